//! Random constraints of which the answer is known beforehand.

use crate::common;

use common::Builder;
use common::constrained::{HOLONOMIC, NONHOLONOMIC, constrain, particles};
use dynamics_symbolic::check::Finding;
use dynamics_symbolic::check::constraints::{Combination, ConstraintFinding as Fault, analyse};
use dynamics_symbolic::graph::{NodeId, Symbol};
use proptest::prelude::*;

const N: usize = 6;

/// Independent rows: unit triangular, with anything behind the diagonal.
fn independent() -> impl Strategy<Value = Vec<Vec<i64>>> {
    (1..=4usize)
        .prop_flat_map(|r| prop::collection::vec(prop::collection::vec(-3..=3i64, N + 1), r))
        .prop_map(|mut rows| {
            for (i, row) in rows.iter_mut().enumerate() {
                row[..i].fill(0);
                row[i] = 1;
            }
            rows
        })
}

/// `first - 2 third` with names `row0`, `row1`, ….
fn text(coefficients: &[i64]) -> String {
    let mut out = String::new();
    for (i, c) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0) {
        let sign = match (out.is_empty(), *c < 0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        let factor = if c.abs() == 1 { String::new() } else { format!("{} ", c.abs()) };
        out.push_str(&format!("{sign}{factor}row{i}"));
    }
    out
}

/// Σ cᵢ rowᵢ, the last element the constant.
fn combined(coefficients: &[i64], rows: &[Vec<i64>]) -> Vec<i64> {
    (0..=N).map(|j| coefficients.iter().zip(rows).map(|(c, row)| c * row[j]).sum()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn linear_rows(
        rows in independent(),
        mut coefficients in prop::collection::vec(-3..=3i64, 4),
        shift in -1..=1i64
    ) {
        coefficients.truncate(rows.len());
        let (mut b, q) = particles(&["a", "b", "c", "d", "e", "f"]);
        for (i, row) in rows.iter().enumerate() {
            let node = b.linear(&row[..N], &q, row[N]);
            constrain(&mut b, &format!("row{i}"), HOLONOMIC, &[node]);
        }
        let analysis = analyse(&b.model);
        prop_assert_eq!(&analysis.findings, &[]);
        prop_assert_eq!((analysis.rank, analysis.rows), (rows.len(), rows.len()));
        prop_assume!(coefficients.iter().any(|c| *c != 0));

        let extra = combined(&coefficients, &rows);
        let node = b.linear(&extra[..N], &q, extra[N] + shift);
        constrain(&mut b, "extra", HOLONOMIC, &[node]);
        let analysis = analyse(&b.model);
        prop_assert_eq!(analysis.rank, rows.len());
        let origin = b.model.constraints[rows.len()].origin;
        let of = Combination::Constant(text(&coefficients));
        let expected = match shift {
            0 => Fault::Repeats { name: "extra".into(), of, on_manifold: false, origin },
            _ => Fault::Contradicts { name: "extra".into(), with: of, origin },
        };
        prop_assert_eq!(&analysis.findings, &[Finding::Constraint(expected)]);
        // The multipliers of the rows that take part are not unique, those of the others are.
        let mut entangled: Vec<usize> = (0..rows.len()).filter(|i| coefficients[*i] != 0).collect();
        entangled.push(rows.len());
        prop_assert_eq!(analysis.not_unique, entangled);
    }

    /// In the coordinates Fᵢ(q, t), a random polynomial change of q, dF₃ and dF₄ are exact and dF₀ + F₁ dF₂
    /// is a contact form: of all combinations exactly those of the exact ones are integrable, whatever
    /// factors they have and however they are mixed.
    #[test]
    fn pfaffian_rows(
        terms in prop::collection::vec((-2..=2i64, 0..5usize, 0..5usize), 5),
        exact in 0..=2usize,
        contact in any::<bool>(),
        timed in any::<bool>(),
        mix in -2..=2i64,
        factor in 0..5usize,
    ) {
        prop_assume!(exact > 0 || contact);
        let (mut b, q) = particles(&["a", "b", "c", "d", "e"]);
        let f: Vec<NodeId> = (0..5).map(|i| changed(&mut b, &q, i, terms[i], timed)).collect();
        let rates: Vec<NodeId> = f.iter().map(|f| b.dt(*f)).collect();
        let mut rows = Vec::new();
        if contact {
            let product = b.mul(f[1], rates[2]);
            rows.push(b.add(rates[0], product));
        }
        rows.extend(&rates[3..3 + exact]);
        let (square, one) = (b.mul(q[factor], q[factor]), b.ratio(1, 1));
        let scale = b.add(square, one);
        for i in 0..rows.len() {
            let scaled = b.mul(scale, rows[i]);
            let m = b.ratio(mix.into(), 1);
            let other = b.mul(m, rows[(i + 1) % rows.len()]);
            rows[i] = if rows.len() > 1 && i == 0 { b.add(scaled, other) } else { scaled };
        }
        // Of two rows mixed with each other the determinant could vanish: mixed is the first only.
        constrain(&mut b, "rolling", NONHOLONOMIC, &rows);
        let analysis = analyse(&b.model);
        let mut counted = 0;
        for finding in &analysis.findings {
            let Finding::Constraint(Fault::Integrable { integrable, .. }) = finding else {
                return Err(TestCaseError::fail(format!("{finding:?}")));
            };
            counted += integrable;
        }
        prop_assert_eq!(counted, exact);
        prop_assert_eq!(analysis.integrable, Some(exact));
    }
}

/// qᵢ + c q_j q_k, with j and k behind i so that it can be solved for q, and a term in t.
fn changed(b: &mut Builder, q: &[NodeId], i: usize, (c, j, k): (i64, usize, usize), timed: bool) -> NodeId {
    let mut sum = q[i];
    if i < 4 {
        let behind = |m: usize| i + 1 + m % (4 - i);
        let (factor, product) = (b.ratio(c.into(), 1), b.mul(q[behind(j)], q[behind(k)]));
        let term = b.mul(factor, product);
        sum = b.add(sum, term);
    }
    if timed {
        let time = b.g().symbol(Symbol::Time);
        let (sine, x) = (b.sin(time), q[(i + 1) % q.len()]);
        let term = b.mul(sine, x);
        // Only behind the diagonal, as above.
        sum = if i < 4 { b.add(sum, term) } else { b.add(sum, sine) };
    }
    sum
}

/// A planar linkage of `loops` dyads, every one between the tip of the dyad before and a pivot on the ground,
/// with lengths taken from one configuration, so that it can be assembled.
fn linkage(numbers: &[f64], loops: usize) -> Builder {
    let mut b = Builder::new("Linkage");
    let mut numbers = numbers.iter().copied();
    let mut next = move || numbers.next().expect("enough numbers");
    let crank = b.coordinate("crank");
    let polar = |b: &mut Builder, length: NodeId, angle: NodeId| {
        let (s, c) = (b.sin(angle), b.cos(angle));
        [b.mul(length, c), b.mul(length, s)]
    };
    let mut values = vec![0.2 + 0.3 * next()];
    let length = b.parameter("crank_length");
    let (mut tip, angle) = (polar(&mut b, length, crank), 6.0 * next());
    let mut place = [values[0] * angle.cos(), values[0] * angle.sin()];
    for i in 0..loops {
        // The knee and the pivot somewhere around, the next tip on the second link.
        let knee = [place[0] + next() - 0.5, place[1] + next() - 0.5];
        let pivot = [2.0 * next() - 1.0, 2.0 * next() - 1.0];
        let own = [(0, place, knee), (1, pivot, knee)].map(|(k, from, to)| {
            let angle = b.coordinate(&format!("link[{}]", 2 * i + k));
            let length = b.parameter(&format!("length[{}]", 2 * i + k));
            values.push((to[0] - from[0]).hypot(to[1] - from[1]));
            polar(&mut b, length, angle)
        });
        let ground = [0, 1].map(|k| {
            values.push(pivot[k]);
            b.parameter(&format!("pivot[{}]", 2 * i + k))
        });
        let mut rows = Vec::new();
        for k in 0..2 {
            let (one, other) = (b.add(tip[k], own[0][k]), b.add(ground[k], own[1][k]));
            rows.push(b.sub(one, other));
        }
        constrain(&mut b, &format!("closure{i}"), HOLONOMIC, &rows);
        let half = b.ratio(1, 2);
        for k in 0..2 {
            let along = b.mul(half, own[1][k]);
            tip[k] = b.add(ground[k], along);
            place[k] = pivot[k] + 0.5 * (knee[k] - pivot[k]);
        }
    }
    for c in &mut b.model.coordinates {
        c.unit = "rad".into();
    }
    values.iter().enumerate().for_each(|(i, x)| b.nominal(i as u32, *x));
    b
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    /// What can be assembled is not called contradictory, with up to 16 rows and whatever lengths.
    #[test]
    fn linkages_that_can_be_assembled(
        numbers in prop::collection::vec(0.0..1.0f64, 40),
        loops in 1..=8usize
    ) {
        let analysis = analyse(&linkage(&numbers, loops).model);
        prop_assert_eq!(&analysis.findings, &[]);
        prop_assert_eq!((analysis.rank, analysis.rows), (2 * loops, 2 * loops));
    }
}

/// Points in the plane or in space, each held by two or three rods to points before it; the first are fixed
/// to the ground, one rod is left out.
fn rods(numbers: &[f64], points: usize, d: usize) -> Builder {
    let mut b = Builder::new("Rods");
    let mut numbers = numbers.iter().copied().cycle();
    let mut next = move || 2.0 * numbers.next().expect("a cycle does not end") - 1.0;
    let mut values = Vec::new();
    let mut known: Vec<(Vec<NodeId>, Vec<f64>)> = Vec::new();
    for i in 0..d {
        let at: Vec<f64> = (0..d).map(|_| next()).collect();
        let nodes = (0..d).map(|k| b.parameter(&format!("ground[{}]", d * i + k))).collect();
        values.extend(&at);
        known.push((nodes, at));
    }
    for i in 0..points {
        let at: Vec<f64> = (0..d).map(|_| next()).collect();
        let nodes: Vec<NodeId> = (0..d).map(|k| b.coordinate(&format!("p[{}]", d * i + k))).collect();
        let mut rows = Vec::new();
        for j in 0..if i == 0 { d - 1 } else { d } {
            let (other, place) = known[known.len() - 1 - j].clone();
            let gap: Vec<NodeId> = nodes.iter().zip(&other).map(|(a, c)| b.sub(*a, *c)).collect();
            let length = b.parameter(&format!("length[{i}][{j}]"));
            values.push(at.iter().zip(&place).map(|(a, c)| (a - c).powi(2)).sum::<f64>().sqrt());
            let (square, own) = (b.norm_squared(&gap), b.mul(length, length));
            rows.push(b.sub(square, own));
        }
        constrain(&mut b, &format!("rods{i}"), HOLONOMIC, &rows);
        known.push((nodes, at));
    }
    values.iter().enumerate().for_each(|(i, x)| b.nominal(i as u32, *x));
    b
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, failure_persistence: None, ..ProptestConfig::default() })]

    /// The same of rods between points, in the plane and in space.
    #[test]
    fn frameworks_that_can_be_assembled(
        numbers in prop::collection::vec(0.0..1.0f64, 36),
        points in 1..=8usize,
        d in 2..=3usize
    ) {
        let analysis = analyse(&rods(&numbers, points, d).model);
        prop_assert_eq!(&analysis.findings, &[]);
        prop_assert_eq!((analysis.rank, analysis.rows), (d * points - 1, d * points - 1));
    }
}
