//! A car axis on a bumpy road. The right wheel goes up and down; the left spring stays at right angles to the
//! line between the wheels.
//!
//!     Φ₁ = r_l·w(t) = 0,        Φ₂ = |r_l − r_r|² − l² = 0
//!     w(t) = (√(l² − y²), y),        y = 0.1 sin 10 t
//!
//! A moving constraint does work. The energy changes by exactly −λ₁ ∂Φ₁/∂t and by what the moving
//! end of the right spring takes. From the Test Set for IVP Solvers, where index-3 codes get 5 digits of the
//! positions and 3 of the multipliers at a tolerance of 1e-8.

mod common;
use dynamics::output::{Axis, Chart, Panel};
use dynamics::prelude::*;

#[derive(Clone, Debug, Dynamics)]
#[coordinates(xl, yl, xr, yr)]
struct CarAxis {
    mass: f64,
    length: f64,
    rest: f64,
    bump: f64,
    frequency: f64,
    g: f64,
}

#[dynamics]
impl CarAxis {
    fn left(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.xl, q.yl)
    }
    fn right(&self, q: &Coordinates<Self>) -> Vec2 {
        vec2(q.xr, q.yr)
    }
    fn wheel(&self, q: &Coordinates<Self>) -> Vec2 {
        let y = self.bump * (self.frequency * q.t).sin();
        vec2((self.length.powi(2) - y * y).sqrt(), y)
    }
    #[kinetic]
    fn kinetic(&self, q: &Coordinates<Self>) -> Expr {
        0.5 * self.mass * (self.left(q).dt().norm_squared() + self.right(q).dt().norm_squared())
    }
    #[potential]
    fn springs(&self, q: &Coordinates<Self>) -> Expr {
        let (left, right) = (self.left(q).norm(), (self.right(q) - self.wheel(q)).norm());
        0.5 * ((left - self.rest).powi(2) + (right - self.rest).powi(2))
    }
    #[potential]
    fn gravity(&self, q: &Coordinates<Self>) -> Expr {
        self.mass * self.g * (q.yl + q.yr)
    }
    #[holonomic]
    fn upright(&self, q: &Coordinates<Self>) -> Expr {
        self.left(q).dot(self.wheel(q))
    }
    #[holonomic]
    fn bar(&self, q: &Coordinates<Self>) -> Expr {
        (self.left(q) - self.right(q)).norm_squared() - self.length.powi(2)
    }
    /// Pull along the bar: |∂Φ₂/∂r_r| λ₂.
    #[output]
    fn thrust(&self, q: &Coordinates<Self>) -> Expr {
        2.0 * self.length * q.reaction(Self::bar)
    }
    #[drawing]
    fn drawing(&self, q: &Coordinates<Self>) -> Drawing {
        let (left, right, wheel) = (self.left(q), self.right(q), self.wheel(q));
        Drawing::new()
            .tail("right end", right, 0.6)
            .spring([0.0, 0.0], left)
            .spring(wheel, right)
            .disc([0.0, 0.0], 0.03)
            .disc(wheel, 0.03)
            .width(4.0)
            .line(left, right)
    }
}

#[allow(clippy::excessive_precision, reason = "reference values keep their digits")]
fn main() -> common::Outcome {
    let eps: f64 = 1e-2;
    let car =
        CarAxis { mass: 10.0 * eps * eps / 2.0, length: 1.0, rest: 0.5, bump: 0.1, frequency: 10.0, g: 1.0 };
    let start = car.state().yl(0.5).xr(1.0).yr(0.5).xl_rate(-0.5).xr_rate(-0.5).build()?;

    // 25 digits by two formulations; the published values are right to 9 in the velocities.
    let q = [0.049345578427524032, 0.496989460230008107, 1.041742524885426115, 0.373911027265365820];
    let u = [-0.077058368403592084, 0.007446866592068416, 0.017556815753741734, 0.770341043779601063];
    let lambda = [-0.004736886590853327, -0.001104680331259566];
    let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("tolerance  evaluations   errors of q, q̇, λ at t = 3");
    for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
        let motion = car.simulate(start).until(3.0).tolerance(tolerance).run()?;
        let end = motion.end();
        let errors = [
            largest(end.q.as_slice(), &q),
            largest(end.u.as_slice(), &u),
            largest(motion.multipliers_at(3.0).as_slice(), &lambda),
        ];
        println!(
            "{tolerance:<10.0e} {:<13} {:.1e} {:.1e} {:.1e}",
            motion.counts().evaluations,
            errors[0],
            errors[1],
            errors[2]
        );
        assert!(errors.iter().all(|e| *e < 100.0 * tolerance));
    }

    let motion = car.simulate(start).until(3.0).tolerance(1e-10).run()?;
    println!("\n{}", motion.summary());
    assert!(motion.verify().energy_drift < 1e-7, "the work of the road is accounted for");
    let energies = || motion.sample(common::times(3.0, 1500)).map(|s| (s.t, car.energy_function(&s)));
    let (least, most) = energies().fold((f64::MAX, f64::MIN), |(l, m), (_, e)| (l.min(e), m.max(e)));
    println!("the road takes the energy up and down between {least:.4} and {most:.4}");
    assert!(most - least > 1e-3);

    let mut files = common::Files::of("car_axis");
    let panel = |title| Panel::new(Axis::new("time"), Axis::new(title));
    let of = |value: fn(&State<CarAxis>) -> f64| -> Vec<(f64, f64)> {
        motion.sample(common::times(3.0, 1500)).map(|s| (s.t, value(&s))).collect()
    };
    Chart::new("A car axis on a bumpy road")
        .panel(panel("height").line("left", of(|s| s.yl())).line("right", of(|s| s.yr())))
        .panel(
            panel("multipliers")
                .line(
                    "upright",
                    motion.sample(common::times(3.0, 1500)).map(|s| (s.t, motion.multipliers_at(s.t)[0])),
                )
                .line(
                    "bar",
                    motion.sample(common::times(3.0, 1500)).map(|s| (s.t, motion.multipliers_at(s.t)[1])),
                ),
        )
        .panel(panel("energy").line("energy", energies()))
        .write_svg(files.path("car_axis.svg"))?;
    let film = motion.animation().title("A car axis on a bumpy road").plot(["yl", "yr"]);
    film.speed(0.25).write_html(files.path("car_axis.html"))?;
    files.list();
    Ok(())
}
