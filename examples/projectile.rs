//! A baseball thrown through air, with drag that grows with the square of the speed.
//!
//!     m r̈ = −m g e_y − k |ṙ| ṙ,        k = ½ ρ c_d A
//!
//! Dropped from rest it falls with v(t) = v∞ tanh(g t / v∞) toward the terminal speed v∞ = √(m g /
//! k).

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// A baseball thrown at 45 m/s; the arrow is its velocity. Without air, as at first, it flies v²/g far at
/// 45° and lands as fast as it was thrown. Raise the drag k to 9e-4 kg/m, as of air, and half of the range
/// is gone.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, k: kg / m, g: m / s^2)]
struct Ball {
    mass: f64,
    k: f64,
    g: f64,
}

#[dynamics]
impl Ball {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[force]
    fn drag(&self, q: &Coordinates<Self>) -> Force {
        let velocity = self.place(q).dt();
        Force::at(self.place(q), -self.k * velocity.norm() * velocity)
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.place(q).dt().norm()
    }
    #[event]
    fn ground(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let place = self.place(q);
        Drawing::new()
            .ground([0.0, 0.0], [210.0, 0.0])
            .trace("ball", place)
            .disc(place, 1.2)
            .color(Color::Faint)
            .arrow(place, place + 0.4 * place.dt())
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let ball = Ball { mass: 0.145, k: 0.0, g: 9.81 };
    let thrown = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        ball.state().x_rate(45.0 * cos).y_rate(45.0 * sin).build()
    };
    Ok(ball
        .live(thrown(45.0)?)
        .title("Projectile")
        .first_start("45°")
        .start("30°", thrown(30.0)?)
        .start("60°", thrown(60.0)?)
        .start("75°", thrown(75.0)?)
        .range("mass", 0.02, 1.0)
        .range("k", 0.0, 5e-3)
        .range("g", 1.0, 25.0)
        .plot(["x", "y", "speed"])
        .phase("y")
        .stop_at("ground", Direction::Falling)
        .finish()?)
}

fn main() -> common::Outcome {
    let ball = Ball { mass: 0.145, k: 8.8e-4, g: 9.81 };
    let in_vacuum = Ball { k: 0.0, ..ball.clone() };
    let speed = 45.0;
    let component = speed * std::f64::consts::FRAC_1_SQRT_2;

    let mut flights = Vec::new();
    for ball in [&ball, &in_vacuum] {
        let start = ball.state().x_rate(component).y_rate(component).build()?;
        flights.push(
            ball.simulate(start).until(60.0).tolerance(1e-10).stop_at("ground", Direction::Falling).run()?,
        );
    }
    let [air, vacuum] = &flights[..] else { unreachable!("two flights") };

    // Without drag the range at 45° is v²/g; with drag the work of the force "drag" is what is missing at
    // landing.
    let range = vacuum.end().x();
    assert!((range - speed * speed / ball.g).abs() < 1e-7);
    assert!(air.end().x() < 0.6 * range);
    println!("range at {speed} m/s and 45°: {:.1} m in air, {range:.1} m in vacuum", air.end().x());
    println!(
        "speed at landing: {:.1} m/s in air, {:.1} m/s in vacuum\n",
        air.output("speed", air.end_time())?,
        speed
    );
    println!("{}", air.work());

    // Dropped from rest, against the closed form.
    let drop = ball.simulate(ball.state().y(3000.0).build()?).until(30.0).tolerance(1e-10).run()?;
    let terminal = (ball.mass * ball.g / ball.k).sqrt();
    for t in [1.0, 3.0, 10.0, 30.0] {
        assert!((drop.at(t).y_rate() + terminal * (ball.g * t / terminal).tanh()).abs() < 1e-7);
    }
    println!(
        "dropped from 3 km: {:.4} m/s after 30 s; terminal speed {terminal:.4} m/s",
        -drop.end().y_rate()
    );

    let mut files = common::Files::of("projectile");
    let path = |flight: &Motion<'_, Ball>| -> Vec<(f64, f64)> {
        flight.sample(common::times(flight.end_time(), 200)).map(|s| (s.x(), s.y())).collect()
    };
    Chart::new("A ball thrown at 45 m/s and 45°")
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("y in m"))
                .equal_axes()
                .line("in air", path(air))
                .line("in vacuum", path(vacuum)),
        )
        .write_svg(files.path("path.svg"))?;
    Animation::new().add(air, "in air").add(vacuum, "in vacuum").write_html(files.path("flight.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
