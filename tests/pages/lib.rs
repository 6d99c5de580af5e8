//! Pages of the documentation as doctests that compare their pictures.
//!
//! An example of the guide writes its picture, and the page shows it. That both are the same is tested where
//! the example runs. So that the test does not stand in the example, a page has it in a comment behind it:
//!
//! ````text
//! ```rust
//! fn main() { .. }
//! ```
//! <!-- pictures::check("pendulum"); -->
//!
//! ![..](pictures/pendulum.svg)
//! ````
//!
//! [`page!`] gives the text of a page in which such lines stand at the end of the example's `main`.

use std::path::Path;

use proc_macro::{Literal, TokenStream, TokenTree};

/// What the comments of a page begin with.
const CALL: &str = "<!-- pictures::";

/// Where the functions of the comments are.
const FUNCTIONS: &str = "include!(concat!(env!(\"CARGO_MANIFEST_DIR\"), \"/../../docs/pictures.rs\"));";

/// The text of a page, for `#[doc = page!("docs/guide/results.md")]`; the path counts from the package.
#[proc_macro]
pub fn page(path: TokenStream) -> TokenStream {
    let path = path.to_string();
    let package = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let file = Path::new(&package).join(path.trim_matches('"'));
    let text = match std::fs::read_to_string(&file) {
        Ok(text) => with_calls(&text),
        Err(error) => panic!("{}: {error}", file.display()),
    };
    TokenTree::Literal(Literal::string(&text)).into()
}

/// The page with the calls of its comments at the end of the examples before them.
fn with_calls(text: &str) -> String {
    let mut out: Vec<String> = Vec::new();
    let (mut block, mut ended): (Option<usize>, Option<usize>) = (None, None);
    for line in text.lines() {
        match line {
            "```rust" => block = Some(out.len()),
            "```" => ended = block.take().map(|_| out.len()).or(ended),
            _ => {}
        }
        if let (Some(end), Some(call)) = (ended, line.strip_prefix(CALL)) {
            let call = format!("pictures::{}", call.trim_end_matches(" -->"));
            ended = Some(insert(&mut out, end, call));
            continue;
        }
        out.push(line.to_string());
    }
    out.join("\n")
}

/// Puts a call before the last statement of the example that ends at this line; returns where it ends then.
fn insert(out: &mut Vec<String>, end: usize, call: String) -> usize {
    let mut end = end;
    if out[end - 1] != FUNCTIONS {
        out.insert(end, FUNCTIONS.to_string());
        end += 1;
    }
    let last = |line: &String| line.trim() == "Ok(())" || line == "}";
    let at = out[..end - 1].iter().rposition(|line| line.trim() == "Ok(())");
    let at = at.filter(|at| end - at < 5).or_else(|| out[..end - 1].iter().rposition(last));
    out.insert(at.unwrap_or(end - 1), call);
    end + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_stand_at_the_end_of_main() {
        let page =
            "a\n```rust\nfn main() {\n    one();\n    Ok(())\n}\n```\n<!-- pictures::check(\"x\"); -->\nb";
        let expected = format!(
            "a\n```rust\nfn main() {{\n    one();\npictures::check(\"x\");\n    Ok(())\n}}\n\
             {FUNCTIONS}\n```\nb"
        );
        assert_eq!(with_calls(page), expected);
        let page = "```rust\nfn main() {\n    one();\n}\n```\n<!-- pictures::check(\"x\"); -->\n";
        assert!(with_calls(page).contains("one();\npictures::check(\"x\");\n}\n"));
    }

    #[test]
    fn pages_without_comments_stay_as_they_are() {
        let page = "a\n```rust\nfn main() {}\n```\nb";
        assert_eq!(with_calls(page), page);
    }
}
