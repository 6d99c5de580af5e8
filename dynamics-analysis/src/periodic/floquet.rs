//! Floquet multipliers: the effect of one period on small disturbances of a closed motion.
//!
//! Disturbances of a motion of period T obey linear equations of that period. One period later they are δx(T)
//! = M δx(0), M the monodromy matrix. They die out if all its eigenvalues, the multipliers μ, lie within the
//! unit circle, and grow if one lies outside (G. Floquet, Ann. Sci. Éc. Norm. Sup. 12 (1883) 47; Nayfeh &
//! Balachandran, *Applied Nonlinear Dynamics*, §3.2; Yakubovich & Starzhinskii, *Linear Differential
//! Equations with Periodic Coefficients*). μ leaves the circle by +1 in a fold (or a pitchfork), by −1 where
//! the period doubles, elsewhere where a torus is born (Neimark–Sacker). M is integrated with the motion
//! (`flow.rs`), on independent coordinates under constraints. Multipliers that are known to be 1 are removed
//! before (`symmetry.rs`).
//!
//! The error of M is measured by a second integration with a looser tolerance; the sum of the steps'
//! tolerances counts, too. The error of a multiplier is |yᵀ||δM||x|/|yᵀx| (x, y the eigenvectors), for
//! multipliers that meet a root of that (Elsner). A multiplier is called inside or outside only if this error
//! could not have caused it.

mod show;
mod spectrum;

use alloc::vec::Vec;

use dynamics_runtime::model::{Constraints, ModelState, Powers, Quantity, Vector};
use nalgebra::{Complex, DMatrix, DVector};

use super::PeriodicError;
use super::flow::Flow;
use super::frame::{Frame, sizes, stacked};
use super::symmetry::{Conserved, Trivial, form, is_autonomous, known};
use spectrum::Scaled;

/// Ratio of the tolerance of the comparison to that of the result. Its error is then clearly larger, and the
/// difference of both measures it.
const COMPARISON_TOLERANCE_RATIO: f64 = 30.0;
/// Largest conditioning of a single multiplier. A larger one is that of two multipliers that have met (a
/// defective pair).
const MAX_CONDITIONING_OF_SINGLE: f64 = 1e6;
/// Largest conditioning at which equal multipliers have mode shapes of their own. Equal ones with a larger
/// conditioning may have met on the circle and left it.
const MAX_CONDITIONING_OF_EQUAL: f64 = 100.0;
/// Largest distance of the end of a closed motion from its start, relative to the range of the motion. Newton
/// iterations close to 1e-8 and better; a motion that was entered by hand closes to its digits.
const MAX_CLOSURE_ERROR: f64 = 1e-6;
/// Roundings per row and element of the monodromy matrix, besides the tolerance of each step. It is a bound,
/// not an estimate: larger values leave more multipliers undecided.
const MATRIX_ROUNDINGS: f64 = 16.0;
/// Factor from the closure error to the error of the monodromy matrix. A larger factor leaves more
/// multipliers undecided; with a smaller one the closure error may decide.
const CLOSURE_ERROR_FACTOR: f64 = 10.0;
/// Factor on the measured error of the divergence within which it counts as 0. A smaller factor may find
/// damping that is only an error of integration.
const DIVERGENCE_ERROR_FACTOR: f64 = 10.0;
/// Divergence that is only rounding. Two equal results of both integrations would otherwise leave no error at
/// all.
const DIVERGENCE_ROUNDING: f64 = 1e-14;

/// A Floquet multiplier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiplier {
    /// μ.
    pub value: Complex<f64>,
    /// Its error bound from integration and rounding.
    pub uncertainty: f64,
    /// Its relative change per relative change of the matrix: 1 at best.
    pub conditioning: f64,
    /// Why it is 1, if this is known.
    pub trivial: Option<Trivial>,
}

/// How a multiplier leaves the unit circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Threshold {
    /// Through +1, without oscillation: folds, pitchforks.
    Fold,
    /// Through −1: period doubling.
    Flip,
    /// As a pair of complex conjugates: another frequency comes in (Neimark–Sacker).
    NeimarkSacker,
}

/// The fate of small disturbances of a closed motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FloquetVerdict {
    /// They die out: all multipliers lie within the unit circle, except the 1 of a shift in time.
    AsymptoticallyStable,
    /// To first order they do not grow. Multipliers on the unit circle are distinct and not ±1, and cannot
    /// leave it because nothing dissipates; or they are 1 because of a conserved quantity or a cyclic
    /// coordinate. Neighbours of another energy may have another period, and so shift in phase.
    StableToFirstOrder,
    /// They grow.
    Unstable {
        /// How.
        threshold: Threshold,
        /// |μ|, the largest.
        growth: f64,
        /// The coordinate that takes most part, or the one whose velocity does.
        coordinate: &'static str,
    },
    /// A multiplier lies on the unit circle within its uncertainty: linear theory does not decide, or more
    /// digits are needed.
    Undecided {
        /// Where it would leave.
        threshold: Threshold,
        /// |μ| − 1.
        excess: f64,
        /// How far the multiplier may be off.
        uncertainty: f64,
    },
}

/// The multipliers of a motion that closes after a period, with the monodromy matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Floquet {
    /// Whether small disturbances grow.
    pub verdict: FloquetVerdict,
    /// All multipliers, as many as independent coordinates and velocities, by falling modulus. Those that are
    /// known to be 1 are last.
    pub multipliers: Vec<Multiplier>,
    /// M: independent coordinates, then velocities, at the end by those at the start.
    pub monodromy: DMatrix<f64>,
    /// How far each element may be off.
    pub uncertainty: DMatrix<f64>,
    /// The independent coordinates, by name and unit.
    pub coordinates: Vec<Quantity>,
    /// The independent velocities, by the coordinates that they are rates of.
    pub velocities: Vec<Quantity>,
    /// T.
    pub period: f64,
    /// ∫ div over the period, which is ln det M (Liouville). A volume of neighbouring states is multiplied by
    /// its exponential.
    pub divergence: f64,
    /// The relative deviation of M from preserving the form δq ∧ δp: 0 if nothing dissipates.
    pub symplectic_defect: f64,
    /// The distance of the end from the start, relative to the range of the motion.
    pub miss: f64,
    /// Whether the equations are autonomous.
    pub autonomous: bool,
    /// Steps of the integration.
    pub steps: usize,
}

impl Floquet {
    /// ln μ / T, in 1/s: real parts are rates of growth; imaginary parts are known up to multiples of 2π/T.
    #[must_use]
    pub fn exponents(&self) -> Vec<Complex<f64>> {
        let of = |value: Complex<f64>| Complex::new(value.norm().ln(), value.arg()) / self.period;
        self.multipliers.iter().map(|multiplier| of(multiplier.value)).collect()
    }

    /// The multipliers that are not known to be 1.
    pub fn nontrivial(&self) -> impl Iterator<Item = &Multiplier> {
        self.multipliers.iter().filter(|multiplier| multiplier.trivial.is_none())
    }

    /// Whether disturbances are known not to grow, to first order.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        matches!(self.verdict, FloquetVerdict::AsymptoticallyStable | FloquetVerdict::StableToFirstOrder)
    }

    /// Whether disturbances are known to grow.
    #[must_use]
    pub fn is_unstable(&self) -> bool {
        matches!(self.verdict, FloquetVerdict::Unstable { .. })
    }
}

/// The multipliers of the motion through `nodes`, states of it that follow each other, within a period.
pub(super) fn of_motion<M: Constraints + Powers>(
    model: &M,
    nodes: &[M::State],
    period: f64,
    advance: &DVector<f64>,
    (tolerance, most_steps): (f64, usize),
) -> Result<Floquet, PeriodicError> {
    // A force that jumps at a node would make the result depend on rounding.
    let mut flow = Flow::new(model, tolerance, most_steps)?;
    for node in nodes {
        if flow.starts_on_corner(node, MAX_CLOSURE_ERROR * period)? {
            return Err(PeriodicError::StartsOnCorner { time: node.t() });
        }
    }
    // M twice, with two tolerances; then closure, known multipliers, and the others.
    let fine = monodromy(&mut flow, nodes, period)?;
    flow.tolerance = tolerance * COMPARISON_TOLERANCE_RATIO;
    let coarse = monodromy(&mut flow, nodes, period)?;
    flow.tolerance = tolerance;
    let frame = &fine.frame;
    let scales = sizes::<M>(&fine.passed, period);
    let miss = closes::<M>(nodes, &fine.ends, advance, &scales)?;
    let autonomous = is_autonomous(&mut flow, &fine.passed, period, advance)?;
    let conserved = Conserved::along(model, &fine.passed, autonomous);
    // Two runs may agree by chance. So the error of M contains the tolerance of every step, and the closure
    // error.
    let rounding = frame.len() as f64 * MATRIX_ROUNDINGS * f64::EPSILON
        + fine.steps as f64 * tolerance
        + CLOSURE_ERROR_FACTOR * miss;
    let uncertainty = (&fine.matrix - &coarse.matrix).abs() + fine.product.map(|x| x * rounding);
    let known =
        known(&mut flow, &nodes[0], frame, (&fine.matrix, &uncertainty), (autonomous, &conserved), &scales)?;
    let weights = DVector::from_iterator(frame.len(), frame.rows().into_iter().map(|i| scales[i]));
    let scaled = Scaled::new(&fine.matrix, &uncertainty, weights);
    let w = form(model, &nodes[0], frame, &scales);
    let symplectic_defect = scaled.defect(&w);
    let (mut multipliers, shapes) = scaled.multipliers(&known)?;
    // The divergence detects weaker damping than the symplectic form.
    let divergence_error = (fine.divergence - coarse.divergence).abs();
    let keeps_volumes =
        fine.divergence.abs() <= DIVERGENCE_ERROR_FACTOR * divergence_error + DIVERGENCE_ROUNDING;
    let symplectic = keeps_volumes && symplectic_defect <= scaled.allowed_defect(&w);
    let verdict = judge(&multipliers, &shapes, symplectic, |k| frame.name::<M>(k));
    let order = |a: &Multiplier, b: &Multiplier| b.value.norm().total_cmp(&a.value.norm());
    multipliers.sort_by(|a, b| a.trivial.is_some().cmp(&b.trivial.is_some()).then(order(a, b)));
    let [coordinates, velocities] = frame.names::<M>();
    Ok(Floquet {
        verdict,
        multipliers,
        monodromy: fine.matrix,
        uncertainty,
        coordinates,
        velocities,
        period,
        divergence: fine.divergence,
        symplectic_defect,
        miss,
        autonomous,
        steps: fine.steps,
    })
}

/// The closure error relative to the range of the motion: the largest distance of a node from the end of the
/// shot before it.
fn closes<M: Constraints>(
    nodes: &[M::State],
    ends: &[M::State],
    advance: &DVector<f64>,
    scales: &DVector<f64>,
) -> Result<f64, PeriodicError> {
    let miss_of = |(k, end): (usize, &M::State)| {
        let wanted = if k + 1 < nodes.len() { stacked(&nodes[k + 1]) } else { stacked(&nodes[0]) + advance };
        let off = (stacked(end) - wanted).component_div(scales);
        (off.amax(), off.iamax())
    };
    let (miss, at) =
        ends.iter().enumerate().map(miss_of).fold((0.0, 0), |m, x| if x.0 > m.0 { x } else { m });
    match miss <= MAX_CLOSURE_ERROR {
        true => Ok(miss),
        false => Err(PeriodicError::NotClosed { coordinate: M::COORDINATES[at % M::Vector::LEN].name, miss }),
    }
}

/// A monodromy matrix, with the motion along which it was integrated.
struct Monodromy<S> {
    matrix: DMatrix<f64>,
    /// The product of the absolute values of its factors: the scale of its rounding.
    product: DMatrix<f64>,
    frame: Frame,
    ends: Vec<S>,
    passed: Vec<S>,
    divergence: f64,
    steps: usize,
}

/// Integrates a period with its variations, node by node.
fn monodromy<M: Constraints>(
    flow: &mut Flow<'_, M>,
    nodes: &[M::State],
    period: f64,
) -> Result<Monodromy<M::State>, PeriodicError> {
    let frames: Vec<Frame> =
        nodes.iter().map(|node| Frame::at(flow.model, node, None)).collect::<Result<_, PeriodicError>>()?;
    let m = frames[0].len();
    let (mut matrix, mut product) = (DMatrix::identity(m, m), DMatrix::identity(m, m));
    let (mut ends, mut passed) = (Vec::new(), Vec::new());
    let (mut divergence, mut steps) = (0.0, 0);
    for (k, node) in nodes.iter().enumerate() {
        let until = nodes.get(k + 1).map_or(nodes[0].t() + period, ModelState::t);
        passed.push(*node);
        let arrived = flow.integrate(node, &frames[k].basis, until, &mut |state| passed.push(*state))?;
        let part = frames[(k + 1) % nodes.len()].read(&arrived.tangents);
        product = part.abs() * product;
        matrix = part * matrix;
        divergence += arrived.divergence;
        steps += arrived.steps;
        ends.push(arrived.state);
    }
    let frame = frames[0].clone();
    Ok(Monodromy { matrix, product, frame, ends, passed, divergence, steps })
}

/// How a multiplier would leave the unit circle.
fn threshold(one: &Multiplier) -> Threshold {
    match (one.value.im.abs() <= one.uncertainty, one.value.re > 0.0) {
        (true, true) => Threshold::Fold,
        (true, false) => Threshold::Flip,
        (false, _) => Threshold::NeimarkSacker,
    }
}

/// The verdict: unstable if a multiplier is certainly outside, then stable if none is on the circle within
/// its error, or if none of those on it can leave it.
fn judge(
    multipliers: &[Multiplier],
    shapes: &[DVector<f64>],
    symplectic: bool,
    name: impl Fn(usize) -> &'static str,
) -> FloquetVerdict {
    let rest: Vec<usize> = (0..multipliers.len()).filter(|k| multipliers[*k].trivial.is_none()).collect();
    let excess = |k: &usize| multipliers[*k].value.norm() - 1.0;
    let outside = rest.iter().filter(|k| excess(k) > multipliers[**k].uncertainty);
    if let Some(worst) = outside.max_by(|a, b| excess(a).total_cmp(&excess(b))) {
        let one = &multipliers[*worst];
        let coordinate = name(shapes[*worst].iamax());
        return FloquetVerdict::Unstable { threshold: threshold(one), growth: one.value.norm(), coordinate };
    }
    let near: Vec<usize> = rest.into_iter().filter(|k| excess(k) >= -multipliers[*k].uncertainty).collect();
    // A disturbance of a conserved quantity or a cyclic coordinate lasts.
    let lasts = |one: &Multiplier| !matches!(one.trivial, None | Some(Trivial::Time));
    if near.is_empty() && !multipliers.iter().any(lasts) {
        return FloquetVerdict::AsymptoticallyStable;
    }
    // In symplectic systems multipliers come in pairs μ, 1/μ. A single pair on the circle cannot leave it.
    let may_leave = |k: &usize| {
        let one = &multipliers[*k];
        let meets = |(i, other): (usize, &Multiplier)| {
            i != *k && (one.value - other.value).norm() <= one.uncertainty + other.uncertainty
        };
        // Two ill-conditioned multipliers within their errors may have met and left the circle.
        let met = one.conditioning > MAX_CONDITIONING_OF_EQUAL && multipliers.iter().enumerate().any(meets);
        !symplectic
            || one.value.im.abs() <= one.uncertainty
            || one.conditioning > MAX_CONDITIONING_OF_SINGLE
            || met
    };
    match near.into_iter().find(may_leave) {
        Some(k) => FloquetVerdict::Undecided {
            threshold: threshold(&multipliers[k]),
            excess: excess(&k),
            uncertainty: multipliers[k].uncertainty,
        },
        None => FloquetVerdict::StableToFirstOrder,
    }
}
