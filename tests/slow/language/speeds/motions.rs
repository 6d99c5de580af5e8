//! Motions of models with speeds: by every kind of method the same, with what is conserved; norms of Euler
//! parameters and of rotation matrices.

use dynamics::model::{Constraints, Vector as _};
use dynamics::prelude::*;

use super::models::*;

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

#[test]
fn a_free_body_flips_alike_with_and_without_speeds() {
    let (a, b, c, weight, height) = (1.0, 2.0, 3.0, 0.0, 1.0);
    let top = Top { a, b, c, weight, height };
    let start = top.state().phi(0.1).theta(1.2).psi(0.3).omega([0.02, 1.0, 0.03]).build().expect("regular");
    let plain = TopInAngles { a, b, c, weight, height };
    let rates = [start.phi_rate(), start.theta_rate(), start.psi_rate()];
    let of_plain =
        plain.state().phi(0.1).theta(1.2).psi(0.3).phi_rate(rates[0]).theta_rate(rates[1]).psi_rate(rates[2]);
    let until = 12.0;
    let motion = top.simulate(start).until(until).tolerance(1e-12).run().expect("runs");
    let other =
        plain.simulate(of_plain.build().expect("finite")).until(until).tolerance(1e-12).run().expect("runs");
    let apart = motion.end().q - other.end().q;
    assert!(largest(apart.iter().copied()) < 1e-8, "{apart}");
    // In speeds: 2T and |L|², from the outputs.
    let measure = |t: f64| {
        let [x, y, z] =
            ["omega[0]", "omega[1]", "omega[2]"].map(|name| motion.output(name, t).expect("an output"));
        [a * x * x + b * y * y + c * z * z, (a * x).powi(2) + (b * y).powi(2) + (c * z).powi(2)]
    };
    let first = measure(0.0);
    assert!((first[0] - (0.0004 + 2.0 + 0.0027)).abs() < 1e-12);
    for t in [3.0, 7.5, until] {
        let now = measure(t);
        assert!(largest([now[0] - first[0], now[1] - first[1]]) < 1e-8, "at {t}: {now:?}, {first:?}");
    }
    // It does flip: the middle axis turns over.
    let least = (0..1200)
        .map(|i| motion.output("omega[1]", 0.01 * f64::from(i)).expect("an output"))
        .fold(1.0, f64::min);
    assert!(least < -0.9, "{least}");
}

#[test]
fn every_kind_of_method_moves_a_sleigh_alike() {
    let sleigh = Sleigh { mass: 1.0, inertia: 0.1, a: 0.2 };
    let start = || sleigh.state().x(0.2).v(1.0).spin(2.0).build().expect("regular");
    // v = V tanh(k t + c) in closed form (Bloch, 1.7).
    let about = 0.1 + 0.2_f64.powi(2);
    let top = (1.0 + about * 4.0).sqrt();
    let (k, c) = (0.2 * top / about, (1.0 / top).atanh());
    let methods: [methods::Any<Sleigh>; 3] =
        [methods::Dop853.into(), methods::Radau5.into(), methods::Taylor { order: None }.into()];
    for method in methods {
        let name = format!("{:?}", method.method());
        let motion = sleigh.simulate(start()).until(3.0).tolerance(1e-10).method(method).run().expect("runs");
        for t in [0.5, 1.7, 3.0] {
            let v = motion.output("v", t).expect("an output");
            assert!((v - top * (k * t + c).tanh()).abs() < 1e-7, "{name} at {t}: {v}");
        }
        assert!(motion.verify().energy_drift < 1e-7, "{name}: {}", motion.verify());
    }
}

#[test]
fn csv_has_the_speeds() {
    let sleigh = Sleigh { mass: 1.0, inertia: 0.1, a: 0.2 };
    let start = sleigh.state().x(0.2).v(1.0).spin(2.0).build().expect("regular");
    let motion = sleigh.simulate(start).until(0.1).run().expect("runs");
    let text = motion.csv().to_text().expect("a table");
    let head = text.lines().next().expect("a head");
    assert!(
        head.contains("spin") && head.split(',').any(|name| name.trim_matches('"').starts_with('v')),
        "{head}"
    );
}

/// A free body in nine elements of its rotation, held at right angles by six rows.
#[derive(Clone, Debug, Dynamics)]
#[coordinates(a: [_; 3], b: [_; 3], c: [_; 3])]
#[speeds(omega: [_; 3])]
struct Directions {
    inertia: [f64; 3],
}

#[dynamics]
impl Directions {
    /// The body's axes in the world.
    fn axes(&self, q: &Coordinates<Self>) -> [Vec3; 3] {
        [Vec3::from(q.a), Vec3::from(q.b), Vec3::from(q.c)]
    }
    #[kinematic]
    fn omega(&self, q: &Coordinates<Self>) -> Vec3 {
        let [a, b, c] = self.axes(q);
        vec3(c.dot(b.dt()), a.dot(c.dt()), b.dot(a.dt()))
    }
    /// ½ Σ eᵢ ȧᵢ² with what the inertia is made of: Jₓ = e_y + e_z.
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        let [a, b, c] = self.axes(q);
        let [x, y, z] = self.inertia;
        0.25 * ((y + z - x) * a.dt().norm_squared()
            + (z + x - y) * b.dt().norm_squared()
            + (x + y - z) * c.dt().norm_squared())
    }
    #[holonomic]
    fn right_angles(&self, q: &Coordinates<Self>) -> [Expr; 6] {
        let [a, b, c] = self.axes(q);
        [a.dot(a) - 1.0, b.dot(b) - 1.0, c.dot(c) - 1.0, b.dot(c), c.dot(a), a.dot(b)]
    }
}

/// Worst residual of the constraints at the ends of steps, for each method.
fn drifts<M>(model: &M, start: M::State, until: f64) -> Vec<(String, f64, f64)>
where
    M: Simulate + Constraints,
{
    // The last is of second order only.
    let methods: [(methods::Any<M>, f64); 4] = [
        (methods::Dop853.into(), 1e-9),
        (methods::Taylor { order: None }.into(), 1e-9),
        (methods::Radau5.into(), 1e-8),
        (methods::GeneralizedAlpha { rho: 0.9 }.into(), 1e-5),
    ];
    let mut found = Vec::new();
    for (method, tolerance) in methods {
        let name = format!("{:?}", method.method());
        let motion =
            model.simulate(start).until(until).tolerance(tolerance).method(method).run().expect("runs");
        let worst = motion.states().map(|state| largest(model.residual(&state).as_slice().iter().copied()));
        found.push((name, largest(worst), motion.verify().energy_drift));
    }
    found
}

#[test]
fn norms_hold_to_rounding_by_every_kind_of_method() {
    let satellite = Satellite { inertia: Mat3::diagonal(1.0, 2.0, 3.0) };
    let start = satellite.state().e([1.0, 0.0, 0.0, 0.0]).omega([0.02, 1.0, 0.03]).build().expect("regular");
    for (name, norm, energy) in drifts(&satellite, start, 4.0) {
        assert!(norm < 1e-13, "{name}: the norm is {norm:e} off");
        assert!(energy < 1e-3, "{name}: energy drifts by {energy:e}");
    }
    let directions = Directions { inertia: [1.0, 2.0, 3.0] };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let start = directions
        .state()
        .a(axes[0])
        .b(axes[1])
        .c(axes[2])
        .omega([0.02, 1.0, 0.03])
        .build()
        .expect("regular");
    for (name, worst, energy) in drifts(&directions, start, 4.0) {
        assert!(worst < 1e-13, "{name}: right angles are {worst:e} off");
        assert!(energy < 1e-3, "{name}: energy drifts by {energy:e}");
    }
}
