//! A book in orbit, spun about its intermediate axis. It turns over, again and again, at even intervals.
//!
//!     I ω̇ + ω × I ω = 0
//!
//! The component along the intermediate axis is a Jacobi elliptic sine. It changes its sign every 2 K(m)/τ
//! (Landau & Lifshitz, Mechanics, §37). About the other two axes this does not happen. Four Euler parameters
//! have no singular attitude.

mod common;
use dynamics::error::{SolveError, StateError};
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A book in orbit that is spun about its intermediate axis turns over again and again, at even intervals.
/// Take the other starts: about the long and the short axis it only wobbles. Then change the sides of the
/// book.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(e: [_; 4])]
#[units(mass: kg, size: m)]
struct Book {
    mass: f64,
    /// Height, width, thickness: along the body's x, y, z.
    size: [f64; 3],
}

#[dynamics]
impl Book {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let [a, b, c] = self.size;
        let frame = Frame::turned(EulerParameters::new(q.e).rotation());
        RigidBody::new(self.mass, Vec3::ZERO, Inertia::cuboid(self.mass, a, b, c), frame)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[holonomic]
    fn unit(&self, q: &Coordinates<Self>) -> Expr {
        EulerParameters::new(q.e).norm_constraint()
    }
    /// In the body's components.
    #[output]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        self.body(q).frame.angular_velocity_in_body()
    }
    #[output]
    fn momentum(&self, q: &Coordinates<Self>) -> Vec3 {
        self.body(q).angular_momentum(Vec3::ZERO)
    }
    #[event]
    fn turning_over(&self, q: &Coordinates<Self>) -> Expr {
        self.omega(q).y
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.body(q).frame;
        let [a, b, c] = self.size.map(|side| 0.5 * side);
        Drawing::new()
            .cuboid(frame, Vec3::ZERO, self.size)
            .color(Color::Red)
            .disc(frame.point(vec3(a, b, c)), 0.006)
            .trace("corner", frame.point(vec3(a, b, c)))
    }
}

/// In rad/s.
const SPIN: f64 = 6.0;

impl Book {
    /// Spun about one of its axes, by this part of the spin beside it.
    fn spun(&self, axis: usize, beside: f64) -> Result<State<Self>, StateError> {
        let mut omega = [SPIN * beside; 3];
        omega[axis] = SPIN;
        let [x, y, z] = omega.map(|w| 0.5 * w);
        self.state().e([1.0, 0.0, 0.0, 0.0]).e_rate([0.0, x, y, z]).build()
    }
}

/// The complete elliptic integral K(m), by the arithmetic-geometric mean.
fn elliptic_k(m: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - m).sqrt());
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    std::f64::consts::FRAC_PI_2 / a
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let book = Book { mass: 0.8, size: [0.24, 0.17, 0.03] };
    Ok(book
        .live(book.spun(1, 0.01)?)
        .title("Tumbling book")
        .first_start("about the intermediate axis")
        .start("about the long axis", book.spun(0, 0.03)?)
        .start("about the short axis", book.spun(2, 0.03)?)
        .range("mass", 0.1, 2.0)
        .range("size[0]", 0.05, 0.4)
        .range("size[1]", 0.05, 0.4)
        .range("size[2]", 0.01, 0.2)
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["omega.x", "omega.y", "omega.z"])
        .phase("e[0]")
        .finish()?)
}

fn main() -> common::Outcome {
    let book = Book { mass: 0.8, size: [0.24, 0.17, 0.03] };
    let [a, b, c] = book.size;
    let [least, middle, most] = [0, 1, 2].map(|k| Inertia::cuboid(book.mass, a, b, c).value()[(k, k)]);
    assert!(least < middle && middle < most);

    // About each axis in turn, a thousandth beside it.
    let spin = SPIN;
    let spun = |axis: usize| book.spun(axis, 1e-3);
    let motion = book.simulate(spun(1)?).until(30.0).tolerance(1e-12).run()?;
    println!("{}", motion.summary());

    // Landau's formulas; where L² < 2 E I₂ the least and the most moment change places.
    let omega = [spin * 1e-3, spin, spin * 1e-3];
    let sum =
        |power: i32| [least, middle, most].iter().zip(omega).map(|(i, w)| i.powi(power) * w * w).sum::<f64>();
    let (double_energy, momentum) = (sum(1), sum(2));
    let (first, last) = if momentum > double_energy * middle { (least, most) } else { (most, least) };
    let tau = ((last - middle) * (momentum - double_energy * first) / (first * middle * last)).sqrt();
    let m = (middle - first) * (double_energy * last - momentum)
        / ((last - middle) * (momentum - double_energy * first));
    let interval = 2.0 * elliptic_k(m) / tau;

    let flips: Vec<f64> = motion.events().iter().map(|e| e.time()).collect();
    println!("it turns over at {flips:.3?} s, by the closed form every {interval:.9} s");
    assert!(flips.len() >= 5);
    for pair in flips.windows(2) {
        assert!((pair[1] - pair[0] - interval).abs() < 1e-6 * interval, "{}", pair[1] - pair[0]);
    }

    // What is kept: the angular momentum, a vector of the world.
    let momentum_at = |state: &State<Book>| -> Result<Vec3<f64>, SolveError> {
        let mut outputs = [0.0; 6];
        book.outputs(state, &mut outputs)?;
        Ok(Vec3::new(outputs[3], outputs[4], outputs[5]))
    };
    let drift = (momentum_at(&motion.end())? - momentum_at(&motion.at(0.0))?).norm() / momentum.sqrt();
    println!("angular momentum drifts by {drift:.1e} of itself");
    assert!(drift < 1e-9);

    // About the least and the most moment of inertia it just turns.
    let component = |motion: &Motion<Book>, axis: usize| {
        let mut line = Vec::new();
        for state in motion.sample(common::times(30.0, 3000)) {
            let mut outputs = [0.0; 6];
            if book.outputs(&state, &mut outputs).is_ok() {
                line.push((state.t, outputs[axis]));
            }
        }
        line
    };
    let mut panel =
        Panel::new(Axis::new("time in s"), Axis::new("spin about the axis it was spun about, in rad/s"));
    for (axis, name) in [(0, "least moment"), (1, "intermediate"), (2, "most")] {
        let motion = book.simulate(spun(axis)?).until(30.0).tolerance(1e-11).run()?;
        let line = component(&motion, axis);
        let least = line.iter().fold(f64::INFINITY, |least, (_, w)| least.min(*w));
        assert!(if axis == 1 { least < -0.99 * spin } else { least > 0.99 * spin }, "{name}: {least}");
        panel = panel.line(name, line);
    }
    let mut files = common::Files::of("tumbling_book");
    Chart::new("A book spun about each of its axes")
        .panel(panel)
        .panel_height(320.0)
        .write_svg(files.path("spin.svg"))?;
    motion.animate(files.path("tumbling.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
