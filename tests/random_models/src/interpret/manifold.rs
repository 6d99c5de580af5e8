//! States where the constraints hold.

use dynamics_symbolic::graph::NodeId;

use super::solve::eliminate;
use super::states::Point;
use super::{Interpreter, Values};

/// Steps of Newton's method, damped while they are long.
const MOST_STEPS: usize = 80;
/// Largest residual of what holds.
const HOLDS: f64 = 1e-12;

impl Interpreter<'_> {
    /// The state with positions and velocities moved onto the constraints; `None` where no way was found, or
    /// no constraint is.
    pub(super) fn on_constraints(&self, at: &Point) -> Option<Point> {
        let c = self.equations.constraints.as_ref()?;
        let mut at = at.clone();
        let n = at.q.len();
        let jacobian: Vec<NodeId> = c.jacobian.concat();
        let values = |at: &Point, nodes: &[NodeId]| {
            self.evaluate(
                nodes,
                &Values { at, parameters: self.parameters, accelerations: &[], multipliers: &[] },
            )
        };
        let mut steps = 0;
        loop {
            let residual = values(&at, &c.residual);
            let size =
                residual.iter().fold(0.0_f64, |s, r| if r.is_nan() { f64::NAN } else { s.max(r.abs()) });
            if size <= HOLDS {
                break;
            }
            steps += 1;
            if steps > MOST_STEPS || !size.is_finite() {
                return None;
            }
            let rows = &values(&at, &jacobian)[..n * c.holonomic];
            let step = least(rows, n, &residual, 1e-2 * size * size);
            let length = step.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
            let part = if length > 0.3 { 0.3 / length } else { 1.0 };
            at.q.iter_mut().zip(step).for_each(|(q, step)| *q -= part * step);
        }
        let rates = values(&at, &c.velocity_residual);
        let step = least(&values(&at, &jacobian), n, &rates, 0.0);
        at.u.iter_mut().zip(step).for_each(|(u, step)| *u -= step);
        let left = values(&at, &c.velocity_residual);
        let within = at.q.iter().chain(&at.u).all(|x| x.abs() < 20.0);
        (within && left.iter().all(|r| r.abs() <= 1e3 * HOLDS)).then_some(at)
    }
}

/// The least δ with J δ = r, J by rows of this width; rows that repeat others are left out, and J Jᵀ is
/// damped.
fn least(rows: &[f64], n: usize, r: &[f64], damping: f64) -> Vec<f64> {
    let rows: Vec<&[f64]> = rows.chunks(n).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let system = rows
        .iter()
        .enumerate()
        .map(|(i, a)| {
            let products = rows.iter().enumerate();
            let damped = products.map(|(j, b)| dot(a, b) + if i == j { damping } else { 0.0 });
            damped.chain([r[i]]).collect()
        })
        .collect();
    let (weights, _) = eliminate(system);
    (0..n).map(|j| rows.iter().zip(&weights).map(|(row, w)| row[j] * w).sum()).collect()
}
