//! Zero crossings within a step.
//!
//! An event function g is sampled at the ends of a few equal parts of the step. A change of sign brackets a crossing, and so does
//! a dip: where three samples of one sign have their smallest in the middle, the vertex of the parabola through them is tried
//! too, so that two crossings close together are seen. The bracket is closed by [`root`].

/// Which crossings count. Rising and falling are meant along the motion, also when it runs backwards in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both.
    Any,
}

impl Direction {
    /// Whether a crossing in direction `found` counts.
    #[must_use]
    pub fn admits(self, found: Direction) -> bool {
        self == Direction::Any || self == found
    }
}

/// A crossing within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Index of the event function.
    pub index: usize,
    /// Where in the step, 0 to 1.
    pub theta: f64,
    /// Rising or falling.
    pub direction: Direction,
}

/// Follows one event function through the samples of a step and finds its crossings.
#[derive(Clone, Copy, Debug)]
pub struct Scan {
    /// The two samples before, (θ, g).
    past: [(f64, f64); 2],
    seen: usize,
    /// The last sign that was not 0; 0 while unknown.
    sign: f64,
}

impl Scan {
    /// Begins at a sample (θ, g) where the function has the given sign (0: unknown, the next sample decides without a crossing).
    #[must_use]
    pub fn new(theta: f64, value: f64, sign: f64) -> Self {
        Self { past: [(theta, value); 2], seen: 1, sign }
    }

    /// The last sign that was not 0.
    #[must_use]
    pub fn sign(&self) -> f64 {
        self.sign
    }

    /// θ of the last sample.
    #[must_use]
    pub fn last_theta(&self) -> f64 {
        self.past[1].0
    }

    /// Takes the next sample; calls `found(θ, direction)` for every crossing up to it. `g` evaluates the function.
    pub fn sample(
        &mut self,
        theta: f64,
        value: f64,
        resolution: f64,
        mut g: impl FnMut(f64) -> f64,
        mut found: impl FnMut(f64, Direction),
    ) {
        let [older, last] = self.past;
        if self.seen >= 2
            && let Some(dip) = dip(older, last, (theta, value))
        {
            let low = g(dip);
            if sign(low) != 0.0 && sign(low) != self.sign {
                // The dip lies on either side of the sample before; both crossings are still to be reported.
                let (from, to) = if dip < last.0 { (older, last) } else { (last, (theta, value)) };
                found(root(&mut g, from, (dip, low), resolution), direction(sign(low)));
                found(root(&mut g, (dip, low), to, resolution), direction(self.sign));
            }
        }
        let now = sign(value);
        if now != 0.0 {
            if self.sign != 0.0 && now != self.sign {
                found(root(&mut g, last, (theta, value), resolution), direction(now));
            }
            self.sign = now;
        }
        self.past = [last, (theta, value)];
        self.seen += 1;
    }
}

fn direction(sign: f64) -> Direction {
    if sign > 0.0 { Direction::Rising } else { Direction::Falling }
}

/// Sign of g: −1, 0 or 1 (0 also for NaN).
pub(crate) fn sign(value: f64) -> f64 {
    if value > 0.0 {
        1.0
    } else if value < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// The vertex of the parabola through three samples of one sign whose middle one is the smallest.
fn dip((x0, g0): (f64, f64), (x1, g1): (f64, f64), (x2, g2): (f64, f64)) -> Option<f64> {
    // A middle sample that is exactly zero is no crossing by itself, and may be the first of two.
    let of_one_sign = sign(g0) != 0.0 && sign(g0) == sign(g2) && (sign(g1) == sign(g0) || g1 == 0.0);
    if !(of_one_sign && g1.abs() < g0.abs() && g1.abs() < g2.abs()) {
        return None;
    }
    let (left, right) = ((g1 - g0) / (x1 - x0), (g2 - g1) / (x2 - x1));
    let curvature = (right - left) / (x2 - x0);
    let slope = left + curvature * (x1 - x0);
    let vertex = x1 - slope / (2.0 * curvature);
    (vertex > x0 && vertex < x2 && vertex != x1).then_some(vertex)
}

/// A root of g between two points where its signs differ, to the given resolution, by the ITP method: never more evaluations than
/// bisection plus one, superlinear where g is smooth.
///
/// Of the final bracket the end on the far side of the crossing is returned, so that g has already changed its sign there.
/// Where one end is exactly 0 that end is returned. Source: Oliveira, Takahashi, ACM TOMS 47 (2020) 5.
pub fn root(mut g: impl FnMut(f64) -> f64, from: (f64, f64), to: (f64, f64), resolution: f64) -> f64 {
    let ((mut a, mut ga), (mut b, mut gb)) = (from, to);
    if ga == 0.0 {
        return a;
    }
    if gb == 0.0 {
        return b;
    }
    let side = sign(ga);
    let half = 0.5 * resolution;
    let k1 = 0.2 / (b - a).abs();
    let bisections = ceil_log2((b - a).abs() / resolution);
    let most = bisections + 1;
    for step in 0..most + 2 {
        let width = b - a;
        if width.abs() <= resolution {
            break;
        }
        let middle = a + 0.5 * width;
        // Regula falsi, pushed towards the middle, projected on the interval that keeps the worst case of bisection.
        let falsi = (gb * a - ga * b) / (gb - ga);
        let toward = sign(middle - falsi);
        let push = (k1 * width * width).min((middle - falsi).abs());
        let truncated = falsi + toward * push;
        let radius = half * power_of_two(most.saturating_sub(step)) - 0.5 * width.abs();
        let radius = radius.max(0.0);
        let x = if (truncated - middle).abs() <= radius { truncated } else { middle - toward * radius };
        // Where rounding leaves no point between the ends the bracket is as small as it gets.
        let x = if x.is_finite() { x } else { middle };
        if x == a || x == b {
            if middle == a || middle == b {
                break;
            }
            let value = g(middle);
            narrow(middle, value, side, (&mut a, &mut ga), (&mut b, &mut gb));
            continue;
        }
        let value = g(x);
        if value == 0.0 {
            return x;
        }
        narrow(x, value, side, (&mut a, &mut ga), (&mut b, &mut gb));
    }
    b
}

/// The smallest n ≥ 0 with 2ⁿ ≥ x; at most 1,100.
fn ceil_log2(x: f64) -> u32 {
    let (mut n, mut power) = (0, 1.0);
    while power < x && n < 1100 {
        power *= 2.0;
        n += 1;
    }
    n
}

fn power_of_two(n: u32) -> f64 {
    (0..n).fold(1.0, |power, _| power * 2.0)
}

fn narrow(x: f64, value: f64, side: f64, near: (&mut f64, &mut f64), far: (&mut f64, &mut f64)) {
    let end = if sign(value) == side { near } else { far };
    (*end.0, *end.1) = (x, value);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count_root(g: impl Fn(f64) -> f64, a: f64, b: f64) -> (f64, u32) {
        let mut calls = 0;
        let x = root(
            |x| {
                calls += 1;
                g(x)
            },
            (a, g(a)),
            (b, g(b)),
            1e-14,
        );
        (x, calls)
    }

    #[test]
    fn finds_roots_of_smooth_steep_and_flat_functions_within_the_cost_of_bisection() {
        let bisection = 47 + 2;
        for (x, calls, exact) in [
            (count_root(|x| x - 0.3, 0.0, 1.0), 0.3),
            (count_root(|x| x * x - 0.5, 0.0, 1.0), 0.5f64.sqrt()),
            (count_root(|x| (x - 0.7).powi(9), 0.0, 1.0), 0.7),
            (count_root(|x| (50.0 * (x - 0.123)).tanh(), 0.0, 1.0), 0.123),
            (count_root(|x| (x - 0.9).exp() - 1.0, 1.0, 0.0), 0.9),
            (count_root(|x| if x < 0.25 { -1.0 } else { 1e9 }, 0.0, 1.0), 0.25),
        ]
        .map(|((x, calls), exact)| (x, calls, exact))
        {
            assert!((x - exact).abs() < 2e-14, "{x} for {exact}");
            assert!(calls <= bisection, "{calls} evaluations for {exact}");
        }
        assert!(count_root(|x| x * x - 0.5, 0.0, 1.0).1 <= 10);
    }

    fn crossings(g: impl Fn(f64) -> f64, parts: usize, initial: f64) -> Vec<(f64, Direction)> {
        let mut scan = Scan::new(0.0, g(0.0), initial);
        let mut out = Vec::new();
        for j in 1..=parts {
            let theta = j as f64 / parts as f64;
            scan.sample(theta, g(theta), 1e-14, &g, |theta, direction| out.push((theta, direction)));
        }
        out
    }

    #[test]
    fn sees_two_crossings_between_samples() {
        let found = crossings(|x| (x - 0.55) * (x - 0.56), 4, 1.0);
        assert_eq!(found.len(), 2);
        assert!((found[0].0 - 0.55).abs() < 1e-12 && found[0].1 == Direction::Falling);
        assert!((found[1].0 - 0.56).abs() < 1e-12 && found[1].1 == Direction::Rising);
        for (first, second) in [(0.5, 0.51), (0.49, 0.5)] {
            let found = crossings(|x| (x - first) * (x - second), 4, 1.0);
            assert_eq!(found.len(), 2, "one of them on a sample: {found:?}");
            assert!((found[0].0 - first).abs() < 1e-12 && (found[1].0 - second).abs() < 1e-12);
        }
    }

    #[test]
    fn a_touch_without_change_of_sign_is_no_crossing() {
        assert!(crossings(|x| (x - 0.5) * (x - 0.5), 4, 1.0).is_empty());
        assert!(crossings(|x| x * (1.0 - x), 4, 0.0).is_empty(), "zero at both ends");
    }

    #[test]
    fn a_zero_on_a_sample_is_found_once() {
        let found = crossings(|x| x - 0.5, 4, -1.0);
        assert_eq!(found, [(0.5, Direction::Rising)]);
    }

    #[test]
    fn unknown_sign_at_the_start_is_settled_without_a_crossing() {
        assert!(crossings(|x| x, 4, 0.0).is_empty());
        assert_eq!(crossings(|x| x * (0.6 - x), 4, 0.0).len(), 1);
    }
}
