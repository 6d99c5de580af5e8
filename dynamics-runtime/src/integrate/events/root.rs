//! Roots of a function between two points where its signs differ.

/// A root of g between two points where its signs differ, to the given resolution, by the ITP method
/// (interpolate, truncate, project): at most one evaluation more than bisection, superlinear where g is
/// smooth.
///
/// Of the final bracket the end on the far side of the crossing is returned, so that g has already changed
/// its sign there. Where one end is exactly 0 that end is returned. Source: Oliveira, Takahashi, ACM TOMS 47
/// (2020) 5.
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
    // κ₁ = 0.2/(b − a), κ₂ = 2 and n₀ = 1 of the paper.
    let k1 = 0.2 / (b - a).abs();
    let bisections = ceil_log2((b - a).abs() / resolution);
    let most = bisections + 1;
    for step in 0..most + 2 {
        let width = b - a;
        if width.abs() <= resolution {
            break;
        }
        let middle = a + 0.5 * width;
        // Regula falsi, pushed towards the middle, projected on the interval that keeps the worst case of
        // bisection.
        let falsi = (gb * a - ga * b) / (gb - ga);
        let toward = sign(middle - falsi);
        let push = (k1 * width * width).min((middle - falsi).abs());
        let truncated = falsi + toward * push;
        let radius = half * power_of_two(most.saturating_sub(step)) - 0.5 * width.abs();
        let radius = radius.max(0.0);
        let x = if (truncated - middle).abs() <= radius { truncated } else { middle - toward * radius };
        // No number is left between the ends: the bracket is as small as rounding permits.
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

/// 2ⁿ.
fn power_of_two(n: u32) -> f64 {
    (0..n).fold(1.0, |power, _| power * 2.0)
}

/// Replaces the end of the bracket on the side of the value.
fn narrow(x: f64, value: f64, side: f64, near: (&mut f64, &mut f64), far: (&mut f64, &mut f64)) {
    let end = if sign(value) == side { near } else { far };
    (*end.0, *end.1) = (x, value);
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
