//! What the compiler cannot check: whether libraries can be loaded, and the launch of a kernel. The only
//! `unsafe` code of this crate.
#![allow(unsafe_code)]

use std::sync::Arc;

use cudarc::driver::{CudaFunction, CudaSlice, CudaStream, DriverError, LaunchConfig, PushKernelArg as _};

/// Threads of a block: a small number, since a run needs many registers.
const THREADS: u32 = 64;

/// Whether the driver can be loaded.
pub(super) fn has_driver() -> bool {
    // SAFETY: loads a library of the system, whose initialisation has no conditions.
    unsafe { cudarc::driver::sys::is_culib_present() }
}

/// Whether the compiler of kernels can be loaded.
pub(super) fn has_compiler() -> bool {
    // SAFETY: loads a library of the system, whose initialisation has no conditions.
    unsafe { cudarc::nvrtc::sys::is_culib_present() }
}

/// Launches a kernel `NAME_kernel(given, moving, outcomes, runs, attempts)` of `kernel.rs`, a thread for each
/// run.
pub(super) fn launch(
    stream: &Arc<CudaStream>,
    kernel: &CudaFunction,
    (given, moving, outcomes): (&CudaSlice<f64>, &mut CudaSlice<f64>, &mut CudaSlice<i32>),
    (runs, attempts): (usize, i32),
) -> Result<(), DriverError> {
    let blocks = u32::try_from(runs.div_ceil(THREADS as usize)).unwrap_or(u32::MAX);
    let shape = LaunchConfig { grid_dim: (blocks, 1, 1), block_dim: (THREADS, 1, 1), shared_mem_bytes: 0 };
    let mut call = stream.launch_builder(kernel);
    call.arg(given).arg(moving).arg(outcomes).arg(&runs).arg(&attempts);
    // SAFETY: the arguments have the number, order and types of the kernel's (`runs` is a `size_t`,
    // `attempts` an `int`). Thread r reads and writes elements e·runs + r of the arrays for e below the
    // lengths that `Batch::new` gives them, and threads from `runs` on return at once. The arrays outlive the
    // kernel: they are on the stream.
    unsafe { call.launch(shape) }?;
    Ok(())
}
