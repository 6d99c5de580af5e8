//! Derived equations against equations worked out by hand.

use crate::common;

use common::{Builder, Values, arm, chain, double_pendulum, relative_chain};
use dynamics_symbolic::compile::compile;
use dynamics_symbolic::graph::{Bindings, FunctionId, NodeId, Origin, Symbol};
use dynamics_symbolic::mechanics::{
    EnergyRole, Event, Force, ForceTerm, Function, Input, Model, Output, directions,
};

#[test]
fn double_pendulum_equals_the_hand_derived_equations() {
    let compiled = compile(double_pendulum()).expect("a good model");
    let (g, e) = (&compiled.model.graph, &compiled.equations);
    let v = Values {
        q: vec![0.7, -1.1],
        u: vec![0.4, 2.3],
        p: vec![1.5, 0.8, 1.2, 0.6, 9.81],
        ..Values::default()
    };
    let [m1, m2, l1, l2, gravity] = [1.5, 0.8, 1.2, 0.6, 9.81];
    let (d, [u1, u2]) = (v.q[0] - v.q[1], [v.u[0], v.u[1]]);
    let m = [[(m1 + m2) * l1 * l1, m2 * l1 * l2 * d.cos()], [m2 * l1 * l2 * d.cos(), m2 * l2 * l2]];
    let q = [
        -m2 * l1 * l2 * d.sin() * u2 * u2 - (m1 + m2) * gravity * l1 * v.q[0].sin(),
        m2 * l1 * l2 * d.sin() * u1 * u1 - m2 * gravity * l2 * v.q[1].sin(),
    ];
    let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let a = [(m[1][1] * q[0] - m[0][1] * q[1]) / det, (m[0][0] * q[1] - m[1][0] * q[0]) / det];
    let roots: Vec<_> =
        e.mass_matrix.iter().flatten().chain(&e.generalized_force).chain(&e.accelerations).collect();
    let roots: Vec<_> = roots.into_iter().copied().collect();
    let values = g.evaluate(&roots, &v);
    let expected = [m[0][0], m[0][1], m[1][0], m[1][1], q[0], q[1], a[0], a[1]];
    for (root, x) in roots.iter().zip(expected) {
        let y = values[root.index()];
        assert!((x - y).abs() <= 1e-13 * x.abs().max(1.0), "{x} {y}");
    }
}

/// A bead on the curve y = f(x), f a smooth parameter function, pushed by an input F along x, slowed by D = ½
/// c ẋ², in a wind (W, 0) at the bead: m (1 + f′²) ẍ + m f′ f″ ẋ² + m g f′ = F + W − c ẋ.
#[test]
fn a_bead_on_a_curve_obeys_its_hand_derived_equation() {
    let mut b = Builder::new("Bead");
    let x = b.coordinate("x");
    let [m, g, c, wind] = ["m", "g", "c", "wind"].map(|n| b.parameter(n));
    b.model.functions.push(Function { name: "curve".into(), unit: String::new(), origin: Origin(1) });
    let y = b.g().smooth(FunctionId(0), 0, x);
    let kinetic = b.kinetic(m, &[x, y]);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let (my, rate) = (b.mul(m, y), b.dt(x));
    let potential = b.mul(g, my);
    b.energy("gravity", EnergyRole::Potential, potential);
    let (half, square) = (b.ratio(1, 2), b.mul(rate, rate));
    let loss = b.mul(c, square);
    let loss = b.mul(half, loss);
    b.energy("drag", EnergyRole::Dissipation, loss);
    b.model.inputs.push(Input { name: "push".into(), unit: String::new(), origin: Origin(0) });
    let (push, zero) = (b.g().symbol(Symbol::Input(0)), b.g().zero());
    let along = ForceTerm::Along { expression: x, magnitude: push };
    let at = ForceTerm::At { point: vec![x, y], vector: vec![wind, zero] };
    b.model.forces.push(Force { name: "motor".into(), terms: vec![along], origin: Origin(0) });
    b.model.forces.push(Force { name: "air".into(), terms: vec![at], origin: Origin(0) });
    let a = b.g().symbol(Symbol::Acceleration(0));
    let twice = b.add(a, a);
    let components = vec![(String::new(), twice)];
    b.model.outputs.push(Output { name: "twice".into(), components, unit: String::new(), origin: Origin(0) });
    b.model.events.push(Event { name: "level".into(), node: y, origin: Origin(0) });
    let compiled = compile(b.model).expect("a good model");
    let e = &compiled.equations;

    let v = Values {
        q: vec![0.7],
        u: vec![1.3],
        w: vec![2.5],
        p: vec![1.7, 9.81, 0.4, 0.9],
        ..Values::default()
    };
    let [slope, bend] = [1, 2].map(|order| v.smooth(FunctionId(0), order, 0.7));
    let mass = 1.7 * (1.0 + slope * slope);
    let force = 2.5 + 0.9 - 0.4 * 1.3 - 1.7 * slope * bend * 1.69 - 1.7 * 9.81 * slope;
    let jacobians = e.jacobians.as_ref().expect("small");
    let mut roots = vec![e.mass_matrix[0][0], e.generalized_force[0], e.accelerations[0], e.outputs[0].node];
    roots.extend(e.powers.iter().map(|p| p.node));
    roots.extend([jacobians.by_inputs[0][0], jacobians.by_u[0][0]]);
    let expected = [
        mass,
        force,
        force / mass,
        2.0 * force / mass,
        2.5 * 1.3,
        0.9 * 1.3,
        -0.4 * 1.69,
        1.0 / mass,
        (-0.4 - 2.0 * 1.7 * slope * bend * 1.3) / mass,
    ];
    let values = compiled.model.graph.evaluate(&roots, &v);
    assert_eq!(roots.len(), expected.len());
    for (i, (root, x)) in roots.iter().zip(expected).enumerate() {
        let y = values[root.index()];
        assert!((x - y).abs() <= 1e-13 * x.abs().max(1.0), "{i}: {x} {y}");
    }
    assert!(e.outputs_use_accelerations && !e.events_use_accelerations);
    assert_eq!(e.powers.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["motor", "air", "drag"]);
}

/// Models too large for all ways to be tried: the one that is taken is checked by difference quotients.
#[test]
fn jacobians_of_larger_models_are_difference_quotients() {
    let models: [(Model, usize); 3] = [(chain(5), 6), (relative_chain(5), 5), (arm(5), 5)];
    for (model, n) in models {
        let parameters = model.parameters.len();
        let c = compile(model).expect("a good model");
        let jacobians = c.equations.jacobians.as_ref().expect("small enough");
        let wave = |k: usize, i: usize| (1.7 * (k * 31 + i * 7 + 1) as f64).sin();
        let v = Values {
            q: (0..n).map(|i| wave(1, i)).collect(),
            u: (0..n).map(|i| wave(2, i)).collect(),
            // Positive, and inertia matrices dominated by their diagonals.
            p: (0..parameters).map(|i| 1.0 + 0.3 * wave(3, i) - if i % 13 > 9 { 0.9 } else { 0.0 }).collect(),
            ..Values::default()
        };
        let at = |nodes: &[NodeId], v: &Values| -> Vec<f64> {
            let found = c.model.graph.evaluate(nodes, v);
            nodes.iter().map(|x| found[x.index()]).collect()
        };
        let check = |rows: &[Vec<NodeId>], j: usize, shift: &dyn Fn(&mut Values, f64)| {
            let column: Vec<NodeId> = rows.iter().map(|row| row[j]).collect();
            let exact = at(&column, &v);
            let moved = |h: f64| {
                let mut moved = v.clone();
                shift(&mut moved, h);
                at(&c.equations.accelerations, &moved)
            };
            let (above, below) = (moved(1e-5), moved(-1e-5));
            let size = exact.iter().fold(1.0f64, |s, x| s.max(x.abs()));
            for ((a, b), x) in above.iter().zip(below).zip(exact) {
                let quotient = (a - b) / 2e-5;
                assert!((quotient - x).abs() <= 1e-6 * size, "{} column {j}: {quotient} {x}", c.model.name);
            }
        };
        for j in 0..n {
            check(&jacobians.by_q, j, &|v, h| v.q[j] += h);
            check(&jacobians.by_u, j, &|v, h| v.u[j] += h);
        }
        for j in 0..parameters {
            check(&jacobians.by_parameters, j, &|v, h| v.p[j] += h);
        }
    }
}

/// Rates along a direction are the Jacobians times the direction, which a state holds behind its own values.
#[test]
fn rates_along_a_direction_are_products_with_jacobians() {
    for (model, n) in [(double_pendulum(), 2), (chain(5), 6), (arm(3), 3)] {
        let parameters = model.parameters.len();
        let mut c = compile(model).expect("a good model");
        let energy = c.equations.energy_function;
        let rates = directions(&mut c.model, &c.equations, &[energy]).expect("no constraints");
        assert_eq!(rates.len(), n + 1);
        let wave = |k: usize, i: usize| (1.7 * (k * 31 + i * 7 + 1) as f64).sin();
        let joined = |k: usize, count: usize| (0..count).map(|i| wave(k, i)).collect::<Vec<f64>>();
        let masses = (0..parameters).map(|i| 1.0 + 0.3 * wave(3, i) - if i % 13 > 9 { 0.9 } else { 0.0 });
        let [dq, du, dp] = [(4, n), (5, n), (6, parameters)].map(|(k, count)| joined(k, count));
        let v = Values {
            // The rate of time is the last one.
            q: [joined(1, n), dq.clone(), vec![0.5]].concat(),
            u: [joined(2, n), du.clone()].concat(),
            p: masses.chain(dp.iter().copied()).collect(),
            ..Values::default()
        };
        let found = c.model.graph.evaluate(&rates, &v);
        let jacobians = c.equations.jacobians.as_ref().expect("small enough");
        for (i, rate) in rates[..n].iter().enumerate() {
            let rows = [&jacobians.by_q[i], &jacobians.by_u[i], &jacobians.by_parameters[i]];
            let product = |(row, direction): (&Vec<NodeId>, &Vec<f64>)| -> f64 {
                let entries = c.model.graph.evaluate(row, &v);
                row.iter().zip(direction).map(|(entry, rate)| entries[entry.index()] * rate).sum()
            };
            let expected: f64 = rows.into_iter().zip([&dq, &du, &dp]).map(product).sum();
            let rate = found[rate.index()];
            assert!((rate - expected).abs() <= 1e-10 * expected.abs().max(1.0), "{i}: {rate} {expected}");
        }
        // dE along a direction by the difference of both ends of a short way.
        let at = |h: f64| {
            let moved = |values: &[f64], rates: &[f64], count: usize| -> Vec<f64> {
                values[..count].iter().zip(rates).map(|(value, rate)| value + h * rate).collect()
            };
            let moved = Values {
                q: moved(&v.q, &dq, n),
                u: moved(&v.u, &du, n),
                p: moved(&v.p, &dp, parameters),
                ..Values::default()
            };
            c.model.graph.evaluate(&[energy], &moved)[energy.index()]
        };
        let (quotient, rate) = ((at(1e-5) - at(-1e-5)) / 2e-5, found[rates[n].index()]);
        assert!((quotient - rate).abs() <= 1e-7 * rate.abs().max(1.0), "{quotient} {rate}");
    }
}
