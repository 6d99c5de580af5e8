//! Bodies in space that hang on one another by coordinates of their joints, sometimes closed to a loop,
//! sometimes with generalized speeds.

use super::spatial::{INERTIAS, SEQUENCES};
use super::*;

impl Draft<'_> {
    pub(super) fn links(&mut self) {
        let n = 2 + self.r.below(3);
        // Names of the single coordinates, with whether they are angles.
        let mut all: Vec<(String, bool)> = Vec::new();
        // For every link, which of them move it.
        let mut moving: Vec<Vec<usize>> = Vec::new();
        for i in 0..n {
            let placed = self.placed();
            let parent = if i > 0 && !self.r.one_in(4) { i } else { self.r.below(i + 1) };
            let mut by = parent.checked_sub(1).map_or_else(Vec::new, |k| moving[k].clone());
            let before = match parent {
                0 => format!("Frame::new({placed})"),
                k => format!("self.link_{}(q).frame({placed})", k - 1),
            };
            let known = all.len();
            let moved = self.moved(i, &mut all);
            by.extend(known..all.len());
            moving.push(by);
            self.function("", &format!("link_{i}"), "Frame", &format!("{before}.frame({moved})"));
            let center = self.vector();
            let inertia = self.r.pick(&INERTIAS);
            let body = format!("RigidBody::new(self.m, self.l * {center}, {inertia}, self.link_{i}(q))");
            self.function("", &format!("body_{i}"), "RigidBody", &body);
        }
        let terms = |what: &str| (0..n).map(|i| format!("self.body_{i}(q).{what}")).collect::<Vec<_>>();
        let kinetic = terms("kinetic_energy()").join(" + ");
        self.function("kinetic", "kinetic", "Expr", &kinetic);
        let weight = terms("potential_energy(vec3(0.0, 0.2 * self.g, -self.g))").join(" + ");
        self.function("potential", "weight", "Expr", &weight);
        if self.r.one_in(2) {
            self.closed(n - 1, moving[n - 1].len());
        }
        if self.r.one_in(3) {
            // What the closure determines has no speed of its own.
            let determined = &moving[n - 1][moving[n - 1].len() - self.rows..];
            let mut left = all.clone();
            determined.iter().rev().for_each(|k| drop(left.remove(*k)));
            self.rates(&left);
        }
        self.rest_in_space(n - 1, "link_", "body_");
    }

    /// Coordinates of a joint: what a frame is moved by.
    fn moved(&mut self, i: usize, all: &mut Vec<(String, bool)>) -> String {
        let axis = self.r.pick(&["x", "y", "z"]);
        let along = axis.to_uppercase();
        let (s, a) = (format!("s{i}"), format!("a{i}"));
        let (slides, angles) = [(0, 1), (0, 1), (0, 1), (1, 0), (1, 1), (0, 2), (0, 3)][self.r.below(7)];
        if slides > 0 {
            self.coordinate(&s, Of::One("m"));
            all.push((s.clone(), false));
        }
        match angles {
            0 => {}
            1 => {
                self.coordinate(&a, Of::One("rad"));
                all.push((a.clone(), true));
            }
            many => {
                self.coordinate(&a, Of::Many("rad", many));
                all.extend((0..many).map(|k| (format!("{a}[{k}]"), true)));
            }
        }
        let shift = if slides > 0 { format!("q.{s} * Vec3::{along}") } else { "self.l * Vec3::Z".to_owned() };
        let turn = match angles {
            0 => "Mat3::IDENTITY".to_owned(),
            1 => format!("Mat3::rotation_{axis}(q.{a})"),
            2 => format!("Mat3::rotation_z(q.{a}[0]) * Mat3::rotation_x(q.{a}[1])"),
            _ => format!("Mat3::euler(EulerSequence::{}, q.{a})", self.r.pick(&SEQUENCES)),
        };
        format!("{shift}, {turn}")
    }

    /// The last link is held somewhere.
    fn closed(&mut self, last: usize, coordinates: usize) {
        let tip = format!("self.link_{last}(q).point(self.l * {})", self.vector());
        let (returns, body, rows) = match self.r.below(3) {
            0 => ("Vec3", format!("{tip} - self.l * {}", self.vector()), 3),
            1 => ("Expr", format!("({tip}).norm() - 0.9 * self.l"), 1),
            _ => ("Expr", format!("({tip}).dot(vec3(0.3, 0.5, -0.4)) - 0.3 * self.l"), 1),
        };
        if coordinates > rows + 1 {
            self.rows += rows;
            self.function("holonomic", "closure", returns, &body);
            self.function("output", "held", returns, "q.reaction(Self::closure)");
        }
    }

    /// A speed for each of these coordinates.
    fn rates(&mut self, left: &[(String, bool)]) {
        for (i, (own, is_angle)) in left.iter().enumerate() {
            let mut speed = format!("{} * q.{own}.dt()", self.number(0.6, 1.8).replace("0.0", "0.7"));
            for (other, other_is_angle) in &left[i + 1..] {
                if is_angle == other_is_angle && self.r.one_in(2) {
                    let factor = if *other_is_angle { format!("q.{other}.cos()") } else { "0.7".to_owned() };
                    let _ = write!(speed, " + 0.3 * {factor} * q.{other}.dt()");
                }
            }
            let name = format!("speed_{i}");
            self.function("kinematic", &name, "Expr", &speed);
            self.speeds.push((name, Of::One(if *is_angle { "rad / s" } else { "m / s" })));
        }
    }
}
