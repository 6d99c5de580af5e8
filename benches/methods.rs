//! What a user gets who names no method, beside the fastest of five named methods, on models of the tests and
//! on the outer planets.
//!
//! `cargo bench -p dynamics-benches --bench methods` prints, for every model and error, the time of the
//! default method, the fastest named method and the ratio of both. Words after `--` choose models by a part
//! of their name. Times are medians in one run, in turn. Errors are those of the state at the end.

#[path = "../tests/models/andrews.rs"]
#[allow(dead_code, reason = "tests use more of it")]
mod andrews;
#[path = "../tests/models/arenstorf.rs"]
mod arenstorf;
#[path = "../tests/models/arm7.rs"]
#[allow(dead_code, reason = "tests use more of it")]
mod arm7;
#[path = "../tests/models/car_axis.rs"]
mod car_axis;
#[path = "../tests/models/double_pendulum.rs"]
mod double_pendulum;
#[path = "../tests/models/kepler.rs"]
mod kepler;
#[path = "../tests/slow/snapshots/models.rs"]
#[allow(dead_code, unused_imports, reason = "snapshots use more of it")]
mod models;
#[path = "../tests/models/rolling_disk.rs"]
#[allow(dead_code, reason = "tests use more of it")]
mod rolling_disk;
#[path = "../tests/models/top.rs"]
mod top;

use std::time::Duration;

use dynamics::analysis::{Cost, ErrorOf};
use dynamics::prelude::*;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Errors at which costs are compared.
const ERRORS: [f64; 4] = [1e-4, 1e-6, 1e-9, 1e-11];

/// The Sun and its outer planets in the plane of the ecliptic.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [_; 6], y: [_; 6])]
struct OuterPlanets {
    gravitation: f64,
    mass: [f64; 6],
}

#[dynamics]
impl OuterPlanets {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn attraction(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            for j in 0..i {
                sum -= self.gravitation * self.mass[i] * self.mass[j]
                    / (self.place(q, i) - self.place(q, j)).norm();
            }
        }
        sum
    }
}

/// Prints the comparison of one problem, if it was asked for.
fn compare<M: Simulate>(name: &str, model: &M, start: M::State, end: f64) -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if !words.is_empty() && !words.iter().any(|word| name.contains(word.as_str())) {
        return Ok(());
    }
    let named: Vec<methods::Any<M>> = vec![
        methods::Tsit5.into(),
        methods::Dop853.into(),
        methods::Verner9.into(),
        methods::GraggBulirschStoer.into(),
        methods::Taylor::default().into(),
    ];
    let study = model.work_precision(start).until(end).default_method().methods(named);
    let study = study.tolerances((3..=13).map(|k| 10f64.powi(-k))).effort(Duration::from_millis(20)).run()?;
    for error in ERRORS {
        let cost = |name: &str| study.cost(name, ErrorOf::State, error, Cost::Time).map(|s| 1e6 * s);
        // A method that does not reach the error, or cannot run the model, has no time.
        let (default, named) = (cost("default method"), &study.curves()[1..]);
        let times: Vec<(&str, f64)> =
            named.iter().filter_map(|curve| Some((&*curve.name, cost(&curve.name)?))).collect();
        let Some((best, least)) = times.iter().min_by(|(_, a), (_, b)| a.total_cmp(b)) else { continue };
        match default {
            Some(time) => print!("{name:<22} {error:e}  {time:>8.1} µs  {:>5.2} of {best} |", time / least),
            None => print!("{name:<22} {error:e}  the default method does not reach it; {best} |"),
        }
        for (name, time) in &times {
            print!("  {} {time:.1}", name.split([' ', '–']).next().unwrap_or(name));
        }
        println!();
    }
    Ok(())
}

fn main() -> Outcome {
    free()?;
    snapshots()?;
    constrained()
}

fn free() -> Outcome {
    let model = double_pendulum::DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    compare("double pendulum", &model, model.state().theta1(1.5).theta2(1.0).build()?, 10.0)?;
    let model = kepler::Kepler { mu: 1.0 };
    compare("Kepler e = 0.9", &model, model.state().x(0.1).y_rate(19f64.sqrt()).build()?, 20.0)?;
    compare("Kepler e = 0.2", &model, model.state().x(0.8).y_rate(1.5f64.sqrt()).build()?, 20.0)?;
    let model = arenstorf::Arenstorf { mu: 0.012277471 };
    let start = model.state().x(0.994).y_rate(-2.001_585_106_379_082_5).build()?;
    compare("Arenstorf", &model, start, 17.065_216_560_157_96)?;
    let model = OuterPlanets {
        gravitation: 2.959_122_082_855_91e-4,
        mass: [
            1.000_005_976_82,
            9.547_861_040_43e-4,
            2.855_837_331_51e-4,
            4.372_731_645_46e-5,
            5.177_591_384_49e-5,
            7.692_307_7e-9,
        ],
    };
    // Positions and velocities of Hairer, Lubich, Wanner, *Geometric Numerical Integration*, §I.2.3.
    let start = model
        .state()
        .x([0.0, -3.502_365_3, 9.075_531_4, 8.310_142, 11.470_766_6, -15.538_735_7])
        .y([0.0, -3.816_984_7, -3.045_835_3, -16.290_108_6, -25.729_482_9, -25.222_559_4])
        .x_rate([0.0, 0.005_654_29, 0.001_685_18, 0.003_541_78, 0.002_887_77, 0.002_767_25])
        .y_rate([0.0, -0.004_124_9, 0.004_835_25, 0.001_371_02, 0.001_145_27, -0.001_707_02])
        .build()?;
    compare("outer planets", &model, start, 50_000.0)?;
    let model = top::Top { across: 1.0, along: 0.4, weight: 3.0 };
    compare("top", &model, model.state().a(0.3).spin_rate(12.0).build()?, 10.0)?;
    let model = arm7::arm();
    compare("arm of seven", &model, model.state().angles([0.3; 7]).motors([0.0; 7]).build()?, 2.0)
}

fn snapshots() -> Outcome {
    let model = models::Pendulum { m: 1.0, l: 1.0, g: 9.81, c: 0.1 };
    compare("damped pendulum", &model, model.state().theta(2.0).build()?, 10.0)?;
    let model = models::SphericalPendulum { m: 1.0, l: 1.0, g: 9.81 };
    compare("spherical pendulum", &model, model.state().theta(1.0).phi_rate(3.0).build()?, 10.0)?;
    let model = models::Chain { cart: 2.0, mass: [1.0; 4], length: [0.5; 4], g: 9.81 };
    compare("chain of four", &model, model.state().theta([1.0, 0.5, 0.2, 0.1]).build()?, 5.0)?;
    let model = models::DrivenPivot { m: 1.0, l: 1.0, g: 9.81, amplitude: 0.1, omega: 20.0 };
    compare("driven pivot", &model, model.state().theta(0.5).build()?, 10.0)?;
    let model = models::CartPole { cart: 2.0, bob: 1.0, l: 0.5, g: 9.81 };
    compare("cart and pole", &model, model.state().theta(2.0).push(0.0).build()?, 10.0)?;
    let model = models::Tube { m: 1.0, hub: 0.5 };
    compare("rotating tube", &model, model.state().r(0.5).phi_rate(2.0).build()?, 3.0)
}

fn constrained() -> Outcome {
    let model = andrews::PUBLISHED;
    let [beta, theta, gamma, phi, delta, omega, epsilon] = andrews::START;
    let start = model.state().beta(beta).theta(theta).gamma(gamma).phi(phi);
    let start = start.delta(delta).omega(omega).epsilon(epsilon).build()?;
    compare("Andrews", &model, start, 0.03)?;
    let model = car_axis::model();
    compare("car axis", &model, car_axis::start(&model), 3.0)?;
    let model = models::CartesianPendulum { m: 1.0, l: 1.0, g: 9.81 };
    compare("Cartesian pendulum", &model, model.state().x(1.0).build()?, 10.0)?;
    let model = models::SliderCrank { m: [1.0, 0.5, 2.0], r: 0.1, l: 0.3, g: 9.81 };
    let start = model.state().crank(0.5).crank_rate(20.0).slide_guess(0.4).assemble()?;
    compare("slider-crank", &model, start, 2.0)?;
    let model = models::Sleigh { m: 1.0, inertia: 0.3, ahead: 0.4 };
    compare("sleigh", &model, model.state().x_rate(1.0).heading_rate(2.0).assemble()?, 5.0)?;
    let model = rolling_disk::Disk { m: 1.0, r: 0.5, g: 9.81 };
    compare("rolling disk", &model, model.state().lean(0.3).spin_rate(8.0).assemble()?, 5.0)
}
