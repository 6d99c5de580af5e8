//! Output of a motion with several charts of angles: outputs and pictures, which do not depend on the chart,
//! and a table with the number of the chart.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt::Write;

use dynamics_view::{Animation, Chart, Drawing, Film};
#[cfg(feature = "std")]
use dynamics_view::{
    OutputError,
    file::{self, Content},
};

use super::csv::header;
use super::motion::{chart, panels};
use crate::model::names::{self, Column};
use crate::model::{Draw, ModelState};
use crate::simulate::{ChartSwitchingMotion, EventRecord, Simulate};

impl<M: Simulate> ChartSwitchingMotion<'_, M> {
    /// The declared outputs over time, those with the same unit in the same panel; without panels where none
    /// is declared. Lines mark the changes of charts.
    #[must_use]
    pub fn outputs_chart(&self) -> Chart {
        let mut rows: Vec<(f64, Vec<f64>)> = Vec::new();
        for segment in self.segments() {
            rows.extend(
                segment
                    .motion
                    .fine_states()
                    .iter()
                    .map(|state| (state.t(), segment.motion.outputs_of(state))),
            );
        }
        let changes: Vec<f64> = self.changes().iter().map(|change| change.time).collect();
        let panels = panels::<M>("outputs", names::plain(M::OUTPUTS), &rows).into_iter();
        let panels = panels.map(|panel| panel.instants("change of chart", changes.iter().copied()));
        chart(alloc::format!("{}: outputs", M::NAME), panels)
    }

    /// The motion as comma-separated values, a row for each accepted step: the columns of
    /// [`Motion::csv`](crate::simulate::Motion::csv), and before them the number of the chart in which the
    /// angles and their rates are to be read. Where a chart changes, the same time comes twice.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut out = String::from("chart,");
        out.push_str(&header::<M>());
        let mut line = String::new();
        for segment in self.segments() {
            let table = segment.motion.csv();
            for state in segment.motion.steps() {
                line.clear();
                table.row(&state, &mut line);
                let _ = write!(out, "{},{line}", segment.chart);
            }
        }
        out
    }
}

/// As files; the folders that a path needs are made.
#[cfg(feature = "std")]
impl<M: Simulate> ChartSwitchingMotion<'_, M> {
    /// Writes [`outputs_chart`](ChartSwitchingMotion::outputs_chart) as `.svg` or `.png`, as
    /// [`Chart::write`] does.
    pub fn plot_outputs(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        Ok(self.outputs_chart().write(path)?)
    }

    /// Writes [`to_csv`](ChartSwitchingMotion::to_csv) to a file, `.csv` or without an extension.
    pub fn write_csv(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        use std::io::Write as _;
        let mut file = file::create(path.as_ref(), Content::Table)?;
        file.write_all(self.to_csv().as_bytes()).and_then(|()| file.flush()).map_err(OutputError::Stream)
    }

    /// Writes the motion as one page, `.html`, that plays in any browser.
    pub fn animate(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError>
    where
        M: Draw,
    {
        self.animation().write_html(path)
    }
}

impl<M: Simulate + Draw> ChartSwitchingMotion<'_, M> {
    /// The motion as an animation that can still be changed.
    #[must_use]
    pub fn animation(&self) -> Animation<'_> {
        Animation::new().add(self, "")
    }
}

impl<M: Simulate + Draw> Film for ChartSwitchingMotion<'_, M> {
    fn title(&self) -> String {
        M::NAME.to_string()
    }

    fn method(&self) -> String {
        self.segments()[0].motion.method().to_string()
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

    /// Outputs alone: angles jump with their chart.
    fn quantities(&self) -> Vec<(String, String)> {
        names::plain(M::OUTPUTS).map(|Column { name, unit }| (name, unit)).collect()
    }

    fn events(&self) -> Vec<(f64, String)> {
        ChartSwitchingMotion::events(self)
            .map(|event| (EventRecord::time(event), event.name.clone()))
            .collect()
    }

    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        // Times are in order: one sampler serves all times of a segment.
        let mut rest = times;
        while let Some(first) = rest.first() {
            let segment = self.segment_at(*first);
            let here = rest.iter().take_while(|t| core::ptr::eq(self.segment_at(**t), segment)).count();
            for state in segment.motion.sample(rest[..here].iter().copied()) {
                let picture = segment.motion.model().draw(&segment.motion.coordinates_of(&state));
                show(&picture, &segment.motion.outputs_of(&state));
            }
            rest = &rest[here..];
        }
    }
}
