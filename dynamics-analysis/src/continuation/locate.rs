//! Special points between two points of a branch: detection, location, classification.
//!
//! An interval with more than one special point is halved until each is alone. A single one is enclosed along
//! the branch by a test function, and then computed from equations that are regular there (`newton.rs`). In a
//! branch point, the null space of [K, F_p] is a plane. The direction in it normal to this branch leads to
//! the other one (H. B. Keller's method IV), which is followed a little way to both sides to classify the
//! point (`branch_classification.rs`).

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Powers, Vector};

use super::branch::{SpecialKind, SpecialPoint};
use super::newton::SingularityCondition;
use super::null_space::null_plane;
use super::problem::{Balance, ContinuationProblem, Direction};
use super::trace::{Sample, Tracer, shape};

/// Special points nearer to each other than this along the branch are one: both were computed to rounding.
/// The second one was then sought elsewhere, and the step is repeated with half its length.
const SAME_POINT_ARCLENGTH: f64 = 1e-13;
/// Width of the interval that encloses a sign change, as a share of the step. Newton's method takes over from
/// there. A wider interval may let it converge to another special point, a narrower one costs more points.
const ENCLOSURE_WIDTH: f64 = 1e-4;
/// Largest distance between the enclosed place and the computed special point, as a share of the step. The
/// enclosure is a hundred times narrower. What is found farther away is another special point.
const MAX_CORRECTION_OF_ENCLOSED_POINT: f64 = 0.01;
/// A special point may lie outside its interval by this share of it. That allows for rounding of points at
/// the very ends.
const INTERVAL_TOLERANCE: f64 = 1e-6;
/// An interval is halved at most this many times until its special points are alone. Two points that are
/// nearer than 2⁻³² of the step are reported as one of several stiffnesses.
const MAX_HALVINGS: usize = 32;
/// An interval in which no stiffness seems to change sign is halved at most this many times to match its mode
/// shapes. After that it counts as one without sign changes: shapes may turn into each other at constant
/// sign, however short the interval is. A larger number costs up to 2⁶ points more for each step there.
const MAX_HALVINGS_TO_MATCH_SHAPES: usize = 6;
/// A fold within this distance of the start is the fold in which the branch begins.
const MAX_DISTANCE_TO_FIRST_FOLD: f64 = 1e-6;
/// A start whose dp/ds, with p in parts of its range, is larger than this is in no fold. The test only saves
/// the computation of a fold: [`MAX_DISTANCE_TO_FIRST_FOLD`] decides.
const MAX_SLOPE_IN_FIRST_FOLD: f64 = 1e-4;
/// Largest β of a branch point, relative to the force of the stiffness that changes sign in the step. A
/// larger β is the push that would make branches meet which only come near each other. Rounding of forces
/// leaves a β of about 10⁻¹⁶ times the ratio of the largest stiffness to this one.
const MAX_UNFOLDING: f64 = 1e-10;

impl<M: Constraints + Powers> Tracer<'_, M> {
    /// Looks for folds and branch points in a step. It is divided at its middle and at the points where a
    /// test function may have a minimum near zero. The result is that of [`Tracer::find_special_points`].
    pub(super) fn find_special_points_in_step(
        &mut self,
        a: &Sample<M>,
        middle: &Sample<M>,
        b: &Sample<M>,
    ) -> bool {
        let length = self.distance_ahead(a, b);
        let mut minima = Vec::new();
        for part in a.test_functions.suspected_minima(&middle.test_functions, &b.test_functions) {
            minima.extend(self.point_at(a, part * length, length).map(|(sample, _)| (part, sample)).ok());
        }
        let (before, after): (Vec<_>, Vec<_>) = minima.iter().partition(|(part, _)| *part < 0.5);
        let between =
            before.into_iter().map(|(_, s)| s).chain([middle]).chain(after.into_iter().map(|(_, s)| s));
        let places: Vec<&Sample<M>> = [a].into_iter().chain(between).chain([b]).collect();
        places.windows(2).all(|pair| self.find_special_points(pair[0], pair[1], 0))
    }

    /// Looks for folds and branch points between two points. False if a sign change could not be explained by
    /// one, for example because the step led to another branch that does not meet this one.
    pub(super) fn find_special_points(&mut self, a: &Sample<M>, b: &Sample<M>, depth: usize) -> bool {
        let changes = a.test_functions.sign_changes(&b.test_functions);
        let count = changes.crossing.len();
        // If the parameter turns round and no stiffness changes sign, the branch is an arm of a pitchfork
        // that passes its branch point.
        let alone = changes.all_matched && count <= 1;
        if changes.all_matched && count == 0 && !changes.parameter_turns {
            return true;
        }
        if alone {
            return self.locate(a, b, changes.crossing.first().copied(), changes.parameter_turns);
        }
        if count == 0 && !changes.parameter_turns && depth >= MAX_HALVINGS_TO_MATCH_SHAPES {
            return true;
        }
        if depth < MAX_HALVINGS
            && let Ok((middle, _)) =
                self.point_at(a, 0.5 * self.distance_ahead(a, b), self.distance_ahead(a, b))
        {
            return self.find_special_points(a, &middle, depth + 1)
                && self.find_special_points(&middle, b, depth + 1);
        }
        let (from, to) = (a.point(), b.point());
        let uncertainty = (to.p[0] - from.p[0]).abs();
        let kind = SpecialKind::MultipleBifurcation { count: count.max(1) };
        self.add(kind, &b.balance, uncertainty, None, None);
        true
    }

    /// Computes the one fold or branch point between two points. `crossing` is the stiffness that changes
    /// sign. False if there is no such point: then the enclosed one is added as it is.
    fn locate(&mut self, a: &Sample<M>, b: &Sample<M>, crossing: Option<usize>, turns: bool) -> bool {
        if crossing.is_some() && self.is_first_fold(a) {
            return true;
        }
        let is_fold = turns && crossing.is_some();
        // 1. Enclose the sign change. At a fold the slope of the parameter is the better test function: it
        //    changes sign there even if the stiffness is only rounding.
        let test = |sample: &Sample<M>| match crossing {
            Some(k) if !is_fold => a.test_functions.matching(k, &sample.test_functions),
            _ => Some(sample.test_functions.slope),
        };
        let Some((best, width)) = self.enclose(a, b, &test) else {
            let kind = if is_fold { SpecialKind::Fold } else { SpecialKind::BranchPoint };
            self.add(kind, &b.balance, self.distance_ahead(a, b) * self.problem.widths[0], None, None);
            return false;
        };
        // 2. Compute the point from the bordered equations.
        let uncertainty = width * self.problem.widths[0];
        let reach =
            MAX_CORRECTION_OF_ENCLOSED_POINT * self.problem.distance(a.point(), b.point()) + 10.0 * width;
        let soft = crossing.and_then(|k| a.test_functions.matching(k, &best.test_functions));
        let polished = SingularityCondition::near(&best.balance, !is_fold, soft).and_then(|singular| {
            let place = best.point();
            self.problem.solve(place, best.coordinates(), None, Some(&singular), reach).ok()
        });
        // 3. Accept it if it lies between both points, and if β is small. β multiplies a force along a
        //    shape of unit inertia. It is compared with the force of the stiffness that changes sign, at
        //    displacements of the size of their scales.
        let stiffness = [a, b].map(|end| {
            crossing
                .and_then(|k| a.test_functions.matching(k, &end.test_functions))
                .or(end.test_functions.stiffest())
        });
        let stiffness = stiffness.into_iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let push = stiffness * self.displacement_scale(&best.balance);
        let length = self.distance_ahead(a, b);
        let is_between = |balance: &Balance<M>| {
            let distance = self.problem.dot(&a.tangent, &self.problem.between(a.point(), &balance.place));
            (-INTERVAL_TOLERANCE * length..=(1.0 + INTERVAL_TOLERANCE) * length).contains(&distance)
        };
        let polished =
            polished.filter(|found| found.beta.abs() <= MAX_UNFOLDING * push && is_between(&found.balance));
        let sound = polished.is_some();
        let (balance, uncertainty) = match polished {
            Some(found) => {
                let rounding = self.parameter_rounding(&found.balance, [a, b], crossing, is_fold);
                (found.balance, found.parameter_error + rounding)
            }
            None => (best.balance, uncertainty),
        };
        // A point that is known already is not the one that was looked for.
        let arclength = self.arclength(&balance.place);
        if self.special.last().is_some_and(|last| (last.arclength - arclength).abs() <= SAME_POINT_ARCLENGTH)
        {
            return false;
        }
        // 4. Classify it, by the branches that leave it.
        let plane = null_plane(self.problem, &balance);
        if is_fold {
            self.add(SpecialKind::Fold, &balance, uncertainty, plane.map(|[first, _]| first), None);
            return sound;
        }
        let Some(plane) = plane else {
            self.add(SpecialKind::BranchPoint, &balance, uncertainty, None, None);
            return sound;
        };
        let directions = self.branch_directions(&plane, &best.tangent);
        let kind = self.classify(&balance, &directions);
        let mode = without_parameter(self.problem, &plane);
        self.add(kind, &balance, uncertainty, Some(mode), Some(directions));
        sound
    }

    /// Adds the fold in which a branch begins as its first special point. The branch leaves it to one side
    /// only, so that no step contains an extremum of the parameter.
    pub(super) fn begin_in_fold(&mut self, first: &Sample<M>) {
        if first.test_functions.slope.abs() > MAX_SLOPE_IN_FIRST_FOLD {
            return;
        }
        let found = SingularityCondition::near(&first.balance, false, None).and_then(|singular| {
            self.problem
                .solve(first.point(), first.coordinates(), None, Some(&singular), MAX_DISTANCE_TO_FIRST_FOLD)
                .ok()
        });
        let Some(found) = found else { return };
        let uncertainty =
            found.parameter_error + self.parameter_rounding(&found.balance, [first, first], None, true);
        let mode = null_plane(self.problem, &found.balance).map(|[first, _]| first);
        self.add(SpecialKind::Fold, &found.balance, uncertainty, mode, None);
    }

    /// Whether a sign change right after the start belongs to the fold in which the branch begins.
    fn is_first_fold(&self, a: &Sample<M>) -> bool {
        let is_start = self.points.len() == 1 && self.arclength(a.point()) == 0.0;
        is_start
            && self.special.first().is_some_and(|one| {
                one.kind == SpecialKind::Fold && one.arclength <= MAX_DISTANCE_TO_FIRST_FOLD
            })
    }

    /// The error of the parameter of a singular point from rounding. In a fold, the forces along the mode
    /// shape are rounded, in a branch point, the stiffnesses.
    fn parameter_rounding(
        &self,
        balance: &Balance<M>,
        [a, b]: [&Sample<M>; 2],
        crossing: Option<usize>,
        is_fold: bool,
    ) -> f64 {
        let own_rounding = f64::EPSILON * balance.place.p[0].abs();
        let (Some(singular), Ok(noise)) = (
            SingularityCondition::near(balance, false, None),
            balance.statics.noise(&balance.model, &balance.place.state),
        ) else {
            return own_rounding;
        };
        if is_fold {
            let Some(left) = balance.mass().cholesky().map(|mass| mass.solve(&singular.borders[0])) else {
                return own_rounding;
            };
            let noise: f64 = balance.free.iter().zip(left.iter()).map(|(k, x)| noise[*k] * x.abs()).sum();
            return own_rounding + noise / left.dot(&balance.by_parameter(0)).abs().max(f64::MIN_POSITIVE);
        }
        let change = |k: usize| {
            Some(a.test_functions.matching(k, &b.test_functions)? - a.test_functions.stiffnesses[k])
        };
        let per_stiffness =
            crossing.and_then(change).map_or(0.0, |d| ((b.point().p[0] - a.point().p[0]) / d).abs());
        own_rounding + 8.0 * f64::EPSILON * a.test_functions.stiffest().map_or(0.0, f64::abs) * per_stiffness
    }

    /// The largest scale of a displacement, in units of √inertia.
    fn displacement_scale(&self, balance: &Balance<M>) -> f64 {
        let of = |j: usize| {
            let k = balance.free[j];
            balance.statics.mass[(k, k)].sqrt() * self.problem.scale_of(balance, j)
        };
        (0..balance.size()).map(of).fold(0.0, f64::max)
    }

    /// The computed point nearest to the sign change of a test function between two points, and its distance
    /// along the branch from the farther end of the enclosing interval.
    fn enclose(
        &self,
        a: &Sample<M>,
        b: &Sample<M>,
        test: &dyn Fn(&Sample<M>) -> Option<f64>,
    ) -> Option<(Sample<M>, f64)> {
        let length = self.distance_ahead(a, b);
        let (mut lo, mut hi) = (0.0, length);
        let (mut at_lo, mut at_hi) = (test(a).unwrap_or(0.0), test(b).unwrap_or(0.0));
        let mut best: Option<(Sample<M>, f64, f64)> = None;
        let mut side = 0;
        for count in 0..60 {
            if hi - lo <= ENCLOSURE_WIDTH * length && count > 4 {
                break;
            }
            // Regula falsi in the Illinois variant; every third step is a bisection.
            let falsi = (lo * at_hi - hi * at_lo) / (at_hi - at_lo);
            let inside = falsi > lo && falsi < hi && count % 3 != 2;
            let s = if inside { falsi } else { 0.5 * (lo + hi) };
            let Ok((sample, _)) = self.point_at(a, s, 0.5 * length) else { break };
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

    /// A copy of a sample, computed once more: models need not be `Clone`.
    pub(super) fn duplicate(&self, sample: &Sample<M>) -> Option<Sample<M>> {
        let balance = self.problem.balance(sample.point(), sample.coordinates()).ok()?;
        Some(Sample {
            balance,
            tangent: sample.tangent.clone(),
            test_functions: sample.test_functions.clone(),
        })
    }

    /// The direction of this branch in the plane in which branches meet, and the direction normal to it.
    fn branch_directions(&self, plane: &[Direction; 2], tangent: &Direction) -> [Direction; 2] {
        let [e, f] = plane;
        let (x, y) = (self.problem.dot(e, tangent), self.problem.dot(f, tangent));
        let size = x.hypot(y).max(f64::MIN_POSITIVE);
        let mix = |x: f64, y: f64| Direction {
            q: (&e.q * x + &f.q * y) / size,
            p: core::array::from_fn(|k| (e.p[k] * x + f.p[k] * y) / size),
        };
        [mix(x, y), mix(-y, x)]
    }

    /// Adds a special point to the branch.
    pub(super) fn add(
        &mut self,
        kind: SpecialKind,
        balance: &Balance<M>,
        uncertainty: f64,
        mode: Option<Direction>,
        directions: Option<[Direction; 2]>,
    ) {
        let place = &balance.place;
        let special = SpecialPoint {
            kind,
            parameter: place.p[0],
            uncertainty,
            state: place.state,
            arclength: self.arclength(place),
            shape: mode.map_or_else(M::Vector::zeros, |mode| shape(&mode)),
            directions,
        };
        self.special.push(special);
    }
}

/// The direction of a plane along which the parameter is constant.
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
