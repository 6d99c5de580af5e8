//! Motions that repeat, and motions that never do: multipliers, closed motions, exponents and sections of
//! derived models against published values, closed forms and differences of the motion; what cannot be told,
//! and what it is told with.

#[path = "../../models/double_pendulum.rs"]
mod double_pendulum;
mod exponents;
mod models;
mod multipliers;
mod orbits;
mod sections;
