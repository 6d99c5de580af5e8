//! Flutter of Ziegler's column. A force that follows its end feeds energy into it, and a little damping makes
//! it worse.
//!
//!     undamped P = (7/2 − √2) k/l
//!     with dampers P = 41/28 k/l + ½ c²/(m l³)        (H. Ziegler, Ing.-Arch. 20 (1952) 49)
//!
//! However small the damping, it takes away a third of the load that the column bears without any. No
//! stiffness vanishes, so statics does not show it. Beyond that load the column swings wider and wider, until
//! the angles are large.

mod common;
use dynamics::analysis::{LinearizeError, Page, SpecialKind, continuation, hopf_curve};
use dynamics::output::{Axis, Panel};
use dynamics::prelude::*;

/// Ziegler's column: the force follows the upper link, and so can feed energy into the column. Between 28 and
/// 42 N it is stable without damping and flutters with a little damping. Set the damper to zero, go back to
/// the start, and see.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(lower: rad, upper: rad)]
#[units(mass: kg, length: m, spring: N * m, damper: N * m * s, load: N)]
struct Column {
    mass: f64,
    length: f64,
    spring: f64,
    damper: f64,
    load: f64,
}

#[dynamics]
impl Column {
    fn joint(&self, q: &Coordinates<Self>) -> Vec2 {
        self.length * vec2(-q.lower.sin(), q.lower.cos())
    }
    fn end(&self, q: &Coordinates<Self>) -> Vec2 {
        self.joint(q) + self.length * vec2(-q.upper.sin(), q.upper.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.joint(q).dt().norm_squared() + 0.5 * self.mass * self.end(q).dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * (q.lower.powi(2) + (q.upper - q.lower).powi(2))
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damper * (q.lower.dt().powi(2) + (q.upper - q.lower).dt().powi(2))
    }
    /// Along the upper link, whichever way that points.
    #[force]
    fn follower(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.end(q), self.load * vec2(q.upper.sin(), -q.upper.cos()))
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (joint, end) = (self.joint(q), self.end(q));
        let tail = end + 0.4 * self.length * vec2(-q.upper.sin(), q.upper.cos());
        Drawing::new()
            .line(Vec2::ZERO, joint)
            .line(joint, end)
            .disc(joint, 0.05 * self.length)
            .disc(end, 0.04 * self.length)
            .color(Color::Red)
            .arrow(tail, end)
            .trace("end", end)
    }
}

/// The eigenvalues of the upright column over the load: frequencies, and growth.
fn eigenvalues(with: &dyn Fn(f64) -> Column, upright: &State<Column>) -> Result<[Panel; 2], LinearizeError> {
    let of_loads = |part: fn(&nalgebra::Complex<f64>) -> f64| -> Result<Vec<(f64, f64)>, LinearizeError> {
        let mut all = Vec::new();
        for k in 0..=300 {
            let load = 0.01 * f64::from(k);
            let found = with(load).linearize(upright)?.eigenvalues()?;
            all.extend(found.iter().filter(|x| x.im >= 0.0).map(|x| (load, part(x))));
        }
        Ok(all)
    };
    let panel = |what: &str| Panel::new(Axis::new("load in N"), Axis::new(what));
    Ok([
        panel("frequency in rad/s").points("Im σ", of_loads(|x| x.im)?),
        panel("growth in 1/s").points("Re σ", of_loads(|x| x.re)?),
    ])
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let column = Column { mass: 1.0, length: 1.0, spring: 20.0, damper: 0.4, load: 36.0 };
    let start = |lower: f64, upper: f64| column.state().lower(lower).upper(upper).build();
    Ok(column
        .live(start(0.05, 0.0)?)
        .title("Ziegler's column flutters")
        .first_start("pushed a little")
        .start("pushed more", start(0.3, 0.3)?)
        .range("load", 0.0, 60.0)
        .range("damper", 0.0, 2.0)
        .range("spring", 5.0, 50.0)
        .hold(["mass", "length"])
        .plot(["lower", "upper"])
        .phase("upper")
        .finish()?)
}

fn main() -> common::Outcome {
    let column = Column { mass: 1.0, length: 1.0, spring: 1.0, damper: 0.0, load: 0.0 };
    let with = |load: f64, damper: f64| Column { load, damper, ..column.clone() };
    let upright = column.state().build()?;
    let flutter = |damper: f64| {
        let branch = continuation(|load| with(load, damper))
            .from(&upright, 0.0)
            .until(0.0..=6.0)
            .named("load in N")
            .run()?;
        let kind = |kind| matches!(kind, SpecialKind::Hopf { .. } | SpecialKind::FrequenciesMeet { .. });
        let found = branch.special.iter().find(|one| kind(one.kind)).cloned();
        found.ok_or_else(|| Box::<dyn std::error::Error>::from("it flutters"))
    };
    let undamped = flutter(0.0)?;
    println!("without damping it flutters at {:.12} N", undamped.parameter);
    assert!((undamped.parameter - (3.5 - 2f64.sqrt())).abs() < 1e-10);

    // With damping: the whole curve of Hopf points.
    let first = flutter(0.5)?;
    let curve = |back: bool| {
        let curve = hopf_curve(with, &first, 0.5).until(0.0..=6.0, 1e-4..=2.0);
        if back { curve.backward().run() } else { curve.run() }
    };
    let (less, more) = (curve(true)?, curve(false)?);
    let mut border: Vec<(f64, f64)> =
        less.points.iter().rev().chain(&more.points[1..]).map(|(p, _)| (p[1], p[0])).collect();
    for (damper, load) in &border {
        assert!((load - (41.0 / 28.0 + 0.5 * damper * damper)).abs() < 1e-10, "{load} at {damper}");
    }
    let least = border[0].1;
    println!(
        "with a damper of 1e-4 N m s at {least:.9} N: {:.1} % less",
        100.0 * (1.0 - least / undamped.parameter)
    );

    // What the verdict says at 2 N, and what the column does: a load between the two.
    for damper in [0.0, 0.01] {
        let one = with(2.0, damper);
        println!("at 2 N with {damper} N m s: {}", one.stability(&upright)?.verdict);
        assert!(one.stability(&upright)?.is_unstable() == (damper > 0.0));
    }
    let pushed = with(2.0, 0.1);
    let swinging = pushed.simulate(pushed.state().lower(0.01).build()?).until(160.0).tolerance(1e-9).run()?;
    let largest = |from: f64, to: f64| {
        swinging
            .sample((0..800).map(|k| from + (to - from) * f64::from(k) / 800.0))
            .map(|s| s.upper().abs())
            .fold(0.0, f64::max)
    };
    println!("pushed by 0.01 rad it swings to {:.2} rad within 160 s", largest(0.0, 160.0));
    assert!(largest(120.0, 160.0) > 10.0 * largest(0.0, 20.0), "it swings ever wider");

    let mut files = common::Files::of("ziegler_flutter");
    border.insert(0, (0.0, least));
    let region = Panel::new(Axis::new("damper in N m s"), Axis::new("load in N"))
        .line("flutter begins", border)
        .points("without damping", [(0.0, undamped.parameter)]);
    let parts = |damper: f64| eigenvalues(&|load| with(load, damper), &upright);
    let times = common::times(160.0, 1600);
    let motion = Panel::new(Axis::new("time in s"), Axis::new("angle in rad"))
        .line("upper link", times.clone().map(|t| (t, swinging.at(t).upper())))
        .line("lower link", times.map(|t| (t, swinging.at(t).lower())));
    Page::new("Flutter of Ziegler's column")
        .panels(
            "Where it begins",
            "The load over the damping: however little there is, a third of the load is lost.",
            [region],
        )
        .panels("Without damping", "Two frequencies meet, and one of the pair then grows.", parts(0.0)?)
        .panels(
            "With a damper of 0.1 N m s",
            "One pair leaves the left half plane much earlier.",
            parts(0.1)?,
        )
        .panels("A load of 2 N, a damper of 0.1 N m s", "Pushed by a hundredth of a radian.", [motion])
        .write_html(files.path("flutter.html"))?;
    swinging.animate(files.path("swinging.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
