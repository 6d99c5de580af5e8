//! The words of models: jets, sines, splines, vectors and matrices.

mod jets;
mod sin_cos;
mod spline;
mod vocabulary;
