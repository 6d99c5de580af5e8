//! A pendulum in Cartesian coordinates: the rod is a constraint, and its pull is a result.
//!
//!     L = ½ m (ẋ² + ẏ²) − m g y,        Φ = √(x² + y²) − l = 0
//!     m r̈ = −m g e_y + λ ∇Φ
//!
//! ∇Φ is the unit vector away from the pivot, so −λ is the tension: m g (3 cos θ − 2 cos θ₀) for
//! a start at rest. Index reduction alone lets the length drift. Projection after each step does not.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A pendulum in Cartesian coordinates: its rod is a constraint, and the pull of the rod is a result, drawn
/// as an arrow. Let it go above its pivot: at first the rod pushes. A thread would be slack there.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, g: m / s^2)]
struct Pendulum {
    mass: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl Pendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q).norm() - self.length
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bob = self.bob(q);
        let pull = q.reaction(Self::rod) / (40.0 * self.length) * bob;
        Drawing::new()
            .tail("bob", bob, 1.0)
            .pivot([0.0, 0.0])
            .line([0.0, 0.0], bob)
            .disc(bob, 0.04)
            .color(Color::Red)
            .arrow(bob, bob + pull)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = Pendulum { mass: 1.0, length: 1.0, g: 9.81 };
    let start = |theta: f64| model.state().x(theta.sin()).y(-theta.cos()).build();
    Ok(model
        .live(start(2.0)?)
        .title("Pull of a rod")
        .first_start("above the pivot")
        .start("level", start(std::f64::consts::FRAC_PI_2)?)
        .start("small swing", start(0.2)?)
        .start("once around", model.state().y(-1.0).x_rate(7.5).build()?)
        .range("mass", 0.2, 5.0)
        .range("length", 0.3, 2.0)
        .range("g", 0.0, 25.0)
        .plot(["tension"])
        .finish()?)
}

fn main() -> common::Outcome {
    let model = Pendulum { mass: 1.0, length: 1.0, g: 9.81 };
    // Let go above the pivot's height: the rod has to push at first.
    let theta0 = 2.0_f64;
    let start = model.state().x(theta0.sin()).y(-theta0.cos()).build()?;
    let swing = model.simulate(start).until(100.0).tolerance(1e-10).run()?;
    println!("{}", swing.summary());

    let law = |state: &State<Pendulum>| {
        let cosine = -state.y() / model.length;
        model.mass * model.g * (3.0 * cosine - 2.0 * theta0.cos())
    };
    let mut worst = 0.0_f64;
    for state in swing.sample(common::times(100.0, 5000)) {
        worst = worst.max((swing.outputs_of(&state)[0] - law(&state)).abs());
    }
    println!("tension: m g (3 cos θ − 2 cos θ₀) to {worst:.1e} N");
    assert!(worst < 1e-6);
    let least = swing.output("tension", 0.0)?;
    println!("the rod pushes with {:.3} N at the start; a thread would be slack", -least);
    assert!((least - model.mass * model.g * theta0.cos()).abs() < 1e-9 && least < 0.0);

    let drift = |formulation| -> Result<Vec<(f64, f64)>, Box<dyn std::error::Error>> {
        let motion = model.simulate(start).until(100.0).tolerance(1e-8).formulation(formulation).run()?;
        let length =
            |state: State<Pendulum>| (state.t, (state.x().hypot(state.y()) - model.length).abs().max(1e-17));
        Ok(motion.steps().map(length).collect())
    };
    let (projected, augmented, baumgarte) = (
        drift(Formulation::Projected)?,
        drift(Formulation::Augmented)?,
        drift(Formulation::Baumgarte { alpha: 10.0, beta: 10.0 })?,
    );
    let largest = |drift: &[(f64, f64)]| drift.iter().fold(0.0, |m: f64, (_, d)| m.max(*d));
    let (kept, lost, held) = (largest(&projected), largest(&augmented), largest(&baumgarte));
    println!(
        "largest error of the length in 100 s: projected {kept:.0e}, stabilised {held:.0e}, left alone \
         {lost:.0e} m"
    );
    assert!(kept < 1e-14 && kept < held && held < lost);

    let mut files = common::Files::of("rod_tension");
    Chart::new("What the rod does")
        .panel(Panel::new(Axis::new("time in s"), Axis::new("tension in N")).line(
            "−λ of the rod",
            swing.sample(common::times(5.0, 1000)).map(|s| (s.t, swing.outputs_of(&s)[0])),
        ))
        .panel(
            Panel::new(Axis::new("time in s"), Axis::log("error of the length in m"))
                .line("projected", projected)
                .line("Baumgarte, α = β = 10/s", baumgarte)
                .line("left alone", augmented),
        )
        .write_svg(files.path("tension.svg"))?;
    model.simulate(start).until(10.0).run()?.animate(files.path("rod_tension.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
