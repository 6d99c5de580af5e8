//! Rod-force elimination: equations of bodies that rods hold at a distance, solved for the forces in the
//! rods.
//!
//! Where an unknown u moves a point by y₁ = p₁ + b₁u + β₁, y₂ = p₂ + b₂u + β₂ with b₁² + b₂² = D constant, as
//! an angle does with the end of its rod, the components of y along the lever b and across it take the place
//! of y:
//!
//!   y₁ = b₁ w + b₂ η/D    w = u + (b₁(p₁ + β₁) + b₂(p₂ + β₂))/D
//!   y₂ = b₂ w − b₁ η/D    η = b₂(p₁ + β₁) − b₁(p₂ + β₂)
//!
//! w is as free as u was; only η, along the rod, depends on earlier quantities. With all pairs turned that
//! way and a diagonal, constant inertia, ½ zᵀHz − fᵀz under the rows η − Σ c z = κ is stationary
//! where
//!
//!   z = H⁻¹(f + Φᵀτ)    (Φ H⁻¹ Φᵀ) τ = κ − Φ H⁻¹ f
//!
//! with one force τ for each η. For a chain of points these are the tensions of its rods, and the system is
//! tridiagonal. Terms that cancel on the way back to u are cancelled force by force. The pivots are those of
//! Φ H⁻¹ Φᵀ; they vanish where the rods cannot carry all forces independently.

use std::collections::BTreeMap;

use crate::graph::{Graph, Node, NodeId};

use super::articulated_bodies::{ArticulatedForm, Stationary};
use super::ldl::Factors;

/// A linear combination of quantities; the known part is under `None`.
type AffineForm = BTreeMap<Option<usize>, NodeId>;

impl ArticulatedForm {
    /// Solves for the forces in the rods; `None` where inertia is not diagonal and constant in these terms,
    /// or a pivot is identically zero.
    pub(super) fn rod_forces(&self, g: &mut Graph) -> Option<Stationary> {
        let mut turned = TurnedForm::new(g, self)?;
        let (inverse, force) = turned.diagonal(g, self)?;
        let rows = &turned.rows;
        // H⁻¹ times each row.
        let scaled: Vec<BTreeMap<usize, NodeId>> = rows
            .iter()
            .map(|row| row.coefficients.iter().map(|(v, c)| (*v, g.mul(inverse[*v], *c))).collect())
            .collect();
        let matrix: Vec<Vec<NodeId>> = rows
            .iter()
            .map(|row| scaled.iter().map(|other| dot(g, &row.coefficients, other)).collect())
            .collect();
        let right: Vec<NodeId> = rows
            .iter()
            .zip(&scaled)
            .map(|(row, scaled)| {
                let driven = scaled.iter().fold(g.zero(), |sum, (v, c)| {
                    let term = g.mul(*c, force[*v]);
                    g.add(sum, term)
                });
                g.sub(row.known, driven)
            })
            .collect();
        let factors = Factors::new(g, &matrix).ok()?;
        let tensions = factors.solve(g, &right);
        // Each quantity: its own force, and its tensions.
        let mut values: Vec<AffineForm> =
            (0..force.len()).map(|v| AffineForm::from([(None, g.mul(inverse[v], force[v]))])).collect();
        for (r, row) in scaled.iter().enumerate() {
            for (v, c) in row {
                values[*v].insert(Some(r), *c);
            }
        }
        let unknowns = (0..self.unknowns)
            .map(|u| {
                let form =
                    turned.back.get(&u).map_or_else(|| values[u].clone(), |back| put_in(g, back, &values));
                form.into_iter().fold(g.zero(), |sum, (tension, c)| {
                    let term = tension.map_or(c, |r| g.mul_as_is(c, tensions[r]));
                    g.add(sum, term)
                })
            })
            .collect();
        // All divisors: inertia, which is constant, and pivots.
        let massive = turned.inertia.iter().map(|(of, h)| (*of, *h, *h));
        let pivots =
            massive.chain(factors.pivots().map(|(r, pivot)| (rows[r].of, pivot, matrix[r][r]))).collect();
        Some(Stationary { unknowns, pivots })
    }
}

/// Σ c z = κ.
struct Row {
    /// The unknown whose rod it is.
    of: usize,
    /// Its η.
    own: usize,
    coefficients: BTreeMap<usize, NodeId>,
    known: NodeId,
}

/// The form in terms of w and η. Quantities are numbered as before, w by its unknown and η by the first of
/// its pair.
struct TurnedForm {
    rows: Vec<Row>,
    /// What intermediate quantities are in these terms.
    forms: BTreeMap<usize, AffineForm>,
    /// What unknowns are in these terms, where they are not themselves.
    back: BTreeMap<usize, AffineForm>,
    /// The unknown that each inertia belongs to, and the inertia.
    inertia: Vec<(usize, NodeId)>,
    size: usize,
}

impl TurnedForm {
    fn new(g: &mut Graph, form: &ArticulatedForm) -> Option<Self> {
        let n = form.unknowns;
        let size = n + form.definitions.len();
        let mut turned = Self {
            rows: Vec::new(),
            forms: BTreeMap::new(),
            back: BTreeMap::new(),
            inertia: Vec::new(),
            size,
        };
        // The definitions in which each unknown stands.
        let mut stands: Vec<Vec<usize>> = vec![Vec::new(); n];
        for (k, definition) in form.definitions.iter().enumerate() {
            definition.terms.iter().filter(|(i, _)| *i < n).for_each(|(i, _)| stands[*i].push(k));
        }
        let inert: Vec<usize> =
            form.inertia.iter().flat_map(|(i, j, _)| [*i, *j]).filter(|i| *i < n).collect();
        for k in 0..form.definitions.len() {
            if turned.forms.contains_key(&(n + k)) {
                continue;
            }
            let pair =
                form.definitions[k].terms.iter().map(|(i, _)| *i).find_map(|u| match stands.get(u)?[..] {
                    [first, second] if first == k && !inert.contains(&u) => Some((u, second)),
                    _ => None,
                });
            let (u, second) = pair?;
            turned.turn(g, form, u, [k, second])?;
        }
        Some(turned)
    }

    /// Turns the pair of definitions that u moves.
    fn turn(&mut self, g: &mut Graph, form: &ArticulatedForm, u: usize, pair: [usize; 2]) -> Option<()> {
        let n = form.unknowns;
        let lever = pair.map(|k| form.definitions[k].terms.iter().find(|(i, _)| *i == u).map(|(_, c)| *c));
        // Each of the two may be written in a unit of its own, such as the length of the rod.
        let [(unit1, b1), (unit2, b2)] = [constant_factor(g, lever[0]?), constant_factor(g, lever[1]?)];
        let squares = [g.mul(b1, b1), g.mul(b2, b2)];
        let length = g.add(squares[0], squares[1]);
        let one = g.one();
        let over = g.div(one, length).filter(|over| g.is_constant(*over))?;
        let [per1, per2] = [g.div(one, unit1)?, g.div(one, unit2)?];
        let [along1, along2, across1, across2] =
            [(b1, per1), (b2, per2), (b2, per1), (b1, per2)].map(|(b, per)| g.mul(per, b));
        let against = g.neg(across2);
        let mut eta = self.combined(g, form, u, pair.into_iter().zip([across1, against]))?;
        let along = self.combined(g, form, u, pair.into_iter().zip([along1, along2]))?;
        let own = n + pair[0];
        let known = eta.remove(&None).unwrap_or(g.zero());
        let mut coefficients: BTreeMap<usize, NodeId> = BTreeMap::from([(own, one)]);
        for (i, c) in eta {
            if !g.is_zero(c) {
                coefficients.insert(i?, g.neg(c));
            }
        }
        self.rows.push(Row { of: u, own, coefficients, known });
        let [l1, l2, r1, r2] =
            [(unit1, b1), (unit2, b2), (unit1, b2), (unit2, b1)].map(|(unit, b)| g.mul(unit, b));
        let (right, left) = (g.mul(over, r1), g.mul(over, r2));
        let left = g.neg(left);
        self.forms.insert(n + pair[0], AffineForm::from([(Some(u), l1), (Some(own), right)]));
        self.forms.insert(n + pair[1], AffineForm::from([(Some(u), l2), (Some(own), left)]));
        let shift = g.neg(over);
        let mut back = AffineForm::from([(Some(u), one)]);
        add(g, &mut back, &along, shift);
        self.back.insert(u, back);
        Some(())
    }

    /// Σ factor·(p + β) over some definitions, where p is what they are made of but u, in terms of what is
    /// kept. What is known is put together by the velocities in it, where sin² + cos² shows.
    fn combined(
        &self,
        g: &mut Graph,
        form: &ArticulatedForm,
        u: usize,
        of: impl Iterator<Item = (usize, NodeId)>,
    ) -> Option<AffineForm> {
        let (mut sum, mut known) = (AffineForm::new(), BTreeMap::<NodeId, NodeId>::new());
        for (k, factor) in of {
            let definition = &form.definitions[k];
            for (i, c) in definition.terms.iter().filter(|(i, _)| *i != u) {
                // An unknown that stands for another since: not what a chain or tree does.
                if self.back.contains_key(i) {
                    return None;
                }
                let (c, one) = (g.mul(factor, *c), g.one());
                add(g, &mut sum, &form_of(self, *i, one), c);
            }
            for (c, speed) in &definition.offset {
                let c = g.mul(factor, *c);
                let old = known.get(speed).copied().unwrap_or(g.zero());
                known.insert(*speed, g.add(old, c));
            }
        }
        let known = known.into_iter().fold(g.zero(), |sum, (speed, c)| {
            let term = g.mul(c, speed);
            g.add(sum, term)
        });
        sum.insert(None, known);
        Some(sum)
    }

    /// 1/Hᵢᵢ and fᵢ; `None` where H is not diagonal and constant, or has no inertia for some quantity that is
    /// kept.
    fn diagonal(&mut self, g: &mut Graph, form: &ArticulatedForm) -> Option<(Vec<NodeId>, Vec<NodeId>)> {
        let one = g.one();
        let mut inertia: BTreeMap<(usize, usize), NodeId> = BTreeMap::new();
        for (i, j, h) in &form.inertia {
            for (a, x) in form_of(self, *i, one) {
                for (b, y) in form_of(self, *j, one) {
                    // hᵢⱼ stands for hⱼᵢ as well; on the diagonal it is whole already.
                    let at = (a?.min(b?), a?.max(b?));
                    if i == j && a > b {
                        continue;
                    }
                    let factor = g.mul(x, y);
                    let part = g.mul(*h, factor);
                    let part = if i != j && a == b { g.add(part, part) } else { part };
                    let old = inertia.get(&at).copied().unwrap_or(g.zero());
                    inertia.insert(at, g.add(old, part));
                }
            }
        }
        if inertia.iter().any(|((i, j), h)| !g.is_zero(*h) && (i != j || !g.is_constant(*h))) {
            return None;
        }
        let mut force = vec![g.zero(); self.size];
        for (i, f) in &form.force {
            let back = if *i < form.unknowns { self.back.get(i).cloned() } else { None };
            for (a, x) in back.unwrap_or_else(|| form_of(self, *i, one)) {
                // What is known does no work on what is sought.
                if let Some(a) = a {
                    let part = g.mul(x, *f);
                    force[a] = g.add(force[a], part);
                }
            }
        }
        let kept: Vec<usize> =
            (0..form.unknowns).chain(self.rows.iter().flat_map(|r| r.coefficients.keys().copied())).collect();
        let mut inverse = vec![g.zero(); self.size];
        for v in kept {
            let own = inertia.get(&(v, v)).copied()?;
            inverse[v] = g.div(one, own)?;
            let of = self.rows.iter().find(|row| row.own == v).map_or(v, |row| row.of);
            if self.inertia.iter().all(|(_, known)| *known != own) && g.as_number(own).is_none() {
                self.inertia.push((of, own));
            }
        }
        Some((inverse, force))
    }
}

fn form_of(turned: &TurnedForm, i: usize, one: NodeId) -> AffineForm {
    turned.forms.get(&i).cloned().unwrap_or_else(|| AffineForm::from([(Some(i), one)]))
}

/// Adds factor·form.
fn add(g: &mut Graph, to: &mut AffineForm, form: &AffineForm, factor: NodeId) {
    for (i, c) in form {
        let part = g.mul(factor, *c);
        let old = to.get(i).copied().unwrap_or(g.zero());
        to.insert(*i, g.add(old, part));
    }
}

/// A form in terms of others.
fn put_in(g: &mut Graph, form: &AffineForm, values: &[AffineForm]) -> AffineForm {
    let one = g.one();
    let mut sum = AffineForm::new();
    for (i, c) in form {
        match i {
            Some(i) => add(g, &mut sum, &values[*i], *c),
            None => add(g, &mut sum, &AffineForm::from([(None, one)]), *c),
        }
    }
    sum
}

fn dot(g: &mut Graph, a: &BTreeMap<usize, NodeId>, b: &BTreeMap<usize, NodeId>) -> NodeId {
    let mut sum = g.zero();
    for (v, x) in a {
        if let Some(y) = b.get(v) {
            let product = g.mul(*x, *y);
            sum = g.add(sum, product);
        }
    }
    sum
}

/// A product as (what depends on parameters alone, the rest).
fn constant_factor(g: &Graph, id: NodeId) -> (NodeId, NodeId) {
    match g.node(id) {
        Node::Mul(a, b) if g.is_constant(a) => (a, b),
        _ => (g.one(), id),
    }
}
