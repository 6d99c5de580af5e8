//! Generated code gets along with whatever surrounds it: modules, function bodies, shadowed names, strict
//! lints, other macros.
#![deny(warnings, missing_docs, unsafe_code, unreachable_pub, clippy::all, clippy::pedantic)]
#![deny(unused, nonstandard_style, rust_2018_idioms, single_use_lifetimes, unused_qualifications)]
#![deny(missing_debug_implementations, missing_copy_implementations, unused_results, trivial_casts)]

/// Every name that generated code might be tempted to use, meaning something else.
mod shadowed {
    #![allow(dead_code, non_camel_case_types, non_upper_case_globals, unused_macros)]
    mod core {}
    mod std {}
    mod dynamics_runtime {}
    mod nalgebra {}
    struct Result;
    struct Vec;
    struct Option;
    struct String;
    struct Box;
    struct Model;
    struct Quantity;
    struct SVector;
    struct State;
    struct f64;
    struct usize;
    struct bool;
    struct str;
    #[allow(non_snake_case)]
    fn Ok() {}
    #[allow(non_snake_case)]
    fn Err() {}
    #[allow(non_snake_case)]
    fn Some() {}
    const None: () = ();
    trait Clone {}
    trait Copy {}
    trait Debug {}
    trait PartialEq {}
    trait Default {}
    trait From {}
    trait Into {}
    trait Send {}
    trait Sync {}
    trait Vector {}
    macro_rules! assert {
        () => {};
    }
    macro_rules! unreachable {
        () => {};
    }
    macro_rules! derive {
        () => {};
    }

    type Real = ::core::primitive::f64;
    type Expr = ::dynamics::Expr;
    use ::dynamics::model::Coordinates;

    #[derive(::dynamics::Dynamics)]
    #[model(targets(c))]
    #[coordinates(x)]
    struct Oscillator {
        m: ::core::primitive::f64,
        k: ::core::primitive::f64,
    }

    #[::dynamics::dynamics]
    impl Oscillator {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * q.x.dt() * q.x.dt()
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            Self::ONES[1] * self.k * q.x * q.x * (Self::TURN / ::core::f64::consts::TAU)
        }
        const COUNT: ::core::primitive::usize = 1;
        #[allow(clippy::cast_precision_loss, reason = "it is 1")]
        const ONES: [Real; 2] = [1.0, 0.5 * (Self::COUNT as ::core::primitive::f64)];
        const TURN: Real = 2.0 * ::core::f64::consts::PI;
    }

    /// With everything that constraints bring along.
    #[derive(::dynamics::Dynamics)]
    #[coordinates(x, y)]
    struct Block {
        m: ::core::primitive::f64,
        friction: ::core::primitive::f64,
    }

    #[::dynamics::dynamics]
    impl Block {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * (q.x.dt() * q.x.dt() + q.y.dt() * q.y.dt())
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            9.81 * self.m * (q.y - q.x)
        }
        #[holonomic(switched)]
        #[redundant]
        fn floor(&self, q: &Coordinates<Self>) -> ::dynamics::Vec2 {
            ::dynamics::Vec2::new(q.y, 2.0 * q.y)
        }
        #[nonholonomic(switched, integrable)]
        fn stick(&self, q: &Coordinates<Self>) -> [Expr; 1] {
            [q.x.dt()]
        }
        #[force]
        fn rubbing(&self, q: &Coordinates<Self>) -> ::dynamics::Force {
            ::dynamics::Force::along(q.x, -self.friction * q.reaction(Self::floor).x * q.slip(Self::stick))
        }
        #[output]
        fn normal(&self, q: &Coordinates<Self>) -> Expr {
            q.reaction(Self::floor).y + q.x.dt().dt()
        }
        #[event]
        fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
            q.reaction(Self::stick)[0]
        }
    }

    pub(crate) fn held() -> Real {
        let model = Block { m: 2.0, friction: 0.1 };
        let ::core::result::Result::Ok(state) = model.state().x_guess(1.0).assemble() else { return 0.0 };
        let mut values = [0.0];
        let ::core::result::Result::Ok(()) = ::dynamics::model::Events::events(&model, &state, &mut values)
        else {
            return 0.0;
        };
        values[0]
    }

    pub(crate) fn acceleration() -> Real {
        let model = Oscillator { m: 2.0, k: 3.0 };
        let ::core::result::Result::Ok(state) = model.state().x(1.0).build() else { return 0.0 };
        let ::core::result::Result::Ok(a) = ::dynamics::model::Dynamics::accelerations(&model, &state) else {
            return 0.0;
        };
        a[0]
    }
}

#[test]
fn shadowed_names_do_not_matter() {
    assert!((shadowed::acceleration() + 1.5).abs() < 1e-15);
    assert!((shadowed::held() + 2.0 * 9.81).abs() < 1e-12);
}

/// Constants of std's by every way to their names, beside the user's own of the same names.
mod constants {
    use dynamics::prelude::*;
    use std::f64::consts as c;

    /// Steel.
    const E: f64 = 2.1e11;

    /// A spring.
    #[derive(Debug, Dynamics)]
    #[coordinates(x)]
    pub(crate) struct Spring {
        pub(crate) m: f64,
    }

    #[dynamics]
    impl Spring {
        const E: f64 = 8.0;
        const PI: f64 = 3.0;
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            use core::f64::consts::{FRAC_PI_2, PI};
            self.m * (PI / FRAC_PI_2) / 4.0 * q.x.dt().powi(2)
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            const TAU: f64 = 2.0;
            let sines = [c::PI.sin(), std::f64::consts::E.ln(), f64::EPSILON];
            sines[1] * Self::E / TAU * (Self::PI - 2.5) * q.x.powi(2)
        }
    }

    #[test]
    fn each_is_what_rustc_says() {
        let model = Spring { m: 1.0 };
        let state = model.state().x(1.0).build().expect("a finite state");
        assert!((model.accelerations(&state).expect("inertia")[0] + 4.0).abs() < 1e-14);
        assert!((model.potential_energy(&state) - 2.0).abs() < 1e-14);
        const { assert!(E > Spring::E) };
    }
}

/// Words of the library by several ways to their names.
mod words {
    use dynamics as library;
    use dynamics::model::Energies as _;
    use dynamics::prelude::{Coordinates, Dynamics, Expr, dynamics};

    type Vec2 = library::Vec2<f64>;

    #[derive(Debug, Dynamics)]
    #[coordinates(r, phi)]
    pub(crate) struct Bead {
        pub(crate) m: f64,
        pub(crate) g: f64,
    }

    #[dynamics]
    impl Bead {
        const UP: library::Vec3<f64> = library::Vec3::<f64>::new(0.0, 1.0, 0.0);
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            use dynamics::vec2;
            let place = q.r * vec2(q.phi.cos(), q.phi.sin());
            0.5 * self.m * place.dt().norm_squared()
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            let up = Vec2::new(Self::UP.x, 2.0 * Self::UP.y);
            let place = library::Polar { r: q.r, theta: q.phi }.point();
            self.m * self.g / 2.0 * up.dot(place)
        }
    }

    #[test]
    fn each_is_the_librarys() {
        let model = Bead { m: 2.0, g: 3.0 };
        let state = model.state().r(1.5).phi(0.4).r_rate(1.0).phi_rate(2.0).build().expect("a finite state");
        assert!((model.kinetic_energy(&state) - 10.0).abs() < 1e-13);
        assert!((model.potential_energy(&state) - 9.0 * 0.4_f64.sin()).abs() < 1e-13);
    }
}

/// Struct and impl apart.
mod apart {
    pub(crate) mod parameters {
        use dynamics::prelude::*;

        /// An oscillator.
        #[derive(Clone, Debug, PartialEq, Dynamics)]
        #[coordinates(x)]
        pub(crate) struct Oscillator {
            /// Mass.
            pub(crate) m: f64,
            /// Stiffness.
            pub(crate) k: f64,
        }
    }
    pub(crate) mod equations {
        use super::parameters::Oscillator;
        use dynamics::prelude::*;

        #[dynamics]
        impl Oscillator {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.m * q.x.dt().powi(2)
            }
            #[potential]
            fn potential(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.k * q.x.powi(2)
            }
        }
    }
    pub(crate) mod more {
        pub(in crate::apart) mod deep {
            use dynamics::prelude::*;

            /// A second model of the same crate.
            #[derive(Dynamics)]
            #[coordinates(x)]
            pub(in crate::apart) struct Second {
                pub(in crate::apart) m: f64,
                pub(in crate::apart) k: f64,
            }
        }
    }
    use dynamics::prelude::*;

    #[dynamics]
    impl more::deep::Second {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * q.x.dt().powi(2)
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * q.x.powi(2)
        }
    }

    pub(crate) fn name() -> &'static str {
        let _ = more::deep::Second { m: 1.0, k: 1.0 };
        more::deep::Second::NAME
    }
}

#[test]
fn struct_and_impl_may_stand_in_different_modules() {
    use dynamics::prelude::*;
    let model = apart::parameters::Oscillator { m: 1.0, k: 4.0 };
    let state = model.state().x(0.5).build().expect("a finite state");
    assert!((model.accelerations(&state).expect("inertia")[0] + 2.0).abs() < 1e-15);
    assert_eq!(apart::name(), "Second");
}

#[test]
fn a_model_in_a_function_body() {
    use dynamics::prelude::*;

    // The impl block may even come first.
    #[dynamics]
    impl Local {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * q.x.dt().powi(2)
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * q.x.powi(2)
        }
    }

    #[derive(Dynamics)]
    #[coordinates(x)]
    struct Local {
        m: f64,
        k: f64,
    }

    let model = Local { m: 1.0, k: 4.0 };
    let state = model.state().x(0.5).build().expect("a finite state");
    assert!((model.accelerations(&state).expect("inertia")[0] + 2.0).abs() < 1e-15);
}

/// Constraints of a model whose struct stands elsewhere.
mod constrained {
    mod parameters {
        use dynamics::prelude::*;

        /// A pendulum.
        #[derive(Debug, Dynamics)]
        #[coordinates(x, y)]
        pub(super) struct Pendulum {
            pub(super) m: f64,
            pub(super) l: f64,
        }
    }
    use dynamics::prelude::*;

    #[dynamics]
    impl parameters::Pendulum {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
        }
        #[potential]
        fn weight(&self, q: &Coordinates<Self>) -> Expr {
            self.m * q.y
        }
        #[holonomic]
        fn rod(&self, q: &Coordinates<Self>) -> Expr {
            q.x.powi(2) + q.y.powi(2) - self.l.powi(2)
        }
        #[output]
        fn tension(&self, q: &Coordinates<Self>) -> Expr {
            -2.0 * self.l * q.reaction(Self::rod)
        }
    }

    #[test]
    fn a_rod_carries_its_weight() {
        let model = parameters::Pendulum { m: 3.0, l: 2.0 };
        let state = model.state().x(0.0).y_guess(-1.0).assemble().expect("within reach");
        let mut tension = [f64::NAN];
        model.outputs(&state, &mut tension).expect("regular");
        assert!((tension[0] - 3.0).abs() < 1e-14);
    }
}

/// Blocks in one module for structs of one name: they are no two blocks for one struct.
mod namesakes {
    macro_rules! wheel {
        ($module:ident) => {
            mod $module {
                use dynamics::prelude::*;

                /// A wheel.
                #[derive(Debug, Dynamics)]
                #[coordinates(angle)]
                pub(super) struct Wheel {
                    pub(super) inertia: f64,
                }
            }
        };
    }
    wheel!(front);
    wheel!(rear);
    use dynamics::prelude::*;

    #[dynamics]
    impl front::Wheel {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * q.angle.dt().powi(2)
        }
    }

    #[dynamics]
    impl rear::Wheel {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.inertia * q.angle.dt().powi(2)
        }
    }

    #[test]
    fn each_has_its_own_block() {
        let (front, rear) = (front::Wheel { inertia: 1.0 }, rear::Wheel { inertia: 3.0 });
        let front_state = front.state().angle_rate(2.0).build().expect("finite");
        let rear_state = rear.state().angle_rate(2.0).build().expect("finite");
        assert!((front.kinetic_energy(&front_state) - 2.0).abs() < 1e-15);
        assert!((rear.kinetic_energy(&rear_state) - 6.0).abs() < 1e-15);
    }
}

/// The façade under another name.
mod renamed {
    pub(crate) use dynamics as mechanics;

    pub(crate) mod model {
        use super::mechanics::prelude::*;

        /// An oscillator.
        #[derive(Clone, Copy, Debug, Dynamics)]
        #[model(crate = crate::renamed::mechanics)]
        #[coordinates(x)]
        pub(crate) struct Renamed {
            pub(crate) m: f64,
            pub(crate) k: f64,
        }

        #[dynamics]
        impl Renamed {
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.m * q.x.dt().powi(2)
            }
            #[potential]
            fn potential(&self, q: &Coordinates<Self>) -> Expr {
                0.5 * self.k * q.x.powi(2)
            }
        }
    }
}

#[test]
fn the_crate_may_be_renamed() {
    use dynamics::prelude::*;
    let model = renamed::model::Renamed { m: 1.0, k: 4.0 };
    let state = model.state().x(0.5).build().expect("a finite state");
    assert!((model.accelerations(&state).expect("inertia")[0] + 2.0).abs() < 1e-15);
}

/// Models whose declarations come out of another macro.
mod from_macro {
    use dynamics::prelude::*;

    macro_rules! oscillator {
        ($name:ident, $coordinate:ident, $ty:ty, $factor:expr) => {
            /// An oscillator.
            #[derive(Debug, Dynamics)]
            #[coordinates($coordinate)]
            struct $name {
                m: $ty,
                k: $ty,
            }
            #[dynamics]
            impl $name {
                #[kinetic]
                fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                    $factor * self.m * q.$coordinate.dt().powi(2)
                }
                #[potential]
                fn potential(&self, q: &Coordinates<Self>) -> Expr {
                    $factor * self.k * q.$coordinate.powi(2)
                }
            }
        };
    }
    oscillator!(First, y, f64, 0.5);
    oscillator!(Other, z, f64, 1.0 / 2.0);

    #[test]
    fn both_work() {
        let first = First { m: 1.0, k: 4.0 };
        let state = first.state().y(0.5).build().expect("a finite state");
        assert!((first.accelerations(&state).expect("inertia")[0] + 2.0).abs() < 1e-15);
        let other = Other { m: 1.0, k: 4.0 };
        let state = other.state().z(0.5).z_rate(1.0).build().expect("a finite state");
        assert!((other.kinetic_energy(&state) - 0.5).abs() < 1e-15);
    }
}

/// Conditional compilation where rustc settles it before the macros run, and in a drawing, which they do not
/// follow.
mod conditional {
    use dynamics::prelude::*;

    /// An oscillator.
    #[derive(Debug, Dynamics)]
    #[coordinates(x)]
    struct Oscillator {
        m: f64,
        #[cfg(not(test))]
        k: f32,
        #[cfg(test)]
        k: f64,
    }

    #[cfg(test)]
    #[dynamics]
    #[cfg(test)]
    impl Oscillator {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * q.x.dt().powi(2)
        }
        #[potential]
        fn potential(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.k * q.x.powi(2)
        }
        #[drawing]
        fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
            #[cfg(not(test))]
            let q = None;
            Drawing::new().dot(vec2(q.x, 0.0))
        }
    }

    #[dynamics]
    #[cfg(not(test))]
    impl Oscillator {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            7.0 * self.m * q.x.dt().powi(2)
        }
    }

    #[test]
    fn what_is_switched_on_is_derived() {
        let model = Oscillator { m: 1.0, k: 4.0 };
        let state = model.state().x(0.5).build().expect("a finite state");
        assert!((model.accelerations(&state).expect("inertia")[0] + 2.0).abs() < 1e-15);
    }
}

mod names;
