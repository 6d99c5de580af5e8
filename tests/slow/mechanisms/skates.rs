//! Nonholonomic constraints: the Chaplygin sleigh and a knife edge on an inclined plane.

use core::f64::consts::PI;

use dynamics::prelude::*;

use crate::support::*;

/// A body on a skate at the distance a behind its centre of mass; Chaplygin 1911; Bloch, Nonholonomic
/// Mechanics and Control, 2nd ed. 2015, 1.7.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(mass: kg, inertia: kg * m^2, a: m)]
struct Sleigh {
    mass: f64,
    inertia: f64,
    a: f64,
}

#[dynamics]
impl Sleigh {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    fn skate(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) - self.a * vec2(q.phi.cos(), q.phi.sin())
    }
    /// The skate does not slide sideways.
    #[nonholonomic]
    fn edge(&self, q: &Coordinates<Self>) -> Expr {
        self.skate(q).dt().dot(vec2(-q.phi.sin(), q.phi.cos()))
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.skate(q).dt().dot(vec2(q.phi.cos(), q.phi.sin()))
    }
}

fn sleigh() -> Sleigh {
    Sleigh { mass: 1.0, inertia: 0.1, a: 0.2 }
}

/// t, place of the skate and φ, its speed and φ̇, and λ; closed form with a quadrature, 30 digits. The source
/// turns λ.
const SLEIGH: &[(f64, [f64; 3], [f64; 2], f64)] = &[
    (
        0.5,
        [0.508369087488522274, 0.217457044328338709, 0.694836362522265723],
        [1.203406773343074813, 0.893676746736318359],
        0.768183321572635102,
    ),
    (
        1.0,
        [0.904474294788247191, 0.683391045792609765, 0.993041702405936218],
        [1.241225725036125549, 0.371855381917529617],
        0.329683190020836478,
    ),
    (
        2.0,
        [1.464357510175662237, 1.795833401927827835, 1.166777860604544551],
        [1.248779741527238183, 0.062630272869789141],
        0.055865297118654658,
    ),
    (
        5.0,
        [2.838248180456202770, 5.281653959322648016, 1.201714760743421399],
        [1.248999594750783694, 0.000296556163108899],
        0.000264570376817045,
    ),
    (
        10.0,
        [5.090327821218563262, 11.106440412710074768, 1.201880943023856036],
        [1.248999599679679552, 0.000000039589589399],
        0.000000035319558079,
    ),
];

/// q and u of the centre of mass from those of the skate.
fn centre(model: &Sleigh, [xc, yc, phi]: [f64; 3], [v, w]: [f64; 2]) -> ([f64; 3], [f64; 3]) {
    let (s, c) = phi.sin_cos();
    let a = model.a;
    ([xc + a * c, yc + a * s, phi], [v * c - a * w * s, v * s + a * w * c, w])
}

fn sleigh_by_hand(model: &Sleigh, s: &State<Sleigh>) -> Kkt {
    let (sin, cos) = s.phi().sin_cos();
    let gamma = s.phi_rate() * (cos * s.x_rate() + sin * s.y_rate());
    let (m, j) = (model.mass, model.inertia);
    Kkt::new([[m, 0.0, 0.0], [0.0, m, 0.0], [0.0, 0.0, j]], [0.0; 3], [[-sin, cos, -model.a]], [gamma])
}

#[test]
fn the_equations_of_the_sleigh_are_those_by_hand() {
    let model = Sleigh { mass: 1.3, inertia: 0.4, a: 0.7 };
    let mut random = Random(5);
    for _ in 0..50 {
        let state = near(&model, &model.state().build().unwrap(), &mut random, (3.0, 3.0)).unwrap();
        Kkt::of(&model, &state).assert_equals(&sleigh_by_hand(&model, &state), 1e-14);
        assert_agreement(&model, &state, &sleigh_by_hand(&model, &state));
    }
}

#[test]
fn the_sleigh_in_every_formulation() {
    use Formulation::*;
    let model = sleigh();
    let start = model.state().x(0.2).x_rate(1.0).y_rate(0.4).phi_rate(2.0).build().unwrap();
    let states: Vec<_> = SLEIGH.iter().map(|(_, q, u, _)| centre(&model, *q, *u)).collect();
    let lambda: Vec<_> = SLEIGH.iter().map(|row| [row.3]).collect();
    let rows = SLEIGH.iter().zip(&states).zip(&lambda);
    let references: Vec<Reference<'_>> =
        rows.map(|((row, (q, u)), multipliers)| Reference { t: row.0, q, u, multipliers }).collect();
    keeps(
        &model,
        start,
        &references,
        &[
            promise(Projected, 1e-6, [1e-5; 3], [0.0, 1e-12]),
            promise(Embedded, 1e-6, [1e-5; 3], [0.0, 1e-12]),
            promise(Projected, 1e-9, [1e-8; 3], [0.0, 1e-12]),
            promise(Embedded, 1e-9, [1e-8; 3], [0.0, 1e-12]),
            promise(Projected, 1e-12, [1e-11; 3], [0.0, 1e-12]),
            promise(Embedded, 1e-12, [1e-11; 3], [0.0, 1e-12]),
            promise(Augmented, 1e-12, [1e-11; 3], [0.0, 1e-10]),
            promise(BaumgarteTied, 1e-12, [1e-11; 3], [0.0, 1e-11]),
        ],
    );
    embeds_as_it_projects(&model, start, &references, 3.0);
    let promises = [
        promise(Projected, 1e-6, [1e-5; 3], [0.0, 1e-12]),
        promise(Projected, 1e-9, [1e-8; 3], [0.0, 1e-12]),
        promise(Projected, 1e-12, [1e-11; 3], [0.0, 1e-12]),
        promise(Augmented, 1e-12, [1e-11; 3], [0.0, 1e-10]),
    ];
    keeps_with(methods::Taylor { order: None }, &model, start, &references, &promises);
    for rho in [0.0, 0.8] {
        keeps_order_2(methods::GeneralizedAlpha { rho }, &model, start, &references[..3], (2e-3, [1e-5; 3]));
    }
}

/// Energy is kept although phase volume is not: the sleigh ends on a straight line, at the speed that the
/// energy gives.
#[test]
fn the_sleigh_ends_on_a_straight_line() {
    let model = sleigh();
    let start = model.state().x(0.2).x_rate(1.0).y_rate(0.4).phi_rate(2.0).build().unwrap();
    assert!((model.energy_function(&start) - 0.78).abs() < 1e-15);
    let motion = model.simulate(start).until(60.0).tolerance(1e-12).run().unwrap();
    assert!(motion.verify().energy_drift < 1e-11, "{}", motion.verify());
    let end = motion.end();
    assert!((end.phi() - 1.201880965211783547).abs() < 1e-10, "{}", end.phi());
    assert!(end.phi_rate().abs() < 1e-10);
    assert!((motion.output("speed", 60.0).unwrap() - (2.0 * 0.78_f64).sqrt()).abs() < 1e-10);
}

/// A skate on an inclined plane; Neimark & Fufaev 1972; Bloch 2015, 1.6.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(mass: kg, inertia: kg * m^2, g: m / s^2, slope: rad)]
struct KnifeEdge {
    mass: f64,
    inertia: f64,
    g: f64,
    slope: f64,
}

#[dynamics]
impl KnifeEdge {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    /// x points downhill.
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        -self.mass * self.g * self.slope.sin() * q.x
    }
    #[nonholonomic]
    fn edge(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() * q.phi.sin() - q.y.dt() * q.phi.cos()
    }
}

fn knife() -> KnifeEdge {
    KnifeEdge { mass: 1.25, inertia: 0.13, g: 9.81, slope: PI / 4.0 }
}

/// Closed form: x = g sin α/(2 Ω²) sin² Ωt, y = g sin α/(2 Ω²) (Ωt − ½ sin 2Ωt), λ = −2 m g sin α sin Ωt.
fn knife_at(model: &KnifeEdge, spin: f64, t: f64) -> ([f64; 3], [f64; 3], [f64; 1]) {
    let pull = model.g * model.slope.sin();
    let (k, angle) = (pull / (2.0 * spin * spin), spin * t);
    (
        [k * angle.sin().powi(2), k * (angle - 0.5 * (2.0 * angle).sin()), angle],
        [k * spin * (2.0 * angle).sin(), k * spin * (1.0 - (2.0 * angle).cos()), spin],
        [-2.0 * model.mass * pull * angle.sin()],
    )
}

#[test]
fn the_closed_form_of_the_knife_edge_is_the_published_table() {
    let (q, u, lambda) = knife_at(&knife(), PI / 3.0, 1.0);
    let known = [2.372072951477778302, 1.942521690989828556, PI / 3.0];
    assert!(distance(&q, &known) < 1e-14);
    assert!(distance(&u[..2], &[2.868309607538385982, 4.968057972094430930]) < 1e-14);
    assert!((lambda[0] + 15.018433985439360715).abs() < 1e-13);
}

#[test]
fn the_equations_of_the_knife_edge_are_those_by_hand() {
    let model = knife();
    let mut random = Random(6);
    for _ in 0..50 {
        let s = near(&model, &model.state().build().unwrap(), &mut random, (3.0, 3.0)).unwrap();
        let (sin, cos) = s.phi().sin_cos();
        let gamma = -s.phi_rate() * (cos * s.x_rate() + sin * s.y_rate());
        let (m, j) = (model.mass, model.inertia);
        let force = [m * model.g * model.slope.sin(), 0.0, 0.0];
        let hand =
            Kkt::new([[m, 0.0, 0.0], [0.0, m, 0.0], [0.0, 0.0, j]], force, [[sin, -cos, 0.0]], [gamma]);
        Kkt::of(&model, &s).assert_equals(&hand, 1e-14);
        assert_agreement(&model, &s, &hand);
    }
}

/// The skate does not go downhill in the mean: it drifts sideways. Equations in which the constraint is
/// varied (vakonomic) give another path.
#[test]
fn the_knife_edge_in_every_formulation() {
    use Formulation::*;
    let (model, spin) = (knife(), PI / 3.0);
    let start = model.state().phi_rate(spin).build().unwrap();
    let times = [1.0, 2.0, 6.0, 20.0];
    let known = times.map(|t| knife_at(&model, spin, t));
    let rows = times.iter().zip(&known);
    let references: Vec<Reference<'_>> =
        rows.map(|(t, (q, u, multipliers))| Reference { t: *t, q, u, multipliers }).collect();
    keeps(
        &model,
        start,
        &references,
        &[
            promise(Projected, 1e-6, [1e-5; 3], [0.0, 1e-12]),
            promise(Embedded, 1e-6, [1e-5; 3], [0.0, 1e-12]),
            promise(Projected, 1e-9, [1e-8; 3], [0.0, 1e-12]),
            promise(Embedded, 1e-9, [1e-8; 3], [0.0, 1e-12]),
            promise(Projected, 1e-12, [1e-11; 3], [0.0, 1e-12]),
            promise(Embedded, 1e-12, [1e-11; 3], [0.0, 1e-12]),
            promise(Augmented, 1e-12, [1e-11; 3], [0.0, 1e-10]),
            promise(BaumgarteTied, 1e-12, [1e-11; 3], [0.0, 1e-11]),
        ],
    );
    embeds_as_it_projects(&model, start, &references, 4.0);
}
