//! The page: what was recorded, put into the template.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Write;

use super::clock::Clock;
use super::encode::{Bounds, Grid, differences};
use super::{Animation, Recording};
use crate::color::Color;
use crate::scripts::{self, joined};
use crate::text::{fill, json, json_number, typeset, with_unit, xml};

/// Azimuth and elevation of the eye in degrees: x comes toward the viewer and to the right, y goes away and
/// to the right, and no axis hides another.
const EYE: [f64; 2] = [-60.0, 25.0];

/// Whether anything of space is shown.
fn is_spatial(recordings: &[Recording]) -> bool {
    recordings.iter().any(|recording| recording.reel.spatial)
}

impl Animation<'_> {
    pub(super) fn page(&self, clock: &Clock, recordings: &[Recording]) -> String {
        let title = self.title.clone().unwrap_or_else(|| match self.films.first() {
            Some((film, _)) => film.title(),
            None => String::from("No motion"),
        });
        let mut methods: Vec<_> = self.films.iter().map(|(film, _)| film.method()).collect();
        methods.dedup();
        let known = methods.iter().chain(&clock.notes).filter(|part| !part.is_empty());
        let subtitle: Vec<_> = known.map(|part| xml(part)).collect();
        let sight = if is_spatial(recordings) { scripts::SPACE } else { scripts::PLANE };
        let own = [sight, include_str!("room.js"), include_str!("page.js")];
        fill(
            include_str!("page.html"),
            &[
                ("title", &xml(&title)),
                ("style", &joined(&[scripts::STYLE, include_str!("page.css")])),
                ("subtitle", &subtitle.join(" · ")),
                ("summary", &self.summaries()),
                ("data", &self.data(clock, recordings)),
                ("script", &joined(&[&scripts::SHARED[..], &own].concat())),
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
        let bounds =
            recordings.iter().fold(Bounds::EMPTY, |bounds, recording| bounds.union(recording.reel.bounds));
        let grid = bounds.grid(is_spatial(recordings));
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
            "{{\"start\":{},\"step\":{},\"frames\":{},\"speed\":{},\"time_unit\":{},\"length_unit\":{},{},\
             \"films\":[{}],\"strip\":{},\"events\":{}}}",
            json_number(clock.start),
            json_number(clock.step),
            clock.frames,
            json_number(clock.speed),
            json(&self.time_unit()),
            json(&typeset(&self.length_unit())),
            self.view_data(&grid),
            films.join(",\n"),
            self.strip_data(recordings),
            self.events_data(clock)
        )
    }

    /// What happened, as places among the instants.
    fn events_data(&self, clock: &Clock) -> String {
        let mut events = Vec::new();
        for (film, _) in &self.films {
            for (time, name) in film.events() {
                let place = if clock.step == 0.0 { 0.0 } else { (time - clock.start) / clock.step };
                events.push(format!("[{},{}]", json_number(libm::round(place * 100.0) / 100.0), json(&name)));
            }
        }
        format!("[{}]", events.join(","))
    }

    /// Where everything is, and the eye that sees it.
    fn view_data(&self, grid: &Grid) -> String {
        let origin: Vec<_> = grid.axes().map(|axis| json_number(grid.origin[axis])).collect();
        let half: Vec<_> = grid.axes().map(|axis| format!("{}", grid.half[axis])).collect();
        let [azimuth, elevation] = self.eye.unwrap_or(EYE).map(|degrees| json_number(degrees.to_radians()));
        format!(
            "\"origin\":[{}],\"quantum\":{},\"half\":[{}],\"spatial\":{},\"eye\":[{azimuth},{elevation}]",
            origin.join(","),
            json_number(grid.quantum),
            half.join(","),
            grid.spatial
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
                let name = if several && !label.is_empty() {
                    format!("{} ({label})", curve.name)
                } else {
                    curve.name.clone()
                };
                let color = Color::cycle(if several { film } else { k });
                let _ = write!(
                    out,
                    "{{\"name\":{},\"unit\":{},\"title\":{},\"color\":{},\"dash\":{},{}}}",
                    json(&name),
                    json(&typeset(&curve.unit)),
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

/// Values as integers of a hundred-thousandth of their range.
fn quantized(values: &[f64]) -> String {
    let finite = || values.iter().copied().filter(|value| value.abs() < 1e300);
    let (lo, hi) =
        finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
    let lo = if lo.is_finite() { lo } else { 0.0 };
    let unit = match (hi - lo) / 1e5 {
        unit if unit.is_normal() && unit > 0.0 => unit,
        _ => 1.0,
    };
    // What is far below the resolution is zero, not 1.2e-33.
    let lo = if hi > lo && lo.abs() < 1e-6 * unit { 0.0 } else { lo };
    let integers =
        values.iter().map(|value| (value.abs() < 1e300).then(|| libm::round((value - lo) / unit) as i64));
    format!(
        "\"lo\":{},\"unit_of_values\":{},\"values\":{}",
        json_number(lo),
        json_number(unit),
        differences(integers)
    )
}

#[cfg(test)]
mod tests {
    use super::quantized;

    /// Labels of the strip come from these: 0, not 1.2×10⁻³³; but what is small altogether keeps its digits.
    #[test]
    fn what_is_far_below_the_resolution_is_zero() {
        assert!(quantized(&[1.2e-33, 1.0]).starts_with("\"lo\":0,"));
        assert!(quantized(&[-1.2e-33, 1.0]).starts_with("\"lo\":0,"));
        for values in [&[1e-4, 1.0][..], &[2e-33, 3e-33], &[1.2e-33; 2]] {
            assert!(!quantized(values).starts_with("\"lo\":0,"), "{values:?}");
        }
    }
}
