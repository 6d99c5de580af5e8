{
let model = Reserved { method: 1.0, accuracy: 0.5, only: 2.0, r#type: 3.0 };
let start = model.state().x(1.0).x_rate(0.0).build()?;
let method = dynamics::methods::DormandPrince5;
let motion = model.simulate(start).until(10.0).method(method).tolerance(1e-8).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
