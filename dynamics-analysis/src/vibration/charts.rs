//! Charts of responses, rotors and spectra.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use dynamics_view::text::typeset;
use dynamics_view::{Axis, Chart, Panel};

use super::FrequencyResponse;
use super::frequency_response::phases;

impl FrequencyResponse {
    /// Magnitude and phase over frequency: the Bode diagram. Peaks have their full height, even if they are
    /// narrower than the spacing of the frequencies ([`FrequencyResponse::peaks`]).
    #[must_use]
    pub fn bode(&self) -> Chart {
        let of = |unit: &str| if unit.contains(['/', '*', ' ']) { format!("({unit})") } else { unit.into() };
        let unit = match (self.output.unit.as_str(), self.input.unit.as_str()) {
            (out, cause) if out == cause => String::new(),
            (out, "") => format!(" in {out}"),
            ("", cause) => format!(" in 1/{}", of(cause)),
            (out, cause) => format!(" in {}/{}", of(out), of(cause)),
        };
        let (frequencies, values) = self.drawn();
        let with = |values: Vec<f64>| frequencies.iter().copied().zip(values).collect::<Vec<_>>();
        let magnitude = values.iter().map(|value| value.norm()).collect();
        let degrees = phases(&values).into_iter().map(f64::to_degrees).collect();
        let axis = || Axis::log("ω in rad/s");
        Chart::new(self.title())
            .panel(
                Panel::new(axis(), Axis::log(format!("magnitude{}", typeset(&unit))))
                    .line("", with(magnitude)),
            )
            .panel(Panel::new(axis(), Axis::new("phase in °")).line("", with(degrees)))
    }

    /// The imaginary part over the real part: the Nyquist diagram, in which each lightly damped mode is
    /// nearly a circle.
    #[must_use]
    pub fn nyquist(&self) -> Chart {
        let (_, values) = self.drawn();
        let points = values.iter().map(|value| (value.re, value.im));
        let panel =
            Panel::new(Axis::new("real part"), Axis::new("imaginary part")).line("", points).equal_axes();
        Chart::new(self.title()).panel(panel)
    }

    fn title(&self) -> String {
        format!("Response of {} to {}", self.output.name, self.input.name)
    }
}
