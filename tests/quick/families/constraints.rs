//! Constraints by index: chains, between families and ordinary coordinates, with masses of every structure.

use dynamics::prelude::*;

/// Beads on rods that do not stretch, from a pin at the origin; perhaps to a second pin.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.beads], y: [m; self.beads])]
#[units(pitch: m, mass: kg, g: m / s^2)]
struct Chain {
    beads: usize,
    pitch: f64,
    mass: f64,
    g: f64,
}

#[dynamics]
impl Chain {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.beads).map(|i| 0.5 * self.mass * self.bead(q, i).dt().norm_squared()).sum()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| self.mass * self.g * q.y[i]).sum()
    }
    #[holonomic]
    fn link(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.beads)
            .map(|i| {
                let rod = self.bead(q, i + 1) - self.bead(q, i);
                (rod.norm_squared() - self.pitch.powi(2)) / (2.0 * self.pitch)
            })
            .collect()
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        q.reaction(Self::link).iter().map(|&reaction| -reaction).collect()
    }
    #[output]
    fn support(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::link)[0]
    }
}

/// Released level; the reference is from absolute angles.
#[test]
fn a_released_chain_falls_as_its_angles_say() {
    let chain = Chain { beads: 20, pitch: 0.05, mass: 0.05, g: 9.81 };
    let start = chain.state().x((1..=20).map(|i| 0.05 * f64::from(i))).build().expect("finite");
    let run = chain.simulate(start).until(0.5).tolerance(1e-12).record(Every::time(0.1));
    let motion = run.run().expect("to the end");
    // x20, y20, x10, y10, tension of the first rod.
    for (t, exact) in [
        (0.2, [0.936326714051638, -0.1962, 0.4363267159365748, -0.19618518387075157, 8.286579371323235]),
        (
            0.4,
            [
                0.4801308148540587,
                -0.7847912361809692,
                0.15857739056353412,
                -0.4740388361078431,
                20.42828409953849,
            ],
        ),
        (
            0.5,
            [
                -0.20238289172838334,
                -0.864688027672253,
                -0.0006468379571294092,
                -0.49983423294776375,
                20.37012514534571,
            ],
        ),
    ] {
        let state = motion.at(t).expect("recorded");
        let tension = motion.numbered_output("tension", t).expect("an output");
        assert_eq!(tension[0], motion.output("support", t).expect("an output"));
        let found = [state.x()[19], state.y()[19], state.x()[9], state.y()[9], tension[0]];
        for (found, exact) in found.iter().zip(exact) {
            assert!((found - exact).abs() < 1e-10 * exact.abs().max(0.1), "{t}: {found} {exact}");
        }
    }
    let summary = motion.summary();
    assert!(summary.energy_drift.expect("conserved") < 1e-11);
    let constraints = summary.constraints.expect("links");
    assert_eq!((constraints.rows, constraints.system.as_str()), (20, "tridiagonal"));
    assert!(constraints.residual < 1e-13 && constraints.correction < 1e-8, "{constraints:?}");
}

/// ω² = (g/l) x, x the zeros of Laguerre's polynomial, along the chain and across; those along are held.
#[test]
fn hanging_beads_have_the_zeros_of_laguerres_polynomial() {
    let omega = [
        1.0654735901329283,
        2.449763442272203,
        3.8521041972546210,
        5.272485241643465,
        6.717024872865516,
        8.194192742122917,
        9.715200369757289,
        11.295547772675139,
        12.958254102656142,
        14.741173515764777,
        16.717265288681443,
        19.07727384732371,
    ];
    let chain = Chain { beads: 12, pitch: 1.0, mass: 0.7, g: 9.81 };
    let start = chain.state().y((1..=12).map(|i| -f64::from(i))).build().expect("finite");
    let modes = chain.modes(&start, 100).expect("modes");
    assert_eq!(modes.len(), 12);
    for (mode, exact) in modes.iter().zip(omega) {
        assert!((mode.frequency() / exact - 1.0).abs() < 1e-10, "{} {exact}", mode.frequency());
    }
    let lowest = chain.modes(&start, 2).expect("modes");
    assert!((lowest[1].frequency() / omega[1] - 1.0).abs() < 1e-10);
    // The bound holds, and is not far off.
    let longest = chain.longest_step(&start).expect("a bound");
    let exact = 2.0 / omega[11];
    assert!(longest <= exact && longest > 0.5 * exact, "{longest} {exact}");
}

/// A chain between two pins at the same height.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.beads], y: [m; self.beads])]
#[units(pitch: m, mass: kg, g: m / s^2, span: m)]
struct Garland {
    beads: usize,
    pitch: f64,
    mass: f64,
    g: f64,
    span: f64,
}

#[dynamics]
impl Garland {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 {
            vec2(0.0, 0.0)
        } else if i == self.beads + 1 {
            vec2(self.span, 0.0)
        } else {
            vec2(q.x[i - 1], q.y[i - 1])
        }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (1..=self.beads).map(|i| 0.5 * self.mass * self.bead(q, i).dt().norm_squared()).sum()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| self.mass * self.g * q.y[i]).sum()
    }
    #[holonomic]
    fn link(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.beads + 1).map(|i| (self.bead(q, i + 1) - self.bead(q, i)).norm() - self.pitch).collect()
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        q.reaction(Self::link).iter().map(|&reaction| -reaction).collect()
    }
}

#[test]
fn a_hanging_chain_is_the_discrete_catenary() {
    let chain = Garland { beads: 39, pitch: 3.0 / 40.0, mass: 0.1, g: 9.81, span: 2.0 };
    // A bent chain of about the length: the start is moved onto the constraints.
    let x: Vec<f64> = (1..40).map(|i| 0.05 * f64::from(i)).collect();
    let guess = chain.state().y(x.iter().map(|x| -x * (2.0 - x))).x(x).assemble().expect("assembled");
    let found = chain.equilibrium(&guess).expect("an equilibrium");
    assert_eq!(found.is_stable(), Some(true));
    let state = &found.state;
    let near = |value: f64, exact: f64| assert!((value - exact).abs() < 1e-12, "{value} {exact}");
    near(state.x()[19], 1.0);
    near(state.y()[19], -1.005_671_545_730_707);
    near(state.x()[9], 0.367_056_110_451_798_99);
    near(state.y()[9], -0.650_989_974_626_059_95);
    let motion = chain.simulate(state.clone()).until(0.0).run().expect("no step");
    let tension = motion.numbered_output("tension", 0.0).expect("an output");
    assert!((tension[0] / 20.759_139_865_983_046 - 1.0).abs() < 1e-12, "{}", tension[0]);
    let of_name = motion.multipliers_of("link", motion.start()).expect("a constraint");
    assert_eq!(of_name[0], -tension[0]);
    assert_eq!(motion.multipliers_of("links", state), None);
}

/// A trolley and a chain below it. Where places are relative, the trolley's inertia couples to all beads.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(cart: m, x: [m; self.beads], y: [m; self.beads])]
#[units(trolley: kg, pitch: m, mass: kg, g: m / s^2)]
struct Crane {
    beads: usize,
    trolley: f64,
    pitch: f64,
    mass: f64,
    g: f64,
    /// 1 where places are against the trolley, else 0.
    relative: f64,
}

#[dynamics]
impl Crane {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(q.cart, 0.0) } else { vec2(self.relative * q.cart + q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let beads: Expr =
            (1..=self.beads).map(|i| 0.5 * self.mass * self.bead(q, i).dt().norm_squared()).sum();
        beads + 0.5 * self.trolley * q.cart.dt().powi(2)
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| self.mass * self.g * q.y[i]).sum()
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.beads)
            .map(|i| {
                let rod = self.bead(q, i + 1) - self.bead(q, i);
                0.5 * (rod.norm_squared() - self.pitch.powi(2))
            })
            .collect()
    }
}

/// The same motion, with a mass matrix that has a border and with one that is diagonal.
#[test]
fn a_chain_on_a_trolley_moves_alike_in_both_frames() {
    let motion = |relative: f64| {
        let crane = Crane { beads: 8, trolley: 3.0, pitch: 0.25, mass: 0.5, g: 9.81, relative };
        let x = (1..=8).map(|i| 0.15 * f64::from(i));
        let start = crane.state().x(x).y((1..=8).map(|i| -0.2 * f64::from(i))).build().expect("finite");
        let motion = crane.simulate(start).until(1.0).tolerance(1e-11).record(Every::Last).run();
        let motion = motion.expect("to the end");
        let summary = motion.summary();
        assert!(summary.energy_drift.expect("conserved") < 1e-10);
        (motion.end().cart(), motion.end().x()[7] + relative * motion.end().cart(), motion.end().y()[7])
    };
    let (a, b) = (motion(1.0), motion(0.0));
    for (a, b) in [(a.0, b.0), (a.1, b.1), (a.2, b.2)] {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// A rope of springs whose ends are held apart by a motor; the sum of all stretches is fixed: one row that
/// all nodes share.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes])]
#[units(stiffness: N / m, mass: kg, length: m)]
struct Rope {
    nodes: usize,
    stiffness: f64,
    mass: f64,
    length: f64,
}

#[dynamics]
impl Rope {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass * q.s[i].dt().powi(2)).sum()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.stiffness * q.s[i].powi(2)).sum()
    }
    #[holonomic]
    fn total(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| q.s[i]).sum::<Expr>() - self.length
    }
    #[output]
    fn force(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::total)
    }
}

/// Every spring keeps its mean; what is left swings with √(k/m), whatever the sum does.
#[test]
fn a_sum_over_all_nodes_is_one_row() {
    let rope = Rope { nodes: 1000, stiffness: 4.0, mass: 1.0, length: 500.0 };
    let start: Vec<f64> = (0..1000).map(|i| 0.5 + 0.1 * f64::from(i).sin()).collect();
    let state = rope.state().s(start.iter().copied()).assemble().expect("assembled");
    let sum: f64 = state.s().iter().sum();
    assert!((sum - 500.0).abs() < 1e-10);
    let first = state.s().to_vec();
    let motion =
        rope.simulate(state).until(core::f64::consts::PI).tolerance(1e-11).run().expect("to the end");
    for (end, start) in motion.end().s().iter().zip(&first) {
        assert!((end - start).abs() < 1e-9);
    }
    let force = motion.output("force", 0.0).expect("an output");
    assert!((force - 4.0 * 0.5).abs() < 1e-12, "{force}");
}

#[test]
fn mistakes_are_told_by_name() {
    let chain = Chain { beads: 5, pitch: 0.1, mass: 1.0, g: 9.81 };
    let off = chain.state().x([0.1, 0.2, 0.3, 0.5, 0.6]).build().expect("finite");
    let error = chain.simulate(off).until(1.0).run().expect_err("off the constraints");
    assert_eq!(
        error.to_string().lines().next(),
        Some(
            "`Chain` was not simulated: the start violates `link[3]`; build it with `.assemble()`, which moves it onto the constraints, \
             or place it there"
        )
    );
    // All beads at the pin: rods have no direction.
    let error = chain.simulate(chain.state().build().expect("finite")).until(1.0).run();
    let text = error.expect_err("no direction").to_string();
    assert!(text.contains("`link[0]` follows from other constraints here"), "{text}");
    let start = chain.state().x((1..=5).map(|i| 0.1 * f64::from(i))).build().expect("finite");
    for method in [methods::StormerVerlet.into(), dynamics::families::FamilyMethod::ImplicitMidpoint] {
        let run = chain.simulate(start.clone()).until(1.0).method(method).fixed_step(1e-3).run();
        let text = run.expect_err("not for constraints").to_string();
        assert!(text.contains("it has constraints; choose methods::Rk4"), "{text}");
    }
    let motion = chain.simulate(start).until(0.1).fixed_step(1e-3).run().expect("RK4");
    assert!(motion.summary().energy_drift.expect("conserved") < 1e-9);
}

/// Displacements of beads on a straight line, all zero at the start: what is small is said by the rods.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.beads], y: [m; self.beads])]
#[units(pitch: m, mass: kg, stiffness: N / m)]
struct Stretched {
    beads: usize,
    pitch: f64,
    mass: f64,
    stiffness: f64,
}

#[dynamics]
impl Stretched {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let x = self.pitch * i as f64;
        if i == 0 { vec2(x, 0.0) } else { vec2(x + q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| 0.5 * self.mass * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2))).sum()
    }
    #[potential]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| 0.5 * self.stiffness * q.y[i].powi(2)).sum()
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (0..self.beads).map(|i| (self.bead(q, i + 1) - self.bead(q, i)).norm() - self.pitch).collect()
    }
}

#[test]
fn displacements_may_begin_at_zero() {
    for (beads, pitch) in [(3, 0.1), (8, 0.15), (30, 1.0 / 30.0), (100, 0.01)] {
        let chain = Stretched { beads, pitch, mass: 1.0, stiffness: 2.0 };
        let start = chain.state().assemble().expect("on the constraints");
        let rates = (1..=beads).map(|i| 0.1 * i as f64 * pitch);
        let moving = chain.state().y_rate(rates).build().expect("finite");
        for start in [start, moving] {
            let motion = chain.simulate(start).until(0.1).tolerance(1e-9).run().expect("to the end");
            assert!(motion.summary().energy_drift.expect("conserved") < 1e-8);
        }
    }
}

/// Rods without stiffness along themselves: the count of unstable displacements is that across them.
#[test]
fn a_hanging_chain_is_stable_and_a_standing_one_is_not() {
    let chain = Garland { beads: 9, pitch: 0.1, mass: 1.0, g: 9.81, span: 1.0 };
    // A straight chain between pins as far apart as it is long: nothing moves but by bending.
    let x: Vec<f64> = (1..10).map(|i| 0.1 * f64::from(i)).collect();
    let error = chain.equilibrium(&chain.state().x(x).build().expect("finite"));
    assert!(error.is_err() || error.is_ok_and(|found| found.is_stable() != Some(false)));
    let free = Stretched { beads: 12, pitch: 0.1, mass: 1.0, stiffness: 3.0 };
    let found = free.equilibrium(&free.state().build().expect("finite")).expect("at rest");
    assert_eq!((found.unstable, found.neutral), (Some(0), false));
    let free = Stretched { stiffness: -3.0, ..free };
    let found = free.equilibrium(&free.state().build().expect("finite")).expect("at rest");
    assert_eq!((found.unstable, found.neutral), (Some(12), false));
}

/// A chain that whirls about its pin without weight: rotation stretches it, and gives the bound.
#[test]
fn the_bound_of_a_step_knows_the_tension_of_rotation() {
    let chain = Chain { beads: 10, pitch: 0.1, mass: 1.0, g: 0.0 };
    let x = || (1..=10).map(|i| 0.1 * f64::from(i));
    let whirling = |omega: f64| chain.state().x(x()).y_rate(x().map(|x| omega * x)).build().expect("finite");
    assert!(chain.longest_step(&whirling(0.0)).expect("a bound").is_infinite());
    let (slow, fast) = (whirling(1.0), whirling(10.0));
    let [slow, fast] = [slow, fast].map(|state| chain.longest_step(&state).expect("a bound"));
    assert!((slow / fast - 10.0).abs() < 1e-9, "{slow} {fast}");
}

/// Second differences that vanish; their range is empty for one node. The pin holds the first.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes])]
#[units(mass: kg, stiffness: N / m)]
struct Straight {
    nodes: usize,
    mass: f64,
    stiffness: f64,
}

#[dynamics]
impl Straight {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass * q.s[i].dt().powi(2)).sum()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.stiffness * q.s[i].powi(2)).sum()
    }
    #[holonomic]
    fn bend(&self, q: &Coordinates<Self>) -> Vec<Expr> {
        (2..self.nodes).map(|i| q.s[i] - 2.0 * q.s[i - 1] + q.s[i - 2]).collect()
    }
    #[holonomic]
    fn pin(&self, q: &Coordinates<Self>) -> Expr {
        q.s[0]
    }
}

#[test]
fn rows_of_an_empty_range_are_none() {
    for nodes in [1, 2, 3, 40] {
        let bar = Straight { nodes, mass: 1.0, stiffness: 4.0 };
        let Ok(state) = bar.state().s((0..nodes).map(|i| i as f64)).build() else {
            // The report says how many it needs.
            assert!(nodes < 3);
            continue;
        };
        let motion = bar.simulate(state).until(1.0).run().expect("to the end");
        let rows = motion.summary().constraints.expect("a pin").rows;
        assert_eq!(rows, nodes.max(2) - 1, "{nodes}");
        // A rigid bar about its pin.
        for (i, s) in motion.end().s().iter().enumerate() {
            assert!((s - i as f64 * 2f64.cos()).abs() < 1e-7 * nodes as f64, "{nodes} {i} {s}");
        }
    }
}

/// A net of threads that do not push: beads in one place are slack, and no force is divided by zero.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.beads], y: [m; self.beads])]
#[units(length: m, mass: kg, stiffness: N / m, g: m / s^2)]
struct Thread {
    beads: usize,
    length: f64,
    mass: f64,
    stiffness: f64,
    g: f64,
}

#[dynamics]
impl Thread {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads).map(|i| 0.5 * self.mass * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2))).sum()
    }
    #[potential]
    fn energy(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..self.beads {
            let length = (self.bead(q, i + 1) - self.bead(q, i)).norm();
            sum += self.mass * self.g * q.y[i];
            sum += if length < self.length {
                Expr::ZERO
            } else {
                0.5 * self.stiffness * (length - self.length).powi(2)
            };
        }
        sum
    }
}

#[test]
fn a_slack_thread_falls_freely() {
    for beads in [2, 700] {
        let thread = Thread { beads, length: 0.3, mass: 1.0, stiffness: 1e4, g: 9.81 };
        let start = thread.state().build().expect("finite");
        let motion = thread.simulate(start).until(0.2).run().expect("to the end");
        for y in motion.end().y() {
            assert!((y + 0.5 * 9.81 * 0.04).abs() < 1e-12, "{y}");
        }
    }
}
