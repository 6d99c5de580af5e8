{
let model = RigidBody { inertia: [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.5]].into() };
let start = model.state().yaw(0.0).tilt(1.0).spin(0.0).yaw_rate(2.0).tilt_rate(0.0).spin_rate(1.0).build()?;
let method = dynamics::methods::DormandPrince5;
let motion = model.simulate(start).until(10.0).method(method).tolerance(1e-8).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
