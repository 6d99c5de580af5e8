//! Waves between the ends: ω² as a function of the phase κ per node, at rest with all coordinates zero.
//!
//! Far from the ends all nodes have the same rows of K and M. With q_j = a e^{iκj} these become small
//! matrices K(κ) = Σ_d K_d e^{iκd} and M(κ), and det(K(κ) − ω² M(κ)) = 0. Fields that are not coupled have an
//! equation each, ω² = K(κ)/M(κ); two coupled ones have a quadratic equation. Ordinary coordinates are held.
//!
//! ω² of long waves is a power series in κ. Where its first term is that of the continuum, the next one is
//! the error of the lattice.

mod cosines;
mod stencil;

use crate::graph::{Graph, NodeId, Number, Symbol, Unary};
use crate::mechanics::Parameter;
use crate::text::{Formulas, Plain};

use super::derive::Derived;
use super::model::{FamilyModel, Source};

use cosines::{Cosines, sum};
use stencil::{Couplings, Stencil, root};

/// Longest text of a relation. What is longer is left to numbers.
const LONGEST: usize = 320;

/// What the report says of waves: headings with texts. Changes nothing in the model.
pub(super) fn describe(family: &FamilyModel, derived: &Derived) -> Vec<(&'static str, String)> {
    if !family.fields.iter().any(|field| field.length.is_some()) {
        return Vec::new();
    }
    if !family.constraints.is_empty() {
        let text = "left out: constraints are no part of it; ask `modes(&state, count)`";
        return vec![("dispersion", text.to_owned())];
    }
    if family.fields.iter().any(|field| field.columns.is_some()) {
        return vec![("dispersion", String::from("left out: nodes have two indices"))];
    }
    let mut own = family.clone();
    let stencil = match Stencil::at_rest(&mut own, derived) {
        Ok(stencil) => stencil,
        Err(reason) => return vec![("dispersion", format!("left out: {reason}"))],
    };
    let kappa = kappa(&mut own);
    let mut entries = Vec::new();
    let mut steps = Vec::new();
    for block in &stencil.blocks {
        let names: Vec<&str> = block.iter().map(|field| own.fields[*field].name.as_str()).collect();
        let names = names.join(", ");
        let of = if stencil.blocks.len() > 1 { format!("{names}: ") } else { String::new() };
        let lines = match block[..] {
            [field] => single(&mut own, &stencil, field, kappa, &mut steps),
            [a, b] => pair(&mut own, &stencil, [a, b], kappa).map(|text| vec![("dispersion", text)]),
            _ => None,
        };
        let lines = lines.unwrap_or_else(|| {
            let text = "left out: it is no short formula; ask `dispersion(&state, [phase])`";
            vec![("dispersion", text.to_owned())]
        });
        entries.extend(lines.into_iter().map(|(heading, text)| (heading, format!("{of}{text}"))));
    }
    // A part without a formula may have the shorter step.
    let shortest = steps.len() == stencil.blocks.len() && !steps.is_empty();
    if shortest {
        steps.dedup();
        let list = steps.join(" and ");
        entries.push(("longest step", format!("{list} with leapfrog, by the nodes between the ends")));
    }
    let mut where_ = String::from("kappa is the phase per node; all coordinates are zero");
    if !stencil.alike.is_empty() {
        where_.push_str(&format!(", all {} alike", stencil.alike.join(", ")));
    }
    if stencil.border {
        where_.push_str(", coordinates beside are held");
    }
    entries.push(("", where_));
    entries.sort_by_key(|(heading, _)| match *heading {
        "dispersion" => 0,
        "" => 1,
        "long waves" => 2,
        "largest omega^2" | "omega^2" => 3,
        _ => 4,
    });
    let mut last = "none";
    for (heading, _) in &mut entries {
        let known = *heading == last;
        last = heading;
        if known {
            *heading = "";
        }
    }
    entries
}

/// A symbol for the phase, with a name that the model does not have.
fn kappa(family: &mut FamilyModel) -> NodeId {
    let taken = |name: &str| family.model.parameters.iter().any(|p| p.name == name);
    let name = ["kappa", "phase_per_node"].into_iter().find(|name| !taken(name)).unwrap_or("phase");
    let number = family.model.parameters.len() as u32;
    let origin = family.model.coordinates.first().map(|c| c.origin).unwrap_or_default();
    family.model.parameters.push(Parameter { name: name.to_owned(), unit: String::new(), origin });
    family.sources.push(Source::Scalar(number));
    family.model.graph.symbol(Symbol::Parameter(number))
}

/// The text of a node; `None` where it is long.
fn text(family: &FamilyModel, id: NodeId) -> Option<String> {
    let text = Formulas::whole(&Plain::READABLE, &family.model, id)?.text;
    (text.len() <= LONGEST).then_some(text)
}

/// The relation of a field that no other one is coupled to, with what follows from it. `None` where it is no
/// short formula.
fn single(
    family: &mut FamilyModel,
    stencil: &Stencil,
    field: usize,
    kappa: NodeId,
    steps: &mut Vec<String>,
) -> Option<Vec<(&'static str, String)>> {
    let g = &mut family.model.graph;
    let stiffness = stencil.stiffness.cosines(g, field)?;
    let mass = stencil.mass.cosines(g, field)?;
    if stiffness.iter().all(|entry| g.is_zero(*entry)) {
        return Some(vec![("dispersion", String::from("omega = 0: nothing drives these nodes back"))]);
    }
    let shapes = Cosines::of(g, &stiffness).zip(Cosines::of(g, &mass));
    let Some((above, below)) = shapes else {
        return banded(family, &stiffness, &mass, kappa, steps);
    };
    let factor = quotient(g, above.factor, below.factor)?;
    let (top, bottom) = (above.shape(g, kappa), below.shape(g, kappa));
    let numerator = g.mul(factor, top);
    let relation = g.div(numerator, bottom)?;
    let mut entries = vec![("dispersion", format!("omega^2 = {}", text(family, relation)?))];
    if let Some(long) = above.long_waves_over(&below).filter(|long| long.power > 0) {
        let leading = scaled(&mut family.model.graph, factor, long.leading);
        let power = match long.power {
            1 => String::from("kappa"),
            power => format!("kappa^{power}"),
        };
        let g = &mut family.model.graph;
        let mut phase = g.powi(kappa, i32::try_from(long.power).ok()?)?;
        phase = g.mul(leading, phase);
        let leading = text(family, phase).unwrap_or(power);
        let long = match long.error {
            None => format!("omega^2 = {leading}, with no error"),
            Some((order, error)) => {
                let g = &mut family.model.graph;
                let size = if error.is_negative() { error.opposite() } else { error };
                let power = g.powi(kappa, i32::try_from(order).ok()?)?;
                let error_term = scaled(g, power, size);
                let sign = if error.is_negative() { "-" } else { "+" };
                let error_term = text(family, error_term)?;
                format!("omega^2 = {leading} (1 {sign} {error_term} + ..), an error of order {order}")
            }
        };
        entries.push(("long waves", long));
    }
    if let Some(greatest) = above.greatest_over(&below) {
        let square = scaled(&mut family.model.graph, factor, greatest);
        entries.push(("largest omega^2", format!("{} at kappa = pi", text(family, square)?)));
        steps.extend(longest_step(family, square));
    }
    Some(entries)
}

/// The relation of a field whose entries have no rational ratios, as beads on an elastic foundation. Where
/// only neighbours are coupled, ω² is between its values at κ = 0 and π.
fn banded(
    family: &mut FamilyModel,
    stiffness: &[NodeId],
    mass: &[NodeId],
    kappa: NodeId,
    steps: &mut Vec<String>,
) -> Option<Vec<(&'static str, String)>> {
    let g = &mut family.model.graph;
    let (above, below) = (sum(g, stiffness, kappa), sum(g, mass, kappa));
    let relation = crate::text::quotient(&mut family.model, above, below)?;
    if relation.len() > LONGEST {
        return None;
    }
    let mut entries = vec![("dispersion", format!("omega^2 = {relation}"))];
    if stiffness.len() > 2 || mass.len() > 2 {
        return Some(entries);
    }
    let mut end = |odd: bool| {
        let g = &mut family.model.graph;
        let mut at = |all: &[NodeId]| {
            all.iter().enumerate().fold(g.zero(), |sum, (d, entry)| match odd && d % 2 == 1 {
                true => g.sub(sum, *entry),
                false => g.add(sum, *entry),
            })
        };
        (at(stiffness), at(mass))
    };
    let ends = [end(false), end(true)];
    let squares = ends.map(|(above, below)| crate::text::quotient(&mut family.model, above, below));
    if let [Some(first), Some(last)] = squares {
        entries.push(("omega^2", format!("between {first} at kappa = 0 and {last} at kappa = pi")));
    }
    // The step that a vanishing frequency permits is any.
    let moving = ends.into_iter().filter(|(above, _)| !family.model.graph.is_zero(*above));
    let mut bounds = Vec::new();
    for (above, below) in moving.collect::<Vec<_>>() {
        let g = &mut family.model.graph;
        let four = g.integer(4);
        let above_step = g.mul(four, below);
        bounds.extend(crate::text::quotient(&mut family.model, above_step, above));
    }
    if !bounds.is_empty() {
        let roots: Vec<String> = bounds.iter().map(|square| format!("sqrt({square})")).collect();
        steps.push(roots.join(" and "));
    }
    Some(entries)
}

/// a ω⁴ − b ω² + c = 0 of two coupled fields.
fn pair(family: &mut FamilyModel, stencil: &Stencil, fields: [usize; 2], kappa: NodeId) -> Option<String> {
    let g = &mut family.model.graph;
    let [a, b] = fields;
    let diagonal = |g: &mut Graph, of: &Couplings, field: usize| {
        let coefficients = of.cosines(g, field)?;
        Some(sum(g, &coefficients, kappa))
    };
    let (k, l) = (diagonal(g, &stencil.stiffness, a)?, diagonal(g, &stencil.stiffness, b)?);
    let (m, n) = (diagonal(g, &stencil.mass, a)?, diagonal(g, &stencil.mass, b)?);
    let mut product = |left: &Couplings, right: &Couplings| {
        let coefficients = left.product(g, right, fields)?;
        Some(sum(g, &coefficients, kappa))
    };
    let kk = product(&stencil.stiffness, &stencil.stiffness)?;
    let mm = product(&stencil.mass, &stencil.mass)?;
    let km = product(&stencil.stiffness, &stencil.mass)?;
    let (mn, kn, lm, kl) = (g.mul(m, n), g.mul(k, n), g.mul(l, m), g.mul(k, l));
    let fourth = g.sub(mn, mm);
    let two = g.integer(2);
    let twice = g.mul(two, km);
    let sum_of = g.add(kn, lm);
    let second = g.sub(sum_of, twice);
    let last = g.sub(kl, kk);
    if g.is_zero(fourth) {
        return None;
    }
    let [fourth, second, last] = [fourth, second, last].map(|id| text(family, id));
    let line = format!("({}) omega^4 - ({}) omega^2 + {} = 0", fourth?, second?, last?);
    (line.len() <= LONGEST).then_some(line)
}

/// 2/√ω².
fn longest_step(family: &mut FamilyModel, square: NodeId) -> Option<String> {
    let g = &mut family.model.graph;
    let four = g.integer(4);
    let step = quotient(g, four, square)?;
    let step = match root(g, step) {
        Some(step) => step,
        None => g.unary(Unary::Sqrt, step),
    };
    text(family, step)
}

fn quotient(g: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    match g.cancelled_quotient(a, b) {
        Some(quotient) => Some(quotient),
        None => g.div(a, b),
    }
}

fn scaled(g: &mut Graph, a: NodeId, by: Number) -> NodeId {
    let by = g.number(by);
    g.mul(by, a)
}
