//! A device that is a program of its own for the processor: the text of a kernel, compiled by a compiler of
//! C.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use dynamics::gpu::side_by_side_in_c;
use dynamics::model::{PrintedInC, SimulationModel};
use dynamics::simulate::{Batch, Device};

use crate::compiler::compile;

/// Reads a batch of doubles, moves all its runs and writes it.
const MAIN: &str = r"
static int take(double *into, size_t count)
{
  return fread(into, sizeof *into, count, stdin) == count;
}

int main(void)
{
  double sizes[3];
  size_t runs, run;
  double *given, *moving, *outcomes;
  if (!take(sizes, 3)) {
    return 1;
  }
  runs = (size_t)sizes[0];
  given = calloc((size_t)sizes[1], sizeof *given);
  moving = calloc((size_t)sizes[2], sizeof *moving);
  outcomes = calloc(runs, sizeof *outcomes);
  if (!take(given, (size_t)sizes[1]) || !take(moving, (size_t)sizes[2]) || !take(outcomes, runs)) {
    return 1;
  }
  for (run = 0; run < runs; run++) {
    while (outcomes[run] == 0.0) {
      outcomes[run] = (double)$_side_by_side(given, moving, runs, run, 7);
    }
  }
  (void)fwrite(moving, sizeof *moving, (size_t)sizes[2], stdout);
  (void)fwrite(outcomes, sizeof *outcomes, runs, stdout);
  return 0;
}
";

/// The device.
pub(crate) struct Host {
    program: PathBuf,
    /// How often it was called.
    pub(crate) calls: usize,
}

impl Host {
    pub(crate) fn new<M: SimulationModel + PrintedInC>(model: &M, compiler: &str, folder: PathBuf) -> Self {
        let headers = ["float", "math", "stddef", "stdio", "stdlib"].map(|h| format!("#include <{h}.h>\n"));
        let text = side_by_side_in_c(model).unwrap();
        let main = MAIN.replace('$', M::C.name);
        fs::write(folder.join("host.c"), format!("{}{text}{main}", headers.concat())).unwrap();
        compile(compiler, &folder, &[], &["host.c"], "host");
        Self { program: folder.join("host"), calls: 0 }
    }
}

impl Device for Host {
    type Error = std::io::Error;

    fn advance(&mut self, batch: &mut Batch) -> Result<(), std::io::Error> {
        self.calls += 1;
        let runs = batch.runs();
        let given = batch.given().to_vec();
        let (moving, found) = batch.moving();
        let sizes = [runs, given.len(), moving.len()].map(|size| size as f64);
        let outcomes = found.iter().map(|&outcome| f64::from(outcome));
        let all = sizes.into_iter().chain(given).chain(moving.iter().copied()).chain(outcomes);
        let input: Vec<u8> = all.flat_map(f64::to_le_bytes).collect();
        let mut command = Command::new(&self.program);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let mut stdin = child.stdin.take().expect("a pipe");
        let writer = std::thread::spawn(move || stdin.write_all(&input));
        let output = child.wait_with_output()?;
        writer.join().expect("it writes")?;
        assert!(output.status.success());
        let mut numbers = output.stdout.chunks_exact(8).map(|x| f64::from_le_bytes(x.try_into().unwrap()));
        moving.iter_mut().for_each(|x| *x = numbers.next().expect("a number"));
        found.iter_mut().for_each(|x| *x = numbers.next().expect("a number") as i32);
        Ok(())
    }
}
