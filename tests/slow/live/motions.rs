//! Motions in JavaScript beside those of Rust: the same steps, and the same end.

use dynamics::integrate::tables::{DOP853, DORMAND_PRINCE5, Embedded};
use dynamics::live::{Live, OpenLive};
use dynamics::methods;
use dynamics::model::{ModelState, Vector};
use dynamics::prelude::*;
use dynamics::simulate::Simulation;

use crate::double_pendulum::DoublePendulum;
use crate::engine::Engine;

#[path = "../../models/andrews.rs"]
pub(crate) mod andrews;
#[path = "../../models/parallelogram.rs"]
mod parallelogram;
#[path = "../../models/three_cranks.rs"]
mod three_cranks;

/// A bob on a rod, in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Rod {
    l: f64,
    g: f64,
}

#[dynamics]
impl Rod {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.x.powi(2) + q.y.powi(2) - self.l * self.l)
    }
}

/// A ball above the ground.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub(crate) struct BouncingBall {
    pub(crate) g: f64,
}

#[dynamics]
impl BouncingBall {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * q.y
    }
    #[holonomic(switched)]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
}

/// A block on a belt, held by a spring.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct BlockOnBelt {
    stiffness: f64,
    speed: f64,
    kinetic_mu: f64,
    static_mu: f64,
}

#[dynamics]
impl BlockOnBelt {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * q.x.powi(2)
    }
    #[nonholonomic(switched, integrable)]
    fn belt(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - self.speed
    }
    #[force]
    fn sliding(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.kinetic_mu * q.slip(Self::belt))
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.static_mu - q.reaction(Self::belt).abs()
    }
}

/// A block that is thrown along a rough floor at a wall.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Thrown {
    distance: f64,
    kinetic_mu: f64,
    static_mu: f64,
}

#[dynamics]
impl Thrown {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[holonomic(switched)]
    fn wall(&self, q: &Coordinates<Self>) -> Expr {
        self.distance - q.x
    }
    #[nonholonomic(switched, integrable)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn sliding(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.kinetic_mu * q.slip(Self::floor))
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.static_mu - q.reaction(Self::floor).abs()
    }
}

/// A ball between the ground and a plate that comes down.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y)]
struct Press {
    height: f64,
    speed: f64,
}

#[dynamics]
impl Press {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        10.0 * q.y
    }
    #[holonomic(switched)]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[holonomic(switched)]
    fn plate(&self, q: &Coordinates<Self>) -> Expr {
        self.height - self.speed * q.t - q.y
    }
}

/// A plank whose ends are contacts.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, phi)]
struct Plank {
    g: f64,
}

#[dynamics]
impl Plank {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.x.dt().powi(2) + q.y.dt().powi(2)) + q.phi.dt().powi(2) / 6.0
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * q.y
    }
    #[holonomic(switched)]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        q.y - q.phi.sin()
    }
    #[holonomic(switched)]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        q.y + q.phi.sin()
    }
}

/// A bead on a track through points.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct BeadOnTrack {
    g: f64,
    track: CubicSpline,
}

#[dynamics]
impl BeadOnTrack {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, self.track.at(q.x))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * self.place(q).y
    }
}

/// A valley with straight sides, and a damper that works on one of them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Valley {
    slope: f64,
    damping: f64,
}

#[dynamics]
impl Valley {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.x.dt().powi(2)
    }
    #[potential]
    fn sides(&self, q: &Coordinates<Self>) -> Expr {
        self.slope * q.x.abs()
    }
    #[force]
    fn damper(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, if q.x > 0.0 { -self.damping * q.x.dt() } else { 0.0 * q.x })
    }
}

/// What is compared of a motion.
#[derive(Clone, Debug)]
struct Made {
    steps: f64,
    evaluations: f64,
    state: Vec<f64>,
    events: Vec<f64>,
}

/// A method of both: its name in pages, and its step or tolerance.
#[derive(Clone, Copy, Debug)]
enum By {
    Euler(f64),
    ExplicitEuler(f64),
    Heun(f64),
    Rk4(f64),
    DormandPrince(f64),
    Dop853(f64),
}

impl By {
    fn name(self) -> (&'static str, f64) {
        match self {
            Self::Euler(step) => ("euler", step),
            Self::ExplicitEuler(step) => ("explicit_euler", step),
            Self::Heun(step) => ("heun", step),
            Self::Rk4(step) => ("rk4", step),
            Self::DormandPrince(tolerance) => ("dp5", tolerance),
            Self::Dop853(tolerance) => ("dop853", tolerance),
        }
    }

    fn set<M: OpenLive>(self, simulation: Simulation<'_, M>) -> Simulation<'_, M> {
        match self {
            Self::Euler(step) => simulation.method(methods::SemiImplicitEuler).fixed_step(step),
            Self::ExplicitEuler(step) => simulation.method(methods::ExplicitEuler).fixed_step(step),
            Self::Heun(step) => simulation.method(methods::Heun).fixed_step(step),
            Self::Rk4(step) => simulation.method(methods::Rk4).fixed_step(step),
            Self::DormandPrince(tolerance) => simulation.method(methods::DormandPrince5).tolerance(tolerance),
            Self::Dop853(tolerance) => simulation.method(methods::Dop853).tolerance(tolerance),
        }
    }

    /// Steps may differ by this part, ends by this much, events by this much.
    fn permitted(self) -> [f64; 3] {
        match self {
            Self::Euler(_) | Self::ExplicitEuler(_) | Self::Heun(_) | Self::Rk4(_) => [0.0, 0.0, 1e-9],
            Self::DormandPrince(tolerance) | Self::Dop853(tolerance) => [0.01, 10.0 * tolerance, 1e-9],
        }
    }
}

fn by_rust<M: OpenLive>(simulation: Simulation<'_, M>, by: By, end: f64) -> Made {
    let motion = by.set(simulation).until(end).run().unwrap();
    let summary = motion.summary();
    let state = motion.end();
    let parts = [state.q().as_slice(), state.u().as_slice()];
    Made {
        steps: summary.steps as f64,
        evaluations: summary.evaluations as f64,
        state: parts.concat(),
        events: motion.events().iter().map(|event| event.time()).collect(),
    }
}

fn by_page(engine: &Engine, by: By, end: f64) -> Made {
    let (method, accuracy) = by.name();
    let [counts, state, events]: [Vec<f64>; 3] = engine
        .run::<Vec<Vec<f64>>>(&format!(
            "(() => {{
                const motion = new Motion(PROGRAMS, MODEL), {{ t, q, u, w, m }} = MODEL.starts[0];
                const refused = motion.refused ?? motion.start(t, q, u, w, m);
                if (refused !== null) throw new Error(refused);
                while (motion.t < {end:?}) {{
                    if (!motion.step('{method}', {accuracy:?}, {end:?})) throw new Error(motion.reason);
                }}
                return [
                    [motion.steps, motion.evaluations],
                    [...motion.q, ...motion.u],
                    motion.events.map((e) => e.t),
                ];
            }})()"
        ))
        .try_into()
        .unwrap();
    Made { steps: counts[0], evaluations: counts[1], state, events }
}

/// Pages locate kinks on another interpolant. A step that misses one is followed by a tiny one, there or
/// here.
const STEPS_AT_KINKS: f64 = 0.15;

/// Compares motions of a page with those of a simulation.
fn compare<'m, M: OpenLive + 'm>(
    page: &Live<'_, M>,
    simulate: impl Fn() -> Simulation<'m, M>,
    end: f64,
    methods: &[By],
) {
    let engine = Engine::new(page);
    for &by in methods {
        let (rust, page) = (by_rust(simulate(), by, end), by_page(&engine, by, end));
        let [of_steps, of_state, of_events] = by.permitted();
        let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eprintln!(
            "{} {by:?}: steps {} {}, evaluations {} {}, end off {:.1e}, {} events off {:.1e}",
            M::NAME,
            rust.steps,
            page.steps,
            rust.evaluations,
            page.evaluations,
            off(&rust.state, &page.state),
            rust.events.len(),
            off(&rust.events, &page.events),
        );
        let size = rust.state.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
        // Without fused products a fixed step has the same bits; a projection divides by pivots in another
        // order.
        let of_state = if M::ROWS.is_empty() { of_state } else { of_state.max(1e-11) };
        let of_steps = if M::KINKS > 0 { STEPS_AT_KINKS } else { of_steps };
        assert!((rust.steps - page.steps).abs() <= of_steps * rust.steps, "{by:?}: {rust:?} {page:?}");
        assert!(off(&rust.state, &page.state) <= of_state * size, "{by:?}: {rust:?} {page:?}");
        assert_eq!(rust.events.len(), page.events.len(), "{by:?}: {rust:?} {page:?}");
        assert!(off(&rust.events, &page.events) <= of_events, "{by:?}: {rust:?} {page:?}");
    }
}

#[test]
fn motions_without_constraints_have_the_same_steps() {
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(1.0).theta2(0.4).build().unwrap();
    let methods = [
        By::Euler(1e-3),
        By::ExplicitEuler(1e-3),
        By::Heun(1e-3),
        By::Rk4(0.01),
        By::DormandPrince(1e-4),
        By::DormandPrince(1e-8),
        By::Dop853(1e-6),
        By::Dop853(1e-10),
    ];
    compare(&Live::new(&model, start), || model.simulate(start), 5.0, &methods);
    // Small motions have a smaller absolute tolerance.
    let small = model.state().theta1(1e-4).build().unwrap();
    compare(&Live::new(&model, small), || model.simulate(small), 5.0, &[By::DormandPrince(1e-6)]);
}

#[test]
fn motions_with_constraints_have_the_same_steps() {
    let model = Rod { l: 1.0, g: 9.81 };
    let start = model.state().x(1.0).build().unwrap();
    let methods = [By::Rk4(0.01), By::DormandPrince(1e-4), By::DormandPrince(1e-8), By::Dop853(1e-8)];
    compare(&Live::new(&model, start), || model.simulate(start), 5.0, &methods);
    let model = three_cranks::ThreeCranks { inertia: 1.0, a: 0.5, b: 0.8, weight: 3.0 };
    let start =
        model.state().first(0.6).second(0.6).third(0.6).first_rate(1.0).second_rate(1.0).third_rate(1.0);
    let start = start.build().unwrap();
    compare(&Live::new(&model, start), || model.simulate(start), 5.0, &[By::Rk4(0.01), By::Dop853(1e-8)]);
    let model = andrews::PUBLISHED;
    let [beta, theta, gamma, phi, delta, omega, epsilon] = andrews::START;
    let start = model.state().beta(beta).theta(theta).gamma(gamma).phi(phi);
    let start = start.delta(delta).omega(omega).epsilon(epsilon).build().unwrap();
    let methods = [By::Rk4(1e-4), By::DormandPrince(1e-7), By::Dop853(1e-9)];
    compare(&Live::new(&model, start), || model.simulate(start), 0.03, &methods);
}

/// Through the change point, where the crank and the coupler lie on the base.
#[test]
fn change_points_are_passed_as_in_rust() {
    let model = parallelogram::Parallelogram { inertia: 1.0, l: 1.0, wide: 2.0, k: 3.0, rest: 0.2 };
    let start = model.state().a(1.0).c(1.0).a_rate(-1.0).c_rate(-1.0).build().unwrap();
    let methods = [By::Rk4(0.01), By::DormandPrince(1e-7), By::Dop853(1e-9)];
    compare(&Live::new(&model, start), || model.simulate(start), 5.0, &methods);
}

/// Knots of a spline and corners of a potential: steps end there.
#[test]
fn steps_end_where_accelerations_are_not_smooth() {
    let track = CubicSpline::natural(&[-4.0, -1.0, 0.5, 2.0, 4.0], &[3.0, 0.4, 0.1, 0.9, 3.4]).unwrap();
    let model = BeadOnTrack { g: 9.81, track };
    let start = model.state().x(-2.0).build().unwrap();
    let methods = [By::DormandPrince(1e-6), By::DormandPrince(1e-9), By::Dop853(1e-9)];
    compare(&Live::new(&model, start), || model.simulate(start), 10.0, &methods);
    let model = Valley { slope: 3.0, damping: 0.1 };
    let start = model.state().x(1.0).build().unwrap();
    compare(&Live::new(&model, start), || model.simulate(start), 10.0, &methods);
}

#[test]
fn contacts_and_friction_switch_as_in_rust() {
    let model = BouncingBall { g: 10.0 };
    let start = model.state().y(5.0).x_rate(1.0).release("ground").build().unwrap();
    let page = Live::new(&model, start).contact("ground", 0.5);
    let methods = [By::Rk4(0.01), By::DormandPrince(1e-8), By::Dop853(1e-6)];
    compare(&page, || model.simulate(start).contact("ground", 0.5), 6.0, &methods);
    let model = BlockOnBelt { stiffness: 1.0, speed: 0.2, kinetic_mu: 0.5, static_mu: 0.8 };
    let start = model.state().x_rate(0.2).build().unwrap();
    let page = Live::new(&model, start).stick_slip("belt", "breakaway");
    let methods = [By::Rk4(0.01), By::DormandPrince(1e-9), By::Dop853(1e-10)];
    compare(&page, || model.simulate(start).stick_slip("belt", "breakaway"), 20.0, &methods);
    let model = Plank { g: 10.0 };
    let start = model.state().y(2.0).phi(0.2).release("left").release("right").build().unwrap();
    let page = Live::new(&model, start).contact("left", 0.3).contact("right", 0.3);
    let simulate = || model.simulate(start).contact("left", 0.3).contact("right", 0.3);
    compare(&page, simulate, 4.0, &[By::DormandPrince(1e-9), By::Dop853(1e-9)]);
}

/// Why a motion ends, in Rust and on a page.
fn reasons<M: OpenLive>(page: &Live<'_, M>, simulation: Simulation<'_, M>, end: f64) -> [String; 2] {
    let by = By::DormandPrince(1e-9);
    let Err(error) = by.set(simulation).until(end).run() else { panic!("it goes on") };
    let rust = error.to_string();
    let page = Engine::new(page).run::<String>(&format!(
        "(() => {{
            const motion = new Motion(PROGRAMS, MODEL), {{ t, q, u, w, m }} = MODEL.starts[0];
            const refused = motion.refused ?? motion.start(t, q, u, w, m);
            if (refused !== null) throw new Error(refused);
            while (motion.t < {end:?} && motion.step('dp5', 1e-9, {end:?}));
            return motion.reason ?? 'it goes on';
        }})()"
    ));
    eprintln!("{rust}\n{page}");
    [rust, page]
}

#[test]
fn friction_brakes_after_an_impact() {
    let model = Thrown { distance: 0.9, kinetic_mu: 2.0, static_mu: 2.5 };
    let start = model.state().x_rate(3.0).release("wall").release("floor").build().unwrap();
    let page = Live::new(&model, start).contact("wall", 0.8).stick_slip("floor", "breakaway");
    let simulate = || model.simulate(start).contact("wall", 0.8).stick_slip("floor", "breakaway");
    compare(&page, simulate, 3.0, &[By::Rk4(0.01), By::DormandPrince(1e-9), By::Dop853(1e-9)]);
}

/// Hits every microsecond are no accumulation.
#[test]
fn fast_hits_go_on_as_in_rust() {
    let model = BouncingBall { g: 1e7 };
    let start = model.state().y(1.25e-6).release("ground").build().unwrap();
    let page = Live::new(&model, start).contact("ground", 1.0);
    // Shortly before a hit: the error of the speed is relative to 4 m/s.
    compare(&page, || model.simulate(start).contact("ground", 1.0), 2.04e-5, &[By::DormandPrince(1e-9)]);
}

#[test]
fn motions_end_with_the_words_of_rust() {
    let model = BlockOnBelt { stiffness: 1.0, speed: 0.2, kinetic_mu: 0.5, static_mu: 0.8 };
    let start = model.state().x_rate(0.5).release("belt").build().unwrap();
    for reason in reasons(&Live::new(&model, start), model.simulate(start), 5.0) {
        assert!(reason.contains("`belt` is released and comes to rest"), "{reason}");
    }
    let model = Press { height: 1.0, speed: 0.5 };
    let start = model.state().release("plate").build().unwrap();
    let page = Live::new(&model, start).contact("ground", 0.3).contact("plate", 0.3);
    let simulation = model.simulate(start).contact("ground", 0.3).contact("plate", 0.3);
    for reason in reasons(&page, simulation, 5.0) {
        assert!(reason.contains("`plate` is driven against constraints and contacts"), "{reason}");
    }
}

/// Values and derivatives of a periodic spline over many turns, at its seams too.
#[test]
fn periodic_splines_have_the_bits_of_rust() {
    let knots = [0.1, 0.35, 0.6, 0.8, 1.0];
    let track = CubicSpline::periodic(&knots, &[0.3, -0.2, 0.9, 0.1, 0.3]).unwrap();
    let model = BeadOnTrack { g: 9.81, track: track.clone() };
    let engine = Engine::new(&Live::new(&model, model.state().x(0.5).build().unwrap()));
    let mut at = Vec::new();
    for turn in -300..300 {
        for knot in knots {
            let x: f64 = knot + 0.9 * f64::from(turn);
            at.extend([x.next_down(), x, x.next_up(), x + 0.07]);
        }
    }
    let found = engine.run::<Vec<f64>>(&format!(
        "(() => {{
            const f = piecewise(MODEL.functions[0]);
            return {at:?}.flatMap((x) => [0, 1, 2, 3].map((order) => f(x, order)));
        }})()"
    ));
    for (i, x) in at.iter().enumerate() {
        assert_eq!(found[4 * i..][..4], track.derivatives(*x), "at {x:e}");
    }
}

/// The tables of both methods with step control, and the constants of their controllers.
#[test]
fn tables_are_those_of_rust() {
    let model = Rod { l: 1.0, g: 9.81 };
    let engine = Engine::new(&Live::new(&model, model.state().x(1.0).build().unwrap()));
    let compare = |name: &str, table: &Embedded| {
        let number = |field: &str| engine.run::<f64>(&format!("Number(METHODS.{name}.{field})"));
        let row = |field: &str| -> Vec<(usize, f64)> {
            let of =
                |part: &str| engine.run::<Vec<f64>>(&format!("Array.from(METHODS.{name}.{field}.{part})"));
            of("stages").into_iter().map(|stage| stage as usize).zip(of("weights")).collect()
        };
        let rows = number("rows.length") as usize;
        for (i, expected) in table.rows[1..=rows].iter().enumerate() {
            assert_eq!(row(&format!("rows[{i}]")), expected.to_vec(), "{name}: row {i}");
        }
        assert_eq!(rows + 1 + usize::from(table.first_same_as_last), table.rows.len(), "{name}: stages");
        let nodes = engine.run::<Vec<f64>>(&format!("METHODS.{name}.c"));
        assert_eq!(nodes, table.nodes[..nodes.len()].to_vec(), "{name}: nodes");
        assert_eq!(row("result"), table.weights.to_vec(), "{name}: weights");
        assert_eq!(row("error"), table.error.to_vec(), "{name}: error");
        if let Some(third) = table.third_order {
            assert_eq!(row("third"), third.to_vec(), "{name}: third order");
        }
        let control = table.control;
        for (field, expected) in [
            ("control.safety", control.safety),
            ("control.beta", control.beta),
            ("control.shrink", control.shrink),
            ("control.grow", control.grow),
            ("error_order", f64::from(table.error_order)),
        ] {
            assert_eq!(number(field), expected, "{name}: {field}");
        }
    };
    compare("dp5", &DORMAND_PRINCE5);
    compare("dop853", &DOP853);
}

/// Models and checks against closed forms, written in JavaScript.
#[test]
fn closed_forms_hold_in_this_engine() {
    let model = Rod { l: 1.0, g: 9.81 };
    let engine = Engine::new(&Live::new(&model, model.state().x(1.0).build().unwrap()));
    engine.run::<()>(include_str!("../../../dynamics-live/tests/motion/models.js"));
    engine.run::<()>(include_str!("../../../dynamics-live/tests/motion/checks.js"));
    let names = engine.run::<Vec<String>>("Object.keys(CHECKS)");
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        engine.run::<()>(&format!("CHECKS.{name}(); undefined"));
    }
}
