//! Expressions that are written with time and do not depend on it.

use std::collections::BTreeMap;

use super::substitute::{replace, substitute};
use crate::graph::{Dependence, Graph, NodeId, Sampler, Symbol};

/// `roots`, where every part that contains time but does not depend on it is replaced by its form at t = 0.
///
/// A bead in a turning tube is written as r (cos Ωt, sin Ωt). Its centrifugal force
/// m Ω² r (cos² + sin²) has the value of m Ω² r, but no node of that form exists. At t = 0 it folds to
/// that. Parts that have no value at t = 0 stay as they are.
#[must_use]
pub fn remove_time(g: &mut Graph, roots: &[NodeId]) -> Vec<NodeId> {
    if !roots.iter().any(|root| g.dependence(*root).on(Dependence::TIME)) {
        return roots.to_vec();
    }
    let mut timed = g.cone(roots);
    timed.retain(|id| g.dependence(*id).on(Dependence::TIME));
    let steady: Vec<NodeId> = {
        let sampler = Sampler::new(g, &timed);
        let [now, later] =
            [0, 1].map(|t| sampler.with(&mut |s| sampler.random(s, if s == Symbol::Time { t } else { 0 })));
        timed.iter().zip(now.iter().zip(later)).filter(|(_, (a, b))| **a == *b).map(|(id, _)| *id).collect()
    };
    let mut at_zero = BTreeMap::new();
    for id in steady {
        let zero = g.zero();
        let folded = substitute(g, &[id], &mut |_, s| (s == Symbol::Time).then_some(zero));
        if let Ok([new]) = folded.as_deref()
            && g.fingerprint(*new) == g.fingerprint(id)
        {
            at_zero.insert(id, *new);
        }
    }
    if at_zero.is_empty() {
        return roots.to_vec();
    }
    replace(g, roots, &mut |_, id| at_zero.get(&id).copied()).unwrap_or_else(|_| roots.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Unary;

    fn symbols(g: &mut Graph) -> [NodeId; 3] {
        [Symbol::Coordinate(0), Symbol::Parameter(0), Symbol::Time].map(|s| g.symbol(s))
    }

    #[test]
    fn a_turning_frame_is_forgotten_and_a_driving_force_is_not() {
        let mut g = Graph::new();
        let [r, omega, t] = symbols(&mut g);
        let angle = g.mul(omega, t);
        let [cos, sin] = [Unary::Cos, Unary::Sin].map(|f| g.unary(f, angle));
        // r cos·cos + r sin·sin + sin
        let mut sum = sin;
        for f in [cos, sin] {
            let once = g.mul(r, f);
            let twice = g.mul(once, f);
            sum = g.add(sum, twice);
        }
        let x = g.mul(r, cos);
        let xx = g.mul(x, x);
        let y = g.mul(r, sin);
        let yy = g.mul(y, y);
        let square = g.add(xx, yy);
        let new = remove_time(&mut g, &[square, x]);
        let rr = g.mul(r, r);
        assert_eq!(new, [rr, x]);
        assert!(g.operations(&[square]) > g.operations(&new[..1]));
        let driven = remove_time(&mut g, &[sum])[0];
        assert!(g.dependence(driven).on(Dependence::TIME), "sin Ωt stays");
        assert_eq!(g.fingerprint(driven), g.fingerprint(sum));
    }

    #[test]
    fn what_has_no_value_at_the_start_is_kept() {
        let mut g = Graph::new();
        let [r, _, t] = symbols(&mut g);
        // r cos²(1/t) + r sin²(1/t)
        let one = g.one();
        let angle = g.div(one, t).expect("t is not zero");
        let parts = [Unary::Cos, Unary::Sin].map(|f| {
            let value = g.unary(f, angle);
            let once = g.mul(r, value);
            g.mul(once, once)
        });
        let square = g.add(parts[0], parts[1]);
        assert_eq!(remove_time(&mut g, &[square]), [square]);
    }
}
