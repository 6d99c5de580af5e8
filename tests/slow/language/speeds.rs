//! Generalized speeds: equations solved in them against the same equations in coordinates and against closed
//! ones; starts, outputs and motions.

mod against_coordinates;
mod closed_forms;
mod models;
mod motions;
mod starts;
