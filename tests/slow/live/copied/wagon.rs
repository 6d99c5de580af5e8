{
let model = Wagon { trolley: 3.0, bead: 0.2, k: 70.0, inertia: 0.1, damping: 0.3, beads: 4 };
let start = model.state().x([0.1, 0.2, 0.3, 0.4]).cart_rate(0.5).build()?;
let method = dynamics::families::methods::Rk4;
let motion = model.simulate(start).until(10.0).method(method).fixed_step(0.01).run()?;
println!("{}", motion.summary());
Ok(motion.end().clone())
}
