//! What the engine's interpreter says of the models of a package.

use std::collections::BTreeMap;
use std::thread;

use random_models::interpret::{Refused, interpreted};

use crate::cases::Case;

/// By module.
pub type Interpretations = BTreeMap<String, Result<String, Refused>>;

/// Models that are interpreted side by side.
const THREADS: usize = 2;
/// A compiler's thread has 8 MiB, but less optimised code wants more.
const STACK: usize = 64 << 20;

/// Interprets these models.
#[must_use]
pub fn interpretations(cases: &[&Case]) -> Interpretations {
    let interpret = |k: usize| {
        cases.iter().skip(k).step_by(THREADS).map(|case| (case.module.clone(), one(case))).collect()
    };
    thread::scope(|scope| {
        let part = |k: usize| {
            let thread = thread::Builder::new().stack_size(STACK);
            thread.spawn_scoped(scope, move || -> Interpretations { interpret(k) })
        };
        let parts: Vec<_> = (0..THREADS).filter_map(|k| part(k).ok()).collect();
        parts.into_iter().filter_map(|part| part.join().ok()).flatten().collect()
    })
}

/// A panic is a finding of this model, not the end of all.
fn one(case: &Case) -> Result<String, Refused> {
    let result = std::panic::catch_unwind(|| interpreted(&case.module, &case.text));
    result.unwrap_or_else(|_| Err(Refused::Model("it panics".to_owned())))
}
