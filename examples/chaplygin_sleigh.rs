//! Chaplygin's sleigh: a body on two runners and a skate that cannot slip sideways.
//!
//!     L = ½ m (ẋ² + ẏ²) + ½ I φ̇²,        n·v = 0 at the skate, a behind the centre of mass
//!
//! No force does work and the energy is conserved. Still the sleigh forgets how it was pushed: it ends on a
//! straight line with the skate behind. In closed form v = V tanh(k t + c), φ̇ = √(m/D) V sech(k t + c)
//! with D = I + m a², k = m a V/D. Pushed backward it turns round (Chaplygin 1911; Bloch, Nonholonomic
//! Mechanics and Control, 2015, 1.7).

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// Chaplygin's sleigh: a body on two runners and a skate that cannot slip sideways. The arrow is the force of
/// the ice on the skate. No force does work, yet the sleigh always ends with its skate behind: push it
/// backward, and it turns round.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(mass: kg, inertia: kg * m^2, a: m)]
struct Sleigh {
    mass: f64,
    inertia: f64,
    a: f64,
}

#[dynamics]
impl Sleigh {
    fn centre(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    fn forward(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.phi.cos(), q.phi.sin())
    }
    fn skate(&self, q: &Coordinates<Self>) -> Vec2 {
        self.centre(q) - self.a * self.forward(q)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.centre(q).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    /// λ is the sideways force of the ice on the skate, to the left.
    #[nonholonomic]
    fn edge(&self, q: &Coordinates<Self>) -> Expr {
        self.skate(q).dt().dot(self.forward(q).perp())
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.skate(q).dt().dot(self.forward(q))
    }
    #[output]
    fn sideways(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::edge)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (skate, forward) = (self.skate(q), self.forward(q));
        let side = forward.perp();
        let bow = skate + 2.5 * self.a * forward;
        Drawing::new()
            .tail("skate", skate, 4.0)
            .polyline([skate, bow + 0.6 * self.a * side, bow - 0.6 * self.a * side, skate])
            .disc(self.centre(q), 0.03)
            .color(Color::Red)
            .line(skate - 0.4 * self.a * forward, skate + 0.4 * self.a * forward)
            .arrow(skate, skate + 0.7 * q.reaction(Self::edge) * side)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let sleigh = Sleigh { mass: 1.0, inertia: 0.1, a: 0.2 };
    let push = |v: f64, spin: f64| {
        sleigh.state().x(sleigh.a).x_rate(v).y_rate(sleigh.a * spin).phi_rate(spin).build()
    };
    Ok(sleigh
        .live(push(1.0, 2.0)?)
        .title("Chaplygin's sleigh")
        .first_start("pushed forward and spun")
        .start("pushed backward", push(-1.0, 0.2)?)
        .start("spun only", push(0.0, 4.0)?)
        .range("mass", 0.2, 5.0)
        .range("inertia", 0.01, 1.0)
        .range("a", 0.02, 0.5)
        .tolerance(1e-9)
        .plot(["speed", "sideways"])
        .phase("phi")
        .until(6.0)
        .finish()?)
}

fn main() -> common::Outcome {
    let sleigh = Sleigh { mass: 1.0, inertia: 0.1, a: 0.2 };
    let about_skate = sleigh.inertia + sleigh.mass * sleigh.a.powi(2);
    // Speed v of the skate and spin ω, both at φ = 0.
    let push = |v: f64, spin: f64| {
        let builder = sleigh.state().x(sleigh.a).x_rate(v).y_rate(sleigh.a * spin).phi_rate(spin);
        builder.build()
    };
    let forward = sleigh.simulate(push(1.0, 2.0)?).until(30.0).tolerance(1e-11).run()?;
    let backward = sleigh.simulate(push(-1.0, 0.2)?).until(30.0).tolerance(1e-11).run()?;
    println!("{}", forward.summary());

    for (name, motion, v0, spin0) in
        [("forward", &forward, 1.0_f64, 2.0_f64), ("backward", &backward, -1.0, 0.2)]
    {
        let summary = motion.summary();
        assert!(summary.energy_drift < 1e-9, "{summary}");
        assert!(summary.constraints.iter().all(|c| c.velocity_residual < 1e-12));
        // Closed form: v = V tanh(k t + c), φ̇ = (V/a) √(m a²/D) sech(k t + c).
        let top = (v0.powi(2) + about_skate / sleigh.mass * spin0.powi(2)).sqrt();
        let (k, c) = (sleigh.a * sleigh.mass * top / about_skate, (v0 / top).atanh());
        let spin = (sleigh.mass / about_skate).sqrt() * top;
        let mut worst = 0.0_f64;
        for state in motion.sample(common::times(30.0, 300)) {
            let speed = motion.outputs_of(&state)[0];
            worst = worst.max((speed - top * (k * state.t + c).tanh()).abs());
            worst = worst.max((state.phi_rate() - spin / (k * state.t + c).cosh()).abs());
        }
        let turned = spin / k * (std::f64::consts::FRAC_PI_2 - c.sinh().atan());
        println!(
            "pushed {name}: ends at {top:.4} m/s after turning by {turned:.4} rad; closed form to {worst:.0e}"
        );
        assert!(worst < 1e-8);
        assert!((motion.end().phi() - turned).abs() < 1e-6);
    }
    assert!(backward.output("speed", 0.0)? < 0.0 && backward.output("speed", 30.0)? > 0.0, "it turns about");

    let mut files = common::Files::of("chaplygin_sleigh");
    let track = |motion: &Motion<'_, Sleigh>| -> Vec<(f64, f64)> {
        let skate = |s: State<Sleigh>| sleigh.skate(&motion.coordinates_of(&s)).value();
        motion.sample(common::times(8.0, 800)).map(skate).map(|p| (p.x, p.y)).collect()
    };
    let force = |motion: &Motion<'_, Sleigh>| -> Vec<(f64, f64)> {
        motion.sample(common::times(8.0, 800)).map(|s| (s.t, motion.outputs_of(&s)[1])).collect()
    };
    Chart::new("Chaplygin's sleigh")
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("y in m"))
                .equal_axes()
                .line("pushed forward", track(&forward))
                .line("pushed backward", track(&backward)),
        )
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("force on the skate in N"))
                .line("pushed forward", force(&forward))
                .line("pushed backward", force(&backward)),
        )
        .write_svg(files.path("sleigh.svg"))?;
    let short = |v, spin| -> Result<_, Box<dyn std::error::Error>> {
        Ok(sleigh.simulate(push(v, spin)?).until(5.0).tolerance(1e-9).run()?)
    };
    let (first, second) = (short(1.0, 2.0)?, short(-1.0, 0.2)?);
    let film = Animation::new().add(&first, "forward").add(&second, "backward").title("Chaplygin's sleigh");
    film.speed(0.5).write_html(files.path("sleigh.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
