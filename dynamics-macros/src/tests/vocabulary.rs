//! Every expression of the language by two routes: the same text runs on the runtime's time jets and through
//! the elaborator.

use dynamics_runtime::{Expr, Mat3, SmoothFunction, Vec2, Vec3, vec2, vec3};
use dynamics_symbolic::graph::{Bindings, FunctionId, Symbol};
use proptest::prelude::*;

use super::model;

/// Coordinates of the test model as the runtime sees them.
struct Coordinates {
    t: Expr,
    x: Expr,
    y: Expr,
    angle: [Expr; 3],
}

/// Its parameters.
#[derive(Debug)]
struct Parameters {
    a: f64,
    b: f64,
    list: [f64; 3],
    axis: Vec3<f64>,
    turn: Mat3<f64>,
    spring: Spring,
}

#[derive(Debug)]
struct Spring;
impl SmoothFunction for Spring {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        [x * x * x, 3.0 * x * x, 6.0 * x, 6.0]
    }
}

const DECLARATION: &str = "#[coordinates(x, y, angle: [_; 3])] struct Parameters {
    a: f64, b: f64, list: [f64; 3], axis: Vec3<f64>, turn: Mat3<f64>, spring: Spring
}";

/// Everything else that the checks want of a model: inertia for every coordinate, a use of every parameter.
const REST: &str = "#[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = q.x.dt().powi(2) + q.y.dt().powi(2);
        for i in 0..3 { sum += q.angle[i].dt().powi(2); }
        0.5 * sum
    }
    #[potential] fn everything(&self, q: &Coordinates<Self>) -> Expr {
        let all = self.a + self.b + self.list[0] + self.axis.x + self.turn[(0, 0)];
        q.x * all + self.spring.at(q.y)
    }";

macro_rules! vocabulary {
    (
        impl { $($other:tt)* }
        $(fn $name:ident(&$this:ident, $q:ident: &Coordinates) -> $ty:ty $body:block)*
    ) => {
        impl Parameters {
            $($other)*
            $(fn $name(&$this, $q: &Coordinates) -> $ty $body)*
        }
        /// The functions with role, as text.
        fn source() -> String {
            let mut text = String::from(stringify!($($other)*));
            $(text += concat!(
                "#[output] fn ", stringify!($name), "(&self, q: &Coordinates<Self>) -> ",
                stringify!($ty), stringify!($body)
            );)*
            text
        }
        /// Values and rates by the runtime.
        fn by_jets(p: &Parameters, q: &Coordinates) -> Vec<(&'static str, Vec<f64>)> {
            vec![$((stringify!($name), Flat::flat(&p.$name(q)))),*]
        }
    };
}

trait Flat {
    fn flat(&self) -> Vec<f64>;
}
impl Flat for Expr {
    fn flat(&self) -> Vec<f64> {
        vec![self.value()]
    }
}
impl Flat for Vec2 {
    fn flat(&self) -> Vec<f64> {
        vec![self.x.value(), self.y.value()]
    }
}
impl Flat for Vec3 {
    fn flat(&self) -> Vec<f64> {
        vec![self.x.value(), self.y.value(), self.z.value()]
    }
}
impl<const N: usize> Flat for [Expr; N] {
    fn flat(&self) -> Vec<f64> {
        self.iter().map(|e| e.value()).collect()
    }
}

vocabulary! {
    impl {
        const COUNT: usize = 3;
        const HALF: f64 = 1.0 / 2.0;
        fn place(&self, q: &Coordinates, i: usize) -> Vec2 {
            let mut p = Vec2::ZERO;
            for k in 0..=i {
                p += self.list[k] * vec2(q.angle[k].sin(), -q.angle[k].cos());
            }
            p
        }
        fn smoothstep(x: Expr) -> Expr {
            x * x * (3.0 - 2.0 * x)
        }
        fn pair(&self, q: &Coordinates) -> (Expr, Vec2) {
            (q.x * q.y, vec2(q.x, q.y))
        }
        fn kind(i: usize) -> f64 {
            match i {
                0 => 1.5,
                1 | 2 => -0.5,
                _ => 0.0,
            }
        }
    }
    fn trigonometry(&self, q: &Coordinates) -> Expr { q.x.sin() + q.y.cos() * (q.x * 0.3).tan() }
    fn inverse_trigonometry(&self, q: &Coordinates) -> Expr {
        (q.x.sin() * 0.9).asin() + (q.y.sin() * 0.9).acos()
            + q.x.atan() + q.y.atan2(q.x + 3.0)
    }
    fn hyperbolic(&self, q: &Coordinates) -> Expr { q.x.sinh() - q.y.cosh() * q.x.tanh() }
    fn exponentials(&self, q: &Coordinates) -> Expr { q.x.exp() + (q.x * q.x + 1.0).ln() }
    fn roots(&self, q: &Coordinates) -> Expr { (q.x * q.x + 1.0).sqrt() + (q.y * q.y + 2.0).cbrt() }
    fn powers(&self, q: &Coordinates) -> Expr {
        q.x.powi(3) + (q.x * q.x + 1.0).powi(-2)
            + (q.y * q.y + 1.0).powf(1.7) + (q.x * q.x + 1.0).powf(q.y)
    }
    fn more_powers(&self, q: &Coordinates) -> Expr {
        (q.x * q.x + 1.0).powf(0.5) + (q.x * q.x + 1.0).powf(2.0)
            + (q.x * q.x + 1.0).powf(-1.5) + q.x.powi(0)
    }
    fn reciprocals(&self, q: &Coordinates) -> Expr {
        (q.x * q.x + 0.5).recip() + q.y.hypot(q.x) + q.x.mul_add(self.a, q.y)
    }
    fn both_at_once(&self, q: &Coordinates) -> Expr { let (s, c) = q.x.sin_cos(); s * c + s }
    fn kinks(&self, q: &Coordinates) -> Expr {
        q.x.abs() * q.y.signum() + q.x.min(q.y) * q.x.max(0.25) + q.x.clamp(-0.5, 0.5)
    }
    fn kinks_with_rates(&self, q: &Coordinates) -> Expr {
        (q.x.abs() + q.x.min(q.y) * q.x.max(0.25) + q.x.clamp(-0.5, 0.5)).dt()
    }
    fn branches(&self, q: &Coordinates) -> Expr {
        let slope = if q.x > 0.0 { 2.0 * q.x } else if q.y <= q.x { q.y } else { -q.x * q.x };
        slope * q.y
    }
    fn branch_rates(&self, q: &Coordinates) -> Expr {
        (if q.x > q.y && q.x > 0.0 || !(q.y == 0.3) { q.x * q.y } else { q.x.sin() }).dt()
    }
    fn branch_assignments(&self, q: &Coordinates) -> Expr {
        let mut sum = q.x;
        let mut other = q.y * 2.0;
        if q.x * q.y < 0.0 {
            sum += q.y;
            other = sum * other;
        } else if q.x != q.y {
            sum -= 1.0;

    }
        sum * other
    }
    fn integer_branches(&self, q: &Coordinates) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..Self::COUNT {
            if i == 1 {
                continue;

    }
            if i % 2 == 0 { sum += q.angle[i] * f64::from(i as u32 + 1); }
        }
        sum
    }
    fn vectors(&self, q: &Coordinates) -> Vec3 {
        let v = vec3(q.x, self.a, 0.5 * q.y);
        let w = self.axis * q.y.sin() - Vec3::X;
        v.cross(w) * v.dot(w) / (1.0 + w.norm_squared()) + self.b * Vec3::new(q.x, q.y, q.x * q.y)
    }
    fn plane(&self, q: &Coordinates) -> Vec2 {
        let v = vec2(q.x + 2.0, q.y);
        v.perp() * v.norm() + v.normalize() - vec2(v.cross(vec2(q.y, 1.0)), v[1])
    }
    fn matrices(&self, q: &Coordinates) -> Vec3 {
        let r = Mat3::rotation_z(q.angle[0]) * Mat3::rotation_x(q.angle[1]) * Mat3::rotation_y(q.angle[2]);
        let m = self.turn * r.transpose() + Mat3::skew(self.axis) * q.x - Mat3::diagonal(1.0, 2.0, 3.0);
        m * vec3(q.x, q.y, m.trace()) * m.determinant() + m.row(1) - m.column(2) * m[(0, 2)]
    }
    fn angular_velocity(&self, q: &Coordinates) -> Vec3 {
        let r = Mat3::rotation_z(q.angle[0]) * Mat3::rotation_x(q.angle[1]);
        let w = r.transpose() * r.dt();
        vec3(w[(2, 1)], w[(0, 2)], w[(1, 0)])
    }
    fn rows_and_columns(&self, q: &Coordinates) -> Vec3 {
        let rows = Mat3::from_rows(vec3(q.x, 0.0, 1.0), vec3(0.0, q.y, 2.0), vec3(q.x, q.y, 0.0));
        let columns = Mat3::from_columns(vec3(q.x, 0.0, 1.0), vec3(0.0, q.y, 2.0), vec3(q.x, q.y, 0.0));
        let fixed = Mat3::from([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 10.0]]);
        (rows - columns.transpose() + fixed) * vec3(q.y, 1.0, q.x) + Mat3::IDENTITY * vec3(1.0, 2.0, q.x)
    }
    fn places(&self, q: &Coordinates) -> Vec2 { self.place(q, 2) - Self::HALF * self.place(q, 0) }
    fn velocities(&self, q: &Coordinates) -> Vec2 { self.place(q, 2).dt() }
    fn sums(&self, q: &Coordinates) -> Expr {
        let mut total = Expr::from(0.0);
        for (i, m) in self.list.iter().enumerate() {
            total += *m * self.place(q, i).dt().norm_squared();

    }
        for length in self.list { total -= length * q.x; }
        for i in (0..self.list.len()).rev() { total *= 1.0 + 0.1 * self.list[i]; }
        total / 2.0
    }
    fn nested_loops(&self, q: &Coordinates) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..3 {
            for j in i + 1..3 {
                sum += (q.angle[i] - q.angle[j]).cos() * (i * 3 + j) as f64;

    }
        }
        sum
    }
    fn array_elements(&self, q: &Coordinates) -> [Expr; 3] {
        let mut all = [Expr::ZERO; 3];
        for i in 0..3 {
            all[i] = q.angle[i] * self.list[i];
            all[i] += q.x;
            if i > 0 { let before = all[i - 1]; all[i] *= before; }
        }
        all
    }
    fn early(&self, q: &Coordinates) -> Expr {
        if Self::COUNT == 3 {
            return q.x * 2.0;

    }
        q.y
    }
    fn shadows(&self, q: &Coordinates) -> Expr {
        let x = q.x;
        let x = { let y = x * 2.0; y + 1.0 };
        let (a, [b, c]) = (x, [q.y, x * x]);
        let _ = a;
        a * b - c
    }
    fn helpers(&self, q: &Coordinates) -> Expr {
        let (area, v) = self.pair(q);
        area + v.x - Self::smoothstep(q.y) + Self::kind(2) + Self::kind(0)
    }
    fn constants(&self, q: &Coordinates) -> Expr {
        q.x * core::f64::consts::PI + std::f64::consts::FRAC_PI_2 + Expr::ONE
    }
    fn time(&self, q: &Coordinates) -> Expr { (q.t * self.a).sin() * q.x + q.t.powi(2) }
    fn explicit_time_rate(&self, q: &Coordinates) -> Expr { ((q.t * self.a).sin() * q.x).dt() }
    fn accelerations(&self, q: &Coordinates) -> Expr { (q.x * q.y).dt().dt() + q.angle[0].sin().dt().dt() }
    fn smooth(&self, q: &Coordinates) -> Expr { self.spring.at(q.x) * q.y + self.spring.at(0.5 * q.y).dt() }
    fn numbers(&self, q: &Coordinates) -> Expr { q.x * 1e-3 + 6.674e-1 * q.y + 1_000.5 }
    fn upward(&self, q: &Coordinates) -> Expr {
        let mut v = vec2(q.x, q.y);
        v.x = q.y * 2.0;
        v.y += 1.0;
        v.x * v.y
    }
}

struct State {
    q: [f64; 5],
    u: [f64; 5],
    a: [f64; 5],
    t: f64,
    p: Parameters,
}

impl Bindings for State {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let p = &self.p;
        match symbol {
            Symbol::Time => self.t,
            Symbol::Coordinate(i) => self.q[i as usize],
            Symbol::Rate(i) => self.u[i as usize],
            Symbol::Acceleration(i) => self.a[i as usize],
            Symbol::Input(_) | Symbol::Multiplier(_) | Symbol::Mode(_) => f64::NAN,
            Symbol::Parameter(i) => {
                let m = |k: usize| p.turn[(k / 3, k % 3)];
                match i as usize {
                    0 => p.a,
                    1 => p.b,
                    i @ 2..=4 => p.list[i - 2],
                    i @ 5..=7 => p.axis[i - 5],
                    i => m(i - 8),
                }
            }
        }
    }
    fn smooth(&self, _: FunctionId, order: u8, x: f64) -> f64 {
        SmoothFunction::derivatives(&Spring, x)[order as usize]
    }
}

#[test]
fn the_elaborator_and_the_jets_agree_on_the_whole_vocabulary() {
    let compiled = model(DECLARATION, &format!("impl Parameters {{ {REST} {} }}", source())).compiled;
    let outputs = &compiled.model.outputs;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let value = -1.5..1.5f64;
    let states = (
        proptest::array::uniform5(value.clone()),
        proptest::array::uniform5(value.clone()),
        proptest::array::uniform5(value.clone()),
        proptest::array::uniform20(0.1..1.5f64),
    );
    runner
        .run(&states, |(q, u, a, p)| {
            let turn = Mat3::from([[p[8], p[9], p[10]], [p[11], p[12], p[13]], [p[14], p[15], p[16]]]);
            let parameters = Parameters {
                a: p[0],
                b: p[1],
                list: [p[2], p[3], p[4]],
                axis: Vec3::new(p[5], p[6], p[7]),
                turn,
                spring: Spring,
            };
            let jet = |i: usize| Expr::coordinate(q[i], u[i], a[i]);
            let coordinates =
                Coordinates { t: Expr::time(p[17]), x: jet(0), y: jet(1), angle: [jet(2), jet(3), jet(4)] };
            let expected = by_jets(&parameters, &coordinates);
            let state = State { q, u, a, t: p[17], p: parameters };
            prop_assert_eq!(expected.len(), outputs.len());
            for ((name, values), output) in expected.iter().zip(outputs) {
                prop_assert_eq!(*name, &output.name);
                let roots: Vec<_> = output.components.iter().map(|(_, node)| *node).collect();
                let all = compiled.model.graph.evaluate(&roots, &state);
                prop_assert_eq!(roots.len(), values.len());
                for (root, value) in roots.iter().zip(values) {
                    let found = all[root.index()];
                    let close = (found - value).abs() <= 1e-9 * (1.0 + value.abs());
                    prop_assert!(close, "{}: elaborated {}, by jets {}", name, found, value);
                }
            }
            Ok(())
        })
        .unwrap();
}
