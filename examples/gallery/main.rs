//! The simulations of the book as a gallery of live pages: `target/gallery/index.html` shows all of them
//! moving.
//!
//! The pages come from the examples, and from the files beside this one for what no example has.

// Examples are included as they are, with what their own `main` needs and the gallery does not.
#![allow(dead_code, clippy::duplicate_mod)]

mod particles;
mod planar;
mod waves;

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
    "../andrews.rs" andrews,
    "../bead_on_wire.rs" bead_on_wire,
    "../buckling_column.rs" buckling_column,
    "../chain.rs" chain,
    "../charged_particle.rs" charged_particle,
    "../chaplygin_sleigh.rs" chaplygin_sleigh,
    "../coaster_jump.rs" coaster_jump,
    "../double_pendulum.rs" double_pendulum,
    "../foucault.rs" foucault,
    "../four_bar.rs" four_bar,
    "../gimbal.rs" gimbal,
    "../governor.rs" governor,
    "../gyroscope.rs" gyroscope,
    "../gyrostat.rs" gyrostat,
    "../hoop_pitchfork.rs" hoop_pitchfork,
    "../jansen.rs" jansen,
    "../kapitza.rs" kapitza,
    "../planar_bodies.rs" planar_bodies,
    "../planets.rs" planets,
    "../projectile.rs" projectile,
    "../quick_return.rs" quick_return,
    "../rod_tension.rs" rod_tension,
    "../roller_coaster.rs" roller_coaster,
    "../rolling_coin.rs" rolling_coin,
    "../rotating_tube.rs" rotating_tube,
    "../shallow_arch.rs" shallow_arch,
    "../slider_crank.rs" slider_crank,
    "../spring_pendulum.rs" spring_pendulum,
    "../stick_slip.rs" stick_slip,
    "../tumbling_book.rs" tumbling_book,
    "../tuned_absorber.rs" tuned_absorber,
    "../ziegler_flutter.rs" ziegler_flutter,
}

/// A finished page.
type Page = Result<LivePage, Box<dyn Error>>;

/// A chapter with its pages and their names as files.
type Chapter = (&'static str, &'static [(&'static str, fn() -> Page)]);

/// The pages by the chapters of the book.
const CHAPTERS: &[Chapter] = &[
    (
        "2 Particles and constraints",
        &[
            ("projectile", projectile::live),
            ("projectile_with_drag", particles::projectile_with_drag),
            ("bead_on_wire", bead_on_wire::live),
            ("rough_wire", particles::rough_wire),
            ("roller_coaster", roller_coaster::live),
            ("coaster_jump", coaster_jump::live),
            ("spring_pendulum", spring_pendulum::live),
            ("drift_and_projection", particles::drift_and_projection),
            ("rod_tension", rod_tension::live),
            ("rotating_tube", rotating_tube::live),
        ],
    ),
    (
        "3 Systems of particles",
        &[
            ("double_pendulum", double_pendulum::live),
            ("chain", chain::live),
            ("planets", planets::live),
            ("charged_particle", charged_particle::live),
        ],
    ),
    (
        "4 Kinematics",
        &[
            ("slider_crank", slider_crank::live),
            ("four_bar", four_bar::live),
            ("quick_return", quick_return::live),
            ("jansen", jansen::live),
        ],
    ),
    (
        "5 Planar bodies",
        &[
            ("planar_bodies", planar_bodies::live),
            ("redundant_four_bar", planar::redundant_four_bar),
            ("rolling_disc", planar::rolling_disc),
            ("andrews", andrews::live),
            ("chaplygin_sleigh", chaplygin_sleigh::live),
        ],
    ),
    (
        "6 Stability and buckling",
        &[
            ("hoop_pitchfork", hoop_pitchfork::live),
            ("buckling_column", buckling_column::live),
            ("shallow_arch", shallow_arch::live),
            ("ziegler_flutter", ziegler_flutter::live),
        ],
    ),
    (
        "7 Vibrations",
        &[
            ("kapitza", kapitza::live),
            ("stick_slip", stick_slip::live),
            ("tuned_absorber", tuned_absorber::live),
        ],
    ),
    (
        "8 Bodies in space",
        &[
            ("gyroscope", gyroscope::live),
            ("tumbling_book", tumbling_book::live),
            ("gyrostat", gyrostat::live),
            ("gimbal", gimbal::live),
            ("governor", governor::live),
            ("rolling_coin", rolling_coin::live),
            ("foucault", foucault::live),
        ],
    ),
    (
        "9 Waves in a bar",
        &[
            ("waves", waves::waves),
            ("plucked_string", waves::plucked_string),
            ("hanging_rope", waves::rope),
            ("membrane", waves::membrane),
        ],
    ),
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
