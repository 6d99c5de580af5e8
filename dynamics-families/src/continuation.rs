//! Equilibria along an input: Q(q, w) = 0 by pseudo-arclength continuation.
//!
//! The next point is predicted along the tangent K q' = ∂Q/∂w w' and corrected by Newton's method across it,
//! by the bordered system
//!
//! ```text
//! [K   −b] [Δq]   [Q ]        b = ∂Q/∂w
//! [tᵀM  s] [Δw] = [−g]        g: how far the point is from the plane across the tangent (t, s)
//! ```
//!
//! solved by two solutions with K. The input may therefore fall while the motion goes on, as behind a limit
//! load. ∂Q/∂w is a central difference, which is exact for forces that are linear in the input. Steps grow
//! where Newton's method needs few corrections, and shrink where it fails. Source: Keller, in Applications of
//! Bifurcation Theory (1977) 359.

use dynamics_runtime::simulate::OptionError;

use crate::error::FamilyError;
use crate::failure::{FamilyErrorKind, check_state};
use crate::model::{FamilyModel, FamilyState, Sizes, View};
use crate::statics::{self, FamilyEquilibrium};
use crate::tangent::{Coefficients, Tangent};

/// First step, in parts of the path that the linear answer would take.
const FIRST_STEP: f64 = 0.02;
/// Longest step, likewise.
const LONGEST_STEP: f64 = 0.05;
/// Shortest step, likewise.
const SHORTEST_STEP: f64 = 1e-9;
/// Cosine of the angle by which the tangent may turn from point to point.
const LEAST_COSINE: f64 = 0.9;
/// Most corrections of a point.
const MOST_CORRECTIONS: u32 = 12;
/// Corrections after which steps grow.
const FEW_CORRECTIONS: u32 = 4;
/// The last correction, in parts of the size of the path.
const ACCURACY: f64 = 1e-11;
/// Distance of inputs for differences, in parts of the way of the input.
const DIFFERENCE: f64 = 1e-4;

/// A branch of equilibria.
#[derive(Clone, Debug, PartialEq)]
pub struct EquilibriumBranch<S> {
    /// The points in the order of the branch, the start included. Their states have the input's values.
    pub points: Vec<FamilyEquilibrium<S>>,
    /// Why the branch ends before its input has the last value; `None` where it reached that.
    pub ended: Option<FamilyErrorKind>,
}

/// The way along a branch.
pub(crate) struct Path<'a, M: FamilyModel> {
    model: &'a M,
    ends: Sizes,
    t: f64,
    inputs: Vec<f64>,
    input: usize,
    rest: Vec<f64>,
    tangent: Tangent,
    /// The sizes by which displacements and the input are measured.
    scale: [f64; 2],
}

/// A displacement and a change of the input.
#[derive(Clone)]
struct Step {
    q: Vec<f64>,
    w: f64,
}

/// The branch through the equilibrium near `guess`, until the input has the value `until` or the branch has
/// `most` points.
pub(crate) fn follow<M: FamilyModel>(
    model: &M,
    guess: &M::State,
    input: &str,
    until: f64,
    most: usize,
) -> Result<EquilibriumBranch<M::State>, FamilyError<M>> {
    let failed = |kind: FamilyErrorKind| FamilyError::before(kind, guess.t());
    let ends = model.ends().map_err(|error| failed(error.into()))?;
    check_state::<M>(guess, &ends).map_err(failed)?;
    if !M::ROWS.is_empty() {
        return Err(failed(FamilyErrorKind::NotWithConstraints { what: "a branch" }));
    }
    let Some(index) = M::INPUTS.iter().position(|declared| declared.name == input) else {
        let suggestion = dynamics_view::suggest(input, M::INPUTS.iter().map(|declared| declared.name));
        return Err(failed(FamilyErrorKind::UnknownInput { name: input.to_owned(), suggestion }));
    };
    if most < 2 {
        let (option, admissible) = ("most", "at least 2");
        let number = OptionError::Number { option, value: most as f64, admissible };
        return Err(failed(number.into()));
    }
    if !until.is_finite() {
        let (option, admissible) = ("until", "a finite value of the input");
        let number = OptionError::Number { option, value: until, admissible };
        return Err(failed(number.into()));
    }
    let first = statics::equilibrium(model, guess)?;
    let mut points = vec![first];
    let start = &points[0].state;
    let span = until - start.inputs()[index];
    if span == 0.0 {
        return Ok(EquilibriumBranch { points, ended: None });
    }
    let rest = vec![0.0; start.q().len()];
    let view = View { t: start.t(), q: start.q(), u: &rest, inputs: start.inputs() };
    let mut path = Path {
        model,
        tangent: Tangent::new(model, view, &ends, None).map_err(failed)?,
        ends,
        t: start.t(),
        inputs: start.inputs().to_vec(),
        input: index,
        rest: rest.clone(),
        scale: [1.0, span.abs()],
    };
    let ended = path.go(&mut points, until, most).err();
    Ok(EquilibriumBranch { points, ended })
}

impl<M: FamilyModel> Path<'_, M> {
    fn go(
        &mut self,
        points: &mut Vec<FamilyEquilibrium<M::State>>,
        until: f64,
        most: usize,
    ) -> Result<(), FamilyErrorKind> {
        let mut q = points[0].state.q().to_vec();
        let mut w = self.inputs[self.input];
        let direction = (until - w).signum();
        // The size of the linear answer is that of displacements.
        let mut tangent = self.direction(&q, w, None)?;
        let moved = self.tangent.norm(&tangent.q) * self.scale[1] / tangent.w.abs();
        let size_of_q = self.tangent.norm(&q);
        if moved > 0.0 && moved.is_finite() {
            // Near a limit load the linear answer is larger than the structure.
            self.scale[0] = if size_of_q > 0.0 { moved.min(size_of_q) } else { moved };
        }
        tangent = self.direction(&q, w, None)?;
        if tangent.w * direction < 0.0 {
            tangent = scaled(&tangent, -1.0);
        }
        let mut size = FIRST_STEP;
        while points.len() < most {
            let predicted = Step { q: sum(&q, &tangent.q, size), w: w + size * tangent.w };
            // A step no longer than usual may end at the last value; a longer one is none of the branch's.
            let part = (until - w) / tangent.w;
            let passes = (0.0..=size).contains(&part);
            let corrected = if passes {
                // The last point has the input's last value.
                self.correct(Step { q: sum(&q, &tangent.q, part), w: until }, None)
            } else {
                self.correct(predicted, Some(&tangent))
            };
            let corrected = corrected.and_then(|(point, corrections)| {
                let (point, reached) = self.held(point, passes, [w, until], direction, &q)?;
                let next = self.direction(&point.q, point.w, Some(&tangent))?;
                let turned = self.product(&next, &tangent);
                if turned < LEAST_COSINE && size > SHORTEST_STEP {
                    let coordinate = crate::mass::coordinate_name::<M>(&self.ends, 0);
                    return Err(FamilyErrorKind::NotSolved { coordinate });
                }
                Ok((point, next, corrections, reached))
            });
            match corrected {
                Ok((point, next, corrections, reached)) => {
                    (q, w, tangent) = (point.q, point.w, next);
                    points.push(self.point(&q, w)?);
                    if reached {
                        return Ok(());
                    }
                    if corrections <= FEW_CORRECTIONS {
                        size = (1.5 * size).min(LONGEST_STEP);
                    }
                }
                Err(kind) => {
                    size *= 0.5;
                    if size < SHORTEST_STEP {
                        return Err(kind);
                    }
                }
            }
        }
        Err(FamilyErrorKind::TooManyPoints { limit: most })
    }

    /// A corrected point, or, where the input has gone beyond its last value, the point there; and whether it
    /// has the last value.
    fn held(
        &mut self,
        point: Step,
        passes: bool,
        [w, until]: [f64; 2],
        direction: f64,
        q: &[f64],
    ) -> Result<(Step, bool), FamilyErrorKind> {
        if passes || (point.w - until) * direction < 0.0 {
            return Ok((point, passes));
        }
        let part = (until - w) / (point.w - w);
        let between: Vec<f64> = q.iter().zip(&point.q).map(|(a, b)| a + part * (b - a)).collect();
        Ok((self.correct(Step { q: between, w: until }, None)?.0, true))
    }

    /// Q at a point, to `forces`.
    fn forces(&mut self, q: &[f64], w: f64, forces: &mut [f64]) {
        self.inputs[self.input] = w;
        self.model.forces(View { t: self.t, q, u: &self.rest, inputs: &self.inputs }, forces);
    }

    /// Factors K at a point.
    fn factor(&mut self, q: &[f64], w: f64) -> Result<(), FamilyErrorKind> {
        self.inputs[self.input] = w;
        let weights = Coefficients { mass: 0.0, damping: 0.0, stiffness: 1.0 };
        let at = View { t: self.t, q, u: &self.rest, inputs: &self.inputs };
        self.tangent.assemble(self.model, at, weights, None)?;
        self.tangent.factor::<M>(&self.ends)
    }

    /// K⁻¹ ∂Q/∂w, from factors of K at this point.
    fn answer(&mut self, q: &[f64], w: f64) -> Vec<f64> {
        let h = DIFFERENCE * self.scale[1];
        let (mut above, mut below) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        self.forces(q, w + h, &mut above);
        self.forces(q, w - h, &mut below);
        above.iter_mut().zip(&below).for_each(|(a, b)| *a = (*a - b) / (2.0 * h));
        self.tangent.solve(&mut above);
        above
    }

    /// The product of two steps, in which displacements and the input count alike.
    fn product(&self, a: &Step, b: &Step) -> f64 {
        let [of_q, of_w] = self.scale;
        let masses = &self.tangent.diagonal;
        let by_q = crate::generated::sum(0..a.q.len(), |i| masses[i] * a.q[i] * b.q[i]);
        by_q / (of_q * of_q) + a.w * b.w / (of_w * of_w)
    }

    /// The tangent at a point, of size 1, in the sense of the one before.
    fn direction(&mut self, q: &[f64], w: f64, before: Option<&Step>) -> Result<Step, FamilyErrorKind> {
        self.factor(q, w)?;
        let tangent = Step { q: self.answer(q, w), w: 1.0 };
        let size = self.product(&tangent, &tangent).sqrt();
        let sense = before.map_or(1.0, |before| self.product(&tangent, before).signum());
        Ok(scaled(&tangent, sense / size))
    }

    /// The point of the branch across the tangent, or with the input as it is; and how many corrections that
    /// took.
    fn correct(&mut self, mut point: Step, across: Option<&Step>) -> Result<(Step, u32), FamilyErrorKind> {
        let predicted = point.clone();
        let mut step = vec![0.0; point.q.len()];
        for correction in 1..=MOST_CORRECTIONS {
            self.forces(&point.q, point.w, &mut step);
            if let Some(unknown) = step.iter().position(|force| !force.is_finite()) {
                let coordinate = crate::mass::coordinate_name::<M>(&self.ends, unknown);
                return Err(FamilyErrorKind::AccelerationNotFinite { coordinate });
            }
            self.factor(&point.q, point.w)?;
            self.tangent.solve(&mut step);
            let mut change = Step { q: step.clone(), w: 0.0 };
            if let Some(tangent) = across {
                let away = Step { q: sum(&point.q, &predicted.q, -1.0), w: point.w - predicted.w };
                let answer = Step { q: self.answer(&point.q, point.w), w: 1.0 };
                change.w = -(self.product(tangent, &away) + self.product(tangent, &change))
                    / self.product(tangent, &answer);
                change.q = sum(&change.q, &answer.q, change.w);
            }
            point = Step { q: sum(&point.q, &change.q, 1.0), w: point.w + change.w };
            let moved = self.product(&change, &change).sqrt();
            if moved <= ACCURACY {
                return Ok((point, correction));
            }
            if !moved.is_finite() {
                break;
            }
        }
        let largest =
            (0..step.len()).fold(0, |best, i| if step[i].abs() > step[best].abs() { i } else { best });
        let coordinate = crate::mass::coordinate_name::<M>(&self.ends, largest);
        Err(FamilyErrorKind::NotSolved { coordinate })
    }

    /// A point with its stability.
    fn point(&mut self, q: &[f64], w: f64) -> Result<FamilyEquilibrium<M::State>, FamilyErrorKind> {
        self.factor(q, w)?;
        let inertia = self.tangent.inertia();
        Ok(FamilyEquilibrium {
            state: M::State::new(
                self.t,
                q.to_vec(),
                self.rest.clone(),
                self.inputs.clone(),
                self.ends.clone(),
            ),
            unstable: inertia.map(|(negative, _)| negative),
            neutral: inertia.is_some_and(|(_, singular)| singular),
            iterations: 0,
        })
    }
}

fn sum(a: &[f64], b: &[f64], factor: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + factor * b).collect()
}

fn scaled(step: &Step, factor: f64) -> Step {
    Step { q: step.q.iter().map(|x| factor * x).collect(), w: factor * step.w }
}
