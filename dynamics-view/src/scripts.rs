//! What recorded and live pages share: scripts and the style of their look.
//!
//! They are sources to be read; pages get them without comments and indentation.

use alloc::string::String;

/// Colours, numbers and the painters of all figures; axes of plots; what the viewer does with picture and
/// bar.
pub const SHARED: [&str; 4] = [
    include_str!("animation/paint.js"),
    include_str!("animation/axes.js"),
    include_str!("animation/gestures.js"),
    include_str!("animation/transport.js"),
];
/// What is seen of the plane.
pub const PLANE: &str = include_str!("animation/plane.js");
/// What is seen of space: perspective, and turning by hand.
pub const SPACE: &str = include_str!("animation/space.js");
/// The look.
pub const STYLE: &str = include_str!("animation/base.css");

/// Scripts or styles as one text without comments and indentation.
///
/// Their comments stand on lines of their own, and no text of theirs contains such a line; the tests of the
/// pages would show it.
#[must_use]
pub fn joined(texts: &[&str]) -> String {
    let mut out = String::new();
    let comments = ["//", "/*", "* ", "*/"];
    for line in texts.iter().flat_map(|text| text.lines()).map(str::trim) {
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
