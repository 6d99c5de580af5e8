//! The states at which a model is judged: by its name, for the interpreter as for the judge.

/// A place in state space: time, coordinates, velocities, inputs.
#[derive(Clone, Debug)]
pub struct Point {
    pub t: f64,
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub inputs: Vec<f64>,
}

/// States at which each model is judged.
const STATES: usize = 3;

/// SplitMix64, so that a finding can be repeated.
struct Random(u64);

impl Random {
    fn next(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// States of a model with so many coordinates and inputs.
pub fn states(name: &str, coordinates: usize, inputs: usize) -> Vec<Point> {
    let start = 0xcbf2_9ce4_8422_2325_u64;
    let seed = name.bytes().fold(start, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    let mut random = Random(seed);
    let state = |_| {
        let mut draw =
            |count: usize, size: f64| (0..count).map(|_| random.next(-size, size)).collect::<Vec<f64>>();
        let (q, u) = (draw(coordinates, 0.9), draw(coordinates, 1.5));
        let inputs = draw(inputs, 1.5);
        Point { t: random.next(0.1, 2.0), q, u, inputs }
    };
    (0..STATES).map(state).collect()
}
