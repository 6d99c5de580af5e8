//! Mechanisms with closed loops: the models, and what is written by hand for them, parameters folded into the
//! code.
//!
//! By hand twice: as the textbooks have it, M, Q, Φ_q and γ entered into the whole matrix, which is factored
//! with pivoting; and as one would do it for speed, loop by loop, with one coordinate left.

use dynamics::prelude::*;
use nalgebra::{SMatrix, SVector};

#[path = "../../tests/models/andrews.rs"]
pub(crate) mod andrews;

use super::real::{Real, Standard};
use andrews::PUBLISHED;

/// A slider-crank with a rod of given mass and inertia: crank, rod, slider.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta, phi, x)]
pub(crate) struct SliderCrank {
    pub(crate) m: [f64; 3],
    pub(crate) l: [f64; 2],
    pub(crate) i: [f64; 2],
    pub(crate) g: f64,
}

#[dynamics]
impl SliderCrank {
    fn on_crank(&self, q: &Coordinates<Self>, r: f64) -> Vec2 {
        r * vec2(q.theta.cos(), q.theta.sin())
    }
    fn on_rod(&self, q: &Coordinates<Self>, r: f64) -> Vec2 {
        self.on_crank(q, self.l[0]) + r * vec2(q.phi.cos(), q.phi.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let rod = self.on_rod(q, 0.5 * self.l[1]);
        0.5 * self.i[0] * q.theta.dt().powi(2)
            + 0.5 * self.m[1] * rod.dt().norm_squared()
            + 0.5 * self.i[1] * q.phi.dt().powi(2)
            + 0.5 * self.m[2] * q.x.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let crank = self.on_crank(q, 0.5 * self.l[0]);
        let rod = self.on_rod(q, 0.5 * self.l[1]);
        self.g * (self.m[0] * crank.y + self.m[1] * rod.y)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.on_rod(q, self.l[1]) - vec2(q.x, 0.0)
    }
}

const M: [f64; 7] = PUBLISHED.m;
const I: [f64; 7] = PUBLISHED.i;
const B: [f64; 2] = PUBLISHED.b;
const C: [f64; 2] = PUBLISHED.c;
const D: f64 = PUBLISHED.d;
const DA: f64 = PUBLISHED.da;
const E: f64 = PUBLISHED.e;
const EA: f64 = PUBLISHED.ea;
const RR: f64 = PUBLISHED.rr;
const RA: f64 = PUBLISHED.ra;
const SS: f64 = PUBLISHED.ss;
const SA: f64 = PUBLISHED.sa;
const SB: f64 = PUBLISHED.sb;
const SC: f64 = PUBLISHED.sc;
const SD: f64 = PUBLISHED.sd;
const TA: f64 = PUBLISHED.ta;
const TB: f64 = PUBLISHED.tb;
const U: f64 = PUBLISHED.u;
const UA: f64 = PUBLISHED.ua;
const UB: f64 = PUBLISHED.ub;
const ZF: f64 = PUBLISHED.zf;
const ZT: f64 = PUBLISHED.zt;
const FA: f64 = PUBLISHED.fa;
const C0: f64 = PUBLISHED.c0;
const L0: f64 = PUBLISHED.l0;
const MOMENT: f64 = PUBLISHED.moment;

/// M (only where it is not zero), Q, sines and cosines, as published.
struct Published<T> {
    /// M by rows: (β, β), (Θ, β), (Θ, Θ), (γ, γ), then the pairs (Φ, δ) and (Ω, ε) likewise.
    m: [T; 10],
    q: [T; 7],
    /// Sine and cosine of β, β + Θ, γ, δ, Φ + δ, ε, Ω + ε.
    angles: [(T, T); 7],
}

#[inline(always)]
fn published<T: Real>(q: &[T; 7], u: &[T; 7]) -> Published<T> {
    let k = T::of;
    let [beta, theta, gamma, phi, delta, omega, epsilon] = T::sin_cos(*q);
    // sin and cos of sums by products: seven pairs in all.
    let both = |a: (T, T), b: (T, T)| (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0);
    let lever2 = k(M[1]) * k(DA) * k(RR);
    let (arm4, arm6) = (k(E) - k(EA), k(ZF) - k(FA));
    let lever4 = k(M[3]) * k(ZT) * arm4;
    let lever6 = k(M[5]) * k(U) * arm6;
    let m22 = k(M[1]) * k(DA) * k(DA) + k(I[1]);
    let m44 = k(M[3]) * arm4 * arm4 + k(I[3]);
    let m66 = k(M[5]) * arm6 * arm6 + k(I[5]);
    let (c2, s4, s6) = (lever2 * theta.1, lever4 * phi.0, lever6 * omega.0);
    let two = k(2.0);
    let m = [
        k(M[0]) * k(RA) * k(RA) + k(I[0]) + k(M[1]) * k(RR) * k(RR) + m22 - two * c2,
        m22 - c2,
        m22,
        k(M[2]) * (k(SA) * k(SA) + k(SB) * k(SB)) + k(I[2]),
        m44,
        m44 + s4,
        m44 + k(M[3]) * k(ZT) * k(ZT) + k(M[4]) * (k(TA) * k(TA) + k(TB) * k(TB)) + k(I[4]) + two * s4,
        m66,
        m66 - s6,
        m66 + k(M[5]) * k(U) * k(U) + k(M[6]) * (k(UA) * k(UA) + k(UB) * k(UB)) + k(I[6]) - two * s6,
    ];
    let (sd, sc) = (k(SD), k(SC));
    let (across, along) = (sd * gamma.1 + sc * gamma.0, sd * gamma.0 - sc * gamma.1);
    let (x, y) = (k(B[0]) + across - k(C[0]), k(B[1]) + along - k(C[1]));
    let length = (x * x + y * y).sqrt();
    let pull = -k(C0) * (length - k(L0)) / length;
    let force = [
        k(MOMENT) - lever2 * u[1] * (u[1] + two * u[0]) * theta.0,
        lever2 * u[0] * u[0] * theta.0,
        pull * (y * across - x * along),
        lever4 * u[4] * u[4] * phi.1,
        -lever4 * u[3] * (u[3] + two * u[4]) * phi.1,
        -lever6 * u[6] * u[6] * omega.1,
        lever6 * u[5] * (u[5] + two * u[6]) * omega.1,
    ];
    let angles = [beta, both(beta, theta), gamma, delta, both(phi, delta), epsilon, both(omega, epsilon)];
    Published { m, q: force, angles }
}

/// d/dq of the point E as four bodies have it, and its centripetal acceleration: (by the first coordinate, by
/// the second, v̇ at q̈ = 0).
type Point<T> = [[T; 2]; 3];

/// E on bodies 2, 3, 4, 6 from the sines and cosines.
#[inline(always)]
fn points<T: Real>(angles: &[(T, T); 7], u: &[T; 7]) -> [Point<T>; 4] {
    let k = T::of;
    let [beta, second, gamma, delta, fourth, epsilon, sixth] = *angles;
    let (w2, w4, w6) = (u[0] + u[1], u[3] + u[4], u[5] + u[6]);
    let (w2, w4, w6) = (w2 * w2, w4 * w4, w6 * w6);
    let (b, g, d, e) = (u[0] * u[0], u[2] * u[2], u[4] * u[4], u[6] * u[6]);
    let (rod, rr, ss, el, zt, zf, uu) = (k(D), k(RR), k(SS), k(E), k(ZT), k(ZF), k(U));
    let t = [rod * second.0, -rod * second.1];
    let p = [el * fourth.1, el * fourth.0];
    let o = [-zf * sixth.0, zf * sixth.1];
    [
        [
            [t[0] - rr * beta.0, t[1] + rr * beta.1],
            t,
            [rod * second.1 * w2 - rr * beta.1 * b, rod * second.0 * w2 - rr * beta.0 * b],
        ],
        [[ss * gamma.1, ss * gamma.0], [k(0.0); 2], [-ss * gamma.0 * g, ss * gamma.1 * g]],
        [
            p,
            [p[0] - zt * delta.0, p[1] + zt * delta.1],
            [-el * fourth.0 * w4 - zt * delta.1 * d, el * fourth.1 * w4 - zt * delta.0 * d],
        ],
        [
            o,
            [o[0] + uu * epsilon.1, o[1] + uu * epsilon.0],
            [-zf * sixth.1 * w6 - uu * epsilon.0 * e, -zf * sixth.0 * w6 + uu * epsilon.1 * e],
        ],
    ]
}

/// The whole 13 × 13 matrix, factored with pivoting.
#[inline(always)]
pub(crate) fn andrews_whole(q: &[Standard; 7], u: &[Standard; 7]) -> [Standard; 7] {
    let Published { m, q: force, angles } = published(q, u);
    let points = points(&angles, u).map(|point| point.map(|row| row.map(Real::to_f64)));
    let [two, three, four, six] = points;
    let m = m.map(Real::to_f64);
    let mut a = SMatrix::<f64, 13, 13>::zeros();
    let mut b = SVector::<f64, 13>::zeros();
    for (first, k) in [(0, 0), (3, 4), (5, 7)] {
        a[(first, first)] = m[k];
        a[(first + 1, first)] = m[k + 1];
        a[(first, first + 1)] = m[k + 1];
        a[(first + 1, first + 1)] = m[k + 2];
    }
    a[(2, 2)] = m[3];
    for (i, f) in force.iter().enumerate() {
        b[i] = f.to_f64();
    }
    for (k, (other, first, second)) in [(three, 2, 2), (four, 3, 4), (six, 5, 6)].into_iter().enumerate() {
        for axis in 0..2 {
            let row = 7 + 2 * k + axis;
            let mut entries =
                [(0, two[0][axis]), (1, two[1][axis]), (first, -other[0][axis]), (second, -other[1][axis])];
            if first == second {
                entries[3] = entries[2];
            }
            for (column, entry) in entries {
                a[(row, column)] = entry;
                a[(column, row)] = -entry;
            }
            b[row] = other[2][axis] - two[2][axis];
        }
    }
    let x = a.lu().solve(&b).unwrap_or(SVector::repeat(f64::NAN));
    core::array::from_fn(|i| Standard::of(x[i]))
}

/// Loop by loop: β leads, E and body 3 follow, then bodies 4 and 5, then 6 and 7.
#[inline(always)]
pub(crate) fn andrews_loops<T: Real>(q: &[T; 7], u: &[T; 7]) -> [T; 7] {
    let Published { m, q: force, angles } = published(q, u);
    let [two, three, four, six] = points(&angles, u);
    let (zero, one) = (T::of(0.0), T::of(1.0));
    // x with [a b] x = r.
    let solve = |a: [T; 2], b: [T; 2], inverse: T, r: [T; 2]| {
        [(r[0] * b[1] - r[1] * b[0]) * inverse, (a[0] * r[1] - a[1] * r[0]) * inverse]
    };
    let inverse = |a: [T; 2], b: [T; 2]| one / (a[0] * b[1] - a[1] * b[0]);
    let by = |a: [T; 2], k: T, b: [T; 2]| [a[0] + k * b[0], a[1] + k * b[1]];
    // Θ and γ by β, and at β̈ = 0.
    let minus = [-three[0][0], -three[0][1]];
    let det = inverse(two[1], minus);
    let r1 = solve(two[1], minus, det, [-two[0][0], -two[0][1]]);
    let s1 = solve(two[1], minus, det, [three[2][0] - two[2][0], three[2][1] - two[2][1]]);
    // The acceleration of E by β, and at β̈ = 0.
    let e = by(two[0], r1[0], two[1]);
    let drift = by(two[2], s1[0], two[1]);
    let follow = |p: &Point<T>| {
        let det = inverse(p[0], p[1]);
        let rest = [drift[0] - p[2][0], drift[1] - p[2][1]];
        (solve(p[0], p[1], det, e), solve(p[0], p[1], det, rest))
    };
    let ((r2, s2), (r3, s3)) = (follow(&four), follow(&six));
    let r = [one, r1[0], r1[1], r2[0], r2[1], r3[0], r3[1]];
    let s = [zero, s1[0], s1[1], s2[0], s2[1], s3[0], s3[1]];
    let times = |x: &[T; 7]| {
        [
            m[0] * x[0] + m[1] * x[1],
            m[1] * x[0] + m[2] * x[1],
            m[3] * x[2],
            m[4] * x[3] + m[5] * x[4],
            m[5] * x[3] + m[6] * x[4],
            m[7] * x[5] + m[8] * x[6],
            m[8] * x[5] + m[9] * x[6],
        ]
    };
    let (mr, ms) = (times(&r), times(&s));
    let (mut inertia, mut driving) = (zero, zero);
    for i in 0..7 {
        inertia = inertia + r[i] * mr[i];
        driving = driving + r[i] * (force[i] - ms[i]);
    }
    let a = driving / inertia;
    core::array::from_fn(|i| r[i] * a + s[i])
}

const CRANK: [f64; 2] = [0.5, 1.2];
const MASS: [f64; 3] = [1.0, 1.5, 2.0];
const INERTIA: [f64; 2] = [MASS[0] * CRANK[0] * CRANK[0] / 3.0, MASS[1] * CRANK[1] * CRANK[1] / 12.0];
const GRAVITY: f64 = 9.81;

/// The slider-crank with the numbers that are folded into the functions below.
pub(crate) fn slider_crank() -> SliderCrank {
    SliderCrank { m: MASS, l: CRANK, i: INERTIA, g: GRAVITY }
}

/// Where it is put together.
pub(crate) const SLIDER_START: [f64; 3] = [0.7, -0.271_814_676_3, 1.538_345_8];

/// M of θ and φ, Q of θ and φ, Φ_q by θ and φ, γ.
type Slider<T> = ([T; 3], [T; 2], [[T; 2]; 2], [T; 2]);

#[inline(always)]
fn slider<T: Real>(q: &[T; 3], u: &[T; 3]) -> Slider<T> {
    let [m1, m2] = [T::of(MASS[0]), T::of(MASS[1])];
    let [l1, l2] = CRANK.map(T::of);
    let [i1, i2] = INERTIA.map(T::of);
    let (half, g) = (T::of(0.5), T::of(GRAVITY));
    let middle = half * l2;
    let lever = m2 * l1 * middle;
    let [(s, c), (sp, cp)] = T::sin_cos([q[0], q[1]]);
    let (cos, sin) = (c * cp + s * sp, s * cp - c * sp);
    let (w, v) = (u[0] * u[0], u[1] * u[1]);
    let m = [i1 + m2 * l1 * l1, lever * cos, i2 + m2 * middle * middle];
    let force = [-(lever * sin) * v - (half * m1 + m2) * l1 * g * c, lever * sin * w - m2 * middle * g * cp];
    let by = [[-(l1 * s), -(l2 * sp)], [l1 * c, l2 * cp]];
    let gamma = [by[1][0] * w + by[1][1] * v, -(by[0][0] * w) - by[0][1] * v];
    (m, force, by, gamma)
}

/// The whole 5 × 5 matrix, factored with pivoting.
#[inline(always)]
pub(crate) fn slider_whole(q: &[Standard; 3], u: &[Standard; 3]) -> [Standard; 3] {
    let (m, force, by, gamma) = slider(q, u);
    let (m, force) = (m.map(Real::to_f64), force.map(Real::to_f64));
    let (by, gamma) = (by.map(|row| row.map(Real::to_f64)), gamma.map(Real::to_f64));
    #[rustfmt::skip]
    let a = SMatrix::<f64, 5, 5>::new(
        m[0], m[1], 0.0, -by[0][0], -by[1][0],
        m[1], m[2], 0.0, -by[0][1], -by[1][1],
        0.0, 0.0, MASS[2], 1.0, 0.0,
        by[0][0], by[0][1], -1.0, 0.0, 0.0,
        by[1][0], by[1][1], 0.0, 0.0, 0.0,
    );
    let b = SVector::<f64, 5>::new(force[0], force[1], 0.0, gamma[0], gamma[1]);
    let x = a.lu().solve(&b).unwrap_or(SVector::repeat(f64::NAN));
    [x[0], x[1], x[2]].map(Standard::of)
}

/// The crank leads, the rod follows, then the slider.
#[inline(always)]
pub(crate) fn slider_loops<T: Real>(q: &[T; 3], u: &[T; 3]) -> [T; 3] {
    let (m, force, by, gamma) = slider(q, u);
    let (one, two, m3) = (T::of(1.0), T::of(2.0), T::of(MASS[2]));
    let inverse = one / by[1][1];
    let (rod, drift) = (-by[1][0] * inverse, gamma[1] * inverse);
    let (slide, along) = (by[0][0] + by[0][1] * rod, by[0][1] * drift - gamma[0]);
    let inertia = m[0] + rod * (two * m[1] + rod * m[2]) + m3 * slide * slide;
    let driving = force[0] - m[1] * drift + rod * (force[1] - m[2] * drift) - m3 * slide * along;
    let a = driving / inertia;
    [a, rod * a + drift, slide * a + along]
}
