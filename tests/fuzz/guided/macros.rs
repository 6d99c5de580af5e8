//! The coverage-guided target: libFuzzer keeps what reaches new code and changes it further.
//!
//! An input is the text of a struct, a line `---`, and the text of an impl block. Half of the changes are
//! made on its tokens, half on its bytes.
//!
//! ```text
//! cargo run --manifest-path tests/fuzz/Cargo.toml -- --seeds tests/fuzz/corpus/macros
//! cargo +nightly fuzz run --fuzz-dir tests/fuzz --features guided macros -- -max_len=20000 -timeout=20
//! ```
#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use std::cell::LazyCell;

use dynamics_fuzz::corpus::{self, Seed};
use dynamics_fuzz::mutate::mutate;
use dynamics_fuzz::random::Random;
use dynamics_fuzz::target::{check, check_raw};
use dynamics_fuzz::trees::{parsed, stream};

thread_local! {
    // Tokens stay on their thread.
    static SEEDS: LazyCell<Vec<Seed>> = LazyCell::new(corpus::read);
}

fuzz_target!(|data: &[u8]| {
    proc_macro2::extra::invalidate_current_thread_spans();
    let Ok(text) = std::str::from_utf8(data) else { return };
    let result = match text.split_once("\n---\n").map(|(a, b)| (a.parse(), b.parse())) {
        Some((Ok(declaration), Ok(implementation))) => check(&declaration, &implementation),
        _ => match text.parse() {
            Ok(tokens) => check_raw(&tokens),
            Err(_) => return,
        },
    };
    if let Err(finding) = result {
        panic!("{finding}");
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    if seed % 4 == 0 {
        return fuzzer_mutate(data, size, max_size);
    }
    let text = std::str::from_utf8(&data[..size]).ok();
    let halves = text.and_then(|t| t.split_once("\n---\n")).map(|(a, b)| (parsed(a), parsed(b)));
    let Some((Some(mut declaration), Some(mut implementation))) = halves else {
        return fuzzer_mutate(data, size, max_size);
    };
    let mut random = Random::new(seed.into());
    for _ in 0..=random.below(3) {
        let list = if random.one_in(4) { &mut declaration } else { &mut implementation };
        SEEDS.with(|seeds| mutate(list, &mut random, seeds));
    }
    let changed = format!("{}\n---\n{}", stream(&declaration), stream(&implementation));
    if changed.len() > max_size {
        return fuzzer_mutate(data, size, max_size);
    }
    data[..changed.len()].copy_from_slice(changed.as_bytes());
    changed.len()
});
