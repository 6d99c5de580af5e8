//! The procedural macros of `dynamics`; use them through that crate.
//!
//! `src/tests/` is compiled by `tests/quick/macros/`: tests inside of a crate of macros would be built with
//! all their dependencies for the compiler's side, a second time.

mod assertions;
mod compile;
mod diagnostics;
mod elaborate;
mod emit;
mod expand;
mod library;
mod messages;
mod suggest;
mod syntax;

use proc_macro::TokenStream;

/// Makes a struct a mechanical model. Its fields are the parameters: `f64`, arrays, vectors, matrices, or
/// smooth functions of one variable. `#[dynamics]` on an `impl` block gives the energies, forces and
/// constraints.
///
/// | attribute of the struct | meaning |
/// |---|---|
/// | `#[coordinates(x: m, theta: [rad; 5])]` | generalized coordinates, scalars or arrays, with units |
/// | `#[inputs(drive: N)]` | quantities from outside, such as an actuator force: `q.drive` |
/// | `#[speeds(omega: [rad / s; 3])]` | generalized speeds, each defined by a function with `#[kinematic]` |
/// | `#[units(mass: kg, power: W)]` | units of parameters and outputs; one is enough for all to be checked |
/// | `#[nominal(length = 1.0)]` | parameter values for the compile-time checks alone |
/// | `#[model(crate = path)]` | the crate `dynamics` has another name in this program |
/// | `#[model(sin_cos = accurate)]` | the sines and cosines of the standard library |
/// | `#[model(targets(c))]` | the programs are printed in C99, too, for `model.write_c(folder)` |
/// | `#[model(targets(wgsl))]` | the accelerations are printed in WGSL, too, for runs on graphics cards |
///
/// ```
/// # use dynamics::prelude::*;
/// #[derive(Clone, Debug, Dynamics)]
/// #[coordinates(x: m)]
/// #[units(mass: kg)]
/// struct Particle {
///     mass: f64,
/// }
/// # #[dynamics]
/// # impl Particle {
/// #     #[kinetic]
/// #     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
/// #         0.5 * self.mass * q.x.dt().powi(2)
/// #     }
/// # }
/// ```
#[proc_macro_derive(Dynamics, attributes(coordinates, speeds, inputs, units, nominal, model))]
pub fn derive_dynamics(item: TokenStream) -> TokenStream {
    let here = proc_macro::Span::call_site();
    expand::derive_once(item.into(), [here.line(), here.column()]).into()
}

/// Derives the equations of motion from one `impl` block of a model. Each function has a role (`#[kinetic]`,
/// `#[potential]`, `#[force]`, `#[holonomic]`, ..) or is a helper that others call. Functions with a role
/// have the signature `fn name(&self, q: &Coordinates<Self>) -> ..`. There, `q.x` is a coordinate or an
/// input, `q.t` the time, and `.dt()` the total time derivative. All mistakes are compile errors on your
/// words.
///
/// ```
/// # use dynamics::prelude::*;
/// # #[derive(Debug, Dynamics)]
/// # #[coordinates(x: m)]
/// # #[units(mass: kg, stiffness: N / m)]
/// # struct Oscillator { mass: f64, stiffness: f64 }
/// #[dynamics]
/// impl Oscillator {
///     #[kinetic]
///     fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
///         0.5 * self.mass * q.x.dt().powi(2)
///     }
///     #[potential]
///     fn spring(&self, q: &Coordinates<Self>) -> Expr {
///         0.5 * self.stiffness * q.x.powi(2)
///     }
/// }
/// assert!(Oscillator::EQUATIONS.contains("mass x'' = -stiffness x"));
/// ```
#[proc_macro_attribute]
pub fn dynamics(arguments: TokenStream, item: TokenStream) -> TokenStream {
    let here = proc_macro::Span::call_site();
    expand::attribute(arguments.into(), item.into(), [here.line(), here.column()]).into()
}

/// Roles of functions. `#[dynamics]` reads and removes them before they run. They exist so that rustc knows
/// their names if `#[dynamics]` is missing: the derive then reports that one attribute.
macro_rules! roles {
    ($($(#[$text:meta])* $role:ident)*) => {
        $(
            $(#[$text])*
            #[proc_macro_attribute]
            pub fn $role(_: TokenStream, item: TokenStream) -> TokenStream {
                expand::role(stringify!($role), item.into()).into()
            }
        )*
    };
}

roles! {
    /// Kinetic energy T in a unit of energy (J). T is the sum of all functions with this role. It is
    /// quadratic in the velocities. Parts that are linear or constant in them, as of moving frames, may be
    /// included.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m, y: m)]
    /// # #[units(mass: kg)]
    /// # struct Particle { mass: f64 }
    /// # #[dynamics] impl Particle {
    /// #[kinetic]
    /// fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    ///     0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    /// }
    /// # }
    /// ```
    kinetic
    /// Potential energy V in a unit of energy (J). V is the sum of all functions with this role. The
    /// generalized force is −∂V/∂q, so a weight has V = m g · height. V may depend on coordinates and time.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(height: m)]
    /// # #[units(mass: kg, g: m / s^2)]
    /// # struct Ball { mass: f64, g: f64 }
    /// # #[dynamics] impl Ball {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * q.height.dt().powi(2)
    /// # }
    /// #[potential]
    /// fn weight(&self, q: &Coordinates<Self>) -> Expr {
    ///     self.mass * self.g * q.height
    /// }
    /// # }
    /// ```
    potential
    /// The Lagrangian L as a whole, in a unit of energy (J), for models where T − V is not the natural form.
    /// It replaces `#[kinetic]` and `#[potential]`; a model has either L or these two. Several functions are
    /// added.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m, y: m)]
    /// # #[units(mass: kg, charge: C, field: T)]
    /// # struct Ion { mass: f64, charge: f64, field: f64 }
    /// # #[dynamics] impl Ion {
    /// /// A charge in a uniform magnetic field.
    /// #[lagrangian]
    /// fn lagrangian(&self, q: &Coordinates<Self>) -> Expr {
    ///     let (place, velocity) = (vec2(q.x, q.y), vec2(q.x, q.y).dt());
    ///     0.5 * self.mass * velocity.norm_squared() + 0.5 * self.charge * self.field * place.cross(velocity)
    /// }
    /// # }
    /// ```
    lagrangian
    /// Rayleigh's dissipation function D in a unit of power (W). The generalized force is −∂D/∂q̇: a positive
    /// D takes energy from the motion. A linear damper has D = ½ c v². D is the sum of all functions with
    /// this role.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m)]
    /// # #[units(mass: kg, damping: N * s / m)]
    /// # struct Slider { mass: f64, damping: f64 }
    /// # #[dynamics] impl Slider {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * q.x.dt().powi(2)
    /// # }
    /// #[dissipation]
    /// fn damper(&self, q: &Coordinates<Self>) -> Expr {
    ///     0.5 * self.damping * q.x.dt().powi(2)
    /// }
    /// # }
    /// ```
    dissipation
    /// Applied forces, as `Force`. `Force::along(e, f)` has the power f · ė: it is positive toward growing e,
    /// and is a torque if e is an angle. `Force::at(point, vector)` acts at a point. Forces may depend on
    /// coordinates, velocities, time, inputs, and, for friction, on reactions.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m)]
    /// # #[inputs(drive: N)]
    /// # #[units(mass: kg, drag: N * s^2 / m^2)]
    /// # struct Cart { mass: f64, drag: f64 }
    /// # #[dynamics] impl Cart {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * q.x.dt().powi(2)
    /// # }
    /// #[force]
    /// fn motor_and_air(&self, q: &Coordinates<Self>) -> Force {
    ///     let speed = q.x.dt();
    ///     Force::along(q.x, q.drive) + Force::along(q.x, -self.drag * speed * speed.abs())
    /// }
    /// # }
    /// ```
    force
    /// A constraint on positions: each component of the result is zero on every motion. It returns `Expr`, a
    /// vector, or an array of them, and may contain coordinates and time, but no velocities and no inputs.
    /// Its reaction is Φ_qᵀ λ; λ times the unit of the component is an energy. `#[holonomic(switched)]` can
    /// be released and engaged while the model runs.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m, y: m)]
    /// # #[units(mass: kg, length: m)]
    /// # struct Pendulum { mass: f64, length: f64 }
    /// # #[dynamics] impl Pendulum {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    /// # }
    /// /// λ is the force along the rod, positive if it pushes the bob outward.
    /// #[holonomic]
    /// fn rod(&self, q: &Coordinates<Self>) -> Expr {
    ///     vec2(q.x, q.y).norm() - self.length
    /// }
    /// # }
    /// ```
    holonomic
    /// A constraint on velocities: each component of the result is zero on every motion and linear in the
    /// velocities, A(q, t) q̇ + b(q, t) = 0. It returns `Expr`, a vector, or an array of them. Options:
    /// `(switched)` can be released and engaged while the model runs; `(integrable)` is the time derivative
    /// of a position, and you mean it.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m, y: m, phi: rad)]
    /// # #[units(mass: kg, inertia: kg * m^2)]
    /// # struct Skate { mass: f64, inertia: f64 }
    /// # #[dynamics] impl Skate {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     let (v, w) = (vec2(q.x, q.y).dt(), q.phi.dt());
    /// #     0.5 * self.mass * v.norm_squared() + 0.5 * self.inertia * w.powi(2)
    /// # }
    /// /// The blade does not slip sideways.
    /// #[nonholonomic]
    /// fn blade(&self, q: &Coordinates<Self>) -> Expr {
    ///     q.y.dt() * q.phi.cos() - q.x.dt() * q.phi.sin()
    /// }
    /// # }
    /// ```
    nonholonomic
    /// Stands beside `#[holonomic]` or `#[nonholonomic]`. It says that the constraint repeats others, and
    /// that you mean it. Without this mark a repeated constraint is a compile error. The motion does not
    /// change; reactions that are not unique are reported as such.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m, y: m)]
    /// # #[units(mass: kg)]
    /// # struct Slider { mass: f64 }
    /// # #[dynamics] impl Slider {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
    /// # }
    /// #[holonomic]
    /// fn guide(&self, q: &Coordinates<Self>) -> Expr {
    ///     q.y
    /// }
    /// #[holonomic]
    /// #[redundant]
    /// fn second_guide(&self, q: &Coordinates<Self>) -> Expr {
    ///     q.y
    /// }
    /// # }
    /// ```
    redundant
    /// Defines the generalized speed of the function's name, which `#[speeds(..)]` declares: w = Y(q, t) q̇ +
    /// y(q, t), linear in the velocities. It returns `Expr`, a vector or an array, as declared. The speeds
    /// must determine all rates of the coordinates.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(angles: [rad; 3])]
    /// # #[speeds(omega: [rad / s; 3])]
    /// # #[units(inertia: kg * m^2)]
    /// # struct Body { inertia: [f64; 3] }
    /// # #[dynamics] impl Body {
    /// #[kinematic]
    /// fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
    ///     Mat3::euler(EulerSequence::Zxz, q.angles).angular_velocity_in_body()
    /// }
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     let (w, [a, b, c]) = (self.omega(q), self.inertia);
    /// #     0.5 * (a * w.x * w.x + b * w.y * w.y + c * w.z * w.z)
    /// # }
    /// # }
    /// ```
    kinematic
    /// A named result: `Expr`, a vector, or an array of them. It may use accelerations (`.dt().dt()`),
    /// reactions and inputs. Its unit is inferred, or given in `#[units(..)]` by the function's name.
    /// `motion.output("pull", t)` reads it; an output that is not read costs nothing.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(x: m)]
    /// # #[units(mass: kg, g: m / s^2)]
    /// # struct Load { mass: f64, g: f64 }
    /// # #[dynamics] impl Load {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * q.x.dt().powi(2)
    /// # }
    /// /// The force in the rope that carries the load.
    /// #[output]
    /// fn pull(&self, q: &Coordinates<Self>) -> Expr {
    ///     self.mass * (self.g + q.x.dt().dt())
    /// }
    /// # }
    /// ```
    output
    /// A value whose zero crossings are located during a run, as `Expr`. Every motion lists them in
    /// `motion.events()`. A run can stop there (`.stop_at("floor", Direction::Falling)`) or change its state
    /// (`.on_event(..)`).
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(height: m)]
    /// # #[units(mass: kg)]
    /// # struct Ball { mass: f64 }
    /// # #[dynamics] impl Ball {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * q.height.dt().powi(2)
    /// # }
    /// #[event]
    /// fn floor(&self, q: &Coordinates<Self>) -> Expr {
    ///     q.height
    /// }
    /// # }
    /// ```
    event
    /// The picture of one instant, as `Drawing`. Animations show it over time. Lengths are those of the
    /// model. A model has at most one function with this role, and its body may contain any Rust.
    ///
    /// ```
    /// # use dynamics::prelude::*;
    /// # #[derive(Debug, Dynamics)]
    /// # #[coordinates(theta: rad)]
    /// # #[units(mass: kg, length: m)]
    /// # struct Pendulum { mass: f64, length: f64 }
    /// # #[dynamics] impl Pendulum {
    /// # #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
    /// #     0.5 * self.mass * (self.length * q.theta.dt()).powi(2)
    /// # }
    /// #[drawing]
    /// fn picture(&self, q: &Coordinates<Self>) -> Drawing {
    ///     let bob = self.length * vec2(q.theta.sin(), -q.theta.cos());
    ///     Drawing::new().pivot([0.0, 0.0]).line([0.0, 0.0], bob).disc(bob, 0.1)
    /// }
    /// # }
    /// ```
    drawing
}

/// Where the struct's tokens and the impl's meet; called by generated code alone.
#[doc(hidden)]
#[proc_macro]
pub fn __model(input: TokenStream) -> TokenStream {
    expand::model(input.into()).into()
}
