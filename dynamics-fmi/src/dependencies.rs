//! What results depend on. Importers find algebraic loops by it: a result that does not reach an input closes
//! none.
//!
//! The programs in C are lists of assignments. What a result depends on is read from them, so that it is true
//! of what is computed. Where a program is anything else, its results depend on everything.

use std::collections::{BTreeMap, BTreeSet};

use dynamics_runtime::model::{PrintedInC, SimulationModel};

/// Value references that a result depends on.
pub(crate) type Known = BTreeSet<usize>;

/// For each variable what it depends on; `None`: on everything.
#[derive(Clone, Debug)]
pub(crate) struct Dependencies(Vec<Option<Known>>);

impl Dependencies {
    /// Of the variables of a model, whose programs these are.
    pub(crate) fn of<M: SimulationModel + PrintedInC>(programs: &[(String, String)], count: usize) -> Self {
        let n = M::COORDINATES.len();
        let parameters = 1 + 4 * n;
        let inputs = parameters + M::PARAMETERS.len();
        let firsts = BTreeMap::from([("q", 1), ("u", 1 + n), ("p", parameters), ("w", inputs)]);
        let mut first = inputs + M::INPUTS.len() + M::ROWS.len();
        let mut all = vec![None; count];
        let text = programs.iter().find(|(name, _)| name.ends_with(".c")).map_or("", |(_, text)| text);
        for (program, results) in [
            ("energies", if M::HAS_ENERGIES { 3 } else { 1 }),
            ("outputs", M::OUTPUTS.len()),
            ("events", M::EVENTS.len()),
            ("kinks", M::C.kink_functions.len()),
        ] {
            let found = body(text, &format!("{}_{program}", M::C.name)).and_then(|body| read(body, &firsts));
            for (result, known) in found.unwrap_or_default() {
                if result < results {
                    all[first + result] = known;
                }
            }
            first += results;
        }
        Self(all)
    }

    /// What a variable depends on; `None`: on everything.
    pub(crate) fn on(&self, reference: usize) -> Option<&Known> {
        self.0.get(reference)?.as_ref()
    }
}

/// The statements of a function.
fn body<'a>(text: &'a str, function: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(&format!(" {function}("))?;
    let (_, rest) = rest.split_once("{\n")?;
    Some(rest.split_once("\n}")?.0)
}

/// What the results of a program depend on; `None` where it is more than a list of assignments.
fn read(body: &str, firsts: &BTreeMap<&str, usize>) -> Option<BTreeMap<usize, Option<Known>>> {
    let mut locals: BTreeMap<&str, Option<Known>> = BTreeMap::new();
    let mut results = BTreeMap::new();
    for statement in body.split(';').map(str::trim).filter(|statement| !statement.is_empty()) {
        if statement.starts_with("return") {
            break;
        }
        if statement.starts_with("(void)") {
            continue;
        }
        let (mut targets, mut known, mut result) = (Vec::new(), Some(Known::new()), None);
        let mut before = "";
        for (i, name) in names(statement)?.into_iter().enumerate() {
            match name {
                Name { text: "const", .. } | Name { is_called: true, .. } => {}
                Name { text: "real", .. } if i < 2 => {}
                Name { text: "out", index: Some(index), .. } if i == 0 => result = Some(index),
                Name { text, is_address: true, .. } => targets.push(text),
                Name { text, .. } if before == "real" => targets.push(text),
                Name { text: "t", .. } => add(&mut known, &Some(Known::from([0]))),
                Name { text: "a" | "l", .. } => known = None,
                Name { text, index: Some(index), .. } => {
                    add(&mut known, &Some(Known::from([firsts.get(text)? + index])));
                }
                Name { text, .. } => add(&mut known, locals.get(text)?),
            }
            before = name.text;
        }
        match result {
            Some(result) => _ = results.insert(result, known),
            None if targets.is_empty() => return None,
            None => targets.into_iter().for_each(|target| _ = locals.insert(target, known.clone())),
        }
    }
    Some(results)
}

/// Adds what something depends on.
fn add(known: &mut Option<Known>, more: &Option<Known>) {
    match (known.as_mut(), more) {
        (Some(known), Some(more)) => known.extend(more),
        _ => *known = None,
    }
}

/// A name in a statement: `v1`, `q[2]`, `&v2`, `sin(`.
#[derive(Clone, Copy)]
struct Name<'a> {
    text: &'a str,
    index: Option<usize>,
    is_address: bool,
    is_called: bool,
}

/// The names of a statement, in order; `None` for an index that is no number.
fn names(statement: &str) -> Option<Vec<Name<'_>>> {
    let is_part = |c: char| c == '_' || c.is_ascii_alphanumeric();
    let (mut found, mut rest, mut before) = (Vec::new(), statement, "");
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        if first.is_ascii_digit() {
            // A number, with the sign of its exponent.
            let number = rest.find(|c: char| !is_part(c) && c != '.').unwrap_or(rest.len());
            let has_sign = rest[..number].ends_with(['e', 'E']) && rest[number..].starts_with(['-', '+']);
            rest = &rest[number + usize::from(has_sign)..];
            before = "";
        } else if end == 0 {
            let (sign, behind) = rest.split_at(first.len_utf8());
            before = if before == "&" && sign == "&" { "&&" } else { sign };
            rest = behind;
        } else {
            let (text, behind) = rest.split_at(end);
            let (index, behind) = match behind.strip_prefix('[') {
                Some(inside) => {
                    let (index, behind) = inside.split_once(']')?;
                    (Some(index.parse().ok()?), behind)
                }
                None => (None, behind),
            };
            let is_called = behind.starts_with('(');
            found.push(Name { text, index, is_address: before == "&", is_called });
            (before, rest) = ("", behind);
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Known, body, read};

    fn of(text: &str) -> Option<BTreeMap<usize, Option<Known>>> {
        read(text, &BTreeMap::from([("q", 1), ("u", 3), ("p", 9), ("w", 11)]))
    }

    #[test]
    fn assignments_are_followed() {
        let found = of("  (void)(t);\n  real v2; const real v1 = x_sin_cos(q[1], &v2);\n  \
                        const real v3 = (v1 <= 1e-13 && v2 > 0.5) ? w[0] : t;\n  out[0] = p[0]*v2;\n  \
                        out[1] = v3 +\n    u[0];\n  out[2] = 1.5e3 - l[1];\n  out[3] = 2.0;\n  \
                        const real d0 = v2;\n  return (d0 > 0.0) ? X_OK : X_SINGULAR");
        let known = |all: &[usize]| Some(all.iter().copied().collect::<Known>());
        let expected = [known(&[2, 9]), known(&[0, 2, 3, 11]), None, known(&[])];
        assert_eq!(found, Some(expected.into_iter().enumerate().collect()));
    }

    #[test]
    fn what_is_no_list_of_assignments_depends_on_all() {
        for text in
            ["if (q[0] > 0.0) { out[0] = 1.0; }", "out[0] = v1;", "out[0] = q[i];", "x_part(p, q, out);"]
        {
            assert_eq!(of(text), None, "{text}");
        }
    }

    #[test]
    fn functions_are_found_by_their_names() {
        let other = "void x_outputs_2(int a)\n{\n  b;\n}\n\n";
        let text = format!("{other}int x_outputs(const real *p,\n  real t)\n{{\n  c;\n  d;\n}}\n");
        assert_eq!(body(&text, "x_outputs"), Some("  c;\n  d;"));
        assert_eq!(body(&text, "x_events"), None);
    }
}
