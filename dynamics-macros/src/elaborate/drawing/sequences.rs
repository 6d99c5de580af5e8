//! Iterators of drawings: methods with closures, and what chains arrays and ranges.

use std::rc::Rc;

use syn::Ident;

use super::super::Elaborator;
use super::super::calls::Argument;
use super::super::values::{Condition, Value};
use crate::messages;

impl<'a> Elaborator<'a> {
    /// Methods of arrays and iterators that models do not have; `None` for those that they have.
    pub(super) fn drawn_sequence(
        &mut self,
        items: &Rc<Vec<Value>>,
        is_array: bool,
        name: &Ident,
        arguments: &[Argument],
    ) -> Option<Value> {
        let made = match (name.to_string().as_str(), arguments) {
            ("to_vec" | "as_slice" | "value", []) => return Some(Value::Array(items.clone())),
            ("peekable" | "fuse", []) => return Some(Value::Sequence(items.clone())),
            ("map", [closure]) => {
                let made = items.iter().map(|item| self.call_argument(closure, vec![item.clone()]));
                let made: Vec<Value> = made.collect();
                if made.iter().any(Value::is_poison) {
                    return Some(Value::Poison);
                }
                if is_array {
                    return Some(self.bounded(Value::array(made), name.span()));
                }
                made
            }
            ("fold", [start, closure]) => {
                let mut sum = start.0.clone();
                for item in items.iter() {
                    sum = self.call_argument(closure, vec![sum, item.clone()]);
                    self.steps += 1;
                    if self.exhausted {
                        break;
                    }
                }
                return Some(sum);
            }
            ("filter", [closure]) => {
                let mut kept = Vec::new();
                for item in items.iter() {
                    match self.call_argument(closure, vec![item.clone()]) {
                        Value::Condition(Condition::Known(true)) => kept.push(item.clone()),
                        Value::Condition(Condition::Known(false)) => {}
                        Value::Poison => return Some(Value::Poison),
                        other => {
                            let message = messages::expected_shape("a known condition", other.shape());
                            return Some(self.fail(name.span(), &message));
                        }
                    }
                }
                kept
            }
            ("flat_map", [closure]) => {
                let mut all = Vec::new();
                for item in items.iter() {
                    match self.call_argument(closure, vec![item.clone()]) {
                        Value::Array(inner) | Value::Sequence(inner) => all.extend(inner.iter().cloned()),
                        Value::Poison => return Some(Value::Poison),
                        other => {
                            let message = messages::not_iterable(other.shape());
                            return Some(self.fail(name.span(), &message));
                        }
                    }
                    self.steps += all.len();
                    if self.exhausted {
                        break;
                    }
                }
                all
            }
            ("flatten" | "concat", []) => {
                let mut all = Vec::new();
                for item in items.iter() {
                    let (Value::Array(inner) | Value::Sequence(inner)) = item else { return None };
                    all.extend(inner.iter().cloned());
                }
                if is_array {
                    return Some(self.bounded(Value::array(all), name.span()));
                }
                all
            }
            ("chain", [(Value::Array(other) | Value::Sequence(other), _)]) => {
                items.iter().chain(other.iter()).cloned().collect()
            }
            ("first", []) => return items.first().cloned(),
            ("last", []) => return items.last().cloned(),
            ("windows", [(Value::Integer(n), _)]) if n.value > 0 => {
                let n = usize::try_from(n.value).unwrap_or(usize::MAX);
                items.windows(n).map(|window| Value::array(window.to_vec())).collect()
            }
            _ => return None,
        };
        Some(self.bounded(Value::Sequence(Rc::new(made)), name.span()))
    }
}
