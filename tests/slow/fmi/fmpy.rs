//! Units in FMPy, a simulation tool in Python: its validator, and both interfaces against Rust.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use dynamics::prelude::*;
use serde_json::json;

use crate::models::CartPole;
use crate::units::{JUMP, MOST_TOLERANCES, TOLERANCE, folder, units};

/// The interpreter: `DYNAMICS_PYTHON`, else `python3`.
fn python() -> String {
    env::var("DYNAMICS_PYTHON").unwrap_or_else(|_| "python3".to_owned())
}

/// Whether the interpreter has FMPy; an error under `DYNAMICS_FMPY=1` where it has not.
fn has_fmpy() -> bool {
    let output = Command::new(python()).args(["-c", "import fmpy; print(fmpy.__version__)"]).output();
    let version = output.ok().filter(|output| output.status.success());
    let version = version.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    let is_needed = env::var("DYNAMICS_FMPY").is_ok_and(|value| value == "1");
    match &version {
        Some(version) => eprintln!("FMPy {version}"),
        None if is_needed => panic!("`{}` has no FMPy, and DYNAMICS_FMPY is 1", python()),
        None => eprintln!("skipped: `{}` has no FMPy (`pip install fmpy`)", python()),
    }
    version.is_some()
}

#[test]
fn fmpy_validates_and_moves_all_units() {
    if !has_fmpy() {
        return;
    }
    let all: Vec<_> = units()
        .iter()
        .map(|unit| {
            let runs = unit.runs.iter().map(|run| {
                json!({
                    "about": run.about,
                    "changed": run.changed.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
                    "jump": run.jump,
                    "own": run.own,
                    "times": run.times,
                    "values": run.values,
                    "events": run.events,
                })
            });
            let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmi").join(unit.name);
            json!({
                "name": unit.name,
                "path": path.join(format!("{}.fmu", unit.name)),
                "compared": unit.compared,
                "states": unit.states,
                "size": unit.size,
                "runs": runs.collect::<Vec<_>>(),
            })
        })
        .collect();
    let folder = folder("fmpy");
    // One with a library, which needs no build.
    let model = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let start = model.state().theta(0.3).push(0.5).build().unwrap();
    let binary = folder.join("built.fmu");
    model.fmu(start).tolerance(TOLERANCE).with_binary().write(&binary).unwrap();
    let jobs = json!({ "tolerance": TOLERANCE, "jump": JUMP, "most": MOST_TOLERANCES, "units": all, "binary": binary });
    fs::write(folder.join("jobs.json"), jobs.to_string()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fmi/fmpy_runs.py");
    let output = Command::new(python()).arg(script).arg(&folder).output().unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    eprintln!("{out}");
    assert!(output.status.success(), "{error}");
}
