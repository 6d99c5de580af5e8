//! Andrews' mechanism by hand: loop by loop, constants folded. β leads, E and body 3 follow, then bodies 4
//! and 5, then 6 and 7 (numbers and names of the Test Set for IVP Solvers).

const M: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const I: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
const B: [f64; 2] = [-0.03635, 0.03273];
const C: [f64; 2] = [0.014, 0.072];
const D: f64 = 28e-3;
const DA: f64 = 115e-4;
const E: f64 = 2e-2;
const EA: f64 = 1421e-5;
const RR: f64 = 7e-3;
const RA: f64 = 92e-5;
const SS: f64 = 35e-3;
const SA: f64 = 1874e-5;
const SB: f64 = 1043e-5;
const SC: f64 = 18e-3;
const SD: f64 = 2e-2;
const TA: f64 = 2308e-5;
const TB: f64 = 916e-5;
const U: f64 = 4e-2;
const UA: f64 = 1228e-5;
const UB: f64 = 449e-5;
const ZF: f64 = 2e-2;
const ZT: f64 = 4e-2;
const FA: f64 = 1421e-5;
const C0: f64 = 4530.0;
const L0: f64 = 7785e-5;
const MOMENT: f64 = 33e-3;

/// M (only where it is not zero), Q, sines and cosines, as published.
struct Published {
    /// M by rows: (β, β), (Θ, β), (Θ, Θ), (γ, γ), then the pairs (Φ, δ) and (Ω, ε) likewise.
    m: [f64; 10],
    q: [f64; 7],
    /// Sine and cosine of β, β + Θ, γ, δ, Φ + δ, ε, Ω + ε.
    angles: [(f64, f64); 7],
}

#[inline(always)]
fn published(q: &[f64; 7], u: &[f64; 7]) -> Published {
    let [beta, theta, gamma, phi, delta, omega, epsilon] = q.map(f64::sin_cos);
    // sin and cos of sums by products: seven pairs in all.
    let both = |a: (f64, f64), b: (f64, f64)| (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0);
    let lever2 = M[1] * DA * RR;
    let (arm4, arm6) = (E - EA, ZF - FA);
    let lever4 = M[3] * ZT * arm4;
    let lever6 = M[5] * U * arm6;
    let m22 = M[1] * DA * DA + I[1];
    let m44 = M[3] * arm4 * arm4 + I[3];
    let m66 = M[5] * arm6 * arm6 + I[5];
    let (c2, s4, s6) = (lever2 * theta.1, lever4 * phi.0, lever6 * omega.0);
    let m = [
        M[0] * RA * RA + I[0] + M[1] * RR * RR + m22 - 2.0 * c2,
        m22 - c2,
        m22,
        M[2] * (SA * SA + SB * SB) + I[2],
        m44,
        m44 + s4,
        m44 + M[3] * ZT * ZT + M[4] * (TA * TA + TB * TB) + I[4] + 2.0 * s4,
        m66,
        m66 - s6,
        m66 + M[5] * U * U + M[6] * (UA * UA + UB * UB) + I[6] - 2.0 * s6,
    ];
    let (sd, sc) = (SD, SC);
    let (across, along) = (sd * gamma.1 + sc * gamma.0, sd * gamma.0 - sc * gamma.1);
    let (x, y) = (B[0] + across - C[0], B[1] + along - C[1]);
    let length = (x * x + y * y).sqrt();
    let pull = -C0 * (length - L0) / length;
    let force = [
        MOMENT - lever2 * u[1] * (u[1] + 2.0 * u[0]) * theta.0,
        lever2 * u[0] * u[0] * theta.0,
        pull * (y * across - x * along),
        lever4 * u[4] * u[4] * phi.1,
        -lever4 * u[3] * (u[3] + 2.0 * u[4]) * phi.1,
        -lever6 * u[6] * u[6] * omega.1,
        lever6 * u[5] * (u[5] + 2.0 * u[6]) * omega.1,
    ];
    let angles = [beta, both(beta, theta), gamma, delta, both(phi, delta), epsilon, both(omega, epsilon)];
    Published { m, q: force, angles }
}

/// d/dq of the point E as four bodies have it, and its centripetal acceleration: (by the first coordinate, by
/// the second, v̇ at q̈ = 0).
type Point = [[f64; 2]; 3];

/// E on bodies 2, 3, 4, 6 from the sines and cosines.
#[inline(always)]
fn points(angles: &[(f64, f64); 7], u: &[f64; 7]) -> [Point; 4] {
    let [beta, second, gamma, delta, fourth, epsilon, sixth] = *angles;
    let (w2, w4, w6) = (u[0] + u[1], u[3] + u[4], u[5] + u[6]);
    let (w2, w4, w6) = (w2 * w2, w4 * w4, w6 * w6);
    let (b, g, d, e) = (u[0] * u[0], u[2] * u[2], u[4] * u[4], u[6] * u[6]);
    let (rod, rr, ss, el, zt, zf, uu) = (D, RR, SS, E, ZT, ZF, U);
    let t = [rod * second.0, -rod * second.1];
    let p = [el * fourth.1, el * fourth.0];
    let o = [-zf * sixth.0, zf * sixth.1];
    [
        [
            [t[0] - rr * beta.0, t[1] + rr * beta.1],
            t,
            [rod * second.1 * w2 - rr * beta.1 * b, rod * second.0 * w2 - rr * beta.0 * b],
        ],
        [[ss * gamma.1, ss * gamma.0], [0.0; 2], [-ss * gamma.0 * g, ss * gamma.1 * g]],
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

/// q̈.
#[inline(always)]
pub(super) fn accelerations(q: &[f64; 7], u: &[f64; 7]) -> [f64; 7] {
    let Published { m, q: force, angles } = published(q, u);
    let [two, three, four, six] = points(&angles, u);
    // x with [a b] x = r.
    let solve = |a: [f64; 2], b: [f64; 2], inverse: f64, r: [f64; 2]| {
        [(r[0] * b[1] - r[1] * b[0]) * inverse, (a[0] * r[1] - a[1] * r[0]) * inverse]
    };
    let inverse = |a: [f64; 2], b: [f64; 2]| 1.0 / (a[0] * b[1] - a[1] * b[0]);
    let by = |a: [f64; 2], k: f64, b: [f64; 2]| [a[0] + k * b[0], a[1] + k * b[1]];
    // Θ and γ by β, and at β̈ = 0.
    let minus = [-three[0][0], -three[0][1]];
    let det = inverse(two[1], minus);
    let r1 = solve(two[1], minus, det, [-two[0][0], -two[0][1]]);
    let s1 = solve(two[1], minus, det, [three[2][0] - two[2][0], three[2][1] - two[2][1]]);
    // The acceleration of E by β, and at β̈ = 0.
    let e = by(two[0], r1[0], two[1]);
    let drift = by(two[2], s1[0], two[1]);
    let follow = |p: &Point| {
        let det = inverse(p[0], p[1]);
        let rest = [drift[0] - p[2][0], drift[1] - p[2][1]];
        (solve(p[0], p[1], det, e), solve(p[0], p[1], det, rest))
    };
    let ((r2, s2), (r3, s3)) = (follow(&four), follow(&six));
    let r = [1.0, r1[0], r1[1], r2[0], r2[1], r3[0], r3[1]];
    let s = [0.0, s1[0], s1[1], s2[0], s2[1], s3[0], s3[1]];
    let times = |x: &[f64; 7]| {
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
    let (mut inertia, mut driving) = (0.0, 0.0);
    for i in 0..7 {
        inertia = inertia + r[i] * mr[i];
        driving = driving + r[i] * (force[i] - ms[i]);
    }
    let a = driving / inertia;
    core::array::from_fn(|i| r[i] * a + s[i])
}
