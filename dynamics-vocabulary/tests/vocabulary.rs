//! Model functions as users write them type-check without annotations and give the values that a hand
//! calculation gives.

use dynamics_vocabulary::{Expr, Force, Mat3, SmoothFunction, TimeDerivative, Vec2, Vec3, vec2, vec3};

struct Parameters {
    mass: f64,
    length: f64,
    masses: [f64; 3],
    axis: Vec3<f64>,
    inertia: Mat3<f64>,
}

struct Coordinates {
    theta: [Expr; 3],
    x: Expr,
    t: Expr,
}

fn parameters() -> Parameters {
    Parameters {
        mass: 2.0,
        length: 0.5,
        masses: [1.0, 2.0, 3.0],
        axis: Vec3::new(0.0, 0.6, 0.8),
        inertia: Mat3::diagonal(1.0, 2.0, 3.0),
    }
}

fn coordinates() -> Coordinates {
    Coordinates {
        theta: [0.1, 0.2, 0.3].map(|angle| Expr::coordinate(angle, 10.0 * angle, 0.0)),
        x: Expr::coordinate(1.5, -0.5, 0.25),
        t: Expr::time(4.0),
    }
}

impl Parameters {
    fn bob(&self, q: &Coordinates, i: usize) -> Vec2 {
        let mut place = vec2(q.x, 0.0);
        for theta in &q.theta[..=i] {
            place += self.length * vec2(theta.sin(), -theta.cos());
        }
        place
    }

    fn kinetic(&self, q: &Coordinates) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..3 {
            sum += 0.5 * self.masses[i] * self.bob(q, i).dt().norm_squared();
        }
        sum += 0.5 * self.mass * q.x.dt().powi(2);
        sum
    }

    fn orientation(&self, q: &Coordinates) -> Mat3 {
        Mat3::rotation_z(q.theta[0]) * Mat3::rotation_x(self.length) * Mat3::rotation_y(q.theta[1])
    }

    fn friction(&self, q: &Coordinates) -> Force {
        let v = self.bob(q, 2).dt();
        let mut total = Force::at(self.bob(q, 2), -0.1 * v * v.norm()) - Force::along(q.x, self.mass);
        total += 2.0 * Force::at(vec3(0.0, self.length, q.x), self.axis);
        if q.x.dt() < 0.0 { total } else { -total }
    }
}

#[test]
fn kinetic_energy_of_a_chain() {
    let (model, q) = (parameters(), coordinates());
    let mut expected = 0.5 * 2.0 * 0.25;
    for i in 0..3 {
        let mut velocity = [-0.5, 0.0];
        for angle in &[0.1_f64, 0.2, 0.3][..=i] {
            velocity[0] += 0.5 * angle.cos() * 10.0 * angle;
            velocity[1] += 0.5 * angle.sin() * 10.0 * angle;
        }
        expected += 0.5 * model.masses[i] * (velocity[0] * velocity[0] + velocity[1] * velocity[1]);
    }
    assert!((model.kinetic(&q).value() - expected).abs() < 1e-14 * expected);
}

#[test]
fn power_of_summed_forces() {
    let (model, q) = (parameters(), coordinates());
    let v = model.bob(&q, 2).rate();
    let expected = -0.1 * v.norm() * v.norm_squared() - 2.0 * -0.5 + 2.0 * 0.8 * -0.5;
    assert!((model.friction(&q).power() - expected).abs() < 1e-14);
}

#[test]
fn forces_add_and_scale_by_their_power() {
    let q = coordinates();
    let (a, b) = (Force::along(q.x, 4.0), Force::along(q.theta[0], q.x));
    assert_eq!((a.power(), b.power()), (-2.0, 1.5));
    let mut sum = Force::ZERO;
    sum += a;
    sum -= b;
    for (force, power) in [
        (a + b, -0.5),
        (a - b, -3.5),
        (-a, 2.0),
        (2.0 * b, 3.0),
        (b * 2.0, 3.0),
        (q.x * b, 2.25),
        (b * q.x, 2.25),
        (b / 0.5, 3.0),
        (b / q.x, 1.0),
        (sum, -3.5),
        ([a, b, b].into_iter().sum(), 1.0),
        (Force::at(vec2(q.x, 3.0), vec2(1.0, 7.0)), -0.5),
        (Force::at(Vec2::new(1.0, 3.0), vec2(q.x, 7.0)), 0.0),
    ] {
        assert_eq!(force.power(), power);
    }
    assert!(Force::along(Expr::input(1.0), 2.0).power().is_nan(), "the rate of an input is not known");
}

#[test]
fn f64_and_expr_mix_everywhere() {
    let (model, q) = (parameters(), coordinates());
    let spin: Vec3 = model.inertia * (model.axis * q.x) + q.x * model.axis - model.axis / q.x;
    let number: f64 = model.axis.dot(model.axis) + model.axis.cross(model.axis).norm();
    let moving: Expr = model.axis.dot(vec3(0.0, model.length, q.x)) + spin.dot(model.axis) * 2.0;
    assert_eq!(number, 1.0);
    assert_eq!((0.0 + 0.6 * 0.5 + 0.8 * 1.5) + spin.value().dot(model.axis) * 2.0, moving.value());

    let doubled = vec2(1.0, q.x) * 2.0;
    assert_eq!(doubled.y.rate(), -1.0);
    let mut sum = Vec3::ZERO;
    sum += model.axis;
    sum -= q.x * Vec3::Z;
    sum *= 2.0;
    sum /= q.x;
    assert_eq!(sum.z.value(), (0.8 - 1.5) * 2.0 / 1.5);
    let mut tensor = Mat3::ZERO;
    tensor += model.inertia;
    tensor -= Mat3::IDENTITY * 0.5;
    assert_eq!(tensor[(1, 1)].value(), 1.5);
    let total: Vec2 = (0..3).map(|i| model.masses[i] * model.bob(&q, i)).sum();
    let terms = [0, 1, 2].map(|i| model.masses[i] * model.bob(&q, i));
    assert_eq!(terms.iter().sum::<Vec2>(), total);
    let by_hand = model.bob(&q, 0) + 2.0 * model.bob(&q, 1) + 3.0 * model.bob(&q, 2);
    assert_eq!(total.value(), by_hand.value());
    let (t, factor) = (&q.t, &2.0);
    assert_eq!((1.0 - t / 2.0 + t * factor).rate(), 1.5);
    assert!(0.0 < q.x && q.x <= q.t && q.x >= model.length && q.x != 0.0 && 1.5 == q.x);
}

#[test]
fn everything_has_a_time_derivative() {
    let (model, q) = (parameters(), coordinates());
    let rates = q.theta.dt().map(Expr::value);
    assert_eq!(rates, [1.0, 2.0, 3.0]);
    let (bobs, rotation, axis, (length,)) =
        ([model.bob(&q, 0), model.bob(&q, 1)], model.orientation(&q), model.axis, (model.length,)).dt();
    assert_eq!(bobs[1].value(), model.bob(&q, 1).rate());
    assert_eq!(rotation.value(), model.orientation(&q).rate());
    assert_eq!((axis, length), (Vec3::new(0.0, 0.0, 0.0), 0.0));
    assert_eq!([[q.x]].dt()[0][0].value(), -0.5);
}

#[test]
fn rotations_are_right_handed_and_orthogonal() {
    let (model, q) = (parameters(), coordinates());
    let quarter = core::f64::consts::FRAC_PI_2;
    let turned = [
        (Mat3::rotation_x(quarter) * Vec3::Y, Vec3::Z),
        (Mat3::rotation_y(quarter) * Vec3::Z, Vec3::X),
        (Mat3::rotation_z(quarter) * Vec3::X, Vec3::Y),
    ];
    for (turned, expected) in turned {
        assert!((turned - expected).value().norm() < 1e-15);
    }
    let r = model.orientation(&q);
    let unit = r * r.transpose() - Mat3::IDENTITY;
    for i in 0..3 {
        assert!(unit.row(i).value().norm() < 1e-15 && unit.rate().row(i).norm() < 1e-14);
        assert!(unit.column(i).dt().rate().norm() < 1e-13);
    }
    assert!((r.determinant().value() - 1.0).abs() < 1e-15 && r.determinant().rate().abs() < 1e-14);
    // Ṙ Rᵀ = skew(ω) with ω = θ̇₀ e_z + θ̇₁ R e_y, R e_y being the axis of the last rotation.
    let omega = q.theta[0].dt() * Vec3::Z + q.theta[1].dt() * r.column(1);
    let spin = r.dt() * r.transpose() - Mat3::skew(omega);
    for i in 0..3 {
        assert!(spin.row(i).value().norm() < 1e-14);
    }
}

#[test]
fn matrices_and_vectors_agree_with_nalgebra() {
    let rows = [[1.0, 2.0, -3.0], [0.5, -1.5, 4.0], [2.5, 0.25, 0.75]];
    let (ours, theirs) = (Mat3::from(rows), nalgebra::Matrix3::from_fn(|i, j| rows[i][j]));
    let (v, w) = (Vec3::new(0.1, -0.7, 2.0), nalgebra::Vector3::new(0.1, -0.7, 2.0));
    assert_eq!(Vec3::from(theirs * w), ours * v);
    assert_eq!(Mat3::from(theirs * theirs.transpose()), ours * ours.transpose());
    assert!((theirs.determinant() - ours.determinant()).abs() < 1e-13);
    assert_eq!(theirs.trace(), ours.trace());
    assert_eq!(nalgebra::Matrix3::from(ours), theirs);
    assert_eq!(nalgebra::Vector3::from(v.cross(ours.row(1))), w.cross(&theirs.row(1).transpose()));
    assert_eq!(Mat3::skew(v) * ours.column(2), v.cross(ours.column(2)));
    assert_eq!(Mat3::from_columns(ours.column(0), ours.column(1), ours.column(2)), ours);
    assert_eq!(Mat3::from_rows(ours.row(0), ours.row(1), ours.row(2)), ours);
    assert_eq!(
        Vec2::new(1.0, 2.0).cross(Vec2::new(-3.0, 5.0)),
        Vec2::new(1.0, 2.0).perp().dot(Vec2::new(-3.0, 5.0))
    );
    assert_eq!((Vec3::new(3.0, 0.0, 4.0).normalize(), v[2]), (Vec3::new(0.6, 0.0, 0.8), 2.0));
}

struct Parabola;

impl SmoothFunction for Parabola {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        [x * x, 2.0 * x, 2.0, 0.0]
    }
}

#[test]
fn smooth_functions_follow_the_chain_rule() {
    let x = Expr::coordinate(3.0, 0.5, -2.0);
    let (by_trait, by_product) = (Parabola.at(x), x * x);
    assert_eq!(by_trait.value(), by_product.value());
    assert_eq!(by_trait.rate(), by_product.rate());
    assert_eq!(by_trait.acceleration(), by_product.acceleration());
    assert!(Parabola.at(4.0).is_constant());
    #[cfg(feature = "alloc")]
    {
        let boxed: Box<dyn SmoothFunction> = Box::new(Parabola);
        assert_eq!(boxed.at(2.0).value(), 4.0);
    }
}
