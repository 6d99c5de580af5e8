//! A motion as a table, as an animation, and as a picture over place and time.

use std::io::{self, Write};
use std::path::Path;

use dynamics_view::file::{self, Content};
use dynamics_view::{Animation, Drawing, FileError, Film, HeatMap, OutputError, text};

use crate::failure::FamilyMotionError;
use crate::model::{FamilyModel, FamilyState, Places};
use crate::motion::FamilyMotion;
use crate::record::{RecordedFrame, ordinary};

/// Most points of a line that is drawn.
const MOST_POINTS: usize = 400;
/// Most lines of a grid that are drawn in either direction.
const MOST_GRID_LINES: usize = 13;
/// Most points of each of them.
const MOST_GRID_POINTS: usize = 25;
/// Up to so many points have dots.
const MOST_DOTS: usize = 24;
/// Most instants of an animation.
const MOST_FRAMES: usize = 300;

impl<M: FamilyModel> FamilyMotion<'_, M> {
    /// Writes the scalars of the recorded instants as comma-separated values: time, ordinary coordinates and
    /// their velocities, scalar outputs, kinetic, potential and total energy. Makes the folders that the path
    /// needs. An error where the path has an extension other than `.csv` or `.txt`.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let path = path.as_ref();
        let mut file = file::create(path, Content::Table)?;
        let names: Vec<String> = self.columns().into_iter().map(|(name, unit)| titled(name, &unit)).collect();
        let energies = ["kinetic", "potential", "energy"].map(String::from);
        let header: Vec<String> =
            core::iter::once(String::from("t")).chain(names).chain(energies).map(text::quoted).collect();
        let written = (|| {
            writeln!(file, "{}", header.join(","))?;
            for frame in &self.record.frames {
                let energies = [frame.energies.kinetic, frame.energies.potential, frame.energies.total()];
                let values = core::iter::once(frame.t).chain(scalars(frame)).chain(energies);
                writeln!(file, "{}", values.map(text::exact).collect::<Vec<_>>().join(","))?;
            }
            file.flush()
        })();
        written.map_err(|source| {
            OutputError::File(FileError { path: path.to_path_buf(), action: "write", source })
        })
    }

    /// Names and units of the scalars of a frame.
    fn columns(&self) -> Vec<(String, String)> {
        let own = || ordinary::<M>(self.record.start.ends());
        let coordinates = own().map(|(_, name, unit)| (name.to_string(), unit.to_string()));
        let rate = |unit: &str| if unit.is_empty() { String::new() } else { format!("{unit}/s") };
        let velocities = own().map(|(_, name, unit)| (format!("{name}_rate"), rate(unit)));
        let outputs = M::OUTPUTS.iter().filter(|output| !output.numbered);
        let outputs = outputs.map(|output| (output.name.to_string(), output.unit.to_string()));
        coordinates.chain(velocities).chain(outputs).collect()
    }

    /// Writes the motion as one page, `.html`, that plays in any browser, as [`FamilyMotion::animation`]
    /// makes it.
    ///
    /// # Errors
    /// Where the file cannot be written, and where the states went to a file.
    pub fn animate(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        if self.record.frames.iter().any(|frame| frame.state.is_none()) {
            let words = "the states of this motion went to a file; drop `.to_file(..)` to animate it";
            return Err(OutputError::Stream(io::Error::new(io::ErrorKind::InvalidInput, words)));
        }
        self.animation().write_html(path)
    }

    /// The motion as an animation that can still be changed: lines through the places of the nodes, at most
    /// 400 points each, 300 instants; of a grid 13 lines of 25 points in either direction. Between recorded instants it is drawn with coordinates in between.
    #[must_use]
    pub fn animation(&self) -> Animation<'_> {
        Animation::new().add(self, "").frames(MOST_FRAMES)
    }

    /// A field (`s`) or a numbered output over place and time: index across, time down, values as colours. The
    /// nodes of a grid stand one after the other, row by row.
    /// [`HeatMap::write_svg`] writes it.
    ///
    /// # Errors
    /// Where there is no such field or numbered output.
    pub fn space_time(&self, name: &str) -> Result<HeatMap, FamilyMotionError> {
        let ends = self.record.start.ends();
        let field = M::FIELDS.iter().position(|field| field.name == name);
        let output = M::OUTPUTS.iter().position(|output| output.name == name && output.numbered);
        let unit = match (field, output) {
            (Some(field), _) => M::FIELDS[field].unit,
            (None, Some(output)) => M::OUTPUTS[output].unit,
            (None, None) => return Err(FamilyMotionError::UnknownField { name: name.to_string() }),
        };
        let row = |state: &M::State| match (field, output) {
            (Some(field), _) => state.q()[ends.range(field)].to_vec(),
            (None, Some(output)) => self.values_of(output, state),
            (None, None) => Vec::new(),
        };
        let rows: Vec<Vec<f64>> = self.frames().filter_map(|frame| frame.state.map(row)).collect();
        let columns = rows.first().map_or(0, Vec::len);
        let title = format!("{}: {name} over place and time", M::NAME);
        Ok(HeatMap::new(title, rows)
            .across("index", [0.0, columns.saturating_sub(1) as f64])
            .down("time (s)", [self.start_time(), self.end_time()])
            .values(text::with_unit(name, unit)))
    }

    /// The recorded states around a time, and the part of the way from the first to the second.
    fn blend(&self, t: f64) -> (usize, usize, f64) {
        let frames = &self.record.frames;
        let direction = if self.end_time() < self.start_time() { -1.0 } else { 1.0 };
        let behind = frames.partition_point(|frame| (frame.t - t) * direction < 0.0).min(frames.len() - 1);
        let before = behind.saturating_sub(1);
        let length = frames[behind].t - frames[before].t;
        let part = if length == 0.0 { 1.0 } else { ((t - frames[before].t) / length).clamp(0.0, 1.0) };
        (before, behind, part)
    }

    /// The coordinates between two recorded states.
    fn drawn_state(&self, before: usize, behind: usize, part: f64) -> M::State {
        let state = |index: usize| {
            let frame = &self.record.frames[index];
            frame.state.as_ref().unwrap_or(if index == 0 { &self.record.start } else { &self.record.end })
        };
        let (first, second) = (state(before), state(behind));
        let mix = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + part * (b - a)).collect();
        M::State::new(
            first.t() + part * (second.t() - first.t()),
            mix(first.q(), second.q()),
            mix(first.u(), second.u()),
            mix(first.inputs(), second.inputs()),
            first.ends().clone(),
        )
    }

    /// Lines through the places of nodes at a state, thinned out, and whether they have dots.
    fn lines(&self, state: &M::State) -> Vec<(Vec<[f64; 3]>, bool)> {
        // Places are made of coordinates; what is made of accelerations is not a number.
        let unknown = vec![f64::NAN; state.q().len()];
        let places =
            self.model.places(&M::coordinates(state, &unknown, crate::model::Multipliers::default()));
        places.into_iter().flat_map(lines_of).collect()
    }
}

/// A line through all nodes, with dots where they are few, or lines along the rows and the columns of a grid.
fn lines_of(places: Places) -> Vec<(Vec<[f64; 3]>, bool)> {
    let points = places.points;
    let Some(columns) = places.columns else {
        let line: Vec<_> = thinned(points.len(), MOST_POINTS).map(|k| points[k]).collect();
        let dots = line.len() <= MOST_DOTS;
        return vec![(line, dots)];
    };
    let rows = points.len().checked_div(columns).unwrap_or(0);
    let line = |length: usize, node: &dyn Fn(usize) -> usize| {
        (thinned(length, MOST_GRID_POINTS).map(|k| points[node(k)]).collect::<Vec<_>>(), false)
    };
    let across = thinned(rows, MOST_GRID_LINES).map(|i| line(columns, &|j| i * columns + j));
    let down = thinned(columns, MOST_GRID_LINES).map(|j| line(rows, &|i| i * columns + j));
    across.chain(down).collect()
}

/// At most so many of the indices below a length, the first and the last among them.
fn thinned(length: usize, most: usize) -> impl Iterator<Item = usize> {
    let (kept, last) = (length.min(most), length.saturating_sub(1));
    (0..kept).map(move |k| k * last / kept.saturating_sub(1).max(1))
}

/// The scalars of a frame: ordinary coordinates, their velocities, outputs.
fn scalars<S>(frame: &RecordedFrame<S>) -> impl Iterator<Item = f64> + '_ {
    frame.ordinary.iter().chain(&frame.outputs).copied()
}

fn titled(name: String, unit: &str) -> String {
    if unit.is_empty() { name } else { format!("{name} [{unit}]") }
}

impl<M: FamilyModel> Film for FamilyMotion<'_, M> {
    fn title(&self) -> String {
        M::NAME.to_string()
    }

    fn method(&self) -> String {
        self.record.method.to_string()
    }

    fn summary(&self) -> String {
        FamilyMotion::summary(self).to_string()
    }

    fn span(&self) -> [f64; 2] {
        [self.start_time(), self.end_time()]
    }

    fn quantities(&self) -> Vec<(String, String)> {
        self.columns()
    }

    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        let is_spatial = [&self.record.start, &self.record.end].iter().any(|state| {
            self.lines(state).iter().any(|(points, _)| points.iter().any(|point| point[2] != 0.0))
        });
        let mut values = Vec::new();
        for &t in times {
            let (before, behind, part) = self.blend(t);
            let lines = self.lines(&self.drawn_state(before, behind, part));
            let mut drawing = Drawing::new();
            for (points, dots) in &lines {
                if is_spatial {
                    drawing = drawing.polyline(points.iter().copied());
                    drawing =
                        points.iter().filter(|_| *dots).fold(drawing, |drawing, &point| drawing.dot(point));
                } else {
                    let plane = || points.iter().map(|&[x, y, _]| [x, y]);
                    drawing = drawing.polyline(plane());
                    drawing = plane().filter(|_| *dots).fold(drawing, Drawing::dot);
                }
            }
            values.clear();
            let ends = [&self.record.frames[before], &self.record.frames[behind]].map(scalars);
            let [first, second] = ends;
            values.extend(first.zip(second).map(|(a, b)| a + part * (b - a)));
            show(&drawing, &values);
        }
    }
}
