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
