//! Times of candidates, in turn.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// How long a batch of calls takes at least, unless one call takes longer.
const BATCH: Duration = Duration::from_micros(40);
/// How long all candidates of a table row are measured.
const ROW: Duration = Duration::from_millis(1500);
/// Fewest batches of a candidate.
const LEAST_BATCHES: usize = 7;

/// What is measured: calls of one function with its own data.
pub struct Candidate<'a> {
    pub name: String,
    pub call: Box<dyn FnMut() + 'a>,
}

/// Seconds of one call of each candidate: the shortest of many batches, which take turns.
pub fn times(candidates: &mut [Candidate<'_>]) -> Vec<f64> {
    let mut batches: Vec<usize> = Vec::new();
    for candidate in candidates.iter_mut() {
        (candidate.call)();
        let begin = Instant::now();
        (candidate.call)();
        let one = begin.elapsed().max(Duration::from_nanos(20));
        batches.push((BATCH.as_nanos() / one.as_nanos()).max(1) as usize);
    }
    let mut best = vec![f64::INFINITY; candidates.len()];
    let (begin, mut rounds) = (Instant::now(), 0);
    while begin.elapsed() < ROW || rounds < LEAST_BATCHES {
        for ((candidate, calls), best) in candidates.iter_mut().zip(&batches).zip(&mut best) {
            let begin = Instant::now();
            for _ in 0..*calls {
                (black_box(&mut candidate.call))();
            }
            *best = best.min(begin.elapsed().as_secs_f64() / *calls as f64);
        }
        rounds += 1;
    }
    best
}
