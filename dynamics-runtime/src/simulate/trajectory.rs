//! What a run leaves: its records, and the motion that answers from them.

pub(crate) mod error;
pub(crate) mod global_error;
pub(crate) mod motion;
pub(crate) mod motion_record;
pub(crate) mod position_analysis;
pub(crate) mod record;
pub(crate) mod work;
