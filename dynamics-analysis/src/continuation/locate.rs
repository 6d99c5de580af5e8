//! Special points between two points of a branch: detection, location, classification.
//!
//! An interval with more than one special point is halved until each is alone. A single one is enclosed along
//! the branch, and then computed from equations that are regular there (`newton.rs`). Where branches meet,
//! the null space of [K, F_p] is a plane: the direction in it normal to this branch leads to the other one
//! (Keller's method IV), which is followed a little way to both sides to classify the point.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Powers, Vector};
use nalgebra::{DMatrix, DVector};

use super::branch::{Special, SpecialKind};
use super::newton::Singular;
use super::problem::{Balance, ContinuationProblem, Direction};
use super::trace::{Sample, Tracer, shape};

/// Points nearer than this along the branch are one.
const TWICE: f64 = 1e-13;
/// A point that is enclosed lies no farther beside that, as a part of the step: farther away there is another
/// one.
const ENCLOSED_DISTANCE: f64 = 0.01;
/// A point at the end of an interval may be found beyond it by this part, for rounding.
const WITHIN: f64 = 1e-6;
/// How often an interval is halved for what happens in it to stand alone.
const HALVED: usize = 32;
/// How often it is halved for shapes alone to be told apart.
const FOLLOWED: usize = 6;
/// A fold that is nearer to the start than this is that in which the branch begins.
const BEGINS: f64 = 1e-6;
/// The slope of the parameter there is less than this.
const IN_FOLD: f64 = 1e-4;
/// β of a branch point, against the forces that stiffness makes: more is a near miss, of branches that do not
/// meet.
const UNFOLDED: f64 = 1e-10;

impl<M: Constraints + Powers> Tracer<'_, M> {
    /// Looks for folds and branch points in a step, of which the middle is known, and where something seems
    /// to dip to zero; false as in [`Tracer::inspect`].
    pub(super) fn inspect_step(&mut self, a: &Sample<M>, middle: &Sample<M>, b: &Sample<M>) -> bool {
        let length = self.ahead(a, b);
        let mut dips = Vec::new();
        for part in a.watch.dips(&middle.watch, &b.watch) {
            dips.extend(self.beside(a, part * length, length).map(|(sample, _)| (part, sample)).ok());
        }
        let (before, after): (Vec<_>, Vec<_>) = dips.iter().partition(|(part, _)| *part < 0.5);
        let between =
            before.into_iter().map(|(_, s)| s).chain([middle]).chain(after.into_iter().map(|(_, s)| s));
        let places: Vec<&Sample<M>> = [a].into_iter().chain(between).chain([b]).collect();
        places.windows(2).all(|pair| self.inspect(pair[0], pair[1], 0))
    }

    /// Looks for folds and branch points between two places; false where what is there could not be made out,
    /// as where the step led to another branch that does not meet this one.
    pub(super) fn inspect(&mut self, a: &Sample<M>, b: &Sample<M>, depth: usize) -> bool {
        let changes = a.watch.changes(&b.watch);
        let count = changes.crossing.len();
        // A branch that turns round where nothing passes zero does so in a branch point, as the arms of a
        // pitchfork.
        let alone = changes.sure && count <= 1;
        if changes.sure && count == 0 && !changes.turns {
            return true;
        }
        if alone {
            return self.locate(a, b, changes.crossing.first().copied(), changes.turns);
        }
        if count == 0 && !changes.turns && depth >= FOLLOWED {
            return true;
        }
        if depth < HALVED
            && let Ok((middle, _)) = self.beside(a, 0.5 * self.ahead(a, b), self.ahead(a, b))
        {
            return self.inspect(a, &middle, depth + 1) && self.inspect(&middle, b, depth + 1);
        }
        let (from, to) = (a.place(), b.place());
        let uncertainty = (to.p[0] - from.p[0]).abs();
        let kind = SpecialKind::Several { count: count.max(1) };
        self.add(kind, &b.balance, uncertainty, None, None);
        true
    }

    /// One fold, or one branch point; false where there is neither.
    fn locate(&mut self, a: &Sample<M>, b: &Sample<M>, crossing: Option<usize>, turns: bool) -> bool {
        if crossing.is_some() && self.is_first_fold(a) {
            return true;
        }
        let is_fold = turns && crossing.is_some();
        // At a fold the parameter is the better measure: its slope passes zero there, whatever the stiffness
        // is made of.
        let test = |sample: &Sample<M>| match crossing {
            Some(k) if !is_fold => a.watch.like(k, &sample.watch),
            _ => Some(sample.watch.slope),
        };
        let Some((best, width)) = self.enclose(a, b, &test) else {
            let kind = if is_fold { SpecialKind::Fold } else { SpecialKind::BranchPoint };
            self.add(kind, &b.balance, self.ahead(a, b) * self.problem.widths[0], None, None);
            return false;
        };
        let uncertainty = width * self.problem.widths[0];
        let reach = ENCLOSED_DISTANCE * self.problem.distance(a.place(), b.place()) + 10.0 * width;
        let soft = crossing.and_then(|k| a.watch.like(k, &best.watch));
        let polished = Singular::beside(&best.balance, !is_fold, soft).and_then(|singular| {
            let place = best.place();
            self.problem.solve(place, best.coordinates(), None, Some(&singular), reach).ok()
        });
        // β pushes along a shape of unit inertia: beside the force of the stiffness that comes and goes here,
        // at the size of displacements.
        let stiffness =
            [a, b].map(|end| crossing.and_then(|k| a.watch.like(k, &end.watch)).or(end.watch.stiffest()));
        let stiffness = stiffness.into_iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let push = stiffness * self.size(&best.balance);
        // What lies before or after both places is another point.
        let length = self.ahead(a, b);
        let is_between = |balance: &Balance<M>| {
            let gone = self.problem.dot(&a.tangent, &self.problem.between(a.place(), &balance.place));
            (-WITHIN * length..=(1.0 + WITHIN) * length).contains(&gone)
        };
        let polished =
            polished.filter(|found| found.beta.abs() <= UNFOLDED * push && is_between(&found.balance));
        let sound = polished.is_some();
        let (balance, uncertainty) = match polished {
            Some(found) => {
                let rounding = self.rounding(&found.balance, [a, b], crossing, is_fold);
                (found.balance, found.change + rounding)
            }
            None => (best.balance, uncertainty),
        };
        // One point is not found twice: what was looked for is another one, nearby.
        let gone = self.arclength(&balance.place);
        if self.special.last().is_some_and(|last| (last.arclength - gone).abs() <= TWICE) {
            return false;
        }
        let plane = null_plane(self.problem, &balance);
        if is_fold {
            self.add(SpecialKind::Fold, &balance, uncertainty, plane.map(|[first, _]| first), None);
            return sound;
        }
        let Some(plane) = plane else {
            self.add(SpecialKind::BranchPoint, &balance, uncertainty, None, None);
            return sound;
        };
        let ways = self.ways(&plane, &best.tangent);
        let kind = self.tell(&balance, &ways);
        let mode = without_parameter(self.problem, &plane);
        self.add(kind, &balance, uncertainty, Some(mode), Some(ways));
        sound
    }

    /// The fold in which a branch begins, which is then its first special point: on one side of it alone the
    /// parameter does not turn round.
    pub(super) fn begin_in_fold(&mut self, first: &Sample<M>) {
        if first.watch.slope.abs() > IN_FOLD {
            return;
        }
        let found = Singular::beside(&first.balance, false, None).and_then(|singular| {
            self.problem.solve(first.place(), first.coordinates(), None, Some(&singular), BEGINS).ok()
        });
        let Some(found) = found else { return };
        let uncertainty = found.change + self.rounding(&found.balance, [first, first], None, true);
        let mode = null_plane(self.problem, &found.balance).map(|[first, _]| first);
        self.add(SpecialKind::Fold, &found.balance, uncertainty, mode, None);
    }

    /// Whether what passes zero next to a place does so in the fold in which the branch begins.
    fn is_first_fold(&self, a: &Sample<M>) -> bool {
        let is_start = self.points.len() == 1 && self.arclength(a.place()) == 0.0;
        is_start
            && self
                .special
                .first()
                .is_some_and(|one| one.kind == SpecialKind::Fold && one.arclength <= BEGINS)
    }

    /// How far the parameter of a singular place may be off for rounding: of forces along the shape in a
    /// fold, of stiffnesses elsewhere.
    fn rounding(
        &self,
        balance: &Balance<M>,
        [a, b]: [&Sample<M>; 2],
        crossing: Option<usize>,
        is_fold: bool,
    ) -> f64 {
        let own = f64::EPSILON * balance.place.p[0].abs();
        let (Some(singular), Ok(noise)) = (
            Singular::beside(balance, false, None),
            balance.statics.noise(&balance.model, &balance.place.state),
        ) else {
            return own;
        };
        if is_fold {
            let mass = balance.statics.mass.select_rows(&balance.free).select_columns(&balance.free);
            let Some(left) = mass.cholesky().map(|mass| mass.solve(&singular.borders[0])) else { return own };
            let noise: f64 = balance.free.iter().zip(left.iter()).map(|(k, x)| noise[*k] * x.abs()).sum();
            return own + noise / left.dot(&balance.by_parameter(0)).abs().max(f64::MIN_POSITIVE);
        }
        let change = |k: usize| Some(a.watch.like(k, &b.watch)? - a.watch.squares[k]);
        let per_stiffness =
            crossing.and_then(change).map_or(0.0, |d| ((b.place().p[0] - a.place().p[0]) / d).abs());
        own + 8.0 * f64::EPSILON * a.watch.stiffest().map_or(0.0, f64::abs) * per_stiffness
    }

    /// What displacements are measured by, weighed by inertia.
    fn size(&self, balance: &Balance<M>) -> f64 {
        let of = |j: usize| {
            let k = balance.free[j];
            balance.statics.mass[(k, k)].sqrt() * self.problem.measure(balance, j)
        };
        (0..balance.size()).map(of).fold(0.0, f64::max)
    }

    /// A place next to where a test passes zero between two others, and how far it may be from there along
    /// the branch.
    fn enclose(
        &self,
        a: &Sample<M>,
        b: &Sample<M>,
        test: &dyn Fn(&Sample<M>) -> Option<f64>,
    ) -> Option<(Sample<M>, f64)> {
        let length = self.ahead(a, b);
        let (mut lo, mut hi) = (0.0, length);
        let (mut at_lo, mut at_hi) = (test(a).unwrap_or(0.0), test(b).unwrap_or(0.0));
        let mut best: Option<(Sample<M>, f64, f64)> = None;
        let mut side = 0;
        for count in 0..60 {
            if hi - lo <= 1e-4 * length && count > 4 {
                break;
            }
            // Regula falsi, Illinois variant; halves where it creeps.
            let falsi = (lo * at_hi - hi * at_lo) / (at_hi - at_lo);
            let inside = falsi > lo && falsi < hi && count % 3 != 2;
            let s = if inside { falsi } else { 0.5 * (lo + hi) };
            let Ok((sample, _)) = self.beside(a, s, 0.5 * length) else { break };
            let Some(value) = test(&sample) else { break };
            if best.as_ref().is_none_or(|(_, least, _)| value.abs() < *least) {
                best = Some((sample, value.abs(), s));
            }
            if value == 0.0 {
                (lo, hi) = (s, s);
                break;
            }
            if (value < 0.0) == (at_lo < 0.0) {
                (lo, at_lo) = (s, value);
                at_hi *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (hi, at_hi) = (s, value);
                at_lo *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        best.map(|(sample, _, s)| (sample, (hi - s).abs().max((s - lo).abs())))
    }

    /// The same place once more.
    pub(super) fn copied(&self, sample: &Sample<M>) -> Option<Sample<M>> {
        let balance = self.problem.balance(sample.place(), sample.coordinates()).ok()?;
        Some(Sample { balance, tangent: sample.tangent.clone(), watch: sample.watch.clone() })
    }

    /// Of the plane in which branches meet, the direction of this branch, and the one normal to it.
    fn ways(&self, plane: &[Direction; 2], tangent: &Direction) -> [Direction; 2] {
        let [e, f] = plane;
        let (x, y) = (self.problem.dot(e, tangent), self.problem.dot(f, tangent));
        let size = x.hypot(y).max(f64::MIN_POSITIVE);
        let mix = |x: f64, y: f64| Direction {
            q: (&e.q * x + &f.q * y) / size,
            p: core::array::from_fn(|k| (e.p[k] * x + f.p[k] * y) / size),
        };
        [mix(x, y), mix(-y, x)]
    }

    pub(super) fn add(
        &mut self,
        kind: SpecialKind,
        balance: &Balance<M>,
        uncertainty: f64,
        mode: Option<Direction>,
        ways: Option<[Direction; 2]>,
    ) {
        let place = &balance.place;
        let special = Special {
            kind,
            parameter: place.p[0],
            uncertainty,
            state: place.state,
            arclength: self.arclength(place),
            shape: mode.map_or_else(M::Vector::zeros, |mode| shape(&mode)),
            ways,
        };
        self.special.push(special);
    }
}

/// The two directions in which F changes least, orthonormal in what coordinates and parameters are measured
/// by: at a fold the first of them is the branch.
pub(super) fn null_plane<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    balance: &Balance<M>,
) -> Option<[Direction; 2]> {
    let (unknowns, n) = (balance.jacobian.ncols(), balance.size());
    let measures = DVector::from_fn(unknowns, |j, _| problem.measure(balance, j));
    let scaled = balance.weighed()? * DMatrix::from_diagonal(&measures);
    if !scaled.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Thin decompositions leave the null space out: a row of zeros more has it in.
    let square = scaled.insert_row(n, 0.0);
    let svd = square.try_svd(false, true, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..unknowns).collect();
    order.sort_by(|i, j| svd.singular_values[*i].total_cmp(&svd.singular_values[*j]));
    let v_t = svd.v_t?;
    let way = |k: usize| balance.direction(&v_t.row(k).transpose().component_mul(&measures), problem.count);
    let first = way(*order.first()?);
    let first = first.scaled(1.0 / problem.norm(&first));
    let second = way(*order.get(1)?);
    let along = problem.dot(&first, &second);
    let second = Direction {
        q: &second.q - &first.q * along,
        p: core::array::from_fn(|k| second.p[k] - along * first.p[k]),
    };
    let norm = problem.norm(&second);
    (norm > 0.0).then(|| [first, second.scaled(1.0 / norm)])
}

/// The direction of a plane that leaves the parameter as it is.
fn without_parameter<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    [e, f]: &[Direction; 2],
) -> Direction {
    let [x, y] = [f.p[0], -e.p[0]].map(|p| p / problem.widths[0]);
    match x == 0.0 && y == 0.0 {
        true => e.clone(),
        false => Direction { q: &e.q * x + &f.q * y, p: [0.0; 2] },
    }
}
