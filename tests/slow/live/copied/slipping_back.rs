{
let model = Block { m: 2.0, g: 9.81, slope: 0.2, friction: 0.3 };
let start = model.state().x(0.0).y(0.0).x_rate(-1.0).y_rate(0.0).at_time(123456.0).release_to("stick", -1.0).build()?;
let method = dynamics::methods::DormandPrince5;
let motion = model.simulate(start).stick_slip("stick", "breakaway").until(123457.5).method(method).tolerance(1e-8).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
