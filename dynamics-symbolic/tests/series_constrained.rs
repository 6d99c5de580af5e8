//! Series of motions with constraints against what they solve: the polynomials of q and λ, put into M q̈ =
//! Q + Φ_qᵀλ, Φ = 0 and A q̇ + b = 0, leave remainders that vanish with the powers of time that their orders
//! say. All of it is evaluated as it is, so that no recurrence is checked against itself.

use crate::common;

use common::mechanisms::{Mechanism, andrews, cartesian_chain, four_bar, n_four_bar, slider_crank};
use common::taylor::{eliminate, polynomial};
use common::{Builder, Values};
use dynamics_symbolic::graph::{Bindings, FunctionId, NodeId, Symbol, Unary};
use dynamics_symbolic::mechanics::{EnergyRole, Equations, Model, derive};
use dynamics_symbolic::series::{ConstrainedSeries, Series, Unexpandable, expand};

/// Order of the series.
const ORDER: usize = 12;

/// A model with its equations, its series, and a state on the constraints.
struct Case {
    name: String,
    model: Model,
    equations: Equations,
    series: Series,
    at: Values,
}

/// Symbols of the programs of one order.
#[derive(Default)]
struct Order {
    k: usize,
    time: f64,
    q: Vec<f64>,
    u: Vec<f64>,
    kept: Vec<f64>,
    sums: Vec<f64>,
    unknowns: Vec<f64>,
    shared: Vec<f64>,
}

impl Bindings for Order {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::Time => self.time,
            Symbol::Coordinate(i) => self.q[i as usize],
            Symbol::Rate(i) => self.u[i as usize],
            Symbol::Parameter(i) => self.kept[i as usize],
            Symbol::Multiplier(i) => self.sums[i as usize],
            Symbol::Acceleration(i) => self.unknowns[i as usize],
            Symbol::Mode(i) => self.shared[i as usize],
            Symbol::Input(0) => self.k as f64,
            Symbol::Input(1) => 1.0 / self.k as f64,
            other @ Symbol::Input(_) => panic!("{other:?} is no symbol of a series"),
        }
    }
    fn smooth(&self, _: FunctionId, _: u8, _: f64) -> f64 {
        unreachable!("smooth functions are not expanded")
    }
}

/// Factors of lanes, order by order.
struct Lanes {
    left: Vec<Vec<f64>>,
    right: Vec<Vec<f64>>,
}

impl Lanes {
    fn new(lanes: usize) -> Self {
        Self { left: vec![vec![0.0; lanes]], right: vec![vec![0.0; lanes]] }
    }
    fn sums(&self, k: usize) -> Vec<f64> {
        let cauchy = |i: usize| (1..k).map(|j| self.left[j][i] * self.right[k - j][i]).sum();
        (0..self.left[0].len()).map(cauchy).collect()
    }
    fn push(&mut self, factors: &[f64]) {
        let lanes = self.left[0].len();
        self.left.push(factors[..lanes].to_vec());
        self.right.push(factors[lanes..2 * lanes].to_vec());
    }
}

impl Case {
    fn new(mut model: Model, mut at: Values) -> Self {
        let equations = derive(&mut model).expect("derives");
        let name = model.name.clone();
        let series = expand(&mut model.graph, &equations).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        let n = at.q.len();
        at.a = vec![0.0; n];
        at.lambda = vec![0.0; equations.constraints.as_ref().expect("constrained").rows.len()];
        let mut case = Self { name, model, equations, series, at };
        case.settle();
        let (a, lambda) = case.solve(&case.at);
        (case.at.a, case.at.lambda) = (a, lambda);
        case
    }

    fn of(mechanism: Mechanism, speed: f64) -> Self {
        let (p, q) = (mechanism.parameters.clone(), mechanism.place.clone());
        let u = (0..q.len()).map(|i| speed * (1.0 + 1.3 * i as f64).sin()).collect();
        Self::new(mechanism.closed(), Values { p, q, u, ..Values::default() })
    }

    fn values(&self, roots: &[NodeId], at: &Values) -> Vec<f64> {
        let values = self.model.graph.evaluate(roots, at);
        roots.iter().map(|id| values[id.index()]).collect()
    }

    /// Newton's method for Φ = 0, then velocities.
    fn settle(&mut self) {
        let c = self.equations.constraints.clone().expect("constrained");
        for round in 0..12 {
            let velocities = round == 11;
            let (rows, residual) = if velocities {
                (c.rows.len(), self.values(&c.velocity_residual, &self.at))
            } else {
                (c.holonomic, self.values(&c.residual, &self.at))
            };
            let jacobian: Vec<Vec<f64>> =
                c.jacobian[..rows].iter().map(|row| self.values(row, &self.at)).collect();
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let square = jacobian.iter().map(|a| jacobian.iter().map(|b| product(a, b)).collect()).collect();
            let weights = eliminate(square, residual);
            let moved = if velocities { &mut self.at.u } else { &mut self.at.q };
            for (j, x) in moved.iter_mut().enumerate() {
                *x -= weights.iter().zip(&jacobian).map(|(w, row)| w * row[j]).sum::<f64>();
            }
        }
    }

    /// q̈ and λ.
    fn solve(&self, at: &Values) -> (Vec<f64>, Vec<f64>) {
        let c = self.equations.constraints.as_ref().expect("constrained");
        let jacobian: Vec<Vec<f64>> = c.jacobian.iter().map(|row| self.values(row, at)).collect();
        let mut matrix = Vec::new();
        for (i, row) in self.equations.mass_matrix.iter().enumerate() {
            matrix.push(self.values(row, at).into_iter().chain(jacobian.iter().map(|row| -row[i])).collect());
        }
        let none = vec![0.0; jacobian.len()];
        matrix.extend(jacobian.iter().map(|row| [row.as_slice(), &none].concat()));
        let right = [self.values(&self.equations.generalized_force, at), self.values(&c.gamma, at)].concat();
        let mut a = eliminate(matrix, right);
        let lambda = a.split_off(at.q.len());
        (a, lambda)
    }

    /// Coefficients of q and λ, time in units of `scale`, by interpreting the programs.
    fn coefficients(&self, scale: f64) -> [Vec<Vec<f64>>; 2] {
        let (s, c) = (&self.series, self.series.constrained.as_ref().expect("constrained"));
        let (n, rows) = (self.at.q.len(), self.at.lambda.len());
        let start = self.values(&s.start.results, &self.at);
        let holonomic = c.residue.results.len();
        let times = |v: &[f64], factor: f64| v.iter().map(|x| x * factor).collect::<Vec<f64>>();
        let mut q = vec![self.at.q.clone(), times(&self.at.u, scale), times(&self.at.a, 0.5 * scale * scale)];
        let mut u = vec![self.at.u.clone(), times(&self.at.a, scale)];
        let mut lambda = vec![self.at.lambda.clone()];
        let (mut lanes, mut ahead, mut shared) = (Lanes::new(s.lanes), Lanes::new(c.lanes), vec![Vec::new()]);
        for late in 1..=ORDER {
            let mut step = Order {
                k: late,
                q: q[late].clone(),
                kept: start.clone(),
                time: if late == 1 { scale } else { 0.0 },
                ..Order::default()
            };
            if late > 2 {
                let k = late - 2;
                let square = scale * scale / (late * (late - 1)) as f64;
                step.sums = ahead.sums(late);
                let residue = run(&c.graph, &c.residue.results, &step);
                assert_eq!(residue.len(), holonomic);
                let mut of_k =
                    Order { k, q: q[k].clone(), u: u[k].clone(), kept: start.clone(), ..Order::default() };
                (of_k.time, of_k.shared) = (if k == 1 { scale } else { 0.0 }, shared[k].clone());
                of_k.sums = lanes.sums(k);
                let mut right = run(&s.graph, &c.right.results, &of_k);
                right.splice(n..n, residue.iter().map(|x| -x / square));
                of_k.unknowns = right;
                let solve = c.solve.as_ref().expect("M is definite");
                of_k.unknowns = run(&s.graph, &solve.program.results, &of_k);
                lanes.push(&run(&s.graph, &s.next.results, &of_k));
                u.push(times(&of_k.unknowns[..n], scale / (k + 1) as f64));
                lambda.push(of_k.unknowns[n..n + rows].to_vec());
                q[late] = times(&of_k.unknowns[..n], square);
            }
            step.q = q[late].clone();
            step.sums = ahead.sums(late);
            let found = run(&c.graph, &c.ahead.results, &step);
            ahead.push(&found);
            shared.push(found[2 * c.lanes..].to_vec());
            q.push(vec![0.0; n]);
        }
        q.pop();
        [q, lambda]
    }

    /// The largest remainders of the equations of motion and of the constraints at time s·scale after the
    /// start, each against what it is a sum of.
    fn remainders(&self, [q, lambda]: &[Vec<Vec<f64>>; 2], scale: f64, s: f64) -> [f64; 2] {
        let jets: Vec<[f64; 3]> = (0..self.at.q.len()).map(|i| polynomial(q, i, s)).collect();
        let at = Values {
            t: self.at.t + s * scale,
            q: jets.iter().map(|x| x[0]).collect(),
            u: jets.iter().map(|x| x[1] / scale).collect(),
            a: jets.iter().map(|x| x[2] / (scale * scale)).collect(),
            lambda: (0..self.at.lambda.len()).map(|i| polynomial(lambda, i, s)[0]).collect(),
            ..self.at.clone()
        };
        let c = self.equations.constraints.as_ref().expect("constrained");
        let jacobian: Vec<Vec<f64>> = c.jacobian.iter().map(|row| self.values(row, &at)).collect();
        let force = self.values(&self.equations.generalized_force, &at);
        let mut motion = 0.0f64;
        for (i, row) in self.equations.mass_matrix.iter().enumerate() {
            let inertia = self.values(row, &at).into_iter().zip(&at.a).map(|(m, a)| m * a);
            let reaction = jacobian.iter().zip(&at.lambda).map(|(row, l)| -row[i] * l);
            let terms: Vec<f64> = inertia.chain(reaction).chain([-force[i]]).collect();
            let size: f64 = terms.iter().map(|x| x.abs()).sum();
            motion = motion.max(terms.iter().sum::<f64>().abs() / (1e-3 + size));
        }
        let places = self.values(&c.residual, &at);
        let speed = at.u.iter().fold(1.0f64, |m, u| m.max(u.abs()));
        let slips = self.values(&c.velocity_residual[c.holonomic..], &at).into_iter().map(|x| x / speed);
        let constraint = places.into_iter().chain(slips).fold(0.0f64, |m, x| m.max(x.abs()));
        [motion, constraint]
    }
}

fn run(g: &dynamics_symbolic::graph::Graph, results: &[NodeId], at: &Order) -> Vec<f64> {
    let values = g.evaluate(results, at);
    results.iter().map(|id| values[id.index()]).collect()
}

/// Asserts that the remainders fall with their powers of time, down to rounding.
fn assert_solves(case: &Case) {
    let name = &case.name;
    for scale in [0.02, -0.05] {
        let c = case.coefficients(scale);
        assert!(c.iter().flatten().flatten().all(|x| x.is_finite()), "{name}: {c:?}");
        let size = |k: usize| c[0][k].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let radius =
            (ORDER - 3..=ORDER).map(|k| size(k).powf(-1.0 / k as f64)).fold(f64::INFINITY, f64::min).min(1e3);
        let at = |part: f64| case.remainders(&c, scale, part * radius);
        let (near, half, far) = (at(0.02), at(0.125), at(0.25));
        // Φ of a polynomial of order p leaves one of order p + 1, the equations of motion two less than that.
        for (what, order, i) in [("motion", ORDER - 1, 0), ("constraints", ORDER, 1)] {
            assert!(near[i] < 1e-11, "{name}, scale {scale}, {what}: {:e} close to the start", near[i]);
            assert!(far[i] < 2e-2, "{name}, scale {scale}, {what}: {:e}, radius {radius}", far[i]);
            let least = 2f64.powi(order as i32) / 16.0;
            let (half, far) = (half[i], far[i]);
            assert!(
                half < 1e-11 || far / half > least,
                "{name}, {scale}, {what}: {half:e} → {far:e} is not order {order}"
            );
        }
    }
}

#[test]
fn mechanisms_keep_their_equations_and_constraints_in_every_coefficient() {
    let cases = [
        (andrews(), 50.0),
        (slider_crank(), 3.0),
        (four_bar(), 4.0),
        (cartesian_chain(3), 2.0),
        (n_four_bar(2), 2.0),
    ];
    for (mechanism, speed) in cases {
        assert_solves(&Case::of(mechanism, speed));
    }
}

/// A particle in space, pulled by a spring.
fn particle(name: &str) -> (Builder, [NodeId; 3]) {
    let mut b = Builder::new(name);
    let q = ["x", "y", "z"].map(|name| b.coordinate(name));
    let mass = b.parameter("m");
    let kinetic = b.kinetic(mass, &q);
    b.energy("kinetic", EnergyRole::Kinetic, kinetic);
    let (x, z) = (b.mul(q[0], q[2]), q[2]);
    let potential = b.add(x, z);
    b.energy("pull", EnergyRole::Potential, potential);
    (b, q)
}

fn values(q: [f64; 3], u: [f64; 3]) -> Values {
    Values { t: 0.3, q: q.to_vec(), u: u.to_vec(), p: vec![1.7], ..Values::default() }
}

#[test]
fn constraints_that_move_and_nonholonomic_ones_are_kept() {
    // A surface that swings: z = sin(x) cos(3t) + y².
    let (mut b, [x, y, z]) = particle("Swinging");
    let (t, three) = (b.g().symbol(Symbol::Time), b.g().integer(3));
    let angle = b.mul(three, t);
    let (height, swing, square) = (b.sin(x), b.cos(angle), b.mul(y, y));
    let (product, place) = (b.mul(height, swing), b.sub(z, square));
    let gap = b.sub(place, product);
    b.holonomic("surface", &[gap]);
    assert_solves(&Case::new(b.model, values([0.4, 0.7, 0.6], [1.0, -0.5, 0.2])));

    // A blade: ẋ y − ẏ = sin t, alone and on a sphere.
    for sphere in [false, true] {
        let (mut b, [x, y, z]) = particle(if sphere { "Blade on a sphere" } else { "Blade" });
        let t = b.g().symbol(Symbol::Time);
        let (along, across, drive) = (b.dt(x), b.dt(y), b.sin(t));
        let (product, driven) = (b.mul(along, y), b.add(across, drive));
        let slip = b.sub(product, driven);
        if sphere {
            let (square, two) = (b.norm_squared(&[x, y, z]), b.g().integer(2));
            let gap = b.sub(square, two);
            b.holonomic("sphere", &[gap]);
        }
        b.nonholonomic("blade", &[slip]);
        assert_solves(&Case::new(b.model, values([0.5, 0.8, 0.9], [1.0, -0.5, 0.2])));
    }
}

#[test]
fn functions_of_all_kinds_stand_in_constraints() {
    use Unary::{Acos, Asin, Atan, Cosh, Exp, Ln, Sinh, Sqrt, Tan, Tanh};
    for f in [Tan, Asin, Acos, Atan, Sinh, Cosh, Tanh, Exp, Ln, Sqrt] {
        let (mut b, [x, y, z]) = particle(&format!("{f:?}"));
        let curved = b.g().unary(f, x);
        let (product, height) = (b.mul(curved, y), b.sin(z));
        let gap = b.sub(product, height);
        b.holonomic("surface", &[gap]);
        assert_solves(&Case::new(b.model, values([0.5, 0.8, 0.6], [0.3, -0.5, 0.2])));
    }
}

#[test]
fn what_constraints_share_with_the_equations_of_motion_is_computed_once() {
    let case = Case::of(andrews(), 50.0);
    let c: &ConstrainedSeries = case.series.constrained.as_ref().expect("constrained");
    // Sines and cosines of seven angles and sums of them make all of Φ; M, Q and Φ_qᵀλ have no others.
    assert_eq!(c.lanes, 14);
    assert!((12..=14).contains(&c.shared), "{} shared", c.shared);
    assert!(case.series.lanes <= 48, "{} lanes", case.series.lanes);
    assert!(case.series.operations() <= 575, "{} operations", case.series.operations());
}

#[test]
fn what_repeats_itself_has_no_series() {
    let (mut b, [x, y, _]) = particle("Twice");
    let gap = b.sub(x, y);
    b.holonomic("once", &[gap]);
    b.holonomic("twice", &[gap]);
    let mut model = b.model;
    let equations = derive(&mut model).expect("derives");
    assert_eq!(expand(&mut model.graph, &equations).unwrap_err(), Unexpandable::Redundant);
}
