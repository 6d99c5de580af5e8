//! Andrews' squeezing mechanism: seven bodies, seven angles, three closed loops; Giles 1978; Schiehlen (ed.),
//! Multibody Systems Handbook 1990; Hairer & Wanner, Solving ODE II, VII.7; Test Set for IVP Solvers. The
//! tests and the benchmarks of evaluation include this file.

use dynamics::prelude::*;

/// A motor at O turns K₁; four loops of rods move the point D against a spring. Names as in the Test Set.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(beta: rad, theta: rad, gamma: rad, phi: rad, delta: rad, omega: rad, epsilon: rad)]
#[units(
    m: kg, i: kg * m^2, a: m, b: m, c: m, d: m, da: m, e: m, ea: m, rr: m, ra: m, ss: m, sa: m, sb: m,
    sc: m, sd: m, ta: m, tb: m,
    u: m, ua: m, ub: m, zf: m, zt: m, fa: m, c0: N / m, l0: m, moment: N * m
)]
pub(crate) struct Andrews {
    /// Masses of the bodies 1 to 7.
    pub(crate) m: [f64; 7],
    /// Their central moments of inertia.
    pub(crate) i: [f64; 7],
    /// The bearings A and B and the spring's end C; O is the origin.
    pub(crate) a: [f64; 2],
    pub(crate) b: [f64; 2],
    pub(crate) c: [f64; 2],
    pub(crate) d: f64,
    pub(crate) da: f64,
    pub(crate) e: f64,
    pub(crate) ea: f64,
    pub(crate) rr: f64,
    pub(crate) ra: f64,
    pub(crate) ss: f64,
    pub(crate) sa: f64,
    pub(crate) sb: f64,
    pub(crate) sc: f64,
    pub(crate) sd: f64,
    pub(crate) ta: f64,
    pub(crate) tb: f64,
    pub(crate) u: f64,
    pub(crate) ua: f64,
    pub(crate) ub: f64,
    pub(crate) zf: f64,
    pub(crate) zt: f64,
    pub(crate) fa: f64,
    pub(crate) c0: f64,
    pub(crate) l0: f64,
    pub(crate) moment: f64,
}

#[dynamics]
impl Andrews {
    /// The end of the crank.
    fn f(&self, q: &Coordinates<Self>) -> Vec2 {
        self.rr * vec2(q.beta.cos(), q.beta.sin())
    }
    /// The direction of body 2.
    fn along2(&self, q: &Coordinates<Self>) -> Vec2 {
        let angle = q.beta + q.theta;
        vec2(angle.cos(), angle.sin())
    }
    /// The direction of body 4.
    fn along4(&self, q: &Coordinates<Self>) -> Vec2 {
        let angle = q.phi + q.delta;
        vec2(angle.sin(), -angle.cos())
    }
    /// The direction of body 6.
    fn along6(&self, q: &Coordinates<Self>) -> Vec2 {
        let angle = q.omega + q.epsilon;
        vec2(angle.cos(), angle.sin())
    }
    fn g(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.a[0], self.a[1]) + self.zt * vec2(q.delta.cos(), q.delta.sin())
    }
    fn h(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.a[0], self.a[1]) + self.u * vec2(q.epsilon.sin(), -q.epsilon.cos())
    }
    /// A point of body 3: `along` and `across` from B.
    fn on3(&self, q: &Coordinates<Self>, along: f64, across: f64) -> Vec2 {
        let (s, c) = q.gamma.sin_cos();
        vec2(self.b[0], self.b[1]) + along * vec2(s, -c) + across * vec2(c, s)
    }
    /// The joint E, as reached by bodies 2, 3, 4 and 6.
    fn e2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.f(q) - self.d * self.along2(q)
    }
    fn e3(&self, q: &Coordinates<Self>) -> Vec2 {
        self.on3(q, self.ss, 0.0)
    }
    fn e4(&self, q: &Coordinates<Self>) -> Vec2 {
        self.g(q) + self.e * self.along4(q)
    }
    fn e6(&self, q: &Coordinates<Self>) -> Vec2 {
        self.h(q) + self.zf * self.along6(q)
    }
    /// The centres of mass.
    fn centres(&self, q: &Coordinates<Self>) -> [Vec2; 7] {
        let (sd, cd) = q.delta.sin_cos();
        let (se, ce) = q.epsilon.sin_cos();
        let a = vec2(self.a[0], self.a[1]);
        [
            self.ra * vec2(q.beta.cos(), q.beta.sin()),
            self.f(q) - self.da * self.along2(q),
            self.on3(q, self.sa, self.sb),
            self.g(q) + (self.e - self.ea) * self.along4(q),
            a + self.ta * vec2(cd, sd) + self.tb * vec2(-sd, cd),
            self.h(q) + (self.zf - self.fa) * self.along6(q),
            a + self.ua * vec2(se, -ce) - self.ub * vec2(ce, se),
        ]
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let centres = self.centres(q);
        let angles =
            [q.beta, q.beta + q.theta, q.gamma, q.phi + q.delta, q.delta, q.omega + q.epsilon, q.epsilon];
        let mut sum = Expr::ZERO;
        for k in 0..7 {
            sum +=
                0.5 * self.m[k] * centres[k].dt().norm_squared() + 0.5 * self.i[k] * angles[k].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        let length = (self.on3(q, self.sc, self.sd) - vec2(self.c[0], self.c[1])).norm();
        0.5 * self.c0 * (length - self.l0).powi(2)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.beta, self.moment)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> [Vec2; 3] {
        let e = self.e2(q);
        [e - self.e3(q), e - self.e4(q), e - self.e6(q)]
    }
}

/// The published parameters.
pub(crate) const PUBLISHED: Andrews = Andrews {
    m: [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498],
    i: [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5],
    a: [-0.06934, -0.00227],
    b: [-0.03635, 0.03273],
    c: [0.014, 0.072],
    d: 28e-3,
    da: 115e-4,
    e: 2e-2,
    ea: 1421e-5,
    rr: 7e-3,
    ra: 92e-5,
    ss: 35e-3,
    sa: 1874e-5,
    sb: 1043e-5,
    sc: 18e-3,
    sd: 2e-2,
    ta: 2308e-5,
    tb: 916e-5,
    u: 4e-2,
    ua: 1228e-5,
    ub: 449e-5,
    zf: 2e-2,
    zt: 4e-2,
    fa: 1421e-5,
    c0: 4530.0,
    l0: 7785e-5,
    moment: 33e-3,
};

/// Where it starts, at rest.
#[allow(clippy::excessive_precision, reason = "as published")]
pub(crate) const START: [f64; 7] = [
    -0.0617138900142764496,
    0.0,
    0.455279819163070380,
    0.222668390165885885,
    0.487364979543842550,
    -0.222668390165885885,
    1.230547444549821192,
];
