//! Forces that a motion needs: zero for what a model does by itself, reactions and forces that depend on them
//! included, and M q̈ − Q by entries for any other.

use dynamics::prelude::*;

/// A block on a floor, with friction by the reaction; it carries a pendulum.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad)]
#[inputs(push: N)]
#[units(m: kg, bob: kg, l: m, g: m / s^2)]
struct Block {
    m: f64,
    bob: f64,
    l: f64,
    g: f64,
    friction: f64,
}
#[dynamics]
impl Block {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) + self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.bob * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.g * (self.m * q.y + self.bob * self.bob(q).y)
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[force]
    fn rubbing(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.x, q.push - self.friction * q.reaction(Self::floor))
    }
}

const BLOCK: Block = Block { m: 2.0, bob: 0.5, l: 0.3, g: 9.81, friction: 0.2 };

#[test]
fn what_a_model_does_by_itself_needs_nothing() {
    let state =
        BLOCK.state().theta(0.7).theta_rate(-2.0).x_rate(1.5).push(3.0).build().expect("on the floor");
    let solved = dynamics::constrain::solve_once(&BLOCK, &BLOCK.constants().expect("regular"), &state)
        .expect("one solution");
    let nothing = BLOCK.inverse_dynamics_with(&state, &solved.accelerations, &solved.multipliers);
    assert!(nothing.norm() < 1e-14 * 25.0, "{nothing:?}");
    assert!(solved.multipliers[0] > 20.0);
    // Without reactions they are part of what is needed: the floor's, and friction along with it.
    let all = BLOCK.inverse_dynamics(&state, &solved.accelerations);
    let floor = solved.multipliers[0];
    for (found, wanted) in all.iter().zip([-BLOCK.friction * floor, floor, 0.0]) {
        assert!((found - wanted).abs() < 1e-13 * floor, "{all:?}");
    }
}

#[test]
fn any_accelerations() {
    let state =
        BLOCK.state().theta(0.7).theta_rate(-2.0).x_rate(1.5).push(3.0).build().expect("on the floor");
    let a = [0.4, -1.1, 6.0];
    let found = BLOCK.inverse_dynamics(&state, &a.into());
    // By hand: d/dt of p, less ∂L/∂q and the push.
    let (s, c) = 0.7_f64.sin_cos();
    let bob = [a[0] + BLOCK.l * (c * a[2] - s * 4.0), a[1] + BLOCK.l * (s * a[2] + c * 4.0) + BLOCK.g];
    let wanted = [
        BLOCK.m * a[0] + BLOCK.bob * bob[0] - 3.0,
        BLOCK.m * (a[1] + BLOCK.g) + BLOCK.bob * bob[1],
        BLOCK.bob * BLOCK.l * (c * bob[0] + s * bob[1]),
    ];
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-13 * 25.0, "{found} for {wanted}");
    }
}

/// A rigid body whose mass is aside of its frame, which shifts and turns: a tree of one body is tried for it,
/// and not taken.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, yaw: rad, roll: rad)]
#[units(m: kg, a: m, j: kg * m^2, g: m / s^2)]
struct Floating {
    m: f64,
    a: f64,
    j: f64,
    g: f64,
}
#[dynamics]
impl Floating {
    fn body(&self, q: &Coordinates<Self>) -> RigidBody {
        let frame = Frame::new(vec3(q.x, q.y, 0.0), Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.roll));
        RigidBody::new(
            self.m,
            vec3(self.a, 0.0, self.a),
            Mat3::diagonal(self.j, 2.0 * self.j, 3.0 * self.j),
            frame,
        )
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).kinetic_energy()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.body(q).potential_energy(-self.g * Vec3::Y)
    }
}

/// As M q̈ − Q by entries; and its derivatives, of which linearisations are made, as differences of that.
/// What a tree of bodies leaves behind in the graph once hid the symbols ẋ and ẏ from gradients.
#[test]
fn of_a_body_that_floats() {
    let model = Floating { m: 2.0, a: 0.3, j: 0.1, g: 9.81 };
    let state =
        model.state().x(0.4).y(-0.7).yaw(0.9).roll(0.3).x_rate(0.2).y_rate(1.1).yaw_rate(-0.8).roll_rate(0.6);
    let state = state.build().expect("nothing holds it");
    let by_entries = |state: &State<Floating>, a: [f64; 4]| {
        model.mass_matrix(state) * nalgebra::SVector::from(a) - model.generalized_force(state)
    };
    for k in 0..5 {
        let mut a = [0.3, -1.2, 0.8, 2.1];
        if k < 4 {
            a = [0.0; 4];
            a[k] = 1.0;
        }
        let (found, wanted) = (model.inverse_dynamics(&state, &a.into()), by_entries(&state, a));
        assert!((found - wanted).amax() < 1e-13 * 20.0, "{k}: {found:?} for {wanted:?}");
        let mut values = [0.0; 32];
        assert!(model.variations(&state, &a.into(), &[].into(), &mut values));
        for (j, rate) in (0..4).flat_map(|j| [(j, false), (j, true)]) {
            let h = 1e-5;
            let moved = |h: f64| {
                let mut moved = state;
                if rate {
                    moved.u_mut()[j] += h
                } else {
                    moved.q_mut()[j] += h
                }
                by_entries(&moved, a)
            };
            let wanted = (moved(h) - moved(-h)) / (2.0 * h);
            let off = (0..4).map(|i| (values[if rate { 16 } else { 0 } + 4 * i + j] - wanted[i]).abs());
            assert!(off.fold(0.0, f64::max) < 1e-7, "{k}, {j}, {rate}: {wanted:?}");
        }
    }
}
