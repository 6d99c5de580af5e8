//! The example that every model is written with: it compiles without a warning and moves as Rust does.

use std::path::Path;
use std::process::Command;

use dynamics::model::{ModelState, PrintedInC, SimulationModel, Vector};
use dynamics::prelude::*;

use crate::compiler::{compile, compilers, folder};
use crate::programs::start;
use crate::random_states::{Visit, every_model};

/// Step and duration of all examples: sums of them are exact.
const STEP: f64 = 1.0 / 1024.0;
const DURATION: f64 = 1.0;
/// Largest difference at the end, as part of the largest number, where Rust takes other steps because of
/// constraints.
const NEAR: f64 = 1e-5;
/// The same where steps of the example go over kinks, at which Rust ends its steps.
const NEAR_WITH_KINKS: f64 = 1e-3;

/// The status where generated code does not apply: `NAME_GUARDED`.
const GUARDED: i32 = 2;

/// The last line that the example prints; `None` where it ends at a guard.
fn end(folder: &Path) -> Option<Vec<f64>> {
    let output = Command::new(folder.join("example")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(GUARDED) {
        eprintln!("{}: {said}", folder.display());
        return None;
    }
    assert!(output.status.success(), "{said}");
    let text = String::from_utf8(output.stdout).unwrap();
    Some(text.lines().last().unwrap().split(' ').map(|x| x.parse().unwrap()).collect())
}

/// Compiles and runs the examples of all models.
struct Examples {
    compiler: String,
    with_bits: usize,
    /// Models whose examples end at a guard.
    guarded: Vec<&'static str>,
}

impl Visit for Examples {
    fn visit<M: SimulationModel + PrintedInC>(&mut self, model: &M) {
        if !M::C.obstacles.is_empty() {
            return;
        }
        let found = start(model).expect("a start on the constraints");
        let start = M::State::new(0.0, *found.q(), *found.u(), *found.inputs());
        let source = format!("{}.c", M::C.name);
        let build = |export: dynamics::export::CExport<'_, M>, what: &str| {
            let folder = folder(&format!("example_{what}_{}_{}", self.compiler, M::C.name));
            export.start(start).step(STEP).duration(DURATION).write(&folder).unwrap();
            compile(&self.compiler, &folder, &[], &["main.c", &source], "example");
            end(&folder)
        };
        let end = build(model.in_c().library_sines(), "double");
        let single = build(model.in_c().single_precision(), "single");
        let (Some(end), Some(single)) = (end, single) else {
            self.guarded.push(M::NAME);
            return;
        };
        let simulation = model.simulate(start).until(DURATION);
        let has_bits = M::ROWS.is_empty() && M::KINKS == 0 && !dynamics::sin_cos::FUSED;
        let motion = match has_bits {
            true => simulation.method(methods::Rk4).fixed_step(STEP).run().unwrap(),
            false => simulation.tolerance(1e-10).run().unwrap(),
        };
        let state = motion.end();
        let rust = [&[state.t()][..], state.q().as_slice(), state.u().as_slice()].concat();
        let size = rust.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
        let off = |end: &[f64]| rust.iter().zip(end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
        eprintln!("{}: {:.1e} apart, in floats {:.1e}", M::NAME, off(&end), off(&single));
        if has_bits {
            assert_eq!(rust, end, "{}", M::NAME);
            self.with_bits += 1;
        }
        let near = if M::KINKS > 0 { NEAR_WITH_KINKS } else { NEAR };
        assert!(off(&end) <= near, "{}: {rust:?} in Rust, {end:?} in C", M::NAME);
    }
}

#[test]
fn examples_move_as_rust_does() {
    for compiler in compilers() {
        let mut examples = Examples { compiler, with_bits: 0, guarded: Vec::new() };
        every_model(&mut examples);
        assert!(examples.with_bits >= 8, "{}", examples.with_bits);
        // The sleigh turns across the way, where Rust takes its general solver.
        assert_eq!(examples.guarded, ["Sleigh"]);
    }
}

/// T and V stand behind the energy function.
#[test]
fn energies_are_three_numbers() {
    let model = crate::models::DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let state = model.state().theta1(0.4).theta2(-1.2).theta1_rate(2.0).theta2_rate(-0.3).build().unwrap();
    for compiler in compilers() {
        let given = crate::driver::given::<crate::models::DoublePendulum>(&state, [&[0.0; 2], &[], &[]]);
        let folder = folder(&format!("energies_{compiler}"));
        let parameters = crate::driver::parameters(&model);
        let found =
            crate::driver::run(&model.in_c().library_sines(), &compiler, &folder, &parameters, &[given]);
        let expected =
            [model.energy_function(&state), model.kinetic_energy(&state), model.potential_energy(&state)];
        assert!(dynamics::sin_cos::FUSED || found[0][3..6] == expected, "{found:?} {expected:?}");
    }
}

/// Times are multiples of the step, as in Rust, and the last step ends at the duration.
#[test]
fn steps_of_a_thousandth_have_the_bits_of_rust() {
    let model = crate::models::DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(2.0).build().unwrap();
    for compiler in compilers() {
        for (i, duration) in [3.0, 1.0005].into_iter().enumerate() {
            let simulation = model.simulate(start).until(duration);
            let motion = simulation.method(methods::Rk4).fixed_step(0.001).run().unwrap();
            let state = motion.end();
            let rust = [&[state.t][..], state.q.as_slice(), state.u.as_slice()].concat();
            let folder = folder(&format!("thousandths_{i}_{compiler}"));
            let export = model.in_c().start(start).step(0.001).duration(duration);
            export.library_sines().write(&folder).unwrap();
            compile(&compiler, &folder, &[], &["main.c", "double_pendulum.c"], "example");
            let end = end(&folder).unwrap();
            assert_eq!(end[0], duration);
            assert!(dynamics::sin_cos::FUSED || end == rust, "{end:?} in C, {rust:?} in Rust");
        }
    }
}

/// Long steps leave the constraints; the example says so.
#[test]
fn examples_off_the_constraints_say_so() {
    let model = crate::models::CartesianPendulum { m: 0.7, l: 1.3, g: 9.81 };
    let start = model.state().x(1.3).y(0.0).build().unwrap();
    for compiler in compilers() {
        let folder = folder(&format!("off_{compiler}"));
        model.in_c().start(start).step(40.0).duration(400.0).write(&folder).unwrap();
        compile(&compiler, &folder, &[], &["main.c", "cartesian_pendulum.c"], "example");
        let output = Command::new(folder.join("example")).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{said}");
        assert!(said.contains("off the constraints"), "{said}");
    }
}

/// Programs in C++ include the header and call the functions.
#[test]
fn programs_in_cpp_include_the_header() {
    let is_there = Command::new("g++").arg("--version").output().is_ok_and(|output| output.status.success());
    if !is_there || compilers().is_empty() {
        eprintln!("skipped: there is no g++, or no compiler of C");
        return;
    }
    let model = crate::models::CartesianPendulum { m: 0.7, l: 1.3, g: 9.81 };
    let folder = folder("cpp");
    model.in_c().without_example().write(&folder).unwrap();
    let text = "#include \"cartesian_pendulum.h\"\nint main() {\n  double p[3] = {0.7, 1.3, 9.81}, \
                k[CARTESIAN_PENDULUM_CONSTANTS + 1], q[2] = {0.0, -1.3}, u[2] = {0.0, 0.0}, a[2], l[1];\n  \
                cartesian_pendulum_constants(p, k);\n  \
                return cartesian_pendulum_accelerations(p, k, 0.0, q, u, a, l);\n}\n";
    std::fs::write(folder.join("main.cpp"), text).unwrap();
    compile(&compilers()[0], &folder, &["-c"], &["cartesian_pendulum.c"], "model.o");
    let mut command = Command::new("g++");
    command.current_dir(&folder).args(["-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    let output = command.args(["main.cpp", "model.o", "-o", "program", "-lm"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(Command::new(folder.join("program")).status().unwrap().success());
}

/// The library's sines refuse arithmetic that changes their bits.
#[test]
fn sines_refuse_fast_mathematics() {
    let model = crate::models::DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    for compiler in compilers() {
        let folder = folder(&format!("fast_{compiler}"));
        model.in_c().library_sines().write(&folder).unwrap();
        let mut command = Command::new(&compiler);
        command.current_dir(&folder).args(["-std=c99", "-ffast-math", "-c", "double_pendulum.c"]);
        let output = command.output().unwrap();
        assert!(!output.status.success() && String::from_utf8_lossy(&output.stderr).contains("doubles"));
    }
}

/// Multipliers have the units of forces, as columns of motions have.
#[test]
fn headers_name_rows_and_what_functions_write() {
    use crate::models::{CartesianPendulum, Sleigh};
    let lines: Vec<&str> = CartesianPendulum::C.header.lines().collect();
    for line in [
        " *   l[0]  rod  [N/m]",
        " *   r[0]  rod  [m^2]",
        " * cartesian_pendulum_outputs writes",
        " *   out[0]  tension  [N]",
    ] {
        assert!(lines.contains(&line), "{line} in {}", CartesianPendulum::C.header);
    }
    assert!(!CartesianPendulum::C.header.contains("_SINGULAR"));
    assert!(Sleigh::C.header.contains(" *   l[0]  edge  [N]"), "{}", Sleigh::C.header);
}
