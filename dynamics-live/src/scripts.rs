//! The scripts of pages. They are sources to be read; pages get them without comments and indentation.

use dynamics_view::scripts;
pub(crate) use dynamics_view::scripts::joined;

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

/// What is seen, as one script.
pub(crate) fn page_script(in_space: bool) -> String {
    let sight = if in_space { scripts::SPACE } else { scripts::PLANE };
    joined(&[&scripts::SHARED[..], &[sight], &PAGE].concat())
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
