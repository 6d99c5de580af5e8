//! Studies of error against cost, and of models beside each other.

#[path = "../../dynamics-runtime/tests/common/mod.rs"]
mod common;
mod ladder;
mod work_precision;
