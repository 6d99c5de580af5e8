//! The law of a unilateral contact.

/// The law of a unilateral contact: free where Φ > 0, pushed by λ > 0 where it is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Coefficient of restitution e, 0 to 1: Φ̇⁺ = −e Φ̇⁻. Default 0: it closes at the first
    /// impact.
    pub restitution: f64,
    /// Speed of approach |Φ̇⁻| below which the contact closes instead of rebounding. `None`: a thousandth
    /// of the largest speed with which this contact was hit, as a slower rebound has less than a millionth of
    /// that impact's energy. It is a tenth where the contact is hit again before it was seen to open: such a
    /// hop is shorter than steps resolve. The summary reports how often this happened, and the largest such
    /// speed. A body that rocks from contact to contact comes to rest by the same rule.
    pub rest_speed: Option<f64>,
}

impl Default for Contact {
    fn default() -> Self {
        Self { restitution: 0.0, rest_speed: None }
    }
}

impl From<f64> for Contact {
    /// With this coefficient of restitution.
    fn from(restitution: f64) -> Self {
        Self { restitution, ..Self::default() }
    }
}
