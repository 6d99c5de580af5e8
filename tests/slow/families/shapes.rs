//! Shapes of models, and ways of writing them.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::families::model::{EnergyParts, FamilyModel as _};
use dynamics::model::{Dynamics as _, ModelState as _};
use dynamics::prelude::*;

use super::harness::{check_alone, check_sizes, compare, compare_with, twice};

/// Two ropes, tied to each other.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [m; self.left], b: [m; self.right], knot: m)]
#[units(mass: kg, k: N / m, tie: N / m)]
pub struct Ropes {
    pub left: usize,
    pub right: usize,
    pub mass: f64,
    pub k: f64,
    pub tie: f64,
}

#[dynamics]
impl Ropes {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let a: Expr = (0..self.left).map(|i| 0.5 * self.mass * q.a[i].dt().powi(2)).sum();
        let b: Expr = (0..self.right).map(|i| 0.25 * self.mass * q.b[i].dt().powi(2)).sum();
        a + b + 0.5 * self.mass * q.knot.dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.k * q.a[0].powi(2);
        for i in 1..self.left {
            sum += 0.5 * self.k * (q.a[i] - q.a[i - 1]).powi(2);
        }
        for j in 0..self.right - 1 {
            sum += 0.25 * self.k * (q.b[j + 1] - q.b[j]).powi(2);
        }
        sum
    }
    #[potential]
    fn ties(&self, q: &Coordinates<Self>) -> Expr {
        let (end, start) = (q.a[self.left - 1], q.b[0]);
        0.5 * self.tie * ((q.knot - end).powi(2) + (start - q.knot).powi(2))
    }
}

#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [m; 4], b: [m; 6], knot: m)]
#[units(mass: kg, k: N / m, tie: N / m)]
pub struct Ropes46 {
    pub mass: f64,
    pub k: f64,
    pub tie: f64,
}

#[dynamics]
impl Ropes46 {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.mass * q.knot.dt().powi(2);
        for a in q.a {
            sum += 0.5 * self.mass * a.dt().powi(2);
        }
        for b in q.b {
            sum += 0.25 * self.mass * b.dt().powi(2);
        }
        sum
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.k * q.a[0].powi(2);
        for i in 1..4 {
            sum += 0.5 * self.k * (q.a[i] - q.a[i - 1]).powi(2);
        }
        for j in 1..6 {
            sum += 0.25 * self.k * (q.b[j] - q.b[j - 1]).powi(2);
        }
        sum + 0.5 * self.tie * ((q.knot - q.a[3]).powi(2) + (q.b[0] - q.knot).powi(2))
    }
}

#[test]
fn two_counts() {
    let (mass, k, tie) = (0.4, 7.0, 3.0);
    compare(&Ropes { left: 4, right: 6, mass, k, tie }, &Ropes46 { mass, k, tie }, 0.5);
    for (left, right) in [(1, 1), (1, 300), (256, 1), (257, 255), (3, 1000)] {
        check_alone(&Ropes { left, right, mass, k, tie }, 0.5);
    }
    let error = Ropes { left: 3, right: 0, mass, k, tie }.ends().unwrap_err();
    assert_eq!(error.to_string(), "`right` is 0; this model needs at least 1");
}

twice! {
    #[inputs(torque: N * m, shake: N * m)]
    #[units(inertia: kg * m^2, k: N * m, play: rad, c: N * m * s)]
    Shaft: (theta: [rad; self.nodes]) {
        pub inertia: Vec<f64>, pub k: Vec<f64>, pub play: f64, pub c: f64,
    }
    Shaft6: (theta: [rad; 6]) {
        pub inertia: [f64; 6], pub k: [f64; 5], pub play: f64, pub c: f64,
    } = 6;
    {
        fn twist(&self, q: &Coordinates<Self>, i: usize) -> Expr {
            q.theta[i + 1] - q.theta[i]
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n()).map(|i| 0.5 * self.inertia[i] * q.theta[i].dt().powi(2)).sum()
        }
        /// The last coupling has play.
        #[potential]
        fn couplings(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n() - 1)
                .map(|i| {
                    let twist = self.twist(q, i);
                    if i == self.n() - 2 {
                        let beyond = twist.abs() - self.play;
                        if beyond > 0.0 { 0.5 * self.k[i] * beyond.powi(2) } else { 0.0 * self.k[i] * beyond }
                    } else {
                        0.5 * self.k[i] * twist.powi(2)
                    }
                })
                .sum()
        }
        #[dissipation]
        fn material(&self, q: &Coordinates<Self>) -> Expr {
            (1..self.n()).map(|i| 0.5 * self.c * self.twist(q, i - 1).dt().powi(2)).sum()
        }
        #[force]
        fn motor(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.theta[0], q.torque) - Force::along(self.twist(q, self.n() - 2), q.shake)
        }
        #[output]
        fn speed(&self, q: &Coordinates<Self>) -> Expr {
            q.theta[self.n() - 1].dt()
        }
    }
}

#[test]
fn shaft_with_discs() {
    let (play, c) = (0.1, 0.3);
    let inertia = |i: usize| 0.3 + 0.1 * (i % 7) as f64;
    let k = |i: usize| 3.0 + (i % 5) as f64;
    let family = |nodes: usize| Shaft {
        nodes,
        inertia: (0..nodes).map(inertia).collect(),
        k: (0..nodes.max(1) - 1).map(k).collect(),
        play,
        c,
    };
    let literal = Shaft6 { inertia: std::array::from_fn(inertia), k: std::array::from_fn(k), play, c };
    compare(&family(6), &literal, 0.7);
    check_sizes(0.7, family);
}

twice! {
    Lattice: (s: [_; self.nodes]) { pub m: f64, pub omega: f64 }
    Lattice7: (s: [_; 7]) { pub m: f64, pub omega: f64 } = 7;
    {
        const NEAR: f64 = 3.0;
        const FAR: f64 = 0.5;
        const LAST: usize = 1;
        const REACH: usize = 2;

        /// The ends move.
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Expr {
            if i == 0 {
                0.1 * (self.omega * q.t).sin()
            } else if i == self.n() + 1 {
                Expr::from(0.2) * q.t
            } else {
                q.s[i - 1]
            }
        }
        fn spring(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
            let stretch = self.place(q, j) - self.place(q, i);
            let stretch = stretch + 0.1 * stretch.powi(3);
            stretch * stretch
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let n = self.n();
            let mut sum = Expr::ZERO;
            for i in (0..n).rev() {
                let i = i + 1;
                sum += 0.5 * self.m * self.place(q, i).dt().powi(2);
            }
            sum
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            let near: Expr = (0..=self.n()).map(|i| self.spring(q, i, i + 1)).sum();
            let far: Expr = (0..self.n()).map(|i| self.spring(q, i, i + Self::REACH)).sum();
            0.5 * (Self::NEAR * near + Self::FAR * far)
        }
        #[potential]
        fn nothing(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 3..3 {
                sum += q.s[i];
            }
            let empty: Expr = (self.n()..self.n()).map(|i| q.s[i]).sum();
            let end = q.s[self.n() - Self::LAST];
            sum + empty + 0.5 * end.powi(2)
        }
    }
}

#[test]
fn lattice_of_second_neighbours() {
    let (m, omega) = (0.4, 2.0);
    let family = |nodes| Lattice { nodes, m, omega };
    compare(&family(7), &Lattice7 { m, omega }, 0.5);
    check_sizes(0.5, family);
}

twice! {
    Written: (s: [_; self.nodes], phi: [rad; self.nodes - 1]) { pub m: f64, pub k: f64 }
    Written6: (s: [_; 6], phi: [rad; 5]) { pub m: f64, pub k: f64 } = 6;
    {
        fn both(&self, q: &Coordinates<Self>, i: usize) -> (Expr, Expr) {
            let (a, b) = if i == 0 { (q.s[0], q.s[1]) } else { (q.s[i], q.s[i - 1]) };
            (a + b, a - b)
        }
        fn left(&self, i: usize) -> usize {
            i - 1
        }
        fn square(&self, x: Expr) -> Expr {
            x * x
        }
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            vec2(q.s[i].cos(), i as f64 + q.s[i])
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let last = self.n() - 1;
            let mut sum = 0.25 * self.m * q.s[last].dt().powi(2);
            for i in 0..self.n() {
                if i + 1 == self.n() {
                    continue;
                }
                let inner = i > 0;
                let mass = if inner { self.m } else { 2.0 * self.m };
                sum += 0.5 * mass * (q.s[i].dt().powi(2) + q.phi[i].dt().powi(2));
            }
            sum
        }
        #[potential]
        fn pairs(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i: usize| -> Expr {
                    let (sum, difference) = self.both(q, i);
                    if i > 2 && i + 1 < self.n() || i == 1 {
                        return self.k * sum * difference;
                    }
                    let difference = 2.0 * difference;
                    0.5 * self.k * self.square(difference)
                })
                .sum()
        }
        #[potential]
        fn angles(&self, q: &Coordinates<Self>) -> Expr {
            let (mut inner_sum, mut direct_sum) = (Expr::ZERO, Expr::ZERO);
            for i in 1..self.n() {
                let triple = [q.s[i], q.s[self.left(i)], q.phi[i - 1]];
                let mut inner = Expr::ZERO;
                for (k, x) in triple.iter().enumerate() {
                    inner += (k as f64 + 1.0) * x.sin();
                }
                let direct: Expr = (0..2).map(|k| q.s[i - k].powi(2)).sum();
                inner_sum += inner;
                direct_sum += direct;
            }
            self.k * (inner_sum + 2.0 * direct_sum)
        }
        #[potential]
        fn center(&self, q: &Coordinates<Self>) -> Expr {
            let sum: Vec2 = (0..self.n()).map(|i| self.place(q, i)).sum();
            let center = sum / self.n() as f64;
            self.k * center.y - 0.1 * center.x
        }
        #[force]
        fn wind(&self, q: &Coordinates<Self>) -> Force {
            (0..self.n()).map(|i| Force::at(self.place(q, i), vec2(0.1 * i as f64, 0.2))).sum()
        }
    }
}

#[test]
fn ways_of_writing() {
    let (m, k) = (0.4, 2.0);
    compare(&Written { nodes: 6, m, k }, &Written6 { m, k }, 0.5);
}

twice! {
    Periodic: (s: [_; self.nodes], w: [_; self.nodes]) { pub m: f64, pub k: f64 }
    Periodic7: (s: [_; 7], w: [_; 7]) { pub m: f64, pub k: f64 } = 7;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..q.s.len()).map(|i| q.s[i].dt().powi(2) + q.w[i].dt().powi(2)).map(|v| 0.5 * self.m * v).sum()
        }
        /// Everyone pulls at the next one, and at the one after that; the last ones at the first ones.
        #[potential]
        fn around(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.n() {
                let next = (i + 1) % self.n();
                let after = if i + 2 >= self.n() { i + 2 - self.n() } else { i + 2 };
                sum += 0.5 * self.k * ((q.s[next] - q.s[i]).powi(2) + 0.1 * (q.w[after] - q.w[i]).powi(4));
                let left = if i == 0 { self.n() - 1 } else { i - 1 };
                sum += self.k * (q.w[left] * q.s[i]).cos();
            }
            sum
        }
        /// The branches add to the sum, one of them twice.
        #[potential]
        fn one_sided(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.n() {
                sum += q.s[i].powi(2);
                if q.s[i] > 0.0 {
                    sum += self.k * q.s[i].powi(4);
                } else if i > 0 {
                    sum -= q.s[i].powi(3);
                    sum += q.s[i - 1] * q.s[i].powi(2);
                }
            }
            sum
        }
        #[potential]
        fn windows(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..self.n() - 2 {
                let mut part = Expr::ZERO;
                for k in 0..3 {
                    part += q.s[i + k];
                }
                // Another variable of this name.
                let weight = {
                    let mut sum = q.w[i];
                    sum += 1.0;
                    sum
                };
                sum += self.k * (weight * part).powi(2);
            }
            for k in 1..3 {
                for i in 0..self.n() - k {
                    sum += 0.1 * (q.w[i + k] - q.w[i]).powi(2) / k as f64;
                }
            }
            sum
        }
        #[potential]
        fn many_ends(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| {
                    if i < 3 || i + 2 >= self.n() {
                        self.k * (i + 1) as f64 * q.s[i].powi(2)
                    } else {
                        self.k * q.s[i].powi(4)
                    }
                })
                .sum()
        }
        #[output]
        fn root_of_squares(&self, q: &Coordinates<Self>) -> Expr {
            let sum: Expr = (0..self.n()).map(|i| q.s[i].powi(2)).sum();
            sum.sqrt()
        }
    }
}

#[test]
fn around_and_from_branches() {
    let (m, k) = (0.4, 2.0);
    let family = |nodes| Periodic { nodes, m, k };
    compare(&family(7), &Periodic7 { m, k }, 0.5);
    check_sizes(0.5, family);
}

twice! {
    /// Beads on a belt that runs, as T and V.
    Belt: (s: [_; self.nodes]) { pub m: f64, pub k: f64, pub v: f64 }
    Belt5: (s: [_; 5]) { pub m: f64, pub k: f64, pub v: f64 } = 5;
    {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| 0.5 * (self.m + 0.1 * i as f64) * (q.s[i].dt() + self.v * q.s[i] + 1.0).powi(2))
                .sum()
        }
        #[potential]
        fn springs(&self, q: &Coordinates<Self>) -> Expr {
            (1..self.n()).map(|i| 0.5 * self.k * (q.s[i] - q.s[i - 1]).powi(2)).sum()
        }
    }
}

twice! {
    /// Particles of the plane in a magnetic field, as a Lagrangian.
    Charges: (x: [_; self.nodes], y: [_; self.nodes]) { pub m: f64, pub k: f64, pub b: f64 }
    Charges4: (x: [_; 4], y: [_; 4]) { pub m: f64, pub k: f64, pub b: f64 } = 4;
    {
        #[lagrangian]
        fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
            (0..self.n())
                .map(|i| {
                    let (x, y) = (q.x[i], q.y[i]);
                    0.5 * self.m * (x.dt().powi(2) + y.dt().powi(2)) + self.b * (x * y.dt() - y * x.dt())
                        - 0.5 * self.k * (x - 0.3 * i as f64).powi(4)
                })
                .sum()
        }
    }
}

#[test]
fn terms_linear_in_velocities() {
    let (m, k, v) = (0.4, 2.0, 0.7);
    let (family, literal) = (Belt { nodes: 5, m, k, v }, Belt5 { m, k, v });
    assert!(!Belt::CONSERVATIVE, "T + V varies, T - V has terms linear in velocities");
    let (t, potential) = (Belt5::kinetic, Belt5::springs);
    compare_with(&family, &literal, 0.5, |state| {
        let jets = <Belt5 as dynamics::model::Model>::coordinates_with(state, &Default::default(), &[]);
        EnergyParts { kinetic: t(&literal, &jets).value(), potential: potential(&literal, &jets).value() }
    });
    let (family, literal) = (Charges { nodes: 4, m, k, b: 0.6 }, Charges4 { m, k, b: 0.6 });
    assert!(Charges::CONSERVATIVE && Charges::VELOCITY_FORCES);
    compare_with(&family, &literal, 0.5, |state| {
        let kinetic = 0.5 * m * state.u().norm_squared();
        EnergyParts { kinetic, potential: literal.energy_function(state) - kinetic }
    });
}
