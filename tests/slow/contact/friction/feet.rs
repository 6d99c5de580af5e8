//! Feet whose reactions are not unique, and friction by their sum.

use super::*;

/// A board on three feet in a line: their reactions are not unique, their sum is.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, a: rad)]
#[units(mass: kg, inertia: kg * m^2, g: m / s^2, half: m)]
#[nominal(half = 0.5)]
struct Board {
    mass: f64,
    inertia: f64,
    g: f64,
    half: f64,
    mu: [f64; 3],
    of_sizes: [f64; 3],
}

#[dynamics]
impl Board {
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.a.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    fn ends(&self, q: &Coordinates<Self>) -> [Expr; 2] {
        [q.y - self.half * q.a.sin(), q.y + self.half * q.a.sin()]
    }
    #[holonomic]
    #[redundant]
    fn middle(&self, q: &Coordinates<Self>) -> Expr {
        q.y
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        let (ends, middle) = (q.reaction(Self::ends), q.reaction(Self::middle));
        let linear = self.mu[0] * ends[0] + self.mu[1] * ends[1] + self.mu[2] * middle;
        let of = self.of_sizes;
        Force::along(q.x, -linear - of[0] * ends[0].abs() - of[1] * ends[1].abs() - of[2] * middle.abs())
    }
}

/// Friction that goes by the sum of reactions that are not unique, is; by one of them, or by their sizes, it
/// is not.
#[test]
fn friction_by_a_sum_of_reactions_is_decided() {
    let board = |mu: [f64; 3], of_sizes: [f64; 3]| Board {
        mass: 1.5,
        inertia: 0.2,
        g: 10.0,
        half: 0.5,
        mu,
        of_sizes,
    };
    let even = board([0.3; 3], [0.0; 3]);
    let start = even.state().x_rate(3.0).build().unwrap();
    for formulation in FORMULATIONS {
        for tolerance in [1e-6, 1e-10] {
            let run = even.simulate(start).until(0.3).tolerance(tolerance).formulation(formulation);
            let end = run.run().unwrap_or_else(|e| panic!("{formulation}: {e}")).end();
            assert!((end.x_rate() - 2.1).abs() < 30.0 * tolerance, "{formulation}: {end:?}");
        }
    }
    // (1, 1, −2) is what the reactions may differ by.
    // The last by sizes is unique only as long as no reaction changes its sign: 0.3 |λ₀| + 0.15 |λ₂|.
    for (mu, of_sizes) in [
        ([0.3, 0.3, 0.4], [0.0; 3]),
        ([0.1, 0.5, 0.1], [0.0; 3]),
        ([0.3, 0.3, 0.300_001], [0.0; 3]),
        ([0.0; 3], [0.3; 3]),
        ([0.0; 3], [0.3, 0.0, 0.15]),
    ] {
        let uneven = board(mu, of_sizes);
        let error = uneven.simulate(start).until(0.3).run().unwrap_err();
        assert!(error.to_string().contains("which is not decided"), "{error}");
    }
    // As much more at one end as less at the other: sum and moment of the reactions, of which both are
    // unique.
    let tilted = board([0.2, 0.4, 0.3], [0.0; 3]);
    let end = tilted.simulate(start).until(0.3).run().unwrap().end();
    assert!((end.x_rate() - 2.1).abs() < 1e-8, "{end:?}");
}

/// A table on eight feet in a row: what each of them bears is not decided, and what they rub together is.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(x: m, y: m, phi: rad)]
#[units(mass: kg, inertia: kg * m^2, g: m / s^2, pitch: m)]
#[nominal(pitch = 0.2)]
struct Table {
    mass: f64,
    inertia: f64,
    g: f64,
    pitch: f64,
    mu: f64,
    more: f64,
}

#[dynamics]
impl Table {
    fn foot(&self, q: &Coordinates<Self>, i: usize) -> Vec2 {
        vec2(q.x, q.y) + self.pitch * (i as f64 - 3.5) * vec2(q.phi.cos(), q.phi.sin())
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * vec2(q.x, q.y).dt().norm_squared() + 0.5 * self.inertia * q.phi.dt().powi(2)
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * q.y
    }
    #[holonomic]
    #[redundant]
    fn floor(&self, q: &Coordinates<Self>) -> [Expr; 8] {
        [
            self.foot(q, 0).y,
            self.foot(q, 1).y,
            self.foot(q, 2).y,
            self.foot(q, 3).y,
            self.foot(q, 4).y,
            self.foot(q, 5).y,
            self.foot(q, 6).y,
            self.foot(q, 7).y,
        ]
    }
    #[force]
    fn rub(&self, q: &Coordinates<Self>) -> Force {
        let along = vec2(-self.mu * q.x.dt().signum(), 0.0);
        let mut force = Force::at(self.foot(q, 0), (1.0 + self.more) * q.reaction(Self::floor)[0] * along);
        for i in 1..8 {
            force += Force::at(self.foot(q, i), q.reaction(Self::floor)[i] * along);
        }
        force
    }
}

/// Eight reactions have 256 patterns of signs, which are not all tried: with one coefficient the motion is
/// decided all the same, with one foot that is rougher it is not.
#[test]
fn many_feet_rub_alike() {
    let table = Table { mass: 3.0, inertia: 0.5, g: G, pitch: 0.2, mu: 0.3, more: 0.0 };
    let start = table.state().x_rate(2.0).build().unwrap();
    let accelerations = table.accelerations(&start).unwrap();
    assert!(
        (accelerations[0] + 0.3 * G).abs() < 1e-12 && accelerations[1].abs() < 1e-12,
        "{accelerations:?}"
    );
    let end = table.simulate(start).until(0.5).tolerance(1e-10).run().unwrap().end();
    assert!((end.x() - (1.0 - 0.125 * 0.3 * G)).abs() < 1e-9, "{}", end.x());
    let rougher = Table { more: 0.2, ..table };
    let error = rougher.accelerations(&start).unwrap_err();
    assert!(matches!(error, dynamics::error::SolveError::ReactionNotUnique { .. }), "{error}");
}
