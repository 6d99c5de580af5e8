//! A building, and a mass on its roof that takes its swaying away.
//!
//!     M ẍ + C ẋ + K x = forces
//!     roof mass μ of the first mode's, tuned to ω₁/(1 + μ), ζ² = 3μ/(8(1 + μ)³)
//!
//! Five storeys shear against each other. Wind shakes the roof, or the ground moves. With den Hartog's tuning
//! (*Mechanical Vibrations*, §3.3) the single tall peak of the first mode becomes two low peaks of nearly
//! equal height, and a gust dies away in a few swings.

mod common;
use dynamics::analysis::{Load, Spectrum, StateSpace, Window, frequencies};
use dynamics::error::StateError;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

const STOREYS: usize = 5;

/// A building of five storeys with a tuned mass on its roof, pushed by a gust; the sway is enlarged. The mass
/// swings in place of the building and its damper takes the energy. Lock the damper (100 times its value) or
/// take it away, and the building sways for long.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 5], roof: m)]
#[inputs(wind: N, ground: m, ground_rate: m / s)]
#[units(floor: kg, shear: N / m, material: s, mass: kg, spring: N / m, damper: N * s / m)]
struct Building {
    floor: f64,
    shear: f64,
    material: f64,
    mass: f64,
    spring: f64,
    damper: f64,
}

#[dynamics]
impl Building {
    fn place(&self, q: &Coordinates<Self>, i: usize) -> Expr {
        if i == 0 { q.ground } else { q.x[i - 1] }
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.mass * q.roof.dt().powi(2);
        for i in 0..5 {
            sum += 0.5 * self.floor * q.x[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn columns(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.spring * (q.roof - q.x[4]).powi(2);
        for i in 0..5 {
            sum += 0.5 * self.shear * (self.place(q, i + 1) - self.place(q, i)).powi(2);
        }
        sum
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.damper * (q.roof - q.x[4]).dt().powi(2);
        for i in 1..5 {
            sum += self.material * self.shear * (q.x[i] - q.x[i - 1]).dt().powi(2);
        }
        0.5 * sum
    }
    #[force]
    fn outside(&self, q: &Coordinates<Self>) -> Force {
        let foundation = self.material * self.shear * (q.ground_rate - q.x[0].dt());
        Force::along(q.x[4], q.wind) + Force::along(q.x[0], foundation)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let mut drawing = Drawing::new().ground([-8.0, 0.0], [14.0, 0.0]);
        for i in 0..5 {
            let (below, above) = (vec2(self.place(q, i), 3.0 * i as f64), vec2(q.x[i], 3.0 * i as f64 + 3.0));
            let wide = vec2(6.0, 0.0);
            drawing = drawing.line(below, above).line(below + wide, above + wide).line(above, above + wide);
        }
        drawing.fill(Color::Faint).rectangle(vec2(q.roof + 3.0, 15.5), 1.6, 1.0, 0.0)
    }
}

impl Building {
    /// With this part of the first mode's mass on the roof, tuned.
    fn with(part: f64) -> Self {
        let (floor, shear) = (2.0e5, 1.5e8);
        // Modal mass where the roof moves by 1, and frequency, of a chain with one end free.
        let angle = std::f64::consts::PI / (2.0 * (2.0 * STOREYS as f64 + 1.0));
        let first = 2.0 * f64::sqrt(shear / floor) * angle.sin();
        let shape = |i: usize| (2.0 * angle * i as f64).sin() / (2.0 * angle * STOREYS as f64).sin();
        let modal = floor * (1..=STOREYS).map(|i| shape(i).powi(2)).sum::<f64>();
        let (mass, tuned) = (part * modal, first / (1.0 + part));
        let ratio = f64::sqrt(3.0 * part / (8.0 * (1.0 + part).powi(3)));
        Self {
            floor,
            shear,
            material: 0.02 / first,
            mass,
            spring: mass * tuned * tuned,
            damper: 2.0 * ratio * mass * tuned,
        }
    }
    fn rest(&self) -> Result<State<Self>, StateError> {
        self.state().wind(0.0).ground(0.0).ground_rate(0.0).build()
    }
}

/// A hammer's blow of 1 N s on the roof, simulated: its spectrum is the response to wind,
/// |H| = ½ T · amplitude.
fn hammer(
    tuned: &Building,
    space: &StateSpace,
    peak: f64,
) -> Result<Vec<(f64, f64)>, Box<dyn std::error::Error>> {
    let (until, count) = (80.0, 8000);
    let blow = tuned.state().x_rate([0.0, 0.0, 0.0, 0.0, 1.0 / tuned.floor]);
    let struck = tuned
        .simulate(blow.wind(0.0).ground(0.0).ground_rate(0.0).build()?)
        .until(until)
        .tolerance(1e-10)
        .run()?;
    let interval = until / f64::from(count);
    let samples: Vec<f64> =
        struck.sample((0..count).map(|k| interval * f64::from(k))).map(|s| s.x(4)).collect();
    let spectrum = Spectrum::of(&samples, interval, Window::Rectangular)?;
    let hammered: Vec<(f64, f64)> = spectrum
        .frequencies
        .iter()
        .zip(&spectrum.amplitudes)
        .map(|(w, a)| (*w, 0.5 * until * a))
        .filter(|(w, _)| (1.0..40.0).contains(w))
        .collect();
    let analytic =
        space.frequency_response("wind", "x[4]", &hammered.iter().map(|(w, _)| *w).collect::<Vec<_>>())?;
    let off = hammered.iter().zip(analytic.magnitude()).map(|((_, a), h)| (a - h).abs()).fold(0.0, f64::max);
    println!("the spectrum of a hammer's blow is the response to {:.1e} of its peak", off / peak);
    assert!(off < 2e-3 * peak);
    Ok(hammered)
}

/// The live page: displacements are a hundred times too large, which a linear model permits.
pub(crate) fn live() -> common::Page {
    let tuned = Building::with(0.03);
    let gust =
        |rates: [f64; STOREYS]| tuned.state().x_rate(rates).wind(0.0).ground(0.0).ground_rate(0.0).build();
    let (spring, damper) = (tuned.spring, tuned.damper);
    Ok(tuned
        .live(gust([2.0, 4.0, 6.0, 7.0, 8.0])?)
        .title("Tuned absorber")
        .first_start("a gust")
        .start("a hammer on the roof", gust([0.0, 0.0, 0.0, 0.0, 15.0])?)
        .start("an earthquake's jerk", gust([12.0, 0.0, 0.0, 0.0, 0.0])?)
        .range("damper", 0.0, 100.0 * damper)
        .range("spring", 0.25 * spring, 4.0 * spring)
        .range("material", 0.0, 0.02)
        .range("wind", -3e7, 3e7)
        .hold(["floor", "shear", "mass", "ground", "ground_rate"])
        .plot(["x[4]", "roof"])
        .phase("x[4]")
        .finish()?)
}

fn main() -> common::Outcome {
    // A mass of a millionth is none.
    let (bare, tuned) = (Building::with(1e-6), Building::with(0.03));
    let spaces = [bare.state_space(&bare.rest()?)?, tuned.state_space(&tuned.rest()?)?];
    let grid = frequencies(1.0, 40.0, 1500);
    let [before, after] = [0, 1].map(|k: usize| spaces[k].frequency_response("wind", "x[4]", &grid));
    let (before, after) = (before?, after?);
    for (name, space) in ["without", "with"].into_iter().zip(&spaces) {
        let most = space.largest_response("wind", "x[4]")?;
        println!(
            "{name:>8} absorber: roof sways most at {:.4} rad/s, {:.3e} m/N; no frequency has more than \
             {:.3e}",
            most.frequency, most.magnitude, most.bound
        );
    }
    let peaks = spaces[1].resonances("wind", "x[4]")?;
    let [low, high] = [peaks[0], peaks[1]];
    let ratio = spaces[0].largest_response("wind", "x[4]")?.magnitude / low.magnitude.max(high.magnitude);
    println!("two peaks, {:.4} and {:.4} rad/s, {ratio:.2} times lower", low.frequency, high.frequency);
    assert!(ratio > 4.0 && (low.magnitude / high.magnitude - 1.0).abs() < 0.12, "{low:?} {high:?}");
    // Den Hartog: √(1 + 2/μ) of the static deflection, of the first mode alone and without damping of its
    // own.
    let shaken = |k: usize| {
        spaces[k].frequency_response(
            dynamics::analysis::Excitation::moved("ground", "ground_rate"),
            "x[4]",
            &grid,
        )
    };
    let (ground_before, ground_after) = (shaken(0)?, shaken(1)?);

    // A gust of four seconds.
    let times: Vec<f64> = common::times(30.0, 1500).collect();
    let gust = || [Load::new("wind", [(0.0, 0.0), (1.0, 1e6), (3.0, 1e6), (4.0, 0.0)])];
    let sway = |k: usize| spaces[k].response(&gust(), &["x[4]", "roof"], &[], &times);
    let (sway_before, sway_after) = (sway(0)?, sway(1)?);
    let late = |points: &[(f64, f64)]| {
        points.iter().filter(|(t, _)| *t > 10.0).map(|(_, x)| x.abs()).fold(0.0, f64::max)
    };
    let of = |response: &dynamics::analysis::TimeResponse, name: &str| response.of(name).unwrap_or_default();
    let (then, now) = (late(&of(&sway_before, "x[4]")), late(&of(&sway_after, "x[4]")));
    println!("6 s after the gust the roof sways by {:.2} mm instead of {:.1} mm", 1e3 * now, 1e3 * then);
    assert!(now < 0.2 * then);
    // The simulation of the model itself agrees.
    let law = |t: f64, _: &State<Building>| [1e6 * t.min(4.0 - t).clamp(0.0, 1.0), 0.0, 0.0];
    let motion =
        tuned.simulate(tuned.rest()?).until(30.0).tolerance(1e-9).max_step(0.05).inputs(law).run()?;
    let worst =
        of(&sway_after, "x[4]").iter().map(|(t, x)| (motion.at(*t).x(4) - x).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst:e} m");

    let hammered = hammer(&tuned, &spaces[1], low.magnitude)?;

    let mut files = common::Files::of("tuned_absorber");
    let line = |response: &dynamics::analysis::FrequencyResponse| -> Vec<(f64, f64)> {
        grid.iter().copied().zip(response.magnitude()).collect()
    };
    let panel = |title: &str| Panel::new(Axis::log("ω in rad/s"), Axis::log(title));
    Chart::new("A building without and with a tuned mass on its roof")
        .panel(
            panel("roof by wind in m/N")
                .line("without", line(&before))
                .line("with", line(&after))
                .line("with, by a hammer", hammered),
        )
        .panel(
            panel("roof by ground").line("without", line(&ground_before)).line("with", line(&ground_after)),
        )
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("a gust in m"))
                .line("roof without", of(&sway_before, "x[4]"))
                .line("roof with", of(&sway_after, "x[4]"))
                .line("tuned mass", of(&sway_after, "roof")),
        )
        .write_svg(files.path("responses.svg"))?;
    after.bode().write_svg(files.path("bode.svg"))?;
    after.nyquist().write_svg(files.path("nyquist.svg"))?;
    let modes = tuned.linearize(&tuned.rest()?)?.modes()?;
    let film = tuned.mode_animation(&tuned.rest()?, &modes[0], 2.0)?;
    Animation::new()
        .add(film, "")
        .title("First mode, with the tuned mass against it")
        .write_html(files.path("first_mode.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
