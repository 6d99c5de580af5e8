//! The choice of lanes at run time.

use core::marker::PhantomData;
use core::sync::atomic::{AtomicUsize, Ordering};

use crate::lanes::{Code, Lanes};
use crate::pair::Pair;
use crate::portable::Portable;

/// Code for any lanes: [`in_four_lanes`] and [`in_widest_lanes`] choose the type. Implementations are inlined
/// as those of [`Code`] are.
pub trait Task {
    /// What it returns.
    type Output;
    /// The code.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// A task with the lanes that were chosen.
struct With<L, T>(T, PhantomData<L>);

impl<L: Lanes, T: Task> Code for With<L, T> {
    type Output = T::Output;
    #[inline(always)]
    fn run(self) -> T::Output {
        self.0.run::<L>()
    }
}

#[inline(always)]
fn run_with<L: Lanes, T: Task>(task: T) -> T::Output {
    L::call(With::<L, T>(task, PhantomData))
}

/// Runs a task with four lanes of the widest vectors that the processor has.
#[inline(always)]
pub fn in_four_lanes<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if crate::x86::has_four_lanes() {
        return run_with::<crate::x86::Avx2<false>, T>(task);
    }
    run_with::<Portable, T>(task)
}

/// Bits of the widest vectors that [`in_widest_lanes`] and [`in_fused_lanes`] may use.
static WIDEST: AtomicUsize = AtomicUsize::new(usize::MAX);

/// Limits the vectors that [`in_widest_lanes`] and [`in_fused_lanes`] use, of the whole process: to 128, 256
/// or 512 bits. Results do not depend on it, but that [`in_fused_lanes`] fuses nothing in 128 bits. It is for
/// measurements, and for tests that compare the bits of results.
pub fn limit_vectors(bits: usize) {
    WIDEST.store(bits, Ordering::Relaxed);
}

/// Runs a task with the most lanes that one vector of the processor has, but at least four.
#[inline(always)]
pub fn in_widest_lanes<T: Task>(task: T) -> T::Output {
    let bits = WIDEST.load(Ordering::Relaxed);
    #[cfg(target_arch = "x86_64")]
    if bits >= 512 && crate::x86::has_eight_lanes() {
        return run_with::<crate::x86::Avx512<false>, T>(task);
    }
    if bits >= 256 { in_four_lanes(task) } else { run_with::<Portable, T>(task) }
}

/// Runs a task with two of the widest vectors that the processor has, whose operations fill each other's
/// gaps, and with fused products where the processor has them. Results may differ in their last digits
/// between processors with these instructions and others.
#[inline(always)]
pub fn in_fused_lanes<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    let bits = WIDEST.load(Ordering::Relaxed);
    #[cfg(target_arch = "x86_64")]
    if bits >= 512 && crate::x86::has_eight_lanes() {
        return run_with::<Pair<crate::x86::Avx512<true>>, T>(task);
    }
    #[cfg(target_arch = "x86_64")]
    if bits >= 256 && crate::x86::has_four_lanes() {
        return run_with::<Pair<crate::x86::Avx2<true>>, T>(task);
    }
    run_with::<Pair<Portable>, T>(task)
}

/// Whether [`in_fused_lanes`] has fused products on this processor.
#[must_use]
pub fn has_fused_lanes() -> bool {
    /// Asks the lanes.
    struct Fused;
    impl Task for Fused {
        type Output = bool;
        #[inline(always)]
        fn run<L: Lanes>(self) -> bool {
            L::FUSED
        }
    }
    in_fused_lanes(Fused)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::sines as sin_cos;

    /// Checks one type of lanes. All checks run with every type that the processor has.
    struct Check(fn(&mut dyn Checked));

    /// Lanes behind functions of arrays, so that a check need not be generic.
    trait Checked {
        fn count(&self) -> usize;
        /// Whether products are fused.
        fn fuses(&self) -> bool;
        /// An operation of two vectors.
        fn binary(&self, name: &str, a: &[f64], b: &[f64]) -> Vec<f64>;
        /// Sines and cosines.
        fn sines(&self, x: &[f64]) -> [Vec<f64>; 2];
        /// `exceed` and `exceed_signed`.
        fn exceeds(&self, x: &[f64], scale: &[f64]) -> [bool; 2];
    }

    struct Type<L>(PhantomData<L>);

    impl<L: Lanes> Checked for Type<L> {
        fn count(&self) -> usize {
            L::COUNT
        }
        fn fuses(&self) -> bool {
            L::FUSED
        }
        fn binary(&self, name: &str, a: &[f64], b: &[f64]) -> Vec<f64> {
            let (x, y) = (L::load(a), L::load(b));
            let mask = |mask| L::splat(1.0).or(mask, L::zero());
            let found = match name {
                "add" => x + y,
                "sub" => x - y,
                "mul" => x * y,
                "div" => x / y,
                "neg" => -x,
                "abs" => x.abs(),
                "sqrt" => x.sqrt(),
                "times_plus" => x.times_plus(y, x),
                "times_minus" => x.times_minus(y, x),
                "minus_product" => x.minus_product(y, x),
                "less" => mask(x.less(y)),
                "at_most" => mask(x.at_most(y)),
                "not" => mask(!x.less(y)),
                "either" => mask(x.less(y) | y.less(x)),
                "both" => mask(x.at_most(y) & y.at_most(x)),
                "or" => x.or(L::mask(MASK), y),
                "map" => x.map(|x| x + 1.0),
                "zip" => x.zip(y, |x, y| x - 2.0 * y),
                _ => L::splat(x.lane(0)).with_lane(L::COUNT - 1, y.lane(L::COUNT - 1)),
            };
            (0..L::COUNT).map(|i| found.lane(i)).collect()
        }
        fn sines(&self, x: &[f64]) -> [Vec<f64>; 2] {
            let (s, c) = L::load(x).sin_cos();
            [s, c].map(|x| (0..L::COUNT).map(|i| x.lane(i)).collect())
        }
        fn exceeds(&self, x: &[f64], scale: &[f64]) -> [bool; 2] {
            let (x, scale) = (L::load(x), L::load(scale));
            [x.exceed(1.0, scale), x.exceed_signed(1.0, scale)]
        }
    }

    impl Task for Check {
        type Output = usize;
        fn run<L: Lanes>(self) -> usize {
            (self.0)(&mut Type::<L>(PhantomData));
            L::COUNT
        }
    }

    fn check(each: fn(&mut dyn Checked)) {
        assert_eq!(run_with::<f64, _>(Check(each)), 1);
        assert_eq!(run_with::<Portable, _>(Check(each)), 4);
        assert_eq!(in_four_lanes(Check(each)), 4);
        assert!([4, 8].contains(&in_widest_lanes(Check(each))));
        assert!([8, 16].contains(&in_fused_lanes(Check(each))));
    }

    /// Lanes of every vector of the widest type.
    const MASK: u32 = 0b0110_1001_1010_0110;

    const NUMBERS: [f64; 12] =
        [1.5, -2.0, 0.1, -0.0, 0.0, 3.0e-9, f64::NAN, -7.25, f64::INFINITY, 1e300, 5e-324, 2.0];

    fn is_same(a: f64, b: f64) -> bool {
        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
    }

    /// Every operation has the bits of `f64` in every lane.
    #[test]
    fn operations_are_those_of_one_number() {
        check(|lanes| {
            for shift in 0..NUMBERS.len() {
                let at = |i: usize| NUMBERS[i % NUMBERS.len()];
                let a: Vec<f64> = (0..16).map(|i| at(i + shift)).collect();
                for other in 0..NUMBERS.len() {
                    let b: Vec<f64> = (0..16).map(|i| at(5 * i + other)).collect();
                    let yes = |is: bool| f64::from(u8::from(is));
                    for (name, expected) in [
                        ("add", (|a, b, _| a + b) as fn(f64, f64, usize) -> f64),
                        ("sub", |a, b, _| a - b),
                        ("mul", |a, b, _| a * b),
                        ("div", |a, b, _| a / b),
                        ("neg", |a, _, _| -a),
                        ("abs", |a, _, _| a.abs()),
                        ("sqrt", |a, _, _| a.sqrt()),
                        ("or", |a, b, i| if MASK >> i & 1 == 1 { a } else { b }),
                        ("map", |a, _, _| a + 1.0),
                        ("zip", |a, b, _| a - 2.0 * b),
                    ] {
                        for (i, found) in lanes.binary(name, &a, &b).into_iter().enumerate() {
                            let expected = expected(a[i], b[i], i);
                            assert!(is_same(found, expected), "{name} of {} and {}: {found}", a[i], b[i]);
                        }
                    }
                    for (name, expected, fused) in [
                        (
                            "times_plus",
                            (|a, b| a * b + a) as fn(f64, f64) -> f64,
                            (|a, b| a.mul_add(b, a)) as fn(f64, f64) -> f64,
                        ),
                        ("times_minus", |a, b| a * b - a, |a, b| a.mul_add(b, -a)),
                        ("minus_product", |a, b| a - b * a, |a, b| (-b).mul_add(a, a)),
                    ] {
                        for (i, found) in lanes.binary(name, &a, &b).into_iter().enumerate() {
                            let expected = if lanes.fuses() { fused } else { expected }(a[i], b[i]);
                            assert!(is_same(found, expected), "{name} of {} and {}: {found}", a[i], b[i]);
                        }
                    }
                    for (name, expected) in [
                        ("less", (|a, b| a < b) as fn(f64, f64) -> bool),
                        ("at_most", |a, b| a <= b),
                        ("not", |a, b| a.partial_cmp(&b) != Some(core::cmp::Ordering::Less)),
                        ("either", |a, b| a < b || b < a),
                        ("both", |a, b| a == b),
                    ] {
                        for (i, found) in lanes.binary(name, &a, &b).into_iter().enumerate() {
                            assert_eq!(found, yes(expected(a[i], b[i])), "{name} of {} and {}", a[i], b[i]);
                        }
                    }
                    let placed = lanes.binary("with_lane", &a, &b);
                    let last = lanes.count() - 1;
                    assert!(is_same(placed[last], b[last]) && (last == 0 || is_same(placed[0], a[0])));
                }
            }
        });
    }

    /// The same bits as one by one, in every quarter, near and far.
    #[test]
    fn sines_beside_others_are_those_of_one() {
        check(|lanes| {
            let compare = |angles: [f64; 16]| {
                let [sines, cosines] = lanes.sines(&angles);
                for (i, (s, c)) in sines.into_iter().zip(cosines).enumerate() {
                    if lanes.fuses() != sin_cos::FUSED {
                        // Other roundings: both within 0.8 units in the last place.
                        let exact = angles[i].sin_cos();
                        let near = |x: f64, y: f64| (x - y).abs() <= 1.5 * f64::EPSILON * y.abs();
                        assert!(exact.0.is_nan() || near(s, exact.0) && near(c, exact.1), "{angles:?}");
                        continue;
                    }
                    let expected = sin_cos::fast(angles[i]);
                    assert!(is_same(s, expected.0) && is_same(c, expected.1), "{angles:?}");
                }
            };
            let mut x = 1.0e-3;
            while x < sin_cos::LARGEST_REDUCED {
                let near = [x, -x, x + 0.7, 2.0 - x, 0.5 * x, x - 11.0, 1.0 / x, -0.1 * x];
                compare(core::array::from_fn(|i| near[i % 8] * if i < 8 { 1.0 } else { 0.999 }));
                x *= 1.003_7;
            }
            for far in [f64::NAN, f64::INFINITY, -2e6, sin_cos::LARGEST_REDUCED, 1e300, -0.0, 5e-324] {
                for at in 0..16 {
                    compare(core::array::from_fn(|i| if i == at { far } else { i as f64 }));
                }
            }
        });
    }

    /// One lane that does not is enough, as is one that is no number.
    #[test]
    fn what_exceeds_does_so_in_every_lane() {
        check(|lanes| {
            let scale = [-2.0; 16];
            let signs: [f64; 16] =
                core::array::from_fn(|i| [3.0, -3.0, 2.5, 9.0, -4.0, 2.1, 7.0, -9.0][i % 8]);
            assert_eq!(lanes.exceeds(&signs, &scale), [true, lanes.count() == 1]);
            assert_eq!(lanes.exceeds(&[3.0; 16], &scale), [true; 2]);
            for bad in [2.0, f64::NAN, -0.5, 0.0] {
                for at in 0..lanes.count() {
                    let mut x = [3.0; 16];
                    x[at] = bad;
                    assert_eq!(lanes.exceeds(&x, &scale), [false; 2], "{bad} at {at}");
                }
            }
        });
    }
}
