{
let model = Bead { m: 0.3, g: 3.7, ..model };
let start = model.state().x(-2.0).x_rate(0.0).build()?;
let method = dynamics::methods::DormandPrince5;
let motion = model.simulate(start).until(10.0).method(method).tolerance(1e-8).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
