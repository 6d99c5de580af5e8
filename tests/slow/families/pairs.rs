//! Each model twice: with a family, and with a literal count.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::families::model::EnergyParts;
use dynamics::model::Dynamics as _;
use dynamics::prelude::*;

use super::harness::{check_sizes, compare, compare_with, twice};

twice! {
    #[inputs(pull: N)]
    #[units(length: m, ea: N, mass: kg)]
    LumpedBar: (s: [m; self.nodes]) { pub length: f64, pub ea: f64, pub mass: f64 }
    LumpedBar5: (s: [m; 5]) { pub length: f64, pub ea: f64, pub mass: f64 } = 5;
    {
        fn h(&self) -> f64 {
            self.length / self.n() as f64
        }
        fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
            if i == 0 { Expr::ZERO } else { q.s[i - 1] }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| {
                    let mass = if i + 1 == self.n() { 0.5 * self.mass } else { self.mass };
                    0.5 * mass * q.s[i].dt().powi(2)
                })
                .sum()
        }
        #[potential]
        fn strain(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|e| 0.5 * self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e)).powi(2))
                .sum()
        }
        #[force]
        fn pull(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.s[self.n() - 1], q.pull)
        }
        #[output]
        fn wall(&self, q: &Coordinates<Self>) -> Expr {
            self.ea / self.h() * q.s[0]
        }
        #[output]
        fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
            vec2(self.node(q, self.n()), q.s[self.n() - 1].dt())
        }
    }
}

#[test]
fn lumped_bar() {
    let (length, ea, mass) = (1.3, 20.0, 0.7);
    compare(&LumpedBar { nodes: 5, length, ea, mass }, &LumpedBar5 { length, ea, mass }, 0.3);
    check_sizes(0.3, |nodes| LumpedBar { nodes, length, ea, mass });
}

twice! {
    #[units(length: m, ea: N, rho: kg / m)]
    Consistent: (s: [m; self.nodes]) { pub length: f64, pub ea: f64, pub rho: f64 }
    Consistent4: (s: [m; 4]) { pub length: f64, pub ea: f64, pub rho: f64 } = 4;
    {
        fn h(&self) -> f64 {
            self.length / self.n() as f64
        }
        fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
            if i == 0 { Expr::ZERO } else { q.s[i - 1] }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|e| {
                    let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
                    self.rho * self.h() / 6.0 * (a * a + a * b + b * b)
                })
                .sum()
        }
        #[potential]
        fn strain(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|e| 0.5 * self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e)).powi(2))
                .sum()
        }
    }
}

#[test]
fn consistent_bar() {
    let (length, ea, rho) = (1.3, 20.0, 0.7);
    compare(&Consistent { nodes: 4, length, ea, rho }, &Consistent4 { length, ea, rho }, 0.3);
    check_sizes(0.3, |nodes| Consistent { nodes, length, ea, rho });
}

twice! {
    #[units(pitch: m, ea: N, tension: N, mass: kg, damping: N * s / m)]
    Guitar: (s: [m; self.nodes], w: [m; self.nodes]) {
        pub pitch: f64, pub ea: f64, pub tension: f64, pub damping: f64, pub mass: Vec<f64>,
    }
    Guitar4: (s: [m; 4], w: [m; 4]) {
        pub pitch: f64, pub ea: f64, pub tension: f64, pub damping: f64, pub mass: [f64; 4],
    } = 4;
    {
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            let x = self.pitch * i as f64;
            if i == 0 || i == self.n() + 1 { vec2(x, 0.0) } else { vec2(x + q.s[i - 1], q.w[i - 1]) }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.n() {
                sum += 0.5 * self.mass[i] * (q.s[i].dt().powi(2) + q.w[i].dt().powi(2));
            }
            sum
        }
        #[potential]
        fn strain(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for e in 0..self.n() + 1 {
                let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() / self.pitch - 1.0;
                sum += self.pitch * (self.tension * stretch + 0.5 * self.ea * stretch.powi(2));
            }
            sum
        }
        #[dissipation]
        fn air(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| 0.5 * self.damping * q.w[i].dt().powi(2)).sum()
        }
    }
}

#[test]
fn guitar_string() {
    let (pitch, ea, tension, damping) = (0.4, 20.0, 3.0, 0.2);
    let mass = |i: usize| 0.3 + 0.1 * (i % 7) as f64;
    let family =
        |nodes: usize| Guitar { nodes, pitch, ea, tension, damping, mass: (0..nodes).map(mass).collect() };
    let literal = Guitar4 { pitch, ea, tension, damping, mass: std::array::from_fn(mass) };
    compare(&family(4), &literal, 0.1);
    check_sizes(0.1, family);
}

twice! {
    #[inputs(moment: N * m)]
    #[units(length: m, ea: N, ga: N, ei: N * m^2, rho: kg / m, spin: kg * m)]
    Beam: (x: [m; self.nodes], y: [m; self.nodes], theta: [rad; self.nodes + 1]) {
        pub length: f64, pub ea: f64, pub ga: f64, pub ei: f64, pub rho: f64, pub spin: f64,
    }
    Beam3: (x: [m; 3], y: [m; 3], theta: [rad; 4]) {
        pub length: f64, pub ea: f64, pub ga: f64, pub ei: f64, pub rho: f64, pub spin: f64,
    } = 3;
    {
        fn h(&self) -> f64 {
            self.length / self.n() as f64
        }
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|e| {
                    let (a, b) = (self.place(q, e).dt(), self.place(q, e + 1).dt());
                    let (c, d) = (q.theta[e].dt(), q.theta[e + 1].dt());
                    self.h() / 6.0
                        * (self.rho * (a.dot(a) + a.dot(b) + b.dot(b)) + self.spin * (c * c + c * d + d * d))
                })
                .sum()
        }
        fn strains(&self, q: &Coordinates<Self>, e: usize) -> Vec3 {
            let angle = 0.5 * (q.theta[e] + q.theta[e + 1]);
            let d = (self.place(q, e + 1) - self.place(q, e)) / self.h();
            let (c, s) = (angle.cos(), angle.sin());
            vec3(c * d.x + s * d.y - 1.0, c * d.y - s * d.x, (q.theta[e + 1] - q.theta[e]) / self.h())
        }
        #[potential]
        fn strain_energy(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|e| {
                    let k = self.strains(q, e);
                    0.5 * self.h()
                        * (self.ea * k.x.powi(2) + self.ga * k.y.powi(2) + self.ei * (k.z / 1.0).powi(2))
                })
                .sum()
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.theta[0], q.moment)
        }
        #[output]
        fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
            self.place(q, self.n())
        }
    }
}

#[test]
fn exact_beam() {
    let (length, ea, ga, ei, rho, spin) = (1.0, 30.0, 20.0, 2.0, 0.8, 0.1);
    let family = |nodes| Beam { nodes, length, ea, ga, ei, rho, spin };
    compare(&family(3), &Beam3 { length, ea, ga, ei, rho, spin }, 0.4);
    check_sizes(0.4, family);
}

twice! {
    #[inputs(push: N)]
    #[units(trolley: kg, bead: kg, load: kg, pitch: m, ea: N, g: m / s^2)]
    Crane: (cart: m, x: [m; self.nodes], y: [m; self.nodes]) {
        pub trolley: f64, pub bead: f64, pub load: f64, pub pitch: f64, pub ea: f64, pub g: f64,
    }
    Crane4: (cart: m, x: [m; 4], y: [m; 4]) {
        pub trolley: f64, pub bead: f64, pub load: f64, pub pitch: f64, pub ea: f64, pub g: f64,
    } = 4;
    {
        /// In the trolley's frame: the rope's inertia couples to it.
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            if i == 0 { vec2(q.cart, 0.0) } else { vec2(q.cart + q.x[i - 1], q.y[i - 1]) }
        }
        fn mass(&self, i: usize) -> f64 {
            if i == self.n() { self.load } else { self.bead }
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.trolley * q.cart.dt().powi(2)
                + (1..=self.n())
                    .map(|i| 0.5 * self.mass(i) * self.place(q, i).dt().norm_squared())
                    .sum::<Expr>()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            (1..=self.n()).map(|i| self.mass(i) * self.g * self.place(q, i).y).sum()
        }
        #[potential]
        fn strain(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| {
                    let length = (self.place(q, i + 1) - self.place(q, i)).norm();
                    0.5 * self.ea / self.pitch * (length - self.pitch).powi(2)
                })
                .sum()
        }
        #[force]
        fn drive(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.cart, q.push)
        }
        #[output]
        fn hook(&self, q: &Coordinates<Self>) -> Vec2 {
            self.place(q, self.n())
        }
    }
}

#[test]
fn crane() {
    let (trolley, bead, load, pitch, ea, g) = (3.0, 0.2, 2.0, 0.5, 40.0, 9.81);
    let family = |nodes| Crane { nodes, trolley, bead, load, pitch, ea, g };
    compare(&family(4), &Crane4 { trolley, bead, load, pitch, ea, g }, 0.5);
    check_sizes(0.5, family);
}

twice! {
    Ring: (s: [m; self.nodes]) { pub m: f64, pub k: f64, pub tie: f64, pub ground: f64 }
    Ring6: (s: [m; 6]) { pub m: f64, pub k: f64, pub tie: f64, pub ground: f64 } = 6;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| 0.5 * self.m * q.s[i].dt().powi(2)).sum()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            (1..self.n()).map(|i| 0.25 * self.k * (q.s[i] - q.s[i - 1]).powi(4)).sum()
        }
        #[potential]
        fn closure(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.tie * (q.s[0] - q.s[self.n() - 1]).powi(2)
        }
        /// Stiffer from node to node.
        #[potential]
        fn foundation(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| {
                    let along = (i as f64 + 0.5) / self.n() as f64;
                    0.5 * self.ground * (1.0 + along) * q.s[i].powi(2)
                })
                .sum()
        }
    }
}

#[test]
fn ring_on_a_foundation() {
    let (m, k, tie, ground) = (0.4, 7.0, 3.0, 2.0);
    let family = |nodes| Ring { nodes, m, k, tie, ground };
    compare(&family(6), &Ring6 { m, k, tie, ground }, 0.8);
    check_sizes(0.8, family);
}

twice! {
    Ends: (s: [_; self.nodes]) { pub m: f64, pub k: f64, pub a: f64, pub b: f64 }
    Ends7: (s: [_; 7]) { pub m: f64, pub k: f64, pub a: f64, pub b: f64 } = 7;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| if i < 2 || i + 2 >= self.n() { self.a } else { self.m } * 0.5 * q.s[i].dt().powi(2))
                .sum()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.n() {
                if i + 1 < self.n() {
                    sum += 0.5 * self.k * (q.s[i + 1] - q.s[i]).powi(2);
                }
                if i == 0 {
                    sum += self.b * q.s[i];
                } else if i >= 2 {
                    sum -= 0.1 * self.k * (q.s[i] - q.s[i - 2]).sin();
                }
            }
            sum
        }
    }
}

#[test]
fn ends_of_two_nodes() {
    let (m, k, a, b) = (0.4, 7.0, 0.9, 2.0);
    let family = |nodes| Ends { nodes, m, k, a, b };
    compare(&family(7), &Ends7 { m, k, a, b }, 0.8);
    check_sizes(0.8, family);
}

twice! {
    #[inputs(field, shake)]
    Driven: (s: [_; self.nodes], hub) { pub m: f64, pub k: f64, pub omega: f64 }
    Driven5: (s: [_; 5], hub) { pub m: f64, pub k: f64, pub omega: f64 } = 5;
    {
        #[lagrangian]
        fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
            let beads: Expr = (0..self.n())
                .map(|i| {
                    let across = q.s[i] - q.hub + 0.1 * (self.omega * q.t).sin();
                    0.5 * self.m * (q.s[i].dt() + 0.3 * q.hub.dt()).powi(2)
                        - 0.5 * self.k * across.powi(2)
                        + q.field * (q.s[i] - 0.2 * i as f64).cos()
                })
                .sum();
            beads + 0.5 * self.m * q.hub.dt().powi(2)
        }
        #[force]
        fn shake(&self, q: &Coordinates<Self>) -> Force {
            let mut sum = Force::ZERO;
            for i in 0..self.n() {
                sum += Force::along(q.s[i], q.shake * (self.omega * q.t + i as f64).cos());
            }
            sum
        }
        #[dissipation]
        fn rub(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| 0.1 * self.k * (q.s[i].dt() - q.hub.dt()).powi(4)).sum()
        }
    }
}

#[test]
fn driven_by_time_and_inputs() {
    let (m, k, omega) = (0.6, 4.0, 2.5);
    let (family, literal) = (Driven { nodes: 5, m, k, omega }, Driven5 { m, k, omega });
    compare_with(&family, &literal, 0.7, |state| {
        let u = dynamics::model::ModelState::u(state);
        let kinetic = 0.5 * u.dot(&(literal.mass_matrix(state) * u));
        EnergyParts { kinetic, potential: literal.energy_function(state) - kinetic }
    });
}

twice! {
    Sums: (s: [_; self.nodes], r: [_; self.nodes]) { pub m: f64, pub a: f64, pub b: f64 }
    Sums6: (s: [_; 6], r: [_; 6]) { pub m: f64, pub a: f64, pub b: f64 } = 6;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let squares: Expr = (0..self.n()).map(|i| q.s[i].dt().powi(2) + q.r[i].dt().powi(2)).sum();
            0.5 * self.m * squares
        }
        #[potential]
        fn differences(&self, q: &Coordinates<Self>) -> Expr {
            let tight: Expr = (0..self.n() - 1).map(|i| (q.s[i + 1] - q.s[i]).powi(2)).sum();
            let loose: Expr = (0..self.n()).map(|i| (q.s[i] * q.r[i]).cos()).sum();
            self.a * (tight - loose) / 2.0 - 3.0 * self.b
        }
        #[potential]
        fn negative(&self, q: &Coordinates<Self>) -> Expr {
            let far: Expr = (0..self.n() - 3).map(|i| (1.0 + (q.r[i + 3] - q.r[i]).powi(2)).sqrt()).sum();
            let mut both = q.s[0] - q.r[2];
            for i in 1..self.n() - 1 {
                both -= self.b * q.s[i + 1] * q.r[i - 1];
            }
            -(far * self.b) + both
        }
        /// A selection by the motion, and one by the index.
        #[potential]
        fn stops(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| {
                    let into = q.s[i] - 0.1;
                    let stiff = if i == self.n() - 1 { 2.0 * self.a } else { self.a };
                    if into > 0.0 { stiff * into.powi(3) } else { 0.5 * stiff * into.powi(4) }
                })
                .sum()
        }
        #[force]
        fn circulating(&self, q: &Coordinates<Self>) -> Force {
            let all: Force = (0..self.n()).map(|i| Force::along(q.s[i], self.b * q.r[i])).sum();
            all - Force::along(q.r[1], self.b * q.s[2]) + 2.0 * Force::along(q.s[0], self.a)
        }
    }
}

#[test]
fn sums_of_sums() {
    let (m, a, b) = (0.6, 4.0, 2.5);
    compare(&Sums { nodes: 6, m, a, b }, &Sums6 { m, a, b }, 0.7);
}

/// A user's own smooth function.
#[derive(Clone, Debug)]
pub struct Ripple {
    pub wave_number: f64,
}

impl dynamics::SmoothFunction for Ripple {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let k = self.wave_number;
        let (s, c) = (k * x).sin_cos();
        [s, k * c, -k * k * s, -k * k * k * c]
    }
}

twice! {
    OnTrack: (s: [_; self.nodes]) { pub m: f64, pub k: f64, pub track: Ripple }
    OnTrack4: (s: [_; 4]) { pub m: f64, pub k: f64, pub track: Ripple } = 4;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| 0.5 * self.m * q.s[i].dt().powi(2)).sum()
        }
        #[potential]
        fn height(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| self.k * self.track.at(q.s[i] + i as f64)).sum()
        }
        #[potential]
        fn couplings(&self, q: &Coordinates<Self>) -> Expr {
            (1..self.n()).map(|i| self.k * (1.0 - (q.s[i] - q.s[i - 1]).cos())).sum()
        }
    }
}

#[test]
fn smooth_function_in_an_element() {
    let (m, k) = (0.6, 4.0);
    let track = Ripple { wave_number: 1.7 };
    let family = |nodes| OnTrack { nodes, m, k, track: track.clone() };
    compare(&family(4), &OnTrack4 { m, k, track: track.clone() }, 0.7);
    check_sizes(0.7, family);
}
