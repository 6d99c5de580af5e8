//! Published values of stability in full digits: small damping in unequal parts, loads that come at once,
//! chains of many links, frequencies about L4.

#![allow(clippy::excessive_precision, reason = "reference values keep their digits")]

use std::f64::consts::PI;

use dynamics::analysis::{Banded, SpecialKind, StabilityVerdict, continuation, lowest_modes};
use dynamics::prelude::*;

use super::stability::moon::Moon;
use super::truss::{TRUSS, Truss};

/// Ziegler's column with a damper of its own in each joint, m = l = k = 1; O. N. Kirillov, Acta Polytechnica
/// 51/4 (2011) 32.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: [rad; 2])]
struct Column {
    c: [f64; 2],
    p: f64,
}
#[dynamics]
impl Column {
    fn joints(&self, q: &Coordinates<Self>) -> [Vec2; 2] {
        let first = vec2(q.phi[0].cos(), q.phi[0].sin());
        [first, first + vec2(q.phi[1].cos(), q.phi[1].sin())]
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b] = self.joints(q);
        a.dt().norm_squared() + 0.5 * b.dt().norm_squared()
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (q.phi[0].powi(2) + (q.phi[1] - q.phi[0]).powi(2))
    }
    #[dissipation]
    fn dampers(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * (self.c[0] * q.phi[0].dt().powi(2) + self.c[1] * (q.phi[1] - q.phi[0]).dt().powi(2))
    }
    #[force]
    fn follower(&self, q: &Coordinates<Self>) -> Force {
        let [_, end] = self.joints(q);
        Force::at(end, -self.p * vec2(q.phi[1].cos(), q.phi[1].sin()))
    }
}

/// Of Hurwitz's determinant, with a₂ = 7 − 2P + c₁c₂ and all the rest free of P: the flutter load is that of
/// vanishing damping plus c₁c₂/2, exactly.
#[test]
fn vanishing_damping_in_unequal_parts() {
    // c₁/c₂ and the limit. At 4 + 5√2 = 11.071 nothing is lost against no damping at all, (7/2 − √2) k/l.
    let published = [
        (0.5, 1.102_564_102_564_102_564_1),
        (1.0, 1.464_285_714_285_714_285_7),
        (2.0, 1.791_666_666_666_666_666_7),
        (4.0 + 50.0_f64.sqrt(), 2.085_786_437_626_904_951_2),
    ];
    for (ratio, limit) in published {
        for second in [1e-3, 0.1] {
            let c = [ratio * second, second];
            let family = |p: f64| Column { c, p };
            let start = family(0.0).state().build().unwrap();
            let branch = continuation(family).from(&start, 0.0).until(0.0..=2.5).run().unwrap();
            let flutter = branch.special.iter().find(|one| matches!(one.kind, SpecialKind::Hopf { .. }));
            let found = flutter.unwrap_or_else(|| panic!("{ratio}, {second}: {branch}")).parameter;
            let off = (found - 0.5 * c[0] * c[1]) / limit - 1.0;
            assert!(off.abs() < 1e-10, "{ratio}, {second}: off by {off:.1e}");
        }
        // The limit itself, without what is known of how it is approached: c₁c₂/2 is below 1e-9 here. Nearer
        // than 1e-7 of the load what grows is too little beside rounding to be told: damping times distance.
        let c = [ratio * 1e-5, 1e-5];
        let verdict = |p: f64| {
            let model = Column { c, p };
            model.stability(&model.state().build().unwrap()).unwrap().verdict
        };
        let below = verdict(limit * (1.0 - 1e-7));
        assert_eq!(below, StabilityVerdict::AsymptoticallyStable, "{ratio}: {below}");
        let above = verdict(limit * (1.0 + 1e-7));
        assert!(matches!(above, StabilityVerdict::Flutter { .. }), "{ratio}: {above}");
    }
}

/// A load that comes at once and stays snaps the truss where its energy reaches the top of the hill: V(z) =
/// V(h) there, with P the load at z.
#[test]
fn a_step_load_on_a_truss() {
    let (threshold, hill) = (0.029_180_954_916_405_365_95, 0.155_791_566_859_760_151_44);
    let model = Truss { load: threshold, ..TRUSS };
    let top = model.equilibrium(&model.state().z(0.15).build().unwrap()).unwrap();
    assert!((top.state.z() / hill - 1.0).abs() < 1e-12, "{top}");
    assert!(model.stability(&top.state).unwrap().is_unstable());
    // From rest to where it first turns round: short of the hill, or far beyond it.
    for (part, snaps) in [(1.0 - 1e-10, false), (1.0 + 1e-10, true)] {
        let model = Truss { load: threshold * part, ..TRUSS };
        let run = model.simulate(model.state().z(0.5).build().unwrap()).until(300.0).tolerance(1e-14);
        let motion =
            run.event("turns", |state| state.z_rate()).stop_at("turns", Direction::Rising).run().unwrap();
        let z = motion.end().z();
        match snaps {
            true => assert!(z < -0.5, "{part}: {z}"),
            false => assert!(z > hill && z < hill + 1e-4, "{part}: {z}"),
        }
    }
}

/// The truss by Green's strain: P = EA z (h² − z²)/L₀³; M. A. Crisfield, *Non-linear Finite Element
/// Analysis*, volume 1, chapter 1.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(z)]
struct Green {
    load: f64,
}
#[dynamics]
impl Green {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * q.z.dt().powi(2)
    }
    /// Two bars of EA = 1, free length √1.25: ½ EA L₀ e² each, e = (z² − h²)/(2 L₀²).
    #[potential]
    fn bars(&self, q: &Coordinates<Self>) -> Expr {
        let strain = (q.z.powi(2) - 0.25) / 2.5;
        1.25_f64.sqrt() * strain.powi(2)
    }
    #[force]
    fn load(&self, q: &Coordinates<Self>) -> Force {
        Force::along(q.z, -self.load)
    }
}

#[test]
fn a_truss_by_greens_strain() {
    let family = |load: f64| Green { load };
    let start = family(0.0).state().z(0.5).build().unwrap();
    let branch = continuation(family).from(&start, 0.0).until(-0.06..=0.06).run().unwrap();
    assert_eq!((branch.folds().count(), branch.special.len()), (2, 2), "{branch}");
    for (fold, sign) in branch.folds().zip([1.0, -1.0]) {
        let (limit, z) = (sign * 0.034_426_518_632_954_816_76, sign * 0.288_675_134_594_812_882_25);
        assert!((fold.parameter / limit - 1.0).abs() < 1e-12, "{fold:?}");
        assert!((fold.state.z() / z - 1.0).abs() < 1e-12, "{fold:?}");
    }
}

/// Ten links, clamped at the foot; each carries its mass in its own turning, of which no load knows.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: [rad; 10])]
struct Clamped {
    p: f64,
}
#[dynamics]
impl Clamped {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            sum += 0.5 * q.theta[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn springs_and_load(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = 0.5 * q.theta[0].powi(2) + self.p * q.theta[0].cos();
        for i in 1..10 {
            sum += 0.5 * (q.theta[i] - q.theta[i - 1]).powi(2) + self.p * q.theta[i].cos();
        }
        sum
    }
}

/// The same links, pinned at both ends: no spring at the foot, and the head stays above it.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(theta: [rad; 10])]
struct Pinned {
    p: f64,
}
#[dynamics]
impl Pinned {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            sum += 0.5 * q.theta[i].dt().powi(2);
        }
        sum
    }
    #[potential]
    fn springs_and_load(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = self.p * q.theta[0].cos();
        for i in 1..10 {
            sum += 0.5 * (q.theta[i] - q.theta[i - 1]).powi(2) + self.p * q.theta[i].cos();
        }
        sum
    }
    #[holonomic]
    fn head(&self, q: &Coordinates<Self>) -> Expr {
        let mut sum = Expr::ZERO;
        for i in 0..10 {
            sum += q.theta[i].sin();
        }
        sum
    }
}

/// The lowest three loads in k/l, of n links.
const CLAMPED: [(usize, [f64; 3]); 2] = [
    (10, [0.022_338_347_549_742_909_861, 0.198_062_264_195_161_747_53, 0.533_896_256_340_347_342_96]),
    (50, [0.000_967_435_416_023_870_158_51, 0.008_701_304_061_962_839_032, 0.024_139_120_518_486_558_504]),
];
const PINNED: [(usize, [f64; 3]); 2] = [
    (10, [0.097_886_967_409_692_855_767, 0.381_966_011_250_105_151_8, 0.824_429_495_415_053_741_66]),
    (50, [0.003_946_543_143_456_876_095_3, 0.015_770_597_371_044_337_900, 0.035_425_498_542_622_637_829]),
];

fn near(found: &[f64], wanted: &[f64]) {
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found / wanted - 1.0).abs() < 1e-10, "{found} {wanted}");
    }
}

#[test]
fn henckys_chains_of_ten_links() {
    let clamped = |p: f64| Clamped { p };
    let column = continuation(clamped).from(&clamped(0.0).state().build().unwrap(), 0.0).until(0.0..=4.0);
    let found: Vec<f64> = column.buckling().unwrap().loads.iter().map(|load| load.parameter).collect();
    assert_eq!(found.len(), 10, "{found:?}");
    near(&found, &CLAMPED[0].1);
    near(&found, &core::array::from_fn::<_, 10, _>(|j| 4.0 * ((2 * j + 1) as f64 * PI / 42.0).sin().powi(2)));

    let pinned = |p: f64| Pinned { p };
    let column = continuation(pinned).from(&pinned(0.0).state().build().unwrap(), 0.0).until(0.0..=4.0);
    let found: Vec<f64> = column.buckling().unwrap().loads.iter().map(|load| load.parameter).collect();
    assert_eq!(found.len(), 9, "{found:?}");
    near(&found, &PINNED[0].1);
    near(&found, &core::array::from_fn::<_, 9, _>(|j| 4.0 * ((j + 1) as f64 * PI / 20.0).sin().powi(2)));
}

/// As K x = P G x in banded matrices: angles where it is clamped, displacements of the joints where it is
/// pinned.
#[test]
fn henckys_chains_of_fifty_links() {
    let loads = |geometric: &Banded, stiffness: &Banded| -> Vec<f64> {
        lowest_modes(geometric, stiffness, 3).unwrap().frequencies.iter().map(|root| root * root).collect()
    };
    for (n, wanted) in CLAMPED {
        let mut stiffness = Banded::zeros(n, 1);
        for i in 0..n {
            stiffness.add(i, i, 1.0).unwrap();
            if i > 0 {
                stiffness.add(i - 1, i - 1, 1.0).unwrap();
                stiffness.add(i, i - 1, -1.0).unwrap();
            }
        }
        near(&loads(&Banded::diagonal(&vec![1.0; n]), &stiffness), &wanted);
    }
    let five = (5, [0.381_966_011_250_105_15, 1.381_966_011_250_105_2, 2.618_033_988_749_895]);
    for (n, wanted) in [five].into_iter().chain(PINNED) {
        let (mut geometric, mut stiffness) = (Banded::zeros(n - 1, 1), Banded::zeros(n - 1, 2));
        // Joints 1 … n − 1 move.
        let add = |to: &mut Banded, by: &[(usize, f64)]| {
            for &(i, a) in by {
                for &(j, b) in by {
                    if (1..n).contains(&i) && (1..=i).contains(&j) {
                        to.add(i - 1, j - 1, a * b).unwrap();
                    }
                }
            }
        };
        for joint in 1..n {
            add(&mut stiffness, &[(joint - 1, 1.0), (joint, -2.0), (joint + 1, 1.0)]);
        }
        for link in 1..=n {
            add(&mut geometric, &[(link - 1, -1.0), (link, 1.0)]);
        }
        near(&loads(&geometric, &stiffness), &wanted);
    }
}

#[test]
fn both_frequencies_about_l4() {
    let earth = Moon { mu: 0.012_150_585_6 };
    let near_it = earth.state().x(0.48).y(0.86).build().unwrap();
    let judged = earth.stability(&earth.equilibrium(&near_it).unwrap().state).unwrap();
    let mut found: Vec<f64> = judged.eigenvalues.iter().map(|x| x.im).collect();
    found.sort_by(f64::total_cmp);
    let (slow, fast) = (0.298_208_172_927_014_119_24, 0.954_500_856_783_026_697_83);
    assert_eq!(found.len(), 4, "{judged}");
    for (found, wanted) in found.iter().zip([-fast, -slow, slow, fast]) {
        assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
    }
    assert!(judged.eigenvalues.iter().all(|x| x.re.abs() < 1e-12), "{judged}");
}
