//! Colours that are readable on light and on dark backgrounds.

use alloc::format;
use alloc::string::{String, ToString};

/// A colour of a picture.
///
/// Named colours are roles: a page shows each in the shade that is readable on the viewer's light or dark
/// background. [`Color::Rgb`] is taken as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Color {
    /// The figure's own: ink for lines and springs, the accent for discs and traces, faint for ground and
    /// pivots.
    #[default]
    Auto,
    /// The colour of text.
    Ink,
    /// A quiet grey.
    Faint,
    /// The colour of the motion: a different one for every motion that is shown on the same page.
    Accent,
    /// Blue.
    Blue,
    /// Red.
    Red,
    /// Green.
    Green,
    /// Amber.
    Amber,
    /// Purple.
    Purple,
    /// Teal.
    Teal,
    /// Brown.
    Brown,
    /// Pink.
    Pink,
    /// Red, green and blue, 0 to 255 each.
    Rgb(u8, u8, u8),
}

/// The colours that series and motions take in turn.
pub(crate) const CYCLE: [Color; 8] = [
    Color::Blue,
    Color::Red,
    Color::Green,
    Color::Amber,
    Color::Purple,
    Color::Teal,
    Color::Brown,
    Color::Pink,
];

impl Color {
    /// The k-th colour of the cycle, which begins again after eight.
    #[must_use]
    pub fn cycle(k: usize) -> Self {
        CYCLE[k % CYCLE.len()]
    }

    /// As SVG writes it, on light ground.
    pub(crate) fn on_light(self) -> String {
        match self {
            Self::Auto | Self::Ink => "#1d2530",
            Self::Faint => "#8a94a0",
            Self::Accent | Self::Blue => "#1f6fb4",
            Self::Red => "#cf3f4f",
            Self::Green => "#23895e",
            Self::Amber => "#bd7e00",
            Self::Purple => "#7d4fb3",
            Self::Teal => "#128a99",
            Self::Brown => "#8a5738",
            Self::Pink => "#c24e98",
            Self::Rgb(r, g, b) => return format!("#{r:02x}{g:02x}{b:02x}"),
        }
        .to_string()
    }

    /// The page's name of it: a role that the page's style sheet resolves, or `#rrggbb`.
    pub(crate) fn role(self) -> String {
        match self {
            Self::Auto => "auto",
            Self::Ink => "ink",
            Self::Faint => "faint",
            Self::Accent => "accent",
            Self::Blue => "blue",
            Self::Red => "red",
            Self::Green => "green",
            Self::Amber => "amber",
            Self::Purple => "purple",
            Self::Teal => "teal",
            Self::Brown => "brown",
            Self::Pink => "pink",
            Self::Rgb(..) => return self.on_light(),
        }
        .to_string()
    }
}
