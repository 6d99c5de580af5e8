//! Sizes that do not suit a model, states given by name, and loops written by hand.
#![allow(missing_docs, unreachable_pub, reason = "models as users write them")]

use dynamics::families::model::{FamilyModel as _, FamilyState as _, Length, SizeError};
use dynamics::families::state::FamilyStateError;
use dynamics::prelude::*;

use super::harness::{Numbers, SIZES, assert_close, forces, matrix, random};

/// Beads with their masses and springs, both ends held. Springs to the second neighbour pull, too.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(load: m, s: [m; self.beads])]
#[inputs(push: N)]
#[units(mass: kg, k: N / m, far: N / m)]
pub struct Beads {
    pub beads: usize,
    pub mass: Vec<f64>,
    pub k: Box<[f64]>,
    pub far: f64,
}

#[dynamics]
impl Beads {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let beads: Expr = (0..self.beads).map(|i| 0.5 * self.mass[i] * q.s[i].dt().powi(2)).sum();
        beads + 0.5 * self.mass[self.beads] * q.load.dt().powi(2)
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * self.k[0] * q.s[0].powi(2);
        for i in 1..self.beads {
            sum += 0.5 * self.k[i] * (q.s[i] - q.s[i - 1]).powi(2);
        }
        sum + 0.5 * self.k[self.beads] * (q.load - q.s[self.beads - 1]).powi(2)
    }
    #[potential]
    fn far(&self, q: &Coordinates<Self>) -> Expr {
        (0..self.beads - 2).map(|i| 0.5 * self.far * (q.s[i + 2] - q.s[i]).powi(2)).sum()
    }
    #[force]
    fn push(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.load, q.push)
    }
    #[output]
    fn stretch(&self, q: &Coordinates<Self>) -> Expr {
        q.load - q.s[self.beads - 1]
    }
}

fn beads(beads: usize) -> Beads {
    let mut numbers = Numbers::new(5);
    let mut positive = |n| numbers.vec(n, 0.5).iter().map(|x| 1.0 + x).collect::<Vec<f64>>();
    Beads { beads, mass: positive(beads + 1), k: positive(beads + 1).into(), far: 0.3 }
}

#[test]
fn loops_equal_loops_by_hand() {
    for n in SIZES.into_iter().filter(|n| *n >= 2) {
        let model = beads(n);
        let state = random(&model, &mut Numbers::new(n as u64), 1.0);
        let (load, s) = (state.load(), state.s());
        assert_eq!(state.q()[0], load);
        assert_eq!(&state.q()[1..], s);
        let mut expected = vec![0.0; n + 1];
        let mut pull = |a: usize, b: usize, stiffness: f64| {
            let tension = stiffness * (state.q()[b] - state.q()[a]);
            expected[a] += tension;
            expected[b] -= tension;
        };
        for i in 1..n {
            pull(i, i + 1, model.k[i]);
        }
        for i in 0..n - 2 {
            pull(i + 1, i + 3, model.far);
        }
        pull(n, 0, model.k[n]);
        expected[1] -= model.k[0] * s[0];
        expected[0] += state.push();
        assert_close("forces", &forces(&model, state.view()), &expected, 1e-14);
        let mass = matrix(n + 1, |add| model.mass(add));
        assert_eq!(mass[(0, 0)], model.mass[n]);
        assert!((0..n).all(|i| mass[(i + 1, i + 1)] == model.mass[i]));
        assert_eq!(mass.iter().filter(|m| **m != 0.0).count(), n + 1);
    }
}

#[test]
fn sizes_that_do_not_suit() {
    for n in [0, 1] {
        let error = Beads { beads: n, ..beads(5) }.ends().unwrap_err();
        assert_eq!(error, SizeError::TooFew { count: "beads", value: n, least: 2 });
    }
    let error = Beads { beads: 1, ..beads(5) }.state().build().unwrap_err();
    assert_eq!(error.to_string(), "`beads` is 1; this model needs at least 2");
    let short = Beads { beads: 7, ..beads(5) };
    let error = short.ends().unwrap_err();
    assert!(matches!(error, SizeError::TooShort { length: 6, last: 6 | 7, .. }), "{error:?}");
    let short = Beads { mass: vec![1.0; 4], ..beads(5) };
    let error = short.ends().unwrap_err();
    assert!(matches!(error, SizeError::TooShort { parameter: "mass", length: 4, .. }), "{error:?}");
    assert_eq!(error.to_string(), "`mass` has 4 elements; the model reads `mass[5]`");
    let short = Beads { k: Box::new([1.0; 5]), ..beads(5) };
    let error = short.state().build().unwrap_err();
    assert_eq!(error.to_string(), "`k` has 5 elements; the model reads `k[5]`");
    let many = Beads { beads: usize::MAX / 8, ..beads(5) };
    let error = many.ends().unwrap_err();
    assert!(matches!(error, SizeError::TooMany { count: "beads", .. }), "{error:?}");
    // Longer ones are no mistake.
    assert!(Beads { mass: vec![1.0; 40], ..beads(5) }.ends().is_ok());
}

#[test]
fn states_by_name() {
    let model = beads(4);
    let state = model
        .state()
        .load(2.0)
        .load_rate(-1.0)
        .s((0..4).map(f64::from))
        .s_rate([0.5; 4])
        .push(3.0)
        .at_time(0.25)
        .build()
        .expect("four values for four beads");
    assert_eq!((state.t(), state.load(), state.load_rate(), state.push()), (0.25, 2.0, -1.0, 3.0));
    assert_eq!((state.s(), state.s_rate()), (&[0.0, 1.0, 2.0, 3.0][..], &[0.5; 4][..]));
    assert_eq!(state.q(), [2.0, 0.0, 1.0, 2.0, 3.0]);
    assert_eq!(state.ends()[..], [1, 5]);
    let rest = model.state().build().expect("all is left at 0");
    assert!(rest.q().iter().chain(rest.u()).all(|x| *x == 0.0) && rest.push().is_nan());
    let error = model.state().s([1.0; 3]).build().unwrap_err();
    assert_eq!(error.to_string(), "`s` has 4 nodes, and 3 values are given for it");
    let error = model.state().s_rate([1.0; 5]).build().unwrap_err();
    assert_eq!(error, FamilyStateError::Length { name: "s_rate".into(), length: 4, given: 5 });
    let error = model.state().s([0.0, 1.0, f64::NAN, 0.0]).build().unwrap_err();
    assert_eq!(error.to_string(), "`s[2]` is NaN; give it a finite value");
    let error = model.state().load_rate(f64::INFINITY).build().unwrap_err();
    assert_eq!(error.to_string(), "`load_rate` is inf; give it a finite value");
    let mut state = rest;
    state.s_mut()[3] = 4.0;
    state.s_rate_mut()[0] = 5.0;
    state.set_load(6.0);
    state.set_load_rate(7.0);
    state.set_push(8.0);
    assert_eq!((state.q(), state.u()[..2].to_vec()), (&[6.0, 0.0, 0.0, 0.0, 4.0][..], vec![7.0, 5.0]));
    assert_eq!(state.inputs(), [8.0]);
}

#[test]
fn what_a_model_says_of_itself() {
    let names: Vec<&str> = Beads::FIELDS.iter().map(|field| field.name).collect();
    assert_eq!(names, ["load", "s"]);
    assert_eq!(Beads::FIELDS[0].length, Length::One);
    assert_eq!(Beads::FIELDS[1].length, Length::Count { count: "beads", plus: 0 });
    assert_eq!((Beads::FIELDS[1].unit, Beads::INPUTS[0].unit, Beads::OUTPUTS[0].unit), ("m", "N", "m"));
    let facts = [Beads::CONSERVATIVE, Beads::VELOCITY_FORCES, Beads::DIAGONAL];
    assert_eq!(facts, [false, false, true]);
}
