//! Sets of constraints that repeat themselves where they hold: what the report says at compile time beside
//! what singular values say at states that are assembled at run time, and what the reactions there say of
//! themselves.

use crate::singular_values;
use crate::three_cranks;
use crate::turning_trammel;

use dynamics::model::Vector;
use dynamics::prelude::*;
use singular_values::{jacobian, rank};
use three_cranks::ThreeCranks;
use turning_trammel::Turning;

/// The rank at a state, and the constraints whose multipliers are unique there: without any of their rows the
/// rank is less (Wojtyra 2009).
fn by_singular_values<M: Simulate>(model: &M, state: &M::State) -> (usize, Vec<&'static str>) {
    let all = jacobian(model, state);
    let full = rank(&all);
    let own = |c: &dynamics::model::Constraint| {
        (c.first..c.first + c.rows).all(|r| rank(&all.clone().remove_row(r)) == full - 1)
    };
    (full, M::CONSTRAINTS.iter().filter(|c| own(c)).map(|c| c.name).collect())
}

/// Asserts that the report, the reactions at a state and singular values there say the same of rank and
/// uniqueness.
#[track_caller]
fn agree<M: Simulate>(report: &str, model: &M, state: &M::State) -> (usize, Vec<&'static str>) {
    let words = report.split_whitespace().collect::<Vec<_>>().join(" ");
    let (rank, unique) = by_singular_values(model, state);
    let said = format!("{rank} of {} rows of constraints independent", M::Rows::LEN);
    assert!(words.contains(&said), "{said}\n{report}");
    let (_, rest) =
        words.split_once("reactions unique: ").unwrap_or_else(|| panic!("no reactions\n{report}"));
    let (reported, _) = rest.split_once("; not unique").expect("the other ones follow");
    let reported: Vec<&str> =
        reported.split(", ").filter(|name| M::CONSTRAINTS.iter().any(|c| c.name == *name)).collect();
    assert_eq!(reported, unique, "{report}");
    let told: Vec<&str> =
        model.reactions(state).expect("reactions").iter().filter(|r| r.unique).map(|r| r.name).collect();
    assert_eq!(told, unique);
    (rank, unique)
}

/// A bar of three beads on a line, its first one pinned: the third rod holds the middle in line, but to
/// second order only.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 3], y: [m; 3])]
#[units(mass: kg, half: m, gravity: m / s^2)]
#[nominal(half = 0.5)]
struct MiddlePin {
    mass: f64,
    half: f64,
    gravity: f64,
}

#[dynamics]
impl MiddlePin {
    fn bead(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    fn rod(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
        (self.bead(q, i) - self.bead(q, j)).norm_squared()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..3 {
            sum += 0.5 * self.mass * self.bead(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.gravity * (q.y[0] + q.y[1] + q.y[2])
    }
    #[holonomic]
    fn pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.bead(q, 0)
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        q.y[2]
    }
    #[holonomic]
    fn short(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [self.rod(q, 0, 1) - self.half.powi(2), self.rod(q, 1, 2) - self.half.powi(2)]
    }
    #[holonomic]
    #[redundant]
    fn long(&self, q: &Coordinates<Self>) -> Expr {
        self.rod(q, 0, 2) - (2.0 * self.half).powi(2)
    }
}

#[test]
fn rods_on_one_line_hold_positions_only() {
    let model = MiddlePin { mass: 1.0, half: 0.5, gravity: 9.81 };
    let start = model.state().x([0.0, 0.5, 1.0]).build().unwrap();
    assert_eq!(agree(MiddlePin::REPORT, &model, &start), (5, vec!["pin", "floor"]));
    assert_eq!(model.degrees_of_freedom(&start).unwrap(), 1);
    let words = MiddlePin::REPORT.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("degrees of freedom 1 in velocities, 0 in positions"), "{words}");
    assert!(words.contains("where forces push across long, runs end with an error"), "{words}");
    // As it says: weight pushes across, and without it there is nothing to yield to.
    let error = model.simulate(start).until(1.0).run().unwrap_err();
    assert!(error.to_string().contains("the constraints contradict each other"), "{error}");
    let weightless = MiddlePin { gravity: 0.0, ..model };
    let motion = weightless.simulate(start).until(1.0).run().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(motion.end().q, start.q);
}

#[test]
fn parallel_cranks_repeat_each_other() {
    let model = ThreeCranks { inertia: 1.0, a: 0.5, b: 0.8, weight: 0.0 };
    for angle in [0.4, 1.0, 2.5] {
        let start = model.state().first(angle).second_guess(angle).third_guess(angle).assemble().unwrap();
        assert_eq!(agree(ThreeCranks::REPORT, &model, &start), (3, vec![]));
    }
}

/// A door: two hinges on one axis. Which of them carries it is nobody's to say.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(r: [m; 3], tilt: [rad; 2], swing: rad)]
#[units(mass: kg, inertia: kg * m^2, apart: m, gravity: m / s^2)]
struct Door {
    mass: f64,
    inertia: f64,
    apart: f64,
    gravity: f64,
}

#[dynamics]
impl Door {
    fn attitude(&self, q: &Coordinates<Self>) -> Mat3 {
        Mat3::rotation_x(q.tilt[0]) * Mat3::rotation_y(q.tilt[1]) * Mat3::rotation_z(q.swing)
    }
    fn gap(&self, q: &Coordinates<Self>, side: f64) -> Vec3 {
        let hinge = vec3(0.0, 0.0, side * self.apart);
        vec3(q.r[0], q.r[1], q.r[2]) + self.attitude(q) * hinge - hinge
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let turning = q.tilt[0].dt().powi(2) + q.tilt[1].dt().powi(2) + q.swing.dt().powi(2);
        0.5 * self.mass * (q.r[0].dt().powi(2) + q.r[1].dt().powi(2) + q.r[2].dt().powi(2))
            + 0.5 * self.inertia * turning
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.gravity * q.r[2]
    }
    #[holonomic]
    fn top(&self, q: &Coordinates<Self>) -> Vec3 {
        self.gap(q, 1.0)
    }
    #[holonomic]
    fn bottom_across(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        let gap = self.gap(q, -1.0);
        [gap.x, gap.y]
    }
    #[holonomic]
    #[redundant]
    fn bottom_along(&self, q: &Coordinates<Self>) -> Expr {
        self.gap(q, -1.0).z
    }
}

#[test]
fn two_hinges_on_one_axis_share_what_is_along_it() {
    let model = Door { mass: 20.0, inertia: 4.0, apart: 0.8, gravity: 9.81 };
    let start = model.state().swing(0.7).swing_rate(1.0).build().unwrap();
    assert_eq!(agree(Door::REPORT, &model, &start), (5, vec!["bottom_across"]));
    let rows = "unique: top.x, top.y, bottom_across; not unique, the smallest are given: top.z, bottom_along";
    assert!(Door::REPORT.split_whitespace().collect::<Vec<_>>().join(" ").contains(rows), "{}", Door::REPORT);
}

/// Bennett's loop: four hinges in space whose axes are skew; it moves because of its proportions alone.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(first: rad, second: rad, fourth: rad)]
#[units(inertia: kg * m^2, a: m, alpha: rad, beta: rad, length: m)]
#[nominal(a = 1.0, alpha = 0.6, beta = 1.1, length = 0.3)]
struct Bennett {
    inertia: f64,
    a: f64,
    alpha: f64,
    beta: f64,
    length: f64,
}

#[dynamics]
impl Bennett {
    fn b(&self) -> f64 {
        self.a * self.beta.sin() / self.alpha.sin()
    }
    /// A point on the axis of the third hinge, from both sides.
    fn gap(&self, q: &Coordinates<Self>, side: f64) -> Vec3 {
        let point = vec3(0.0, 0.0, side * self.length);
        let second =
            Mat3::rotation_z(q.second) * (vec3(self.b(), 0.0, 0.0) + Mat3::rotation_x(self.beta) * point);
        let one_way =
            Mat3::rotation_z(q.first) * (vec3(self.a, 0.0, 0.0) + Mat3::rotation_x(self.alpha) * second);
        let third = Mat3::rotation_x(-self.alpha) * (point - vec3(self.a, 0.0, 0.0));
        let other_way =
            Mat3::rotation_x(-self.beta) * (Mat3::rotation_z(-q.fourth) * third - vec3(self.b(), 0.0, 0.0));
        one_way - other_way
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.inertia * (q.first.dt().powi(2) + q.second.dt().powi(2) + q.fourth.dt().powi(2))
    }
    #[holonomic]
    #[redundant]
    fn hinge(&self, q: &Coordinates<Self>) -> [Vec3; 2] {
        [self.gap(q, 1.0), self.gap(q, -1.0)]
    }
}

#[test]
fn bennetts_loop_moves() {
    let model = Bennett { inertia: 1.0, a: 1.0, alpha: 0.6, beta: 1.1, length: 0.3 };
    let start = model
        .state()
        .first(0.9)
        .second_guess(2.0)
        .fourth_guess(-2.0)
        .assemble()
        .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(agree(Bennett::REPORT, &model, &start), (2, vec![]));
}

/// A truss of two bays on a pin: the first has both diagonals, the second one.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 6], y: [m; 6])]
#[units(mass: kg, width: m, height: m, gravity: m / s^2)]
#[nominal(width = 1.0, height = 0.7)]
struct Truss {
    mass: f64,
    width: f64,
    height: f64,
    gravity: f64,
}

#[dynamics]
impl Truss {
    fn joint(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x[i], q.y[i])
    }
    fn square(&self, q: &Coordinates<Self>, i: usize, j: usize) -> Expr {
        (self.joint(q, i) - self.joint(q, j)).norm_squared()
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            sum += 0.5 * self.mass * self.joint(q, i).dt().norm_squared();
        }
        sum
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            sum += self.mass * self.gravity * q.y[i];
        }
        sum
    }
    #[holonomic]
    fn pin(&self, q: &Coordinates<Self>) -> Vec2 {
        self.joint(q, 0)
    }
    /// Joints 0, 1, 2 below, 3, 4, 5 above.
    #[holonomic]
    fn braced(&self, q: &Coordinates<Self>) -> [Expr; 5] {
        let (w, h) = (self.width.powi(2), self.height.powi(2));
        [
            self.square(q, 0, 1) - w,
            self.square(q, 3, 4) - w,
            self.square(q, 0, 3) - h,
            self.square(q, 1, 4) - h,
            self.square(q, 0, 4) - (w + h),
        ]
    }
    #[holonomic]
    fn bay(&self, q: &Coordinates<Self>) -> [Expr; 4] {
        let (w, h) = (self.width.powi(2), self.height.powi(2));
        [
            self.square(q, 1, 2) - w,
            self.square(q, 4, 5) - w,
            self.square(q, 2, 5) - h,
            self.square(q, 1, 5) - (w + h),
        ]
    }
    #[holonomic]
    #[redundant]
    fn second_diagonal(&self, q: &Coordinates<Self>) -> Expr {
        self.square(q, 1, 3) - (self.width.powi(2) + self.height.powi(2))
    }
}

#[test]
fn one_rod_too_many_concerns_its_bay_alone() {
    let model = Truss { mass: 1.0, width: 1.0, height: 0.7, gravity: 9.81 };
    let state =
        model.state().x([0.0, 1.0, 2.0, 0.0, 1.0, 2.0]).y([0.0, 0.0, 0.0, 0.7, 0.7, 0.7]).build().unwrap();
    assert_eq!(agree(Truss::REPORT, &model, &state), (11, vec!["pin", "bay"]));
}

/// Sarrus' linkage: two hinged chains in upright planes carry a platform straight up.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(p: [m; 3], yaw: rad, pitch: rad, roll: rad, a: [rad; 2], b: [rad; 2])]
#[units(mass: kg, inertia: kg * m^2, link: m, half: m)]
#[nominal(link = 1.0, half = 0.3)]
struct Sarrus {
    mass: f64,
    inertia: f64,
    link: f64,
    half: f64,
}

#[dynamics]
impl Sarrus {
    fn attitude(&self, q: &Coordinates<Self>) -> Mat3 {
        Mat3::rotation_z(q.yaw) * Mat3::rotation_y(q.pitch) * Mat3::rotation_x(q.roll)
    }
    fn middle(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.p[0], q.p[1], q.p[2])
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let spin = self.attitude(q).dt() * self.attitude(q).transpose();
        let omega = vec3(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
        0.5 * self.mass * self.middle(q).dt().norm_squared() + 0.5 * self.inertia * omega.norm_squared()
    }
    #[holonomic]
    fn chain_x(&self, q: &Coordinates<Self>) -> Vec3 {
        let (out, up) = (q.a[0].cos() + q.a[1].cos(), q.a[0].sin() + q.a[1].sin());
        self.middle(q) + self.half * self.attitude(q).column(0)
            - vec3(self.half + self.link * out, Expr::ZERO, self.link * up)
    }
    #[holonomic]
    fn chain_y(&self, q: &Coordinates<Self>) -> Vec3 {
        let (out, up) = (q.b[0].cos() + q.b[1].cos(), q.b[0].sin() + q.b[1].sin());
        self.middle(q) + self.half * self.attitude(q).column(1)
            - vec3(Expr::ZERO, self.half + self.link * out, self.link * up)
    }
    #[holonomic]
    fn hinge_x(&self, q: &Coordinates<Self>) -> Vec2 {
        let y = self.attitude(q).column(1);
        vec2(y.x, y.z)
    }
    #[holonomic]
    #[redundant]
    fn hinge_y(&self, q: &Coordinates<Self>) -> Vec2 {
        let x = self.attitude(q).column(0);
        vec2(x.y, x.z)
    }
}

/// Which rows can be left out differs from one assembly to the next; how many does not.
#[test]
fn sarrus_linkage_has_one_freedom_in_velocities_and_positions() {
    let model = Sarrus { mass: 2.0, inertia: 0.1, link: 1.0, half: 0.3 };
    let start = model.state().p([0.0, 0.0, 1.8]).a_guess([1.0, 2.0]).b_guess([1.0, 2.0]).assemble().unwrap();
    assert_eq!(by_singular_values(&model, &start).0, 9);
    let words = Sarrus::REPORT.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("degrees of freedom 1; 10 coordinates, 9 of 10 rows"), "{}", Sarrus::REPORT);
}

/// An ellipsograph: a rod whose ends slide on two axes, by its middle. A third rod from the origin to the
/// middle repeats what the axes do.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(half: m, mass: kg, inertia: kg * m^2, g: m / s^2)]
#[nominal(half = 0.5)]
struct Trammel {
    half: f64,
    mass: f64,
    inertia: f64,
    g: f64,
}

#[dynamics]
impl Trammel {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn sliders(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) - self.half * vec2(q.phi.cos(), -q.phi.sin())
    }
    #[holonomic]
    #[redundant]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        vec2(q.x, q.y).norm() - self.half
    }
}

/// Beside the manifold rows that repeat others differ from them: taken together with them they cost four
/// digits.
#[test]
fn rows_that_repeat_others_cost_no_digits() {
    let (half, mass, inertia, g) = (0.5, 2.0, 0.2, 9.81);
    let turning = Turning { half, mass, inertia, g };
    let start = turning.state().phi(0.4).phi_rate(9.0).build().unwrap();
    let truth = turning.simulate(start).until(10.0).tolerance(1e-13).run().unwrap().end().phi();
    let trammel = Trammel { half, mass, inertia, g };
    let start = trammel.state().phi(0.4).phi_rate(9.0).x_guess(0.4).y_guess(-0.2).assemble().unwrap();
    for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
        let motion = trammel.simulate(start).until(10.0).tolerance(tolerance).run().unwrap();
        let error = (motion.end().phi() - truth).abs();
        println!("{tolerance:e}: {error:.1e}, {} steps", motion.summary().steps);
        assert!(error < 300.0 * tolerance, "{tolerance:e}: {error:e}");
    }
}
