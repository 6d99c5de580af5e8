//! A rotor on soft bearings: its critical speeds, and the speed above which its own material makes it whirl.
//!
//!     m ẍ = −k_x x − c_e ẋ − c_i (ẋ + Ω y) + m e Ω² cos Ωt
//!     m ÿ = −k_y y − c_e ẏ − c_i (ẏ − Ω x) + m e Ω² sin Ωt
//!     I_t α̈ + I_p Ω β̇ + k_t α = 0        I_t β̈ − I_p Ω α̇ + k_t β = 0
//!
//! Damping in the rotating part drives forward whirl once Ω exceeds the frequency of the whirl (A. L.
//! Kimball 1924; D. M. Smith 1933): with equal bearings above ω_n (1 + c_e/c_i). Bearings of unequal
//! stiffness raise that speed, because they hinder circles. The tilting of the disk splits into a slow
//! backward and a fast forward whirl (G. Genta, *Dynamics of Rotating Systems*).

mod common;
use dynamics::analysis::Campbell;
use dynamics::output::{Animation, Axis, Chart, Panel};
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, alpha: rad, beta: rad)]
#[units(
    mass: kg, stiffness: N / m, external: N * s / m, internal: N * s / m, offset: m, transverse: kg * m^2,
    polar: kg * m^2, tilting: N * m, speed: rad / s
)]
struct Rotor {
    mass: f64,
    stiffness: [f64; 2],
    external: f64,
    internal: f64,
    offset: f64,
    transverse: f64,
    polar: f64,
    tilting: f64,
    speed: f64,
}

#[dynamics]
impl Rotor {
    fn centre(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    fn out(&self, q: &Coordinates<Self>) -> Vec2 {
        let turned = self.speed * q.t;
        vec2(turned.cos(), turned.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.centre(q).dt().norm_squared()
            + 0.5 * self.transverse * (q.alpha.dt().powi(2) + q.beta.dt().powi(2))
    }
    #[potential]
    fn bearings(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.stiffness[0] * q.x.powi(2) + self.stiffness[1] * q.y.powi(2))
            + 0.5 * self.tilting * (q.alpha.powi(2) + q.beta.powi(2))
    }
    #[dissipation]
    fn outside(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.external * self.centre(q).dt().norm_squared()
    }
    #[force]
    fn material(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.internal * (q.x.dt() + self.speed * q.y))
            + Force::along(q.y, -self.internal * (q.y.dt() - self.speed * q.x))
    }
    #[force]
    fn gyroscopic(&self, q: &Coordinates<Self>) -> Force {
        let spin = self.polar * self.speed;
        Force::along(q.alpha, -spin * q.beta.dt()) + Force::along(q.beta, spin * q.alpha.dt())
    }
    #[force]
    fn unbalance(&self, q: &Coordinates<Self>) -> Force {
        Force::at(self.centre(q), self.mass * self.offset * self.speed.powi(2) * self.out(q))
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let centre = self.centre(q) * 100.0;
        Drawing::new()
            .tail("centre", centre, 3.0)
            .line(vec2(0.0, 0.0), centre)
            .circle(centre, 0.5)
            .disc(centre + self.out(q) * 0.35, 0.06)
    }
}

impl Rotor {
    fn at(speed: f64, stiffness: [f64; 2], offset: f64) -> Self {
        Self {
            mass: 1.0,
            stiffness,
            external: 0.3,
            internal: 0.2,
            offset,
            transverse: 0.02,
            polar: 0.012,
            tilting: 6.0,
            speed,
        }
    }
}

fn main() -> common::Outcome {
    let speeds: Vec<f64> = (0..=90).map(|k| 0.5 * f64::from(k)).collect();
    let diagram = |stiffness: [f64; 2]| {
        Campbell::new(&speeds, &[1.0, 2.0], &[("x", "y"), ("alpha", "beta")], |speed| {
            let rotor = Rotor::at(speed, stiffness, 0.0);
            rotor.linearize(&rotor.state().build()?)
        })
    };
    let (equal, unequal) = (diagram([100.0; 2])?, diagram([98.0, 102.0])?);
    println!("equal bearings:\n{equal}\n\nunequal bearings:\n{unequal}\n");
    assert!(
        (equal.onsets[0].speed - 10.0 * (1.0 + 0.3 / 0.2)).abs() < 1e-9
            && equal.onsets[0].mode.direction() == "forward"
    );
    // (s² + c s + k)² = Δ² − (c_i Ω)² of bearings k ± Δ: the onset is at √(Δ² + c² k/m)/c_i.
    assert!((unequal.onsets[0].speed - f64::sqrt(4.0 + 0.25 * 100.0) / 0.2).abs() < 1e-9);
    // Ω² = k_t/(I_t ∓ I_p): backward and forward critical speed of the tilting disk.
    for (sign, direction) in [(1.0, "backward"), (-1.0, "forward")] {
        let wanted = f64::sqrt(6.0 / (0.02 + sign * 0.012));
        let found = equal.critical.iter().find(|c| c.order == 1.0 && (c.speed - wanted).abs() < 1e-9);
        assert!(found.is_some_and(|c| c.mode.direction() == direction), "{wanted}");
    }

    // Run up to each side of the onset with a small unbalance: below, the whirl dies away to the circle of
    // the unbalance; above, it grows.
    let rotors = [20.0, 32.0].map(|speed| Rotor::at(speed, [100.0; 2], 2e-4));
    let lengths = [300.0, 60.0];
    let whirl = |k: usize| -> Result<_, Box<dyn std::error::Error>> {
        Ok(rotors[k].simulate(rotors[k].state().x(2e-3).build()?).until(lengths[k]).tolerance(1e-9).run()?)
    };
    let (below, above) = (whirl(0)?, whirl(1)?);
    let radius = |motion: &Motion<Rotor>, t: f64| motion.at(t).x().hypot(motion.at(t).y());
    // Beyond its critical speed the rotor turns about its centre of mass, and its material, which turns
    // along, feels nothing of it.
    let wanted = 2e-4 * 400.0 / f64::hypot(100.0 - 400.0, 0.3 * 20.0);
    let [circle, grown] = [radius(&below, 300.0), radius(&above, 60.0)];
    println!(
        "at 20 rad/s the centre is left on a circle of {:.5} mm, at 32 rad/s it is off by {:.0} mm",
        1e3 * circle,
        1e3 * grown
    );
    assert!((circle / wanted - 1.0).abs() < 1e-5 && grown > 0.05);

    let mut files = common::Files::of("rotor");
    equal.chart().write_svg(files.path("campbell_equal.svg"))?;
    unequal.chart().write_svg(files.path("campbell_unequal.svg"))?;
    let orbit = |motion: &Motion<Rotor>, from: f64| {
        motion
            .sample(common::times(4.0, 1200).map(|t| from + t))
            .map(|s| (1e3 * s.x(), 1e3 * s.y()))
            .collect::<Vec<_>>()
    };
    let panel =
        |name: &str| Panel::new(Axis::new("x in mm"), Axis::new(format!("{name}, y in mm"))).equal_axes();
    Chart::new("Whirl of the centre below and above the onset")
        .panel(panel("20 rad/s").line("first 4 s", orbit(&below, 0.0)).line("last 4 s", orbit(&below, 296.0)))
        .panel(
            panel("32 rad/s").line("first 4 s", orbit(&above, 0.0)).line("after 20 s", orbit(&above, 20.0)),
        )
        .panel_height(330.0)
        .write_svg(files.path("orbits.svg"))?;
    let [slow, fast] = rotors.each_ref().map(|rotor| -> Result<_, Box<dyn std::error::Error>> {
        Ok(rotor.simulate(rotor.state().x(8e-3).build()?).until(12.0).tolerance(1e-9).run()?)
    });
    Animation::new()
        .add(slow?, "20 rad/s")
        .add(fast?, "32 rad/s")
        .speed(0.5)
        .plot(["x"])
        .write_html(files.path("whirl.html"))?;
    files.list();
    Ok(())
}
