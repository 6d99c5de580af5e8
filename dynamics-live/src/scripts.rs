//! The scripts of pages. They are sources to be read; pages get them without comments and indentation, and
//! packed.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use dynamics_view::scripts;
pub(crate) use dynamics_view::scripts::joined;
use miniz_oxide::deflate::compress_to_vec;

/// Which parts of the motion's scripts a model needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts {
    /// It has constraints.
    pub(crate) constraints: bool,
    /// Its accelerations are not smooth.
    pub(crate) kinks: bool,
    /// It has events, contacts, or sticking.
    pub(crate) events: bool,
    /// It has families of coordinates.
    pub(crate) families: bool,
}

/// A script, and whether a model with these parts needs it.
type Script = (&'static str, fn(Parts) -> bool);

/// What computes, in the order in which it has to be read. It knows nothing of pages.
const MOTION: [Script; 24] = [
    (include_str!("motion/numbers.js"), |_| true),
    (include_str!("motion/methods.js"), |_| true),
    (include_str!("motion/linear.js"), |_| true),
    (include_str!("motion/words.js"), |_| true),
    (include_str!("motion/system.js"), |_| true),
    (include_str!("motion/general_solver.js"), |parts| parts.constraints),
    (include_str!("motion/constraint_words.js"), |parts| parts.constraints),
    (include_str!("motion/rank.js"), |parts| parts.constraints),
    (include_str!("motion/friction.js"), |parts| parts.constraints),
    (include_str!("motion/impact.js"), |parts| parts.constraints && parts.events),
    (include_str!("motion/constraints.js"), |parts| parts.constraints),
    (include_str!("motion/slip.js"), |parts| parts.constraints),
    (include_str!("motion/crossing.js"), |parts| parts.constraints),
    (include_str!("motion/midpoint.js"), |_| true),
    (include_str!("motion/step_size.js"), |_| true),
    (include_str!("motion/roots.js"), |parts| parts.events || parts.kinks),
    (include_str!("motion/switching.js"), |parts| parts.kinks),
    (include_str!("motion/stepper.js"), |_| true),
    (include_str!("motion/unilateral.js"), |parts| parts.constraints && parts.events),
    (include_str!("motion/zeno.js"), |parts| parts.constraints && parts.events),
    (include_str!("motion/events.js"), |parts| parts.events),
    (include_str!("motion/motion.js"), |_| true),
    (include_str!("motion/drag.js"), |_| true),
    (include_str!("motion/families.js"), |parts| parts.families),
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

/// How much is tried to find repetitions: the most that has a name.
const COMPRESSION: u8 = 9;

/// The script of a page, packed by DEFLATE as Base64, which browsers unpack without a request. `model` in a
/// comment is the place of programs and data.
pub(crate) fn packed(parts: Parts, in_space: bool) -> String {
    let motion = motion_script_of(parts);
    let sight = if in_space { scripts::SPACE } else { scripts::PLANE };
    let page = joined(&[&scripts::SHARED[..], &[sight], &PAGE].concat());
    let script =
        format!("\"use strict\";\n(() => {{\n{motion}/* model */\n(() => {{\n{page}}})();\n}})();\n");
    BASE64_STANDARD.encode(compress_to_vec(script.as_bytes(), COMPRESSION))
}

/// The style without comments and indentation.
pub(crate) fn style() -> String {
    joined(&[scripts::STYLE, include_str!("page/page.css")])
}

/// What computes, as one script. Public for the tests of the library alone.
#[doc(hidden)]
#[must_use]
pub fn motion_script() -> String {
    motion_script_of(Parts { constraints: true, kinks: true, events: true, families: true })
}

/// The same with the parts that a model needs.
pub(crate) fn motion_script_of(parts: Parts) -> String {
    let needed = MOTION.iter().filter(|(_, is_needed)| is_needed(parts));
    joined(&needed.map(|(script, _)| *script).collect::<Vec<_>>())
}
