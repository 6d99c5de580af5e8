//! Typed ids.

/// A node of a [`Graph`](super::Graph).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub(super) u32);

impl NodeId {
    /// Position in the graph; children come before their parents.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A smooth function of one variable that is a parameter of the model (a spline, a cam profile).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FunctionId(pub u32);

/// Where something was declared, in terms that only the caller understands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Origin(pub u32);
