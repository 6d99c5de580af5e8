//! A coin rolls on a table without slipping, in a circle. Pushed, it wobbles about that circle.
//!
//!     ṙ + ω × (contact − r) = 0
//!     T = ½ m |ṙ|² + ½ ω·I ω,        V = m g r cos(lean)
//!
//! Leaning by β on a circle of radius R it spins with γ̇² = 4 g sin β / ((6 − 5 ρ sin β) ρ r cos
//! β), ρ = r/R (C. Le Saux, R. I. Leine and C. Glocker, J. Nonlinear Sci. 15 (2005) 27).

mod common;
use dynamics::error::StateError;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A coin rolls on a table without slipping, in a circle. Pushed, it wobbles about that circle; slower, it
/// wobbles more and more. Energy is conserved, so it never falls flat. Drag it, and turn the picture.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, yaw: rad, lean: rad, spin: rad)]
#[units(mass: kg, radius: m, g: m / s^2)]
struct Coin {
    mass: f64,
    radius: f64,
    g: f64,
}

#[dynamics]
impl Coin {
    /// Heading and lean, without the spin: x along the track, y along the axle, −z toward the table.
    fn leaning(&self, q: &Coordinates<Self>) -> Frame {
        let center = vec3(q.x, q.y, self.radius * q.lean.cos());
        Frame::new(center, Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.lean))
    }
    /// The axle is y: a thin disk has half its inertia across.
    fn coin(&self, q: &Coordinates<Self>) -> RigidBody {
        let across = 0.25 * self.mass * self.radius.powi(2);
        let inertia = Mat3::diagonal(across, 2.0 * across, across);
        RigidBody::new(
            self.mass,
            Vec3::ZERO,
            inertia,
            self.leaning(q).frame(Vec3::ZERO, Mat3::rotation_y(q.spin)),
        )
    }
    fn contact(&self, q: &Coordinates<Self>) -> Vec3 {
        self.leaning(q).point(-self.radius * Vec3::Z)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.coin(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.coin(q).potential_energy(-self.g * Vec3::Z)
    }
    /// What is fixed in the coin rests where it touches the table.
    #[nonholonomic]
    fn rolling(&self, q: &Coordinates<Self>) -> Vec2 {
        let slip = self.coin(q).frame.carried_velocity(self.contact(q));
        vec2(slip.x, slip.y)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let frame = self.coin(q).frame;
        let along = |y: f64| frame.point(vec3(0.0, y, 0.0));
        // A mark beside the rim shows how it turns.
        let mark = frame.point(vec3(0.0, 0.1 * self.radius, 0.75 * self.radius));
        Drawing::new()
            .cylinder(along(-0.07 * self.radius), along(0.07 * self.radius), self.radius)
            .color(Color::Red)
            .disc(mark, 0.1 * self.radius)
            .plain()
            .trace("contact", self.contact(q))
    }
}

impl Coin {
    /// Rolls with this lean on a circle of this radius; `push` is the rate of the lean.
    fn circling(&self, lean: f64, circle: f64, push: f64) -> Result<State<Self>, StateError> {
        let (spin, yaw, speed) = self.steady_rates(lean, circle);
        let coin = self.state().lean(lean).x_rate(speed).yaw_rate(yaw).spin_rate(spin);
        coin.lean_rate(push).y_rate(-self.radius * push * lean.cos()).build()
    }
    /// Spin, yaw and the speed of the centre of mass on a circle of the contact.
    fn steady_rates(&self, lean: f64, circle: f64) -> (f64, f64, f64) {
        let ratio = self.radius / circle;
        let spin = (4.0 * self.g * lean.sin()
            / ((6.0 - 5.0 * ratio * lean.sin()) * ratio * self.radius * lean.cos()))
        .sqrt();
        // The contact describes the circle; the center of mass is nearer to its middle by r sin β.
        let yaw = -ratio * spin;
        (spin, yaw, self.radius * (spin + yaw * lean.sin()))
    }
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let coin = Coin { mass: 0.0075, radius: 0.012, g: 9.81 };
    let lean = 25.0_f64.to_radians();
    Ok(coin
        .live(coin.circling(lean, 0.05, 4.0)?)
        .title("Rolling coin")
        .first_start("pushed")
        .start("steady circle", coin.circling(lean, 0.05, 0.0)?)
        .start("wide circle", coin.circling(0.15, 0.15, 0.0)?)
        .start("low and narrow", coin.circling(0.9, 0.03, 0.0)?)
        .range("radius", 0.006, 0.024)
        .range("g", 1.0, 25.0)
        .hold(["mass"])
        .method(methods::Dop853)
        .plot(["lean", "yaw_rate"])
        .phase("lean")
        .finish()?)
}

fn main() -> common::Outcome {
    let coin = Coin { mass: 0.0075, radius: 0.012, g: 9.81 };
    // 25° of lean on a circle of 5 cm.
    let (lean, circle) = (25.0_f64.to_radians(), 0.05);
    let (spin, yaw, _) = coin.steady_rates(lean, circle);
    let steady = coin.circling(lean, circle, 0.0)?;
    // From a guess: turning and spin stay, the lean is looked for.
    let guess = 0.9 * lean;
    let near = coin
        .state()
        .lean(guess)
        .x_rate(coin.radius * (spin + yaw * guess.sin()))
        .yaw_rate(yaw)
        .spin_rate(spin);
    let found = coin.steady(&near.build()?)?;
    println!("with this spin it rolls steadily at {:.10}° of lean", found.state.lean().to_degrees());
    assert!((found.state.lean() - lean).abs() < 1e-12);
    let period = std::f64::consts::TAU / yaw.abs();
    let motion = coin.simulate(steady).until(4.0 * period).tolerance(1e-12).run()?;
    println!("{}", motion.summary());
    let end = motion.end();
    println!(
        "after four circles of {period:.4} s it is back to {:.1e} m, and leans by {:.10}°",
        end.x().hypot(end.y()),
        end.lean().to_degrees()
    );
    assert!(end.x().hypot(end.y()) < 1e-9 && (end.lean() - lean).abs() < 1e-9);
    let widest = motion.sample(common::times(period, 400)).map(|s| s.x().hypot(s.y())).fold(0.0, f64::max);
    assert!((widest - 2.0 * (circle - coin.radius * lean.sin())).abs() < 1e-5, "the circle is {widest} wide");

    // Pushed, it wobbles about the circle, and gives nothing away.
    let lean_rate = 4.0;
    let pushed = coin.circling(lean, circle, lean_rate)?;
    let wobbling = coin.simulate(pushed).until(4.0 * period).tolerance(1e-11).run()?;
    println!("{}", wobbling.summary());
    assert!(wobbling.summary().energy_drift < 1e-9);
    let leans: Vec<f64> = wobbling.sample(common::times(4.0 * period, 4000)).map(|s| s.lean()).collect();
    let (least, most) = leans.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
    println!("pushed, it leans between {:.2}° and {:.2}°", least.to_degrees(), most.to_degrees());
    assert!(least < lean && lean < most && most < 1.5);

    let mut files = common::Files::of("rolling_coin");
    let track = |motion: &Motion<Coin>| {
        motion.sample(common::times(4.0 * period, 4000)).map(|s| (s.x(), s.y())).collect::<Vec<_>>()
    };
    Chart::new("A coin on a table")
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("y in m"))
                .equal_axes()
                .line("steady", track(&motion))
                .line("pushed", track(&wobbling)),
        )
        .panel_height(420.0)
        .write_svg(files.path("from_above.svg"))?;
    wobbling.animate(files.path("rolling.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
