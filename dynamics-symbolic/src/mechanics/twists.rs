//! Equations of motion of bodies that hang on one another, in the axes of the bodies: velocities and
//! accelerations outward, forces inward, M from composite inertias.
//!
//! Outward, from link to link, with U = α× + ω×ω× (all in the axes of the link, at its origin; a starts with
//! −g, which is all that weight takes):
//!
//!   shift by p:       a′ = a + U p + 2 ω×ṗ + p̈
//!   turn R, rate r:   ω′ = Rᵀω + r,  α′ = Rᵀα + Rᵀω × r + ṙ,  a′ = Rᵀa
//!
//! Each link resists by f = m a + U h and n = J α + ω×Jω + h×a. Inward these add up, f → R f, n → R n + p×f,
//! and what the rate of a step gets is the generalized force M q̈ − Q of its coordinates. The operations grow
//! linearly with the number of links. (J. Y. S. Luh, M. W. Walker, R. P. C. Paul, J. Dyn. Syst. Meas. Control
//! 102 (1980) 69; with U after C. A. Balafoutis, R. V. Patel, *Dynamic Analysis of Robot Manipulators*,
//! Kluwer 1991.)
//!
//! Columns of M: what a unit rate of a coordinate gives to the composite of all that hangs on its step,
//! carried inward. (M. W. Walker, D. E. Orin, J. Dyn. Syst. Meas. Control 104 (1982) 205, method 3.)

use crate::calculus::directional;
use crate::graph::{Graph, NodeId, Number, Symbol};

use super::bodies::{Carried, Tree};
use super::lagrange::Inertia;
use super::model::FrameStep;
use super::vectors::{M3, V3, added, cross, dot, scaled, transposed, turned, zero};
use super::velocity_form::{along_motion, transport};

/// What symbols move with: of a motion, or at q̈ = 0.
type Direction = fn(&mut Graph, Symbol) -> Option<NodeId>;

impl Tree {
    /// M, Q without applied forces, and p of the bodies.
    pub(super) fn inertia(&self, g: &mut Graph) -> Inertia {
        let mass = self.mass_matrix(g);
        let bias = self.forces(g, transport);
        let force = bias.into_iter().map(|b| g.neg(b)).collect();
        let momenta = self.momenta(g);
        Inertia { mass, product: Vec::new(), left_out: 0, force, momenta }
    }

    /// M q̈ − Q of the bodies, with symbols for q̈.
    pub(super) fn inverse(&self, g: &mut Graph) -> Vec<NodeId> {
        self.forces(g, along_motion)
    }

    /// T of the bodies.
    pub(super) fn energy(&self, g: &mut Graph) -> NodeId {
        let twists = self.twists(g);
        let mut twice = g.zero();
        for (link, (v, omega)) in self.links.iter().zip(&twists) {
            // 2 T = v·(m v + 2 ω×h) + ω·Jω.
            let along = scaled(g, link.own.mass, v);
            let turning = cross(g, omega, &link.own.moment);
            let double = added(g, &turning, &turning);
            let along = added(g, &along, &double);
            let spin = turned(g, &link.own.inertia, omega);
            let (one, other) = (dot(g, v, &along), dot(g, omega, &spin));
            let both = g.add(one, other);
            twice = g.add(twice, both);
        }
        let half = g.number(Number::ratio(1, 2));
        g.mul(half, twice)
    }

    /// ∂T/∂q̇: momenta of the links, added up inward.
    fn momenta(&self, g: &mut Graph) -> Vec<NodeId> {
        let twists = self.twists(g);
        let own =
            self.links.iter().zip(&twists).map(|(link, (v, omega))| link.own.momenta(g, v, omega)).collect();
        self.inward(g, own)
    }

    /// (v, ω) of every link in its own axes.
    fn twists(&self, g: &mut Graph) -> Vec<(V3, V3)> {
        let mut twists: Vec<(V3, V3)> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let (v, omega) = link.parent.map_or_else(|| (zero(g), zero(g)), |parent| twists[parent]);
            twists.push(match &link.step {
                FrameStep::Shift(by) => {
                    let (moving, carried) = (along(g, by, &mut transport), cross(g, &omega, by));
                    let carried = added(g, &v, &carried);
                    (added(g, &carried, &moving), omega)
                }
                FrameStep::Turn { rotation, rate } => {
                    let back = transposed(rotation);
                    let omega = turned(g, &back, &omega);
                    (turned(g, &back, &v), added(g, &omega, rate))
                }
            });
        }
        twists
    }

    /// Σ of what resists, by coordinate.
    fn forces(&self, g: &mut Graph, direction: Direction) -> Vec<NodeId> {
        let mut motions: Vec<Motion> = Vec::with_capacity(self.links.len());
        let mut own = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let before =
                link.parent.map_or_else(|| Motion::of_the_world(g, self.lift), |parent| motions[parent]);
            let motion = before.after(g, &link.step, direction);
            own.push(motion.resisted(g, &link.own));
            motions.push(motion);
        }
        self.inward(g, own)
    }

    /// Forces and moments of the links added up inward: what each coordinate gets.
    fn inward(&self, g: &mut Graph, mut wrenches: Vec<(V3, V3)>) -> Vec<NodeId> {
        let mut total = vec![g.zero(); self.coordinates];
        for (k, link) in self.links.iter().enumerate().rev() {
            for (j, column) in link.step.columns(g, self.coordinates) {
                let part = link.step.given(g, &column, &wrenches[k]);
                total[j] = g.add(total[j], part);
            }
            if let Some(parent) = link.parent {
                let (f, n) = link.step.inward(g, &wrenches[k]);
                let before = wrenches[parent];
                wrenches[parent] = (added(g, &before.0, &f), added(g, &before.1, &n));
            }
        }
        total
    }

    fn mass_matrix(&self, g: &mut Graph) -> Vec<Vec<NodeId>> {
        let n = self.coordinates;
        let mut composites: Vec<Carried> = self.links.iter().map(|link| link.own).collect();
        for (k, link) in self.links.iter().enumerate().rev() {
            if let Some(parent) = link.parent {
                let moved = composites[k].before(g, &link.step);
                composites[parent] = moved.and(g, &composites[parent]);
            }
        }
        let columns: Vec<_> = self.links.iter().map(|link| link.step.columns(g, n)).collect();
        let mut mass = vec![vec![g.zero(); n]; n];
        let mut add = |g: &mut Graph, i: usize, j: usize, part: NodeId| mass[i][j] = g.add(mass[i][j], part);
        for (k, link) in self.links.iter().enumerate() {
            for (j, column) in &columns[k] {
                let mut wrench = link.step.pushed(g, column, &composites[k]);
                for (i, other) in &columns[k] {
                    let entry = link.step.given(g, other, &wrench);
                    add(g, *i, *j, entry);
                }
                let (mut at, mut step) = (link.parent, &link.step);
                while let Some(before) = at {
                    wrench = step.inward(g, &wrench);
                    (at, step) = (self.links[before].parent, &self.links[before].step);
                    for (i, other) in &columns[before] {
                        let entry = step.given(g, other, &wrench);
                        add(g, *i, *j, entry);
                        add(g, *j, *i, entry);
                    }
                }
            }
        }
        mass
    }
}

impl FrameStep {
    /// What unit rates of the coordinates give: directions of the shift's velocity or of the turn's rate.
    fn columns(&self, g: &mut Graph, n: usize) -> Vec<(usize, V3)> {
        let mut found = Vec::new();
        for j in 0..n {
            // The velocity of the shift has the slopes of the shift.
            let (of, by) = match self {
                Self::Shift(by) => (by, Symbol::Coordinate(j as u32)),
                Self::Turn { rate, .. } => (rate, Symbol::Rate(j as u32)),
            };
            let column = along(g, of, &mut |g, s| (s == by).then(|| g.one()));
            if column.iter().any(|x| !g.is_zero(*x)) {
                found.push((j, column));
            }
        }
        found
    }

    /// The power of force and moment along a column.
    fn given(&self, g: &mut Graph, column: &V3, (f, n): &(V3, V3)) -> NodeId {
        match self {
            Self::Shift(_) => dot(g, column, f),
            Self::Turn { .. } => dot(g, column, n),
        }
    }

    /// Momenta of what hangs on the step, moved along a column.
    fn pushed(&self, g: &mut Graph, column: &V3, composite: &Carried) -> (V3, V3) {
        let none = zero(g);
        match self {
            Self::Shift(_) => composite.momenta(g, column, &none),
            Self::Turn { .. } => composite.momenta(g, &none, column),
        }
    }

    /// Force and moment in the frame before.
    fn inward(&self, g: &mut Graph, (f, n): &(V3, V3)) -> (V3, V3) {
        match self {
            Self::Shift(by) => {
                let lever = cross(g, by, f);
                (*f, added(g, n, &lever))
            }
            Self::Turn { rotation, .. } => (turned(g, rotation, f), turned(g, rotation, n)),
        }
    }
}

/// How a link moves: in its own axes, at its origin.
#[derive(Clone, Copy)]
struct Motion {
    omega: V3,
    alpha: V3,
    /// Acceleration of the origin less that of gravity.
    a: V3,
}

impl Motion {
    fn of_the_world(g: &Graph, lift: V3) -> Self {
        Self { omega: zero(g), alpha: zero(g), a: lift }
    }

    /// Beyond a step.
    fn after(&self, g: &mut Graph, step: &FrameStep, direction: Direction) -> Self {
        match step {
            FrameStep::Shift(by) => {
                let speed = along(g, by, &mut transport);
                let (own, carried) = (along(g, &speed, &mut { direction }), self.carried(g, by));
                let twice = added(g, &speed, &speed);
                let coriolis = cross(g, &self.omega, &twice);
                let a = added(g, &self.a, &carried);
                let a = added(g, &a, &coriolis);
                Self { a: added(g, &a, &own), ..*self }
            }
            FrameStep::Turn { rotation, rate } => {
                let back = transposed(rotation);
                let (omega, alpha) = (turned(g, &back, &self.omega), turned(g, &back, &self.alpha));
                let (own, across) = (along(g, rate, &mut { direction }), cross(g, &omega, rate));
                let alpha = added(g, &alpha, &across);
                let (omega, alpha) = (added(g, &omega, rate), added(g, &alpha, &own));
                Self { omega, alpha, a: turned(g, &back, &self.a) }
            }
        }
    }

    /// ωᵢωⱼ.
    fn products(&self, g: &mut Graph) -> M3 {
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| g.mul(self.omega[i.min(j)], self.omega[i.max(j)])))
    }

    /// U = α× + ω×ω×.
    fn lever(&self, g: &mut Graph) -> M3 {
        let squares = self.products(g);
        let mut u = squares;
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let across = g.add(squares[j][j], squares[k][k]);
            u[i][i] = g.neg(across);
            u[i][j] = g.sub(squares[i][j], self.alpha[k]);
            u[j][i] = g.add(squares[i][j], self.alpha[k]);
        }
        u
    }

    /// U r: the acceleration of a point relative to a.
    fn carried(&self, g: &mut Graph, r: &V3) -> V3 {
        let u = self.lever(g);
        turned(g, &u, r)
    }

    /// m a + U h and J α + ω×Jω + h×a.
    fn resisted(&self, g: &mut Graph, own: &Carried) -> (V3, V3) {
        let (pushed, carried) = (scaled(g, own.mass, &self.a), self.carried(g, &own.moment));
        let (spin, lever) = (self.spin(g, &own.inertia), cross(g, &own.moment, &self.a));
        (added(g, &pushed, &carried), added(g, &spin, &lever))
    }

    /// J α + ω×Jω, through the elements of U.
    fn spin(&self, g: &mut Graph, inertia: &M3) -> V3 {
        let (squares, u) = (self.products(g), self.lever(g));
        [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (across, unequal) =
                (g.sub(inertia[k][k], inertia[j][j]), g.sub(squares[j][j], squares[k][k]));
            let (back, forth) = (g.mul(inertia[i][j], u[k][i]), g.mul(inertia[i][k], u[j][i]));
            let mut sum = g.mul(inertia[i][i], self.alpha[i]);
            for (factor, product) in [(across, squares[j][k]), (inertia[j][k], unequal)] {
                let term = g.mul(factor, product);
                sum = g.add(sum, term);
            }
            sum = g.sub(sum, back);
            g.add(sum, forth)
        })
    }
}

/// The derivative of a vector along a direction.
fn along(g: &mut Graph, v: &V3, direction: &mut dyn FnMut(&mut Graph, Symbol) -> Option<NodeId>) -> V3 {
    let moved = directional(g, v, direction);
    [moved[0], moved[1], moved[2]]
}
