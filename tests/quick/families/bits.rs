//! The bits of evaluations and runs do not depend on the width of vectors, on threads, or on how a pass is
//! cut into parts. Numbers out of the range of the quick functions have their values, too. Steps allocate
//! nothing.

use allocation_counter::measure;
use dynamics::families::measured::DriftAndKick;
use dynamics::families::methods;
use dynamics::families::model::{FamilyModel, View};
use dynamics::lanes::limit_vectors;
use dynamics::prelude::*;

/// A string on angles, with springs that turn: roots, sines and numbered parameters in one element.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: [m; self.nodes], w: [m; self.nodes], turn: [rad; self.nodes + 1])]
#[units(pitch: m, k: N / m, slack: m, couple: N * m, mass: kg, spin: kg * m^2)]
struct Rope {
    nodes: usize,
    pitch: f64,
    k: f64,
    slack: f64,
    couple: f64,
    mass: Vec<f64>,
    spin: f64,
}

#[dynamics]
impl Rope {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let x = self.pitch * i as f64;
        if i == 0 || i == self.nodes + 1 { vec2(x, 0.0) } else { vec2(x + q.s[i - 1], q.w[i - 1]) }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let nodes: Expr =
            (0..self.nodes).map(|i| 0.5 * self.mass[i] * (q.s[i].dt().powi(2) + q.w[i].dt().powi(2))).sum();
        let turns: Expr = (0..self.nodes + 1).map(|i| 0.5 * self.spin * q.turn[i].dt().powi(2)).sum();
        nodes + turns
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes + 1)
            .map(|e| {
                let d = self.place(q, e + 1) - self.place(q, e);
                let along = q.turn[e].cos() * d.x + q.turn[e].sin() * d.y;
                0.5 * self.k * (d.norm() - self.slack).powi(2) - self.couple / self.pitch * along
            })
            .sum()
    }
}

/// Masses on springs, whose elements are so cheap that every node makes its own; one end is held.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [_; self.nodes])]
struct Cheap {
    nodes: usize,
    k: f64,
    beta: f64,
}

#[dynamics]
impl Cheap {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.nodes).map(|i| 0.5 * q.x[i].dt().powi(2)).sum()
    }
    #[potential]
    fn strain(&self, q: &Coordinates<Self>) -> Expr {
        let ends = 0.5 * self.k * q.x[0].powi(2);
        let inner: Expr = (0..self.nodes - 1)
            .map(|e| {
                let d = q.x[e + 1] - q.x[e];
                0.5 * self.k * d.powi(2) + 0.25 * self.beta * d.powi(4)
            })
            .sum();
        ends + inner
    }
}

fn numbers(n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|i| size * ((i * 7919 + 13) % 1009) as f64 / 1009.0 - 0.5 * size).collect()
}

fn rope(nodes: usize) -> (Rope, Vec<f64>) {
    let mass = (0..nodes).map(|i| 1.0 + 0.1 * (i % 7) as f64).collect();
    let rope = Rope { nodes, pitch: 0.5, k: 30.0, slack: 0.4, couple: 0.2, mass, spin: 0.7 };
    (rope, numbers(3 * nodes + 1, 0.3))
}

/// All that evaluations write at this width, by so many threads.
fn everything<M: FamilyModel>(model: &M, q: &[f64], bits: usize, threads: usize) -> Vec<u64> {
    limit_vectors(bits);
    let n = q.len();
    let (u, scale) = (numbers(n, 0.1), numbers(n, 2.0));
    let at = View { t: 0.3, q, u: &u, inputs: &[] };
    let mut forces = vec![f64::NAN; n];
    model.forces_by(threads, at, &mut forces);
    let mut scaled = vec![f64::NAN; n];
    model.scaled_forces_by(threads, at, &scale, &mut scaled);
    let mut kicked = u.clone();
    model.kick_by(threads, [0, usize::MAX], 0.3, [q, &[], &scale], 0.01, &mut kicked);
    let energies = model.energies(at);
    let all = [forces, scaled, kicked, vec![energies.kinetic, energies.potential]].concat();
    assert!(all.iter().all(|value| value.is_finite()));
    all.into_iter().map(f64::to_bits).collect()
}

#[test]
fn bits_do_not_depend_on_vectors_or_threads() {
    fn check<M: FamilyModel>(model: &M, q: &[f64]) {
        assert!(M::LOCAL);
        let expected = everything(model, q, 128, 1);
        for bits in [128, 256, 512] {
            for threads in [1, 2, 3, 7] {
                let found = everything(model, q, bits, threads);
                assert!(found == expected, "{bits} bit, {threads} threads, {} nodes", q.len());
            }
        }
        limit_vectors(usize::MAX);
    }
    for nodes in [3, 255, 256, 257, 1000, 70_001] {
        let (rope, q) = rope(nodes);
        check(&rope, &q);
        check(&Cheap { nodes, k: 2.0, beta: 3.0 }, &numbers(nodes, 1.0));
    }
}

/// One pass over memory has the bits of a drift of all nodes and a kick of all nodes.
#[test]
fn a_drift_and_a_kick_in_one_pass_have_the_bits_of_two() {
    let (rope, start) = rope(20_000);
    let ends = rope.ends().expect("counts");
    let scale = numbers(start.len(), 2.0);
    let step = DriftAndKick { t: 0.0, drift: 0.02, kick: 0.03, inputs: &[], scale: &scale };
    let mut expected = [start.clone(), numbers(start.len(), 0.1)];
    let mut found = expected.clone();
    for _ in 0..3 {
        let [q, u] = &mut expected;
        q.iter_mut().zip(&*u).for_each(|(q, u)| *q += step.drift * u);
        rope.kick(0.0, q, &[], &scale, step.kick, u);
        let [q, u] = &mut found;
        step.apply(&rope, 1, &ends, q, u);
    }
    assert!(found == expected && found[0] != start);
}

#[test]
fn runs_by_several_threads_have_the_bits_of_one() {
    let (rope, q) = rope(20_000);
    let n = rope.nodes;
    let state = rope.state().s(q[..n].iter().copied()).w(q[n..2 * n].iter().copied()).build();
    let state = state.expect("a state");
    let end = |method: dynamics::families::FamilyMethod, threads: usize| {
        let simulation = rope.simulate(state.clone()).until(0.1).fixed_step(0.02).method(method);
        let motion = simulation.record(Every::Last).threads(threads).run().expect("a stable step");
        motion.end().clone()
    };
    for method in [methods::StormerVerlet.into(), methods::Rk4.into()] {
        let one = end(method, 1);
        assert!(one != state && one == end(method, 2) && one == end(method, 3));
    }
}

/// Lengths whose square is below the normal numbers, and angles beyond the range of the quick sine.
#[test]
fn numbers_out_of_range_have_their_values() {
    let (rope, mut q) = rope(600);
    let n = rope.nodes;
    // Two nodes in nearly one place; the rest of their block is as before.
    (q[299], q[300], q[n + 299], q[n + 300]) = (0.0, -rope.pitch, 0.0, 1e-160);
    q[2 * n + 310] = 3.0e7;
    let zeros = vec![0.0; q.len()];
    let mut forces = zeros.clone();
    rope.forces(View { t: 0.0, q: &q, u: &zeros, inputs: &[] }, &mut forces);
    let place = |i: usize| match i {
        0 => [0.0, 0.0],
        i if i == n + 1 => [0.0, 0.0],
        i => [q[i - 1], q[n + i - 1]],
    };
    // The force of element e on its left node, and its couple.
    let element = |e: usize| {
        let ([a, b], [c, d]) = (place(e), place(e + 1));
        let (dx, dy, angle) = (rope.pitch + (c - a), d - b, q[2 * n + e]);
        let length = (dx * dx + dy * dy).sqrt();
        let pull = rope.k * (length - rope.slack) / length;
        let turn = rope.couple / rope.pitch;
        let (s, c) = angle.sin_cos();
        [pull * dx - turn * c, pull * dy - turn * s, turn * (c * dy - s * dx)]
    };
    for e in [0, 200, 299, 300, 301, 310, 311, 599, 600] {
        let right = element(e);
        let close = |found: f64, exact: f64| (found - exact).abs() < 1e-12 * (1.0 + exact.abs());
        assert!(close(forces[2 * n + e], right[2]), "{e}: {} {}", forces[2 * n + e], right[2]);
        if (1..=n).contains(&e) {
            let left = element(e - 1);
            for (k, found) in [forces[e - 1], forces[n + e - 1]].into_iter().enumerate() {
                assert!(close(found, right[k] - left[k]), "{e}: {found} {}", right[k] - left[k]);
            }
        }
    }
}

#[test]
fn steps_of_derived_families_do_not_allocate() {
    let (rope, q) = rope(10_000);
    let n = rope.nodes;
    let state = rope.state().s(q[..n].iter().copied()).w(q[n..2 * n].iter().copied()).build();
    let state = state.expect("a state");
    let allocations = |method: dynamics::families::FamilyMethod, steps: u32| {
        let h = 0.005;
        let simulation = rope.simulate(state.clone()).until(h * f64::from(steps)).fixed_step(h);
        let simulation = simulation.method(method).record(Every::Last);
        measure(|| drop(simulation.run().expect("a stable step"))).count_total
    };
    for method in [methods::StormerVerlet.into(), methods::Rk4.into(), methods::Newmark.into()] {
        assert_eq!(allocations(method, 3), allocations(method, 40), "{method}");
    }
}
