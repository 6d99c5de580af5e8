//! The simulations of the book as a gallery of live pages: `target/gallery/index.html` has a moving picture of
//! each.
//!
//! The pages come from the examples, and from the files beside this one for what no example has.

// Examples are included as they are, with what their own `main` needs and the gallery does not.
#![allow(dead_code, clippy::duplicate_mod)]

use std::error::Error;
use std::path::Path;

use dynamics::live::{Gallery, LivePage};

/// Includes examples as modules.
macro_rules! examples {
    ($($path:literal $name:ident),* $(,)?) => {$(
        #[path = $path]
        mod $name;
    )*};
}

examples! {
    "../double_pendulum.rs" double_pendulum,
    "../kapitza.rs" kapitza,
    "../planets.rs" planets,
    "../projectile.rs" projectile,
    "../tumbling_book.rs" tumbling_book,
}

/// The function that makes a page.
type Make = fn() -> Result<LivePage, Box<dyn Error>>;

/// The pages by the chapters of the book, with their names as files.
const CHAPTERS: &[(&str, &[(&str, Make)])] = &[
    ("2 Particles and constraints", &[("projectile", projectile::live)]),
    ("3 Systems of particles", &[("planets", planets::live), ("double_pendulum", double_pendulum::live)]),
    ("7 Vibrations", &[("kapitza", kapitza::live)]),
    ("8 Bodies in space", &[("tumbling_book", tumbling_book::live)]),
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut gallery = Gallery::new("Mechanics in motion").about(
        "Simulations after the chapters of Schmerr's Engineering Dynamics 2.0. Each of them computes in your \
         browser: open one, drag what moves, change a parameter, look at the equations.",
    );
    for (chapter, pages) in CHAPTERS {
        gallery = gallery.chapter(*chapter);
        for (name, make) in *pages {
            let page = make().map_err(|error| format!("{name}: {error}"))?;
            println!("{:7.1} kB  {}", page.html().len() as f64 / 1000.0, page.title());
            gallery = gallery.page(*name, page);
        }
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/gallery");
    println!("\nto look at:\n  {}", gallery.write(folder)?.display());
    Ok(())
}
