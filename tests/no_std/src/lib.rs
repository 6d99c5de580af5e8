//! A driven double pendulum and a bob held by a constraint on firmware: no standard library, no allocator.
//!
//! The library is what a firmware author writes. The program beside it (`main.rs`) links it with a panic
//! handler and nothing else: had anything below asked for an allocator or for `std`, it would not link.
#![no_std]
#![forbid(unsafe_code)]

use dynamics::SmoothFunction;
use dynamics::constrain::{project_positions, project_velocities, solve_general, solve_once, with_workspace};
use dynamics::error::{SingularMassMatrix, SolveError};
use dynamics::integrate::{
    Accelerations, AdamsBashforth, Canonical, Composition4, Composition6, Composition8, Dop853,
    DormandPrince5, EnergyMidpoint, Esdirk4, Expandable, ExplicitEuler, Gauss4, Gauss6, GeneralizedAlpha,
    GraggBulirschStoer, Heun, Phase, ProjectedEnd, Radau5, Rattle, Rk4, Scheme, SemiImplicitEuler,
    Stabilized, StepOptions, Stepper, StormerVerlet, Switching, Taylor, Tolerances, Tsit5, Verner9,
};
use dynamics::model::Model;
use dynamics::prelude::*;

/// A stop that the author knows in closed form: its energy s(θ) = 1 − cos θ, in J.
#[derive(Clone, Debug)]
pub struct Stop;

impl SmoothFunction for Stop {
    fn derivatives(&self, x: f64) -> [f64; 4] {
        let (sin, cos) = x.sin_cos();
        [1.0 - cos, sin, cos, -sin]
    }
}

/// Two bobs on massless rods; a motor turns the first rod.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta1: rad, theta2: rad)]
#[inputs(torque: N * m)]
#[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
pub struct DoublePendulum {
    /// Mass of the first bob.
    pub m1: f64,
    /// Mass of the second bob.
    pub m2: f64,
    /// Length of the first rod.
    pub l1: f64,
    /// Length of the second rod.
    pub l2: f64,
    /// Acceleration of gravity.
    pub g: f64,
    /// Energy of a spring between the rods.
    pub stop: Stop,
}

#[dynamics]
impl DoublePendulum {
    fn bob1(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l1 * vec2(q.theta1.sin(), -q.theta1.cos())
    }
    fn bob2(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 * self.bob2(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
    }
    #[potential]
    fn spring(&self, q: &Coordinates<Self>) -> Expr {
        self.stop.at(q.theta2 - q.theta1)
    }
    #[force]
    fn motor(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.theta1, q.torque)
    }
    #[output]
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bob2(q)
    }
    /// Frequency of the first rod alone: a function of parameters, by the methods of `f64`.
    fn frequency(&self) -> f64 {
        (self.g / self.l1).sqrt()
    }
}

type Vector = <DoublePendulum as Model>::Vector;
type Inputs = <DoublePendulum as Model>::Inputs;

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Failure {
    /// The model or its start was refused.
    Refused,
    /// The integration stopped.
    Step,
    /// Energy that nothing accounts for, relative to the energy of the motion.
    Energy(f64),
    /// The derived model and its own functions differ by this much.
    Difference(f64),
    /// A model without inertia was accepted.
    Singular,
}

/// The pendulum of all checks.
pub fn pendulum() -> DoublePendulum {
    DoublePendulum { m1: 2.0, m2: 1.0, l1: 0.5, l2: 0.4, g: 9.81, stop: Stop }
}

/// Swings freely with step control, by explicit methods and by an implicit one: energy is conserved.
pub fn swing(model: &DoublePendulum) -> Result<(), Failure> {
    swing_by::<Dop853<Vector>>(model, 10.0)?;
    swing_by::<Verner9<Vector>>(model, 10.0)?;
    swing_by::<GraggBulirschStoer<Vector>>(model, 10.0)?;
    swing_by::<Tsit5<Vector>>(model, 1.0)?;
    swing_by::<DormandPrince5<Vector>>(model, 1.0)?;
    swing_by::<Radau5<Vector>>(model, 1.0)
}

/// The same by a method for few digits.
pub fn swing_roughly(model: &DoublePendulum) -> Result<(), Failure> {
    swing_with::<Esdirk4<Vector>>(model, 1.0, 1e-6, 1e-4)
}

fn swing_by<S: Scheme<Vector>>(model: &DoublePendulum, end: f64) -> Result<(), Failure> {
    swing_with::<S>(model, end, 1e-12, 1e-9)
}

fn swing_with<S: Scheme<Vector>>(
    model: &DoublePendulum,
    end: f64,
    tolerance: f64,
    most: f64,
) -> Result<(), Failure> {
    let start =
        model.state().theta1(2.0).theta2_rate(1.0).torque(0.0).build().map_err(|_| Failure::Refused)?;
    let constants = model.constants().map_err(|_| Failure::Refused)?;
    let mut equation = |t: f64, q: &Vector, u: &Vector| {
        model.accelerations_with(&constants, &State::<DoublePendulum>::new(t, *q, *u, start.inputs))
    };
    let phase = Phase { q: start.q, u: start.u };
    let options = StepOptions {
        tolerances: Tolerances::both(tolerance),
        fixed: None,
        first: None,
        most: f64::INFINITY,
    };
    let mut stepper: Stepper<Vector, S> =
        Stepper::new(&mut equation, 0.0, phase, end, options).map_err(|_| Failure::Step)?;
    let energy = model.energy_function(&start);
    while stepper.now().t < end {
        stepper.step(&mut equation, end).map_err(|_| Failure::Step)?;
        let now = stepper.now();
        let state = State::<DoublePendulum>::new(now.t, now.y.q, now.y.u, start.inputs);
        let drift = (model.energy_function(&state) - energy) / energy;
        if drift.is_nan() || drift.abs() > most {
            return Err(Failure::Energy(drift));
        }
    }
    Ok(())
}

/// The pendulum with its canonical variables and its energy, as methods that preserve them ask for.
struct Hamiltonian<'m> {
    model: &'m DoublePendulum,
    constants: <DoublePendulum as Dynamics>::Constants,
    inputs: Inputs,
}

impl Hamiltonian<'_> {
    fn state(&self, t: f64, q: &Vector, u: &Vector) -> State<DoublePendulum> {
        State::<DoublePendulum>::new(t, *q, *u, self.inputs)
    }
}

impl Accelerations<Vector> for Hamiltonian<'_> {
    type Error = SolveError;
    fn accelerations(&mut self, t: f64, q: &Vector, u: &Vector) -> Result<Vector, SolveError> {
        self.model.accelerations_with(&self.constants, &self.state(t, q, u))
    }
}

impl Stabilized<Vector> for Hamiltonian<'_> {}

impl Switching<Vector> for Hamiltonian<'_> {}

impl Canonical<Vector> for Hamiltonian<'_> {
    fn momenta(
        &mut self,
        t: f64,
        y: &Phase<Vector>,
        p: &mut Vector,
        rate: &mut Vector,
    ) -> Result<bool, SolveError> {
        let state = self.state(t, &y.q, &y.u);
        let Some(found) = self.model.momentum_rates(&state) else { return Ok(false) };
        (*p, *rate) = (self.model.momenta(&state), found);
        Ok(true)
    }
    fn mass_matrix(&mut self, t: f64, q: &Vector, mass: &mut [f64]) -> Result<(), SolveError> {
        let found = self.model.mass_matrix(&self.state(t, q, &Vector::zeros()));
        mass.iter_mut().enumerate().for_each(|(i, element)| *element = found[(i / 2, i % 2)]);
        Ok(())
    }
    fn energy(&mut self, t: f64, y: &Phase<Vector>) -> Option<f64> {
        Some(self.model.energy_function(&self.state(t, &y.q, &y.u)))
    }
}

impl Expandable<Vector> for Hamiltonian<'_> {}

/// Swings for 5 s with fixed steps, by all that have one: the energy stays within what their order permits.
pub fn swing_evenly(model: &DoublePendulum) -> Result<(), Failure> {
    evenly::<SemiImplicitEuler<Vector>>(model, 1e-4, 2e-2)?;
    evenly::<StormerVerlet<Vector>>(model, 1e-3, 1e-3)?;
    evenly::<Rattle<Vector>>(model, 1e-3, 1e-3)?;
    evenly::<Composition4<Vector>>(model, 5e-3, 1e-4)?;
    evenly::<Composition6<Vector>>(model, 5e-3, 1e-4)?;
    evenly::<Composition8<Vector>>(model, 5e-3, 1e-4)?;
    evenly::<GeneralizedAlpha<Vector>>(model, 1e-3, 1e-3)?;
    evenly::<Gauss4<Vector>>(model, 5e-3, 1e-5)?;
    evenly::<Gauss6<Vector>>(model, 5e-3, 1e-7)?;
    evenly::<ExplicitEuler<Vector>>(model, 1e-4, 2e-2)?;
    evenly::<Heun<Vector>>(model, 1e-3, 1e-3)?;
    evenly::<AdamsBashforth<Vector, 2>>(model, 1e-3, 1e-3)?;
    evenly::<AdamsBashforth<Vector, 3>>(model, 1e-3, 1e-5)?;
    evenly::<AdamsBashforth<Vector, 4>>(model, 1e-3, 1e-6)?;
    evenly::<EnergyMidpoint<Vector>>(model, 5e-3, 1e-11)
}

fn evenly<S: Scheme<Vector>>(model: &DoublePendulum, h: f64, permitted: f64) -> Result<(), Failure> {
    const END: f64 = 5.0;
    let start =
        model.state().theta1(1.0).theta2_rate(1.0).torque(0.0).build().map_err(|_| Failure::Refused)?;
    let constants = model.constants().map_err(|_| Failure::Refused)?;
    let mut system = Hamiltonian { model, constants, inputs: start.inputs };
    let options = StepOptions { tolerances: Tolerances::both(1e-9), fixed: Some(h), first: None, most: h };
    let phase = Phase { q: start.q, u: start.u };
    let mut stepper: Stepper<Vector, S> =
        Stepper::new(&mut system, 0.0, phase, END, options).map_err(|_| Failure::Step)?;
    let energy = model.energy_function(&start);
    while stepper.now().t < END {
        stepper.step(&mut system, END).map_err(|_| Failure::Step)?;
        let now = stepper.now();
        let drift = (model.energy_function(&system.state(now.t, &now.y.q, &now.y.u)) - energy) / energy;
        if drift.is_nan() || drift.abs() > permitted {
            return Err(Failure::Energy(drift));
        }
    }
    Ok(())
}

/// A control loop of 1 kHz that holds its torque from sample to sample: what the motor gives, torque·Δθ₁, is
/// what the energy gains.
pub fn control(model: &DoublePendulum) -> Result<(), Failure> {
    const H: f64 = 1e-3;
    let constants = model.constants().map_err(|_| Failure::Refused)?;
    let mut state = model.state().theta1(0.3).torque(0.0).build().map_err(|_| Failure::Refused)?;
    let gain = model.frequency();
    let (mut work, start) = (0.0, model.energy_function(&state));
    let options = StepOptions { tolerances: Tolerances::both(1e-9), fixed: Some(H), first: None, most: H };
    for sample in 0..5000 {
        let t = H * f64::from(sample);
        state.inputs[0] = 4.0 * gain * ((2.0 * t).sin() - state.theta1()) - 0.5 * state.theta1_rate();
        let inputs: Inputs = state.inputs;
        let mut equation = |t: f64, q: &Vector, u: &Vector| {
            model.accelerations_with(&constants, &State::<DoublePendulum>::new(t, *q, *u, inputs))
        };
        let phase = Phase { q: state.q, u: state.u };
        let mut stepper: Stepper<Vector, Rk4<Vector>> =
            Stepper::new(&mut equation, t, phase, t + H, options).map_err(|_| Failure::Step)?;
        stepper.step(&mut equation, t + H).map_err(|_| Failure::Step)?;
        let end = stepper.now();
        work += inputs[0] * (end.y.q[0] - state.q[0]);
        state = State::<DoublePendulum>::new(end.t, end.y.q, end.y.u, inputs);
    }
    let missing = (model.energy_function(&state) - start - work) / start;
    if missing.abs() < 1e-9 { Ok(()) } else { Err(Failure::Energy(missing)) }
}

/// The derived quantities against the model's own functions on time jets, and a model without inertia.
pub fn agreement(model: &DoublePendulum) -> Result<(), Failure> {
    let built = model.state().theta1(0.7).theta2(-0.4).theta1_rate(1.5).theta2_rate(-2.0).torque(0.3).build();
    let state = built.map_err(|_| Failure::Refused)?;
    let accelerations = model.accelerations(&state).map_err(|_| Failure::Refused)?;
    let q = DoublePendulum::coordinates_with(&state, &accelerations, &[]);
    let mut tip = [0.0; DoublePendulum::OUTPUTS.len()];
    model.outputs(&state, &mut tip).map_err(|_| Failure::Refused)?;
    let energy = model.kinetic(&q) + model.gravity(&q) + model.spring(&q);
    for difference in [
        model.kinetic_energy(&state) - model.kinetic(&q).value(),
        model.energy_function(&state) - energy.value(),
        // dE/dt is the power of the motor.
        energy.rate() - model.motor(&q).power(),
        tip[0] - model.tip(&q).x.value(),
        tip[1] - model.tip(&q).y.value(),
    ] {
        if difference.is_nan() || difference.abs() > 1e-12 {
            return Err(Failure::Difference(difference));
        }
    }
    let massless = DoublePendulum { m2: 0.0, ..model.clone() };
    match massless.accelerations(&state) {
        Err(SolveError::SingularMassMatrix(SingularMassMatrix { name: "theta2", .. })) => Ok(()),
        _ => Err(Failure::Singular),
    }
}

/// A bob on a rod, in Cartesian coordinates.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, l: m, g: m / s^2)]
pub struct Bob {
    /// Mass.
    pub m: f64,
    /// Length of the rod.
    pub l: f64,
    /// Acceleration of gravity.
    pub g: f64,
}

#[dynamics]
impl Bob {
    fn place(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.place(q).norm() - self.l
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -q.reaction(Self::rod)
    }
}

/// Assembles a start, swings for 5 s with projection after every step, and knows the tension of the rod all
/// the way.
pub fn hold() -> Result<(), Failure> {
    const H: f64 = 1e-3;
    let model = Bob { m: 2.0, l: 0.5, g: 9.81 };
    let refused = |_| Failure::Refused;
    let constants = model.constants().map_err(|_| Failure::Refused)?;
    let start = model.state().x(0.3).y_guess(-1.0).x_rate(0.4).assemble().map_err(|_| Failure::Refused)?;
    let (mut state, energy) = (start, model.energy_function(&start));
    let options = StepOptions { tolerances: Tolerances::both(1e-9), fixed: Some(H), first: None, most: H };
    for _ in 0..5000 {
        let mut equation = |t: f64, q: &<Bob as Model>::Vector, u: &<Bob as Model>::Vector| {
            model.accelerations_with(&constants, &State::<Bob>::new(t, *q, *u, start.inputs))
        };
        let (t, phase) = (state.t, Phase { q: state.q, u: state.u });
        let mut stepper: Stepper<<Bob as Model>::Vector, Rk4<<Bob as Model>::Vector>> =
            Stepper::new(&mut equation, t, phase, t + H, options).map_err(|_| Failure::Step)?;
        stepper.step(&mut equation, t + H).map_err(|_| Failure::Step)?;
        let end = stepper.now();
        state = State::<Bob>::new(end.t, end.y.q, end.y.u, start.inputs);
        with_workspace::<Bob, _>(|workspace| {
            project_positions(&model, &constants, &mut state, workspace)?;
            project_velocities(&model, &constants, &mut state, workspace)
        })
        .map_err(refused)?;
        // T = m (g cos θ + l θ̇²), also by the general solver.
        let by_hand = model.m * (model.g * -state.y() / model.l + state.u.dot(&state.u) / model.l);
        let mut tension = [0.0];
        model.outputs(&state, &mut tension).map_err(refused)?;
        let general = with_workspace::<Bob, _>(|workspace| solve_general(&model, &state, workspace))
            .map_err(refused)?;
        let unrolled = solve_once(&model, &constants, &state).map_err(refused)?;
        for difference in [
            tension[0] - by_hand,
            general.multipliers[0] + by_hand,
            (general.accelerations - unrolled.accelerations).norm(),
            model.residual(&state)[0],
            model.velocity_residual(&state)[0],
        ] {
            if difference.is_nan() || difference.abs() > 1e-11 {
                return Err(Failure::Difference(difference));
            }
        }
    }
    let drift = (model.energy_function(&state) - energy) / energy;
    if drift.abs() < 1e-9 { Ok(()) } else { Err(Failure::Energy(drift)) }
}

type Place = <Bob as Model>::Vector;

/// The bob as Taylor series see it: coefficients from the model's own code, ends of steps put onto the
/// constraint.
struct Expanded<'m> {
    model: &'m Bob,
    constants: <Bob as Dynamics>::Constants,
    inputs: <Bob as Model>::Inputs,
    memory: <Bob as Dynamics>::Series,
}

impl Expanded<'_> {
    fn state(&self, t: f64, q: &Place, u: &Place) -> State<Bob> {
        State::<Bob>::new(t, *q, *u, self.inputs)
    }
}

impl Accelerations<Place> for Expanded<'_> {
    type Error = SolveError;
    fn accelerations(&mut self, t: f64, q: &Place, u: &Place) -> Result<Place, SolveError> {
        self.model.accelerations_with(&self.constants, &self.state(t, q, u))
    }
}

impl Stabilized<Place> for Expanded<'_> {
    fn needs_projection(&self) -> bool {
        true
    }
    fn project(
        &mut self,
        t: f64,
        y: &mut Phase<Place>,
        tolerances: &Tolerances,
    ) -> Result<Option<ProjectedEnd>, SolveError> {
        let mut state = self.state(t, &y.q, &y.u);
        with_workspace::<Bob, _>(|workspace| {
            project_positions(self.model, &self.constants, &mut state, workspace)?;
            project_velocities(self.model, &self.constants, &mut state, workspace)
        })?;
        let by = (state.q - y.q).norm().max((state.u - y.u).norm()) / tolerances.absolute;
        *y = Phase { q: state.q, u: state.u };
        Ok(Some(ProjectedEnd { by, violation: by, noise: 0.0 }))
    }
}

impl Switching<Place> for Expanded<'_> {}

impl Canonical<Place> for Expanded<'_> {}

impl Expandable<Place> for Expanded<'_> {
    fn series(
        &mut self,
        t: f64,
        y: &Phase<Place>,
        a: &Place,
        scale: f64,
        q: &mut [Place],
        u: &mut [Place],
    ) -> Result<bool, SolveError> {
        Ok(self.model.series(&self.constants, &self.state(t, &y.q, &y.u), a, scale, [q, u], &mut self.memory))
    }
}

/// Swings by Taylor series that satisfy the constraint in every coefficient: energy and rod are kept to
/// rounding.
pub fn expand() -> Result<(), Failure> {
    let model = Bob { m: 2.0, l: 0.5, g: 9.81 };
    let start = model.state().x(0.3).y_guess(-1.0).x_rate(0.4).assemble().map_err(|_| Failure::Refused)?;
    let constants = model.constants().map_err(|_| Failure::Refused)?;
    let mut system = Expanded { model: &model, constants, inputs: start.inputs, memory: Default::default() };
    let options =
        StepOptions { tolerances: Tolerances::both(1e-14), fixed: None, first: None, most: f64::INFINITY };
    let phase = Phase { q: start.q, u: start.u };
    let mut stepper: Stepper<Place, Taylor<Place>> =
        Stepper::new(&mut system, 0.0, phase, 20.0, options).map_err(|_| Failure::Step)?;
    let energy = model.energy_function(&start);
    while stepper.now().t < 20.0 {
        stepper.step(&mut system, 20.0).map_err(|_| Failure::Step)?;
        let now = stepper.now();
        let state = system.state(now.t, &now.y.q, &now.y.u);
        let drift = (model.energy_function(&state) - energy) / energy;
        if drift.is_nan() || drift.abs() > 1e-13 {
            return Err(Failure::Energy(drift));
        }
        let off = model.residual(&state)[0].abs().max(model.velocity_residual(&state)[0].abs());
        if off.is_nan() || off > 1e-15 {
            return Err(Failure::Difference(off));
        }
    }
    Ok(())
}
