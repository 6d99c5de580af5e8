//! Every function of the language of models, switched constraints, and tables: also at corners, at values
//! that are no numbers, and far away.

use dynamics::prelude::*;

use crate::compiler::{compilers, folder};
use crate::driver::{given, parameters, run};

/// Largest difference of what `<math.h>` returns from what Rust returns, in units of the last place: most
/// often both call the same library.
const FEW_ULPS: u64 = 4;

/// A function in each output.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x, y)]
pub(crate) struct Functions {
    pub(crate) m: f64,
}

#[dynamics]
impl Functions {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (q.x.dt().powi(2) + q.y.dt().powi(2))
    }
    /// These have the bits of Rust.
    #[output]
    fn exact(&self, q: &Coordinates<Self>) -> [Expr; 12] {
        let (x, y) = (q.x, q.y);
        let chosen = if x < y { x } else { 2.0 * y };
        let other = if x <= y { y } else { x * y };
        let powers = [x.powi(5), x.powi(-3)];
        let [fifth, inverse] = powers;
        [
            x.sin(),
            x.cos(),
            x.abs(),
            x.signum(),
            x.min(y),
            x.max(y),
            x.sqrt(),
            fifth,
            inverse,
            chosen,
            other,
            x.sin() * y.cos(),
        ]
    }
    /// These as far as libraries agree.
    #[output]
    fn near(&self, q: &Coordinates<Self>) -> [Expr; 14] {
        let (x, y) = (q.x, q.y);
        [
            x.tan(),
            (0.3 * x).asin(),
            (0.3 * x).acos(),
            x.atan(),
            x.sinh(),
            x.cosh(),
            x.tanh(),
            x.exp(),
            x.ln(),
            x.cbrt(),
            y.atan2(x),
            x.hypot(y),
            x.powf(y),
            (x * x).powf(y),
        ]
    }
}

/// A bob on a rod that hangs on a hook, each of which can be released.
#[derive(Clone, Debug, Dynamics)]
#[model(targets(c))]
#[coordinates(x: m, y: m, px: m, py: m)]
#[units(m: kg, l: m, g: m / s^2)]
pub(crate) struct Hook {
    pub(crate) m: f64,
    pub(crate) l: f64,
    pub(crate) g: f64,
}

#[dynamics]
impl Hook {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (vec2(q.x, q.y).dt().norm_squared() + vec2(q.px, q.py).dt().norm_squared())
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (q.y + q.py)
    }
    #[holonomic]
    fn wall(&self, q: &Coordinates<Self>) -> Expr {
        q.px
    }
    #[holonomic(switched)]
    fn rod(&self, q: &Coordinates<Self>) -> Expr {
        (vec2(q.x, q.y) - vec2(q.px, q.py)).norm_squared() - self.l.powi(2)
    }
    #[holonomic(switched)]
    fn hook(&self, q: &Coordinates<Self>) -> Expr {
        q.py
    }
    #[output]
    fn tension(&self, q: &Coordinates<Self>) -> Expr {
        -2.0 * self.l * q.reaction(Self::rod)
    }
}

/// The distance of two numbers, in numbers between them.
fn ulps(a: f64, b: f64) -> u64 {
    let place = |x: f64| {
        let bits = x.to_bits() as i64;
        if bits < 0 { i64::MIN.wrapping_sub(bits) } else { bits }
    };
    place(a).abs_diff(place(b))
}

#[test]
fn functions_are_those_of_rust() {
    let model = Functions { m: 1.5 };
    let values = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        2.0,
        -3.3,
        1e-300,
        5e-324,
        1e300,
        -1e300,
        1e5,
        2e6,
        -7.5e8,
        core::f64::consts::FRAC_PI_2,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    let pairs: Vec<(f64, f64)> = values.iter().flat_map(|x| values.map(|y| (*x, y))).collect();
    let states: Vec<_> = pairs
        .iter()
        .map(|(x, y)| FunctionsState::new(0.0, [*x, *y].into(), [0.0; 2].into(), Default::default()))
        .collect();
    for compiler in compilers() {
        let all: Vec<_> =
            states.iter().map(|state| given::<Functions>(state, [&[f64::NAN; 2], &[], &[]])).collect();
        let folder = folder(&format!("functions_{compiler}"));
        let results = run(&model.in_c().library_sines(), &compiler, &folder, &parameters(&model), &all);
        let mut most = 0;
        for (state, found) in states.iter().zip(&results) {
            let mut expected = [f64::NAN; 26];
            model.outputs(state, &mut expected).unwrap();
            let found = &found[found.len() - expected.len()..];
            for (i, (expected, found)) in expected.iter().zip(found).enumerate() {
                if expected.is_nan() && found.is_nan() {
                    continue;
                }
                let apart = ulps(*expected, *found);
                let name = Functions::OUTPUTS[i].name;
                let bound = if i < 12 && !dynamics::sin_cos::FUSED { 0 } else { FEW_ULPS };
                assert!(apart <= bound, "{name}: {expected:e} in Rust, {found:e} in C, {state:?}");
                most = most.max(apart);
            }
        }
        eprintln!("{compiler}: at most {most} units in the last place");
    }
}

/// Accelerations on a track with knots, beyond its ends, too.
#[test]
fn tables_are_continued_as_in_rust() {
    let knots = [0.0, 0.5, 1.5, 2.0, 3.0];
    let natural = CubicSpline::natural(&knots, &[0.0, 0.7, -0.2, 0.4, 0.0]).unwrap();
    let periodic = CubicSpline::periodic(&knots, &[0.0, 0.7, -0.2, 0.4, 0.0]).unwrap();
    for (name, track) in [("natural", natural), ("periodic", periodic)] {
        let model = crate::models::Bead { m: 0.3, g: 9.81, track };
        let places: Vec<f64> = (-80..=80).map(|i| f64::from(i) / 8.0).collect();
        let states: Vec<_> =
            places.iter().map(|x| model.state().x(*x).x_rate(1.5).build().unwrap()).collect();
        for compiler in compilers() {
            let all: Vec<_> = states
                .iter()
                .map(|state| given::<crate::models::Bead>(state, [&[f64::NAN], &[], &[]]))
                .collect();
            let folder = folder(&format!("tables_{name}_{compiler}"));
            let results = run(&model.in_c(), &compiler, &folder, &parameters(&model), &all);
            for (state, found) in states.iter().zip(&results) {
                let expected = model.accelerations(state).unwrap()[0];
                let same = expected.to_bits() == found[1].to_bits() || expected.is_nan() && found[1].is_nan();
                assert!(same || dynamics::sin_cos::FUSED, "{expected:e}, {:e}, {state:?}", found[1]);
            }
        }
    }
}
