//! Models with families of coordinates: loops over elements against the same models unrolled, against
//! differences of energies at sizes around those of a block, and against loops written by hand.

mod alone;
mod grids;
mod harness;
mod pairs;
mod rows;
mod shapes;
