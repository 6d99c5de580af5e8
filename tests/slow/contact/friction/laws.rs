//! Forces that go by the reactions of the same instant in another way than Coulomb's: what solves them, and
//! what is told where nothing was found.

use dynamics::constrain::solve_once;
use dynamics::error::SolveError;
use dynamics::prelude::*;

use crate::wheelset;

use wheelset::Wheelset;

/// The wheelset at x, y, z, θ, φ with the contact points (ψ, ξ) of both wheels and velocities.
fn wheelset(p: [f64; 5], contacts: [f64; 4], v: [f64; 6]) -> (Wheelset, State<Wheelset>) {
    let mut model = Wheelset::published();
    for missed in [true, false] {
        let start = model.state().x(p[0]).y_guess(p[1]).z(p[2]).theta(p[3]).phi_guess(p[4]);
        let start = start.psi_left_guess(contacts[0]).xi_left_guess(contacts[1]);
        let start = start.psi_right_guess(contacts[2]).xi_right_guess(contacts[3]);
        let start = start.x_rate(v[0]).z_rate(v[2]).theta_rate(v[3]).beta_rate(v[5]);
        let start = start.assemble().unwrap();
        if !missed {
            return (model, start);
        }
        let mut published = start;
        published.q.as_mut_slice().copy_from_slice(&[
            p[0],
            p[1],
            p[2],
            p[3],
            p[4],
            0.0,
            contacts[0],
            contacts[1],
            contacts[2],
            contacts[3],
        ]);
        let gaps = model.residual(&published);
        (model.gap_left, model.gap_right) = (gaps[0], gaps[1]);
    }
    unreachable!()
}

/// λ at the published start, where it is an approximation, and at the published end, which is that of the
/// published Fortran, run at 1e-12 and 1e-13, which agree to 8 digits and more.
#[test]
fn creep_forces_of_a_wheelset_are_solved_with_its_normal_forces() {
    let start = [0.14941e-2, 0.40089e-6, 0.11241e-5, -0.28573e-3, 0.26459e-3];
    let contacts = [-7.412238035766714e-6, -0.1521364296121248, 7.563440639517294e-6, 0.1490635714733819];
    let end = [
        8.63553825324552e-3,
        1.303834114342201e-5,
        -9.363581148210597e-5,
        -1.364229595410239e-2,
        1.529289421816618e-3,
    ];
    let end_contacts =
        [-3.366674257456237e-4, -1.594942563762444e-1, 3.783960360262247e-4, 1.417321500950541e-1];
    let end_rates = [
        -7.698524079018815e-2,
        -2.515106367564128e-4,
        2.054114870611125e-3,
        -2.390484031176063e-1,
        -1.36334448372505e-2,
        -2.442137054509622e-1,
    ];
    // λ₁ is of the wheel with ξ > 0.
    for (p, contacts, v, [right, left], digits) in [
        (start, contacts, [0.0; 6], [-83.593, -74.144], 5e-5),
        (end, end_contacts, end_rates, [-101.2404499987827, -56.28562902878363], 1e-8),
    ] {
        let (model, state) = wheelset(p, contacts, v);
        let constants = model.constants().unwrap();
        let solved = solve_once(&model, &constants, &state).unwrap();
        let lambda = solved.multipliers;
        assert!((lambda[0] / left - 1.0).abs() < digits, "{lambda} instead of {left}");
        assert!((lambda[1] / right - 1.0).abs() < digits, "{lambda} instead of {right}");
        // The rates that follow are those that are published.
        assert!((state.y_rate() - v[1]).abs() < 1e-9 && (state.phi_rate() - v[4]).abs() < 1e-9, "{state:?}");
    }
    let (model, state) = wheelset(start, contacts, [0.0; 6]);
    let motion = model.simulate(state).until(0.02).tolerance(1e-8).run().unwrap();
    let finer = model.simulate(state).until(0.02).tolerance(1e-11).run().unwrap();
    assert!((motion.end().q - finer.end().q).amax() < 1e-8, "{} {}", motion.end().q, finer.end().q);
}

/// A rod that slides with one end on the floor, F. Génot & B. Brogliato, Eur. J. Mech. A/Solids 18 (1999)
/// 653–677, with friction τ(N) by other laws than Coulomb's.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, theta: rad)]
#[units(mass: kg, half: m, g: m / s^2)]
#[nominal(half = 0.7)]
struct Rod {
    mass: f64,
    half: f64,
    g: f64,
    /// τ = N μ tanh(c (N/mg)^(-1/3)), as creep forces.
    mu: f64,
    creep: f64,
    /// τ = s (1 − e^(−p N/(s mg))), a film that shears off at s m g, with the slope p at no load.
    shear: f64,
    slope: f64,
    /// τ = w N²/mg.
    wedge: f64,
}

#[dynamics]
impl Rod {
    fn tip(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.x, q.y) - self.half * vec2(q.theta.cos(), q.theta.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared()
            + 0.5 * self.mass * self.half.powi(2) / 3.0 * q.theta.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn floor(&self, q: &Coordinates<Self>) -> Expr {
        self.tip(q).y
    }
    #[force]
    fn friction(&self, q: &Coordinates<Self>) -> Force {
        let (tip, weight) = (self.tip(q), self.mass * self.g);
        let push = q.reaction(Self::floor) / weight;
        let creep = self.mu * push * (self.creep * push.cbrt().recip()).tanh();
        let film = self.shear * (1.0 - (-self.slope * push / self.shear).exp());
        let all = weight * (creep + film + self.wedge * push.powi(2));
        Force::at(tip, vec2(-all * tip.dt().x.signum(), 0.0))
    }
}

impl Rod {
    /// N/mg by hand, where the tip slides to growing x or falling x at rate θ̇ = 0: N (1 + 3 cos² θ) + 3 sin
    /// θ cos θ sgn τ(N) = m g. All of a scan, by bisection.
    fn by_hand(&self, theta: f64, slide: f64) -> Vec<f64> {
        let (s, c) = theta.sin_cos();
        let law = |n: f64| {
            let creep = self.mu * n * (self.creep / n.cbrt()).tanh();
            creep + self.shear * (1.0 - (-self.slope * n / self.shear).exp()) + self.wedge * n * n
        };
        let left = |n: f64| n * (1.0 + 3.0 * c * c) + 3.0 * s * c * slide * law(n) - 1.0;
        let sizes = (-200..300).map(|k| 10.0_f64.powf(0.02 * f64::from(k) + 0.003));
        let mut scan: Vec<f64> = sizes.flat_map(|size| [-size, size]).collect();
        scan.sort_by(f64::total_cmp);
        let roots = scan.windows(2).filter(|pair| left(pair[0]) * left(pair[1]) < 0.0).map(|pair| {
            let (mut a, mut b) = (pair[0], pair[1]);
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if left(a) * left(middle) <= 0.0 { b = middle } else { a = middle }
            }
            0.5 * (a + b)
        });
        roots.collect()
    }
}

/// Laws that are not linear in the reaction, light and heavy, up to and beyond the slope of Painlevé's
/// paradox: N is the one by hand wherever there is one.
#[test]
fn other_laws_of_friction_have_the_reaction_by_hand() {
    let smooth =
        Rod { mass: 2.0, half: 0.7, g: 9.81, mu: 0.0, creep: 1.0, shear: 1.0, slope: 0.0, wedge: 0.0 };
    let (mut solved, mut several, mut none) = (0, 0, 0);
    for mu in [0.0, 0.3, 1.3, 1.7, 3.0] {
        for creep in [1e-3, 0.3, 1.0, 10.0] {
            for (shear, slope) in [(1.0, 0.0), (0.2, 0.5), (0.1, 4.0), (1.0, 1.6)] {
                for wedge in [0.0, 0.01] {
                    for (theta, slide) in [(0.3, -1.0), (1.1, -1.0), (1.3, -1.0), (0.8, 1.0)] {
                        let rod = Rod { mu, creep, shear, slope, wedge, ..smooth };
                        let case = format!("{rod:?} {theta} {slide}");
                        let start =
                            rod.state().x(0.7 * f64::cos(theta)).y(0.7 * f64::sin(theta)).theta(theta);
                        let start = start.x_rate(slide).build().unwrap();
                        let hand = rod.by_hand(theta, slide);
                        match (solve_once(&rod, &rod.constants().unwrap(), &start), hand.as_slice()) {
                            (Ok(found), hand) => {
                                let push = found.multipliers[0] / (2.0 * 9.81);
                                solved += 1;
                                let is_it = |n: &f64| (push / n - 1.0).abs() < 1e-9;
                                assert!(hand.iter().any(is_it), "{case}: {push} of {hand:?}");
                                // Of several it is the one to which friction grows from none.
                                let nearest =
                                    hand.iter().filter(|n| **n > 0.0).fold(f64::INFINITY, |a, n| a.min(*n));
                                assert!(push < 1.5 * nearest, "{case}: {push} of {hand:?}");
                            }
                            (Err(SolveError::Friction { solutions, .. }), hand) => {
                                assert!(solutions > 1, "{case}: {solutions} of {hand:?}");
                                several += 1;
                            }
                            (Err(error), hand) => {
                                assert!(
                                    matches!(error, SolveError::FrictionUnsolved { .. }),
                                    "{case}: {error}"
                                );
                                let text = error.to_string();
                                assert!(
                                    text.contains("does not prove") && !text.contains("Painlevé"),
                                    "{text}"
                                );
                                // None, or one that more reaction drives away, or one far beyond.
                                assert!(hand.iter().all(|n| *n < 0.0 || *n > 100.0), "{case}: {hand:?}");
                                none += 1;
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(solved > 400 && several > 0 && (1..30).contains(&none), "{solved} {several} {none}");
}
