//! A load on a cable of beads and springs, on a trolley: L = Σ ½ mᵢ vᵢ² − Σ mᵢ g yᵢ − Σ ½ EA/h (|d| − h)².
//!
//! A push on the trolley leaves the load swinging. Half of the push now, and half of it after half a period
//! of the slowest swing, leaves it at rest: the two swings cancel. The rope is a part of the model, so its
//! own waves stay, and the period is that of the whole crane: with a trolley that yields it is shorter than
//! that of a pendulum.
//!
//! Source: Smith, Proc. IRE 45 (1957) 1249; Singer, Seering, J. Dyn. Syst. Meas. Control 112 (1990) 76.

mod common;

use core::f64::consts::PI;

use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A crane's trolley, a cable of beads and springs, a load at its end.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(cart: m, x: [m; self.beads], y: [m; self.beads])]
#[inputs(push: N)]
#[units(trolley: kg, bead: kg, load: kg, pitch: m, ea: N, g: m / s^2)]
struct Crane {
    beads: usize,
    trolley: f64,
    bead: f64,
    load: f64,
    pitch: f64,
    ea: f64,
    g: f64,
}

#[dynamics]
impl Crane {
    /// Places against the trolley: the rope's inertia couples to it.
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(q.cart, 0.0) } else { vec2(q.cart + q.x[i - 1], q.y[i - 1]) }
    }
    fn mass(&self, i: usize) -> f64 {
        if i == self.beads { self.load } else { self.bead }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let rope = (1..=self.beads).map(|i| 0.5 * self.mass(i) * self.place(q, i).dt().norm_squared());
        0.5 * self.trolley * q.cart.dt().powi(2) + rope.sum::<Expr>()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.beads).map(|i| self.mass(i) * self.g * self.place(q, i).y).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.beads {
            let length = (self.place(q, i + 1) - self.place(q, i)).norm();
            sum += 0.5 * self.ea / self.pitch * (length - self.pitch).powi(2);
        }
        sum
    }
    #[force]
    fn drive(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.cart, q.push)
    }
    /// How far the load is from below the trolley.
    #[output]
    fn swing(&self, q: &Coordinates<Self>) -> Expr {
        q.x[self.beads - 1]
    }
}

fn main() -> common::Outcome {
    let crane = Crane { beads: 15, trolley: 5.0, bead: 0.2, load: 10.0, pitch: 0.4, ea: 2000.0, g: 9.81 };
    // Each spring carries what hangs below.
    let mut depth = 0.0;
    let places = (0..crane.beads).map(|i| {
        let carried = crane.g * (crane.load + crane.bead * (crane.beads - 1 - i) as f64);
        depth -= crane.pitch * (1.0 + carried / crane.ea);
        depth
    });
    let start = crane.state().y(places.collect::<Vec<_>>()).push(0.0).build()?;
    // The first mode rolls along, the second is the swing.
    let omega = crane.modes(&start, 5)?[1].frequency();
    assert!((omega / 2.199_882_845_698_961_5 - 1.0).abs() < 1e-9);
    println!("slowest swing: {omega:.6} rad/s, with a fixed trolley {:.6}", (9.81f64 / 6.335502).sqrt());

    // A push and, later, a pull: the trolley moves and stops.
    let smooth = |t: f64, from: f64| {
        let part = (t - from) / 0.5;
        if (0.0..=1.0).contains(&part) { 40.0 * (PI * part).sin().powi(2) } else { 0.0 }
    };
    let plain = move |t: f64| smooth(t, 0.2) - smooth(t, 4.2);
    let shaped = move |t: f64| 0.5 * (plain(t) + plain(t - PI / omega));
    let titles = ["push in N", "trolley in m", "swing of the load in m"];
    let mut panels = titles.map(|title| Panel::new(Axis::new("time in s"), Axis::new(title)));
    let mut files = common::Files::of("hanging_crane");
    let mut left = Vec::new();
    for (name, law) in [("at once", &plain as &(dyn Fn(f64) -> f64 + Sync)), ("in two halves", &shaped)] {
        let run = crane.simulate(start.clone()).inputs(|t, _| [law(t)]).until(14.0).max_step(0.05);
        let motion = run.tolerance(1e-8).record(Every::time(0.02)).run()?;
        let mut curves = [const { Vec::new() }; 3];
        for frame in motion.frames() {
            let cart = frame.state.map_or(f64::NAN, |state| state.cart());
            for (curve, y) in curves.iter_mut().zip([law(frame.t), cart, motion.output("swing", frame.t)?]) {
                curve.push((frame.t, y));
            }
        }
        let after = curves[2].iter().filter(|(t, _)| *t > 8.0).map(|(_, swing)| swing.abs());
        left.push(after.fold(0.0, f64::max));
        println!("{name}: a swing of {:.4} m is left\n{}", left[left.len() - 1], motion.summary());
        for (panel, curve) in panels.iter_mut().zip(curves) {
            *panel = panel.clone().line(name, curve);
        }
        motion.animate(files.path(&format!("{}.html", name.replace(' ', "_"))))?;
    }
    assert!(left[1] < 0.1 * left[0]);
    let chart = Chart::new("A load on a cable: the trolley is pushed at once, and in two halves");
    panels.into_iter().fold(chart, Chart::panel).write_svg(files.path("crane.svg"))?;
    files.list();
    Ok(())
}
