//! Models with families of coordinates against published and closed results.
#![allow(missing_docs, reason = "models of tests")]
#![allow(clippy::excessive_precision, reason = "reference values keep their digits")]

mod bits;
mod constraints;
mod grids;
mod references;
mod waves;
