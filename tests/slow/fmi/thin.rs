use dynamics::prelude::*;
use std::path::Path;

use crate::double_pendulum::DoublePendulum;
use crate::models::*;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmi")
}

#[test]
fn write_all() {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = model.state().theta1(2.0).theta2_rate(0.5).build().unwrap();
    model.fmu(start).write(folder().join("double_pendulum.fmu")).unwrap();
    let model = Masses { mass: [1.0, 2.0], stiffness: [10.0, 20.0, 30.0], damping: 0.3 };
    let start = model.state().x([0.1, -0.2]).build().unwrap();
    model.fmu(start).write(folder().join("masses.fmu")).unwrap();
    let model = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let start = model.state().theta(0.3).push(0.5).build().unwrap();
    model.fmu(start).write(folder().join("cart_pole.fmu")).unwrap();
    let model = SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81, brake: 0.1 };
    let start = model
        .state()
        .crank(0.4)
        .rod((0.5 * 0.4f64.sin() / 1.5).asin())
        .slide(0.5 * 0.4f64.cos() + 1.5 * (0.5 * 0.4f64.sin() / 1.5).asin().cos())
        .build()
        .unwrap();
    model.fmu(start).write(folder().join("slider_crank.fmu")).unwrap();
    let wind = CubicSpline::natural(&[-1.0, 0.0, 1.0, 2.0, 3.0], &[0.0, 0.1, 0.5, -0.4, 0.0]).unwrap();
    let model = Ball { mass: 0.5, g: 9.81, floor: 2e3, line: 0.2, wind };
    let start = model.state().y(1.5).build().unwrap();
    model.fmu(start).method(methods::Dop853).write(folder().join("ball.fmu")).unwrap();
    let model = Chain { cart: 2.0, mass: 0.3, length: 0.25, g: 9.81 };
    let start = model.state().theta([0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1, -0.2]).build().unwrap();
    model.fmu(start).write(folder().join("chain.fmu")).unwrap();
}
