//! Forces that go by the reactions of the same instant.

use super::*;

/// What friction is made of a reaction `N`: a force.
const LAWS: [&str; 6] = [
    "self.mu * N",
    "self.mu * N.abs()",
    "self.mu * N.powi(2) / (self.k * self.l)",
    "self.mu * self.k * self.l * (N / (self.k * self.l)).tanh()",
    "self.mu * (N.powi(2) + (self.k * self.l).powi(2)).sqrt()",
    "self.mu * N.abs().min(self.k * self.l)",
];

impl Draft<'_> {
    pub(super) fn rubbing(&mut self) {
        match self.r.below(3) {
            0 => self.bead(),
            1 => self.pinned(),
            _ => self.beads(),
        }
    }

    fn law(&mut self, reaction: &str, slip: &str) -> String {
        let law = self.r.pick(&LAWS).replace('N', reaction);
        match self.r.below(3) {
            0 => format!("-({law}) * {slip}.tanh()"),
            1 => format!("-({law}) * {slip} / (1.0 + {slip}.powi(2)).sqrt()"),
            _ => format!("-({law}) * {slip}.atan()"),
        }
    }

    /// A bead on a curve.
    fn bead(&mut self) {
        self.coordinate("x", Of::One("m"));
        self.coordinate("y", Of::One("m"));
        self.function("kinetic", "kinetic", "Expr", "0.5 * self.m * vec2(q.x, q.y).dt().norm_squared()");
        self.function("potential", "weight", "Expr", "self.m * self.g * q.y + 0.5 * self.k * q.x.powi(2)");
        let curve = self.r.pick(&[
            "q.y - 0.3 * q.x.powi(2) / self.l",
            "q.y - 0.4 * self.l * (q.x / self.l).sin()",
            "2.0 * q.y - 0.6 * q.x",
            "vec2(q.x, q.y - 1.3 * self.l).norm() - 1.2 * self.l",
        ]);
        self.function("holonomic", "wire", "Expr", curve);
        if self.r.one_in(4) {
            self.function("redundant", "again", "Expr", "-1.5 * self.wire(q)");
        }
        let law = self.law("q.reaction(Self::wire)", "(q.x.dt() / self.v)");
        if self.r.one_in(2) {
            self.along("rubbing", "q.x", &law);
        } else {
            let size = format!("({law}) * vec2(q.x.dt(), q.y.dt()) / (self.v + q.x.dt().abs())");
            self.at("rubbing", "Vec2", "vec2(q.x, q.y)", &size);
        }
        self.function("output", "load", "Expr", "q.reaction(Self::wire)");
        self.function("output", "lost", "Expr", "q.reaction(Self::wire) * q.x.dt()");
        self.function("event", "lifts", "Expr", "q.reaction(Self::wire) + 0.1 * self.k * q.x");
    }

    /// Two bodies of the plane on pins that rub.
    fn pinned(&mut self) {
        let n = 1 + self.r.below(2);
        self.coordinate("x", Of::Many("m", n));
        self.coordinate("y", Of::Many("m", n));
        self.coordinate("a", Of::Many("rad", n));
        self.of_body("frame", "PlanarFrame", "PlanarFrame::new(vec2(q.x[i], q.y[i]), q.a[i])");
        self.of_body(
            "body",
            "PlanarBody",
            "PlanarBody::new(self.m, Vec2::ZERO, 0.3 * self.m * self.l.powi(2), self.frame(q, i))",
        );
        let kinetic = self.over(n, "self.body(q, i).kinetic_energy()");
        self.function("kinetic", "kinetic", "Expr", &kinetic);
        let weight = self.over(n, "self.body(q, i).potential_energy(-self.g * Vec2::Y)");
        self.function("potential", "weight", "Expr", &weight);
        for i in 0..n {
            let there = match i {
                0 => "PlanarFrame::world()".to_owned(),
                _ => format!("self.frame(q, {}).frame(self.l * Vec2::X, 0.0)", i - 1),
            };
            let body =
                format!("PlanarJoint::revolute({there}, self.frame(q, {i}).frame(-self.l * Vec2::X, 0.0))");
            self.function("holonomic", &format!("pin_{i}"), "[Expr; 2]", &body);
            let held = format!("q.reaction(Self::pin_{i})");
            let load =
                format!("({held}[0].powi(2) + {held}[1].powi(2) + (0.1 * self.k * self.l).powi(2)).sqrt()");
            let turning = match i {
                0 => "q.a[0]".to_owned(),
                _ => format!("(q.a[{i}] - q.a[{}])", i - 1),
            };
            let law = self.law(&load, &format!("({turning}.dt() / self.w)"));
            self.along(&format!("rubbing_{i}"), &turning, &format!("0.2 * self.l * ({law})"));
            self.function("output", &format!("load_{i}"), "Expr", &load);
        }
    }

    /// Beads on a line each, coupled by a rod; every line rubs.
    fn beads(&mut self) {
        self.coordinate("x", Of::Many("m", 2));
        self.coordinate("y", Of::Many("m", 2));
        self.function("", "first", "Vec2", "vec2(q.x[0], q.y[0])");
        self.function("", "second", "Vec2", "vec2(q.x[1], q.y[1])");
        self.function(
            "kinetic",
            "kinetic",
            "Expr",
            "0.5 * self.m * (self.first(q).dt().norm_squared() + 1.4 * self.second(q).dt().norm_squared())",
        );
        self.function(
            "potential",
            "weight",
            "Expr",
            "self.m * self.g * (q.y[0] + q.y[1]) + \
            0.5 * self.k * (self.first(q) - self.second(q)).norm_squared()",
        );
        self.function("holonomic", "floor", "Expr", "q.y[0]");
        let wall = self.r.pick(&[
            "q.y[1] - 0.8 * self.l - 0.2 * q.x[1]",
            "q.x[1] - 1.1 * self.l",
            "q.y[1] - self.l",
        ]);
        self.function("holonomic", "wall", "Expr", wall);
        if self.r.one_in(3) {
            self.function(
                "holonomic",
                "rod",
                "Expr",
                "(self.first(q) - self.second(q)).norm() - 1.4 * self.l",
            );
        }
        let floor = self.law("q.reaction(Self::floor)", "(q.x[0].dt() / self.v)");
        self.along("below", "q.x[0]", &floor);
        let side = self.law("q.reaction(Self::wall)", "((q.x[1] + q.y[1]).dt() / self.v)");
        self.along("beside", "q.x[1] + q.y[1]", &side);
        self.function("output", "loads", "Vec2", "vec2(q.reaction(Self::floor), q.reaction(Self::wall))");
    }
}
