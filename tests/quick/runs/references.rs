//! Published problems, from their Lagrangians to their published end values.
//!
//! The reference values were computed in multi-precision arithmetic by two independent routes and agree to at
//! least 22 digits; they are rounded to `f64` here. Each problem names its source.

/// Models that benchmarks share.
mod models {
    pub(crate) use crate::arenstorf;
    pub(crate) use crate::double_pendulum;
    pub(crate) use crate::kepler;
}

use dynamics::prelude::*;
use models::arenstorf::Arenstorf;
use models::double_pendulum::DoublePendulum;
use models::kepler::Kepler;

/// Largest absolute difference.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// q and u of a state in one list.
macro_rules! flat {
    ($state:expr) => {{
        let state = $state;
        state.q.iter().chain(state.u.iter()).copied().collect::<Vec<f64>>()
    }};
}

/// Planar double pendulum; Levien & Tan, Am. J. Phys. 61 (1993) 1038. Errors grow like e^{0.9 t}.
mod double_pendulum {
    use super::*;

    fn model() -> DoublePendulum {
        DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, g: 9.8 }
    }

    fn start(model: &DoublePendulum) -> State<DoublePendulum> {
        use core::f64::consts::PI;
        model.state().theta1(2.0 * PI / 3.0).theta2(-PI / 18.0).build().unwrap()
    }

    const REFERENCE: &[(f64, [f64; 4])] = &[
        (1.0, [-1.517290485027184, 0.25279157971681376, -1.984467696932938, -4.087371261679003]),
        (2.0, [1.1528460961788194, -0.47307638064164165, -0.03045114454465769, 5.7995352636315705]),
        (5.0, [-0.4402197453666654, 7.04957895015024, -3.5211389783202574, -3.9088281777737497]),
        (10.0, [-0.7925961165988001, -2.4694945097592726, -1.9758098813438518, -2.3806311931408137]),
        (20.0, [-0.5317385636317077, -5.014305231077321, 4.524457260308955, 1.2158028455606882]),
        (50.0, [-1.5629561208262188, -19.93438388509621, 0.27578225262772876, 2.8643911318414186]),
    ];

    #[test]
    fn follows_the_reference_as_far_as_chaos_allows() {
        let model = model();
        let motion = model.simulate(start(&model)).until(20.0).tolerance(1e-13).run().unwrap();
        for (t, reference) in REFERENCE.iter().filter(|(t, _)| *t <= 20.0) {
            let error = distance(&flat!(motion.at(*t)), reference);
            // Ten times what rounding alone makes, which the condition number e^{0.9 t} amplifies
            // (`taylor.rs`).
            let bound = 1e-13 * (0.9 * t).exp();
            assert!(error < bound, "t = {t}: error {error:e}, bound {bound:e}");
        }
    }

    #[test]
    fn start_energy_is_the_published_one() {
        let model = model();
        let energy = model.energy_function(&start(&model));
        assert!((energy - 0.148884020480361).abs() < 1e-14, "{energy}");
    }

    #[test]
    fn energy_over_a_thousand_seconds() {
        let model = model();
        let motion = model.simulate(start(&model)).until(1000.0).tolerance(1e-12).run().unwrap();
        let drift = motion.verify().energy_drift;
        assert!(drift.abs() < 1e-9, "relative energy drift {drift:e}");
    }
}

/// Kepler's problem with eccentricity 0.9; Hairer, Lubich & Wanner, Geometric Numerical Integration, I.2.
mod kepler {
    use super::*;

    const REFERENCE: &[(f64, [f64; 4])] = &[
        (1.0, [-1.1871884663458634, 0.41752763873976423, -0.7611420105214913, -0.09947204787027349]),
        (10.0, [-1.8538537094055791, -0.13088540483992556, 0.16156945255843133, -0.2237192767918971]),
        (20.0, [-1.2952662509875743, 0.4003938963792322, -0.6775390924707566, -0.12708381542786862]),
        (100.0, [-0.7506333330296452, -0.4310000275773213, 1.1423476744354137, 0.07521912809626714]),
        (1000.0, [-1.1668352947149516, 0.4200854625477215, -0.7771162964060331, -0.09378756026719322]),
        (5000.0, [-1.4577741916087028, -0.3617854484681481, 0.5525928929177725, -0.16186994400627924]),
    ];

    #[test]
    fn end_values_to_the_digits_of_the_tolerance() {
        let model = Kepler { mu: 1.0 };
        let start = model.state().x(0.1).y_rate(19f64.sqrt()).build().unwrap();
        for tolerance in [1e-6, 1e-9, 1e-12] {
            let motion = model.simulate(start).until(20.0).tolerance(tolerance).run().unwrap();
            for (t, reference) in REFERENCE.iter().filter(|(t, _)| *t <= 20.0) {
                let error = distance(&flat!(motion.at(*t)), reference);
                // A local error is amplified at every perihelion: the phase error grows with time.
                assert!(error < 300.0 * tolerance, "tolerance {tolerance:e}, t = {t}: error {error:e}");
            }
        }
    }

    #[test]
    fn angular_momentum_is_found_only_in_polar_coordinates_but_kept_here() {
        let model = Kepler { mu: 1.0 };
        let start = model.state().x(0.1).y_rate(19f64.sqrt()).build().unwrap();
        let motion = model.simulate(start).until(100.0).tolerance(1e-12).run().unwrap();
        for state in motion.states() {
            let h = state.x() * state.y_rate() - state.y() * state.x_rate();
            assert!((h - 0.435889894354067).abs() < 1e-9, "t = {}: h = {h}", state.t);
        }
        let error = distance(&flat!(motion.end()), &REFERENCE.iter().find(|(t, _)| *t == 100.0).unwrap().1);
        assert!(error < 1e-7, "error {error:e}");
    }
}

/// Arenstorf's orbit, from the Lagrangian in the rotating frame; Hairer, Nørsett & Wanner, Solving ODE I,
/// p. 129.
mod arenstorf {
    use super::*;

    const PERIOD: f64 = 17.065_216_560_157_96;
    const REFERENCE: &[(f64, [f64; 4])] = &[
        (1.0, [0.3132845955561022, 0.3480089746751417, -1.0426165112787884, 0.6733841140965562]),
        (5.0, [0.022688783647977124, 0.8665401401712473, -0.1177364786408644, -0.42178580416287775]),
        (10.0, [-0.8398071663389864, 0.4468314170984721, 0.37374253561439386, -0.14966964466689517]),
        (17.065216560157964, [0.994, -2.63957739707259e-29, -3.6775349599317234e-27, -2.0015851063790824]),
    ];

    #[test]
    fn returns_after_a_period() {
        let model = Arenstorf { mu: 0.012277471 };
        let start = model.state().x(0.994).y_rate(-2.001_585_106_379_082_5).build().unwrap();
        let motion = model.simulate(start).until(PERIOD).tolerance(1e-13).run().unwrap();
        for (t, reference) in REFERENCE {
            let error = distance(&flat!(motion.at(t.min(PERIOD))), reference);
            // The close encounters at both ends of the period amplify a local error of 1e-13 by about 10⁵.
            assert!(error < 2e-8, "t = {t}: error {error:e}");
        }
    }

    #[test]
    fn jacobi_integral_is_conserved_and_found() {
        let model = Arenstorf { mu: 0.012277471 };
        let start = model.state().x(0.994).y_rate(-2.001_585_106_379_082_5).build().unwrap();
        assert!((model.energy_function(&start) + 1.428_206_260_104_93).abs() < 1e-12);
        assert!(Arenstorf::CONSERVED.iter().any(|q| q.name == "energy"), "{:?}", Arenstorf::CONSERVED);
        let motion = model.simulate(start).until(PERIOD).tolerance(1e-12).run().unwrap();
        assert!(motion.verify().energy_drift.abs() < 1e-8);
    }
}

/// Hénon & Heiles, Astron. J. 69 (1964) 73; initial data of the SciML energy conservation benchmark.
mod henon_heiles {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x, y)]
    struct HenonHeiles {
        lambda: f64,
    }

    #[dynamics]
    impl HenonHeiles {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (q.x.dt().powi(2) + q.y.dt().powi(2))
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * (q.x.powi(2) + q.y.powi(2)) + self.lambda * (q.x.powi(2) * q.y - q.y.powi(3) / 3.0)
        }
    }

    const REFERENCE: &[(f64, [f64; 4])] = &[
        (10.0, [0.03670891970302608, 0.6826922399017149, 0.04716396717584516, -0.025305958813863046]),
        (100.0, [-0.040194237876068815, 0.6790169217720217, 0.038450928951859836, 0.04859483155300364]),
        (500.0, [0.04255266468740387, 0.5979491577861642, 0.010964791015468331, -0.20220988032870155]),
        (1000.0, [-0.020869654947295507, -0.38163084134669734, 0.05684673704038535, 0.27197223256780373]),
    ];

    #[test]
    fn follows_the_reference() {
        let model = HenonHeiles { lambda: 1.0 };
        let start = model.state().x(0.1).y_rate(0.5).build().unwrap();
        let motion = model.simulate(start).until(1000.0).tolerance(1e-13).run().unwrap();
        for (t, reference) in REFERENCE {
            let error = distance(&flat!(motion.at(*t)), reference);
            assert!(error < 2e-12 * t.max(1.0), "t = {t}: error {error:e}");
        }
        assert!((motion.energy_at(0.0) - 0.13).abs() < 1e-15);
        assert!(motion.verify().energy_drift.abs() < 1e-10);
    }
}

/// Seven bodies in a plane; Hairer, Nørsett & Wanner, Solving ODE I, II.10.
mod pleiades {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x: [_; 7], y: [_; 7])]
    struct Pleiades {
        m: [f64; 7],
    }

    #[dynamics]
    impl Pleiades {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..7 {
                sum += 0.5 * self.m[i] * vec2(q.x[i], q.y[i]).dt().norm_squared();
            }
            sum
        }
        #[potential]
        fn gravitation(&self, q: &Coordinates<Self>) -> Expr {
            let mut sum = Expr::ZERO;
            for i in 0..7 {
                for j in 0..i {
                    sum -= self.m[i] * self.m[j] / vec2(q.x[i] - q.x[j], q.y[i] - q.y[j]).norm();
                }
            }
            sum
        }
    }

    const REFERENCE: [f64; 28] = [
        0.37061391439705127,
        3.237284092057233,
        -3.2225590324183235,
        0.6597091455775308,
        0.342558170715658,
        1.5621721014006311,
        -0.7003092922212495,
        -3.943437585517392,
        -3.27138097397255,
        5.225081843456544,
        -2.5906124349774693,
        1.1982136933922747,
        -0.24296823449358235,
        1.0914492404289797,
        3.4170038063143147,
        1.3545845016255011,
        -2.5900655978107756,
        2.025053734714241,
        -1.155815100160449,
        -0.8072988170223022,
        0.5952396354208719,
        -3.7412449612340084,
        0.3773459685750629,
        0.9386858869551079,
        0.36679222272005696,
        -0.3474046353808494,
        2.344915448180937,
        -1.947020434263292,
    ];

    #[test]
    fn end_values() {
        let model = Pleiades { m: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0] };
        let start = model
            .state()
            .x([3.0, 3.0, -1.0, -3.0, 2.0, -2.0, 2.0])
            .y([3.0, -3.0, 2.0, 0.0, 0.0, -4.0, 4.0])
            .x_rate([0.0, 0.0, 0.0, 0.0, 0.0, 1.75, -1.5])
            .y_rate([0.0, 0.0, 0.0, -1.25, 1.0, 0.0, 0.0])
            .build()
            .unwrap();
        assert!((model.energy_function(&start) + 45.952_469_497_847_126).abs() < 1e-12);
        let motion = model.simulate(start).until(3.0).tolerance(1e-13).run().unwrap();
        let error = distance(&flat!(motion.end()), &REFERENCE);
        // Quasi-collisions amplify errors by about 10³.
        assert!(error < 1e-9, "error {error:e}");
        let conserved: Vec<&str> = Pleiades::CONSERVED.iter().map(|q| q.name).collect();
        assert!(conserved.contains(&"energy"), "{conserved:?}");
    }
}

/// A bead on a cycloid: its period does not depend on its amplitude (Huygens 1673).
mod cycloid {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta: rad)]
    #[units(r: m, m: kg, g: m / s^2)]
    struct Cycloid {
        r: f64,
        m: f64,
        g: f64,
    }

    #[dynamics]
    impl Cycloid {
        fn bead(&self, q: &Coordinates<Self>) -> Vec2 {
            self.r * vec2(q.theta + q.theta.sin(), 1.0 - q.theta.cos())
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * self.bead(q).dt().norm_squared()
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.m * self.g * self.bead(q).y
        }
    }

    const REFERENCE: &[(f64, [f64; 3])] = &[
        (0.1, [0.0004748353579161309, -0.09999548310359951, -0.09988709812707776]),
        (1.0, [0.004554865460774381, -0.9999506896276801, -0.9987676622550935]),
        (3.0, [0.009476901355214052, -2.998732829276405, -2.9711235253565653]),
    ];

    #[test]
    fn closed_form_for_three_amplitudes() {
        let model = Cycloid { r: 1.0, m: 1.0, g: 9.81 };
        for (theta0, at_1_2_10) in REFERENCE {
            let start = model.state().theta(*theta0).build().unwrap();
            let motion = model.simulate(start).until(10.0).tolerance(1e-13).run().unwrap();
            for (t, reference) in [1.0, 2.0, 10.0].into_iter().zip(at_1_2_10) {
                let error = (motion.at(t).theta() - reference).abs();
                assert!(error < 1e-10, "start {theta0}, t = {t}: error {error:e}");
            }
        }
    }
}
