//! Gauss: collocation at Gauss's nodes, of order 4 (two stages) and 6 (three).
//!
//! * **Problem**: long motions of conservative systems of any kind, velocities in the forces and mass
//!   matrices that move included, where [`StormerVerlet`](crate::integrate::StormerVerlet) and its
//!   compositions do not apply; also where many digits are wanted at long steps.
//! * **Formula**: stages Uᵢ = q̇(t + cᵢh), Qᵢ = q₀ + h Σ aᵢⱼUⱼ. Where the system gives its momenta p = ∂L/∂q̇
//!   and their rates ṗ = ∂L/∂q + forces, the stages solve p(Qᵢ, Uᵢ) = p₀ + h Σ aᵢⱼṗⱼ: the method in the
//!   canonical variables (q, p). Else Uᵢ = u₀ + h Σ aᵢⱼq̈ⱼ: the method in (q, u), the same while M is
//!   constant. The equations are solved to rounding, by fixed-point iterations that start from the polynomial
//!   of the step before; for momenta with M(Qᵢ) factored once per stage.
//! * **Order** 4 and 6; no error estimate, hence a fixed step.
//! * **Structure**: symmetric and reversible; in canonical variables symplectic: the energy error stays at
//!   O(h⁴) and O(h⁶) for times exponentially long in 1/h, and momenta, linear ones and those quadratic in (q,
//!   p), are kept to rounding. In (q, u) with M(q) it is symmetric, no more, which keeps energy for
//!   reversible motions far from chaos.
//! * **Dense output**: the quintic through q, q̇, q̈ at both ends ([`Hermite`](crate::integrate::Hermite)),
//!   of order 4 at least in u: better than the collocation polynomial's.
//! * **Stability**: A-stable without damping. Oscillations faster than the step are not solved for: the
//!   iterations converge to hω = 2.5 and 3. Far beyond, the step is an error. A solution there would be
//!   worse: by Newton's method, a pendulum on a stiff spring (k = 1e8, h = 0.02) gains 2 J in two seconds.
//! * **Rounding**: steps in (q, u) are added by a [`CompensatedSum`], as Hairer, McLachlan and Razakarivony
//!   (BIT 48 (2008) 231) recommend. In Kepler's problem with e = 0.9 rounding leaves an energy error of 10⁻¹⁵
//!   after 100 periods in 1.3 million steps, without it 10⁻¹³. In (q, p) each step solves for u anew, and
//!   there is nothing to compensate.
//! * **Cost**: 2 or 3 evaluations of q̈ (or of p and ṗ) per iteration, 4 to 10 iterations a step, and 1 of q̈
//!   at its end.
//! * **Source**: Hairer, Lubich, Wanner, *Geometric Numerical Integration*, 2nd ed., §II.1.3, §VI.4, §VIII.6;
//!   Butcher, Math. Comp. 18 (1964) 50.

use crate::integrate::compensated_summation::CompensatedSum;
use crate::integrate::geometric::fixed_point::{FixedPoint, IterationStatus, relative_correction};
use crate::integrate::phase::{nan_vector, plus_scaled};
use crate::integrate::{ControllerSettings, Method, Phase, Scheme, Step, StepNode, System, Tolerances};
use crate::linalg::elimination::{Matrices, factor, solve};
use crate::model::Vector;

/// √3.
const ROOT_3: f64 = 1.7320508075688772;
/// √15.
const ROOT_15: f64 = 3.872983346207417;
/// Steps that differ by no more than this part have the same size: their times are rounded.
const SAME_STEP_PART: f64 = 1e-6;

/// Collocation at the S nodes of Gauss.
#[derive(Clone, Debug)]
pub struct Gauss<V: Vector, const S: usize> {
    /// (q̇, q̈) at the start, then (U, q̈) or (U, ṗ) of the stages.
    k: [Phase<V>; 4],
    /// U of the stages.
    u: [V; S],
    /// M of the stages, factored, and how rows were exchanged.
    mass: Matrices<V, S>,
    exchanges: [V; S],
    solved: bool,
    /// The last accepted step: its end, its size, the velocities of its stages and of its start.
    last: Option<(Phase<V>, f64, [V; S], V)>,
    compensation: CompensatedSum<V>,
}

/// Order 4 by two stages.
pub type Gauss4<V> = Gauss<V, 2>;
/// Order 6 by three stages.
pub type Gauss6<V> = Gauss<V, 3>;

/// Nodes, rows and weights.
struct Table<const S: usize> {
    c: [f64; S],
    a: [[f64; S]; S],
    b: [f64; S],
}

impl<const S: usize> Table<S> {
    const OF: Self = Self::new();

    const fn new() -> Self {
        let mut table = Self { c: [0.0; S], a: [[0.0; S]; S], b: [0.0; S] };
        let (c, a, b) = match S {
            2 => {
                let off = ROOT_3 / 6.0;
                let a = [[0.25, 0.25 - off, 0.0], [0.25 + off, 0.25, 0.0], [0.0; 3]];
                ([0.5 - off, 0.5 + off, 0.0], a, [0.5, 0.5, 0.0])
            }
            3 => {
                let (near, far, wide) = (ROOT_15 / 30.0, ROOT_15 / 15.0, ROOT_15 / 24.0);
                let (outer, inner) = (5.0 / 36.0, 2.0 / 9.0);
                let a = [
                    [outer, inner - far, outer - near],
                    [outer + wide, inner, outer - wide],
                    [outer + near, inner + far, outer],
                ];
                ([0.5 - ROOT_15 / 10.0, 0.5, 0.5 + ROOT_15 / 10.0], a, [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0])
            }
            _ => panic!("collocation has two or three stages"),
        };
        let mut i = 0;
        while i < S {
            (table.c[i], table.b[i]) = (c[i], b[i]);
            let mut j = 0;
            while j < S {
                table.a[i][j] = a[i][j];
                j += 1;
            }
            i += 1;
        }
        table
    }

    /// Weights that continue the polynomial through values at 0, c₁ … cₛ and 1 to 1 + cᵢ: those of the stages
    /// and of the end. That of the start is the rest to 1.
    fn beyond(i: usize) -> ([f64; S], f64) {
        let x = 1.0 + Self::OF.c[i];
        let node = |j: usize| if j == S { 1.0 } else { Self::OF.c[j] };
        // For differences from the value at 0 each basis polynomial has the factor θ.
        let weight = |j: usize| {
            let others = (0..=S).filter(|k| *k != j).map(|k| (x - node(k)) / (node(j) - node(k)));
            others.product::<f64>() * x / node(j)
        };
        (core::array::from_fn(weight), weight(S))
    }
}

impl<V: Vector, const S: usize> Gauss<V, S> {
    /// The velocities of the stages from which the iterations start: those of the last step continued, where
    /// it ends here and had the same size; else u₀ + cᵢ h q̈₀.
    fn predict(&mut self, start: &StepNode<V>, h: f64) {
        let StepNode { y, a, .. } = start;
        let last =
            self.last.filter(|(end, before, ..)| end == y && (h / before - 1.0).abs() < SAME_STEP_PART);
        for i in 0..S {
            self.u[i] = plus_scaled(&y.u, Table::<S>::OF.c[i] * h, a);
            if let Some((_, _, stages, first)) = &last {
                let (weights, of_end) = Table::<S>::beyond(i);
                for l in 0..V::LEN {
                    let along: f64 =
                        weights.iter().zip(stages).map(|(w, stage)| w * (stage[l] - first[l])).sum();
                    self.u[i][l] = first[l] + along + of_end * (y.u[l] - first[l]);
                }
            }
        }
    }

    /// x + h Σ wⱼ dⱼ.
    #[inline(always)]
    fn weighted_sum(x: &V, h: f64, weights: &[f64; S], d: impl Fn(usize) -> V) -> V {
        let mut sum = V::zeros();
        (0..S).for_each(|j| sum = plus_scaled(&sum, weights[j], &d(j)));
        plus_scaled(x, h, &sum)
    }

    /// Evaluates the stages at their velocities: q̈, or ṗ with the momenta.
    fn evaluate<Y: System<V>>(
        &mut self,
        system: &mut Y,
        start: &StepNode<V>,
        h: f64,
        momenta: Option<&mut [V; S]>,
    ) -> Result<(), Y::Error> {
        let Table { c, a, .. } = Table::<S>::OF;
        let mut momenta = momenta;
        for i in 0..S {
            let q = Self::weighted_sum(&start.y.q, h, &a[i], |j| self.u[j]);
            let (t, y) = (start.t + c[i] * h, Phase { q, u: self.u[i] });
            let rate = match &mut momenta {
                None => system.accelerations(t, &q, &y.u)?,
                Some(momenta) => {
                    let mut rate = V::zeros();
                    system.momenta(t, &y, &mut momenta[i], &mut rate)?;
                    rate
                }
            };
            self.k[i + 1] = Phase { q: y.u, u: rate };
        }
        Ok(())
    }

    /// Iterates until rounding stops it; `improve` gives new velocities of the stages.
    fn iterate<E>(
        &mut self,
        (start, h): (&Phase<V>, f64),
        mut improve: impl FnMut(&mut Self) -> Result<[V; S], E>,
    ) -> Result<(), E> {
        let mut progress = FixedPoint::new();
        loop {
            let new = improve(self)?;
            let values = (0..S * V::LEN).map(|k| (k / V::LEN, k % V::LEN));
            let values = values.map(|(i, l)| (self.u[i][l], new[i][l], start.u[l]));
            let next = progress.judge(relative_correction(values, (start.q.as_slice(), h)));
            self.u = new;
            let finite = new.iter().all(|u| u.as_slice().iter().all(|x| x.is_finite()));
            // Values that are not finite lead to an end that is not, and the stepper reports that.
            self.solved = next != IterationStatus::Diverged || !finite;
            if next != IterationStatus::Continue || !finite {
                return Ok(());
            }
        }
    }

    /// The step in (q, u).
    fn step_in_velocities<Y: System<V>>(
        &mut self,
        system: &mut Y,
        start: &StepNode<V>,
        h: f64,
    ) -> Result<Phase<V>, Y::Error> {
        let Table { a, b, .. } = Table::<S>::OF;
        self.iterate((&start.y, h), |this| {
            this.evaluate(system, start, h, None)?;
            Ok(core::array::from_fn(|i| Self::weighted_sum(&start.y.u, h, &a[i], |j| this.k[j + 1].u)))
        })?;
        let none = V::zeros();
        let way = Phase {
            q: Self::weighted_sum(&none, h, &b, |j| self.u[j]),
            u: Self::weighted_sum(&none, h, &b, |j| self.k[j + 1].u),
        };
        Ok(self.compensation.add(&start.y, &way))
    }

    /// The step in (q, p), from momenta p₀.
    fn step_in_momenta<Y: System<V>>(
        &mut self,
        system: &mut Y,
        start: &StepNode<V>,
        h: f64,
        from: &V,
    ) -> Result<Phase<V>, Y::Error> {
        let Table { c, a, b } = Table::<S>::OF;
        for i in 0..S {
            let q = Self::weighted_sum(&start.y.q, h, &a[i], |j| self.u[j]);
            if !self.factor(system, i, start.t + c[i] * h, &q)? {
                return Ok(no_end());
            }
        }
        self.iterate((&start.y, h), |this| {
            let mut momenta = [V::zeros(); S];
            this.evaluate(system, start, h, Some(&mut momenta))?;
            Ok(core::array::from_fn(|i| {
                let wanted = Self::weighted_sum(from, h, &a[i], |j| this.k[j + 1].u);
                let u = this.u[i];
                this.velocity_correction(i, &u, &wanted, &momenta[i])
            }))
        })?;
        let q = Self::weighted_sum(&start.y.q, h, &b, |j| self.u[j]);
        let wanted = Self::weighted_sum(from, h, &b, |j| self.k[j + 1].u);
        let (t, mut y) = (start.t + h, Phase { q, u: self.u[S - 1] });
        if !self.factor(system, 0, t, &q)? {
            return Ok(no_end());
        }
        // p is linear in u: the first correction is nearly exact, the second removes its rounding error.
        for _ in 0..2 {
            let (mut p, mut rate) = (V::zeros(), V::zeros());
            system.momenta(t, &y, &mut p, &mut rate)?;
            y.u = self.velocity_correction(0, &y.u, &wanted, &p);
        }
        Ok(y)
    }

    /// Factors M at a position; false where it is singular.
    fn factor<Y: System<V>>(&mut self, system: &mut Y, i: usize, t: f64, q: &V) -> Result<bool, Y::Error> {
        system.mass_matrix(t, q, self.mass.one(i))?;
        let exchanges = factor(self.mass.one(i));
        self.exchanges[i] = exchanges.unwrap_or_else(V::zeros);
        Ok(exchanges.is_some())
    }

    /// u + M⁻¹(p − p(u)).
    fn velocity_correction(&mut self, i: usize, u: &V, wanted: &V, found: &V) -> V {
        let mut missing = plus_scaled(wanted, -1.0, found);
        solve(self.mass.one(i), &self.exchanges[i], &mut missing);
        plus_scaled(u, 1.0, &missing)
    }
}

/// The end of a step where M has no inverse: positions of no meaning, velocities that are not a number.
fn no_end<V: Vector>() -> Phase<V> {
    Phase { q: V::zeros(), u: nan_vector() }
}

impl<V: Vector, const S: usize> Scheme<V> for Gauss<V, S> {
    const METHOD: Method = if S == 2 { Method::Gauss4 } else { Method::Gauss6 };
    const ORDER: u32 = 2 * S as u32;
    const ERROR_ORDER: u32 = Self::ORDER;
    const CONTROL: Option<ControllerSettings> = None;
    const WEIGHTS: &'static [f64] = &[];
    const STABILITY_BORDER: f64 = f64::INFINITY;
    const EVENT_PANELS: usize = 8;
    quintic!(V);

    fn new() -> Self {
        Self {
            k: [Phase::zeros(); 4],
            u: [V::zeros(); S],
            mass: Matrices::new(),
            exchanges: [V::zeros(); S],
            solved: true,
            last: None,
            compensation: CompensatedSum::new(),
        }
    }

    fn forget_history(&mut self) {
        self.last = None;
    }

    fn attempt<Y: System<V>>(
        &mut self,
        system: &mut Y,
        start: &StepNode<V>,
        h: f64,
        _: &Tolerances,
    ) -> Result<(Phase<V>, f64), Y::Error> {
        self.k[0] = start.derivative();
        self.predict(start, h);
        let (mut p, mut rate) = (V::zeros(), V::zeros());
        // Without velocity forces M is constant, and the method in (q, u) is that in (q, p).
        let canonical =
            system.has_velocity_forces() && system.momenta(start.t, &start.y, &mut p, &mut rate)?;
        let end = if canonical {
            self.step_in_momenta(system, start, h, &p)
        } else {
            self.step_in_velocities(system, start, h)
        };
        Ok((end?, 0.0))
    }

    fn stages(&self) -> &[Phase<V>] {
        &self.k[..S + 1]
    }

    fn has_converged(&self) -> bool {
        self.solved
    }

    fn accept_step(&mut self, step: &Step<V>) {
        self.last = Some((step.end.y, step.h, self.u, step.start.y.u));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::explicit::trees::Tableau;
    use std::vec::Vec;

    fn check<const S: usize>(order: u32) {
        let Table { c, a, b } = Table::<S>::OF;
        let row = |row: &[f64; S]| row.iter().copied().enumerate().collect::<Vec<_>>();
        let rows: Vec<Vec<(usize, f64)>> = a.iter().map(row).collect();
        let rows: Vec<&[(usize, f64)]> = rows.iter().map(Vec::as_slice).collect();
        Tableau::new(&rows, &c).assert_orders(&row(&b), order, 1e-15);
        for i in 0..S {
            for j in 0..S {
                // What makes a Runge–Kutta method keep quadratic invariants.
                let defect = b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j];
                assert!(defect.abs() < 1e-16, "{defect:e}");
            }
        }
    }

    #[test]
    fn the_order_conditions_of_all_trees_hold_and_quadratic_invariants_are_kept() {
        check::<2>(4);
        check::<3>(6);
    }

    /// A polynomial of the degree that the nodes determine is continued exactly.
    #[test]
    fn the_start_of_the_iterations_continues_the_step_before() {
        let u = |theta: f64| 1.0 + theta * (2.0 - theta * (3.0 + theta * (0.5 - theta)));
        for i in 0..3 {
            let (weights, of_end) = Table::<3>::beyond(i);
            let stages: f64 = (0..3).map(|j| weights[j] * (u(Table::<3>::OF.c[j]) - u(0.0))).sum();
            let found = u(0.0) + stages + of_end * (u(1.0) - u(0.0));
            assert!((found - u(1.0 + Table::<3>::OF.c[i])).abs() < 1e-12);
        }
    }
}
