//! The rows together: which repeat or contradict others, in every state and where the constraints hold.
//!
//! Constraints that are always on have to be consistent among themselves, and every switched one together
//! with them. Switched ones may exclude each other, or touch where one takes over from another: models do not
//! declare which of them are on together. The freedom with all of them on is reported, as a model starts with
//! all of them on, but it does not decide the solver.

use crate::check::Finding;
use crate::mechanics::Model;

use super::generic::{Dependent, Samples, Verdict, entangled};
use super::integrable::{self, Integrability, Undeclared};
use super::likely;
use super::manifold::{self, RowDependence, SampledManifold};
use super::rows::ConstraintRows;
use super::sample::Sample;
use crate::check::finding::{Combination, ConstraintFinding};

/// Most rows up to which a failed search counts as evidence: a set that no start satisfies is called
/// contradictory, and rows that touch others in all states found are called tangent. With more rows, Newton's
/// method may well have missed a branch; then only the report mentions it.
const MOST_CERTAIN_ROWS: usize = 24;
/// Most switched constraints for each of which states on the manifold are searched. Every one of them takes a
/// search of its own; the others are examined in general only.
const MOST_SWITCHED_SEARCHED: usize = 8;

/// The results of the checks of a model's constraints.
#[derive(Clone, Debug, Default)]
pub struct Analysis {
    /// Mistakes.
    pub findings: Vec<Finding>,
    /// Number of rows, R.
    pub rows: usize,
    /// Rank of Φ_q joined by A with all constraints on: where they hold, if states were found in which they
    /// do, otherwise in general.
    pub rank: usize,
    /// The smallest ranks met where the constraints hold: below `rank` where rows repeat others on some
    /// branches of the manifold only.
    pub least: Ranks,
    /// Rank of Φ_q alone.
    pub holonomic_rank: usize,
    /// The ranks of the constraints that are always on, with all switched ones released.
    pub always: Ranks,
    /// The smallest of them met where those hold.
    pub least_always: Ranks,
    /// Whether rows that repeat others on some branches of the manifold only are declared to: then those
    /// branches are the ones that are meant.
    pub branch_meant: bool,
    /// Rows whose multipliers are not unique: those in the span of the others.
    pub not_unique: Vec<usize>,
    /// Constraints with multipliers that are not unique whose whole generalized force Φ_qᵀλ is, by index in
    /// the model.
    pub joint: Vec<usize>,
    /// Rows that can be left out without changing the motion, the last ones of every relation; and those that
    /// are tangent.
    pub superfluous: Vec<usize>,
    /// Rows that depend on others where they hold, and nevertheless hold positions that those leave free: to
    /// second order, so that no reaction holds the velocities.
    pub tangent: Vec<usize>,
    /// States in which the holonomic constraints hold; velocities and the inputs are random. Empty if none
    /// was found or searched.
    pub samples: Vec<Sample>,
    /// States at nominal values by which a solution may be chosen: the same, or where all constraints at once
    /// are not independent because of switched ones, those in which the others hold. Empty where random
    /// parameters say nothing of where this mechanism moves.
    pub guides: Vec<Sample>,
    /// Where the holonomic constraints hold and motions are likely to begin, if known: a solution has to
    /// apply there.
    pub likely: Option<Sample>,
    /// Further states at which it should apply: turned, at the origin's other sides, and without guides
    /// anywhere.
    pub passed: Vec<Sample>,
    /// Whether rows depend on others that are always on together with them, on the branches that are meant:
    /// then the multipliers are not unique and no order of elimination goes through.
    pub redundant: bool,
    /// Where the rank was determined.
    pub rank_scope: RankScope,
    /// Nonholonomic rows that can be integrated; `None` where there are too many rows to settle that.
    pub integrable: Option<usize>,
}

/// Ranks of the rows of some constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ranks {
    /// Of Φ_q joined by A.
    pub all: usize,
    /// Of Φ_q alone.
    pub holonomic: usize,
}

/// Where the rank was determined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RankScope {
    /// In general only: there is no holonomic constraint, or random values of the parameters led nowhere.
    #[default]
    General,
    /// In general only: there are too many rows.
    TooMany,
    /// In general only: no state was found in which all constraints hold at the nominal values.
    Nowhere,
    /// In general only: switched constraints touch each other wherever all of them hold.
    Touching,
    /// In general only: switched constraints exclude each other.
    Excluding,
    /// Where the constraints hold, at nominal values.
    Nominal,
    /// Where the constraints hold, at random values of the parameters that have no nominal one.
    Random,
}

/// Analyses the constraints of a model in which every row is in order by itself.
#[must_use]
pub fn analyse(model: &Model) -> Analysis {
    if model.constraints.is_empty() {
        return Analysis::default();
    }
    let rows = ConstraintRows::of(model);
    let samples = Samples::of(&rows);
    let order = RowOrder::of(model, &rows);
    let mut all = Set { model, rows: &rows, samples: &samples, faults: Vec::new(), entangled: Vec::new() };
    let base = all.examine(&order.always, &order.always, true);
    let mut known = SeparateFindings {
        redundant: base.redundant(),
        guides: base.guides(),
        tangent: base.tangent().to_vec(),
    };
    for (i, switched) in order.switched.iter().enumerate() {
        let together: Vec<usize> = order.always.iter().chain(switched).copied().collect();
        let look = all.examine(&together, switched, i < MOST_SWITCHED_SEARCHED);
        known.redundant |= look.redundant();
        known.tangent.extend(look.tangent());
    }
    let mut analysis = if order.switched.is_empty() {
        Analysis { joint: all.joint(&base), ..summarise(&rows, base) }
    } else {
        let mut whole = all.look(&order.everything(), true);
        whole.leave_out_where_others_touch(&rows, &known.tangent);
        known.guides = match &whole.manifold {
            Some(m) if m.nominal && (whole.redundant() || whole.guides().is_empty()) => known.guides,
            _ => whole.guides(),
        };
        let Analysis { always, least_always, .. } = summarise(&rows, base);
        Analysis { joint: all.joint(&whole), always, least_always, ..summarise(&rows, whole) }
    };
    // A mark that is true on every branch says nothing of which is meant.
    let of = |rows: &[usize], c: usize| rows.iter().any(|r| all.rows.constraint[*r] == c);
    let repeating = |c: &usize| of(&analysis.not_unique, *c) && !of(&analysis.superfluous, *c);
    let mut marked = (0..model.constraints.len()).filter(|c| model.constraints[*c].redundant);
    analysis.branch_meant = analysis.least.all < analysis.rank && marked.any(|c| repeating(&c));
    analysis.redundant = known.redundant || (analysis.branch_meant && analysis.least.all < analysis.rows);
    analysis.guides = known.guides;
    let mut likely = likely::likely(model, &rows).into_iter();
    analysis.likely = likely.next();
    analysis.passed =
        analysis.likely.as_ref().map_or_else(Vec::new, |straight| likely::turned(model, &rows, straight));
    analysis.passed.extend(likely);
    if analysis.guides.is_empty() {
        // Random parameters say nothing of how well, but where a pivot vanishes on a whole branch.
        analysis.passed.extend_from_slice(&analysis.samples);
    }
    if all.faults.is_empty() {
        let known = integrable::integrability(model, &rows, &analysis.superfluous);
        judge_integrability(model, &rows, known.as_ref(), &mut all.faults);
        analysis.integrable = known.map(|k| k.dimension);
    }
    if all.faults.is_empty() {
        all.redundant_in_vain(analysis.rank_scope == RankScope::Nominal);
    }
    analysis.findings = all.faults.into_iter().map(Finding::Constraint).collect();
    analysis
}

/// The order in which rows are examined: those marked as redundant last.
struct RowOrder {
    always: Vec<usize>,
    switched: Vec<Vec<usize>>,
}

impl RowOrder {
    fn of(model: &Model, rows: &ConstraintRows) -> Self {
        let of = |c: usize| (0..rows.len()).filter(move |r| rows.constraint[*r] == c);
        let chosen = |redundant: bool| {
            let wanted = move |c: &usize| {
                !model.constraints[*c].switched && model.constraints[*c].redundant == redundant
            };
            (0..model.constraints.len()).filter(wanted).flat_map(of)
        };
        let switched = (0..model.constraints.len()).filter(|c| model.constraints[*c].switched);
        Self {
            always: chosen(false).chain(chosen(true)).collect(),
            switched: switched.map(|c| of(c).collect()).collect(),
        }
    }

    fn everything(&self) -> Vec<usize> {
        self.always.iter().chain(self.switched.iter().flatten()).copied().collect()
    }
}

/// The findings about some rows.
struct RowFindings {
    order: Vec<usize>,
    rank: usize,
    general: Vec<Dependent>,
    manifold: Option<SampledManifold>,
    ranks: Option<manifold::SampledRanks>,
    /// Switched rows touch each other wherever all hold.
    touching: bool,
}

impl RowFindings {
    /// Whether rows depend on others in every state, or in all that were found.
    fn redundant(&self) -> bool {
        self.rank < self.order.len()
            || self.ranks.as_ref().is_some_and(|ranks| ranks.rank.1 < self.order.len())
    }

    /// The states that were found, if they are those of this mechanism.
    fn guides(&self) -> Vec<Sample> {
        let known =
            self.manifold.as_ref().filter(|m| m.nominal && self.ranks.is_some() && !self.order.is_empty());
        known.map_or_else(Vec::new, |m| m.samples.clone())
    }

    fn tangent(&self) -> &[usize] {
        self.manifold.as_ref().map_or(&[], |m| &m.tangent)
    }

    /// Leaves out the states in which rows are tangent only while everything is on, as where a slot takes
    /// over from a lock: motions pass such states and do not stay there.
    fn leave_out_where_others_touch(&mut self, rows: &ConstraintRows, known: &[usize]) {
        let Some(manifold) = &mut self.manifold else { return };
        if manifold.tangent.iter().any(|r| !known.contains(r)) {
            manifold.leave_out_tangent();
            self.touching = manifold.samples.is_empty();
            self.ranks = manifold.ranks(rows, &self.order);
        }
    }
}

/// The findings before all constraints are examined together.
struct SeparateFindings {
    redundant: bool,
    guides: Vec<Sample>,
    tangent: Vec<usize>,
}

struct Set<'a> {
    model: &'a Model,
    rows: &'a ConstraintRows,
    samples: &'a Samples,
    faults: Vec<ConstraintFinding>,
    /// Rows that are in some relation.
    entangled: Vec<usize>,
}

impl Set<'_> {
    fn look(&self, order: &[usize], project: bool) -> RowFindings {
        let (rank, mut general) = self.samples.dependents(self.rows, order);
        let contradicts = |d: &Dependent| d.verdict == Verdict::Contradicts;
        let contradictory = general.iter().any(contradicts);
        // What is declared to repeat others may do so for some values of the parameters alone: the nominal
        // ones decide.
        let meant = general.iter().all(|d| !contradicts(d) || self.redundant(d.row));
        let possible = project && meant && order.len() <= manifold::MOST_PROJECTED_ROWS;
        let manifold = possible.then(|| SampledManifold::of(self.model, self.rows, order));
        let manifold = manifold.filter(|m| !contradictory || (m.nominal && !m.samples.is_empty()));
        if manifold.is_some() {
            general.iter_mut().filter(|d| contradicts(d)).for_each(|d| d.verdict = Verdict::Open);
        }
        let ranks = manifold.as_ref().and_then(|m| m.ranks(self.rows, order));
        RowFindings { order: order.to_vec(), rank, general, manifold, ranks, touching: false }
    }

    /// Constraints whose generalized force is unique though their multipliers are not: their rows span
    /// nothing that the others span.
    fn joint(&self, look: &RowFindings) -> Vec<usize> {
        let lost: Vec<usize> = match &look.ranks {
            Some(ranks) => ranks.entangled.clone(),
            None => entangled(&look.general),
        };
        let ranks = |order: &[usize]| match &look.manifold {
            Some(m) if !m.samples.is_empty() => {
                m.samples.iter().map(|s| manifold::rank(self.rows, s, order)).collect()
            }
            _ => vec![self.samples.dependents(self.rows, order).0],
        };
        let all = ranks(&look.order);
        let apart = |c: &usize| {
            let (own, rest): (Vec<usize>, Vec<usize>) =
                look.order.iter().partition(|r| self.rows.constraint[**r] == *c);
            own.iter().any(|r| lost.contains(r))
                && ranks(&own).iter().zip(ranks(&rest)).zip(&all).all(|((a, b), whole)| a + b == *whole)
        };
        if lost.is_empty() { Vec::new() } else { (0..self.model.constraints.len()).filter(apart).collect() }
    }

    /// Looks at rows and reports the faults of those in `own`.
    fn examine(&mut self, order: &[usize], own: &[usize], project: bool) -> RowFindings {
        let look = self.look(order, project);
        self.entangled.extend(entangled(&look.general));
        if let Some(ranks) = &look.ranks {
            self.entangled.extend(&ranks.entangled);
        }
        let own_relations = || look.general.iter().filter(|d| own.contains(&d.row));
        let before = self.faults.len();
        for d in own_relations() {
            match d.verdict {
                Verdict::Contradicts => self.faults.push(self.contradicts(d.row, d.of.clone())),
                Verdict::Repeats if !self.redundant(d.row) => {
                    self.faults.push(self.repeats(d.row, d.of.clone(), false))
                }
                _ => {}
            }
        }
        if self.faults.len() == before && look.ranks.is_none() {
            // No state decides, and the repetition is not declared.
            let open = own_relations().find(|d| d.verdict == Verdict::Open && !self.redundant(d.row));
            let fault = open.map(|d| self.open(&look, d));
            self.faults.extend(fault);
        }
        if self.faults.len() == before {
            self.on_manifold(&look, own);
        }
        look
    }

    fn on_manifold(&mut self, look: &RowFindings, own: &[usize]) {
        let Some(manifold) = &look.manifold else { return };
        for r in manifold.vanishing.iter().filter(|r| own.contains(r)) {
            let (name, origin) = self.named(*r);
            self.faults.push(ConstraintFinding::GradientVanishes { name, origin });
        }
        // A stop that cannot be reached may be intended. Constraints that are always on have to be
        // satisfiable.
        let always = own.len() == look.order.len() && look.order.len() <= MOST_CERTAIN_ROWS;
        if let Some(rows) = manifold.nowhere.as_ref().filter(|_| always)
            && let Some((last, _)) = rows.last()
        {
            let missed = rows.iter().map(|(row, distance)| (self.named(*row).0, *distance)).collect();
            self.faults.push(ConstraintFinding::Unsatisfiable { missed, origin: self.named(*last).1 });
        }
        let Some(ranks) = &look.ranks else { return };
        for d in ranks.dependent.iter().filter(|d| own.contains(&d.row)) {
            let of = look
                .general
                .iter()
                .find(|g| g.row == d.row)
                .map_or_else(|| self.combination(d), |g| g.of.clone());
            // Velocities that no motion can have; holonomic rows that hold at all times are consistent by
            // themselves.
            let velocities = d.row >= self.rows.holonomic && !d.consistent;
            if velocities {
                let fault = self.contradicts(d.row, of);
                self.faults.push(fault);
            } else if !self.redundant(d.row) {
                let fault = if manifold.tangent.contains(&d.row) {
                    // A branch on which no row is tangent may have been missed: with many rows only the
                    // report mentions it.
                    let (name, origin) = self.named(d.row);
                    let certain = look.order.len() <= MOST_CERTAIN_ROWS;
                    certain.then_some(ConstraintFinding::Tangent { name, to: of, origin })
                } else {
                    Some(self.repeats(d.row, of, true))
                };
                self.faults.extend(fault);
            }
        }
    }

    fn redundant(&self, row: usize) -> bool {
        self.model.constraints[self.rows.constraint[row]].redundant
    }

    fn named(&self, row: usize) -> (String, crate::graph::Origin) {
        (self.rows.names[row].clone(), self.model.constraints[self.rows.constraint[row]].origin)
    }

    fn contradicts(&self, row: usize, with: Combination) -> ConstraintFinding {
        let (name, origin) = self.named(row);
        ConstraintFinding::Contradicts { name, with, origin }
    }

    fn repeats(&self, row: usize, of: Combination, on_manifold: bool) -> ConstraintFinding {
        let (name, origin) = self.named(row);
        ConstraintFinding::Repeats { name, of, on_manifold, origin }
    }

    /// A row that repeats others or contradicts them, which no state was found to tell.
    fn open(&self, look: &RowFindings, d: &Dependent) -> ConstraintFinding {
        let (coordinates, rows) =
            (self.rows.coordinates, look.order.iter().filter(|r| !self.redundant(**r)).count());
        if look.rank < coordinates {
            return match manifold::misses(self.model, self.rows, &d.others, d.row) {
                true => self.contradicts(d.row, d.of.clone()),
                false => self.repeats(d.row, d.of.clone(), false),
            };
        }
        let (name, origin) = self.named(d.row);
        ConstraintFinding::TooMany { rows, coordinates, name, origin }
    }

    fn combination(&self, d: &RowDependence) -> Combination {
        let Some(constant) = d.constant.as_ref().filter(|c| c.iter().all(|(_, (_, d))| *d == 1)) else {
            return Combination::Of(self.rows.named(d.row, d.others.iter().copied()));
        };
        let names = self.rows.named(d.row, constant.iter().map(|(r, _)| *r));
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let factors: Vec<i64> = constant.iter().map(|(_, (n, _))| *n).collect();
        Combination::Constant(crate::check::modular::combination(&factors, &names))
    }

    /// Constraints marked as redundant of which no row is in any relation, where that is certain: parameters
    /// that are not known might have the very values at which it repeats others, unless there is nothing that
    /// it shares a coordinate with.
    fn redundant_in_vain(&mut self, nominal: bool) {
        for (i, c) in self.model.constraints.iter().enumerate().filter(|(_, c)| c.redundant) {
            let entangled = self.entangled.iter().any(|r| self.rows.constraint[*r] == i);
            if !entangled && (nominal || self.alone(i)) {
                self.faults
                    .push(ConstraintFinding::RedundantInVain { name: c.name.clone(), origin: c.origin });
            }
        }
    }

    /// Whether a constraint is one row, and no other row moves a coordinate of it.
    fn alone(&self, constraint: usize) -> bool {
        let own: Vec<usize> =
            (0..self.rows.len()).filter(|r| self.rows.constraint[*r] == constraint).collect();
        let [own] = own[..] else { return false };
        let shares = |r: usize| {
            self.rows.jacobian[r].iter().any(|(j, _)| self.rows.jacobian[own].iter().any(|(k, _)| j == k))
        };
        (0..self.rows.len()).all(|r| r == own || !shares(r))
    }
}

fn summarise(rows: &ConstraintRows, look: RowFindings) -> Analysis {
    let holonomic = |r: &usize| *r < rows.holonomic;
    let mut superfluous: Vec<usize> = look.general.iter().map(|d| d.row).collect();
    let mut not_unique = entangled(&look.general);
    let mut rank = look.rank;
    let mut rank_scope = match &look.manifold {
        _ if look.touching => RankScope::Touching,
        // Of those that are always on it is a finding.
        _ if look.general.iter().any(|d| d.verdict == Verdict::Contradicts) => RankScope::Excluding,
        None if look.order.len() > manifold::MOST_PROJECTED_ROWS => RankScope::TooMany,
        Some(m) if m.samples.is_empty() && m.nominal => RankScope::Nowhere,
        _ => RankScope::General,
    };
    if let (Some(ranks), Some(manifold)) = (&look.ranks, &look.manifold) {
        rank_scope = if manifold.nominal { RankScope::Nominal } else { RankScope::Random };
        rank = ranks.rank.1.min(rank);
        superfluous.extend(ranks.dependent.iter().map(|d| d.row));
        // A relation that holds in every state may leave out some of its rows where they hold.
        not_unique.clone_from(&ranks.entangled);
    }
    superfluous.extend(look.manifold.iter().flat_map(|m| m.vanishing.iter().copied()));
    for list in [&mut superfluous, &mut not_unique] {
        list.sort_unstable();
        list.dedup();
    }
    let lost = superfluous.iter().filter(|r| holonomic(r)).count();
    let places: Vec<usize> = look.order.iter().copied().filter(holonomic).collect();
    let touching = look.manifold.as_ref().map_or(&[][..], |m| &m.tangent);
    // What is held at the states that were found; which rows can be left out may differ from one to the next.
    // Rows that are tangent hold more than their rank says.
    let held = || look.manifold.iter().flat_map(|m| m.held.iter().copied());
    let most = Ranks { all: rank, holonomic: held().max().unwrap_or(places.len() - lost) };
    let met = look
        .manifold
        .iter()
        .flat_map(|m| m.samples.iter().zip(&m.held))
        .map(|(s, held)| Ranks { all: manifold::rank(rows, s, &look.order), holonomic: *held });
    let least = met.fold(most, |least, here| Ranks {
        all: least.all.min(here.all),
        holonomic: least.holonomic.min(here.holonomic),
    });
    let tangent = touching.iter().copied().filter(|r| superfluous.contains(r)).collect();
    Analysis {
        findings: Vec::new(),
        rows: rows.len(),
        rank,
        least,
        holonomic_rank: most.holonomic,
        always: most,
        least_always: least,
        branch_meant: false,
        not_unique,
        joint: Vec::new(),
        superfluous,
        tangent,
        samples: look.manifold.map_or_else(Vec::new, |m| m.samples),
        guides: Vec::new(),
        likely: None,
        passed: Vec::new(),
        redundant: false,
        rank_scope,
        integrable: None,
    }
}

fn judge_integrability(
    model: &Model,
    rows: &ConstraintRows,
    known: Option<&Integrability>,
    faults: &mut Vec<ConstraintFinding>,
) {
    let Some(known) = known else { return };
    for group in &known.undeclared {
        let first = &model.constraints[rows.constraint[group.rows[0]]];
        let names = rows.named(0, group.rows.iter().copied());
        let Undeclared { integrable, of, determined, .. } = *group;
        faults.push(ConstraintFinding::Integrable {
            integrable,
            of,
            names,
            determined,
            origin: first.origin,
        });
    }
    for (i, c) in model.constraints.iter().enumerate() {
        let said = c.kind == crate::mechanics::ConstraintKind::Nonholonomic { integrable: true };
        if said && !c.switched && !known.rows.iter().any(|r| rows.constraint[*r] == i) {
            faults.push(ConstraintFinding::IntegrableInVain { name: c.name.clone(), origin: c.origin });
        }
    }
}
