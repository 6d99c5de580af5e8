//! The arm of seven hinges as one writes it down: Jacobians and inertia of every link in the world's axes,
//! M = Σ JᵀIJ, LDLᵀ.

#[macro_use]
#[path = "../../tests/models/arm7.rs"]
mod arm7;

use super::by_hand::solve;
use super::real::Real;

pub(crate) use arm7::{Arm, arm};

/// With the standard library's sines.
pub(crate) mod accurate {
    use core::f64::consts::FRAC_PI_2;

    use dynamics::prelude::*;

    arm_of_seven_hinges!(ArmAccurate, accurate);
}

/// The same numbers.
pub(crate) fn arm_accurate() -> accurate::ArmAccurate {
    let Arm { masses, centers, inertia, hinges, g } = arm();
    accurate::ArmAccurate { masses, centers, inertia, hinges, g }
}

type V<T> = [T; 3];

fn added<T: Real>(a: V<T>, b: V<T>) -> V<T> {
    core::array::from_fn(|i| a[i] + b[i])
}
fn scaled<T: Real>(factor: T, a: V<T>) -> V<T> {
    a.map(|x| factor * x)
}
fn dot<T: Real>(a: V<T>, b: V<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross<T: Real>(a: V<T>, b: V<T>) -> V<T> {
    core::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}
/// A vector of the link in the world, by the link's axes there.
fn carried<T: Real>(axes: &[V<T>; 3], v: V<T>) -> V<T> {
    (0..3).fold([T::of(0.0); 3], |sum, i| added(sum, scaled(v[i], axes[i])))
}

/// Accelerations of the arm, without motors.
pub(crate) fn in_the_world<T: Real>(q: &[T; 7], u: &[T; 7]) -> [T; 7] {
    let (zero, one, model) = (T::of(0.0), T::of(1.0), arm());
    let pairs = T::sin_cos(*q);
    let mut axes = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let (mut origin, mut omega, mut alpha) = ([zero; 3], [zero; 3], [zero; 3]);
    let mut a = [zero, zero, T::of(model.g)];
    let (mut origins, mut hinges) = ([[zero; 3]; 7], [[zero; 3]; 7]);
    let (mut mass, mut force) = ([[zero; 7]; 7], [zero; 7]);
    for i in 0..7 {
        let step = carried(&axes, model.hinges[i].to_array().map(T::of));
        a = added(a, added(cross(alpha, step), cross(omega, cross(omega, step))));
        origin = added(origin, step);
        // By a quarter turn about x, then about z.
        let [x, y, z] = axes;
        let [y, z] = match i {
            0 => [y, z],
            _ if i % 2 == 0 => [z, scaled(-one, y)],
            _ => [scaled(-one, z), y],
        };
        let (sin, cos) = pairs[i];
        axes = [added(scaled(cos, x), scaled(sin, y)), added(scaled(-sin, x), scaled(cos, y)), z];
        let rate = scaled(u[i], z);
        alpha = added(alpha, cross(omega, rate));
        omega = added(omega, rate);
        (origins[i], hinges[i]) = (origin, z);
        let m = T::of(model.masses[i]);
        let arm = carried(&axes, model.centers[i].to_array().map(T::of));
        let center = added(origin, arm);
        let turned = |v: V<T>| {
            let within = axes.map(|axis| dot(axis, v));
            let row = |r: usize| (0..3).fold(zero, |sum, c| sum + T::of(model.inertia[(r, c)]) * within[c]);
            carried(&axes, core::array::from_fn(row))
        };
        let pushed = scaled(m, added(a, added(cross(alpha, arm), cross(omega, cross(omega, arm)))));
        let spun = added(turned(alpha), cross(omega, turned(omega)));
        for k in 0..=i {
            let lever = |j: usize| cross(hinges[j], added(center, scaled(-one, origins[j])));
            force[k] = force[k] - dot(lever(k), pushed) - dot(hinges[k], spun);
            let (along, about) = (scaled(m, lever(k)), turned(hinges[k]));
            for j in 0..=k {
                mass[k][j] = mass[k][j] + dot(along, lever(j)) + dot(about, hinges[j]);
            }
        }
    }
    solve(mass, force)
}
