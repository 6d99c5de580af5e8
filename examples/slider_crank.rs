//! A driven slider-crank. Its crank turns steadily, so everything follows from the constraints.
//!
//!     crank pin + rod − slider pin = 0        θ − Ω t = 0        M q̈ = Q + Φ_qᵀ λ
//!
//! Three coordinates, three constraints: positions, velocities and accelerations are solved, not integrated.
//! The multiplier of the drive is the torque on the crank. The multipliers of the closure are the force of
//! the rod on the slider. The same mechanism driven from the slider locks up at its dead point, which is
//! located.

mod common;
use std::f64::consts::{PI, TAU};

use dynamics::kinematics::KinematicsErrorKind;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A slider-crank whose crank turns steadily; the arrow is the force of the rod on the slider. Nothing is
/// integrated here: three coordinates follow from three constraints. Shorten the rod toward the length of the
/// crank, and see how the slider jerks.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[units(crank: m, rod: m, inertia: kg * m^2, rod_mass: kg, slider: kg, omega: rad / s)]
#[nominal(crank = 0.1, rod = 0.3, inertia = 2e-3, rod_mass = 0.8, slider = 1.2, omega = 30.0)]
struct SliderCrank {
    crank: f64,
    rod: f64,
    inertia: f64,
    rod_mass: f64,
    slider: f64,
    omega: f64,
}

#[dynamics]
impl SliderCrank {
    fn crank_pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.crank * vec2(q.theta.cos(), q.theta.sin())
    }
    fn along_rod(&self, q: &Coordinates<Self>, part: f64) -> Vec2 {
        self.crank_pin(q) + part * self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.theta.dt().powi(2)
            + 0.5 * self.rod_mass * self.along_rod(q, 0.5).dt().norm_squared()
            + self.rod_mass * self.rod.powi(2) / 24.0 * q.phi.dt().powi(2)
            + 0.5 * self.slider * q.x.dt().powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0) - self.along_rod(q, 1.0)
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.theta - self.omega * q.t
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (pin, slider) = (self.crank_pin(q), vec2(q.x, 0.0));
        let inertial = self.slider * self.crank * self.omega.powi(2);
        Drawing::new()
            .color(Color::Faint)
            .line([0.15, -0.03], [0.45, -0.03])
            .plain()
            .line([0.0, 0.0], pin)
            .line(pin, slider)
            .disc(pin, 0.006)
            .pivot([0.0, 0.0])
            .fill(Color::Blue)
            .rectangle(slider, 0.06, 0.06, 0.0)
            .color(Color::Red)
            .arrow(slider, slider + 0.13 / inertial * q.reaction(Self::closure))
    }
}

/// The same crank, pulled at its slider: x = x₀ + v t.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[units(crank: m, rod: m, inertia: kg * m^2, slider: kg, speed: m / s, from: m)]
#[nominal(crank = 0.1, rod = 0.3, inertia = 2e-3, slider = 1.2, speed = 0.5, from = 0.25)]
struct Pulled {
    crank: f64,
    rod: f64,
    inertia: f64,
    slider: f64,
    speed: f64,
    from: f64,
}

#[dynamics]
impl Pulled {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.theta.dt().powi(2) + q.phi.dt().powi(2))
            + 0.5 * self.slider * q.x.dt().powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let pin = self.crank * vec2(q.theta.cos(), q.theta.sin());
        vec2(q.x, 0.0) - pin - self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.from - self.speed * q.t
    }
}

/// x, ẋ, ẍ of the slider in closed form.
fn slider(model: &SliderCrank, t: f64) -> [f64; 3] {
    let (r, l, w) = (model.crank, model.rod, model.omega);
    let (s, c) = (w * t).sin_cos();
    let root = (l * l - r * r * s * s).sqrt();
    let v = -r * w * s - r * r * w * s * c / root;
    let a = -r * w * w * c - r * r * w * w * ((c * c - s * s) / root + r * r * s * s * c * c / root.powi(3));
    [r * c + root, v, a]
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = SliderCrank { crank: 0.1, rod: 0.3, inertia: 2e-3, rod_mass: 0.8, slider: 1.2, omega: 5.0 };
    let start = model.state().x_guess(0.4).assemble()?;
    Ok(model
        .live(start)
        .title("Slider-crank")
        .range("crank", 0.02, 0.15)
        .range("rod", 0.15, 0.6)
        .range("slider", 0.2, 5.0)
        .range("rod_mass", 0.1, 5.0)
        .range("omega", 1.0, 12.0)
        .hold(["inertia"])
        .plot(["x", "x_rate", "energy"])
        .phase("x")
        .finish()?)
}

fn main() -> common::Outcome {
    let model = SliderCrank { crank: 0.1, rod: 0.3, inertia: 2e-3, rod_mass: 0.8, slider: 1.2, omega: 30.0 };
    let turn = TAU / model.omega;
    let guess = model.state().x_guess(0.4).assemble()?;
    let motion = model.kinematics(guess).until(2.0 * turn).every(turn / 180.0).run()?;
    println!("{}\n", motion.summary());

    let mut farthest = [0.0f64; 3];
    let mut work = 0.0;
    for now in motion.states() {
        let exact = slider(&model, now.t);
        let found = [now.x(), now.x_rate(), motion.accelerations_of(&now)[2]];
        for (far, (found, exact)) in farthest.iter_mut().zip(found.iter().zip(exact)) {
            *far = far.max((found - exact).abs());
        }
        // Steady turning: the torque of the drive gives the kinetic energy its changes, and over a turn
        // nothing.
        work += motion.reaction_of("drive", &now)?[0] * model.omega * turn / 180.0;
    }
    println!(
        "against the closed form: x to {:.1e}, its velocity to {:.1e}, acceleration to {:.1e}",
        farthest[0], farthest[1], farthest[2]
    );
    assert!(farthest[0] < 1e-14 && farthest[1] < 1e-12 && farthest[2] < 1e-10);
    assert!(work.abs() < 1e-9, "work over whole turns: {work}");
    assert!(motion.work().closure_error.abs() < 1e-10);

    let pulled = Pulled { crank: 0.1, rod: 0.3, inertia: 2e-3, slider: 1.2, speed: 0.5, from: 0.25 };
    let guess = pulled.state().theta_guess(1.5).x_guess(0.25).assemble()?;
    let Err(stop) = pulled.kinematics(guess).until(1.0).run() else {
        return Err("went through its dead point".into());
    };
    println!("\npulled at the slider: {}", stop.kind);
    // In line at x = crank + rod.
    assert!(matches!(stop.kind, KinematicsErrorKind::LockUp { .. }));
    assert!((stop.time - (0.4 - 0.25) / 0.5).abs() < 1e-12 && stop.state.theta().abs() < 1e-7);

    let mut files = common::Files::of("slider_crank");
    let curve = |name: &str, value: &dyn Fn(&State<SliderCrank>) -> f64| {
        let points: Vec<(f64, f64)> =
            motion.states().map(|now| (now.theta() / PI * 180.0, value(&now))).collect();
        (name.to_string(), points)
    };
    let torque = curve("torque of the drive", &|now| motion.multipliers_of(now)[2]);
    let along = curve("along the guide", &|now| motion.multipliers_of(now)[0]);
    let across = curve("on the guide", &|now| motion.multipliers_of(now)[1]);
    let angle = || Axis::new("crank angle in degrees");
    Chart::new("What it takes to turn a slider-crank steadily")
        .panel(Panel::new(angle(), Axis::new("torque in N·m")).line(&torque.0, torque.1))
        .panel(
            Panel::new(angle(), Axis::new("force of the rod in N"))
                .line(&along.0, along.1)
                .line(&across.0, across.1),
        )
        .write_svg(files.path("torque.svg"))?;
    let film = motion.animation().title("A driven slider-crank").plot(["phi"]);
    film.speed(0.05).write_html(files.path("slider_crank.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
