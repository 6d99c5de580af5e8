//! Every row of a constraint has its own unit, and so has its multiplier.

use dynamics::prelude::*;

/// A block that slides on a rail: its joint holds a length and an angle.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad)]
#[units(mass: kg, inertia: kg * m^2, force: N)]
pub struct RailBlock {
    pub mass: f64,
    pub inertia: f64,
    pub force: f64,
}

#[dynamics]
impl RailBlock {
    fn frame(&self, q: &Coordinates<Self>) -> PlanarFrame {
        PlanarFrame::new(vec2(q.x, q.y), q.theta)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        PlanarBody::new(self.mass, Vec2::ZERO, self.inertia, self.frame(q)).kinetic_energy()
    }
    /// A constant force along the rail and across it.
    #[potential]
    fn push(&self, q: &Coordinates<Self>) -> Expr {
        -self.force * (q.x + q.y)
    }
    #[holonomic]
    fn rail(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        PlanarJoint::prismatic(PlanarFrame::world(), self.frame(q))
    }
}

#[test]
fn every_row_has_its_own_unit() {
    let units: Vec<_> = RailBlock::ROWS.iter().map(|row| row.unit).collect();
    // An angle has the unit 1.
    assert_eq!(units, ["m", ""]);
    let model = RailBlock { mass: 2.0, inertia: 0.1, force: 3.0 };
    let motion = model.simulate(model.state().build().unwrap()).until(0.1).run().unwrap();
    let csv = motion.csv().to_text().unwrap();
    let head = csv.lines().find(|line| line.contains("lambda")).expect("multipliers are columns");
    assert!(head.contains("lambda[rail[0]] [N]") && head.contains("lambda[rail[1]] [N*m]"), "{head}");
}
