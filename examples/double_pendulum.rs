//! Two double pendulums whose starts differ by a billionth of a radian.
//!
//!     L = ½ m₁ |ṙ₁|² + ½ m₂ |ṙ₂|² − g (m₁ y₁ + m₂ y₂)
//!
//! The motion is chaotic. The distance of two neighbours grows as e^{λt} with λ ≈ 0.9/s, so 25 seconds
//! turn 10⁻⁹ into 1.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// Two bobs on massless rods swing in a vertical plane: small swings are regular, large ones chaotic. Drag a
/// bob and let go; then compare the first two starts, which differ by a thousandth of a radian.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
struct DoublePendulum {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    g: f64,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (bob1, bob2) = (self.bob1(q), self.bob2(q));
        Drawing::new()
            .tail("bob2", bob2, 2.0)
            .polyline([vec2(0.0, 0.0), bob1, bob2])
            .pivot([0.0, 0.0])
            .disc(bob1, 0.07)
            .disc(bob2, 0.07)
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let start = |theta1: f64, theta2: f64| model.state().theta1(theta1).theta2(theta2).build();
    let upper = 120f64.to_radians();
    Ok(model
        .live(start(upper, -0.2)?)
        .title("Double pendulum")
        .first_start("120°")
        .start("0.001 rad more", start(upper + 1e-3, -0.2)?)
        .start("slow mode", start(0.2, 0.2 * f64::sqrt(2.0))?)
        .start("fast mode", start(0.2, -0.2 * f64::sqrt(2.0))?)
        .range("m1", 0.1, 10.0)
        .range("m2", 0.1, 10.0)
        .range("l1", 0.3, 2.0)
        .range("l2", 0.3, 2.0)
        .range("g", 0.0, 25.0)
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["theta1", "theta2"])
        .phase("theta2")
        .finish()?)
}

fn main() -> common::Outcome {
    let model = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.81 };
    let run = |theta1: f64| -> Result<_, Box<dyn std::error::Error>> {
        let start = model.state().theta1(theta1).theta2(-10f64.to_radians()).build()?;
        Ok(model.simulate(start).until(40.0).tolerance(1e-13).run()?)
    };
    let (motion, neighbour) = (run(120f64.to_radians())?, run(120f64.to_radians() + 1e-9)?);
    assert!(motion.summary().energy_drift < 1e-11);

    let times = || common::times(40.0, 4000);
    let separation: Vec<(f64, f64)> = motion
        .sample(times())
        .zip(neighbour.sample(times()))
        .map(|(a, b)| (a.t, ((a.q - b.q).norm_squared() + (a.u - b.u).norm_squared()).sqrt()))
        .collect();

    // λ is the slope of ln(separation) where it grows: above the first transient and below the size of the
    // motion itself.
    let growing: Vec<_> =
        separation.iter().filter(|(_, s)| (1e-8..1e-1).contains(s)).map(|&(t, s)| (t, s.ln())).collect();
    let (exponent, offset) = straight_line(&growing);
    println!("the separation grows as e^(λt) with λ = {exponent:.2}/s");
    let apart = separation.iter().find(|(_, s)| *s > 1.0).map(|(t, _)| *t);
    println!("one billionth of a radian is one after {:.1} s", apart.ok_or("the pendulums stay together")?);
    assert!((0.6..1.3).contains(&exponent));

    let mut files = common::Files::of("double_pendulum");
    Chart::new("Two starts 10⁻⁹ rad apart")
        .panel(
            Panel::new(Axis::new("time in s"), Axis::log("separation in the state space"))
                .line("separation", separation)
                .line(
                    format!("e^({exponent:.2} t)"),
                    growing.iter().map(|&(t, _)| (t, (offset + exponent * t).exp())),
                ),
        )
        .write_svg(files.path("separation.svg"))?;
    Animation::new()
        .add(&motion, "θ₁ = 120°")
        .add(&neighbour, "10⁻⁹ rad more")
        .write_html(files.path("two_starts.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}

/// Slope and offset of the straight line through points (least squares).
fn straight_line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let slope = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
        / points.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>();
    (slope, my - slope * mx)
}
