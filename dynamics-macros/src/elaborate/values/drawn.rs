//! Values of drawings: the figures so far with their pen, and what a condition chooses among colours, texts
//! and pens. Such a choice has no expression: every case becomes a figure of its own, which is shown where
//! its condition holds.

use dynamics_symbolic::mechanics::{Pen, Shape};

use super::Condition;

/// Most cases of one pen or text. More are no picture that somebody wrote.
const MOST_CASES: usize = 16;

/// A drawing: its figures so far, and its pen.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Canvas {
    pub(in super::super) shapes: Vec<Shape>,
    pub(in super::super) pen: Choice<Pen>,
}

impl Default for Canvas {
    fn default() -> Self {
        Self { shapes: Vec::new(), pen: Choice::Is(Pen::default()) }
    }
}

/// A value, or several of which a condition chooses one.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) enum Choice<T> {
    /// The value.
    Is(T),
    /// One of two.
    If(Condition, Box<Self>, Box<Self>),
}

impl<T: Clone + PartialEq> Choice<T> {
    /// `if condition { then } else { otherwise }`; `None` where there are too many cases.
    pub(in super::super) fn between(condition: &Condition, then: &Self, otherwise: &Self) -> Option<Self> {
        if then == otherwise {
            return Some(then.clone());
        }
        let made = Self::If(condition.clone(), Box::new(then.clone()), Box::new(otherwise.clone()));
        (made.cases().len() <= MOST_CASES).then_some(made)
    }

    /// All values, each with the condition under which it is chosen.
    pub(in super::super) fn cases(&self) -> Vec<(Condition, &T)> {
        match self {
            Self::Is(value) => vec![(Condition::Known(true), value)],
            Self::If(condition, then, otherwise) => {
                let mut all = Vec::new();
                for (holds, side) in [(condition.clone(), then), (condition.clone().not(), otherwise)] {
                    let cases = side.cases().into_iter();
                    all.extend(cases.map(|(inner, value)| (holds.clone().and(inner), value)));
                }
                all
            }
        }
    }

    /// Every value changed, by every case of `by`; `None` where there are too many cases.
    pub(in super::super) fn changed<U: Clone + PartialEq>(
        &self,
        by: &Choice<U>,
        change: &impl Fn(&mut T, &U),
    ) -> Option<Self> {
        match by {
            Choice::Is(by) => Some(self.each(&|value| change(value, by))),
            Choice::If(condition, then, otherwise) => {
                let (then, otherwise) = (self.changed(then, change)?, self.changed(otherwise, change)?);
                Self::between(condition, &then, &otherwise)
            }
        }
    }

    fn each(&self, change: &impl Fn(&mut T)) -> Self {
        match self {
            Self::Is(value) => {
                let mut value = value.clone();
                change(&mut value);
                Self::Is(value)
            }
            Self::If(condition, then, otherwise) => {
                Self::If(condition.clone(), Box::new(then.each(change)), Box::new(otherwise.each(change)))
            }
        }
    }
}
