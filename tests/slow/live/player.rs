//! What a page plays, without a browser: the player and the sliders' values know no document.

use dynamics::prelude::*;

use crate::engine::Engine;
use crate::models::Pendulum;
use crate::motions::BouncingBall;
use crate::rust::copy;

const PENDULUM: Pendulum = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 };

/// Plays until the motion ends, for a minute and a half at most.
const PLAY: &str = "while (player.last < 5400 && player.advance(Infinity) === 'more');";

/// The value of a script as text, as JSON prints it.
fn seen(engine: &Engine, script: &str) -> String {
    engine.run(&format!("JSON.stringify({script})"))
}

/// `until` is a time, also where the start is not at zero.
#[test]
fn a_motion_ends_at_its_time() {
    let start = PENDULUM.state().theta(1.0).at_time(10.0).build().unwrap();
    let engine = copy(&PENDULUM.live(start).until(13.0), PLAY);
    assert_eq!(seen(&engine, "[player.end, player.time(player.last)]"), "[13,13]");
    assert!(engine.run::<String>("player.reason").contains("for 3 s"));
    // From a start that the viewer chose at the end, the motion goes on as long again.
    engine.run::<()>("player.begin({ ...player.start, t: 13 }); undefined");
    assert_eq!(seen(&engine, "player.end"), "16");
    // A motion of half a second at a late time is slowed down.
    assert_eq!(
        seen(&engine, "[chosenPace(1, 3), chosenPace(1, 0.5) < 0.1, chosenPace(1, Infinity)]"),
        "[1,true,1]"
    );
}

/// Of events, those are kept that can be seen.
#[test]
fn events_before_the_first_instant_are_dropped() {
    let ball = BouncingBall { g: 10.0 };
    let start = ball.state().y(1.0).release("ground").build().unwrap();
    let page = ball.live(start).contact("ground", 1.0).method(methods::Rk4).step(0.01);
    let engine = copy(&page, PLAY);
    let events = "[player.events.length > 20, player.first > 1000]";
    assert_eq!(seen(&engine, events), "[true,true]");
    assert_eq!(seen(&engine, "player.events.every(({ t }) => t >= player.instants[0].t)"), "true");
}

/// A page stands at a start that is refused, and moves as soon as there is another one.
#[test]
fn a_refused_start_stands() {
    let page = PENDULUM.live(PENDULUM.state().theta(1.0).build().unwrap()).plot(["theta", "energy"]);
    let engine = copy(
        &page,
        "const none = { t, q: [NaN], u, m };
        player.stand(none, player.begin(none));",
    );
    assert!(engine.run::<String>("player.reason").contains("`theta` is NaN"));
    assert_eq!(
        seen(&engine, "[player.advance(Infinity), player.head, player.show().length]"),
        "[\"ended\",0,2]"
    );
    // Other parameters are no remedy, but another method can be chosen.
    let refused = engine.run::<String>("player.change('parameters', () => { player.motion.p[0] = 2; })");
    assert!(refused.contains("`theta` is NaN"), "{refused}");
    let method = "player.change('method', () => { player.method = 'rk4'; player.accuracy = 0.01; })";
    assert_eq!(seen(&engine, method), "null");
    assert_eq!(seen(&engine, "player.begin({ t, q: [0.5], u, m })"), "null");
    assert_eq!(
        seen(&engine, "[player.refused, player.advance(Infinity), player.method]"),
        "[null,\"more\",\"rk4\"]"
    );
}

/// A refused start changes no inputs.
#[test]
fn inputs_of_a_refused_start_are_not_taken() {
    let cart = crate::models::CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let engine = copy(&cart.live(cart.state().theta(0.5).push(0.3).build().unwrap()), "");
    let refused = "player.begin({ ...player.start, q: [NaN, 0], w: [7] }) !== null";
    assert_eq!(seen(&engine, refused), "true");
    assert_eq!(seen(&engine, "Array.from(player.w)"), "[0.3]");
    assert_eq!(seen(&engine, "player.begin({ ...player.start, w: [7] })"), "null");
    assert_eq!(seen(&engine, "Array.from(player.w)"), "[7]");
}

/// What nobody chose is usual: the model's own accuracy for its method, otherwise the method's.
#[test]
fn methods_have_usual_accuracies() {
    let start = PENDULUM.state().theta(1.0).build().unwrap();
    let engine = copy(&PENDULUM.live(start).method(methods::Dop853).tolerance(1e-10), "player.pace = 0.2;");
    let usual = "['dop853', 'dp5', 'rk4'].map((method) => player.usualAccuracy(method))";
    assert_eq!(seen(&engine, usual), "[1e-10,1e-8,0.002]");
}

/// Values of a slider stay between its ends, and tell apart what lies between them.
#[test]
fn values_of_sliders_are_rounded_between_their_ends() {
    let engine = copy(&PENDULUM.live(PENDULUM.state().theta(1.0).build().unwrap()), "");
    engine.run::<()>(include_str!("../../../dynamics-live/src/page/controls.js"));
    for (value, lo, hi, rounded) in [
        (9.780_500_01, 9.7805, 9.8325, "9.7805"),
        (9.832_499_99, 9.7805, 9.8325, "9.8325"),
        (9.806_68, 9.7805, 9.8325, "9.8067"),
        (95.3245, 0.981, 98.1, "95.3"),
        (std::f64::consts::PI, -std::f64::consts::PI, std::f64::consts::PI, "3.14"),
        (1e-27, 1e-28, 1e-26, "1e-27"),
        (0.0, -1.0, 1.0, "0"),
    ] {
        assert_eq!(seen(&engine, &format!("roundedBetween({value:?}, {lo:?}, {hi:?})")), rounded);
    }
}

/// Everything that can be plotted has its name of the library.
#[test]
fn plots_have_the_names_of_the_library() {
    let ball = BouncingBall { g: 10.0 };
    let engine = copy(&ball.live(ball.state().y(1.0).release("ground").build().unwrap()), "");
    engine.run::<()>("while (player.last < 20) player.advance(Infinity);");
    let names = "['y', 'y_rate', 'energy', 'kinetic energy', 'potential energy', 'lambda[ground]']";
    engine.run::<()>(&format!("MODEL.plots = {names}; undefined"));
    // At 1/6 s the ball has fallen by 5/36 m, with 5/3 m/s.
    let values = "channelsOf(player.motion).map(({ of }) => of(player.instant(10)).toFixed(6))";
    let energies = "\"10.000000\",\"1.388889\",\"8.611111\"";
    assert_eq!(seen(&engine, values), format!("[\"0.861111\",\"-1.666667\",{energies},\"0.000000\"]"));
}
