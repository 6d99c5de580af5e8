//! Graphics cards. A card makes many blocks at once, since it has many threads; the cores prepare the runs.

use std::sync::{Mutex, MutexGuard, PoisonError};

use dynamics_analysis::shared::shared;
use dynamics_runtime::simulate::{Simulate, Simulation};

use super::{Cores, Ends, EndsElsewhere, Job, Made, Opened, Place, PlaceFor};
use crate::error::EnsembleError;

/// Runs that the card makes at once, or a few more: enough for all of its threads.
const RUNS_AT_ONCE: usize = 1 << 15;

/// A card, or the cores where there is none.
struct Card {
    name: String,
    /// Where there is no card.
    cores: Option<Cores>,
}

impl Card {
    /// The cores, because there is no card.
    fn missing(why: &dyn std::fmt::Display) -> Self {
        let cores = Cores::default();
        Self { name: format!("{}: {why}", cores.name()), cores: Some(cores) }
    }
}

impl Place for Card {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn is_divided(&self) -> bool {
        false
    }

    fn is_main(&self) -> bool {
        true
    }

    fn of_main(&self, value: u64) -> u64 {
        value
    }

    fn first_failed(&self, is_failed: bool) -> Option<usize> {
        is_failed.then_some(0)
    }

    fn make(&self, job: &Job<'_>) -> Result<Made, EnsembleError> {
        if let Some(cores) = &self.cores {
            return cores.make(job);
        }
        let missing = job.missing()?;
        let bar = job.bar(missing.runs, true);
        let most = RUNS_AT_ONCE.div_ceil(job.partition.block);
        // Blocks that follow each other, in groups.
        let mut groups: Vec<std::ops::Range<usize>> = Vec::new();
        for block in missing.blocks {
            match groups.last_mut().filter(|group| group.end == block && group.len() < most) {
                Some(group) => group.end += 1,
                None => groups.push(block..block + 1),
            }
        }
        let group = |k: usize| job.make_together(groups[k].clone(), &bar);
        let made = shared(groups.len(), None, group).map_err(EnsembleError::Threads)?;
        let in_memory = made.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        Ok(Made { in_memory, made: missing.runs, damaged: missing.damaged })
    }
}

/// How many runs a card has made.
#[derive(Default)]
struct Counts {
    on_card: usize,
    all: usize,
    /// Measured errors, in single precision.
    #[cfg(feature = "wgpu")]
    error: Option<dynamics_gpu::MeasuredError>,
}

impl Counts {
    /// How many runs the processor made, if any.
    fn text(&self) -> String {
        match self.all - self.on_card {
            0 => String::new(),
            rest => format!("; {rest} of {} by the processor", self.all),
        }
    }
}

/// What a panic leaves is whole: counts of one call more or less.
fn locked(counts: &Mutex<Counts>) -> MutexGuard<'_, Counts> {
    counts.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(feature = "cuda")]
mod double {
    use dynamics_gpu::{Gpu, GpuError};
    use dynamics_runtime::model::PrintedInC;

    use super::*;

    struct OnCard {
        gpu: Gpu,
        counts: Mutex<Counts>,
    }

    impl<M: Simulate + PrintedInC> EndsElsewhere<M> for OnCard {
        fn ends<'a>(
            &self,
            count: usize,
            run: &dyn Fn(usize) -> Simulation<'a, M>,
        ) -> Result<Ends<M>, EnsembleError>
        where
            M: 'a,
        {
            let done = self.gpu.ends((0..count).map(run));
            let done = done.map_err(|error| EnsembleError::Place {
                place: self.gpu.name().to_owned(),
                message: error.to_string(),
            })?;
            let mut counts = locked(&self.counts);
            counts.on_card += done.on_device();
            counts.all += count;
            Ok(done.ends)
        }

        fn way(&self) -> String {
            match self.gpu.is_exact() {
                true => "ends, on a card without fused products".into(),
                false => "ends, on a card with fused products".into(),
            }
        }

        fn remark(&self) -> String {
            locked(&self.counts).text()
        }
    }

    impl<M: Simulate + PrintedInC> PlaceFor<M> for Gpu {
        fn opened<'p>(self) -> Opened<'p, M>
        where
            Self: 'p,
        {
            let place = Card { name: self.name().to_owned(), cores: None };
            let elsewhere = OnCard { gpu: self, counts: Mutex::default() };
            Opened { place: Box::new(place), elsewhere: Some(Box::new(elsewhere)) }
        }
    }

    impl<M: Simulate + PrintedInC> PlaceFor<M> for Result<Gpu, GpuError> {
        fn opened<'p>(self) -> Opened<'p, M>
        where
            Self: 'p,
        {
            match self {
                Ok(gpu) => gpu.opened(),
                Err(why) => Opened { place: Box::new(Card::missing(&why)), elsewhere: None },
            }
        }
    }
}

#[cfg(feature = "wgpu")]
mod single {
    use dynamics_gpu::{MeasuredError, SingleGpu, SingleGpuError};
    use dynamics_runtime::model::PrintedInWgsl;

    use super::*;

    struct OnSingleCard {
        gpu: SingleGpu,
        counts: Mutex<Counts>,
    }

    impl<M: Simulate + PrintedInWgsl> EndsElsewhere<M> for OnSingleCard {
        fn ends<'a>(
            &self,
            count: usize,
            run: &dyn Fn(usize) -> Simulation<'a, M>,
        ) -> Result<Ends<M>, EnsembleError>
        where
            M: 'a,
        {
            let done = self.gpu.ends((0..count).map(run));
            let done = done.map_err(|error| EnsembleError::Place {
                place: self.gpu.name().to_owned(),
                message: error.to_string(),
            })?;
            let mut counts = locked(&self.counts);
            counts.on_card += done.on_device;
            counts.all += count;
            if let Some(error) = done.measured_error {
                let all = counts.error.get_or_insert_default();
                all.absolute = all.absolute.max(error.absolute);
                all.relative = all.relative.max(error.relative);
                all.runs += error.runs;
            }
            Ok(done.ends)
        }

        // Drivers differ in their functions.
        fn way(&self) -> String {
            format!("ends, in single precision on {}", self.gpu.name())
        }

        fn remark(&self) -> String {
            let counts = locked(&self.counts);
            let measured = match counts.error {
                Some(MeasuredError { absolute, relative, runs }) => format!(
                    ", to {absolute:.1e} ({relative:.1e} of the largest) in {runs} runs that were repeated"
                ),
                None => String::new(),
            };
            format!("; in single precision{measured}{}", counts.text())
        }
    }

    impl<M: Simulate + PrintedInWgsl> PlaceFor<M> for SingleGpu {
        fn opened<'p>(self) -> Opened<'p, M>
        where
            Self: 'p,
        {
            let place = Card { name: self.name().to_owned(), cores: None };
            let elsewhere = OnSingleCard { gpu: self, counts: Mutex::default() };
            Opened { place: Box::new(place), elsewhere: Some(Box::new(elsewhere)) }
        }
    }

    impl<M: Simulate + PrintedInWgsl> PlaceFor<M> for Result<SingleGpu, SingleGpuError> {
        fn opened<'p>(self) -> Opened<'p, M>
        where
            Self: 'p,
        {
            match self {
                Ok(gpu) => gpu.opened(),
                Err(why) => Opened { place: Box::new(Card::missing(&why)), elsewhere: None },
            }
        }
    }
}
