//! A word about builds without optimisation, where that takes its time: once per program, on the error
//! stream.
//!
//! Numerics without optimisation take up to two hundred times as long, and who waits does not see why. What
//! takes some seconds says so at its end. Programs that do not want to hear it are compiled with the profile
//! that it names, or run with `DYNAMICS_QUIET` in their environment.

/// Watches how long something takes, to its end of life.
pub struct Watch {
    #[cfg(unoptimized)]
    begun: std::time::Instant,
}

impl Watch {
    /// From here on.
    #[must_use]
    pub fn start() -> Self {
        Self {
            #[cfg(unoptimized)]
            begun: std::time::Instant::now(),
        }
    }
}

#[cfg(unoptimized)]
impl Drop for Watch {
    fn drop(&mut self) {
        /// Nobody asks why something takes less.
        const LONG: std::time::Duration = std::time::Duration::from_secs(5);
        static ONCE: std::sync::Once = std::sync::Once::new();
        let took = self.begun.elapsed();
        if took > LONG && std::env::var_os("DYNAMICS_QUIET").is_none() {
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
