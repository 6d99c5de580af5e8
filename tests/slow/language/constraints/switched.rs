//! Switched constraints: what is released, to which side, and friction by the reactions of the rest.

use super::*;

/// A block on an incline, which sticks, slides or flies; dry friction of the reaction of the same instant.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(m: kg, g: m / s^2)]
pub struct Block {
    pub m: f64,
    pub g: f64,
    pub slope: f64,
    pub friction: f64,
}

#[dynamics]
impl Block {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (q.y * self.slope.cos() - q.x * self.slope.sin())
    }
    #[holonomic(switched)]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[nonholonomic(switched, integrable)]
    fn stick(&self, q: &Coordinates<Self>) -> Expr {
        q.x.dt()
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, -self.friction * q.reaction(Self::floor) * q.slip(Self::stick))
    }
    #[output]
    fn normal(&self, q: &Coordinates<Self>) -> Expr {
        q.reaction(Self::floor)
    }
    #[output]
    fn side(&self, q: &Coordinates<Self>) -> Expr {
        q.slip(Self::stick)
    }
    #[event]
    fn breakaway(&self, q: &Coordinates<Self>) -> Expr {
        self.friction * q.reaction(Self::floor) - q.reaction(Self::stick).abs()
    }
}

/// q̈, outputs and the event.
fn evaluated(model: &Block, state: &BlockState) -> (f64, f64, [f64; 2], f64) {
    let (mut outputs, mut events) = ([f64::NAN; 2], [f64::NAN]);
    model.outputs(state, &mut outputs).unwrap();
    model.events(state, &mut events).unwrap();
    let a = model.accelerations(state).unwrap();
    (a[0], a[1], outputs, events[0])
}

#[test]
fn a_block_sticks_and_flies() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let (s, c) = model.slope.sin_cos();
    let normal = model.m * model.g * c;
    const { assert!(Block::FRICTION) };
    assert_eq!(Block::ROWS.iter().map(|r| r.unit).collect::<Vec<_>>(), ["m", "m/s"]);

    let sticking = model.state().build().unwrap();
    let (ax, ay, [n, side], breakaway) = evaluated(&model, &sticking);
    near(ax, 0.0, 1.0, "it sticks");
    near(ay, 0.0, 1.0, "it stays on the floor");
    near(n, normal, 1.0, "normal force");
    near(breakaway, model.friction * normal - model.m * model.g * s, 1.0, "friction that is left");
    assert_eq!(side, 0.0);

    let flying = model.state().y(1.0).release("floor").release("stick").build().unwrap();
    let (ax, ay, [n, _], _) = evaluated(&model, &flying);
    near(ax, model.g * s, 1.0, "it falls");
    near(ay, -model.g * c, 1.0, "it falls");
    assert_eq!(n, 0.0);
}

#[test]
fn a_block_slides() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let (s, c) = model.slope.sin_cos();
    let normal = model.m * model.g * c;
    for (u, side) in [(0.5, 1.0), (-0.5, -1.0)] {
        let mut sliding = model.state().build().unwrap();
        sliding.active_set_mut().release(1, side);
        sliding.set_x_rate(u);
        let (ax, ay, outputs, _) = evaluated(&model, &sliding);
        near(ax, model.g * (s - side * model.friction * c), 1.0, "it slides");
        near(ay, 0.0, 1.0, "it stays on the floor");
        assert_eq!(outputs[1], side);
        let q = Block::coordinates_with(&sliding, &Vector::zeros(), &[normal, 0.0]);
        assert_eq!(q.slip(Block::stick).value(), side);
        assert_eq!(q.reaction(Block::floor).value(), normal);
        assert_eq!(q.slip(Block::floor).value(), 0.0);
        // No constraint, and reactions that are not at hand, are not numbers.
        assert!(q.reaction(Block::gravity).value().is_nan() && q.slip(Block::gravity).value().is_nan());
        let unsolved = Block::coordinates_with(&sliding, &Vector::zeros(), &[]);
        assert!(unsolved.reaction(Block::floor).value().is_nan());
        // Powers: gravity is in the energy, friction takes away.
        let mut powers = [f64::NAN; 1];
        model.powers(&sliding, &mut powers);
        near(powers[0], -side * model.friction * normal * u, 1.0, "power of friction");
    }
}

#[test]
fn forces_that_depend_on_reactions_come_with_their_derivative() {
    let model = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let mut state = model.state().build().unwrap();
    state.active_set_mut().release(1, 1.0);
    let lambda = nalgebra::Vector2::new(7.0, 3.0);
    let (mut force, mut by) = ([f64::NAN; 2], [f64::NAN; 4]);
    model.friction(&state, &lambda, &mut force, &mut by);
    let weight = model.m * model.g;
    near(force[0], weight * model.slope.sin() - model.friction * 7.0, 1.0, "Q₁(λ)");
    near(force[1], -weight * model.slope.cos(), 1.0, "Q₂(λ)");
    assert_eq!(by, [-model.friction, 0.0, 0.0, 0.0]);
    let (mut mass, mut jacobian, mut gamma) = ([0.0; 4], [0.0; 4], [0.0; 2]);
    model.terms(
        &state,
        &mut Terms { mass: &mut mass, force: &mut force, jacobian: &mut jacobian, gamma: &mut gamma },
    );
    near(force[0], weight * model.slope.sin(), 1.0, "without reactions");
}

/// A bead on a wire that lets go.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
pub struct Bead {
    pub m: f64,
    pub g: f64,
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
    fn wire(&self, q: &Coordinates<Self>) -> Expr {
        q.y - q.x.powi(2)
    }
}

#[test]
fn derivatives_that_do_not_exist_are_errors() {
    let bead = Bead { m: 1.0, g: 9.81 };
    let on_wire = bead.state().x(0.5).y(0.25).build().unwrap();
    assert!(bead.state_jacobian(&on_wire).is_ok());
    let mut free = on_wire;
    free.release("wire").unwrap();
    assert_eq!(bead.accelerations(&free).unwrap().as_slice(), [0.0, -9.81]);
    let error = bead.state_jacobian(&free).unwrap_err();
    assert_eq!(error, SolveError::Released { constraint: "wire" });
    let flying = bead.solve_unrolled(&bead.constants().unwrap(), &free).unwrap();
    assert_eq!((flying.accelerations.as_slice(), flying.multipliers[0]), (&[0.0, -9.81][..], 0.0));
    let massless = Bead { m: 0.0, ..bead };
    assert!(massless.accelerations(&on_wire).is_err() && massless.state_jacobian(&on_wire).is_err());

    let pendulum = Pendulum { m: 2.0, l: 1.5, g: 9.81 };
    let origin = PendulumState::new(0.0, Vector::zeros(), Vector::zeros(), Vector::zeros());
    let error = pendulum.state_jacobian(&origin).unwrap_err();
    assert!(matches!(error, SolveError::DependentRow { row: "rod", .. }), "{error}");
    assert!(pendulum.solve_unrolled(&pendulum.constants().unwrap(), &origin).is_none());
    assert!(pendulum.accelerations(&origin).is_err(), "the rod has no direction");
}

#[test]
fn states_are_checked_and_completed() {
    let model = Pendulum { m: 2.0, l: 1.5, g: 9.81 };
    let error = model.state().x(1.0).y(0.3).build().unwrap_err();
    assert!(error.to_string().contains("`rod`"), "{error}");
    for (guess, sign) in [(-1.0, -1.0), (1.0, 1.0)] {
        let state = model.state().x(0.9).y_guess(guess).x_rate(0.4).assemble().unwrap();
        assert_eq!((state.x(), state.x_rate()), (0.9, 0.4));
        near(state.y(), sign * 1.2, 1.0, "the branch of the guess");
        near(state.y_rate(), -0.4 * 0.9 / state.y(), 1.0, "tangential");
        near(model.velocity_residual(&state)[0], 0.0, 1.0, "Φ̇");
    }
    assert!(model.state().x(2.0).assemble().is_err(), "the rod is shorter");

    let block = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let mut state = block.state().release("stick").build().unwrap();
    assert_eq!((state.is_engaged("stick"), state.is_engaged("floor")), (Ok(false), Ok(true)));
    state.engage("stick").unwrap();
    state.release("floor").unwrap();
    assert_eq!((state.is_engaged("stick"), state.is_engaged("floor")), (Ok(true), Ok(false)));
    let unknown = block.state().release("flor").build().unwrap_err();
    assert_eq!(unknown.to_string(), "no switched constraint is called `flor`; there are `floor`, `stick`");
    let fixed = model.state().release("rod").build().unwrap_err();
    assert_eq!(fixed.to_string(), "constraint `rod` always holds; declare it with the option `switched`");
}

/// A bar over a floor, on which either end may rest, held by a latch.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, tilt: rad)]
#[units(m: kg, inertia: kg * m^2, half: m, g: m / s^2, drag: N, speed: m / s)]
pub struct Plank {
    pub m: f64,
    pub inertia: f64,
    pub half: f64,
    pub g: f64,
    pub drag: f64,
    pub speed: f64,
}

#[dynamics]
impl Plank {
    fn end(&self, q: &Coordinates<Self>, side: f64) -> Vec2 {
        vec2(q.x, q.y) + side * self.half * vec2(q.tilt.cos(), q.tilt.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2)) + 0.5 * self.inertia * q.tilt.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic(switched)]
    fn left(&self, q: &Coordinates<Self>) -> Expr {
        self.end(q, -1.0).y
    }
    #[holonomic(switched)]
    fn right(&self, q: &Coordinates<Self>) -> Expr {
        self.end(q, 1.0).y
    }
    #[holonomic(switched)]
    fn latch(&self, q: &Coordinates<Self>) -> Expr {
        self.end(q, 1.0).x - self.speed * q.t
    }
    #[force]
    fn dragging(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.tilt, -self.drag * self.half * q.slip(Self::latch))
    }
}

/// Whatever is released, generated code gives what the general solver gives: accelerations, multipliers,
/// corrections.
#[test]
fn every_set_of_released_constraints_has_code_of_its_own() {
    let model = Plank { m: 2.0, inertia: 0.3, half: 0.7, g: 9.81, drag: 1.5, speed: 0.1 };
    let constants = model.constants().unwrap();
    let mut state = model.state().y(0.4).tilt(0.6).x_rate(0.3).y_rate(-0.2).tilt_rate(1.1).at_time(0.4);
    for name in ["left", "right", "latch"] {
        state = state.release(name);
    }
    let state = state.build().unwrap();
    let right = <Plank as Constraints>::Rows::new(0.3, -0.2, 0.5);
    for released in 0..8 {
        let mut state = state;
        *state.active_set_mut() = dynamics::model::ActiveSet::ALL_HOLD;
        let is_held = |mode: usize| released >> mode & 1 == 0;
        (0..3).filter(|mode| !is_held(*mode)).for_each(|mode| state.active_set_mut().release(mode, -1.0));
        let found =
            model.solve_unrolled(&constants, &state).unwrap_or_else(|| panic!("{:?}", state.active_set));
        let alone = model.accelerate_unrolled(&constants, &state).unwrap();
        let delta = model.correct_unrolled(&constants, &state, &right).unwrap();
        let general = dynamics::constrain::with_workspace::<Plank, _>(|workspace| {
            dynamics::constrain::solve_general(&model, &state, workspace).unwrap()
        });
        let size = general.accelerations.norm() + general.multipliers.norm();
        near((found.accelerations - general.accelerations).norm(), 0.0, size, "q̈");
        near((alone - general.accelerations).norm(), 0.0, size, "q̈ alone");
        near((found.multipliers - general.multipliers).norm(), 0.0, size, "λ");
        let (jacobian, held) = (model.jacobian(&state), (0..3).filter(|mode| is_held(*mode)));
        held.for_each(|row| near((jacobian * delta)[row], right[row], 10.0, "Φ_q δ = r"));
        // M δ is a reaction of what holds: no motion that this leaves takes part.
        let momentum = model.mass_matrix(&state) * delta;
        let mut rows = jacobian;
        (0..3).filter(|mode| !is_held(*mode)).for_each(|row| rows.row_mut(row).fill(0.0));
        let mut square = rows * rows.transpose();
        (0..3).filter(|mode| !is_held(*mode)).for_each(|row| square[(row, row)] = 1.0);
        let reaction = rows.transpose() * square.try_inverse().unwrap() * (rows * momentum);
        near((momentum - reaction).norm(), 0.0, 10.0, "M δ = Φ_qᵀμ");
    }
}
