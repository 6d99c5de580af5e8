//! A program in C that reads states and writes what all functions of a model return there, as doubles. The
//! library has no unsafe code, so that its functions are called by a program of their own.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::{fs, thread};

use dynamics::export::CExport;
use dynamics::model::{PrintedInC, SimulationModel, Vector};

use crate::compiler::compile;

/// A function that the driver calls, and how many numbers it returns.
pub(crate) struct Called {
    pub(crate) name: &'static str,
    pub(crate) results: usize,
    /// Whether a status stands before them.
    pub(crate) status: bool,
    /// Arguments beside p, t, q, u, w, m: of what is given, `k`, `a`, `l`, `r`.
    given: &'static [&'static str],
}

/// The functions of a model that its header declares, in order.
pub(crate) fn called<M: SimulationModel + PrintedInC>() -> Vec<Called> {
    let size = |what: &str| -> usize {
        let line = format!("#define {}_{what} ", M::C.name.to_uppercase());
        let found = M::C.header.lines().find_map(|text| text.strip_prefix(&line));
        found.unwrap_or_else(|| panic!("no {line}")).parse().unwrap()
    };
    let (n, r) = (size("COORDINATES"), size("ROWS"));
    let solution: &[&str] = if r > 0 { &["a", "l"] } else { &[] };
    let mut all = vec![
        ("accelerations", n + r, true, &["k"][..]),
        ("energies", size("ENERGIES"), false, &[]),
        ("conserved", size("CONSERVED"), false, &[]),
        ("powers", size("POWERS"), false, solution),
        ("outputs", size("OUTPUTS"), true, solution),
        ("events", size("EVENTS"), true, solution),
        ("kinks", size("KINKS"), false, &[]),
    ];
    if r > 0 {
        all.push(("residual", size("HOLONOMIC"), false, &[]));
        all.push(("velocity_residual", r, false, &[]));
        all.push(("correction", n, true, &["k", "r"]));
        all.push(("terms", n * n + n + r * n + r, false, &[]));
    }
    let all = all.into_iter().filter(|(_, results, ..)| *results > 0);
    all.map(|(name, results, status, given)| Called { name, results, status, given }).collect()
}

/// The driver's text.
fn driver<M: SimulationModel + PrintedInC>() -> String {
    let (name, upper) = (M::C.name, M::C.name.to_uppercase());
    let (n, p, w, r) = (M::COORDINATES.len(), M::PARAMETERS.len(), M::INPUTS.len(), M::ROWS.len());
    let s = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
    let arrays = [
        ("p", p),
        ("k", M::C.constants),
        ("q", n),
        ("u", n),
        ("w", w),
        ("m", s),
        ("a", n),
        ("l", r),
        ("r", r),
    ];
    let read = |array: &str, count: usize| format!("  ok = take({array}, {count}) && ok;\n");
    let mut text = format!(
        "#include \"{name}.h\"\n#include <stdio.h>\ntypedef {name}_real real;\n\
         static int take(real *into, int count)\n{{\n  int ok = 1;\n  int i;\n\
         \x20 for (i = 0; i < count; i++) {{\n    double x = 0.0;\n\
         \x20   ok = (fread(&x, sizeof x, 1, stdin) == 1) && ok;\n    into[i] = (real)x;\n  }}\n\
         \x20 return ok;\n}}\n\
         static void give(const real *from, int count)\n{{\n  int i;\n\
         \x20 for (i = 0; i < count; i++) {{\n    const double x = (double)from[i];\n\
         \x20   (void)fwrite(&x, sizeof x, 1, stdout);\n  }}\n}}\n\
         int main(void)\n{{\n  int ok = 1;\n  real t[1];\n"
    );
    for (array, count) in arrays {
        text.push_str(&format!("  real {array}[{}] = {{ 0 }};\n", count.max(1)));
    }
    let called = called::<M>();
    let most = called.iter().map(|function| function.results).max().unwrap();
    text.push_str(&format!("  real out[{most}];\n  real status[1];\n{}", read("p", p)));
    text.push_str(&format!("  {name}_constants(p, k);\n  ok = take(t, 1) && ok;\n  while (ok) {{\n"));
    for (array, count) in arrays.into_iter().skip(2) {
        text.push_str(&read(array, count));
    }
    for Called { name: function, results, status, given } in &called {
        let mut arguments = vec!["p"];
        arguments.extend(given.iter().filter(|x| **x == "k"));
        arguments.extend(["t[0]", "q", "u"]);
        arguments.extend((w > 0).then_some("w"));
        arguments.extend((s > 0).then_some("m"));
        arguments.extend(given.iter().filter(|x| **x != "k"));
        arguments.push("out");
        let second = format!("out + {n}");
        arguments.extend((*function == "accelerations" && r > 0).then_some(second.as_str()));
        let call = format!("{name}_{function}({})", arguments.join(", "));
        text.push_str(&match status {
            true => format!("  status[0] = (real){call};\n  give(status, 1);\n"),
            false => format!("  {call};\n"),
        });
        text.push_str(&format!("  give(out, {results});\n"));
    }
    text.push_str(&format!("  ok = take(t, 1) && ok;\n  }}\n  return {upper}_OK;\n}}\n"));
    text
}

/// A state as the driver reads it.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    /// t, q, u, inputs, modes.
    pub(crate) state: Vec<f64>,
    /// Accelerations, multipliers, and the right side of a correction.
    pub(crate) more: Vec<f64>,
}

/// The results of all functions at states, one after the other.
pub(crate) fn run<M: SimulationModel + PrintedInC>(
    export: &CExport<'_, M>,
    compiler: &str,
    folder: &Path,
    parameters: &[f64],
    given: &[Given],
) -> Vec<Vec<f64>> {
    export.write(folder).unwrap();
    fs::write(folder.join("driver.c"), driver::<M>()).unwrap();
    compile(compiler, folder, &[], &["driver.c", &format!("{}.c", M::C.name)], "driver");
    let bytes = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let mut input = bytes(parameters);
    given.iter().for_each(|g| input.extend([bytes(&g.state), bytes(&g.more)].concat()));
    let mut command = Command::new(folder.join("driver"));
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let writer = thread::spawn(move || stdin.write_all(&input));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(output.status.success(), "{}", M::NAME);
    let values: Vec<f64> =
        output.stdout.chunks_exact(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect();
    let width: usize = called::<M>().iter().map(|f| f.results + usize::from(f.status)).sum();
    assert_eq!(values.len(), width * given.len(), "{}", M::NAME);
    values.chunks(width).map(<[f64]>::to_vec).collect()
}

/// The parameters of a model.
pub(crate) fn parameters<M: SimulationModel>(model: &M) -> Vec<f64> {
    (0..M::PARAMETERS.len()).map(|i| model.parameter(i).unwrap()).collect()
}

/// A state, what it has been solved for, and a right side.
pub(crate) fn given<M: SimulationModel>(state: &M::State, [a, l, right]: [&[f64]; 3]) -> Given
where
    M::State: dynamics::model::ModelState,
{
    use dynamics::model::ModelState as _;
    let switched = M::CONSTRAINTS.iter().filter(|c| c.switched.is_some()).count();
    let modes: Vec<f64> = (0..switched).map(|i| state.active_set().side(i)).collect();
    let state =
        [&[state.t()][..], state.q().as_slice(), state.u().as_slice(), state.inputs().as_slice(), &modes];
    Given { state: state.concat(), more: [a, l, right].concat() }
}
