//! An elliptic trammel that spins: a rod whose ends slide on two axes, by its middle and its angle. The
//! middle turns round twice in every turn, within few steps: coordinates that lead for longer than a moment
//! lead badly.

use crate::turning_trammel;

use dynamics::prelude::*;
use turning_trammel::Turning;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(half: m, mass: kg, inertia: kg * m^2, g: m / s^2)]
struct Trammel {
    half: f64,
    mass: f64,
    inertia: f64,
    g: f64,
}

#[dynamics]
impl Trammel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn sliders(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) - self.half * vec2(q.phi.cos(), -q.phi.sin())
    }
}

/// Where coordinates themselves led the error was a hundred to two thousand times that of projection, and
/// errors of steps were said to grow by up to 10¹⁰.
#[test]
fn embedded_trammels_are_as_accurate_as_their_angle_alone() {
    let (half, mass, g) = (0.5, 2.0, 9.81);
    // The rod beside its middle, and a rod that weighs next to nothing.
    for inertia in [0.2, 0.01] {
        let turning = Turning { half, mass, inertia, g };
        let released = turning.state().phi(0.4).phi_rate(9.0).build().unwrap();
        // By the method that models with constraints have, too.
        let alone = || turning.simulate(released).until(10.0).method(methods::Dop853);
        let truth = alone().tolerance(1e-13).run().unwrap();
        let model = Trammel { half, mass, inertia, g };
        let start = model.state().phi(0.4).phi_rate(9.0).x_guess(0.4).y_guess(-0.2).assemble().unwrap();
        let worst = |angle: &dyn Fn(f64) -> f64| {
            let at = (1..=20).map(|k| 0.5 * f64::from(k));
            at.fold(0.0, |worst: f64, t| worst.max((angle(t) - truth.at(t).phi()).abs()))
        };
        let mut excess = [0.0; 2];
        let tolerances = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11];
        for tolerance in tolerances {
            let angle = alone().tolerance(tolerance).run().unwrap();
            let of_angle = worst(&|t| angle.at(t).phi());
            let motions = [Formulation::Projected, Formulation::Embedded].map(|formulation| {
                let run = model.simulate(start).until(10.0).tolerance(tolerance).formulation(formulation);
                run.run().unwrap_or_else(|e| panic!("{e}"))
            });
            let errors = motions.each_ref().map(|motion| worst(&|t| motion.at(t).phi()));
            (0..2).for_each(|k| excess[k] += (errors[k] / of_angle).ln() / tolerances.len() as f64);
            let [projected, embedded] = motions.each_ref().map(Motion::verify);
            let shown = [&projected, &embedded]
                .map(|summary| summary.accuracy.step_doubling_at_most.expect("adaptive steps"));
            println!(
                "{tolerance:.0e}: alone {of_angle:.1e}, projected {:.1e}, embedded {:.1e}",
                errors[0], errors[1]
            );
            println!("  half steps show {shown:.1?}");
            println!("  in {} and {} evaluations", projected.evaluations, embedded.evaluations);
            // Of x and y, too, and at all steps.
            assert!(errors[1] < 3.0 * shown[1] * tolerance, "{tolerance:e}: {shown:?}");
            assert!(embedded.evaluations < 2 * projected.evaluations, "{projected}\n{embedded}");
            let drift = embedded.constraints.iter().map(|row| row.residual.max(row.velocity_residual));
            assert!(drift.fold(0.0, f64::max) < 1e-12, "{embedded}");
        }
        let excess = excess.map(f64::exp);
        println!("projected and embedded {excess:.2?} times the error of the angle alone");
        assert!(excess[1] < 3.0, "{inertia}: {excess:?}");
    }
}
