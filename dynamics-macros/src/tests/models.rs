//! Whole models.

use super::model;

pub(super) const DOUBLE_PENDULUM: (&str, &str) = (
    "#[derive(Clone, Debug, Dynamics)]
    #[coordinates(theta1: rad, theta2: rad)]
    #[units(m1: kg, m2: kg, l1: m, l2: m, g: m / s^2)]
    pub struct DoublePendulum { pub m1: f64, pub m2: f64, pub l1: f64, pub l2: f64, pub g: f64 }",
    "impl DoublePendulum {
        fn bob1(&self, q: &Coordinates<Self>) -> Vec2 { self.l1 * vec2(q.theta1.sin(), -q.theta1.cos()) }
        fn bob2(&self, q: &Coordinates<Self>) -> Vec2
        { self.bob1(q) + self.l2 * vec2(q.theta2.sin(), -q.theta2.cos()) }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m1 * self.bob1(q).dt().norm_squared() + 0.5 * self.m2 *
            self.bob2(q).dt().norm_squared()
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            self.g * (self.m1 * self.bob1(q).y + self.m2 * self.bob2(q).y)
        }
    }",
);

/// Arrays, loops, inputs, forces, units, a smooth function, a matrix: most of the surface.
pub(super) const ARRAYS: (&str, &str) = (
    "#[coordinates(x: m, theta: [rad; 3])]
    #[inputs(push: N)]
    #[units(mass: kg, length: m, g: m/s^2)]
    #[nominal(mass = [1.0, 1.0, 1.0, 2.0], length = 0.5)]
    pub struct Chain
    { mass: [f64; 4], length: f64, g: f64, axis: Vec3<f64>, turn: Mat3<f64>, track: CubicSpline }",
    "impl Chain {
        const LINKS: usize = 3;
        const DRAG: f64 = 0.1;
        fn place(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
            let mut p = vec2(q.x, 0.0);
            for k in 0..i { p += self.length * vec2(q.theta[k].sin(), -q.theta[k].cos()); }
            p
        }
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            let mut t = Expr::ZERO;
            for (i, m) in self.mass.iter().enumerate()
            { t += 0.5 * *m * self.place(q, i).dt().norm_squared(); }
            t
        }
        #[potential]
        fn gravity(&self, q: &Coordinates<Self>) -> Expr {
            let mut v = self.track.at(q.x);
            for i in 0..=Self::LINKS { v += self.mass[i] * self.g * self.place(q, i).y; }
            v
        }
        #[dissipation]
        fn drag(&self, q: &Coordinates<Self>) -> Expr { Self::DRAG * q.x.dt().powi(2) }
        #[force]
        fn push(&self, q: &Coordinates<Self>) -> Force {
            let stop = if q.x > self.length && q.x.dt() > 0.0 { -self.g * self.mass[0] } else
            { 0.0 * q.push };
            Force::along(q.x, q.push + stop) + Force::at(self.place(q, 3), vec2(q.push, 0.0))
        }
        #[output]
        fn tip(&self, q: &Coordinates<Self>) -> Vec3 {
            let p = self.place(q, 3);
            self.turn * vec3(p.x, p.y, 0.0) + self.axis.cross(vec3(p.y, p.x, 0.0 * p.x))
        }
        #[event]
        fn hit(&self, q: &Coordinates<Self>) -> Expr { q.x.max(q.x.abs()) - self.length }
    }",
);

/// Constraints of all kinds, with all that asks about them.
pub(super) const CONSTRAINED: (&str, &str) = (
    "#[coordinates(x: m, y: m, turn: rad)]
    #[units(m: kg, l: m)]
    pub struct Cart { m: f64, l: f64, friction: f64 }",
    "impl Cart {
        #[kinetic]
        fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
            0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2) + (self.l * q.turn.dt()).powi(2))
        }
        #[nonholonomic(switched, integrable)]
        fn roll(&self, q: &Coordinates<Self>) -> [Expr; 1] { [q.x.dt() - self.l * q.turn.dt()] }
        #[force]
        fn rubbing(&self, q: &Coordinates<Self>) -> Force {
            Force::along(q.x - self.l * q.turn, -self.friction * q.reaction(Self::floor).y *
            q.slip(Self::roll))
        }
        #[holonomic]
        #[redundant]
        fn floor(&self, q: &Coordinates<Self>) -> Vec2 { vec2(q.y, 2.0 * q.y) }
        #[output]
        fn grip(&self, q: &Coordinates<Self>) -> Expr { q.reaction(Self::roll)[0] }
        #[event]
        fn slack(&self, q: &Coordinates<Self>) -> Expr { q.reaction(Cart::floor).x }
        #[drawing]
        fn drawing(&self, q: &Coordinates<Self>) -> Drawing { arrow(q.reaction(Self::floor)) }
    }",
);

#[test]
fn double_pendulum_of_the_design_compiles() {
    let compiled = model(DOUBLE_PENDULUM.0, DOUBLE_PENDULUM.1).compiled;
    let model = &compiled.model;
    assert_eq!(
        model.coordinates.iter().map(|c| (&*c.name, &*c.unit)).collect::<Vec<_>>(),
        [("theta1", "rad"), ("theta2", "rad")]
    );
    assert_eq!(model.parameters.iter().map(|c| &*c.name).collect::<Vec<_>>(), ["m1", "m2", "l1", "l2", "g"]);
    assert_eq!(model.energies.len(), 2);
}

#[test]
fn units_that_are_not_declared_are_inferred() {
    let compiled = model(ARRAYS.0, ARRAYS.1).compiled;
    let model = &compiled.model;
    let parameters: Vec<_> = model.parameters.iter().map(|p| (p.name.as_str(), p.unit.as_str())).collect();
    assert_eq!(
        &parameters[..6],
        [
            ("mass[0]", "kg"),
            ("mass[1]", "kg"),
            ("mass[2]", "kg"),
            ("mass[3]", "kg"),
            ("length", "m"),
            ("g", "m/s^2")
        ]
    );
    assert_eq!((model.functions[0].name.as_str(), model.functions[0].unit.as_str()), ("track", "J"));
    assert_eq!(model.inputs[0].unit, "N");
    assert_eq!(model.nominal, [(0, 1.0), (1, 1.0), (2, 1.0), (3, 2.0), (4, 0.5)]);
    assert_eq!(model.outputs[0].components.len(), 3);
}

#[test]
fn a_constant_of_the_impl_may_have_a_unit() {
    let declaration = "#[coordinates(x: m)] #[units(m: kg)] struct Ball { m: f64 }";
    let implementation = |gravity: &str| {
        format!(
            "impl Ball {{
                const GRAVITY: f64 = 9.81;
                #[kinetic] fn kinetic(&self, q: &Coordinates<Self>) -> Expr
                {{ 0.5 * self.m * q.x.dt().powi(2) }}
                #[potential] fn weight(&self, q: &Coordinates<Self>) -> Expr {{ self.m * {gravity} * q.x }}
            }}"
        )
    };
    model(declaration, &implementation("Self::GRAVITY"));
    assert_eq!(super::try_model(declaration, &implementation("9.81")).unwrap_err().len(), 1);
}
