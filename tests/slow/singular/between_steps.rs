//! States between the steps of motions whose steps projection has bought.

use super::*;

/// Bars 1 : 2 : 1 : 2 crossed: the antiparallelogram, which passes a flat position twice in a turn of its
/// short bars. With the platform's sines: where steps end beside the flat position is a matter of the last
/// bits.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad, c: rad)]
#[units(short: m, long: m, inertia: kg * m^2)]
struct Crossed {
    short: f64,
    long: f64,
    inertia: f64,
}

#[dynamics]
impl Crossed {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.a.dt().powi(2) + q.b.dt().powi(2) + q.c.dt().powi(2))
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        self.short * vec2(q.a.cos() - q.c.cos(), q.a.sin() - q.c.sin())
            + self.long * vec2(q.b.cos() - 1.0, q.b.sin())
    }
}

/// Between steps, too, rates near a change point are those of the branch. They were off by their own size, in
/// runs that ended well; consistent output made it worse.
#[test]
fn states_between_steps_are_right_beside_change_points() {
    let model = Crossed { short: 1.0, long: 2.0, inertia: 0.1 };
    let start = model.state().a(1.0).a_rate(2.0).b_guess(-0.5).c_guess(-2.0).assemble().unwrap();
    let energy = model.energy_function(&start);
    for formulation in [Formulation::Projected, Formulation::Embedded] {
        for tolerance in [1e-6, 1e-7, 1e-8, 1e-9, 1e-10] {
            for consistent in [false, true] {
                let run = model.simulate(start).until(20.0).tolerance(tolerance).formulation(formulation);
                let motion = if consistent { run.consistent_output().run() } else { run.run() }.unwrap();
                let (mut off_branch, mut off_energy) = (0.0f64, 0.0f64);
                for state in motion.sample((0..20_000).map(|k| 1e-3 * f64::from(k))) {
                    off_branch = off_branch.max(self::off_branch(&state));
                    off_energy = off_energy.max((model.energy_function(&state) / energy - 1.0).abs());
                }
                let case =
                    format!("{formulation} {tolerance:e} {consistent}: {off_branch:.1e} {off_energy:.1e}");
                println!("{case}");
                assert!(off_branch < 1e3 * tolerance && off_energy < 1e3 * tolerance, "{case}");
            }
        }
    }
}

/// That holds whatever the last bits are: a stage of one of these runs, or one that only its interpolant has,
/// lies so near a change point that rounding decides what becomes of it. Steps that were made again otherwise
/// than in the run left rates off by up to 1e-2.
#[test]
fn states_between_steps_do_not_depend_on_the_last_bits() {
    let model = Crossed { short: 1.0, long: 2.0, inertia: 0.1 };
    for k in 0..24 {
        let a = 1.0 + 1e-14 * f64::from(k);
        let start = model.state().a(a).a_rate(2.0).b_guess(-0.5).c_guess(-2.0).assemble().unwrap();
        let motion = model.simulate(start).until(20.0).tolerance(1e-10).run().unwrap();
        let knots: Vec<f64> = motion.steps().map(|state| state.t()).collect();
        let within =
            |ends: &[f64]| (0..20).map(move |i| (ends[0], ends[1], f64::from(i) / 20.0)).collect::<Vec<_>>();
        let times = knots.windows(2).flat_map(within).map(|(a, b, part)| a + part * (b - a));
        for state in motion.sample(times) {
            let off = off_branch(&state);
            assert!(off < 1e3 * 1e-10, "{k}: {off:e} at {}", state.t());
        }
    }
}

/// tan(c/2) = −3 tan(a/2), differentiated: c′ (1 + 9 tan²) = −3 a′ (1 + tan²), without poles.
fn off_branch(state: &CrossedState) -> f64 {
    let (s, c) = (0.5 * state.a()).sin_cos();
    (state.c_rate() + 3.0 * state.a_rate() / (c * c + 9.0 * s * s)).abs()
}

/// At rest on a floor that is shaken: nothing is left to integrate, steps are as long as projection permits,
/// and states between them are on the floor.
#[test]
fn states_between_steps_are_on_a_shaken_floor() {
    let model = Shaken { mass: 1.0, amplitude: 0.1, rate: 7.0 };
    let start = model.state().y_rate(0.7).x_rate(0.3).build().unwrap();
    for tolerance in [1e-6, 1e-9, 1e-11] {
        let motion = model.simulate(start).until(10.0).tolerance(tolerance).run().unwrap();
        for state in motion.sample((0..10_000).map(|k| 1e-3 * f64::from(k))) {
            let (s, c) = (7.0 * state.t).sin_cos();
            let missed = (state.y() - 0.1 * s).abs().max((state.y_rate() - 0.7 * c).abs());
            assert!(missed < 10.0 * tolerance, "{missed:e} at {} of {tolerance:e}", state.t);
        }
    }
}

#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, amplitude: m, rate: rad / s)]
struct Shaken {
    mass: f64,
    amplitude: f64,
    rate: f64,
}

#[dynamics]
impl Shaken {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.amplitude * (self.rate * q.t).sin()
    }
}
