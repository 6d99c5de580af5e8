//! What friction comes to where steps collapse: rest on its jump, or a reaction without bounds.
//!
//! Friction by the sign of a velocity brings that to zero, and there its accelerations lead back from either
//! side: no step goes on from it (Filippov's sliding mode, which a switched constraint has instead). And near
//! to Painlevé's paradox the reaction of a contact that rubs grows as the inverse of what answers it (Génot &
//! Brogliato, Eur. J. Mech. A/Solids 18 (1999) 653–677). Both look like any other collapse to a method;
//! accelerations beside the state tell them.

use alloc::boxed::Box;

use crate::constrain::{TopContributors, solve_once};
use crate::error::SolveError;
use crate::model::{Constraints, ModelState, Vector};
use crate::simulate::failure::SimulationErrorKind as Kind;

/// First and last time that is looked ahead, in parts of 1 + |t|.
const AHEAD: (f64, f64) = (1e-12, 1e-2);
/// Up to where a jump is looked for: what is stiff and smooth turns round in longer times.
const JUMP_HORIZON: f64 = 1e-8;
/// Times by which what crossed the jump may take longer to come back.
const SLOWER: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];
/// Part of a jump that comes back when it is crossed again.
const BACK: f64 = 0.1;
/// Part of 1 + |q̈| from which on accelerations jump.
const JUMPS: f64 = 1e-3;

/// What a step that collapses has met, where friction says it.
pub(crate) fn explain<M: Constraints>(model: &M, state: &M::State, kind: &Kind) -> Option<Kind> {
    let constants = model.constants().ok()?;
    let cause = || Box::new(kind.copy());
    let accelerations =
        |state: &M::State| solve_once(model, &constants, state).map(|solved| solved.accelerations);
    let here = accelerations(state).ok()?;
    let size = 1.0 + state.t().abs();
    let mut by = AHEAD.0 * size;
    while by <= AHEAD.1 * size {
        let there = ahead(state, &here, by);
        match accelerations(&there) {
            Err(SolveError::Friction { row, .. }) => {
                return Some(Kind::FrictionGrows { row, ahead: by, cause: cause() });
            }
            Ok(beyond) if by <= JUMP_HORIZON * size => {
                // From the one side it may come back more slowly than from the other.
                let back = |times: &f64| accelerations(&ahead(&there, &beyond, times * by)).ok();
                let coordinates =
                    SLOWER.iter().filter_map(back).find_map(|back| alternate::<M>(&here, &beyond, &back));
                if let Some(coordinates) = coordinates {
                    return Some(Kind::RestsOnJump { coordinates, cause: cause() });
                }
            }
            _ => {}
        }
        by *= 2.0;
    }
    None
}

/// The state a little later.
fn ahead<S: ModelState>(state: &S, accelerations: &S::Vector, by: f64) -> S {
    let mut ahead = *state;
    for i in 0..S::Vector::LEN {
        ahead.q_mut()[i] += by * state.u()[i];
        ahead.u_mut()[i] += by * accelerations[i];
    }
    ahead
}

/// The coordinates whose accelerations jump between here and there, and jump back where they lead from there.
fn alternate<M: Constraints>(
    here: &M::Vector,
    there: &M::Vector,
    back: &M::Vector,
) -> Option<TopContributors> {
    let apart = |a: &M::Vector, b: &M::Vector, i: usize| (a[i] - b[i]).abs();
    let n = M::Vector::LEN;
    let most = |a: &M::Vector, b: &M::Vector| (0..n).map(|i| apart(a, b, i)).fold(0.0, f64::max);
    let size = 1.0 + here.as_slice().iter().fold(0.0, |most: f64, a| most.max(a.abs()));
    let jump = most(here, there);
    let alternates = jump > JUMPS * size && most(here, back) <= BACK * jump;
    alternates.then(|| TopContributors::ranked(M::COORDINATES, (0..n).map(|i| (i, apart(here, there, i)))))
}
