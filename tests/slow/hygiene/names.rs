//! Names of statics, constants and structs that emitted code must not meet.

/// Statics and constants of the user's: a pattern of their name would be no binding but what they are.
mod lower_case {
    #![allow(non_upper_case_globals, dead_code, reason = "names that emitted code could have for its locals")]
    use dynamics::prelude::*;

    macro_rules! taken {
        ($($name:ident)*) => { $(pub(crate) static $name: u8 = 0;)* };
    }
    taken!(v0 v1 v2 q u t w a k x z state model lambda branches values
        value name side i j f error index matrix terms);
    const modes: u8 = 0;
    const memory: u8 = 0;
    const accelerations: u8 = 0;

    /// A bead on a wire that moves, and a weight on a rod.
    #[derive(Debug, Dynamics)]
    #[coordinates(s, y, h)]
    #[inputs(push)]
    pub(crate) struct Bead {
        pub(crate) m: f64,
        pub(crate) l: f64,
        pub(crate) c: f64,
    }

    #[dynamics]
    impl Bead {
        fn place(&self, at: &Coordinates<Self>) -> Vec2 {
            vec2(at.s, at.s.sin().sin() + (self.l * at.t).cos())
        }
        #[kinetic]
        fn kinetic(&self, at: &Coordinates<Self>) -> Expr {
            0.5 * self.m * (self.place(at).dt().norm_squared() + vec2(at.y, at.h).dt().norm_squared())
        }
        #[potential]
        fn weight(&self, at: &Coordinates<Self>) -> Expr {
            self.m * (self.place(at).y + at.h) + 0.5 * self.c * at.s.max(0.0).powi(2)
        }
        #[holonomic]
        fn rod(&self, at: &Coordinates<Self>) -> Expr {
            vec2(at.y, at.h).norm_squared() - self.l.powi(2)
        }
        #[nonholonomic(switched, integrable)]
        fn stick(&self, at: &Coordinates<Self>) -> Expr {
            at.s.dt()
        }
        #[force]
        fn drive(&self, at: &Coordinates<Self>) -> Force {
            Force::along(at.s, at.push)
        }
        #[output]
        fn tension(&self, at: &Coordinates<Self>) -> Expr {
            at.reaction(Self::rod)
        }
        #[event]
        fn bottom(&self, at: &Coordinates<Self>) -> Expr {
            at.y
        }
    }
}

#[test]
fn statics_and_constants_of_any_name_may_stand_beside_a_model() {
    use dynamics::prelude::*;
    let model = lower_case::Bead { m: 2.0, l: 1.0, c: 0.0 };
    let start = model.state().s(0.3).h(-1.0).push(0.0).release("stick").build().expect("a state on the rod");
    // (1 + f'²) s̈ = −f' (1 + b̈) with f = sin sin s, b = cos t, b̈(0) = −1, at rest.
    let found = model.accelerations(&start).expect("regular");
    assert!(found.norm() < 1e-14, "{found}");
    let mut outputs = [f64::NAN];
    model.outputs(&start, &mut outputs).expect("regular");
    // Pushes toward shorter rods: λ ∂Φ/∂h = 2 N up.
    assert!((outputs[0] + 1.0).abs() < 1e-14, "{outputs:?}");
}

/// Structs that are called like something that emitted code, the prelude or the standard library names.
mod struct_names {
    macro_rules! oscillators {
        ($($module:ident $name:ident)*) => {
            $(mod $module {
                use dynamics::prelude::*;

                /// An oscillator on an inclined line.
                #[derive(Dynamics)]
                #[coordinates(x, y)]
                pub(super) struct $name {
                    pub(super) m: f64,
                    pub(super) k: f64,
                }
                #[dynamics]
                impl $name {
                    #[kinetic]
                    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
                    }
                    #[potential]
                    fn potential(&self, q: &Coordinates<Self>) -> Expr {
                        0.5 * self.k * q.x.powi(2)
                    }
                    #[holonomic]
                    fn line(&self, q: &Coordinates<Self>) -> Expr {
                        q.x - q.y
                    }
                }
                #[test]
                fn moves() {
                    let model = $name { m: 1.0, k: 4.0 };
                    let state = model.state().x(0.5).y(0.5).build().expect("a state on the line");
                    assert!((model.accelerations(&state).expect("inertia")[0] + 1.0).abs() < 1e-15);
                }
            })*
        };
    }
    oscillators!(model Model result Result ok Ok err Err t T f F force Force state State clone Clone);
}
