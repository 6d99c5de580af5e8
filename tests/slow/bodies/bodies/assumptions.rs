//! Masses, inertia and rotations that are none.

use dynamics::NotARotation;
use dynamics::error::StateError;

use super::*;

/// Parameters without nominal values are guessed where the equations are looked at. A matrix that was guessed
/// is rarely an inertia: the model is not to blame for it.
mod guessed_inertia {
    use super::*;

    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(e: [_; 4])]
    struct Thrown {
        inertia: Mat3<f64>,
    }

    #[dynamics]
    impl Thrown {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            EulerParameters::new(q.e).rotation().rotational_energy(self.inertia)
        }
        #[holonomic]
        fn unit(&self, q: &Coordinates<Self>) -> Expr {
            EulerParameters::new(q.e).norm_constraint()
        }
    }

    #[test]
    fn a_body_needs_no_nominal_values() {
        let thrown = Thrown { inertia: Mat3::diagonal(2.0, 3.0, 4.0) };
        // ω = (0, 0.1, 0.2) in the body: ė = ω/2 at e = (1, 0, 0, 0). Euler: ω̇ₓ = (I_y − I_z) ω_y ω_z / I_x,
        // and ë = ω̇/2 across e.
        let start =
            thrown.state().e([1.0, 0.0, 0.0, 0.0]).e_rate([0.0, 0.0, 0.05, 0.1]).build().expect("unit");
        let found = thrown.accelerations(&start).expect("regular");
        let expected = [-(0.05 * 0.05 + 0.1 * 0.1), (3.0 - 4.0) / 2.0 * 0.1 * 0.2 / 2.0, 0.0, 0.0];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{found} and {expected}");
        }
    }
}

/// Masses, inertia and rotations that are known only where the program runs: what is none is refused by the
/// name of what it is made of, before anything moves.
mod parameters {
    use dynamics::mass_properties::UnphysicalInertia;
    use dynamics::model::{AssumptionKind, AssumptionViolation};
    use dynamics::simulate::{OptionError, SimulationErrorKind};

    use super::*;

    /// A wheel on a hinge whose direction is a matrix, beside a plate that grows heavier.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(angle, turned)]
    struct Wheel {
        mount: Mat3<f64>,
        axis: Vec3<f64>,
        inertia: Mat3<f64>,
        growth: f64,
        moment: f64,
        radius: f64,
        skew: f64,
    }

    #[dynamics]
    impl Wheel {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let hinge = Frame::turned(self.mount).frame(Vec3::X, Mat3::axis_angle(self.axis, q.angle));
            // What a matrix of one's own makes of angles is not known to turn.
            let (s, c) = q.turned.sin_cos();
            let own = Mat3::from([
                [c, -s, 0.0.into()],
                [s, c, self.skew * q.turned],
                [0.0.into(), 0.0.into(), 1.0.into()],
            ]);
            let disk = RigidBody::new(
                1.0,
                Vec3::ZERO,
                Inertia::cylinder(2.0, self.radius, 0.0),
                hinge.frame(Vec3::Y, own),
            );
            RigidBody::new(1.0 + self.growth * q.t, Vec3::X, self.inertia, hinge).kinetic_energy()
                + disk.kinetic_energy()
        }
        #[kinetic]
        fn of_the_plate(&self, q: &Coordinates<Self>) -> Expr {
            PlanarBody::new(1.0, Vec2::X, self.moment, PlanarFrame::new(Vec2::ZERO, q.angle + q.turned))
                .kinetic_energy()
        }
    }

    fn wheel() -> Wheel {
        let mount = Mat3::euler(EulerSequence::Zyx, [0.3, -0.5, 0.9]);
        Wheel {
            mount,
            axis: Vec3::new(0.0, 0.3, 2.0),
            inertia: Mat3::diagonal(0.1, 0.1, 0.2),
            growth: 0.1,
            moment: 0.3,
            radius: 0.2,
            skew: 0.0,
        }
    }

    /// What keeps a start from being made, and a run of a start that was made for another model.
    fn refused(model: &Wheel) -> (AssumptionKind, AssumptionViolation, String) {
        let error = model.state().angle(0.4).turned(0.3).build().expect_err("nothing has it");
        let StateError::Unphysical { assumption, why } = error else { panic!("{error}") };
        let start = wheel().state().angle(0.4).turned(0.3).build().expect("a wheel");
        let run = model.simulate(start).until(1.0).run().expect_err("nothing has it");
        // By their words: what is not a number is not itself.
        let said = |option: &OptionError| {
            matches!(option, OptionError::Unphysical { .. }) && option.to_string() == error.to_string()
        };
        assert!(matches!(&run.kind, SimulationErrorKind::Option(option) if said(option)), "{run}");
        (assumption.kind, why, error.to_string())
    }

    #[test]
    fn what_bodies_have_is_accepted() {
        let mirror = Mat3::diagonal(1.0, -1.0, 1.0);
        let mounted = wheel();
        // Nothing is as thin as a rod or a plate, and a point has no inertia; what mirrors is meant; rounding
        // is no mistake.
        for (inertia, mount) in [
            (Mat3::diagonal(0.0, 0.1, 0.1), mounted.mount * mirror),
            (Mat3::diagonal(0.0, 0.0, 0.0), Mat3::diagonal(-1.0, -1.0, 1.0)),
            (Mat3::diagonal(0.1, 0.2, 0.3 * (1.0 + 1e-12)), mounted.mount * (1.0 + 1e-12)),
        ] {
            let model = Wheel { inertia, mount, moment: 0.3, ..wheel() };
            let start = model.state().angle_rate(1.0).build().unwrap_or_else(|error| panic!("{error}"));
            assert!(model.simulate(start).until(0.1).run().is_ok());
        }
    }

    #[test]
    fn what_no_body_has_is_named_before_it_moves() {
        let sheared = Mat3::from([[0.1, 0.02, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.2]]);
        let scaled = wheel().mount * 1.001;
        let (kind, why, said) = refused(&Wheel { inertia: sheared, ..wheel() });
        assert_eq!(kind, AssumptionKind::Inertia);
        assert!(
            matches!(why, AssumptionViolation::Body(UnphysicalInertia::NotSymmetric { i: 0, j: 1, .. })),
            "{said}"
        );
        assert!(
            said.starts_with(
                "the inertia of a body in `kinetic`, given by `inertia`: an inertia matrix is symmetric"
            ),
            "{said}"
        );
        for (inertia, negative) in [((0.1, 0.1, 0.201), false), ((-0.1, 0.3, 0.2), true)] {
            let (_, why, said) =
                refused(&Wheel { inertia: Mat3::diagonal(inertia.0, inertia.1, inertia.2), ..wheel() });
            let named = match why {
                AssumptionViolation::Body(UnphysicalInertia::NegativeMoment { .. }) => negative,
                AssumptionViolation::Body(UnphysicalInertia::Triangle { .. }) => !negative,
                _ => false,
            };
            assert!(named, "{said}");
        }
        let (kind, why, said) = refused(&Wheel { moment: -0.3, ..wheel() });
        assert_eq!(
            (kind, why),
            (AssumptionKind::Moment, AssumptionViolation::Body(UnphysicalInertia::Moment(-0.3))),
            "{said}"
        );
        assert!(said.contains("`of_the_plate`, given by `moment`"), "{said}");
        let (kind, why, said) = refused(&Wheel { mount: scaled, ..wheel() });
        assert_eq!(kind, AssumptionKind::Rotation);
        assert!(
            matches!(
                why,
                AssumptionViolation::Rotation(NotARotation::NotOrthonormal(by))
                if (by - 2.001e-3).abs() < 1e-9
            ),
            "{said}"
        );
        assert!(said.contains("given by `mount`"), "{said}");
        for size in [0.0, 1e-200, 1e-160, 1e160, 1e200] {
            let (kind, why, said) = refused(&Wheel { axis: Vec3::new(0.0, 0.6, 0.8) * size, ..wheel() });
            assert!(kind == AssumptionKind::Axis && matches!(why, AssumptionViolation::Axis(_)), "{said}");
            assert!(said.contains("the axis of a turn in `kinetic`, given by `axis`"), "{said}");
        }
    }

    /// What the state decides is looked at where it begins.
    #[test]
    fn what_the_state_decides_is_looked_at_in_the_start() {
        let (kind, why, said) = refused(&Wheel { skew: 0.1, ..wheel() });
        assert!(
            kind == AssumptionKind::Rotation && matches!(why, AssumptionViolation::Rotation(_)),
            "{said}"
        );
        assert!(said.contains("`turned`") && said.contains("`skew`"), "{said}");
        let model = wheel();
        let start = model.state().at_time(-20.0).build();
        let heavy = matches!(
            start,
            Err(StateError::Unphysical { why: AssumptionViolation::Body(UnphysicalInertia::Mass(m)), .. })
            if m == -1.0
        );
        assert!(heavy, "{start:?}");
    }

    /// Inertia of solids is that of bodies, and turns by angles turn: nothing is asked of them at run time.
    #[test]
    fn what_is_so_as_it_is_written_is_not_asked_again() {
        let asked: Vec<(AssumptionKind, &[&str], bool)> =
            Wheel::ASSUMPTIONS.iter().map(|p| (p.kind, p.of, p.constant)).collect();
        let all: [(AssumptionKind, &[&str], bool); 6] = [
            (AssumptionKind::Rotation, &["mount"], true),
            (AssumptionKind::Axis, &["axis"], true),
            (AssumptionKind::Rotation, &["turned", "skew"], false),
            (AssumptionKind::Mass, &["growth"], false),
            (AssumptionKind::Inertia, &["inertia"], true),
            (AssumptionKind::Moment, &["moment"], true),
        ];
        assert_eq!(asked, all);
        assert!(
            Hinged::ASSUMPTIONS
                .iter()
                .all(|assumption| assumption.kind != AssumptionKind::Rotation || assumption.of == ["axes"])
        );
    }
}
