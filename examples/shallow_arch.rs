//! A shallow arch of two bars with a load at its apex: its equilibria through both limit points, and the jump
//! when the load exceeds the first.
//!
//!     V = k (ℓ − ℓ₀)² − P (h − z),   ℓ² = b² + z²
//!     P(z) = 2 k z (ℓ₀/ℓ − 1),        limit load where ℓ³ = ℓ₀ b²
//!
//! (R. von Mises, ZAMM 3 (1923) 406; Z. P. Bažant & L. Cedolin, *Stability of Structures*, §4.4). Weights
//! that are added one by one end at the limit load. Statics has no answer beyond it, and says so. Dynamics
//! has one: the arch snaps through to the equilibrium on the other side.

mod common;
use dynamics::analysis::{ContinuationError, Diagram, Page, continuation};
use dynamics::output::{Axis, Panel};
use dynamics::prelude::*;

/// A shallow arch of two bars with a load at its apex. Raise the load slowly past its limit of 15 N: the
/// arch snaps through, and no equilibrium is near. Then lower the load to −15 N and more, and it comes
/// back.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(z: m)]
#[units(mass: kg, half_span: m, rise: m, stiffness: N / m, damper: N * s / m, load: N)]
struct Arch {
    mass: f64,
    half_span: f64,
    rise: f64,
    /// Of each bar.
    stiffness: f64,
    damper: f64,
    load: f64,
}

#[dynamics]
impl Arch {
    fn free(&self) -> f64 {
        (self.half_span.powi(2) + self.rise.powi(2)).sqrt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (apex, b) = (vec2(0.0, q.z), self.half_span);
        Drawing::new()
            .ground(vec2(-b - 0.1, 0.0), vec2(-b + 0.1, 0.0))
            .ground(vec2(b - 0.1, 0.0), vec2(b + 0.1, 0.0))
            .polyline([vec2(-b, 0.0), apex, vec2(b, 0.0)])
            .dot(apex)
            .arrow(apex + vec2(0.0, 0.25), apex + vec2(0.0, 0.04))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.z.dt().powi(2)
    }
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        self.stiffness * (vec2(self.half_span, q.z).norm() - self.free()).powi(2)
    }
    #[dissipation]
    fn damping(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damper * q.z.dt().powi(2)
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, -self.load)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let arch = Arch { mass: 20.0, half_span: 1.0, rise: 0.2, stiffness: 5e3, damper: 20.0, load: 8.0 };
    let start = |z: f64| arch.state().z(z).build();
    Ok(arch
        .live(start(0.2)?)
        .title("Shallow arch")
        .first_start("the load comes at once")
        .start("a push away from the limit", arch.state().z(0.17).z_rate(-0.6).build()?)
        .start("hanging", start(-0.2)?)
        .range("load", -40.0, 40.0)
        .range("damper", 0.0, 100.0)
        .range("rise", 0.05, 0.5)
        .range("stiffness", 1e3, 2e4)
        .hold(["mass", "half_span"])
        .plot(["z"])
        .finish()?)
}

fn main() -> common::Outcome {
    let arch = Arch { mass: 2.0, half_span: 1.0, rise: 0.2, stiffness: 5e4, damper: 40.0, load: 0.0 };
    let loaded = |load: f64| Arch { load, ..arch.clone() };
    let start = arch.state().z(arch.rise).build()?;

    // Statics: the complete curve, without help.
    let statics = continuation(loaded).from(&start, 0.0).until(-600.0..=600.0).named("load in N");
    let curve = statics.clone().run()?;
    println!("{curve}\n");
    let length = (arch.free() * arch.half_span.powi(2)).cbrt();
    let z = (length.powi(2) - arch.half_span.powi(2)).sqrt();
    let limit = 2.0 * arch.stiffness * z * (arch.free() / length - 1.0);
    for (fold, sign) in curve.folds().zip([1.0, -1.0]) {
        assert!((fold.parameter - sign * limit).abs() < 1e-9 && (fold.state.z() - sign * z).abs() < 1e-12);
    }
    assert_eq!(curve.folds().count(), 2);

    // The same with weights: it fails, and says where.
    let error = statics.load_controlled().run().expect_err("no weights carry it through");
    println!("with weights: {error}\n");
    let ContinuationError::LimitLoad { limit: found, at, .. } = error else { return Err(error.into()) };
    assert!((found / limit - 1.0).abs() < 1e-12);

    // Dynamics: a thousandth more than it carries, from the limit point.
    let above = loaded(1.001 * limit);
    let snap = above.simulate(above.state().z(at.z()).build()?).until(3.0).tolerance(1e-9).run()?;
    let rest = above.equilibrium(&snap.end())?.state.z();
    println!("it snaps from z = {:.4} m to {:.4} m, and comes to rest at {rest:.4} m", at.z(), lowest(&snap));
    assert!((snap.end().z() - rest).abs() < 1e-4 && rest < -arch.rise && lowest(&snap) < rest);

    let mut files = common::Files::of("shallow_arch");
    let jump = common::times(3.0, 600).map(|t| snap.at(t).z());
    let diagram = Diagram::from(curve);
    let statics = diagram.panel("height of the apex in m", |state| state.z());
    let statics = statics.line("jump", jump.map(|z| (above.load, z)));
    let motion = Panel::new(Axis::new("time in s"), Axis::new("height of the apex in m"));
    let motion = motion
        .line("a thousandth above the limit load", common::times(3.0, 600).map(|t| (t, snap.at(t).z())));
    let motion = motion.line("equilibrium", [(0.0, rest), (3.0, rest)]);
    Page::new("A shallow arch snaps through")
        .diagram("Equilibria", &diagram, [statics])
        .panels("The jump", "From rest in the limit point, with the load a thousandth above it.", [motion])
        .write_html(files.path("shallow_arch.html"))?;
    snap.animation().plot(["z"]).speed(0.25).write_html(files.path("snap.html"))?;
    diagram.write_csv(files.path("equilibria.csv"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}

/// The lowest place of the apex.
fn lowest(snap: &Motion<'_, Arch>) -> f64 {
    common::times(3.0, 3000).map(|t| snap.at(t).z()).fold(f64::INFINITY, f64::min)
}
