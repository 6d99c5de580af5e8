//! A motion as one HTML page that plays in any browser, without network access.

mod encode;

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

use super::color::Color;
use super::drawing::Drawing;
use super::error::OutputError;
use super::text::{self, json, json_number, readable, with_unit, xml};
use encode::{Bounds, Grid, Reel, differences};

/// Instants per second of playing.
const FRAMES_PER_SECOND: f64 = 60.0;

/// The most instants that a page holds unless it is set: one minute, some 100 kB for a mechanism of a few links.
const MOST_FRAMES: usize = 3600;

/// Motions shorter than this, in their own time, are slowed down unless the speed is set.
const SHORT: f64 = 2.0;

/// Motions longer than this are sped up.
const LONG: f64 = 60.0;

/// What can be shown moving. A [`Motion`](crate::motion::Motion) whose model can be drawn is one.
pub trait Film {
    /// What is moving.
    fn title(&self) -> String;
    /// How its motion was found, in a few words.
    fn method(&self) -> String;
    /// The whole account, in lines.
    fn summary(&self) -> String;
    /// First and last instant; the last may be the smaller.
    fn span(&self) -> [f64; 2];
    /// The unit of time, empty where it is not known.
    fn time_unit(&self) -> String {
        String::from("s")
    }
    /// Name and unit of the quantities that can be plotted along with the picture, those first that are plotted unless others
    /// are chosen.
    fn quantities(&self) -> Vec<(String, String)>;
    /// Calls `show` with the picture and the values of all quantities at each of `times`, which run from first to last instant.
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
    fn quantities(&self) -> Vec<(String, String)> {
        (**self).quantities()
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
/// ```ignore
/// Animation::new()
///     .add(&a, "start A")
///     .add(&b, "start B")
///     .plot(["theta1"])
///     .write_html("compare.html")?;
/// ```
///
/// The picture is scaled to hold the whole motion, one unit of x as long as one of y. Motions of 2 to 60 seconds are played in
/// real time, shorter ones slower and longer ones faster unless [`speed`](Animation::speed) is called; the page says so. It
/// holds 60 instants per second of playing, up to a number that [`frames`](Animation::frames) changes; between them it
/// interpolates.
#[derive(Default)]
pub struct Animation<'a> {
    films: Vec<(Box<dyn Film + 'a>, String)>,
    title: Option<String>,
    strip: Strip,
    speed: Option<f64>,
    most_frames: Option<usize>,
}

impl<'a> Animation<'a> {
    /// A page without motions.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a motion; the label tells it from others on the page and may be empty.
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

    /// Plots these quantities under the picture, by their names: coordinates, velocities as `theta1_rate`, outputs.
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

    /// Seconds of the motion per second of playing, greater than 0; the viewer can change it. A value that is not a positive
    /// number counts as not set.
    #[must_use]
    pub fn speed(mut self, speed: f64) -> Self {
        self.speed = (speed > 0.0 && speed.is_finite()).then_some(speed);
        self
    }

    /// The most instants that the page holds, at least 2; 3,600 unless set.
    #[must_use]
    pub fn frames(mut self, most: usize) -> Self {
        self.most_frames = Some(most.max(2));
        self
    }

    /// The page as text. An error where a name that is to be plotted is not known.
    pub fn to_html(&self) -> Result<String, OutputError> {
        let clock = Clock::of(self);
        let curves = self.chosen_curves()?;
        let recordings: Vec<_> = (0..self.films.len()).map(|k| self.record(k, &clock, &curves[k])).collect();
        Ok(self.page(&clock, &recordings))
    }

    /// Writes the page, making the folders that the path needs.
    #[cfg(feature = "std")]
    pub fn write_html(&self, path: impl AsRef<std::path::Path>) -> Result<(), OutputError> {
        let page = self.to_html()?;
        Ok(super::file::write(path.as_ref(), page.as_bytes())?)
    }
}

/// The instants that a page holds.
#[derive(Clone, Debug, PartialEq)]
struct Clock {
    start: f64,
    step: f64,
    frames: usize,
    /// Seconds of the motion per second of playing.
    speed: f64,
    notes: Vec<String>,
}

impl Clock {
    fn of(animation: &Animation<'_>) -> Self {
        let unit = animation.time_unit();
        let spans: Vec<_> = animation.films.iter().map(|(film, _)| film.span()).collect();
        let [start, end] = union(&spans);
        let duration = (end - start).abs();
        let speed = animation.speed.unwrap_or_else(|| usual_speed(duration));
        let most = animation.most_frames.unwrap_or(MOST_FRAMES);
        // Long motions get all the instants there may be: the viewer will want to slow them down.
        let wanted = if duration > LONG { most as f64 } else { libm::ceil(duration / speed * FRAMES_PER_SECOND) + 1.0 };
        let frames = if duration > 0.0 { (wanted.min(most as f64) as usize).max(2) } else { 1 };
        let step = if frames > 1 { (end - start) / (frames - 1) as f64 } else { 0.0 };
        let mut notes = Vec::new();
        if speed != 1.0 && duration > 0.0 {
            notes.push(format!("played {} × as fast as real time", readable(speed, 3)));
        }
        // Slowed down to real time, the page would show less than it could.
        if step.abs() > 1.01 / FRAMES_PER_SECOND {
            notes.push(format!("one instant every {}", text::value_with_unit(step.abs(), &unit)));
        }
        Self { start, step, frames, speed, notes }
    }

    /// The instants, none outside of `span`: a motion that is over stays where it ended.
    fn times(&self, [start, end]: [f64; 2]) -> Vec<f64> {
        let (lo, hi) = (start.min(end), start.max(end));
        (0..self.frames).map(|k| (self.start + k as f64 * self.step).clamp(lo, hi)).collect()
    }
}

/// From the first beginning to the last end, in the direction of the first motion.
fn union(spans: &[[f64; 2]]) -> [f64; 2] {
    let all = || spans.iter().flatten().copied().filter(|t| t.is_finite());
    let (lo, hi) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), t| (lo.min(t), hi.max(t)));
    match spans.first() {
        _ if lo > hi => [0.0, 0.0],
        Some([start, end]) if end < start => [hi, lo],
        _ => [lo, hi],
    }
}

/// Real time where that can be watched; else the round speed with which playing takes 5 to 12 or 24 to 60 seconds.
fn usual_speed(duration: f64) -> f64 {
    let round = |least: f64| {
        let power = libm::pow(10.0, libm::floor(libm::log10(least)));
        [1.0, 2.0, 5.0, 10.0]
            .map(|digit| digit * power)
            .into_iter()
            .find(|speed| *speed >= least * (1.0 - 1e-9))
            .unwrap_or(least)
    };
    if duration > LONG {
        round(duration / LONG)
    } else if duration > 0.0 && duration < SHORT {
        round(duration / 12.0)
    } else {
        1.0
    }
}

/// A quantity that is plotted: its index among the film's quantities, its name and unit.
struct Chosen {
    index: usize,
    name: String,
    unit: String,
}

/// What one film gives to the page.
struct Recording {
    reel: Reel,
    curves: Vec<Curve>,
}

struct Curve {
    name: String,
    unit: String,
    values: Vec<f64>,
}

impl Animation<'_> {
    fn chosen_curves(&self) -> Result<Vec<Vec<Chosen>>, OutputError> {
        let most = if self.films.len() > 1 { 1 } else { 4 };
        self.films
            .iter()
            .map(|(film, _)| {
                let quantities = film.quantities();
                let choose = |index: usize| Chosen {
                    index,
                    name: quantities[index].0.clone(),
                    unit: quantities[index].1.clone(),
                };
                match &self.strip {
                    Strip::Nothing => Ok(Vec::new()),
                    Strip::Automatic => Ok((0..quantities.len())
                        .take_while(|&k| quantities[k].1 == quantities[0].1)
                        .take(most)
                        .map(choose)
                        .collect()),
                    Strip::Names(names) => names
                        .iter()
                        .map(|name| {
                            quantities.iter().position(|(known, _)| known == name).map(choose).ok_or_else(|| {
                                OutputError::UnknownName {
                                    name: name.clone(),
                                    known: quantities.iter().map(|(known, _)| known.clone()).collect(),
                                }
                            })
                        })
                        .collect(),
                }
            })
            .collect()
    }

    fn time_unit(&self) -> String {
        self.films.first().map_or_else(String::new, |(film, _)| film.time_unit())
    }

    fn record(&self, k: usize, clock: &Clock, chosen: &[Chosen]) -> Recording {
        let film = &self.films[k].0;
        let ink = if self.films.len() > 1 { Color::Accent } else { Color::Ink };
        let mut reel = Reel::new(ink);
        let mut curves: Vec<_> = chosen
            .iter()
            .map(|chosen| Curve { name: chosen.name.clone(), unit: chosen.unit.clone(), values: Vec::new() })
            .collect();
        film.play(&clock.times(film.span()), &mut |drawing, values| {
            reel.push(drawing);
            for (curve, chosen) in curves.iter_mut().zip(chosen) {
                curve.values.push(values.get(chosen.index).copied().unwrap_or(f64::NAN));
            }
        });
        Recording { reel, curves }
    }

    fn page(&self, clock: &Clock, recordings: &[Recording]) -> String {
        let title = self.title.clone().unwrap_or_else(|| match self.films.first() {
            Some((film, _)) => film.title(),
            None => String::from("No motion"),
        });
        let mut methods: Vec<_> = self.films.iter().map(|(film, _)| film.method()).collect();
        methods.dedup();
        let subtitle: Vec<_> = methods.iter().chain(&clock.notes).map(|part| xml(part)).collect();
        fill(
            include_str!("animation/page.html"),
            &[
                ("title", &xml(&title)),
                ("style", include_str!("animation/page.css")),
                ("subtitle", &subtitle.join(" · ")),
                ("summary", &self.summaries()),
                ("data", &self.data(clock, recordings)),
                ("script", include_str!("animation/page.js")),
            ],
        )
    }

    fn summaries(&self) -> String {
        let mut out = String::new();
        for (film, label) in &self.films {
            if !label.is_empty() {
                let _ = write!(out, "<h2>{}</h2>", xml(label));
            }
            let _ = write!(out, "<pre>{}</pre>", xml(film.summary().trim_end()));
        }
        out
    }

    fn data(&self, clock: &Clock, recordings: &[Recording]) -> String {
        let bounds = recordings.iter().fold(Bounds::EMPTY, |bounds, recording| bounds.union(recording.reel.bounds));
        let grid = bounds.grid();
        let mut films = Vec::new();
        for (k, (recording, (_, label))) in recordings.iter().zip(&self.films).enumerate() {
            films.push(format!(
                "{{\"label\":{},\"color\":{},\"reel\":{}}}",
                json(label),
                json(&Color::cycle(k).role()),
                recording.reel.to_json(&grid)
            ));
        }
        format!(
            "{{\"start\":{},\"step\":{},\"frames\":{},\"speed\":{},\"time_unit\":{},{},\"films\":[{}],\"strip\":{}}}",
            json_number(clock.start),
            json_number(clock.step),
            clock.frames,
            json_number(clock.speed),
            json(&self.time_unit()),
            view(&grid, recordings.iter().any(|recording| recording.reel.spatial)),
            films.join(",\n"),
            self.strip_data(recordings)
        )
    }

    fn strip_data(&self, recordings: &[Recording]) -> String {
        let several = recordings.len() > 1;
        let mut out = String::from("[");
        for (film, recording) in recordings.iter().enumerate() {
            for (k, curve) in recording.curves.iter().enumerate() {
                if out.len() > 1 {
                    out.push_str(",\n");
                }
                let label = &self.films[film].1;
                let name =
                    if several && !label.is_empty() { format!("{} ({label})", curve.name) } else { curve.name.clone() };
                let color = Color::cycle(if several { film } else { k });
                let _ = write!(
                    out,
                    "{{\"name\":{},\"unit\":{},\"title\":{},\"color\":{},\"dash\":{},{}}}",
                    json(&name),
                    json(&curve.unit),
                    json(&with_unit(&name, &curve.unit)),
                    json(&color.role()),
                    if several { k } else { 0 },
                    quantized(&curve.values)
                );
            }
        }
        out.push(']');
        out
    }
}

/// `template` with every `{{name}}` replaced; what is put in is not looked at again, whatever it holds.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let value = values.iter().find(|(known, _)| *known == name);
        out.push_str(value.map_or("", |(_, value)| value));
        rest = after;
    }
    out.push_str(rest);
    out
}

fn view(grid: &Grid, spatial: bool) -> String {
    format!(
        "\"origin\":[{},{}],\"quantum\":{},\"half\":[{},{}],\"spatial\":{spatial}",
        json_number(grid.origin[0]),
        json_number(grid.origin[1]),
        json_number(grid.quantum),
        grid.half[0],
        grid.half[1]
    )
}

/// Values as integers of a hundred-thousandth of their range.
fn quantized(values: &[f64]) -> String {
    let finite = || values.iter().copied().filter(|value| value.abs() < 1e300);
    let (lo, hi) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
    let lo = if lo.is_finite() { lo } else { 0.0 };
    let unit = match (hi - lo) / 1e5 {
        unit if unit.is_normal() && unit > 0.0 => unit,
        _ => 1.0,
    };
    let integers = values.iter().map(|value| (value.abs() < 1e300).then(|| libm::round((value - lo) / unit) as i64));
    format!("\"lo\":{},\"unit_of_values\":{},\"values\":{}", json_number(lo), json_number(unit), differences(integers))
}

#[cfg(test)]
mod tests;
