//! Cards of all makers, by the crate `wgpu`: in single precision, since the language of their kernels has no
//! doubles.

use std::sync::Arc;

use dynamics_runtime::model::{ModelState as _, PrintedInWgsl, SimulationModel, Vector as _};
use dynamics_runtime::simulate::{Batch, Device, DeviceEnds, Simulation, can_be_on_device, ends, ends_on};

use crate::kernel::{KernelError, kernel_in_wgsl};

/// Smallest relative tolerance of a run in single precision: below it rounding decides about the steps.
const FINEST_TOLERANCE: f64 = 1e-5;
/// Most runs that are repeated in double precision to measure the error.
const MEASURED: usize = 16;
/// Tolerance of these.
const MEASURED_TOLERANCE: f64 = 1e-9;
/// Threads of a workgroup, as in `side_by_side.wgsl`.
const THREADS: usize = 64;
/// Most workgroups in a row of a dispatch; WebGPU permits 65,535.
const GROUPS_IN_A_ROW: usize = 32_768;
/// Most runs that are on the card at the same time, where its buffers have room for them.
const AT_ONCE: usize = 1 << 18;

/// Why runs cannot be made on a card in single precision.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SingleGpuError {
    /// There is no card, or no driver of one.
    #[error("no graphics card is found here: {reason}; the runs can be made by the processor")]
    NoCard {
        /// What the driver says.
        reason: String,
    },
    /// The model has no kernel.
    #[error(transparent)]
    Model(Arc<KernelError>),
    /// A tolerance that single precision does not have.
    #[error(
        "run {run} has the tolerance {tolerance:e}; cards compute in single precision here, for tolerances \
         from 1e-5 on: ask for it with `.tolerance(1e-5)`, or take the processor or the feature `cuda`"
    )]
    Tolerance {
        /// Its number, from 0 on.
        run: usize,
        /// The tolerance.
        tolerance: f64,
    },
    /// The driver fails.
    #[error("the driver of the card fails: {reason}")]
    Driver {
        /// What it says.
        reason: String,
    },
}

fn driver(error: impl std::fmt::Display) -> SingleGpuError {
    SingleGpuError::Driver { reason: error.to_string() }
}

/// The ends of many simulations in single precision.
#[derive(Debug)]
pub struct SingleEnds<M: SimulationModel> {
    /// The ends in the order of the simulations.
    pub ends: Vec<Result<M::State, dynamics_runtime::simulate::SimulationError<M>>>,
    /// How many of them the card has made to their end; the processor made the others, in double precision.
    pub on_device: usize,
    /// The largest difference of a coordinate or rate from the same run in double precision, over runs spread
    /// evenly over all of them, with their number; `None` where none of these succeeds.
    pub measured_error: Option<(f64, usize)>,
}

/// A card that makes runs in single precision.
///
/// ```no_run
/// # mod dynamics { pub use dynamics_gpu as gpu; pub use dynamics_runtime::*; }
/// # fn f<M: dynamics_runtime::model::SimulationModel + dynamics_runtime::model::PrintedInWgsl>(
/// #     model: &M, starts: &[M::State]) -> Result<(), dynamics_gpu::SingleGpuError> {
/// use dynamics::gpu::SingleGpu;
/// use dynamics::simulate::Simulate;
///
/// let gpu = SingleGpu::first()?;
/// let done = gpu.ends(starts.iter().map(|start| model.simulate(*start).until(10.0).tolerance(1e-5)))?;
/// if let Some((error, runs)) = done.measured_error {
///     println!("on {}, to {error:.1e} in {runs} runs that were repeated", gpu.name());
/// }
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct SingleGpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
}

impl SingleGpu {
    /// The card that the system prefers. It may be a software driver.
    ///
    /// # Errors
    /// There is none.
    pub fn first() -> Result<Self, SingleGpuError> {
        let instance = wgpu::Instance::default();
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let no_card = |reason: String| SingleGpuError::NoCard { reason };
        let adapter =
            pollster::block_on(instance.request_adapter(&options)).map_err(|e| no_card(e.to_string()))?;
        let asked = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&asked)).map_err(|e| no_card(e.to_string()))?;
        Ok(Self { device, queue, name: adapter.get_info().name })
    }

    /// What the card calls itself.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The ends of simulations of one model, in their order, as [`ends`] has them, in single precision. Runs
    /// with constraints, choices or events that act, stiff runs and those that fail are made by the processor,
    /// in double precision. The simulations may differ in parameters, starts, ends and tolerances.
    ///
    /// Some of the runs are made again in double precision, so that the error is known
    /// ([`SingleEnds::measured_error`]).
    ///
    /// # Errors
    /// The model cannot be written in WGSL, a tolerance is below 1e-5, or the card fails. Runs that fail are no
    /// error of the whole.
    pub fn ends<'m, M, I>(&self, simulations: I) -> Result<SingleEnds<M>, SingleGpuError>
    where
        M: SimulationModel + PrintedInWgsl + 'm,
        I: IntoIterator<Item = Simulation<'m, M>>,
        I::IntoIter: Clone,
    {
        let simulations = simulations.into_iter();
        if !can_be_on_device::<M>() {
            return Ok(SingleEnds { ends: ends(simulations), on_device: 0, measured_error: None });
        }
        for (run, simulation) in simulations.clone().enumerate() {
            let tolerance = simulation.relative_tolerance();
            if tolerance < FINEST_TOLERANCE {
                return Err(SingleGpuError::Tolerance { run, tolerance });
            }
        }
        let text = kernel_in_wgsl::<M>().map_err(|error| SingleGpuError::Model(Arc::new(error)))?;
        let mut launcher = self.launcher(&text);
        let at_once = self.at_once::<M>();
        let DeviceEnds { ends, on_device } = ends_on(&mut launcher, simulations.clone(), at_once)?;
        let measured_error = measured_error(simulations, &ends);
        Ok(SingleEnds { ends, on_device, measured_error })
    }

    /// How many runs the buffers of the card have room for.
    fn at_once<M: SimulationModel>(&self) -> usize {
        let limit = self.device.limits().max_storage_buffer_binding_size;
        let given = M::PARAMETERS.len() + M::INPUTS.len() + Batch::OPTIONS;
        let moving = 2 * (1 + 2 * M::COORDINATES.len()) + Batch::CONTROL;
        let room = limit / (4 * given.max(moving) as u64);
        usize::try_from(room).unwrap_or(AT_ONCE).clamp(1, AT_ONCE)
    }

    fn launcher(&self, text: &str) -> SingleLauncher<'_> {
        let source = wgpu::ShaderSource::Wgsl(text.into());
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("advance"),
            compilation_options: Default::default(),
            cache: None,
        });
        SingleLauncher { gpu: self, pipeline }
    }
}

/// The largest difference from some of the runs in double precision, and how many these are.
fn measured_error<'m, M: SimulationModel + 'm>(
    simulations: impl Iterator<Item = Simulation<'m, M>>,
    ends: &[Result<M::State, dynamics_runtime::simulate::SimulationError<M>>],
) -> Option<(f64, usize)> {
    let every = ends.len().div_ceil(MEASURED).max(1);
    let mut found: Option<(f64, usize)> = None;
    for (simulation, end) in simulations.zip(ends).step_by(every) {
        let (Ok(end), Ok(exact)) = (end, simulation.tolerance(MEASURED_TOLERANCE).run_with(|_| ())) else {
            continue;
        };
        let pairs = [(end.q(), exact.q()), (end.u(), exact.u())];
        let differences =
            pairs.iter().flat_map(|(a, b)| a.as_slice().iter().zip(b.as_slice())).map(|(a, b)| (a - b).abs());
        let (largest, runs) = found.unwrap_or_default();
        found = Some((differences.fold(largest, f64::max), runs + 1));
    }
    found
}

/// What steps a batch.
struct SingleLauncher<'a> {
    gpu: &'a SingleGpu,
    pipeline: wgpu::ComputePipeline,
}

/// Numbers in single precision as bytes.
fn bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect()
}

impl Device for SingleLauncher<'_> {
    type Error = SingleGpuError;

    fn advance(&mut self, batch: &mut Batch) -> Result<(), SingleGpuError> {
        use wgpu::BufferUsages as Usage;
        let SingleGpu { device, queue, .. } = self.gpu;
        let runs = batch.runs();
        let filled = |contents: &[u8], usage: Usage| {
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: contents.len().max(16) as u64,
                usage: usage | Usage::COPY_DST,
                mapped_at_creation: false,
            });
            queue.write_buffer(&buffer, 0, contents);
            buffer
        };
        let given = filled(&bytes(&batch.given), Usage::STORAGE);
        let moving = filled(&bytes(&batch.moving), Usage::STORAGE | Usage::COPY_SRC);
        let outcomes: Vec<u8> = batch.outcomes.iter().flat_map(|outcome| outcome.to_le_bytes()).collect();
        let outcomes = filled(&outcomes, Usage::STORAGE | Usage::COPY_SRC);
        let count = u32::try_from(runs).map_err(driver)?;
        let sizes: Vec<u8> = [count, 0, 0, 0].iter().flat_map(|size| size.to_le_bytes()).collect();
        let sizes = filled(&sizes, Usage::UNIFORM);
        let buffers = [&given, &moving, &outcomes, &sizes];
        let entries = (0..).zip(buffers);
        let entries: Vec<wgpu::BindGroupEntry<'_>> = entries
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            let groups = runs.div_ceil(THREADS);
            let (row, rows) = (groups.min(GROUPS_IN_A_ROW), groups.div_ceil(GROUPS_IN_A_ROW));
            pass.dispatch_workgroups(row as u32, rows as u32, 1);
        }
        let read = [&moving, &outcomes].map(|buffer| {
            let copy = device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: buffer.size(),
                usage: Usage::MAP_READ | Usage::COPY_DST,
                mapped_at_creation: false,
            });
            encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
            copy
        });
        queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        for buffer in &read {
            let sender = sender.clone();
            buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
                // The receiver waits for both.
                let _ = sender.send(result);
            });
        }
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(driver)?;
        for _ in &read {
            receiver.recv().map_err(driver)?.map_err(driver)?;
        }
        let [moving, outcomes] = read.each_ref().map(|buffer| buffer.slice(..).get_mapped_range());
        let (moving, outcomes) = (moving.map_err(driver)?, outcomes.map_err(driver)?);
        let numbers = moving.chunks_exact(4).map(|x| f32::from_le_bytes([x[0], x[1], x[2], x[3]]));
        for (to, number) in batch.moving.iter_mut().zip(numbers) {
            // What did not change keeps its digits.
            if *to as f32 != number {
                *to = f64::from(number);
            }
        }
        let found = outcomes.chunks_exact(4).map(|x| i32::from_le_bytes([x[0], x[1], x[2], x[3]]));
        batch.outcomes.iter_mut().zip(found).for_each(|(to, outcome)| *to = outcome);
        Ok(())
    }
}
