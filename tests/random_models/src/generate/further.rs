//! Speeds, drawings, joints and constraints on velocities that are not integrable, drawn by numbers of their
//! own: models without them are the same as before there were any.

use std::fmt::Write;

use super::*;

/// Joints with what they return.
const JOINTS: &[(&str, &str)] = &[
    ("revolute", "[Expr; 5]"),
    ("prismatic", "[Expr; 5]"),
    ("screw", "[Expr; 5]"),
    ("cylindrical", "[Expr; 4]"),
    ("universal", "[Expr; 4]"),
    ("planar", "[Expr; 3]"),
    ("spherical", "Vec3"),
];

impl Draft<'_> {
    pub(super) fn further(&mut self) {
        let jets: Vec<String> = self.coordinates.iter().flat_map(Coordinate::jets).collect();
        let is_free = !self.functions.contains("holonomic");
        self.scope.corners = false;
        if self.r.one_in(12) {
            let name = self.names.function(self.r);
            let place = {
                let (mut w, scope) = self.writer();
                w.vec2(&scope, 1)
            };
            let (vec2, drawing) = (self.ty("vec2"), self.ty("Drawing"));
            let body = format!("{drawing}::new().line({vec2}({}, 0.5), {place})", jets[0]);
            self.function("drawing", &name, "Drawing", &body);
        }
        if is_free && !self.units && self.r.one_in(8) {
            self.speeds(&jets);
        } else if let [a, b, c, ..] = &jets[..]
            && is_free
            && self.r.one_in(3)
        {
            let name = self.names.function(self.r);
            let kind = self.r.pick(&["nonholonomic", "nonholonomic(switched)"]);
            let body = format!("{a}.dt() - {c}.sin() * {b}.dt()");
            self.function(kind, &name, "Expr", &body);
        }
    }

    /// As many speeds as coordinates: by a triangular matrix, and what depends on the place and on time.
    fn speeds(&mut self, jets: &[String]) {
        let name = self.coordinate_name();
        let mut each = Vec::new();
        for (i, own) in jets.iter().enumerate() {
            let mut speed = format!("(1.3 + 0.4 * {own}.sin()) * {own}.dt()");
            for other in &jets[i + 1..] {
                let _ = write!(speed, " + 0.3 * {other}.cos() * {other}.dt()");
            }
            each.push(format!("{speed} + {}", self.jet(1)));
        }
        let expr = self.ty("Expr");
        let (returns, body) = match jets.len() {
            1 => (expr, each.swap_remove(0)),
            n => (format!("[{expr}; {n}]"), format!("[{}]", each.join(", "))),
        };
        self.function("kinematic", &name, &returns, &body);
        self.speeds = Some((name, jets.len()));
    }

    /// A body on a joint, in coordinates of its place and attitude.
    pub(super) fn jointed(&mut self) {
        let angles = self.coordinate_name();
        self.alone(vec![(self.coordinates[0].name.clone(), 3), (angles.clone(), 3)]);
        let (x, m, k) = (
            self.coordinates[0].name.clone(),
            self.scalars[0].clone(),
            self.scalars[self.scalars.len() - 1].clone(),
        );
        let (joint, returns) = JOINTS[self.r.below(JOINTS.len())];
        let [vec3, mat3, frame, body, inertia, order, joints] =
            ["vec3", "Mat3", "Frame", "RigidBody", "Inertia", "EulerSequence", "Joint"]
                .map(|word| self.ty(word));
        let place = format!("{vec3}(q.{x}[0], q.{x}[1], q.{x}[2])");
        let moving = format!(
            "{frame}::new({place}, {mat3}::euler({order}::{}, q.{angles}))",
            self.r.pick(&["Zyx", "Zxz", "Xyz"])
        );
        let turned = |axis: &str, angle: f64| format!("{mat3}::rotation_{axis}({angle:?})");
        let fixed = format!("{frame}::new({vec3}(0.1, -0.2, 0.3), {})", turned("x", 0.4));
        let own = format!("{moving}.frame({vec3}(0.3, 0.1, -0.2), {})", turned("y", 0.7));
        let lead = if joint == "screw" { ", 0.3" } else { "" };
        self.function(
            "kinetic",
            "moving",
            "Expr",
            &format!(
                "{body}::new(self.{m}, {vec3}(0.1, 0.2, -0.3), {inertia}::cuboid(self.{m}, 0.4, 0.5, \
                0.9), {moving}).kinetic_energy()"
            ),
        );
        self.function(
            "potential",
            "weight",
            "Expr",
            &format!("self.{m} * self.{k} * {place}.z + q.{angles}[1].sin()"),
        );
        self.function("holonomic", "joint", returns, &format!("{joints}::{joint}({fixed}, {own}{lead})"));
        self.function("output", "held", returns, "q.reaction(Self::joint)");
    }
}
