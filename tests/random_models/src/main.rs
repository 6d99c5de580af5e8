//! Random whole models, compiled and run.
//!
//! ```sh
//! cargo run --target-dir target --manifest-path tests/random_models/Cargo.toml -- --models 1000
//! cargo run --target-dir target --manifest-path tests/random_models/Cargo.toml -- --models 0 --kinds 300
//! cargo run --target-dir target --manifest-path tests/random_models/Cargo.toml -- --case 17
//! cargo run --target-dir target --manifest-path tests/random_models/Cargo.toml -- --sizes 80 --size 34
//! ```
//!
//! A case is a number; the same number is the same model on every machine. From 1000000 on they are of
//! further kinds: bodies on one another, rows that repeat others, generalized speeds, friction by reactions.
//! Models are written into packages of a hundred, each in a module of its own, compiled once, and run: see
//! `judge/` for what is compared. What the macro refuses is taken out, counted by its reason, and has to be
//! one error.
//!
//! Beside the models' own functions on jets stands the engine's interpreter: the same text goes through the
//! macros' passes here, its equations are evaluated on the graph, and the values travel in the package.

mod batch;
mod cases;
mod expressions;
mod generate;
mod glue;
mod interpretations;
mod kinds;
mod mistakes;
mod names;
#[allow(dead_code, reason = "shared with the fuzzer, which draws more kinds of numbers")]
#[path = "../../fuzz/src/random.rs"]
mod random;
mod sizes;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use batch::{Batch, Tally};
use cases::{Case, defects};

const USAGE: &str = "Random models, compiled and run. Exit status 1 with findings.
  --from N        the first case (default 0)
  --models N      how many cases (default 100)
  --kinds N       as many models of bodies, joints, speeds, friction, from case 1000000 on (default 0)
  --size N        models in a package (default 100)
  --case N        prints one model and judges it
  --sizes N       families of models at sizes up to N (1, 2, 3, 5, 10, 20, 21, 30, 50, 80), damped and \
  undamped, alone
  --defects       the models of defects/ alone
  --check         compiles without running
  --library PATH  the checkout of dynamics to compile against (default: this one)
  --keep          leaves the packages where they were written";

struct Options {
    from: u64,
    models: u64,
    kinds: u64,
    size: u64,
    case: Option<u64>,
    sizes: Option<u64>,
    only_defects: bool,
    check: bool,
    library: PathBuf,
    keep: bool,
}

fn options() -> Result<Options, String> {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let mut options = Options {
        from: 0,
        models: 100,
        kinds: 0,
        size: 100,
        case: None,
        sizes: None,
        only_defects: false,
        check: false,
        library: here.join("../.."),
        keep: false,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(option) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{option} wants a value"));
        let number = |text: String| text.parse::<u64>().map_err(|_| format!("`{text}` is not a number"));
        match option.as_str() {
            "--from" | "--seed" => options.from = number(value()?)?,
            "--models" => options.models = number(value()?)?,
            "--kinds" => options.kinds = number(value()?)?,
            "--size" => options.size = number(value()?)?.max(1),
            "--case" => options.case = Some(number(value()?)?),
            "--sizes" => options.sizes = Some(number(value()?)?),
            "--library" => options.library = value()?.into(),
            "--defects" => options.only_defects = true,
            "--check" => options.check = true,
            "--keep" => options.keep = true,
            _ => return Err(format!("{option}: no such option\n{USAGE}")),
        }
    }
    options.library =
        options.library.canonicalize().map_err(|e| format!("{}: {e}", options.library.display()))?;
    Ok(options)
}

/// The cases that are asked for, in packages: the defects first.
fn packages(options: &Options) -> Vec<Vec<Case>> {
    if let Some(case) = options.case {
        let cases = Case::random(case);
        cases.iter().for_each(|case| println!("{}", case.text));
        return vec![cases];
    }
    if let Some(largest) = options.sizes {
        return sizes::families(largest).chunks(options.size as usize).map(<[Case]>::to_vec).collect();
    }
    let mut first = defects();
    if options.only_defects {
        return vec![first];
    }
    first.extend((kinds::FIRST..kinds::FIRST + options.kinds).flat_map(Case::random));
    let mut packages = Vec::new();
    let end = options.from + options.models;
    let mut from = options.from;
    while from < end {
        let next = end.min(from + options.size);
        first.extend((from..next).flat_map(Case::random));
        packages.push(std::mem::take(&mut first));
        from = next;
    }
    packages
}

fn main() -> ExitCode {
    let options = match options() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let start = Instant::now();
    let mut total = Tally::default();
    let packages = packages(&options);
    let count = packages.len();
    for (k, cases) in packages.into_iter().enumerate() {
        let batch = Batch::new(&options.library, options.keep, !options.check);
        match batch.judge(&cases) {
            Ok(tally) => {
                tally.findings.iter().for_each(|finding| println!("{finding}"));
                total.add(tally);
            }
            Err(message) => {
                eprintln!("{message}");
                return ExitCode::from(2);
            }
        }
        println!("-- package {} of {count}, {} s: {}", k + 1, start.elapsed().as_secs(), total.line());
    }
    println!("{}", total.closing());
    ExitCode::from(u8::from(!total.findings.is_empty()))
}
