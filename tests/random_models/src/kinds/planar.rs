//! Bodies of the plane, each with a place and an angle, on one another by joints.

use super::*;

/// Joints with what they return, and their rows.
const JOINTS: [(&str, &str, usize); 4] = [
    ("revolute", "[Expr; 2]", 2),
    ("slot", "Expr", 1),
    ("prismatic", "[Expr; 2]", 2),
    ("weld", "[Expr; 3]", 3),
];

/// A joint that was written.
struct PlanarJoint {
    name: String,
    returns: &'static str,
    role: &'static str,
    /// As in [`Draft::planar_joint`].
    before: usize,
    rows: usize,
}

/// How freely the last body moves against the world, by the joints on the way to it.
fn freedom(joints: &[Option<PlanarJoint>]) -> usize {
    let (mut total, mut at) = (0, joints.len());
    while let Some(i) = at.checked_sub(1) {
        let Some(joint) = &joints[i] else { return 3 };
        total += 3 - joint.rows;
        at = joint.before;
    }
    total
}

impl Draft<'_> {
    pub(super) fn planar(&mut self) {
        let n = 2 + self.r.below(3);
        self.planar_bodies(n);
        let mut joints: Vec<Option<PlanarJoint>> = Vec::new();
        for i in 0..n {
            // The first body may move freely.
            let is_free = i == 0 && self.r.one_in(3);
            let before = self.r.below(i + 1);
            joints.push(if is_free { None } else { self.planar_joint(n, i, before, JOINTS.len()) });
        }
        if self.r.one_in(3) && freedom(&joints) > 2 {
            // A loop, by what holds no angle: two joints that do may contradict each other.
            joints.push(self.planar_joint(n, n - 1, 0, 2));
        }
        if let Some(PlanarJoint { name, returns, role, .. }) = joints.into_iter().flatten().next() {
            let first = |of: &str| if returns == "Expr" { of.to_owned() } else { format!("{of}[0]") };
            if role == "holonomic" && self.r.one_in(3) {
                let row = first(&format!("self.{name}(q)"));
                // In every state, or where it holds.
                let body = match self.r.below(3) {
                    0 => format!("2.0 * {row}"),
                    1 => format!("{row} * (1.2 + 0.4 * q.a[0].sin())"),
                    _ => format!("-{row}"),
                };
                self.function("redundant", "again", "Expr", &body);
            }
            self.function("output", "held", returns, &format!("q.reaction(Self::{name})"));
            if self.r.one_in(4) {
                // The reaction is of the first row, a force or what the unit of the row makes of it.
                let reaction = first(&format!("q.reaction(Self::{name})"));
                let size = format!("-self.mu * self.l * {reaction}.abs() * (q.a[0].dt() / self.w).tanh()");
                self.along("rubbing", "q.a[0]", &size);
            }
        }
        self.planar_rest(n);
    }

    /// Coordinates, frames, bodies, energies.
    fn planar_bodies(&mut self, n: usize) {
        self.coordinate("x", Of::Many("m", n));
        self.coordinate("y", Of::Many("m", n));
        self.coordinate("a", Of::Many("rad", n));
        self.of_body("frame", "PlanarFrame", "PlanarFrame::new(vec2(q.x[i], q.y[i]), q.a[i])");
        let (along, across, round) = (self.number(-0.4, 0.4), self.number(-0.4, 0.4), self.number(0.1, 0.8));
        let body = format!(
            "let mass = self.m * (1.0 + 0.3 * i as f64);\n        PlanarBody::new(mass, self.l * \
             vec2({along}, {across}), (0.1 + {round}) * mass * self.l.powi(2), self.frame(q, i))"
        );
        self.of_body("body", "PlanarBody", &body);
        let kinetic = self.over(n, "self.body(q, i).kinetic_energy()");
        self.function("kinetic", "kinetic", "Expr", &kinetic);
        let weight = self.over(n, "self.body(q, i).potential_energy(-self.g * Vec2::Y)");
        self.function("potential", "weight", "Expr", &weight);
    }

    /// One of the first few joints of body `i` with body `before` − 1, or with the world before all, unless
    /// no freedom would be left.
    fn planar_joint(&mut self, n: usize, i: usize, before: usize, few: usize) -> Option<PlanarJoint> {
        let (joint, returns, rows) = JOINTS[self.r.below(few)];
        if self.rows + rows >= 3 * n {
            return None;
        }
        self.rows += rows;
        let place = |draft: &mut Self| {
            let (x, y) = (draft.number(-0.8, 0.8), draft.number(-0.8, 0.8));
            let turn = if draft.r.one_in(2) { "0.0".to_owned() } else { draft.number(-0.9, 0.9) };
            format!("self.l * vec2({x}, {y}), {turn}")
        };
        let (there, own) = (place(self), place(self));
        let from = match before {
            0 => format!("PlanarFrame::new({there})"),
            k => format!("self.frame(q, {}).frame({there})", k - 1),
        };
        let own = format!("self.frame(q, {i}).frame({own})");
        let name = format!("joint_{}", self.rows);
        let role = if self.r.one_in(8) { "holonomic(switched)" } else { "holonomic" };
        let body = if self.r.one_in(2) {
            format!("PlanarJoint::{joint}({from}, {own})")
        } else {
            format!("PlanarJoint::{joint}({own}, {from})")
        };
        self.function(role, &name, returns, &body);
        Some(PlanarJoint { name, returns, role, before, rows })
    }

    /// Springs, dampers, forces, outputs, an event.
    fn planar_rest(&mut self, n: usize) {
        let last = n - 1;
        if self.r.one_in(2) {
            let body = format!(
                "0.5 * self.k * (self.frame(q, 0).origin() - self.frame(q, \
                 {last}).point(self.l * Vec2::X)).norm_squared()"
            );
            self.function("potential", "spring", "Expr", &body);
        }
        if self.r.one_in(2) {
            self.function(
                "dissipation",
                "air",
                "Expr",
                "0.5 * self.c * vec2(q.x[0], q.y[0]).dt().norm_squared()",
            );
        }
        if self.r.one_in(2) {
            let place = format!("self.frame(q, {last}).point(self.l * vec2(0.3, -0.2))");
            let size = format!("self.k * self.l * (q.a[0].cos() * Vec2::X + self.frame(q, {last}).y())");
            self.at("push", "Vec2", &place, &size);
        }
        if self.r.one_in(3) {
            self.inputs.push(("motor".to_owned(), Of::One("N * m")));
            self.along("drive", &format!("q.a[{last}] - q.a[0]"), "q.motor - self.torque * q.a[0].sin()");
        }
        if self.r.one_in(3) {
            let moment = format!("self.body(q, {last}).moment(self.torque * q.a[0].cos())");
            self.function("force", "moment", "Force", &moment);
        }
        let outputs = [
            ("momentum", "Vec2", format!("self.body(q, {last}).momentum()")),
            ("spin", "Expr", format!("self.body(q, {last}).angular_momentum(self.frame(q, 0).origin())")),
            ("seen", "Vec2", format!("self.frame(q, 0).acceleration_in(self.frame(q, {last}).origin())")),
            ("carried", "Vec2", format!("self.frame(q, {last}).carried_velocity(self.l * Vec2::X)")),
        ];
        for (name, returns, body) in outputs {
            if self.r.one_in(3) {
                self.function("output", name, returns, &body);
            }
        }
        if self.r.one_in(4) {
            self.function("event", "level", "Expr", &format!("q.y[{last}] - 0.3 * self.l"));
        }
    }
}
