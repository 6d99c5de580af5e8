//! One model that uses every word models may be written in: what the macro compiles it to gives the same
//! numbers as the model's own functions on time jets. Each output carries a value with its first and second
//! time derivative.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::SmoothFunction;
use dynamics::model::ModelState;
use dynamics::prelude::*;
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

/// A user's own smooth function.
#[derive(Clone, Debug)]
pub struct Wave {
    wave_number: f64,
}

impl SmoothFunction for Wave {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let k = self.wave_number;
        let (s, c) = (k * x).sin_cos();
        [s, k * c, -k * k * s, -k * k * k * c]
    }
}

/// A point mass of the plane and one on a line, with parameters of every shape.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, z: [_; 2])]
pub struct Everything {
    /// Mass of both points.
    pub m: f64,
    /// A number.
    pub a: f64,
    /// An array.
    pub b: [f64; 3],
    /// A vector.
    pub axis: Vec3<f64>,
    /// A matrix.
    pub tensor: Mat3<f64>,
    /// A vector of the plane.
    pub offset: Vec2<f64>,
    /// A vector of nalgebra's.
    pub arm: Vector3<f64>,
    /// A matrix of nalgebra's.
    pub frame: Matrix3<f64>,
    /// Numbers by rows.
    pub table: [[f64; 2]; 3],
    /// A user's own smooth function.
    pub wave: Wave,
    /// A spline.
    pub track: CubicSpline,
}

#[dynamics]
impl Everything {
    const FACTOR: f64 = 1.5;

    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        // The second point runs on a curve: f‴ of the user's function stands in the Jacobian of the
        // accelerations.
        let height = self.wave.at(q.z[0]);
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
            + 0.5 * self.m * (q.z[0].dt().powi(2) + height.dt().powi(2) + q.z[1].dt().powi(2))
    }

    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.a * (q.x * q.y).sin() + 0.1 * q.z[0] * q.z[1] + self.track.at(q.x)
    }

    /// A value with its first and second derivative.
    fn three(&self, f: Expr) -> Vec3 {
        vec3(f, f.dt(), f.dt().dt())
    }

    #[output]
    fn sin(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.sin())
    }
    #[output]
    fn cos(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.cos())
    }
    #[output]
    fn tan(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.tan())
    }
    #[output]
    fn asin(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.asin())
    }
    #[output]
    fn acos(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.acos())
    }
    #[output]
    fn atan(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.atan())
    }
    #[output]
    fn sinh(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.sinh())
    }
    #[output]
    fn cosh(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.cosh())
    }
    #[output]
    fn tanh(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.tanh())
    }
    #[output]
    fn exp(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.exp())
    }
    #[output]
    fn ln(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.ln())
    }
    #[output]
    fn sqrt(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.sqrt())
    }
    #[output]
    fn cbrt(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.cbrt())
    }
    #[output]
    fn recip(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.recip())
    }
    #[output]
    fn abs(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three((q.x - q.y).abs() * q.x)
    }
    #[output]
    fn signum(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three((q.x - q.y).signum() * q.x)
    }
    #[output]
    fn sin_cos(&self, q: &Coordinates<Self>) -> Vec3 {
        let (s, c) = q.x.sin_cos();
        self.three(s * c)
    }
    #[output]
    fn powi(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.powi(5) + q.x.powi(-2) + q.y.powi(0) + q.y.powi(1))
    }
    #[output]
    fn powf(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.powf(2.5) + q.y.powf(-0.3) + q.y.powf(2.0))
    }
    #[output]
    fn power_of_power(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.powf(q.y) + q.x.powf(self.a))
    }
    #[output]
    fn atan2(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.atan2(q.y) + q.x.atan2(-self.a))
    }
    #[output]
    fn hypot(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.hypot(q.y) + q.x.hypot(self.a))
    }
    #[output]
    fn min(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.min(q.y) * q.y + q.x.min(0.5) * q.y)
    }
    #[output]
    fn max(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.max(q.y) * q.y + q.x.max(0.5) * q.y)
    }
    #[output]
    fn clamp(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.clamp(0.4, q.y) * q.y)
    }
    #[output]
    fn mul_add(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(q.x.mul_add(q.y, self.a))
    }
    #[output]
    fn smooth(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three(self.wave.at(q.x * q.y) + self.track.at(q.x))
    }
    #[output]
    fn operators(&self, q: &Coordinates<Self>) -> Vec3 {
        let mut sum = Expr::ZERO;
        sum += q.x / q.y - 2.0 / q.x + q.x * 3.0 - q.y / self.a;
        sum -= -(1.0 - q.x) + (q.y - 1.0) * Self::FACTOR;
        sum *= q.y + 1.0;
        sum /= core::f64::consts::PI;
        self.three(sum + Expr::from(self.a) + Expr::ONE)
    }
    #[output]
    fn branches(&self, q: &Coordinates<Self>) -> Vec3 {
        let f = if q.x < q.y && q.x > 0.35 {
            q.x * q.y
        } else if q.y <= 0.5 || q.x >= 0.8 {
            q.x + q.y.sin()
        } else {
            -q.x.cos()
        };
        self.three(f)
    }
    #[output]
    fn loops(&self, q: &Coordinates<Self>) -> Vec3 {
        let mut sum = Expr::ZERO;
        for i in 0..self.b.len() {
            for j in 0..2 {
                sum += self.b[i] * (f64::from(i as u32 + 1) * q.z[j]).sin();
            }
        }
        for (weight, z) in self.b.iter().zip(q.z) {
            sum -= *weight * z * z;
        }
        let [first, second] = q.z.dt();
        self.three(sum + q.z.iter().sum::<Expr>()) + vec3(first, second, 0.0)
    }
    #[output]
    fn time(&self, q: &Coordinates<Self>) -> Vec3 {
        self.three((2.0 * q.t).sin() * q.x + q.t * q.t)
    }

    fn place(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.x, self.a, q.y * q.x) + self.axis
    }
    #[output]
    fn vectors(&self, q: &Coordinates<Self>) -> Vec3 {
        let r = self.place(q);
        let mut w = Vec3::ZERO;
        w += r.cross(self.axis) - q.x * Vec3::Z;
        w -= self.axis / q.y;
        let flat = vec2(q.x, q.y);
        let turned = flat.perp() + Vec2::X * 0.3 - Vec2::new(0.1, 0.2);
        self.three(r.dot(w) + w.norm() + w[1] * r.norm_squared() + flat.cross(turned) + turned.normalize().x)
    }
    #[output]
    fn whole_vectors(&self, q: &Coordinates<Self>) -> Vec3 {
        self.place(q).dt().dt() + self.place(q).normalize().dt() + Vec3::from(self.place(q).to_array())
    }
    fn rotation(&self, q: &Coordinates<Self>) -> Mat3 {
        Mat3::rotation_z(q.x) * Mat3::rotation_x(self.a) * Mat3::rotation_y(q.y)
    }
    #[output]
    fn matrices(&self, q: &Coordinates<Self>) -> Vec3 {
        let r = self.rotation(q);
        let inertia =
            r * self.tensor * r.transpose() + Mat3::IDENTITY * q.x - 0.5 * Mat3::diagonal(q.x, q.y, q.x);
        let skew = Mat3::skew(r.column(1)) + Mat3::from_rows(r.row(0), self.axis.into(), r.row(2)) / q.y;
        let built = Mat3::from([[q.x, q.y, Expr::ONE], [q.y, q.x, Expr::ZERO], [q.x, q.x, q.y]])
            - Mat3::from_columns(r.row(0), r.row(1), r.row(2));
        self.three(
            inertia.determinant()
                + skew.trace() * built[(1, 2)]
                + (skew * built * self.axis).dot(r * self.axis),
        )
    }
    #[output]
    fn angular_velocity(&self, q: &Coordinates<Self>) -> Vec3 {
        let spin = self.rotation(q).dt() * self.rotation(q).transpose();
        vec3(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)])
    }

    /// The same without and with what the macro knows of products of turns.
    #[output]
    fn angular_velocities(&self, q: &Coordinates<Self>) -> Vec3 {
        let r = self.rotation(q).transpose() * Mat3::axis_angle(self.axis, q.z[0]) * Mat3::rotation_x(self.a);
        let turning = Mat3::axis_angle(self.place(q), q.x * q.y);
        (r * turning).transpose().angular_velocity() + r.angular_velocity_in_body()
            - turning.angular_velocity_in_body()
    }
    #[output]
    fn euler_angles(&self, q: &Coordinates<Self>) -> Vec3 {
        let body = Mat3::euler(EulerSequence::Zxz, [q.x, q.y, q.z[0]]);
        let space = Mat3::euler_space(EulerSequence::Yzx, [q.z[1], Expr::from(self.a), q.x * q.z[0]]);
        let turned = body * space.transpose();
        turned.angular_velocity() + 2.0 * body.angular_velocity_in_body().dt() + space.dt() * self.axis
    }
    #[output]
    fn euler_parameters(&self, q: &Coordinates<Self>) -> Vec3 {
        // Of unit length by construction.
        let (s, c) = q.x.sin_cos();
        let n = self.place(q).normalize();
        let r = Mat3::euler_parameters([c, s * n.x, s * n.y, s * n.z]);
        let symmetric = Mat3::diagonal(self.a, self.a, self.m);
        let turned = Mat3::euler(EulerSequence::Zxz, [q.x, q.y, q.z[0]]);
        let energy = r.rotational_energy(self.tensor) + turned.rotational_energy(symmetric)
            - (turned * Mat3::rotation_x(q.z[1])).rotational_energy(Mat3::IDENTITY * q.x);
        let dyad = Mat3::outer(self.axis, q.x * self.place(q)) + Mat3::outer(n, n);
        (r.transpose() * Mat3::rotation_x(q.y)).angular_velocity()
            + r.angular_velocity_in_body()
            + energy * dyad * r.dt().row(1)
    }

    #[output]
    fn parameters(&self, q: &Coordinates<Self>) -> Vec3 {
        let arm = Vec3::from(self.arm) + self.arm.x * Vec3::X;
        let frame = Mat3::from(self.frame) / self.frame[(0, 1)];
        let mut sum = self.offset.dot(vec2(q.x, q.y)) + (self.offset * q.x).perp().y;
        for row in &self.table {
            let [first, second] = *row;
            sum += first * q.x / (second + q.y);
        }
        let constant = self.a.sqrt() + self.b[1].abs() + self.axis.norm() + self.tensor[(0, 1)].powi(3);
        self.three(sum * constant + (frame * arm).dot(self.place(q)) + self.table[2][1].sin() * self.a.dt())
    }

    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        let mut sum =
            Force::at(self.place(q), vec3(self.a, q.x, 0.2)) - 0.5 * Force::along(q.x * q.y, q.z[0]);
        sum += Force::at(vec2(q.z[0], q.z[1]), Vec2::new(0.3, -0.1)) * q.x;
        -sum / 2.0 + Force::ZERO
    }
}

fn model() -> Everything {
    let knots = [-1.0, 0.0, 0.4, 0.6, 1.5];
    Everything {
        m: 1.3,
        a: 0.7,
        b: [0.2, -0.5, 0.9],
        axis: Vec3::new(0.1, 0.8, -0.4),
        tensor: Mat3::from([[2.0, 0.1, 0.2], [0.1, 3.0, -0.3], [0.2, -0.3, 1.5]]),
        offset: Vec2::new(0.4, -0.9),
        arm: Vector3::new(-0.3, 0.2, 1.1),
        frame: Matrix3::new(1.0, 0.5, -0.2, 0.3, 2.0, 0.1, 0.6, -0.7, 1.4),
        table: [[0.1, 0.9], [-0.4, 1.2], [0.8, 0.5]],
        wave: Wave { wave_number: 2.0 },
        track: CubicSpline::not_a_knot(&knots, &[0.3, 0.1, -0.2, 0.5, 0.4]).expect("the knots increase"),
    }
}

/// Every output by its name: what the macro's program says, what the functions themselves say.
macro_rules! compare {
    ($model:ident, $coordinates:ident, $compiled:ident; $($name:ident)*) => {{
        let functions = [$((stringify!($name), $model.$name(&$coordinates).value().to_array())),*];
        prop_assert_eq!(Everything::OUTPUTS.len(), 3 * functions.len(), "every output is compared");
        for (i, (name, expected)) in functions.into_iter().enumerate() {
            prop_assert_eq!(Everything::OUTPUTS[3 * i].name, format!("{name}.x"));
            let scale = expected.iter().fold(1.0_f64, |scale, x| scale.max(x.abs()));
            for k in 0..3 {
                let compiled = $compiled[3 * i + k];
                let error = (compiled - expected[k]).abs();
                prop_assert!(error <= 1e-11 * scale, "{} [{}]: {:e} compiled, {:e} by \
                    jets", name, k, compiled, expected[k]);
            }
        }
    }};
}

/// Everything that is compiled against everything that runs on jets, at one state.
fn agree(position: [f64; 4], rates: [f64; 4], t: f64) -> Result<(), TestCaseError> {
    let model = model();
    let ([x, y, z @ ..], [x_rate, y_rate, z_rate @ ..]) = (position, rates);
    let builder = model.state().x(x).y(y).z(z).x_rate(x_rate).y_rate(y_rate).z_rate(z_rate);
    let state = builder.at_time(t).build().expect("every number is finite");
    let accelerations = model.accelerations(&state).expect("the masses are positive");
    let q = Everything::coordinates_with(&state, &accelerations, &[]);
    let mut compiled = vec![0.0; Everything::OUTPUTS.len()];
    model.outputs(&state, &mut compiled).expect("the masses are positive");
    compare!(model, q, compiled;
        sin cos tan asin acos atan sinh cosh tanh
            exp ln sqrt cbrt recip abs signum sin_cos powi powf power_of_power
        atan2 hypot min max clamp mul_add smooth operators branches loops time vectors whole_vectors matrices
        angular_velocity angular_velocities euler_angles euler_parameters parameters);

    let force = Everything::POWERS.iter().position(|p| p.name == "push").expect("a force has its power");
    let mut powers = vec![0.0; Everything::POWERS.len()];
    model.powers(&state, &mut powers);
    prop_assert!((powers[force] - model.push(&q).power()).abs() < 1e-12, "power of the force");
    prop_assert!((model.kinetic_energy(&state) - model.kinetic(&q).value()).abs() < 1e-13);
    prop_assert!((model.potential_energy(&state) - model.potential(&q).value()).abs() < 1e-13);
    Ok(())
}

proptest! {
    #[test]
    fn the_compiled_model_and_its_functions_agree(
        x in 0.3..0.9_f64,
        y in 0.3..0.9_f64,
        z in [-1.0..1.0_f64, -1.0..1.0_f64],
        rates in [-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64],
        t in -2.0..2.0_f64,
    ) {
        agree([x, y, z[0], z[1]], rates, t)?;
    }
}

/// The Jacobians of the accelerations against difference quotients.
#[test]
fn jacobians_of_the_accelerations() {
    let model = model();
    let builder = model.state().x(0.45).y(0.7).z([0.3, -0.8]).x_rate(0.4).y_rate(-0.6).z_rate([1.1, 0.5]);
    let state = builder.build().expect("every number is finite");
    let accelerations =
        |q, u| model.accelerations(&ModelState::new(0.0, q, u, state.inputs)).expect("positive masses");
    let jacobian = model.state_jacobian(&state).expect("the masses are positive");
    assert_eq!(jacobian.accelerations, accelerations(state.q, state.u));
    for j in 0..4 {
        let difference = |h: f64, velocity: bool| {
            let shifted = |h: f64| {
                let (mut q, mut u) = (state.q, state.u);
                if velocity {
                    u[j] += h
                } else {
                    q[j] += h
                }
                accelerations(q, u)
            };
            (shifted(h) - shifted(-h)) / (2.0 * h)
        };
        for (velocity, exact) in [(false, &jacobian.by_q), (true, &jacobian.by_u)] {
            let quotient = (4.0 * difference(1e-3, velocity) - difference(2e-3, velocity)) / 3.0;
            for i in 0..4 {
                let error = (quotient[i] - exact[(i, j)]).abs();
                assert!(
                    error < 1e-8,
                    "({i}, {j}), velocity {velocity}: {} and {}",
                    quotient[i],
                    exact[(i, j)]
                );
            }
        }
    }
    assert!(jacobian.by_q[(2, 2)].abs() > 0.1 && jacobian.by_u[(2, 2)].abs() > 0.1, "the curve is felt");
}

/// At the corners of abs, signum, min, max and clamp, and where a condition just holds or just fails, both
/// take the same branch.
#[test]
fn the_compiled_model_and_its_functions_agree_at_corners() {
    for x in [0.35, 0.4, 0.5, 0.6, 0.8] {
        for y in [0.35, 0.4, 0.5, 0.8] {
            agree([x, y, 0.0, -0.0], [0.7, -0.3, 0.2, 0.9], 0.0)
                .unwrap_or_else(|error| panic!("x = {x}, y = {y}: {error}"));
        }
    }
}

/// The elaborator knows exactly the methods that the runtime has: a word that only one of them knows cannot
/// be used.
#[test]
fn macro_and_runtime_know_the_same_words() {
    // Read-outs of values and what generated code makes jets with are not part of the language.
    const READ_OUTS: [&str; 5] = ["value", "rate", "acceleration", "is_constant", "to_array"];
    let public = |source: &str| -> Vec<String> {
        let names = source.lines().filter_map(|line| line.trim().strip_prefix("pub fn "));
        let name = |rest: &str| rest.split(['(', '<']).next().unwrap_or_default().to_owned();
        names
            .filter(|rest| rest.contains("(self"))
            .map(name)
            .filter(|n| !READ_OUTS.contains(&n.as_str()))
            .collect()
    };
    let listed = |source: &str, list: &str| -> Vec<String> {
        let from = source.split_once(list).unwrap_or_else(|| panic!("no list {list}")).1;
        let words = from.split_once('=').and_then(|(_, rest)| rest.split_once(';')).expect("a constant").0;
        words
            .split('"')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .filter(|n| !READ_OUTS.contains(&n.as_str()))
            .collect()
    };
    let scalars = include_str!("../../../dynamics-macros/src/elaborate/scalar_methods.rs");
    let vectors = include_str!("../../../dynamics-macros/src/elaborate/vector_methods.rs");
    let mut jets = public(include_str!("../../../dynamics-vocabulary/src/expr/functions.rs"));
    jets.push("dt".to_owned());
    let mut matrices = public(include_str!("../../../dynamics-vocabulary/src/matrix.rs"));
    matrices.extend(public(include_str!("../../../dynamics-vocabulary/src/rotation.rs")));
    for (kind, mut runtime, mut elaborator) in [
        ("Expr", jets, listed(scalars, "SCALAR_METHODS")),
        (
            "vectors",
            public(include_str!("../../../dynamics-vocabulary/src/vector.rs")),
            listed(vectors, "VECTOR_METHODS"),
        ),
        ("matrices", matrices, listed(vectors, "MATRIX_METHODS")),
    ] {
        for words in [&mut runtime, &mut elaborator] {
            words.sort();
            words.dedup();
        }
        assert_eq!(runtime, elaborator, "methods of {kind}: runtime and elaborator");
    }
}
