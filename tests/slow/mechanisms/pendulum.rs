//! The pendulum in Cartesian coordinates: IFToMM problem A01, its triple-redundant variant, and Cash's
//! index-3 pendulum.

use dynamics::constrain::solve_once;
use dynamics::model::SolverKind;
use dynamics::prelude::*;

use crate::support::*;

/// A point mass on a massless rod; IFToMM library problem A01, González, Dopico, Lugrís & Cuadrado, Multibody
/// Syst. Dyn. 16 (2006) 179.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, g: m / s^2)]
struct Pendulum {
    mass: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl Pendulum {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.bob(q).norm_squared() - self.length.powi(2))
    }
    /// Φ_qᵀλ = λ (x, y) pushes outward: the tension is −λ l.
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod) * self.length
    }
}

fn by_hand(model: &Pendulum, s: &State<Pendulum>) -> Kkt {
    let m = model.mass;
    let gamma = -(s.x_rate().powi(2) + s.y_rate().powi(2));
    Kkt::new([[m, 0.0], [0.0, m]], [0.0, -m * model.g], [[s.x(), s.y()]], [gamma])
}

fn a01() -> Pendulum {
    Pendulum { mass: 1.0, length: 1.0, g: 9.81 }
}

/// t, (x, y), tension; closed form in Jacobi's elliptic functions. Energy 0: ẋ² + ẏ² = −2 g y, and the
/// tension is −3 m g y / l.
const A01: &[(f64, [f64; 2], f64)] = &[
    (1.0, [0.986291751131875319, -0.165010853125541169], 4.856269407484676596),
    (2.0, [-0.793566195332321747, -0.608483930443791514], 17.907682072960784276),
    (5.0, [-0.942305435043755734, -0.334754338414000581], 9.851820179524037093),
    (10.0, [-0.275087462576116860, -0.961419205099125064], 28.294567206067250641),
    (100.0, [-0.181513351427031385, -0.983388480338405355], 28.941122976231312363),
];

#[test]
fn the_derived_equations_are_those_by_hand() {
    let model = Pendulum { mass: 1.7, length: 0.8, g: 9.81 };
    let around = model.state().x(0.8).build().unwrap();
    let mut random = Random(1);
    for _ in 0..50 {
        let state = near(&model, &around, &mut random, (2.0, 5.0)).unwrap();
        Kkt::of(&model, &state).assert_equals(&by_hand(&model, &state), 1e-15);
        assert_agreement(&model, &state, &by_hand(&model, &state));
    }
}

/// Period of A01; energy 0 gives the speed √(−2 g y), and the first half of a period goes from left to right.
const PERIOD: f64 = 2.367841947576237448;

fn a01_velocity(model: &Pendulum, t: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let speed = (-2.0 * model.g * y).sqrt();
    let side = if t % PERIOD < 0.5 * PERIOD { speed } else { -speed };
    [-y * side, x * side]
}

#[test]
fn a01_in_every_formulation() {
    use Formulation::*;
    let model = a01();
    let start = model.state().x(-1.0).y(0.0).build().unwrap();
    let table: Vec<_> = A01.iter().filter(|(t, ..)| *t <= 10.0).collect();
    let unknowns: Vec<_> =
        table.iter().map(|(t, q, tension)| (a01_velocity(&model, *t, *q), [-tension])).collect();
    let references: Vec<Reference<'_>> = table
        .iter()
        .zip(&unknowns)
        .map(|((t, q, _), (u, multipliers))| Reference { t: *t, q, u, multipliers })
        .collect();
    keeps(
        &model,
        start,
        &references,
        &[
            promise(Projected, 1e-6, [5e-5; 3], [1e-12; 2]),
            promise(Embedded, 1e-6, [1e-4; 3], [1e-12; 2]),
            promise(Projected, 1e-9, [3e-8; 3], [1e-12; 2]),
            promise(Embedded, 1e-9, [5e-8; 3], [1e-12; 2]),
            promise(Projected, 1e-12, [3e-11; 3], [1e-12; 2]),
            promise(Embedded, 1e-12, [5e-11; 3], [1e-12; 2]),
            promise(Augmented, 1e-9, [5e-7; 3], [1e-7; 2]),
            promise(Augmented, 1e-12, [5e-10; 3], [3e-10; 2]),
            promise(BaumgarteTied, 1e-9, [1e-7; 3], [1e-9, 1e-7]),
            promise(Baumgarte { alpha: 10.0, beta: 10.0 }, 1e-9, [1e-7; 3], [1e-8; 2]),
        ],
    );
    embeds_as_it_projects(&model, start, &references, 3.0);
}

/// With fixed steps and with step control; constraints that repeat each other are no obstacle.
#[test]
fn a01_by_generalized_alpha() {
    let model = a01();
    let (t, q, tension) = A01[1];
    let (u, multipliers) = (a01_velocity(&model, t, q), [-tension]);
    let references = [Reference { t, q: &q, u: &u, multipliers: &multipliers }];
    let start = model.state().x(-1.0).y(0.0).build().unwrap();
    for rho in [0.0, 0.5, 0.9] {
        let method = methods::GeneralizedAlpha { rho };
        keeps_order_2(method, &model, start, &references, (1e-3, [1e-4; 3]));
        let kept = model.simulate(start).until(t).tolerance(1e-5).method(method).run().unwrap();
        assert!(distance(kept.end().q.as_slice(), &q) < 1e-3, "{}", kept.verify());
    }
    let thrice = TripleRod { mass: 1.0, length: 1.0, g: 9.81 };
    let again = thrice.state().x(-1.0).y(0.0).build().unwrap();
    let run = thrice.simulate(again).until(t).fixed_step(1e-3).method(methods::GeneralizedAlpha { rho: 0.5 });
    let motion = run.run().unwrap();
    assert!(distance(motion.end().q.as_slice(), &q) < 1e-4, "{}", motion.verify());
    assert!((motion.output("tension", t).unwrap() - tension).abs() < 1e-3 * tension);
}

/// What would not be what it is chosen for is refused, with the remedy; so are steps that would turn the rod
/// over.
#[test]
fn generalized_alpha_refuses_what_it_cannot_keep() {
    let model = a01();
    let start = model.state().x(-1.0).y(0.0).build().unwrap();
    let said = |rho: f64, formulation: Formulation, h: f64| {
        let run = model.simulate(start).until(5.0).fixed_step(h).formulation(formulation);
        run.method(methods::GeneralizedAlpha { rho }).run().unwrap_err().to_string()
    };
    for (rho, formulation, h, part) in [
        (1.0, Formulation::Projected, 0.01, "from 0 to below 1"),
        (f64::NAN, Formulation::Projected, 0.01, "`rho: NaN`"),
        (-0.1, Formulation::Projected, 0.01, "`rho: -0.1`"),
        (0.8, Formulation::Embedded, 0.01, "`.formulation(..)` asks for something else"),
        (0.8, Formulation::BaumgarteTied, 0.01, "`.formulation(..)` asks for something else"),
        (0.8, Formulation::Projected, 0.5, "fixed step"),
        (0.8, Formulation::Projected, 1.0, "fixed step"),
    ] {
        let said = said(rho, formulation, h);
        println!("{said}");
        assert!(said.contains(part), "{rho} {formulation}, {h}: {said}");
    }
}

#[test]
fn a01_over_a_hundred_seconds() {
    let model = a01();
    let start = model.state().x(-1.0).y(0.0).build().unwrap();
    let motion = model.simulate(start).until(100.0).tolerance(1e-12).run().unwrap();
    let (_, place, tension) = A01[4];
    assert!(distance(motion.end().q.as_slice(), &place) < 1e-9);
    assert!((motion.output("tension", 100.0).unwrap() - tension).abs() < 1e-8);
    let summary = motion.verify();
    assert!(summary.energy_drift < 1e-10, "{summary}");
    assert!(
        summary.constraints.iter().all(|c| c.residual < 1e-12 && c.velocity_residual < 1e-12),
        "{summary}"
    );
}

/// A01 with the same rod three times, once with twice the weight: Φ_q has rank 1 of 3.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m, g: m / s^2)]
struct TripleRod {
    mass: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl TripleRod {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    fn stretch(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.bob(q).norm_squared() - self.length.powi(2))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.stretch(q)
    }
    #[holonomic]
    #[redundant]
    fn again(&self, q: &Coordinates<Self>) -> Expr {
        self.stretch(q)
    }
    #[holonomic]
    #[redundant]
    fn twice(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * self.stretch(q)
    }
    /// Only the sum of the three pulls is unique.
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -self.length * (q.reaction(Self::rod) + q.reaction(Self::again) + 2.0 * q.reaction(Self::twice))
    }
}

#[test]
fn three_times_the_same_rod_moves_as_one_and_pulls_as_one() {
    use Formulation::*;
    let model = TripleRod { mass: 1.0, length: 1.0, g: 9.81 };
    let start = model.state().x(-1.0).y(0.0).build().unwrap();
    for (formulation, bound) in
        [(Projected, 1e-9), (Embedded, 1e-9), (Augmented, 1e-8), (BaumgarteTied, 1e-8)]
    {
        let run = model.simulate(start).until(10.0).tolerance(1e-12).formulation(formulation).run();
        let motion = run.unwrap_or_else(|e| panic!("{formulation:?}: {e}"));
        for (t, place, tension) in A01.iter().filter(|(t, ..)| *t <= 10.0) {
            assert!(distance(motion.at(*t).q.as_slice(), place) < bound, "{formulation:?} at {t}");
            let error = motion.output("tension", *t).unwrap() - tension;
            assert!(error.abs() < 100.0 * bound, "{formulation:?} at {t}: tension {error:e}");
        }
    }
}

/// The three multipliers of minimum norm stand as the rows do, and are flagged as not unique.
#[test]
fn the_multipliers_of_the_triple_rod_are_not_unique_and_say_so() {
    let model = TripleRod { mass: 2.0, length: 1.0, g: 9.81 };
    let state = model.state().x(0.6).y(-0.8).x_rate(0.8).y_rate(0.6).build().unwrap();
    let solved = solve_once(&model, &model.constants().unwrap(), &state).unwrap();
    assert!(!solved.unique());
    assert_eq!(solved.diagnosis.expect("the general solver").rank, 1);
    // The sum λ₁ + λ₂ + 2 λ₃ is that of one rod: −m (v² − g y).
    let sum = solved.multipliers[0] + solved.multipliers[1] + 2.0 * solved.multipliers[2];
    assert!((sum + 2.0 * (1.0 + 9.81 * 0.8)).abs() < 1e-12, "{sum}");
    assert!(matches!(TripleRod::SOLVER, SolverKind::General { .. }));
}

/// x² + y² = 1 with g = 1; Cash, MEBDFDAE drivers, pendul3.f (Imperial College, 2000). Published to 9.1
/// digits, here to 30.
#[test]
fn cash_pendulum() {
    use Formulation::*;
    let model = Pendulum { mass: 1.0, length: 1.0, g: 1.0 };
    let start = model.state().x(1.0).y_rate(1.0).build().unwrap();
    let solved = solve_once(&model, &model.constants().unwrap(), &start).unwrap();
    assert!((solved.multipliers[0] + 1.0).abs() < 1e-15, "our sign: ẍ = +x λ");
    let references = [Reference {
        t: 1.0,
        q: &[0.867348640600439322, 0.497701050479672930],
        u: &[-0.0337480180609545197, 0.0588130114652500751],
        multipliers: &[0.493103151439018788],
    }];
    keeps(
        &model,
        start,
        &references,
        &[
            promise(Projected, 1e-6, [1e-6, 1e-5, 1e-5], [1e-14; 2]),
            promise(Embedded, 1e-6, [1e-6, 1e-5, 1e-5], [1e-14; 2]),
            promise(Projected, 1e-9, [1e-9, 1e-8, 1e-8], [1e-14; 2]),
            promise(Embedded, 1e-9, [1e-9, 1e-8, 1e-8], [1e-14; 2]),
            promise(Projected, 1e-12, [1e-12, 1e-11, 1e-11], [1e-14; 2]),
            promise(Embedded, 1e-12, [1e-12, 1e-11, 1e-11], [1e-14; 2]),
            promise(Augmented, 1e-12, [1e-11, 1e-10, 1e-10], [1e-11; 2]),
            promise(BaumgarteTied, 1e-9, [1e-8, 1e-7, 1e-7], [1e-8; 2]),
        ],
    );
    embeds_as_it_projects(&model, start, &references, 3.0);
}
