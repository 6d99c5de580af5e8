//! Closures of several rows whose branches touch: no row vanishes, a combination of them does.

use dynamics::methods::Any;
use dynamics::model::{Constraints, Model, Vector};
use dynamics::prelude::*;
use dynamics::simulate::SimulationErrorKind as Kind;

use super::{DRIFTING, EXACT, methods};

/// A bead on both z = y² and z = x⁶ in axes that are turned and moved: y = ±x³.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y, z)]
struct Bead {
    mass: f64,
    pull: [f64; 3],
    place: [f64; 3],
    axes: [f64; 9],
}

#[dynamics]
impl Bead {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec3(q.x, q.y, q.z).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * (self.pull[0] * q.x + self.pull[1] * q.y + self.pull[2] * q.z)
    }
    #[holonomic]
    fn way(&self, q: &Coordinates<Self>) -> Vec2 {
        let (a, b, c) = (q.x - self.place[0], q.y - self.place[1], q.z - self.place[2]);
        let x = self.axes[0] * a + self.axes[1] * b + self.axes[2] * c;
        let y = self.axes[3] * a + self.axes[4] * b + self.axes[5] * c;
        let z = self.axes[6] * a + self.axes[7] * b + self.axes[8] * c;
        vec2(z - y * y, z - x.powi(6))
    }
}

/// Along y = x³ alone, in axes of the curve.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(s)]
struct Alone {
    mass: f64,
    pull: [f64; 3],
}

#[dynamics]
impl Alone {
    fn place(&self, q: &Coordinates<Self>) -> Vec3 {
        vec3(q.s, q.s.powi(3), q.s.powi(6))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * self.place(q).dt().norm_squared()
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        let place = self.place(q);
        self.mass * (self.pull[0] * place.x + self.pull[1] * place.y + self.pull[2] * place.z)
    }
}

/// A model, a start, an end, and where the motion is then by a coordinate of its branch alone.
struct Case<M: Model> {
    model: M,
    start: M::State,
    end: f64,
    truth: [f64; 3],
}

/// Turned by three angles, moved, with and without weight.
fn bead(k: u32) -> Case<Bead> {
    let (at, k) = (start_of(k), f64::from(k));
    let ([a, b, c], w) =
        ([0.7 + 0.61 * k, 0.3 + 1.13 * k, 0.37 * k - 0.4], if k % 3.0 == 0.0 { 0.0 } else { 0.4 });
    let turn = [[a.cos(), a.sin()], [b.cos(), b.sin()], [c.cos(), c.sin()]];
    let [[ca, sa], [cb, sb], [cc, sc]] = if k % 5.0 == 0.0 { [[1.0, 0.0]; 3] } else { turn };
    let axes = [
        [ca * cc - sa * cb * sc, -ca * sc - sa * cb * cc, sa * sb],
        [sa * cc + ca * cb * sc, ca * cb * cc - sa * sc, -ca * sb],
        [sb * sc, sb * cc, cb],
    ];
    let (pull, place) =
        ([0.3 * w, -0.8 * w, 0.2 * w], [0.3 * (1.7 * k).sin(), 0.4 * (2.3 * k).cos(), 0.2 * k.cos()]);
    let of_curve = axes.map(|axis| (0..3).map(|j| axis[j] * pull[j]).sum());
    let alone = Alone { mass: 0.5 + 0.03 * k, pull: of_curve };
    let begin = alone.state().s(at.0).s_rate(at.1).build().unwrap();
    let last = alone.simulate(begin).until(2.0).method(methods::Dop853).tolerance(1e-13).run().unwrap().end();
    let read = |state: &State<Alone>| {
        let found = alone.place(&Alone::coordinates_with(state, &Default::default(), &[]));
        let out = |v: [f64; 3]| [0, 1, 2].map(|i| (0..3).map(|j| axes[j][i] * v[j]).sum::<f64>());
        let speed = found.dt();
        let q = out([found.x.value(), found.y.value(), found.z.value()]);
        ([0, 1, 2].map(|i| q[i] + place[i]), out([speed.x.value(), speed.y.value(), speed.z.value()]))
    };
    let [one, two, three] = axes;
    let axes = [one[0], one[1], one[2], two[0], two[1], two[2], three[0], three[1], three[2]];
    let (model, (q, u)) = (Bead { mass: alone.mass, pull, place, axes }, read(&begin));
    let start = model.state().x(q[0]).y(q[1]).z(q[2]).x_rate(u[0]).y_rate(u[1]).z_rate(u[2]).build().unwrap();
    Case { model, start, end: 2.0, truth: read(&last).0 }
}

fn start_of(k: u32) -> (f64, f64) {
    let part = |by: f64| (f64::from(k) * by).fract();
    (part(0.618) * 0.5 - 0.9, 0.8 + 0.4 * part(0.37))
}

/// A slider that a cam on one shaft lifts, k(1 − cos a)², and a crank on another one, 1 − cos b: sin(b/2) =
/// ±√(2k) sin²(a/2), which touch where a = 0.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad, s)]
struct Cam {
    inertia: [f64; 3],
    k: f64,
    pull: f64,
    mix: f64,
}

#[dynamics]
impl Cam {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b, s] = self.inertia;
        0.5 * (a * q.a.dt().powi(2) + b * q.b.dt().powi(2) + s * q.s.dt().powi(2))
    }
    #[potential]
    fn pull(&self, q: &Coordinates<Self>) -> Expr {
        self.pull * q.s
    }
    #[holonomic]
    fn closure(&self, q: &Coordinates<Self>) -> Vec2 {
        let (crank, cam) = (q.s - (1.0 - q.b.cos()), q.s - self.k * (1.0 - q.a.cos()).powi(2));
        vec2(crank + self.mix * cam, cam)
    }
}

/// By its cam shaft alone.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad)]
struct Shaft {
    inertia: [f64; 3],
    k: f64,
    pull: f64,
}

#[dynamics]
impl Shaft {
    fn crank(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * ((2.0 * self.k).sqrt() * (0.5 * q.a).sin().powi(2)).asin()
    }
    fn lift(&self, q: &Coordinates<Self>) -> Expr {
        self.k * (1.0 - q.a.cos()).powi(2)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b, s] = self.inertia;
        0.5 * (a * q.a.dt().powi(2) + b * self.crank(q).dt().powi(2) + s * self.lift(q).dt().powi(2))
    }
    #[potential]
    fn pull(&self, q: &Coordinates<Self>) -> Expr {
        self.pull * self.lift(q)
    }
}

fn cam(k: u32) -> Case<Cam> {
    let (at, n) = (start_of(k), f64::from(k));
    let alone = Shaft { inertia: [1.0, 0.5 + 0.1 * n, 0.3], k: 0.2 + 0.02 * n, pull: 0.2 * (n % 3.0) };
    let begin = alone.state().a(at.0).a_rate(at.1).build().unwrap();
    let last = alone.simulate(begin).until(1.6).method(methods::Dop853).tolerance(1e-13).run().unwrap().end();
    let read = |state: &State<Shaft>| {
        let q = Shaft::coordinates_with(state, &Default::default(), &[]);
        let (b, s) = (alone.crank(&q), alone.lift(&q));
        ([state.a(), b.value(), s.value()], [state.a_rate(), b.dt().value(), s.dt().value()])
    };
    let (inertia, (q, u)) = (alone.inertia, read(&begin));
    let model =
        Cam { inertia, k: alone.k, pull: alone.pull, mix: if k.is_multiple_of(2) { 0.0 } else { 0.7 } };
    let start = model.state().a(q[0]).b(q[1]).s(q[2]).a_rate(u[0]).b_rate(u[1]).s_rate(u[2]).build().unwrap();
    Case { model, start, end: 1.6, truth: read(&last).0 }
}

/// How many end right; none ends wrong as a success.
fn right<M: Simulate + Constraints>(
    case: &Case<M>,
    formulations: &[Formulation],
    methods: &[Any<M>],
    digits: &[i32],
) -> usize {
    let mut right = 0;
    for formulation in formulations {
        for method in methods {
            for digits in digits {
                let run =
                    case.model.simulate(case.start).until(case.end).method(method).formulation(*formulation);
                let named = format!("{formulation} {method} 1e-{digits} {:?}", case.start);
                match run.tolerance(10f64.powi(-digits)).max_steps(250).run() {
                    Ok(motion) => {
                        let (found, end) = (motion.end(), case.end);
                        let off = found.q().as_slice().iter().zip(case.truth).map(|(a, b)| (a - b).abs());
                        let off = off.fold(0.0, f64::max);
                        assert!(
                            off < 1e-2 || motion.verify().to_string().contains("\n  warning "),
                            "{named}: {off:e}"
                        );
                        right += usize::from(off < 1e-2 && found.t() == end);
                    }
                    Err(error) => {
                        let named_rows = |rows: &dynamics::constrain::TopContributors| rows.count() > 0;
                        if let Kind::BranchesTouch { rows, .. } = &error.kind {
                            assert!(
                                named_rows(rows) && error.to_string().contains("depend on each other"),
                                "{error}"
                            );
                        }
                    }
                }
            }
        }
    }
    right
}

#[test]
fn several_rows_stay_on_their_branch_or_say_so() {
    let (mut beads, mut cams) = (0, 0);
    for k in 0..2 {
        beads += right(&bead(k), &EXACT, &methods(), &[4, 5, 7, 9]);
        cams += right(&cam(k), &EXACT, &methods(), &[4, 6, 8, 10]);
    }
    right(&bead(1), &DRIFTING, &methods()[..1], &[6]);
    right(&cam(1), &DRIFTING, &methods()[..1], &[6]);
    println!("{beads} of 64 beads right, {cams} of 64 cams");
    assert!(beads >= 30 && cams >= 48, "{beads} {cams}");
}
