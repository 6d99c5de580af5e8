//! The recipe of `docs/guide/c.md`: an example on an emulated Cortex-M4 prints what Rust computes.

use std::path::Path;
use std::process::{Command, Stdio};
use std::{fs, str};

use dynamics::prelude::*;

use crate::compiler::folder;
use crate::models::DoublePendulum;

const COMPILER: &str = "arm-none-eabi-gcc";
const EMULATOR: &str = "qemu-system-arm";

/// What the recipe says of the processor.
const PROCESSOR: &[&str] = &["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"];

fn answers(name: &str) -> bool {
    let mut command = Command::new(name);
    command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Compiles the example in a folder; `None`, with a line, where the compiler has no library for it.
fn compile(folder: &Path) -> Option<()> {
    for file in ["startup.c", "link.ld"] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("c/cortex_m").join(file);
        fs::copy(from, folder.join(file)).unwrap();
    }
    let run = |arguments: &[&str]| {
        let output = Command::new(COMPILER).current_dir(folder).args(PROCESSOR).args(arguments).output();
        let output = output.unwrap();
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    fs::write(folder.join("library.c"), "#include <math.h>\nint main(void) { return 0; }\n").unwrap();
    if !run(&["--specs=rdimon.specs", "-T", "link.ld", "startup.c", "library.c", "-o", "library"]).0 {
        eprintln!("skipped: {COMPILER} has no library of C");
        return None;
    }
    let strict = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];
    let (done, text) = run(&[&strict[..], &["-c", "double_pendulum.c", "main.c"]].concat());
    assert!(done && text.is_empty(), "{text}");
    let objects = ["double_pendulum.o", "main.o", "startup.c", "-o", "example.elf", "-lm"];
    let (done, text) = run(&[&["--specs=rdimon.specs", "-T", "link.ld"][..], &objects].concat());
    assert!(done, "{text}");
    Some(())
}

/// The last line that the example prints.
fn end(folder: &Path) -> Vec<f64> {
    let options = ["-M", "mps2-an386", "-kernel", "example.elf", "-semihosting", "-display", "none"];
    let mut command = Command::new(EMULATOR);
    command.current_dir(folder).args(options).args(["-monitor", "none", "-serial", "null"]);
    let output = command.stdin(Stdio::null()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = str::from_utf8(&output.stdout).unwrap();
    text.lines().last().unwrap().split(' ').map(|x| x.parse().unwrap()).collect()
}

#[test]
fn an_emulated_controller_has_the_bits_of_rust() {
    if !answers(COMPILER) || !answers(EMULATOR) {
        eprintln!("skipped: {COMPILER} and {EMULATOR} are not both there");
        return;
    }
    let model = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let start = model.state().theta1(2.0).build().unwrap();
    let step = 1.0 / 512.0;
    let motion = model.simulate(start).until(4.0).method(methods::Rk4).fixed_step(step).run().unwrap();
    let rust = [&[motion.end().t][..], motion.end().q.as_slice(), motion.end().u.as_slice()].concat();
    let example = || model.in_c().start(start).step(step).duration(4.0);
    for (name, export) in [("double", example().library_sines()), ("single", example().single_precision())] {
        let folder = folder(&format!("cortex_m_{name}"));
        export.write(&folder).unwrap();
        if compile(&folder).is_none() {
            return;
        }
        let end = end(&folder);
        let off = rust.iter().zip(&end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eprintln!("{name}: {off:.1e} apart");
        assert!(
            name == "single" && off < 1e-2 || end == rust || dynamics::sin_cos::FUSED,
            "{rust:?} {end:?}"
        );
    }
}
