//! Branches that meet where several stiffnesses vanish at once.
//!
//! There the null space of [K, F_p] has more than two dimensions. Which of its directions belong to branches
//! follows from the next terms of F (bifurcation equations: M. Golubitsky, I. Stewart & D. G. Schaeffer,
//! *Singularities and Groups in Bifurcation Theory* II). These terms are not computed. Newton's method starts
//! from guesses at a small distance in all directions of that space, on the planes normal to them. Each half
//! of a branch that it finds is kept once. If nearly every guess leads to a branch of its own, a symmetry
//! maps them into each other, and there are no single branches.

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, Powers};
use nalgebra::{DMatrix, DVector};

use super::branch::{Branch, Special, SpecialKind};
use super::problem::{Balance, ContinuationPoint, ContinuationProblem, Direction};
use super::trace::{Sample, Tracer};
use super::{Continuation, ContinuationError};
use crate::random_numbers::RandomNumbers;

/// How far from the point, at first and then.
const ASIDE: [f64; 3] = [2e-2, 5e-3, 1e-3];
/// Guesses for each direction of the space, at least and at most.
const GUESSES: usize = 60;
const MOST_BRANCH_GUESSES: usize = 40 * GUESSES;
/// So many guesses in a row, for each half that is known, that lead to no other one: there is none that has
/// its share of the guesses.
const IN_VAIN: usize = 10;
/// Halves of branches whose directions are nearer than this, in rad, are one.
const ONE: f64 = 1e-2;
/// Where more than this part of the guesses that lead anywhere lead to halves of their own, there is one in
/// every direction.
const EVERYWHERE: f64 = 0.3;

/// Each half of a branch, with what it fails for.
pub(super) type Halves<S> = Vec<Result<Branch<S>, ContinuationError<S>>>;

impl<M: Constraints + Powers, F: Fn(f64) -> M> Continuation<M, F> {
    /// Halves of all branches that meet in a point.
    pub(super) fn halves(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        at: &Special<M::State>,
    ) -> Result<Halves<M::State>, ContinuationError<M::State>> {
        let parameter = at.parameter;
        let count = match at.kind {
            SpecialKind::Several { count } => count,
            kind if kind.is_branch_point() => 1,
            _ => return Err(ContinuationError::NoBranchPoint { parameter }),
        };
        let place = ContinuationPoint { state: at.state, p: [parameter, 0.0] };
        let balance = problem.balance(&place, &[])?;
        let none = || ContinuationError::NoOtherBranch { parameter };
        let space = softest(problem, &balance, count + 1).ok_or_else(none)?;
        let mut found = Vec::new();
        for h in ASIDE {
            let tracer = Tracer::new(problem, &self.options, periodic);
            let (samples, led) = around(&tracer, &balance, &space, h);
            if is_everywhere(samples.len(), led, &space) {
                return Err(ContinuationError::Everywhere { parameter });
            }
            if samples.len() > found.len() {
                found = samples;
            }
        }
        if found.is_empty() {
            return Err(none());
        }
        let follow = |aside: Sample<M>| {
            let balance = problem.balance(&place, aside.coordinates())?;
            let chord = problem.between(&balance.place, aside.place());
            let tangent = chord.scaled(1.0 / problem.norm(&chord));
            let first = Sample { balance, tangent, watch: aside.watch };
            Tracer::new(problem, &self.options, periodic).run(first, true)
        };
        Ok(found.into_iter().map(follow).collect())
    }
}

/// Whether there is a half of a branch beside each guess that led anywhere.
fn is_everywhere(found: usize, led: usize, space: &[Direction]) -> bool {
    found as f64 > EVERYWHERE * led as f64 && found > 8 * space.len()
}

/// Places of branches at a distance from a point, each half once, and how many guesses led to one.
fn around<M: Constraints + Powers>(
    tracer: &Tracer<'_, M>,
    balance: &Balance<M>,
    space: &[Direction],
    h: f64,
) -> (Vec<Sample<M>>, usize) {
    let problem = tracer.problem;
    let way = |to: &Sample<M>| {
        let chord = problem.between(&balance.place, to.place());
        chord.scaled(1.0 / problem.norm(&chord))
    };
    let (mut found, mut ways, mut led): (Vec<Sample<M>>, Vec<Direction>, usize) = (Vec::new(), Vec::new(), 0);
    let mut numbers = RandomNumbers(0x5eed);
    let mut in_vain = 0;
    for guess in 0..MOST_BRANCH_GUESSES * space.len() {
        if guess >= GUESSES * space.len()
            && (in_vain > IN_VAIN * found.len() || is_everywhere(found.len(), led, space))
        {
            break;
        }
        let parts: Vec<f64> = space.iter().map(|_| numbers.within([-1.0, 1.0])).collect();
        let size = parts.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Within the ball, so that no direction is preferred.
        if !(0.1..=1.0).contains(&size) {
            continue;
        }
        let guess = mixed(space, &parts, size);
        let Some(sample) = tracer.arm(balance, &guess, h) else {
            in_vain += 1;
            continue;
        };
        (led, in_vain) = (led + 1, in_vain + 1);
        let to = way(&sample);
        let is_known = ways.iter().any(|known| problem.dot(known, &to).clamp(-1.0, 1.0).acos() < ONE);
        if !is_known && problem.distance(&balance.place, sample.place()) > 0.5 * h {
            ways.push(to);
            found.push(sample);
            in_vain = 0;
        }
    }
    (found, led)
}

fn mixed(space: &[Direction], parts: &[f64], size: f64) -> Direction {
    let mut sum = space[0].scaled(0.0);
    for (one, part) in space.iter().zip(parts) {
        sum.q += &one.q * (part / size);
        (0..2).for_each(|k| sum.p[k] += one.p[k] * part / size);
    }
    sum
}

/// The directions in which F changes least, orthonormal in what coordinates and parameters are measured by.
fn softest<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    balance: &Balance<M>,
    count: usize,
) -> Option<Vec<Direction>> {
    let (unknowns, n) = (balance.jacobian.ncols(), balance.size());
    let measures = DVector::from_fn(unknowns, |j, _| problem.measure(balance, j));
    let scaled = balance.weighed()? * DMatrix::from_diagonal(&measures);
    if !scaled.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Thin decompositions leave the null space out: a row of zeros more has it in.
    let svd = scaled.insert_row(n, 0.0).try_svd(false, true, f64::EPSILON, 1000)?;
    let mut order: Vec<usize> = (0..unknowns).collect();
    order.sort_by(|i, j| svd.singular_values[*i].total_cmp(&svd.singular_values[*j]));
    let v_t = svd.v_t?;
    let mut space: Vec<Direction> = Vec::new();
    for k in order.into_iter().take(count) {
        let mut way = balance.direction(&v_t.row(k).transpose().component_mul(&measures), problem.count);
        for known in &space {
            let along = problem.dot(known, &way);
            way = Direction {
                q: &way.q - &known.q * along,
                p: core::array::from_fn(|k| way.p[k] - along * known.p[k]),
            };
        }
        let norm = problem.norm(&way);
        if norm > 0.0 {
            space.push(way.scaled(1.0 / norm));
        }
    }
    (!space.is_empty()).then_some(space)
}
