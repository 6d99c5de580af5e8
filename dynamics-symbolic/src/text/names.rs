//! A user's name as a symbol of a formula: a letter or a word with indices.

/// Greek letters by their names.
const GREEK: &[&str] = &[
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu",
    "nu", "xi", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega", "Gamma", "Delta",
    "Theta", "Lambda", "Xi", "Pi", "Sigma", "Upsilon", "Phi", "Psi", "Omega",
];

/// The letters in the order of their names.
const LETTERS: &str = "αβγδεζηθικλμνξπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ";

/// A name with its indices: `theta1`, `theta[3]`, `m_cart`, `axis.x`, `inertia[0, 1]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Name<'a> {
    /// The letter or word.
    pub(super) base: &'a str,
    /// Digits at its end, then what follows it.
    pub(super) indices: Vec<&'a str>,
}

impl<'a> Name<'a> {
    /// The parts of a user's name.
    pub(super) fn new(user: &'a str) -> Self {
        // Indices of families have a sum in them, `s[i + 1]`.
        let separators: &[char] = if user.contains(" + ") || user.contains(" - ") {
            &['[', ']']
        } else {
            &['_', '.', '[', ']', ',', ' ']
        };
        let mut parts = user.split(separators).filter(|p| !p.is_empty());
        let (base, digits) = split_digits(parts.next().unwrap_or(user));
        let digits = (!digits.is_empty()).then_some(digits);
        Self { base, indices: digits.into_iter().chain(parts).collect() }
    }
}

/// Letters and the digits at their end.
pub(super) fn split_digits(word: &str) -> (&str, &str) {
    let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
    if letters.is_empty() { (word, "") } else { word.split_at(letters.len()) }
}

/// Whether this is the name of a Greek letter.
pub(super) fn is_greek(name: &str) -> bool {
    GREEK.contains(&name)
}

/// The Greek letter of this name.
pub(super) fn letter(name: &str) -> Option<char> {
    GREEK.iter().position(|g| *g == name).and_then(|i| LETTERS.chars().nth(i))
}

/// The name of a small Greek letter.
pub(super) fn small_letter_name(letter: char) -> Option<&'static str> {
    LETTERS
        .chars()
        .position(|g| g == letter)
        .map(|i| GREEK[i])
        .filter(|name| !name.starts_with(char::is_uppercase))
}

#[cfg(test)]
mod tests {
    use super::{Name, letter, small_letter_name};

    #[test]
    fn names_are_split_into_a_base_and_indices() {
        for (user, base, indices) in [
            ("theta1", "theta", &["1"][..]),
            ("theta[3]", "theta", &["3"]),
            ("x", "x", &[]),
            ("m_cart", "m", &["cart"]),
            ("omega_z2", "omega", &["z2"]),
            ("inertia[0, 1]", "inertia", &["0", "1"]),
            ("_", "_", &[]),
            ("_1", "1", &[]),
            ("s[i + 1]", "s", &["i + 1"]),
        ] {
            assert_eq!(Name::new(user), Name { base, indices: indices.to_vec() });
        }
    }

    #[test]
    fn letters_and_their_names_agree() {
        for (name, greek) in [("alpha", 'α'), ("rho", 'ρ'), ("tau", 'τ'), ("omega", 'ω'), ("Omega", 'Ω')]
        {
            assert_eq!(letter(name), Some(greek));
        }
        assert_eq!(small_letter_name('ω'), Some("omega"));
        assert_eq!(small_letter_name('Ω'), None);
        assert_eq!(letter("cart"), None);
    }
}
