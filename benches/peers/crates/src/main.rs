//! ode_solvers, differential-equations and diffsol, with their default options but the tolerances; prints
//! lines for `Study::add_outside`.

mod andrews;

use std::cell::Cell;
use std::time::{Duration, Instant};

#[cfg(andrews)]
unsafe extern "C" {
    fn peers_andrews(y: *const f64, slope: *mut f64);
}

/// A problem as a first-order system of N equations.
#[derive(Clone, Copy)]
struct Problem<const N: usize> {
    name: &'static str,
    /// What is said of the right-hand side beside the solver's name.
    variant: &'static str,
    start: [f64; N],
    end: f64,
    right: fn(&[f64], &mut [f64]),
}

thread_local!(static EVALUATIONS: Cell<u64> = const { Cell::new(0) });

impl<const N: usize> Problem<N> {
    fn evaluate(&self, y: &[f64], slope: &mut [f64]) {
        EVALUATIONS.set(EVALUATIONS.get() + 1);
        (self.right)(y, slope);
    }
}

fn double_pendulum(y: &[f64], d: &mut [f64]) {
    let ((s1, c1), (s2, c2)) = (y[0].sin_cos(), y[1].sin_cos());
    let (c, s) = (c1 * c2 + s1 * s2, s1 * c2 - c1 * s2);
    let f1 = -1.04 * s * y[3] * y[3] - 2.3 * 9.81 * s1;
    let f2 = 1.04 * s * y[2] * y[2] - 1.04 * 9.81 * s2;
    let m = 1.04 * c;
    let inverse = 1.0 / (2.3 * 0.832 - m * m);
    d.copy_from_slice(&[y[2], y[3], (0.832 * f1 - m * f2) * inverse, (2.3 * f2 - m * f1) * inverse]);
}

fn kepler(y: &[f64], d: &mut [f64]) {
    let square = y[0] * y[0] + y[1] * y[1];
    let cube = 1.0 / (square * square.sqrt());
    d.copy_from_slice(&[y[2], y[3], -y[0] * cube, -y[1] * cube]);
}

fn spring(y: &[f64], d: &mut [f64]) {
    let r = y[0].hypot(y[1]);
    let pull = -(1e8 * (r - 1.0) + 2e4 * (y[0] * y[2] + y[1] * y[3]) / r) / r;
    d.copy_from_slice(&[y[2], y[3], pull * y[0], pull * y[1] - 9.81]);
}

/// The derivative of `spring` in the direction v.
#[cfg(feature = "diffsol")]
fn spring_along(y: &[f64], v: &[f64], d: &mut [f64]) {
    let r = y[0].hypot(y[1]);
    let (nx, ny) = (y[0] / r, y[1] / r);
    let rate = nx * y[2] + ny * y[3];
    let pull = -(1e8 * (r - 1.0) + 2e4 * rate);
    let along = nx * v[0] + ny * v[1];
    let (tx, ty) = ((v[0] - nx * along) / r, (v[1] - ny * along) / r);
    let turned = tx * y[2] + ty * y[3] + nx * v[2] + ny * v[3];
    let change = -(1e8 * along + 2e4 * turned);
    d.copy_from_slice(&[v[2], v[3], change * nx + pull * tx, change * ny + pull * ty]);
}

#[cfg(andrews)]
fn generated(y: &[f64], d: &mut [f64]) {
    assert!(y.len() == 14 && d.len() == 14);
    // SAFETY: both have the 14 elements that the generated function reads and writes.
    unsafe { peers_andrews(y.as_ptr(), d.as_mut_ptr()) }
}

/// Repeats for 0.3 s, at least 3 times, and prints a line with the median.
fn measure<const N: usize>(
    p: &Problem<N>,
    solver: &str,
    tolerance: f64,
    run: impl Fn() -> Result<Vec<f64>, String>,
) {
    let (begun, mut times) = (Instant::now(), Vec::new());
    print!("{{\"problem\":\"{}\",\"solver\":\"{solver}{}\",\"tolerance\":{tolerance:e}", p.name, p.variant);
    while times.len() < 3 || (begun.elapsed() < Duration::from_millis(300) && times.len() < 101) {
        EVALUATIONS.set(0);
        let clock = Instant::now();
        let end = run();
        times.push(clock.elapsed());
        // An end that is none is a failure, whatever the solver calls it, and NaN is no JSON.
        let end = end.and_then(|end| {
            if end.iter().all(|x| x.is_finite()) { Ok(end) } else { Err("its end is not finite".into()) }
        });
        match end {
            Err(error) => {
                let error: String =
                    error.chars().filter(|c| !c.is_control() && !matches!(c, '"' | '\\')).take(150).collect();
                println!(",\"failure\":\"{error}\"}}");
                return;
            }
            Ok(end)
                if times.len() >= 3 && begun.elapsed() >= Duration::from_millis(300)
                    || times.len() == 101 =>
            {
                times.sort_unstable();
                let time = times[(times.len() - 1) / 2].as_secs_f64() * 1e6;
                let end: Vec<String> = end.iter().map(|x| format!("{x:e}")).collect();
                let (repeats, evaluations) = (times.len(), EVALUATIONS.get());
                print!(",\"time_us\":{time:.3},\"repeats\":{repeats},\"evaluations\":{evaluations}");
                println!(",\"end\":[{}]}}", end.join(","));
                return;
            }
            Ok(_) => {}
        }
    }
}

mod of_ode_solvers {
    use ode_solvers::dop_shared::OutputType;
    use ode_solvers::{Dop853, SVector, System};

    use super::{Problem, measure};

    struct Right<const N: usize>(Problem<N>);

    impl<const N: usize> System<f64, SVector<f64, N>> for Right<N> {
        fn system(&self, _: f64, y: &SVector<f64, N>, d: &mut SVector<f64, N>) {
            self.0.evaluate(y.as_slice(), d.as_mut_slice());
        }
    }

    pub(super) fn run<const N: usize>(p: &Problem<N>, tolerance: f64) {
        measure(p, "ode_solvers DOP853", tolerance, || {
            let start = SVector::<f64, N>::from_column_slice(&p.start);
            // All options as the crate has them, but for more steps and no output between.
            let mut solver = Dop853::from_param(
                Right(*p),
                0.0,
                p.end,
                p.end,
                start,
                tolerance,
                tolerance,
                0.9,
                0.0,
                0.333,
                6.0,
                p.end,
                0.0,
                10_000_000,
                1000,
                OutputType::Sparse,
            );
            solver.integrate().map_err(|error| format!("{error:?}"))?;
            Ok(solver.y_out().last().ok_or("no output")?.as_slice().to_vec())
        });
    }
}

mod of_differential_equations {
    use differential_equations::prelude::*;

    use super::{Problem, measure};

    impl<const N: usize> ODE<f64, [f64; N]> for Problem<N> {
        fn diff(&self, _: f64, y: &[f64; N], d: &mut [f64; N]) {
            self.evaluate(y, d);
        }
    }

    pub(super) fn run<const N: usize>(p: &Problem<N>, tolerance: f64, stiff: bool) {
        let last = |y: Option<&[f64; N]>| y.map(|y| y.to_vec()).ok_or_else(|| String::from("no output"));
        if stiff {
            measure(p, "differential-equations Radau5", tolerance, || {
                let method = ImplicitRungeKutta::radau5().rtol(tolerance).atol(tolerance);
                let solved = IVP::ode(p, 0.0, p.end, p.start).method(method).solve();
                last(solved.map_err(|error| format!("{error:?}"))?.y.last())
            });
        } else {
            measure(p, "differential-equations RKV 9(8)", tolerance, || {
                let method = ExplicitRungeKutta::rkv988e().rtol(tolerance).atol(tolerance);
                let solved = IVP::ode(p, 0.0, p.end, p.start).method(method).solve();
                last(solved.map_err(|error| format!("{error:?}"))?.y.last())
            });
        }
    }
}

#[cfg(feature = "diffsol")]
mod of_diffsol {
    use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason};

    use super::{Problem, measure, spring_along};

    /// To the end, step by step; the state there.
    macro_rules! to_the_end {
        ($solver:expr, $end:expr) => {{
            let mut solver = $solver.map_err(|error| format!("{error:?}"))?;
            solver.set_stop_time($end).map_err(|error| format!("{error:?}"))?;
            while !matches!(
                solver.step().map_err(|error| format!("{error:?}"))?,
                OdeSolverStopReason::TstopReached
            ) {}
            Ok(solver.state().y.batch_as_slice(0).to_vec())
        }};
    }

    pub(super) fn run<const N: usize>(p: &Problem<N>, tolerance: f64, stiff: bool) {
        let p = *p;
        if stiff {
            measure(&p, "diffsol BDF", tolerance, || {
                let problem = OdeBuilder::<NalgebraMat<f64>>::new()
                    .rtol(tolerance)
                    .atol([tolerance])
                    .rhs_implicit(
                        move |y: &[f64], _: &[f64], _: f64, d: &mut [f64]| p.evaluate(y, d),
                        move |y: &[f64], _: &[f64], _: f64, v: &[f64], d: &mut [f64]| spring_along(y, v, d),
                    )
                    .init(move |_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&p.start), N)
                    .build()
                    .map_err(|error| format!("{error:?}"))?;
                to_the_end!(problem.bdf::<NalgebraLU<f64>>(), p.end)
            });
        } else {
            measure(&p, "diffsol Tsit45", tolerance, || {
                let problem = OdeBuilder::<NalgebraMat<f64>>::new()
                    .rtol(tolerance)
                    .atol([tolerance])
                    .rhs(move |y: &[f64], _: &[f64], _: f64, d: &mut [f64]| p.evaluate(y, d))
                    .init(move |_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&p.start), N)
                    .build()
                    .map_err(|error| format!("{error:?}"))?;
                to_the_end!(problem.tsit45(), p.end)
            });
        }
    }
}

fn all<const N: usize>(p: &Problem<N>, stiff: bool) {
    for k in 3..=13 {
        let tolerance = 10f64.powi(-k);
        of_ode_solvers::run(p, tolerance);
        of_differential_equations::run(p, tolerance, stiff);
        #[cfg(feature = "diffsol")]
        of_diffsol::run(p, tolerance, stiff);
    }
}

fn andrews_by_hand(y: &[f64], d: &mut [f64]) {
    let (q, u) = y.split_at(7);
    d[..7].copy_from_slice(u);
    let (q, u) = (q.try_into().expect("seven angles"), u.try_into().expect("seven rates"));
    d[7..].copy_from_slice(&andrews::accelerations(q, u));
}

fn main() {
    let name = "double pendulum";
    all(
        &Problem { name, variant: "", start: [1.5, 1.0, 0.0, 0.0], end: 10.0, right: double_pendulum },
        false,
    );
    let name = "Kepler e = 0.9";
    all(
        &Problem { name, variant: "", start: [0.1, 0.0, 0.0, 19f64.sqrt()], end: 20.0, right: kepler },
        false,
    );
    let name = "stiff spring pendulum";
    all(&Problem { name, variant: "", start: [1.0, 0.0, 0.0, 0.0], end: 10.0, right: spring }, true);
    mechanism();
}

#[allow(clippy::excessive_precision, reason = "as published")]
fn mechanism() {
    let mut start = [0.0; 14];
    start[..7].copy_from_slice(&[
        -0.0617138900142764496,
        0.0,
        0.455279819163070380,
        0.222668390165885885,
        0.487364979543842550,
        -0.222668390165885885,
        1.230547444549821192,
    ]);
    let (name, end) = ("Andrews", 0.03);
    all(&Problem { name, variant: ", by hand", start, end, right: andrews_by_hand }, false);
    #[cfg(andrews)]
    all(&Problem { name, variant: "", start, end, right: generated }, false);
}
