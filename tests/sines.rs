//! Sines and cosines of derived models: the inlined ones side by side, and the platform's where a model asks for them.

use dynamics::prelude::*;
use dynamics::sin_cos;

macro_rules! turning {
    ($name:ident, $($sines:ident)?) => {
        /// Unit inertias; the forces are −a cos θ + b sin θ.
        #[derive(Clone, Debug, Dynamics)]
        #[coordinates(theta: [_; 7], alone)]
        $(#[model(sin_cos = $sines)])?
        struct $name {
            a: f64,
            b: f64,
        }

        #[dynamics]
        impl $name {
            fn height(&self, angle: Expr) -> Expr {
                self.a * angle.sin() + self.b * angle.cos()
            }
            #[kinetic]
            fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
                let mut sum = 0.5 * q.alone.dt().powi(2);
                for i in 0..7 {
                    sum += 0.5 * q.theta[i].dt().powi(2);
                }
                sum
            }
            #[potential]
            fn potential(&self, q: &Coordinates<Self>) -> Expr {
                // One sine that needs another: it cannot stand beside it.
                let mut sum = 0.5 * (q.alone - q.alone.sin()).sin().powi(2);
                for i in 0..7 {
                    sum += self.height(q.theta[i]);
                }
                sum
            }
        }
    };
}

turning!(Inlined,);
turning!(Fast, fast);
turning!(Accurate, accurate);

/// The cosines and sines that a model evaluates.
macro_rules! evaluated {
    ($model:ident, $angles:expr) => {{
        let (mut cosines, mut sines) = ([0.0; 7], [0.0; 7]);
        for (a, b) in [(1.0, 0.0), (0.0, 1.0)] {
            let model = $model { a, b };
            let mut state = model.state().theta($angles).build().expect("finite values");
            state.set_alone(0.3);
            let accelerations = model.accelerations(&state).expect("unit inertias");
            for i in 0..7 {
                if b == 0.0 { cosines[i] = -accelerations[i] } else { sines[i] = accelerations[i] }
            }
        }
        (cosines, sines)
    }};
}

/// Seven angles, one of them large in some of the rounds.
fn angles(round: u32) -> [f64; 7] {
    let mut angles = std::array::from_fn(|i| 0.377 * f64::from(round) - 20.0 + 1.7 * i as f64);
    if round.is_multiple_of(5) {
        angles[round as usize % 7] = 1.3 * 10f64.powi(4 + (round / 5) as i32);
    }
    angles
}

#[test]
fn side_by_side_they_are_the_inlined_ones() {
    for round in 0..100 {
        let angles = angles(round);
        let expected = (angles.map(sin_cos::cos), angles.map(sin_cos::sin));
        assert_eq!(evaluated!(Inlined, angles), expected, "{angles:?}");
        assert_eq!(evaluated!(Fast, angles), expected, "{angles:?}");
    }
}

#[test]
fn on_request_they_are_the_platform_s() {
    let mut differ = 0;
    for round in 0..100 {
        let angles = angles(round);
        let platform = (angles.map(f64::cos), angles.map(f64::sin));
        assert_eq!(evaluated!(Accurate, angles), platform, "{angles:?}");
        differ += usize::from(evaluated!(Inlined, angles) != platform);
    }
    // Otherwise the option would not be seen to do anything.
    assert!(differ > 0);
}

/// A sine of a sine, by hand: a = −s cos(θ − sin θ) (1 − cos θ) with s = sin(θ − sin θ).
#[test]
fn one_within_another() {
    let model = Inlined { a: 0.0, b: 0.0 };
    for k in 0..50 {
        let theta = 0.13 * f64::from(k) - 3.0;
        let state = model.state().alone(theta).build().expect("finite values");
        let inner = theta - theta.sin();
        let expected = -inner.sin() * inner.cos() * (1.0 - theta.cos());
        let acceleration = model.accelerations(&state).expect("unit inertias")[7];
        assert!((acceleration - expected).abs() < 4e-16, "{theta}: {acceleration} {expected}");
    }
}
