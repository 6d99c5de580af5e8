//! Carts that couple where they meet: constraints that actions engage, release and hit.

use super::*;

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
