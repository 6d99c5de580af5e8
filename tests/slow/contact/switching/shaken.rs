//! Blocks, hoops and balls on what is shaken, and a bead that leaves a cylinder.

use super::*;

/// A block on a plank that is shaken, x = −cos(ω t)/ω.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x)]
struct Shaken {
    m: f64,
    omega: f64,
    sliding: f64,
    resting: f64,
}

#[dynamics]
impl Shaken {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.x.dt().powi(2)
    }
    #[nonholonomic(switched)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() - (self.omega * q.t).sin()
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.resting - q.reaction(Self::stick).abs()
    }
    #[force]
    fn slide(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.sliding * q.slip(Self::stick))
    }
}

/// Friction f that is the same at rest and in motion: where it breaks away from the plank the slip starts
/// without acceleration, and where f is too weak to hold it at all it turns between the same two places of
/// every period. Ends by bisection on the two closed forms of the motion.
#[test]
fn a_block_on_a_shaken_plank_turns_as_often_as_it_should() {
    for (omega, f, end, turns) in SHAKEN {
        let block = Shaken { m: 1.0, omega, sliding: f, resting: f };
        for formulation in [Formulation::Projected, Formulation::Embedded] {
            let run = block.simulate(block.state().assemble().unwrap()).until(20.0).formulation(formulation);
            let motion = run.stick_slip("stick", "grip").run();
            let motion = motion.unwrap_or_else(|error| panic!("{omega} {f}: {error}"));
            assert!(
                (motion.end().x() - end).abs() < 1e-7,
                "{omega} {f} {formulation}: {} {end}",
                motion.end().x()
            );
            let slips = motion.events().iter().filter(|event| event.name == "stick slip").count();
            assert!(slips >= turns, "{omega} {f}: {slips}");
        }
    }
}
const SHAKEN: [(f64, f64, f64, usize); 9] = [
    (3.0, 0.3, 0.807_404_807, 19),
    (3.0, 1.0, 0.720_639_602, 19),
    (3.0, 2.0, 0.634_569_069, 39),
    (3.0, 2.5, 0.650_359_819, 39),
    (3.0, 2.8, 0.651_917_851, 39),
    (1.0, 0.7, 0.524_030_074, 13),
    (1.0, 0.9, 0.576_607_183, 14),
    (5.0, 4.0, 0.052_551_629, 65),
    (100.0, 1.0, 0.024_552_401, 630),
];

/// Late, where the rounding of the time is most of what the slip changes by, it is not followed as if it
/// oscillated.
#[test]
fn slip_that_only_rounding_changes_is_no_error() {
    for (k, omega) in (1..40).step_by(6).flat_map(|k| [3.0, 20.0, 50.0].map(|omega| (k, omega))) {
        let f = omega * f64::from(k) / 39.5;
        let block = Shaken { m: 1.0, omega, sliding: f, resting: f };
        for method in [methods::Any::from(methods::DormandPrince5), methods::Dop853.into()] {
            let run =
                block.simulate(block.state().assemble().unwrap()).until(12.0).tolerance(1e-6).method(&method);
            let motion = run.formulation(Formulation::Projected).stick_slip("stick", "grip").run();
            let motion = motion.unwrap_or_else(|error| panic!("{omega} {f} {method}: {error}"));
            assert!(motion.events().len() > 5, "{omega} {f} {method}: it turns in every period");
        }
    }
}

/// A hoop on a floor that is a shaken plank: it rolls, or slips where that takes more than the friction that
/// it has.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, a)]
struct Hoop {
    m: f64,
    r: f64,
    g: f64,
    mu: f64,
}

#[dynamics]
impl Hoop {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (vec2(q.x, q.y).dt().norm_squared() + (self.r * q.a.dt()).powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.r
    }
    #[nonholonomic(switched)]
    fn roll(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt() + self.r * q.a.dt() - 1.5 * (3.0 * q.t).cos()
    }
    #[event]
    fn grip(&self, q: &Coordinates<Self>) -> Expr {
        self.mu * q.reaction(Self::floor) - q.reaction(Self::roll).abs()
    }
    #[force]
    fn slide(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x + self.r * q.a, -self.mu * q.reaction(Self::floor) * q.slip(Self::roll))
    }
}

/// Rolling and slipping: v = u + r w, the velocity of the hoop at the plank, is that of a block on it with
/// twice the friction, and x goes with half of v. Ends of a start in rolling, by the same closed forms as
/// above.
#[test]
fn a_hoop_on_a_shaken_plank_rolls_and_slips() {
    for (mu, end) in HOOP {
        let hoop = Hoop { m: 0.5, r: 0.3, g: 9.81, mu };
        for formulation in [Formulation::Projected, Formulation::Augmented, Formulation::Embedded] {
            let start = hoop.state().y(0.3).x_rate(0.75).a_rate(2.5).build().unwrap();
            let run = hoop.simulate(start).until(5.0).tolerance(1e-9).formulation(formulation);
            let motion = run.contact("floor", 0.0).stick_slip("roll", "grip").run();
            let motion = motion.unwrap_or_else(|error| panic!("{mu} {formulation}: {error}"));
            assert!((motion.end().x() - end).abs() < 1e-7, "{mu} {formulation}: {} {end}", motion.end().x());
        }
    }
}
/// Without friction the plank does nothing to the hoop. At the start the reaction of rolling is zero: the
/// side to which it slips is that of the reaction a little later.
#[test]
fn a_hoop_without_friction_slides_on() {
    let hoop = Hoop { m: 0.5, r: 0.3, g: 9.81, mu: 0.0 };
    for formulation in [Formulation::Projected, Formulation::Augmented, Formulation::Embedded] {
        for method in [methods::Any::from(methods::DormandPrince5), methods::Dop853.into()] {
            let start = hoop.state().y(0.3).x_rate(0.75).a_rate(2.5).build().unwrap();
            let run =
                hoop.simulate(start).until(5.0).tolerance(1e-9).formulation(formulation).method(&method);
            let motion = run.contact("floor", 0.0).stick_slip("roll", "grip").run();
            let motion = motion.unwrap_or_else(|error| panic!("{formulation} {method}: {error}"));
            let end = motion.end();
            assert!(
                (end.x() - 3.75).abs() < 1e-12 && (end.a() - 12.5).abs() < 1e-11,
                "{formulation}: {} {}",
                end.x(),
                end.a()
            );
            assert!(!end.is_engaged("roll").unwrap() && motion.events()[0].time() == 0.0);
        }
    }
}
const HOOP: [(f64, f64); 4] =
    [(0.1, 0.377_464_981), (0.15, 0.246_872_547), (0.2, 0.180_303_691), (5.0, 0.162_571_960)];

/// A ball on a floor that is shaken, y = A sin(ω t).
#[derive(Clone, Debug, Dynamics)]
#[coordinates(y)]
struct Bouncing {
    m: f64,
    g: f64,
    amplitude: f64,
    frequency: f64,
}

#[dynamics]
impl Bouncing {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * q.y.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y - self.amplitude * (self.frequency * q.t).sin()
    }
}

impl Bouncing {
    /// Flights until a time, by the closed form: it lifts off where the floor falls faster than g, and lands
    /// where both meet again.
    fn flights(&self, end: f64) -> usize {
        let (a, w, g) = (self.amplitude, self.frequency, self.g);
        let (phase, period) = ((g / (a * w * w)).asin() / w, std::f64::consts::TAU / w);
        let (mut t, mut count) = (0.0, 0);
        loop {
            if a * w * w * (w * t).sin() <= g {
                t = phase + period * ((t - phase) / period).ceil();
            }
            if t > end {
                return count;
            }
            count += 1;
            let (y, v) = (a * (w * t).sin(), a * w * (w * t).cos());
            let gap = |s: f64| y + v * s - 0.5 * g * s * s - a * (w * (t + s)).sin();
            let landing = (10..).map(|k| 1e-4 * f64::from(k)).find(|s| gap(*s) < 0.0);
            t += landing.expect("it comes down");
        }
    }
}

/// The gap grows with the third power of time where a contact lifts off: neither rounding nor drift closes it
/// again.
#[test]
fn a_ball_on_a_shaken_floor_flies_as_often_as_it_should() {
    let formulations =
        [Formulation::Projected, Formulation::Embedded, Formulation::BaumgarteTied, Formulation::Augmented];
    for (amplitude, frequency) in [(0.05, 16.0), (0.05, 15.0), (0.1, 12.0), (0.2, 8.0), (0.01, 40.0)] {
        let model = Bouncing { m: 1.0, g: 9.81, amplitude, frequency };
        let start = model.state().y_rate(amplitude * frequency).build().unwrap();
        for formulation in formulations {
            for tolerance in [1e-6, 1e-9, 1e-12] {
                let taylor = methods::Taylor { order: None };
                for method in
                    &[methods::Any::from(methods::DormandPrince5), methods::Dop853.into(), taylor.into()]
                {
                    // Series have no part for what Baumgarte's formulation adds.
                    if method.method() == Method::Taylor && formulation == Formulation::BaumgarteTied {
                        continue;
                    }
                    let run = model.simulate(start).until(3.0).tolerance(tolerance).formulation(formulation);
                    let case = format!("{amplitude} {frequency} {formulation:?} {tolerance:e}");
                    let motion = run.contact("floor", 0.0).method(method).run();
                    let motion = motion.unwrap_or_else(|error| panic!("{case}: {error}"));
                    let lifts = motion
                        .events()
                        .iter()
                        .filter(|event| !event.after.is_engaged("floor").unwrap())
                        .count();
                    assert_eq!(lifts, model.flights(3.0), "{case}");
                }
            }
        }
    }
}

/// A bead that slides down a cylinder that does not hold it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Bead {
    m: f64,
    g: f64,
    r: f64,
}

#[dynamics]
impl Bead {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn cylinder(&self, q: &Coordinates<Self>) -> Expr {
        (q.x.powi(2) + q.y.powi(2)).sqrt() - self.r
    }
}

/// It leaves once, where cos θ = (2 cos θ₀ + ω² r/g)/3, in every formulation.
#[test]
fn a_bead_leaves_a_cylinder_once() {
    for formulation in [Formulation::Projected, Formulation::BaumgarteTied, Formulation::Augmented] {
        for tolerance in [1e-6, 1e-9, 1e-11] {
            for k in 0..25 {
                let (k, case) = (f64::from(k), format!("{formulation:?} {tolerance:e} {k}"));
                let (model, angle, rate) =
                    (Bead { m: 1.0, g: 9.81, r: 1.0 + 0.03 * k }, 0.05 + 0.02 * k, 0.04 * k);
                let (y, x) = (model.r * angle.cos(), model.r * angle.sin());
                let start = model.state().x(x).y(y).x_rate(rate * y).y_rate(-rate * x).build().unwrap();
                let run = model.simulate(start).until(2.0).tolerance(tolerance).formulation(formulation);
                let motion =
                    run.contact("cylinder", 0.0).run().unwrap_or_else(|error| panic!("{case}: {error}"));
                let leaves = (2.0 * angle.cos() + rate * rate * model.r / model.g) / 3.0;
                assert_eq!(motion.events().len(), 1, "{case}");
                let found = motion.events()[0].before.y() / model.r;
                assert!((found - leaves).abs() < 1e3 * tolerance, "{case}: {found} instead of {leaves}");
            }
        }
    }
}
