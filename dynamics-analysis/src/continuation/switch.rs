//! Branch switching at the points in which other branches meet this one.

use alloc::string::ToString;
use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Powers};

use super::branch::{Branch, Diagram, Special, SpecialKind};
use super::meet::aside;
use super::problem::{ContinuationPoint, ContinuationProblem, is_range};
use super::trace::{Sample, Tracer};
use super::{Continuation, ContinuationError};

/// Branch points nearer than this, in what coordinates and parameters are measured by, are one.
const SAME: f64 = 1e-5;
/// A point nearer than this to a chord of another branch, as a part of the chord, lies on it: chords leave
/// their branch by less.
const ON_CHORD: f64 = 0.05;

impl<M: Constraints + Powers, F: Fn(f64) -> M> Continuation<M, F> {
    /// The two halves of the branch that crosses the one on which this branch point was found.
    ///
    /// # Errors
    /// A point in which no branches meet, or at which no other branch is found; the failure of the other
    /// branch, with what was computed.
    pub fn switch(
        &self,
        at: &Special<M::State>,
    ) -> Result<[Branch<M::State>; 2], ContinuationError<M::State>> {
        self.traced(|problem, periodic| {
            let [plus, minus] = self.arms(problem, periodic, at)?;
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
        at: &Special<M::State>,
    ) -> Result<Vec<Branch<M::State>>, ContinuationError<M::State>> {
        self.traced(|problem, periodic| self.halves(problem, periodic, at)?.into_iter().collect())
    }

    /// All branches that are reached from the start through branch points, up to `limit` of them, each once:
    /// the one through the start to both sides, then what crosses it.
    ///
    /// # Errors
    /// Only the errors of the branch through the start. The result says why other branches ended, with what
    /// was computed of them.
    pub fn branches(&self, limit: usize) -> Result<Diagram<M::State>, ContinuationError<M::State>> {
        self.traced(|problem, periodic| {
            let mut diagram = Diagram { branches: Vec::new(), failures: Vec::new(), left_out: 0 };
            let forward = self.forward.unwrap_or(self.value < self.options.range[1]);
            diagram.branches.push(self.one_way(problem, periodic, forward)?);
            let inside = self.value > self.options.range[0] && self.value < self.options.range[1];
            if inside && diagram.branches[0].end != super::BranchEnd::Closed {
                diagram.branches.push(self.one_way(problem, periodic, !forward)?);
            }
            let mut known: Vec<Special<M::State>> = Vec::new();
            let mut next = 0;
            while next < diagram.branches.len() {
                let is_one = |one: &&Special<M::State>| one.kind.is_branch_point() || is_multiple(one);
                let points: Vec<_> = diagram.branches[next].special.iter().filter(is_one).cloned().collect();
                for point in points {
                    if known.iter().any(|other| problem.distance(&place(other), &place(&point)) <= SAME) {
                        continue;
                    }
                    if diagram.branches.len() >= limit {
                        diagram.left_out += 1;
                        continue;
                    }
                    self.leave(problem, periodic, &point, limit, &mut diagram);
                    known.push(point);
                }
                next += 1;
            }
            Ok(diagram)
        })
    }

    /// Adds the branches that leave from a point, unless they are known.
    fn leave(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        point: &Special<M::State>,
        limit: usize,
        diagram: &mut Diagram<M::State>,
    ) {
        let arms = match is_multiple(point) {
            true => self.halves(problem, periodic, point),
            false => self.arms(problem, periodic, point).map(Vec::from),
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
    fn arms(
        &self,
        problem: &ContinuationProblem<'_, M>,
        periodic: &[bool],
        at: &Special<M::State>,
    ) -> Result<[Result<Branch<M::State>, ContinuationError<M::State>>; 2], ContinuationError<M::State>> {
        let parameter = at.parameter;
        let Some([_, other]) = &at.ways else { return Err(ContinuationError::NoBranchPoint { parameter }) };
        if !is_range(self.options.range, parameter) {
            return Err(ContinuationError::Range { range: self.options.range, start: parameter });
        }
        let begin = |sign: f64| -> Option<Sample<M>> {
            let tracer = Tracer::new(problem, &self.options, periodic);
            let balance = problem.balance(&place(at), &[]).ok()?;
            // The first step is along the direction that the other branch has a little way on.
            let way = other.scaled(sign);
            let aside = aside().find_map(|h| tracer.arm(&balance, &way, h))?;
            let chord = problem.between(&balance.place, aside.place());
            let tangent = chord.scaled(1.0 / problem.norm(&chord));
            let watch = aside.watch;
            Some(Sample { balance, tangent, watch })
        };
        let [Some(plus), Some(minus)] = [begin(1.0), begin(-1.0)] else {
            return Err(ContinuationError::NoOtherBranch { parameter });
        };
        Ok([plus, minus].map(|first| Tracer::new(problem, &self.options, periodic).run(first, true)))
    }
}

/// Whether several stiffnesses vanish at once.
fn is_multiple<S: ModelState>(at: &Special<S>) -> bool {
    matches!(at.kind, SpecialKind::Several { .. })
}

fn place<S: ModelState>(special: &Special<S>) -> ContinuationPoint<S> {
    ContinuationPoint { state: special.state, p: [special.parameter, 0.0] }
}

/// Whether a branch goes where another one went: its first points after the one in which they meet all lie on
/// that.
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
    points.len() > 1 && points.iter().take(6).skip(1).all(|point| on_chord(problem, point, other))
}

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
        (-0.01..=1.01).contains(&along) && left <= ON_CHORD * length
    })
}
