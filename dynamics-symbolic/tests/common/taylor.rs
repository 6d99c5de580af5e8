//! What tests of Taylor series need.

/// Sum and first two derivatives of a polynomial in s.
pub fn polynomial(c: &[Vec<f64>], i: usize, s: f64) -> [f64; 3] {
    let (mut value, mut slope, mut bend) = (0.0, 0.0, 0.0);
    for row in c.iter().rev() {
        bend = bend * s + 2.0 * slope;
        slope = slope * s + value;
        value = value * s + row[i];
    }
    [value, slope, bend]
}

/// Gauss elimination with pivots by rows.
pub fn eliminate(mut m: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let p = (k..n).max_by(|i, j| m[*i][k].abs().total_cmp(&m[*j][k].abs())).expect("not empty");
        m.swap(k, p);
        b.swap(k, p);
        for i in k + 1..n {
            let (above, below) = m.split_at_mut(i);
            let factor = below[0][k] / above[k][k];
            below[0].iter_mut().zip(&above[k]).for_each(|(x, y)| *x -= factor * y);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| m[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / m[k][k];
    }
    b
}
