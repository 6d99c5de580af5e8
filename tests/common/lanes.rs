//! Accelerations of four states side by side beside those of each.

use dynamics::integrate::{Phase, Stages};
use dynamics::lanes::{COUNT, Lanes};
use dynamics::model::{ModelState, WideOf};
use dynamics::prelude::*;

/// What generated code gives for four states, with the inputs and modes of the first; `None` where it does
/// not apply.
pub(crate) fn side_by_side<M: Dynamics>(model: &M, states: [M::State; COUNT]) -> Option<[M::Vector; COUNT]> {
    let constants = model.constants().expect("regular");
    let mut stages = Stages::<M::Vector>::zeros();
    for (lane, state) in states.iter().enumerate() {
        stages.put(lane, &Phase { q: *state.q(), u: *state.u() });
    }
    let mut found = Stages::<M::Vector>::zeros();
    let t = Lanes::new(states.map(|state| state.t()));
    let accelerations: &mut WideOf<M> = &mut found.u;
    let applies =
        model.accelerations_in_lanes(&constants, &states[0], t, [&stages.q, &stages.u], accelerations);
    applies.then(|| core::array::from_fn(|lane| found.of(lane).u))
}

/// That they are there, and have the bits that each state has by itself. Of the last states as many as make
/// no four are left out.
pub(crate) fn have_the_same_bits<M: Dynamics>(model: &M, states: impl IntoIterator<Item = M::State>) {
    assert!(M::HAS_LANES, "{}", M::NAME);
    let states: Vec<M::State> = states.into_iter().collect();
    assert!(states.len() >= COUNT);
    for four in states.chunks_exact(COUNT) {
        let four: [M::State; COUNT] = core::array::from_fn(|i| four[i]);
        let found = side_by_side(model, four).unwrap_or_else(|| panic!("{}: {four:?}", M::NAME));
        for (state, found) in four.iter().zip(found) {
            let alone = model.accelerations(state).expect("regular");
            for i in 0..M::COORDINATES.len() {
                assert_eq!(
                    found[i].to_bits(),
                    alone[i].to_bits(),
                    "{}, {i}: {} {}",
                    M::NAME,
                    found[i],
                    alone[i]
                );
            }
        }
    }
}
