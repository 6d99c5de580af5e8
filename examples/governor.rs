//! Porter's governor holds the speed of an engine. Balls on arms fly out as the shaft turns, lift a heavy
//! sleeve and close the valve.
//!
//!     ball: l sin θ from the shaft, l cos θ below the top
//!     links of length l from the balls to the sleeve:  |ball − sleeve|² − l² = 0
//!
//! At a steady speed ω² = (m + M) g / (m l cos θ) (Porter 1858; Watt's for M = 0), and each link carries
//! the weight M g/(2 cos θ). The governor is proportional: a heavier load runs at a lower speed. With too
//! little damping it hunts, as Vyshnegradsky found (1877).

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Porter's governor of an engine. Its balls fly out as the shaft turns faster, raise the sleeve, and the
/// sleeve closes the valve. Change the load, and it finds a new speed; take the damper of the sleeve away,
/// and it hunts.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(psi: rad, theta: rad, height: m)]
#[inputs(load: N * m)]
#[units(
    ball: kg, sleeve: kg, arm: m, flywheel: kg * m^2, g: m / s^2, dashpot: N * s / m, valve: N, closed: m
)]
struct Governor {
    ball: f64,
    sleeve: f64,
    arm: f64,
    flywheel: f64,
    g: f64,
    dashpot: f64,
    /// Torque of the engine per metre of the sleeve below `closed`.
    valve: f64,
    /// Height of the sleeve at which the valve is shut.
    closed: f64,
}

#[dynamics]
impl Governor {
    /// Distance from the shaft, and height over the top of the shaft.
    fn ball(&self, q: &Coordinates<Self>) -> Vec2 {
        self.arm * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let ball = self.ball(q);
        let balls = self.ball * (ball.dt().norm_squared() + (ball.x * q.psi.dt()).powi(2));
        balls + 0.5 * self.sleeve * q.height.dt().powi(2) + 0.5 * self.flywheel * q.psi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (2.0 * self.ball * self.ball(q).y + self.sleeve * q.height)
    }
    #[dissipation]
    fn dashpot(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.dashpot * q.height.dt().powi(2)
    }
    #[force]
    fn engine(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.psi, self.valve * (self.closed - q.height))
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.psi, -q.load)
    }
    /// Both links at once: λ is the pull of two.
    #[holonomic]
    fn links(&self, q: &Coordinates<Self>) -> Expr {
        (self.ball(q) - vec2(0.0, q.height)).norm() - self.arm
    }
    /// Tension of one link.
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -0.5 * q.reaction(Self::links)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let ball = self.ball(q);
        let turn = |side: f64| vec2(side * ball.x * q.psi.cos(), ball.y);
        let sleeve = vec2(Expr::ZERO, q.height);
        let mut drawing = Drawing::new().ground([-0.2, -0.62], [0.2, -0.62]).line([0.0, -0.62], [0.0, 0.05]);
        for side in [-1.0, 1.0] {
            drawing = drawing.polyline([Vec2::ZERO, turn(side), sleeve]).disc(turn(side), 0.035);
        }
        drawing.fill(Color::Blue).rectangle(sleeve, 0.12, 0.06, 0.0)
    }
}

/// What holds steadily under a load: angle, height of the sleeve, speed.
fn steady(governor: &Governor, load: f64) -> (f64, f64, f64) {
    let height = governor.closed - load / governor.valve;
    let cosine = -height / (2.0 * governor.arm);
    let square = (governor.ball + governor.sleeve) * governor.g / (governor.ball * governor.arm * cosine);
    (cosine.acos(), height, square.sqrt())
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let governor = Governor {
        ball: 1.0,
        sleeve: 8.0,
        arm: 0.3,
        flywheel: 5.0,
        g: 9.81,
        dashpot: 12.0,
        valve: 91.0,
        closed: -0.35,
    };
    let (theta, height, speed) = steady(&governor, 10.0);
    let start = |load: f64| governor.state().theta(theta).height(height).psi_rate(speed).load(load).build();
    Ok(governor
        .live(start(6.0)?)
        .title("Governor of an engine")
        .first_start("the load drops to 6 N m")
        .start("the load of 10 N m stays", start(10.0)?)
        .start("the load rises to 12 N m", start(12.0)?)
        .range("load", 0.0, 15.0)
        .range("dashpot", 0.0, 100.0)
        .range("sleeve", 2.0, 20.0)
        .range("flywheel", 1.0, 20.0)
        .hold(["ball", "arm", "g", "valve", "closed"])
        .plot(["psi_rate", "height", "tension"])
        .phase("height")
        .until(120.0)
        .finish()?)
}

fn main() -> common::Outcome {
    let damped = Governor {
        ball: 1.0,
        sleeve: 8.0,
        arm: 0.3,
        flywheel: 5.0,
        g: 9.81,
        dashpot: 30.0,
        valve: 91.0,
        closed: -0.35,
    };
    let hunting = Governor { dashpot: 3.0, ..damped.clone() };
    // It carries 10 N m, and at t = 0 the load drops to 6 N m.
    let (theta, height, speed) = steady(&damped, 10.0);
    let start =
        |governor: &Governor| governor.state().theta(theta).height(height).psi_rate(speed).load(6.0).build();
    let settles = damped.simulate(start(&damped)?).until(40.0).tolerance(1e-9).run()?;
    let hunts = hunting.simulate(start(&hunting)?).until(12.0).tolerance(1e-9).run()?;
    println!("{}", settles.summary());

    let (angle, height, final_speed) = steady(&damped, 6.0);
    let end = settles.end();
    let tension = settles.output("tension", 40.0)?;
    let weight = damped.sleeve * damped.g / (2.0 * angle.cos());
    println!(
        "speed {speed:.3} rad/s before, {:.3} rad/s after; ω² = (m + M) g/(m l cos θ) gives {final_speed:.3}",
        end.psi_rate()
    );
    println!("tension of a link {tension:.3} N; M g/(2 cos θ) gives {weight:.3}");
    assert!((end.psi_rate() / final_speed - 1.0).abs() < 1e-5);
    assert!((end.theta() / angle - 1.0).abs() < 1e-4);
    assert!((end.height() / height - 1.0).abs() < 1e-4);
    assert!((tension / weight - 1.0).abs() < 1e-3);
    assert!(settles.summary().constraints.iter().all(|c| c.residual < 1e-12));

    let swing = |motion: &Motion<'_, Governor>, from: f64, to: f64| {
        let heights =
            motion.sample(common::times(1.0, 400).map(|part| from + part * (to - from))).map(|s| s.height());
        let (least, most) = heights.fold((f64::MAX, f64::MIN), |(l, m), h| (l.min(h), m.max(h)));
        most - least
    };
    let (early, late) = (swing(&hunts, 0.0, 3.0), swing(&hunts, 9.0, 12.0));
    println!(
        "with a tenth of the damping the sleeve moves by {:.1} cm at first, by {:.1} cm later: it hunts",
        100.0 * early,
        100.0 * late
    );
    assert!(late > early);
    assert!(swing(&settles, 30.0, 40.0) < 1e-4);

    let mut files = common::Files::of("governor");
    let of = |motion: &Motion<'_, Governor>, value: fn(&State<Governor>) -> f64| -> Vec<(f64, f64)> {
        motion.sample(common::times(12.0, 1200)).map(|s| (s.t, value(&s))).collect()
    };
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    let both = |title, value: fn(&State<Governor>) -> f64| {
        panel(title).line("dashpot 30 N·s/m", of(&settles, value)).line("dashpot 3 N·s/m", of(&hunts, value))
    };
    Chart::new("Porter's governor after the load has dropped")
        .panel(both("speed in rad/s", |s| s.psi_rate()))
        .panel(both("sleeve in m", |s| s.height()))
        .panel(panel("tension in N").line(
            "one link",
            settles.sample(common::times(12.0, 1200)).map(|s| (s.t, settles.outputs_of(&s)[0])),
        ))
        .write_svg(files.path("governor.svg"))?;
    let short = damped.simulate(start(&damped)?).until(8.0).tolerance(1e-9).run()?;
    short.animation().plot(["height"]).speed(0.25).write_html(files.path("governor.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
