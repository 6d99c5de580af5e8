//! A model with everything, and choices.

use dynamics::error::StateError;

use super::*;

mod whole_language {
    use super::*;

    /// A made-up system that uses the whole language: arrays, vectors, matrices, a spline, explicit time, an
    /// input, forces at points, `if`.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(s, phi: [_; 2], z)]
    #[inputs(w: [_; 2])]
    pub(super) struct Everything {
        m: [f64; 3],
        axis: Vec3<f64>,
        inertia: Mat3<f64>,
        track: CubicSpline,
        k: f64,
        c: f64,
    }

    #[dynamics]
    impl Everything {
        const LINKS: usize = 2;
        const OMEGA: f64 = 1.7;

        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec3 {
            let mut p = vec3(q.s, self.track.at(q.s), 0.0);
            for j in 0..=i {
                let (sin, cos) = (q.phi[j].sin(), q.phi[j].cos());
                p += vec3(sin, -cos, 0.3 * q.z);
            }
            p
        }
        fn spin(&self, q: &Coordinates<Self>) -> Vec3 {
            let [a, b] = q.phi;
            vec3(a.dt(), b.dt() * a.cos(), q.z.dt()) + self.axis * (q.s.dt() + 0.2)
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut t = 0.5 * self.m[2] * vec2(q.s, self.track.at(q.s)).dt().norm_squared();
            for i in 0..Self::LINKS {
                t += 0.5 * self.m[i] * self.place(q, i).dt().norm_squared();
            }
            // A body whose angular velocity is no time derivative: the fast derivation must refuse it.
            let w = self.spin(q);
            t + 0.5 * w.dot(self.inertia * w)
        }
        #[potential]
        fn spring(&self, q: &Coordinates<Self>) -> Expr {
            let stretch = (q.z - 0.1 * (Self::OMEGA * q.t).sin()).powi(2);
            0.5 * self.k * stretch
                + q.s.cosh().ln()
                + (0.3 * q.phi[0]).exp()
                + (1.0 + q.phi[1].powi(2)).sqrt()
        }
        #[potential]
        fn stop(&self, q: &Coordinates<Self>) -> Expr {
            if q.s > 5.0 { 0.5 * self.k * (q.s - 5.0).powi(2) } else { Expr::ZERO }
        }
        #[dissipation]
        fn drag(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.c * (q.z.dt().powi(2) + q.s.dt().powi(2))
        }
        #[force]
        fn wind(&self, q: &Coordinates<Self>) -> Force {
            let p = self.place(q, 1);
            let v = p.dt();
            Force::at(p, -0.1 * v.norm() * v + vec3(q.w[0], 0.2, q.t.cos()))
                + Force::along(q.phi[0] * q.z, q.w[1])
        }
        #[output]
        fn tip(&self, q: &Coordinates<Self>) -> Vec3 {
            self.place(q, 1)
        }
        #[output]
        fn felt(&self, q: &Coordinates<Self>) -> Expr {
            self.place(q, 1).dt().dt().norm()
        }
        #[event]
        fn crossing(&self, q: &Coordinates<Self>) -> Expr {
            q.z - 0.2 * q.s.dt().dt()
        }
    }

    fn model(p: &[f64]) -> Everything {
        let knots: Vec<f64> = (-8..=8).map(f64::from).collect();
        let heights: Vec<f64> = knots.iter().map(|x| (0.7 * x).sin()).collect();
        Everything {
            m: [p[0], p[1], p[2]],
            axis: Vec3::new(p[3], p[4], p[5]),
            inertia: Mat3::from([[p[6], p[7], p[8]], [p[9], p[10], p[11]], [p[12], p[13], p[14]]]),
            track: CubicSpline::natural(&knots, &heights).unwrap(),
            k: p[15],
            c: p[16],
        }
    }

    const PARAMETERS: [f64; 17] =
        [1.0, 0.8, 0.5, 0.1, -0.2, 0.3, 0.9, 0.05, 0.02, 0.05, 0.7, 0.04, 0.02, 0.04, 0.6, 3.0, 0.4];

    #[test]
    fn by_two_routes() {
        let model = model(&PARAMETERS);
        // Around 0.5, between knots at 0 and 1 and clear of the `if`: the spline's third derivative jumps at
        // knots.
        let mut random = Random(3);
        for _ in 0..3 {
            let state = random_state::<Everything>(&mut random, 0.5);
            assert!(state.s().abs() < 5.0);
        }
        verify(
            &model,
            0.5,
            |q| model.kinetic(q) - model.spring(q) - model.stop(q),
            |q| model.wind(q).power() - 2.0 * model.drag(q).value(),
        );
    }

    #[test]
    fn parameters_are_told_in_their_order() {
        let model = model(&PARAMETERS);
        let told: Vec<Option<f64>> = (0..=PARAMETERS.len()).map(|i| model.parameter(i)).collect();
        let expected = PARAMETERS.iter().copied().map(Some).chain([None]);
        assert!(told.iter().copied().eq(expected), "{told:?}");
        // Of vectors and matrices by element; a model without constraints is asked as well.
        let mut broken = model;
        broken.inertia = Mat3::from([[0.9, 0.05, 0.02], [0.05, 0.7, f64::NAN], [0.02, 0.04, 0.6]]);
        let error = broken.state().build().unwrap_err();
        let StateError::NotFinite { what: "parameter", name, .. } = error else { panic!("{error}") };
        assert_eq!(name, Everything::PARAMETERS[11].name);
    }

    #[test]
    fn each_parameter_is_set_and_no_other() {
        let before = model(&PARAMETERS);
        for i in 0..PARAMETERS.len() {
            let after = before.with_parameter(i, -7.25).expect("a parameter of this index");
            let expected = PARAMETERS.iter().enumerate().map(|(k, x)| Some(if k == i { -7.25 } else { *x }));
            assert!(
                (0..PARAMETERS.len()).map(|k| after.parameter(k)).eq(expected),
                "{}",
                Everything::PARAMETERS[i].name
            );
        }
        assert!(before.with_parameter(PARAMETERS.len(), 1.0).is_none());
    }

    #[test]
    fn parameters_by_two_routes() {
        verify_parameters(model, &PARAMETERS, 0.5);
    }

    #[test]
    fn outputs_and_events_are_what_the_functions_say_on_jets() {
        let model = model(&PARAMETERS);
        let mut random = Random(11);
        for _ in 0..20 {
            let state = random_state::<Everything>(&mut random, 0.5);
            let q = Everything::coordinates_with(&state, &model.accelerations(&state).unwrap(), &[]);
            let mut outputs = vec![f64::NAN; Everything::OUTPUTS.len()];
            model.outputs(&state, &mut outputs).unwrap();
            let names: Vec<&str> = Everything::OUTPUTS.iter().map(|o| o.name).collect();
            assert_eq!(names, ["tip.x", "tip.y", "tip.z", "felt"]);
            let tip = model.tip(&q).value();
            let expected = [tip.x, tip.y, tip.z, model.felt(&q).value()];
            for (emitted, jets) in outputs.iter().zip(expected) {
                near(*emitted, jets, jets, 1e-12, "output");
            }
            let mut events = vec![f64::NAN; 1];
            model.events(&state, &mut events).unwrap();
            near(events[0], model.crossing(&q).value(), 1.0, 1e-12, "event");
        }
    }
}

mod choices {
    use super::*;

    /// A ball that meets a wall with Hertz's law on one side, held by a rope that can be slack on the other:
    /// the branch not taken is outside of its domain, 0/0 or a root of a negative number.
    #[derive(Clone, Debug, Dynamics)]
    #[coordinates(x, y)]
    struct Ball {
        m: f64,
        wall: f64,
        rope: f64,
        length: f64,
        damping: f64,
    }

    #[dynamics]
    impl Ball {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()
        }
        #[potential]
        fn contact(&self, q: &Coordinates<Self>) -> Expr {
            if q.x < 0.0 { self.wall * (-q.x).powf(2.5) } else { Expr::ZERO }
        }
        #[potential]
        fn rope(&self, q: &Coordinates<Self>) -> Expr {
            let stretch = vec2(q.x, q.y).norm() - self.length;
            if stretch > 0.0 { 0.5 * self.rope * stretch.powi(2) } else { Expr::ZERO }
        }
        #[force]
        fn damper(&self, q: &Coordinates<Self>) -> Force {
            let closing = if q.x < 0.0 { (-q.x).sqrt() * q.x.dt() } else { Expr::ZERO };
            Force::along(q.x, -self.damping * closing)
                + Force::along(q.y, -self.damping * (q.y.sqrt()).max(1.0).ln())
        }
    }

    fn model(p: &[f64]) -> Ball {
        Ball { m: p[0], wall: p[1], rope: p[2], length: p[3], damping: p[4] }
    }

    #[test]
    fn by_two_routes_on_every_side() {
        let parameters = [1.2, 30.0, 20.0, 1.5, 0.4];
        for center in [2.5, 0.95] {
            let model = model(&parameters);
            verify(
                &model,
                center,
                |q| model.kinetic(q) - model.contact(q) - model.rope(q),
                |q| model.damper(q).power(),
            );
        }
        verify_parameters(model, &parameters, 2.5);
    }

    #[test]
    fn the_branch_not_taken_leaks_nothing() {
        let model = model(&[1.2, 30.0, 20.0, 1.5, 0.4]);
        for (x, y) in [(0.0, 0.0), (0.3, 0.2), (-0.2, 0.1), (3.0, 2.0), (-2.0, 0.5)] {
            let state = model.state().x(x).y(y).x_rate(0.3).y_rate(-0.1).build().unwrap();
            let a = model.accelerations(&state).unwrap();
            let jacobian = model.state_jacobian(&state).unwrap();
            let numbers = a.iter().chain(jacobian.by_q.iter()).chain(jacobian.by_u.iter());
            assert!(numbers.into_iter().all(|v| v.is_finite()), "at ({x}, {y}): {a} {jacobian:?}");
            if x > 0.0 && x.hypot(y) < 1.5 {
                assert_eq!(a[0], 0.0, "nothing touches the ball at ({x}, {y})");
            }
        }
        // In the wall: −∂V/∂x = 2.5 k (−x)^1.5, less the damper.
        let state = model.state().x(-0.2).y(0.1).x_rate(0.3).build().unwrap();
        let expected = (2.5 * 30.0 * 0.2f64.powf(1.5) - 0.4 * 0.2f64.sqrt() * 0.3) / 1.2;
        near(model.accelerations(&state).unwrap()[0], expected, expected, 1e-14, "force of the wall");
    }
}
