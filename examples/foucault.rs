//! Foucault's pendulum in the Panthéon: the complete motion on the rotating Earth.
//!
//!     T = ½ m |d/dt (R(Ω t) r)|²,        V = −m μ/|r|,        r from the center of the Earth
//!
//! Nothing is left out: neither the centrifugal force nor the change of gravity with place. The Coriolis
//! force appears nowhere by name. A plumb line does not point to the center, and the pendulum hangs along it:
//! the axes east, north, up are those of the plumb line at the geographic latitude φ.
//!
//! The plane of the swing turns clockwise at Ω sin φ. A pendulum released from rest swings on a narrow
//! ellipse, which by itself turns back by 3/8 (a/l)² of that (Airy 1851). The centrifugal force grows with
//! Ω² to the east and with Ω² sin² φ to the north, so swings in these directions have different
//! periods, by Ω² cos² φ/(2 ω). That widens the ellipse, and Airy's formula then turns it further. Over
//! a time in which the plane turns by ψ this takes 3/64 (a/l)² cot² φ (1 − sin 2ψ/2ψ) of the mean
//! rate.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// Foucault's pendulum on a small planet with a day of five minutes. Nobody turns its plane: seen from the
/// turning ground, it turns by itself at Ω sin φ. Take the latitude to zero, the equator, and it stays.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(east: m, north: m)]
#[units(mass: kg, length: m, mu: m^3 / s^2, place: m, rotation: rad / s, latitude: rad)]
struct Foucault {
    mass: f64,
    length: f64,
    /// Gravity of the Earth, G M.
    mu: f64,
    /// The point of suspension from the center of the Earth: away from the axis, and along it.
    place: [f64; 2],
    rotation: f64,
    /// Of the plumb line.
    latitude: f64,
}

#[dynamics]
impl Foucault {
    /// East, north and up where the pendulum hangs.
    fn site(&self, q: &Coordinates<Self>) -> Frame {
        let (sin, cos) = self.latitude.sin_cos();
        let axes = Mat3::from_columns(Vec3::Y, vec3(-sin, 0.0, cos), vec3(cos, 0.0, sin));
        let earth = Frame::turned(Mat3::rotation_z(self.rotation * q.t));
        earth.frame(vec3(self.place[0], 0.0, self.place[1]), axes)
    }
    /// The bob, seen from the point of suspension; the length of the wire is kept by definition.
    fn bob(&self, q: &Coordinates<Self>) -> Vec3 {
        let down = (self.length.powi(2) - q.east.powi(2) - q.north.powi(2)).sqrt();
        vec3(q.east, q.north, -down)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.site(q).point(self.bob(q)).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        -self.mass * self.mu / self.site(q).point(self.bob(q)).norm()
    }
    /// Rate of the distance from the middle: falls through zero at the end of each swing.
    #[event]
    fn turning(&self, q: &Coordinates<Self>) -> Expr {
        q.east * q.east.dt() + q.north * q.north.dt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bob = self.bob(q);
        Drawing::new().line([0.0; 3], bob).trace("bob", bob).disc(bob, 0.02 * self.length)
    }
}

/// Where on a sphere the plumb line has this latitude: along it pull gravity and the centrifugal force
/// together.
fn plumb(mu: f64, radius: f64, rotation: f64, latitude: f64) -> [f64; 2] {
    let pull = mu / radius.powi(3);
    let geocentric = f64::atan((pull - rotation * rotation) / pull * latitude.tan());
    [radius * geocentric.cos(), radius * geocentric.sin()]
}

/// The live page: a planet of 5 km with a day of five minutes, to be seen.
pub(crate) fn live() -> common::Page {
    let (radius, latitude) = (5e3_f64, 48.846_f64.to_radians());
    let (mu, rotation) = (9.81 * radius.powi(2), std::f64::consts::TAU / 300.0);
    let place = plumb(mu, radius, rotation, latitude);
    let model = Foucault { mass: 28.0, length: 10.0, mu, place, rotation, latitude };
    Ok(model
        .live(model.state().east(4.0).build()?)
        .title("Foucault's pendulum")
        .first_start("let go, seen from the ground")
        .start("let go, seen from space", model.state().east(4.0).north_rate(-rotation * 3.0).build()?)
        .range("latitude", 0.0, 1.5)
        .range("length", 5.0, 20.0)
        .hold(["mass", "mu", "place[0]", "place[1]", "rotation"])
        .method(methods::Dop853)
        .tolerance(1e-10)
        .plot(["east", "north"])
        .finish()?)
}

fn main() -> common::Outcome {
    let day = 86164.1; // a turn of the Earth against the stars
    let earth = std::f64::consts::TAU / day;
    let latitude = 48.846_f64.to_radians();
    let (mu, radius) = (3.986e14, 6.371e6);
    let place = plumb(mu, radius, earth, latitude);
    let pantheon = Foucault { mass: 28.0, length: 67.0, mu, place, rotation: earth, latitude };
    let off = latitude - (pantheon.place[1] / pantheon.place[0]).atan();
    println!("the plumb line passes {:.3}° beside the center of the Earth", off.to_degrees());
    let amplitude = 3.0;
    let start = pantheon.state().east(amplitude).build()?;
    let hours = 6.0;
    let motion = pantheon.simulate(start).until(hours * 3600.0).tolerance(1e-12).run()?;
    println!("{}", motion.summary());

    // The direction of the swing at every second turning point is that of the plane.
    let turns: Vec<_> =
        motion.events().iter().filter(|e| e.direction == Direction::Falling).skip(1).step_by(2).collect();
    let direction = |k: usize| f64::atan2(turns[k].after.north(), turns[k].after.east());
    let (first, last) = (0, turns.len() - 1);
    // Over six hours the plane turns by less than π, so that atan2 needs no unwinding.
    let rate = (direction(last) - direction(first)) / (turns[last].time() - turns[first].time());
    let plane = -earth * pantheon.latitude.sin();
    let airy = plane * (1.0 - 0.375 * (amplitude / pantheon.length).powi(2));
    println!("the plane turns by {:.4}° an hour", rate.to_degrees() * 3600.0);
    println!(
        "       −Ω sin φ is {:.4}°, less the turning of the ellipse {:.4}°",
        plane.to_degrees() * 3600.0,
        airy.to_degrees() * 3600.0
    );
    assert!((rate / plane - 1.0).abs() < 1e-3);
    let turned = 2.0 * (plane * (turns[last].time() - turns[first].time())).abs();
    let centrifugal =
        3.0 / 64.0 * (amplitude / pantheon.length / latitude.tan()).powi(2) * (1.0 - turned.sin() / turned);
    println!(
        "       which is off by {:.2e} of it; the centrifugal force takes {centrifugal:.2e}",
        rate / airy - 1.0
    );
    assert!((rate / airy - 1.0 + centrifugal).abs() < 2e-6);

    // The same with a wire of 10 m on a planet of 20 km and a day of ten minutes, to be seen.
    let (mu, rotation) = (9.81 * 2e4_f64.powi(2), std::f64::consts::TAU / 600.0);
    let toy = Foucault {
        length: 10.0,
        mu,
        place: plumb(mu, 2e4, rotation, latitude),
        rotation,
        ..pantheon.clone()
    };
    let seen = toy.simulate(toy.state().east(4.0).build()?).until(300.0).tolerance(1e-10).run()?;
    let mut files = common::Files::of("foucault");
    let hour = |k: usize| turns[k].time() / 3600.0;
    let every = (0..turns.len()).step_by(100);
    Chart::new("Foucault's pendulum")
        .panel(
            Panel::new(Axis::new("time in h"), Axis::new("direction of the swing in degrees"))
                .line("−Ω t sin φ", [0.0, hours].map(|h| (h, (plane * 3600.0 * h).to_degrees())))
                .points("computed", every.map(|k| (hour(k), direction(k).to_degrees()))),
        )
        .panel(Panel::new(Axis::new("east in m"), Axis::new("north in m")).equal_axes().line(
            "with a day of ten minutes",
            seen.sample(common::times(300.0, 6000)).map(|s| (s.east(), s.north())),
        ))
        .panel_height(420.0)
        .write_svg(files.path("from_above.svg"))?;
    seen.animate(files.path("short_day.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
