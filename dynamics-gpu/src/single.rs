//! Cards of all makers, by the crate `wgpu`: in single precision, since the language of their kernels has no
//! doubles.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use dynamics_runtime::model::{ModelState as _, PrintedInWgsl, SimulationModel, Vector as _};
use dynamics_runtime::simulate::{
    Batch, Device, DeviceEnds, Outcome, RunNumbers, Simulation, can_be_on_device, ends, ends_on,
};

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
/// Attempts of a dispatch: few, because drivers of cards with a screen stop kernels that take seconds.
const ATTEMPTS: u32 = 32;
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
    /// How far runs of the card are from those in double precision; `None` where the card made none.
    pub measured_error: Option<MeasuredError>,
}

/// How far runs in single precision are from the same runs in double precision: of some runs, spread evenly
/// over those that the card made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredError {
    /// The largest difference of a coordinate or a rate, in its unit.
    pub absolute: f64,
    /// The largest difference of the coordinates as a part of the largest of them, and of the rates.
    pub relative: f64,
    /// How many runs were compared.
    pub runs: usize,
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
/// if let Some(error) = done.measured_error {
///     println!("on {}, to {:.1e} in {} runs that were repeated", gpu.name(), error.absolute, error.runs);
/// }
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct SingleGpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
    /// Kernels that are compiled, by their texts.
    pipelines: Mutex<HashMap<String, wgpu::ComputePipeline>>,
    /// Held by the thread whose runs are on the card.
    turn: Mutex<()>,
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
        let name = adapter.get_info().name;
        Ok(Self { device, queue, name, pipelines: Mutex::default(), turn: Mutex::default() })
    }

    /// What the card calls itself.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The ends of simulations of one model, in their order, as [`ends`] has them, in single precision. Runs
    /// with constraints, choices or events that act, stiff runs and those that fail are made by the
    /// processor, in double precision. The simulations may differ in parameters, starts, ends and tolerances.
    ///
    /// Some of the runs are made again in double precision, so that the error is known
    /// ([`SingleEnds::measured_error`]).
    ///
    /// # Errors
    /// The model cannot be written in WGSL, a tolerance is below 1e-5, or the card fails. Runs that fail are
    /// no error of the whole.
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
            if (0.0..FINEST_TOLERANCE).contains(&tolerance) {
                return Err(SingleGpuError::Tolerance { run, tolerance });
            }
        }
        let text = kernel_in_wgsl::<M>().map_err(|error| SingleGpuError::Model(Arc::new(error)))?;
        let mut launcher = SingleLauncher { gpu: self, pipeline: self.pipeline(text)? };
        let done = ends_on(&mut launcher, simulations.clone(), self.at_once::<M>())?;
        let measured_error = measured_error(simulations, &done);
        Ok(SingleEnds { on_device: done.on_device(), ends: done.ends, measured_error })
    }

    /// How many runs the buffers of the card have room for.
    fn at_once<M: SimulationModel>(&self) -> usize {
        let limit = self.device.limits().max_storage_buffer_binding_size;
        let given = M::PARAMETERS.len() + M::INPUTS.len() + Batch::OPTIONS;
        let moving = 2 * (1 + 2 * M::COORDINATES.len()) + Batch::CONTROL;
        let room = limit / (4 * given.max(moving) as u64);
        usize::try_from(room).unwrap_or(AT_ONCE).clamp(1, AT_ONCE)
    }

    /// The compiled kernel of a text.
    fn pipeline(&self, text: String) -> Result<wgpu::ComputePipeline, SingleGpuError> {
        // One thread compiles what the others wait for. What a panic leaves is whole: an entry or none.
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&text) {
            return Ok(pipeline.clone());
        }
        let pipeline = self.checked(|| {
            let source = wgpu::ShaderSource::Wgsl(text.as_str().into());
            let module =
                self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: None,
                module: &module,
                entry_point: Some("advance"),
                compilation_options: Default::default(),
                cache: None,
            })
        })?;
        pipelines.insert(text, pipeline.clone());
        Ok(pipeline)
    }

    /// What is asked of the driver, or the error that it reports meanwhile.
    fn checked<T>(&self, asked: impl FnOnce() -> T) -> Result<T, SingleGpuError> {
        let filters =
            [wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::Validation];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let result = asked();
        // The innermost scope first.
        let errors = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        let errors: Vec<wgpu::Error> = errors.flatten().collect();
        match errors.first() {
            Some(error) => Err(driver(error)),
            None => Ok(result),
        }
    }
}

/// How far some of the runs that the card made are from those in double precision.
fn measured_error<'m, M: SimulationModel + 'm>(
    simulations: impl Iterator<Item = Simulation<'m, M>>,
    done: &DeviceEnds<M>,
) -> Option<MeasuredError> {
    let made = simulations.zip(&done.ends).zip(&done.by_device).filter(|(_, by_device)| **by_device);
    let every = done.on_device().div_ceil(MEASURED).max(1);
    let mut found: Option<MeasuredError> = None;
    for ((simulation, end), _) in made.step_by(every) {
        let (Ok(end), Ok(exact)) = (end, simulation.tolerance(MEASURED_TOLERANCE).run_with(|_| ())) else {
            continue;
        };
        let all = found.get_or_insert_default();
        for (a, b) in [(end.q(), exact.q()), (end.u(), exact.u())] {
            // Ends are finite.
            let off = a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| (a - b).abs());
            let off = off.fold(0.0, f64::max);
            let size = b.as_slice().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            all.absolute = all.absolute.max(off);
            all.relative = all.relative.max(if off == 0.0 { 0.0 } else { off / size });
        }
        all.runs += 1;
    }
    found
}

/// Whether single precision holds a number: not where it is 0 or infinite there alone, or where cards may
/// take it for 0.
fn is_held(x: f64) -> bool {
    let single = (x as f32).abs();
    x == 0.0 || single.is_normal() && single.is_finite()
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

    /// All numbers, and times between which single precision has enough digits.
    fn holds(&self, run: &RunNumbers<'_>) -> bool {
        let [start, end] = run.times;
        let last_place = f64::from(f32::EPSILON) * start.abs().max(end.abs());
        last_place <= run.relative_tolerance * (end - start).abs() && run.values.iter().all(|x| is_held(*x))
    }

    fn advance(&mut self, batch: &mut Batch) -> Result<(), SingleGpuError> {
        // What one thread has on the card at a time has room there, whatever the others prepare.
        let _turn = self.gpu.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let memory = self.gpu.checked(|| self.memory(batch))?;
        loop {
            self.gpu.checked(|| self.dispatch(&memory, batch.runs()))?;
            let outcomes = self.gpu.read(&memory.outcomes)?;
            let (_, found) = batch.moving();
            let read = outcomes.chunks_exact(4).map(|x| i32::from_le_bytes([x[0], x[1], x[2], x[3]]));
            found.iter_mut().zip(read).for_each(|(to, outcome)| *to = outcome);
            // All runs end or pause after some attempts.
            if !found.contains(&Outcome::GOES_ON.0) {
                break;
            }
        }
        let numbers = self.gpu.read(&memory.moving)?;
        let numbers = numbers.chunks_exact(4).map(|x| f32::from_le_bytes([x[0], x[1], x[2], x[3]]));
        for (to, number) in batch.moving().0.iter_mut().zip(numbers) {
            // What did not change keeps its digits.
            if *to as f32 != number {
                *to = f64::from(number);
            }
        }
        Ok(())
    }
}

/// What a batch has on the card.
struct CardMemory {
    moving: wgpu::Buffer,
    outcomes: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl SingleLauncher<'_> {
    /// A batch, on the card.
    fn memory(&self, batch: &mut Batch) -> CardMemory {
        use wgpu::BufferUsages as Usage;
        let SingleGpu { device, queue, .. } = self.gpu;
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
        // No more than `AT_ONCE`.
        let sizes = [batch.runs() as u32, ATTEMPTS, 0, 0].map(u32::to_le_bytes).concat();
        let given = filled(&bytes(batch.given()), Usage::STORAGE);
        let (places, found) = batch.moving();
        let moving = filled(&bytes(places), Usage::STORAGE | Usage::COPY_SRC);
        let found: Vec<u8> = found.iter().flat_map(|outcome| outcome.to_le_bytes()).collect();
        let outcomes = filled(&found, Usage::STORAGE | Usage::COPY_SRC);
        let sizes = filled(&sizes, Usage::UNIFORM);
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip([&given, &moving, &outcomes, &sizes])
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        CardMemory { moving, outcomes, group }
    }

    /// Some attempts of all runs.
    fn dispatch(&self, memory: &CardMemory, runs: usize) {
        let SingleGpu { device, queue, .. } = self.gpu;
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &memory.group, &[]);
        let groups = runs.div_ceil(THREADS);
        let (row, rows) = (groups.min(GROUPS_IN_A_ROW), groups.div_ceil(GROUPS_IN_A_ROW));
        pass.dispatch_workgroups(row as u32, rows as u32, 1);
        drop(pass);
        queue.submit([encoder.finish()]);
    }
}

impl SingleGpu {
    /// What a buffer holds.
    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, SingleGpuError> {
        use wgpu::BufferUsages as Usage;
        let Self { device, queue, .. } = self;
        let copy = self.checked(|| {
            let copy = device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: buffer.size(),
                usage: Usage::MAP_READ | Usage::COPY_DST,
                mapped_at_creation: false,
            });
            let mut encoder = device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
            queue.submit([encoder.finish()]);
            copy
        })?;
        let (sender, receiver) = std::sync::mpsc::channel();
        copy.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits for it.
            let _ = sender.send(result);
        });
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(driver)?;
        receiver.recv().map_err(driver)?.map_err(driver)?;
        let bytes = copy.slice(..).get_mapped_range().map_err(driver)?.to_vec();
        copy.unmap();
        Ok(bytes)
    }
}
