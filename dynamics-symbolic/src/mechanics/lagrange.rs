//! M and Q from a Lagrangian, in general: p = ∂L/∂q̇ by a reverse sweep, M = ∂p/∂q̇ by forward sweeps of p,
//! Coriolis and centripetal terms as ∂p/∂q·q̇ + ∂p/∂t, one forward sweep, minus ∂L/∂q.

use crate::calculus::{directional, gradient};
use crate::graph::{Graph, NodeId, Symbol};

use super::model::symbols;
use super::velocity_form::{VelocityForm, along_motion, transport};

/// d/dt(∂L/∂q̇) − ∂L/∂q = M q̈ − Q.
#[derive(Clone, Debug)]
pub(super) struct Inertia {
    /// M, N×N; without rows where it is left out.
    pub(super) mass: Vec<Vec<NodeId>>,
    /// M q̈ with symbols for q̈, where M is left out.
    pub(super) product: Vec<NodeId>,
    /// The operations of an M that is left out, or its nodes when deriving it was given up.
    pub(super) left_out: usize,
    /// Q without applied forces.
    pub(super) force: Vec<NodeId>,
    /// ∂L/∂q̇.
    pub(super) momenta: Vec<NodeId>,
}

impl Inertia {
    /// Both together.
    pub(super) fn and(self, g: &mut Graph, other: &Self) -> Self {
        let mut each =
            |a: Vec<NodeId>, b: &[NodeId]| a.into_iter().zip(b).map(|(a, b)| g.add(a, *b)).collect();
        Self {
            mass: self.mass.into_iter().zip(&other.mass).map(|(a, b)| each(a, b)).collect(),
            product: Vec::new(),
            left_out: 0,
            force: each(self.force, &other.force),
            momenta: each(self.momenta, &other.momenta),
        }
    }
}

/// Derives from L = `lagrangian` for n coordinates.
pub(super) fn lagrange(g: &mut Graph, lagrangian: NodeId, n: usize) -> Inertia {
    let one = g.one();
    let momenta = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Rate));
    let mut mass = vec![vec![one; n]; n];
    for j in 0..n {
        let column =
            directional(g, &momenta[j..], &mut |g, s| (s == Symbol::Rate(j as u32)).then(|| g.one()));
        for (i, entry) in (j..n).zip(column) {
            mass[i][j] = entry;
            mass[j][i] = entry;
        }
    }
    let moved = directional(g, &momenta, &mut transport);
    let slope = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Coordinate));
    let force = slope.into_iter().zip(moved).map(|(s, t)| g.sub(s, t)).collect();
    Inertia { mass, product: Vec::new(), left_out: 0, force, momenta }
}

/// Derives from L = `form` + `lagrangian`: what is in velocity form by its own formulas, the rest in general.
pub(super) fn mixed(g: &mut Graph, form: &VelocityForm, lagrangian: NodeId, n: usize) -> Inertia {
    let columns = form.mass_columns(g, n, usize::MAX).expect("as many nodes as it takes");
    let own: Vec<Vec<NodeId>> =
        (0..n).map(|i| (0..n).map(|j| columns[i.min(j)][i.max(j)]).collect()).collect();
    let coriolis = form.coriolis(g, &own);
    let momenta = form.momenta(g, n);
    let general = lagrange(g, lagrangian, n);
    let both = own.into_iter().zip(general.mass);
    let mass = both.map(|(a, b)| a.into_iter().zip(b).map(|(a, b)| g.add(a, b)).collect()).collect();
    let force = general.force.into_iter().zip(coriolis).map(|(f, c)| g.sub(f, c)).collect();
    let momenta = momenta.into_iter().zip(general.momenta).map(|(a, b)| g.add(a, b)).collect();
    Inertia { mass, product: Vec::new(), left_out: 0, force, momenta }
}

/// The same without M, of L = `form` + `lagrangian` where the latter is free of velocities: in operations
/// proportional to those of L.
pub(super) fn without_mass_matrix(
    g: &mut Graph,
    form: &VelocityForm,
    lagrangian: NodeId,
    n: usize,
    left_out: usize,
) -> Inertia {
    let one = g.one();
    let coriolis = form.coriolis_by_sweep(g, n);
    let momenta = form.momenta(g, n);
    let slope = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Coordinate));
    let force = slope.into_iter().zip(coriolis).map(|(s, c)| g.sub(s, c)).collect();
    let product = form.mass_product(g, n);
    Inertia { mass: Vec::new(), product, left_out, force, momenta }
}

/// The left-hand side d/dt(∂L/∂q̇) − ∂L/∂q with symbols for q̈: inverse dynamics, far smaller than M q̈ − Q
/// from the entries of M.
pub(super) fn inverse(g: &mut Graph, form: &VelocityForm, lagrangian: NodeId, n: usize) -> Vec<NodeId> {
    let one = g.one();
    let own = form.inverse(g, n);
    let momenta = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Rate));
    let moved = directional(g, &momenta, &mut along_motion);
    let slope = gradient(g, &[(lagrangian, one)], &symbols(n, Symbol::Coordinate));
    let general = moved.into_iter().zip(slope).map(|(m, s)| g.sub(m, s)).collect::<Vec<_>>();
    own.into_iter().zip(general).map(|(a, b)| g.add(a, b)).collect()
}
