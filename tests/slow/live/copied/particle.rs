{
let model = Particle { mass: 1.7, charge: 0.8, magnetic: [0.1, 0.7, -0.4].into(), electric: [0.3, 0.0, 0.2].into() };
let start = model.state().x(0.0).y(0.0).z(0.0).x_rate(1.0).y_rate(0.0).z_rate(0.0).build()?;
let method = dynamics::methods::DormandPrince5;
let motion = model.simulate(start).until(10.0).method(method).tolerance(1e-8).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
