//! `#[drawing]` as expressions, for pages that move by themselves, and the points that have names.
//!
//! A drawing may be any Rust: it runs on time jets. Here it is followed as far as it is written in the
//! language of models, extended by the methods of `Drawing`, colours, texts, closures, and iterators over
//! arrays. Whatever else it contains is no mistake. It is noted with its line, and the page draws the points
//! instead.
//!
//! This comes last, on a copy of the graph and with a collector of errors that is thrown away: a picture
//! changes no error, no unit and no equation of its model.

mod closures;
mod figures;
mod not_followed;
mod parsed;
mod points;
mod sequences;
mod smooth;
mod words;

use std::collections::BTreeMap;
use std::mem;
use std::rc::Rc;

use dynamics_symbolic::graph::{NodeId, Symbol};
use dynamics_symbolic::mechanics::{Extra, Figures, NotFollowed, Picture};
use quote::ToTokens;
use syn::Expr;

use super::Elaborator;
use super::values::{Scalar, Value};
use crate::diagnostics::Diagnostics;
use crate::syntax::{Function, Role, conditions};
use closures::Closure;
pub(super) use parsed::Parsed;

/// A picture that is being followed.
#[derive(Default)]
pub(super) struct DrawingState<'a> {
    /// Every closure that was made so far.
    closures: Vec<Closure<'a>>,
    /// What is in the macros that were met so far, by where these are in memory.
    macros: BTreeMap<*const syn::Macro, Rc<[&'a Expr]>>,
    /// Numbers beside the parameters.
    extras: Vec<Extra>,
    /// The first expression that is not followed.
    stopped: Option<NotFollowed>,
}

impl<'a> Elaborator<'a> {
    /// Whether the words of drawings are known here.
    pub(super) fn draws(&self) -> bool {
        self.picture.is_some()
    }

    /// Whether the model shows anything of itself: a drawing, or what may be a place.
    pub(super) fn has_picture(&self) -> bool {
        let shown = |f: &Function| f.role == Role::Drawing || f.role == Role::Helper && f.may_be_place();
        self.implementation.functions.iter().any(shown) || self.has_places_by_name()
    }

    /// The picture of the model, in a graph of its own. To be asked once, when everything else is done.
    pub(super) fn picture(&mut self) -> Picture {
        // The role that may read most: coordinates, inputs, accelerations and reactions.
        self.role = Role::Output;
        self.picture = Some(DrawingState::default());
        let points = self.named_points();
        let functions = &self.implementation.functions;
        let figures = match functions.iter().position(|f| f.role == Role::Drawing) {
            Some(index) => self.figures_of(index),
            None => Figures::None,
        };
        let extras = self.picture.take().map(|followed| followed.extras).unwrap_or_default();
        let first_extra = self.model.parameters.len() as u32;
        Picture { graph: mem::take(&mut self.model.graph), figures, points, extras, first_extra }
    }

    fn figures_of(&mut self, index: usize) -> Figures {
        // Lengths in pictures are numbers as one likes them: a force of 30 N may be an arrow of 3 m.
        self.dimensions.active = false;
        let body = &self.implementation.functions[index].item.block;
        if let Some((_, condition)) = conditions(body.to_token_stream()).into_iter().next() {
            // Whether it holds only rustc knows.
            return Figures::NotFollowed(not_followed::of_tokens(condition));
        }
        match self.followed_result(index) {
            Ok(Value::Drawing(canvas)) => Figures::Of(canvas.shapes.clone()),
            Ok(_) => Figures::NotFollowed(not_followed::of_function(&self.implementation.functions[index])),
            Err(reason) => Figures::NotFollowed(reason),
        }
    }

    /// What a function `(&self, q)` returns, or the expression that is not followed.
    fn followed_result(&mut self, index: usize) -> Result<Value, NotFollowed> {
        let function = &self.implementation.functions[index];
        let known = mem::replace(self.diagnostics, Diagnostics::new());
        (self.steps, self.depth, self.exhausted) = (0, 0, false);
        self.frames.clear();
        let value = self.run(index, function);
        let stopped = self.picture.as_mut().and_then(|followed| followed.stopped.take());
        let unread = mem::replace(self.diagnostics, known);
        let failed = unread.raised() > 0 || self.exhausted || value.has_poison();
        // What is not followed is no mistake.
        let _ = unread.finish();
        match stopped {
            Some(reason) => Err(reason),
            None if failed => Err(not_followed::of_function(function)),
            None => Ok(value),
        }
    }

    /// A number that only pictures read.
    fn extra(&mut self, extra: Extra) -> NodeId {
        let first = self.model.parameters.len();
        let extras = &mut self.picture.get_or_insert_default().extras;
        let at = extras.iter().position(|known| *known == extra).unwrap_or_else(|| {
            extras.push(extra);
            extras.len() - 1
        });
        self.model.graph.symbol(Symbol::Parameter((first + at) as u32))
    }

    /// The same as a value, of any unit.
    fn extra_scalar(&mut self, extra: Extra) -> Scalar {
        Scalar { node: self.extra(extra), unit: None }
    }
}
