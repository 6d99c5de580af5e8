//! Variables: one frame per function call, one scope per block.

use super::values::Value;

/// A variable.
#[derive(Clone, Debug)]
pub(super) struct Variable {
    pub(super) name: String,
    pub(super) value: Value,
}

/// Where control goes instead of to the next statement.
#[derive(Clone, Debug)]
pub(super) enum Flow {
    Break,
    Continue,
    Return(Value),
}

/// A function call.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    /// Index of the function; `None` while a constant is evaluated.
    pub(super) function: Option<usize>,
    /// For loops over indices: how many loops there are down to them.
    pub(super) rounds: Vec<usize>,
    /// Index of the constant that is being evaluated.
    pub(super) constant: Option<usize>,
    /// Number of the first scopes that belong to the function around, where this is a closure's.
    pub(super) captured: usize,
    /// The library type whose function this is.
    pub(super) of: Option<usize>,
    pub(super) scopes: Vec<Vec<Variable>>,
    /// Set by `break`, `continue` and `return`, taken by the loop or call that it is meant for.
    pub(super) flow: Option<Flow>,
    /// Conditions around the current statement that only the run decides.
    pub(super) undecided: usize,
    /// `undecided` at the start of each loop around the current statement.
    pub(super) loops: Vec<usize>,
}

impl Frame {
    pub(super) fn find(&self, name: &str) -> Option<&Value> {
        self.scopes.iter().rev().flat_map(|s| s.iter().rev()).find(|v| v.name == name).map(|v| &v.value)
    }
    pub(super) fn find_mut(&mut self, name: &str) -> Option<&mut Value> {
        self.scopes
            .iter_mut()
            .rev()
            .flat_map(|s| s.iter_mut().rev())
            .find(|v| v.name == name)
            .map(|v| &mut v.value)
    }
    /// Whether a variable is one of the function around a closure.
    pub(super) fn is_captured(&self, name: &str) -> bool {
        let own = self.scopes.iter().skip(self.captured).flatten().any(|v| v.name == name);
        self.captured > 0 && !own
    }
    pub(super) fn declare(&mut self, name: String, value: Value) {
        if self.scopes.is_empty() {
            self.scopes.push(Vec::new());
        }
        if let Some(scope) = self.scopes.last_mut() {
            scope.push(Variable { name, value });
        }
    }
    /// All names in scope, for did-you-mean.
    pub(super) fn names(&self) -> Vec<String> {
        self.scopes.iter().flatten().map(|v| v.name.clone()).collect()
    }
}
