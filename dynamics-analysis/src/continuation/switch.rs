//! Branch switching in branch points, and diagrams of all branches that are reached from a start.
//!
//! The other branch is sought in the plane normal to its direction in the null space (`locate.rs`), at
//! decreasing distances from the branch point. In a multiple bifurcation all arms are sought
//! (`multiple_bifurcation.rs`).

use alloc::string::ToString;
use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Powers};

use super::branch::{Branch, Diagram, SpecialKind, SpecialPoint};
use super::branch_classification::probe_distances;
use super::problem::{ContinuationPoint, ContinuationProblem, is_range};
use super::trace::{Sample, Tracer};
use super::{Continuation, ContinuationError};

/// Branch points nearer than this, in the scales of coordinates and parameter, are one. Most are computed to
/// rounding. Those that were only enclosed are known to 10⁻⁴ of a step, 5·10⁻⁶ with the longest step
/// of 0.05.
const SAME_BRANCH_POINT_DISTANCE: f64 = 1e-5;
/// A point nearer than this to a chord of another branch, as a share of the chord, lies on that branch. An
/// arc that turns by 0.35 rad, the most within a step, leaves its chord by 0.044 of it.
const MAX_DEVIATION_FROM_CHORD: f64 = 0.05;

/// A point may lie beyond the end of a chord by this share of it, for points at the corner of two chords.
const CHORD_END_TOLERANCE: f64 = 0.01;
/// Number of points after the branch point that have to lie on another branch for a branch to be the same. A
/// single one may lie on it by chance.
const COMPARED_POINTS: usize = 5;

impl<M: Constraints + Powers, F: Fn(f64) -> M> Continuation<M, F> {
    /// The two halves of the branch that crosses the one on which this branch point was found.
    ///
    /// # Errors
    /// A point in which no branches meet, or at which no other branch is found; the failure of the other
    /// branch, with what was computed.
    pub fn switch(
        &self,
        at: &SpecialPoint<M::State>,
    ) -> Result<[Branch<M::State>; 2], ContinuationError<M::State>> {
        self.with_problem(|problem, periodic| {
            let [plus, minus] = self.crossing_arms(problem, periodic, at)?;
            Ok([plus?, minus?])
        })
    }

    /// All halves of branches that meet in a point, this branch's own among them: also where several
    /// stiffnesses vanish at once, as of a column with two equal axes. Directions are tried from many sides,
    /// so that a half that bends away within a hundredth of the range may be missed.
    ///
    /// # Errors
    /// As [`Continuation::switch`]; a continuum of branches that a symmetry maps into each other.
    pub fn switch_all(
        &self,
        at: &SpecialPoint<M::State>,
    ) -> Result<Vec<Branch<M::State>>, ContinuationError<M::State>> {
        self.with_problem(|problem, periodic| self.all_arms(problem, periodic, at)?.into_iter().collect())
    }

    /// All branches that are reached from the start through branch points, up to `limit` of them, each once:
    /// the one through the start to both sides, then what crosses it.
    ///
    /// # Errors
    /// Only the errors of the branch through the start. The result says why other branches ended, with what
    /// was computed of them.
    pub fn branches(&self, limit: usize) -> Result<Diagram<M::State>, ContinuationError<M::State>> {
        self.with_problem(|problem, periodic| {
            let mut diagram = Diagram { branches: Vec::new(), failures: Vec::new(), left_out: 0 };
            let forward = self.forward.unwrap_or(self.value < self.options.range[1]);
            diagram.branches.push(self.run_direction(problem, periodic, forward)?);
            let inside = self.value > self.options.range[0] && self.value < self.options.range[1];
            if inside && diagram.branches[0].end != super::BranchEnd::Closed {
                diagram.branches.push(self.run_direction(problem, periodic, !forward)?);
            }
            let mut known: Vec<SpecialPoint<M::State>> = Vec::new();
            let mut next = 0;
            while next < diagram.branches.len() {
                let is_one = |one: &&SpecialPoint<M::State>| one.kind.is_branch_point() || is_multiple(one);
                let points: Vec<_> = diagram.branches[next].special.iter().filter(is_one).cloned().collect();
                for point in points {
                    if known.iter().any(|other| {
                        problem.distance(&place(other), &place(&point)) <= SAME_BRANCH_POINT_DISTANCE
                    }) {
                        continue;
                    }
                    if diagram.branches.len() >= limit {
                        diagram.left_out += 1;
                        continue;
                    }
                    self.add_branches_from(problem, periodic, &point, limit, &mut diagram);
                    known.push(point);
                }
                next += 1;
            }
            Ok(diagram)
        })
    }

    /// Adds the branches that leave from a point, unless they are in the diagram.
    fn add_branches_from(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        point: &SpecialPoint<M::State>,
        limit: usize,
        diagram: &mut Diagram<M::State>,
    ) {
        let arms = match is_multiple(point) {
            true => self.all_arms(problem, periodic, point),
            false => self.crossing_arms(problem, periodic, point).map(Vec::from),
        };
        let arms = match arms {
            Ok(arms) => arms,
            Err(error) => return diagram.failures.push((point.parameter, error.to_string())),
        };
        for arm in arms {
            let branch = match arm {
                Ok(branch) => branch,
                Err(error) => {
                    diagram.failures.push((point.parameter, error.to_string()));
                    let Some(branch) = error.branch().filter(|branch| branch.points.len() > 2) else {
                        continue;
                    };
                    branch.clone()
                }
            };
            let is_known = diagram.branches.iter().any(|other| lies_on(problem, &branch, other));
            if is_known {
                continue;
            }
            match diagram.branches.len() < limit {
                true => diagram.branches.push(branch),
                false => diagram.left_out += 1,
            }
        }
    }

    /// Both halves of the other branch, or the error of each.
    #[expect(clippy::type_complexity, reason = "two results in one")]
    fn crossing_arms(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        at: &SpecialPoint<M::State>,
    ) -> Result<[Result<Branch<M::State>, ContinuationError<M::State>>; 2], ContinuationError<M::State>> {
        let parameter = at.parameter;
        let Some([_, other]) = &at.directions else {
            return Err(ContinuationError::NoBranchPoint { parameter });
        };
        if !is_range(self.options.range, parameter) {
            return Err(ContinuationError::Range { range: self.options.range, start: parameter });
        }
        let begin = |sign: f64| -> Option<Sample<M>> {
            let tracer = Tracer::new(problem, &self.options, periodic);
            let balance = problem.balance(&place(at), &[]).ok()?;
            // The first tangent is the chord to a point of the other branch nearby.
            let direction = other.scaled(sign);
            let sample = probe_distances().find_map(|h| tracer.point_on_arm(&balance, &direction, h))?;
            let chord = problem.between(&balance.place, sample.point());
            let tangent = chord.scaled(1.0 / problem.norm(&chord));
            let test_functions = sample.test_functions;
            Some(Sample { balance, tangent, test_functions })
        };
        let [Some(plus), Some(minus)] = [begin(1.0), begin(-1.0)] else {
            return Err(ContinuationError::NoOtherBranch { parameter });
        };
        Ok([plus, minus].map(|first| Tracer::new(problem, &self.options, periodic).run(first, true)))
    }
}

/// Whether a special point is a multiple bifurcation.
fn is_multiple<S: ModelState>(at: &SpecialPoint<S>) -> bool {
    matches!(at.kind, SpecialKind::MultipleBifurcation { .. })
}

fn place<S: ModelState>(special: &SpecialPoint<S>) -> ContinuationPoint<S> {
    ContinuationPoint { state: special.state, p: [special.parameter, 0.0] }
}

/// Whether a branch is a part of another one: if its first points after the branch point all lie on it.
fn lies_on<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    branch: &Branch<M::State>,
    other: &Branch<M::State>,
) -> bool {
    let points: Vec<ContinuationPoint<M::State>> = branch
        .points
        .iter()
        .map(|point| ContinuationPoint { state: point.state, p: [point.parameter, 0.0] })
        .collect();
    points.len() > 1
        && points.iter().skip(1).take(COMPARED_POINTS).all(|point| on_chord(problem, point, other))
}

/// Whether a point lies on a chord between neighbouring points of a branch.
fn on_chord<M: Constraints>(
    problem: &ContinuationProblem<'_, M>,
    point: &ContinuationPoint<M::State>,
    other: &Branch<M::State>,
) -> bool {
    other.points.windows(2).any(|pair| {
        let [a, b] =
            [&pair[0], &pair[1]].map(|end| ContinuationPoint { state: end.state, p: [end.parameter, 0.0] });
        let (chord, to) = (problem.between(&a, &b), problem.between(&a, point));
        let length = problem.norm(&chord);
        let along = problem.dot(&chord, &to) / (length * length);
        let left = (problem.dot(&to, &to) - (along * length).powi(2)).max(0.0).sqrt();
        (-CHORD_END_TOLERANCE..=1.0 + CHORD_END_TOLERANCE).contains(&along)
            && left <= MAX_DEVIATION_FROM_CHORD * length
    })
}
