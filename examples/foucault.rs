//! Foucault's pendulum in the Panthéon, seen from the turning Earth.
//!
//!     T = ½ m |ṙ|² + m ṙ·(Ω × r),        Ω = Ω (0, cos φ, sin φ) in axes east, north, up
//!
//! The centrifugal part ½ m |Ω × r|² belongs to g, which a plumb line shows. The plane of the swing turns clockwise at Ω sin φ. A pendulum released from rest swings on a narrow ellipse, which by itself
//! turns back by 3/8 (a/l)² of that (Airy 1851).

mod common;
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(east: m, north: m)]
#[units(mass: kg, length: m, g: m / s^2, rotation: rad / s, latitude: rad)]
struct Foucault {
    mass: f64,
    length: f64,
    g: f64,
    rotation: f64,
    latitude: f64,
}

#[dynamics]
impl Foucault {
    /// The bob, seen from the point of suspension; the length of the wire is kept by definition.
    fn bob(&self, q: &Coordinates<Self>) -> Vec3 {
        let down = (self.length.powi(2) - q.east.powi(2) - q.north.powi(2)).sqrt();
        vec3(q.east, q.north, -down)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let rotation = self.rotation * vec3(0.0, self.latitude.cos(), self.latitude.sin());
        let velocity = self.bob(q).dt();
        self.mass * (0.5 * velocity.norm_squared() + velocity.dot(rotation.cross(self.bob(q))))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bob(q).z
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

fn main() -> common::Outcome {
    let day = 86164.1; // a turn of the Earth against the stars
    let earth = std::f64::consts::TAU / day;
    let pantheon = Foucault { mass: 28.0, length: 67.0, g: 9.81, rotation: earth, latitude: 48.846_f64.to_radians() };
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
    assert!((rate / airy - 1.0).abs() < 2e-5);

    // The same with a day of ten minutes and a wire of 10 m, to be seen.
    let toy = Foucault { length: 10.0, rotation: std::f64::consts::TAU / 600.0, ..pantheon.clone() };
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
        .panel(
            Panel::new(Axis::new("east in m"), Axis::new("north in m")).equal_axes().line(
                "with a day of ten minutes",
                seen.sample(common::times(300.0, 6000)).map(|s| (s.east(), s.north())),
            ),
        )
        .panel_height(420.0)
        .write_svg(files.path("from_above.svg"))?;
    seen.animate(files.path("short_day.html"))?;
    files.list();
    Ok(())
}
