//! A cart that runs freely on a rail, with a chain of ten links.
//!
//!     L = ½ M ẋ² + Σ ½ mᵢ |ṙᵢ|² − Σ mᵢ g yᵢ
//!     rᵢ = (x, 0) + Σ_{k≤i} lₖ (sin θₖ, −cos θₖ)
//!
//! Nothing pushes horizontally. So the centre of mass of cart and chain keeps its place x, whatever the chain
//! does.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A cart that runs freely on a rail, with a chain of ten links. Nothing pushes horizontally, so the centre
/// of mass of cart and chain keeps its place, whatever the chain does. Drag a joint and let go.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, theta: [rad; 10])]
#[units(cart: kg, mass: kg, length: m, g: m / s^2)]
struct Chain {
    cart: f64,
    mass: [f64; 10],
    length: [f64; 10],
    g: f64,
}

#[dynamics]
impl Chain {
    /// The lower end of link i, where its mass is.
    fn joint(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let mut place = vec2(q.x, 0.0);
        for k in 0..i + 1 {
            place += self.length[k] * vec2(q.theta[k].sin(), -q.theta[k].cos());
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.cart * q.x.dt().powi(2);
        for i in 0..10 {
            sum += 0.5 * self.mass[i] * self.joint(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            sum += self.mass[i] * self.g * self.joint(q, i).y;
        }
        sum
    }
    #[output]
    fn centre_of_mass(&self, q: &Coordinates<Self>) -> Expr {
        let (mut moment, mut mass) = (self.cart * q.x, self.cart);
        for i in 0..10 {
            moment += self.mass[i] * self.joint(q, i).x;
            mass += self.mass[i];
        }
        moment / mass
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let joints: Vec<_> = (0..10).map(|i| self.joint(q, i)).collect();
        let drawing = Drawing::new()
            .tail("end", joints[9], 1.5)
            .color(Color::Faint)
            .line([-1.0, -0.08], [2.0, -0.08])
            .plain()
            .fill(Color::Faint)
            .rectangle(vec2(q.x, 0.0), 0.3, 0.16, 0.0)
            .polyline(std::iter::once(vec2(q.x, 0.0)).chain(joints.iter().copied()));
        joints.into_iter().fold(drawing, |drawing, joint| drawing.disc(joint, 0.025))
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let chain = Chain { cart: 1.0, mass: [0.1; 10], length: [0.15; 10], g: 9.81 };
    let start = |theta: fn(usize) -> f64| chain.state().theta(std::array::from_fn(theta)).build();
    let mut page = chain
        .live(start(|_| 1.6)?)
        .title("Chain on a cart")
        .first_start("stretched out")
        .start("folded", start(|i| if i % 2 == 0 { 1.5 } else { -1.5 })?)
        .start("rolled up", start(|i| 0.6 * i as f64)?)
        .start("whipped", chain.state().theta_rate(std::array::from_fn(|i| i as f64)).build()?)
        .range("cart", 0.1, 10.0)
        .range("g", 0.0, 25.0);
    for i in 0..10 {
        page = page.range(format!("mass[{i}]"), 0.02, 1.0).range(format!("length[{i}]"), 0.05, 0.3);
    }
    Ok(page.method(methods::Dop853).plot(["x", "centre_of_mass"]).phase("theta[9]").finish()?)
}

fn main() -> common::Outcome {
    let chain = Chain { cart: 1.0, mass: [0.1; 10], length: [0.15; 10], g: 9.81 };
    let start = chain.state().theta([1.6; 10]).build()?;
    let motion = chain.simulate(start).until(12.0).tolerance(1e-10).run()?;
    println!("{}\n{}", Chain::REPORT, motion.summary());

    let place = motion.output("centre_of_mass", 0.0)?;
    let moved = motion.steps().map(|s| (motion.outputs_of(&s)[0] - place).abs()).fold(0.0, f64::max);
    let cart = motion.steps().map(|s| s.x().abs()).fold(0.0, f64::max);
    println!("the cart moves by {cart:.3} m, the centre of mass by {moved:.1e} m");
    assert!(cart > 0.1 && moved < 1e-8);
    assert!(motion.summary().energy_drift < 1e-7);

    let mut files = common::Files::of("chain");
    let times = || common::times(12.0, 1200);
    let end_of_chain = motion.sample(times()).map(|s| {
        let place = chain.joint(&motion.coordinates_of(&s), 9).value();
        (place.x, place.y)
    });
    Chart::new("A cart with a chain of ten links")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("x in m"))
                .line("cart", motion.sample(times()).map(|s| (s.t, s.x())))
                .line("centre of mass", motion.sample(times()).map(|s| (s.t, motion.outputs_of(&s)[0]))),
        )
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("y in m"))
                .equal_axes()
                .line("end of the chain", end_of_chain),
        )
        .write_svg(files.path("cart.svg"))?;
    motion.animate(files.path("chain.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
