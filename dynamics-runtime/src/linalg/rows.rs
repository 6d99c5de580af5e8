//! Operations on rows of numbers.

/// Σ aᵢ bᵢ.
#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// y + x, in place.
#[inline]
pub(crate) fn add(y: &mut [f64], x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += x);
}

/// y + c x, in place.
#[inline]
pub(crate) fn add_scaled(y: &mut [f64], c: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += c * x);
}

/// The largest absolute value; NaN where an element is NaN.
#[inline]
pub(crate) fn max_abs(x: &[f64]) -> f64 {
    let larger = |most: f64, x: f64| if x.abs() > most || x.is_nan() { x.abs() } else { most };
    // Eight at once, the width of the widest vectors: a comparison has to wait for the one before it.
    let (blocks, rest) = x.as_chunks::<8>();
    if blocks.is_empty() {
        return rest.iter().fold(0.0, |most, x| larger(most, *x));
    }
    let mut most = [0.0; 8];
    for block in blocks {
        (0..8).for_each(|k| most[k] = larger(most[k], block[k]));
    }
    most.iter().chain(rest).fold(0.0, |most, x| larger(most, *x))
}

/// Euclidean norm without overflow.
#[inline]
pub(crate) fn norm(x: &[f64]) -> f64 {
    let square = dot(x, x);
    // Usually nothing over- or underflows.
    if (1e-250..1e250).contains(&square) {
        return crate::math::sqrt(square);
    }
    let size = max_abs(x);
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    size * crate::math::sqrt(x.iter().map(|x| (x / size) * (x / size)).sum())
}

/// Two different rows of a matrix with `n` columns, the first before the second.
#[inline]
pub(crate) fn two_rows(a: &mut [f64], n: usize, first: usize, second: usize) -> (&mut [f64], &mut [f64]) {
    let (head, tail) = a.split_at_mut(second * n);
    (&mut head[first * n..(first + 1) * n], &mut tail[..n])
}

/// Exchanges two rows of a matrix with `n` columns.
pub(crate) fn swap_rows(a: &mut [f64], n: usize, i: usize, j: usize) {
    if i != j {
        let (a, b) = two_rows(a, n, i.min(j), i.max(j));
        a.swap_with_slice(b);
    }
}

#[cfg(test)]
mod tests {
    use super::max_abs;

    #[test]
    fn the_largest_of_short_and_long_rows_and_nan_wherever_it_stands() {
        for n in [0, 1, 7, 8, 9, 19, 64] {
            let row: Vec<f64> = (0..n).map(|i| f64::from((7 * i + 3) % 11) - 8.0).collect();
            let plain = row.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            assert_eq!(max_abs(&row), plain, "{n}");
            for at in 0..row.len() {
                let mut row = row.clone();
                row[at] = f64::NAN;
                assert!(max_abs(&row).is_nan(), "{at} of {n}");
            }
        }
    }
}
