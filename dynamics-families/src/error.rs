//! A simulation that stopped before its end, with what it had computed.

use core::fmt;
use std::sync::Arc;

use dynamics_runtime::sentence_for_debugging;
use dynamics_runtime::wording::Readable;

use crate::failure::FamilyErrorKind;
use crate::model::FamilyModel;
use crate::motion::FamilyMotion;
use crate::record::Record;

/// A simulation that stopped before its end. What was computed up to there is still in hand:
/// [`FamilyError::motion`].
pub struct FamilyError<M: FamilyModel> {
    /// What happened.
    pub kind: FamilyErrorKind,
    /// Time of the last good state; the start's where nothing has moved.
    pub time: f64,
    /// Size of the last step that was tried; 0 where none was.
    pub step: f64,
    pub(crate) record: Option<Arc<Record<M>>>,
}

impl<M: FamilyModel> FamilyError<M> {
    /// Nothing was computed.
    pub(crate) fn before(kind: impl Into<FamilyErrorKind>, time: f64) -> Self {
        Self { kind: kind.into(), time, step: 0.0, record: None }
    }

    /// The motion up to the failure; its end is the last good state. `None` where nothing was computed.
    #[must_use]
    pub fn motion<'m>(&self, model: &'m M) -> Option<FamilyMotion<'m, M>> {
        self.record.as_ref().map(|record| FamilyMotion { model, record: Arc::clone(record) })
    }

    /// The last good state; `None` where nothing was computed.
    #[must_use]
    pub fn state(&self) -> Option<&M::State> {
        self.record.as_ref().map(|record| &record.end)
    }
}

impl<M: FamilyModel> fmt::Display for FamilyError<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.kind.is_of_options() || self.record.is_none() {
            return write!(f, "`{}` was not simulated: {}", M::NAME, self.kind);
        }
        write!(f, "`{}` stopped at t = {}: {}", M::NAME, Readable(self.time), self.kind)?;
        if self.step != 0.0 {
            write!(f, " (last step tried {:.3e})", self.step)?;
        }
        Ok(())
    }
}

sentence_for_debugging!(FamilyError<M: FamilyModel>);

impl<M: FamilyModel> core::error::Error for FamilyError<M> {}
