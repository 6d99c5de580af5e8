//! A four-bar linkage and a slider-crank, built from planar bodies and joints.
//!
//! Every body has its place and its angle, every joint its rows. The closed forms are not used in the models,
//! but the motion obeys them. The output angle of the four-bar obeys Freudenstein's equation, with links a,
//! b, c on a base d,
//!
//!     d/a cos ψ − d/c cos φ + (a² − b² + c² + d²)/(2 a c) = cos(φ − ψ),
//!
//! the slider x = a cos φ + √(b² − a² sin²φ). The energy is conserved.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// A four-bar linkage of three bars: nine coordinates of bodies, and eight rows of four pins. The crank turns
/// by its own momentum and weight, and energy is conserved. Change a length, and the bars are put together
/// again.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 3], y: [m; 3], crank: rad, coupler: rad, rocker: rad)]
#[units(density: kg / m, lengths: m, base: m, g: m / s^2)]
#[nominal(density = 2.0, lengths = [0.3, 0.8, 0.6], base = 0.7, g = 9.81)]
struct FourBar {
    density: f64,
    /// Crank, coupler, rocker.
    lengths: [f64; 3],
    base: f64,
    g: f64,
}

#[dynamics]
impl FourBar {
    fn bar(&self, q: &Coordinates<Self>, k: usize) -> PlanarBody {
        let mass = self.density * self.lengths[k];
        let frame = PlanarFrame::new(vec2(q.x[k], q.y[k]), [q.crank, q.coupler, q.rocker][k]);
        PlanarBody::new(mass, Vec2::ZERO, mass * self.lengths[k].powi(2) / 12.0, frame)
    }
    /// The end of a bar: −1 or 1.
    fn end(&self, q: &Coordinates<Self>, k: usize, side: f64) -> PlanarFrame {
        self.bar(q, k).frame.frame(0.5 * side * self.lengths[k] * Vec2::X, 0.0)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.bar(q, 0).kinetic_energy() + self.bar(q, 1).kinetic_energy() + self.bar(q, 2).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let gravity = -self.g * Vec2::Y;
        self.bar(q, 0).potential_energy(gravity)
            + self.bar(q, 1).potential_energy(gravity)
            + self.bar(q, 2).potential_energy(gravity)
    }
    #[holonomic]
    fn pins(&self, q: &Coordinates<Self>) -> [[Expr; 2]; 4] {
        [
            PlanarJoint::revolute(PlanarFrame::world(), self.end(q, 0, -1.0)),
            PlanarJoint::revolute(self.end(q, 0, 1.0), self.end(q, 1, -1.0)),
            PlanarJoint::revolute(self.end(q, 1, 1.0), self.end(q, 2, 1.0)),
            PlanarJoint::revolute(PlanarFrame::new(self.base * Vec2::X, 0.0), self.end(q, 2, -1.0)),
        ]
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let mut drawing = Drawing::new().pivot([0.0, 0.0]).pivot([self.base, 0.0]);
        for k in 0..3 {
            drawing = drawing.line(self.end(q, k, -1.0).origin(), self.end(q, k, 1.0).origin());
        }
        let middle = self.bar(q, 1).frame.origin();
        drawing
            .dot(self.end(q, 0, 1.0).origin())
            .dot(self.end(q, 2, 1.0).origin())
            .color(Color::Red)
            .trace("coupler", middle)
    }
}

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 3], y: [m; 3], crank: rad, rod: rad, tilt: rad)]
#[units(density: kg / m, lengths: m, slider: kg)]
#[nominal(density = 2.0, lengths = [0.3, 0.9], slider = 1.5)]
struct SliderCrank {
    density: f64,
    /// Crank, rod.
    lengths: [f64; 2],
    slider: f64,
}

#[dynamics]
impl SliderCrank {
    fn frame(&self, q: &Coordinates<Self>, k: usize) -> PlanarFrame {
        PlanarFrame::new(vec2(q.x[k], q.y[k]), [q.crank, q.rod, q.tilt][k])
    }
    fn bar(&self, q: &Coordinates<Self>, k: usize) -> PlanarBody {
        let mass = self.density * self.lengths[k];
        PlanarBody::new(mass, Vec2::ZERO, mass * self.lengths[k].powi(2) / 12.0, self.frame(q, k))
    }
    fn end(&self, q: &Coordinates<Self>, k: usize, side: f64) -> PlanarFrame {
        self.frame(q, k).frame(0.5 * side * self.lengths[k] * Vec2::X, 0.0)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let size = self.lengths[0];
        let slider =
            PlanarBody::new(self.slider, Vec2::ZERO, self.slider * size * size / 24.0, self.frame(q, 2));
        self.bar(q, 0).kinetic_energy() + self.bar(q, 1).kinetic_energy() + slider.kinetic_energy()
    }
    #[holonomic]
    fn pins(&self, q: &Coordinates<Self>) -> [[Expr; 2]; 3] {
        [
            PlanarJoint::revolute(PlanarFrame::world(), self.end(q, 0, -1.0)),
            PlanarJoint::revolute(self.end(q, 0, 1.0), self.end(q, 1, -1.0)),
            PlanarJoint::revolute(self.end(q, 1, 1.0), self.frame(q, 2)),
        ]
    }
    #[holonomic]
    fn guide(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        PlanarJoint::prismatic(PlanarFrame::world(), self.frame(q, 2))
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let mut drawing = Drawing::new().pivot([0.0, 0.0]);
        for k in 0..2 {
            drawing = drawing.line(self.end(q, k, -1.0).origin(), self.end(q, k, 1.0).origin());
        }
        drawing.fill(Color::Blue).rectangle(self.frame(q, 2).origin(), 0.16, 0.1, 0.0)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let four_bar = FourBar { density: 2.0, lengths: [0.3, 0.8, 0.6], base: 0.7, g: 9.81 };
    let start = |spin: f64| {
        let crank = four_bar.state().crank(0.4).crank_rate(spin).coupler_guess(0.4).rocker_guess(1.2);
        crank.x_guess([0.1, 0.6, 0.8]).y_guess([0.1, 0.3, 0.3]).assemble()
    };
    Ok(four_bar
        .live(start(12.0)?)
        .title("Four-bar from bodies and pins")
        .first_start("12 rad/s")
        .start("let go", start(0.0)?)
        .range("lengths[0]", 0.1, 0.4)
        .range("lengths[1]", 0.5, 1.0)
        .range("lengths[2]", 0.4, 0.9)
        .range("base", 0.5, 0.9)
        .range("density", 0.5, 10.0)
        .range("g", 0.0, 25.0)
        .tolerance(1e-9)
        .plot(["crank", "rocker"])
        .phase("rocker")
        .finish()?)
}

fn main() -> common::Outcome {
    let four_bar = FourBar { density: 2.0, lengths: [0.3, 0.8, 0.6], base: 0.7, g: 9.81 };
    // The crank is known; where the other bars are is solved, from about where they stand.
    let start = four_bar
        .state()
        .crank(0.4)
        .crank_rate(12.0)
        .coupler_guess(0.4)
        .rocker_guess(1.2)
        .x_guess([0.1, 0.6, 0.8])
        .y_guess([0.1, 0.3, 0.3])
        .assemble()?;
    let motion = four_bar.simulate(start).until(4.0).tolerance(1e-11).run()?;
    println!("{}", motion.summary());
    let ([a, b, c], d) = (four_bar.lengths, four_bar.base);
    let freudenstein = |s: &State<FourBar>| {
        let (phi, psi) = (s.crank(), s.rocker());
        d / a * psi.cos() - d / c * phi.cos() + (a * a - b * b + c * c + d * d) / (2.0 * a * c)
            - (phi - psi).cos()
    };
    let off = motion.sample(common::times(4.0, 800)).map(|s| freudenstein(&s).abs()).fold(0.0, f64::max);
    let turns = motion.end().crank() / std::f64::consts::TAU;
    println!("Freudenstein's equation holds to {off:.1e} over {turns:.2} turns");
    assert!(off < 1e-9 && turns > 3.0 && motion.summary().energy_drift < 1e-8);

    let engine = SliderCrank { density: 2.0, lengths: [0.3, 0.9], slider: 1.5 };
    let start = engine
        .state()
        .crank(0.8)
        .crank_rate(9.0)
        .rod_guess(-0.2)
        .x_guess([0.1, 0.6, 1.1])
        .y_guess([0.1, 0.1, 0.0])
        .assemble()?;
    let sliding = engine.simulate(start).until(4.0).tolerance(1e-11).run()?;
    println!("{}", sliding.summary());
    let [a, b] = engine.lengths;
    let closed_form =
        |s: &State<SliderCrank>| a * s.crank().cos() + (b * b - (a * s.crank().sin()).powi(2)).sqrt();
    let off =
        sliding.sample(common::times(4.0, 800)).map(|s| (s.x(2) - closed_form(&s)).abs()).fold(0.0, f64::max);
    println!("the slider is where the closed form says to {off:.1e} m");
    assert!(off < 1e-9 && sliding.summary().energy_drift < 1e-8);

    let mut files = common::Files::of("planar_bodies");
    let times = || common::times(2.0, 1000);
    Chart::new("Linkages from planar bodies and joints")
        .panel(Panel::new(Axis::new("crank in degrees"), Axis::new("rocker in degrees")).line(
            "four-bar",
            motion.sample(times()).map(|s| (s.crank().to_degrees(), s.rocker().to_degrees())),
        ))
        .panel(
            Panel::new(Axis::new("crank in degrees"), Axis::new("slider in m"))
                .line("slider-crank", sliding.sample(times()).map(|s| (s.crank().to_degrees(), s.x(2)))),
        )
        .write_svg(files.path("linkages.svg"))?;
    Animation::new().add(&motion, "").plot(["crank", "rocker"]).write_html(files.path("four_bar.html"))?;
    Animation::new().add(&sliding, "").plot(["x[2]"]).write_html(files.path("slider_crank.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
