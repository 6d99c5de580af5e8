//! A note on the error stream, once per program, if a build without optimisation is slow.
//!
//! Numerics without optimisation take up to two hundred times as long, and the user does not see why. A call
//! that takes some seconds prints the note at its end. The profile that it names, or `DYNAMICS_QUIET` in the
//! environment, silences it.

/// Measures the time until it is dropped, and prints the note if that was long.
pub struct SlowBuildNote {
    /// Nothing in a build with optimisation.
    begun: Option<std::time::Instant>,
}

impl SlowBuildNote {
    /// Starts the measurement.
    #[must_use]
    pub fn start() -> Self {
        Self { begun: cfg!(unoptimized).then(std::time::Instant::now) }
    }
}

impl Drop for SlowBuildNote {
    fn drop(&mut self) {
        /// Shorter times need no explanation.
        const MIN_TIME: std::time::Duration = std::time::Duration::from_secs(5);
        static ONCE: std::sync::Once = std::sync::Once::new();
        let Some(begun) = self.begun else { return };
        let took = begun.elapsed();
        if took > MIN_TIME && std::env::var_os("DYNAMICS_QUIET").is_none() {
            ONCE.call_once(|| {
                eprintln!(
                    "dynamics: this took {:.0} s because the crate is compiled without optimisation; use \
                     `--release`, or put `[profile.dev.package.\"*\"]` with `opt-level = 3` into Cargo.toml \
                     (silence: DYNAMICS_QUIET=1)",
                    took.as_secs_f64()
                );
            });
        }
    }
}
