//! Charts of responses, rotors and spectra.

use alloc::format;
use alloc::string::String;

use super::FrequencyResponse;
use crate::output::{Axis, Chart, Panel};

impl FrequencyResponse {
    /// Magnitude and phase over frequency: the Bode diagram.
    #[must_use]
    pub fn bode(&self) -> Chart {
        let of = |unit: &str| if unit.contains(['/', '*', ' ']) { format!("({unit})") } else { unit.into() };
        let unit = match (self.output.unit.as_str(), self.input.unit.as_str()) {
            (out, cause) if out == cause => String::new(),
            (out, "") => format!(" in {out}"),
            ("", cause) => format!(" in 1/{}", of(cause)),
            (out, cause) => format!(" in {}/{}", of(out), of(cause)),
        };
        let with = |values: alloc::vec::Vec<f64>| self.frequencies.iter().copied().zip(values);
        let degrees = self.phase().into_iter().map(f64::to_degrees).collect();
        let axis = || Axis::log("ω in rad/s");
        Chart::new(self.title())
            .panel(Panel::new(axis(), Axis::log(format!("magnitude{unit}"))).line("", with(self.magnitude())))
            .panel(Panel::new(axis(), Axis::new("phase in °")).line("", with(degrees)))
    }

    /// The imaginary part over the real part: the Nyquist diagram, in which each lightly damped mode is nearly a circle.
    #[must_use]
    pub fn nyquist(&self) -> Chart {
        let points = self.values.iter().map(|value| (value.re, value.im));
        let panel = Panel::new(Axis::new("real part"), Axis::new("imaginary part")).line("", points).equal_axes();
        Chart::new(self.title()).panel(panel)
    }

    fn title(&self) -> String {
        format!("Response of {} to {}", self.output.name, self.input.name)
    }
}
