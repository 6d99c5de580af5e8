//! A motion as one HTML page that plays in any browser, without network access.

mod clock;
mod encode;
mod page;

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use crate::color::Color;
use crate::drawing::Drawing;
use crate::error::OutputError;
#[cfg(feature = "std")]
use crate::file::Content;
use clock::Clock;
use encode::Reel;

/// What an [`Animation`] can show, such as the motion of a model with a drawing.
pub trait Film {
    /// What is moving.
    fn title(&self) -> String;
    /// How the motion was computed, in a few words.
    fn method(&self) -> String;
    /// The full report, in lines.
    fn summary(&self) -> String;
    /// First and last instant; the last may be the smaller.
    fn span(&self) -> [f64; 2];
    /// The unit of time, empty where it is not known.
    fn time_unit(&self) -> String {
        String::from("s")
    }
    /// The unit of lengths in the picture, empty where it is not known.
    fn length_unit(&self) -> String {
        String::new()
    }
    /// Name and unit of the quantities that can be plotted along with the picture, those first that are
    /// plotted unless others are chosen.
    fn quantities(&self) -> Vec<(String, String)>;
    /// Time and name of what happened on the way.
    fn events(&self) -> Vec<(f64, String)> {
        Vec::new()
    }
    /// Calls `show` with the picture and the values of all quantities at each of `times`, which run from
    /// first to last instant.
    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64]));
}

impl<F: Film + ?Sized> Film for &F {
    fn title(&self) -> String {
        (**self).title()
    }
    fn method(&self) -> String {
        (**self).method()
    }
    fn summary(&self) -> String {
        (**self).summary()
    }
    fn span(&self) -> [f64; 2] {
        (**self).span()
    }
    fn time_unit(&self) -> String {
        (**self).time_unit()
    }
    fn length_unit(&self) -> String {
        (**self).length_unit()
    }
    fn quantities(&self) -> Vec<(String, String)> {
        (**self).quantities()
    }
    fn events(&self) -> Vec<(f64, String)> {
        (**self).events()
    }
    fn play(&self, times: &[f64], show: &mut dyn FnMut(&Drawing, &[f64])) {
        (**self).play(times, show);
    }
}

/// Which quantities are plotted under the picture.
#[derive(Clone, Debug, Default, PartialEq)]
enum Strip {
    /// The first of the film that have the same unit, four curves at most.
    #[default]
    Automatic,
    /// These.
    Names(Vec<String>),
    /// None.
    Nothing,
}

/// One or several motions on one page, in the same view and at the same time.
///
/// ```
/// # mod dynamics {
/// #     pub use dynamics_view as output;
/// # }
/// use dynamics::output::{Animation, Film, OutputError};
/// # fn compare(a: impl Film, b: impl Film) -> Result<String, OutputError> {
/// Animation::new()
///     .add(&a, "start A")
///     .add(&b, "start B, 10⁻⁹ rad beside it")
///     .plot(["theta1"])
///     .to_html()
/// # }
/// ```
///
/// The picture is scaled to hold the whole motion, one unit of x as long as one of y. Motions of 2 to 60
/// seconds are played in real time, shorter ones slower and longer ones faster unless
/// [`speed`](Animation::speed) is called; the page says so. It holds 60 instants per second of playing, up to
/// a number that [`frames`](Animation::frames) changes; between them it interpolates.
#[derive(Default)]
pub struct Animation<'a> {
    films: Vec<(Box<dyn Film + 'a>, String)>,
    title: Option<String>,
    strip: Strip,
    speed: Option<f64>,
    most_frames: Option<usize>,
    eye: Option<[f64; 2]>,
}

impl<'a> Animation<'a> {
    /// A page without motions.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a motion. The label distinguishes it from others on the page and may be empty.
    #[must_use]
    pub fn add(mut self, film: impl Film + 'a, label: impl Into<String>) -> Self {
        self.films.push((Box::new(film), label.into()));
        self
    }

    /// The page's title instead of the model's name.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// Plots these quantities under the picture, by their names: coordinates, velocities as `theta1_rate`,
    /// outputs.
    #[must_use]
    pub fn plot<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.strip = Strip::Names(names.into_iter().map(Into::into).collect());
        self
    }

    /// Plots nothing under the picture.
    #[must_use]
    pub fn without_plot(mut self) -> Self {
        self.strip = Strip::Nothing;
        self
    }

    /// Seconds of the motion per second of playing, greater than 0; the viewer can change it.
    #[must_use]
    pub fn speed(mut self, speed: f64) -> Self {
        self.speed = Some(speed);
        self
    }

    /// The most instants that the page holds, at least 2; 3,600 unless set.
    #[must_use]
    pub fn frames(mut self, most: usize) -> Self {
        self.most_frames = Some(most);
        self
    }

    /// Where motions in space are seen from at first, in degrees: the azimuth of the eye, counted from the
    /// x-axis about z, and its elevation above the horizontal, from −90 to 90. Defaults: −60 and 25. The
    /// viewer can turn the picture with mouse or finger. No effect on pages without points in space.
    #[must_use]
    pub fn seen_from(mut self, azimuth: f64, elevation: f64) -> Self {
        self.eye = Some([azimuth, elevation]);
        self
    }

    /// The page as text. It is an error if a name to be plotted is unknown, if the speed is not positive, or
    /// if fewer than two instants are allowed.
    pub fn to_html(&self) -> Result<String, OutputError> {
        if let Some(speed) = self.speed.filter(|speed| !(speed.is_normal() && *speed > 0.0)) {
            return Err(OutputError::Speed { speed });
        }
        if let Some(most) = self.most_frames.filter(|most| *most < 2) {
            return Err(OutputError::Frames { most });
        }
        if let Some([azimuth, elevation]) = self.eye
            && !(azimuth.is_finite() && elevation.abs() <= 90.0)
        {
            return Err(OutputError::Eye { azimuth, elevation });
        }
        let clock = Clock::of(self);
        let curves = self.chosen_curves()?;
        let recordings: Vec<_> = (0..self.films.len()).map(|k| self.record(k, &clock, &curves[k])).collect();
        Ok(self.page(&clock, &recordings))
    }

    /// Writes the page and creates the folders of its path. It is an error if the path has an extension other
    /// than `.html` or `.htm`.
    #[cfg(feature = "std")]
    pub fn write_html(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        let path = path.as_ref();
        // Before minutes are spent on it.
        crate::file::check(path, Content::Page)?;
        let page = self.to_html()?;
        Ok(crate::file::write(path, Content::Page, page.as_bytes())?)
    }
}

/// A quantity that is plotted: its index among the film's quantities, its name and unit.
struct Chosen {
    index: usize,
    name: String,
    unit: String,
}

impl Strip {
    /// The quantities of a film that are plotted: the chosen ones, or at most the first `most` that share a
    /// unit.
    fn choose(&self, quantities: &[(String, String)], most: usize) -> Result<Vec<Chosen>, OutputError> {
        let chosen = |index: usize| {
            let (name, unit) = quantities[index].clone();
            Chosen { index, name, unit }
        };
        let find = |name: &String| {
            let index = quantities.iter().position(|(known, _)| known == name);
            index.map(chosen).ok_or_else(|| OutputError::UnknownName {
                name: name.clone(),
                known: quantities.iter().map(|(known, _)| known.clone()).collect(),
            })
        };
        match self {
            Self::Nothing => Ok(Vec::new()),
            Self::Automatic => {
                let together = (0..quantities.len()).take_while(|&k| quantities[k].1 == quantities[0].1);
                Ok(together.take(most).map(chosen).collect())
            }
            Self::Names(names) => names.iter().map(find).collect(),
        }
    }
}

/// What one film gives to the page.
struct Recording {
    reel: Reel,
    curves: Vec<SampledCurve>,
}

struct SampledCurve {
    name: String,
    unit: String,
    values: Vec<f64>,
}

impl Animation<'_> {
    /// The quantities of every film that are to be plotted.
    fn chosen_curves(&self) -> Result<Vec<Vec<Chosen>>, OutputError> {
        let most = if self.films.len() > 1 { 1 } else { 4 };
        self.films.iter().map(|(film, _)| self.strip.choose(&film.quantities(), most)).collect()
    }

    fn time_unit(&self) -> String {
        self.films.first().map_or_else(String::new, |(film, _)| film.time_unit())
    }

    /// The unit that the lengths of all films have in common.
    fn length_unit(&self) -> String {
        let mut units = self.films.iter().map(|(film, _)| film.length_unit());
        let first = units.next().unwrap_or_default();
        if units.all(|unit| unit == first) { first } else { String::new() }
    }

    fn record(&self, k: usize, clock: &Clock, chosen: &[Chosen]) -> Recording {
        let film = &self.films[k].0;
        let ink = if self.films.len() > 1 { Color::Accent } else { Color::Ink };
        let mut reel = Reel::new(ink);
        let mut curves: Vec<_> = chosen
            .iter()
            .map(|chosen| SampledCurve {
                name: chosen.name.clone(),
                unit: chosen.unit.clone(),
                values: Vec::new(),
            })
            .collect();
        film.play(&clock.times(film.span()), &mut |drawing, values| {
            reel.push(drawing);
            for (curve, chosen) in curves.iter_mut().zip(chosen) {
                curve.values.push(values.get(chosen.index).copied().unwrap_or(f64::NAN));
            }
        });
        Recording { reel, curves }
    }
}

#[cfg(test)]
mod tests;
