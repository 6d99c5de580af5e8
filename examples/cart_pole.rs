//! A cart swings its pole up and catches it.
//!
//!     L = ½ M ẋ² + ½ m |ṙ|² − m g y,        r = (x + l sin θ, l cos θ)
//!     θ from the upright, force F on the cart
//!
//! Far from the upright the cart pumps energy into the pole (Åström and Furuta 2000). Near it the state
//! feedback F = −K (x, θ, ẋ, θ̇) takes over. K comes from the exact linearisation at the upright by
//! Ackermann's formula.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;
use nalgebra::{Matrix4, RowVector4, Vector4};

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: rad)]
#[inputs(force: N)]
#[units(cart: kg, bob: kg, length: m, g: m / s^2)]
struct CartPole {
    cart: f64,
    bob: f64,
    length: f64,
    g: f64,
}

#[dynamics]
impl CartPole {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x + self.length * q.theta.sin(), self.length * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.cart * q.x.dt().powi(2) + 0.5 * self.bob * self.tip(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.bob * self.g * self.tip(q).y
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.force)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (cart, tip) = (vec2(q.x, 0.0), self.tip(q));
        Drawing::new()
            .ground([-2.0, -0.1], [2.0, -0.1])
            .tail("tip", tip, 1.0)
            .fill(Color::Faint)
            .rectangle(cart, 0.4, 0.2, 0.0)
            .line(cart, tip)
            .disc(tip, 0.06)
            .color(Color::Red)
            .arrow(cart, cart + vec2(0.03 * q.force, 0.0))
    }
}

/// K that puts the poles of the linearization at the upright to `poles`: K = (0 0 0 1) C⁻¹ p(A), C = (b Ab
/// A²b A³b).
fn feedback(model: &CartPole, poles: [f64; 4]) -> Result<RowVector4<f64>, Box<dyn std::error::Error>> {
    let upright = model.state().force(0.0).build()?;
    let (by_state, by_input) = (model.state_jacobian(&upright)?, model.input_jacobian(&upright)?);
    let a = Matrix4::from_fn(|i, j| match (i, j) {
        (0..2, _) => f64::from(j == i + 2),
        (_, 0..2) => by_state.by_q[(i - 2, j)],
        _ => by_state.by_u[(i - 2, j - 2)],
    });
    let b = Vector4::new(0.0, 0.0, by_input[(0, 0)], by_input[(1, 0)]);
    let controllability = Matrix4::from_columns(&[b, a * b, a * a * b, a * a * a * b]);
    let polynomial = poles.iter().fold(Matrix4::identity(), |p, pole| p * (a - Matrix4::identity() * *pole));
    let inverse = controllability.try_inverse().ok_or("the cart cannot control its pole")?;
    Ok(inverse.row(3) * polynomial)
}

fn main() -> common::Outcome {
    let model = CartPole { cart: 1.0, bob: 0.2, length: 0.5, g: 9.81 };
    let gains = feedback(&model, [-3.0, -3.5, -4.0, -4.5])?;
    let [x, theta, x_rate, theta_rate] = (-gains).transpose().into();
    println!("near the upright F = {x:.2} x {theta:+.2} θ {x_rate:+.2} ẋ {theta_rate:+.2} θ̇");

    let control = |_: f64, s: &State<CartPole>| -> [f64; 1] {
        let CartPole { cart, bob, length, g } = model;
        let (sin, cos) = s.theta().sin_cos();
        if cos > 0.9 && s.theta_rate().abs() < 2.5 {
            let angle = f64::atan2(sin, cos); // the pole may have turned over
            return [-(gains * Vector4::new(s.x(), angle, s.x_rate(), s.theta_rate()))[0]];
        }
        // Energy of the pole, 0 at rest upright; an acceleration of the cart along −θ̇ cos θ raises it.
        let energy = 0.5 * bob * length * length * s.theta_rate().powi(2) + bob * g * length * (cos - 1.0);
        let acceleration =
            (8.0 * energy * s.theta_rate() * cos).clamp(-6.0, 6.0) - 1.5 * s.x() - 1.0 * s.x_rate();
        [(cart + bob * sin * sin) * acceleration + bob * sin * (g * cos - length * s.theta_rate().powi(2))]
    };
    let start = model.state().theta(std::f64::consts::PI - 0.05).build()?;
    let motion = model.simulate(start).until(15.0).tolerance(1e-8).max_step(0.02).inputs(control).run()?;
    println!("{}\n{}", motion.summary(), motion.work());

    let end = motion.end();
    let reach = motion.steps().map(|s| s.x().abs()).fold(0.0, f64::max);
    let caught = motion.steps().filter(|s| s.theta().cos() < 0.9).last().map_or(0.0, |s| s.t);
    println!("caught after {caught:.2} s; the cart needs {reach:.2} m to either side");
    assert!((end.theta().cos() - 1.0).abs() < 1e-8 && end.x().abs() < 1e-3, "the pole stands in the middle");
    assert!(reach < 2.0);

    let mut files = common::Files::of("cart_pole");
    let history: Vec<_> = motion.sample(common::times(15.0, 1500)).collect();
    let panel = |title| Panel::new(Axis::new("time in s"), Axis::new(title));
    Chart::new("A pole swung up and caught")
        .panel(panel("θ in rad").line("θ", history.iter().map(|s| (s.t, s.theta()))))
        .panel(panel("x in m").line("x", history.iter().map(|s| (s.t, s.x()))))
        .panel(panel("F in N").line("F", history.iter().map(|s| (s.t, s.force()))))
        .write_svg(files.path("history.svg"))?;
    Animation::new().add(&motion, "").plot(["x", "theta"]).write_html(files.path("swing_up.html"))?;
    files.list();
    Ok(())
}
