//! A beam that a moment rolls up: geometrically exact, any rotation (Reissner 1972; Simo, Vu-Quoc 1986).
//!
//! A moment M at the tip of a clamped beam gives it the curvature M/EI everywhere. At M = 2π EI/L it is a
//! circle: of n elements a regular polygon, exactly, whose tip is at the clamp. The moment has then done the
//! work ½ M 2π = 2π² EI/L. Raised slowly it does the same in a motion; let go, the beam springs back.
//!
//! Source: Simo, Vu-Quoc, Comput. Methods Appl. Mech. Eng. 58 (1986) 79, §5.1; 55 (1986) 101.

mod common;

use core::f64::consts::PI;

use dynamics::families::methods::GeneralizedAlpha;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Geometrically exact planar beam, linear elements, strains in the middle; clamped, turned at its tip.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.elements], y: [m; self.elements], theta: [rad; self.elements])]
#[inputs(moment: N * m)]
#[units(length: m, ea: N, ga: N, ei: N * m^2, rho: kg / m, spin: kg * m)]
struct Beam {
    elements: usize,
    length: f64,
    ea: f64,
    ga: f64,
    ei: f64,
    rho: f64,
    spin: f64,
}

#[dynamics]
impl Beam {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    fn angle(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.theta[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.elements {
            let (a, b) = (self.place(q, e).dt(), self.place(q, e + 1).dt());
            let (c, d) = (self.angle(q, e).dt(), self.angle(q, e + 1).dt());
            sum += self.h() / 6.0 * self.rho * (a.dot(a) + a.dot(b) + b.dot(b));
            sum += self.h() / 6.0 * self.spin * (c * c + c * d + d * d);
        }
        sum
    }
    #[potential]
    fn strain_energy(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.elements {
            // Strains in the middle: along the element, across it, and its curvature.
            let angle = 0.5 * (self.angle(q, e) + self.angle(q, e + 1));
            let d = (self.place(q, e + 1) - self.place(q, e)) / self.h();
            let (c, s) = (angle.cos(), angle.sin());
            let curvature = (self.angle(q, e + 1) - self.angle(q, e)) / self.h();
            sum += 0.5 * self.h() * self.ea * (c * d.x + s * d.y - 1.0).powi(2);
            sum += 0.5 * self.h() * (self.ga * (c * d.y - s * d.x).powi(2) + self.ei * curvature.powi(2));
        }
        sum
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta[self.elements - 1], q.moment)
    }
}

fn main() -> common::Outcome {
    let elements = 30;
    let beam = Beam { elements, length: 1.0, ea: 1e4, ga: 5e3, ei: 1.0, rho: 1.0, spin: 1e-3 };
    let straight = beam.state().x((1..=elements).map(|i| i as f64 / elements as f64)).moment(0.0).build()?;
    let shape = |state: &BeamState| {
        let nodes = state.x().iter().copied().zip(state.y().iter().copied()).collect::<Vec<_>>();
        core::iter::once((0.0, 0.0)).chain(nodes)
    };

    // The load grows: each equilibrium is the guess for the next.
    let mut shapes = Panel::new(Axis::new("x in m"), Axis::new("y in m")).equal_axes();
    let mut state = straight.clone();
    for step in 1..=40 {
        state.set_moment(2.0 * PI * f64::from(step) / 40.0);
        state = beam.equilibrium(&state)?.state;
        if step % 10 == 0 {
            shapes = shapes.line(format!("{} of 2π EI/L", f64::from(step) / 40.0), shape(&state));
        }
    }
    // A regular polygon: its corners are on a circle that touches the x-axis at the clamp.
    let n = elements as f64;
    let radius = 0.5 / n / (PI / n).sin();
    let off = |(x, y): (f64, f64)| (x.hypot(y - radius) / radius - 1.0).abs();
    let tip = |state: &BeamState| state.x()[elements - 1].hypot(state.y()[elements - 1]);
    println!("at 2π EI/L the tip is {:.1e} m from the clamp", tip(&state));
    assert!(tip(&state) < 1e-10 && shape(&state).all(|corner| off(corner) < 1e-9));

    // Slowly raised within 20 s, held for 1 s, and let go within 2 s.
    let part = |t: f64| (t / 20.0).min(1.0).min((23.0 - t) / 2.0).max(0.0);
    let law = move |t: f64| PI * (1.0 - (PI * part(t)).cos());
    let run = beam.simulate(straight).inputs(move |t, _| [law(t)]).until(26.0).record(Every::time(0.1));
    let motion = run.method(GeneralizedAlpha { rho: 0.8 }).fixed_step(0.005).run()?;
    let rolled = motion.nearest(20.5)?.state.ok_or("kept in memory")?;
    let energy = motion.energies_of(rolled).total() / (2.0 * PI * PI);
    println!("raised slowly: tip {:.1e} m from the clamp, energy {energy:.5} of 2π² EI/L", tip(rolled));
    assert!(tip(rolled) < 0.02 && (energy - 1.0).abs() < 5e-3);
    println!("{}", motion.summary());

    let mut files = common::Files::of("rolled_beam");
    let heights = motion.frames().filter_map(|frame| frame.state.map(|state| (frame.t, tip(state))));
    Chart::new("Equilibria under a moment at the tip, and a slow motion through them")
        .panel(shapes)
        .panel(Panel::new(Axis::new("time in s"), Axis::new("tip to clamp in m")).line("", heights))
        .panel_height(260.0)
        .write_svg(files.path("beam.svg"))?;
    motion.animate(files.path("beam.html"))?;
    files.list();
    Ok(())
}
