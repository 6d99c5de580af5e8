//! Routh's reduction: what is left when the momenta of ignorable coordinates are held, of a heavy top in
//! Euler's angles.
//!
//! ```text
//! T = ½A (θ̇² + φ̇² sin²θ) + ½C (ψ̇ + φ̇ cos θ)²        V = m g l cos θ        φ, ψ ignorable
//! R = ½A θ̇² − (p_φ − p_ψ cos θ)²/(2A sin²θ) − m g l cos θ        steady: φ̇ (p_ψ − A φ̇ cos θ) = m g l
//! beside it: ω² = (p_ψ − 2A φ̇ cos θ)²/A² + φ̇² sin²θ
//! ```
//!
//! E. J. Routh, *Stability of a Given State of Motion* (1877); H. Goldstein, *Classical Mechanics*, §5.7 and
//! §8.3.

use dynamics::analysis::StabilityVerdict;
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad, theta: rad, psi: rad)]
#[units(across: kg * m^2, along: kg * m^2, weight: N * m)]
struct Top {
    across: f64,
    along: f64,
    weight: f64,
}
#[dynamics]
impl Top {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let turn = q.psi.dt() + q.phi.dt() * q.theta.cos();
        0.5 * self.across * (q.theta.dt().powi(2) + (q.phi.dt() * q.theta.sin()).powi(2))
            + 0.5 * self.along * turn.powi(2)
    }
    #[potential]
    fn height(&self, q: &Coordinates<Self>) -> Expr {
        self.weight * q.theta.cos()
    }
}

#[test]
fn a_top_precesses_steadily_and_nods_as_its_routhian_says() {
    let top = Top { across: 0.05, along: 0.01, weight: 0.5 * 9.81 * 0.1 };
    for (theta, precession) in [(0.4_f64, 1.5), (1.0, 2.5), (2.0, 4.0), (1.2, -3.0)] {
        // p_ψ = C (ψ̇ + φ̇ cos θ) from steadiness.
        let p_psi = top.weight / precession + top.across * precession * theta.cos();
        let spin = p_psi / top.along - precession * theta.cos();
        let start = top.state().theta(theta + 0.05).phi_rate(precession).psi_rate(spin).build().unwrap();
        let one = top.steady(&start).unwrap();
        assert!((one.state.theta() - theta).abs() < 1e-12, "{theta}: {one}");
        let judged = top.stability(&one.state).unwrap();
        assert_eq!(judged.ignorable.iter().map(|q| q.name).collect::<Vec<_>>(), ["phi", "psi"], "{judged}");
        let nod = (p_psi - 2.0 * top.across * precession * theta.cos()) / top.across;
        let square = nod * nod + (precession * theta.sin()).powi(2);
        assert!((judged.least_omega_squared.unwrap() / square - 1.0).abs() < 1e-11, "{judged} {square}");
        assert_eq!(judged.verdict, StabilityVerdict::Stable, "{judged}");
        // And so does the motion: pushed a little with the same momenta, it nods with that period.
        let mut pushed = one.state;
        pushed.u_mut()[1] = 1e-4;
        let period = std::f64::consts::TAU / square.sqrt();
        let end = top.simulate(pushed).until(period).tolerance(1e-12).run().unwrap().end();
        assert!(
            (end.theta() - theta).abs() < 1e-7 && (end.theta_rate() - 1e-4).abs() < 1e-7,
            "{theta}: {end:?}"
        );
    }
}
