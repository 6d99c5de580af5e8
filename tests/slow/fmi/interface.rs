//! The functions of the standard, driven by a program in C.

use std::fs;
use std::path::Path;
use std::process::Command;

use roxmltree::Document;

use crate::compiler::{STRICT, compilers};
use crate::units::{MOST_TOLERANCES, TOLERANCE, Unit, folder, largest, units};

/// What finds accesses out of bounds, leaks and undefined behaviour, where the compiler has it.
const SANITIZED: &[&str] = &["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];

/// Compiles to a program; `Err` with what the compiler says.
fn compile(compiler: &str, folder: &Path, flags: &[&str], files: &[String]) -> Result<(), String> {
    let mut command = Command::new(compiler);
    command.current_dir(folder).args(STRICT).args(flags).args(files).args(["-o", "interface", "-lm"]);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() && said.is_empty() { Ok(()) } else { Err(said) }
}

/// Whether a compiler makes programs with sanitizers, and these run.
fn can_sanitize(compiler: &str) -> bool {
    let folder = folder("sanitized");
    fs::write(folder.join("none.c"), "int main(void) { return 0; }\n").unwrap();
    compile(compiler, &folder, SANITIZED, &["none.c".to_owned()]).is_ok()
        && Command::new(folder.join("interface")).status().is_ok_and(|status| status.success())
}

/// What the program prints.
struct Printed {
    /// Derivatives at the start, then the state at t = 1.
    numbers: Vec<f64>,
    /// Times of events.
    events: Vec<f64>,
    /// Value references of unknowns and knowns whose derivative at the start is not 0.
    rates: Vec<(usize, usize)>,
}

fn drive(unit: &Unit, compiler: &str, flags: &[&str]) -> Printed {
    let folder = folder(&format!("{}_{compiler}", unit.name));
    let mut files = unit.write_sources(&folder);
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("fmi/interface.c"), folder.join("interface.c"))
        .unwrap();
    files.push("interface.c".to_owned());
    let directional = format!("-DDIRECTIONAL={}_DIRECTIONAL", unit.prefix.to_uppercase());
    let header = format!("-DUNIT=\"{}_fmu.h\"", unit.prefix);
    // The only switched constraint here is released.
    let held = format!("-DHELD={}", if unit.directional { unit.rows } else { 0 });
    let flags = [flags, &[directional.as_str(), header.as_str(), held.as_str()]].concat();
    if let Err(said) = compile(compiler, &folder, &flags, &files) {
        panic!("{compiler} in {}:\n{said}", folder.display());
    }
    let output = Command::new(folder.join("interface")).output().unwrap();
    assert!(output.status.success(), "{}:\n{}", unit.name, String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let plain = text.lines().filter(|line| !line.starts_with(char::is_alphabetic));
    let after = |word: &'static str| text.lines().filter_map(move |line| line.strip_prefix(word));
    let pair = |line: &str| {
        let (unknown, known) = line.split_once(' ').unwrap();
        (unknown.parse().unwrap(), known.parse().unwrap())
    };
    Printed {
        numbers: plain.map(number).collect(),
        events: after("event ").map(number).collect(),
        rates: after("rate ").map(pair).collect(),
    }
}

/// What has a derivative by a known lists it, where it lists any.
fn depends(unit: &Unit, rates: &[(usize, usize)]) {
    let document = Document::parse(unit.text("modelDescription.xml")).unwrap();
    let unknowns = document.descendants().filter(|node| node.has_attribute("dependencies"));
    for unknown in unknowns.filter(|node| node.has_tag_name("InitialUnknown")) {
        let reference: usize = unknown.attribute("valueReference").unwrap().parse().unwrap();
        let listed = unknown.attribute("dependencies").unwrap().split_whitespace();
        let listed: Vec<usize> = listed.map(|known| known.parse().unwrap()).collect();
        for (_, known) in rates.iter().filter(|(unknown, _)| *unknown == reference) {
            assert!(listed.contains(known), "{}: {reference} by {known}", unit.name);
        }
    }
}

#[test]
fn all_functions_do_what_the_standard_says() {
    for compiler in compilers() {
        let flags = if can_sanitize(&compiler) { SANITIZED } else { &[] };
        if flags.is_empty() {
            eprintln!("{compiler} has no sanitizers");
        }
        for unit in units() {
            let Printed { numbers, events, rates } = drive(unit, &compiler, flags);
            assert_eq!(rates.is_empty(), !unit.directional, "{}", unit.name);
            depends(unit, &rates);
            let (derivatives, end) = numbers.split_at(unit.states);
            assert_eq!(derivatives.len(), unit.derivatives.len(), "{}", unit.name);
            assert_eq!(end.len(), unit.states, "{}", unit.name);
            let near = |a: &f64, b: &f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
            let same = derivatives.iter().zip(&unit.derivatives).all(|(a, b)| near(a, b));
            assert!(same, "{}: {derivatives:?} {:?}", unit.name, unit.derivatives);
            let rust = &unit.runs[0];
            let last = &rust.values[rust.values.len() - 1][..unit.states];
            let apart = |(a, b): (&f64, &f64)| (a - b).abs() / (unit.size + b.abs());
            let off = largest(end.iter().zip(last).map(apart)) / TOLERANCE;
            eprintln!("{}: {off:.2} tolerances from Rust, {} events", unit.name, events.len());
            assert!(off <= MOST_TOLERANCES, "{}: {end:?} {last:?}", unit.name);
            assert_eq!(events.len(), rust.events.len(), "{}: {events:?} {:?}", unit.name, rust.events);
            let off = largest(events.iter().zip(&rust.events).map(|(a, b)| (a - b).abs()));
            assert!(off <= MOST_TOLERANCES * TOLERANCE, "{}: {events:?} {:?}", unit.name, rust.events);
        }
    }
}
