//! The campaign on stable Rust: numbered cases, each the same on every machine.
//!
//! ```text
//! cargo run --manifest-path tests/fuzz/Cargo.toml -- --seconds 20
//! # One case again, its input printed.
//! cargo run --manifest-path tests/fuzz/Cargo.toml -- --case 4711
//! ```
//! `--from N` starts at another case, `--threads N`, `--limit SECONDS` per case, `--stack MEBIBYTES` per
//! case; `--seeds FOLDER` writes the models for the coverage-guided target.
//!
//! The cases run in a process of their own, so that a stack overflow, which kills a process, is a finding
//! like any other: the case is noted before it runs.

use std::collections::BTreeMap;
use std::os::unix::fs::FileExt;
use std::process::{Command, ExitCode};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use std::{env, fs, panic, process, thread};

use dynamics_fuzz::corpus;
use dynamics_fuzz::generate::{Input, input};
use dynamics_fuzz::target::{Outcome, check, check_raw};
use dynamics_fuzz::trees::stream;
use dynamics_fuzz::{engine, random::Random};

#[derive(Clone, Debug)]
struct Options {
    seconds: f64,
    from: u64,
    case: Option<u64>,
    threads: u64,
    limit: f64,
    stack: usize,
    child: bool,
    seeds: Option<String>,
}

impl Options {
    fn read() -> Result<Self, String> {
        // A compiler's thread has 8 MiB, of which some is in use when a macro runs.
        let mut o = Self {
            seconds: 20.0,
            from: 0,
            case: None,
            threads: 1,
            limit: 20.0,
            stack: 6,
            child: false,
            seeds: None,
        };
        let mut arguments = env::args().skip(1);
        while let Some(name) = arguments.next() {
            if name == "--child" {
                o.child = true;
                continue;
            }
            let text = arguments.next().ok_or_else(|| format!("`{name}` needs a value"))?;
            let bad = |_| format!("`{name}` cannot be `{text}`");
            match name.as_str() {
                "--seconds" => o.seconds = text.parse().map_err(|_| bad(()))?,
                "--from" => o.from = text.parse().map_err(|_| bad(()))?,
                "--case" => o.case = Some(text.parse().map_err(|_| bad(()))?),
                "--threads" => o.threads = text.parse().map_err(|_| bad(()))?,
                "--limit" => o.limit = text.parse().map_err(|_| bad(()))?,
                "--stack" => o.stack = text.parse().map_err(|_| bad(()))?,
                "--seeds" => o.seeds = Some(text),
                _ => return Err(format!("`{name}` is unknown; see the head of main.rs")),
            }
        }
        Ok(o)
    }
}

fn main() -> ExitCode {
    let options = match Options::read() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    if let Some(folder) = &options.seeds {
        return write_seeds(folder);
    }
    if let Some(case) = options.case {
        return one(case, &options);
    }
    if options.child { campaign(&options) } else { watched() }
}

/// Writes the models of the repository where the coverage-guided target starts from.
fn write_seeds(folder: &str) -> ExitCode {
    let write = || -> std::io::Result<()> {
        fs::create_dir_all(folder)?;
        for (i, seed) in corpus::read().iter().enumerate() {
            let text = format!("{}\n---\n{}", stream(&seed.declaration), stream(&seed.implementation));
            fs::write(format!("{folder}/{i:03}"), text)?;
        }
        Ok(())
    };
    match write() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{folder}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// File in which the cases that run are noted, eight bytes for each thread.
fn notes(of: u32) -> std::path::PathBuf {
    env::temp_dir().join(format!("dynamics-fuzz-{of}"))
}

/// Runs the campaign in a child and says which case ended it, if one did.
fn watched() -> ExitCode {
    let myself = env::current_exe().expect("a running program has a path");
    let mut child = Command::new(myself)
        .args(env::args().skip(1))
        .arg("--child")
        .spawn()
        .expect("a program can run itself");
    let notes = notes(child.id());
    let status = child.wait().expect("the child was started");
    let noted = fs::read(&notes).unwrap_or_default();
    let _ = fs::remove_file(notes);
    if status.code().is_none() {
        let cases: Vec<u64> = noted.as_chunks().0.iter().map(|c| u64::from_le_bytes(*c)).collect();
        eprintln!("the campaign died ({status}) in one of the cases {cases:?}; run each with `--case`");
    }
    if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn run(input: &Input) -> Result<Outcome, String> {
    match input {
        Input::Model(declaration, implementation) => check(declaration, implementation),
        Input::Tokens(tokens) => check_raw(tokens),
        Input::Engine(seed) => engine::check(*seed),
    }
}

fn one(case: u64, options: &Options) -> ExitCode {
    let work = move || {
        let input = input(case, &corpus::read());
        match &input {
            Input::Model(a, b) => println!("{a}\n\n{b}\n"),
            other => println!("{other:?}\n"),
        }
        let begin = Instant::now();
        let result = run(&input);
        println!("{result:?} in {:.3} s", begin.elapsed().as_secs_f64());
        result.is_ok()
    };
    let thread = thread::Builder::new().stack_size(options.stack << 20).spawn(work).expect("a thread starts");
    if matches!(thread.join(), Ok(true)) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What a campaign counts.
#[derive(Default)]
struct Tally {
    executions: u64,
    accepted: u64,
    engine: u64,
    slowest: (f64, u64),
    /// What went wrong, by its first words, with the first case.
    findings: BTreeMap<String, (u64, u64)>,
}

type Running = Arc<Mutex<Vec<Option<(u64, Instant)>>>>;

fn campaign(options: &Options) -> ExitCode {
    let models = corpus::read().len();
    assert!(models > 0, "no model found in the repository");
    println!("{models} models to start from, cases from {}", options.from);
    panic::set_hook(Box::new(|information| {
        let place = information.location().map(ToString::to_string).unwrap_or_default();
        let text = information.payload_as_str().unwrap_or("no text");
        PANIC.with_borrow_mut(|p| *p = format!("panic at {place}: {text}"));
    }));
    let file = fs::File::create(notes(process::id())).expect("a file for notes");
    let file = Arc::new(file);
    let tally = Arc::new(Mutex::new(Tally::default()));
    let next = Arc::new(AtomicU64::new(options.from));
    let running: Running = Arc::new(Mutex::new(vec![None; options.threads as usize]));
    let begin = Instant::now();
    let end = begin + Duration::from_secs_f64(options.seconds);
    let workers: Vec<_> = (0..options.threads)
        .map(|slot| {
            let shared = (file.clone(), tally.clone(), next.clone(), running.clone());
            let work = move || worker(slot, end, &shared.0, &shared.1, &shared.2, &shared.3);
            thread::Builder::new().stack_size(options.stack << 20).spawn(work).expect("a thread starts")
        })
        .collect();
    while workers.iter().any(|w| !w.is_finished()) {
        thread::sleep(Duration::from_millis(100));
        let hung = running
            .lock()
            .expect("no worker panics while it holds this")
            .iter()
            .flatten()
            .copied()
            .find(|(_, since)| since.elapsed().as_secs_f64() > options.limit);
        if let Some((case, _)) = hung {
            eprintln!("case {case} runs longer than {} s", options.limit);
            report(&tally, begin);
            return ExitCode::FAILURE;
        }
    }
    let _ = fs::remove_file(notes(process::id()));
    if report(&tally, begin) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

thread_local! {
    static PANIC: std::cell::RefCell<String> = const { std::cell::RefCell::new(String::new()) };
}

fn worker(
    slot: u64,
    end: Instant,
    notes: &fs::File,
    tally: &Mutex<Tally>,
    next: &AtomicU64,
    running: &Mutex<Vec<Option<(u64, Instant)>>>,
) {
    // Tokens stay on their thread.
    let seeds = corpus::read();
    while Instant::now() < end {
        // Neighbouring numbers share nothing after one step of the generator.
        let case = Random::new(next.fetch_add(1, Ordering::Relaxed)).draw();
        notes.write_all_at(&case.to_le_bytes(), 8 * slot).expect("notes can be written");
        let begin = Instant::now();
        running.lock().expect("no holder panics")[slot as usize] = Some((case, begin));
        let mut on_engine = false;
        let result = panic::catch_unwind(panic::AssertUnwindSafe(|| {
            // What earlier cases left in the table of source texts is not needed any more.
            proc_macro2::extra::invalidate_current_thread_spans();
            let input = input(case, &seeds);
            on_engine = matches!(input, Input::Engine(_));
            run(&input)
        }));
        running.lock().expect("no holder panics")[slot as usize] = None;
        let result = result.unwrap_or_else(|_| Err(PANIC.take()));
        let seconds = begin.elapsed().as_secs_f64();
        let mut tally = tally.lock().expect("no holder panics");
        tally.executions += 1;
        tally.engine += u64::from(on_engine);
        tally.accepted += u64::from(result == Ok(Outcome::Accepted));
        if seconds > tally.slowest.0 {
            tally.slowest = (seconds, case);
        }
        if let Err(finding) = result {
            let key: String = finding.chars().take(100).collect();
            let entry = tally.findings.entry(key).or_insert_with(|| {
                eprintln!("case {case}: {finding}");
                (case, 0)
            });
            entry.1 += 1;
        }
    }
}

/// Prints the tally; true where nothing was found.
fn report(tally: &Mutex<Tally>, begin: Instant) -> bool {
    let tally = tally.lock().expect("no holder panics");
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "{} cases in {seconds:.0} s ({:.0} per second), {} of them for the engine alone, {} accepted; \
         slowest {:.2} s (case {})",
        tally.executions,
        tally.executions as f64 / seconds,
        tally.engine,
        tally.accepted,
        tally.slowest.0,
        tally.slowest.1
    );
    for (finding, (case, times)) in &tally.findings {
        println!("FOUND {times} times, first in case {case}: {finding}");
    }
    tally.findings.is_empty()
}
