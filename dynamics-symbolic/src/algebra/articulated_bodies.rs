//! Articulated-body elimination: inertia that is carried by velocities which are sums of other velocities.
//! ½ zᵀHz − fᵀz is stationary, where z are unknowns and intermediate quantities y = Σ c z + β, each defined
//! by earlier ones.
//!
//! In a chain, y are the accelerations of its bodies, each that of the body before plus the contribution of
//! its own joint. Instead of M, which couples all joints, the form above is kept, in which every body is
//! coupled to its neighbours only. Two steps are taken as they become possible:
//!
//! * an intermediate quantity that no remaining definition contains is replaced by its definition, H ← CᵀHC,
//! * an unknown that no remaining definition contains is eliminated, as in LDLᵀ.
//!
//! For a tree this is the recursion of articulated bodies, and the operations grow linearly with the number
//! of joints. The pivots are those of LDLᵀ of M in the same order: both are what remains of the inertia of an
//! unknown while the others adapt. Source: R. Featherstone, *Rigid Body Dynamics Algorithms*, Springer 2008,
//! chapter 7. Here the recursion follows from the elimination; no tree is declared.

use crate::graph::{Graph, NodeId};

use super::ldl::{Factors, Rest};

/// An intermediate quantity.
#[derive(Clone, Debug)]
pub struct Definition {
    /// (unknown or intermediate quantity, factor); the latter counted from the number of unknowns, those
    /// defined before only.
    pub terms: Vec<(usize, NodeId)>,
    /// β as (factor, product of velocities), added up.
    pub offset: Vec<(NodeId, NodeId)>,
}

/// The form ½ zᵀHz − fᵀz.
#[derive(Clone, Debug)]
pub struct ArticulatedForm {
    /// Number of unknowns.
    pub unknowns: usize,
    /// Intermediate quantities in order.
    pub definitions: Vec<Definition>,
    /// (i, j, Hᵢⱼ), each pair once in either order; what belongs to the same pair is added up.
    pub inertia: Vec<(usize, usize, NodeId)>,
    /// (i, fᵢ), added up.
    pub force: Vec<(usize, NodeId)>,
}

/// Where the form is stationary.
#[derive(Clone, Debug)]
pub struct Stationary {
    /// Values of the unknowns.
    pub unknowns: Vec<NodeId>,
    /// Unknowns in the order of elimination, each with its pivot and the element of the diagonal that it came
    /// from: of M, or of what holds the rods.
    pub pivots: Vec<(usize, NodeId, NodeId)>,
}

impl ArticulatedForm {
    /// Eliminates everything and goes back.
    ///
    /// # Errors
    /// The unknown whose pivot is identically zero.
    pub fn solve(&self, g: &mut Graph) -> Result<Stationary, usize> {
        // M may be in the graph already, entry by entry; the form that is found here step by step is shorter.
        let made_of = g.cone(&self.nodes());
        g.afresh(&made_of, |g| self.eliminate(g))
    }

    /// The same by rod-force elimination; `None` where no rod holds a body.
    #[must_use]
    pub fn solve_for_rod_forces(&self, g: &mut Graph) -> Option<Stationary> {
        let made_of = g.cone(&self.nodes());
        g.afresh(&made_of, |g| self.rod_forces(g))
    }

    /// All nodes that the form contains.
    fn nodes(&self) -> Vec<NodeId> {
        let definitions = self.definitions.iter().flat_map(|d| {
            d.terms.iter().map(|(_, c)| *c).chain(d.offset.iter().flat_map(|(c, speed)| [*c, *speed]))
        });
        let form = self.inertia.iter().map(|(.., h)| *h).chain(self.force.iter().map(|(_, f)| *f));
        definitions.chain(form).collect()
    }

    fn eliminate(&self, g: &mut Graph) -> Result<Stationary, usize> {
        let mut left = RemainingForm::new(g, self);
        let mut factors = Factors::empty(g, self.unknowns + self.definitions.len());
        let (mut order, mut pivots) =
            (Vec::with_capacity(left.uses.len()), Vec::with_capacity(self.unknowns));
        while let Some(k) = left.next(self) {
            match k.checked_sub(self.unknowns) {
                Some(definition) => left.put_in(g, k, &self.definitions[definition]),
                None => pivots.push(left.eliminate(g, &mut factors, k)?),
            }
            order.push(k);
        }
        let mut z = left.force;
        for &k in order.iter().rev() {
            z[k] = match k.checked_sub(self.unknowns) {
                Some(definition) => self.definitions[definition].value(g, &z),
                None => factors.back(g, k, &z),
            };
        }
        z.truncate(self.unknowns);
        Ok(Stationary { unknowns: z, pivots })
    }
}

impl Definition {
    /// β.
    fn offset(&self, g: &mut Graph) -> NodeId {
        self.offset.iter().fold(g.zero(), |sum, (c, speed)| {
            let term = g.mul(*c, *speed);
            g.add(sum, term)
        })
    }

    /// Its value, given the values of its terms.
    fn value(&self, g: &mut Graph, z: &[NodeId]) -> NodeId {
        let offset = self.offset(g);
        self.terms.iter().fold(offset, |sum, (i, c)| {
            let term = g.mul_as_is(*c, z[*i]);
            g.add(sum, term)
        })
    }
}

/// The remaining form.
struct RemainingForm {
    rest: Rest,
    /// The same while every unknown taken out is held: its diagonal is that of M.
    held: Rest,
    force: Vec<NodeId>,
    /// How many of the remaining definitions contain each quantity.
    uses: Vec<usize>,
}

impl RemainingForm {
    fn new(g: &mut Graph, form: &ArticulatedForm) -> Self {
        let size = form.unknowns + form.definitions.len();
        let mut left = Self {
            rest: Rest::new(size),
            held: Rest::new(size),
            force: vec![g.zero(); size],
            uses: vec![0; size],
        };
        for (i, j, entry) in &form.inertia {
            add(g, &mut left.rest, *i, *j, *entry);
        }
        left.held = left.rest.clone();
        for (i, part) in &form.force {
            left.force[*i] = g.add(left.force[*i], *part);
        }
        for (i, _) in form.definitions.iter().flat_map(|d| &d.terms) {
            left.uses[*i] += 1;
        }
        left
    }

    /// The next step, among quantities that no remaining definition contains: the unknown with the fewest
    /// neighbours, else the quantity defined last, which is farthest from the root. Chosen by their number of
    /// neighbours, quantities of a tree would be replaced before unknowns that they still depend on.
    fn next(&self, form: &ArticulatedForm) -> Option<usize> {
        let ready = |k: usize| self.uses[k] == 0;
        let unknown = self.rest.fewest_neighbours(|k| k < form.unknowns && ready(k));
        unknown.or_else(|| self.rest.last(ready))
    }

    /// Puts y = Σ c z + β into the form.
    fn put_in(&mut self, g: &mut Graph, k: usize, definition: &Definition) {
        let (own, offset) = (self.rest.diagonal(g, k), definition.offset(g));
        let neighbours: Vec<usize> = self.rest.neighbours(k).collect();
        for i in neighbours {
            let entry = self.rest.get(g, i, k);
            let carried = g.mul_as_is(entry, offset);
            self.force[i] = g.sub(self.force[i], carried);
        }
        let carried = g.mul_as_is(own, offset);
        let force = g.sub(self.force[k], carried);
        for (i, c) in &definition.terms {
            self.uses[*i] -= 1;
            let part = g.mul_as_is(*c, force);
            self.force[*i] = g.add(self.force[*i], part);
        }
        replace(g, &mut self.rest, k, &definition.terms);
        replace(g, &mut self.held, k, &definition.terms);
    }

    /// Eliminates an unknown. Returns it, its pivot, and the diagonal element that the pivot came from.
    fn eliminate(
        &mut self,
        g: &mut Graph,
        factors: &mut Factors,
        k: usize,
    ) -> Result<(usize, NodeId, NodeId), usize> {
        let (pivot, held) = (self.rest.diagonal(g, k), self.held.diagonal(g, k));
        factors.eliminate(g, &mut self.rest, k).ok_or(k)?;
        factors.forward(g, k, &mut self.force);
        self.held.remove(k);
        Ok((k, pivot, held))
    }
}

/// Adds to an entry.
fn add(g: &mut Graph, matrix: &mut Rest, i: usize, j: usize, part: NodeId) {
    let sum = matrix.get(g, i, j);
    let sum = g.add(sum, part);
    matrix.set(g, i, j, sum);
}

/// Replaces the quantity k by its definition.
fn replace(g: &mut Graph, matrix: &mut Rest, k: usize, terms: &[(usize, NodeId)]) {
    let own = matrix.diagonal(g, k);
    let neighbours = matrix.remove(k);
    for (at, (i, c)) in terms.iter().enumerate() {
        let lever = g.mul_as_is(own, *c);
        for (j, d) in &terms[..=at] {
            let entry = g.mul_as_is(lever, *d);
            add(g, matrix, *i, *j, entry);
        }
        for (j, entry) in &neighbours {
            let entry = g.mul_as_is(*entry, *c);
            let entry = if i == j { g.add(entry, entry) } else { entry };
            add(g, matrix, *i, *j, entry);
        }
    }
}
