//! A quarter-car suspension, fitted to noisy measurements of a drive over a bump.
//!
//!     m_s ẍ_s = −k (x_s − x_u) − c (ẋ_s − ẋ_u)
//!     m_u ẍ_u = k (x_s − x_u) + c (ẋ_s − ẋ_u) − k_t (x_u − road)
//!
//! The masses were weighed. Spring, damper and tyre are found from the travel of the suspension and the
//! acceleration of the body. The data come from the model itself, with noise, so the true values are known.
//! The variational equations give the derivatives of the motion by the parameters, and the standard errors.
//! 100 fits of resampled data agree with these.

mod common;
use dynamics::output::{Animation, Axis, Chart, Panel, Series};
use dynamics::prelude::*;
use dynamics::simulate::MotionError;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(body: m, wheel: m)]
#[units(sprung: kg, unsprung: kg, spring: N / m, damper: N * s / m, tyre: N / m, bump: m, half: s, at: s)]
struct Suspension {
    sprung: f64,
    unsprung: f64,
    spring: f64,
    damper: f64,
    tyre: f64,
    /// Height and half length of the bump, in time, and when the wheel meets its top.
    bump: f64,
    half: f64,
    at: f64,
}

#[dynamics]
impl Suspension {
    fn road(&self, q: &Coordinates<Self>) -> Expr {
        self.bump * (-((q.t - self.at) / self.half).powi(2)).exp()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.sprung * q.body.dt().powi(2) + 0.5 * self.unsprung * q.wheel.dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.spring * (q.body - q.wheel).powi(2) + 0.5 * self.tyre * (q.wheel - self.road(q)).powi(2)
    }
    #[dissipation]
    fn damping(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.damper * (q.body - q.wheel).dt().powi(2)
    }
    #[output]
    fn travel(&self, q: &Coordinates<Self>) -> Expr {
        q.body - q.wheel
    }
    #[output]
    fn felt(&self, q: &Coordinates<Self>) -> Expr {
        q.body.dt().dt()
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (body, wheel) = (vec2(0.0, q.body + 0.46), vec2(0.0, q.wheel + 0.16));
        // The road comes along: where the car is in `at` seconds of it.
        let speed = 2.0;
        let ahead = |x: f64| {
            let t = q.t + x / speed - self.at;
            vec2(x, self.bump * (-(t / self.half).powi(2)).exp())
        };
        Drawing::new()
            .curve(-0.6, 0.6, 120, ahead)
            .line(vec2(-0.05, 0.0) + body, vec2(-0.05, 0.0) + wheel)
            .spring(vec2(0.05, 0.0) + body, vec2(0.05, 0.0) + wheel)
            .circle(wheel, 0.16)
            .rectangle(body + vec2(0.0, 0.05), 0.6, 0.1, 0.0)
            .tail("body", body + vec2(0.0, 0.1), 0.4)
    }
}

/// Noise of mean 0 and variance 1: sums of twelve even numbers.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        let mut even = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| even()).sum::<f64>() - 6.0
    }
}

fn main() -> common::Outcome {
    let car = Suspension {
        sprung: 290.0,
        unsprung: 59.0,
        spring: 16_812.0,
        damper: 1_000.0,
        tyre: 190_000.0,
        bump: 0.08,
        half: 0.08,
        at: 0.4,
    };
    let (of_travel, of_felt, end) = (0.001, 0.15, 3.0);
    let truth = car.simulate(car.state().build()?).until(end).run()?;
    let (mut first, mut second) = (noise(1), noise(2));
    let measure =
        |name: &str, sigma: f64, noise: &mut dyn FnMut() -> f64| -> Result<Vec<(f64, f64)>, MotionError> {
            common::times(end, 120).map(|t| Ok((t, truth.output(name, t)? + sigma * noise()))).collect()
        };
    let (travel, felt) = (measure("travel", of_travel, &mut first)?, measure("felt", of_felt, &mut second)?);

    // A guess that is wrong by half.
    let guess = Suspension { spring: 25_000.0, damper: 600.0, tyre: 130_000.0, ..car.clone() };
    let before = guess.simulate(guess.state().build()?).until(end).run()?;
    let fit = guess
        .fit(guess.state().build()?)
        .find(["spring", "damper", "tyre"])
        .data_with("travel", of_travel, travel.clone())
        .data_with("felt", of_felt, felt.clone());
    let (fit, sampled) = fit.resample(100, 1)?;
    println!("{fit}\n");
    for (found, value) in fit.found.iter().zip([car.spring, car.damper, car.tyre]) {
        let error = found.standard_error.unwrap_or(f64::NAN);
        let [low, high] = sampled.interval(&found.name, 0.95).unwrap_or([f64::NAN; 2]);
        println!(
            "{:<7} truth {value:>9.1}, 95 % of the resampled fits from {low:.1} to {high:.1}",
            found.name
        );
        assert!((found.value - value).abs() < 4.0 * error && error < 0.04 * value, "{fit}");
        assert!(((high - low) / (3.92 * error) - 1.0).abs() < 0.4, "{low} {high} {error}");
    }
    assert!((0.8..1.2).contains(&fit.reduced_chi_squared().unwrap_or(f64::NAN)), "{fit}");

    let value = |name: &str| fit.get(name).map_or(f64::NAN, |found| found.value);
    let fitted = Suspension { spring: value("spring"), damper: value("damper"), tyre: value("tyre"), ..car };
    let after = fitted.simulate(fitted.state().build()?).until(end).run()?;
    let curve =
        |motion: &Motion<'_, Suspension>, name: &str, unit: f64| -> Result<Vec<(f64, f64)>, MotionError> {
            common::times(end, 600).map(|t| Ok((t, unit * motion.output(name, t)?))).collect()
        };
    let scaled =
        |points: &[(f64, f64)], unit: f64| points.iter().map(|(t, y)| (*t, unit * y)).collect::<Vec<_>>();
    let mut chart = Chart::new("A suspension, measured and fitted");
    for (name, unit, title, points) in
        [("travel", 1e3, "travel in mm", &travel), ("felt", 1.0, "acceleration of the body in m/s²", &felt)]
    {
        chart = chart.panel(
            Panel::new(Axis::new("t in s"), Axis::new(title))
                .points("measured", scaled(points, unit))
                .series(Series::new("guess", curve(&before, name, unit)?).dashed())
                .series(Series::new("fitted", curve(&after, name, unit)?).solid()),
        );
    }
    // Two thirds of the residuals lie within one σ, 95 % within two.
    for (left, (sigma, unit, title)) in
        fit.residuals.iter().zip([(of_travel, 1e3, "residuals in mm"), (of_felt, 1.0, "residuals in m/s²")])
    {
        let within = left.points.iter().filter(|(_, r)| r.abs() < 2.0 * sigma).count();
        assert!((0.9..0.99).contains(&(within as f64 / left.points.len() as f64)), "{within}");
        let level = |y: f64| [(0.0, unit * y), (end, unit * y)];
        chart = chart.panel(
            Panel::new(Axis::new("t in s"), Axis::new(title))
                .points("model − measured", scaled(&left.points, unit))
                .series(Series::new("± 2σ", level(2.0 * sigma)).color(Color::cycle(1)).dashed())
                .series(Series::new("", level(-2.0 * sigma)).color(Color::cycle(1)).dashed()),
        );
    }
    let mut files = common::Files::of("fit_suspension");
    chart.write_svg(files.path("fit.svg"))?;
    // The fitted car goes where the measured one does; the guess bounces for longer.
    Animation::new()
        .add(&truth, "measured car")
        .add(&before, "guess")
        .add(&after, "fitted")
        .title("Over a bump: a car, a guess, and the fit, ten times slower")
        .plot(["travel"])
        .speed(0.1)
        .write_html(files.path("bump.html"))?;
    files.list();
    Ok(())
}
