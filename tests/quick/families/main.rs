//! Models with families of coordinates against published and closed results.
#![allow(missing_docs, reason = "models of tests")]

mod references;
