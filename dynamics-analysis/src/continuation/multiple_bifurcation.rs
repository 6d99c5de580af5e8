//! Multiple bifurcations: branches that meet where several stiffnesses vanish at once.
//!
//! There the null space of [K, F_p] has more than two dimensions. Which of its directions belong to branches
//! follows from the next terms of F (bifurcation equations: M. Golubitsky, I. Stewart & D. G. Schaeffer,
//! *Singularities and Groups in Bifurcation Theory* II). These terms are not computed. Newton's method starts
//! from random guesses at a small distance in all directions of that space, in the planes normal to them.
//! Each half of a branch (arm) that it finds is kept once. If nearly every guess leads to an arm of its own,
//! a symmetry maps them into each other, and there are no isolated branches.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Powers};

use super::branch::{Branch, SpecialKind, SpecialPoint};
use super::null_space::null_space;
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction};
use super::trace::{Sample, Tracer};
use super::{Continuation, ContinuationError};
use crate::random_numbers::RandomNumbers;

/// Distances from the point at which arms are sought, in the scales of coordinates and parameter. The
/// distance that yields most arms counts. At a large one, an arm that bends strongly is missed. At a small
/// one, arms that leave in nearly the same direction are one.
const ARM_PROBE_DISTANCES: [f64; 3] = [2e-2, 5e-3, 1e-3];
/// Least number of guesses for each dimension of the null space. Fewer could end the search before an arm has
/// had its share of guesses; [`VAIN_GUESSES_PER_ARM`] decides from here on.
const MIN_GUESSES_PER_DIMENSION: usize = 60;
/// Largest number of guesses for each dimension of the null space. It bounds the time: a guess costs one run
/// of Newton's method. Arms that only few guesses lead to may be missed then.
const MAX_GUESSES_PER_DIMENSION: usize = 40 * MIN_GUESSES_PER_DIMENSION;
/// The search ends after this many guesses in a row, for each known arm, without a new arm. If n arms are
/// known and another one attracts an equal share of the guesses, it is missed with probability
/// (n/(n+1))^(10n): 10⁻³ for one known arm, 5·10⁻⁵ for many.
const VAIN_GUESSES_PER_ARM: usize = 10;
/// Arms whose directions differ by less than this angle, in rad, are one arm. Guesses on different planes
/// reach an arm at slightly different places, and its curvature turns the chord to them. A larger value
/// merges arms that leave close together, a smaller one counts a bent arm several times.
const SAME_ARM_ANGLE: f64 = 1e-2;
/// If more than this share of the successful guesses leads to arms of their own, arms leave in every
/// direction. Isolated arms are found again and again, so that their share falls with the number of guesses.
/// In a continuum nearly every guess finds a new arm.
const CONTINUUM_SHARE: f64 = 0.3;

/// Fewer arms than this, for each dimension of the null space, are no continuum: their share of few guesses
/// says nothing.
const MIN_ARMS_IN_CONTINUUM: usize = 8;
/// An arm found nearer to the point than this share of h is not one: Newton's method returned to the point.
const MIN_RELATIVE_DISTANCE: f64 = 0.5;

/// The arms of a point: each half of a branch, or the error of its continuation.
pub(super) type Arms<S> = Vec<Result<Branch<S>, ContinuationError<S>>>;

impl<M: Constraints + Powers, F: Fn(f64) -> M> Continuation<M, F> {
    /// Arms of all branches that meet in a point.
    pub(super) fn all_arms(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        at: &SpecialPoint<M::State>,
    ) -> Result<Arms<M::State>, ContinuationError<M::State>> {
        let parameter = at.parameter;
        let count = match at.kind {
            SpecialKind::MultipleBifurcation { count } => count,
            kind if kind.is_branch_point() => 1,
            _ => return Err(ContinuationError::NoBranchPoint { parameter }),
        };
        let place = ContinuationPoint { state: at.state, p: [parameter, 0.0] };
        let balance = problem.balance(&place, &[])?;
        let not_found = || ContinuationError::NoOtherBranch { parameter };
        let space = null_space(problem, &balance, count + 1).ok_or_else(not_found)?;
        let mut found = Vec::new();
        for h in ARM_PROBE_DISTANCES {
            let tracer = Tracer::new(problem, &self.options, periodic);
            let (samples, successes) = find_arms(&tracer, &balance, &space, h);
            if is_continuum(samples.len(), successes, &space) {
                return Err(ContinuationError::ContinuumOfBranches { parameter });
            }
            if samples.len() > found.len() {
                found = samples;
            }
        }
        if found.is_empty() {
            return Err(not_found());
        }
        let follow = |arm: Sample<M>| {
            let balance = problem.balance(&place, arm.coordinates())?;
            let chord = problem.between(&balance.place, arm.point());
            let tangent = chord.scaled(1.0 / problem.norm(&chord));
            let first = Sample { balance, tangent, test_functions: arm.test_functions };
            Tracer::new(problem, &self.options, periodic).run(first, true)
        };
        Ok(found.into_iter().map(follow).collect())
    }
}

/// Whether arms leave in every direction: if there are many, and nearly as many as successful guesses.
fn is_continuum(found: usize, successes: usize, space: &[Direction]) -> bool {
    found as f64 > CONTINUUM_SHARE * successes as f64 && found > MIN_ARMS_IN_CONTINUUM * space.len()
}

/// Points of the arms at the distance h from a point, one for each arm, and the number of successful guesses.
fn find_arms<M: Constraints + Powers>(
    tracer: &Tracer<'_, M>,
    balance: &Balance<M>,
    space: &[Direction],
    h: f64,
) -> (Vec<Sample<M>>, usize) {
    let problem = tracer.problem;
    let direction = |to: &Sample<M>| {
        let chord = problem.between(&balance.place, to.point());
        chord.scaled(1.0 / problem.norm(&chord))
    };
    let (mut found, mut directions, mut successes): (Vec<Sample<M>>, Vec<Direction>, usize) =
        (Vec::new(), Vec::new(), 0);
    let mut numbers = RandomNumbers(0x5eed);
    let mut in_vain = 0;
    for guess in 0..MAX_GUESSES_PER_DIMENSION * space.len() {
        if guess >= MIN_GUESSES_PER_DIMENSION * space.len()
            && (in_vain > VAIN_GUESSES_PER_ARM * found.len() || is_continuum(found.len(), successes, space))
        {
            break;
        }
        let parts: Vec<f64> = space.iter().map(|_| numbers.within([-1.0, 1.0])).collect();
        let size = parts.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Only vectors inside the unit ball count, so that no direction is preferred.
        if !(0.1..=1.0).contains(&size) {
            continue;
        }
        // A point in balance near it, if Newton's method finds one.
        let guess = combination(space, &parts, size);
        let Some(sample) = tracer.point_on_arm(balance, &guess, h) else {
            in_vain += 1;
            continue;
        };
        (successes, in_vain) = (successes + 1, in_vain + 1);
        let to = direction(&sample);
        // It is a new arm if its direction is new.
        let is_known = directions.iter().any(|known| problem.angle(known, &to) < SAME_ARM_ANGLE);
        if !is_known && problem.distance(&balance.place, sample.point()) > MIN_RELATIVE_DISTANCE * h {
            directions.push(to);
            found.push(sample);
            in_vain = 0;
        }
    }
    (found, successes)
}

/// The linear combination of directions with these parts, divided by `size`.
fn combination(space: &[Direction], parts: &[f64], size: f64) -> Direction {
    let mut sum = space[0].scaled(0.0);
    for (one, part) in space.iter().zip(parts) {
        sum.q += &one.q * (part / size);
        (0..2).for_each(|k| sum.p[k] += one.p[k] * part / size);
    }
    sum
}
