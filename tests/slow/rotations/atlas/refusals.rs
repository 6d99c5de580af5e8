//! What is refused: charts of different motions, turns that are none, and closures that read angles.

use super::*;

#[test]
fn charts_of_different_motions_are_refused() {
    let refused = |model: Craft, turn: fn(&mut Craft, f64)| {
        let atlas = ChartSwitching::new(model).turning("pitch", turn).expect("a set with a reference");
        let start = atlas.charts()[0]
            .state()
            .pitch(0.3)
            .yaw_rate(0.4)
            .pitch_rate(1.0)
            .motor(0.0)
            .build()
            .expect("finite");
        let error = atlas.simulate(start).until(10.0).run().expect_err("the charts disagree");
        assert!(error.motion(&atlas).is_none() && error.time == 0.0);
        match error.kind {
            ChartSwitchingErrorKind::Chart(ChartError::Disagree { what, name, .. }) => {
                (what, name, error.to_string())
            }
            _ => panic!("{error}"),
        }
    };
    let wrong = |model: &mut Craft, turn: f64| model.misplaced = turn;
    let (what, name, text) = refused(CRAFT, wrong);
    assert_eq!((what, name), (Compared::Output, "forward.x"), "{text}");
    let (what, name, text) = refused(Craft { spring: 0.1, ..CRAFT }, right);
    assert_eq!((what, name), (Compared::AngularAcceleration, "pitch"));
    assert!(text.contains("they do not describe the same; say it by the frame of the body"), "{text}");
    let (what, name, _) = refused(Craft { shown: 1e-6, ..CRAFT }, right);
    assert_eq!((what, name), (Compared::Output, "forward.x"));
    let (what, name, _) = refused(Craft { seen: 0.01, ..CRAFT }, right);
    assert_eq!((what, name), (Compared::Event, "passes"));
}

#[test]
fn what_makes_no_atlas_is_refused() {
    let of = |model: Craft, name: &str, turn: fn(&mut Craft, f64)| {
        ChartSwitching::new(model).turning(name, turn).map(|_| ())
    };
    let error = of(CRAFT, "yaw", right).expect_err("it is the first");
    assert!(error.to_string().contains("those of this model are `pitch`"), "{error}");
    assert_eq!(of(CRAFT, "pitch", |_, _| ()), Err(ChartError::Unturned { name: "pitch" }));
    let turned = Craft { reference: 0.2, ..CRAFT };
    assert_eq!(of(turned, "pitch", right), Err(ChartError::NotAtZero { parameter: "reference", value: 0.2 }));
    let atlas = ChartSwitching::new(CRAFT).turning("pitch", right).expect("a set with a reference");
    assert_eq!(atlas.clone().turning("pitch", right).map(|_| ()), Err(ChartError::Twice { name: "pitch" }));
    let start = CRAFT.state().pitch_rate(1.0).motor(0.0).build().expect("finite");
    let refused = |error: ChartSwitchingErrorKind<Craft>| match error {
        ChartSwitchingErrorKind::Chart(error) => error,
        ChartSwitchingErrorKind::Run { error, .. } => panic!("{error}"),
        _ => panic!("another kind"),
    };
    assert_eq!(refused(atlas.simulate(start).run().expect_err("no end").kind), ChartError::NoEnd);
    let every = atlas.simulate(start).until(3.0).with(|run, _| run.every(0.1)).run();
    assert_eq!(
        refused(every.expect_err("times of a part").kind),
        ChartError::NotByParts { option: "output times" }
    );
    let estimated = atlas.simulate(start).until(3.0).with(|run, _| run.estimate_error()).run();
    assert_eq!(
        refused(estimated.expect_err("of a part").kind),
        ChartError::NotByParts { option: "estimate_error" }
    );
    // What stops a part stops all, with what there is in hand.
    let limited = atlas
        .simulate(start)
        .until(30.0)
        .with(|run, _| run.tolerance(1e-10).max_steps(2))
        .run()
        .expect_err("few steps");
    assert!(
        matches!(limited.kind, ChartSwitchingErrorKind::Run { .. })
            && limited.to_string().contains("more than 2 steps"),
        "{limited}"
    );
    let motion = limited.motion(&atlas).expect("some steps were made");
    assert!(motion.end_time() == limited.time && limited.time > 0.0);
    // Without a set nothing changes.
    let motion = ChartSwitching::new(CRAFT);
    let motion = motion.simulate(start).until(1.0).run().expect("it does not lock before");
    assert!(motion.changes().is_empty() && motion.segments().len() == 1);
}

/// A free body moves alike whichever way its reference is turned: a turn that is not the one that was asked
/// for is seen from the parameter.
#[test]
fn another_turn_is_refused() {
    let of = |turn: fn(&mut Craft, f64)| ChartSwitching::new(CRAFT).turning("pitch", turn).map(|_| ());
    for turn in
        [|m: &mut Craft, t: f64| m.reference = -t, |m: &mut Craft, t: f64| m.reference = t.to_degrees()]
    {
        let error = of(turn).expect_err("another turn");
        assert!(matches!(error, ChartError::NotTheTurn { parameter: "reference", .. }), "{error}");
    }
    let error = of(|m, t| m.reference = t * f64::NAN).expect_err("no turn").to_string();
    assert!(error.contains("`reference` is set to NaN where the turn of the reference is 0"), "{error}");
}

/// What is given with the simulation has to be the same in all charts, too, however small it is beside
/// others.
#[test]
fn closures_that_read_angles_are_refused() {
    let atlas = ChartSwitching::new(CRAFT).turning("pitch", right).expect("a set with a reference");
    let start = CRAFT.state().pitch(0.3).pitch_rate(1.0).motor(0.0).build().expect("finite");
    let run = atlas.simulate(start).until(3.0).with(|run, _| run.event("steep", |state| state.pitch() - 0.7));
    let error = run.run().expect_err("the event depends on the chart");
    assert!(matches!(
        &error.kind,
        ChartSwitchingErrorKind::Chart(ChartError::EventDisagrees { event, .. })
        if event == "steep"
    ));
    assert!(error.to_string().contains("have it ask the model that `with` gives"), "{error}");
    let place = |model: &Craft, state: &State<Craft>| {
        let q = Craft::coordinates_with(state, &nalgebra::SVector::zeros(), &[]);
        model.frame(&q).x().z.value() + 0.7
    };
    let run = atlas.simulate(start).until(3.0);
    let run = run.with(|run, model| run.event("steep", move |state| place(model, state))).run();
    let motion = run.unwrap_or_else(|error| panic!("{error}"));
    assert!(
        !motion.changes().is_empty() && motion.events().any(|event| event.name == "steep"),
        "{}",
        motion.verify()
    );
}
