//! Mechanisms with closed loops, built directly on the graph: coordinates, energies, and Φ as plain nodes.

use super::Builder;
use dynamics_symbolic::graph::Origin;
use dynamics_symbolic::graph::{NodeId, Unary};
use dynamics_symbolic::mechanics::{EnergyRole, Force, ForceTerm, Model};

/// A mechanism without the constraints that are yet to be put on it.
pub struct Mechanism {
    pub builder: Builder,
    /// Φ.
    pub residual: Vec<NodeId>,
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// A place on the manifold (to a few digits), as a start for Newton's method.
    pub place: Vec<f64>,
}

impl Mechanism {
    /// The model with its constraint, named `closure`.
    pub fn closed(self) -> Model {
        let Self { mut builder, residual, .. } = self;
        builder.holonomic("closure", &residual);
        builder.model
    }
}

type V2 = [NodeId; 2];

impl Mechanism {
    fn new(name: &str) -> Self {
        Self { builder: Builder::new(name), residual: Vec::new(), parameters: Vec::new(), place: Vec::new() }
    }
    fn coordinate(&mut self, name: &str, value: f64) -> NodeId {
        self.place.push(value);
        self.builder.coordinate(name)
    }
    fn parameter(&mut self, name: &str, value: f64) -> NodeId {
        self.parameters.push(value);
        self.builder.parameter(name)
    }
    /// (a cos φ, a sin φ).
    fn polar(&mut self, a: NodeId, angle: NodeId) -> V2 {
        let (s, c) = (self.builder.sin(angle), self.builder.cos(angle));
        [self.builder.mul(a, c), self.builder.mul(a, s)]
    }
    fn plus(&mut self, a: V2, b: V2) -> V2 {
        [self.builder.add(a[0], b[0]), self.builder.add(a[1], b[1])]
    }
    fn minus(&mut self, a: V2, b: V2) -> V2 {
        [self.builder.sub(a[0], b[0]), self.builder.sub(a[1], b[1])]
    }
    /// The vector turned by a right angle.
    fn turned(&mut self, a: V2) -> V2 {
        [self.builder.neg(a[1]), a[0]]
    }
    fn opposite(&mut self, a: V2) -> V2 {
        a.map(|x| self.builder.neg(x))
    }
    /// length · (sin γ, −cos γ): the direction of γ turned back by a right angle.
    fn back(&mut self, length: NodeId, angle: NodeId) -> V2 {
        let v = self.polar(length, angle);
        let v = self.turned(v);
        self.opposite(v)
    }
    /// ½ c (|a − b| − l)².
    fn spring(&mut self, a: V2, b: V2, c: NodeId, l: NodeId) {
        let stretch = self.minus(a, b);
        let square = self.builder.norm_squared(&stretch);
        let length = self.builder.g().unary(Unary::Sqrt, square);
        let longer = self.builder.sub(length, l);
        let square = self.builder.mul(longer, longer);
        let half = self.builder.ratio(1, 2);
        let stiffness = self.builder.mul(half, c);
        let spring = self.builder.mul(stiffness, square);
        self.builder.energy("spring", EnergyRole::Potential, spring);
    }
    fn close(&mut self, a: V2, b: V2) {
        let gap = self.minus(a, b);
        self.residual.extend(gap);
    }
    /// ½ m |ċ|² + ½ I ω².
    fn body(&mut self, total: NodeId, m: NodeId, centre: V2, inertia: NodeId, angle: NodeId) -> NodeId {
        let slide = self.builder.kinetic(m, &centre);
        let spin = self.builder.kinetic(inertia, &[angle]);
        let sum = self.builder.add(slide, spin);
        self.builder.add(total, sum)
    }
}

/// Coordinates of Andrews' squeezing mechanism, with a position that closes its loops.
const ANDREWS_COORDINATES: [(&str, f64); 7] = [
    ("beta", -0.061_713_890_014_276_45),
    ("theta", 0.0),
    ("gamma", 0.455_279_819_163_070_4),
    ("phi", 0.222_668_390_165_885_9),
    ("delta", 0.487_364_979_543_842_55),
    ("omega", -0.222_668_390_165_885_9),
    ("epsilon", 1.230_547_444_549_821_2),
];
const ANDREWS_MASSES: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const ANDREWS_INERTIAS: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
/// Lengths, and behind them the stiffness and the length of the spring and the torque of the drive.
const ANDREWS_LENGTHS: [(&str, f64); 22] = [
    ("d", 28e-3),
    ("da", 115e-4),
    ("e", 2e-2),
    ("ea", 1421e-5),
    ("rr", 7e-3),
    ("ra", 92e-5),
    ("ss", 35e-3),
    ("sa", 1874e-5),
    ("sb", 1043e-5),
    ("sc", 18e-3),
    ("sd", 2e-2),
    ("ta", 2308e-5),
    ("tb", 916e-5),
    ("u", 4e-2),
    ("ua", 1228e-5),
    ("ub", 449e-5),
    ("zf", 2e-2),
    ("zt", 4e-2),
    ("fa", 1421e-5),
    ("c0", 4530.0),
    ("l0", 7785e-5),
    ("mom", 33e-3),
];

/// Parameters with one name and numbers.
fn numbered<const N: usize>(s: &mut Mechanism, name: &str, values: [f64; N]) -> Vec<NodeId> {
    values.iter().enumerate().map(|(i, v)| s.parameter(&format!("{name}[{i}]"), *v)).collect()
}

/// Andrews' squeezing mechanism as in the test set (Mazzia, Magherini & Iavernaro): β, Θ, γ, Φ, δ, Ω, ε.
pub fn andrews() -> Mechanism {
    let mut s = Mechanism::new("Andrews");
    let q = ANDREWS_COORDINATES.map(|(name, value)| s.coordinate(name, value));
    let [beta, theta, gamma, phi, delta, omega, epsilon] = q;
    let m = numbered(&mut s, "m", ANDREWS_MASSES);
    let inertia = numbered(&mut s, "i", ANDREWS_INERTIAS);
    let a = [s.parameter("xa", -0.06934), s.parameter("ya", -0.00227)];
    let b = [s.parameter("xb", -0.03635), s.parameter("yb", 0.03273)];
    let c = [s.parameter("xc", 0.014), s.parameter("yc", 0.072)];
    let p = ANDREWS_LENGTHS.map(|(name, value)| s.parameter(name, value));
    let [d, da, e, ea, rr, ra, ss, sa, sb, sc, sd, ta, tb, u, ua, ub, zf, zt, fa, c0, l0, mom] = p;
    let turn = s.builder.add(beta, theta);
    let swing = s.builder.add(phi, delta);
    let other = s.builder.add(omega, epsilon);
    let f = s.polar(rr, beta);
    let (along_d, along_da) = (s.polar(d, turn), s.polar(da, turn));
    let e2 = s.minus(f, along_d);
    let along_ss = s.back(ss, gamma);
    let e3 = s.plus(b, along_ss);
    let g = s.polar(zt, delta);
    let g = s.plus(a, g);
    let along_e = s.back(e, swing);
    let e4 = s.plus(g, along_e);
    let h = s.back(u, epsilon);
    let h = s.plus(a, h);
    let along_zf = s.polar(zf, other);
    let e6 = s.plus(h, along_zf);
    [e3, e4, e6].into_iter().for_each(|end| s.close(e2, end));
    let c1 = s.polar(ra, beta);
    let c2 = s.minus(f, along_da);
    let (x, y) = (s.back(sa, gamma), s.polar(sb, gamma));
    let c3 = s.plus(x, y);
    let rest = s.builder.sub(e, ea);
    let along = s.back(rest, swing);
    let c4 = s.plus(g, along);
    let (x, y) = (s.polar(ta, delta), s.polar(tb, delta));
    let y = s.turned(y);
    let c5 = s.plus(x, y);
    let rest = s.builder.sub(zf, fa);
    let along = s.polar(rest, other);
    let c6 = s.plus(h, along);
    let (x, y) = (s.back(ua, epsilon), s.polar(ub, epsilon));
    let c7 = s.minus(x, y);
    let mut kinetic = s.builder.g().zero();
    let bodies = [(c1, beta), (c2, turn), (c3, gamma), (c4, swing), (c5, delta), (c6, other), (c7, epsilon)];
    for (k, (centre, angle)) in bodies.into_iter().enumerate() {
        kinetic = s.body(kinetic, m[k], centre, inertia[k], angle);
    }
    s.builder.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let (x, y) = (s.polar(sd, gamma), s.back(sc, gamma));
    let point = s.plus(x, y);
    let point = s.plus(b, point);
    s.spring(point, c, c0, l0);
    let drive = ForceTerm::Along { expression: beta, magnitude: mom };
    s.builder.model.forces.push(Force { name: "drive".into(), terms: vec![drive], origin: Origin(400) });
    s
}

/// A slider-crank: crank θ, rod φ, slider x.
pub fn slider_crank() -> Mechanism {
    let mut s = Mechanism::new("SliderCrank");
    let theta = s.coordinate("theta", 0.7);
    let phi = s.coordinate("phi", -0.272);
    let x = s.coordinate("x", 1.538);
    let numbers = [
        ("m1", 1.0),
        ("m2", 1.5),
        ("m3", 2.0),
        ("l1", 0.5),
        ("l2", 1.2),
        ("i1", 0.083),
        ("i2", 0.18),
        ("g", 9.81),
    ];
    let [m1, m2, m3, l1, l2, i1, i2, gravity] = numbers.map(|(name, value)| s.parameter(name, value));
    let half = s.builder.ratio(1, 2);
    let (h1, h2) = (s.builder.mul(half, l1), s.builder.mul(half, l2));
    let pin = s.polar(l1, theta);
    let c1 = s.polar(h1, theta);
    let arm = s.polar(h2, phi);
    let c2 = s.plus(pin, arm);
    let rod = s.polar(l2, phi);
    let end = s.plus(pin, rod);
    let zero = s.builder.g().zero();
    s.close(end, [x, zero]);
    let slide = s.builder.kinetic(m3, &[x]);
    let first = s.body(slide, m1, c1, i1, theta);
    let kinetic = s.body(first, m2, c2, i2, phi);
    s.builder.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let (w1, w2) = (s.builder.mul(m1, c1[1]), s.builder.mul(m2, c2[1]));
    let height = s.builder.add(w1, w2);
    let weight = s.builder.mul(gravity, height);
    s.builder.energy("gravity", EnergyRole::Potential, weight);
    s
}

/// A four-bar linkage in absolute angles: crank, coupler, rocker.
pub fn four_bar() -> Mechanism {
    let mut s = Mechanism::new("FourBar");
    let q: Vec<NodeId> =
        [("crank", 1.0), ("coupler", 0.45), ("rocker", 1.5)].map(|(n, v)| s.coordinate(n, v)).to_vec();
    let lengths: Vec<NodeId> =
        [1.0, 2.0, 1.8].iter().enumerate().map(|(i, v)| s.parameter(&format!("l[{i}]"), *v)).collect();
    let ground = s.parameter("ground", 2.2);
    let (m, inertia, gravity) = (s.parameter("m", 0.8), s.parameter("inertia", 0.2), s.parameter("g", 9.81));
    let half = s.builder.ratio(1, 2);
    let zero = s.builder.g().zero();
    let mut kinetic = zero;
    let mut height = zero;
    let mut ends = [[zero, zero]; 3];
    let mut centres = [[zero, zero]; 3];
    for (k, start) in [(0, [zero, zero]), (2, [ground, zero])] {
        let (full, middle) = (lengths[k], s.builder.mul(half, lengths[k]));
        let (arm, to_centre) = (s.polar(full, q[k]), s.polar(middle, q[k]));
        ends[k] = s.plus(start, arm);
        centres[k] = s.plus(start, to_centre);
    }
    let middle = s.builder.mul(half, lengths[1]);
    let (arm, to_centre) = (s.polar(lengths[1], q[1]), s.polar(middle, q[1]));
    ends[1] = s.plus(ends[0], arm);
    centres[1] = s.plus(ends[0], to_centre);
    s.close(ends[1], ends[2]);
    for k in 0..3 {
        kinetic = s.body(kinetic, m, centres[k], inertia, q[k]);
        height = s.builder.add(height, centres[k][1]);
    }
    s.builder.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let weight = s.builder.mul(m, gravity);
    let potential = s.builder.mul(weight, height);
    s.builder.energy("gravity", EnergyRole::Potential, potential);
    s
}

/// A chain of `n` point masses on massless rods, all in Cartesian coordinates.
pub fn cartesian_chain(n: usize) -> Mechanism {
    let mut s = Mechanism::new("CartesianChain");
    let (m, l, gravity) = (s.parameter("m", 1.3), s.parameter("l", 0.9), s.parameter("g", 9.81));
    let zero = s.builder.g().zero();
    let square = s.builder.mul(l, l);
    let mut last = [zero, zero];
    let (mut kinetic, mut height) = (zero, zero);
    let mut at = [0.0, 0.0];
    for i in 0..n {
        let angle = 0.4 + 0.3 * (i as f64);
        at = [at[0] + 0.9 * angle.sin(), at[1] - 0.9 * angle.cos()];
        let place = [s.coordinate(&format!("x[{i}]"), at[0]), s.coordinate(&format!("y[{i}]"), at[1])];
        let rod = s.minus(place, last);
        let length = s.builder.norm_squared(&rod);
        let gap = s.builder.sub(length, square);
        s.residual.push(gap);
        let own = s.builder.kinetic(m, &place);
        kinetic = s.builder.add(kinetic, own);
        height = s.builder.add(height, place[1]);
        last = place;
    }
    s.builder.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let weight = s.builder.mul(m, gravity);
    let potential = s.builder.mul(weight, height);
    s.builder.energy("gravity", EnergyRole::Potential, potential);
    s
}

/// `loops` four-bars in a row, every link a body with x, y of its centre and an angle: 2·loops + 1 vertical
/// or horizontal links of unit length, 3 coordinates each, two rows a joint (the first link of every loop
/// after the first is shared).
pub fn n_four_bar(loops: usize) -> Mechanism {
    let mut s = Mechanism::new("NFourBar");
    let (m, inertia, gravity) =
        (s.parameter("m", 1.0), s.parameter("inertia", 1.0 / 12.0), s.parameter("g", 9.81));
    let half = s.parameter("half", 0.5);
    let zero = s.builder.g().zero();
    let one = s.builder.g().one();
    let (mut kinetic, mut height) = (zero, zero);
    let mut link = |s: &mut Mechanism, name: &str, x: f64, y: f64, angle: f64| {
        let centre = [s.coordinate(&format!("{name}.x"), x), s.coordinate(&format!("{name}.y"), y)];
        let turn = s.coordinate(&format!("{name}.angle"), angle);
        kinetic = s.body(kinetic, m, centre, inertia, turn);
        height = s.builder.add(height, centre[1]);
        let arm = s.polar(half, turn);
        (s.minus(centre, arm), s.plus(centre, arm))
    };
    // All upright links lean by the same angle: a parallelogram away from its dead points.
    let lean = 1.2f64;
    let (dx, dy) = (0.5 * lean.cos(), 0.5 * lean.sin());
    let mut upright = link(&mut s, "upright[0]", dx, dy, lean);
    let mut ground = [zero, zero];
    s.close(upright.0, ground);
    for i in 0..loops {
        let at = i as f64;
        let coupler = link(&mut s, &format!("coupler[{i}]"), at + 0.5 + 2.0 * dx, 2.0 * dy, 0.0);
        let next = link(&mut s, &format!("upright[{}]", i + 1), at + 1.0 + dx, dy, lean);
        ground[0] = s.builder.add(ground[0], one);
        s.close(next.0, ground);
        s.close(coupler.0, upright.1);
        s.close(coupler.1, next.1);
        upright = next;
    }
    s.builder.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let weight = s.builder.mul(m, gravity);
    let potential = s.builder.mul(weight, height);
    s.builder.energy("gravity", EnergyRole::Potential, potential);
    s
}

/// Two massless links of equal length in relative angles, θ₁ and θ₂, a point mass at the end of the second,
/// and a wheel ψ that turns with the first joint: folded, the mass sits in the first joint.
pub fn folded() -> Mechanism {
    let mut s = Mechanism::new("Folded");
    let theta1 = s.coordinate("theta1", 0.4);
    let theta2 = s.coordinate("theta2", 1.0);
    let psi = s.coordinate("psi", 0.0);
    let (m, inertia) = (s.parameter("m", 1.0), s.parameter("inertia", 0.5));
    let (l1, l2) = (s.parameter("l1", 1.0), s.parameter("l2", 1.0));
    let both = s.builder.add(theta1, theta2);
    let (first, second) = (s.polar(l1, theta1), s.polar(l2, both));
    let place = s.plus(first, second);
    let slide = s.builder.kinetic(m, &place);
    let spin = s.builder.kinetic(inertia, &[psi]);
    let kinetic = s.builder.add(slide, spin);
    s.builder.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let stiff = s.builder.mul(theta1, theta1);
    s.builder.energy("spring", EnergyRole::Potential, stiff);
    let half = s.builder.ratio(1, 2);
    let geared = s.builder.mul(half, theta2);
    let gap = s.builder.sub(psi, geared);
    s.residual.push(gap);
    s
}
