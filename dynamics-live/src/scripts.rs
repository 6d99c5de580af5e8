//! The scripts of pages. They are sources to be read; pages get them without comments and indentation.

use dynamics_view::scripts;
pub(crate) use dynamics_view::scripts::joined;

/// What computes, in the order in which it has to be read. It knows nothing of pages.
const MOTION: [&str; 17] = [
    include_str!("motion/numbers.js"),
    include_str!("motion/methods.js"),
    include_str!("motion/linear.js"),
    include_str!("motion/words.js"),
    include_str!("motion/system.js"),
    include_str!("motion/rank.js"),
    include_str!("motion/friction.js"),
    include_str!("motion/impact.js"),
    include_str!("motion/constraints.js"),
    include_str!("motion/crossing.js"),
    include_str!("motion/midpoint.js"),
    include_str!("motion/step_size.js"),
    include_str!("motion/switching.js"),
    include_str!("motion/stepper.js"),
    include_str!("motion/events.js"),
    include_str!("motion/motion.js"),
    include_str!("motion/drag.js"),
];

/// What is seen.
const PAGE: [&str; 8] = [
    include_str!("page/player.js"),
    include_str!("page/picture.js"),
    include_str!("page/plots.js"),
    include_str!("page/precision.js"),
    include_str!("page/controls.js"),
    include_str!("page/panel.js"),
    include_str!("page/address.js"),
    include_str!("page/page.js"),
];

/// What is seen, as one script.
pub(crate) fn page_script(in_space: bool) -> String {
    let eye = if in_space { scripts::SPACE } else { "" };
    joined(&[&scripts::SHARED[..], &[scripts::PLANE, eye], &PAGE].concat())
}

/// The style without comments and indentation.
pub(crate) fn style() -> String {
    joined(&[scripts::STYLE, include_str!("page/page.css")])
}

/// What computes, as one script. Public for the tests of the library alone.
#[doc(hidden)]
#[must_use]
pub fn motion_script() -> String {
    joined(&MOTION)
}
