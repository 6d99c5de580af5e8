//! Generalized speeds beside constraints: what rolls, glides, or turns in Euler parameters.

use super::spatial::{INERTIAS, SEQUENCES};
use super::*;

impl Draft<'_> {
    pub(super) fn with_speeds(&mut self) {
        match self.r.below(4) {
            0 => self.sleigh(),
            1 => self.disk(),
            2 => self.satellite(),
            _ => self.aircraft(),
        }
    }

    /// A body of the plane on a skate, its first axis somewhere on it.
    fn sleigh(&mut self) {
        self.coordinate("x", Of::One("m"));
        self.coordinate("y", Of::One("m"));
        self.coordinate("phi", Of::One("rad"));
        let (place, turn) = (self.number(-0.6, 0.6), self.number(-0.8, 0.8));
        self.function("", "frame", "PlanarFrame", "PlanarFrame::new(vec2(q.x, q.y), q.phi)");
        let edge = format!("self.frame(q).frame(self.l * vec2({place}, 0.2), {turn})");
        self.function("", "edge", "PlanarFrame", &edge);
        let (along, across) = (self.number(-0.3, 0.3), self.number(-0.3, 0.3));
        let body = format!(
            "PlanarBody::new(self.m, self.l * vec2({along}, {across}), 0.4 * self.m * self.l.powi(2), \
             self.frame(q))"
        );
        self.function("", "body", "PlanarBody", &body);
        self.function("kinetic", "kinetic", "Expr", "self.body(q).kinetic_energy()");
        let potential =
            "self.body(q).potential_energy(-self.g * Vec2::Y) + self.k * self.l.powi(2) * q.phi.sin()";
        self.function("potential", "slope", "Expr", potential);
        let offset = if self.r.one_in(3) { " - 0.3 * self.v" } else { "" };
        let glides = format!("self.edge(q).origin().dt().dot(self.edge(q).y()){offset}");
        self.function("nonholonomic", "glides", "Expr", &glides);
        self.speeds.push(("ahead".to_owned(), Of::One("m / s")));
        self.speeds.push(("spin".to_owned(), Of::One("rad / s")));
        self.function("kinematic", "ahead", "Expr", "self.edge(q).origin().dt().dot(self.edge(q).x())");
        let spin = if self.r.one_in(2) { "q.phi.dt()" } else { "q.phi.dt() + 0.2 * self.ahead(q) / self.l" };
        self.function("kinematic", "spin", "Expr", spin);
        self.along("engine", "q.x", "self.k * self.l * q.phi.cos() - self.c * self.ahead(q)");
        self.function("output", "grip", "Expr", "q.reaction(Self::glides) * self.spin(q)");
        if self.r.one_in(2) {
            let size = "-self.mu * self.l * q.reaction(Self::glides).abs() * (q.phi.dt() / self.w).tanh()";
            self.along("rubbing", "q.phi", size);
        }
    }

    /// A disk that rolls on the floor.
    fn disk(&mut self) {
        for (name, unit) in [("x", "m"), ("y", "m"), ("yaw", "rad"), ("lean", "rad"), ("spin", "rad")] {
            self.coordinate(name, Of::One(unit));
        }
        let leaning = "Frame::new(vec3(q.x, q.y, self.l * q.lean.cos()), \
                       Mat3::rotation_z(q.yaw) * Mat3::rotation_x(q.lean))";
        self.function("", "leaning", "Frame", leaning);
        let round = self.number(0.3, 0.7);
        let body = format!(
            "let across = 0.5 * (0.1 + {round}) * self.m * self.l.powi(2);\n        RigidBody::new(self.m, \
             Vec3::ZERO, \
             Mat3::diagonal(across, 1.7 * across, across), \
             self.leaning(q).frame(Vec3::ZERO, Mat3::rotation_y(q.spin)))"
        );
        self.function("", "body", "RigidBody", &body);
        self.speeds.push(("omega".to_owned(), Of::Many("rad / s", 3)));
        let omega = if self.r.one_in(2) {
            "self.leaning(q).components_of(self.body(q).angular_velocity())"
        } else {
            "self.body(q).frame.angular_velocity_in_body()"
        };
        self.function("kinematic", "omega", "Vec3", omega);
        self.function("kinetic", "kinetic", "Expr", "self.body(q).kinetic_energy()");
        let slope = self.number(0.0, 0.3);
        let weight = format!("self.body(q).potential_energy(vec3({slope} * self.g, 0.0, -self.g))");
        self.function("potential", "weight", "Expr", &weight);
        let rolling = "let slip = self.body(q).frame.\
                       carried_velocity(self.leaning(q).point(-self.l * Vec3::Z));\n        \
                       vec2(slip.x, slip.y)";
        self.function("nonholonomic", "rolling", "Vec2", rolling);
        self.function("output", "grip", "Vec2", "q.reaction(Self::rolling)");
        if self.r.one_in(2) {
            self.along("drive", "q.spin", "self.torque - self.c * self.l.powi(2) * self.omega(q).y");
        }
    }

    /// A body on a ball joint, in Euler parameters.
    fn satellite(&mut self) {
        self.coordinate("e", Of::Many("1", 4));
        self.function("", "frame", "Frame", "Frame::turned(EulerParameters::new(q.e).rotation())");
        let inertia = self.r.pick(&INERTIAS);
        let center = self.vector();
        let body = format!("RigidBody::new(self.m, self.l * {center}, {inertia}, self.frame(q))");
        self.function("", "body", "RigidBody", &body);
        self.function("holonomic", "unit", "Expr", "EulerParameters::new(q.e).norm_constraint()");
        self.speeds.push(("omega".to_owned(), Of::Many("rad / s", 3)));
        let omega = match self.r.below(3) {
            0 => "EulerParameters::new(q.e).angular_velocity_in_body()",
            1 => "EulerParameters::new(q.e).angular_velocity()",
            _ => "self.frame(q).angular_velocity_in_body()",
        };
        self.function("kinematic", "omega", "Vec3", omega);
        self.function("kinetic", "kinetic", "Expr", "self.body(q).kinetic_energy()");
        self.function("potential", "weight", "Expr", "self.body(q).potential_energy(-self.g * Vec3::Z)");
        self.function("output", "tip", "Vec3", "self.frame(q).point(self.l * Vec3::X)");
    }

    /// A body that flies, in the components of its velocity; sometimes it is on a wire.
    fn aircraft(&mut self) {
        self.coordinate("r", Of::Many("m", 3));
        self.coordinate("angles", Of::Many("rad", 3));
        let frame = format!(
            "Frame::new(vec3(q.r[0], q.r[1], q.r[2]), Mat3::euler(EulerSequence::{}, q.angles))",
            self.r.pick(&SEQUENCES)
        );
        self.function("", "frame", "Frame", &frame);
        let inertia = self.r.pick(&INERTIAS);
        let center = self.vector();
        let body = format!("RigidBody::new(self.m, self.l * {center}, {inertia}, self.frame(q))");
        self.function("", "body", "RigidBody", &body);
        self.function("kinetic", "kinetic", "Expr", "self.body(q).kinetic_energy()");
        self.function("potential", "weight", "Expr", "self.body(q).potential_energy(-self.g * Vec3::Z)");
        self.function("kinematic", "omega", "Vec3", "self.frame(q).angular_velocity_in_body()");
        if self.r.one_in(2) {
            // Held to the floor: two components of the velocity are left.
            let height = "q.r[2] - 0.2 * q.r[0].powi(2) / self.l - 0.1 * self.l";
            self.function("holonomic", "floor", "Expr", height);
            self.function("kinematic", "flat", "Vec2", "vec2(q.r[0].dt() + 0.3 * q.r[1].dt(), q.r[1].dt())");
            self.speeds.push(("flat".to_owned(), Of::Many("m / s", 2)));
            self.function("output", "load", "Expr", "q.reaction(Self::floor)");
        } else {
            self.function(
                "kinematic",
                "flown",
                "Vec3",
                "self.frame(q).components_of(self.frame(q).origin().dt())",
            );
            self.speeds.push(("flown".to_owned(), Of::Many("m / s", 3)));
        }
        self.speeds.push(("omega".to_owned(), Of::Many("rad / s", 3)));
        self.at("air", "Vec3", "self.frame(q).origin()", "-self.c * self.frame(q).origin().dt()");
    }
}
