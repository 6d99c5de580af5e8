//! Constraints for models that are built on the graph.

use dynamics_symbolic::graph::{NodeId, Origin};
use dynamics_symbolic::mechanics::{Constraint, ConstraintKind, EnergyRole};

use super::Builder;

pub const HOLONOMIC: ConstraintKind = ConstraintKind::Holonomic;
pub const NONHOLONOMIC: ConstraintKind = ConstraintKind::Nonholonomic { integrable: false };

/// Free particles of unit mass, one per name.
pub fn particles(names: &[&str]) -> (Builder, Vec<NodeId>) {
    let mut b = Builder::new("Particles");
    let q: Vec<NodeId> = names.iter().map(|n| b.coordinate(n)).collect();
    let one = b.ratio(1, 1);
    let t = b.kinetic(one, &q);
    b.energy("kinetic", EnergyRole::Kinetic, t);
    (b, q)
}

/// Declares a constraint of one row or several; its origin is 1000 plus its place.
pub fn constrain<'b>(
    b: &'b mut Builder,
    name: &str,
    kind: ConstraintKind,
    rows: &[NodeId],
) -> &'b mut Constraint {
    let suffix = |i: usize| if rows.len() == 1 { String::new() } else { format!("[{i}]") };
    let components = rows.iter().enumerate().map(|(i, node)| (suffix(i), *node)).collect();
    let origin = Origin(1000 + b.model.constraints.len() as u32);
    let name = name.to_owned();
    let (units, redundant, switched) = (vec![String::new(); rows.len()], false, false);
    b.model.constraints.push(Constraint { name, kind, components, units, redundant, switched, origin });
    b.model.constraints.last_mut().expect("it was added just now")
}

impl Builder {
    /// Σ cᵢ xᵢ + c.
    pub fn linear(&mut self, coefficients: &[i64], x: &[NodeId], constant: i64) -> NodeId {
        let mut sum = self.g().integer(constant);
        for (c, x) in coefficients.iter().zip(x).filter(|(c, _)| **c != 0) {
            let factor = self.g().integer(*c);
            let term = self.mul(factor, *x);
            sum = self.add(sum, term);
        }
        sum
    }

    /// Gives a parameter its nominal value.
    pub fn nominal(&mut self, parameter: u32, value: f64) {
        self.model.nominal.push((parameter, value));
    }
}
