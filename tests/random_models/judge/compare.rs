//! Everything emitted, by a second route that knows only values of the model's own functions on jets.
//!
//! Jets give ∂L/∂q̇, ∂D/∂q̇, Φ_q and γ exactly, by accelerations of unit size; L is differentiated by q, and
//! everything else once more, by differences of sixth order at two step sizes. Where the two do not agree
//! with each other, near a kink, nothing is said.

use crate::interpreted::{self, OWN};
use crate::states::{Point, states};
use crate::tangent::Tangential;
use crate::{Emitted, Own, Shape, Subject};

/// What came of a model.
#[derive(Default)]
pub(crate) struct Report {
    pub(crate) findings: Vec<String>,
    pub(crate) made: usize,
    /// Of these, comparisons with the interpreter.
    pub(crate) by_interpreter: usize,
    pub(crate) undecided: usize,
}

/// Relative agreement of what both routes compute without differences: rounding of some hundred operations.
pub(crate) const EXACT: f64 = 1e-11;
/// Relative agreement of a solution put back into the equations: rounding times the condition of M.
pub(crate) const SOLVED: f64 = 1e-9;
/// Relative agreement with differences of sixth order at steps of 2e-3.
pub(crate) const BY_DIFFERENCES: f64 = 1e-6;
/// A difference is believed to this many times what its two step sizes differ by.
const SPREADS: f64 = 30.0;
/// Findings of one model that are told.
const TOLD: usize = 6;

/// Central difference of sixth order, and its spread over two steps.
fn slope(f: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let with = |h: f64| {
        let d = |k: f64| f(k * h) - f(-k * h);
        (45.0 * d(1.0) - 9.0 * d(2.0) + d(3.0)) / (60.0 * h)
    };
    let (fine, coarse) = (with(2e-3), with(5e-3));
    (fine, (fine - coarse).abs())
}

/// Two Lagrangians of the same motions, derived by different routes: M, Q, accelerations, outputs.
pub(crate) fn twins(name: &str, original: &dyn Subject, twin: &dyn Subject) -> Vec<String> {
    let shape = original.shape();
    let mut judge = Judge::new(twin, &shape);
    for at in states(name, shape.coordinates, shape.inputs) {
        let (a, b) = (original.emitted(&at), twin.emitted(&at));
        let (Ok((of_a, _)), Ok((of_b, _))) = (&a.solved, &b.solved) else { continue };
        for (what, a, b) in [
            ("M of twins", &a.mass, &b.mass),
            ("Q of twins", &a.force, &b.force),
            ("q̈ of twins", of_a, of_b),
            ("outputs of twins", &a.outputs, &b.outputs),
        ] {
            let scale = a.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
            // Near a corner rounding decides the branch.
            a.iter().zip(b).for_each(|(a, b)| judge.near(what, *a, *b, scale, SOLVED, 0.0));
        }
    }
    judge.report.findings
}

pub(crate) fn judge(name: &str, model: &dyn Subject) -> Report {
    let shape = model.shape();
    let mut judge = Judge::new(model, &shape);
    let interpreted = interpreted::read(model.interpreted());
    let places = match interpreted.as_slice() {
        // Where no state was found there are none.
        [] if model.interpreted().is_empty() => states(name, shape.coordinates, shape.inputs),
        some => some.iter().map(|state| state.at.clone()).collect(),
    };
    for (k, at) in places.iter().enumerate() {
        let emitted = model.emitted(at);
        if let Some(interpreted) = interpreted.get(k) {
            judge.beside_interpreter(&emitted, interpreted);
            judge.slopes_beside_interpreter(model, interpreted);
        }
        let is_tangential = interpreted.get(k).is_some_and(|state| state.is_tangential);
        judge.state(at, &emitted, k == 0, is_tangential);
    }
    judge.report
}

pub(crate) struct Judge<'a> {
    model: &'a dyn Subject,
    pub(crate) shape: &'a Shape,
    pub(crate) report: Report,
    /// How the second route is called.
    pub(crate) route: &'static str,
    /// Quantities that already differed.
    met: Vec<String>,
}

/// A generalized force by the second route.
pub(crate) struct Force {
    pub(crate) value: f64,
    pub(crate) spread: f64,
    pub(crate) scale: f64,
    /// What of it is applied.
    pushed: f64,
}

/// Whether this column of M is compared: all of them of up to 30 coordinates. They take n² runs of the
/// model's functions, which alone would be minutes for each of the largest models.
fn compared(column: usize, n: usize) -> bool {
    column.is_multiple_of(n.div_ceil(30))
}

impl<'a> Judge<'a> {
    fn new(model: &'a dyn Subject, shape: &'a Shape) -> Self {
        Self { model, shape, report: Report::default(), route: OWN, met: Vec::new() }
    }

    /// Two numbers that should agree; `doubt` is what the second may be off by.
    pub(crate) fn near(
        &mut self,
        what: &str,
        emitted: f64,
        own: f64,
        scale: f64,
        tolerance: f64,
        doubt: f64,
    ) {
        self.report.made += 1;
        if emitted == own || emitted.is_nan() && own.is_nan() {
            return;
        }
        let allowed = tolerance * (1.0 + scale.abs().max(own.abs())) + SPREADS * doubt;
        // A spread as large as this is a kink, not a difference.
        if !allowed.is_finite() || SPREADS * doubt > 0.05 * (1.0 + own.abs()) {
            self.report.undecided += 1;
            return;
        }
        let error = (emitted - own).abs();
        if error > allowed || error.is_nan() {
            let kind = what.split(' ').next().unwrap_or_default().to_owned();
            if !self.met.contains(&kind) && self.met.len() < TOLD {
                self.report.findings.push(format!("{what}: emitted {emitted:e}, {} {own:e}", self.route));
                self.met.push(kind);
            }
        }
    }

    fn own(&self, at: &Point, a: &[f64]) -> Own {
        self.model.own(at, a, &[])
    }

    /// The model's own values at ten places a rounding away: what the second route is uncertain by.
    fn noise(&self, at: &Point, of: &dyn Fn(&Point) -> Vec<f64>) -> Vec<f64> {
        let here = of(at);
        let mut noise = vec![0.0_f64; here.len()];
        for by in [-1e-13, 1e-13] {
            let mut beside = at.clone();
            beside.q.iter_mut().chain(&mut beside.u).chain([&mut beside.t]).for_each(|x| *x *= 1.0 + by);
            for (n, (a, b)) in noise.iter_mut().zip(of(&beside).iter().zip(&here)) {
                *n = n.max((a - b).abs());
            }
        }
        noise
    }

    fn state(&mut self, at: &Point, emitted: &Emitted, with_slopes: bool, is_tangential: bool) {
        let n = self.shape.coordinates;
        let unit = |j: usize| (0..n).map(|i| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
        let zero = vec![0.0; n];

        // ∂L/∂q̇ and ∂D/∂q̇: L̇ is linear in q̈.
        let lagrangian =
            |p: &Point, a: &[f64]| self.model.own(p, a, &[]).lagrangian.map_or(0.0, |l| l.rate());
        let momenta = |p: &Point| -> Vec<f64> {
            let free = lagrangian(p, &zero);
            (0..n).map(|j| lagrangian(p, &unit(j)) - free).collect()
        };
        let p = momenta(at);
        // Forces may go by reactions.
        let given = emitted.solved.as_ref().map_or(&[][..], |(_, multipliers)| multipliers);
        let own = self.model.own(at, &zero, given);
        let l = own.lagrangian.map_or(0.0, |l| l.value());
        // Momenta are differences of L̇, which may be larger by far.
        let rounding = 1e2 * f64::EPSILON * lagrangian(at, &zero).abs();
        for i in (0..n).filter(|_| !is_tangential) {
            self.near(&format!("momentum of q[{i}]"), emitted.momenta[i], p[i], 1.0, EXACT, rounding);
        }
        let energy: f64 = p.iter().zip(&at.u).map(|(p, u)| p * u).sum::<f64>() - l;
        let noise = self.noise(at, &|p| vec![self.own(p, &zero).lagrangian.map_or(0.0, |l| l.value())]);
        self.near("energy", emitted.energy, energy, l, EXACT, 1e2 * noise[0]);

        let (mass, masses) = self.mass(at, &momenta);
        for k in (0..n * n).filter(|k| compared(k % n, n) && !is_tangential) {
            let what = format!("M[{}, {}]", k / n, k % n);
            self.near(&what, emitted.mass[k], mass[k], 1.0, BY_DIFFERENCES, masses[k]);
        }
        let forces = self.forces(at, &own, &p, &momenta);
        if is_tangential {
            let found = Tangential { momenta: &p, mass: (&mass, &masses), forces: &forces };
            self.along_the_constraints(emitted, &own, &found);
        } else {
            self.force(emitted, &own, &forces);
        }
        if self.shape.rows == 0 {
            self.powers(at, emitted, &own, &forces);
        }
        self.constraints(at, emitted);
        match &emitted.solved {
            Ok((a, multipliers)) => {
                let (a, multipliers) = (a.clone(), multipliers.clone());
                self.solution(emitted, &a, &multipliers);
                self.results(at, emitted, &a, &multipliers);
                if with_slopes {
                    self.slopes(at);
                }
            }
            Err(_) if self.shape.rows > 0 => self.report.undecided += 1,
            Err(error) => {
                let pivot = (0..n).map(|i| mass[n * i + i]).fold(f64::INFINITY, f64::min);
                self.report.findings.push(format!(
                    "no accelerations: {error}; least diagonal of M \
                    {pivot:e}"
                ));
            }
        }
    }

    /// M = ∂p/∂q̇, p linear in q̇ or not.
    fn mass(&self, at: &Point, momenta: &dyn Fn(&Point) -> Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let n = self.shape.coordinates;
        let (mut mass, mut spread) = (vec![0.0; n * n], vec![0.0; n * n]);
        for j in (0..n).filter(|j| compared(*j, n)) {
            let along = |h: f64| {
                let mut p = at.clone();
                p.u[j] += h;
                momenta(&p)
            };
            let samples: Vec<(f64, Vec<f64>)> = [-1.0, 1.0, -2.0, 2.0, -3.0, 3.0]
                .iter()
                .flat_map(|k| [2e-3 * k, 5e-3 * k])
                .map(|h| (h, along(h)))
                .collect();
            let at_step = |h: f64, i: usize| {
                samples.iter().find(|(s, _)| (s - h).abs() < 1e-9).map_or(f64::NAN, |(_, p)| p[i])
            };
            for i in 0..n {
                let (d, s) = slope(&|h| at_step(h, i));
                (mass[n * i + j], spread[n * i + j]) = (d, s);
            }
        }
        (mass, spread)
    }

    /// Q = ∂L/∂q − (∂p/∂q) q̇ − ∂p/∂t − ∂D/∂q̇ + Σ size ∂place/∂q.
    fn forces(&self, at: &Point, own: &Own, p: &[f64], momenta: &dyn Fn(&Point) -> Vec<f64>) -> Vec<Force> {
        let n = self.shape.coordinates;
        let zero = vec![0.0; n];
        let at_rest = Point { u: zero.clone(), ..at.clone() };
        let places = |p: &Point| -> Vec<f64> {
            self.model.own(p, &zero, &[]).along.iter().map(|(place, _)| place.rate()).collect()
        };
        let still = places(&at_rest);
        let drag = |a: &[f64]| self.model.own(at, a, &[]).dissipation.map_or(0.0, |d| d.rate());
        let free = drag(&zero);
        // Along the motion: p moves with q and t, not with q̇.
        let carried = |h: f64| {
            let mut moved = at.clone();
            moved.t += h;
            moved.q.iter_mut().zip(&at.u).for_each(|(q, u)| *q += h * u);
            momenta(&moved)
        };
        let steps: Vec<(f64, Vec<f64>)> = [-1.0, 1.0, -2.0, 2.0, -3.0, 3.0]
            .iter()
            .flat_map(|k| [2e-3 * k, 5e-3 * k])
            .map(|h| (h, carried(h)))
            .collect();
        let mut forces = Vec::new();
        for i in 0..n {
            let by_q = slope(&|h| {
                let mut moved = at.clone();
                moved.q[i] += h;
                self.model.own(&moved, &zero, &[]).lagrangian.map_or(0.0, |l| l.value())
            });
            let by_time =
                slope(&|h| steps.iter().find(|(s, _)| (s - h).abs() < 1e-9).map_or(f64::NAN, |(_, p)| p[i]));
            let mut unit = zero.clone();
            unit[i] = 1.0;
            let dissipated = drag(&unit) - free;
            let moved = places(&Point { u: unit, ..at.clone() });
            let pushed: f64 = own
                .along
                .iter()
                .zip(moved.iter().zip(&still))
                .map(|((_, size), (a, b))| size * (a - b))
                .sum();
            forces.push(Force {
                value: by_q.0 - by_time.0 - dissipated + pushed,
                spread: by_q.1 + by_time.1,
                scale: by_time.0.abs() + p[i].abs(),
                pushed,
            });
        }
        forces
    }

    fn force(&mut self, emitted: &Emitted, own: &Own, forces: &[Force]) {
        let has_reactions = own.along.iter().any(|(_, size)| size.is_nan());
        if own.given_along != own.forces.len() || has_reactions && emitted.solved.is_err() {
            return;
        }
        for (i, Force { value, spread, scale, .. }) in forces.iter().enumerate() {
            self.near(&format!("Q[{i}]"), emitted.force[i], *value, *scale, BY_DIFFERENCES, *spread);
        }
    }

    /// The sum of all powers, of models without constraints.
    fn powers(&mut self, at: &Point, emitted: &Emitted, own: &Own, forces: &[Force]) {
        let n = self.shape.coordinates;
        let zero = vec![0.0; n];
        let drag = |a: &[f64]| self.model.own(at, a, &[]).dissipation.map_or(0.0, |d| d.rate());
        let free = drag(&zero);
        let named = self.shape.powers.iter().zip(&emitted.powers);
        let emitted_powers: Vec<f64> =
            named.filter(|(name, _)| **name != "explicit time").map(|(_, power)| *power).collect();
        // Forces stand in the order of their functions, but dissipations may stand among them: only the sum
        // is compared.
        let dissipation: f64 = (0..n)
            .map(|i| {
                let mut unit = zero.clone();
                unit[i] = 1.0;
                -(drag(&unit) - free) * at.u[i]
            })
            .sum();
        // Places that move with time do work besides, which is no force on a coordinate.
        let pushed = forces.iter().zip(&at.u).map(|(force, u)| force.pushed * u).sum::<f64>();
        let sum = if own.given_along == own.forces.len() { pushed } else { own.forces.iter().sum() };
        let sum = sum + dissipation;
        self.near("powers", emitted_powers.iter().sum(), sum, dissipation, EXACT, 0.0);
    }

    /// M q̈ = Q + Φ_qᵀλ, Φ_q q̈ = γ.
    fn solution(&mut self, emitted: &Emitted, a: &[f64], multipliers: &[f64]) {
        let n = self.shape.coordinates;
        let size = a.iter().chain(multipliers).fold(0.0_f64, |s, x| s.max(x.abs()));
        if size > 1e6 {
            self.report.undecided += 1;
            return;
        }
        for i in 0..n {
            let left: f64 = (0..n).map(|j| emitted.mass[n * i + j] * a[j]).sum();
            let held: f64 =
                multipliers.iter().enumerate().map(|(r, l)| emitted.jacobian[n * r + i] * l).sum();
            let scale = (0..n).map(|j| (emitted.mass[n * i + j] * a[j]).abs()).fold(size, f64::max);
            self.near(&format!("M q̈ of row {i}"), left, emitted.force[i] + held, scale, SOLVED, 0.0);
        }
        for r in 0..multipliers.len() {
            let left: f64 = (0..n).map(|j| emitted.jacobian[n * r + j] * a[j]).sum();
            self.near(&format!("Φ_q q̈ of row {r}"), left, emitted.gamma[r], size, SOLVED, 0.0);
        }
    }

    /// Outputs and events, at the accelerations and multipliers that were emitted.
    fn results(&mut self, at: &Point, emitted: &Emitted, a: &[f64], multipliers: &[f64]) {
        let own = self.model.own(at, a, multipliers);
        let all = |own: &Own| {
            own.outputs.iter().chain(&own.speeds).chain(&own.events).copied().collect::<Vec<f64>>()
        };
        let noise = self.noise(at, &|p| all(&self.model.own(p, a, multipliers)));
        let (left, right) = (emitted.outputs.len(), own.outputs.len() + own.speeds.len());
        if left != right {
            self.report.findings.push(format!("{left} outputs are emitted for {right}"));
            return;
        }
        let pairs: Vec<(f64, f64)> =
            emitted.outputs.iter().chain(&emitted.events).copied().zip(all(&own)).collect();
        let size = a.iter().chain(multipliers).fold(0.0_f64, |s, x| s.max(x.abs()));
        for (i, (emitted, own)) in pairs.into_iter().enumerate() {
            let name = self
                .shape
                .outputs
                .get(i)
                .map_or_else(|| "event".to_owned(), |name| format!("output `{name}`"));
            self.near(&name, emitted, own, size, EXACT, 1e3 * noise[i]);
        }
    }

    fn constraints(&mut self, at: &Point, emitted: &Emitted) {
        let n = self.shape.coordinates;
        if self.shape.rows == 0 {
            return;
        }
        let zero = vec![0.0; n];
        let own = self.model.own(at, &zero, &[]);
        let still = self.model.own(&Point { u: zero.clone(), ..at.clone() }, &zero, &[]);
        let holonomic = own.holonomic.len();
        let rows = |own: &Own| -> Vec<dynamics::Expr> {
            own.holonomic.iter().chain(&own.nonholonomic).copied().collect()
        };
        let value = |r: usize, row: &dynamics::Expr| if r < holonomic { row.rate() } else { row.value() };
        let moved: Vec<Own> = (0..n)
            .map(|j| {
                let mut unit = zero.clone();
                unit[j] = 1.0;
                self.model.own(&Point { u: unit, ..at.clone() }, &zero, &[])
            })
            .collect();
        for (r, row) in rows(&own).iter().enumerate() {
            if r < holonomic {
                self.near(&format!("Φ[{r}]"), emitted.residual[r], row.value(), 1.0, EXACT, 0.0);
            }
            self.near(&format!("Φ̇[{r}]"), emitted.rates[r], value(r, row), 1.0, EXACT, 0.0);
            let gamma = if r < holonomic { -row.acceleration() } else { -row.rate() };
            self.near(&format!("γ[{r}]"), emitted.gamma[r], gamma, 1.0, EXACT, 0.0);
            for (j, moved) in moved.iter().enumerate() {
                let entry = value(r, &rows(moved)[r]) - value(r, &rows(&still)[r]);
                self.near(&format!("Φ_q[{r}, {j}]"), emitted.jacobian[n * r + j], entry, 1.0, EXACT, 0.0);
            }
        }
    }

    /// Derivatives of the accelerations, which are themselves compared before.
    fn slopes(&mut self, at: &Point) {
        let (model, shape) = (self.model, self.shape);
        let n = shape.coordinates;
        let (has, says) = model.has_jacobians();
        if has != says {
            self.report.findings.push(format!("Jacobians: {has}, by `REPORT` {says}"));
        }
        let Some(slopes) = model.slopes(at) else {
            // With constraints there may be none: at singular positions, and where equations are too long.
            if shape.rows == 0 && has {
                self.report.findings.push("accelerations, but no Jacobians of them".to_owned());
            }
            return;
        };
        let mut columns =
            |what: &str, emitted: &[f64], width: usize, f: &dyn Fn(usize, f64) -> Option<Vec<f64>>| {
                // The first few columns say what all of them would.
                for j in 0..width.min(4) {
                    let samples: Vec<(f64, Option<Vec<f64>>)> = [-1.0, 1.0, -2.0, 2.0, -3.0, 3.0]
                        .iter()
                        .flat_map(|k| [2e-3 * k, 5e-3 * k])
                        .map(|h| (h, f(j, h)))
                        .collect();
                    for i in 0..n {
                        let sample = |h: f64| {
                            let found = samples.iter().find(|(s, _)| (s - h).abs() < 1e-9);
                            found.and_then(|(_, a)| a.as_ref()).map_or(f64::NAN, |a| a[i])
                        };
                        let (own, spread) = slope(&sample);
                        self.near(
                            &format!(
                                "{what} [{i}, \
                        {j}]"
                            ),
                            emitted[width * i + j],
                            own,
                            1.0,
                            BY_DIFFERENCES,
                            spread,
                        );
                    }
                }
            };
        let accelerations = |p: &Point| model.emitted(p).solved.ok().map(|(a, _)| a);
        columns("∂q̈/∂q", &slopes.by_q, n, &|j, h| {
            let mut p = at.clone();
            p.q[j] += h;
            accelerations(&p)
        });
        columns("∂q̈/∂q̇", &slopes.by_u, n, &|j, h| {
            let mut p = at.clone();
            p.u[j] += h;
            accelerations(&p)
        });
        columns("∂q̈/∂input", &slopes.by_input, shape.inputs, &|j, h| {
            let mut p = at.clone();
            p.inputs[j] += h;
            accelerations(&p)
        });
        columns("∂q̈/∂parameter", &slopes.by_parameter, shape.parameters, &|j, h| {
            model.with_parameter(at, j, 0.1 * h).map(|a| a.into_iter().map(|x| 10.0 * x).collect())
        });
    }
}
