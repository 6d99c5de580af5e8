//! A set of three angles and its two references, and the change between them.

use core::f64::consts::FRAC_PI_2;

use crate::expr::Expr;
use crate::matrix::Mat3;
use crate::model::{AngleSet, Dynamics, ModelState, Vector};
use crate::rotation::EulerSequence;
use crate::simulate::charts::error::ChartError;
use crate::vector::Vec3;

/// Angle of a turned reference.
pub(crate) const QUARTER_TURN: f64 = FRAC_PI_2;

/// A set of angles whose reference may be turned by a quarter about the set's second axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AngleReference {
    pub(crate) set: AngleSet,
    pub(crate) names: [&'static str; 3],
    sequence: EulerSequence,
}

impl AngleReference {
    /// The set with this second angle.
    pub(crate) fn of<M: Dynamics>(middle: &str) -> Result<Self, ChartError> {
        let name = |set: &AngleSet| M::COORDINATES[set.angles[1]].name;
        let unknown = || ChartError::UnknownSet {
            name: middle.into(),
            known: M::ANGLE_SETS.iter().map(name).collect(),
            model: M::NAME,
        };
        let set = *M::ANGLE_SETS.iter().find(|set| name(set) == middle).ok_or_else(unknown)?;
        let axes = set.axes.map(|axis| usize::from(axis) - 1);
        let sequence =
            EulerSequence::ALL.into_iter().find(|known| known.axes() == axes).ok_or_else(unknown)?;
        Ok(Self { set, sequence, names: set.angles.map(|k| M::COORDINATES[k].name) })
    }

    /// How far the second angle is from locking.
    pub(crate) fn distance<S: ModelState>(&self, state: &S) -> f64 {
        self.set.distance(state.q().as_slice())
    }

    /// The turn of a reference, C.
    fn frame(&self, turned: bool) -> Mat3<f64> {
        Mat3::about(self.sequence.axes()[1], if turned { QUARTER_TURN } else { 0.0 })
    }

    /// E(θ) with its rates.
    fn rotation<S: ModelState>(&self, state: &S, accelerations: [f64; 3]) -> Mat3 {
        let (q, u) = (state.q().as_slice(), state.u().as_slice());
        let jet = |k: usize| Expr::coordinate(q[self.set.angles[k]], u[self.set.angles[k]], accelerations[k]);
        Mat3::euler(self.sequence, [jet(0), jet(1), jet(2)])
    }

    /// ω and ω̇ against the frame that carries the reference, in that frame's components.
    pub(crate) fn angular_motion<S: ModelState>(
        &self,
        state: &S,
        accelerations: &[f64],
        turned: bool,
    ) -> [Vec3<f64>; 2] {
        let omega = self.rotation(state, self.set.angles.map(|k| accelerations[k])).angular_velocity();
        [omega.value(), omega.rate()].map(|v| self.frame(turned) * v)
    }

    /// Measures the angles from the other reference: the same rotation, the same angular velocity.
    pub(crate) fn re_express<S: ModelState>(
        &self,
        state: &mut S,
        from: bool,
        to: bool,
    ) -> Result<(), ChartError> {
        let rotation = self.rotation(state, [0.0; 3]);
        let back = self.frame(to).transpose() * self.frame(from);
        let omega = back * rotation.angular_velocity().value();
        let read = (back * rotation.value()).to_euler(self.sequence);
        let angles = read.map_err(|error| ChartError::NoRotation { name: self.names[1], error })?.angles;
        // ω = Σ θ̇ₖ aₖ with the axes as the turns before left them.
        let [i, j, k] = self.sequence.axes();
        let first = Mat3::about(i, angles[0]);
        let axes = [
            Mat3::<f64>::about(i, 0.0).column(i),
            first.column(j),
            (first * Mat3::about(j, angles[1])).column(k),
        ];
        let normals = [axes[1].cross(axes[2]), axes[2].cross(axes[0]), axes[0].cross(axes[1])];
        let volume = axes[0].dot(normals[0]);
        for (which, (angle, normal)) in angles.into_iter().zip(normals).enumerate() {
            let at = self.set.angles[which];
            state.q_mut().as_mut_slice()[at] = angle;
            state.u_mut().as_mut_slice()[at] = omega.dot(normal) / volume;
        }
        Ok(())
    }
}
