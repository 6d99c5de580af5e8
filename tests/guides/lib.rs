//! The README, the guides and the course as doctests: their code is compiled and run, and their pictures and
//! their listings are compared with what it draws and prints.

use dynamics_pages::page;

#[doc = page!("../../README.md")]
pub struct Readme;
#[doc = page!("../../docs/guide/first-model.md")]
pub struct FirstModel;
#[doc = page!("../../docs/guide/results.md")]
pub struct Results;
#[doc = page!("../../docs/guide/constraints.md")]
pub struct Constraints;
#[doc = page!("../../docs/guide/mechanisms.md")]
pub struct Mechanisms;
#[doc = page!("../../docs/guide/events-and-control.md")]
pub struct EventsAndControl;
#[doc = page!("../../docs/guide/equilibria.md")]
pub struct Equilibria;
#[doc = page!("../../docs/guide/branches.md")]
pub struct Branches;
#[doc = page!("../../docs/guide/vibration.md")]
pub struct Vibration;
#[doc = page!("../../docs/guide/rotors.md")]
pub struct Rotors;
#[doc = page!("../../docs/guide/periodic-motions.md")]
pub struct PeriodicMotions;
#[doc = page!("../../docs/guide/parameters.md")]
pub struct Parameters;
#[doc = page!("../../docs/guide/ensembles.md")]
pub struct Ensembles;
#[doc = page!("../../docs/guide/accuracy.md")]
pub struct Accuracy;
#[doc = page!("../../docs/guide/bodies.md")]
pub struct Bodies;
#[doc = page!("../../docs/guide/singular-positions.md")]
pub struct SingularPositions;
#[doc = page!("../../docs/guide/families.md")]
pub struct Families;
#[doc = page!("../../docs/guide/waves.md")]
pub struct Waves;
#[doc = page!("../../docs/guide/live-pages.md")]
pub struct LivePages;
#[doc = page!("../../docs/guide/c.md")]
pub struct C;
#[doc = page!("../../docs/guide/gpu.md")]
pub struct Gpu;
#[doc = page!("../../docs/guide/fmi.md")]
pub struct Fmi;
#[doc = page!("../../docs/reference/language.md")]
pub struct Language;

#[doc = page!("../../docs/book/src/particles-and-constraints.md")]
pub struct BookParticles;
#[doc = page!("../../docs/book/src/systems-of-particles.md")]
pub struct BookSystems;
#[doc = page!("../../docs/book/src/kinematics.md")]
pub struct BookKinematics;
#[doc = page!("../../docs/book/src/planar-bodies.md")]
pub struct BookPlanarBodies;
#[doc = page!("../../docs/book/src/stability.md")]
pub struct BookStability;
#[doc = page!("../../docs/book/src/vibrations.md")]
pub struct BookVibrations;
#[doc = page!("../../docs/book/src/bodies-in-space.md")]
pub struct BookBodiesInSpace;
#[doc = page!("../../docs/book/src/waves-in-a-bar.md")]
pub struct BookWaves;
#[doc = page!("../../docs/book/src/matrices-solids-methods.md")]
pub struct BookMatricesSolidsMethods;
#[doc = page!("../../docs/book/src/vibration-formulas-signals.md")]
pub struct BookFormulasSignals;

/// The pages show every picture of the guide and of the course, and only pictures that their examples draw.
///
/// ```
/// include!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/pictures.rs"));
/// fn main() {
///     pictures::all_are_shown();
/// }
/// ```
pub struct Pictures;
