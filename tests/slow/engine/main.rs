//! What takes long of the engine's tests.

mod accuracy;
#[path = "../../../dynamics-symbolic/tests/common/mod.rs"]
mod common;
