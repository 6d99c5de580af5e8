//! Andrews' squeezing mechanism: seven bodies, seven angles, three closed loops; Giles 1978; Schiehlen (ed.), Multibody Systems Handbook 1990;
//! Hairer & Wanner, Solving ODE II, VII.7; Test Set for IVP Solvers.

use dynamics::prelude::*;

use crate::support::*;

/// A motor at O turns K₁; four loops of rods move the point D against a spring. Names as in the Test Set.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(beta: rad, theta: rad, gamma: rad, phi: rad, delta: rad, omega: rad, epsilon: rad)]
#[units(
    m: kg, i: kg * m^2, a: m, b: m, c: m, d: m, da: m, e: m, ea: m, rr: m, ra: m, ss: m, sa: m, sb: m, sc: m, sd: m, ta: m, tb: m,
    u: m, ua: m, ub: m, zf: m, zt: m, fa: m, c0: N / m, l0: m, moment: N * m
)]
struct Andrews {
    /// Masses of the bodies 1 to 7.
    m: [f64; 7],
    /// Their central moments of inertia.
    i: [f64; 7],
    /// The bearings A and B and the spring's end C; O is the origin.
    a: [f64; 2],
    b: [f64; 2],
    c: [f64; 2],
    d: f64,
    da: f64,
    e: f64,
    ea: f64,
    rr: f64,
    ra: f64,
    ss: f64,
    sa: f64,
    sb: f64,
    sc: f64,
    sd: f64,
    ta: f64,
    tb: f64,
    u: f64,
    ua: f64,
    ub: f64,
    zf: f64,
    zt: f64,
    fa: f64,
    c0: f64,
    l0: f64,
    moment: f64,
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
        let angles = [q.beta, q.beta + q.theta, q.gamma, q.phi + q.delta, q.delta, q.omega + q.epsilon, q.epsilon];
        let mut sum = Expr::ZERO;
        for k in 0..7 {
            sum += 0.5 * self.m[k] * centres[k].dt().norm_squared() + 0.5 * self.i[k] * angles[k].dt().powi(2);
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

fn model() -> Andrews {
    Andrews {
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
    }
}

const START: [f64; 7] = [
    -0.0617138900142764496,
    0.0,
    0.455279819163070380,
    0.222668390165885885,
    0.487364979543842550,
    -0.222668390165885885,
    1.230547444549821192,
];

fn start(model: &Andrews) -> State<Andrews> {
    let [beta, theta, gamma, phi, delta, omega, epsilon] = START;
    let builder = model.state().beta(beta).theta(theta).gamma(gamma).phi(phi);
    builder.delta(delta).omega(omega).epsilon(epsilon).build().unwrap()
}

/// M, f, G and γ as published in andrews.f of the Test Set.
fn by_hand(p: &Andrews, s: &State<Andrews>) -> Kkt {
    let [be, th, ga, ph, de, om, ep] = <[f64; 7]>::try_from(s.q.as_slice()).unwrap();
    let [bep, thp, gap, php, dep, omp, epp] = <[f64; 7]>::try_from(s.u.as_slice()).unwrap();
    let [m1, m2, m3, m4, m5, m6, m7] = p.m;
    let [i1, i2, i3, i4, i5, i6, i7] = p.i;
    let (rr, d, da, e, ea, zt, zf, fa, u) = (p.rr, p.d, p.da, p.e, p.ea, p.zt, p.zf, p.fa, p.u);
    let (sith, coth) = th.sin_cos();
    let (siph, coph, siom, coom) = (ph.sin(), ph.cos(), om.sin(), om.cos());
    let mut m = [[0.0; 7]; 7];
    m[0][0] = m1 * p.ra.powi(2) + m2 * (rr * rr - 2.0 * da * rr * coth + da * da) + i1 + i2;
    m[1][0] = m2 * (da * da - da * rr * coth) + i2;
    m[1][1] = m2 * da * da + i2;
    m[2][2] = m3 * (p.sa.powi(2) + p.sb.powi(2)) + i3;
    m[3][3] = m4 * (e - ea).powi(2) + i4;
    m[4][3] = m4 * ((e - ea).powi(2) + zt * (e - ea) * siph) + i4;
    m[4][4] =
        m4 * (zt * zt + 2.0 * zt * (e - ea) * siph + (e - ea).powi(2)) + m5 * (p.ta.powi(2) + p.tb.powi(2)) + i4 + i5;
    m[5][5] = m6 * (zf - fa).powi(2) + i6;
    m[6][5] = m6 * ((zf - fa).powi(2) - u * (zf - fa) * siom) + i6;
    m[6][6] =
        m6 * ((zf - fa).powi(2) - 2.0 * u * (zf - fa) * siom + u * u) + m7 * (p.ua.powi(2) + p.ub.powi(2)) + i6 + i7;
    for (i, j) in [(1, 0), (4, 3), (6, 5)] {
        m[j][i] = m[i][j];
    }
    let (siga, coga) = ga.sin_cos();
    let (xd, yd) = (p.sd * coga + p.sc * siga + p.b[0], p.sd * siga - p.sc * coga + p.b[1]);
    let length = (xd - p.c[0]).hypot(yd - p.c[1]);
    let force = -p.c0 * (length - p.l0) / length;
    let (fx, fy) = (force * (xd - p.c[0]), force * (yd - p.c[1]));
    let f = [
        p.moment - m2 * da * rr * thp * (thp + 2.0 * bep) * sith,
        m2 * da * rr * bep.powi(2) * sith,
        fx * (p.sc * coga - p.sd * siga) + fy * (p.sd * coga + p.sc * siga),
        m4 * zt * (e - ea) * dep.powi(2) * coph,
        -m4 * zt * (e - ea) * php * (php + 2.0 * dep) * coph,
        -m6 * u * (zf - fa) * epp.powi(2) * coom,
        m6 * u * (zf - fa) * omp * (omp + 2.0 * epp) * coom,
    ];
    let (sibe, cobe) = be.sin_cos();
    let (sibeth, cobeth) = (be + th).sin_cos();
    let (siphde, cophde) = (ph + de).sin_cos();
    let (side, code) = de.sin_cos();
    let (siomep, coomep) = (om + ep).sin_cos();
    let (siep, coep) = ep.sin_cos();
    let first = ([-rr * sibe + d * sibeth, d * sibeth], [rr * cobe - d * cobeth, -d * cobeth]);
    let ([x0, x1], [y0, y1]) = first;
    let ss = p.ss;
    let jacobian = [
        [x0, x1, -ss * coga, 0.0, 0.0, 0.0, 0.0],
        [y0, y1, -ss * siga, 0.0, 0.0, 0.0, 0.0],
        [x0, x1, 0.0, -e * cophde, -e * cophde + zt * side, 0.0, 0.0],
        [y0, y1, 0.0, -e * siphde, -e * siphde - zt * code, 0.0, 0.0],
        [x0, x1, 0.0, 0.0, 0.0, zf * siomep, zf * siomep - u * coep],
        [y0, y1, 0.0, 0.0, 0.0, -zf * coomep, -zf * coomep - u * siep],
    ];
    let (bt, pd, oe) = ((bep + thp).powi(2), (php + dep).powi(2), (omp + epp).powi(2));
    let (x, y) = (rr * cobe * bep.powi(2) - d * cobeth * bt, rr * sibe * bep.powi(2) - d * sibeth * bt);
    let gamma = [
        x - ss * siga * gap.powi(2),
        y + ss * coga * gap.powi(2),
        x - zt * code * dep.powi(2) - e * siphde * pd,
        y - zt * side * dep.powi(2) + e * cophde * pd,
        x - u * siep * epp.powi(2) - zf * coomep * oe,
        y + u * coep * epp.powi(2) - zf * siomep * oe,
    ];
    Kkt::new(m, f, jacobian, gamma)
}

#[test]
fn the_derived_equations_are_the_published_ones() {
    let model = model();
    let around = start(&model);
    let mut random = Random(4);
    let states = (0..60).filter_map(|_| near(&model, &around, &mut random, (0.3, 500.0)));
    let mut count = 0;
    for state in states {
        Kkt::of(&model, &state).assert_equals(&by_hand(&model, &state), 1e-13);
        assert_agreement(&model, &state, &by_hand(&model, &state));
        count += 1;
    }
    assert!(count > 30, "{count} states on the manifold");
}

#[test]
fn the_start_is_the_published_one() {
    let model = model();
    let start = start(&model);
    assert!((model.energy_function(&start) - 1.435796399161668750).abs() < 1e-14);
    // The published λ₀ and β̈₀ of the Test Set; its sign of λ is ours turned.
    let (a, lambda) = by_hand(&model, &start).solve();
    assert!((a[0] - 14222.4439199541138705911625887).abs() < 1e-8 * a[0]);
    assert!((lambda[0] + 98.5668703962410896057654982170).abs() < 1e-9 * lambda[0].abs());
}

/// 27 digits by two formulations. The published values are right to 9.6 digits in the positions and 5.9 in the multipliers: their phase is
/// 1.0e-12 s off. The Test Set has M q̈ = f − Gᵀλ: its λ are ours turned.
const Q_END: [f64; 7] = [
    15.810771195153707097,
    -15.756371058411839470,
    0.040822240119645805,
    -0.534730116342079594,
    0.524409965879954069,
    0.534730116342079594,
    1.048080741041937873,
];
const U_END: [f64; 7] = [
    1139.920302259106064198,
    -1424.379295177540073196,
    11.032911910618593745,
    19.293374105032040832,
    0.573569914829502454,
    -19.293374105032040832,
    0.323179149249130875,
];
const LAMBDA_END: [f64; 6] = [
    -199.175348104538628186,
    29.755309974971763324,
    -23.066543611622151129,
    -31.452725275771137075,
    -22.642494786394378578,
    -11.617392351112625607,
];

/// q̈ at the end, 27 digits: the equations by hand give them from the positions and velocities of the reference.
const A_END: [f64; 7] = [
    -24631.763122874634470,
    51850.319636464231534,
    324102.600707578605812,
    566749.422000995326493,
    16743.635418345444610,
    -566749.422000995326493,
    9826.507801544162688,
];

#[test]
fn the_reference_satisfies_the_equations_by_hand() {
    let model = model();
    let mut end = start(&model);
    end.q_mut().as_mut_slice().copy_from_slice(&Q_END);
    end.u_mut().as_mut_slice().copy_from_slice(&U_END);
    let (a, lambda) = by_hand(&model, &end).solve();
    // The multipliers change by 1e5 per rad of the crank: the rounding of its angle of 15.8 rad shows.
    assert!(relative(a.as_slice(), &A_END) < 1e-9, "{:e}", relative(a.as_slice(), &A_END));
    assert!(relative(lambda.as_slice(), &LAMBDA_END) < 1e-9, "{:e}", relative(lambda.as_slice(), &LAMBDA_END));
}

#[test]
fn end_values_in_every_formulation() {
    use Formulation::*;
    let model = model();
    let references = [Reference { t: 0.03, q: &Q_END, u: &U_END, multipliers: &LAMBDA_END }];
    keeps(
        &model,
        start(&model),
        &references,
        &[
            promise(Projected, 1e-6, [1e-4, 1e-2, 1e-2], [1e-12; 2]),
            promise(Embedded, 1e-6, [1e-4, 1e-2, 1e-2], [1e-12; 2]),
            promise(Projected, 1e-9, [1e-7, 1e-5, 1e-5], [1e-12; 2]),
            promise(Embedded, 1e-9, [1e-7, 1e-5, 1e-5], [1e-12; 2]),
            promise(Projected, 1e-12, [1e-10, 1e-8, 1e-8], [1e-12; 2]),
            promise(Embedded, 1e-12, [1e-10, 1e-8, 1e-8], [1e-12; 2]),
            promise(Augmented, 1e-12, [1e-9, 1e-7, 1e-7], [1e-9, 1e-6]),
            promise(BaumgarteTied, 1e-12, [1e-9, 1e-7, 1e-7], [1e-9, 1e-6]),
        ],
    );
    embeds_as_it_projects(&model, start(&model), &references, 3.0);
}

#[test]
fn energy_less_the_work_of_the_motor_is_kept() {
    let model = model();
    let motion = model.simulate(start(&model)).until(0.03).tolerance(1e-12).run().unwrap();
    assert!(motion.summary().energy_drift < 1e-10, "{}", motion.summary());
    // T + V − E₀ = mom (β − β₀), whatever the loops do.
    let work = model.moment * (motion.end().beta() - motion.start().beta());
    let change = model.energy_function(&motion.end()) - model.energy_function(&motion.start());
    assert!((change - work).abs() < 1e-10 * work);
}
