//! Taylor series of adaptive order and step.
//!
//! * **Problem**: smooth, not stiff, from six digits to all that there are; accelerations that can be
//!   expanded (models whose code is generated).
//! * **Formula**: q(t₀ + h) = Σ qₖ hᵏ and u likewise, with coefficients by recurrences that the model's code
//!   contains ([`Expandable::series`](super::Expandable::series)): exact derivatives, no differences. M is
//!   factored once per step.
//! * **Constraints**: Φ = 0 in every coefficient, so that Φ at the end of the step is the truncation error;
//!   projection removes it. The equations are solved as a system of index 3 with one factorisation per step
//!   (Pryce, BIT 41 (2001) 364; Nedialkov, Pryce, BIT 47 (2007) 191).
//! * **Order** p from the tolerance ε, p = 1 − ½ f ln ε. f = 1 minimises the work per unit of time if the
//!   work of a step grows with p² (Jorba, Zou). Here most of it grows with p, and the best f, measured, is
//!   larger.
//! * **Error estimate**: the last two terms. The step is chosen before it is made, as the longest for which
//!   both are permitted; at its end the accelerations of the model are compared with those of the series.
//!   Where the model chooses (`if`, min, max, abs, signum) the series is that of the branch at its start:
//!   there the comparison is also made within the step, and the step is repeated shorter until no branch
//!   changes within it.
//! * **Where there is no series**: at the edge of a contact max(δ, 0)^1.5 accelerations are finite and their
//!   derivatives are not; near it the radius of convergence is the distance from it. A step there has the
//!   constant accelerations of its start, and is as short as their change demands. The next steps grow with
//!   the distance.
//! * **Dense output**: the series itself, of full order, at no cost.
//! * **Stability**: the disk of radius about (p!)^(1/p), 8.3 for p = 20, on the left.
//! * **Rounding**: steps are added by compensated summation.
//! * **Cost**: one series, about p/2 evaluations of q̈ at p = 20, and one evaluation at the end.
//! * **Source**: Jorba, Zou, *A software package for the numerical integration of ODEs by means of high-order
//!   Taylor methods*, Experimental Mathematics 14 (2005) 99; Corliss, Chang, ACM TOMS 8 (1982) 114; Biscani,
//!   Izzo, MNRAS 504 (2021) 2614.

mod rough_powers;

use crate::integrate::compensated_summation::two_sum;
use crate::integrate::phase::{nan_vector, zip};
use crate::integrate::taylor::rough_powers::{exp2_roughly, log2_roughly};
use crate::integrate::{ControllerSettings, Dense, Method, Phase, Scheme, StepNode, System, Tolerances};
use crate::math;
use crate::model::{MAX_SERIES_ORDER, Vector};

/// Rows of coefficients.
const ROWS: usize = MAX_SERIES_ORDER + 1;
/// Lowest order: the step control needs two terms.
const MIN_ORDER: usize = 4;
/// The orders that series may have.
#[cfg(feature = "alloc")]
pub(crate) const ORDERS: core::ops::RangeInclusive<usize> = MIN_ORDER..=MAX_SERIES_ORDER;
/// The factor f of the order, see the header: measured.
const ORDER_FACTOR: f64 = 1.5;
/// Part of the longest permitted step that is made, since the last two terms are an estimate.
const STEP_SAFETY: f64 = 0.95;
/// Tolerances up to this are near rounding: see [`Taylor::margin`].
const NEAR_ROUNDING_TOLERANCE: f64 = 1e-14;
/// Largest growth from one step to the next: coefficients that vanish by chance or at rest are not those of
/// an exact polynomial.
const MAX_STEP_GROWTH: f64 = 30.0;
/// Largest defect of a step, in permitted errors, of models with choices: h times the difference of the
/// accelerations from those of the series. Smooth steps have less than 10, steps across a branch more.
const MAX_DEFECT_WITH_CHOICES: f64 = 50.0;
/// The same for models without choices. There only terms that vanish by chance can make the estimate wrong.
const MAX_DEFECT: f64 = 1e4;
/// Relative rounding of the accelerations, for models without choices: such a defect is not one of the step.
const ACCELERATION_ROUNDING: f64 = 1e-8;
/// A series whose step is below this part of the time, or of the proposed step, is not used: see
/// [`Taylor::shorten`].
const MIN_STEP_PART: f64 = 1e-13;
/// Parts of a step at which the accelerations of a model with choices are compared, besides its end.
const BRANCH_SAMPLES: [f64; 3] = [0.25, 0.5, 0.75];

/// Taylor series of adaptive order and step. A system without
/// [`Expandable::series`](super::Expandable::series) has none: its first step
/// fails as not finite.
#[derive(Clone, Copy, Debug)]
pub struct Taylor<V> {
    /// The order that the user chose.
    chosen_order: Option<usize>,
    /// The order of the series.
    order: usize,
    series: Series<V>,
    /// Longest step for which the last two terms are permitted, in the unit of time of the series.
    reach: f64,
    /// The series has the accelerations of its start and no further terms.
    is_short: bool,
    /// The start of the series, if there is one.
    from: Option<StepNode<V>>,
    /// The rounding error of the start of the series.
    lost: Phase<V>,
    /// The end of the last attempt and its rounding error.
    end: (Phase<V>, Phase<V>),
    /// q̈ there.
    acceleration: V,
    /// The last term at the end of the last attempt.
    error: Phase<V>,
    /// The tolerances for which the order was chosen.
    tolerances: Option<Tolerances>,
    /// Derivatives at start and end of the last attempt.
    stages: [Phase<V>; 2],
}

/// The series of a step: its dense output.
#[derive(Clone, Copy, Debug)]
pub struct Series<V> {
    q: [V; ROWS],
    u: [V; ROWS],
    /// Highest order.
    order: usize,
    /// Unit of time of the coefficients, with the sign of the run.
    scale: f64,
    /// Length of the step in this unit.
    length: f64,
}

impl<V: Vector> Series<V> {
    /// Row k.
    fn row(&self, k: usize) -> Phase<V> {
        Phase { q: self.q[k], u: self.u[k] }
    }

    /// Σ over k ≥ 1 of the coefficients times sᵏ.
    #[inline(always)]
    fn change(&self, s: f64) -> Phase<V> {
        let square = s * s;
        let (mut odd, mut even) = (Phase::<V>::zeros(), Phase::<V>::zeros());
        // Odd and even powers separately: an addition has to wait for the one before it.
        let mut add = |to_odd: bool, k: usize| {
            let sum = if to_odd { &mut odd } else { &mut even };
            for i in 0..V::LEN {
                sum.q[i] = math::add_product(self.q[k][i], sum.q[i], square);
                sum.u[i] = math::add_product(self.u[k][i], sum.u[i], square);
            }
        };
        if self.order % 2 == 1 {
            add(true, self.order);
        }
        for m in (1..=self.order / 2).rev() {
            add(false, 2 * m);
            add(true, 2 * m - 1);
        }
        zip(&odd, &even, |odd, even| math::add_product(odd, even, s) * s)
    }

    /// q̈ = du/dt at s.
    #[inline(always)]
    fn acceleration(&self, s: f64) -> V {
        let square = s * s;
        let (mut odd, mut even) = (V::zeros(), V::zeros());
        let mut add = |to_odd: bool, k: usize| {
            let sum = if to_odd { &mut odd } else { &mut even };
            for i in 0..V::LEN {
                sum[i] = math::add_product(k as f64 * self.u[k][i], sum[i], square);
            }
        };
        if self.order % 2 == 1 {
            add(true, self.order);
        }
        for m in (1..=self.order / 2).rev() {
            add(false, 2 * m);
            add(true, 2 * m - 1);
        }
        let per_scale = 1.0 / self.scale;
        for i in 0..V::LEN {
            odd[i] = math::add_product(odd[i], even[i], s) * per_scale;
        }
        odd
    }
}

impl<V: Vector> Dense<V> for Series<V> {
    fn at(&self, theta: f64) -> Phase<V> {
        zip(&self.row(0), &self.change(theta * self.length), |x, dx| x + dx)
    }
}

impl<V: Vector> Taylor<V> {
    /// Of a fixed order, 4 to [`MAX_SERIES_ORDER`], the nearest of these to any other; `None`: chosen by the
    /// tolerance.
    #[must_use]
    pub fn of_order(order: Option<usize>) -> Self {
        Self { chosen_order: order.map(|p| p.clamp(MIN_ORDER, MAX_SERIES_ORDER)), ..Self::new() }
    }

    /// The order of series.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// Part of a step that is made at tolerances near rounding: a tenth of the tolerance. Truncation errors,
    /// which add up, then stay below rounding errors, which do not.
    fn margin(&self) -> f64 {
        let fine = self.tolerances.is_some_and(|t| t.absolute.max(t.relative) <= NEAR_ROUNDING_TOLERANCE);
        if fine { 1.0 - 2.3 / self.series.order as f64 } else { 1.0 }
    }

    /// Chooses the order for the tolerances.
    fn choose_order(&mut self, tolerances: &Tolerances) {
        if self.tolerances == Some(*tolerances) {
            return;
        }
        let loosest = tolerances.absolute.max(tolerances.relative);
        // Rounded up.
        let by_tolerance = 2 + (-0.5 * ORDER_FACTOR * math::ln(loosest.clamp(1e-300, 1.0))) as usize;
        self.order = self.chosen_order.unwrap_or(by_tolerance.clamp(MIN_ORDER, MAX_SERIES_ORDER));
        self.tolerances = Some(*tolerances);
    }

    /// Expands the series at the start of a step, in a unit of time that keeps its coefficients in range.
    fn expand<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        scale: f64,
        tolerances: &Tolerances,
    ) -> Result<(), S::Error> {
        self.choose_order(tolerances);
        self.lost = match self.from {
            _ if self.end.0 == start.y => self.end.1,
            Some(from) if from.y == start.y => self.lost,
            _ => Phase::zeros(),
        };
        self.from = None;
        let order = self.order;
        (self.series.order, self.is_short) = (order, false);
        self.series.scale = power_of_two(scale);
        for _ in 0..8 {
            let Series { q, u, scale, .. } = &mut self.series;
            (q[0], u[0]) = (start.y.q, start.y.u);
            let rows = ..=order;
            if !system.series(start.t, &start.y, &start.a, *scale, &mut q[rows], &mut u[rows])? {
                (q[order], u[order], self.reach) = (nan_vector(), nan_vector(), f64::NAN);
                self.from = Some(*start);
                return Ok(());
            }
            if self.series.row(order).is_finite() {
                break;
            }
            self.series.scale *= 1.0 / 16384.0;
        }
        self.reach = self.reach(tolerances);
        let is_long = self.reach * self.series.scale.abs() >= MIN_STEP_PART * scale.abs().max(start.t.abs());
        if !is_long || !self.series.row(order).is_finite() {
            self.shorten(start, scale);
        }
        self.from = Some(*start);
        Ok(())
    }

    /// Makes the series one of constant accelerations.
    #[cold]
    fn shorten(&mut self, start: &StepNode<V>, scale: f64) {
        let Series { q, u, .. } = &mut self.series;
        (q[0], u[0]) = (start.y.q, start.y.u);
        for i in 0..V::LEN {
            (q[1][i], u[1][i]) = (start.y.u[i] * scale, start.a[i] * scale);
            (q[2][i], u[2][i]) = (0.5 * start.a[i] * scale * scale, 0.0);
        }
        (self.series.order, self.series.scale, self.is_short) = (2, scale, true);
    }

    /// The error of a short series: by the change of the accelerations within it.
    #[cold]
    fn short_error<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        (s, h): (f64, f64),
        tolerances: &Tolerances,
    ) -> Result<f64, S::Error> {
        let mut most = start.a;
        (0..V::LEN).for_each(|i| most[i] = (self.acceleration[i] - start.a[i]).abs());
        for part in BRANCH_SAMPLES {
            let y = zip(&start.y, &self.series.change(part * s), |y, x| y + x);
            let a = system.accelerations(start.t + part * h, &y.q, &y.u)?;
            for i in 0..V::LEN {
                let change = (a[i] - start.a[i]).abs();
                // NaN stays.
                most[i] = if change <= most[i] { most[i] } else { change };
            }
        }
        for i in 0..V::LEN {
            (self.error.q[i], self.error.u[i]) = (0.5 * h * h * most[i], h * most[i]);
        }
        Ok(tolerances.norm(&self.error, &start.y, &self.end.0))
    }

    /// Time, in the unit of the series, after which one of the last two terms is as large as permitted.
    #[inline(always)]
    fn reach(&self, tolerances: &Tolerances) -> f64 {
        let (p, y, count) = (self.series.order, self.series.row(0), (2 * V::LEN) as f64);
        let (mut last, mut before) = (0.0, 0.0);
        let mut add = |x: &[V; ROWS], start: &V| {
            for i in 0..V::LEN {
                let per_scale = 1.0 / tolerances.scale(start[i], start[i]);
                let (x, x_before) = (x[p][i] * per_scale, x[p - 1][i] * per_scale);
                last += x * x;
                before += x_before * x_before;
            }
        };
        add(&self.series.q, &y.q);
        add(&self.series.u, &y.u);
        if last + before == f64::INFINITY {
            // Very close to a singularity of the series.
            return 0.0;
        }
        let (per_count, half) = (1.0 / count, [p, p - 1].map(|k| -0.5 / k as f64));
        let of = |squares: f64, half: f64| half * log2_roughly(squares * per_count);
        let (last, before) = (of(last, half[0]), of(before, half[1]));
        // `min` would drop NaN.
        exp2_roughly(if last < before || last.is_nan() { last } else { before })
    }

    /// h times the difference of the accelerations from those of the series, in units of the largest
    /// permitted defect.
    fn defect<S: System<V>>(
        &self,
        system: &S,
        (s, h): (f64, f64),
        y: &Phase<V>,
        a: &V,
        tolerances: &Tolerances,
    ) -> f64 {
        let (expected, has_choices) = (self.series.acceleration(s), system.has_choices());
        let (factor, rounding) =
            if has_choices { (MAX_DEFECT_WITH_CHOICES, 0.0) } else { (MAX_DEFECT, ACCELERATION_ROUNDING) };
        let mut worst = 0.0f64;
        for i in 0..V::LEN {
            let permitted = factor * tolerances.scale(self.series.u[0][i], y.u[i])
                + rounding * h.abs() * self.stages[0].u[i].abs().max(a[i].abs());
            let part = (h * (a[i] - expected[i])).abs() / permitted;
            // NaN stays.
            worst = if part <= worst { worst } else { part };
        }
        worst
    }
}

/// The power of two in x, with its sign: multiplying by it, or by its reciprocal, does not round.
#[inline(always)]
fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0xfff0_0000_0000_0000)
}

impl<V: Vector> Scheme<V> for Taylor<V> {
    const METHOD: Method = Method::Taylor;
    // Used only for the first guess of a step and for how rejected steps shrink.
    const ORDER: u32 = 8;
    const ERROR_ORDER: u32 = 7;
    const CONTROL: Option<ControllerSettings> =
        Some(ControllerSettings { safety: 0.9, beta: 0.0, shrink: 0.25, grow: 4.0 });
    const WEIGHTS: &'static [f64] = &[];
    const PROPOSES_STEP: bool = true;
    const STABILITY_BORDER: f64 = 0.8;
    const EVENT_PANELS: usize = 16;
    type Dense = Series<V>;

    fn new() -> Self {
        let (rows, phase) = ([V::zeros(); ROWS], Phase::zeros());
        Self {
            chosen_order: None,
            order: MIN_ORDER,
            reach: f64::NAN,
            is_short: false,
            series: Series { q: rows, u: rows, order: MIN_ORDER, scale: 1.0, length: 1.0 },
            from: None,
            lost: phase,
            end: (phase, phase),
            acceleration: V::zeros(),
            error: phase,
            tolerances: None,
            stages: [phase; 2],
        }
    }

    fn propose<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Option<f64> {
        // An error here is reported when the step is made.
        self.expand(system, start, h, tolerances).ok()?;
        if self.is_short {
            return None;
        }
        let reach = self.reach * self.margin();
        let most = MAX_STEP_GROWTH * (h / self.series.scale).abs();
        (!reach.is_nan()).then(|| (STEP_SAFETY * reach).min(most) * self.series.scale.abs())
    }

    #[inline(always)]
    fn attempt<S: System<V>>(
        &mut self,
        system: &mut S,
        start: &StepNode<V>,
        h: f64,
        tolerances: &Tolerances,
    ) -> Result<(Phase<V>, f64), S::Error> {
        if self.from != Some(*start) || self.tolerances != Some(*tolerances) {
            self.expand(system, start, h, tolerances)?;
        }
        // The reciprocal is exact unless the series is short, and does not wait for h.
        let s = h * (1.0 / self.series.scale);
        self.series.length = s;
        self.stages[0] = start.derivative();
        let change = self.series.change(s);
        // Compensated summation: the rounding error of the last step is added.
        let change = zip(&change, &self.lost, |x, lost| x + lost);
        let (end, lost) = two_sum(&start.y, &change);
        self.end = (end, lost);
        if !end.is_finite() {
            return Ok((end, f64::NAN));
        }
        if self.is_short {
            self.acceleration = system.accelerations(start.t + h, &end.q, &end.u)?;
            self.stages[1] = Phase { q: end.u, u: self.acceleration };
            let error = self.short_error(system, start, (s, h), tolerances)?;
            return Ok((end, error));
        }
        let p = self.series.order;
        let power = math::powi(s, p as i32);
        self.error = zip(&self.series.row(p), &end, |x, _| x * power);
        let mut error = tolerances.norm(&self.error, &start.y, &end);
        self.acceleration = system.accelerations_at_next_start(start.t + h, &end)?;
        self.stages[1] = Phase { q: end.u, u: self.acceleration };
        error = error.max(self.defect(system, (s, h), &end, &self.acceleration, tolerances));
        if system.has_choices() {
            for part in BRANCH_SAMPLES {
                let y = zip(&start.y, &self.series.change(part * s), |y, x| y + x);
                let a = system.accelerations(start.t + part * h, &y.q, &y.u)?;
                error = error.max(self.defect(system, (part * s, h), &y, &a, tolerances));
            }
        }
        Ok((end, error))
    }

    #[inline(always)]
    fn finish<S: System<V>>(&mut self, _: &mut S, _: f64, _: &Phase<V>) -> Result<V, S::Error> {
        Ok(self.acceleration)
    }

    fn dense<S: System<V>>(
        &mut self,
        _: &mut S,
        _: &StepNode<V>,
        _: &StepNode<V>,
        _: f64,
    ) -> Result<Series<V>, S::Error> {
        Ok(self.series)
    }

    fn forget_history(&mut self) {
        self.from = None;
        self.end = (Phase { q: nan_vector(), u: nan_vector() }, Phase::zeros());
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.stages
    }

    fn error_vector(&self) -> Phase<V> {
        self.error
    }

    /// |h λ| where one mode makes the last coefficients, as it does where stability bounds the step, against
    /// the border of stability (p!)^(1/p). Then xₖ = (h λ)ᵏ/k! times the mode; two orders are compared
    /// because those of one parity may vanish.
    fn stiffness(&self, _: f64, _: &StepNode<V>) -> Option<f64> {
        if self.is_short {
            return None;
        }
        let (p, u) = (self.series.order, &self.series.u);
        let square = |k: usize| u[k].as_slice().iter().map(|x| x * x).sum::<f64>();
        let ratio = |k: usize| math::sqrt(math::sqrt(square(k) / square(k - 2)) * (k * (k - 1)) as f64);
        // If no mode dominates, the ratios differ.
        let size = (p - 1..=p).map(ratio).fold(f64::INFINITY, f64::min) * self.series.length.abs();
        // Stirling's formula.
        let n = p as f64;
        let border = n / core::f64::consts::E * math::powf(core::f64::consts::TAU * n, 0.5 / n);
        size.is_finite().then_some(size / border)
    }
}
