//! Contacts that are met together, or nearly, beside a kink that has nothing to do with them: both rebound as
//! each does alone.

use dynamics::prelude::*;

/// Two balls over one floor, and a bead that is pulled to the middle of its wire by a force of constant size.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(left: m, right: m, bead: m)]
#[units(mass: kg, g: m / s^2, pull: N)]
struct Balls {
    mass: f64,
    g: f64,
    pull: f64,
}

#[dynamics]
impl Balls {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (q.left.dt().powi(2) + q.right.dt().powi(2) + q.bead.dt().powi(2))
    }
    #[potential]
    fn energy(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.left + q.right) + self.pull * q.bead.abs()
    }
    #[holonomic(switched)]
    fn one(&self, q: &Coordinates<Self>) -> Expr {
        q.left
    }
    #[holonomic(switched)]
    fn other(&self, q: &Coordinates<Self>) -> Expr {
        q.right
    }
}

/// Falls from a height, and once rebounds by half.
fn falls(g: f64, height: f64, t: f64) -> f64 {
    let hits = (2.0 * height / g).sqrt();
    if t < hits { height - 0.5 * g * t * t } else { (t - hits) * (0.5 * g * hits - 0.5 * g * (t - hits)) }
}

/// The bead starts where its force jumps in the same step as the balls hit, or elsewhere.
#[test]
fn balls_that_hit_together_rebound_like_one() {
    let balls = Balls { mass: 1.0, g: 9.81, pull: 2.0 };
    let (height, end) = (0.5, 0.55);
    let hits = (2.0 * height / balls.g).sqrt();
    let methods: [methods::Any<Balls>; 5] = [
        methods::DormandPrince5.into(),
        methods::Dop853.into(),
        methods::Radau5.into(),
        methods::Esdirk4.into(),
        methods::Taylor::default().into(),
    ];
    for higher in [0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4] {
        // It comes to the middle as they hit, a little later, and after a long time.
        for meets in [hits, hits + 1e-9, hits + 1e-5, 10.0] {
            let start =
                balls.state().left(height).right(height + higher).bead(0.5 * balls.pull * meets * meets);
            let start = start.release("one").release("other").build().unwrap();
            let run = || balls.simulate(start).until(end).contact("one", 0.5).contact("other", 0.5);
            let check = |case: &str, bound: f64, motion: &Motion<'_, Balls>| {
                let state = motion.end();
                let errors = [
                    state.left() - falls(9.81, height, end),
                    state.right() - falls(9.81, height + higher, end),
                ];
                assert!(errors.iter().all(|e| e.abs() < bound), "{higher:e} {meets} {case}: {errors:?}");
                let impacts =
                    motion.events().iter().flat_map(|event| &event.impacts).filter(|impact| !impact.held);
                let met: Vec<f64> =
                    impacts.filter(|impact| impact.impulse[0] > 1.0).map(|i| i.approach[0]).collect();
                assert_eq!(met.len(), 2, "{higher:e} {meets} {case}: {met:?}");
            };
            for method in &methods {
                for tolerance in [1e-5, 1e-8] {
                    let case = format!("{method} {tolerance:e}");
                    let motion = run().method(method).tolerance(tolerance).run();
                    check(
                        &case,
                        30.0 * tolerance,
                        &motion.unwrap_or_else(|e| panic!("{higher:e} {meets} {case}: {e}")),
                    );
                }
            }
            let motion = run().method(methods::Rk4).fixed_step(0.013).run();
            check("RK4", 1e-9, &motion.unwrap_or_else(|e| panic!("{higher:e} {meets} RK4: {e}")));
        }
    }
}
