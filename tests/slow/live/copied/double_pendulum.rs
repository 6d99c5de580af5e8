{
let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.6666666666666666, g: 9.81 };
let start = model.state().theta1(0.3333333333333333).theta2(0.0).theta1_rate(0.0).theta2_rate(-0.7).build()?;
let method = dynamics::methods::Dop853;
let motion = model.simulate(start).until(10.0).method(method).tolerance(1e-10).run()?;
println!("{}", motion.summary());
Ok(motion.end())
}
