//! The engine: graph, derivatives, equations, checks, programs and texts.

mod articulated_bodies;
mod checks;
mod common;
mod constraint_analysis;
mod constraint_checks;
mod constraint_consequences;
mod constraint_degenerate;
mod constraint_mechanisms;
mod constraint_properties;
mod constraints;
mod derivation;
mod elimination;
mod expressions;
mod forms;
mod limits;
mod mathml;
mod models;
mod operations;
mod series;
mod series_constrained;
mod targets;
mod texts;
mod units;
