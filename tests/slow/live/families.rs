//! Models with families in the scripts of live pages: loops with the bits of Rust, motions by fixed steps
//! with the bits of the library's runs where M is diagonal.

use dynamics::families::measured::Accelerations;
use dynamics::families::methods;
use dynamics::families::model::{FamilyState as _, Multipliers};
use dynamics::families::portable::PortableFamily;
use dynamics::live::{LiveError, OpenFamilyLive};
use dynamics::prelude::*;

use crate::engine::Engine;
use crate::random_states::Numbers;
use crate::rust::play;

/// A bar of masses, held at one end and pulled at the other.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.elements])]
#[inputs(pull: N)]
#[units(length: m, ea: N, rho: kg / m)]
struct Bar {
    elements: usize,
    length: f64,
    ea: f64,
    rho: f64,
}

#[dynamics]
impl Bar {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.s[i - 1] }
    }
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(self.h() * i as f64 + self.node(q, i), 0.0)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
                0.25 * self.rho * self.h() * (a * a + b * b)
            })
            .sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                0.5 * self.ea / self.h() * (self.place(q, e + 1).x - self.place(q, e).x - self.h()).powi(2)
            })
            .sum()
    }
    #[force]
    fn pull(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.s[self.elements - 1], q.pull)
    }
    #[output]
    fn wall(&self, q: &Coordinates<Self>) -> Expr {
        self.ea / self.h() * q.s[0]
    }
    #[output]
    fn normal_force(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.elements).map(|e| self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e))).collect()
    }
}

/// The same with the mass of linear elements.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.elements])]
#[units(length: m, ea: N, rho: kg / m)]
struct ConsistentBar {
    elements: usize,
    length: f64,
    ea: f64,
    rho: f64,
}

#[dynamics]
impl ConsistentBar {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.s[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
                self.rho * self.h() / 6.0 * (a * a + a * b + b * b)
            })
            .sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| 0.5 * self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e)).powi(2))
            .sum()
    }
}

/// A string between two pegs, with masses of their own and air.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes], w: [m; self.nodes])]
#[units(pitch: m, ea: N, tension: N, mass: kg, damping: N * s / m)]
struct GuitarString {
    nodes: usize,
    pitch: f64,
    ea: f64,
    tension: f64,
    mass: Vec<f64>,
    damping: f64,
}

#[dynamics]
impl GuitarString {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let x = self.pitch * i as f64;
        if i == 0 || i == self.nodes + 1 { vec2(x, 0.0) } else { vec2(x + q.s[i - 1], q.w[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass[i] * (q.s[i].dt().powi(2) + q.w[i].dt().powi(2))).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.nodes + 1 {
            let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() / self.pitch - 1.0;
            sum += self.pitch * (self.tension * stretch + 0.5 * self.ea * stretch.powi(2));
        }
        sum
    }
    #[dissipation]
    fn air(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.damping * q.w[i].dt().powi(2)).sum()
    }
}

/// Pendulums on one axle, coupled by springs, and one more that all of them pull.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: [rad; self.links], beam: m)]
#[units(mass: kg, length: m, g: m / s^2, k: N * m, rail: kg, hold: N / m, pull: N / m)]
struct Pendulums {
    links: usize,
    mass: f64,
    length: f64,
    g: f64,
    k: f64,
    rail: f64,
    hold: f64,
    pull: f64,
}

#[dynamics]
impl Pendulums {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.rail * q.beam.dt().powi(2)
            + (0..self.links)
                .map(|i| 0.5 * self.mass * self.length * self.length * q.theta[i].dt().powi(2))
                .sum::<Expr>()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.hold * q.beam.powi(2);
        for i in 0..self.links {
            sum -= self.mass * self.g * self.length * q.theta[i].cos();
            sum += 0.5 * self.pull * (q.beam - self.length * q.theta[i].sin()).powi(2);
        }
        for i in 0..self.links - 1 {
            sum += 0.5 * self.k * (q.theta[i + 1] - q.theta[i]).powi(2);
        }
        sum
    }
}

/// A membrane on a grid, its rim held, large deflections.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(w: [[m; self.columns]; self.rows])]
#[units(pitch: m, tension: N / m, mass: kg)]
struct Drum {
    rows: usize,
    columns: usize,
    pitch: f64,
    tension: f64,
    mass: f64,
}

#[dynamics]
impl Drum {
    fn height(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
        if i == 0 || j == 0 || i == self.rows + 1 || j == self.columns + 1 {
            Expr::ZERO
        } else {
            q.w[i - 1][j - 1]
        }
    }
    fn place(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Vec3 {
        vec3(self.pitch * i as f64, self.pitch * j as f64, self.height(q, i, j))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows {
            for j in 0..self.columns {
                sum += 0.5 * self.mass * q.w[i][j].dt().powi(2);
            }
        }
        sum
    }
    #[potential]
    fn stretched_area(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.rows + 1 {
            for j in 0..self.columns + 1 {
                let w = self.place(q, i, j).z;
                let a = (self.place(q, i + 1, j).z - w) / self.pitch;
                let b = (self.place(q, i, j + 1).z - w) / self.pitch;
                sum += self.tension * self.pitch.powi(2) * ((1.0 + a * a + b * b).sqrt() - 1.0);
            }
        }
        sum
    }
}

/// A trolley, a cable of beads in its frame, a load: M is banded with a border.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(cart: m, x: [m; self.beads], y: [m; self.beads])]
#[inputs(push: N)]
#[units(trolley: kg, bead: kg, load: kg, pitch: m, ea: N, g: m / s^2)]
struct Crane {
    beads: usize,
    trolley: f64,
    bead: f64,
    load: f64,
    pitch: f64,
    ea: f64,
    g: f64,
}

#[dynamics]
impl Crane {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(q.cart, 0.0) } else { vec2(q.cart + q.x[i - 1], q.y[i - 1]) }
    }
    fn mass(&self, i: usize) -> f64 {
        if i == self.beads { self.load } else { self.bead }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.trolley * q.cart.dt().powi(2)
            + (1..=self.beads)
                .map(|i| 0.5 * self.mass(i) * self.place(q, i).dt().norm_squared())
                .sum::<Expr>()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.beads).map(|i| self.mass(i) * self.g * self.place(q, i).y).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads)
            .map(|e| {
                let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() / self.pitch - 1.0;
                0.5 * self.ea * self.pitch * stretch.powi(2)
            })
            .sum()
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.cart, q.push)
    }
}

/// Beads on rods, with a constraint for every index.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.links], y: [m; self.links])]
#[units(pitch: m, mass: kg, g: m / s^2)]
struct Rods {
    links: usize,
    pitch: f64,
    mass: f64,
    g: f64,
}

#[dynamics]
impl Rods {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.links).map(|i| 0.5 * self.mass * self.bead(q, i).dt().norm_squared()).sum()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.links).map(|i| self.mass * self.g * q.y[i]).sum()
    }
    #[holonomic]
    fn link(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.links)
            .map(|i| {
                let rod = (self.bead(q, i + 1) - self.bead(q, i)).norm_squared();
                (rod - self.pitch.powi(2)) / (2.0 * self.pitch)
            })
            .collect()
    }
}

/// A cart with beads in its frame, and a wheel that nothing couples with them: M is not dominant.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(cart: m, wheel: rad, x: [m; self.beads])]
#[units(trolley: kg, bead: kg, k: N / m, inertia: kg * m^2, damping: N * s / m)]
pub(crate) struct Wagon {
    pub(crate) beads: usize,
    pub(crate) trolley: f64,
    pub(crate) bead: f64,
    pub(crate) k: f64,
    pub(crate) inertia: f64,
    pub(crate) damping: f64,
}

#[dynamics]
impl Wagon {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.trolley * q.cart.dt().powi(2)
            + 0.5 * self.inertia * q.wheel.dt().powi(2)
            + (0..self.beads).map(|i| 0.5 * self.bead * (q.cart.dt() + q.x[i].dt()).powi(2)).sum::<Expr>()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x[0].powi(2)
            + (0..self.beads - 1).map(|i| 0.5 * self.k * (q.x[i + 1] - q.x[i]).powi(2)).sum::<Expr>()
    }
    #[dissipation]
    fn dashpots(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| 0.5 * self.damping * q.x[i].dt().powi(2)).sum()
    }
    #[output]
    fn pair(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.cart + q.x[0], q.cart - q.x[0]]
    }
    #[output]
    fn felt(&self, q: &Coordinates<Self>) -> Expr {
        q.cart.dt().dt()
    }
    #[output]
    fn end(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.cart + q.x[self.beads - 1], q.cart)
    }
}

/// A mass on a spring, and what a passenger feels.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m)]
#[units(mass: kg, k: N / m)]
struct Passenger {
    mass: f64,
    k: f64,
}

#[dynamics]
impl Passenger {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * q.x.dt().powi(2)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.k * q.x.powi(2)
    }
    #[output]
    fn felt(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt().dt()
    }
}

pub(crate) fn wagon(beads: usize) -> Wagon {
    Wagon { beads, trolley: 3.0, bead: 0.2, k: 80.0, inertia: 0.1, damping: 0.0 }
}

fn bar(elements: usize) -> Bar {
    Bar { elements, length: 1.3, ea: 0.25, rho: 0.7 }
}

fn string(nodes: usize) -> GuitarString {
    let mass = (0..nodes).map(|i| 0.01 + 0.001 * (i % 7) as f64).collect();
    GuitarString { nodes, pitch: 1.0 / (nodes + 1) as f64, ea: 20.0, tension: 1.5, mass, damping: 0.02 }
}

fn pendulums(links: usize) -> Pendulums {
    Pendulums { links, mass: 0.3, length: 0.4, g: 9.81, k: 0.8, rail: 2.0, hold: 30.0, pull: 0.05 }
}

fn drum(rows: usize, columns: usize) -> Drum {
    Drum { rows, columns, pitch: 0.05, tension: 1.1, mass: 0.002 }
}

fn crane(beads: usize) -> Crane {
    Crane { beads, trolley: 3.0, bead: 0.2, load: 1.5, pitch: 0.3, ea: 900.0, g: 9.81 }
}

/// Pages that are tested in a browser: a line with a damper, a grid, ordinary coordinates with an input.
pub(crate) fn pages() -> Vec<(&'static str, String)> {
    let (string, drum, crane) = (string(60), drum(12, 9), crane(10));
    let pluck = (0..60).map(|i| 0.004 * f64::from(i.min(59 - i)));
    let blow = (0..108_i32).map(|k| 0.05 * (-0.1 * f64::from((k / 9 - 4).pow(2) + (k % 9 - 5).pow(2))).exp());
    let hanging = |tilt: f64| {
        let state = crane.state().x((1..=10).map(move |i| 0.3 * tilt.sin() * f64::from(i)));
        state.y((1..=10).map(move |i| -0.3 * tilt.cos() * f64::from(i))).push(0.0).build().unwrap()
    };
    let start = string.state().w(pluck).build().unwrap();
    vec![
        ("string", string.live(start).plot(["w[30]", "energy"]).phase("w[30]").to_html().unwrap()),
        ("drum", drum.live(drum.state().w(blow).build().unwrap()).to_html().unwrap()),
        ("crane", {
            let page = crane.live(hanging(0.5)).start("upright", hanging(0.0));
            page.hold(["g"]).range("push", -20.0, 20.0).to_html().unwrap()
        }),
    ]
}

/// A state with random numbers of this size, about another one.
fn random<M: PortableFamily>(numbers: &mut Numbers, about: &M::State, size: f64) -> M::State {
    let mut state = about.clone();
    let (t, q, u, inputs) = state.parts_mut();
    *t = numbers.between(0.0, 3.0);
    q.iter_mut().chain(u).for_each(|x| *x += numbers.between(-size, size));
    inputs.iter_mut().for_each(|x| *x = numbers.between(-2.0, 2.0));
    state
}

/// Compares all loops of a model with Rust at random states about this one; the number of comparisons.
fn compare<M: OpenFamilyLive>(model: &M, about: &M::State, size: f64) -> usize {
    let engine = Engine::of_family(&model.live(about.clone()));
    let mut numbers = Numbers::new(M::NAME);
    let states: Vec<M::State> = (0..60).map(|_| random::<M>(&mut numbers, about, size)).collect();
    let given: Vec<[Vec<f64>; 7]> = states
        .iter()
        .map(|s| {
            let [q, u, w] = [s.q(), s.u(), s.inputs()].map(<[f64]>::to_vec);
            [vec![s.t()], q, u, w, Vec::new(), vec![0.0; s.q().len()], Vec::new()]
        })
        .collect();
    let evaluated = |name: &str| engine.evaluate(name, &model.parameters(), &given);
    let [found, kinetic, potential] = ["accelerations", "kinetic_energy", "potential_energy"].map(evaluated);
    let sizes = model.ends().unwrap();
    let mut accelerations = Accelerations::new(model, &sizes).unwrap();
    let mut compared = 0;
    for (k, state) in states.iter().enumerate() {
        let mut a = vec![0.0; sizes.unknowns()];
        accelerations.evaluate(model, state.view(), &mut a);
        let scale = a.iter().fold(0.0f64, |most, a| most.max(a.abs()));
        for (i, (a, found)) in a.iter().zip(&found[k]).enumerate() {
            let same = if M::DIAGONAL { a == found } else { (a - found).abs() <= 1e-11 * scale };
            assert!(same, "{} a[{i}]: {a:e} in Rust, {found:e} in JavaScript", M::NAME);
        }
        let energies = model.energies(state.view());
        let found = [kinetic[k][0], potential[k][0]];
        assert_eq!([energies.kinetic, energies.potential], found, "{}", M::NAME);
        compared += a.len() + 2;
    }
    compared + outputs(model, &engine, &states, &given)
}

/// Outputs are functions of Rust there, and printed as expressions here.
fn outputs<M: OpenFamilyLive>(
    model: &M,
    engine: &Engine,
    states: &[M::State],
    given: &[[Vec<f64>; 7]],
) -> usize {
    if M::OUTPUTS.is_empty() {
        return 0;
    }
    let found = engine.evaluate("outputs", &model.parameters(), given);
    let mut compared = 0;
    for (state, found) in states.iter().zip(&found) {
        let jets = M::coordinates(state, &vec![0.0; state.q().len()], Multipliers::default());
        let own: Vec<f64> = (0..M::OUTPUTS.len()).flat_map(|k| model.output(k, &jets)).collect();
        assert_eq!(own.len(), found.len(), "{}", M::NAME);
        for (own, found) in own.iter().zip(found) {
            assert!((own - found).abs() <= 1e-13 * (1.0 + own.abs()), "{}: {own:e} {found:e}", M::NAME);
        }
        compared += own.len();
    }
    compared
}

#[test]
fn loops_have_the_bits_of_rust() {
    let mut compared = Vec::new();
    // Short and long, so that blocks and ends of all kinds occur.
    for n in [2, 3, 9, 300, 1000] {
        let bar = bar(n);
        compared.push(compare(&bar, &bar.state().pull(0.0).build().unwrap(), 0.3));
    }
    for n in [2, 7, 600] {
        let string = string(n);
        compared.push(compare(&string, &string.state().build().unwrap(), 0.5 / n as f64));
        let pendulums = pendulums(n);
        compared.push(compare(&pendulums, &pendulums.state().build().unwrap(), 2.0));
        let bar = ConsistentBar { elements: n, length: 1.3, ea: 0.25, rho: 0.7 };
        compared.push(compare(&bar, &bar.state().build().unwrap(), 0.3));
    }
    for (rows, columns) in [(2, 2), (3, 5), (20, 31)] {
        let drum = drum(rows, columns);
        compared.push(compare(&drum, &drum.state().build().unwrap(), 0.1));
    }
    for n in [2, 12, 40] {
        let crane = crane(n);
        let hanging = crane.state().y((1..=n).map(|i| -0.3 * i as f64)).push(0.0).build().unwrap();
        compared.push(compare(&crane, &hanging, 0.1));
        let wagon = wagon(n);
        compared.push(compare(&wagon, &wagon.state().build().unwrap(), 0.1));
    }
    eprintln!("{} numbers of {} models", compared.iter().sum::<usize>(), compared.len());
}

/// The end of a motion in the scripts: q and u.
fn moved<M: OpenFamilyLive>(model: &M, start: &M::State, method: &str, step: f64, end: f64) -> [Vec<f64>; 2] {
    let engine = Engine::of_family(&model.live(start.clone()));
    let inputs = start.inputs();
    let ends: Vec<Vec<f64>> = engine.run(&format!(
        "(() => {{
            const motion = new Motion(PROGRAMS, MODEL), [{{ t, q, u }}] = MODEL.starts;
            const refused = motion.start(t, q, u, {inputs:?}, []);
            if (refused) throw new Error(refused);
            while (motion.t < {end}) {{
                if (!motion.step('{method}', {step}, {end})) throw new Error(motion.reason);
            }}
            return [Array.from(motion.q), Array.from(motion.u)];
        }})()"
    ));
    ends.try_into().unwrap()
}

#[test]
fn fixed_steps_have_the_bits_of_runs() {
    let bar = bar(300);
    let bump = (0..300).map(|i| 0.1 * (-((i as f64 - 100.0) / 20.0).powi(2)).exp());
    let start = bar.state().s(bump).pull(0.3).build().unwrap();
    let (step, end) = (2f64.powi(-9), 1.0);
    let motion = bar.simulate(start.clone()).until(end).method(methods::Rk4).fixed_step(step).run().unwrap();
    let [q, u] = moved(&bar, &start, "rk4", step, end);
    assert_eq!((motion.end().q(), motion.end().u()), (&q[..], &u[..]));
    let string = string(40);
    let start = string.state().w((0..40).map(|i| 0.01 * f64::from(i.min(39 - i)))).build().unwrap();
    let step = 2f64.powi(-10);
    let run = string.simulate(start.clone()).until(0.5).method(methods::Rk4).fixed_step(step);
    let motion = run.run().unwrap();
    let [q, u] = moved(&string, &start, "rk4", step, 0.5);
    assert_eq!((motion.end().q(), motion.end().u()), (&q[..], &u[..]));
    // Runs add the kick of each element at the rim by itself, the scripts that of all together.
    let drum = drum(15, 12);
    let start = drum.state().w((0..180).map(|i| 0.05 * (f64::from(i) / 7.0).sin())).build().unwrap();
    let run = drum.simulate(start.clone()).until(0.5).method(methods::StormerVerlet).fixed_step(step);
    let motion = run.run().unwrap();
    let [q, u] = moved(&drum, &start, "verlet", step, 0.5);
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off(motion.end().q(), &q) < 1e-14 && off(motion.end().u(), &u) < 1e-12);
}

#[test]
fn the_longest_step_is_that_of_the_library() {
    let engine_bound = |engine: &Engine, method: &str| -> f64 {
        engine.run(&format!(
            "(() => {{
                const motion = new Motion(PROGRAMS, MODEL), [{{ t, q, u, w }}] = MODEL.starts;
                motion.start(t, q, u, w, []);
                return motion.longest_step('{method}');
            }})()"
        ))
    };
    let close =
        |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    let consistent = ConsistentBar { elements: 50, length: 1.0, ea: 2.0, rho: 0.5 };
    let start = consistent.state().build().unwrap();
    let engine = Engine::of_family(&consistent.live(start.clone()));
    close(engine_bound(&engine, "verlet"), consistent.longest_step(&start).unwrap());
    let bar = bar(64);
    let start = bar.state().pull(0.0).build().unwrap();
    let engine = Engine::of_family(&bar.live(start.clone()));
    close(engine_bound(&engine, "verlet"), bar.longest_step(&start).unwrap());
    // M is not dominant on its diagonal: an enclosure, from below of the step.
    let crane = crane(12);
    let start = crane.state().y((1..=12).map(|i| -0.3 * f64::from(i))).push(0.0).build().unwrap();
    let engine = Engine::of_family(&crane.live(start.clone()));
    let part = engine_bound(&engine, "verlet") / crane.longest_step(&start).unwrap();
    assert!(part > 0.99 && part < 1.0 + 1e-6, "{part}");
    // Nor here; the wheel's row has the only pivot that is always positive.
    let wagon = wagon(12);
    let start = wagon.state().build().unwrap();
    let engine = Engine::of_family(&wagon.live(start.clone()));
    let part = engine_bound(&engine, "verlet") / wagon.longest_step(&start).unwrap();
    assert!(part > 0.99 && part < 1.0 + 1e-6, "{part}");
    // With dashpots RK4 is stable at its bound, and not far beyond it.
    let wagon = Wagon { damping: 40.0, ..wagon };
    let engine = Engine::of_family(&wagon.live(start));
    let bound = engine_bound(&engine, "rk4");
    let end = |step: f64| -> f64 {
        engine.run(&format!(
            "(() => {{
                const motion = new Motion(PROGRAMS, MODEL), [{{ t, u, w }}] = MODEL.starts;
                motion.start(t, MODEL.coordinates.map((_, i) => Math.sin(i)), u, w, []);
                for (let k = 0; k < 400 && motion.step('rk4', {step}, Infinity); k++);
                return max_abs(motion.q);
            }})()"
        ))
    };
    let ends = [end(bound), end(3.0 * bound)];
    assert!(ends[0] < 10.0 && (ends[1].is_nan() || ends[1] >= 1e6), "{ends:?}, bound {bound}");
}

/// Outputs of accelerations at a state that is not that of the motion, as pages plot them.
#[test]
fn outputs_read_the_accelerations_of_other_states() {
    let script = "(() => {
        const motion = new Motion(PROGRAMS, MODEL), [{ t, q, u, w }] = MODEL.starts;
        motion.start(t, q, u, w, []);
        const { evaluations } = motion, other = MODEL.coordinates.map((_, i) => Math.cos(i));
        const felt = motion.value('outputs', 1, Float64Array.from(other), motion.u).slice();
        const again = motion.value('outputs', 1, Float64Array.from(other), motion.u).slice();
        const at = MODEL.outputs.findIndex(({ name }) => name === 'felt');
        const same = motion.evaluations === evaluations && felt.every((x, i) => x === again[i]);
        motion.start(1, other, u, w, []);
        return [same ? 1 : 0, felt[at], motion.a[0]];
    })()";
    let passenger = Passenger { mass: 2.0, k: 30.0 };
    let engine = Engine::new(&passenger.live(passenger.state().x(0.3).build().unwrap()));
    assert_eq!(engine.run::<Vec<f64>>(script), [1.0, -15.0, -15.0]);
    let wagon = wagon(5);
    let engine = Engine::of_family(&wagon.live(wagon.state().build().unwrap()));
    let found: Vec<f64> = engine.run(script);
    assert!(found[0] == 1.0 && found[1] != 0.0 && found[1] == found[2], "{found:?}");
    let names: String = engine.run("MODEL.outputs.map(({ name }) => name).join()");
    assert_eq!(names, "pair[0],pair[1],felt,end.x,end.y");
}

/// Names that the page knows, and others that look like them.
#[test]
fn plots_have_the_names_of_the_page() {
    let bar = bar(100);
    let start = || bar.state().pull(0.0).build().unwrap();
    let refused = |name: &str| {
        let error = bar.live(start()).plot([name]).to_html().unwrap_err();
        assert!(matches!(&error, LiveError::UnknownName { name: own, .. } if own == name), "{error}");
    };
    let names =
        ["s[3].foo", "s[03]", "s[100]", "energy.zzz", "energy_rate", "wall_rate", "normal_force[100]", "s"];
    names.into_iter().for_each(refused);
    let known =
        ["s[3]", "s_rate[99]", "normal_force[99]", "wall", "energy", "kinetic energy", "potential energy"];
    assert!(bar.live(start()).plot(known).to_html().is_ok());
    let wagon = wagon(5);
    let page = |name: &str| wagon.live(wagon.state().build().unwrap()).plot([name]).to_html();
    for name in ["end.x", "pair[1]", "felt", "cart", "wheel_rate", "x_rate[4]", "power"] {
        assert!(page(name).is_ok(), "{name}");
    }
    for name in ["end", "end.z", "pair", "pair[2]", "cart[0]", "x[5]"] {
        assert!(page(name).is_err(), "{name}");
    }
    let consistent = ConsistentBar { elements: 5, length: 1.0, ea: 2.0, rho: 0.5 };
    assert!(consistent.live(consistent.state().build().unwrap()).plot(["power"]).to_html().is_err());
}

/// A step that parameters or a start make too long comes back with them, and an address that is refused does
/// not take the model's own start along.
#[test]
fn steps_stay_below_the_longest_one() {
    let bar = bar(20);
    let bump = (0..20).map(|i| 0.01 * f64::from(i));
    let start = bar.state().s(bump).pull(0.0).build().unwrap();
    let longest = bar.longest_step(&start).unwrap();
    let engine = play(Engine::of_family(&bar.live(start).step(0.9 * longest)), "");
    let step = |acts: &str| -> f64 { engine.run(&format!("{acts}; player.accuracy")) };
    let ea = "MODEL.parameters.findIndex(({ name }) => name === 'ea')";
    let set = |ea_value: f64| {
        step(&format!("player.change('parameters', () => {{ player.motion.p[{ea}] = {ea_value}; }})"))
    };
    assert_eq!(step(""), 0.9 * longest);
    let stiff = set(25.0);
    assert!(stiff < 0.1 * longest && stiff > 0.01 * longest, "{stiff} {longest}");
    assert_eq!(set(0.25), 0.9 * longest);
    let too_long = format!("player.change('method', () => {{ player.accuracy = {}; }})", 5.0 * longest);
    assert!(step(&too_long) < longest);
    assert!(engine.run::<bool>("METHODS.euler === undefined"));
    // What `recall` needs of the document.
    let recalled: f64 = engine.run(
        "globalThis.picture = { forget() {} };
        globalThis.toast = () => {};
        globalThis.btoa = globalThis.atob = (text) => text;
        globalThis.URLSearchParams = class extends Map {
            get(key) { return super.get(key) ?? null; }
        };
        const far = new Float64Array(2 * N).fill(0.5), start = { ...player.start, q: far.slice(0, N) };
        const [key, state] = nodesInLink({ ...start, u: far.slice(N) });
        recall([[key, state], ['ea', '-1'], ['rho', '-1']]);
        player.start.q[19]",
    );
    assert!((recalled - 0.19).abs() < 1e-12, "{recalled}");
}

#[test]
fn what_a_page_cannot_hold_is_refused_by_name() {
    let rods = Rods { links: 5, pitch: 0.2, mass: 0.1, g: 9.81 };
    let start = rods.state().y((1..=5).map(|i| -0.2 * f64::from(i))).build().unwrap();
    let error = rods.live(start).to_html().unwrap_err();
    assert!(
        matches!(error, LiveError::NotPortable { .. }) && error.to_string().contains("`link`"),
        "{error}"
    );
    let bar = bar(100);
    let start = || bar.state().pull(0.0).build().unwrap();
    let longest = bar.longest_step(&start()).unwrap();
    let error = bar.live(start()).step(1.01 * longest).to_html().unwrap_err();
    assert!(matches!(error, LiveError::FamilyStart { .. }), "{error}");
    assert!(bar.live(start()).step(0.99 * longest).to_html().is_ok());
    let error = bar.live(start()).plot(["s[100]"]).to_html().unwrap_err();
    assert!(matches!(error, LiveError::UnknownName { .. }), "{error}");
    let many = Bar { elements: 20_001, ..bar.clone() };
    let error = many.live(many.state().pull(0.0).build().unwrap()).to_html().unwrap_err();
    assert!(error.to_string().contains("20001 unknowns"), "{error}");
    let error = bar.live(start()).range("elements", 10.0, 200.0).to_html().unwrap_err();
    assert!(matches!(error, LiveError::Fixed { name: "elements" }), "{error}");
    let error = bar.live(start()).first_start("rest").start("rest", start()).to_html().unwrap_err();
    assert!(matches!(error, LiveError::TwoStarts { .. }), "{error}");
    let error = bar.live(start()).method(methods::Newmark).step(1e-3).to_html().unwrap_err();
    assert!(matches!(error, LiveError::FamilyMethod { .. }), "{error}");
}

/// A beam that is stiff along itself: the fixed point diverges, Newton's method with the banded matrix does
/// not.
#[test]
fn the_implicit_midpoint_rule_solves_banded_systems() {
    let string = GuitarString { ea: 2e4, ..string(80) };
    let start = string.state().w((0..80).map(|i| 2e-5 * f64::from(i.min(79 - i)))).build().unwrap();
    let method = methods::ImplicitMidpoint;
    let run = string.simulate(start.clone()).until(0.1).method(method).fixed_step(1e-3);
    let motion = run.run().unwrap();
    let [q, _] = moved(&string, &start, "midpoint", 1e-3, 0.1);
    let most = q.iter().zip(motion.end().q()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(most < 1e-9, "{most:e}");
}

/// The picture has what `places` has, and a dragged node stands where it was brought.
#[test]
fn nodes_are_drawn_and_dragged() {
    let string = string(30);
    let start = string.state().w((0..30).map(|i| 0.001 * f64::from(i))).build().unwrap();
    let engine = Engine::of_family(&string.live(start.clone()));
    let drawn: Vec<f64> = engine.run(
        "(() => {
            const motion = new Motion(PROGRAMS, MODEL), [{ t, q, u, w }] = MODEL.starts;
            motion.start(t, q, u, w, []);
            return Array.from(motion.value('drawing'));
        })()",
    );
    let jets = GuitarString::coordinates(&start, &[0.0; 60], Multipliers::default());
    let places: Vec<f64> = string.places(&jets)[0].points.iter().flat_map(|[x, y, _]| [*x, *y]).collect();
    assert_eq!(drawn.len(), places.len());
    assert!(drawn.iter().zip(&places).all(|(a, b)| (a - b).abs() < 1e-15));
    let left: Vec<f64> = engine.run(
        "(() => {
            const motion = new Motion(PROGRAMS, MODEL), [{ t, q, u, w }] = MODEL.starts;
            motion.start(t, q, u, w, []);
            const point = MODEL.points.findIndex(({ name }) => name === 'place[10]');
            const [x, y] = position_of_point(motion, point);
            return [motion.drag(point, [x, y + 0.05]), motion.q[30 + 9], motion.q[30 + 29], motion.q[30]];
        })()",
    );
    assert!(left[0] < 1e-9 && (left[1] - 0.059).abs() < 1e-9, "{left:?}");
    // As a string is plucked: less and less towards its ends.
    assert!(left[2] < 0.033 && left[3] > 0.0 && left[3] < 0.006, "{left:?}");
    // What is off along the given direction does not count.
    let left: Vec<f64> = engine.run(
        "(() => {
            const motion = new Motion(PROGRAMS, MODEL), [{ t, q, u, w }] = MODEL.starts;
            motion.start(t, q, u, w, []);
            const point = MODEL.points.findIndex(({ name }) => name === 'place[10]');
            const [x, y] = position_of_point(motion, point);
            const left = motion.drag(point, [x + 0.02, y + 0.05], [1, 0]);
            return [left, motion.q[30 + 9], motion.q[9]];
        })()",
    );
    assert!(left[0] < 1e-9 && (left[1] - 0.059).abs() < 1e-9 && left[2].abs() < 1e-9, "{left:?}");
}
