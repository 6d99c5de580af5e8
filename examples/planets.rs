//! The Sun and four planets as an n-body problem, in astronomical units, years and masses of the Sun.
//!
//!     L = Σ ½ mᵢ |ṙᵢ|² + Σ_{i<j} G mᵢ mⱼ / |rᵢ − rⱼ|,        G = 4π²
//!
//! Energy, momentum and angular momentum are conserved. Jupiter, a thousandth of the Sun, disturbs the
//! others. On average the periods still follow Kepler's third law T² = a³ / (1 + m).

mod common;
use dynamics::error::StateError;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

/// The Sun and four planets, by their mutual attraction alone: astronomical units, years, masses of the Sun.
/// Raise the mass of Jupiter to 0.05 and more: the Sun moves, and the inner planets leave their circles.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [_; 5], y: [_; 5])]
struct Planets {
    gravitation: f64,
    mass: [f64; 5],
}

#[dynamics]
impl Planets {
    const NAMES: [&str; 5] = ["Sun", "Venus", "Earth", "Mars", "Jupiter"];

    fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..5 {
            sum += 0.5 * self.mass[i] * self.place(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn attraction(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..5 {
            for j in 0..i {
                sum -= self.gravitation * self.mass[i] * self.mass[j]
                    / (self.place(q, i) - self.place(q, j)).norm();
            }
        }
        sum
    }
    #[output]
    fn angular_momentum(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..5 {
            sum += self.mass[i] * self.place(q, i).cross(self.place(q, i).dt());
        }
        sum
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let colors = [Color::Amber, Color::Teal, Color::Blue, Color::Red, Color::Brown];
        (0..5).fold(Drawing::new(), |drawing, i| {
            let place = self.place(q, i);
            let (radius, name) = if i == 0 { (0.12, "") } else { (0.08, Self::NAMES[i]) };
            drawing.color(colors[i]).tail(Self::NAMES[i], place, 0.6).disc(place, radius).label(place, name)
        })
    }
}

/// Distance from the Sun and speed at perihelion: a (1 − e) and √(G (1 + m) (1 + e) / (a (1 − e))).
fn perihelion(gravitation: f64, mass: f64, a: f64, e: f64) -> (f64, f64) {
    (a * (1.0 - e), (gravitation * (1.0 + mass) * (1.0 + e) / (a * (1.0 - e))).sqrt())
}

/// Half axes of the orbits.
const AXES: [f64; 5] = [0.0, 0.7233, 1.0, 1.5237, 5.2034];

fn model() -> Planets {
    let gravitation = 4.0 * std::f64::consts::PI.powi(2);
    Planets { gravitation, mass: [1.0, 2.448e-6, 3.003e-6, 3.227e-7, 9.546e-4] }
}

impl Planets {
    /// Every planet at its perihelion.
    fn start(&self) -> Result<State<Self>, StateError> {
        let eccentricities = [0.0, 0.0068, 0.0167, 0.0934, 0.0484];
        let directions = [0.0, 2.3, 1.8, 5.9, 0.3_f64];
        let (mut x, mut y, mut vx, mut vy) = ([0.0; 5], [0.0; 5], [0.0; 5], [0.0; 5]);
        for i in 1..5 {
            let (distance, speed) = perihelion(self.gravitation, self.mass[i], AXES[i], eccentricities[i]);
            let (sin, cos) = directions[i].sin_cos();
            (x[i], y[i], vx[i], vy[i]) = (distance * cos, distance * sin, -speed * sin, speed * cos);
        }
        // These are motions about the Sun; in the frame of the centre of mass everything keeps its place on
        // the page.
        for v in [&mut vx, &mut vy] {
            let mean = (0..5).map(|i| self.mass[i] * v[i]).sum::<f64>() / self.mass.iter().sum::<f64>();
            v.iter_mut().for_each(|v| *v -= mean);
        }
        self.state().x(x).y(y).x_rate(vx).y_rate(vy).build()
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let model = model();
    let start = model.start()?;
    Ok(model
        .live(start)
        .title("Planets")
        .hold(["mass[1]", "mass[2]", "mass[3]"])
        .range("gravitation", 4.0, 400.0)
        .range("mass[0]", 0.1, 3.0)
        .range("mass[4]", 1e-4, 0.3)
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["angular_momentum"])
        .phase("x[2]")
        .finish()?)
}

fn main() -> common::Outcome {
    let model = model();
    let start = model.start()?;
    let mut run = model.simulate(start).until(120.0).tolerance(1e-12);
    for (i, name) in Planets::NAMES.into_iter().enumerate().skip(1) {
        run = run.event(name, move |s| s.y(i) - s.y(0)); // passes the x-axis as seen from the Sun
    }
    let motion = run.run()?;
    println!("{}", motion.summary());
    assert!(motion.summary().energy_drift < 1e-9);
    let momentum = |t| motion.output("angular_momentum", t);
    assert!((momentum(120.0)? / momentum(0.0)? - 1.0).abs() < 1e-9);

    println!("planet    period in years   √(a³/(1 + m))");
    for (i, name) in Planets::NAMES.into_iter().enumerate().skip(1) {
        let times: Vec<_> = motion
            .events()
            .iter()
            .filter(|e| e.name == name && e.direction == Direction::Rising)
            .map(|e| e.time())
            .collect();
        let period = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
        let kepler = (AXES[i].powi(3) / (1.0 + model.mass[i])).sqrt();
        println!("{name:8}  {period:15.5}  {kepler:14.5}");
        assert!((period / kepler - 1.0).abs() < 1e-4, "Kepler's third law");
    }

    let mut files = common::Files::of("planets");
    let orbit = |i: usize| motion.sample(common::times(12.0, 1200)).map(move |s| (s.x(i), s.y(i)));
    let axes = Panel::new(Axis::new("x in au"), Axis::new("y in au")).equal_axes();
    Chart::new("Twelve years")
        .panel((0..5).fold(axes, |panel, i| panel.line(Planets::NAMES[i], orbit(i))))
        .write_svg(files.path("orbits.svg"))?;
    motion.plot_energy(files.path("energy.svg"))?;
    let seen = model.simulate(start).until(12.0).tolerance(1e-10).run()?;
    Animation::new()
        .add(&seen, "")
        .title("Sun and four planets, a second a year")
        .without_plot()
        .write_html(files.path("planets.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
