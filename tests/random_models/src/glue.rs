//! What stands beside a model in its module, so that the judge can call its functions: read from the text of
//! the model.

/// The glue of a model: a module with `model()`, its parameters, and `own`, which calls every function with a
/// role.
///
/// `interpreted` is what the interpreter says of the model, empty where nothing.
/// The text says `// model: Name { parameter: value }`. Forces are given once more as what they go along and
/// their size where there are functions of the same name with `_place` and `_size`.
#[must_use]
pub fn glue(text: &str, interpreted: &str) -> String {
    let literal = text.lines().find_map(|line| line.strip_prefix("// model: ")).unwrap_or("Missing {}");
    let name = literal.split([' ', '{']).next().unwrap_or_default();
    let mut functions = roles(text);
    // Speeds are emitted in the order of their declaration.
    let speeds = text.lines().find(|line| line.starts_with("#[speeds(")).unwrap_or_default();
    functions.sort_by_key(|(role, name)| match *role {
        "kinematic" => speeds.find(&format!("{}:", plain(name))).or_else(|| speeds.find(plain(name))),
        _ => None,
    });
    let mut calls = String::new();
    for (role, function) in &functions {
        let call = format!("model.{function}(q)");
        calls += &match *role {
            "drawing" => continue,
            "force" => {
                let twin = |part: &str| text.contains(&format!("fn {}_{part}(", plain(function)));
                let along = if twin("place") && twin("size") {
                    format!(" own.along(model.{0}_place(q), model.{0}_size(q));", plain(function))
                } else {
                    String::new()
                };
                format!("        own.force({call});{along}\n")
            }
            role => format!("        own.{role}({call});\n"),
        };
    }
    // Nothing here may be called anything that the model's names could shadow.
    format!(
        "pub mod glue \
         {{\n\
         \x20   pub const REPORT: &::core::primitive::str = super::{name}::REPORT;\n\
         \x20   pub const INTERPRETED: &::core::primitive::str = {interpreted:?};\n\
         \x20   pub fn model() -> super::{name} {{ super::{literal} }}\n\
         \x20   pub fn own(model: &super::{name}, q: &::dynamics::model::Coordinates<super::{name}>, \
         own: &mut ::judge::Own) {{\n{calls}    }}\n}}\n"
    )
}

fn plain(name: &str) -> &str {
    name.strip_prefix("r#").unwrap_or(name)
}

/// Every function with a role, in order: role and name.
fn roles(text: &str) -> Vec<(&'static str, &str)> {
    const ROLES: [&str; 11] = [
        "kinetic",
        "potential",
        "lagrangian",
        "dissipation",
        "force",
        "holonomic",
        "nonholonomic",
        "kinematic",
        "output",
        "event",
        "drawing",
    ];
    let mut found = Vec::new();
    let mut role = None;
    for line in text.lines().map(str::trim) {
        if let Some(attribute) = line.strip_prefix("#[") {
            let word = attribute.split([']', '(']).next().unwrap_or_default();
            role = ROLES.iter().find(|r| **r == word).or(role.as_ref().map(|r: &&'static &'static str| *r));
        } else if let Some((_, rest)) = line.split_once("fn ")
            && let Some(role) = role.take()
        {
            found.push((*role, rest.split(['(', '<']).next().unwrap_or_default()));
        }
    }
    found
}
