//! The scripts of pages. They are sources to be read; pages get them without comments and indentation.

use dynamics_view::scripts;

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
    joined(&[&[scripts::PAINT, eye][..], &PAGE].concat())
}

/// The style without comments and indentation.
pub(crate) fn style() -> String {
    joined(&[include_str!("page/page.css")])
}

/// What computes, as one script. Public for the tests of the library alone.
#[doc(hidden)]
#[must_use]
pub fn motion_script() -> String {
    joined(&MOTION)
}

/// Scripts without comments and indentation.
///
/// Comments of these scripts stand on lines of their own, and no text of theirs contains such a line; the
/// tests of the pages would show it.
pub(crate) fn joined(scripts: &[&str]) -> String {
    let mut out = String::new();
    let comments = ["//", "/*", "* ", "*/"];
    for line in scripts.iter().flat_map(|script| script.lines()).map(str::trim) {
        let is_comment = line == "*" || comments.iter().any(|start| line.starts_with(start));
        if !(line.is_empty() || is_comment || line == "\"use strict\";") {
            out.push_str(line);
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::joined;

    #[test]
    fn comments_and_indentation_go() {
        let script = "// Head.\n/**\n * What.\n */\nfunction f() {\n  // Why.\n  return 1 / 2; // half\n}\n";
        assert_eq!(joined(&[script]), "function f() {\nreturn 1 / 2; // half\n}\n");
    }
}
