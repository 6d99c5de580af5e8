//! Accelerations of several states side by side beside those of each.

use dynamics::integrate::{Phase, Stages};
use dynamics::lanes::{Lanes, Task, in_four_lanes, in_widest_lanes};
use dynamics::model::{LaneEvaluation, ModelState, OwnValues};
use dynamics::prelude::*;

/// The accelerations of the states, as many at once as there are lanes, with the inputs and active set of the
/// first of them. `None` where the generated code does not apply to some of them. Of the last states as many
/// as do not fill the lanes are left out.
struct SideBySide<'a, M: Dynamics> {
    model: &'a M,
    states: &'a [M::State],
}

impl<M: Dynamics> Task for SideBySide<'_, M> {
    type Output = Vec<Option<Vec<M::Vector>>>;

    fn run<L: Lanes>(self) -> Self::Output {
        let constants = self.model.constants().expect("regular");
        let beside = |states: &[M::State]| {
            let mut stages = Stages::<M::Vector, L>::zeros();
            let mut t = L::zero();
            for (lane, state) in states.iter().enumerate() {
                stages.put(lane, &Phase { q: *state.q(), u: *state.u() });
                t = t.with_lane(lane, state.t());
            }
            let mut own = vec![0.0; M::LANE_VALUES];
            self.model.lane_values(&constants, &states[0], &mut own);
            let own: Vec<L> = own.into_iter().map(L::splat).collect();
            let mut found = Stages::<M::Vector, L>::zeros();
            let applies = L::call(LaneEvaluation {
                model: self.model,
                constants: &constants,
                state: &states[0],
                values: OwnValues(&own),
                t,
                states: [&stages.q, &stages.u],
                accelerations: &mut found.u,
            });
            applies.then(|| (0..L::COUNT).map(|lane| found.of(lane).u).collect())
        };
        self.states.chunks_exact(L::COUNT).map(beside).collect()
    }
}

/// What generated code gives for four states; `None` where it does not apply.
pub(crate) fn side_by_side<M: Dynamics>(model: &M, states: [M::State; 4]) -> Option<Vec<M::Vector>> {
    in_four_lanes(SideBySide { model, states: &states }).remove(0)
}

/// That they are there, and have the bits that each state has by itself, with every number of lanes.
pub(crate) fn have_the_same_bits<M: Dynamics>(model: &M, states: impl IntoIterator<Item = M::State>) {
    assert!(M::HAS_LANES, "{}", M::NAME);
    let states: Vec<M::State> = states.into_iter().collect();
    assert!(states.len() >= 8, "as many as fill the widest lanes");
    let four = in_four_lanes(SideBySide { model, states: &states });
    let most = in_widest_lanes(SideBySide { model, states: &states });
    for found in [four, most] {
        let found = found.into_iter().flat_map(|found| found.unwrap_or_else(|| panic!("{}", M::NAME)));
        for (state, found) in states.iter().zip(found) {
            let alone = model.accelerations(state).expect("regular");
            for i in 0..M::COORDINATES.len() {
                assert_eq!(
                    found[i].to_bits(),
                    alone[i].to_bits(),
                    "{}, {i}: {} {} at {state:?}",
                    M::NAME,
                    found[i],
                    alone[i]
                );
            }
        }
    }
}
