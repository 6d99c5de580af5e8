//! Bodies in space, each with six or seven coordinates, on one another by joints.

use super::*;

/// Joints with what they return, and their rows.
const JOINTS: [(&str, &str, usize); 8] = [
    ("revolute", "[Expr; 5]", 5),
    ("prismatic", "[Expr; 5]", 5),
    ("screw", "[Expr; 5]", 5),
    ("cylindrical", "[Expr; 4]", 4),
    ("universal", "[Expr; 4]", 4),
    ("planar", "[Expr; 3]", 3),
    ("spherical", "Vec3", 3),
    ("weld", "[Expr; 6]", 6),
];

pub(super) const SEQUENCES: [&str; 12] =
    ["Xyz", "Xzy", "Yxz", "Yzx", "Zxy", "Zyx", "Xyx", "Xzx", "Yxy", "Yzy", "Zxz", "Zyz"];

/// Inertias of a body of mass `self.m` and size `self.l`.
pub(super) const INERTIAS: [&str; 6] = [
    "Inertia::cuboid(self.m, 0.4 * self.l, 0.5 * self.l, 0.9 * self.l)",
    "Inertia::cylinder(self.m, 0.3 * self.l, 0.8 * self.l)",
    "Inertia::sphere(self.m, 0.4 * self.l)",
    "Inertia::offset(self.m, self.l * vec3(0.2, -0.1, 0.3)) + \
    Inertia::cone(self.m, 0.3 * self.l, 0.5 * self.l)",
    "self.m * self.l.powi(2) * Mat3::diagonal(0.3, 0.4, 0.5)",
    "Inertia::turned(Inertia::plate(self.m, 0.5 * self.l, 0.8 * self.l), Mat3::rotation_x(0.4))",
];

impl Draft<'_> {
    pub(super) fn spatial(&mut self) {
        let n = [1, 1, 2, 2, 2, 3][self.r.below(6)];
        let freedom = 6 * n;
        let mut kinetic = Vec::new();
        let mut weight = Vec::new();
        for i in 0..n {
            let frame = self.free_body(i);
            let center = self.vector();
            let inertia = self.r.pick(&INERTIAS);
            let body = format!("RigidBody::new(self.m, self.l * {center}, {inertia}, self.{frame}(q))");
            self.function("", &format!("body_{i}"), "RigidBody", &body);
            kinetic.push(format!("self.body_{i}(q).kinetic_energy()"));
            weight.push(format!("self.body_{i}(q).potential_energy(-self.g * Vec3::Z)"));
        }
        self.function("kinetic", "kinetic", "Expr", &kinetic.join(" + "));
        self.function("potential", "weight", "Expr", &weight.join(" + "));
        let mut held = None;
        for i in 0..n {
            let (joint, returns, rows) = JOINTS[self.r.below(JOINTS.len())];
            if self.rows + rows >= freedom || i == 0 && n > 1 && self.r.one_in(3) {
                continue;
            }
            self.rows += rows;
            // Axes of a joint along those of the body would hold it where its angles lock.
            let (there, own) = (self.placed(), self.askew());
            let before = match self.r.below(i + 1) {
                0 => format!("Frame::new({there})"),
                k => format!("self.frame_{}(q).frame({there})", k - 1),
            };
            let lead = if joint == "screw" { ", 0.4 * self.l" } else { "" };
            let body = format!("Joint::{joint}({before}, self.frame_{i}(q).frame({own}){lead})");
            self.function("holonomic", &format!("joint_{i}"), returns, &body);
            held = held.or(Some((format!("joint_{i}"), returns)));
        }
        if let Some((name, returns)) = held {
            self.function("output", "held", returns, &format!("q.reaction(Self::{name})"));
        }
        self.rest_in_space(n - 1, "frame_", "body_");
    }

    /// Coordinates of a free body: in angles, or in Euler parameters.
    fn free_body(&mut self, i: usize) -> String {
        self.coordinate(&format!("r{i}"), Of::Many("m", 3));
        let place = format!("vec3(q.r{i}[0], q.r{i}[1], q.r{i}[2])");
        let rotation = if self.r.one_in(3) {
            self.coordinate(&format!("e{i}"), Of::Many("1", 4));
            let norm = format!("EulerParameters::new(q.e{i}).norm_constraint()");
            self.function("holonomic", &format!("norm_{i}"), "Expr", &norm);
            format!("EulerParameters::new(q.e{i}).rotation()")
        } else {
            self.coordinate(&format!("a{i}"), Of::Many("rad", 3));
            let word = self.r.pick(&["euler", "euler_space"]);
            format!("Mat3::{word}(EulerSequence::{}, q.a{i})", self.r.pick(&SEQUENCES))
        };
        self.function("", &format!("frame_{i}"), "Frame", &format!("Frame::new({place}, {rotation})"));
        format!("frame_{i}")
    }

    /// Three numbers.
    pub(super) fn vector(&mut self) -> String {
        format!("vec3({}, {}, {})", self.number(-0.5, 0.5), self.number(-0.5, 0.5), self.number(-0.5, 0.5))
    }

    /// Origin and rotation of a frame none of whose axes is along one of those that it is given in.
    fn askew(&mut self) -> String {
        let [a, b] = [(); 2].map(|()| 0.25 + self.r.below(60) as f64 / 100.0);
        let origin = self.vector();
        format!(
            "self.l * {origin}, \
             Mat3::rotation_x({a:.2}) * Mat3::rotation_y({b:.2}) * Mat3::rotation_z({b:.2})"
        )
    }

    /// Origin and rotation of a frame in another one.
    pub(super) fn placed(&mut self) -> String {
        let origin = if self.r.one_in(4) {
            "Vec3::ZERO * self.l".to_owned()
        } else {
            format!("self.l * {}", self.vector())
        };
        let rotation = match self.r.below(4) {
            0 => "Mat3::IDENTITY".to_owned(),
            1 => format!("Mat3::rotation_{}(core::f64::consts::FRAC_PI_2)", self.r.pick(&["x", "y", "z"])),
            2 => format!(
                "Mat3::rotation_x({}) * Mat3::rotation_z({})",
                self.number(-0.9, 0.9),
                self.number(-0.9, 0.9)
            ),
            _ => format!("Mat3::rotation_{}({})", self.r.pick(&["x", "y", "z"]), self.number(-0.9, 0.9)),
        };
        format!("{origin}, {rotation}")
    }

    /// Springs, dampers, forces, outputs of the last of some bodies.
    pub(super) fn rest_in_space(&mut self, last: usize, frame: &str, body: &str) {
        let (frame, body) = (format!("self.{frame}{last}(q)"), format!("self.{body}{last}(q)"));
        if self.r.one_in(2) {
            let spring = format!(
                "0.5 * self.k * \
                 ({frame}.point(self.l * vec3(0.4, 0.7, -0.3)) - self.l * Vec3::X).norm_squared()"
            );
            self.function("potential", "spring", "Expr", &spring);
        }
        if self.r.one_in(3) {
            let air =
                format!("0.5 * self.c * {frame}.point(self.l * vec3(0.5, -0.3, 0.6)).dt().norm_squared()");
            self.function("dissipation", "air", "Expr", &air);
        }
        if self.r.one_in(3) {
            let (place, size) = (
                format!("{frame}.point(self.l * vec3(0.3, -0.2, 0.1))"),
                format!("self.k * self.l * {frame}.z()"),
            );
            self.at("push", "Vec3", &place, &size);
        }
        if self.r.one_in(4) {
            let moment = format!("{body}.moment(self.torque * {frame}.x())");
            self.function("force", "moment", "Force", &moment);
        }
        let outputs = [
            ("momentum", format!("{body}.momentum()")),
            ("spin", format!("{body}.angular_momentum(self.l * Vec3::X)")),
            ("turning", format!("{frame}.angular_velocity_in_body()")),
            ("seen", format!("{frame}.velocity_in(self.l * Vec3::Z)")),
        ];
        for (name, value) in outputs {
            if self.r.one_in(4) {
                self.function("output", name, "Vec3", &value);
            }
        }
    }
}
