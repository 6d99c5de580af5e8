//! The words of models: jets, sines, splines, vectors and matrices.

mod jets;
mod spline;
mod vocabulary;
