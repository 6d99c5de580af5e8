//! Closed forms and values in many digits: bars, a lattice, Fermi's chain, a crane's cable, a beam that is
//! rolled up.

use dynamics::prelude::*;

/// Finite elements of a bar: clamped left, free or clamped right.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes])]
#[units(length: m, ea: N, rho: kg / m)]
struct Bar {
    nodes: usize,
    elements: f64,
    length: f64,
    ea: f64,
    rho: f64,
    /// 1 if the right end is a wall one element beyond the last node, else 0.
    wall: f64,
}

#[dynamics]
impl Bar {
    fn h(&self) -> f64 {
        self.length / self.elements
    }
    fn node(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 || i == self.nodes + 1 { Expr::ZERO } else { q.s[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.nodes + 1 {
            let (a, b) = (self.node(q, e).dt(), self.node(q, e + 1).dt());
            let there = if e == self.nodes { self.wall } else { 1.0 };
            sum += there * self.rho * self.h() / 6.0 * (a * a + a * b + b * b);
        }
        sum
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for e in 0..self.nodes + 1 {
            let there = if e == self.nodes { self.wall } else { 1.0 };
            sum += there * 0.5 * self.ea / self.h() * (self.node(q, e + 1) - self.node(q, e)).powi(2);
        }
        sum
    }
}

/// ω of mode k in closed form, with phase θ per element: ω² = 6 c²/h² (1 − cos θ)/(2 + cos θ).
#[test]
fn finite_elements_of_a_bar_have_the_frequencies_of_the_closed_form() {
    let (length, ea, rho, elements) = (2.0, 7.0, 3.0, 25.0);
    let h: f64 = length / elements;
    let closed = |theta: f64| {
        let (c, s) = (theta.cos(), ea / rho / (h * h));
        (6.0 * s * (1.0 - c) / (2.0 + c)).sqrt()
    };
    for (nodes, wall) in [(24, 1.0), (25, 0.0)] {
        let bar = Bar { nodes, elements, length, ea, rho, wall };
        let modes = bar.modes(&bar.state().build().expect("finite"), nodes).expect("modes");
        assert_eq!(modes.len(), nodes);
        for (k, mode) in modes.iter().enumerate() {
            let k = k as f64 + if wall == 1.0 { 1.0 } else { 0.5 };
            let exact = closed(k * core::f64::consts::PI / elements);
            assert!((mode.frequency() / exact - 1.0).abs() < 1e-11, "{} {exact}", mode.frequency());
        }
    }
}

/// Masses between walls, with springs that may stiffen with the stretch.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [_; self.masses])]
struct Springs {
    masses: usize,
    alpha: f64,
}

#[dynamics]
impl Springs {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 || i == self.masses + 1 { Expr::ZERO } else { q.x[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.masses).map(|i| 0.5 * q.x[i].dt().powi(2)).sum()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        (0..=self.masses)
            .map(|i| {
                let r = self.place(q, i + 1) - self.place(q, i);
                0.5 * r.powi(2) + self.alpha / 3.0 * r.powi(3)
            })
            .sum()
    }
}

/// x_n(t) = J_2n(2 t) until the front returns: Schrödinger 1914.
#[test]
fn a_displaced_mass_of_a_lattice_makes_bessel_functions() {
    let lattice = Springs { masses: 201, alpha: 0.0 };
    let start = lattice.state().x((0..201).map(|i| f64::from(u8::from(i == 100)))).build().expect("finite");
    let motion = lattice.simulate(start).until(20.0).tolerance(1e-13).run().expect("runs");
    let exact = [
        (0, 0.00736689058423728955, -0.25207663607516999841),
        (1, -0.00106497468235803960, 0.25218313354340580237),
        (5, 0.119383362782260951607, 0.087308529884174519457),
        (10, 0.127793933550848896251, -0.082505287517642226725),
        (20, 0.130780545285166722103, 0.068946792132634474142),
    ];
    for (n, x, v) in exact {
        let (own_x, own_v) = (motion.end().x()[100 + n], motion.end().x_rate()[100 + n]);
        assert!((own_x - x).abs() < 1e-11 && (own_v - v).abs() < 1e-11, "{n}: {own_x} {own_v}");
    }
}

/// Fermi, Pasta, Ulam and Tsingou 1955: energies of the linear modes of the longest waves.
#[test]
fn the_chain_of_fermi_has_its_energies_at_published_times() {
    let chain = Springs { masses: 31, alpha: 0.25 };
    let sine = |j: usize, k: usize| (core::f64::consts::PI * (j * k) as f64 / 32.0).sin();
    let start = chain.state().x((1..=31).map(|j| sine(j, 1))).build().expect("finite");
    let motion = chain
        .simulate(start)
        .until(5000.0)
        .tolerance(1e-13)
        .max_steps(10_000_000)
        .record(Every::time(1000.0))
        .run()
        .expect("runs");
    let energy = |state: &SpringsState, k: usize| {
        let part = |values: &[f64]| -> f64 {
            let all = values.iter().enumerate().map(|(i, x)| x * sine(i + 1, k));
            (2.0_f64 / 32.0).sqrt() * all.sum::<f64>()
        };
        let omega = 2.0 * (k as f64 * core::f64::consts::PI / 64.0).sin();
        0.5 * (part(state.x_rate()).powi(2) + (omega * part(state.x())).powi(2))
    };
    let reference = [
        (1000.0, [0.053_465_332_094_706_59, 0.010_775_348_382_184_217, 0.004_884_702_470_522_251]),
        (5000.0, [0.007_704_967_852_380_606, 0.058_753_093_709_359_98, 0.000_570_509_060_750_989_4]),
    ];
    for (t, energies) in reference {
        let frame = motion.nearest(t).expect("recorded");
        let state = frame.state.expect("in memory");
        assert!((frame.t - t).abs() < 1e-9);
        for (k, exact) in energies.into_iter().enumerate() {
            let own = energy(state, k + 1);
            assert!((own - exact).abs() < 1e-9, "t = {t}, mode {}: {own} {exact}", k + 1);
        }
    }
    let drift = motion.summary().energy_drift.expect("conserved");
    assert!(drift < 1e-9, "{drift}");
}

/// A crane's trolley, a cable of beads and springs, a load at its end.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(cart: m, x: [m; self.beads], y: [m; self.beads])]
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
    /// Places against the trolley: the rope's inertia couples to it.
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
            .map(|i| {
                let length = (self.place(q, i + 1) - self.place(q, i)).norm();
                0.5 * self.ea / self.pitch * (length - self.pitch).powi(2)
            })
            .sum()
    }
}

#[test]
fn a_crane_swings_with_frequencies_of_many_digits() {
    let crane = Crane { beads: 15, trolley: 5.0, bead: 0.2, load: 10.0, pitch: 0.4, ea: 2000.0, g: 9.81 };
    // The trolley rolls freely, so that an equilibrium is not unique: each spring carries what hangs below.
    let mut depth = 0.0;
    let places = (0..15).map(|i| {
        let carried = crane.g * (crane.load + crane.bead * f64::from(14 - i));
        depth -= crane.pitch * (1.0 + carried / crane.ea);
        depth
    });
    let rest = crane.state().y(places.collect::<Vec<_>>()).build().expect("finite");
    assert!((rest.y()[14] + 6.335502).abs() < 1e-12, "{}", rest.y()[14]);
    let free = crane.equilibrium(&rest).expect_err("it rolls");
    assert!(free.to_string().contains("singular at `cart`"), "{free}");
    let modes = crane.modes(&rest, 31).expect("modes");
    let exact = [
        2.199882845698961518,
        5.524711777675957825,
        8.238429229484991091,
        15.43507722587509923727,
        22.65678453594890234505,
        29.68685019469115745920,
        34.03010161477862566767,
        36.41484988668403358970,
    ];
    // The first one rolls.
    assert!(modes[0].omega_squared.abs() < 1e-7, "{}", modes[0].omega_squared);
    for (mode, exact) in modes[1..].iter().zip(exact) {
        assert!((mode.frequency() / exact - 1.0).abs() < 1e-10, "{} {exact}", mode.frequency());
    }
    let (highest, exact) = (modes[30].frequency(), 314.4966063960506699461);
    assert!((highest / exact - 1.0).abs() < 1e-10, "{highest}");
}

/// Geometrically exact planar beam, linear elements, strains in the middle; clamped, turned at its tip.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.elements], y: [m; self.elements], theta: [rad; self.elements])]
#[inputs(moment: N * m)]
#[units(length: m, ea: N, ga: N, ei: N * m^2, rho: kg / m, spin: kg * m)]
struct Beam {
    elements: usize,
    length: f64,
    ea: f64,
    ga: f64,
    ei: f64,
    rho: f64,
    spin: f64,
}

#[dynamics]
impl Beam {
    fn h(&self) -> f64 {
        self.length / self.elements as f64
    }
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 { vec2(0.0, 0.0) } else { vec2(q.x[i - 1], q.y[i - 1]) }
    }
    fn angle(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { Expr::ZERO } else { q.theta[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let (a, b) = (self.place(q, e).dt(), self.place(q, e + 1).dt());
                let (c, d) = (self.angle(q, e).dt(), self.angle(q, e + 1).dt());
                let places = self.rho * (a.dot(a) + a.dot(b) + b.dot(b));
                self.h() / 6.0 * (places + self.spin * (c * c + c * d + d * d))
            })
            .sum()
    }
    fn strains(&self, q: &Coordinates<Self>, e: usize) -> Vec3 {
        let angle = 0.5 * (self.angle(q, e) + self.angle(q, e + 1));
        let d = (self.place(q, e + 1) - self.place(q, e)) / self.h();
        let (c, s) = (angle.cos(), angle.sin());
        let curvature = (self.angle(q, e + 1) - self.angle(q, e)) / self.h();
        vec3(c * d.x + s * d.y - 1.0, c * d.y - s * d.x, self.h() * curvature)
    }
    #[potential]
    fn strain_energy(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.elements)
            .map(|e| {
                let k = self.strains(q, e);
                let bending = self.ei * (k.z / self.h()).powi(2);
                0.5 * self.h() * (self.ea * k.x.powi(2) + self.ga * k.y.powi(2) + bending)
            })
            .sum()
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta[self.elements - 1], q.moment)
    }
}

/// A moment of 2π EI/L at the tip rolls the beam up: a regular polygon, its tip at the clamp, for every
/// count.
#[test]
fn a_moment_rolls_a_beam_up() {
    let tau = 2.0 * core::f64::consts::PI;
    for elements in [3, 10, 37] {
        let beam = Beam { elements, length: 1.0, ea: 1e4, ga: 5e3, ei: 1.0, rho: 1.0, spin: 1e-3 };
        // The load grows: each equilibrium is the guess for the next.
        let mut state = beam
            .state()
            .x((1..=elements).map(|i| i as f64 / elements as f64))
            .moment(0.0)
            .build()
            .expect("finite");
        for step in 1..=40 {
            state.set_moment(tau * f64::from(step) / 40.0);
            state = beam.equilibrium(&state).expect("bends").state;
        }
        let n = elements as f64;
        for i in 0..elements {
            let turned = tau * (i + 1) as f64 / n;
            assert!((state.theta()[i] - turned).abs() < 1e-10);
            // Each element stands at the angle in its middle.
            let (mut exact_x, mut exact_y) = (0.0, 0.0);
            for k in 0..=i {
                let (sin, cos) = ((0.5 + k as f64) * tau / n).sin_cos();
                exact_x += cos / n;
                exact_y += sin / n;
            }
            assert!((state.x()[i] - exact_x).abs() < 1e-10, "{} {exact_x}", state.x()[i]);
            assert!((state.y()[i] - exact_y).abs() < 1e-10, "{} {exact_y}", state.y()[i]);
        }
        assert!(state.x()[elements - 1].hypot(state.y()[elements - 1]) < 1e-10, "the tip is at the clamp");
    }
}

/// Twice as much rolls it up twice; the branch has no limit.
#[test]
fn a_branch_turns_a_beam_over_twice() {
    let twice = 4.0 * core::f64::consts::PI;
    let beam = Beam { elements: 20, length: 1.0, ea: 1e4, ga: 5e3, ei: 1.0, rho: 1.0, spin: 1e-3 };
    let straight = beam.state().x((1..=20).map(|i| f64::from(i) / 20.0)).moment(0.0).build().expect("finite");
    let branch = beam.follow(&straight, "moment", twice, 1000).expect("a branch");
    assert_eq!(branch.ended, None);
    let last = &branch.points[branch.points.len() - 1];
    assert!(last.unstable == Some(0) && last.state.moment() == twice);
    for (i, theta) in last.state.theta().iter().enumerate() {
        assert!((theta - twice * (i + 1) as f64 / 20.0).abs() < 1e-8);
    }
    assert!(last.state.x()[19].hypot(last.state.y()[19]) < 1e-8, "the tip is at the clamp");
    let error = beam.follow(&straight, "momnt", 1.0, 10).expect_err("no such input").to_string();
    assert!(error.contains("there is no input `momnt`; did you mean `moment`?"), "{error}");
    let short = beam.follow(&straight, "moment", twice, 5).expect("a branch");
    assert!(short.points.len() == 5 && short.ended.is_some());
}

/// Bars between two supports, in a flat arch, with a load on every node.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; self.nodes], y: [m; self.nodes])]
#[inputs(load: N)]
#[units(span: m, rise: m, ea: N, mass: kg)]
struct Arch {
    nodes: usize,
    span: f64,
    rise: f64,
    ea: f64,
    mass: f64,
}

#[dynamics]
impl Arch {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        if i == 0 {
            vec2(0.0, 0.0)
        } else if i == self.nodes + 1 {
            vec2(self.span, 0.0)
        } else {
            vec2(q.x[i - 1], q.y[i - 1])
        }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * self.mass * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2))).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        // Of a bar between supports and one node: half of the span across, the rise up.
        let length = (0.25 * self.span.powi(2) + self.rise.powi(2)).sqrt();
        (0..self.nodes + 1)
            .map(|e| {
                let stretch = (self.place(q, e + 1) - self.place(q, e)).norm() - length;
                0.5 * self.ea / length * stretch.powi(2)
            })
            .sum()
    }
    #[force]
    fn weight(&self, q: &Coordinates<Self>) -> Force {
        (0..self.nodes).map(|i| Force::along(q.y[i], -q.load)).sum()
    }
}

/// Two bars snap through: the limit load has ℓ³ = a² ℓ₀, and between both limits one displacement is
/// unstable.
#[test]
fn a_branch_goes_on_behind_the_limit_load_of_two_bars() {
    let (a, rise, ea) = (1.0f64, 0.2, 1000.0);
    let arch = Arch { nodes: 1, span: 2.0 * a, rise, ea, mass: 1.0 };
    let start = arch.state().x([a]).y([rise]).load(0.0).build().expect("finite");
    let length = a.hypot(rise);
    let critical = (a * a * length).cbrt();
    let limit = 2.0 * ea * (critical * critical - a * a).sqrt() * (1.0 / critical - 1.0 / length);
    let branch = arch.follow(&start, "load", 2.0 * limit, 2000).expect("a branch");
    assert_eq!(branch.ended, None);
    let loads: Vec<f64> = branch.points.iter().map(|point| point.state.load()).collect();
    let turn = loads.windows(2).position(|pair| pair[1] < pair[0]).expect("the load turns back");
    assert!(loads[turn] <= limit * (1.0 + 1e-12) && loads[turn] > 0.99 * limit, "{} {limit}", loads[turn]);
    let (mut height, mut unstable) = (rise, 0);
    for point in &branch.points {
        let y = point.state.y()[0];
        assert!(y <= height, "the node only goes down");
        // Equilibrium by hand.
        let bar = a.hypot(y);
        let exact = 2.0 * ea * y * (1.0 / bar - 1.0 / length);
        assert!((point.state.load() - exact).abs() < 1e-8 * limit);
        let between = bar * bar * bar < a * a * length;
        if (bar - critical).abs() > 1e-6 {
            assert_eq!(point.unstable, Some(usize::from(between)), "{y}");
        }
        unstable += usize::from(between);
        height = y;
    }
    assert!(unstable > 5 && height < -rise, "{unstable} {height}");
    // From near the limit on the branch is the same: nothing is jumped over.
    for part in [0.9, 0.999_999] {
        let near = arch.state().x([a]).y([rise]).load(part * limit).build().expect("finite");
        let branch = arch.follow(&near, "load", 2.0 * limit, 5000).expect("a branch");
        assert_eq!(branch.ended, None);
        let unstable = branch.points.iter().filter(|point| point.unstable == Some(1)).count();
        assert!(unstable > 5, "{part} {unstable}");
    }
}
