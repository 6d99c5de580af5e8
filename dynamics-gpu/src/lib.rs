//! Many runs of a model on a graphics card.
//!
//! A model with `#[model(targets(c))]` has its programs in C. [`kernel_in_cuda`] joins them with the method
//! that moves runs side by side in the lanes of the processor; the card's driver compiles the text when the
//! program runs. [`Gpu::ends`] hands runs to the card and those that it cannot make to the processor.
//!
//! | file | what it does |
//! |---|---|
//! | `kernel` | the text of a kernel: programs, tables and steps |
//! | `side_by_side.c` | the steps of a run, with gaps for sizes and tables |
//! | `cuda` | cards of NVIDIA (feature `cuda`): compiled kernels, memory, launches |
//! | `side_by_side.wgsl` | the same in single precision |
//! | `single` | cards of all makers (feature `wgpu`): in single precision, with its error measured |
//! | `cuda/launch.rs` | what the compiler cannot check. The only `unsafe` code |
//!
//! Without these features the crate has the texts alone.

#[cfg(feature = "cuda")]
mod cuda;
mod kernel;
#[cfg(feature = "wgpu")]
mod single;

#[cfg(feature = "cuda")]
pub use cuda::{Gpu, GpuError, compile_kernel};
pub use kernel::{KernelError, kernel_in_cuda, kernel_in_wgsl, side_by_side_in_c};
#[cfg(feature = "wgpu")]
pub use single::{MeasuredError, SingleEnds, SingleGpu, SingleGpuError};
