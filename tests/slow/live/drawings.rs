//! Drawings: the numbers of every figure that a page draws are those of the `#[drawing]` function.

use dynamics::live::OpenLive;
use dynamics::model::{Draw, ModelState, Vector};
use dynamics::output::{Color, Drawing, Figure, Point};
use dynamics::prelude::*;

use crate::engine::Engine;

/// Every figure of the plane, and every way to write them that a page follows.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, theta, swing: [1; 3])]
struct Plane {
    m: f64,
    l: f64,
    k: f64,
    g: f64,
}

#[dynamics]
impl Plane {
    fn cart(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, 0.0)
    }
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        self.cart(q) + self.l * vec2(q.theta.sin(), -q.theta.cos())
    }
    fn joint(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        let mut at = self.bob(q);
        for k in 0..=i {
            at += 0.3 * self.l * vec2(q.swing[k].sin(), -q.swing[k].cos());
        }
        at
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut t = 0.5 * self.m * (q.x.dt().powi(2) + self.bob(q).dt().norm_squared());
        for i in 0..3 {
            t += 0.1 * self.m * self.joint(q, i).dt().norm_squared();
        }
        t
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        let mut v = 0.5 * self.k * q.x.powi(2) + self.m * self.g * self.bob(q).y;
        for i in 0..3 {
            v += 0.2 * self.m * self.g * self.joint(q, i).y;
        }
        v
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let cart = self.cart(q);
        let wheel = |side: f64| cart + vec2(0.1 * side, -0.05);
        let joints: Vec<_> = (0..3).map(|i| self.joint(q, i)).collect();
        let mut drawing = Drawing::new()
            .ground([-2.0, -0.1], [2.0, -0.1])
            .spring([-2.0, 0.0], cart)
            .coils(cart, vec2(2.0, 0.0), 5)
            .rectangle(cart, 0.4, 0.2, 0.1 * q.theta)
            .pivot(cart)
            .line(cart, self.bob(q))
            .fill(Color::Blue)
            .polygon([wheel(-1.0), wheel(1.0), cart])
            .plain()
            .arc(cart, 0.3, -1.57, q.theta - 1.57)
            .curve(0.0, self.l, 12, |s| cart + vec2(s * q.theta.sin(), 0.1 * (s * self.k).cos()))
            .arrow(self.bob(q), self.bob(q) + 0.2 * self.bob(q).dt())
            .label(cart, "cart")
            .text(self.bob(q), "bob")
            .tail("end", joints[2], 1.5)
            .trace("bob", self.bob(q));
        for side in [-1.0, 1.0] {
            drawing = drawing.circle(wheel(side), 0.05 * self.l);
        }
        if self.k > 10.0 {
            drawing = drawing.dot(cart);
        }
        let ends = joints.iter().map(|joint| joint.x).fold(Expr::ZERO, |sum, x| sum + x);
        drawing = drawing.polyline(std::iter::once(self.bob(q)).chain(joints.iter().copied()));
        drawing = drawing.dot(vec2(ends / 3.0, 0.0));
        joints.into_iter().fold(drawing, |drawing, joint| drawing.disc(joint, 0.03))
    }
}

/// Figures of space, with figures of the plane among them.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(psi, lean, spin)]
struct Space {
    m: f64,
    r: f64,
    g: f64,
}

#[dynamics]
impl Space {
    fn frame(&self, q: &Coordinates<Self>) -> Frame {
        Frame::new(Vec3::ZERO, Mat3::rotation_z(q.psi) * Mat3::rotation_x(q.lean) * Mat3::rotation_z(q.spin))
    }
    fn tip(&self, q: &Coordinates<Self>) -> Vec3 {
        self.frame(q).point(vec3(0.0, 0.0, 3.0 * self.r))
    }
    fn top(&self, q: &Coordinates<Self>) -> RigidBody {
        let across = 0.1 * self.m * self.r.powi(2);
        let inertia = Mat3::diagonal(across, across, 1.5 * across);
        RigidBody::new(self.m, vec3(0.0, 0.0, 2.0 * self.r), inertia, self.frame(q))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        self.top(q).kinetic_energy()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * self.tip(q).z
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (frame, tip) = (self.frame(q), self.tip(q));
        let rim = |angle: f64| frame.point(self.r * vec3(angle.cos(), angle.sin(), 10.0 * self.r));
        Drawing::new()
            .axes(0.5)
            .cuboid(frame, vec3(0.0, 0.0, 0.1), [0.1, 0.2, 0.3])
            .cylinder(tip, 1.2 * tip, self.r)
            .cone([0.0, 0.0, 0.0], tip, 0.1 * self.r)
            .curve(0.0, 6.0, 20, rim)
            .spring([0.0, 0.0, 1.0], tip)
            .arrow(tip, tip + tip.dt())
            .dot(tip)
            .disc(rim(0.3), 0.02)
            .line([0.0, 0.0], [1.0, 0.5])
            .trace("tip", tip)
    }
}

/// Reactions and accelerations drawn as arrows.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x, y)]
struct Held {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Held {
    fn bob(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * self.bob(q).dt().norm_squared()
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * q.y
    }
    #[holonomic]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        self.bob(q).norm() - self.l
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let bob = self.bob(q);
        Drawing::new().line([0.0, 0.0], bob).arrow(bob, bob + 0.05 * bob.dt().dt()).disc(bob, 0.1)
    }
}

/// The numbers of a figure in the order in which pages have them.
fn numbers(figure: &Figure) -> Vec<f64> {
    let flat = |points: &[Point]| -> Vec<f64> {
        let of = |point: &Point| match point {
            Point::Planar(at) => at.to_vec(),
            Point::Spatial(at) => at.to_vec(),
        };
        points.iter().flat_map(of).collect()
    };
    match figure {
        Figure::Polyline { points, .. } => flat(points),
        Figure::Circle { center, radius, .. } => [flat(&[*center]), vec![*radius]].concat(),
        Figure::Arc { center, radius, from, to } => [flat(&[*center]), vec![*radius, *from, *to]].concat(),
        Figure::Dot { center: at }
        | Figure::Text { at, .. }
        | Figure::Trace { at, .. }
        | Figure::Pivot { at } => flat(&[*at]),
        Figure::Spring { from, to, .. } | Figure::Arrow { from, to } | Figure::Ground { from, to } => {
            flat(&[*from, *to])
        }
        Figure::Cuboid { center, faces } => flat(&[&[*center][..], faces].concat()),
        Figure::Cone { from, to, radii } => [flat(&[*from, *to]), radii.to_vec()].concat(),
        other => panic!("{other:?} is new"),
    }
}

/// Compares all figures along a motion; the number of numbers that were compared.
fn compare<M: OpenLive + Draw>(model: &M, start: State<M>) -> usize {
    assert_eq!(M::NOT_PORTABLE, &[] as &[&str], "{}", M::NAME);
    let motion = model.simulate(start).tolerance(1e-8).until(2.0).run().unwrap();
    let engine = Engine::new(&model.live(start));
    engine.run::<()>(
        "const p = Float64Array.from(MODEL.parameters, ({ value }) => value);
        const f = MODEL.functions.map(piecewise), none = new Float64Array(0);
        const k = new Float64Array(PROGRAMS.drawing.constants);
        const drawn = new Float64Array(PROGRAMS.drawing.results); undefined",
    );
    let mut compared = 0;
    for step in 0..20 {
        let state = motion.at(0.1 * f64::from(step));
        let (a, lambda) = (motion.accelerations_of(&state), motion.multipliers_of(&state));
        let [q, u, a] = [state.q(), state.u(), &a].map(|vector| vector.as_slice().to_vec());
        let found = engine.run::<Vec<Vec<f64>>>(&format!(
            "(() => {{
                const of = (list) => Float64Array.from(list);
                const [q, u, a] = [{q:?}, {u:?}, {a:?}].map(of);
                PROGRAMS.drawing.run(p, k, f, {:?}, q, u, none, none, a, of({:?}), drawn);
                return PROGRAMS.figures.map(([, places]) => places.flatMap((place) =>
                    Array.isArray(place) ? Array.from(drawn.slice(place[0], place[0] + place[1])) : []));
            }})()",
            state.t(),
            lambda.as_slice(),
        ));
        let drawing = model.draw(&motion.coordinates_of(&state));
        let shapes = drawing.shapes();
        assert_eq!(found.len(), shapes.len(), "{drawing:?}");
        for (shape, found) in shapes.iter().zip(&found) {
            let expected = numbers(&shape.figure);
            for (a, b) in expected.iter().zip(found) {
                assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{shape:?} is {found:?} in a page");
            }
            // A tail is followed by its seconds.
            assert!(found.len() - expected.len() <= 1, "{shape:?} is {found:?} in a page");
            compared += expected.len();
        }
    }
    compared
}

#[test]
fn drawings_are_those_of_rust() {
    let plane = Plane { m: 1.0, l: 0.7, k: 20.0, g: 9.81 };
    let (space, held) = (Space { m: 0.5, r: 0.2, g: 9.81 }, Held { m: 0.7, l: 1.3, g: 9.81 });
    let start = plane.state().x(0.2).theta(0.8).swing([0.3, -0.5, 1.0]).build().unwrap();
    let compared = [
        compare(&plane, start),
        compare(&space, space.state().lean(0.5).spin_rate(20.0).build().unwrap()),
        compare(&held, held.state().x(1.3).build().unwrap()),
    ];
    eprintln!("{compared:?} numbers");
    assert!(compared.iter().all(|&count| count > 100), "{compared:?}");
}
