//! Lyapunov exponents: how fast neighbouring motions part.
//!
//! Tangent vectors are integrated by the variational equations, and orthonormalised repeatedly, δx = Q R: the
//! exponents are the means of ln Rᵢᵢ per time (Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15 (1980)
//! 9; Shimada & Nagashima, Prog. Theor. Phys. 61 (1979) 1605). Their sum is the mean divergence. In
//! Hamiltonian systems they come in pairs ±λ. One is 0 if the system is autonomous and the motion does not
//! come to rest, and two more for every further conserved quantity.
//!
//! A mean over a finite time is an estimate. Its uncertainty is the larger of two values: twice the standard
//! error of twenty parts of the run, and the difference of its halves, which shows whether it has converged.
//! Neighbours of regular motions separate in proportion to time, which gives ln(ωt)/t, falling for ever. An
//! estimate that is not larger than this, or than its uncertainty, has no certain sign. No exponent has one
//! if more would differ from 0 than is possible.

mod show;

use alloc::vec::Vec;

use dynamics_runtime::constrain::at_time;
use dynamics_runtime::model::{ConservedKind, ModelState, Vector};
use dynamics_runtime::simulate::Simulate;
use nalgebra::{DMatrix, DVector};

use super::flow::Flow;
use super::frame::{Frame, direction, sizes};
use super::symmetry::{Conserved, is_autonomous};
use super::{PeriodicError, check, positive};

/// Blocks of equal duration into which the run is divided. Their means are kept for the convergence and the
/// error.
const BLOCKS: usize = 100;
/// Blocks that form one of the twenty groups of the standard error. Longer groups are less correlated, but
/// there are fewer of them.
const BLOCKS_PER_GROUP: usize = 5;
/// Largest ratio of the lengths of tangent vectors before an orthonormalisation. If it is exceeded, the block
/// is divided into twice as many parts. A larger ratio costs digits of the shorter vectors; a smaller one
/// costs time.
const MAX_LENGTH_RATIO: f64 = 1e4;
/// Longest tangent vector before an orthonormalisation; its inverse bounds the shortest. Beyond it the
/// numbers would soon overflow or underflow.
const LONGEST_TANGENT: f64 = 1e100;
/// Most parts of a block, each with one orthonormalisation. With a hundred blocks these are 400,000 parts; a
/// run that needs more is an error, or has vectors with fewer digits.
const MAX_PARTS_PER_BLOCK: usize = 4096;
/// Default limit on the steps between two orthonormalisations.
const DEFAULT_MAX_STEPS: usize = 20_000_000;
/// Default permitted local error per step. Exponents are means over a finite time, which limits their
/// accuracy far more.
const DEFAULT_TOLERANCE: f64 = 1e-9;
/// Least speed at the end of the run, relative to the scales of the coordinates, of a motion that has not
/// come to rest. A smaller value counts a motion that only creeps as one with a zero exponent along it.
const MIN_SPEED: f64 = 1e-6;

/// A computation of Lyapunov exponents, with its options.
#[must_use = "nothing is computed until `.run()`"]
pub struct Lyapunov<'m, M: Simulate> {
    model: &'m M,
    start: M::State,
    settle: f64,
    during: Option<f64>,
    count: Option<usize>,
    tolerance: f64,
    most_steps: usize,
}

/// The sign of an exponent, if it is certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExponentSign {
    /// Neighbours part exponentially.
    Positive,
    /// Known to be 0: the system is autonomous, or a quantity is conserved; and the estimate agrees.
    Zero,
    /// Neighbours come together.
    Negative,
    /// The estimate is smaller than its uncertainty, or the run contradicts known facts: more exponents would
    /// differ from 0 than is possible.
    Undecided,
}

/// One exponent, in 1/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponent {
    /// The mean over the run.
    pub value: f64,
    /// Its uncertainty, estimated from the run.
    pub uncertainty: f64,
    /// Its sign, as far as it is known.
    pub sign: ExponentSign,
}

/// Lyapunov exponents with their uncertainties.
#[derive(Clone, Debug, PartialEq)]
pub struct LyapunovExponents<S: ModelState> {
    /// The largest ones, in falling order.
    pub exponents: Vec<Exponent>,
    /// Mean divergence, in 1/s: the sum of all exponents.
    pub divergence: f64,
    /// How many there are in all: independent coordinates and velocities.
    pub dimension: usize,
    /// The convergence: (time since the means began, exponents up to then).
    pub running: Vec<(f64, Vec<f64>)>,
    /// Time over which the means are.
    pub time: f64,
    /// How many exponents are known to be 0.
    pub known_zeros: usize,
    /// A smaller estimate cannot be distinguished from 0: ln(1 + ωt)/t, the estimate if neighbours separate
    /// in proportion to time. ω is the highest frequency of the motion.
    pub resolution: f64,
    /// Orthonormalisations.
    pub orthonormalisations: usize,
    /// Steps of the integration, those before the means included.
    pub steps: usize,
    /// The state at the end.
    pub end: S,
}

impl<S: ModelState> LyapunovExponents<S> {
    /// The largest exponent.
    #[must_use]
    pub fn largest(&self) -> Exponent {
        self.exponents[0]
    }

    /// Whether neighbours separate exponentially: `None` if the run does not decide.
    #[must_use]
    pub fn is_chaotic(&self) -> Option<bool> {
        match self.largest().sign {
            ExponentSign::Positive => Some(true),
            ExponentSign::Zero | ExponentSign::Negative => Some(false),
            ExponentSign::Undecided => None,
        }
    }

    /// The sum of the exponents minus the mean divergence: 0 up to errors. `None` if not all exponents were
    /// computed.
    #[must_use]
    pub fn sum_defect(&self) -> Option<f64> {
        let sum = self.exponents.iter().map(|one| one.value).sum::<f64>();
        (self.exponents.len() == self.dimension).then_some(sum - self.divergence)
    }

    /// The largest |λᵢ + λₙ₊₁₋ᵢ|: 0 for Hamiltonian systems; `None` if not all exponents were
    /// computed.
    #[must_use]
    pub fn pairing_defect(&self) -> Option<f64> {
        let pairs = self.exponents.iter().zip(self.exponents.iter().rev());
        let worst = pairs.map(|(a, b)| (a.value + b.value).abs()).fold(0.0, f64::max);
        (self.exponents.len() == self.dimension).then_some(worst)
    }

    /// The Kaplan–Yorke dimension of the attractor (of its section once a period if time appears in the
    /// equations): j + Σ₁ʲ λᵢ/|λⱼ₊₁|, where the sum over j is the last that is not negative. Exponents that
    /// are 0 for a reason count as 0. `None` if too few exponents were computed, or if the sign of the
    /// largest is unknown.
    #[must_use]
    pub fn kaplan_yorke(&self) -> Option<f64> {
        if self.largest().sign == ExponentSign::Undecided {
            return None;
        }
        let mut sum = 0.0;
        for (j, one) in self.exponents.iter().enumerate() {
            let value = if one.sign == ExponentSign::Zero { 0.0 } else { one.value };
            if sum + value < 0.0 {
                return Some(j as f64 + sum / value.abs());
            }
            sum += value;
        }
        (self.exponents.len() == self.dimension).then_some(self.dimension as f64)
    }
}

impl<'m, M: Simulate> Lyapunov<'m, M> {
    pub(crate) fn new(model: &'m M, start: M::State) -> Self {
        Self {
            model,
            start,
            settle: 0.0,
            during: None,
            count: None,
            tolerance: DEFAULT_TOLERANCE,
            most_steps: DEFAULT_MAX_STEPS,
        }
    }

    /// Time that passes before the means begin: for the motion to come near its attractor, and the tangent
    /// vectors to turn to their directions. Default 0.
    pub fn settle(mut self, time: f64) -> Self {
        self.settle = time;
        self
    }

    /// Time over which the means are taken.
    pub fn during(mut self, time: f64) -> Self {
        self.during = Some(time);
        self
    }

    /// The number of exponents, the largest ones. Default: all.
    pub fn exponents(mut self, count: usize) -> Self {
        self.count = Some(count);
        self
    }

    /// Permitted local error per step of state and tangent vectors. Default 1e-9.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Most steps between two orthonormalisations. Default 20 million.
    pub fn max_steps(mut self, steps: usize) -> Self {
        self.most_steps = steps;
        self
    }

    /// Computes them.
    ///
    /// # Errors
    /// No time given, a motion that ends or diverges, a model without derivatives.
    pub fn run(self) -> Result<LyapunovExponents<M::State>, PeriodicError> {
        let during = self.during.unwrap_or(f64::NAN);
        positive("the time over which the exponents are means, `.during(..)`,", during)?;
        positive("the tolerance", self.tolerance)?;
        if !(self.settle >= 0.0 && self.settle.is_finite()) {
            return Err(PeriodicError::Option {
                what: "the time to settle",
                value: self.settle,
                needed: "0 or more",
            });
        }
        check(self.model, &self.start)?;
        // Settle in blocks of about the same length as those of the run, then begin the means.
        let mut carried = TangentFlow::new(&self)?;
        let settling = (BLOCKS as f64 * self.settle / during).ceil() as usize;
        (0..settling).try_for_each(|k| {
            let until = self.start.t() + self.settle * (k + 1) as f64 / settling as f64;
            carried.block(until).map(drop)
        })?;
        let (begin, before) = (self.start.t() + self.settle, carried.divergence);
        carried.passed.clear();
        let mut blocks = Vec::with_capacity(BLOCKS);
        for k in 0..BLOCKS {
            blocks.push(carried.block(begin + during * (k + 1) as f64 / BLOCKS as f64)?);
        }
        carried.judge(&blocks, during, before)
    }
}

/// A motion with orthonormal tangent vectors, and what it has accumulated.
struct TangentFlow<'m, M: Simulate> {
    flow: Flow<'m, M>,
    state: M::State,
    tangents: DMatrix<f64>,
    weights: DVector<f64>,
    dimension: usize,
    /// Parts into which a block is divided; it only grows.
    parts: usize,
    /// ∫ tr a_u dt so far.
    divergence: f64,
    steps: usize,
    orthonormalisations: usize,
    /// The states at the ends of the blocks.
    passed: Vec<M::State>,
}

impl<'m, M: Simulate> TangentFlow<'m, M> {
    fn new(options: &Lyapunov<'m, M>) -> Result<Self, PeriodicError> {
        let flow = Flow::new(options.model, options.tolerance, options.most_steps)?;
        let frame = Frame::at(options.model, &options.start, None)?;
        let dimension = frame.len();
        let count = options.count.unwrap_or(dimension);
        if count == 0 || count > dimension {
            let needed = "between 1 and the number of independent coordinates and velocities";
            return Err(PeriodicError::Option {
                what: "the number of exponents",
                value: count as f64,
                needed,
            });
        }
        let weights = sizes::<M>(&[options.start], core::f64::consts::TAU);
        // Independent vectors that are not aligned with the coordinates.
        let mix = DMatrix::from_fn(dimension, count, |i, j| {
            f64::from(u8::from(i == j)) + 0.3 * (1.7 + 2.399_963 * (i + dimension * j) as f64).sin()
        });
        let tangents = &frame.basis * mix;
        let mut carried = Self {
            flow,
            state: options.start,
            tangents,
            weights,
            dimension,
            parts: 1,
            divergence: 0.0,
            steps: 0,
            orthonormalisations: 0,
            passed: Vec::new(),
        };
        carried.orthonormalise()?;
        Ok(carried)
    }

    /// Integrates up to a time and returns Σ ln Rᵢᵢ. A part that fails because its vectors became too
    /// long, or too different, is repeated from its start with half the duration.
    fn block(&mut self, until: f64) -> Result<DVector<f64>, PeriodicError> {
        let mut logs = DVector::zeros(self.tangents.ncols());
        let mut done = 0;
        let begin = self.state.t();
        while done < self.parts {
            let here = (self.state, self.tangents.clone());
            let end = if done + 1 == self.parts {
                until
            } else {
                begin + (until - begin) * (done + 1) as f64 / self.parts as f64
            };
            let arrived = match self.flow.integrate(&self.state, &self.tangents, end, &mut |_| ()) {
                Ok(arrived) => arrived,
                // The vectors may have overflowed; then the motion alone reaches the end.
                Err(
                    PeriodicError::NotFinite { .. }
                    | PeriodicError::Derivatives(_)
                    | PeriodicError::Ends { .. },
                ) if self.parts < MAX_PARTS_PER_BLOCK && self.reaches_without_tangents(end) => {
                    (self.parts, done) = (2 * self.parts, 2 * done);
                    continue;
                }
                Err(error) => return Err(error),
            };
            (self.state, self.tangents) = (arrived.state, arrived.tangents);
            let sizes = self.orthonormalise()?;
            let too_different = sizes.max() > MAX_LENGTH_RATIO * sizes.min();
            let out_of_range =
                !sizes.iter().all(|size| (1.0 / LONGEST_TANGENT..LONGEST_TANGENT).contains(size));
            if out_of_range && self.parts >= MAX_PARTS_PER_BLOCK {
                return Err(PeriodicError::TooFast { time: self.state.t(), parts: self.parts });
            }
            if (too_different || out_of_range) && self.parts < MAX_PARTS_PER_BLOCK {
                (self.state, self.tangents) = here;
                (self.parts, done) = (2 * self.parts, 2 * done);
                continue;
            }
            done += 1;
            logs += sizes.map(f64::ln);
            self.divergence += arrived.divergence;
            self.steps += arrived.steps;
            self.orthonormalisations += 1;
        }
        self.passed.push(self.state);
        Ok(logs)
    }

    /// Whether the motion reaches a time if it is integrated without tangent vectors.
    fn reaches_without_tangents(&mut self, until: f64) -> bool {
        let none = DMatrix::zeros(2 * M::Vector::LEN, 0);
        self.flow.integrate(&self.state, &none, until, &mut |_| ()).is_ok()
    }

    /// Projects the vectors onto the tangent space of the constraints and makes them orthonormal in the
    /// scales of the coordinates. Returns the diagonal of R.
    fn orthonormalise(&mut self) -> Result<DVector<f64>, PeriodicError> {
        if !M::ROWS.is_empty() {
            let frame = Frame::at(self.flow.model, &self.state, None)?;
            self.tangents = &frame.basis * frame.read(&self.tangents);
        }
        let mut scaled = self.tangents.clone();
        scaled.column_iter_mut().for_each(|mut column| column.component_div_assign(&self.weights));
        let qr = scaled.qr();
        let lengths = qr.r().diagonal().abs();
        let mut q = qr.q();
        q.column_iter_mut().for_each(|mut column| column.component_mul_assign(&self.weights));
        self.tangents = q;
        Ok(lengths)
    }

    /// The exponents from the means of the blocks, with uncertainties and signs.
    fn judge(
        mut self,
        blocks: &[DVector<f64>],
        during: f64,
        before: f64,
    ) -> Result<LyapunovExponents<M::State>, PeriodicError> {
        let count = self.tangents.ncols();
        let part = during / blocks.len() as f64;
        let resolution = (self.highest_frequency()? * during).ln_1p() / during;
        let mean = |blocks: &[DVector<f64>], i: usize| {
            blocks.iter().map(|b| b[i]).sum::<f64>() / (part * blocks.len() as f64)
        };
        // Mean, standard error of the groups, and the difference of the halves.
        let mut exponents: Vec<Exponent> = (0..count)
            .map(|i| {
                let value = mean(blocks, i);
                let groups: Vec<f64> = blocks.chunks(BLOCKS_PER_GROUP).map(|group| mean(group, i)).collect();
                let k = groups.len() as f64;
                let variance = groups.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (k * (k - 1.0));
                let (first, second) = blocks.split_at(blocks.len() / 2);
                let uncertainty = (2.0 * variance.sqrt()).max((mean(first, i) - mean(second, i)).abs());
                let sign = match value.abs() > uncertainty.max(resolution) {
                    false => ExponentSign::Undecided,
                    true if value > 0.0 => ExponentSign::Positive,
                    true => ExponentSign::Negative,
                };
                Exponent { value, uncertainty, sign }
            })
            .collect();
        exponents.sort_by(|a, b| b.value.total_cmp(&a.value));
        let known_zeros = self.known_zeros(part)?;
        // If more exponents differ from 0 than possible, the run was too short to represent the motion, for
        // example because it stayed near a saddle; then no sign is certain. If all exponents were computed
        // and as many are undecided as are known to be 0, these are the zeros.
        let decided = exponents.iter().filter(|one| one.sign != ExponentSign::Undecided).count();
        if decided + known_zeros > self.dimension {
            exponents.iter_mut().for_each(|one| one.sign = ExponentSign::Undecided);
        } else if count == self.dimension && decided + known_zeros == count {
            let open = exponents.iter_mut().filter(|one| one.sign == ExponentSign::Undecided);
            open.for_each(|one| one.sign = ExponentSign::Zero);
        }
        let mut sums: DVector<f64> = DVector::zeros(count);
        let running = blocks.iter().enumerate().map(|(k, block)| {
            sums += block;
            let time = part * (k + 1) as f64;
            (time, sums.iter().map(|sum| sum / time).collect())
        });
        Ok(LyapunovExponents {
            running: running.collect(),
            exponents,
            divergence: (self.divergence - before) / during,
            dimension: self.dimension,
            time: during,
            known_zeros,
            resolution,
            orthonormalisations: self.orthonormalisations,
            steps: self.steps,
            end: self.state,
        })
    }

    /// The highest frequency of the coordinates: speed over half the range, or acceleration over speed.
    fn highest_frequency(&mut self) -> Result<f64, PeriodicError> {
        let n = M::Vector::LEN;
        let mut extent = alloc::vec![[f64::INFINITY, f64::NEG_INFINITY]; n];
        let (mut speed, mut acceleration) = (alloc::vec![0.0_f64; n], alloc::vec![0.0_f64; n]);
        for state in &self.passed {
            let along = direction(&mut self.flow, state)?;
            for i in 0..n {
                let q = state.q().as_slice()[i];
                extent[i] = [extent[i][0].min(q), extent[i][1].max(q)];
                speed[i] = speed[i].max(along[i].abs());
                acceleration[i] = acceleration[i].max(along[n + i].abs());
            }
        }
        let ratio = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
        let of = |i: usize| {
            ratio(speed[i], 0.5 * (extent[i][1] - extent[i][0])).max(ratio(acceleration[i], speed[i]))
        };
        Ok((0..n).map(of).fold(0.0, f64::max))
    }

    /// How many exponents are known to be 0.
    fn known_zeros(&mut self, span: f64) -> Result<usize, PeriodicError> {
        // No period is given: the equations are compared with themselves at other times.
        let (passed, n) = (self.passed.clone(), 2 * M::Vector::LEN);
        let autonomous = match is_autonomous(&mut self.flow, &passed, span, &DVector::zeros(n)) {
            Ok(autonomous) => autonomous,
            Err(PeriodicError::NotPeriodic { .. }) => false,
            Err(error) => return Err(error),
        };
        let along = direction(&mut self.flow, &at_time(&self.state, self.state.t()))?;
        let moves = along.component_div(&self.weights).amax() > MIN_SPEED;
        let conserved = Conserved::along(self.flow.model, &passed, autonomous).quantities;
        // A conserved momentum has a cyclic coordinate, so it gives two zeros.
        let momenta = conserved.iter().filter(|of| of.kind == ConservedKind::Momentum).count();
        let others = if moves { conserved.len() - momenta } else { 0 };
        Ok((usize::from(autonomous && moves) + others + 2 * momenta).min(self.dimension).min(n))
    }
}
