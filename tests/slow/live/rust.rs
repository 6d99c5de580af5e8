//! "Copy as Rust": the text that a page gives compiles, and its motion is that of the page.
//!
//! The files of `copied/` are these texts, as blocks that are compiled here. The tests compare them with what
//! pages give now, or write them where `UPDATE_COPIED` is set to something. They need no browser: neither the
//! player nor the copies know the document.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use dynamics::families::model::FamilyModel;
use dynamics::live::{Live, OpenLive};
use dynamics::model::{ModelState, State, Vector};
use dynamics::prelude::*;

use crate::double_pendulum::DoublePendulum;
use crate::engine::Engine;
use crate::families::Wagon;
use crate::models::{Bead, Block, Chain, Particle, RigidBody};
use crate::motions::BouncingBall;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Names that an address and Rust have for themselves.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
pub(crate) struct Reserved {
    pub(crate) method: f64,
    pub(crate) accuracy: f64,
    pub(crate) only: f64,
    pub(crate) r#type: f64,
}

#[dynamics]
impl Reserved {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.method + self.accuracy) * q.x.dt().powi(2)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.only + self.r#type) * q.x.powi(2)
    }
}

// The texts as they were copied, with their ends as values.

fn double_pendulum() -> Result<State<DoublePendulum>> {
    include!("copied/double_pendulum.rs")
}

fn chain() -> Result<State<Chain>> {
    include!("copied/chain.rs")
}

fn bead(model: Bead) -> Result<State<Bead>> {
    include!("copied/bead.rs")
}

fn block() -> Result<State<Block>> {
    include!("copied/block.rs")
}

fn slipping_back() -> Result<State<Block>> {
    include!("copied/slipping_back.rs")
}

fn particle() -> Result<State<Particle>> {
    include!("copied/particle.rs")
}

fn rigid_body() -> Result<State<RigidBody>> {
    include!("copied/rigid_body.rs")
}

fn reserved() -> Result<State<Reserved>> {
    include!("copied/reserved.rs")
}

fn wagon() -> Result<<Wagon as FamilyModel>::State> {
    include!("copied/wagon.rs")
}

fn bouncing_ball() -> Result<State<BouncingBall>> {
    include!("copied/bouncing_ball.rs")
}

/// The scripts of a page that print the text, after what its reader did to the `player`.
pub(crate) fn copy<M: OpenLive>(page: &Live<'_, M>, acts: &str) -> Engine {
    play(Engine::new(page), acts)
}

/// The player of a page, and what its reader does to it.
pub(crate) fn play(engine: Engine, acts: &str) -> Engine {
    // Without a clock nothing takes too long.
    engine.run::<()>("globalThis.performance = { now: () => 0 }");
    engine.run::<()>(include_str!("../../../dynamics-view/src/animation/paint.js"));
    engine.run::<()>(include_str!("../../../dynamics-live/src/page/player.js"));
    engine.run::<()>(include_str!("../../../dynamics-live/src/page/address.js"));
    engine.run::<()>(
        "const player = new Player();
        const { t, q, u, m } = MODEL.starts[0];
        player.w.set(MODEL.starts[0].w);
        const refused = player.begin({ t, q: Float64Array.from(q), u: Float64Array.from(u), m });
        if (refused) throw new Error(refused);",
    );
    engine.run::<()>(&format!("{acts}; undefined"));
    engine
}

/// Compares the text with its file, and the end of its motion with that of the page at the same time.
fn compare(name: &str, engine: &Engine, copied: Result<impl ModelState>, tolerance: f64) {
    let end = copied.map(|end| (end.t(), [end.q().as_slice(), end.u().as_slice()].concat()));
    compare_values(name, engine, "motion.end()", end, tolerance);
}

/// The same with the end as t, and q and u in one list; `value` is what the block returns.
fn compare_values(name: &str, engine: &Engine, value: &str, copied: Result<(f64, Vec<f64>)>, tolerance: f64) {
    let text = format!("{{\n{}Ok({value})\n}}\n", engine.run::<String>("rust()"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("live/copied").join(format!("{name}.rs"));
    if env::var_os("UPDATE_COPIED").is_some_and(|value| !value.is_empty()) {
        fs::write(&path, &text).unwrap();
    }
    let stored = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert_eq!(
        stored, text,
        "copied/{name}.rs is not what the page gives now; if that is meant: \
         UPDATE_COPIED=1 cargo test -p dynamics-slow-tests --test live rust::, and once more without it"
    );
    let (end, values) = copied.unwrap();
    let page = engine.run::<Vec<f64>>(&format!(
        "(() => {{
            const {{ motion, start: {{ t, q, u, m }}, method, accuracy }} = player, end = {:?};
            const refused = motion.start(t, q, u, player.w, m);
            if (refused) throw new Error(refused);
            while (motion.t < end && motion.step(method, accuracy, end));
            return [motion.t, ...motion.q, ...motion.u];
        }})()",
        end
    ));
    let rust = [&[end][..], &values].concat();
    let size = rust.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
    let off = rust.iter().zip(&page).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    eprintln!("{name}: t = {end}, {off:.1e} apart");
    assert!(off <= tolerance * size, "{name}: {rust:?} in Rust, {page:?} in the page");
}

/// All digits of starts and parameters, and the method of the page.
#[test]
fn a_copied_double_pendulum_moves_alike() {
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(1.0 / 3.0).theta2_rate(-0.7).build().unwrap();
    let page = model.live(start).method(methods::Dop853).tolerance(1e-10);
    let engine = copy(&page, "player.change('parameters', () => { player.motion.p[3] = 2 / 3; })");
    compare("double_pendulum", &engine, double_pendulum(), 1e-8);
    // The same numbers as literals: the same bits.
    let model = DoublePendulum { l2: 2.0 / 3.0, ..model };
    let motion = model.simulate(start).until(10.0).method(methods::Dop853).tolerance(1e-10).run().unwrap();
    assert_eq!(double_pendulum().unwrap(), motion.end());
}

/// Arrays, a start at another time, a fixed step.
#[test]
fn a_copied_chain_moves_alike() {
    let model = Chain { cart: 2.0, mass: [0.5, 0.4, 0.3, 0.2], length: [0.8, 0.7, 0.6, 0.5], g: 9.81 };
    let start = model.state().theta([0.4, 0.3, 0.2, 0.1]).at_time(0.25).build().unwrap();
    let page = model.live(start).method(methods::Rk4).step(0.01);
    let engine = copy(&page, "player.change('parameters', () => { player.motion.p[2] = 0.45; })");
    compare("chain", &engine, chain(), 1e-11);
}

/// Smooth functions come from the model of the program.
#[test]
fn a_copied_bead_moves_alike() {
    let track = CubicSpline::natural(&[-4.0, -1.0, 0.5, 2.0, 4.0], &[3.0, 0.4, 0.1, 0.9, 3.4]).unwrap();
    let model = Bead { m: 0.3, g: 9.81, track };
    let page = model.live(model.state().x(-2.0).build().unwrap());
    let engine = copy(&page, "player.change('parameters', () => { player.motion.p[1] = 3.7; })");
    compare("bead", &engine, bead(model), 1e-6);
}

/// A switched constraint that slides, and its rule.
#[test]
fn a_copied_block_moves_alike() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.2, friction: 0.3 };
    let start = model.state().x_rate(1.0).release("stick").build().unwrap();
    let page = model.live(start).stick_slip("stick", "breakaway");
    compare("block", &copy(&page, ""), block(), 1e-6);
}

/// The other side of the same constraint, and an end after a start that is late.
#[test]
fn a_block_that_slips_back_moves_alike() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.2, friction: 0.3 };
    let start = model.state().x_rate(-1.0).at_time(123_456.0).release("stick").build().unwrap();
    let page = model.live(start).stick_slip("stick", "breakaway").until(123_457.5);
    compare("slipping_back", &copy(&page, ""), slipping_back(), 1e-6);
}

/// Vectors.
#[test]
fn a_copied_particle_moves_alike() {
    let (magnetic, electric) = ([0.1, 0.7, -0.4].into(), [0.3, 0.0, 0.2].into());
    let model = Particle { mass: 1.7, charge: 0.8, magnetic, electric };
    let page = model.live(model.state().x_rate(1.0).build().unwrap());
    compare("particle", &copy(&page, ""), particle(), 1e-6);
}

/// A matrix.
#[test]
fn a_copied_body_moves_alike() {
    let model = RigidBody { inertia: Mat3::diagonal(1.0, 2.0, 2.5) };
    let page = model.live(model.state().tilt(1.0).yaw_rate(2.0).spin_rate(1.0).build().unwrap());
    compare("rigid_body", &copy(&page, ""), rigid_body(), 1e-6);
}

/// Names that are words of Rust.
#[test]
fn copied_names_are_raw_where_they_must_be() {
    let model = Reserved { method: 1.0, accuracy: 0.5, only: 2.0, r#type: 3.0 };
    let page = model.live(model.state().x(1.0).build().unwrap());
    compare("reserved", &copy(&page, ""), reserved(), 1e-6);
}

/// A model with families, with dashpots.
#[test]
fn a_copied_wagon_moves_alike() {
    let model = Wagon { damping: 0.3, ..crate::families::wagon(4) };
    let start = model.state().x([0.1, 0.2, 0.3, 0.4]).cart_rate(0.5).build().unwrap();
    let page = model.live(start).method(dynamics::families::methods::Rk4).step(0.01);
    let engine =
        play(Engine::of_family(&page), "player.change('parameters', () => { player.motion.p[2] = 70; })");
    let end = wagon().map(|end| (end.t(), [end.q(), end.u()].concat()));
    compare_values("wagon", &engine, "motion.end().clone()", end, 1e-11);
}

/// A contact and its law of impact.
#[test]
fn a_copied_ball_moves_alike() {
    let model = BouncingBall { g: 10.0 };
    let start = model.state().y(5.0).x_rate(1.0).release("ground").build().unwrap();
    let page = model.live(start).contact("ground", 0.5);
    compare("bouncing_ball", &copy(&page, ""), bouncing_ball(), 1e-6);
}
