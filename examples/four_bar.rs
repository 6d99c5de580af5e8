//! A four-bar linkage with the path of a point of its coupler, and the positions in which such linkages stop.
//!
//!     crank + coupler − rocker − ground = 0        crank − Ω t = 0
//!
//! Hoecken's proportions 1 : 2 : 2.5 : 2.5 move a point of the coupler along a straight line for half of the
//! turn. A linkage whose shortest link is too long (Grashof) locks up. One with equal opposite links has a
//! change point, where two assemblies meet. Both positions are found and named.

mod common;
use std::f64::consts::{PI, TAU};

use dynamics::kinematics::KinematicsErrorKind;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Hoecken's four-bar linkage: a point of its coupler runs along a straight line for half of the turn.
/// Shorten the rocker c to 0.12 m and go back to the start: the shortest and the longest link are now longer
/// than the other two (Grashof), and the motion stops in a singular position.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, coupler: rad, rocker: rad)]
#[units(ground: m, a: m, b: m, c: m, beyond: m, inertia: kg * m^2, omega: rad / s)]
#[nominal(ground = 0.2, a = 0.1, b = 0.25, c = 0.25, beyond = 0.25, inertia = 1e-3, omega = 6.0)]
struct FourBar {
    ground: f64,
    /// Lengths of crank, coupler and rocker.
    a: f64,
    b: f64,
    c: f64,
    /// The coupler's point lies so far beyond its joint with the rocker, in line.
    beyond: f64,
    /// Of each link.
    inertia: f64,
    omega: f64,
}

#[dynamics]
impl FourBar {
    fn direction(&self, angle: Expr) -> Vec2 {
        vec2(angle.cos(), angle.sin())
    }
    fn first(&self, q: &Coordinates<Self>) -> Vec2 {
        self.a * self.direction(q.crank)
    }
    fn second(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.ground, 0.0) + self.c * self.direction(q.rocker)
    }
    fn point(&self, q: &Coordinates<Self>) -> Vec2 {
        self.first(q) + (self.b + self.beyond) * self.direction(q.coupler)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.crank.dt().powi(2) + q.coupler.dt().powi(2) + q.rocker.dt().powi(2))
    }
    #[holonomic]
    fn joint(&self, q: &Coordinates<Self>) -> Vec2 {
        self.first(q) + self.b * self.direction(q.coupler) - self.second(q)
    }
    #[holonomic]
    fn drive(&self, q: &Coordinates<Self>) -> Expr {
        q.crank - self.omega * q.t
    }
    #[output]
    fn path(&self, q: &Coordinates<Self>) -> Vec2 {
        self.point(q)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        Drawing::new()
            .pivot(Vec2::ZERO)
            .pivot(vec2(self.ground, 0.0))
            .line(Vec2::ZERO, self.first(q))
            .line(self.first(q), self.point(q))
            .line(vec2(self.ground, 0.0), self.second(q))
            .color(Color::Red)
            .trace("coupler's point", self.point(q))
    }
}

impl FourBar {
    fn new([ground, a, b, c]: [f64; 4]) -> Self {
        Self { ground, a, b, c, beyond: b, inertia: 1e-3, omega: 6.0 }
    }
    /// The rocker by Freudenstein's equation, above or below the ground.
    fn rocker(&self, crank: f64, branch: f64) -> f64 {
        let (x, y) = (self.a * crank.cos() - self.ground, self.a * crank.sin());
        let k = (x * x + y * y + self.c.powi(2) - self.b.powi(2)) / (2.0 * self.c);
        y.atan2(x) + branch * (k / x.hypot(y)).acos()
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let bar = FourBar::new([0.2, 0.1, 0.25, 0.25]);
    // It begins stretched out, a position that a shorter rocker has, too.
    let start = bar.state().at_time(PI / bar.omega).crank_guess(PI).coupler_guess(0.93).rocker_guess(2.21);
    Ok(bar
        .live(start.assemble()?)
        .title("Four-bar with a straight line and a singular position")
        .range("ground", 0.05, 0.4)
        .range("a", 0.05, 0.3)
        .range("b", 0.1, 0.4)
        .range("c", 0.1, 0.4)
        .range("beyond", 0.0, 0.5)
        .range("omega", 0.5, 12.0)
        .hold(["inertia"])
        .plot(["path.x", "path.y", "rocker"])
        .phase("rocker")
        .finish()?)
}

fn main() -> common::Outcome {
    let bar = FourBar::new([0.2, 0.1, 0.25, 0.25]);
    let turn = TAU / bar.omega;
    // The guess says that the linkage is up: at t = 0 the crank points to the rocker's pivot.
    let start = bar.state().coupler_guess(1.4).rocker_guess(1.8).assemble()?;
    let motion = bar.kinematics(start).until(100.0 * turn).every(turn / 90.0).run()?;
    println!("{}\n", motion.summary());
    let off = |s: &State<FourBar>| {
        let off = s.rocker() - bar.rocker(s.crank(), -1.0);
        off.sin().atan2(off.cos()).abs()
    };
    let worst = motion.states().map(|s| off(&s)).fold(0.0, f64::max);
    println!("100 turns: rocker against Freudenstein's equation {worst:.1e} rad");
    assert!(worst < 1e-12);

    // Hoecken: while the crank turns through half of its turn the point stays on a line to a hundredth of the
    // way.
    let at = |t: f64| -> [f64; 2] { std::array::from_fn(|i| motion.outputs_at(t)[i]) };
    let path: Vec<[f64; 2]> = (0..=360).map(|k| at(turn * f64::from(k) / 360.0)).collect();
    let half = &path[90..=270];
    let range = |axis: usize| {
        let values = half.iter().map(|p| p[axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    println!("half a turn along a line: {:.4} m long, {:.2e} m off", range(0), range(1));
    assert!(range(1) < 0.01 * range(0));

    println!("\nlinks that do not fit:");
    let stuck = FourBar::new([0.3, 0.2, 0.15, 0.15]);
    let start = stuck.state().coupler_guess(0.9).rocker_guess(2.2).assemble()?;
    let Err(stop) = stuck.kinematics(start).until(1.0).run() else {
        return Err("it turned all the way".into());
    };
    println!("  {} at {:.6}°", stop.kind, stop.state.crank() * 180.0 / PI);
    assert!(matches!(stop.kind, KinematicsErrorKind::LockUp { .. }));
    // Coupler and rocker in line: a triangle of sides 0.3, 0.2, 0.3.
    assert!((stop.state.crank() - (1.0f64 / 3.0).acos()).abs() < 1e-11);

    let parallel = FourBar::new([0.3, 0.1, 0.3, 0.1]);
    let start = parallel.state().at_time(0.1).coupler(0.0).rocker_guess(0.6).assemble()?;
    let Err(stop) = parallel.kinematics(start).until(1.0).run() else {
        return Err("it did not notice".into());
    };
    println!("  {} at {:.6}°", stop.kind, stop.state.crank() * 180.0 / PI);
    assert!(
        matches!(stop.kind, KinematicsErrorKind::Bifurcation { .. })
            && (stop.state.crank() - PI).abs() < 1e-10
    );
    let on = parallel.kinematics(start).until(3.0).through_bifurcations().run()?;
    println!("{}", on.summary());
    assert!((on.end().rocker() - on.end().crank()).abs() < 1e-9, "a parallelogram stays one");

    let mut files = common::Files::of("four_bar");
    let point = path.iter().map(|p| (p[0], p[1]));
    let sample: Vec<State<FourBar>> = motion.sample(common::times(turn, 360)).collect();
    let degrees = |s: &State<FourBar>| s.crank() * 180.0 / PI;
    Chart::new("Hoecken's straight line")
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("y in m"))
                .line("point of the coupler", point)
                .equal_axes(),
        )
        .panel(
            Panel::new(Axis::new("crank in degrees"), Axis::new("velocity ratio"))
                .line("rocker", sample.iter().map(|s| (degrees(s), s.rocker_rate() / s.crank_rate()))),
        )
        .write_svg(files.path("coupler_curve.svg"))?;
    let two = bar.kinematics(motion.start()).until(2.0 * turn).run()?;
    let film = two.animation().title("Hoecken's straight line").plot(["coupler", "rocker"]);
    film.speed(0.25).write_html(files.path("four_bar.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
