//! Random models: what is derived from them obeys the laws that hold for every Lagrangian, and both
//! derivations agree.

use crate::common;

use common::{Builder, Values};
use dynamics_symbolic::calculus::directional;
use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::{NodeId, Number, Origin, Symbol, Unary};
use dynamics_symbolic::mechanics::{Derivation, EnergyRole, Force, ForceTerm, Model};
use proptest::prelude::*;

/// How the kinetic energy of a random model is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Family {
    /// Point masses at random places: true velocities.
    Points,
    /// The same, moved by explicit time.
    Driven,
    /// Weights that depend on q, and angular velocities of a body frame.
    Bodies,
    /// Some of each.
    Mixed,
}

#[derive(Clone, Debug)]
struct Recipe {
    family: Family,
    n: usize,
    numbers: Vec<f64>,
    forced: bool,
    lossy: bool,
}

fn recipes() -> impl Strategy<Value = Recipe> {
    let family =
        prop_oneof![Just(Family::Points), Just(Family::Driven), Just(Family::Bodies), Just(Family::Mixed)];
    (family, 1usize..=3, prop::collection::vec(0.2..1.5f64, 80), any::<bool>(), any::<bool>())
        .prop_map(|(family, n, numbers, forced, lossy)| Recipe { family, n, numbers, forced, lossy })
}

/// Draws the recipe's numbers one after another.
struct Draw<'a>(core::iter::Cycle<core::slice::Iter<'a, f64>>);

impl Draw<'_> {
    fn value(&mut self) -> f64 {
        *self.0.next().expect("a cycle does not end")
    }
    fn number(&mut self, b: &mut Builder) -> NodeId {
        let number = Number::finite(self.value()).expect("finite");
        b.g().number(number)
    }
}

/// Σ aᵢ q̂ᵢ, where q̂ are the coordinates as the model sees them.
fn combination(b: &mut Builder, d: &mut Draw, q: &[NodeId]) -> NodeId {
    let mut sum = b.g().zero();
    for x in q {
        let a = d.number(b);
        let term = b.mul(a, *x);
        sum = b.add(sum, term);
    }
    sum
}

/// The model of a recipe in coordinates s with q = A s; A = 1 where `map` is `None`. All in L directly where
/// `direct`.
fn model(recipe: &Recipe, map: Option<&[Vec<f64>]>, direct: bool) -> Model {
    let mut b = Builder::new("Random");
    let s = b.coordinates("s", recipe.n);
    let q: Vec<NodeId> = match map {
        None => s.clone(),
        Some(rows) => rows
            .iter()
            .map(|row| {
                let mut sum = b.g().zero();
                for (a, x) in row.iter().zip(&s) {
                    let a = b.g().number(Number::finite(*a).expect("finite"));
                    let term = b.mul(a, *x);
                    sum = b.add(sum, term);
                }
                sum
            })
            .collect(),
    };
    let mass = b.parameter("m");
    let mut d = Draw(recipe.numbers.iter().cycle());
    let mut kinetic = b.g().zero();
    // Every coordinate has some inertia of its own, so that M is positive definite.
    for x in &q {
        let k = b.kinetic(mass, &[*x]);
        kinetic = b.add(kinetic, k);
    }
    if recipe.family != Family::Bodies {
        for _ in 0..recipe.n {
            let place = point(&mut b, &mut d, &q, recipe.family == Family::Driven);
            let w = d.number(&mut b);
            let k = b.kinetic(w, &place);
            kinetic = b.add(kinetic, k);
        }
    }
    if matches!(recipe.family, Family::Bodies | Family::Mixed) {
        let k = body(&mut b, &mut d, &q);
        kinetic = b.add(kinetic, k);
    }
    let potential = {
        let (x, y) = (combination(&mut b, &mut d, &q), combination(&mut b, &mut d, &q));
        let (c, square, g) = (b.cos(x), b.mul(y, y), b.parameter("g"));
        let (w, k) = (b.mul(g, c), d.number(&mut b));
        let spring = b.mul(k, square);
        b.add(w, spring)
    };
    if direct {
        let lagrangian = b.sub(kinetic, potential);
        b.energy("lagrangian", EnergyRole::Lagrangian, lagrangian);
    } else {
        b.energy("kinetic", EnergyRole::Kinetic, kinetic);
        b.energy("potential", EnergyRole::Potential, potential);
    }
    if recipe.forced {
        let place = point(&mut b, &mut d, &q, false);
        let (rate, t) = (b.dt(q[0]), b.g().symbol(Symbol::Time));
        let vector = vec![b.sin(t), b.mul(rate, t)];
        let (expression, magnitude) = (combination(&mut b, &mut d, &q), b.cos(t));
        let terms =
            vec![ForceTerm::At { point: place.to_vec(), vector }, ForceTerm::Along { expression, magnitude }];
        b.model.forces.push(Force { name: "push".into(), terms, origin: Origin(0) });
    }
    if recipe.lossy {
        let x = combination(&mut b, &mut d, &q);
        let rate = b.dt(x);
        let (square, w) = (b.mul(rate, rate), d.number(&mut b));
        let loss = b.mul(w, square);
        b.energy("loss", EnergyRole::Dissipation, loss);
    }
    b.model
}

fn point(b: &mut Builder, d: &mut Draw, q: &[NodeId], driven: bool) -> [NodeId; 2] {
    let mut angle = combination(b, d, q);
    let stretch = combination(b, d, q);
    if driven {
        let (t, w) = (b.g().symbol(Symbol::Time), d.number(b));
        let turn = b.mul(w, t);
        angle = b.add(angle, turn);
    }
    let (s, c, length) = (b.sin(angle), b.cos(angle), d.number(b));
    let bent = b.mul(stretch, stretch);
    let r = b.add(length, bent);
    [b.mul(r, s), b.mul(r, c)]
}

/// ½ ω·(I ω) with ω in the frame of a body turned about z, x, z by three combinations of q, and ½ (1 + x²)
/// ẋ².
fn body(b: &mut Builder, d: &mut Draw, q: &[NodeId]) -> NodeId {
    let angles: Vec<NodeId> = (0..3).map(|_| combination(b, d, q)).collect();
    let rates: Vec<NodeId> = angles.iter().map(|a| b.dt(*a)).collect();
    let (s2, c2, s3, c3) = (b.sin(angles[1]), b.cos(angles[1]), b.sin(angles[2]), b.cos(angles[2]));
    let up = b.mul(rates[0], s2);
    let (x1, x2) = (b.mul(up, s3), b.mul(rates[1], c3));
    let (y1, y2) = (b.mul(up, c3), b.mul(rates[1], s3));
    let z1 = b.mul(rates[0], c2);
    let omega = [b.add(x1, x2), b.sub(y1, y2), b.add(z1, rates[2])];
    let mut sum = b.g().zero();
    for w in omega {
        let (square, inertia) = (b.mul(w, w), d.number(b));
        let term = b.mul(inertia, square);
        sum = b.add(sum, term);
    }
    // A product of inertia.
    let product = b.mul(omega[0], omega[1]);
    let tenth = b.ratio(1, 20);
    let term = b.mul(tenth, product);
    sum = b.add(sum, term);
    let x = combination(b, d, q);
    let (rate, square) = (b.dt(x), b.mul(x, x));
    let (one, speed) = (b.g().one(), b.mul(rate, rate));
    let weight = b.add(one, square);
    let term = b.mul(weight, speed);
    b.add(sum, term)
}

fn values(n: usize, x: &[f64]) -> Values {
    Values {
        t: x[0],
        q: x[1..=n].to_vec(),
        u: x[4..4 + n].to_vec(),
        p: vec![x[7].abs() + 0.5, 9.81],
        ..Values::default()
    }
}

fn state() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.5..1.5f64, 8)
}

fn at(c: &Compiled, nodes: &[NodeId], v: &Values) -> Vec<f64> {
    let found = c.model.graph.evaluate(nodes, v);
    nodes.iter().map(|n| found[n.index()]).collect()
}

fn flat(m: &[Vec<NodeId>]) -> Vec<NodeId> {
    m.iter().flatten().copied().collect()
}

fn near(x: &[f64], y: &[f64], tolerance: f64) -> bool {
    let size = x.iter().chain(y).fold(1.0f64, |s, v| s.max(v.abs()));
    x.len() == y.len() && x.iter().zip(y).all(|(a, b)| (a - b).abs() <= tolerance * size)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 30, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn both_derivations_agree(recipe in recipes(), x in state()) {
        let (form, general) = (compile(model(&recipe, None, false)), compile(model(&recipe, None, true)));
        let (form, general) = (form.expect("a good model"), general.expect("a good model"));
        let expected = match recipe.family {
            // With one coordinate T is f(q) q̇² however it is written, and either derivation does.
            _ if recipe.n == 1 => form.equations.derivation,
            Family::Points | Family::Driven => Derivation::VelocityForm,
            Family::Bodies | Family::Mixed => Derivation::Mixed,
        };
        prop_assert_eq!(form.equations.derivation, expected);
        prop_assert_eq!(general.equations.derivation, Derivation::Momenta);
        let v = values(recipe.n, &x);
        let all = |c: &Compiled| {
            let e = &c.equations;
            [&flat(&e.mass_matrix)[..], &e.generalized_force, &e.accelerations, &e.momenta].concat()
        };
        let (a, b) = (at(&form, &all(&form), &v), at(&general, &all(&general), &v));
        prop_assert!(near(&a, &b, 1e-10), "{a:?} {b:?}");
        let jacobians = |c: &Compiled| {
            let j = c.equations.jacobians.as_ref().expect("small");
            [flat(&j.by_q), flat(&j.by_u), flat(&j.by_parameters)].concat()
        };
        let (a, b) = (at(&form, &jacobians(&form), &v), at(&general, &jacobians(&general), &v));
        prop_assert!(near(&a, &b, 1e-9), "{a:?} {b:?}");
    }

    #[test]
    fn the_mass_matrix_is_symmetric_and_positive_definite(recipe in recipes(), x in state()) {
        let c = compile(model(&recipe, None, false)).expect("a good model");
        let (v, n) = (values(recipe.n, &x), recipe.n);
        let m = at(&c, &flat(&c.equations.mass_matrix), &v);
        for i in 0..n {
            for j in 0..n {
                prop_assert_eq!(m[i * n + j], m[j * n + i]);
            }
        }
        let pivots: Vec<NodeId> = c.equations.pivots.iter().map(|p| p.pivot).collect();
        prop_assert!(at(&c, &pivots, &v).iter().all(|p| *p > 0.0));
        // T = ½ q̇ᵀ M q̇ where the points are not driven.
        if recipe.family != Family::Driven {
            let (t, _) = c.equations.energies.expect("T and V");
            let t = at(&c, &[t], &v)[0];
            let quadratic: f64 =
                (0..n).flat_map(|i| (0..n).map(move |j| (i, j)))
                    .map(|(i, j)| 0.5 * v.u[i] * m[i * n + j] * v.u[j])
                    .sum();
            prop_assert!(near(&[t], &[quadratic], 1e-12), "{t} {quadratic}");
        }
    }

    #[test]
    fn the_energy_function_changes_by_the_powers(recipe in recipes(), x in state()) {
        let mut c = compile(model(&recipe, None, false)).expect("a good model");
        let v = values(recipe.n, &x);
        let (energy, accelerations) = (c.equations.energy_function, c.equations.accelerations.clone());
        let rate = directional(&mut c.model.graph, &[energy], &mut |g, s| match s {
            Symbol::Time => Some(g.one()),
            Symbol::Coordinate(i) => Some(g.symbol(Symbol::Rate(i))),
            Symbol::Rate(i) => Some(accelerations[i as usize]),
            _ => None,
        });
        let powers: Vec<NodeId> = c.equations.powers.iter().map(|p| p.node).collect();
        let (rate, powers) = (at(&c, &rate, &v)[0], at(&c, &powers, &v));
        let size = powers.iter().fold(1.0f64, |s, p| s.max(p.abs()));
        prop_assert!(
            (rate - powers.iter().sum::<f64>()).abs() <= 1e-9 * size.max(rate.abs()).max(10.0),
            "{rate} {powers:?}"
        );
    }

    #[test]
    fn a_linear_change_of_coordinates_is_the_same_motion(
        recipe in recipes(),
        x in state(),
        tilt in prop::collection::vec(-0.3..0.3f64, 9)
    ) {
        let n = recipe.n;
        let map: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| tilt[3 * i + j] + f64::from(u8::from(i == j))).collect()).collect();
        let (plain, mapped) =
            (compile(model(&recipe, None, false)), compile(model(&recipe, Some(&map), false)));
        let (plain, mapped) = (plain.expect("a good model"), mapped.expect("a good model"));
        let times = |x: &[f64]| -> Vec<f64> {
            map.iter().map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
        };
        let s = values(n, &x);
        let q = Values { q: times(&s.q), u: times(&s.u), ..s.clone() };
        let a = at(&plain, &plain.equations.accelerations, &q);
        let b = times(&at(&mapped, &mapped.equations.accelerations, &s));
        prop_assert!(near(&a, &b, 1e-9), "{a:?} {b:?}");
    }

    #[test]
    fn the_equations_are_lagranges_by_difference_quotients(recipe in recipes(), x in state()) {
        let c = compile(model(&recipe, None, false)).expect("a good model");
        let (v, n, h) = (values(recipe.n, &x), recipe.n, 1e-5);
        let (t, u) = c.equations.energies.expect("T and V");
        let lagrangian = |v: &Values| { let e = at(&c, &[t, u], v); e[0] - e[1] };
        let shifted = |change: &dyn Fn(&mut Values, f64), f: &dyn Fn(&Values) -> f64| {
            let [mut a, mut b] = [v.clone(), v.clone()];
            change(&mut a, h);
            change(&mut b, -h);
            (f(&a) - f(&b)) / (2.0 * h)
        };
        let momenta = at(&c, &c.equations.momenta, &v);
        let quotients: Vec<f64> = (0..n).map(|i| shifted(&|v, h| v.u[i] += h, &lagrangian)).collect();
        prop_assert!(near(&momenta, &quotients, 1e-7), "{momenta:?} {quotients:?}");
        if recipe.forced || recipe.lossy {
            return Ok(());
        }
        // Along the motion with the derived accelerations, ṗ = ∂L/∂q.
        let a = at(&c, &c.equations.accelerations, &v);
        for i in 0..n {
            let along = |v: &mut Values, h: f64| {
                v.t += h;
                let moved = v.q.iter_mut().zip(&mut v.u).zip(&a);
                moved.for_each(|((q, u), a)| {
                    *q += h * *u;
                    *u += h * a;
                });
            };
            // The place moves on by h q̇ + ½ h² q̈ to second order; a central difference does not feel the
            // second term.
            let moved = shifted(&along, &|v| at(&c, &[c.equations.momenta[i]], v)[0]);
            let slope = shifted(&|v, h| v.q[i] += h, &lagrangian);
            prop_assert!(
                (moved - slope).abs() <= 1e-6 * (1.0 + moved.abs().max(slope.abs()) * 10.0),
                "{moved} {slope}"
            );
        }
    }

    #[test]
    fn jacobians_are_difference_quotients_of_the_accelerations(recipe in recipes(), x in state()) {
        let c = compile(model(&recipe, None, false)).expect("a good model");
        let (v, n, h) = (values(recipe.n, &x), recipe.n, 1e-5);
        let accelerations = |v: &Values| at(&c, &c.equations.accelerations, v);
        let column = |m: &[Vec<NodeId>], j: usize| {
            at(&c, &m.iter().map(|row| row[j]).collect::<Vec<_>>(), &v)
        };
        let check = |m: &[Vec<NodeId>], j: usize, shift: &dyn Fn(&mut Values, f64)| {
            let [mut a, mut b] = [v.clone(), v.clone()];
            shift(&mut a, h);
            shift(&mut b, -h);
            let quotient: Vec<f64> =
                accelerations(&a).iter().zip(accelerations(&b)).map(|(a, b)| (a - b) / (2.0 * h)).collect();
            near(&column(m, j), &quotient, 1e-6)
        };
        let jacobians = c.equations.jacobians.as_ref().expect("small");
        for j in 0..n {
            prop_assert!(check(&jacobians.by_q, j, &|v, h| v.q[j] += h), "by q{j}");
            prop_assert!(check(&jacobians.by_u, j, &|v, h| v.u[j] += h), "by u{j}");
        }
        for j in 0..2 {
            prop_assert!(check(&jacobians.by_parameters, j, &|v, h| v.p[j] += h), "by p{j}");
        }
    }
}

/// A rigid body in its own frame: the angular velocities are linear in the rates and yet no derivatives of
/// anything.
#[test]
fn angular_velocities_of_a_body_frame_are_no_velocity_form() {
    let recipe = Recipe {
        family: Family::Bodies,
        n: 3,
        numbers: vec![0.3, 0.9, 1.1, 0.7],
        forced: false,
        lossy: false,
    };
    let mut b = Builder::new("Body");
    let q = b.coordinates("q", 3);
    let numbers = recipe.numbers.clone();
    let mut d = Draw(numbers.iter().cycle());
    let kinetic = body(&mut b, &mut d, &q);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let compiled = compile(b.model).expect("a good model");
    assert_ne!(compiled.equations.derivation, Derivation::VelocityForm);
    // Spinning about two axes at once it precesses: without the gyroscopic terms the accelerations would
    // vanish.
    let v = Values { q: vec![0.4, 0.8, -0.3], u: vec![1.0, 0.5, 2.0], p: Vec::new(), ..Values::default() };
    assert!(at(&compiled, &compiled.equations.accelerations, &v).iter().any(|a| a.abs() > 0.1));
}

#[test]
fn the_same_model_gives_the_same_programs_in_every_thread() {
    let text = || {
        let c = compile(common::chain(6)).expect("a good model");
        format!("{:?}{:?}", c.programs, c.equations)
    };
    let here = text();
    let there: Vec<String> = std::thread::scope(|s| {
        let threads: Vec<_> = (0..3).map(|_| s.spawn(text)).collect();
        threads.into_iter().map(|t| t.join().expect("no panic")).collect()
    });
    assert!(there.iter().all(|t| *t == here));
}

#[test]
fn a_weight_that_depends_on_q_may_be_the_square_of_a_true_velocity() {
    // T = ½ (d/dt eˣ)².
    let mut b = Builder::new("Exponential");
    let x = b.coordinate("x");
    let e = b.g().unary(Unary::Exp, x);
    let one = b.g().one();
    let k = b.kinetic(one, &[e]);
    b.energy("kinetic", EnergyRole::Kinetic, k);
    let c = compile(b.model).expect("a good model");
    assert_eq!(c.equations.derivation, Derivation::VelocityForm);
    // ẍ = −ẋ².
    let v = Values { q: vec![0.7], u: vec![1.3], ..Values::default() };
    assert!((at(&c, &c.equations.accelerations, &v)[0] + 1.69).abs() < 1e-14);
}
