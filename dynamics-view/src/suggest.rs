//! Suggestions for misspelt names.

use alloc::string::String;
use alloc::vec::Vec;

/// The known name nearest to the given one, if it is near enough to be meant.
pub fn suggest<'a>(name: &str, mut known: impl Iterator<Item = &'a str>) -> Option<String> {
    nearest(name, &mut || known.next())
}

/// As [`suggest`]; compiled once, and not with every model.
fn nearest<'a>(name: &str, known: &mut dyn FnMut() -> Option<&'a str>) -> Option<String> {
    let near = |candidate: &str| distance(name, candidate);
    core::iter::from_fn(known)
        .map(|candidate| (near(candidate), candidate))
        .filter(|&(d, candidate)| d <= 1 + candidate.chars().count().max(name.chars().count()) / 3)
        .min_by_key(|&(d, _)| d)
        .map(|(_, candidate)| candidate.into())
}

/// Insertions, deletions and replacements between two words (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = core::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.chars().enumerate() {
            let replace = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replace.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.chars().count()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_what_may_be_meant_and_nothing_else() {
        let known = || ["impact", "apex", "return"].into_iter();
        assert_eq!(suggest("impct", known()).as_deref(), Some("impact"));
        assert_eq!(suggest("apexx", known()).as_deref(), Some("apex"));
        assert_eq!(suggest("temperature", known()), None);
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}
