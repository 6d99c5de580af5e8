//! Removes points of curves that make no visible difference.

use alloc::vec::Vec;

/// Distance in pixels up to which two points of a curve are one.
const SAME_POINT: f64 = 0.35;

/// Distance in pixels below which a point counts as on the line between its neighbours: less than the eye
/// sees.
const STRAIGHT: f64 = 0.12;

/// Most points that one straight piece replaces. Each of them is compared with the piece, so this bounds the
/// work for a point.
const MOST_REPLACED: usize = 48;

/// The points, in pixels and all finite, that draw the same picture as `points` do.
///
/// Where x never goes back, each pixel column keeps its first, lowest, highest and last point, so that no
/// peak is lost; elsewhere points near to the last one kept are dropped. Of what is left, points on a
/// straight line between their neighbours go too.
pub(crate) fn visible(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let kept = if points.windows(2).all(|pair| pair[1][0] >= pair[0][0]) {
        columns(points)
    } else {
        distances(points)
    };
    corners(&kept)
}

/// Without the points that lie on the straight piece which replaces them.
fn corners(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let Some(first) = points.first() else {
        return Vec::new();
    };
    let mut kept = [*first].to_vec();
    let mut anchor = 0;
    for end in 2..points.len() {
        let between = &points[anchor + 1..end];
        let straight =
            between.iter().all(|point| distance_to_segment(*point, points[anchor], points[end]) < STRAIGHT);
        if !straight || between.len() >= MOST_REPLACED {
            anchor = end - 1;
            kept.push(points[anchor]);
        }
    }
    kept.extend(points.get(1..).and_then(<[_]>::last));
    kept
}

fn distance_to_segment(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let (px, py) = (point[0] - from[0], point[1] - from[1]);
    let length = dx * dx + dy * dy;
    let part = if length > 0.0 { ((px * dx + py * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    libm::hypot(px - part * dx, py - part * dy)
}

fn columns(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    let mut rest = points;
    while let Some(first) = rest.first() {
        let column = libm::floor(first[0]);
        let length = rest.iter().take_while(|point| libm::floor(point[0]) == column).count().max(1);
        let (here, after) = rest.split_at(length);
        extremes(here, &mut kept);
        rest = after;
    }
    kept
}

/// First, lowest, highest and last point in their order.
fn extremes(points: &[[f64; 2]], kept: &mut Vec<[f64; 2]>) {
    if points.len() <= 4 {
        kept.extend_from_slice(points);
        return;
    }
    let (mut lowest, mut highest) = (0, 0);
    for (k, point) in points.iter().enumerate() {
        if point[1] < points[lowest][1] {
            lowest = k;
        }
        if point[1] > points[highest][1] {
            highest = k;
        }
    }
    let mut chosen = [0, lowest.min(highest), lowest.max(highest), points.len() - 1].to_vec();
    chosen.dedup();
    kept.extend(chosen.into_iter().map(|k| points[k]));
}

fn distances(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for (k, point) in points.iter().enumerate() {
        let far =
            kept.last().is_none_or(|last| libm::hypot(point[0] - last[0], point[1] - last[1]) > SAME_POINT);
        if far || k + 1 == points.len() {
            kept.push(*point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_is_lost_and_the_curve_is_short() {
        let mut points: Vec<_> =
            (0..100_000).map(|k| [f64::from(k) * 0.005, (f64::from(k) * 0.001).sin()]).collect();
        points[54_321][1] = 100.0;
        let kept = visible(&points);
        assert!(kept.len() <= 4 * 500, "{}", kept.len());
        assert!(kept.iter().any(|point| point[1] == 100.0));
        assert_eq!(kept.first(), points.first());
        assert_eq!(kept.last(), points.last());
        assert!(kept.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
    }

    #[test]
    fn a_closed_curve_keeps_its_shape_and_its_end() {
        let points: Vec<_> = (0..=200_000)
            .map(|k| {
                let (sin, cos) = (f64::from(k) * core::f64::consts::TAU / 200_000.0).sin_cos();
                [100.0 * cos, 100.0 * sin]
            })
            .collect();
        let kept = visible(&points);
        assert!((40..200).contains(&kept.len()), "{}", kept.len());
        assert_eq!(kept.last(), points.last());
        for point in points.iter().step_by(97) {
            let away = kept
                .windows(2)
                .map(|pair| distance_to_segment(*point, pair[0], pair[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(away < 0.5, "{away}");
        }
    }

    #[test]
    fn few_points_stay_as_they_are() {
        assert!(visible(&[]).is_empty());
        let points = [[0.0, 1.0], [0.1, 2.0], [0.2, 0.0]];
        assert_eq!(visible(&points), points);
    }
}
