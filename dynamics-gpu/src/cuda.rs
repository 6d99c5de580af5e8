//! Cards of NVIDIA.
//!
//! Driver and compiler are libraries that are loaded when the program runs: a program with the feature `cuda`
//! starts on every machine, and says there what is missing.

mod launch;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use cudarc::driver::sys::CUresult;
use cudarc::driver::{CudaContext, CudaFunction, CudaSlice, CudaStream, DriverError};
use cudarc::nvrtc::{CompileError, CompileOptions, Ptx, compile_ptx_with_opts};
use dynamics_runtime::model::{PrintedInC, SimulationModel};
use dynamics_runtime::simulate::{
    Batch, Device, DeviceEnds, Outcome, Simulation, can_be_on_device, ends, ends_on,
};

use crate::kernel::{KernelError, kernel_in_cuda, name};

/// Attempts of a launch: few, because drivers of cards with a screen stop kernels that take seconds.
const ATTEMPTS: i32 = 32;
/// Most runs that are on the card at the same time, where memory has room for them.
const AT_ONCE: usize = 1 << 20;
/// Part of the card's free memory that the arrays of runs may take; kernels need some, too.
const MEMORY_PART: usize = 4;

/// Why runs cannot be made on a card.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no driver of a card.
    #[error("no driver of an NVIDIA card is installed here (libcuda): the runs can be made by the processor")]
    NoDriver,
    /// There is a driver, but no card.
    #[error("the driver finds no NVIDIA card here: the runs can be made by the processor")]
    NoCard,
    /// There are cards, but none of this number.
    #[error("there is no card {number}: the driver finds {count}, counted from 0")]
    NoSuchCard {
        /// The number that was asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// There is no compiler of kernels.
    #[error(
        "the compiler of kernels is not installed here (libnvrtc of the CUDA toolkit, version 12, or \
         the Python package nvidia-cuda-nvrtc-cu12 with its folder in LD_LIBRARY_PATH)"
    )]
    NoCompiler,
    /// The model has no kernel.
    #[error(transparent)]
    Model(Arc<KernelError>),
    /// The models have different tables of smooth functions.
    #[error("run {run} has other smooth functions than the first: runs on a card share them")]
    Functions {
        /// Its number, from 0 on.
        run: usize,
    },
    /// The compiler of kernels does not know the card: it is too old or too new for it.
    #[error(
        "the compiler of kernels (libnvrtc) does not know cards of compute capability {}.{}; install the \
         version of it that belongs to the driver",
        capability / 10, capability % 10
    )]
    Capability {
        /// Ten times the compute capability.
        capability: u32,
    },
    /// The driver does not load a kernel.
    #[error(
        "the driver does not load the kernel: {error}; if the compiler of kernels (libnvrtc) is newer than the \
         driver, install the version that belongs to it"
    )]
    Load {
        /// What the driver says.
        error: DriverError,
    },
    /// The compiler refuses a kernel: a mistake of this library.
    #[error("the kernel of {model} does not compile, a mistake of dynamics; please report it:\n{log}")]
    Kernel {
        /// Name of the model.
        model: &'static str,
        /// What the compiler says.
        log: String,
    },
    /// The driver fails.
    #[error("the driver of the card fails: {0}")]
    Driver(DriverError),
}

impl From<DriverError> for GpuError {
    fn from(error: DriverError) -> Self {
        Self::Driver(error)
    }
}

impl From<KernelError> for GpuError {
    fn from(error: KernelError) -> Self {
        Self::Model(Arc::new(error))
    }
}

/// A kernel of a model as machine code for cards of a kind, such as `90` for compute capability 9.0. No card
/// is needed. With `exact` products and sums are not fused: results then have the bits of portable lanes of
/// the processor.
///
/// # Errors
/// The model has constraints or cannot be written in C; there is no compiler of kernels.
pub fn compile_kernel<M: SimulationModel + PrintedInC>(
    model: &M,
    capability: u32,
    exact: bool,
) -> Result<Ptx, GpuError> {
    compile::<M>(kernel_in_cuda(model)?, capability, exact)
}

fn compile<M: SimulationModel + PrintedInC>(
    text: String,
    capability: u32,
    exact: bool,
) -> Result<Ptx, GpuError> {
    if !launch::has_compiler() {
        return Err(GpuError::NoCompiler);
    }
    let options = CompileOptions {
        fmad: Some(!exact),
        options: vec![
            format!("--gpu-architecture=compute_{capability}"),
            // The programs in C do not say where they run.
            "--device-as-default-execution-space".to_owned(),
        ],
        name: Some(format!("{}.cu", M::C.name)),
        ..CompileOptions::default()
    };
    compile_ptx_with_opts(text, options).map_err(|error| {
        let log = match error {
            CompileError::CompileError { log, .. } => log.to_string_lossy().into_owned(),
            other => other.to_string(),
        };
        if log.contains("--gpu-architecture") {
            return GpuError::Capability { capability };
        }
        GpuError::Kernel { model: M::NAME, log }
    })
}

/// A card that makes runs.
///
/// ```no_run
/// # mod dynamics { pub use dynamics_gpu as gpu; pub use dynamics_runtime::*; }
/// # fn f<M: dynamics_runtime::model::SimulationModel + dynamics_runtime::model::PrintedInC>(
/// #     model: &M, starts: &[M::State]) -> Result<(), dynamics_gpu::GpuError> {
/// use dynamics::gpu::Gpu;
/// use dynamics::simulate::Simulate;
///
/// let gpu = Gpu::first()?;
/// let done = gpu.ends(starts.iter().map(|start| model.simulate(*start).until(10.0).tolerance(1e-9)))?;
/// println!("{} of {} runs on {}", done.on_device(), done.ends.len(), gpu.name());
/// # Ok(()) }
/// ```
pub struct Gpu {
    context: Arc<CudaContext>,
    stream: Arc<CudaStream>,
    name: String,
    capability: u32,
    exact: bool,
    /// Kernels that are loaded, by their texts.
    kernels: Mutex<HashMap<String, CudaFunction>>,
    /// Held by the thread whose runs are on the card.
    turn: Mutex<()>,
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { name, capability, exact, .. } = self;
        let mut out = f.debug_struct("Gpu");
        out.field("name", name).field("capability", capability).field("exact", exact).finish_non_exhaustive()
    }
}

impl Gpu {
    /// The first card of this machine.
    ///
    /// # Errors
    /// There is none, or no driver, or no compiler of kernels.
    pub fn first() -> Result<Self, GpuError> {
        Self::numbered(0)
    }

    /// The card of a number, from 0 on.
    ///
    /// # Errors
    /// There is none of this number, or no driver, or no compiler of kernels.
    pub fn numbered(number: usize) -> Result<Self, GpuError> {
        if !launch::has_driver() {
            return Err(GpuError::NoDriver);
        }
        let count = match CudaContext::device_count() {
            Err(error) if error.0 == CUresult::CUDA_ERROR_NO_DEVICE => 0,
            count => usize::try_from(count?).unwrap_or(0),
        };
        if count == 0 {
            return Err(GpuError::NoCard);
        }
        if number >= count {
            return Err(GpuError::NoSuchCard { number, count });
        }
        if !launch::has_compiler() {
            return Err(GpuError::NoCompiler);
        }
        let context = CudaContext::new(number)?;
        let (major, minor) = context.compute_capability()?;
        Ok(Self {
            stream: context.default_stream(),
            name: context.name()?,
            capability: (10 * major + minor).unsigned_abs(),
            exact: false,
            kernels: Mutex::default(),
            turn: Mutex::default(),
            context,
        })
    }

    /// Products and sums are not fused: ends have the bits of the processor's portable lanes, as far as the
    /// functions of the card's mathematical library have. It takes longer.
    #[must_use]
    pub fn exact(mut self) -> Self {
        self.exact = true;
        self
    }

    /// Whether it was asked for [`exact`](Self::exact) runs.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.exact
    }

    /// What the card calls itself.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The ends of simulations of one model, in their order, as [`ends`](dynamics_runtime::simulate::ends)
    /// has them. Runs with constraints, choices or events that act, stiff runs and those that fail are made
    /// by the processor. The simulations may differ in parameters, starts, ends and tolerances.
    ///
    /// # Errors
    /// The model cannot be written in C, the models differ in smooth functions, or the card fails. Runs that
    /// fail are no error of the whole.
    pub fn ends<'m, M: SimulationModel + PrintedInC + 'm>(
        &self,
        simulations: impl IntoIterator<Item = Simulation<'m, M>>,
    ) -> Result<DeviceEnds<M>, GpuError> {
        let simulations: Vec<Simulation<'m, M>> = simulations.into_iter().collect();
        let Some(first) = simulations.first() else {
            return Ok(DeviceEnds::by_processor(Vec::new()));
        };
        if !can_be_on_device::<M>() {
            return Ok(DeviceEnds::by_processor(ends(simulations)));
        }
        let model = first.model();
        if !M::FUNCTIONS.is_empty() {
            let pieces = model.pieces();
            if let Some(run) = simulations.iter().position(|other| other.model().pieces() != pieces) {
                return Err(GpuError::Functions { run });
            }
        }
        let kernel = self.kernel(model)?;
        let at_once = self.at_once::<M>()?;
        ends_on(&mut Launcher { stream: &self.stream, turn: &self.turn, kernel }, simulations, at_once)
    }

    /// How many runs the card has room for.
    fn at_once<M: SimulationModel>(&self) -> Result<usize, GpuError> {
        let numbers = M::PARAMETERS.len() + M::INPUTS.len() + 2 * (1 + 2 * M::COORDINATES.len());
        let bytes = 8 * (numbers + Batch::OPTIONS + Batch::CONTROL);
        Ok((self.context.mem_get_info()?.0 / MEMORY_PART / bytes).clamp(1, AT_ONCE))
    }

    /// The kernel of a model.
    fn kernel<M: SimulationModel + PrintedInC>(&self, model: &M) -> Result<CudaFunction, GpuError> {
        let text = kernel_in_cuda(model)?;
        // One thread compiles what the others wait for. What a panic leaves is whole: an entry or none.
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = kernels.get(&text) {
            return Ok(kernel.clone());
        }
        let compiled = compile::<M>(text.clone(), self.capability, self.exact)?;
        let load = |error| GpuError::Load { error };
        let module = self.context.load_module(compiled).map_err(load)?;
        let kernel = module.load_function(&name::<M>()).map_err(load)?;
        kernels.insert(text, kernel.clone());
        Ok(kernel)
    }
}

/// What steps a batch.
struct Launcher<'a> {
    stream: &'a Arc<CudaStream>,
    turn: &'a Mutex<()>,
    kernel: CudaFunction,
}

impl Device for Launcher<'_> {
    type Error = GpuError;

    fn advance(&mut self, batch: &mut Batch) -> Result<(), GpuError> {
        // What one thread has on the card at a time has room there, whatever the others prepare.
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let runs = batch.runs();
        let given: CudaSlice<f64> = self.stream.clone_htod(batch.given())?;
        let (places, found) = batch.moving();
        let mut moving: CudaSlice<f64> = self.stream.clone_htod(places)?;
        let mut outcomes: CudaSlice<i32> = self.stream.clone_htod(found)?;
        // All runs end or pause after some attempts.
        while found.contains(&Outcome::GOES_ON.0) {
            let arrays = (&given, &mut moving, &mut outcomes);
            launch::launch(self.stream, &self.kernel, arrays, (runs, ATTEMPTS))?;
            self.stream.memcpy_dtoh(&outcomes, found)?;
            self.stream.synchronize()?;
        }
        self.stream.memcpy_dtoh(&moving, places)?;
        self.stream.synchronize()?;
        Ok(())
    }
}
