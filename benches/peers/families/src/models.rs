//! The systems that are measured.

use dynamics::prelude::*;

/// A string between two pegs: tension grows as it swings out.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes], w: [m; self.nodes])]
#[units(pitch: m, ea: N, tension: N, mass: kg)]
pub struct PlanarString {
    pub nodes: usize,
    pub pitch: f64,
    pub ea: f64,
    pub tension: f64,
    pub mass: Vec<f64>,
}

#[dynamics]
impl PlanarString {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let x = self.pitch * i as f64;
        if i == 0 || i == self.nodes + 1 { vec2(x, 0.0) } else { vec2(x + q.s[i - 1], q.w[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass[i] * (q.s[i].dt().powi(2) + q.w[i].dt().powi(2))).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes + 1)
            .map(|e| {
                let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() / self.pitch - 1.0;
                self.pitch * (self.tension * stretch + 0.5 * self.ea * stretch.powi(2))
            })
            .sum()
    }
}

/// Masses between two walls, with springs whose force has a cubic term (Fermi, Pasta, Ulam, Tsingou 1955).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes])]
#[units(m: kg, k: N / m, beta: N / m^3)]
pub struct CubicChain {
    pub nodes: usize,
    pub m: f64,
    pub k: f64,
    pub beta: f64,
}

#[dynamics]
impl CubicChain {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 || i == self.nodes + 1 { Expr::ZERO } else { q.s[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.m * q.s[i].dt().powi(2)).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes + 1)
            .map(|e| {
                let d = self.place(q, e + 1) - self.place(q, e);
                0.5 * self.k * d.powi(2) + 0.25 * self.beta * d.powi(4)
            })
            .sum()
    }
}

/// A bar in linear finite elements with consistent mass, held at its left end.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.elements])]
#[units(length: m, ea: N, rho: kg / m)]
pub struct Bar {
    pub elements: usize,
    pub length: f64,
    pub ea: f64,
    pub rho: f64,
}

#[dynamics]
impl Bar {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.s[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
                self.rho * self.h() / 6.0 * (a * a + a * b + b * b)
            })
            .sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| 0.5 * self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e)).powi(2))
            .sum()
    }
}

/// A geometrically exact planar beam (Reissner 1972; Simo and Vu-Quoc 1986) with lumped mass, hinged at its
/// root. Linear elements, strains in the middle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.elements], y: [m; self.elements], theta: [rad; self.elements + 1])]
#[units(length: m, ea: N, ga: N, ei: N * m^2, rho: kg / m, spin: kg * m)]
pub struct Beam {
    pub elements: usize,
    pub length: f64,
    pub ea: f64,
    pub ga: f64,
    pub ei: f64,
    pub rho: f64,
    pub spin: f64,
}

#[dynamics]
impl Beam {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.place(q, e).dt(), self.place(q, e + 1).dt());
                let (c, d) = (q.theta[e].dt(), q.theta[e + 1].dt());
                0.25 * self.h() * (self.rho * (a.dot(a) + b.dot(b)) + self.spin * (c * c + d * d))
            })
            .sum()
    }
    #[potential]
    fn strain_energy(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let angle = 0.5 * (q.theta[e] + q.theta[e + 1]);
                let d = (self.place(q, e + 1) - self.place(q, e)) / self.h();
                let (c, s) = (angle.cos(), angle.sin());
                let (along, across) = (c * d.x + s * d.y - 1.0, c * d.y - s * d.x);
                let turn = (q.theta[e + 1] - q.theta[e]) / self.h();
                0.5 * self.h()
                    * (self.ea * along.powi(2) + self.ga * across.powi(2) + self.ei * turn.powi(2))
            })
            .sum()
    }
}
