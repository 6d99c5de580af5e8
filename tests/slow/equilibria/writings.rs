//! One system in several writings: what is said of its motion does not depend on how its places are written.

use dynamics::analysis::StabilityVerdict;
use dynamics::prelude::*;

/// A double pendulum in one plane that turns, by rotated positions.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad, a: rad, b: rad)]
struct Turned {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Turned {
    fn one(&self, q: &Coordinates<Self>) -> Vec3 {
        Mat3::rotation_z(q.phi) * (self.l * vec3(q.a.sin(), 0.0, -q.a.cos()))
    }
    fn two(&self, q: &Coordinates<Self>) -> Vec3 {
        self.one(q) + Mat3::rotation_z(q.phi) * (self.l * vec3(q.b.sin(), 0.0, -q.b.cos()))
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (self.one(q).dt().norm_squared() + self.two(q).dt().norm_squared())
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (self.one(q).z + self.two(q).z)
    }
}

/// The same, by its rate of turning alone.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad, a: rad, b: rad)]
struct Rates {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Rates {
    fn one(&self, q: &Coordinates<Self>) -> Vec2 {
        self.l * vec2(q.a.sin(), -q.a.cos())
    }
    fn two(&self, q: &Coordinates<Self>) -> Vec2 {
        self.one(q) + self.l * vec2(q.b.sin(), -q.b.cos())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let turning = q.phi.dt().powi(2) * (self.one(q).x.powi(2) + self.two(q).x.powi(2));
        0.5 * self.m * (self.one(q).dt().norm_squared() + self.two(q).dt().norm_squared() + turning)
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (self.one(q).y + self.two(q).y)
    }
}

/// The same where the second rod may leave the plane of the first, by ψ.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(phi: rad, psi: rad, a: rad, b: rad)]
struct Apart {
    m: f64,
    l: f64,
    g: f64,
}

#[dynamics]
impl Apart {
    fn rod(&self, around: Expr, tilt: Expr) -> Vec3 {
        self.l * vec3(tilt.sin() * around.cos(), tilt.sin() * around.sin(), -tilt.cos())
    }
    fn two(&self, q: &Coordinates<Self>) -> Vec3 {
        self.rod(q.phi, q.a) + Mat3::rotation_z(q.phi + q.psi) * self.rod(Expr::ZERO, q.b)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (self.rod(q.phi, q.a).dt().norm_squared() + self.two(q).dt().norm_squared())
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        self.m * self.g * (self.rod(q.phi, q.a).z + self.two(q).z)
    }
}

/// The place and the verdict of the steady motion from a start.
macro_rules! judged {
    ($model:expr, $start:expr) => {{
        let steady = $model.steady(&$start).unwrap_or_else(|error| panic!("{:?}: {error}", $start));
        let stability = $model.stability(&steady.state).unwrap_or_else(|error| panic!("{steady}: {error}"));
        let ignorable: Vec<&str> = stability.ignorable.iter().map(|q| q.name).collect();
        (steady.state, stability.verdict, ignorable)
    }};
}

#[test]
fn a_conical_double_pendulum_is_stable_in_every_writing() {
    let (m, l, g) = (1.0, 1.0, 9.81);
    for phi in [0.0, 0.3, 1.0, -2.5] {
        let (turned, rates, apart) = (Turned { m, l, g }, Rates { m, l, g }, Apart { m, l, g });
        let start = turned.state().phi(phi).a(0.6).b(0.8).phi_rate(4.0).build().unwrap();
        let (place, verdict, ignorable) = judged!(turned, start);
        assert_eq!((verdict, ignorable), (StabilityVerdict::Stable, vec!["phi"]), "{phi}");
        let start = rates.state().phi(phi).a(0.6).b(0.8).phi_rate(4.0).build().unwrap();
        let (same, verdict, ignorable) = judged!(rates, start);
        assert_eq!((verdict, ignorable), (StabilityVerdict::Stable, vec!["phi"]), "{phi}");
        assert!((same.q - place.q).amax() < 1e-12, "{phi}: {same:?} {place:?}");
        let start = apart.state().phi(phi).a(0.6).b(0.8).phi_rate(4.0).build().unwrap();
        let (same, verdict, ignorable) = judged!(apart, start);
        assert_eq!((verdict, ignorable), (StabilityVerdict::Stable, vec!["phi"]), "{phi}");
        assert!((same.a() - place.a()).abs().max((same.b() - place.b()).abs()) < 1e-12, "{phi}: {same:?}");
    }
}

/// Two masses on a rod in orbit, by sums of angles.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(r, theta: rad, pitch: rad)]
struct Dumbbell {
    m: f64,
    l: f64,
    k: f64,
}

#[dynamics]
impl Dumbbell {
    fn end(&self, q: &Coordinates<Self>, side: f64) -> Vec2 {
        let along = q.theta + q.pitch;
        q.r * vec2(q.theta.cos(), q.theta.sin()) + 0.5 * side * self.l * vec2(along.cos(), along.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.m * (self.end(q, 1.0).dt().norm_squared() + self.end(q, -1.0).dt().norm_squared())
    }
    #[potential]
    fn potential(&self, q: &Coordinates<Self>) -> Expr {
        -self.k * self.m * (self.end(q, 1.0).norm().recip() + self.end(q, -1.0).norm().recip())
    }
}

/// A dumbbell satellite points to the earth, stably (F. P. J. Rimrott, *Introductory Attitude Dynamics*,
/// 1989, §9), wherever on its orbit and in every unit of length; across it does not.
#[test]
fn a_dumbbell_satellite_points_down() {
    for (k, r, l) in [(1.0, 1.0, 0.01), (1.0, 1.0, 0.5), (3.986e14, 7e6, 100.0), (398_600.0, 7000.0, 0.1)] {
        for theta in [0.0, 0.7, -3.0] {
            let (model, rate) = (Dumbbell { m: 1.0, l, k }, f64::sqrt(k / (r * r * r)));
            let start =
                |pitch: f64| model.state().r(r).theta(theta).pitch(pitch).theta_rate(rate).build().unwrap();
            let (place, verdict, ignorable) = judged!(model, start(0.0));
            assert_eq!(
                (verdict, ignorable),
                (StabilityVerdict::Stable, vec!["theta"]),
                "{k} {theta}: {place:?}"
            );
            if theta != 0.0 {
                let (place, verdict, _) = judged!(model, start(std::f64::consts::FRAC_PI_2));
                let grows = matches!(
                    verdict,
                    StabilityVerdict::Divergence { growth, .. }
                    if (growth / rate - 1.7).abs() < 0.1
                );
                assert!(grows, "{k} {theta}: {place:?} {verdict:?}");
            }
        }
    }
}
