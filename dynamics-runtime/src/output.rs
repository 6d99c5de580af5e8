//! What shows a motion: tables, charts, animations.

/// A picture of the model at one instant.
#[derive(Clone, Debug, Default)]
pub struct Drawing {}
