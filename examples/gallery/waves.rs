//! Chapter 9: waves in bars, strings, ropes and membranes of any number of nodes.

use dynamics::prelude::*;

use crate::Page;

/// A pulse in a bar that is clamped on the left and free on the right, drawn as the height of a curve: above
/// by lumped masses, below by finite elements. The free end returns it upright, the clamped end upside
/// down. Take the narrow pulse: short waves are late with lumped masses and early with elements, and the
/// pulse falls apart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(lumped: [m; self.elements], consistent: [m; self.elements])]
#[units(length: m, ea: N, rho: kg / m)]
struct Bar {
    /// How many elements the bar has, of either kind.
    elements: usize,
    length: f64,
    /// Stiffness of the section.
    ea: f64,
    /// Mass per length.
    rho: f64,
}

#[dynamics]
impl Bar {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    /// Node 0 is clamped.
    fn of_masses(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.lumped[i - 1] }
    }
    /// The same of the elements.
    fn of_elements(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.consistent[i - 1] }
    }
    /// Where the nodes are drawn.
    fn above(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.h() * i as f64, 0.2 * self.length + self.of_masses(q, i))
    }
    fn below(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.h() * i as f64, -0.2 * self.length + self.of_elements(q, i))
    }
    /// Half of the mass of an element lies at each node, or the velocity is linear between the nodes.
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.elements {
            let (a, b) = (self.of_masses(q, e).dt(), self.of_masses(q, e + 1).dt());
            sum += 0.25 * self.rho * self.h() * (a * a + b * b);
            let (a, b) = (self.of_elements(q, e).dt(), self.of_elements(q, e + 1).dt());
            sum += self.rho * self.h() / 6.0 * (a * a + a * b + b * b);
        }
        sum
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.elements {
            let stretch = self.above(q, e + 1).y - self.above(q, e).y;
            sum += 0.5 * self.ea / self.h() * stretch.powi(2);
            let stretch = self.below(q, e + 1).y - self.below(q, e).y;
            sum += 0.5 * self.ea / self.h() * stretch.powi(2);
        }
        sum
    }
}

/// The live page: a speed of 0.5 m/s, so that the wave is seen.
pub(crate) fn waves() -> Page {
    let bar = Bar { elements: 60, length: 1.0, ea: 0.25, rho: 1.0 };
    let speed = f64::sqrt(bar.ea / bar.rho);
    let places = || (1..=bar.elements).map(|i| i as f64 * bar.length / bar.elements as f64);
    // A pulse that runs to the right: ṡ = −c s′.
    let pulse = |width: f64| {
        let height = move |x: f64| 0.1 * (-((x - 0.35) / width).powi(2)).exp();
        let rate = move |x: f64| speed * 2.0 * (x - 0.35) / (width * width) * height(x);
        let state = bar.state().lumped(places().map(height)).consistent(places().map(height));
        state.lumped_rate(places().map(rate)).consistent_rate(places().map(rate)).build()
    };
    let mode = || places().map(|x| 0.08 * (1.5 * std::f64::consts::PI * x).sin());
    Ok(bar
        .live(pulse(0.12)?)
        .title("Waves in a bar: lumped masses beside elements")
        .first_start("wide pulse")
        .start("narrow pulse", pulse(0.02)?)
        .start("second mode", bar.state().lumped(mode()).consistent(mode()).build()?)
        .range("ea", 0.02, 1.0)
        .range("rho", 0.2, 5.0)
        .hold(["length"])
        .plot(["lumped[59]", "consistent[59]"])
        .phase("lumped[59]")
        .finish()?)
}

/// A string between two pegs, plucked. Its tension grows as it swings out, and air takes its energy: high
/// tones die no sooner than low ones here. Drag a node to pluck the string where you like.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(w: [m; self.nodes])]
#[units(length: m, tension: N, ea: N, rho: kg / m, air: kg / (m * s))]
struct PluckedString {
    /// Nodes between the pegs.
    nodes: usize,
    length: f64,
    /// Tension at rest.
    tension: f64,
    /// Stiffness of the section.
    ea: f64,
    /// Mass per length.
    rho: f64,
    /// Damping per length.
    air: f64,
}

#[dynamics]
impl PluckedString {
    fn pitch(&self) -> f64 {
        self.length / (self.nodes as f64 + 1.0)
    }
    /// The pegs are nodes 0 and nodes + 1.
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let w = if i == 0 || i == self.nodes + 1 { Expr::ZERO } else { q.w[i - 1] };
        vec2(self.pitch() * i as f64, w)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.rho * self.pitch() * q.w[i].dt().powi(2)).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes + 1)
            .map(|e| {
                let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() / self.pitch() - 1.0;
                self.pitch() * (self.tension * stretch + 0.5 * self.ea * stretch.powi(2))
            })
            .sum()
    }
    #[dissipation]
    fn air(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.air * self.pitch() * q.w[i].dt().powi(2)).sum()
    }
    #[output]
    fn peg(&self, q: &Coordinates<Self>) -> Expr {
        self.tension * q.w[0] / self.pitch()
    }
}

/// A string of 200 nodes.
pub(crate) fn plucked_string() -> Page {
    let string = PluckedString { nodes: 200, length: 1.0, tension: 1.0, ea: 3.0, rho: 1.0, air: 0.1 };
    let x = || (1..=200).map(|i| f64::from(i) / 201.0);
    let pluck = |at: f64| x().map(move |x| 0.15 * (x / at).min((1.0 - x) / (1.0 - at)));
    let tone = |k: f64| x().map(move |x| 0.12 * (k * std::f64::consts::PI * x).sin());
    Ok(string
        .live(string.state().w(pluck(0.2)).build()?)
        .title("Plucked string")
        .first_start("plucked near a peg")
        .start("plucked in the middle", string.state().w(pluck(0.5)).build()?)
        .start("third tone", string.state().w(tone(3.0)).build()?)
        .range("air", 0.0, 2.0)
        .hold(["length"])
        .step(2e-3)
        .method(methods::Rk4)
        .plot(["w[99]", "peg"])
        .phase("w[99]")
        .finish()?)
}

/// A rope of beads on springs hangs from a hook. Drag a bead and throw it: waves run up and down the rope,
/// and faster near the hook, where the tension is larger. At the free end a wave turns over like the end of
/// a whip.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.beads], y: [m; self.beads])]
#[units(length: m, mass: kg, ea: N, g: m / s^2, air: kg / s)]
struct Rope {
    /// How many beads the rope has.
    beads: usize,
    length: f64,
    /// Of the whole rope.
    mass: f64,
    ea: f64,
    g: f64,
    /// Damping of the whole rope.
    air: f64,
}

#[dynamics]
impl Rope {
    fn pitch(&self) -> f64 {
        self.length / self.beads as f64
    }
    /// Node 0 is the hook.
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let m = self.mass / self.beads as f64;
        (1..=self.beads).map(|i| 0.5 * m * self.bead(q, i).dt().norm_squared()).sum()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| self.mass / self.beads as f64 * self.g * q.y[i]).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads)
            .map(|e| {
                let stretch = (self.bead(q, e + 1) - self.bead(q, e)).norm() / self.pitch() - 1.0;
                0.5 * self.ea * self.pitch() * stretch.powi(2)
            })
            .sum()
    }
    #[dissipation]
    fn air(&self, q: &Coordinates<Self>) -> Expr {
        let c = self.air / self.beads as f64;
        (1..=self.beads).map(|i| 0.5 * c * self.bead(q, i).dt().norm_squared()).sum()
    }
    #[output]
    fn hook(&self, q: &Coordinates<Self>) -> Expr {
        self.ea * (self.bead(q, 1).norm() / self.pitch() - 1.0)
    }
}

/// A rope of 40 beads.
pub(crate) fn rope() -> Page {
    let rope = Rope { beads: 40, length: 1.0, mass: 0.5, ea: 150.0, g: 9.81, air: 0.1 };
    let along = |angle: f64, i: u32| {
        let s = f64::from(i) / 40.0;
        (s * angle.sin(), -s * angle.cos())
    };
    let straight = |angle: f64| {
        let x = (1..=40).map(move |i| along(angle, i).0);
        rope.state().x(x).y((1..=40).map(move |i| along(angle, i).1))
    };
    let kick = (0..40).map(|i: u32| if i < 34 { 0.0 } else { 3.0 * f64::from(i - 33) });
    Ok(rope
        .live(straight(1.2).build()?)
        .title("Hanging rope")
        .first_start("let go")
        .start("kicked at its end", straight(0.0).x_rate(kick).build()?)
        .range("air", 0.0, 2.0)
        .hold(["length"])
        .step(5e-4)
        .method(methods::Rk4)
        .plot(["x[39]", "hook"])
        .phase("x[39]")
        .finish()?)
}

/// A square membrane on a grid of masses, its rim held, with large deflections. A blow makes a ring that
/// spreads and returns from the rim. Drag a node to pluck the membrane.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(w: [[m; self.columns]; self.rows])]
#[units(pitch: m, tension: N / m, sigma: kg / m^2)]
struct Membrane {
    rows: usize,
    columns: usize,
    /// From node to node.
    pitch: f64,
    tension: f64,
    /// Mass per area.
    sigma: f64,
}

#[dynamics]
impl Membrane {
    /// Nodes 0 and rows + 1, and 0 and columns + 1, are the rim.
    fn height(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
        if i == 0 || j == 0 || i == self.rows + 1 || j == self.columns + 1 {
            Expr::ZERO
        } else {
            q.w[i - 1][j - 1]
        }
    }
    fn place(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Vec3 {
        vec3(self.pitch * i as f64, self.pitch * j as f64, self.height(q, i, j))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows {
            for j in 0..self.columns {
                sum += 0.5 * self.sigma * self.pitch.powi(2) * q.w[i][j].dt().powi(2);
            }
        }
        sum
    }
    #[potential]
    fn stretched_area(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows + 1 {
            for j in 0..self.columns + 1 {
                let w = self.place(q, i, j).z;
                let a = (self.place(q, i + 1, j).z - w) / self.pitch;
                let b = (self.place(q, i, j + 1).z - w) / self.pitch;
                sum += self.tension * self.pitch.powi(2) * ((1.0 + a * a + b * b).sqrt() - 1.0);
            }
        }
        sum
    }
}

/// A membrane of 24 × 24 nodes.
pub(crate) fn membrane() -> Page {
    let n = 24_u32;
    let pitch = 1.0 / f64::from(n + 1);
    let membrane = Membrane { rows: 24, columns: 24, pitch, tension: 1.0, sigma: 1.0 };
    let place = move |k: u32| (f64::from(k / n + 1) * pitch, f64::from(k % n + 1) * pitch);
    let blow = (0..n * n).map(move |k| {
        let (x, y) = place(k);
        0.15 * (-60.0 * ((x - 0.35).powi(2) + (y - 0.4).powi(2))).exp()
    });
    let mode = (0..n * n).map(move |k| {
        let (x, y) = place(k);
        0.12 * (2.0 * std::f64::consts::PI * x).sin() * (std::f64::consts::PI * y).sin()
    });
    Ok(membrane
        .live(membrane.state().w(blow).build()?)
        .title("Membrane on a grid")
        .first_start("blow")
        .start("a mode", membrane.state().w(mode).build()?)
        .hold(["pitch"])
        .step(0.01)
        .plot(["w[12][12]"])
        .phase("w[12][12]")
        .finish()?)
}
