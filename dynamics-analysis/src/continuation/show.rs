//! Branches in words, as tables and as diagrams.
//!
//! Stable parts are solid, unstable ones dashed. Where linear theory does not decide, the line is grey and
//! dotted. Special points carry their names.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt::{self, Write};
use std::path::Path;

use dynamics_runtime::model::{ModelState, Vector};
use dynamics_view::file::{self, FileError};
use dynamics_view::text::{exact, readable};
use dynamics_view::{Axis, Chart, Color, Mark, Panel, Series};

use super::branch::{Branch, BranchEnd, Diagram, PointOnBranch, SpecialKind, SpecialPoint, StabilityClass};
use super::buckling::Buckling;
use crate::page::{Page, PageSection};
use crate::table::columns;

const DIAGRAM_LEGEND: &str = "Solid curves stay, dashed ones do not: small disturbances grow. Grey is what \
    linear theory leaves undecided. Signs stand where equilibria appear, vanish or change their stability.";

impl Page {
    /// Adds branches of equilibria: panels of them (see [`Diagram::panel`]), and their special points as a
    /// table.
    #[must_use]
    pub fn diagram<S: ModelState>(
        self,
        title: &str,
        diagram: &Diagram<S>,
        panels: impl IntoIterator<Item = Panel>,
    ) -> Self {
        let section = PageSection::new(title, &diagram.heading(), DIAGRAM_LEGEND);
        self.section(section.charts(panels).table(&diagram.rows()))
    }
}

impl fmt::Display for SpecialKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MultipleBifurcation { count } => write!(f, "{count} stiffnesses vanish together"),
            Self::Hopf { frequency } => write!(f, "Hopf point at {} rad/s", readable(*frequency, 7)),
            Self::FrequenciesMeet { frequency } => {
                write!(f, "frequencies meet at {} rad/s", readable(*frequency, 7))
            }
            Self::FlutterDivergence { growth } => {
                write!(f, "flutter meets divergence at {}/s", readable(*growth, 7))
            }
            other => f.write_str(other.name()),
        }
    }
}

impl SpecialKind {
    /// The name of the kind, without numbers.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Fold => "fold",
            Self::Pitchfork { supercritical: true } => "pitchfork, supercritical",
            Self::Pitchfork { supercritical: false } => "pitchfork, subcritical",
            Self::Transcritical => "transcritical point",
            Self::BranchPoint => "branch point",
            Self::MultipleBifurcation { .. } => "several branch points",
            Self::Hopf { .. } => "Hopf point",
            Self::FrequenciesMeet { .. } => "frequencies meet",
            Self::FlutterDivergence { .. } => "flutter meets divergence",
        }
    }
}

impl fmt::Display for StabilityClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
            Self::Undecided => "undecided",
        })
    }
}

impl fmt::Display for BranchEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Range => "at an end of the range",
            Self::Closed => "where it began",
            Self::Points => "after as many points",
            Self::ZeroFrequency => "where its frequency is zero",
        })
    }
}

impl<S: ModelState> Branch<S> {
    /// First point, special points and last point as rows of text, the names of the columns first.
    fn rows(&self) -> Vec<Vec<String>> {
        let names = self.coordinates.iter().map(|q| q.name.to_string());
        let mut rows = alloc::vec![
            ["".to_string(), self.parameter.clone()].into_iter().chain(names).collect::<Vec<_>>()
        ];
        let row = |name: String, parameter: f64, state: &S| {
            let values = state.q().as_slice().iter().map(|q| readable(q + 0.0, 9));
            [name, readable(parameter, 12)].into_iter().chain(values).collect::<Vec<_>>()
        };
        let (first, last) = (self.points.first(), self.points.last());
        rows.extend(
            first.map(|point| {
                row(format!("from, {}", point.stability_class()), point.parameter, &point.state)
            }),
        );
        for special in &self.special {
            rows.push(row(special.kind.to_string(), special.parameter, &special.state));
        }
        rows.extend(
            last.map(|point| row(format!("to, {}", point.stability_class()), point.parameter, &point.state)),
        );
        rows
    }
}

impl<S: ModelState> Diagram<S> {
    /// The rows of all branches.
    fn rows(&self) -> Vec<Vec<String>> {
        let mut all: Vec<Vec<String>> = Vec::new();
        for (k, branch) in self.branches.iter().enumerate() {
            let rows = branch.rows().into_iter().enumerate().filter(|(i, _)| k == 0 || *i > 0);
            all.extend(rows.map(|(i, mut row)| {
                row[0] = if i == 0 { String::new() } else { format!("{}: {}", k + 1, row[0]) };
                row
            }));
        }
        all
    }

    /// How many branches there are, and what is missing.
    fn heading(&self) -> String {
        let mut words = match self.branches.len() {
            1 => "One branch".to_string(),
            count => format!("{count} branches"),
        };
        if self.left_out > 0 {
            let _ = write!(words, ", {} more left out", self.left_out);
        }
        words.push('.');
        for (parameter, reason) in &self.failures {
            let _ = write!(words, " From {}: {reason}.", readable(*parameter, 9));
        }
        words
    }
}

impl<S: ModelState> From<Branch<S>> for Diagram<S> {
    fn from(branch: Branch<S>) -> Self {
        Self { branches: alloc::vec![branch], failures: Vec::new(), left_out: 0 }
    }
}

/// The pieces of the branch with their stability, and the special points between them.
impl<S: ModelState> fmt::Display for Branch<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&columns(&self.rows()))?;
        write!(f, "{} points, {} steps made shorter; it ends {}", self.points.len(), self.rejected, self.end)
    }
}

impl<S: ModelState> fmt::Display for Diagram<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, branch) in self.branches.iter().enumerate() {
            writeln!(f, "branch {}\n{branch}", k + 1)?;
        }
        for (parameter, reason) in &self.failures {
            writeln!(f, "from {}: {reason}", readable(*parameter, 9))?;
        }
        write!(f, "{} branches, {} left out", self.branches.len(), self.left_out)
    }
}

impl<S: ModelState> fmt::Display for Buckling<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = [self.parameter.clone(), "nonlinearity".into()].into_iter();
        let names = self.coordinates.iter().map(|q| q.name.to_string());
        let mut rows = alloc::vec![head.chain(names).collect::<Vec<_>>()];
        for load in &self.loads {
            let shape = load.shape.as_slice().iter().map(|x| readable(*x, 4));
            let head = [readable(load.parameter, 12), readable(load.nonlinearity, 2)].into_iter();
            rows.push(head.chain(shape).collect());
        }
        f.write_str(columns(&rows).trim_end())
    }
}

impl<S: ModelState> Branch<S> {
    /// The points as comma-separated values: parameter, coordinates, arclength, stability, the largest real
    /// part of an eigenvalue.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut out = head(&self.parameter, self.coordinates.iter().map(|q| q.name));
        self.lines(&mut out, 1);
        out
    }

    fn lines(&self, out: &mut String, number: usize) {
        for point in &self.points {
            let _ = write!(out, "{number},{}", exact(point.parameter));
            point.state.q().as_slice().iter().for_each(|q| {
                let _ = write!(out, ",{}", exact(*q));
            });
            let growth = point.stability.as_ref().map_or(f64::NAN, |stability| stability.abscissa);
            let _ =
                writeln!(out, ",{},{},{},", exact(point.arclength), point.stability_class(), exact(growth));
        }
        for special in &self.special {
            let _ = write!(out, "{number},{}", exact(special.parameter));
            special.state.q().as_slice().iter().for_each(|q| {
                let _ = write!(out, ",{}", exact(*q));
            });
            let name = special.kind.name().replace(", ", " ");
            let _ = writeln!(out, ",{},,,{name}", exact(special.arclength));
        }
    }

    /// Writes [`Branch::to_csv`], making the folders that the path needs.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), file::Content::Table, self.to_csv().as_bytes())
    }

    /// A quantity of each state over the parameter.
    #[must_use]
    pub fn panel(&self, title: &str, of: impl Fn(&S) -> f64) -> Panel {
        panel(core::slice::from_ref(self), title, of)
    }
}

impl<S: ModelState> Diagram<S> {
    /// The points of all branches as comma-separated values, branches by number.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let Some(first) = self.branches.first() else { return String::new() };
        let mut out = head(&first.parameter, first.coordinates.iter().map(|q| q.name));
        self.branches.iter().enumerate().for_each(|(k, branch)| branch.lines(&mut out, k + 1));
        out
    }

    /// Writes [`Diagram::to_csv`], making the folders that the path needs.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        file::write(path.as_ref(), file::Content::Table, self.to_csv().as_bytes())
    }

    /// A quantity of each state over the parameter: the bifurcation diagram.
    #[must_use]
    pub fn panel(&self, title: &str, of: impl Fn(&S) -> f64) -> Panel {
        panel(&self.branches, title, of)
    }

    /// Writes [`Diagram::panel`] as an SVG file under a title, making the folders that the path needs.
    pub fn write_svg(
        &self,
        path: impl AsRef<Path>,
        title: &str,
        axis: &str,
        of: impl Fn(&S) -> f64,
    ) -> Result<(), FileError> {
        Chart::new(title).panel(self.panel(axis, of)).write_svg(path)
    }
}

fn head(parameter: &str, names: impl Iterator<Item = &'static str>) -> String {
    let quoted = |name: &str| match name.contains([',', '"', '\n']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_string(),
    };
    let names: String = names.fold(String::new(), |all, name| all + "," + &quoted(name));
    format!("branch,{}{names},arclength,stability,growth,special\n", quoted(parameter))
}

fn panel<S: ModelState>(branches: &[Branch<S>], title: &str, of: impl Fn(&S) -> f64) -> Panel {
    let name = branches.first().map_or("parameter", |branch| &branch.parameter);
    let mut panel = Panel::new(Axis::new(name), Axis::new(title));
    for (stability, color) in [
        (StabilityClass::Stable, Color::Blue),
        (StabilityClass::Unstable, Color::Red),
        (StabilityClass::Undecided, Color::Faint),
    ] {
        let points: Vec<(f64, f64)> =
            branches.iter().flat_map(|branch| lines_of_stability(branch, stability, &of)).collect();
        if points.iter().any(|(x, _)| x.is_finite()) {
            let series = Series::new(stability.to_string(), points).color(color);
            panel = panel.series(if stability == StabilityClass::Stable {
                series.solid()
            } else {
                series.dashed()
            });
        }
    }
    let mut kinds: Vec<&'static str> = Vec::new();
    let all = || branches.iter().flat_map(|branch| &branch.special);
    for kind in all().map(|special| special.kind.name()) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    for (k, kind) in kinds.into_iter().enumerate() {
        let place = |special: &SpecialPoint<S>| (special.parameter, of(&special.state));
        let points = all().filter(|special| special.kind.name() == kind).map(place);
        panel = panel.series(Series::new(kind, points).mark(Mark::Points).color(Color::Ink).sign(k));
    }
    panel
}

/// The lines of a branch on which it has the wanted stability, each up to the special point that ends it,
/// with gaps between them.
fn lines_of_stability<S: ModelState>(
    branch: &Branch<S>,
    wanted: StabilityClass,
    of: &impl Fn(&S) -> f64,
) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for (from, to, stability) in
        branch.points.windows(2).flat_map(|pair| lines_between(branch, &pair[0], &pair[1], of))
    {
        if stability != wanted {
            continue;
        }
        if out.last() != Some(&from) {
            // Branches follow each other in one series: the first piece of each begins with a gap, too.
            out.push((f64::NAN, f64::NAN));
            out.push(from);
        }
        out.push(to);
    }
    out
}

/// A line on a chart from one point to another, and the stability on it.
type StabilityLine = ((f64, f64), (f64, f64), StabilityClass);

/// The lines between two points: one, or one up to the first special point between them, one between the
/// special points, and one from the last of them.
fn lines_between<S: ModelState>(
    branch: &Branch<S>,
    before: &PointOnBranch<S>,
    after: &PointOnBranch<S>,
    of: &impl Fn(&S) -> f64,
) -> Vec<StabilityLine> {
    let at = |parameter: f64, state: &S| (parameter, of(state));
    let (from, to) = (at(before.parameter, &before.state), at(after.parameter, &after.state));
    let is_between = |special: &&SpecialPoint<S>| {
        special.arclength > before.arclength && special.arclength <= after.arclength
    };
    let mut between = branch.special.iter().filter(is_between);
    let (first, last) = (between.next(), branch.special.iter().rfind(is_between));
    match (first, last) {
        (Some(first), Some(last)) => {
            let [first, last] = [first, last].map(|special| at(special.parameter, &special.state));
            alloc::vec![
                (from, first, before.stability_class()),
                (first, last, after.stability_class()),
                (last, to, after.stability_class())
            ]
        }
        // A single undecided point, as in a branch point, does not make a line undecided.
        _ => {
            let stability = match (before.stability_class(), after.stability_class()) {
                (StabilityClass::Undecided, other) | (other, StabilityClass::Undecided) => other,
                (_, later) => later,
            };
            alloc::vec![(from, to, stability)]
        }
    }
}
