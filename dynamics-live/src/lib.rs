//! Live pages: a model as one file that simulates in any browser.
//!
//! The macro prints a model's programs in JavaScript beside the Rust
//! ([`Portable`](dynamics_runtime::model::Portable)). A page is these programs, the names and units of the
//! model, a start, and the scripts of this crate. It needs no network and no server.
//!
//! | file | what it does |
//! |---|---|
//! | `live` | [`Live`], the builder: what the user chooses |
//! | `closures` | what the compiler refuses with words of this crate |
//! | `plan` | what a page can hold, and what not |
//! | `data` | the model and the choices as JSON |
//! | `page` | all of it put into the template |
//! | `families` | [`FamilyLive`], the same for models with numbered coordinates |
//! | `gallery` | [`Gallery`]: a folder of pages with an index |
//! | `scripts` | the scripts, as pages get them |
//! | `motion/` | scripts that compute: sines with the bits of the library, methods, constraints, events |
//! | `page/` | scripts and style of what is seen |

mod closures;
mod data;
mod error;
#[cfg(feature = "families")]
mod families;
mod gallery;
mod live;
mod page;
mod plan;
mod scripts;

#[doc(hidden)]
pub use closures::HeldByPages;
pub use error::LiveError;
#[cfg(feature = "families")]
pub use families::{FamilyLive, OpenFamilyLive};
pub use gallery::Gallery;
pub use live::{Live, LivePage, OpenLive, PageMethod};
#[doc(hidden)]
pub use scripts::motion_script;
