//! A cart on a track without a second rail. It flies off a hill that is too sharp for its speed, and lands
//! behind it.
//!
//!     T = ½ m (ẋ² + ẏ²),        V = m g y
//!     y − f(x) ≥ 0,        λ ≥ 0,        λ (y − f(x)) = 0
//!
//! Unlike in `roller_coaster`, the cart has both coordinates of the plane, and the track is a constraint that
//! holds while its multiplier pushes. It lets go where v² κ = g cos α. Where the cart lands, it takes away
//! the velocity across the track.

mod common;
use dynamics::SplineError;
use dynamics::error::StateError;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

/// A cart on a track without a second rail flies off a hill that is too sharp for its speed, and lands behind
/// it. The arrow is the push of the track, which ends where the cart takes off. Begin with less speed, until
/// it stays on the track.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, g: m / s^2, end: m)]
struct Coaster {
    mass: f64,
    g: f64,
    /// Where the track ends.
    end: f64,
    track: CubicSpline,
}

#[dynamics]
impl Coaster {
    fn cart(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.cart(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic(switched)]
    fn rail(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.track.at(q.x)
    }
    /// Push of the track in weights; 0 in flight. ∇Φ = (−f′, 1), and its length is that of velocity over ẋ.
    #[output]
    fn push(&self, q: &Coordinates<Self>) -> Expr {
        let slope = self.track.at(q.x).dt() / q.x.dt();
        q.reaction(Self::rail) * (1.0 + slope.powi(2)).sqrt() / (self.mass * self.g)
    }
    #[event]
    fn end_of_track(&self, q: &Coordinates<Self>) -> Expr {
        q.x - self.end
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (cart, way) = (self.cart(q), self.cart(q).dt());
        let along = way / way.norm();
        let [first, last] = self.track.domain();
        let seat = cart + 0.9 * along.perp();
        Drawing::new()
            .color(Color::Faint)
            .curve(first, last, 400, |x| [x, self.track.derivatives(x)[0]])
            .plain()
            .fill(Color::Blue)
            .rectangle(seat, 3.2, 1.4, along.y.atan2(along.x))
            .color(Color::Red)
            .arrow(seat, seat + 4.0 * self.push(q) * along.perp())
    }
}

impl Coaster {
    fn new() -> Result<Self, SplineError> {
        // An event looks beyond the end of the track before it says that the end was passed.
        let track = track()?.extrapolate_linearly();
        let [_, end] = track.domain();
        Ok(Self { mass: 600.0, g: 9.81, end, track })
    }
    /// At the top of the track, with this speed to the right.
    fn at_top(&self, speed: f64) -> Result<State<Self>, StateError> {
        let (top, slope, _) = self.at(0.0);
        self.state().y(top).x_rate(speed).y_rate(speed * slope.tan()).build()
    }
    /// Height, slope angle and curvature of the track, positive where it bends downward.
    fn at(&self, x: f64) -> (f64, f64, f64) {
        let [height, slope, second, ..] = self.track.derivatives(x);
        (height, slope.atan(), -second / (1.0 + slope * slope).powf(1.5))
    }
}

fn speed(state: &State<Coaster>) -> f64 {
    state.x_rate().hypot(state.y_rate())
}

/// Down 16 m, over a hill of 9 m, and out.
fn track() -> Result<CubicSpline, SplineError> {
    let height = |x: f64| 16.0 * (-(x / 16.0).powi(2)).exp() + 9.0 * (-((x - 57.0) / 14.0).powi(2)).exp();
    let x: Vec<f64> = (0..=55).map(|k| 2.0 * f64::from(k)).collect();
    CubicSpline::not_a_knot(&x, &x.iter().map(|&x| height(x)).collect::<Vec<_>>())
}

/// The live page.
pub(crate) fn live() -> common::Page {
    let coaster = Coaster::new()?;
    let start = |speed: f64| coaster.at_top(speed);
    Ok(coaster
        .live(start(1.0)?)
        .title("Jump off the track")
        .first_start("1 m/s at the top")
        .start("6 m/s", start(6.0)?)
        .start("10 m/s", start(10.0)?)
        .range("mass", 100.0, 2000.0)
        .range("g", 1.0, 25.0)
        .hold(["end"])
        .contact("rail", 0.0)
        .tolerance(1e-9)
        .plot(["y", "push"])
        .stop_at("end_of_track", Direction::Rising)
        .finish()?)
}

fn main() -> common::Outcome {
    let coaster = Coaster::new()?;
    let end = coaster.end;
    let ride = coaster
        .simulate(coaster.at_top(1.0)?)
        .until(60.0)
        .tolerance(1e-11)
        .contact("rail", 0.0)
        .stop_at("end_of_track", Direction::Rising)
        .run()?;
    println!("{}\n", ride.summary());
    assert!(ride.summary().energy_drift < 1e-9);
    let [off, landing] =
        ride.events().iter().filter(|event| event.name == "rail contact").collect::<Vec<_>>()[..]
    else {
        return Err("it does not jump once".into());
    };

    // It lets go where the weight no longer bends its path as much as the hill does.
    let (start, gravity) = (off.after, vec2(0.0, -coaster.g));
    let (_, slope, curvature) = coaster.at(start.x());
    let (needed, weight) = (curvature * speed(&start).powi(2), coaster.g * slope.cos());
    println!(
        "it flies off at x = {:.3} m, where v² κ = {needed:.6} m/s² and g cos α = {weight:.6} m/s²",
        start.x()
    );
    assert!((needed / weight - 1.0).abs() < 1e-8 && off.impacts.is_empty());
    let on_track = ride.sample(common::times(off.time(), 500)).take(500);
    assert!(on_track.into_iter().all(|state| ride.outputs_of(&state)[0] > 0.0), "the track pulls");

    // The flight is a parabola above the track, without a push.
    let flight = landing.time() - off.time();
    for state in ride.sample(common::times(flight, 200).skip(1).take(199).map(|t| off.time() + t)) {
        let t = state.t - off.time();
        let parabola =
            vec2(start.x(), start.y()) + t * vec2(start.x_rate(), start.y_rate()) + 0.5 * t * t * gravity;
        assert!((parabola - vec2(state.x(), state.y())).norm() < 1e-9);
        assert!(state.y() > coaster.at(state.x()).0 && ride.outputs_of(&state)[0] == 0.0);
    }

    // Landing takes the velocity across the track and leaves that along it.
    let (down, along) = (landing.before, landing.after);
    let angle = coaster.at(down.x()).1;
    let across = down.y_rate() * angle.cos() - down.x_rate() * angle.sin();
    let kept = down.x_rate() * angle.cos() + down.y_rate() * angle.sin();
    let lost = 0.5 * coaster.mass * across * across;
    println!(
        "after {flight:.3} s it lands at x = {:.3} m with {:.2} m/s across the track: ½ m vₙ² = {lost:.4} J, \
         lost {:.4} J",
        down.x(),
        across.abs(),
        landing.energy_lost()
    );
    assert!((landing.energy_lost() / lost - 1.0).abs() < 1e-9);
    assert!((speed(&along) / kept - 1.0).abs() < 1e-12);
    // What it lost is missing at the end.
    let energy = ride.energy_at(0.0);
    assert!(((ride.energy_at(ride.end_time()) + lost) / energy - 1.0).abs() < 1e-9);

    let mut files = common::Files::of("coaster_jump");
    let instants: Vec<_> = ride.sample(common::times(ride.end_time(), 1200)).collect();
    let over_way = |title| Panel::new(Axis::new("x in m"), Axis::new(title));
    let surface = common::times(end, 400).map(|x| (x, coaster.at(x).0));
    Chart::new("A jump")
        .panel(
            over_way("height in m")
                .line("track", surface)
                .line("cart", instants.iter().map(|s| (s.x(), s.y()))),
        )
        .panel(over_way("speed in m/s").line("speed", instants.iter().map(|s| (s.x(), speed(s)))))
        .panel(
            over_way("track / weight")
                .line("push of the track", instants.iter().map(|s| (s.x(), ride.outputs_of(s)[0]))),
        )
        .write_svg(files.path("jump.svg"))?;
    let film = ride.animation().title("A cart that jumps").plot(["y", "push"]);
    film.write_html(files.path("jump.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
