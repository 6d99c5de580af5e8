//! A cart on a roller coaster whose track is a smooth curve through surveyed points.
//!
//!     r(s) = (x(s), y(s)),        L = ½ m |r′(s)|² ṡ² − m g y(s)
//!
//! The track defines the position. It is not a constraint: there is one coordinate and no multiplier. The
//! rail pushes with N = m n·(r̈ + g e_y). As long as N > 0 all the way around the loop, no belt is needed.

mod common;
use dynamics::SplineError;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A cart rides a track with a loop; the arrow is its velocity. Its speed depends on the height alone. Look
/// at the force of the rail in the loop, then begin slower or lower: where that force turns negative, only a
/// second rail holds the cart.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s: m)]
#[units(mass: kg, g: m / s^2, end: m)]
struct RollerCoaster {
    mass: f64,
    g: f64,
    /// Where the track ends.
    end: f64,
    x: CubicSpline,
    y: CubicSpline,
}

#[dynamics]
impl RollerCoaster {
    fn cart(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(self.x.at(q.s), self.y.at(q.s))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.cart(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.cart(q).y
    }
    /// Force of the rail on the cart, along its normal (to the left of the direction of travel).
    #[output]
    fn rail(&self, q: &Coordinates<Self>) -> Expr {
        let velocity = self.cart(q).dt();
        let normal = velocity.perp() / velocity.norm();
        self.mass * normal.dot(velocity.dt() + vec2(0.0, self.g))
    }
    #[output]
    fn speed(&self, q: &Coordinates<Self>) -> Expr {
        self.cart(q).dt().norm()
    }
    #[event]
    fn end_of_track(&self, q: &Coordinates<Self>) -> Expr {
        q.s - self.end
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let cart = self.cart(q);
        let [first, last] = self.x.domain();
        Drawing::new()
            .color(Color::Faint)
            .curve(first, last, 400, |s| [self.x.derivatives(s)[0], self.y.derivatives(s)[0]])
            .plain()
            .disc(cart, 0.8)
            .color(Color::Red)
            .arrow(cart, cart + 0.5 * cart.dt())
    }
}

/// A descent of 24 m, a loop of 14 m in the shape of two Euler spirals, a hump and a run-out.
fn track() -> Vec<[f64; 2]> {
    use std::f64::consts::{PI, TAU};
    let wave = |from: f64, length: f64, height: f64, turns: f64| {
        let place =
            move |part: f64| [from + part * length, 0.5 * height * (1.0 + (part * turns * TAU).cos())];
        (0..12).map(move |k| place(f64::from(k) / 12.0))
    };
    let mut points: Vec<[f64; 2]> = wave(0.0, 40.0, 24.0, 0.5).chain([[40.0, 0.0]]).collect();
    // The heading grows as the square of the way to the top, so that the rail's push grows gently; then
    // mirrored.
    let (half, parts) = (28.0, 640);
    let [mut x, mut y] = [45.0, 0.0];
    for k in 0..2 * parts {
        if k % 40 == 0 {
            points.push([x, y]);
        }
        let way = (f64::from(k) + 0.5) / f64::from(parts);
        let heading = if way < 1.0 { PI * way * way } else { TAU - PI * (2.0 - way).powi(2) };
        x += half / f64::from(parts) * heading.cos();
        y += half / f64::from(parts) * heading.sin();
    }
    points.push([x, y]);
    points.extend(wave(x + 5.0, 60.0, -3.0, 1.0).map(|[x, y]| [x, y + 3.0]));
    points.extend([65.0, 70.0, 75.0, 80.0].map(|run| [x + run, 0.0]));
    points
}

impl RollerCoaster {
    /// On the track through these points.
    fn on(points: &[[f64; 2]]) -> Result<Self, SplineError> {
        // The parameter s is the length of the chords: close to the length of the track.
        let mut s = vec![0.0];
        s.extend(points.windows(2).scan(0.0, |sum, p| {
            *sum += f64::hypot(p[1][0] - p[0][0], p[1][1] - p[0][1]);
            Some(*sum)
        }));
        let spline =
            |axis: usize| CubicSpline::not_a_knot(&s, &points.iter().map(|p| p[axis]).collect::<Vec<_>>());
        // An event looks beyond the end of the track before it says that the end was passed.
        let (x, y) = (spline(0)?.extrapolate_linearly(), spline(1)?.extrapolate_linearly());
        Ok(Self { mass: 600.0, g: 9.81, end: s[s.len() - 1], x, y })
    }
}

/// What a rider sees and feels.
struct Instant {
    t: f64,
    place: Vec2<f64>,
    speed: f64,
    /// Force of the rail in weights of the cart.
    rail: f64,
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let coaster = RollerCoaster::on(&track())?;
    let start = |s: f64, speed: f64| coaster.state().s(s).s_rate(speed).build();
    Ok(coaster
        .live(start(0.0, 1.0)?)
        .title("Roller coaster")
        .first_start("from the top")
        .start("faster", start(0.0, 10.0)?)
        .start("from the middle of the slope", start(22.0, 0.0)?)
        .start("in the valley", start(46.0, 2.0)?)
        .range("mass", 100.0, 2000.0)
        .range("g", 1.0, 25.0)
        .hold(["end"])
        .tolerance(1e-9)
        .plot(["rail", "speed"])
        .stop_at("end_of_track", Direction::Rising)
        .finish()?)
}

fn main() -> common::Outcome {
    let points = track();
    let coaster = RollerCoaster::on(&points)?;
    let ride = coaster
        .simulate(coaster.state().s_rate(1.0).build()?)
        .until(60.0)
        .tolerance(1e-10)
        .stop_at("end_of_track", Direction::Rising)
        .run()?;
    println!("{}", ride.summary());
    // Third derivatives of the spline jump at its points: steps end there, and the tolerance keeps its
    // promise.
    assert!(ride.summary().energy_drift < 1e-9);

    let weight = coaster.mass * coaster.g;
    let instants: Vec<Instant> = ride
        .sample(common::times(ride.end_time(), 1000))
        .map(|state| {
            let [push, speed] = ride.outputs_of(&state)[..] else { unreachable!("two outputs") };
            let place = coaster.cart(&ride.coordinates_of(&state)).value();
            Instant { t: state.t, place, speed, rail: push / weight }
        })
        .collect();
    for now in &instants {
        // Speed follows height alone, wherever the track has been: v² = v₀² + 2 g (y₀ − y).
        let from_height = (instants[0].speed.powi(2) + 2.0 * coaster.g * (points[0][1] - now.place.y)).sqrt();
        assert!((now.speed - from_height).abs() < 1e-9 * from_height);
        assert!(now.rail > 0.0, "the cart leaves the rail");
    }
    let inside = instants.iter().filter(|now| (44.0..62.0).contains(&now.place.x));
    let top = inside.max_by(|a, b| a.place.y.total_cmp(&b.place.y)).ok_or("no loop")?;
    println!("top of the loop: {:.1} m/s, the rail pushes with {:.2} times the weight", top.speed, top.rail);
    let least = instants.iter().map(|now| now.rail).fold(f64::INFINITY, f64::min);
    println!("the rail pushes with at least {least:.2} times the weight: nobody needs a belt");

    let mut files = common::Files::of("roller_coaster");
    let panel = |title, name, value: fn(&Instant) -> f64| {
        let curve = instants.iter().map(|now| (now.t, value(now)));
        Panel::new(Axis::new("time in s"), Axis::new(title)).line(name, curve)
    };
    Chart::new("A ride")
        .panel(panel("height in m", "height", |now| now.place.y))
        .panel(panel("speed in m/s", "speed", |now| now.speed))
        .panel(panel("rail / weight", "force of the rail", |now| now.rail))
        .write_svg(files.path("ride.svg"))?;
    ride.animate(files.path("ride.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
