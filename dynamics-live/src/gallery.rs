//! Galleries: a folder of live pages with an index that shows each of them moving.

use std::fs;
use std::path::{Path, PathBuf};

use dynamics_view::file::{self, Content};
use dynamics_view::text::{fill, xml};

use crate::error::LiveError;
use crate::live::LivePage;
use crate::scripts::joined;

/// A folder of live pages with an index. The index has a card for each page: its picture in motion, its title
/// and the first sentence of what the page says about its model.
///
/// ```ignore
/// Gallery::new("Pendulums")
///     .chapter("In the plane")
///     .page("double_pendulum", model.live(start).finish()?)
///     .write("gallery")?;
/// ```
#[must_use]
pub struct Gallery {
    title: String,
    about: String,
    chapters: Vec<Chapter>,
}

struct Chapter {
    title: String,
    entries: Vec<Entry>,
}

struct Entry {
    name: String,
    page: LivePage,
}

impl Gallery {
    /// An empty gallery.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), about: String::new(), chapters: Vec::new() }
    }

    /// What stands under the title of the index.
    pub fn about(mut self, text: impl Into<String>) -> Self {
        self.about = text.into();
        self
    }

    /// Begins a chapter: the pages that are added after it stand under its title.
    pub fn chapter(mut self, title: impl Into<String>) -> Self {
        self.chapters.push(Chapter { title: title.into(), entries: Vec::new() });
        self
    }

    /// Adds a page, to be written as `<name>.html`.
    pub fn page(mut self, name: impl Into<String>, page: LivePage) -> Self {
        if self.chapters.is_empty() {
            self = self.chapter("");
        }
        let entry = Entry { name: name.into(), page };
        self.chapters.last_mut().expect("a chapter was just made sure of").entries.push(entry);
        self
    }

    /// Writes `index.html` and all pages into a folder, which is created; returns the path of the index.
    ///
    /// # Errors
    /// Names that are no names of files or not different, before anything is written; a file that cannot be
    /// written.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<PathBuf, LiveError> {
        let folder = folder.as_ref();
        self.check_names()?;
        for Entry { name, page } in self.entries() {
            page.write_html(folder.join(format!("{name}.html")))?;
        }
        let path = folder.join("index.html");
        file::write(&path, Content::Page, self.index().as_bytes())?;
        // A path that a shell or a browser can open from wherever it is.
        Ok(fs::canonicalize(&path).unwrap_or(path))
    }

    fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.chapters.iter().flat_map(|chapter| &chapter.entries)
    }

    /// Names stand in addresses and in names of files, also where capital letters are not told apart.
    fn check_names(&self) -> Result<(), LiveError> {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        let mut taken = vec!["index".to_owned()];
        for Entry { name, .. } in self.entries() {
            let lower = name.to_lowercase();
            if name.is_empty() || !name.chars().all(plain) || taken.contains(&lower) {
                return Err(LiveError::PageName { name: name.clone() });
            }
            taken.push(lower);
        }
        Ok(())
    }

    /// The index as text.
    fn index(&self) -> String {
        let titled = || self.chapters.iter().enumerate().filter(|(_, chapter)| !chapter.title.is_empty());
        let contents: String = titled()
            .map(|(k, chapter)| format!("<a href=\"#chapter-{k}\">{}</a>\n", xml(&chapter.title)))
            .collect();
        let chapters: String =
            self.chapters.iter().enumerate().map(|(k, chapter)| chapter.section(k)).collect();
        fill(
            include_str!("gallery/index.html"),
            &[
                ("title", &xml(&self.title)),
                ("about", &xml(&self.about)),
                ("style", &joined(&[include_str!("gallery/index.css")])),
                ("contents", &contents),
                ("chapters", &chapters),
                ("script", &joined(&[include_str!("gallery/index.js")])),
            ],
        )
    }
}

impl Chapter {
    fn section(&self, k: usize) -> String {
        let heading =
            if self.title.is_empty() { String::new() } else { format!("<h2>{}</h2>\n", xml(&self.title)) };
        let cards: String = self.entries.iter().map(Entry::card).collect();
        format!("<section id=\"chapter-{k}\">\n{heading}<div class=\"cards\">\n{cards}</div>\n</section>\n")
    }
}

impl Entry {
    fn card(&self) -> String {
        fill(
            include_str!("gallery/card.html"),
            &[
                ("name", &self.name),
                ("title", &xml(self.page.title())),
                ("about", &xml(&first_sentence(self.page.about()))),
            ],
        )
    }
}

/// Up to the first full stop that ends a sentence: one before a capital letter. Lines of comments are joined.
fn first_sentence(text: &str) -> String {
    let mut text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut stops = text.match_indices(". ");
    let end = stops.find(|(at, _)| text[at + 2..].chars().next().is_some_and(char::is_uppercase));
    text.truncate(end.map_or(text.len(), |(at, _)| at + 1));
    text
}

#[cfg(test)]
mod tests {
    use super::{Gallery, first_sentence};
    use crate::live::LivePage;

    fn page(title: &str, about: &str) -> LivePage {
        LivePage { title: title.to_owned(), about: about.to_owned(), html: "<html>".to_owned() }
    }

    #[test]
    fn a_sentence_ends_before_a_capital_letter() {
        assert_eq!(first_sentence("Swings at approx.\ntwo hertz.\nDrag it."), "Swings at approx. two hertz.");
        assert_eq!(first_sentence("One bob"), "One bob");
        assert_eq!(first_sentence("Two bobs on\ntwo rods.\nDrag one."), "Two bobs on two rods.");
        assert_eq!(first_sentence("Rods of 0.5 m. Bobs."), "Rods of 0.5 m.");
    }

    #[test]
    fn cards_escape_what_they_say() {
        let gallery = Gallery::new("a < b").chapter("\"c\"").page("d", page("e & f", "g > h. I."));
        let index = gallery.index();
        assert!(index.contains("a &lt; b") && index.contains("&quot;c&quot;"));
        assert!(index.contains("e &amp; f") && index.contains("g &gt; h.") && !index.contains("I."));
        assert!(index.contains("src=\"d.html#~only=picture\"") && !index.contains("{{"));
    }

    #[test]
    fn names_are_different_names_of_files() {
        for names in [["a", "A"], ["a", "index"], ["a", "b/c"], ["a", ""]] {
            let gallery = names.iter().fold(Gallery::new(""), |g, name| g.page(*name, page("", "")));
            assert!(gallery.check_names().is_err(), "{names:?}");
        }
        assert!(Gallery::new("").page("a", page("", "")).page("b-2", page("", "")).check_names().is_ok());
    }
}
