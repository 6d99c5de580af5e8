//! Mistakes in models and what the compiler says about them: one mistake per file below `ui/`, named after
//! it.
//!
//! `TRYBUILD=overwrite cargo test --test ui` writes the messages anew; read them before they are committed.

#[test]
fn every_mistake_gives_its_one_error() {
    let cases = trybuild::TestCases::new();
    cases.compile_fail("tests/ui/*.rs");
}
