//! The double pendulum in Cartesian coordinates against minimal ones; Levien & Tan, Am. J. Phys. 61
//! (1993) 1038.

use dynamics::prelude::*;

use crate::support::*;

/// Two point masses on massless rods, in four Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x1: m, y1: m, x2: m, y2: m)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
struct Cartesian {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

#[dynamics]
impl Cartesian {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x1, q.y1)
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x2, q.y2)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
    /// Lengths, not their squares: −λ is the tension.
    #[holonomic]
    fn rods(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [self.bob1(q).norm() - self.l1, (self.bob2(q) - self.bob1(q)).norm() - self.l2]
    }
    #[output]
    fn tensions(&self, q: &Coordinates<Self>) -> Vec2 {
        let lambda = q.reaction(Self::rods);
        vec2(-lambda[0], -lambda[1])
    }
}

/// The same in two angles.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
struct Minimal {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

#[dynamics]
impl Minimal {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.a.sin(), -q.a.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.b.sin(), -q.b.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
}

fn models() -> (Cartesian, Minimal) {
    (
        Cartesian { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 },
        Minimal { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 },
    )
}

/// The Cartesian state of angles and their rates.
fn cartesian(model: &Cartesian, [a, b, da, db]: [f64; 4]) -> State<Cartesian> {
    let (e1, e2) = ([a.sin(), -a.cos()], [b.sin(), -b.cos()]);
    let (n1, n2) = ([a.cos(), a.sin()], [b.cos(), b.sin()]);
    let (l1, l2) = (model.l1, model.l2);
    let builder =
        model.state().x1(l1 * e1[0]).y1(l1 * e1[1]).x2(l1 * e1[0] + l2 * e2[0]).y2(l1 * e1[1] + l2 * e2[1]);
    let (u1, v1) = (l1 * da * n1[0], l1 * da * n1[1]);
    builder
        .x1_rate(u1)
        .y1_rate(v1)
        .x2_rate(u1 + l2 * db * n2[0])
        .y2_rate(v1 + l2 * db * n2[1])
        .build()
        .unwrap()
}

/// Tensions by Newton's law along the rods, from the accelerations of the minimal model.
fn tensions(model: &Minimal, state: &State<Minimal>) -> [f64; 2] {
    let q = Minimal::coordinates_with(state, &model.accelerations(state).unwrap(), &[]);
    let (r1, r2) = (model.bob1(&q), model.bob2(&q));
    let weight = Vec2::new(0.0, model.g);
    // m₂ (r̈₂ + g) = −T₂ e₂,  m₁ (r̈₁ + g) = −T₁ e₁ + T₂ e₂.
    let on2 = model.m2 * (r2.dt().dt().value() + weight);
    let on1 = model.m1 * (r1.dt().dt().value() + weight);
    let (e1, e2) = (r1.value() / model.l1, (r2.value() - r1.value()) / model.l2);
    [-(on1 + on2).dot(e1), -on2.dot(e2)]
}

const REFERENCE: &[(f64, [f64; 4])] = &[
    (1.0, [-1.517290485027184, 0.2527915797168139, -1.9844676969329387, -4.087371261679003]),
    (2.0, [1.1528460961788194, -0.47307638064164204, -0.030451144544655827, 5.79953526363157]),
    (5.0, [-0.44021974536666475, 7.049578950150241, -3.52113897832026, -3.9088281777737452]),
    (10.0, [-0.7925961165987995, -2.4694945097592718, -1.9758098813438534, -2.3806311931408177]),
];

#[test]
fn positions_velocities_and_tensions_of_the_reference() {
    use Formulation::*;
    let (model, minimal) = models();
    let pi = core::f64::consts::PI;
    let start = cartesian(&model, [2.0 * pi / 3.0, -pi / 18.0, 0.0, 0.0]);
    let known: Vec<_> = REFERENCE
        .iter()
        .map(|(t, angles)| {
            let [a, b, da, db] = *angles;
            let at = minimal.state().a(a).b(b).a_rate(da).b_rate(db).build().unwrap();
            (*t, cartesian(&model, *angles), tensions(&minimal, &at).map(|tension| -tension))
        })
        .collect();
    let references: Vec<Reference<'_>> = known
        .iter()
        .map(|(t, s, multipliers)| Reference { t: *t, q: s.q.as_slice(), u: s.u.as_slice(), multipliers })
        .collect();
    // Errors grow as e^{0.9 t}: by 10⁴ in ten seconds.
    keeps(
        &model,
        start,
        &references,
        &[
            promise(Projected, 1e-9, [1e-5; 3], [1e-12; 2]),
            promise(Embedded, 1e-9, [1e-5; 3], [1e-12; 2]),
            promise(Projected, 1e-12, [1e-8; 3], [1e-12; 2]),
            promise(Embedded, 1e-12, [1e-8; 3], [1e-12; 2]),
            promise(Augmented, 1e-12, [1e-7; 3], [1e-9; 2]),
            promise(BaumgarteTied, 1e-12, [1e-7; 3], [1e-10; 2]),
        ],
    );
    embeds_as_it_projects(&model, start, &references, 3.0);
}

#[test]
fn accelerations_and_tensions_are_those_of_minimal_coordinates() {
    let model = Cartesian { m1: 1.3, m2: 0.7, l1: 0.9, l2: 1.4, g: 9.81 };
    let minimal = Minimal { m1: 1.3, m2: 0.7, l1: 0.9, l2: 1.4, g: 9.81 };
    let mut random = Random(3);
    for _ in 0..100 {
        let angles = [random.next(3.0), random.next(3.0), random.next(4.0), random.next(4.0)];
        let [a, b, da, db] = angles;
        let at = minimal.state().a(a).b(b).a_rate(da).b_rate(db).build().unwrap();
        let state = cartesian(&model, angles);
        let solved = dynamics::constrain::solve_once(&model, &model.constants().unwrap(), &state).unwrap();
        let q = Minimal::coordinates_with(&at, &minimal.accelerations(&at).unwrap(), &[]);
        let (r1, r2) = (minimal.bob1(&q).dt().dt().value(), minimal.bob2(&q).dt().dt().value());
        assert!(relative(solved.accelerations.as_slice(), &[r1.x, r1.y, r2.x, r2.y]) < 1e-12);
        let lambda = tensions(&minimal, &at).map(|tension| -tension);
        assert!(relative(solved.multipliers.as_slice(), &lambda) < 1e-12);
        assert_agreement(&model, &state, &Kkt::of(&model, &state));
    }
}

#[test]
fn energy_and_rods_over_two_hundred_seconds() {
    let (model, _) = models();
    let pi = core::f64::consts::PI;
    let start = cartesian(&model, [2.0 * pi / 3.0, -pi / 18.0, 0.0, 0.0]);
    let motion = model.simulate(start).until(200.0).tolerance(1e-12).run().unwrap();
    let summary = motion.verify();
    assert!(summary.energy_drift < 1e-8, "{summary}");
    assert!(
        summary.constraints.iter().all(|c| c.residual < 1e-12 && c.velocity_residual < 1e-12),
        "{summary}"
    );
}
