//! Theo Jansen's walking linkage: one leg driven by its crank, and a machine of six pairs of legs that walks.
//!
//!     crank pin + upper rod = hip + triangle
//!     crank pin + lower rod = hip + strut
//!     hip + triangle + coupler = hip + strut + shin
//!
//! Each leg has three closed loops of thirteen lengths (Jansen's "holy numbers"). With the crank driven
//! nothing is free, and everything is solved from Φ(q, t) = 0. The machine's twelve legs hang on one
//! crankshaft with six throws at 60° and a leg on either side. It walks in the frame of its body: the lowest
//! foot stands on the track, so the track moves backward with that foot.

mod common;
use std::f64::consts::TAU;

use dynamics::error::StateError;
use dynamics::integrate::root;
use dynamics::kinematics::KinematicMotion;
use dynamics::output::{Animation, Axis, Chart, Film, Panel};
use dynamics::prelude::*;

macro_rules! linkage {
    ($(#[$doc:meta])* $name:ident, $legs:literal) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(
            crank: rad,
            upper: [rad; $legs],
            triangle: [rad; $legs],
            lower: [rad; $legs],
            strut: [rad; $legs],
            coupler: [rad; $legs],
            shin: [rad; $legs]
        )]
        #[units(
            a: m, b: m, c: m, d: m, e: m, f: m, g: m, h: m, i: m, j: m, k: m, l: m, m: m,
            joint: kg, rod: kg * m^2, inertia: kg * m^2, omega: rad / s
        )]
        struct $name {
            a: f64, b: f64, c: f64, d: f64, e: f64, f: f64, g: f64,
            h: f64, i: f64, j: f64, k: f64, l: f64, m: f64,
            /// At each of the five joints of a leg.
            joint: f64,
            /// Moment of inertia of each of the three rods that are no part of a triangle.
            rod: f64,
            inertia: f64,
            omega: f64,
            /// Angle of the throw of each leg.
            throw: [f64; $legs],
            /// −1 for legs to the left, 1 for those to the right: mirrored.
            side: [f64; $legs],
        }

        #[dynamics]
        impl $name {
            fn reach(&self, n: usize, length: f64, angle: Expr) -> Vec2 {
                length * vec2(self.side[n] * angle.cos(), angle.sin())
            }
            fn pin(&self, q: &Coordinates<Self>, n: usize) -> Vec2 {
                let angle = q.crank + self.throw[n];
                self.m * vec2(angle.cos(), angle.sin())
            }
            fn hip(&self, n: usize) -> Vec2 {
                vec2(self.side[n] * self.a, -self.l)
            }
            fn knee(&self, q: &Coordinates<Self>, n: usize) -> Vec2 {
                self.hip(n) + self.reach(n, self.b, q.triangle[n])
            }
            /// The outer corner of the upper triangle, whose sides are b, d and e.
            fn shoulder(&self, q: &Coordinates<Self>, n: usize) -> Vec2 {
                let cosine = (self.b.powi(2) + self.d.powi(2) - self.e.powi(2)) / (2.0 * self.b * self.d);
                let corner = cosine.acos();
                self.hip(n) + self.reach(n, self.d, q.triangle[n] - corner)
            }
            fn heel(&self, q: &Coordinates<Self>, n: usize) -> Vec2 {
                self.hip(n) + self.reach(n, self.c, q.strut[n])
            }
            fn calf(&self, q: &Coordinates<Self>, n: usize) -> Vec2 {
                self.heel(q, n) + self.reach(n, self.g, q.shin[n])
            }
            /// The lowest corner of the lower triangle, whose sides are g, h and i.
            fn foot(&self, q: &Coordinates<Self>, n: usize) -> Vec2 {
                let cosine = (self.g.powi(2) + self.i.powi(2) - self.h.powi(2)) / (2.0 * self.g * self.i);
                let corner = cosine.acos();
                self.heel(q, n) + self.reach(n, self.i, q.shin[n] - corner)
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = 0.5 * self.inertia * q.crank.dt().powi(2);
                for n in 0..$legs {
                    let speeds = self.knee(q, n).dt().norm_squared()
                        + self.shoulder(q, n).dt().norm_squared()
                        + self.heel(q, n).dt().norm_squared()
                        + self.calf(q, n).dt().norm_squared()
                        + self.foot(q, n).dt().norm_squared();
                    let turns = q.upper[n].dt().powi(2) + q.lower[n].dt().powi(2) + q.coupler[n].dt().powi(2);
                    sum += 0.5 * self.joint * speeds + 0.5 * self.rod * turns;
                }
                sum
            }
            #[holonomic]
            fn upper_loop(&self, q: &Coordinates<Self>) -> [Vec2; $legs] {
                let mut gaps = [Vec2::ZERO; $legs];
                for n in 0..$legs {
                    gaps[n] = self.pin(q, n) + self.reach(n, self.j, q.upper[n]) - self.knee(q, n);
                }
                gaps
            }
            #[holonomic]
            fn lower_loop(&self, q: &Coordinates<Self>) -> [Vec2; $legs] {
                let mut gaps = [Vec2::ZERO; $legs];
                for n in 0..$legs {
                    gaps[n] = self.pin(q, n) + self.reach(n, self.k, q.lower[n]) - self.heel(q, n);
                }
                gaps
            }
            #[holonomic]
            fn back_loop(&self, q: &Coordinates<Self>) -> [Vec2; $legs] {
                let mut gaps = [Vec2::ZERO; $legs];
                for n in 0..$legs {
                    gaps[n] = self.shoulder(q, n) + self.reach(n, self.f, q.coupler[n]) - self.calf(q, n);
                }
                gaps
            }
            #[holonomic]
            fn drive(&self, q: &Coordinates<Self>) -> Expr {
                q.crank - self.omega * q.t
            }
            #[drawing]
            fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
                let mut drawing = Drawing::new();
                for n in 0..$legs {
                    let (pin, hip) = (self.pin(q, n), self.hip(n));
                    let (knee, shoulder, heel) = (self.knee(q, n), self.shoulder(q, n), self.heel(q, n));
                    let (calf, foot) = (self.calf(q, n), self.foot(q, n));
                    drawing = drawing
                        .color(Color::Blue)
                        .polygon([hip, knee, shoulder])
                        .polygon([heel, calf, foot])
                        .plain()
                        .line(Vec2::ZERO, pin)
                        .line(pin, knee)
                        .line(pin, heel)
                        .line(hip, heel)
                        .line(shoulder, calf)
                        .dot(foot)
                        .tail("foot", foot, 1.0);
                }
                drawing.pivot(Vec2::ZERO)
            }
        }

        impl $name {
            /// Jansen's lengths, in parts of a metre, at one turn per second; `legs` are throw and side of
            /// each.
            fn holy(legs: impl Fn(usize) -> [f64; 2]) -> Self {
                let leg: [[f64; 2]; $legs] = std::array::from_fn(legs);
                Self {
                    a: 0.380, b: 0.415, c: 0.393, d: 0.401, e: 0.558, f: 0.394, g: 0.367,
                    h: 0.657, i: 0.490, j: 0.500, k: 0.619, l: 0.078, m: 0.150,
                    joint: 0.1, rod: 2e-3, inertia: 0.01, omega: TAU,
                    throw: leg.map(|[throw, _]| throw),
                    side: leg.map(|[_, side]| side),
                }
            }
            /// Assembled with the knees up, the heels down and the shins bent outward.
            fn start(&self) -> Result<State<Self>, StateError> {
                let near = |angle: f64| [angle; $legs];
                self.state()
                    .crank(0.0)
                    .upper_guess(near(0.7))
                    .triangle_guess(near(1.9))
                    .lower_guess(near(-0.8))
                    .strut_guess(near(-1.9))
                    .coupler_guess(near(-2.0))
                    .shin_guess(near(0.5))
                    .assemble()
            }
            /// Largest gap in a loop.
            fn gap(&self, state: &State<Self>) -> f64 {
                self.residual(state).amax()
            }
        }
    };
}

linkage!(
    /// A leg of Theo Jansen's beach animals, in his "holy numbers": the foot goes straight along the ground
    /// for more than a third of the turn, and is lifted back. Change a length by a few per cent, and it
    /// limps.
    Leg,
    1
);
linkage!(
    /// Six throws with a leg to either side.
    Machine,
    12
);

/// The walk of the machine: where its body is on the track.
struct Walk<'w, 'm> {
    motion: &'w KinematicMotion<'m, Machine>,
    /// Time, standing foot and the place on the track where it stands, from its touching down.
    stands: Vec<(f64, usize, f64)>,
}

impl Walk<'_, '_> {
    fn foot(&self, state: &State<Machine>, n: usize) -> Vec2<f64> {
        // Of the coordinates only positions are looked at.
        self.motion.model().foot(&Machine::coordinates_with(state, &state.u, &[]), n).value()
    }
    fn lowest(&self, state: &State<Machine>) -> usize {
        let height = |n: &usize| self.foot(state, *n).y;
        (0..12).min_by(|a, b| height(a).total_cmp(&height(b))).unwrap_or(0)
    }
    /// When one foot comes down to the height of another one.
    fn crossing(&self, from: f64, to: f64, standing: usize, next: usize) -> f64 {
        let above = |t: f64| {
            let state = self.motion.at(t);
            self.foot(&state, next).y - self.foot(&state, standing).y
        };
        root(above, (from, above(from)), (to, above(to)), 1e-14 * to)
    }
    /// Follows the lowest foot: when another one becomes lowest it touches down, at a time found as a root.
    fn of<'w, 'm>(motion: &'w KinematicMotion<'m, Machine>) -> Walk<'w, 'm> {
        let mut walk = Walk { motion, stands: Vec::new() };
        let first = walk.lowest(&motion.start());
        walk.stands.push((motion.start_time(), first, walk.foot(&motion.start(), first).x));
        let mut before = motion.start_time();
        for state in motion.states() {
            let mut standing = walk.stands[walk.stands.len() - 1].1;
            while walk.lowest(&state) != standing {
                // Whichever is lowest now, an earlier one may have been lowest in between: the first to come
                // down counts.
                let mut next = walk.lowest(&state);
                let mut touch = motion.at(walk.crossing(before, state.t, standing, next));
                while ![standing, next].contains(&walk.lowest(&touch)) {
                    next = walk.lowest(&touch);
                    touch = motion.at(walk.crossing(before, touch.t, standing, next));
                }
                let place = walk.body(&touch) + walk.foot(&touch, next).x;
                walk.stands.push((touch.t, next, place));
                (standing, before) = (next, touch.t);
            }
            before = state.t;
        }
        walk
    }
    /// Where the body is: the standing foot does not move.
    fn body(&self, state: &State<Machine>) -> f64 {
        let at = self.stands.partition_point(|(t, ..)| *t <= state.t).max(1) - 1;
        let (_, foot, place) = self.stands[at];
        place - self.foot(state, foot).x
    }
}

impl Film for Walk<'_, '_> {
    fn title(&self) -> String {
        "Jansen's machine".into()
    }
    fn method(&self) -> String {
        self.motion.method().to_string()
    }
    fn summary(&self) -> String {
        self.motion.summary().to_string()
    }
    fn span(&self) -> [f64; 2] {
        [0.0, 8.0]
    }
    fn quantities(&self) -> Vec<(String, String)> {
        vec![("way".into(), "m".into()), ("height of the crank".into(), "m".into())]
    }
    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        for state in self.motion.sample(times.iter().copied()) {
            let way = self.body(&state);
            let height = -self.foot(&state, self.lowest(&state)).y;
            // The body stays in the picture, the track runs backward under it.
            let mut track = Drawing::new().color(Color::Faint).line([-1.5, -height], [1.5, -height]);
            for post in 0..12 {
                let x = (0.25 * f64::from(post) - way).rem_euclid(3.0) - 1.5;
                track = track.line([x, -height], [x - 0.03, -height - 0.05]);
            }
            let coordinates = self.motion.coordinates_of(&state);
            show(&track.with(self.motion.model().drawing(&coordinates)), &[way, height]);
        }
    }
}

/// The live page of one leg.
pub(crate) fn live() -> common::Page {
    let leg = Leg::holy(|_| [0.0, -1.0]);
    let mut page = leg
        .live(leg.start()?)
        .title("Jansen's leg")
        .range("omega", 0.5, 12.0)
        .hold(["joint", "rod", "inertia", "throw[0]", "side[0]"]);
    for name in ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m"] {
        let index = Leg::PARAMETERS.iter().position(|parameter| parameter.name == name);
        let length = index.and_then(|index| leg.parameter(index)).ok_or("a length")?;
        page = page.range(name, 0.95 * length, 1.05 * length);
    }
    Ok(page.phase("shin[0]").finish()?)
}

fn main() -> common::Outcome {
    let mut files = common::Files::of("jansen");

    let leg = Leg::holy(|_| [0.0, -1.0]);
    let motion = leg.kinematics(leg.start()?).until(60.0).every(0.01).run()?;
    println!("{}", motion.summary());
    let foot = |state: &State<Leg>| leg.foot(&motion.coordinates_of(state), 0).value();
    let gap = motion.states().map(|state| leg.gap(&state)).fold(0.0, f64::max);
    let back = (foot(&motion.start()) - foot(&motion.end())).norm();
    println!("60 turns of one leg: loops closed to {gap:.1e} m, the foot comes back to {back:.1e} m\n");
    assert!(gap < 1e-14 && back < 1e-12);

    let path: Vec<[f64; 2]> = motion.sample(common::times(1.0, 400)).map(|s| foot(&s).to_array()).collect();
    let lowest = path.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let flat = path.iter().filter(|p| p[1] < lowest + 0.01).count() as f64 / 400.0;
    println!("the foot is within 1 cm of the ground for {:.0} % of a turn", 100.0 * flat);
    assert!(flat > 0.3);
    // Work of the drive over a turn: none, without gravity and friction.
    let turn = leg.kinematics(leg.start()?).until(1.0).run()?;
    let account = turn.work();
    println!("{account}\n");
    assert!(
        account.closure_error.abs() < 1e-10 * account.scale
            && account.forces[0].work.abs() < 1e-10 * account.scale
    );

    let machine = Machine::holy(|n| [TAU * (n / 2) as f64 / 6.0, if n % 2 == 0 { -1.0 } else { 1.0 }]);
    let motion = machine.kinematics(machine.start()?).until(60.0).every(0.02).run()?;
    println!("{}", motion.summary());
    let gap = motion.states().map(|state| machine.gap(&state)).fold(0.0, f64::max);
    assert!(gap < 1e-13, "{gap:e}");
    let walk = Walk::of(&motion);
    let way = |t: f64| walk.body(&motion.at(t));
    let stride = way(1.0) - way(0.0);
    let drift =
        (1..=60).map(|turn| (way(f64::from(turn)) - f64::from(turn) * stride).abs()).fold(0.0, f64::max);
    println!(
        "60 turns of the machine: loops closed to {gap:.1e} m, {:.3} m in strides of {stride:.6} m that \
         differ by {drift:.1e} m at most, {} footfalls",
        way(60.0),
        walk.stands.len() - 1
    );
    assert!(stride.abs() > 0.5 && drift < 1e-9);
    // Every turn is the same.
    assert_eq!((walk.stands.len() - 1) % 60, 0);

    let curve = |points: &[[f64; 2]]| points.iter().map(|p| (p[0], p[1])).collect::<Vec<_>>();
    let samples: Vec<State<Machine>> = motion.sample(common::times(1.0, 600)).collect();
    Chart::new("Jansen's linkage")
        .panel(
            Panel::new(Axis::new("x in m"), Axis::new("y in m"))
                .line("path of a foot", curve(&path))
                .equal_axes(),
        )
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("height of the crank in m"))
                .line("walking", samples.iter().map(|s| (s.t, -walk.foot(s, walk.lowest(s)).y))),
        )
        .panel(
            Panel::new(Axis::new("time in s"), Axis::new("torque of the drive in N·m"))
                .line("twelve legs", samples.iter().map(|s| (s.t, motion.multipliers_of(s)[72]))),
        )
        .write_svg(files.path("jansen.svg"))?;
    Animation::new().add(&walk, "").write_html(files.path("walk.html"))?;
    files.live(live()?)?;
    files.list();
    Ok(())
}
