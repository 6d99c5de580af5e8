//! Constraints that switch: impacts, contacts that close and lift off, sticking and slipping, latches, each
//! against closed forms.

use crate::common;
mod planks;

use common::constrained::{Held, PainleveRod, constraint, held};
use common::*;
use dynamics_runtime::constrain;
use dynamics_runtime::error::{SingularMassMatrix, SolveError};
use dynamics_runtime::model::{
    Constraint, ConstraintKind, Constraints, Dynamics, Events, Model, ModelState, Outputs, Powers, Quantity,
    Solved, SolverKind, Terms,
};
use dynamics_runtime::simulate::{
    Contact, Direction, EventAction, EventActionError, Flow, Formulation, Motion, OptionError, Simulate,
    SimulationErrorKind,
};
use nalgebra::{SMatrix, SVector};

const fn switched(name: &'static str, kind: ConstraintKind, row: usize, index: usize) -> Constraint {
    Constraint { switched: Some(index), ..constraint(name, kind, row, 1) }
}

/// A ball over a floor: Φ = y ≥ 0.
struct Ball {
    m: f64,
    g: f64,
}

impl Held<2, 1, 1> for Ball {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity() * self.m
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([0.0, -self.m * self.g])
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        self.m * (0.5 * s.u.norm_squared() + self.g * s.q[1])
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::from([s.q[1]])
    }
    fn phi_q(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 1, 2> {
        SMatrix::<f64, 1, 2>::new(0.0, 1.0)
    }
    fn right(&self, _: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::zeros()
    }
}
held!(Ball, 2 coordinates ["x", "y"], 1 + 0 = 1 rows ["floor"],
    [switched("floor", ConstraintKind::Holonomic, 0, 0)], friction false, events []);

fn released<const N: usize>(
    mut state: PlainState<N, 0>,
    switches: impl IntoIterator<Item = usize>,
) -> PlainState<N, 0> {
    switches.into_iter().for_each(|index| state.active_set_mut().release(index, 1.0));
    state
}

/// Impacts at t₁ = √(2h/g) and then after flights of 2 eⁿ v₁/g, until the speed is a thousandth of v₁; then
/// it lies.
#[test]
fn a_ball_bounces_and_comes_to_rest() {
    let ball = Ball { m: 0.5, g: 9.81 };
    let (h, e) = (2.0, 0.7);
    let start = released(at_rest_or_not([0.0, h], [1.0, 0.0]), [0]);
    let motion = ball.simulate(start).until(6.0).tolerance(1e-10).contact("floor", e).run().unwrap();
    let (first, speed) = ((2.0 * h / ball.g).sqrt(), (2.0 * ball.g * h).sqrt());
    // eⁿ ≤ 1e-3 first for n = 20: impacts 0 to 19 rebound, the one after closes.
    assert_eq!(motion.events().len(), 21);
    let mut expected = first;
    for (n, event) in motion.events().iter().enumerate() {
        assert!((event.time() - expected).abs() < 1e-9, "impact {n}: {} {expected}", event.time());
        let hit = &event.impacts[0];
        let approach = speed * e.powi(n as i32);
        let restitution = if n < 20 { e } else { 0.0 };
        assert_eq!((event.name.as_str(), hit.constraint), ("floor contact", "floor"));
        assert!((hit.approach[0] + approach).abs() < 1e-8);
        assert!((hit.impulse[0] - ball.m * (1.0 + restitution) * approach).abs() < 1e-8);
        assert!(
            (hit.energy_lost - 0.5 * ball.m * approach * approach * (1.0 - restitution * restitution)).abs()
                < 1e-8
        );
        expected += 2.0 * e.powi(n as i32 + 1) * speed / ball.g;
    }
    let end = motion.end();
    assert!(end.active_set.all_hold() && end.q[1].abs() < 1e-15 && end.u[1].abs() < 1e-15);
    assert!((end.q[0] - 6.0).abs() < 1e-9, "it goes on sliding");
    assert!((motion.reaction_at("floor", 5.9).unwrap()[0] - ball.m * ball.g).abs() < 1e-12);
    assert_eq!(motion.reaction_at("floor", 0.5).unwrap(), [0.0], "in flight");
    let account = motion.work();
    assert!(account.resets.len() == 1 && account.resets[0].name == "floor contact", "{account}");
    assert!((account.resets[0].work + ball.m * ball.g * h).abs() < 1e-9, "{account}");
    let summary = motion.verify();
    assert_eq!(summary.impacts, 21);
    assert!((summary.energy_lost - ball.m * ball.g * h).abs() < 1e-9, "{summary}");
    assert!(summary.energy_drift < 1e-8, "{summary}");
    assert!(summary.to_string().contains("impacts      21, "), "{summary}");
    let slowest = speed * e.powi(20);
    assert!(
        summary.stabilization.rests == 1 && (summary.stabilization.fastest_rest - slowest).abs() < 1e-8,
        "{summary}"
    );
    assert!(
        summary.to_string().contains(&format!("too slow to rebound at {slowest:.1e} or less")),
        "{summary}"
    );
    // Asked for, it is no news.
    let contact = Contact { restitution: e, rest_speed: Some(0.01) };
    let motion = ball.simulate(start).until(6.0).contact("floor", contact).run().unwrap();
    assert!(motion.end().active_set.all_hold() && !motion.verify().to_string().contains("too slow"));
}

#[test]
fn without_rest_speed_a_bouncing_ball_is_an_error_that_says_where_it_ends() {
    let ball = Ball { m: 1.0, g: 9.81 };
    let contact = Contact { restitution: 0.5, rest_speed: Some(0.0) };
    let start = released(at_rest_or_not([0.0, 1.0], [0.0, 0.0]), [0]);
    let error = ball.simulate(start).until(6.0).contact("floor", contact).run().unwrap_err();
    let first = (2.0 / ball.g).sqrt();
    match &error.kind {
        SimulationErrorKind::EventsAccumulate { event, at, squeezed: false } => {
            assert_eq!(event, "floor contact");
            assert!((at - 3.0 * first).abs() < 1e-4, "{at}");
        }
        other => panic!("{other:?}"),
    }
    let text = error.to_string();
    assert!(
        text.contains("give `.contact(\"floor\", ..)` a larger `rest_speed`") && !text.contains("Flow::Stop"),
        "{text}"
    );
    assert!(error.motion(&ball).unwrap().events().len() > 10);
}

/// A bead on a dome of radius R, and the ground below: Φ = (r² − R²)/2 ≥ 0, Φ = y ≥ 0.
struct Dome {
    r: f64,
    g: f64,
}

impl Held<2, 2, 2> for Dome {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::identity()
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([0.0, -self.g])
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        0.5 * s.u.norm_squared() + self.g * s.q[1]
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([0.5 * (s.q.norm_squared() - self.r * self.r), s.q[1]])
    }
    fn phi_q(&self, s: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::<f64, 2, 2>::new(s.q[0], s.q[1], 0.0, 1.0)
    }
    fn right(&self, s: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::from([-s.u.norm_squared(), 0.0])
    }
}
held!(Dome, 2 coordinates ["x", "y"], 2 + 0 = 2 rows ["dome", "ground"],
    [switched("dome", ConstraintKind::Holonomic, 0, 0), switched("ground", ConstraintKind::Holonomic, 1, 1)],
    friction false, events []);

/// From the top with speed v: it lifts off where g cos θ = (v² + 2 g R (1 − cos θ))/R, that is cos θ = 2/3 +
/// v²/(3 g R), flies, and stays on the ground.
#[test]
fn a_bead_lifts_off_its_dome_and_lands() {
    let dome = Dome { r: 2.0, g: 9.81 };
    let speed = 1.0;
    for formulation in [Formulation::Projected, Formulation::Embedded, Formulation::BaumgarteTied] {
        let start = released(at_rest_or_not([0.0, dome.r], [speed, 0.0]), [1]);
        let run = dome.simulate(start).until(3.0).tolerance(1e-11).formulation(formulation);
        let motion = run.contact("dome", 0.0).contact("ground", 0.0).run().unwrap();
        let names: Vec<&str> = motion.events().iter().map(|event| event.name.as_str()).collect();
        assert_eq!(names, ["dome contact", "ground contact"], "{formulation}");
        let off = motion.events()[0].before;
        let cos = 2.0 / 3.0 + speed * speed / (3.0 * dome.g * dome.r);
        assert!((off.q[1] / dome.r - cos).abs() < 1e-8, "{formulation}: {} {cos}", off.q[1] / dome.r);
        assert!(motion.events()[0].impacts.is_empty(), "lifting off is no impact");
        // The flight is a parabola.
        let down = &motion.events()[1];
        let fall = down.time() - motion.events()[0].time();
        assert!((off.q[1] + off.u[1] * fall - 0.5 * dome.g * fall * fall).abs() < 1e-8, "{formulation}");
        let end = motion.end();
        assert!(end.q[1].abs() < 1e-12 && (end.u[0] - off.u[0]).abs() < 1e-9 && !end.active_set.all_hold());
        assert!((motion.reaction_at("ground", 2.9).unwrap()[0] - dome.g).abs() < 1e-9);
        let lost = 0.5 * (off.u[1] - dome.g * fall).powi(2);
        assert!((down.energy_lost() - lost).abs() < 1e-7, "{} {lost}", down.energy_lost());
    }
}

/// A contact that would have to pull lets go at once, at the start as later.
#[test]
fn a_contact_never_pulls() {
    let dome = Dome { r: 2.0, g: 9.81 };
    // Faster than √(g R): it flies off the top.
    let start = released(at_rest_or_not([0.0, dome.r], [6.0, 0.0]), [1]);
    let motion = dome.simulate(start).until(0.5).contact("dome", 0.0).run().unwrap();
    assert_eq!((motion.events().len(), motion.events()[0].time()), (1, 0.0));
    let end = motion.end();
    assert!((end.q[0] - 3.0).abs() < 1e-9 && (end.q[1] - (2.0 - 0.125 * dome.g)).abs() < 1e-9, "{end:?}");
    assert!((0..50).all(|k| motion.reaction_at("dome", 0.01 * f64::from(k) + 0.001).unwrap()[0] >= 0.0));
}

/// A block on a belt of speed v, held by a spring; dry friction, μₛ at rest and μₖ in motion.
struct Block {
    m: f64,
    k: f64,
    v: f64,
    n: f64,
    resting: f64,
    sliding: f64,
}

impl Held<1, 0, 1> for Block {
    fn mass(&self, _: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::<f64, 1, 1>::new(self.m)
    }
    fn force(&self, s: &PlainState<1, 0>) -> SVector<f64, 1> {
        SVector::from([-self.k * s.q[0] - self.sliding * self.n * s.active_set.side(0)])
    }
    fn energy(&self, s: &PlainState<1, 0>) -> f64 {
        0.5 * (self.m * s.u[0] * s.u[0] + self.k * s.q[0] * s.q[0])
    }
    fn phi(&self, _: &PlainState<1, 0>) -> SVector<f64, 0> {
        SVector::zeros()
    }
    fn phi_q(&self, _: &PlainState<1, 0>) -> SMatrix<f64, 1, 1> {
        SMatrix::<f64, 1, 1>::new(1.0)
    }
    fn phi_t(&self, _: &PlainState<1, 0>) -> SVector<f64, 1> {
        SVector::from([-self.v])
    }
    fn right(&self, _: &PlainState<1, 0>) -> SVector<f64, 1> {
        SVector::zeros()
    }
    fn event_values(&self, s: &PlainState<1, 0>, values: &mut [f64]) {
        let lambda = constrain::solve_once(self, &(), s).map_or(f64::NAN, |solved| solved.multipliers[0]);
        values[0] = self.resting * self.n - lambda.abs();
    }
}
held!(Block, 1 coordinates ["x"], 0 + 1 = 1 rows ["stick"],
    [switched("stick", ConstraintKind::Nonholonomic, 0, 0)], friction false, events ["breakaway"]);

/// It sticks until k x = μₛ N, slips around μₖ N/k and sticks again when its speed is the belt's: at 2 μₖ N/k
/// − μₛ N/k, after (2π − 2 atan((μₛ − μₖ) N ω/(k v)))/ω.
#[test]
fn a_block_on_a_belt_sticks_and_slips() {
    let block = Block { m: 2.0, k: 50.0, v: 0.3, n: 20.0, resting: 0.6, sliding: 0.4 };
    let (far, centre) = (block.resting * block.n / block.k, block.sliding * block.n / block.k);
    let omega = (block.k / block.m).sqrt();
    let slip = (std::f64::consts::TAU - 2.0 * ((far - centre) * omega / block.v).atan()) / omega;
    let stick = 2.0 * (far - centre) / block.v;
    let run = block.simulate(at_rest_or_not([0.0], [block.v])).until(6.0).tolerance(1e-11);
    let motion = run.stick_slip("stick", "breakaway").run().unwrap();
    let switches: Vec<_> = motion.events().iter().filter(|event| event.name == "stick slip").collect();
    let mut expected = far / block.v;
    assert!(switches.len() > 6);
    // It sticks where its slip is zero: nothing jumps, and nothing is lost.
    let summary = motion.verify();
    assert_eq!((summary.impacts, summary.energy_lost), (0, 0.0), "{summary}");
    assert!(motion.events().iter().all(|event| event.impacts.is_empty()));
    assert!(motion.work().resets.is_empty(), "{}", motion.work());
    for (k, event) in switches.iter().enumerate() {
        let slips = k % 2 == 0;
        let place = if slips { far } else { 2.0 * centre - far };
        assert!((event.time() - expected).abs() < 1e-8, "{k}: {} {expected}", event.time());
        assert!(
            (event.before.q[0] - place).abs() < 1e-9 && (event.before.u[0] - block.v).abs() < 1e-9,
            "{k}: {event:?}"
        );
        assert_eq!(event.after.active_set.side(0), if slips { -1.0 } else { 0.0 });
        expected += if slips { slip } else { stick };
    }
    assert!((motion.reaction_at("stick", 0.2).unwrap()[0] - block.k * 0.2 * block.v).abs() < 1e-9);
}

/// A state that slips backwards is released to that side by its guard, whatever side was given: a = +μN/m
/// until it sticks.
#[test]
fn what_slips_backwards_is_braked() {
    let block = Block { m: 2.0, k: 0.0, v: 0.0, n: 20.0, resting: 0.6, sliding: 0.4 };
    let start = released(at_rest_or_not([0.0], [-1.0]), [0]);
    let motion = block.simulate(start).until(1.0).stick_slip("stick", "breakaway").run().unwrap();
    let braking = block.sliding * block.n / block.m;
    let event = &motion.events()[0];
    assert_eq!((motion.events().len(), event.before.active_set.side(0)), (1, -1.0));
    assert!((event.time() - 1.0 / braking).abs() < 1e-9, "{}", event.time());
    assert!(motion.end().active_set.all_hold() && (motion.end().q[0] + 0.5 / braking).abs() < 1e-9);
}

/// A reset that turns a slipping block round turns the friction with it.
#[test]
fn a_block_that_rebounds_while_it_slips_is_braked_on_the_way_back() {
    let block = Block { m: 2.0, k: 0.0, v: 0.0, n: 20.0, resting: 0.6, sliding: 0.4 };
    let braking = block.sliding * block.n / block.m;
    for formulation in [Formulation::Projected, Formulation::Augmented, Formulation::Embedded] {
        let start = released(at_rest_or_not([0.0], [4.0]), [0]);
        let run = block.simulate(start).until(2.0).formulation(formulation).event("wall", |s| s.q[0] - 1.0);
        let run =
            run.on_event("wall", Direction::Rising, |s| s.u[0] *= -0.5).stick_slip("stick", "breakaway");
        let motion = run.run().unwrap();
        let names: Vec<&str> = motion.events().iter().map(|event| event.name.as_str()).collect();
        assert_eq!(names, ["wall", "stick slip"], "{formulation}");
        let [wall, stick] = [0, 1].map(|i| &motion.events()[i]);
        assert_eq!((wall.before.active_set.side(0), wall.after.active_set.side(0)), (1.0, -1.0));
        let back = 0.5 * (16.0 - 2.0 * braking).sqrt();
        assert!((stick.time() - wall.time() - back / braking).abs() < 1e-8, "{formulation}");
        assert!((motion.end().q[0] - (1.0 - 0.5 * back * back / braking)).abs() < 1e-8, "{formulation}");
    }
}

/// A belt that breaks away at less than the sliding friction neither sticks nor slips: an error, not a
/// chatter without end.
#[test]
fn friction_that_is_lower_at_rest_than_in_motion_is_an_error() {
    let block = Block { m: 2.0, k: 50.0, v: 0.3, n: 20.0, resting: 0.3, sliding: 0.5 };
    let run = block.simulate(at_rest_or_not([0.0], [block.v])).until(6.0);
    let error = run.stick_slip("stick", "breakaway").run().unwrap_err();
    match &error.kind {
        SimulationErrorKind::EventRepeats { event } | SimulationErrorKind::EventsAccumulate { event, .. } => {
            assert_eq!(event, "stick slip");
        }
        other => panic!("{other:?}"),
    }
    assert!((error.time - block.resting * block.n / block.k / block.v).abs() < 1e-6, "{}", error.time);
    let text = error.to_string();
    assert!(
        text.contains("break away at no less than the friction") && !text.contains("Flow::Stop"),
        "{text}"
    );
}

/// A reset must leave a state on the constraints, also where these may drift: what drift there was before is
/// no excuse.
#[test]
fn a_reset_that_leaves_the_constraints_is_refused_in_every_formulation() {
    let dome = Dome { r: 2.0, g: 9.81 };
    let formulations =
        [Formulation::Projected, Formulation::Embedded, Formulation::Augmented, Formulation::BaumgarteTied];
    for formulation in formulations {
        let run = |action: fn(&mut EventAction<'_, Dome>)| {
            let start = released(at_rest_or_not([0.0, dome.r], [0.5, 0.0]), [1]);
            let run =
                dome.simulate(start).until(0.4).formulation(formulation).event("mark", |s| s.q[0] - 0.1);
            run.on_event_with("mark", Direction::Rising, action).run()
        };
        // Along the dome, as fast again.
        assert!(run(|change| change.state_mut().u *= 2.0).is_ok(), "{formulation}");
        let faster: fn(&mut EventAction<'_, Dome>) = |change| change.state_mut().u[1] += 1.6;
        let higher: fn(&mut EventAction<'_, Dome>) = |change| change.state_mut().q[1] += 0.1;
        for action in [faster, higher] {
            match run(action).unwrap_err().kind {
                SimulationErrorKind::EventAction { event, error } => {
                    assert!(
                        event == "mark" && matches!(*error, EventActionError::State(_)),
                        "{formulation}: {error}"
                    );
                }
                other => panic!("{formulation}: {other:?}"),
            }
        }
    }
}

/// Two carts that couple when they meet: Φ = x₂ − x₁.
struct Carts {
    m: [f64; 2],
}

impl Held<2, 1, 1> for Carts {
    fn mass(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 2, 2> {
        SMatrix::from_diagonal(&SVector::from(self.m))
    }
    fn force(&self, _: &PlainState<2, 0>) -> SVector<f64, 2> {
        SVector::zeros()
    }
    fn energy(&self, s: &PlainState<2, 0>) -> f64 {
        0.5 * s.u.dot(&(self.mass(s) * s.u))
    }
    fn phi(&self, s: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::from([s.q[1] - s.q[0]])
    }
    fn phi_q(&self, _: &PlainState<2, 0>) -> SMatrix<f64, 1, 2> {
        SMatrix::<f64, 1, 2>::new(-1.0, 1.0)
    }
    fn right(&self, _: &PlainState<2, 0>) -> SVector<f64, 1> {
        SVector::zeros()
    }
}
held!(Carts, 2 coordinates ["front", "back"], 1 + 0 = 1 rows ["coupling"],
    [switched("coupling", ConstraintKind::Holonomic, 0, 0)], friction false, events []);

fn meet<'m>(
    carts: &'m Carts,
    action: impl FnMut(&mut EventAction<'_, Carts>) + 'm,
) -> Result<Motion<'m, Carts>, SimulationErrorKind> {
    let start = released(at_rest_or_not([0.0, 3.0], [2.0, -1.0]), [0]);
    let run = carts.simulate(start).until(4.0).event("meet", |s| s.q[1] - s.q[0]);
    run.on_event_with("meet", Direction::Falling, action).run().map_err(|error| error.kind)
}

#[test]
fn carts_couple_where_they_meet_and_are_released_again() {
    let carts = Carts { m: [1.0, 3.0] };
    let motion = meet(&carts, |change| {
        assert_eq!(change.holds("coupling"), Ok(false));
        change.engage("coupling");
        assert_eq!((change.holds("coupling"), change.impacts().len()), (Ok(true), 1));
        // To ask for what there is not ends nothing.
        assert!(matches!(change.holds("couplin"), Err(EventActionError::UnknownConstraint { .. })));
    })
    .unwrap();
    let event = &motion.events()[0];
    // ½ m₁m₂/(m₁+m₂) v², v = 3.
    assert!((event.time() - 1.0).abs() < 1e-12 && (event.energy_lost() - 0.5 * 0.75 * 9.0).abs() < 1e-12);
    let end = motion.end();
    assert!(
        (end.u[0] + 0.25).abs() < 1e-14
            && (end.q[0] - 1.25).abs() < 1e-9
            && (end.q[0] - end.q[1]).abs() < 1e-15
    );

    let released = meet(&carts, |change| {
        change.engage("coupling");
        change.release("coupling");
    })
    .unwrap();
    assert_eq!(released.end().active_set.side(0), 1.0);
    let elastic = meet(&carts, |change| change.impact("coupling", 1.0)).unwrap();
    let end = elastic.end();
    assert!(
        (end.u[0] + 2.5).abs() < 1e-12
            && (end.u[1] - 0.5).abs() < 1e-12
            && elastic.events()[0].energy_lost().abs() < 1e-12
    );
}

#[test]
fn changes_that_cannot_be_made_end_the_run_and_say_why() {
    let carts = Carts { m: [1.0, 3.0] };
    let why = |action: fn(&mut EventAction<'_, Carts>)| match meet(&carts, action) {
        Err(SimulationErrorKind::EventAction { event, error }) => {
            assert_eq!(event, "meet");
            *error
        }
        other => panic!("{other:?}"),
    };
    let unknown = why(|change| change.engage("couplin"));
    assert_eq!(
        unknown,
        EventActionError::UnknownConstraint { name: "couplin".into(), suggestion: Some("coupling".into()) }
    );
    assert_eq!(why(|change| change.impact("coupling", 1.5)), EventActionError::Restitution { value: 1.5 });
    let apart = why(|change| {
        change.state_mut().q[1] += 0.25;
        change.engage("coupling");
    });
    assert!(matches!(
        apart,
        EventActionError::EngagedApart { row: "coupling", residual }
        if (residual - 0.25).abs() < 1e-9
    ));
    let apart = why(|change| {
        change.state_mut().q[1] += 0.25;
        change.impact("coupling", 0.5);
    });
    assert!(matches!(
        apart,
        EventActionError::ImpactApart { row: "coupling", residual }
        if (residual - 0.25).abs() < 1e-9
    ));
    // The mode alone, without the impact: the velocities do not fit.
    let state = why(|change| change.state_mut().active_set_mut().engage(0));
    assert!(matches!(state, EventActionError::State(_)), "{state:?}");
}

#[test]
fn guards_that_cannot_be_are_refused() {
    let ball = Ball { m: 1.0, g: 9.81 };
    let start = released(at_rest_or_not([0.0, 1.0], [0.0, 0.0]), [0]);
    let refused = |run: dynamics_runtime::simulate::Simulation<'_, Ball>| match run
        .until(1.0)
        .run()
        .unwrap_err()
        .kind
    {
        SimulationErrorKind::Option(error) => error,
        other => panic!("{other:?}"),
    };
    let open = || ball.simulate(start);
    assert!(matches!(refused(open().contact("flor", 0.0)), OptionError::Constraint(_)));
    let springy = refused(open().contact("floor", 1.1));
    assert!(matches!(springy, OptionError::Contact { option: "restitution", .. }));
    assert!(springy.to_string().starts_with("`.contact(\"floor\", ..)` with restitution 1.1"), "{springy}");
    let rest = Contact { rest_speed: Some(-1.0), ..Contact::default() };
    assert!(matches!(
        refused(open().contact("floor", rest)),
        OptionError::Contact { option: "rest_speed", .. }
    ));
    // Which constraint is wrong comes before which event is.
    for sticky in [open().stick_slip("floor", "x"), open().event("x", |_| 1.0).stick_slip("floor", "x")] {
        let error = refused(sticky);
        assert!(matches!(
            error,
            OptionError::NotForUnilateral { option: "stick_slip", constraint: "floor", .. }
        ));
        let said = "`.stick_slip(..)` is not possible for `floor`, a constraint on positions \
            (`#[holonomic]`); `.contact(..)` is for those";
        assert!(error.to_string().starts_with(said), "{error}");
    }
    let back = open().contact("floor", 0.8).until(-2.0).run().unwrap_err().kind;
    let expected = OptionError::Backwards { option: "contact", constraint: "floor".into() };
    assert_eq!(back, SimulationErrorKind::Option(expected));
    let below = ball
        .simulate(released(at_rest_or_not([0.0, -0.5], [0.0, 0.0]), [0]))
        .until(1.0)
        .contact("floor", 0.0);
    let kind = below.run().unwrap_err().kind;
    assert_eq!(kind, SimulationErrorKind::Penetration { row: "floor", residual: -0.5 });
}

/// A rod whose end is guided in a slot with friction slides into Painlevé's paradox: the run ends where 1 + 3
/// cos² θ = 3 μ sin θ |cos θ| changes sign, tan θ = 3 ± √5 at μ = 2, with an error that says so. Source:
/// Génot and Brogliato, Eur. J. Mech. A 18 (1999) 653.
#[test]
fn painleves_rod_slides_into_its_paradox() {
    let rod = PainleveRod { m: 1.0, l: 1.0, g: 9.81, mu: 2.0, linear: false };
    for (rate, slip) in [(-0.5, -20.0), (-2.0, -20.0), (-0.1, -8.0)] {
        let error = rod.simulate(rod.slipping(1.42, rate, slip)).until(5.0).run().unwrap_err();
        let several = SolveError::Friction { row: "floor", solutions: 2 };
        assert_eq!(error.kind, SimulationErrorKind::Solve(several), "{error}");
        let steepness = -error.state.q[2].tan();
        assert!((steepness - 3.0 - 5f64.sqrt()).abs() < 1e-6, "{steepness}");
        assert!(error.time > 0.1 && error.motion(&rod).unwrap().steps().len() > 10, "{error}");
    }
    // A start inside of the paradox: no reaction in a slot, an unstable one at a surface.
    for (linear, solutions) in [(false, 0), (true, 1)] {
        let rod = PainleveRod { linear, ..rod };
        let error = rod.simulate(rod.slipping(1.2, -0.4, -5.0)).until(5.0).run().unwrap_err();
        let none = SolveError::Friction { row: "floor", solutions };
        assert_eq!((error.time, error.kind), (0.0, SimulationErrorKind::Solve(none)));
    }
}

/// Where friction brings the end of the rod to rest, that is what is said: nothing slips on from there, and
/// nothing sticks.
#[test]
fn painleves_rod_comes_to_rest_on_the_jump_of_its_friction() {
    let rod = PainleveRod { m: 1.0, l: 1.0, g: 9.81, mu: 0.7, linear: false };
    for (theta, rate, slip) in [(1.2, 0.0, -1.0), (1.3, -0.2, -2.0), (1.2, 0.0, 0.3)] {
        let error =
            rod.simulate(rod.slipping(theta, rate, slip)).until(5.0).max_steps(3000).run().unwrap_err();
        let SimulationErrorKind::RestsOnJump { coordinates, .. } = &error.kind else {
            panic!("{theta} {slip}: {error}")
        };
        assert!(rod.slip(&error.state).abs() < 1e-6 && error.time > 0.0, "{error}");
        assert!(
            !coordinates.is_empty() && error.to_string().contains("lead to it from both sides"),
            "{error}"
        );
    }
}

#[test]
fn stopping_in_a_change_stops() {
    let ball = Ball { m: 1.0, g: 9.81 };
    let start = released(at_rest_or_not([0.0, 1.0], [0.0, 0.0]), [0]);
    let run = ball.simulate(start).until(5.0).contact("floor", 0.5);
    let motion = run.on_event_with("floor contact", Direction::Falling, |_| Flow::Stop).run().unwrap();
    assert_eq!((motion.events().len(), motion.events()[0].stopped), (1, true));
    assert!(motion.end().u[1] > 0.0, "after the rebound");
}

#[test]
fn a_release_without_a_reaction_names_no_side() {
    let block = |sliding: f64| Block { m: 2.0, k: 0.0, v: 0.3, n: 20.0, resting: 0.6, sliding };
    let run = |sliding: f64, action: fn(&mut EventAction<'_, Block>)| {
        let block = block(sliding);
        let run = block.simulate(at_rest_or_not([0.0], [block.v])).until(1.0).event("mark", |s| s.q[0] - 0.1);
        run.on_event_with("mark", Direction::Rising, action)
            .run()
            .map(|motion| motion.end())
            .map_err(|error| error.kind)
    };
    let released = run(0.0, |change| {
        change.release_to("stick", -1.0);
        // What is released stays so, to the side it was released to.
        change.release("stick");
    });
    assert_eq!(released.unwrap().active_set.side(0), -1.0);
    // Without friction either side is right; with it one would brake, and the other drive.
    assert!(run(0.0, |change| change.release("stick")).unwrap().active_set.side(0) != 0.0);
    match run(0.4, |change| change.release("stick")).unwrap_err() {
        SimulationErrorKind::EventAction { error, .. } => {
            assert_eq!(*error, EventActionError::NoSide { constraint: "stick" })
        }
        other => panic!("{other:?}"),
    }
}
