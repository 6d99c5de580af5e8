{
let model = Chain { cart: 2.0, mass: [0.5, 0.45, 0.3, 0.2], length: [0.8, 0.7, 0.6, 0.5], g: 9.81 };
let start = model.state().x(0.0).theta([0.4, 0.3, 0.2, 0.1]).x_rate(0.0).theta_rate([0.0, 0.0, 0.0, 0.0]).at_time(0.25).build()?;
let method = dynamics::methods::Rk4;
let motion = model.simulate(start).until(10.25).method(method).fixed_step(0.01).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
