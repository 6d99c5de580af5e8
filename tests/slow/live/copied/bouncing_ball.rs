{
let model = BouncingBall { g: 10.0 };
let start = model.state().x(0.0).y(5.0).x_rate(1.0).y_rate(0.0).release("ground").build()?;
let method = dynamics::methods::DormandPrince5;
let motion = model.simulate(start).contact("ground", 0.5).until(10.0).method(method).tolerance(1e-8).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
