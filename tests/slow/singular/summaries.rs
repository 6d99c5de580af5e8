//! What the summary tells of singular positions.

use super::*;

/// Generated code passes the change points without the general solver; the summary tells of them all the
/// same.
#[test]
fn what_was_passed_is_counted_and_named() {
    let model = Parallelogram::new(2.0, 0.0);
    for formulation in [Formulation::Projected, Formulation::Embedded] {
        let motion =
            model.simulate(model.start(1.0, -1.0)).until(6.0).tolerance(1e-9).formulation(formulation).run();
        let motion = motion.unwrap();
        let turns = |angle: f64| (angle / core::f64::consts::PI).floor();
        let expected = turns(1.0) - turns(motion.end().crank());
        let summary = motion.verify();
        let nearest = summary.nearest.clone().unwrap();
        assert!(nearest.passed as f64 == expected && expected > 1.0, "{nearest:?}");
        assert!(nearest.condition > 1e5 && motion.at(nearest.time).crank().sin().abs() < 1e-4, "{nearest:?}");
        assert!(nearest.rows.contains("closure.x") && nearest.coordinates.contains("coupler"), "{nearest:?}");
        assert!(summary.to_string().contains("singular positions"), "{summary}");
    }
    // Between change points there is none.
    let motion = model.simulate(model.start(-0.5, -1.0)).until(0.5).tolerance(1e-9).run().unwrap();
    let nearest = motion.verify().nearest.unwrap();
    assert!(nearest.passed == 0 && nearest.condition < 10.0, "{nearest:?}");
}

/// Crank, massless rod, slider.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, rod: rad, slide: m)]
#[units(inertia: kg * m^2, mass: kg, a: m, b: m)]
struct SliderCrank {
    inertia: f64,
    mass: f64,
    a: f64,
    b: f64,
}

#[dynamics]
impl SliderCrank {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * q.crank.dt().powi(2) + 0.5 * self.mass * q.slide.dt().powi(2)
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let pin = self.a * vec2(q.crank.cos(), q.crank.sin());
        vec2(q.slide, 0.0) - pin - self.b * vec2(q.rod.cos(), -q.rod.sin())
    }
}

/// Coordinates without inertia take no part in how well the mass matrix determines the others.
#[test]
fn massless_coordinates_do_not_make_the_mass_matrix_ill_conditioned() {
    let model = SliderCrank { inertia: 0.1, mass: 1.0, a: 0.1, b: 0.3 };
    let start = model.state().crank(0.5).crank_rate(5.0).slide_guess(0.4).assemble().unwrap();
    let summary = model.simulate(start).until(1.0).run().unwrap().verify();
    assert_eq!(summary.conditioning.largest, 1.0, "{summary}");
    assert!(summary.nearest.unwrap().passed == 0);
}

/// Which coordinates depend on the others is chosen anew where the ones of the generated code no longer do,
/// and counted.
#[test]
fn other_dependent_coordinates_are_counted() {
    let text = |a: f64, b: f64| {
        let model = SliderCrank { inertia: 0.02, mass: 0.5, a, b };
        let start = model.state().crank(1.0).crank_rate(30.0).slide_guess(a + b).assemble().unwrap();
        let run = |formulation| {
            model.simulate(start).until(2.0).tolerance(1e-9).formulation(formulation).run().unwrap()
        };
        let (embedded, projected) = (run(Formulation::Embedded), run(Formulation::Projected));
        assert!((embedded.end().crank() - projected.end().crank()).abs() < 1e-4, "{a} {b}");
        embedded.verify().to_string()
    };
    // With equal lengths the slider stands in the pivot of the crank each time that this is upright: there
    // the rod's block vanishes.
    let words = "of other dependent coordinates, where a pivot of the generated code vanished";
    let (equal, unequal) = (text(0.2, 0.2), text(0.1, 0.3));
    assert!(equal.contains(words) && !unequal.contains(words), "{equal} {unequal}");
}
