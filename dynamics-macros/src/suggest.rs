//! Did you mean: the nearest known name by edit distance, or the one that is abbreviated.

/// Edit distance where swapping two neighbours counts once (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let substitute = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let plain = substitute.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
                if swapped { plain.min(rows[i - 2][j - 2] + 1) } else { plain }
            };
        }
    }
    rows[a.len()][b.len()]
}

/// The known name nearest to `name`, where it is near enough to be a slip: a third of its letters. Else the
/// only one that `name` abbreviates, by three letters or more: two begin too many words.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = name.chars().count();
    if length > 64 {
        return None;
    }
    let known: Vec<&str> = known.into_iter().filter(|k| k.len() <= 256).collect();
    let best = known.iter().map(|k| (distance(name, k), *k)).min_by_key(|(d, _)| *d)?;
    if best.0 <= (length / 3).max(1) && best.0 < length {
        return Some(best.1);
    }
    let mut longer = known.into_iter().filter(|k| length >= 3 && k.starts_with(name));
    longer.next().filter(|_| longer.next().is_none())
}

/// `; did you mean ..?`, or the list of what there is, or nothing.
pub(crate) fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest(name, known.iter().copied()) {
        Some(best) => format!("; did you mean `{best}`?"),
        None if known.is_empty() => "; there is none".into(),
        None if known.len() <= 8 => {
            format!("; there is {}", known.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", "))
        }
        None => String::new(),
    }
}

/// `; did you mean ..?`, or nothing.
pub(crate) fn did_you_mean_only<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, known).map_or_else(String::new, |best| format!("; did you mean `{best}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised_and_strangers_are_not() {
        for (name, expected) in [
            ("theta3", Some("theta2")),
            ("tehta2", Some("theta2")),
            ("hteta2", Some("theta2")),
            ("theta22", Some("theta2")),
            ("omega", None),
            ("x", None),
        ] {
            assert_eq!(nearest(name, ["theta2", "length"]), expected, "{name}");
        }
    }

    #[test]
    fn the_nearest_of_several_wins() {
        assert_eq!(nearest("kinetc", ["kinematic", "kinetic"]), Some("kinetic"));
    }

    #[test]
    fn abbreviations_are_recognised_where_one_name_fits() {
        let joints = ["revolute", "prismatic", "weld", "slot"];
        for (name, expected) in [("prism", Some("prismatic")), ("rev", Some("revolute")), ("re", None)] {
            assert_eq!(nearest(name, joints), expected, "{name}");
        }
        assert_eq!(nearest("rev", ["revolute", "reversed"]), None);
    }
}
