//! Charts and the animation of a [`Motion`].

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use dynamics_view::{Animation, Axis, Chart, Drawing, Film, OutputError, Panel, Series, text};

use crate::model::names::{self, Column};
use crate::model::{Draw, ModelState, Vector};
use crate::simulate::{EventRecord, Motion, Simulate};

/// A curve has at least about so many points, so that it looks smooth over the width of a page.
const MIN_CURVE_POINTS: usize = 2000;
/// Most interpolated points of a step.
const MAX_STEP_POINTS: usize = 200;
/// Most curves of a panel: more are hard to tell apart.
const MAX_PANEL_CURVES: usize = 6;

/// Charts.
impl<M: Simulate> Motion<'_, M> {
    /// Coordinates and velocities over time, those with the same unit in the same panel.
    #[must_use]
    pub fn history_chart(&self) -> Chart {
        let states = self.fine_states();
        let rows = |of: fn(&M::State) -> &M::Vector| -> Vec<_> {
            states.iter().map(|state| (state.t(), of(state).as_slice().to_vec())).collect()
        };
        let q = panels::<M>("coordinates", names::coordinates::<M>(), &rows(ModelState::q));
        let u = panels::<M>("velocities", names::velocities::<M>(), &rows(ModelState::u));
        let panels = q.into_iter().chain(u).map(|panel| self.with_events(panel));
        chart(format!("{}: coordinates and velocities", M::NAME), panels)
    }

    /// The declared outputs over time, those with the same unit in the same panel; without panels where none
    /// is declared.
    #[must_use]
    pub fn outputs_chart(&self) -> Chart {
        let rows: Vec<_> =
            self.fine_states().iter().map(|state| (state.t(), self.outputs_of(state))).collect();
        let panels = panels::<M>("outputs", names::plain(M::OUTPUTS), &rows);
        chart(format!("{}: outputs", M::NAME), panels.into_iter().map(|panel| self.with_events(panel)))
    }

    /// A coordinate's velocity over the coordinate: the phase portrait.
    pub fn phase_chart(&self, coordinate: &str) -> Result<Chart, OutputError> {
        let index = M::COORDINATES.iter().position(|quantity| quantity.name == coordinate);
        let index = index.ok_or_else(|| unknown(coordinate, names::coordinates::<M>()))?;
        let (Some(q), Some(u)) = (names::coordinates::<M>().nth(index), names::velocities::<M>().nth(index))
        else {
            return Err(unknown(coordinate, names::coordinates::<M>()));
        };
        let states = self.fine_states();
        let points = states.iter().map(|state| (state.q().as_slice()[index], state.u().as_slice()[index]));
        let panel = Panel::new(Axis::new(q.title()), Axis::new(u.title())).line("", points).points(
            "start",
            states.first().map(|state| (state.q().as_slice()[index], state.u().as_slice()[index])),
        );
        Ok(chart(format!("{}: phase portrait of {coordinate}", M::NAME), [panel]))
    }

    /// The error of the energy over time at the accepted steps: E − E₀ less the work of forces and of resets,
    /// in parts of the largest energy met.
    #[must_use]
    pub fn energy_chart(&self) -> Chart {
        let panel =
            Panel::new(Axis::new(names::time::<M>().title()), Axis::new("relative error of the energy"))
                .line("", self.energy_errors());
        chart(format!("{}: drift of the energy, {}", M::NAME, self.method()), [self.with_events(panel)])
    }

    /// With an upright line for every event, under the event's name.
    fn with_events(&self, panel: Panel) -> Panel {
        let mut names: Vec<&str> = self.events().iter().map(|event| event.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names.into_iter().fold(panel, |panel, name| {
            let times = self.events().iter().filter(|event| event.name == name);
            panel.instants(name, times.map(EventRecord::time))
        })
    }

    /// The accepted states with interpolated ones between them, enough for smooth curves.
    pub(super) fn fine_states(&self) -> Vec<M::State> {
        let mut sampler = self.sampler();
        let steps = self.steps();
        let parts = MIN_CURVE_POINTS.div_ceil(steps.len().max(1)).clamp(1, MAX_STEP_POINTS);
        let mut states: Vec<M::State> = Vec::new();
        for state in steps {
            if let Some(before) = states.last().map(ModelState::t) {
                let length = state.t() - before;
                let between = if length == 0.0 { 1 } else { parts };
                for k in 1..between {
                    states.push(sampler.at(before + length * (k as f64 / between as f64)));
                }
            }
            states.push(state);
        }
        states
    }
}

/// Charts and the animation as files; the folders that a path needs are made.
#[cfg(feature = "std")]
impl<M: Simulate> Motion<'_, M> {
    /// Writes [`history_chart`](Motion::history_chart) as `.svg` or `.png`, as [`Chart::write`] does.
    pub fn plot(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        Ok(self.history_chart().write(path)?)
    }

    /// Writes [`outputs_chart`](Motion::outputs_chart) as `.svg` or `.png`, as [`Chart::write`] does.
    pub fn plot_outputs(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        Ok(self.outputs_chart().write(path)?)
    }

    /// Writes [`phase_chart`](Motion::phase_chart) as `.svg` or `.png`, as [`Chart::write`] does.
    pub fn plot_phase(&self, coordinate: &str, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        Ok(self.phase_chart(coordinate)?.write(path)?)
    }

    /// Writes [`energy_chart`](Motion::energy_chart) as `.svg` or `.png`, as [`Chart::write`] does.
    pub fn plot_energy(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        Ok(self.energy_chart().write(path)?)
    }

    /// Writes the motion as one page, `.html`, that plays in any browser, as [`Motion::animation`] makes it.
    pub fn animate(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError>
    where
        M: Draw,
    {
        self.animation().write_html(path)
    }
}

impl<M: Simulate + Draw> Motion<'_, M> {
    /// The motion as an animation that can still be changed: title, speed, plotted quantities, further
    /// motions beside it.
    #[must_use]
    pub fn animation(&self) -> Animation<'_> {
        Animation::new().add(self, "")
    }
}

impl<M: Simulate + Draw> Film for Motion<'_, M> {
    fn title(&self) -> String {
        M::NAME.to_string()
    }

    fn method(&self) -> String {
        self.method().to_string()
    }

    fn summary(&self) -> String {
        self.summary().to_string()
    }

    fn span(&self) -> [f64; 2] {
        [self.start_time(), self.end_time()]
    }

    fn time_unit(&self) -> String {
        names::time_unit::<M>().to_string()
    }

    fn length_unit(&self) -> String {
        names::length_unit::<M>().to_string()
    }

    fn quantities(&self) -> Vec<(String, String)> {
        names::coordinates::<M>()
            .chain(names::velocities::<M>())
            .chain(names::plain(M::OUTPUTS))
            .map(|Column { name, unit }| (name, unit))
            .collect()
    }

    fn events(&self) -> Vec<(f64, String)> {
        self.events().iter().map(|event| (event.time(), event.name.clone())).collect()
    }

    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        let mut values = Vec::new();
        for state in self.sample(times.iter().copied()) {
            values.clear();
            values.extend_from_slice(state.q().as_slice());
            values.extend_from_slice(state.u().as_slice());
            values.extend(self.outputs_of(&state));
            show(&self.model().draw(&self.coordinates_of(&state)), &values);
        }
    }
}

/// A chart with these panels.
pub(super) fn chart(title: String, panels: impl IntoIterator<Item = Panel>) -> Chart {
    panels.into_iter().fold(Chart::new(title), Chart::panel)
}

/// Panels over time, one for each unit in the order in which the units appear, with [`MAX_PANEL_CURVES`]
/// curves at most. `values` are rows of time and numbers.
pub(super) fn panels<M: Simulate>(
    what: &str,
    columns: impl Iterator<Item = Column>,
    rows: &[(f64, Vec<f64>)],
) -> Vec<Panel> {
    let mut groups: Vec<(String, Vec<(usize, Column)>)> = Vec::new();
    for (k, column) in columns.enumerate() {
        match groups.iter_mut().rev().find(|(unit, _)| *unit == column.unit) {
            Some((_, group)) if group.len() < MAX_PANEL_CURVES => group.push((k, column)),
            _ => groups.push((column.unit.clone(), [(k, column)].to_vec())),
        }
    }
    groups
        .into_iter()
        .map(|(unit, group)| {
            let title = match group.as_slice() {
                [(_, only)] => only.title(),
                _ => text::with_unit(what, &unit),
            };
            let panel = Panel::new(Axis::new(names::time::<M>().title()), Axis::new(title));
            group.into_iter().fold(panel, |panel, (k, column)| {
                panel.series(Series::new(column.name, rows.iter().map(|(t, values)| (*t, values[k]))))
            })
        })
        .collect()
}

/// The error for a name that is none of the known ones.
fn unknown(name: &str, known: impl Iterator<Item = Column>) -> OutputError {
    OutputError::UnknownName { name: name.to_string(), known: known.map(|column| column.name).collect() }
}

#[cfg(test)]
mod tests;
