//! Euler angles, Euler parameters, axis and angle of a rotation matrix, at run time.
//!
//! Every set of coordinates of rotations is singular or ambiguous somewhere; only the matrix is not. The
//! results of these functions reproduce the matrix to rounding there, too. If there is a free choice, the
//! documentation says which is made.

use core::fmt;

use crate::math::{atan2, hypot, sqrt};
use crate::matrix::Mat3;
use crate::rotation::EulerSequence;
use crate::vector::Vec3;

/// Largest element of RᵀR − 1 up to which a matrix is read as a rotation. A larger bound accepts data of
/// fewer digits.
const ROTATION_TOLERANCE: f64 = 1e-6;

/// A matrix is no rotation.
#[derive(Clone, Copy, PartialEq)]
pub enum NotARotation {
    /// Its columns are no unit vectors at right angles: the largest element of RᵀR − 1, NaN where an element
    /// is.
    NotOrthonormal(f64),
    /// It mirrors: its determinant is −1.
    Mirrors,
}

impl fmt::Display for NotARotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotOrthonormal(by) => write!(
                f,
                "the matrix is no rotation, RᵀR differs from the identity by {by:.1e}; take its \
                 `nearest_rotation()`, or check how it was made"
            ),
            Self::Mirrors => {
                write!(f, "the matrix mirrors, its determinant is -1; turn the sign of one axis round")
            }
        }
    }
}

crate::sentence_for_debugging!(NotARotation);
impl core::error::Error for NotARotation {}

/// Three angles of a sequence, and how well they are determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EulerAngles {
    /// The angles in rad, in the order of the sequence. The second is in 0..π for the sequences of Euler, in
    /// −π/2..π/2 for those of Tait and Bryan, the others in −π..π.
    pub angles: [f64; 3],
    /// |sin| of the second angle of a sequence of Euler, |cos| of one of Tait and Bryan: 0 in gimbal lock.
    /// An error ε of the matrix becomes ε/conditioning in the first and in the third angle.
    pub conditioning: f64,
}

impl EulerAngles {
    /// Whether the first and the third axis coincide to rounding. Then only the sum or the difference of
    /// their angles is determined, and the first is set to 0.
    #[must_use]
    pub fn is_locked(&self) -> bool {
        self.conditioning <= LOCKED_CONDITIONING
    }
}

/// Conditioning at and below which a sequence of angles is locked. The first angle would follow from rounding
/// errors alone.
const LOCKED_CONDITIONING: f64 = 8.0 * f64::EPSILON;

/// Change of the largest element at which Newton's iteration for the nearest rotation ends: about 5 ε.
const CONVERGED: f64 = 1e-15;
/// Most of its iterations. It converges quadratically, after one halving for each factor of two between the
/// smallest singular value and 1.
const MOST_ITERATIONS: usize = 50;

impl Mat3<f64> {
    /// Checks that this is a rotation, to 1e-6.
    ///
    /// # Errors
    /// What it is instead.
    pub fn check_rotation(self) -> Result<(), NotARotation> {
        let defect = self.orthonormal_defect();
        if defect > ROTATION_TOLERANCE || defect.is_nan() {
            return Err(NotARotation::NotOrthonormal(defect));
        }
        if self.determinant() < 0.0 { Err(NotARotation::Mirrors) } else { Ok(()) }
    }

    /// The largest element of RᵀR − 1; NaN where one is.
    #[doc(hidden)]
    #[must_use]
    pub fn orthonormal_defect(self) -> f64 {
        let product = self.transpose() * self;
        let mut defect = 0.0_f64;
        for (i, row) in product.to_array().into_iter().enumerate() {
            for (j, element) in row.into_iter().enumerate() {
                let error = (element - f64::from(u8::from(i == j))).abs();
                // A NaN stays: no later element is larger.
                if error > defect || error.is_nan() {
                    defect = error;
                }
                if defect.is_nan() {
                    return defect;
                }
            }
        }
        defect
    }

    /// The rotation nearest to this matrix, of any size: its orthogonal polar factor (Newton's iteration: N.
    /// J. Higham, *SIAM J. Sci. Stat. Comput.* 7 (1986) 1160).
    ///
    /// # Errors
    /// There is none if the determinant is negative or 0, or if the iteration does not converge, as for
    /// nearly singular matrices.
    pub fn nearest_rotation(self) -> Result<Self, NotARotation> {
        let largest = self.to_array().into_iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Iterations halve what is large one by one, and the determinant of what is small is none.
        let mut r = if (0.5..=2.0).contains(&largest) || largest == 0.0 { self } else { self / largest };
        for _ in 0..MOST_ITERATIONS {
            let determinant = r.determinant();
            if determinant < 0.0 {
                return Err(NotARotation::Mirrors);
            }
            if determinant == 0.0 {
                break;
            }
            // R ← ½(R + R⁻ᵀ); the cofactors are the cross products of the rows.
            let cofactors =
                Self::from_rows(r.row(1).cross(r.row(2)), r.row(2).cross(r.row(0)), r.row(0).cross(r.row(1)));
            let next = 0.5 * (r + cofactors / determinant);
            let change = (next - r)
                .to_array()
                .into_iter()
                .flatten()
                .fold(0.0, |m: f64, x| if x.abs() <= m { m } else { x.abs() });
            r = next;
            if change < CONVERGED || change.is_nan() {
                break;
            }
        }
        r.check_rotation().map(|()| r)
    }

    /// The angles of a sequence about axes of the body, as [`Mat3::euler`] takes them.
    ///
    /// In gimbal lock, where only the sum or the difference of the first and the third is determined, the
    /// first is 0; see [`EulerAngles::conditioning`].
    ///
    /// ```
    /// # use dynamics_vocabulary as dynamics;
    /// use dynamics::{EulerSequence, Mat3};
    ///
    /// let turned = Mat3::euler(EulerSequence::Zxz, [0.3, 0.0, 0.5]);
    /// let read = turned.to_euler(EulerSequence::Zxz)?;
    /// assert!(read.is_locked() && (read.angles[2] - 0.8).abs() < 1e-15);
    /// # Ok::<(), dynamics::NotARotation>(())
    /// ```
    ///
    /// # Errors
    /// Where this is no rotation.
    pub fn to_euler(self, sequence: EulerSequence) -> Result<EulerAngles, NotARotation> {
        self.check_rotation()?;
        let axes = sequence.axes();
        Ok(self.angles_about(axes))
    }

    /// The angles of a sequence about axes that stay in space, as [`Mat3::euler_space`] takes them; else as
    /// [`to_euler`](Self::to_euler), with the third angle 0 in gimbal lock.
    ///
    /// # Errors
    /// Where this is no rotation.
    pub fn to_euler_space(self, sequence: EulerSequence) -> Result<EulerAngles, NotARotation> {
        self.check_rotation()?;
        let [i, j, k] = sequence.axes();
        let mut read = self.angles_about([k, j, i]);
        read.angles.reverse();
        Ok(read)
    }

    fn angles_about(self, [i, j, last]: [usize; 3]) -> EulerAngles {
        let k = 3 - i - j;
        let r = self.to_array();
        // +1 where i, j, k are right-handed.
        let sign = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
        let proper = last == i;
        let (across, first, second) = if proper {
            let across = hypot(r[j][i], r[k][i]);
            (across, (r[j][i], -sign * r[k][i]), atan2(across, r[i][i]))
        } else {
            let across = hypot(r[j][k], r[k][k]);
            (across, (-sign * r[j][k], r[k][k]), atan2(sign * r[i][k], across))
        };
        let a = if across <= LOCKED_CONDITIONING { 0.0 } else { atan2(first.0, first.1) };
        // What is left once the first rotation is taken back has the third in its row j: right whatever the
        // first became.
        let row = (Self::about(i, -a) * self).to_array()[j];
        let c = if proper { atan2(-sign * row[k], row[j]) } else { atan2(sign * row[i], row[j]) };
        EulerAngles { angles: [a, second, c], conditioning: across }
    }

    /// The Euler parameters (e₀, e₁, e₂, e₃), as [`Mat3::euler_parameters`] takes them, with e₀ ≥ 0; where e₀
    /// = 0 the largest is positive. (Every rotation has two quadruples ±e, and one of them is chosen. To
    /// follow a motion continuously you may need the other.)
    ///
    /// The largest of the four is found first, so that nothing cancels (S. W. Shepperd, *J. Guidance and
    /// Control* 1 (1978) 223).
    ///
    /// # Errors
    /// Where this is no rotation.
    pub fn to_euler_parameters(self) -> Result<[f64; 4], NotARotation> {
        self.check_rotation()?;
        let r = self.to_array();
        let trace = self.trace();
        let mut largest = (0, trace);
        for (i, row) in r.iter().enumerate() {
            if row[i] > largest.1 {
                largest = (i + 1, row[i]);
            }
        }
        let mut e = [0.0; 4];
        if largest.0 == 0 {
            e = [1.0 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
        } else {
            let i = largest.0 - 1;
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            e[0] = r[k][j] - r[j][k];
            e[1 + i] = 1.0 + 2.0 * r[i][i] - trace;
            e[1 + j] = r[i][j] + r[j][i];
            e[1 + k] = r[i][k] + r[k][i];
        }
        let norm = sqrt(e.iter().map(|x| x * x).sum());
        let norm = if e[0] < 0.0 { -norm } else { norm };
        Ok(e.map(|x| x / norm))
    }

    /// Axis of unit length and angle in 0..π rad. For the identity every axis is right, and z is returned;
    /// for half a turn both directions of the axis are.
    ///
    /// # Errors
    /// Where this is no rotation.
    pub fn to_axis_angle(self) -> Result<(Vec3<f64>, f64), NotARotation> {
        let [e0, x, y, z] = self.to_euler_parameters()?;
        let v = Vec3::new(x, y, z);
        let length = v.norm();
        if length == 0.0 {
            return Ok((Vec3::new(0.0, 0.0, 1.0), 0.0));
        }
        Ok((v / length, 2.0 * atan2(length, e0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};

    fn distance(a: Mat3<f64>, b: Mat3<f64>) -> f64 {
        (a - b).to_array().into_iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()))
    }

    /// Angles near and at every kind of special place, for both of its signs.
    fn angles() -> Vec<f64> {
        let near = [0.0, 1e-300, 1e-17, 1e-12, 1e-8, 1e-4, 0.1, 0.7];
        let at = [0.0, FRAC_PI_2, PI, -FRAC_PI_2, -PI, 1.1];
        at.iter().flat_map(|a| near.iter().flat_map(move |e| [a + e, a - e])).collect()
    }

    /// Whatever the angles are, those that are read back turn alike: every sequence against its own matrix,
    /// in gimbal lock and next to it.
    #[test]
    fn angles_read_back_turn_alike() {
        let outer = [0.0, 0.4, -2.9, PI, -FRAC_PI_2];
        for sequence in EulerSequence::ALL {
            for b in angles() {
                for (a, c) in outer.iter().flat_map(|a| outer.iter().map(move |c| (*a, *c))) {
                    let turned = Mat3::euler(sequence, [a, b, c]);
                    let read = turned.to_euler(sequence).expect("a product of rotations is one");
                    let error = distance(Mat3::euler(sequence, read.angles), turned);
                    assert!(error < 2e-15, "{sequence:?} [{a}, {b}, {c}]: {read:?} is off by {error:e}");
                    let middle = read.angles[1];
                    let range = if sequence.is_proper() { 0.0..=PI } else { -FRAC_PI_2..=FRAC_PI_2 };
                    assert!(range.contains(&middle), "{sequence:?}: {middle}");
                    let turned = Mat3::euler_space(sequence, [a, b, c]);
                    let read = turned.to_euler_space(sequence).expect("a product of rotations is one");
                    let error = distance(Mat3::euler_space(sequence, read.angles), turned);
                    assert!(
                        error < 2e-15,
                        "space {sequence:?} [{a}, {b}, {c}]: {read:?} is off by {error:e}"
                    );
                }
            }
        }
    }

    /// Where the angles are determined they are the angles that went in.
    #[test]
    fn angles_come_back_away_from_lock() {
        for sequence in EulerSequence::ALL {
            let b = if sequence.is_proper() { 1.2 } else { -0.6 };
            for (a, c) in [(0.3, -2.0), (3.0, 1.5), (-1.0, -3.1)] {
                let read = Mat3::euler(sequence, [a, b, c]).to_euler(sequence).expect("a rotation");
                for (read, given) in read.angles.iter().zip([a, b, c]) {
                    assert!((read - given).abs() < 4e-15, "{sequence:?}");
                }
                assert!(
                    !read.is_locked()
                        && (read.conditioning - if sequence.is_proper() { b.sin() } else { b.cos() }).abs()
                            < 1e-15
                );
            }
        }
    }

    /// Space-fixed sequences are body-fixed ones backwards.
    #[test]
    fn space_fixed_is_body_fixed_backwards() {
        for sequence in EulerSequence::ALL {
            let [i, j, k] = sequence.axes();
            let backwards =
                EulerSequence::ALL.into_iter().find(|s| s.axes() == [k, j, i]).expect("the set is closed");
            let (a, b, c) = (0.3, 1.1, -0.8);
            assert_eq!(Mat3::euler_space(sequence, [a, b, c]), Mat3::euler(backwards, [c, b, a]));
        }
    }

    /// Half turns, where e₀ = 0, and their neighbours.
    #[test]
    fn euler_parameters_read_back_turn_alike() {
        for angle in angles() {
            for axis in [
                [1.0, 0.0, 0.0],
                [0.0, -1.0, 0.0],
                [0.0, 0.0, 1.0],
                [1.0, 1e-9, 0.0],
                [0.6, -0.48, 0.64],
                [1.0, 1.0, -1.0],
            ] {
                let turned = Mat3::axis_angle(Vec3::from(axis), angle).value();
                let e = turned.to_euler_parameters().expect("a rotation");
                assert!((e.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-15 && e[0] >= 0.0, "{e:?}");
                assert!(distance(Mat3::euler_parameters(e), turned) < 2e-15, "{axis:?} by {angle}: {e:?}");
                let (n, read) = turned.to_axis_angle().expect("a rotation");
                assert!((n.norm() - 1.0).abs() < 1e-15 && (0.0..=PI).contains(&read));
                assert!(
                    distance(Mat3::axis_angle(n, read).value(), turned) < 3e-15,
                    "{axis:?} by {angle}: {n:?} by {read}"
                );
            }
        }
        assert_eq!(Mat3::IDENTITY.value().to_axis_angle(), Ok((Vec3::new(0.0, 0.0, 1.0), 0.0)));
    }

    /// A small angle has all its digits: it is not the arc cosine of something near 1.
    #[test]
    fn small_angles_keep_their_digits() {
        for angle in [1e-3, 1e-7, 1e-12] {
            let (_, read) = Mat3::axis_angle(Vec3::new(1.0, 2.0, -2.0), angle)
                .value()
                .to_axis_angle()
                .expect("a rotation");
            assert!((read - angle).abs() < 4.0 * f64::EPSILON * angle, "{read:e}");
        }
    }

    #[test]
    fn what_is_no_rotation_is_refused() {
        let mirror = Mat3::diagonal(1.0, 1.0, -1.0);
        assert_eq!(mirror.to_euler_parameters(), Err(NotARotation::Mirrors));
        assert_eq!(mirror.nearest_rotation(), Err(NotARotation::Mirrors));
        let stretched = Mat3::rotation_x(0.3) * 1.01;
        let refused = stretched.to_euler(EulerSequence::Zyx);
        assert!(
            matches!(refused, Err(NotARotation::NotOrthonormal(by)) if (by - 0.0201).abs() < 1e-12),
            "{refused:?}"
        );
        let nan = Mat3::diagonal(1.0, f64::NAN, 1.0);
        assert!(matches!(nan.to_axis_angle(), Err(NotARotation::NotOrthonormal(by)) if by.is_nan()));
        assert!(nan.nearest_rotation().is_err() && Mat3::diagonal(1.0, 1.0, 0.0).nearest_rotation().is_err());
    }

    /// A rotation with errors added is mended to the rotation plus the antisymmetric part of the errors; to
    /// first order that is the nearest.
    #[test]
    fn the_nearest_rotation() {
        let rotation = Mat3::euler(EulerSequence::Zyx, [0.4, -0.9, 2.0]);
        let error = Mat3::from([[1.0, -0.3, 0.5], [0.2, 0.7, -0.1], [-0.9, 0.4, 0.6]]) * 1e-6;
        let mended =
            (rotation * (Mat3::IDENTITY.value() + error)).nearest_rotation().expect("it is near one");
        let turn = 0.5 * (error - error.transpose());
        assert!(distance(mended, rotation * (Mat3::IDENTITY.value() + turn)) < 3e-12);
        assert!(distance((rotation * 1.7).nearest_rotation().expect("a multiple"), rotation) < 1e-15);
        for size in [1e-300, 1e-200, 1e-20, 1e20, 1e200, 1e300] {
            let found = (rotation * size).nearest_rotation().expect("a multiple");
            assert!(distance(found, rotation) < 1e-15, "{size:e}");
            let mirror = Mat3::diagonal(size, size, -size);
            assert_eq!(mirror.nearest_rotation(), Err(NotARotation::Mirrors));
        }
        for singular in
            [Mat3::<f64>::default(), Mat3::diagonal(1.0, 1.0, 0.0), Mat3::diagonal(1.0, f64::INFINITY, 1.0)]
        {
            assert!(matches!(singular.nearest_rotation(), Err(NotARotation::NotOrthonormal(_))));
        }
    }

    /// An axis has a direction whatever its length; squares of long ones overflow, those of short ones
    /// vanish.
    #[test]
    fn axes_of_any_length() {
        let axis = Vec3::new(1.0, 2.0, -2.0);
        let turned = Mat3::axis_angle(axis, 0.7).value();
        for size in [1e-320, 1e-300, 1e-200, 1e-160, 1e160, 1e200, 8e307] {
            let found = Mat3::axis_angle(axis * size, 0.7).value();
            // Subnormal numbers have few digits left.
            let tolerance = if size < 1e-310 { 1e-3 } else { 1e-15 };
            assert!(distance(found, turned) < tolerance, "{size:e}: {found:?}");
        }
        for axis in [Vec3::new(0.0, 0.0, 0.0), Vec3::new(f64::INFINITY, 0.0, 0.0)] {
            assert!(Mat3::axis_angle(axis, 0.7).value().check_rotation().is_err());
        }
        // The rate of an axis that moves does not depend on its length either.
        let moving = |size: f64| {
            let x = crate::Expr::coordinate(0.3 * size, 0.4 * size, 0.0);
            Mat3::axis_angle(crate::Vec3 { x, y: size.into(), z: (0.2 * size).into() }, 0.7).rate()
        };
        assert!(
            distance(moving(1e200), moving(1.0)) < 1e-15 && distance(moving(1e-200), moving(1.0)) < 1e-15
        );
    }
}
