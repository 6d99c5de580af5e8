//! Rules that the sources keep: who may use whom, and a case for every message. These tests read files and
//! compile no model.

mod architecture;
mod catalogue;
mod pages;
