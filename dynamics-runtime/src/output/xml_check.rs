//! A small judge of XML for the tests: tags nest, attributes are quoted and single, text is escaped.

use alloc::vec::Vec;

/// Panics, naming the place, where `text` is not a well-formed element.
pub(super) fn assert_well_formed(text: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = text.trim_end();
    let mut roots = 0;
    while !rest.is_empty() {
        let Some(content) = rest.strip_prefix('<') else {
            let end = rest.find('<').unwrap_or(rest.len());
            assert!(!open.is_empty(), "text outside of the root: {:?}", &rest[..end]);
            assert_escaped(&rest[..end]);
            rest = &rest[end..];
            continue;
        };
        let end = content.find('>').expect("a tag is not closed");
        let tag = &content[..end];
        rest = &content[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "tags cross");
            continue;
        }
        let (tag, empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let name = tag.split_whitespace().next().expect("a tag has a name");
        assert_attributes(&tag[name.len()..]);
        roots += usize::from(open.is_empty());
        if !empty {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "not closed: {open:?}");
    assert_eq!(roots, 1, "one root");
}

fn assert_attributes(mut rest: &str) {
    let mut names = Vec::new();
    while !rest.trim_start().is_empty() {
        assert!(rest.starts_with(char::is_whitespace), "attributes are not parted: {rest}");
        let (name, after) = rest.trim_start().split_once("=\"").expect("an attribute has a quoted value");
        assert!(name.chars().all(|c| c.is_ascii_alphabetic() || "-:".contains(c)), "{name}");
        assert!(!names.contains(&name), "`{name}` twice");
        names.push(name);
        let (value, after) = after.split_once('"').expect("a value ends");
        assert_escaped(value);
        rest = after;
    }
}

fn assert_escaped(text: &str) {
    assert!(!text.contains('<'), "`<` in {text:?}");
    for part in text.split('&').skip(1) {
        let entity = part.split(';').next().unwrap_or("");
        assert!(
            part.contains(';') && ["amp", "lt", "gt", "quot", "#39"].contains(&entity),
            "`&` in {text:?}"
        );
    }
}

#[test]
fn the_judge_is_not_blind() {
    assert_well_formed("<a b=\"1\"><c/>x &amp; y</a>");
    for bad in [
        "<a>",
        "<a></b>",
        "<a b=1></a>",
        "<a b=\"1\" b=\"2\"/>",
        "<a>&</a>",
        "<a/><b/>",
        "x<a/>",
        "<a b=\"<\"/>",
    ] {
        assert!(std::panic::catch_unwind(|| assert_well_formed(bad)).is_err(), "{bad}");
    }
}
