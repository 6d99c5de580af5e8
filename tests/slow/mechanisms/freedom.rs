//! What `REPORT` says of mechanisms beside singular values at states that are assembled: freedom, independent
//! rows, unique reactions, and that every loop determines its coordinates. Newton's method ends in singular
//! positions of some of them; the report is on the mechanism, not on those.

use crate::singular_values;

use dynamics::model::Vector;
use dynamics::prelude::*;
use nalgebra::DMatrix;
use singular_values::{jacobian, rank};

/// The text of an entry of the report, in one line.
fn entry(report: &str, heading: &str) -> Option<String> {
    let mut lines = report.lines().skip_while(|line| !line.starts_with(heading));
    let first = lines.next()?.strip_prefix(heading)?.trim().to_owned();
    let more = lines.take_while(|line| line.starts_with(' '));
    Some(more.fold(first, |text, line| text + " " + line.trim()))
}

/// The indices of rows in a list of constraints and rows.
fn rows_named<M: Simulate>(list: &str) -> Vec<usize> {
    let one = |name: &str| -> Vec<usize> {
        if let Some(c) = M::CONSTRAINTS.iter().find(|c| c.name == name) {
            return (c.first..c.first + c.rows).collect();
        }
        M::ROWS.iter().position(|row| row.name == name).into_iter().collect()
    };
    let mut rows: Vec<usize> = list.split(", ").flat_map(one).collect();
    rows.sort_unstable();
    rows
}

/// Rows whose multipliers are unique at a state: without them the rank is less (Wojtyra 2009).
fn unique_rows(all: &DMatrix<f64>, full: usize) -> Vec<usize> {
    (0..all.nrows()).filter(|r| rank(&all.clone().remove_row(*r)) == full - 1).collect()
}

/// Asserts what the report says of a mechanism with so many freedoms and independent rows, at states of it.
#[track_caller]
fn agree<M: Simulate>(report: &str, model: &M, states: &[M::State], (freedom, independent): (usize, usize)) {
    let rows = M::Rows::LEN;
    let said = entry(report, "degrees of freedom").expect("an entry");
    let count = if independent == rows {
        format!("{rows} independent rows")
    } else {
        format!("{independent} of {rows} rows")
    };
    assert!(
        said.starts_with(&format!("{freedom};")) || said.starts_with(&format!("{freedom}: ")),
        "{report}"
    );
    assert!(
        said.contains(&count) && said.contains("where they hold, at the nominal values"),
        "{count}\n{report}"
    );
    assert!(!report.contains("tangent") && !report.contains("branches"), "{report}");
    let reactions = entry(report, "reactions").expect("an entry");
    let blocks: Vec<String> =
        ["loops", "single rows"].iter().filter_map(|heading| entry(report, heading)).collect();
    for state in states {
        let all = jacobian(model, state);
        assert_eq!((rank(&all), M::Vector::LEN - rank(&all)), (independent, freedom), "{state:?}");
        let unique = unique_rows(&all, independent);
        match reactions.strip_prefix("unique: ").and_then(|text| text.split_once("; not unique")) {
            Some((list, _)) => assert_eq!(rows_named::<M>(list), unique, "{report}"),
            None => assert_eq!((reactions.as_str(), unique.len()), ("all unique", rows), "{report}"),
        }
        let told = model.reactions(state).expect("reactions");
        for (reaction, c) in told.iter().zip(M::CONSTRAINTS) {
            assert_eq!(
                reaction.unique,
                (c.first..c.first + c.rows).all(|r| unique.contains(&r)),
                "{}",
                c.name
            );
        }
        determined::<M>(&blocks, &all, independent);
    }
}

/// Every loop can be solved for its coordinates, and all together they are as many as independent rows.
#[track_caller]
fn determined<M: Simulate>(blocks: &[String], all: &DMatrix<f64>, independent: usize) {
    let mut rows = 0;
    for text in blocks {
        let (_, list) = text.split_once(": ").expect("a list");
        for one in list.split("; ") {
            let (own, coordinates) = one.split_once(" for ").expect("rows for coordinates");
            let own = rows_named::<M>(own);
            let place =
                |name: &str| M::COORDINATES.iter().position(|c| c.name == name).expect("a coordinate");
            let columns: Vec<usize> = coordinates.split(", ").map(place).collect();
            let block = all.select_rows(&own).select_columns(&columns);
            assert_eq!((own.len(), rank(&block)), (columns.len(), own.len()), "{one}");
            rows += own.len();
        }
    }
    assert_eq!(rows, independent, "{blocks:?}");
}

/// A Roberval balance with three beams: two pans as bodies, each held by three pins.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(beam: [rad; 3], left: [m; 2], lean: rad, right: [m; 2], tilt: rad)]
#[units(mass: kg, inertia: kg * m^2, arm: m, apart: m, gravity: m / s^2)]
#[nominal(arm = 0.4, apart = 0.15)]
struct Roberval {
    mass: f64,
    inertia: f64,
    arm: f64,
    apart: f64,
    gravity: f64,
}

#[dynamics]
impl Roberval {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let (left, right) = (vec2(q.left[0], q.left[1]), vec2(q.right[0], q.right[1]));
        let mut turning = q.lean.dt().powi(2) + q.tilt.dt().powi(2);
        for i in 0..3 {
            turning += q.beam[i].dt().powi(2);
        }
        0.5 * self.mass * (left.dt().norm_squared() + right.dt().norm_squared())
            + 0.5 * self.inertia * turning
    }
    #[potential]
    fn weight(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.gravity * (q.left[1] + 1.2 * q.right[1])
    }
    /// The gaps at both ends of a beam.
    fn gaps(&self, q: &Coordinates<Self>, i: usize) -> [Vec2; 2] {
        let up = (i as f64 - 1.0) * self.apart;
        let arm = self.arm * vec2(q.beam[i].cos(), q.beam[i].sin());
        let left = vec2(q.left[0], q.left[1]) + up * vec2(-q.lean.sin(), q.lean.cos());
        let right = vec2(q.right[0], q.right[1]) + up * vec2(-q.tilt.sin(), q.tilt.cos());
        [left + arm - vec2(0.0, up), right - arm - vec2(0.0, up)]
    }
    #[holonomic]
    fn upper(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        self.gaps(q, 2)
    }
    #[holonomic]
    #[redundant]
    fn middle(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        self.gaps(q, 1)
    }
    #[holonomic]
    #[redundant]
    fn lower(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        self.gaps(q, 0)
    }
}

/// Random starts end where the beams are upright, where one row more is lost for a moment.
#[test]
fn roberval() {
    let model = Roberval { mass: 1.0, inertia: 0.02, arm: 0.4, apart: 0.15, gravity: 9.81 };
    let at = |angle: f64| {
        let (x, y) = (0.4 * angle.cos(), 0.4 * angle.sin());
        let guessed = model.state().beam([angle; 3]).left_guess([-x, -y]).right_guess([x, y]);
        guessed.assemble().unwrap()
    };
    agree(Roberval::REPORT, &model, &[0.1, 0.9, -2.0, 3.0].map(at), (1, 8));
    assert_eq!(rank(&jacobian(&model, &at(core::f64::consts::FRAC_PI_2))), 7);
}

/// Five bars in parallel: ground, a coupler as a body, and three cranks of one length.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: [rad; 3], x: m, y: m, turn: rad)]
#[units(mass: kg, inertia: kg * m^2, length: m, apart: m)]
#[nominal(length = 0.5, apart = 0.8)]
struct FiveBars {
    mass: f64,
    inertia: f64,
    length: f64,
    apart: f64,
}

#[dynamics]
impl FiveBars {
    fn pin(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let along = i as f64 * self.apart;
        let on_coupler = vec2(q.x, q.y) + along * vec2(q.turn.cos(), q.turn.sin());
        on_coupler - vec2(along, 0.0) - self.length * vec2(q.crank[i].cos(), q.crank[i].sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut turning = q.turn.dt().powi(2);
        for i in 0..3 {
            turning += q.crank[i].dt().powi(2);
        }
        0.5 * self.mass * (q.x.dt().powi(2) + q.y.dt().powi(2)) + 0.5 * self.inertia * turning
    }
    #[holonomic]
    fn pins(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        [self.pin(q, 0), self.pin(q, 2)]
    }
    #[holonomic]
    #[redundant]
    fn third(&self, q: &Coordinates<Self>) -> Vec2 {
        self.pin(q, 1)
    }
}

#[test]
fn five_parallel_bars() {
    let model = FiveBars { mass: 1.0, inertia: 0.1, length: 0.5, apart: 0.8 };
    let at = |angle: f64| {
        let guessed = model.state().crank([angle; 3]).x_guess(0.5 * angle.cos()).y_guess(0.5 * angle.sin());
        guessed.assemble().unwrap()
    };
    agree(FiveBars::REPORT, &model, &[0.4, 1.6, -2.5].map(at), (1, 5));
}

/// Bricard's loop of threefold symmetry: six hinges, each at right angles to the next.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(turn: [rad; 6])]
#[units(inertia: kg * m^2, length: m)]
#[nominal(length = 1.0)]
struct Bricard {
    inertia: f64,
    length: f64,
}

#[dynamics]
impl Bricard {
    /// From the frame of the last hinge to that of the first: a turn about z, a step along x, a quarter turn
    /// about x to either side.
    fn around(&self, q: &Coordinates<Self>, point: Vec3) -> Vec3 {
        let mut place = point;
        for i in 0..6 {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let (y, z) = (-side * place.z, side * place.y);
            let stepped = vec3(place.x + self.length, y, z);
            let (s, c) = (q.turn[5 - i].sin(), q.turn[5 - i].cos());
            place = vec3(c * stepped.x - s * stepped.y, s * stepped.x + c * stepped.y, stepped.z);
        }
        place
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..6 {
            sum += 0.5 * self.inertia * q.turn[i].dt().powi(2);
        }
        sum
    }
    #[holonomic]
    #[redundant]
    fn closure(&self, q: &Coordinates<Self>) -> [Expr; 6] {
        let origin = self.around(q, vec3(0.0, 0.0, 0.0));
        let x = self.around(q, vec3(self.length, 0.0, 0.0)) - origin;
        let y = self.around(q, vec3(0.0, self.length, 0.0)) - origin;
        [origin.x, origin.y, origin.z, x.y, x.z, y.z]
    }
}

/// On the symmetric branch with one freedom; with two opposite hinges folded back it has two.
#[test]
fn bricard() {
    let model = Bricard { inertia: 1.0, length: 1.0 };
    let report = Bricard::REPORT.split_whitespace().collect::<Vec<_>>().join(" ");
    let said = "degrees of freedom 2 on some branches, 1 on others; 6 coordinates, 4 of 6 rows of \
        constraints independent on some branches of the assembly, 5 on others";
    assert!(report.contains(said) && report.contains("which branch the start is on decides"), "{report}");
    let symmetric = |first: f64, other: f64| {
        let turns = [first, other, first, other, first, other];
        model.state().turn_guess(turns).assemble().unwrap()
    };
    for state in [symmetric(1.91274, 1.04203), symmetric(1.04203, 1.91274)] {
        assert_eq!(rank(&jacobian(&model, &state)), 5);
    }
    for [a, b] in [[0.7, 1.1], [-1.2, 0.4], [2.1, -1.7]] {
        let state =
            model.state().turn([core::f64::consts::PI, a, b, core::f64::consts::PI, b, -a]).build().unwrap();
        assert_eq!(rank(&jacobian(&model, &state)), 4);
    }
}

/// A leg of Jansen's walking linkage.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(crank: rad, upper: rad, triangle: rad, lower: rad, strut: rad, coupler: rad, shin: rad)]
#[units(inertia: kg * m^2, a: m, l: m, m: m, j: m, k: m, b: m, c: m, d: m, e: m, f: m, g: m)]
#[nominal(
    a = 0.38,
    l = 0.078,
    m = 0.15,
    j = 0.5,
    k = 0.619,
    b = 0.415,
    c = 0.393,
    d = 0.401,
    e = 0.558,
    f = 0.394,
    g = 0.367
)]
struct Jansen {
    inertia: f64,
    a: f64,
    l: f64,
    m: f64,
    j: f64,
    k: f64,
    b: f64,
    c: f64,
    d: f64,
    e: f64,
    f: f64,
    g: f64,
}

#[dynamics]
impl Jansen {
    fn along(&self, length: f64, angle: Expr) -> Vec2 {
        length * vec2(angle.cos(), angle.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let rods =
            q.upper.dt().powi(2) + q.lower.dt().powi(2) + q.coupler.dt().powi(2) + q.strut.dt().powi(2);
        0.5 * self.inertia * (rods + q.crank.dt().powi(2) + q.triangle.dt().powi(2) + q.shin.dt().powi(2))
    }
    fn hip(&self) -> Vec2 {
        vec2(self.a, -self.l)
    }
    #[holonomic]
    fn upper_loop(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.m, q.crank) + self.along(self.j, q.upper)
            - self.along(self.b, q.triangle)
            - self.hip()
    }
    #[holonomic]
    fn lower_loop(&self, q: &Coordinates<Self>) -> Vec2 {
        self.along(self.m, q.crank) + self.along(self.k, q.lower) - self.along(self.c, q.strut) - self.hip()
    }
    #[holonomic]
    fn back_loop(&self, q: &Coordinates<Self>) -> Vec2 {
        let corner = ((self.b.powi(2) + self.d.powi(2) - self.e.powi(2)) / (2.0 * self.b * self.d)).acos();
        self.along(self.d, q.triangle - corner) + self.along(self.f, q.coupler)
            - self.along(self.c, q.strut)
            - self.along(self.g, q.shin)
    }
}

#[test]
fn jansen() {
    let model = Jansen {
        inertia: 1.0,
        a: 0.38,
        l: 0.078,
        m: 0.15,
        j: 0.5,
        k: 0.619,
        b: 0.415,
        c: 0.393,
        d: 0.401,
        e: 0.558,
        f: 0.394,
        g: 0.367,
    };
    let at = |angle: f64| {
        let guessed = model.state().crank(angle).upper_guess(0.9).triangle_guess(1.5).lower_guess(-0.9);
        guessed.strut_guess(-1.7).coupler_guess(-1.4).shin_guess(0.1).assemble().unwrap()
    };
    agree(Jansen::REPORT, &model, &[0.2, 2.0, 4.0].map(at), (1, 6));
}

/// A leg that was spun turns for a minute: its loops stay closed and its energy the same, at steps and
/// between them. (The machine of twelve legs does it in its example.)
#[test]
fn jansens_leg_turns_for_a_minute() {
    let [a, l, m, j, k, b, c] = [0.38, 0.078, 0.15, 0.5, 0.619, 0.415, 0.393];
    let model = Jansen { inertia: 1.0, a, l, m, j, k, b, c, d: 0.401, e: 0.558, f: 0.394, g: 0.367 };
    let guessed =
        model.state().crank(0.2).crank_rate(6.0).upper_guess(0.9).triangle_guess(1.5).lower_guess(-0.9);
    let start = guessed.strut_guess(-1.7).coupler_guess(-1.4).shin_guess(0.1).assemble().unwrap();
    let energy = model.kinetic_energy(&start);
    let motion = model.simulate(start).until(60.0).tolerance(1e-10).method(methods::Dop853).run().unwrap();
    assert!(motion.end().crank() > 40.0 * core::f64::consts::TAU, "{}", motion.end().crank());
    for state in motion.steps() {
        let (gap, rate) = (model.residual(&state).amax(), model.velocity_residual(&state).amax());
        assert!(gap < 1e-13 && rate < 1e-12, "{gap:e} {rate:e} at {}", state.t);
        assert!((model.kinetic_energy(&state) / energy - 1.0).abs() < 1e-7, "at {}", state.t);
    }
    let between =
        motion.sample((0..6000).map(|i| f64::from(i) * 0.01)).map(|state| model.residual(&state).amax());
    let gap = between.fold(0.0, f64::max);
    assert!(gap < 1e-8, "{gap:e}");
    // It is back after each turn, on the same branch.
    assert!((motion.end().shin() - start.shin()).abs() < core::f64::consts::PI);
}

/// Four windows in a row: five standing rods and four between their tops, each with its centre and its angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: [m; 9], y: [m; 9], angle: [rad; 9])]
#[units(mass: kg, length: m)]
#[nominal(length = 1.0)]
struct FourWindows {
    mass: f64,
    length: f64,
}

#[dynamics]
impl FourWindows {
    fn end(&self, q: &Coordinates<Self>, rod: usize, side: f64) -> Vec2 {
        vec2(q.x[rod], q.y[rod]) + 0.5 * side * self.length * vec2(q.angle[rod].cos(), q.angle[rod].sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..9 {
            sum += 0.5 * self.mass * (q.x[i].dt().powi(2) + q.y[i].dt().powi(2))
                + self.mass * self.length.powi(2) / 24.0 * q.angle[i].dt().powi(2);
        }
        sum
    }
    #[holonomic]
    fn ground(&self, q: &Coordinates<Self>) -> [Vec2; 5] {
        let mut joints = [Vec2::ZERO; 5];
        for i in 0..5 {
            joints[i] = self.end(q, i, -1.0) - vec2(i as f64 * self.length, 0.0);
        }
        joints
    }
    #[holonomic]
    fn corner(&self, q: &Coordinates<Self>) -> [Vec2; 8] {
        let mut joints = [Vec2::ZERO; 8];
        for j in 0..4 {
            joints[2 * j] = self.end(q, 5 + j, -1.0) - self.end(q, j, 1.0);
            joints[2 * j + 1] = self.end(q, 5 + j, 1.0) - self.end(q, j + 1, 1.0);
        }
        joints
    }
}

/// All windows lean, or the first one alone is open, its rods on each other, and the others lie flat: there
/// velocities are free that no position is.
#[test]
fn four_windows() {
    let model = FourWindows { mass: 1.0, length: 1.0 };
    let standing = |angles: [f64; 5], between: [f64; 4]| {
        let (mut x, mut y, mut turns) = ([0.0; 9], [0.0; 9], [0.0; 9]);
        for (i, angle) in angles.into_iter().enumerate() {
            (x[i], y[i], turns[i]) = (i as f64 + 0.5 * angle.cos(), 0.5 * angle.sin(), angle);
        }
        for (j, angle) in between.into_iter().enumerate() {
            let (top, height) = (j as f64 + angles[j].cos(), angles[j].sin());
            (x[5 + j], y[5 + j], turns[5 + j]) = (top + 0.5 * angle.cos(), height + 0.5 * angle.sin(), angle);
        }
        model.state().x(x).y(y).angle(turns).build().unwrap()
    };
    let ranks = |states: [_; 3]| states.map(|state| rank(&jacobian(&model, &state)));
    let flat = core::f64::consts::PI;
    assert_eq!(ranks([0.7, 1.5, -2.0].map(|angle| standing([angle; 5], [0.0; 4]))), [26; 3]);
    let one_open = |angle: f64| standing([angle, flat, flat, flat, flat], [angle + flat, 0.0, 0.0, 0.0]);
    assert_eq!(ranks([0.7, 1.5, -2.0].map(one_open)), [23; 3]);
    let said = entry(FourWindows::REPORT, "degrees of freedom").expect("an entry");
    let freedom = "1, but 4 in velocities on some branches; 27 coordinates, 23 of 26 rows";
    assert!(said.starts_with(freedom), "{said}");
}

/// A pendulum with one rod three times.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m)]
#[units(mass: kg, length: m)]
#[nominal(length = 1.0)]
struct TripleRod {
    mass: f64,
    length: f64,
}

#[dynamics]
impl TripleRod {
    fn stretch(&self, q: &Coordinates<Self>) -> Expr {
        q.x.powi(2) + q.y.powi(2) - self.length.powi(2)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.stretch(q)
    }
    #[holonomic]
    #[redundant]
    fn more(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [self.stretch(q), 2.0 * self.stretch(q)]
    }
}

#[test]
fn three_times_one_rod() {
    let model = TripleRod { mass: 1.0, length: 1.0 };
    let at = |angle: f64| model.state().x(angle.cos()).y(angle.sin()).build().unwrap();
    agree(TripleRod::REPORT, &model, &[0.3, 1.7].map(at), (1, 1));
}

/// A pantograph of four arms of one length, its tracer on a rail.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: rad, b: rad, c: rad, d: rad)]
#[units(mass: kg, length: m, height: m)]
#[nominal(length = 0.5, height = 0.3)]
struct Pantograph {
    mass: f64,
    length: f64,
    height: f64,
}

#[dynamics]
impl Pantograph {
    fn arm(&self, angle: Expr) -> Vec2 {
        self.length * vec2(angle.cos(), angle.sin())
    }
    fn tracer(&self, q: &Coordinates<Self>) -> Vec2 {
        self.arm(q.a) + self.arm(q.c)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * self.mass * (self.arm(q.a) + self.arm(q.b)).dt().norm_squared()
    }
    #[holonomic]
    fn close(&self, q: &Coordinates<Self>) -> Vec2 {
        self.tracer(q) - (2.0 * self.arm(q.a) + self.arm(q.b) + self.arm(q.d))
    }
    #[holonomic]
    fn rail(&self, q: &Coordinates<Self>) -> Expr {
        self.tracer(q).y - self.height
    }
}

#[test]
fn pantograph() {
    let model = Pantograph { mass: 1.0, length: 0.5, height: 0.3 };
    let at = |b: f64| {
        let guessed = model.state().b(b).a_guess(0.9).c_guess(b).d_guess(0.9 + core::f64::consts::PI);
        guessed.assemble().unwrap()
    };
    agree(Pantograph::REPORT, &model, &[-0.4, 0.1, -0.2].map(at), (1, 3));
}
