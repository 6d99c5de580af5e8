//! Models built directly on the graph, as the macro's elaboration would build them.
#![allow(dead_code, unreachable_pub)]

pub mod constrained;
pub mod mechanisms;
pub mod reader;
pub mod taylor;

use dynamics_symbolic::calculus::total_derivative;
use dynamics_symbolic::graph::{
    Binary, Bindings, Comparison, FunctionId, Graph, NodeId, Number, Origin, Symbol, Unary,
};
use dynamics_symbolic::mechanics::{
    Constraint, ConstraintKind, Coordinate, Energy, EnergyRole, Event, Force, ForceTerm, Function, Input,
    Model, Output, Parameter,
};

/// A model under construction, with short names for the operations.
#[derive(Default)]
pub struct Builder {
    pub model: Model,
}

impl Builder {
    pub fn new(name: &str) -> Self {
        Self { model: Model { name: name.into(), ..Model::default() } }
    }
    pub fn g(&mut self) -> &mut Graph {
        &mut self.model.graph
    }
    pub fn coordinate(&mut self, name: &str) -> NodeId {
        let i = self.model.coordinates.len() as u32;
        self.model.coordinates.push(Coordinate { name: name.into(), unit: String::new(), origin: Origin(i) });
        self.g().symbol(Symbol::Coordinate(i))
    }
    pub fn coordinates(&mut self, name: &str, n: usize) -> Vec<NodeId> {
        (0..n).map(|i| self.coordinate(&format!("{name}[{i}]"))).collect()
    }
    pub fn parameter(&mut self, name: &str) -> NodeId {
        let i = self.model.parameters.len() as u32;
        self.model.parameters.push(Parameter {
            name: name.into(),
            unit: String::new(),
            origin: Origin(100 + i),
        });
        self.g().symbol(Symbol::Parameter(i))
    }
    pub fn parameters(&mut self, name: &str, n: usize) -> Vec<NodeId> {
        (0..n).map(|i| self.parameter(&format!("{name}[{i}]"))).collect()
    }
    pub fn energy(&mut self, name: &str, role: EnergyRole, node: NodeId) {
        self.model.energies.push(Energy { name: name.into(), role, node, origin: Origin(0) });
    }
    pub fn holonomic(&mut self, name: &str, rows: &[NodeId]) {
        self.constraint(name, ConstraintKind::Holonomic, rows);
    }
    pub fn nonholonomic(&mut self, name: &str, rows: &[NodeId]) {
        self.constraint(name, ConstraintKind::Nonholonomic { integrable: false }, rows);
    }
    fn constraint(&mut self, name: &str, kind: ConstraintKind, rows: &[NodeId]) {
        let suffix = |i: usize| if rows.len() == 1 { String::new() } else { format!("[{i}]") };
        let components = rows.iter().enumerate().map(|(i, row)| (suffix(i), *row)).collect();
        self.model.constraints.push(Constraint {
            name: name.into(),
            kind,
            components,
            units: vec![String::new(); rows.len()],
            redundant: false,
            switched: false,
            origin: Origin(700 + self.model.constraints.len() as u32),
        });
    }
    pub fn ratio(&mut self, n: i128, d: i128) -> NodeId {
        self.g().number(Number::ratio(n, d))
    }
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.g().add(a, b)
    }
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.g().sub(a, b)
    }
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.g().mul(a, b)
    }
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        self.g().neg(a)
    }
    pub fn sin(&mut self, a: NodeId) -> NodeId {
        self.g().unary(Unary::Sin, a)
    }
    pub fn cos(&mut self, a: NodeId) -> NodeId {
        self.g().unary(Unary::Cos, a)
    }
    pub fn dt(&mut self, a: NodeId) -> NodeId {
        total_derivative(self.g(), &[a]).expect("positions have velocities")[0]
    }
    /// Σ aᵢ².
    pub fn norm_squared(&mut self, a: &[NodeId]) -> NodeId {
        let mut sum = self.g().zero();
        for x in a {
            let square = self.mul(*x, *x);
            sum = self.add(sum, square);
        }
        sum
    }
    /// ½ m |ẋ|².
    pub fn kinetic(&mut self, m: NodeId, position: &[NodeId]) -> NodeId {
        let v: Vec<NodeId> = position.iter().map(|x| self.dt(*x)).collect();
        let half = self.ratio(1, 2);
        let hm = self.mul(half, m);
        let square = self.norm_squared(&v);
        self.mul(hm, square)
    }
}

/// Values for the symbols of a model.
#[derive(Clone, Debug, Default)]
pub struct Values {
    pub t: f64,
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub a: Vec<f64>,
    pub w: Vec<f64>,
    pub p: Vec<f64>,
    pub lambda: Vec<f64>,
}

impl Bindings for Values {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::Time => self.t,
            Symbol::Coordinate(i) => self.q[i as usize],
            Symbol::Rate(i) => self.u[i as usize],
            Symbol::Acceleration(i) => self.a[i as usize],
            Symbol::Input(i) => self.w[i as usize],
            Symbol::Parameter(i) => self.p[i as usize],
            Symbol::Multiplier(i) => self.lambda[i as usize],
            Symbol::Mode(_) => 0.0,
        }
    }
    fn smooth(&self, _: FunctionId, order: u8, x: f64) -> f64 {
        // sin(x) + x/2.
        match order {
            0 => x.sin() + x / 2.0,
            1 => x.cos() + 0.5,
            2 => -x.sin(),
            _ => -x.cos(),
        }
    }
}

/// The double pendulum: coordinates θ₁, θ₂, parameters m₁, m₂, l₁, l₂, g.
pub fn double_pendulum() -> Model {
    let mut b = Builder::new("DoublePendulum");
    let (t1, t2) = (b.coordinate("theta1"), b.coordinate("theta2"));
    let [m1, m2, l1, l2, g] = ["m1", "m2", "l1", "l2", "g"].map(|n| b.parameter(n));
    let bob = |b: &mut Builder, l: NodeId, t: NodeId| {
        let (s, c) = (b.sin(t), b.cos(t));
        let c = b.neg(c);
        [b.mul(l, s), b.mul(l, c)]
    };
    let bob1 = bob(&mut b, l1, t1);
    let arm = bob(&mut b, l2, t2);
    let bob2 = [b.add(bob1[0], arm[0]), b.add(bob1[1], arm[1])];
    let (k1, k2) = (b.kinetic(m1, &bob1), b.kinetic(m2, &bob2));
    let kinetic = b.add(k1, k2);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let (h1, h2) = (b.mul(m1, bob1[1]), b.mul(m2, bob2[1]));
    let sum = b.add(h1, h2);
    let gravity = b.mul(g, sum);
    b.energy("gravity", EnergyRole::Potential, gravity);
    b.model
}

/// A cart with n links in absolute angles: cart mass, n masses, n lengths, g as parameters; velocities by
/// prefix sums.
pub fn chain(n: usize) -> Model {
    let mut b = Builder::new("Chain");
    let x = b.coordinate("x");
    let theta = b.coordinates("theta", n);
    let cart = b.parameter("cart");
    let m = b.parameters("m", n);
    let l = b.parameters("l", n);
    let g = b.parameter("g");
    let mut kinetic = b.kinetic(cart, &[x]);
    let mut potential = b.g().zero();
    let mut place = [x, b.g().zero()];
    for i in 0..n {
        let (s, c) = (b.sin(theta[i]), b.cos(theta[i]));
        let (dx, dy) = (b.mul(l[i], s), b.mul(l[i], c));
        place = [b.add(place[0], dx), b.sub(place[1], dy)];
        let k = b.kinetic(m[i], &place);
        kinetic = b.add(kinetic, k);
        let h = b.mul(m[i], place[1]);
        let v = b.mul(g, h);
        potential = b.add(potential, v);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.model
}

/// n rods in a plane that hang on one another, by centre and angle: 3 n coordinates, 2 n rows of pins. Mass,
/// length and inertia of all rods, g as parameters.
pub fn rods(n: usize) -> Model {
    let mut b = Builder::new("Rods");
    let places: Vec<[NodeId; 3]> =
        (0..n).map(|i| ["x", "y", "theta"].map(|name| b.coordinate(&format!("{name}[{i}]")))).collect();
    let [m, l, inertia, g] = ["m", "l", "inertia", "g"].map(|name| b.parameter(name));
    let (zero, half) = (b.g().zero(), b.ratio(1, 2));
    let (mut kinetic, mut potential) = (zero, zero);
    let (arm, weight) = (b.mul(half, l), b.mul(m, g));
    let (mut rows, mut end) = (Vec::new(), [zero, zero]);
    for [x, y, theta] in places {
        let (moved, turned) = (b.kinetic(m, &[x, y]), b.kinetic(inertia, &[theta]));
        kinetic = b.add(kinetic, moved);
        kinetic = b.add(kinetic, turned);
        let height = b.mul(weight, y);
        potential = b.add(potential, height);
        let (s, c) = (b.sin(theta), b.cos(theta));
        let (dx, dy) = (b.mul(arm, s), b.mul(arm, c));
        let upper = [b.sub(x, dx), b.add(y, dy)];
        rows.extend([b.sub(upper[0], end[0]), b.sub(upper[1], end[1])]);
        end = [b.add(x, dx), b.sub(y, dy)];
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.holonomic("pins", &rows);
    b.model
}

/// n links in relative angles: sin(q₁ + … + q_k).
pub fn relative_chain(n: usize) -> Model {
    let mut b = Builder::new("RelativeChain");
    let q = b.coordinates("q", n);
    let m = b.parameters("m", n);
    let l = b.parameters("l", n);
    let g = b.parameter("g");
    let zero = b.g().zero();
    let (mut kinetic, mut potential, mut place, mut angle) = (zero, zero, [zero, zero], zero);
    for i in 0..n {
        angle = b.add(angle, q[i]);
        let (s, c) = (b.sin(angle), b.cos(angle));
        let (dx, dy) = (b.mul(l[i], s), b.mul(l[i], c));
        place = [b.add(place[0], dx), b.sub(place[1], dy)];
        let k = b.kinetic(m[i], &place);
        kinetic = b.add(kinetic, k);
        let h = b.mul(m[i], place[1]);
        let v = b.mul(g, h);
        potential = b.add(potential, v);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.model
}

/// An n-joint spatial arm, body-frame recursion of twists: joint i turns about its z axis after a fixed
/// quarter turn about x. Parameters are per link: mass, first position p, mass centre c, inertia matrix in
/// the body frame (6 numbers); gravity.
pub fn arm(n: usize) -> Model {
    let mut b = Builder::new("Arm");
    let q = b.coordinates("q", n);
    let g = b.parameter("g");
    let zero = b.g().zero();
    let one = b.g().one();
    let half = b.ratio(1, 2);
    let mut w = [zero; 3];
    let mut v = [zero; 3];
    let mut r = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let mut place = [zero; 3];
    let (mut kinetic, mut potential) = (zero, zero);
    for i in 0..n {
        let m = b.parameter(&format!("m[{i}]"));
        let p: Vec<NodeId> = (0..3).map(|k| b.parameter(&format!("p[{i}][{k}]"))).collect();
        let c: Vec<NodeId> = (0..3).map(|k| b.parameter(&format!("c[{i}][{k}]"))).collect();
        let inertia: Vec<NodeId> = (0..6).map(|k| b.parameter(&format!("I[{i}][{k}]"))).collect();
        let turn = if i == 0 { 0 } else { [1i64, -1][i % 2] };
        let swing = cross(&mut b, w, [p[0], p[1], p[2]]);
        let vp = sum3(&mut b, v, swing);
        let lever = times(&mut b, r, [p[0], p[1], p[2]]);
        place = sum3(&mut b, place, lever);
        let (fx, minus) = (b.g().integer(turn), b.g().integer(-turn));
        let fixed = if turn == 0 {
            [[one, zero, zero], [zero, one, zero], [zero, zero, one]]
        } else {
            [[one, zero, zero], [zero, zero, minus], [zero, fx, zero]]
        };
        let (s, co) = (b.sin(q[i]), b.cos(q[i]));
        let ms = b.neg(s);
        let turn_z = [[co, ms, zero], [s, co, zero], [zero, zero, one]];
        // Columns of `rf` are the axes of the link in the previous frame.
        let rf = matrix(&mut b, fixed, turn_z);
        w = transposed_times(&mut b, rf, w);
        let rate = b.dt(q[i]);
        w[2] = b.add(w[2], rate);
        v = transposed_times(&mut b, rf, vp);
        r = matrix(&mut b, r, rf);
        let c = [c[0], c[1], c[2]];
        let swing = cross(&mut b, w, c);
        let vc = sum3(&mut b, v, swing);
        let square = b.norm_squared(&vc);
        let hm = b.mul(half, m);
        let k = b.mul(hm, square);
        kinetic = b.add(kinetic, k);
        let [xx, yy, zz, xy, xz, yz] = [0, 1, 2, 3, 4, 5].map(|k| inertia[k]);
        let spin = times(&mut b, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], w);
        let k = dot(&mut b, w, spin);
        let k = b.mul(half, k);
        kinetic = b.add(kinetic, k);
        let lever = times(&mut b, r, c);
        let height = b.add(place[2], lever[2]);
        let mg = b.mul(m, g);
        let h = b.mul(mg, height);
        potential = b.add(potential, h);
    }
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.model
}

type V3 = [NodeId; 3];
type M3 = [V3; 3];

pub fn dot(b: &mut Builder, x: V3, y: V3) -> NodeId {
    let mut sum = b.g().zero();
    for k in 0..3 {
        let product = b.mul(x[k], y[k]);
        sum = b.add(sum, product);
    }
    sum
}
pub fn cross(b: &mut Builder, x: V3, y: V3) -> V3 {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let (p, n) = (b.mul(x[i], y[j]), b.mul(x[j], y[i]));
        b.sub(p, n)
    })
}
pub fn sum3(b: &mut Builder, x: V3, y: V3) -> V3 {
    [0, 1, 2].map(|k| b.add(x[k], y[k]))
}
pub fn times(b: &mut Builder, m: M3, x: V3) -> V3 {
    m.map(|row| dot(b, row, x))
}
pub fn transposed_times(b: &mut Builder, m: M3, x: V3) -> V3 {
    [0, 1, 2].map(|k| dot(b, [m[0][k], m[1][k], m[2][k]], x))
}
pub fn matrix(b: &mut Builder, m: M3, n: M3) -> M3 {
    m.map(|row| [0, 1, 2].map(|k| dot(b, row, [n[0][k], n[1][k], n[2][k]])))
}

/// A model that uses every operation, force, input and role there is.
pub fn zoo() -> Model {
    let mut b = Builder::new("Zoo");
    let (x, phi) = (b.coordinate("x"), b.coordinate("phi_1"));
    let r = b.coordinates("r", 2);
    let [m, k, c] = ["m", "k", "c"].map(|n| b.parameter(n));
    b.model.inputs.push(Input { name: "push".into(), unit: String::new(), origin: Origin(200) });
    b.model.functions.push(Function { name: "track".into(), unit: String::new(), origin: Origin(300) });
    let (push, t) = (b.g().symbol(Symbol::Input(0)), b.g().symbol(Symbol::Time));
    let height = b.g().smooth(FunctionId(0), 0, x);
    let kinetic = b.kinetic(m, &[x, height]);
    let turn = {
        let (s, co) = (b.sin(phi), b.cos(phi));
        let place = [b.mul(r[0], s), b.mul(r[0], co), r[1]];
        b.kinetic(k, &place)
    };
    let spin = b.kinetic(c, &[phi]);
    for (name, node) in [("slide", kinetic), ("turn", turn), ("spin", spin)] {
        b.energy(name, EnergyRole::Kinetic, node);
    }
    let mut functions = b.g().zero();
    let one = b.g().one();
    let (square, sum) = (b.mul(r[0], r[0]), b.add(r[1], phi));
    let positive = b.add(one, square);
    let bounded = b.g().unary(Unary::Tanh, sum);
    for f in [
        Unary::Exp,
        Unary::Ln,
        Unary::Sqrt,
        Unary::Cbrt,
        Unary::Tan,
        Unary::Atan,
        Unary::Sinh,
        Unary::Cosh,
        Unary::Abs,
    ] {
        let value = b.g().unary(f, positive);
        functions = b.add(functions, value);
    }
    for f in [Unary::Asin, Unary::Acos] {
        let value = b.g().unary(f, bounded);
        functions = b.sub(functions, value);
    }
    for f in [Binary::Atan2, Binary::Powf, Binary::Hypot, Binary::Min, Binary::Max] {
        let value = b.g().binary(f, positive, sum);
        functions = b.add(functions, value);
    }
    let quotient = b.g().div(functions, positive).expect("not zero");
    // Both branches meet where x = φ: a potential must not jump.
    let before = b.sub(x, phi);
    let grown = b.mul(quotient, before);
    let zero = b.g().zero();
    let chosen = b.g().select(Comparison::Less, x, phi, grown, zero);
    let chosen = b.add(chosen, square);
    let driven = b.mul(push, r[0]);
    let potential = b.add(chosen, driven);
    b.energy("mixture", EnergyRole::Potential, potential);
    let rate = b.dt(x);
    let rate2 = b.mul(rate, rate);
    let lost = b.mul(c, rate2);
    b.energy("friction", EnergyRole::Dissipation, lost);
    let wave = b.sin(t);
    let gust = b.mul(k, wave);
    let along = ForceTerm::Along { expression: sum, magnitude: gust };
    let at = ForceTerm::At { point: vec![x, r[1]], vector: vec![push, gust] };
    b.model.forces.push(Force { name: "gust".into(), terms: vec![along, at], origin: Origin(400) });
    let a = b.dt(rate);
    b.model.outputs.push(Output {
        name: "felt".into(),
        components: vec![(".x".into(), a), (".y".into(), square)],
        unit: String::new(),
        origin: Origin(500),
    });
    let level = b.sub(x, one);
    b.model.events.push(Event { name: "level".into(), node: level, origin: Origin(600) });
    b.model
}

/// A bob on a massless rod in space: θ from the downward vertical, φ about it; parameters m, l, g.
pub fn spherical_pendulum() -> Model {
    let mut b = Builder::new("SphericalPendulum");
    let (theta, phi) = (b.coordinate("theta"), b.coordinate("phi"));
    let [m, l, g] = ["m", "l", "g"].map(|n| b.parameter(n));
    let (st, ct, sp, cp) = (b.sin(theta), b.cos(theta), b.sin(phi), b.cos(phi));
    let (out, down) = (b.mul(l, st), b.mul(l, ct));
    let place = [b.mul(out, cp), b.mul(out, sp), b.neg(down)];
    let kinetic = b.kinetic(m, &place);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let h = b.mul(m, place[2]);
    let gravity = b.mul(g, h);
    b.energy("gravity", EnergyRole::Potential, gravity);
    b.model
}

/// A unit mass attracted to the origin: V = −μ/r.
pub fn kepler() -> Model {
    let mut b = Builder::new("Kepler");
    let place = b.coordinates("x", 2);
    let mu = b.parameter("mu");
    let one = b.g().one();
    let kinetic = b.kinetic(one, &place);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let square = b.norm_squared(&place);
    let r = b.g().unary(Unary::Sqrt, square);
    let attraction = b.g().div(mu, r).expect("r is not zero everywhere");
    let potential = b.neg(attraction);
    b.energy("gravity", EnergyRole::Potential, potential);
    b.model
}
