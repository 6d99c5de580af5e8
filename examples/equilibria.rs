//! A bead on a turning hoop: where it rests, and whether it stays there.
//!
//!     r = (R sin θ cos ωt, R sin θ sin ωt, −R cos θ),        L = ½ m |ṙ|² − m g z
//!
//! Below ω² = g/R the bead rests at the bottom. There the bottom loses its stability to two positions
//! aside, cos θ = g/(R ω²): a pitchfork (Strogatz, *Nonlinear Dynamics and Chaos*, §3.5). The program
//! knows nothing of this. It asks for all equilibria at each speed, and for the stability of each.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad)]
#[units(mass: kg, radius: m, speed: rad / s, g: m / s^2)]
struct Hoop {
    mass: f64,
    radius: f64,
    speed: f64,
    g: f64,
}

#[dynamics]
impl Hoop {
    fn bead(&self, q: &Coordinates<Self>) -> Vec3 {
        let turned = self.speed * q.t;
        let out = self.radius * q.theta.sin();
        vec3(out * turned.cos(), out * turned.sin(), -self.radius * q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.bead(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * self.bead(q).z
    }
}

fn main() -> common::Outcome {
    let (radius, g) = (0.5_f64, 9.81);
    let critical = (g / radius).sqrt();
    println!("critical speed: {critical:.6} rad/s\n");

    // One speed on either side, and the critical one.
    for part in [0.8, 1.0, 1.4] {
        let hoop = Hoop { mass: 0.1, radius, speed: part * critical, g };
        let found = hoop.equilibria(hoop.state().build()?).random(50).run()?;
        println!("at {part} times the critical speed:");
        for rest in &found.equilibria {
            println!("  θ = {:>8.5} rad: {}", rest.state.theta(), hoop.stability(&rest.state)?.verdict);
        }
        assert_eq!(found.equilibria.len(), if part > 1.0 { 4 } else { 2 }, "{found}");
    }

    // The diagram: every equilibrium at every speed, by its verdict; the bead aside swings at ω sin θ.
    let (mut stable, mut unstable) = (Vec::new(), Vec::new());
    for k in 1..=60 {
        let hoop = Hoop { mass: 0.1, radius, speed: 2.5 * critical * f64::from(k) / 60.5, g };
        for rest in hoop.equilibria(hoop.state().build()?).random(40).run()?.equilibria {
            let (theta, judged) = (rest.state.theta(), hoop.stability(&rest.state)?);
            assert!(judged.is_stable() || judged.is_unstable(), "{judged}");
            if judged.is_stable() && theta.abs() > 1e-6 {
                let square = (hoop.speed * theta.sin()).powi(2);
                assert!(
                    (judged.least_omega_squared.unwrap_or(f64::NAN) / square - 1.0).abs() < 1e-9,
                    "{judged}"
                );
                assert!((theta.cos() * hoop.speed.powi(2) * radius / g - 1.0).abs() < 1e-12, "{rest}");
            }
            (if judged.is_stable() { &mut stable } else { &mut unstable })
                .push((hoop.speed / critical, theta));
        }
    }
    println!("\n{} stable and {} unstable equilibria at 60 speeds", stable.len(), unstable.len());

    let mut files = common::Files::of("equilibria");
    let panel = Panel::new(Axis::new("speed of the hoop / critical speed"), Axis::new("θ of rest in rad"));
    Chart::new("A bead on a hoop that is turned")
        .panel(panel.points("stable", stable).points("unstable", unstable))
        .write_svg(files.path("pitchfork.svg"))?;
    files.list();
    Ok(())
}
