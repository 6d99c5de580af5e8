//! What a run keeps: frames at the times that were asked for.

use core::time::Duration;
use std::sync::Arc;

use crate::constraints::ConstraintSummary;
use crate::equations::Equations;
use crate::failure::FamilyErrorKind;
use crate::file::FrameFile;
use crate::integrate::Point;
use crate::mass::Mass;
use crate::methods::FamilyMethod;
use crate::model::{EnergyParts, FamilyModel, FamilyState, Length, Sizes, View};

/// When states are kept. The start and the end always are.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Every {
    /// At this interval of time from the start on. Adaptive steps end there. Fixed steps do not change:
    /// states between their ends are those of the quintic through q, q̇ and q̈ at both ends.
    Time(f64),
    /// After so many accepted steps.
    Steps(u64),
    /// So many, at equal intervals of time, start and end included.
    Frames(usize),
    /// None beside start and end.
    Last,
}

impl Every {
    /// [`Every::Time`].
    #[must_use]
    pub const fn time(interval: f64) -> Self {
        Self::Time(interval)
    }

    /// [`Every::Steps`].
    #[must_use]
    pub const fn steps(steps: u64) -> Self {
        Self::Steps(steps)
    }

    /// [`Every::Frames`].
    #[must_use]
    pub const fn frames(frames: usize) -> Self {
        Self::Frames(frames)
    }
}

impl Default for Every {
    /// 300 frames: enough for an animation and for a picture of a motion. A simulation keeps fewer where
    /// nothing was asked for and they would take more than 256 MiB.
    fn default() -> Self {
        Self::Frames(300)
    }
}

/// Most bytes of states that are kept where nothing was asked for.
const MOST_BYTES: usize = 1 << 28;

impl Every {
    /// What is kept in memory where nothing was asked for: the default, and less where that would take more
    /// than a quarter of a gigabyte.
    pub(crate) fn for_memory(coordinates: usize) -> Self {
        Self::Frames((MOST_BYTES / (16 * coordinates.max(1))).clamp(2, 300))
    }
}

/// A recorded instant.
#[derive(Debug)]
pub(crate) struct RecordedFrame<S> {
    pub(crate) t: f64,
    /// The number of the step that ends here; none between steps.
    pub(crate) step: Option<u64>,
    /// None where states went to a file.
    pub(crate) state: Option<S>,
    pub(crate) energies: EnergyParts,
    /// Scalar outputs in the order of their declaration.
    pub(crate) outputs: Vec<f64>,
    /// Ordinary coordinates, then their velocities.
    pub(crate) ordinary: Vec<f64>,
    /// Σ (uᵢ − uᵢ₊₁)²/(4 Σ uᵢ²) of each field, and Σ uᵢ².
    pub(crate) short_waves: Vec<(f64, f64)>,
}

/// What the energy did at the ends of steps. States between them are interpolated, and their energy is that
/// of the interpolant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EnergyHistory {
    pub(crate) first: Option<EnergyParts>,
    /// Largest |E − E₀|.
    pub(crate) change: f64,
    /// Largest of |T|, |V| and |E|.
    pub(crate) scale: f64,
}

impl EnergyHistory {
    pub(crate) fn see(&mut self, energies: EnergyParts) {
        let EnergyParts { kinetic, potential } = energies;
        let first = *self.first.get_or_insert(energies);
        // Part by part: kinetic and potential energy change into each other, and the sum is rounded once.
        let change = (kinetic - first.kinetic) + (potential - first.potential);
        self.change = self.change.max(change.abs());
        self.scale = self.scale.max(kinetic.abs()).max(potential.abs()).max(energies.total().abs());
    }
}

/// What a run leaves.
pub(crate) struct Record<M: FamilyModel> {
    pub(crate) frames: Vec<RecordedFrame<M::State>>,
    pub(crate) start: M::State,
    pub(crate) end: M::State,
    pub(crate) mass: Arc<Mass>,
    pub(crate) constraints: Option<ConstraintSummary>,
    pub(crate) method: FamilyMethod,
    pub(crate) reason: String,
    pub(crate) energy: EnergyHistory,
    pub(crate) fixed: Option<f64>,
    /// Shortest and longest accepted step.
    pub(crate) step_sizes: Option<[f64; 2]>,
    pub(crate) steps: u64,
    pub(crate) rejected: u64,
    pub(crate) evaluations: u64,
    pub(crate) wall_time: Duration,
    pub(crate) bytes: usize,
    /// The longest step of leapfrog at the start.
    pub(crate) longest: Option<f64>,
}

/// Fields that have one coordinate.
pub(crate) fn ordinary<M: FamilyModel>(
    ends: &Sizes,
) -> impl Iterator<Item = (usize, &'static str, &'static str)> {
    M::FIELDS
        .iter()
        .zip(ends.iter())
        .filter(|(field, _)| field.length == Length::One)
        .map(|(field, &end)| (end - 1, field.name, field.unit))
}

/// Makes frames while a run goes on.
pub(crate) struct Recorder<M: FamilyModel> {
    every: Every,
    start: f64,
    /// Signed time from start to end.
    span: f64,
    /// The number of the next frame by time.
    next: u64,
    template: M::State,
    accelerations: Vec<f64>,
    scalar_outputs: Vec<usize>,
    keeps_states: bool,
    file: Option<FrameFile>,
    pub(crate) frames: Vec<RecordedFrame<M::State>>,
    pub(crate) energy: EnergyHistory,
}

impl<M: FamilyModel> Recorder<M> {
    pub(crate) fn new(every: Every, template: &M::State, end: f64, file: Option<FrameFile>) -> Self {
        let scalar = M::OUTPUTS.iter().enumerate().filter(|(_, output)| !output.numbered);
        let scalar_outputs: Vec<usize> = scalar.map(|(index, _)| index).collect();
        let memory = if scalar_outputs.is_empty() { 0 } else { template.q().len() };
        Self {
            every,
            start: template.t(),
            span: end - template.t(),
            next: 0,
            template: template.clone(),
            accelerations: vec![0.0; memory],
            scalar_outputs,
            keeps_states: file.is_none(),
            file,
            frames: Vec::new(),
            energy: EnergyHistory::default(),
        }
    }

    /// The time of the next frame that goes by time; none where there is no further one before the end.
    pub(crate) fn next_time(&self) -> Option<f64> {
        let k = self.next as f64;
        let time = match self.every {
            Every::Time(interval) => self.start + (k * interval).copysign(self.span),
            Every::Frames(frames) => self.start + self.span * (k / (frames - 1) as f64),
            Every::Steps(_) | Every::Last => return None,
        };
        // The end is a frame of its own.
        let left = (self.start + self.span - time) * self.span.signum();
        (left > 1e-9 * self.interval()).then_some(time)
    }

    fn interval(&self) -> f64 {
        match self.every {
            Every::Time(interval) => interval,
            Every::Frames(frames) => self.span.abs() / (frames - 1) as f64,
            Every::Steps(_) | Every::Last => self.span.abs(),
        }
    }

    /// Whether the end of this step is a frame by its number.
    pub(crate) fn wants_step(&self, step: u64) -> bool {
        matches!(self.every, Every::Steps(every) if step.is_multiple_of(every))
    }

    /// Records a frame.
    pub(crate) fn push(
        &mut self,
        equations: &mut Equations<'_, '_, M>,
        y: &Point,
        step: Option<u64>,
        by_time: bool,
    ) -> Result<(), FamilyErrorKind> {
        self.next += u64::from(by_time);
        equations.set_inputs(y.t, &y.q, &y.u)?;
        let (t, q, u, inputs) = self.template.parts_mut();
        *t = y.t;
        q.copy_from_slice(&y.q);
        u.copy_from_slice(&y.u);
        inputs.copy_from_slice(&equations.inputs);
        let energies = equations.model.energies(View { t: y.t, q, u, inputs });
        if step.is_some() {
            self.energy.see(energies);
        }
        let mut outputs = Vec::new();
        if !self.scalar_outputs.is_empty() {
            equations.accelerations(y.t, &y.q, &y.u, &mut self.accelerations)?;
            let multipliers = equations.multipliers();
            let coordinates = M::coordinates(&self.template, &self.accelerations, multipliers);
            let value = |&index: &usize| {
                equations.model.output(index, &coordinates).first().copied().unwrap_or(f64::NAN)
            };
            outputs = self.scalar_outputs.iter().map(value).collect();
        }
        if let Some(file) = &mut self.file {
            file.push(y.t, &y.q, &y.u, energies)
                .map_err(|error| FamilyErrorKind::File { message: error.to_string() })?;
        }
        let places = || ordinary::<M>(self.template.ends()).map(|(place, ..)| place);
        let ordinary = places().map(|k| y.q[k]).chain(places().map(|k| y.u[k])).collect();
        self.frames.push(RecordedFrame {
            t: y.t,
            step,
            state: self.keeps_states.then(|| self.template.clone()),
            energies,
            outputs,
            ordinary,
            short_waves: short_waves(self.template.ends(), &y.u),
        });
        Ok(())
    }

    /// The state of the last frame.
    pub(crate) fn last(&self) -> &M::State {
        &self.template
    }

    /// Writes all frames to their file.
    pub(crate) fn flush(&mut self) -> Result<(), FamilyErrorKind> {
        let Some(file) = &mut self.file else { return Ok(()) };
        file.flush().map_err(|error| FamilyErrorKind::File { message: error.to_string() })
    }
}

/// Σ (uᵢ − uᵢ₊₁)²/(4 Σ uᵢ²) of each field: sin²(θ/2) for a wave of phase θ per node, 0 for long waves, 1 for
/// neighbours that move against each other. Of a grid the larger of that along its rows and along its columns.
/// With it Σ uᵢ²: of a field at rest the share is that of rounding.
fn short_waves(sizes: &Sizes, u: &[f64]) -> Vec<(f64, f64)> {
    let of_field = |field: usize| {
        let (u, columns) = (&u[sizes.range(field)], sizes.columns(field));
        if u.len() < 3 {
            return (0.0, 0.0);
        }
        let all = crate::generated::sum(0..u.len(), |i| u[i] * u[i]);
        // Neighbours are `apart` places apart; the last of a row has none in it.
        let share = |apart: usize| {
            let differences = crate::generated::sum(0..u.len().saturating_sub(apart), |i| {
                let is_last = columns > 1 && apart == 1 && (i + 1) % columns == 0;
                let difference = if is_last { 0.0 } else { u[i] - u[i + apart] };
                difference * difference
            });
            if all > 0.0 { differences / (4.0 * all) } else { 0.0 }
        };
        (share(1).max(if columns > 1 { share(columns) } else { 0.0 }), all)
    };
    (0..sizes.len()).map(of_field).collect()
}
