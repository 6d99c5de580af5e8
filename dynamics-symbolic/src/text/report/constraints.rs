//! What the report says of constraints: the class of each, what they leave free, loops, uniqueness of the
//! reactions, and how it is all solved.

use crate::check::Analysis;
use crate::check::constraints::{Loop, RankScope, Ranks, loops};
use crate::mechanics::{
    Constraint, ConstraintEquations, ConstraintKind, Elimination, Equations, General, Model, Solution,
};

use super::{counted, entry};

/// Most constraints, loops or rows that the report lists by name. Of more it says how many.
const MOST_LISTED: usize = 12;

/// The lines on constraints; none without any.
pub(super) fn constraints(out: &mut String, model: &Model, equations: &Equations, analysis: &Analysis) {
    let Some(derived) = &equations.constraints else { return };
    classes(out, model, derived, analysis);
    freedom(out, model, derived, analysis);
    found_loops(out, model, derived, analysis);
    reactions(out, model, analysis);
    entry(out, "solved by", &solution(model, derived));
}

/// `rod (m^2): holonomic, fixed`.
fn classes(out: &mut String, model: &Model, derived: &ConstraintEquations, analysis: &Analysis) {
    let mut row = 0;
    for (i, c) in model.constraints.iter().enumerate() {
        let own = row..row + c.components.len();
        row = own.end;
        let moving = own.clone().any(|r| !model.graph.is_zero(derived.velocity_offset[r]));
        let among = |rows: &[usize]| own.clone().filter(|r| rows.contains(r)).count();
        let tangent = among(&analysis.tangent);
        let repeats =
            own.clone().filter(|r| analysis.superfluous.contains(r) && !analysis.tangent.contains(r)).count();
        let branch =
            analysis.branch_meant && c.redundant && own.clone().any(|r| analysis.not_unique.contains(&r));
        let excludes = c.switched && analysis.rank_scope == RankScope::Excluding;
        let text = class(c, moving, if excludes { 0 } else { repeats }, branch && tangent == 0)
            + &some(tangent, c.components.len(), "tangent to others")
            + &some(if excludes { repeats } else { 0 }, c.components.len(), "excludes others");
        match i {
            MOST_LISTED => entry(out, "", &format!("and {} more", model.constraints.len() - i)),
            i if i < MOST_LISTED => entry(out, if i == 0 { "constraints" } else { "" }, &text),
            _ => {}
        }
    }
}

fn class(c: &Constraint, moving: bool, repeats: usize, branch: bool) -> String {
    let unit = unit(&c.units);
    let rows = match c.components.len() {
        1 => String::new(),
        n => format!("{n} rows, "),
    };
    let kind = match (c.kind, moving) {
        (ConstraintKind::Holonomic, false) => "holonomic, fixed",
        (ConstraintKind::Holonomic, true) => "holonomic, moving",
        (ConstraintKind::Nonholonomic { .. }, false) => "nonholonomic, linear",
        (ConstraintKind::Nonholonomic { .. }, true) => "nonholonomic, affine",
    };
    let said =
        if c.kind == (ConstraintKind::Nonholonomic { integrable: true }) { ", integrable" } else { "" };
    let switched = if c.switched { ", switched on and off" } else { "" };
    let repeats = match (repeats, c.components.len()) {
        (0, _) if branch => ", repeats others on some branches".to_owned(),
        (0, _) => String::new(),
        (n, all) if n == all => ", repeats others".to_owned(),
        (n, _) => format!(", {n} of them repeat others"),
    };
    format!("{}{unit}: {rows}{kind}{said}{switched}{repeats}", c.name)
}

/// ` (m)`; nothing where rows have different units or none.
fn unit(units: &[String]) -> String {
    match units {
        [first, others @ ..] if !first.is_empty() && others.iter().all(|unit| unit == first) => {
            format!(" ({first})")
        }
        _ => String::new(),
    }
}

/// `, tangent to others` of all rows or `, 2 of them tangent to others`.
fn some(rows: usize, of: usize, what: &str) -> String {
    match rows {
        0 => String::new(),
        n if n == of => format!(", {what}"),
        n => format!(", {n} of them {what}"),
    }
}

fn freedom(out: &mut String, model: &Model, derived: &ConstraintEquations, analysis: &Analysis) {
    let n = model.coordinates.len();
    let rows = match (analysis.least.all, analysis.rank, analysis.rows) {
        (least, rank, rows) if least < rank => {
            let (some, others) = branches(model, derived);
            let rows = counted(rows, "row");
            format!("{least} of {rows} of constraints independent {some} of the assembly, {rank} {others}")
        }
        (_, rank, rows) if rows == rank => format!("{} of constraints", counted(rows, "independent row")),
        (_, rank, rows) => format!("{rank} of {} of constraints independent", counted(rows, "row")),
    };
    let text = format!(
        "{}; {}, {rows}{}",
        size(model, derived, analysis),
        counted(n, "coordinate"),
        seen(derived, analysis)
    );
    entry(out, "degrees of freedom", &text);
    if analysis.least.all < analysis.rank {
        let (branch, lost) = (
            "which branch the start is on decides",
            "where fewer rows are independent the multipliers are not unique",
        );
        let text = match (analysis.branch_meant, is_fixed(model, derived)) {
            (true, _) => {
                format!(
                    "the branches on which rows repeat others are the ones meant by `#[redundant]`: {branch}"
                )
            }
            (false, true) => format!("{branch}; {lost}"),
            (false, false) => lost.to_owned(),
        };
        entry(out, "", &text);
    }
    if !analysis.tangent.is_empty() {
        let names = rows_text(model, &analysis.tangent);
        let text = "tangent rows hold positions, not velocities: where forces push across";
        entry(out, "", &format!("{text} {names}, runs end with an error"));
    }
    match analysis.integrable {
        Some(n) if n > 0 => {
            entry(out, "", &format!("{} can be integrated", counted(n, "nonholonomic row")));
        }
        None if derived.holonomic < analysis.rows => {
            entry(
                out,
                "",
                "whether the nonholonomic rows can be integrated was not settled, there are too many rows",
            );
        }
        _ => {}
    }
}

fn is_fixed(model: &Model, derived: &ConstraintEquations) -> bool {
    derived.velocity_offset.iter().all(|node| model.graph.is_zero(*node))
}

/// Where a rank is met that is not met everywhere: constraints that move may lose it in passing.
fn branches(model: &Model, derived: &ConstraintEquations) -> (&'static str, &'static str) {
    match is_fixed(model, derived) {
        true => ("on some branches", "on others"),
        false => ("at some times or on some branches", "else"),
    }
}

/// The degrees of freedom, with switched constraints on and off, and what follows where there are none.
fn size(model: &Model, derived: &ConstraintEquations, analysis: &Analysis) -> String {
    let n = model.coordinates.len();
    let free = |ranks: Ranks| (n - ranks.all.min(n), n - ranks.holonomic.min(n));
    let one = |ranks: Ranks| match free(ranks) {
        (velocities, positions) if positions == velocities => velocities.to_string(),
        (velocities, positions) => format!("{velocities} in velocities, {positions} in positions"),
    };
    let (some, others) = branches(model, derived);
    // The largest freedom first: what moves on one branch is not held still. Velocities that are free on
    // some branches where no position is, as rows are tangent there, come second.
    let size = |most: Ranks, least: Ranks| match one(least) {
        text if free(most) == free(least) => text,
        _ if free(most).1 == free(least).1 => {
            format!("{}, but {} in velocities {some}", one(most), free(least).0)
        }
        text if analysis.branch_meant => {
            format!("{text} where rows repeat others, {} on other branches", one(most))
        }
        text => format!("{text} {some}, {} {others}", one(most)),
    };
    let on = size(Ranks { all: analysis.rank, holonomic: analysis.holonomic_rank }, analysis.least);
    let text = if model.constraints.iter().any(|c| c.switched) {
        let off = size(analysis.always, analysis.least_always);
        format!("{on} with all constraints on, {off} with the switched ones released")
    } else {
        on
    };
    let moving = !is_fixed(model, derived);
    let Ranks { all, holonomic } = analysis.least_always;
    match (all >= n, holonomic >= n, moving) {
        (false, ..) => text,
        (true, true, true) => {
            format!("{text}: the constraints alone say how it moves, a matter of `kinematics`")
        }
        (true, false, true) => {
            format!(
                "{text}: constraints on velocities say how it moves, from wherever it starts; `simulate` \
                 follows them"
            )
        }
        (true, true, false) => format!("{text}: the constraints hold it still"),
        (true, false, false) => format!("{text}: the constraints hold it still, wherever it starts"),
    }
}

/// Where the rank of the constraints was determined.
fn seen(derived: &ConstraintEquations, analysis: &Analysis) -> &'static str {
    match analysis.rank_scope {
        _ if derived.holonomic == 0 => " in every state",
        RankScope::Nominal => ", where they hold, at the nominal values",
        RankScope::Random => ", where they hold, with parameters at random; give yours as `#[nominal(..)]`",
        RankScope::General => {
            " in general; no state was found in which they hold, values as `#[nominal(..)]` would help to \
             find one"
        }
        RankScope::TooMany => {
            " in general; too many rows to find states in which they hold, where fewer may be independent"
        }
        RankScope::Nowhere => " in general; no state was found in which they hold",
        RankScope::Excluding => " in general; switched ones exclude each other",
        RankScope::Touching => {
            " in general; where all hold at once switched ones touch each other, and only there"
        }
    }
}

fn found_loops(out: &mut String, model: &Model, derived: &ConstraintEquations, analysis: &Analysis) {
    let found: Vec<Loop> = match &derived.solution {
        Solution::Unrolled(u) => match &u.elimination {
            Elimination::Blocks(blocks) => {
                let holonomic = |rows: &[usize]| rows.iter().all(|r| *r < derived.holonomic);
                let own = blocks.iter().filter(|(rows, _)| holonomic(rows));
                own.map(|(rows, coordinates)| Loop { rows: rows.clone(), coordinates: coordinates.clone() })
                    .collect()
            }
            Elimination::MinimumDegree | Elimination::Speeds => structural(model, derived, analysis),
        },
        Solution::General(_) => structural(model, derived, analysis),
    };
    let found = whole_vectors(model, found);
    if found.is_empty() {
        return;
    }
    // A row by itself closes nothing: a floor, a rod, a drive.
    let (single, loops): (Vec<Loop>, Vec<Loop>) = found.into_iter().partition(|l| l.rows.len() == 1);
    for (heading, found) in
        [("loops", loops), ("single rows", single)].into_iter().filter(|(_, found)| !found.is_empty())
    {
        entry(out, heading, &format!("{}: {}", found.len(), determined(model, &found)));
    }
}

/// `closure for phi, x; drive for theta`.
fn determined(model: &Model, found: &[Loop]) -> String {
    let names = |coordinates: &[usize]| {
        let all: Vec<&str> = coordinates.iter().map(|j| model.coordinates[*j].name.as_str()).collect();
        shortened(&all)
    };
    let one = |l: &Loop| format!("{} for {}", rows_text(model, &l.rows), names(&l.coordinates));
    let texts: Vec<String> = found.iter().take(MOST_LISTED).map(one).collect();
    let more = if found.len() > MOST_LISTED {
        format!("; and {} more", found.len() - MOST_LISTED)
    } else {
        String::new()
    };
    format!("{}{more}", texts.join("; "))
}

/// Components of one vector close one loop, also where they can be solved one after the other.
fn whole_vectors(model: &Model, blocks: Vec<Loop>) -> Vec<Loop> {
    let vector = |r: &usize| {
        let (c, suffix, _) = model.row(*r)?;
        let stem = suffix.strip_suffix(['x', 'y', 'z'])?.strip_suffix('.')?;
        Some((c.name.clone(), stem.to_owned()))
    };
    let mut found: Vec<Loop> = Vec::new();
    for block in blocks {
        let own: Vec<_> = block.rows.iter().filter_map(vector).collect();
        let same = |l: &Loop| l.rows.iter().filter_map(vector).any(|v| own.contains(&v));
        match found.iter_mut().find(|l| same(l)) {
            Some(known) => {
                known.rows.extend(block.rows);
                known.coordinates.extend(block.coordinates);
                known.rows.sort_unstable();
                known.coordinates.sort_unstable();
            }
            None => found.push(block),
        }
    }
    found
}

fn structural(model: &Model, derived: &ConstraintEquations, analysis: &Analysis) -> Vec<Loop> {
    let rows: Vec<usize> = (0..derived.holonomic).filter(|r| !analysis.superfluous.contains(r)).collect();
    loops(model, &derived.jacobian, &rows)
}

/// Which multipliers are unique where rows repeat others: those of the rows that are not in the span of the
/// rest (Wojtyra 2009).
fn reactions(out: &mut String, model: &Model, analysis: &Analysis) {
    if analysis.not_unique.is_empty() {
        let touching = analysis.rank_scope == RankScope::Touching;
        let but = if touching { ", but where all constraints hold at once" } else { "" };
        return entry(out, "reactions", &format!("all unique{but}"));
    }
    let unique: Vec<usize> = (0..analysis.rows).filter(|r| !analysis.not_unique.contains(r)).collect();
    let lost = rows_text(model, &analysis.not_unique);
    let kept = if unique.is_empty() { "none".to_owned() } else { rows_text(model, &unique) };
    let sums: Vec<&str> = analysis.joint.iter().map(|c| model.constraints[*c].name.as_str()).collect();
    let sums = if sums.is_empty() {
        String::new()
    } else {
        format!("; unique as a generalized force of the whole constraint: {}", shortened(&sums))
    };
    let all_on = if model.constraints.iter().any(|c| c.switched) { "with all constraints on, " } else { "" };
    let elsewhere = analysis.rank == analysis.rows && !analysis.branch_meant;
    let few = if elsewhere { "all unique where all rows are independent; elsewhere " } else { "" };
    let text = format!("{all_on}{few}unique: {kept}; not unique, the smallest are given: {lost}{sums}");
    entry(out, "reactions", &text);
}

/// Names of rows, whole constraints by their own name.
fn rows_text(model: &Model, rows: &[usize]) -> String {
    let mut names: Vec<String> = Vec::new();
    let mut first = 0;
    for c in &model.constraints {
        let own = first..first + c.components.len();
        first = own.end;
        let taken: Vec<usize> = own.clone().filter(|r| rows.contains(r)).collect();
        if taken.len() == own.len() {
            names.push(c.name.clone());
        } else {
            names.extend(taken.into_iter().map(|r| model.row_name(r as u32)));
        }
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    shortened(&names)
}

fn shortened(names: &[&str]) -> String {
    match names.len() {
        n if n <= MOST_LISTED => names.join(", "),
        n => format!("{} ... {} ({n})", names[..3].join(", "), names[n - 1]),
    }
}

fn solution(model: &Model, derived: &ConstraintEquations) -> String {
    match &derived.solution {
        Solution::Unrolled(u) => {
            let order = order(model, &u.elimination);
            let behind = match u.guards.len() {
                0 => "no pivot can vanish".to_owned(),
                1 => "one pivot is guarded: where it vanishes the general solver takes over".to_owned(),
                n => format!("{n} pivots are guarded: where one vanishes the general solver takes over"),
            };
            let released = while_released(model, derived);
            format!("generated code, {order}; {behind}{released}")
        }
        Solution::General(why) => {
            let why = match why {
                General::Redundant => {
                    "rows repeat others, the multipliers are those of least norm".to_owned()
                }
                General::Friction => "forces depend on the reactions of the same instant".to_owned(),
                General::NoPivots => "every order of elimination meets a pivot that is zero".to_owned(),
                General::TooLarge(operations) => format!("generated code would take {operations} operations"),
            };
            // It takes over nothing while constraints are released: it is what there is.
            let released =
                if derived.released.is_empty() { String::new() } else { while_released(model, derived) };
            format!("the general rank-revealing solver, at run time: {why}{released}")
        }
    }
}

/// What solves the equations while switched constraints are released: every set of them is a system of its
/// own.
fn while_released(model: &Model, derived: &ConstraintEquations) -> String {
    let switched = model.constraints.iter().filter(|c| c.switched).count() as u32;
    let sets = 2u128.saturating_pow(switched) - 1;
    let own = derived.released.len() as u128;
    let (one, whole) = (switched == 1, own == sets);
    match own {
        _ if switched == 0 => String::new(),
        0 => "; while a switched constraint is released the general solver takes over".into(),
        _ if one => "; code of its own while the switched constraint is released".into(),
        _ if whole => {
            format!(
                "; code of its own for each of the {sets} sets of switched constraints that may be released"
            )
        }
        1 => "; code of its own while all switched constraints are released, the general solver for some of \
             them"
            .into(),
        _ => format!(
            "; code of its own for {own} of the {sets} sets of switched constraints that may be released, \
             the general solver for the others"
        ),
    }
}

/// How generated code eliminates.
fn order(model: &Model, elimination: &Elimination) -> String {
    let blocks = match elimination {
        Elimination::Blocks(blocks) => blocks,
        Elimination::MinimumDegree => {
            return "for accelerations and multipliers together, those with the fewest neighbours first"
                .to_owned();
        }
        Elimination::Speeds => return "the equations of motion for the speeds alone".to_owned(),
    };
    let dependent: Vec<usize> = blocks.iter().flat_map(|(_, c)| c.iter().copied()).collect();
    let free = model.coordinates.iter().enumerate().filter(|(j, _)| !dependent.contains(j));
    let free: Vec<&str> = free.map(|(_, c)| c.name.as_str()).collect();
    let largest = blocks.iter().map(|(rows, _)| rows.len()).max().unwrap_or(0);
    let size = match (blocks.len(), largest) {
        (1, rows) => format!("in one block of {}", counted(rows, "row")),
        (n, 1) => format!("in {n} blocks of 1 row"),
        (n, rows) => format!("in {n} blocks of at most {rows} rows"),
    };
    if free.is_empty() {
        return format!("all coordinates from the constraints, {size}");
    }
    format!(
        "{} from the constraints {size}, the equations of motion for {}",
        counted(dependent.len(), "dependent coordinate"),
        shortened(&free)
    )
}
