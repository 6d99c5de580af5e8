//! Dry friction: sticking and slipping on a belt, and Painlevé's rod.

use super::*;

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
