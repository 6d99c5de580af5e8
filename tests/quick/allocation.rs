//! However long a run of a derived model with constraints is, it allocates a fixed number of times: on the
//! code that the macro emitted.

use allocation_counter::measure;
use dynamics::model::SolverKind;
use dynamics::prelude::*;

/// A crank, a rod with mass, a slider on a spring: one loop, one degree of freedom.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: rad, phi: rad, x: m)]
#[units(crank: m, rod: m, inertia: kg * m^2, rod_mass: kg, slider: kg, stiffness: N / m, moment: N * m)]
#[nominal(crank = 0.1, rod = 0.3)]
struct SliderCrank {
    crank: f64,
    rod: f64,
    inertia: f64,
    rod_mass: f64,
    slider: f64,
    stiffness: f64,
    moment: f64,
}

#[dynamics]
impl SliderCrank {
    fn pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.crank * vec2(q.theta.cos(), q.theta.sin())
    }
    fn along(&self, q: &Coordinates<Self>) -> Vec2 {
        self.rod * vec2(q.phi.cos(), -q.phi.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let centre = self.pin(q) + 0.5 * self.along(q);
        let rod = centre.dt().norm_squared() + self.rod.powi(2) / 12.0 * q.phi.dt().powi(2);
        0.5 * (self.inertia * q.theta.dt().powi(2) + self.slider * q.x.dt().powi(2) + self.rod_mass * rod)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.stiffness * (q.x - self.rod).powi(2)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta, 1.0 * self.moment)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0) - self.pin(q) - self.along(q)
    }
    #[output]
    fn push(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::closure).x
    }
}

#[test]
fn steps_of_unrolled_constraints_do_not_allocate() {
    let model = SliderCrank {
        crank: 0.1,
        rod: 0.3,
        inertia: 0.02,
        rod_mass: 0.3,
        slider: 0.5,
        stiffness: 40.0,
        moment: 0.05,
    };
    assert!(matches!(SliderCrank::SOLVER, SolverKind::Unrolled { .. }));
    let start = model.state().theta(0.5).theta_rate(20.0).x_guess(0.4).assemble().unwrap();
    let formulations = [
        Formulation::Augmented,
        Formulation::Baumgarte { alpha: 20.0, beta: 20.0 },
        Formulation::BaumgarteTied,
        Formulation::Projected,
        Formulation::Embedded,
    ];
    for formulation in formulations {
        let recorded =
            model.simulate(start).until(10.0).tolerance(1e-8).formulation(formulation).run().unwrap();
        assert_eq!(
            recorded.summary().stabilization.general,
            0,
            "generated code alone is looked at: {}",
            recorded.verify()
        );
        let taylor = methods::Any::from(methods::Taylor { order: None });
        for method in &[
            methods::Any::from(methods::Rk4),
            methods::DormandPrince5.into(),
            methods::Dop853.into(),
            methods::GraggBulirschStoer.into(),
            taylor,
        ] {
            if method.method() == Method::Taylor
                && !formulation.is_exact()
                && formulation != Formulation::Augmented
            {
                continue;
            }
            let observed = |end: f64| {
                let mut states = 0_u64;
                let simulation = model.simulate(start).until(end).formulation(formulation).method(method);
                let simulation = if method.is_adaptive() {
                    simulation.tolerance(1e-8)
                } else {
                    simulation.fixed_step(1e-3)
                };
                let info = measure(|| {
                    simulation.run_with(|_| states += 1).unwrap();
                });
                (states, info.count_total)
            };
            let ((few, short), (many, long)) = (observed(0.5), observed(10.0));
            assert!(many > 10 * few, "{formulation}, {}: {few} {many}", method.method());
            assert_eq!(short, long, "{formulation}, {}", method.method());
        }
    }
}
