//! What the problems have in common: the KKT system, dense; random states on the manifold; errors judged
//! apart.

use dynamics::model::{Terms, Vector};
use dynamics::prelude::*;
use nalgebra::{DMatrix, DVector};

/// M q̈ − Φ_qᵀλ = Q, Φ_q q̈ = γ at a state, as dense matrices.
#[derive(Clone, Debug)]
pub(crate) struct Kkt {
    pub(crate) mass: DMatrix<f64>,
    pub(crate) force: DVector<f64>,
    pub(crate) jacobian: DMatrix<f64>,
    pub(crate) gamma: DVector<f64>,
}

impl Kkt {
    /// From rows written by hand.
    pub(crate) fn new<const N: usize, const R: usize>(
        mass: [[f64; N]; N],
        force: [f64; N],
        jacobian: [[f64; N]; R],
        gamma: [f64; R],
    ) -> Self {
        Self {
            mass: DMatrix::from_fn(N, N, |i, j| mass[i][j]),
            force: DVector::from_row_slice(&force),
            jacobian: DMatrix::from_fn(R, N, |i, j| jacobian[i][j]),
            gamma: DVector::from_row_slice(&gamma),
        }
    }

    /// What the model says.
    pub(crate) fn of<M: Simulate>(model: &M, state: &M::State) -> Self {
        let (n, r) = (M::Vector::LEN, M::Rows::LEN);
        let (mut mass, mut force) = (vec![0.0; n * n], vec![0.0; n]);
        let (mut jacobian, mut gamma) = (vec![0.0; r * n], vec![0.0; r]);
        let mut terms =
            Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma };
        model.terms(state, &mut terms);
        Self {
            mass: DMatrix::from_row_slice(n, n, &mass),
            force: DVector::from_row_slice(&force),
            jacobian: DMatrix::from_row_slice(r, n, &jacobian),
            gamma: DVector::from_row_slice(&gamma),
        }
    }

    /// q̈ and λ by LU with pivoting of [M −Φ_qᵀ; Φ_q 0], for Φ_q of full rank; one refinement.
    pub(crate) fn solve(&self) -> (DVector<f64>, DVector<f64>) {
        let (n, r) = (self.force.len(), self.gamma.len());
        let mut matrix = DMatrix::zeros(n + r, n + r);
        matrix.view_mut((0, 0), (n, n)).copy_from(&self.mass);
        matrix.view_mut((0, n), (n, r)).copy_from(&-self.jacobian.transpose());
        matrix.view_mut((n, 0), (r, n)).copy_from(&self.jacobian);
        let right = DVector::from_iterator(n + r, self.force.iter().chain(self.gamma.iter()).copied());
        let lu = matrix.clone().lu();
        let mut solution = lu.solve(&right).expect("a KKT matrix of full rank");
        solution += lu.solve(&(&right - &matrix * &solution)).expect("a KKT matrix of full rank");
        (solution.rows(0, n).into_owned(), solution.rows(n, r).into_owned())
    }

    /// Asserts that both say the same, relative to the size of each matrix.
    #[track_caller]
    pub(crate) fn assert_equals(&self, other: &Self, tolerance: f64) {
        let parts = [
            ("mass matrix", relative(self.mass.as_slice(), other.mass.as_slice())),
            ("generalized force", relative(self.force.as_slice(), other.force.as_slice())),
            ("constraint Jacobian", relative(self.jacobian.as_slice(), other.jacobian.as_slice())),
            ("gamma", relative(self.gamma.as_slice(), other.gamma.as_slice())),
        ];
        for (what, error) in parts {
            assert!(error <= tolerance, "{what}: difference {error:e}\n{self:?}\n{other:?}");
        }
    }
}

/// Largest difference relative to the largest value met; NaN where a value is.
pub(crate) fn relative(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().chain(b).fold(0.0, |s: f64, x| s.max(x.abs()));
    if scale == 0.0 { 0.0 } else { distance(a, b) / scale }
}

/// Largest absolute difference; NaN where a value is.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, |m: f64, d| if d.is_nan() { d } else { m.max(d) })
}

/// A small deterministic generator, so that a failure can be repeated (xorshift64*).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self, spread: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let unit = (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64;
        spread * (2.0 * unit - 1.0)
    }
}

/// A state that satisfies the constraints to rounding, at random around another: Newton with the
/// pseudo-inverse of Φ_q, none of the library's solvers. `None` where Newton does not settle.
pub(crate) fn near<M: Simulate>(
    model: &M,
    around: &M::State,
    random: &mut Random,
    spread: (f64, f64),
) -> Option<M::State> {
    let mut state = *around;
    state.q_mut().as_mut_slice().iter_mut().for_each(|q| *q += random.next(spread.0));
    state.u_mut().as_mut_slice().iter_mut().for_each(|u| *u += random.next(spread.1));
    let rows = M::Residual::LEN;
    let mut settled = rows == 0;
    for _ in 0..if settled { 0 } else { 60 } {
        let residual = DVector::from_row_slice(model.residual(&state).as_slice());
        let step =
            Kkt::of(model, &state).jacobian.rows(0, rows).into_owned().svd(true, true).solve(&residual, 1e-9);
        let step = step.ok()?;
        state.q_mut().as_mut_slice().iter_mut().zip(&step).for_each(|(q, d)| *q -= d);
        if settled {
            break;
        }
        settled = step.amax() < 1e-9;
    }
    for _ in 0..2 {
        let residual = DVector::from_row_slice(model.velocity_residual(&state).as_slice());
        let step = Kkt::of(model, &state).jacobian.svd(true, true).solve(&residual, 1e-9).ok()?;
        state.u_mut().as_mut_slice().iter_mut().zip(&step).for_each(|(u, d)| *u -= d);
    }
    settled.then_some(state)
}

/// Values of a motion at a time: positions, velocities and multipliers apart; what is not published is left
/// empty.
pub(crate) struct Reference<'a> {
    pub(crate) t: f64,
    pub(crate) q: &'a [f64],
    pub(crate) u: &'a [f64],
    pub(crate) multipliers: &'a [f64],
}

/// How far a run may be from the reference: largest errors of positions, velocities and multipliers over the
/// whole table, each relative to the largest value of its kind there, and the largest |Φ| and |Φ̇| at any
/// step.
pub(crate) struct Promise {
    pub(crate) formulation: Formulation,
    pub(crate) tolerance: f64,
    pub(crate) errors: [f64; 3],
    pub(crate) drift: [f64; 2],
}

/// A line of a table of promises.
pub(crate) const fn promise(
    formulation: Formulation,
    tolerance: f64,
    errors: [f64; 3],
    drift: [f64; 2],
) -> Promise {
    Promise { formulation, tolerance, errors, drift }
}

/// Runs the model in every way that the table lists and judges positions, velocities, multipliers and drift
/// apart. All lines are judged before it fails, so that one run shows the whole table.
#[track_caller]
pub(crate) fn keeps<M: Simulate>(
    model: &M,
    start: M::State,
    references: &[Reference<'_>],
    promises: &[Promise],
) {
    judge(model, start, references, None, promises);
}

/// [`keeps`] with a method that is not chosen by itself.
#[track_caller]
pub(crate) fn keeps_with<M: Simulate>(
    method: impl Into<methods::Any<M>>,
    model: &M,
    start: M::State,
    references: &[Reference<'_>],
    promises: &[Promise],
) {
    judge(model, start, references, Some(method.into()), promises);
}

#[track_caller]
fn judge<M: Simulate>(
    model: &M,
    start: M::State,
    references: &[Reference<'_>],
    method: Option<methods::Any<M>>,
    promises: &[Promise],
) {
    let end = references.iter().fold(0.0, |end: f64, r| end.max(r.t));
    let (mut table, mut kept) = (String::new(), true);
    for Promise { formulation, tolerance, errors, drift } in promises {
        let run = model.simulate(start).until(end).tolerance(*tolerance).formulation(*formulation);
        let run = if let Some(method) = &method { run.method(method) } else { run };
        let motion = run.run().unwrap_or_else(|e| panic!("{formulation:?} at {tolerance:e}: {e}"));
        let met = errors_of(&motion, references);
        let summary = motion.verify();
        let drifts = summary.constraints.iter();
        let drifted =
            drifts.fold([0.0f64; 2], |[a, b], d| [worse(a, d.residual), worse(b, d.velocity_residual)]);
        let good = met.iter().zip(errors).all(|(e, bound)| e <= bound)
            && drifted.iter().zip(drift).all(|(d, b)| d <= b);
        kept &= good;
        table += &format!(
            "{} {formulation:?} at {tolerance:.0e}: errors {} (digits {:.1?}), drift {}, {} steps, {} \
             evaluations\n",
            if good { "kept  " } else { "BROKEN" },
            beside(&met, errors),
            met.map(|error| -error.log10()),
            beside(&drifted, drift),
            summary.steps,
            summary.evaluations
        );
    }
    println!("{table}");
    assert!(kept, "{table}");
}

/// Runs with a fixed step and half of it: errors of positions, velocities and multipliers, each with its own
/// bound, fall to a quarter, and drift stays at rounding level.
#[track_caller]
pub(crate) fn keeps_order_2<M: Simulate>(
    method: impl Into<methods::Any<M>>,
    model: &M,
    start: M::State,
    references: &[Reference<'_>],
    (h, bounds): (f64, [f64; 3]),
) {
    let method = method.into();
    let end = references.iter().fold(0.0, |end: f64, r| end.max(r.t));
    let [coarse, fine] = [h, 0.5 * h].map(|h| {
        let run = model.simulate(start).until(end).fixed_step(h).method(&method).run();
        let motion = run.unwrap_or_else(|e| panic!("{method} with steps of {h:e}: {e}"));
        let summary = motion.verify();
        let drift = summary
            .constraints
            .iter()
            .fold(0.0, |m: f64, d| worse(m, worse(d.residual, d.velocity_residual)));
        let errors = errors_of(&motion, references);
        println!("{method} {h:e}: errors {}, drift {drift:.1e}", beside(&errors, &bounds));
        println!("  {} steps, {} evaluations", summary.steps, summary.evaluations);
        assert!(drift < 1e-11, "{summary}");
        errors
    });
    for (k, bound) in bounds.iter().enumerate() {
        let order = (coarse[k] / fine[k]).log2();
        println!("order {order:.2}");
        assert!(fine[k] < *bound && (1.85..2.4).contains(&order), "{coarse:?} {fine:?}, order {order}");
    }
}

/// Runs embedded and projected at five tolerances: as the geometric mean over them, what is embedded may have
/// `factor` times the error, in positions and in velocities, and at none twenty times that; drift stays at
/// rounding level. An error passes zero now and then, so that each is the geometric mean of those at three
/// tolerances close by.
#[track_caller]
pub(crate) fn embeds_as_it_projects<M: Simulate>(
    model: &M,
    start: M::State,
    references: &[Reference<'_>],
    factor: f64,
) {
    let (mut table, mut kept, mut excess) = (String::new(), true, [0.0f64; 2]);
    let tolerances = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10];
    for tolerance in tolerances {
        let [projected, embedded] = [Formulation::Projected, Formulation::Embedded].map(|formulation| {
            let close_by = [1.0, 0.8, 0.64]
                .map(|part| Held::of(model, start, references, formulation, part * tolerance));
            close_by.into_iter().reduce(Held::and).expect("three").mean(3.0)
        });
        let drift = worse(projected.drift, embedded.drift);
        let ratio = [0, 1].map(|k| embedded.errors[k] / projected.errors[k]);
        kept &= ratio.iter().all(|ratio| *ratio < 20.0 * factor) && drift < 1e-12;
        (0..2).for_each(|k| excess[k] += ratio[k].ln() / tolerances.len() as f64);
        table += &format!(
            "{tolerance:.0e}: embedded {} in {} evaluations; projected {} in {}; drift {drift:.1e}\n",
            beside(&embedded.errors, &projected.errors),
            embedded.evaluations,
            beside(&projected.errors, &[tolerance; 2]),
            projected.evaluations
        );
    }
    let excess = excess.map(f64::exp);
    table += &format!("in the mean {excess:.2?} times the error");
    println!("{table}");
    assert!(kept && excess.iter().all(|excess| *excess < factor), "{table}");
}

/// How motions held their constraints.
struct Held {
    /// Of positions and velocities; logarithms until the mean is taken.
    errors: [f64; 2],
    drift: f64,
    evaluations: u64,
}

impl Held {
    #[track_caller]
    fn of<M: Simulate>(
        model: &M,
        start: M::State,
        references: &[Reference<'_>],
        formulation: Formulation,
        tolerance: f64,
    ) -> Self {
        let end = references.iter().fold(0.0, |end: f64, r| end.max(r.t));
        let run = model.simulate(start).until(end).tolerance(tolerance).formulation(formulation).run();
        let motion = run.unwrap_or_else(|e| panic!("{formulation:?} at {tolerance:e}: {e}"));
        let (errors, summary) = (errors_of(&motion, references), motion.verify());
        let drift = summary.constraints.iter();
        let drift = drift.fold(0.0, |most, row| worse(most, worse(row.residual, row.velocity_residual)));
        Self { errors: [errors[0].ln(), errors[1].ln()], drift, evaluations: summary.evaluations }
    }

    fn and(self, other: Self) -> Self {
        Self {
            errors: [0, 1].map(|k| self.errors[k] + other.errors[k]),
            drift: worse(self.drift, other.drift),
            evaluations: self.evaluations + other.evaluations,
        }
    }

    fn mean(self, of: f64) -> Self {
        Self {
            errors: self.errors.map(|x| (x / of).exp()),
            evaluations: self.evaluations / of as u64,
            ..self
        }
    }
}

/// Each value with its bound.
fn beside(values: &[f64], bounds: &[f64]) -> String {
    let pairs: Vec<_> =
        values.iter().zip(bounds).map(|(value, bound)| format!("{value:.1e} ≤ {bound:.0e}")).collect();
    pairs.join(", ")
}

fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Largest errors of positions, velocities and multipliers over the table, each relative to the largest value
/// of its kind.
fn errors_of<M: Simulate>(motion: &Motion<'_, M>, references: &[Reference<'_>]) -> [f64; 3] {
    let (mut errors, mut scales) = ([0.0; 3], [0.0f64; 3]);
    for reference in references {
        let state = motion.at(reference.t);
        let multipliers = motion.multipliers_at(reference.t);
        let kinds = [
            (state.q().as_slice(), reference.q),
            (state.u().as_slice(), reference.u),
            (multipliers.as_slice(), reference.multipliers),
        ];
        for (k, (value, known)) in kinds.into_iter().enumerate().filter(|(_, (_, known))| !known.is_empty()) {
            errors[k] = worse(errors[k], distance(value, known));
            scales[k] = known.iter().fold(scales[k], |s, x| s.max(x.abs()));
        }
    }
    [0, 1, 2].map(|k| if errors[k] == 0.0 { 0.0 } else { errors[k] / scales[k] })
}

/// Asserts that every formulation agrees to 1e-10, in accelerations and in multipliers, with the dense
/// solution of the equations by hand.
#[track_caller]
pub(crate) fn assert_agreement<M: Simulate>(model: &M, state: &M::State, by_hand: &Kkt) {
    let (accelerations, multipliers) = by_hand.solve();
    let comparison = model.compare_formulations(state).expect("a solution");
    assert!(comparison.unique && comparison.disagreement() <= 1e-10, "{comparison}\nat {state:?}");
    for formulation in &comparison.formulations {
        let Ok(solved) = &formulation.solved else {
            panic!("{} does not apply at {state:?}:\n{comparison}", formulation.name)
        };
        let a = relative(solved.accelerations.as_slice(), accelerations.as_slice());
        // Multipliers may be what large forces leave of each other: their rounding is that of the forces.
        let forces = by_hand.force.amax() / by_hand.jacobian.amax();
        let l =
            distance(solved.multipliers.as_slice(), multipliers.as_slice()) / multipliers.amax().max(forces);
        let name = &formulation.name;
        assert!(
            a <= 1e-10 && l <= 1e-10,
            "{name}: accelerations differ by {a:e}, multipliers by {l:e} at {state:?}"
        );
    }
}
