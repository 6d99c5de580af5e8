//! Kernels, by the compiler of kernels, which needs no card.

use std::env;

use dynamics::gpu::{Gpu, GpuError, compile_kernel};
use dynamics::model::{PrintedInC, SimulationModel};

use crate::random_states::{Visit, every_model};

/// Compute capabilities of common cards: those of Turing and Hopper.
const CAPABILITIES: [u32; 2] = [75, 90];

#[derive(Default)]
struct Compiled {
    kernels: usize,
    skipped: bool,
}

impl Visit for Compiled {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M) {
        let mut fused = Vec::new();
        for (i, capability) in CAPABILITIES.into_iter().enumerate() {
            match compile_kernel(model, capability, i == 0) {
                Ok(kernel) => {
                    let text = kernel.to_src();
                    assert!(text.contains(&format!(".visible .entry {}_kernel(", M::C.name)), "{}", M::NAME);
                    assert!(text.contains(".f64") && !text.contains(".f32"), "{}: doubles alone", M::NAME);
                    fused.push(text.matches("fma.rn.f64").count());
                    self.kernels += 1;
                }
                Err(GpuError::NoCompiler) => self.skipped = true,
                Err(GpuError::Model(reason)) => {
                    assert!(!M::ROWS.is_empty(), "{}: {reason}", M::NAME);
                    assert_eq!(
                        reason.to_string(),
                        format!(
                            "{} has constraints, which kernels do not hold: its runs are made by the processor",
                            M::NAME
                        )
                    );
                }
                Err(error) => panic!("{}: {error}", M::NAME),
            }
        }
        // The first is exact: no products and sums are fused there but inside of functions of the library.
        assert!(fused.get(1).is_none_or(|&with| with > 100 + fused[0]), "{}: {fused:?}", M::NAME);
    }
}

/// The kernels of all models that C has compile for several cards, without a card.
#[test]
fn every_kernel_compiles() {
    let mut compiled = Compiled::default();
    every_model(&mut compiled);
    let must = env::var_os("DYNAMICS_NVRTC").is_some();
    assert!(!(must && compiled.skipped), "DYNAMICS_NVRTC is set, but there is no compiler of kernels");
    if compiled.skipped {
        eprintln!("skipped: there is no compiler of kernels (libnvrtc)");
    } else {
        assert!(compiled.kernels >= 12 * CAPABILITIES.len(), "{}", compiled.kernels);
    }
}

/// Where there is a card it has a name; where there is none the error says so and what to do.
#[test]
fn a_missing_card_is_named() {
    match Gpu::first() {
        Ok(gpu) => assert!(!gpu.name().is_empty()),
        Err(error @ (GpuError::NoDriver | GpuError::NoCard)) => {
            assert!(error.to_string().contains("the runs can be made by the processor"), "{error}");
        }
        Err(error) => assert!(matches!(error, GpuError::NoCompiler | GpuError::Driver(_)), "{error}"),
    }
}
