//! Speed against accuracy: six problems, every method at every tolerance, errors against time on one page.
//!
//!     error of q, q̇, λ, E at the end   over   time (median of repeats) and evaluations
//!
//! The problems are the double pendulum, Kepler's problem with e = 0.9, Andrews' mechanism with its six
//! constraints, a stiff spring pendulum, the flyball governor and the car axis. Each is measured against a
//! reference whose uncertainty is drawn as a line. If `benches/peers/run.sh` has measured other solvers on
//! this machine, their curves are added, and the targets of this library against them are compared with the
//! results. `--quick` takes few tolerances and three repeats.

#[path = "../tests/models/andrews.rs"]
#[allow(dead_code, reason = "tests use more of it")]
mod andrews;
#[path = "../tests/models/car_axis.rs"]
mod car_axis;
mod common;
#[path = "../tests/models/governor.rs"]
mod governor;
#[path = "../tests/models/work_precision.rs"]
mod problems;

use std::path::{Path, PathBuf};
use std::time::Duration;

use dynamics::analysis::{Cost, ErrorOf, Page, Reference, RunMeasurement, Study, WorkPrecision};
use dynamics::model::{ModelState, Vector};
use dynamics::prelude::*;
use problems::{DoublePendulum, Kepler, StiffSpring};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// What all problems have in common.
struct Session {
    quick: bool,
    outside: Vec<PathBuf>,
    page: Page,
    files: common::Files,
    verdicts: Vec<String>,
}

/// What is wanted of the best own curve against the best of others.
struct Wanted<'a> {
    /// The others: a part of their names.
    others: &'a [&'a str],
    part: ErrorOf,
    /// Errors, and the part of the others' time that is wanted for them.
    ratios: &'a [(f64, f64)],
}

impl Session {
    fn new() -> Result<Self> {
        let quick = std::env::args().any(|argument| argument == "--quick");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/results");
        let entries = std::fs::read_dir(folder).map(|entries| entries.collect::<std::io::Result<Vec<_>>>());
        // Nobody has measured other solvers here: that is no error.
        let entries = entries.unwrap_or_else(|_| Ok(Vec::new()))?;
        let mut outside: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
        outside.retain(|path| path.extension().is_some_and(|extension| extension == "jsonl"));
        outside.sort();
        if cfg!(not(feature = "json")) && !outside.is_empty() {
            println!("Measurements of other solvers are left out: they need `--features json`.");
        }
        let page = Page::new("Speed against accuracy");
        Ok(Self { quick, outside, page, files: common::Files::of("work_precision"), verdicts: Vec::new() })
    }

    /// Runs a study down to tolerances of ten to the minus `finest`, adds what was measured elsewhere, shows
    /// it.
    fn study<'m, M: Simulate>(
        &mut self,
        name: &str,
        finest: i32,
        study: WorkPrecision<'m, M>,
    ) -> Result<Study<'m, M>> {
        let tolerances = decades(self.quick, if self.quick { 12 } else { finest });
        let effort = if self.quick { Duration::ZERO } else { Duration::from_millis(100) };
        let study = study.problem(name).tolerances(tolerances).effort(effort).default_method().run()?;
        #[cfg(feature = "json")]
        let study =
            self.outside.iter().try_fold(study, |mut study, path| study.read_outside(path).map(|_| study))?;
        println!("{study}\n");
        for part in [ErrorOf::State, ErrorOf::Positions] {
            println!("{}", study.comparison(part, Cost::Time, &[1e-3, 1e-6, 1e-9, 1e-12]));
        }
        self.page = std::mem::replace(&mut self.page, Page::new("")).study(&study);
        let file = name.replace(" = ", "_").replace(' ', "_");
        study.write_svg(self.files.path(&format!("{file}.svg")))?;
        study.write_json_lines(self.files.path(&format!("{file}.jsonl")))?;
        Ok(study)
    }

    /// Says whether what was wanted is reached. Nothing where the others were not measured here.
    fn wanted<M: Simulate>(&mut self, study: &Study<'_, M>, own: impl Fn(&str) -> bool, wanted: &Wanted<'_>) {
        let Wanted { others, part, ratios } = *wanted;
        for &(error, most) in ratios {
            let best = |outside: bool| {
                let curves = study.curves().iter().filter(|curve| curve.outside == outside);
                let named = curves.filter(|curve| match outside {
                    true => others.iter().any(|other| curve.name.contains(other)),
                    false => own(&curve.name),
                });
                let costs =
                    named.filter_map(|c| Some((study.cost(&c.name, part, error, Cost::Time)?, &c.name)));
                costs.min_by(|(a, _), (b, _)| a.total_cmp(b))
            };
            let (Some((ours, own)), Some((theirs, other))) = (best(false), best(true)) else { continue };
            let (ratio, verdict) = (ours / theirs, if ours <= most * theirs { "reached" } else { "missed" });
            self.verdicts.push(format!(
                "{} to {error:e} in {part}: {own} {:.1} µs, {other} {:.1} µs: ratio {ratio:.2}, wanted \
                 {most}: {verdict}",
                study.problem(),
                1e6 * ours,
                1e6 * theirs,
            ));
        }
    }
}

const DOP853: &str = "DOP853 (order 8)";
const AS_ODE: [&str; 4] =
    ["DOP853, as ODE", "Verner 9(8), as ODE", "Taylor series, as ODE", "Gragg–Bulirsch–Stoer, as ODE"];
const DP5: &str = "Dormand–Prince 5(4)";

/// What the curve "default method" is: the method that a run chooses at each of these tolerances.
fn print_default<M: Simulate + 'static>(model: &M, start: &M::State) -> Result<()> {
    for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
        let motion = model.simulate(*start).until(start.t() + 1e-3).tolerance(tolerance).run()?;
        println!("default method of {} at tolerance {tolerance:e}: {}", M::NAME, motion.method());
    }
    Ok(())
}

/// Explicit methods that choose their step.
fn explicit<M: Simulate>() -> [methods::Any<M>; 4] {
    [methods::Dop853.into(), methods::DormandPrince5.into(), methods::Tsit5.into(), methods::Verner9.into()]
}

/// What generated code makes possible: Taylor series, and columns of extrapolation side by side.
fn series_and_columns<M: Simulate>() -> [methods::Any<M>; 2] {
    [methods::Taylor::default().into(), methods::GraggBulirschStoer.into()]
}

/// Adds implicit methods of lower order at the tolerances that they are made for: for the finest ones of the
/// others they would need millions of steps.
fn few_digits<'m, M: Simulate>(study: WorkPrecision<'m, M>, quick: bool) -> WorkPrecision<'m, M> {
    let study = study.methods_at(decades(quick, 9), [methods::Esdirk4.into()]);
    study.methods_at(decades(quick, 6), [methods::GeneralizedAlpha::default().into()])
}

/// Tolerances from a sketch to ten to the minus `finest`, every other one if it is to be quick.
fn decades(quick: bool, finest: i32) -> impl Iterator<Item = f64> {
    let (first, step) = if quick { (4, 2) } else { (3, 1) };
    (first..=finest).step_by(step).map(|k| 10f64.powi(-k))
}

fn main() -> common::Outcome {
    let mut session = Session::new()?;
    smooth(&mut session)?;
    constrained(&mut session)?;
    stiff(&mut session)?;
    let Session { mut page, mut files, verdicts, .. } = session;
    for verdict in &verdicts {
        println!("{verdict}");
        page = page.text(verdict);
    }
    page.write_html(files.path("work_precision.html"))?;
    files.list();
    Ok(())
}

/// Smooth motions: high order wins, and the more so the more digits are wanted.
fn smooth(session: &mut Session) -> Result<()> {
    let model = DoublePendulum { m1: 1.0, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(1.5).theta2(1.0).build()?;
    let steps = if session.quick { 11..13 } else { 9..17 };
    let known = [-1.1686859741349935, -1.060871322324049, 2.716951800644156, -0.7111210975850546];
    print_default(&model, &start)?;
    let study = model.work_precision(start).until(10.0).reference(end(&model, 10.0, known));
    let study = study.methods(explicit()).methods(series_and_columns()).methods([methods::Rk4.into()]);
    let study = session.study("double pendulum", 14, study.steps(steps.map(|k| 10.0 / f64::from(1 << k))))?;
    wins(&study, 1e-9);
    let heyoka = |ratios| Wanted { others: &["heyoka"], part: ErrorOf::State, ratios };
    session.wanted(&study, |_| true, &heyoka(&[(1e-6, 0.7), (1e-9, 0.8), (1e-12, 0.8)]));
    let rk4 =
        study.cost("RK4 (order 4)", ErrorOf::State, 1e-7, Cost::Evaluations).ok_or("RK4 reaches 1e-7")?;
    let dop853 = study.cost(DOP853, ErrorOf::State, 1e-7, Cost::Evaluations).ok_or("DOP853 reaches 1e-7")?;
    println!("RK4 needs {:.1} times the evaluations of DOP853 for an error of 1e-7", rk4 / dop853);
    assert!(rk4 > 2.0 * dop853);

    let model = Kepler { mu: 1.0 };
    let start = model.state().x(0.1).y_rate(19f64.sqrt()).build()?;
    let known = [-1.2952662509874838, 0.4003938963792514, -0.6775390924708295, -0.12708381542784494];
    print_default(&model, &start)?;
    let study =
        model.work_precision(start).until(20.0).reference(end(&model, 20.0, known)).methods(explicit());
    // What preserves structure does so with steps of one size, and that is what an eccentric orbit makes it
    // pay for.
    let even = [methods::Composition8.into(), methods::Gauss6.into()];
    let steps = if session.quick { 9..11 } else { 8..14 };
    let steps = steps.map(|k| 20.0 / f64::from(1 << k));
    let study = session.study(
        "Kepler e = 0.9",
        14,
        study.methods(series_and_columns()).methods(even).steps(steps),
    )?;
    wins(&study, 1e-9);
    session.wanted(&study, |_| true, &heyoka(&[(1e-3, 1.0), (1e-6, 1.0), (1e-9, 1.0), (1e-12, 1.0)]));
    Ok(())
}

/// A known end: Taylor series in 80-bit arithmetic, at tolerances 1e-18 and 1e-20, from the start and
/// parameters as `f64` has them; the two differ by 3e-16 at most.
fn end<M: Simulate>(_: &M, t: f64, [q1, q2, u1, u2]: [f64; 4]) -> Reference<M> {
    let (mut q, mut u) = (M::Vector::zeros(), M::Vector::zeros());
    q.as_mut_slice().copy_from_slice(&[q1, q2]);
    u.as_mut_slice().copy_from_slice(&[u1, u2]);
    Reference::known(M::State::new(t, q, u, M::Inputs::zeros()), 1e-15)
}

fn wins<M: Simulate>(study: &Study<'_, M>, error: f64) {
    let evaluations = |method: &str| {
        study.cost(method, ErrorOf::State, error, Cost::Evaluations).expect("it reaches so far")
    };
    assert!(evaluations(DOP853) < 0.8 * evaluations(DP5), "order 8 wins at {error:e}");
}

/// Mechanisms: multipliers are as good as positions, because they are solved from the state and not carried
/// along.
fn constrained(session: &mut Session) -> Result<()> {
    let model = andrews::PUBLISHED;
    let [beta, theta, gamma, phi, delta, omega, epsilon] = andrews::START;
    let start = model
        .state()
        .beta(beta)
        .theta(theta)
        .gamma(gamma)
        .phi(phi)
        .delta(delta)
        .omega(omega)
        .epsilon(epsilon);
    let start = start.build()?;
    print_default(&model, &start)?;
    let study = model.work_precision(start).until(0.03).methods(explicit());
    // Radau IIA solves for q̈ and λ with Φ̈ = 0 and is projected.
    let study = study.methods(series_and_columns()).methods([methods::Radau5.into()]);
    let study = study.variant("DOP853, embedded", methods::Dop853, |s| s.formulation(Formulation::Embedded));
    // What other solvers are given: accelerations, and nothing that holds the constraints.
    let study = study.variant(AS_ODE[0], methods::Dop853, |s| s.formulation(Formulation::Augmented));
    let study = study.variant(AS_ODE[1], methods::Verner9, |s| s.formulation(Formulation::Augmented));
    let study =
        study.variant(AS_ODE[2], methods::Taylor::default(), |s| s.formulation(Formulation::Augmented));
    let study =
        study.variant(AS_ODE[3], methods::GraggBulirschStoer, |s| s.formulation(Formulation::Augmented));
    let study = session.study("Andrews", 13, study)?;
    // Forces of up to hundreds of newtons.
    digits(&study, 100.0);
    let right_hand_sides = &["ode_solvers", "differential-equations", "diffsol", "heyoka"];
    let part = ErrorOf::Positions;
    let [ode, dae] = [0.4, 0.05].map(|ratio| [(1e-6, ratio), (1e-9, ratio)]);
    session.wanted(
        &study,
        |name| AS_ODE.contains(&name),
        &Wanted { others: right_hand_sides, part, ratios: &ode },
    );
    session.wanted(&study, |name| !AS_ODE.contains(&name), &Wanted { others: &["IDA"], part, ratios: &dae });

    let model = car_axis::model();
    let start = car_axis::start(&model);
    print_default(&model, &start)?;
    let study = model.work_precision(start).until(3.0).methods(explicit()).methods([methods::Radau5.into()]);
    let study = session.study("car axis", 13, study)?;
    digits(&study, 4.7e-3);
    Ok(())
}

/// Six correct digits of the multipliers at tolerance 1e-8, where the index-3 code RADAU5 has 0.2 (Andrews)
/// and 2.7 (car axis).
fn digits<M: Simulate>(study: &Study<'_, M>, scale: f64) {
    for method in [Method::Dop853, Method::Radau5].map(|method| method.to_string()) {
        let error = run(study, &method, 1e-8).errors.of(ErrorOf::Multipliers).expect("it is constrained");
        let digits = -(error / scale).log10();
        println!("{}: {digits:.1} digits of the multipliers by {method} at tolerance 1e-8", study.problem());
        assert!(error < 1e-6 * scale);
    }
}

/// What a method did at a tolerance.
fn run<'a, M: Simulate>(study: &'a Study<'_, M>, method: &str, tolerance: f64) -> &'a RunMeasurement {
    let points = &study.curve(method).expect("it ran").points;
    let point =
        points.iter().find(|point| (point.setting / tolerance - 1.0).abs() < 1e-9).expect("it ran so");
    point.outcome.as_ref().expect("it reached the end")
}

/// Stiff motions: explicit methods are bound by stability, and say so; Radau IIA is not.
fn stiff(session: &mut Session) -> Result<()> {
    let model = StiffSpring { mass: 1.0, stiffness: 1e8, damping: 2e4, length: 1.0, g: 9.81 };
    let start = model.state().x(1.0).build()?;
    let known = [0.27509447648273956, -0.961417492433867, -4.175584765727931, -1.1947781965932027];
    print_default(&model, &start)?;
    let study =
        model.work_precision(start).until(10.0).reference(end(&model, 10.0, known)).methods(explicit());
    let study = study.methods([methods::Radau5.into(), methods::Taylor::default().into()]);
    let study = session.study("stiff spring pendulum", 13, few_digits(study, session.quick))?;
    bound(&study);
    session.wanted(&study, |_| true, &Wanted { others: &[""], part: ErrorOf::State, ratios: &[(1e-6, 1.0)] });

    let model = governor::model();
    let angle = std::f64::consts::FRAC_PI_6;
    let start = model.state().s(0.5).b([angle; 2]).psi_rate(std::f64::consts::TAU);
    let start = start.slider_rate(std::f64::consts::TAU).arm_rate([std::f64::consts::TAU; 2]).build()?;
    print_default(&model, &start)?;
    let study = model.work_precision(start).until(1.0).methods(explicit()).methods([methods::Radau5.into()]);
    bound(&session.study("flyball governor", 13, few_digits(study, session.quick))?);
    Ok(())
}

fn bound<M: Simulate>(study: &Study<'_, M>) {
    let (explicit, implicit) = (run(study, DP5, 1e-4), run(study, &Method::Radau5.to_string(), 1e-4));
    let steps = |run: &RunMeasurement| run.steps.unwrap_or_default();
    let (many, few) = (steps(explicit), steps(implicit));
    println!("{}: {many} steps of {DP5} at 1e-4, {few} of Radau IIA", study.problem());
    assert!(
        explicit.stiff_at.is_some() && implicit.stiff_at.is_none(),
        "the summary of the explicit run says so"
    );
    assert!(many > 5 * few, "stability costs, not accuracy");
}
