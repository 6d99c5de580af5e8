//! States for numeric checks: the values of all symbols.

use crate::graph::{Bindings, Fingerprint, FunctionId, Symbol};
use crate::mechanics::Model;

/// A state, at nominal values of the parameters where all are given that the constraints read, otherwise at
/// random ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// t.
    pub time: f64,
    /// q.
    pub q: Vec<f64>,
    /// q̇.
    pub u: Vec<f64>,
    /// The parameters.
    pub parameters: Vec<f64>,
}

/// From 0 to 1, the same in every run.
pub(super) fn random(kind: u64, index: u64) -> f64 {
    Fingerprint::atom(0x5a3_0000 + kind, index).residue(0) as f64 / (1u64 << 61) as f64
}

impl Sample {
    /// A state at random values.
    pub(in super::super) fn anywhere(model: &Model) -> Self {
        let all = |kind| (0..model.coordinates.len() as u64).map(|i| 2.0 * random(kind, i) - 1.0).collect();
        Self { time: random(6, 0), q: all(7), u: all(8), parameters: Self::parameters(model, 0) }
    }

    /// The parameters of the n-th attempt; nominal values where given.
    pub(super) fn parameters(model: &Model, attempt: u64) -> Vec<f64> {
        let given = |i: u32| model.nominal.iter().find(|(p, _)| *p == i).map(|(_, value)| *value);
        let any = |i: u32| {
            let r = random(1 + (attempt << 8), i.into());
            0.5 + 2.0 * r
        };
        (0..model.parameters.len() as u32).map(|i| given(i).unwrap_or_else(|| any(i))).collect()
    }
}

impl Bindings for Sample {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let at = |values: &[f64], i: u32| values.get(i as usize).copied().unwrap_or(f64::NAN);
        match symbol {
            Symbol::Time => self.time,
            Symbol::Coordinate(i) => at(&self.q, i),
            Symbol::Rate(i) => at(&self.u, i),
            Symbol::Parameter(i) => at(&self.parameters, i),
            // All constraints hold.
            Symbol::Mode(_) => 0.0,
            // What a state does not decide takes part as any number would.
            Symbol::Acceleration(i) => 2.0 * random(2, i.into()) - 1.0,
            Symbol::Input(i) => 2.0 * random(3, i.into()) - 1.0,
            Symbol::Multiplier(i) => 2.0 * random(4, i.into()) - 1.0,
        }
    }

    /// Some smooth function, another one for every parameter: a + x/2 + sin(x + a).
    fn smooth(&self, function: FunctionId, order: u8, x: f64) -> f64 {
        let a = random(5, function.0.into());
        match order {
            0 => a + x / 2.0 + (x + a).sin(),
            1 => 0.5 + (x + a).cos(),
            2 => -(x + a).sin(),
            _ => -(x + a).cos(),
        }
    }
}
