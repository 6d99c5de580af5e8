//! Random graphs and models for the engine alone: deep chains, huge numbers, constants out of range, singular
//! and degenerate energies.
//!
//! Two routes: whatever the graph makes of an expression is compared with the expression computed step by
//! step in `f64`, as far as rounding lets it be known (every step is perturbed by a few units of its last
//! place; the spread of a few such runs bounds the trust, after Vignes' CESTAC).

use dynamics_symbolic::compile::{Compiled, compile};
use dynamics_symbolic::graph::{
    Binary, Bindings, Comparison, FunctionId, Graph, NodeId, Number, Origin, Symbol, Unary,
};
use dynamics_symbolic::mechanics::{
    Constraint, ConstraintKind, Coordinate, Energy, EnergyRole, Event, Force, ForceTerm, Function, Input,
    Model, Output, Parameter, Solution,
};

use crate::random::Random;
use crate::target::Outcome;

const UNARY: &[Unary] = &[
    Unary::Sin,
    Unary::Cos,
    Unary::Tan,
    Unary::Asin,
    Unary::Acos,
    Unary::Atan,
    Unary::Sinh,
    Unary::Cosh,
    Unary::Tanh,
    Unary::Exp,
    Unary::Ln,
    Unary::Sqrt,
    Unary::Cbrt,
    Unary::Abs,
    Unary::Signum,
];
const BINARY: &[Binary] = &[Binary::Atan2, Binary::Powf, Binary::Hypot, Binary::Min, Binary::Max];
const COMPARISONS: &[Comparison] = &[Comparison::Less, Comparison::LessEqual, Comparison::Equal];

/// Runs of the perturbed arithmetic.
const RUNS: usize = 4;

/// A node and what it should be worth, unperturbed first.
#[derive(Clone, Copy, Debug)]
struct Known {
    node: NodeId,
    values: [f64; RUNS],
}

struct Builder<'r> {
    graph: Graph,
    random: &'r mut Random,
    known: Vec<Known>,
}

/// The point at which expressions are compared.
struct At;

impl Bindings for At {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::Time => 0.7,
            Symbol::Coordinate(i) => 0.3 + 0.37 * f64::from(i),
            Symbol::Rate(i) => -0.9 + 0.41 * f64::from(i),
            Symbol::Acceleration(i) => 1.7 - 0.23 * f64::from(i),
            Symbol::Input(i) => 0.11 + 1.3 * f64::from(i),
            Symbol::Parameter(i) => 1.9 + 0.53 * f64::from(i),
            Symbol::Multiplier(i) => 0.6 - 0.71 * f64::from(i),
            Symbol::Mode(i) => f64::from(i % 3) - 1.0,
        }
    }
    fn smooth(&self, function: FunctionId, order: u8, x: f64) -> f64 {
        let phase = f64::from(order) * std::f64::consts::FRAC_PI_2;
        (x + phase + f64::from(function.0)).sin()
    }
}

impl Builder<'_> {
    fn pick(&mut self) -> Known {
        // Mostly what was built last: graphs grow deep, not wide.
        let n = self.known.len();
        let i =
            if self.random.one_in(3) { self.random.below(n) } else { n - 1 - self.random.below(n.min(4)) };
        self.known[i]
    }

    fn keep(&mut self, node: NodeId, exact: impl Fn(usize) -> f64) {
        let values = std::array::from_fn(|run| {
            let noise = if run == 0 { 0.0 } else { (self.random.below(9) as f64 - 4.0) * f64::EPSILON };
            // The graph knows one zero: its sign is that of +0.0.
            trusted(exact(run) * (1.0 + noise) + 0.0)
        });
        self.known.push(Known { node, values });
    }

    fn leaf(&mut self, symbols: &[Symbol]) {
        if self.random.one_in(2) && !symbols.is_empty() {
            let symbol = symbols[self.random.below(symbols.len())];
            let node = self.graph.symbol(symbol);
            return self.keep(node, |_| At.symbol(symbol));
        }
        let number = number(self.random);
        let node = self.graph.number(number);
        self.keep(node, |_| number.value());
    }

    fn step(&mut self, symbols: &[Symbol], functions: u32) {
        let (a, b) = (self.pick(), self.pick());
        let (x, y) = (a.values, b.values);
        match self.random.below(17) {
            0 | 1 => self.leaf(symbols),
            2..5 => {
                let node = self.graph.add(a.node, b.node);
                self.keep(node, |r| x[r] + y[r]);
            }
            5 | 6 => {
                let node = self.graph.sub(a.node, b.node);
                self.keep(node, |r| x[r] - y[r]);
            }
            7..10 => {
                let node = self.graph.mul(a.node, b.node);
                self.keep(node, |r| x[r] * y[r]);
            }
            10 => {
                if let Some(node) = self.graph.div(a.node, b.node) {
                    self.keep(node, |r| x[r] / y[r]);
                }
            }
            11 => {
                let node = self.graph.neg(a.node);
                self.keep(node, |r| -x[r]);
            }
            12 | 13 => {
                let f = UNARY[self.random.below(UNARY.len())];
                let node = self.graph.unary(f, a.node);
                self.keep(node, |r| unary(f, x[r]));
            }
            14 => {
                let f = BINARY[self.random.below(BINARY.len())];
                let node = self.graph.binary(f, a.node, b.node);
                self.keep(node, |r| binary(f, x[r], y[r]));
            }
            15 if functions > 0 => {
                let (f, order) =
                    (FunctionId(self.random.below(functions as usize) as u32), self.random.below(4) as u8);
                let node = self.graph.smooth(f, order, a.node);
                self.keep(node, |r| At.smooth(f, order, x[r]));
            }
            15 => {
                let n = [2, 3, -1, -2, 0, 7, -30][self.random.below(7)];
                if let Some(node) = self.graph.powi(a.node, n) {
                    self.keep(node, |r| x[r].powi(n) + 0.0 * x[r]);
                }
            }
            _ => {
                let c = COMPARISONS[self.random.below(COMPARISONS.len())];
                let (then, otherwise) = (self.pick(), self.pick());
                let node = self.graph.select(c, a.node, b.node, then.node, otherwise.node);
                let (t, o) = (then.values, otherwise.values);
                self.keep(node, |r| match compare(c, x[r], y[r]) {
                    _ if !(x[r] - y[r]).is_finite() || close(x[r], y[r]) => f64::NAN,
                    true => t[r],
                    false => o[r],
                });
            }
        }
    }
}

/// NaN for what other orders of the same steps need not agree on: magnitudes where a step overflows or
/// vanishes.
fn trusted(x: f64) -> f64 {
    if x == 0.0 || (1e-100..1e100).contains(&x.abs()) { x } else { f64::NAN }
}

/// Whether rounding decides how two values compare.
fn close(x: f64, y: f64) -> bool {
    (x - y).abs() <= 1e-6 * (x.abs() + y.abs() + 1.0)
}

fn unary(f: Unary, x: f64) -> f64 {
    match f {
        Unary::Sin => x.sin(),
        Unary::Cos => x.cos(),
        Unary::Tan => x.tan(),
        Unary::Asin => x.asin(),
        Unary::Acos => x.acos(),
        Unary::Atan => x.atan(),
        Unary::Sinh => x.sinh(),
        Unary::Cosh => x.cosh(),
        Unary::Tanh => x.tanh(),
        Unary::Exp => x.exp(),
        Unary::Ln => x.ln(),
        Unary::Sqrt => x.sqrt(),
        Unary::Cbrt => x.cbrt(),
        Unary::Abs => x.abs(),
        Unary::Signum if close(x, 0.0) => f64::NAN,
        Unary::Signum => x.signum(),
    }
}

fn binary(f: Binary, x: f64, y: f64) -> f64 {
    match f {
        _ if x.is_nan() || y.is_nan() => f64::NAN,
        // The cut along the negative axis.
        Binary::Atan2 if close(x, 0.0) && y < 1e-6 => f64::NAN,
        Binary::Atan2 => x.atan2(y),
        Binary::Powf => x.powf(y),
        Binary::Hypot => x.hypot(y),
        Binary::Min => x.min(y),
        Binary::Max => x.max(y),
    }
}

fn compare(c: Comparison, x: f64, y: f64) -> bool {
    match c {
        Comparison::Less => x < y,
        Comparison::LessEqual => x <= y,
        Comparison::Equal => x == y,
    }
}

/// Small integers, fractions, numbers at the edges of both representations.
fn number(r: &mut Random) -> Number {
    let signed = |r: &mut Random| (r.draw() >> r.below(64)) as i64;
    match r.below(12) {
        0..4 => Number::integer(r.below(7) as i64 - 3),
        4..6 => Number::ratio(r.below(41) as i128 - 20, 1 + r.below(12) as i128),
        6 => Number::integer(signed(r)),
        7 => Number::ratio(signed(r).into(), i128::from(signed(r)).abs().max(1)),
        8 => Number::integer([i64::MAX, i64::MIN, 1 << 61, (1 << 61) - 1, 1 << 62, 1 << 53][r.below(6)]),
        9 => Number::finite(f64::from_bits(r.draw())).unwrap_or(Number::ONE),
        10 => {
            let edge = [f64::MAX, f64::MIN_POSITIVE, 5e-324, -1e300, 1e-300, 9e15, 1e16, -0.0][r.below(8)];
            Number::finite(edge).unwrap_or(Number::ZERO)
        }
        _ => Number::parse(r.pick(&["0.1", "1e-7", "1e22", "123456.789", "1e-30", "9.81"]))
            .unwrap_or(Number::ONE),
    }
}

/// One random graph or model.
///
/// # Errors
/// What is wrong with what the engine made of it.
pub fn check(seed: u64) -> Result<Outcome, String> {
    let mut random = Random::new(seed);
    match random.below(8) {
        0 => expressions(&mut random),
        1 => chain(&mut random),
        _ => model(&mut random),
    }
}

/// An expression is worth what its steps are worth.
fn expressions(random: &mut Random) -> Result<Outcome, String> {
    let steps = 5 + random.below(120);
    let symbols = symbols(3, 2, 1);
    let mut b = Builder { graph: Graph::new(), random, known: Vec::new() };
    b.leaf(&symbols);
    (0..steps).for_each(|_| b.step(&symbols, 2));
    for known in &b.known {
        let [expected, perturbed @ ..] = known.values;
        let got = b.graph.evaluate(&[known.node], &At)[known.node.index()];
        let spread = perturbed.iter().map(|p| (p - expected).abs()).fold(0.0, f64::max);
        let scale = expected.abs().max(f64::MIN_POSITIVE);
        let comparable = known.values.iter().all(|v| v.is_finite()) && spread < 1e-6 * scale;
        if comparable && (got - expected).abs() > 1e6 * spread + 1e-8 * scale {
            return Err(format!("node {:?}: {got:e} by the graph, {expected:e} step by step", known.node));
        }
    }
    Ok(Outcome::Accepted)
}

/// A single operation, thousands of times; then the model of which it is the potential.
fn chain(random: &mut Random) -> Result<Outcome, String> {
    let length = 1 << random.below(13);
    let kind = random.below(6);
    let mut m = Model { name: "Chain".into(), ..Model::default() };
    declare(&mut m, 2, 1, 0, 0);
    let (q0, q1) = (m.graph.symbol(Symbol::Coordinate(0)), m.graph.symbol(Symbol::Coordinate(1)));
    let p = m.graph.symbol(Symbol::Parameter(0));
    let mut x = q0;
    for _ in 0..length {
        let g = &mut m.graph;
        x = match kind {
            0 => g.unary(Unary::Sin, x),
            1 => {
                let s = g.unary(Unary::Tanh, x);
                g.add(s, q1)
            }
            2 => {
                let s = g.mul(x, p);
                g.add(s, q1)
            }
            3 => {
                let d = g.add(x, q1);
                g.div(p, d).unwrap_or(p)
            }
            4 => g.add(x, x),
            _ => g.select(Comparison::Less, x, q1, q0, x),
        };
    }
    let (u0, u1) = (m.graph.symbol(Symbol::Rate(0)), m.graph.symbol(Symbol::Rate(1)));
    let kinetic = {
        let g = &mut m.graph;
        let (a, b) = (g.mul(u0, u0), g.mul(u1, u1));
        let sum = g.add(a, b);
        if random.one_in(2) { sum } else { g.mul(x, sum) }
    };
    let role = if random.one_in(2) { EnergyRole::Potential } else { EnergyRole::Dissipation };
    energy(&mut m, EnergyRole::Kinetic, kinetic);
    energy(&mut m, role, x);
    compiled(m)
}

/// Any expressions in any roles, mostly with some inertia.
fn model(random: &mut Random) -> Result<Outcome, String> {
    let [n, w, p, f] = [1 + random.below(5), random.below(3), random.below(4), random.below(3)];
    let mut m = Model { name: "Random".into(), ..Model::default() };
    declare(&mut m, n, p, w, f);
    let steps = 3 + random.scale(6);
    let with_inertia = !random.one_in(5);
    let lagrangian = random.one_in(4);
    let mut all = symbols(n, w, p);
    if random.one_in(4) {
        all.extend((0..n as u32).map(Symbol::Acceleration));
    }
    let mut b = Builder { graph: std::mem::take(&mut m.graph), random, known: Vec::new() };
    b.leaf(&all);
    (0..steps).for_each(|_| b.step(&all, f as u32));
    let mut kinetic = inertia(&mut b, n);
    let role = if lagrangian { EnergyRole::Lagrangian } else { EnergyRole::Kinetic };
    if !with_inertia {
        kinetic = b.pick().node;
    } else if lagrangian {
        let potential = b.pick().node;
        kinetic = b.graph.sub(kinetic, potential);
    }
    let mut nodes: Nodes = std::array::from_fn(|_| b.pick().node);
    let pieces = b.random.draw();
    m.constraints = constraints(&mut b, n);
    if !m.constraints.is_empty() {
        ask_for_reactions(&mut b, &m.constraints, pieces, &mut nodes);
    }
    m.graph = b.graph;
    energy(&mut m, role, kinetic);
    add_pieces(&mut m, pieces, lagrangian, nodes);
    compiled(m)
}

/// What a random model may have besides a kinetic energy: a potential, a dissipation, the point and the
/// magnitude of a force, an output, an event.
type Nodes = [NodeId; 6];

/// Terms of a kinetic energy for n coordinates: constant, varying, coupled, or none at all.
fn inertia(b: &mut Builder<'_>, n: usize) -> NodeId {
    let mut kinetic = b.graph.zero();
    for i in 0..n as u32 {
        let (u, q) = (b.graph.symbol(Symbol::Rate(i)), b.graph.symbol(Symbol::Coordinate(i)));
        let square = b.graph.mul(u, u);
        let term = match b.random.below(8) {
            0..4 => square,
            4 => {
                let cos = b.graph.unary(Unary::Cos, q);
                b.graph.mul(square, cos)
            }
            5 => {
                let other = b.graph.symbol(Symbol::Rate((i + 1) % n as u32));
                let sum = b.graph.add(u, other);
                b.graph.mul(sum, sum)
            }
            6 => {
                let factor = b.pick().node;
                b.graph.mul(factor, square)
            }
            _ => b.graph.zero(),
        };
        kinetic = b.graph.add(kinetic, term);
    }
    kinetic
}

/// Multiplies what may ask for reactions and modes, often for none that exist, with one of them.
fn ask_for_reactions(b: &mut Builder<'_>, constraints: &[Constraint], pieces: u64, nodes: &mut Nodes) {
    let [_, _, _, along, out, event] = nodes;
    for (bit, node) in [(64, along), (128, out), (256, event)] {
        if pieces & bit != 0 {
            let i = b.random.below(3) as u32;
            let symbol = if b.random.one_in(2) { Symbol::Multiplier(0) } else { Symbol::Mode(i) };
            let asked = symbol == Symbol::Multiplier(0)
                || constraints.iter().filter(|c| c.switched).count() > i as usize;
            let symbol = b.graph.symbol(if asked { symbol } else { Symbol::Multiplier(0) });
            *node = b.graph.mul(*node, symbol);
        }
    }
}

/// Adds the pieces whose bits are set.
fn add_pieces(m: &mut Model, pieces: u64, lagrangian: bool, [v, d, at, along, out, event]: Nodes) {
    let origin = Origin(7);
    if pieces & 1 != 0 && !lagrangian {
        energy(m, EnergyRole::Potential, v);
    }
    if pieces & 2 != 0 {
        energy(m, EnergyRole::Dissipation, d);
    }
    if pieces & 4 != 0 {
        let terms = vec![
            ForceTerm::At { point: vec![at, v], vector: vec![along, d] },
            ForceTerm::Along { expression: at, magnitude: along },
        ];
        m.forces.push(Force { name: "push".into(), terms, origin });
    }
    if pieces & 8 != 0 {
        m.outputs.push(Output {
            name: "out".into(),
            components: vec![(".x".into(), out)],
            unit: String::new(),
            origin,
        });
    }
    if pieces & 16 != 0 {
        m.events.push(Event { name: "event".into(), node: event, origin });
    }
    if pieces & 32 != 0 {
        m.nominal.push((0, f64::from_bits(pieces.rotate_left(17))));
    }
}

/// None, or some: of positions, of velocities, of anything.
fn constraints(b: &mut Builder<'_>, n: usize) -> Vec<Constraint> {
    let count = if b.random.one_in(2) { 0 } else { 1 + b.random.below(3) };
    let mut all: Vec<Constraint> = (0..count)
        .map(|k| {
            let holonomic = !b.random.one_in(3);
            let kind = match holonomic {
                true => ConstraintKind::Holonomic,
                false => ConstraintKind::Nonholonomic { integrable: b.random.one_in(2) },
            };
            let rows = 1 + b.random.below(2);
            Constraint {
                name: format!("c{k}"),
                kind,
                components: (0..rows).map(|i| (format!("[{i}]"), row(b, n, holonomic))).collect(),
                units: vec![String::new(); rows],
                redundant: b.random.one_in(3),
                switched: b.random.one_in(4),
                origin: Origin(9),
            }
        })
        .collect();
    all.sort_by_key(|c| !c.is_holonomic());
    all
}

/// Σ f(qⱼ) xᵢ with positions x for a holonomic row, velocities for a nonholonomic one; now and then
/// anything at all.
fn row(b: &mut Builder<'_>, n: usize, holonomic: bool) -> NodeId {
    if b.random.one_in(8) {
        return b.pick().node;
    }
    let mut sum = if b.random.one_in(2) { b.graph.zero() } else { b.graph.symbol(Symbol::Time) };
    for _ in 0..1 + b.random.below(4) {
        let (i, j) = (b.random.below(n) as u32, b.random.below(n) as u32);
        let x = b.graph.symbol(if holonomic { Symbol::Coordinate(i) } else { Symbol::Rate(i) });
        let q = b.graph.symbol(Symbol::Coordinate(j));
        let factor = match b.random.below(4) {
            0 => q,
            1 => b.graph.unary(Unary::Sin, q),
            2 => b.graph.unary(Unary::Cos, q),
            _ => b.graph.one(),
        };
        let term = b.graph.mul(factor, x);
        sum = if b.random.one_in(2) { b.graph.add(sum, term) } else { b.graph.sub(sum, term) };
    }
    sum
}

fn symbols(n: usize, inputs: usize, parameters: usize) -> Vec<Symbol> {
    let mut all = vec![Symbol::Time];
    all.extend((0..n as u32).flat_map(|i| [Symbol::Coordinate(i), Symbol::Rate(i)]));
    all.extend((0..inputs as u32).map(Symbol::Input));
    all.extend((0..parameters as u32).map(Symbol::Parameter));
    all
}

fn declare(m: &mut Model, n: usize, parameters: usize, inputs: usize, functions: usize) {
    let (unit, origin) = (String::new(), Origin(3));
    m.coordinates =
        (0..n).map(|i| Coordinate { name: format!("q{i}"), unit: unit.clone(), origin }).collect();
    m.parameters =
        (0..parameters).map(|i| Parameter { name: format!("p{i}"), unit: unit.clone(), origin }).collect();
    m.inputs = (0..inputs).map(|i| Input { name: format!("w{i}"), unit: unit.clone(), origin }).collect();
    m.functions =
        (0..functions).map(|i| Function { name: format!("f{i}"), unit: unit.clone(), origin }).collect();
    // What no expression reads is an error of its own, which would hide everything after it.
    m.read_elsewhere = m
        .parameters
        .iter()
        .map(|p| p.name.clone())
        .chain(m.functions.iter().map(|f| f.name.clone()))
        .collect();
}

fn energy(m: &mut Model, role: EnergyRole, node: NodeId) {
    m.energies.push(Energy { name: "energy".into(), role, node, origin: Origin(5) });
}

/// What holds of every model that the engine accepts.
fn compiled(model: Model) -> Result<Outcome, String> {
    let n = model.coordinates.len();
    let again = model.clone();
    let first = match compile(model) {
        Ok(first) => first,
        Err(findings) if findings.is_empty() => return Err("refused without a finding".into()),
        Err(_) => return Ok(Outcome::Refused),
    };
    let second = compile(again).map_err(|_| "accepted once, refused once")?;
    let texts =
        |c: &Compiled| [c.report.clone(), c.listing.clone(), c.equations_text.clone(), c.latex.clone()];
    if texts(&first) != texts(&second) {
        return Err("the same model gave two texts".into());
    }
    let mass = &first.equations.mass_matrix;
    if mass.len() != n || mass.iter().any(|row| row.len() != n) {
        return Err("M is not N×N".into());
    }
    let flat: Vec<NodeId> = mass.iter().flatten().copied().collect();
    let values = first.model.graph.evaluate(&flat, &At);
    for i in 0..n {
        for j in 0..i {
            let (a, b) = (values[mass[i][j].index()], values[mass[j][i].index()]);
            if a.is_finite() && b.is_finite() && (a - b).abs() > 1e-6 * (a.abs() + b.abs()).max(1e-100) {
                return Err(format!("M is not symmetric: {a:e} and {b:e}"));
            }
        }
    }
    solved(&first)?;
    Ok(Outcome::Accepted)
}

/// Where the equations with constraints are solved on the graph: M q̈ = Q + Φ_qᵀλ and Φ_q q̈ = γ, as
/// far as pivots let it be known.
fn solved(compiled: &Compiled) -> Result<(), String> {
    let Some(constraints) = &compiled.equations.constraints else { return Ok(()) };
    let Solution::Unrolled(unrolled) = &constraints.solution else { return Ok(()) };
    let equations = &compiled.equations;
    let mut nodes: Vec<NodeId> =
        equations.mass_matrix.iter().chain(&constraints.jacobian).flatten().copied().collect();
    nodes.extend(equations.generalized_force.iter().chain(&constraints.gamma));
    nodes.extend(unrolled.accelerations.iter().chain(&unrolled.multipliers));
    nodes.extend(unrolled.guards.iter().flat_map(|g| [g.pivot, g.scale]));
    let values = compiled.model.graph.evaluate(&nodes, &At);
    let value = |id: &NodeId| values[id.index()];
    let known = nodes.iter().all(|id| value(id).is_finite() && value(id).abs() < 1e8);
    if !known
        || unrolled.guards.iter().any(|g| value(&g.pivot).abs() < 1e-3 * value(&g.scale).abs().max(1e-3))
    {
        return Ok(());
    }
    let (a, lambda) = (&unrolled.accelerations, &unrolled.multipliers);
    let near = |left: &[f64], what: &str| {
        let (sum, size) = (left.iter().sum::<f64>(), left.iter().map(|x| x.abs()).sum::<f64>());
        let largest = a.iter().chain(lambda).map(|id| value(id).abs()).fold(1.0, f64::max);
        (sum.abs() <= 1e-7 * (size + largest))
            .then_some(())
            .ok_or_else(|| format!("{what} is missed by {sum:e} of {size:e}"))
    };
    for (i, row) in equations.mass_matrix.iter().enumerate() {
        let mut terms: Vec<f64> = row.iter().zip(a).map(|(m, a)| value(m) * value(a)).collect();
        terms.push(-value(&equations.generalized_force[i]));
        terms.extend(constraints.jacobian.iter().zip(lambda).map(|(row, l)| -value(&row[i]) * value(l)));
        near(&terms, "M q̈ = Q + Φ_qᵀλ")?;
    }
    for (row, gamma) in constraints.jacobian.iter().zip(&constraints.gamma) {
        let mut terms: Vec<f64> = row.iter().zip(a).map(|(j, a)| value(j) * value(a)).collect();
        terms.push(-value(gamma));
        near(&terms, "Φ_q q̈ = γ")?;
    }
    Ok(())
}
