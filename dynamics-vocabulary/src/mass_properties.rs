//! Mass, center of mass and inertia of composed bodies, in numbers, for use outside of a model.

use core::fmt;
use core::ops::Add;

use crate::bodies::Inertia;
use crate::math::{hypot, sqrt};
use crate::matrix::Mat3;
use crate::vector::Vec3;

/// Mass, center of mass, and inertia about it, all in one set of axes.
///
/// ```
/// # use dynamics_vocabulary as dynamics;
/// use dynamics::{Inertia, Mat3, MassProperties, Vec3};
///
/// // A hammer: a head across the end of a handle along z.
/// let handle = MassProperties::new(0.3, Inertia::cylinder(0.3, 0.01, 0.3).value());
/// let head = MassProperties::new(0.5, Inertia::cuboid(0.5, 0.1, 0.03, 0.03).value());
/// let hammer = handle + head.moved(Vec3::new(0.0, 0.0, 0.15));
/// assert!((hammer.center.z - 0.15 * 0.5 / 0.8).abs() < 1e-16);
/// let principal = hammer.principal_axes()?;
/// assert!(principal.moments[0] < principal.moments[1]);
/// # Ok::<(), dynamics::UnphysicalInertia>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass.
    pub mass: f64,
    /// Center of mass.
    pub center: Vec3<f64>,
    /// Inertia matrix about the center of mass.
    pub inertia: Mat3<f64>,
}

/// Why no body has such an inertia matrix.
#[derive(Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum UnphysicalInertia {
    /// The mass is negative or not a finite number.
    Mass(f64),
    /// An element is not a finite number.
    NotFinite,
    /// A coordinate of the center of mass is not a finite number.
    Center([f64; 3]),
    /// A body of the plane has a moment of inertia that is negative or not a finite number.
    Moment(f64),
    /// There is inertia, yet no mass.
    WithoutMass {
        /// The largest element of the inertia.
        inertia: f64,
    },
    /// The elements (i, j) and (j, i) differ.
    NotSymmetric {
        /// Row of the one element.
        i: usize,
        /// Its column.
        j: usize,
        /// The two elements.
        elements: [f64; 2],
    },
    /// A principal moment is negative.
    NegativeMoment {
        /// All three, in ascending order.
        moments: [f64; 3],
    },
    /// The largest principal moment exceeds the sum of the others, which no distribution of mass can have.
    Triangle {
        /// All three, in ascending order.
        moments: [f64; 3],
    },
}

impl fmt::Display for UnphysicalInertia {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mass(mass) => {
                write!(f, "a body cannot have the mass {mass}; give a finite number that is not negative")
            }
            Self::Moment(moment) => {
                write!(
                    f,
                    "a body cannot have the moment of inertia {moment}; give a finite number that is not \
                     negative"
                )
            }
            Self::NotFinite => {
                write!(f, "an inertia matrix has an element that is no finite number; check how it was made")
            }
            Self::Center([x, y, z]) => write!(
                f,
                "a body cannot have its center of mass at ({x}, {y}, {z}); check how it was made, perhaps of \
                 masses whose sum is zero"
            ),
            Self::WithoutMass { inertia } => write!(
                f,
                "a body without mass has no inertia, yet an element of it is {inertia}; give the mass, or \
                 check what was taken out"
            ),
            Self::NotSymmetric { i, j, elements: [a, b] } => write!(
                f,
                "an inertia matrix is symmetric, yet its elements ({i}, {j}) and ({j}, {i}) are {a} and {b}; \
                 write the products of inertia with one sign on both sides"
            ),
            Self::NegativeMoment { moments: [a, b, c] } => write!(
                f,
                "the principal moments of inertia are {a}, {b}, {c}, and no body has a negative one; check \
                 the signs of the products of inertia, and about which point the moments are"
            ),
            Self::Triangle { moments: [a, b, c] } => write!(
                f,
                "the principal moments of inertia are {a}, {b}, {c}, and no body has one that exceeds the \
                 sum of the others; check the units of the moments, and about which point they are"
            ),
        }
    }
}

crate::sentence_for_debugging!(UnphysicalInertia);
impl core::error::Error for UnphysicalInertia {}

/// Principal moments and axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalAxes {
    /// The moments in ascending order.
    pub moments: [f64; 3],
    /// The rotation whose columns are the axes in that order: the inertia matrix is R diag(moments) Rᵀ.
    pub rotation: Mat3<f64>,
}

/// Errors of rounding, relative to the largest element, up to which a matrix is symmetric and a moment not
/// negative.
const ROUNDING: f64 = 1e-9;
/// Largest excess of a principal moment over the sum of the others, relative to the largest element. Thin
/// plates have none, and data of six digits miss that by their last.
const THIN_PLATE_EXCESS: f64 = 1e-5;

impl MassProperties {
    /// With the center of mass at the origin.
    #[must_use]
    pub fn new(mass: f64, inertia: Mat3<f64>) -> Self {
        Self { mass, center: Vec3::new(0.0, 0.0, 0.0), inertia }
    }

    /// A mass in a point.
    #[must_use]
    pub fn point(mass: f64, place: Vec3<f64>) -> Self {
        Self { mass, center: place, inertia: Mat3::default() }
    }

    /// Half of a full sphere about the origin: the half with z > 0.
    #[must_use]
    pub fn hemisphere(mass: f64, radius: f64) -> Self {
        let center = Vec3::new(0.0, 0.0, 0.375 * radius);
        Self { center, ..Self::new(mass, Inertia::hemisphere(mass, radius).value()) }
    }

    /// Half of a full cylinder about z, its middle at the origin: the half with x > 0.
    #[must_use]
    pub fn half_cylinder(mass: f64, radius: f64, height: f64) -> Self {
        let center = Vec3::new(4.0 * radius / (3.0 * core::f64::consts::PI), 0.0, 0.0);
        Self { center, ..Self::new(mass, Inertia::half_cylinder(mass, radius, height).value()) }
    }

    /// Thin ring about z, its middle at the origin.
    #[must_use]
    pub fn ring(mass: f64, radius: f64) -> Self {
        Self::new(mass, Inertia::ring(mass, radius).value())
    }

    /// Thin triangular plate with these corners.
    #[must_use]
    pub fn triangle(mass: f64, [a, b, c]: [Vec3<f64>; 3]) -> Self {
        Self { center: (a + b + c) / 3.0, ..Self::new(mass, Inertia::triangle(mass, a, b, c).value()) }
    }

    /// The same, moved by a vector.
    #[must_use]
    pub fn moved(self, by: Vec3<f64>) -> Self {
        Self { center: self.center + by, ..self }
    }

    /// The same, turned about the origin.
    #[must_use]
    pub fn turned(self, rotation: Mat3<f64>) -> Self {
        Self {
            center: rotation * self.center,
            inertia: Inertia::turned(self.inertia, rotation).value(),
            ..self
        }
    }

    /// What is left when another body is taken out of this one: a hole.
    #[must_use]
    pub fn without(self, hole: Self) -> Self {
        self + Self { mass: -hole.mass, inertia: -hole.inertia, ..hole }
    }

    /// Inertia about any point, by the theorem of parallel axes.
    #[must_use]
    pub fn inertia_about(self, point: Vec3<f64>) -> Mat3<f64> {
        self.inertia + Inertia::offset(self.mass, self.center - point).value()
    }

    /// Checks that a body can have this mass, center and inertia: finite; no inertia without mass; symmetric
    /// and no negative principal moment, both to 1e-9 of the largest element; no moment larger than the sum
    /// of the others, to 1e-5 of it, because plates are given with six digits.
    ///
    /// # Errors
    /// What is wrong, with the numbers.
    pub fn check(self) -> Result<(), UnphysicalInertia> {
        self.principal_axes().map(|_| ())
    }

    /// Principal moments of inertia about the center of mass, and their axes.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn principal_axes(self) -> Result<PrincipalAxes, UnphysicalInertia> {
        if !(self.mass >= 0.0 && self.mass.is_finite()) {
            return Err(UnphysicalInertia::Mass(self.mass));
        }
        let center = self.center.to_array();
        if center.iter().any(|x| !x.is_finite()) {
            return Err(UnphysicalInertia::Center(center));
        }
        let m = self.inertia.to_array();
        if m.iter().flatten().any(|x| !x.is_finite()) {
            return Err(UnphysicalInertia::NotFinite);
        }
        let scale = m.iter().flatten().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        if self.mass == 0.0 && scale > 0.0 {
            return Err(UnphysicalInertia::WithoutMass { inertia: scale });
        }
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            if (m[i][j] - m[j][i]).abs() > ROUNDING * scale {
                return Err(UnphysicalInertia::NotSymmetric { i, j, elements: [m[i][j], m[j][i]] });
            }
        }
        let principal = diagonalised(m);
        let moments = principal.moments;
        if moments[0] < -ROUNDING * scale {
            return Err(UnphysicalInertia::NegativeMoment { moments });
        }
        if moments[2] - moments[0] - moments[1] > THIN_PLATE_EXCESS * scale {
            return Err(UnphysicalInertia::Triangle { moments });
        }
        Ok(principal)
    }
}

/// Two bodies that are one.
impl Add for MassProperties {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let mass = self.mass + other.mass;
        // Without mass there is no center; that of the first is as good as any.
        let center = if mass == 0.0 {
            self.center
        } else {
            (self.mass * self.center + other.mass * other.center) / mass
        };
        Self { mass, center, inertia: self.inertia_about(center) + other.inertia_about(center) }
    }
}

/// Jacobi's rotations on a symmetric matrix (G. H. Golub and C. F. Van Loan, *Matrix Computations*, 4th ed.,
/// §8.5): small moments keep their digits, and the axes are orthogonal to rounding however close moments are.
fn diagonalised(mut m: [[f64; 3]; 3]) -> PrincipalAxes {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let mean = 0.5 * (m[i][j] + m[j][i]);
        (m[i][j], m[j][i]) = (mean, mean);
    }
    // Quadratic convergence: five sweeps do; the rest is for matrices that a bound has not been proved for.
    for _ in 0..30 {
        let mut done = true;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q].abs() <= f64::EPSILON * f64::EPSILON * (m[p][p].abs() + m[q][q].abs()) {
                continue;
            }
            done = false;
            let half = 0.5 * (m[q][q] - m[p][p]);
            let root = hypot(half, m[p][q]);
            let t = if half >= 0.0 { m[p][q] / (half + root) } else { m[p][q] / (half - root) };
            let c = 1.0 / sqrt(1.0 + t * t);
            turn(&mut m, &mut axes, (p, q), (c, t * c));
        }
        if done {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_unstable_by(|&a, &b| m[a][a].total_cmp(&m[b][b]));
    let column = |k: usize| Vec3::from(axes.map(|row| row[order[k]]));
    let (first, second) = (column(0), column(1));
    // The third axis closes a right-handed set.
    let rotation = Mat3::from_columns(first, second, first.cross(second));
    PrincipalAxes { moments: order.map(|k| m[k][k]), rotation }
}

/// M ← JᵀMJ, axes ← axes J, for the rotation J in the plane of p and q.
fn turn(m: &mut [[f64; 3]; 3], axes: &mut [[f64; 3]; 3], (p, q): (usize, usize), (c, s): (f64, f64)) {
    for row in m.iter_mut().chain(axes.iter_mut()) {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (row_p, row_q) = (Vec3::from(m[p]), Vec3::from(m[q]));
    (m[p], m[q]) = ((c * row_p - s * row_q).to_array(), (s * row_p + c * row_q).to_array());
    (m[p][q], m[q][p]) = (0.0, 0.0);
}

/// Why triangles bound no body.
#[cfg(feature = "alloc")]
#[derive(Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// A triangle names a vertex that does not exist.
    NoVertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex that it names.
        vertex: usize,
    },
    /// An edge, from one vertex to another, has no triangle on its other side that runs along it backwards,
    /// or more than one on this: the surface has a hole, or not all triangles are seen counter-clockwise from
    /// outside.
    Open {
        /// The vertices of the edge.
        edge: [usize; 2],
    },
    /// The volume is nothing beside what rounding of the coordinates makes of one: the surface is flat, or
    /// encloses as much from outside as from inside, or is too far from the origin for its size.
    Flat {
        /// The volume.
        volume: f64,
        /// What rounding may make of it.
        rounding: f64,
    },
    /// The density is zero or negative.
    Density(f64),
    /// The volume is negative: all triangles are seen counter-clockwise from inside.
    Inverted {
        /// The volume.
        volume: f64,
    },
    /// A coordinate or the density is not a finite number.
    NotFinite,
}

#[cfg(feature = "alloc")]
impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoVertex { triangle, vertex } => {
                write!(
                    f,
                    "triangle {triangle} names vertex {vertex}, which does not exist; count vertices from 0"
                )
            }
            Self::Open { edge: [a, b] } => write!(
                f,
                "the surface is not closed along the edge from vertex {a} to vertex {b}; give every edge two \
                 triangles, both seen counter-clockwise from outside"
            ),
            Self::Inverted { volume } => write!(
                f,
                "the triangles enclose the volume {volume}; give their vertices counter-clockwise as seen \
                 from outside"
            ),
            Self::Flat { volume, rounding } => write!(
                f,
                "the triangles enclose the volume {volume:e}, where rounding makes up to {rounding:e}; give \
                 a body that is not flat, with coordinates from a point near it"
            ),
            Self::Density(density) => write!(
                f,
                "a body cannot have the density {density}; give a positive one, and take holes out by \
                 `without`"
            ),
            Self::NotFinite => {
                write!(f, "a coordinate or the density is no finite number; check how the mesh was made")
            }
        }
    }
}

#[cfg(feature = "alloc")]
crate::sentence_for_debugging!(MeshError);
#[cfg(feature = "alloc")]
impl core::error::Error for MeshError {}

#[cfg(feature = "alloc")]
impl MassProperties {
    /// A body of even density bounded by triangles, each three indices of `vertices`, counter-clockwise as
    /// seen from outside.
    ///
    /// The sum over the tetrahedra between the triangles and a point amid the vertices, each with its sign
    /// (D. Eberly, *Polyhedral Mass Properties*, 2002, says the same by integrals over the surface).
    ///
    /// # Errors
    /// Where the triangles bound no body.
    pub fn mesh(density: f64, vertices: &[Vec3<f64>], triangles: &[[usize; 3]]) -> Result<Self, MeshError> {
        check_closed(vertices.len(), triangles)?;
        if !(density.is_finite() && vertices.iter().all(|v| v.to_array().iter().all(|x| x.is_finite()))) {
            return Err(MeshError::NotFinite);
        }
        if density <= 0.0 {
            return Err(MeshError::Density(density));
        }
        // From amid the vertices, not from an origin that may be far away: nothing cancels.
        let origin = vertices.iter().sum::<Vec3<f64>>() / (vertices.len().max(1) as f64);
        let (mut volume, mut first, mut second) = (0.0, Vec3::new(0.0, 0.0, 0.0), Mat3::<f64>::default());
        // Twice the area; the farthest corner, from amid the vertices and from where coordinates are counted.
        let (mut area, mut reach) = (0.0, 0.0_f64);
        for triangle in triangles {
            let corners = triangle.map(|k| vertices[k]);
            let [a, b, c] = corners.map(|corner| corner - origin);
            area += (b - a).cross(c - a).norm();
            reach =
                corners.into_iter().chain([a, b, c]).fold(reach, |reach, corner| reach.max(corner.norm()));
            let six = a.dot(b.cross(c));
            volume += six / 6.0;
            let sum = a + b + c;
            first += sum * (six / 24.0);
            // ∫ r rᵀ over a tetrahedron with one corner at the origin.
            let squares = Mat3::outer(a, a) + Mat3::outer(b, b) + Mat3::outer(c, c) + Mat3::outer(sum, sum);
            second += squares * (six / 120.0);
        }
        // Corners are where they are to ε·reach, and the surface sweeps that much.
        let rounding = 16.0 * f64::EPSILON * area * reach;
        if !(volume.is_finite() && rounding.is_finite() && second.trace().is_finite()) {
            return Err(MeshError::NotFinite);
        }
        if volume.abs() <= rounding || area == 0.0 {
            return Err(MeshError::Flat { volume, rounding });
        }
        if volume < 0.0 {
            return Err(MeshError::Inverted { volume });
        }
        let center = first / volume;
        let central = (second - Mat3::outer(center, center) * volume) * density;
        let trace = central.trace();
        let inertia = Mat3::diagonal(trace, trace, trace) - central;
        Ok(Self { mass: density * volume, center: center + origin, inertia })
    }
}

/// Every edge has its two triangles, which run along it in opposite directions.
#[cfg(feature = "alloc")]
fn check_closed(vertices: usize, triangles: &[[usize; 3]]) -> Result<(), MeshError> {
    let mut edges = alloc::vec::Vec::with_capacity(3 * triangles.len());
    for (i, &[a, b, c]) in triangles.iter().enumerate() {
        if let Some(&vertex) = [a, b, c].iter().find(|k| **k >= vertices) {
            return Err(MeshError::NoVertex { triangle: i, vertex });
        }
        edges.extend([[a, b], [b, c], [c, a]]);
    }
    edges.sort_unstable();
    let twice = edges.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
    let alone = edges.iter().find(|[a, b]| edges.binary_search(&[*b, *a]).is_err()).copied();
    match twice.or(alone) {
        Some(edge) => Err(MeshError::Open { edge }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
