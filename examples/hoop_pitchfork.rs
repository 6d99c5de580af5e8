//! A bead on a hoop that turns about a diameter, and about a line beside it: a pitchfork, its unfolding, and
//! its origin.
//!
//!     T = ½ m (R² θ̇² + (e + R sin θ)² ω²),  V = −m g R cos θ
//!     equilibrium:  m R (e + R sin θ) cos θ ω² = m g R sin θ
//!
//! On the diameter, e = 0, the bottom loses its stability at ω² = g/R to two positions aside, cos θ = g/(R
//! ω²). With the slightest offset no branches meet: one turns smoothly into the position aside, and the
//! others appear together in a fold. The folds of all offsets lie on a curve with a cusp in the pitchfork (S.
//! H. Strogatz, *Nonlinear Dynamics and Chaos*, §3.5 and §3.6).

mod common;
use dynamics::analysis::SpecialKind;
use dynamics::analysis::{Page, continuation, fold_curve};
use dynamics::model::Model;
use dynamics::output::{Animation, Axis, Panel};
use dynamics::prelude::*;

/// A bead on a hoop that turns about its diameter. Below ω² = g/R the bottom is stable, above it two
/// positions aside are, at cos θ = g/(R ω²). Change the speed through 4.43 rad/s; with an offset one side
/// is preferred.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(mass: kg, radius: m, offset: m, speed: rad / s, g: m / s^2)]
struct Hoop {
    mass: f64,
    radius: f64,
    offset: f64,
    speed: f64,
    g: f64,
}

#[dynamics]
impl Hoop {
    fn bead(&self, q: &Coordinates<Self>) -> Vec3 {
        let turned = self.speed * q.t;
        let out = self.offset + self.radius * q.theta.sin();
        vec3(out * turned.cos(), out * turned.sin(), -self.radius * q.theta.cos())
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (s, c) = ((self.speed * q.t).sin(), (self.speed * q.t).cos());
        let hoop = |angle: f64| {
            let out = self.offset + self.radius * angle.sin();
            vec3(out * c, out * s, -self.radius * angle.cos())
        };
        let axis = 1.25 * self.radius;
        Drawing::new()
            .curve(0.0, std::f64::consts::TAU, 48, hoop)
            .line(vec3(0.0, 0.0, -axis), vec3(0.0, 0.0, axis))
            .dot(self.bead(q))
            .tail("bead", self.bead(q), 0.5)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bead(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bead(q).z
    }
}

/// Lets beads go 0.05 rad beside the bottom, on a hoop slower than the pitchfork and on a faster one.
fn let_go<'m>(slow: &'m Hoop, fast: &'m Hoop) -> Result<[Motion<'m, Hoop>; 2], Box<dyn std::error::Error>> {
    let swing = |hoop: &Hoop| hoop.state().theta(0.05).build();
    let (stays, leaves) =
        (slow.simulate(swing(slow)?).until(6.0).run()?, fast.simulate(swing(fast)?).until(6.0).run()?);
    let highest = |motion: &Motion<'_, Hoop>| {
        motion.sample(common::times(6.0, 3000)).map(|s| s.theta()).fold(0.0, f64::max)
    };
    // By the energy in axes that turn, which is kept: cos θ = 2 g/(R ω²) − cos 0.05 where it turns back.
    let farthest = (2.0 * fast.g / (fast.radius * fast.speed.powi(2)) - 0.05f64.cos()).acos();
    println!(
        "at {:.3} rad/s it stays within {:.3} rad, at {:.3} rad/s it swings up to {:.6} rad",
        slow.speed,
        highest(&stays),
        fast.speed,
        highest(&leaves)
    );
    assert!(highest(&stays) < 0.051 && (highest(&leaves) - farthest).abs() < 1e-4);
    Ok([stays, leaves])
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let hoop = Hoop { mass: 0.1, radius: 0.5, offset: 0.0, speed: 5.5, g: 9.81 };
    let start = |theta: f64| hoop.state().theta(theta).build();
    Ok(hoop
        .live(start(0.05)?)
        .title("Bead on a turning hoop")
        .first_start("near the bottom")
        .start("at the side", start(f64::acos(9.81 / (0.5 * 5.5 * 5.5)))?)
        .start("over the top", hoop.state().theta(0.05).theta_rate(12.0).build()?)
        .range("speed", 0.0, 10.0)
        .range("offset", -0.1, 0.1)
        .range("radius", 0.2, 1.0)
        .range("g", 0.0, 25.0)
        .hold(["mass"])
        .tolerance(1e-9)
        .plot(["theta"])
        .finish()?)
}

fn main() -> common::Outcome {
    let (radius, g) = (0.5_f64, 9.81);
    let hoop = |speed: f64, offset: f64| Hoop { mass: 0.1, radius, offset, speed, g };
    let critical = (g / radius).sqrt();
    let angle = |state: &<Hoop as Model>::State| state.theta();

    // About the diameter.
    let start = hoop(0.0, 0.0).state().build()?;
    let family =
        continuation(|speed| hoop(speed, 0.0)).from(&start, 0.0).until(0.0..=10.0).named("speed in rad/s");
    let perfect = family.branches(5)?;
    println!("{perfect}\n");
    let [point] = &perfect.branches[0].special[..] else { return Err(perfect.to_string().into()) };
    assert_eq!((point.kind, perfect.branches.len()), (SpecialKind::Pitchfork { supercritical: true }, 3));
    assert!((point.parameter - critical).abs() < 1e-9);
    for aside in perfect.branches[1..].iter().flat_map(|arm| &arm.points[1..]) {
        assert!((aside.state.theta().cos() - g / (radius * aside.parameter.powi(2))).abs() < 1e-12);
    }

    // About a line 1 cm beside it: from rest, and from the other side, which is reached only from above.
    let offset = 0.01;
    let from = |speed: f64, theta: f64| {
        let model = hoop(speed, offset);
        model.equilibrium(&model.state().theta(theta).build()?).map_err(Box::<dyn std::error::Error>::from)
    };
    let family = |speed: f64| hoop(speed, offset);
    let near = continuation(family)
        .from(&from(0.0, 0.0)?.state, 0.0)
        .until(0.0..=10.0)
        .named("speed in rad/s")
        .run()?;
    let far = continuation(family).from(&from(10.0, -1.3)?.state, 10.0).until(0.0..=10.0).run()?;
    assert!(near.special.is_empty() && far.folds().count() == 1);
    let fold = far.folds().next().ok_or("the far branches are born in a fold")?;
    println!(
        "1 cm beside the diameter, positions on the far side exist from {:.9} rad/s on\n",
        fold.parameter
    );

    // Folds over the offset, to both sides: sin³θ = −e/R and ω² cos³θ = g/R, through the cusp.
    let folds = || fold_curve(hoop, fold, offset).until(3.0..=10.0, -0.05..=0.05);
    let (up, through) = (folds().run()?, folds().backward().run()?);
    let curve: Vec<_> = up.points[1..].iter().rev().chain(&through.points).collect();
    for ([speed, offset], state) in &curve {
        assert!((speed.powi(2) * state.theta().cos().powi(3) - g / radius).abs() < 1e-9);
        assert!((state.theta().sin().powi(3) + offset / radius).abs() < 1e-9);
    }
    assert_eq!((up.cusps.len(), through.cusps.len()), (0, 1));
    let least = curve.iter().map(|([speed, _], _)| *speed).fold(f64::INFINITY, f64::min);
    assert!(least >= critical - 1e-9 && least < 1.01 * critical);
    println!("{} folds from offset 0.05 m through the cusp to −0.05 m", curve.len());

    // Let go a little beside the bottom: slower than the pitchfork it stays there, faster it leaves, and
    // swings about the position aside.
    let [slow, fast] = [0.8, 1.4].map(|part| hoop(part * critical, 0.0));
    let [stays, leaves] = let_go(&slow, &fast)?;

    let mut files = common::Files::of("hoop_pitchfork");
    let born = Panel::new(Axis::new("speed in rad/s"), Axis::new("offset in m"));
    let born = born.line("folds", curve.iter().map(|([speed, offset], _)| (*speed, *offset)));
    let imperfect =
        dynamics::analysis::Diagram { branches: vec![near, far], failures: Vec::new(), left_out: 0 };
    Page::new("A bead on a hoop that is turned")
        .diagram("About its diameter", &perfect, [perfect.panel("θ in rad", angle)])
        .diagram("About a line 1 cm beside it", &imperfect, [imperfect.panel("θ in rad", angle)])
        .panels(
            "Where three positions are possible",
            "Right of the curve, whose cusp is the pitchfork.",
            [born],
        )
        .write_html(files.path("hoop_pitchfork.html"))?;
    let film = Animation::new()
        .add(&stays, "0.8 of the critical speed")
        .add(&leaves, "1.4 times the critical speed");
    film.speed(0.25).write_html(files.path("bead.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
