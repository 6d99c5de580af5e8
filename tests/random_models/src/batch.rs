//! Packages of models: written, compiled, run, and what came of each.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use random_models::interpret::{Refused, UNMET};

use crate::cases::{Case, Expectation};
use crate::glue::glue;
use crate::interpretations::{Interpretations, interpretations};

/// What came of many models.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    pub models: usize,
    /// Compiled without an error.
    pub accepted: usize,
    /// Compiled, run and compared.
    pub judged: usize,
    pub comparisons: usize,
    /// Of these, comparisons with the engine's interpreter.
    pub by_interpreter: usize,
    /// Accepted models that the interpreter says nothing of.
    pub uninterpreted: usize,
    /// Refused models by what the error says, names left out.
    pub refused: BTreeMap<String, usize>,
    pub findings: Vec<String>,
}

impl Tally {
    pub fn add(&mut self, other: Self) {
        self.models += other.models;
        self.accepted += other.accepted;
        self.judged += other.judged;
        self.comparisons += other.comparisons;
        self.by_interpreter += other.by_interpreter;
        self.uninterpreted += other.uninterpreted;
        other.refused.into_iter().for_each(|(reason, n)| *self.refused.entry(reason).or_default() += n);
        self.findings.extend(other.findings);
    }

    #[must_use]
    pub fn line(&self) -> String {
        let refused: usize = self.refused.values().sum();
        format!(
            "{} models, {} accepted, {} run with {} comparisons ({} with the interpreter, \
            {} models without), \
             {refused} refused, {} findings",
            self.models,
            self.accepted,
            self.judged,
            self.comparisons,
            self.by_interpreter,
            self.uninterpreted,
            self.findings.len()
        )
    }

    #[must_use]
    pub fn closing(&self) -> String {
        let reasons =
            self.refused.iter().map(|(reason, n)| format!("  {n:5} refused: {reason}\n")).collect::<String>();
        format!("{reasons}{}", self.line())
    }
}

/// Where packages are written and compiled.
pub struct Batch<'a> {
    library: &'a Path,
    folder: PathBuf,
    keep: bool,
    run: bool,
}

/// What random expressions come to now and then, and the macro is right to refuse.
const DEGENERATE: [&str; 3] = [
    "acts on nothing that can move, or is identically zero",
    "never crosses zero because it is constant",
    "the parameter `period` has no influence",
];

/// What it says of constraints that exclude each other, or ask for what is out of reach.
const NO_STATE: &str = "no state was found in which all constraints hold";

/// What the macro says of a model that is too large.
const TOO_LARGE: &str = "the limit is";

/// Programs of a package: they are compiled side by side.
const PROGRAMS: usize = 2;

/// What the compiler says of one module.
#[derive(Clone, Debug, Default)]
struct Said {
    errors: Vec<String>,
    warnings: Vec<String>,
}

/// What came of a package.
struct Compiled {
    /// What is said of each module.
    said: BTreeMap<String, Said>,
    succeeded: bool,
    /// The executables, or all that was said.
    output: Vec<String>,
}

/// The workspace's levels: packages find crates of others compiled in the target folder. What the models run
/// is short, and compiled for speed of compiling.
const PROFILE: &str = "[profile.dev]
debug = \"line-tables-only\"
incremental = false
[profile.dev.build-override]
opt-level = 1
[profile.dev.package]
nalgebra.opt-level = 2
dynamics-symbolic.opt-level = 1
syn.opt-level = 0
";

impl<'a> Batch<'a> {
    #[must_use]
    pub fn new(library: &'a Path, keep: bool, run: bool) -> Self {
        // One folder for each checkout, so that the judge is compiled once for it.
        let hash =
            library.to_string_lossy().bytes().fold(0_u32, |h, b| h.wrapping_mul(31).wrapping_add(b.into()));
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("target/packages/{hash:08x}"));
        Self { library, folder, keep, run }
    }

    /// Compiles and runs these models.
    ///
    /// # Errors
    /// Packages that cannot be written, and compilers that cannot be run.
    pub fn judge(&self, cases: &[Case]) -> Result<Tally, String> {
        let result = self.compile_and_run(cases);
        if !self.keep {
            ["models", "mistaken"]
                .iter()
                .for_each(|kind| drop(fs::remove_dir_all(self.folder.join(kind).join("src"))));
        }
        result
    }

    fn compile_and_run(&self, cases: &[Case]) -> Result<Tally, String> {
        let mut tally = Tally { models: cases.len(), ..Tally::default() };
        let (mistaken, rest): (Vec<&Case>, Vec<&Case>) =
            cases.iter().partition(|case| case.expectation == Expectation::Refused);
        if !mistaken.is_empty() {
            let said = self.compile("mistaken", &mistaken, &Interpretations::new(), false)?.said;
            for case in &mistaken {
                match said.get(&case.module) {
                    Some(said) if !said.errors.is_empty() => refuse(&mut tally, case, said),
                    _ => tally.findings.push(format!("finding {}: it is not refused", case.title)),
                }
            }
        }
        let interpreted = if self.run { interpretations(&rest) } else { Interpretations::new() };
        let mut left = rest;
        // An error in one model hides others of a later stage of the compiler.
        while !left.is_empty() {
            let Compiled { said, succeeded, output } =
                self.compile("models", &left, &interpreted, self.run)?;
            let mut refused = BTreeSet::new();
            for case in &left {
                let Some(said) = said.get(&case.module) else { continue };
                if said.errors.is_empty() {
                    if succeeded {
                        said.warnings
                            .iter()
                            .for_each(|w| tally.findings.push(format!("finding {}: {w}", case.title)));
                    }
                    continue;
                }
                refused.insert(case.module.clone());
                refuse(&mut tally, case, said);
                // The interpreter looks for such a state by itself.
                let is_unmet =
                    matches!(interpreted.get(&case.module), Some(Ok(values)) if values.ends_with(UNMET));
                let is_excused = DEGENERATE.iter().any(|reason| said.errors[0].contains(reason))
                    || case.is_large && said.errors[0].contains(TOO_LARGE)
                    || is_unmet && said.errors[0].contains(NO_STATE);
                if case.expectation == Expectation::Runs && !is_excused {
                    tally.findings.push(format!("finding {}: it is refused: {}", case.title, said.errors[0]));
                }
            }
            if succeeded {
                tally.accepted += left.len();
                if self.run {
                    uninterpreted(&mut tally, &left, &interpreted);
                    output.iter().try_for_each(|program| self.judged(&left, program, &mut tally))?;
                }
                break;
            }
            if refused.is_empty() {
                return Err(format!(
                    "the package does not compile, and no model is why:\n{}",
                    output.concat()
                ));
            }
            left.retain(|case| !refused.contains(&case.module));
        }
        Ok(tally)
    }

    /// Writes a package and compiles it.
    fn compile(
        &self,
        kind: &str,
        cases: &[&Case],
        interpreted: &Interpretations,
        build: bool,
    ) -> Result<Compiled, String> {
        let folder = self.folder.join(kind);
        let count = self.write(&folder, kind, cases, interpreted)?;
        let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        command.current_dir(&folder).args([if build { "build" } else { "check" }, "--message-format=short"]);
        command.env("CARGO_INCREMENTAL", "0").env("CARGO_TERM_COLOR", "never");
        let target =
            std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| self.library.join("target").into());
        command.env("CARGO_TARGET_DIR", &target);
        let output = command.output().map_err(|e| format!("cargo: {e}"))?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let mut said = read(&text);
        for case in cases {
            // The glue cannot call functions of a block that is refused.
            let last = case.text.lines().count();
            if let Some(said) = said.get_mut(&case.module) {
                let is_own = |error: &String| {
                    error.split(':').nth(1).and_then(|l| l.parse().ok()).is_none_or(|l: usize| l <= last)
                };
                if said.errors.iter().any(is_own) {
                    said.errors.retain(is_own);
                }
            }
        }
        let executables =
            (0..count).map(|k| Path::new(&target).join(format!("debug/{kind}_{k}")).display().to_string());
        let succeeded = output.status.success();
        Ok(Compiled { said, succeeded, output: if succeeded { executables.collect() } else { vec![text] } })
    }

    /// Writes a package: how many programs it has.
    fn write(
        &self,
        folder: &Path,
        kind: &str,
        cases: &[&Case],
        interpreted: &Interpretations,
    ) -> Result<usize, String> {
        let source = folder.join("src");
        // What an earlier package left would be compiled, too.
        let _ = fs::remove_dir_all(&source);
        fs::create_dir_all(&source).map_err(|e| e.to_string())?;
        let library = self.library.display();
        let judge = self.folder.join("judge");
        fs::create_dir_all(&judge).map_err(|e| e.to_string())?;
        let judged = Path::new(env!("CARGO_MANIFEST_DIR")).join("judge/lib.rs");
        let profile = format!("{PROFILE}{kind}.debug = 0\n");
        let manifest = |name: &str, rest: &str| {
            format!(
                "[package]\nname = \"{name}\"\nversion = \"0.0.0\"\nedition = \"2024\"\n{rest}\n\
                 [dependencies]\ndynamics = {{ path = \"{library}\", default-features = false, features = [\"std\"] }}\n"
            )
        };
        let write = |path: PathBuf, text: String| {
            fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
        };
        write(
            judge.join("Cargo.toml"),
            manifest("judge", &format!("[lib]\npath = \"{}\"", judged.display())),
        )?;
        let lock = self.library.join("Cargo.lock");
        if lock.exists() && !folder.join("Cargo.lock").exists() {
            fs::copy(lock, folder.join("Cargo.lock")).map_err(|e| e.to_string())?;
        }
        for case in cases {
            let values = interpreted.get(&case.module).and_then(|said| said.as_ref().ok());
            let glue = glue(&case.text, values.map_or("", String::as_str));
            write(source.join(format!("{}.rs", case.module)), format!("{}\n{glue}", case.text))?;
        }
        // Twins stand side by side in one program.
        let mut groups: Vec<Vec<&Case>> = vec![Vec::new(); if cases.len() > 20 { PROGRAMS } else { 1 }];
        let count = groups.len();
        for case in cases {
            let number = case.module.trim_end_matches("_twin").bytes().map(usize::from).sum::<usize>();
            groups[number % count].push(case);
        }
        let mut programs = String::new();
        for (k, group) in groups.iter().enumerate() {
            write(source.join(format!("program_{k}.rs")), program(group))?;
            programs += &format!("[[bin]]\nname = \"{kind}_{k}\"\npath = \"src/program_{k}.rs\"\n");
        }
        let batch =
            manifest(kind, "") + "judge = { path = \"../judge\" }\n[workspace]\n" + &programs + &profile;
        write(folder.join("Cargo.toml"), batch)?;
        Ok(count)
    }

    fn judged(&self, cases: &[&Case], executable: &str, tally: &mut Tally) -> Result<(), String> {
        let Output { stdout, stderr, status } =
            Command::new(executable).output().map_err(|e| format!("{executable}: {e}"))?;
        let text = String::from_utf8_lossy(&stdout);
        let title = |module: &str| {
            cases.iter().find(|c| c.module == module).map_or(module.to_owned(), |c| c.title.clone())
        };
        for line in text.lines() {
            if let Some((module, what)) = line.strip_prefix("finding ").and_then(|rest| rest.split_once(": "))
            {
                tally.findings.push(format!("finding {}: {what}", title(module)));
            } else if let Some(rest) = line.strip_prefix("judged ") {
                tally.judged += 1;
                let count = |k: usize| rest.split(' ').nth(k).and_then(|n| n.parse().ok()).unwrap_or(0);
                tally.comparisons += count(1);
                tally.by_interpreter += count(5);
            }
        }
        if !status.success() {
            let last = String::from_utf8_lossy(&stderr).lines().last().unwrap_or_default().to_owned();
            tally.findings.push(format!("finding: the models' program ends with {status}: {last}"));
        }
        Ok(())
    }
}

/// Accepted models of which the interpreter says nothing: what it refuses the compiler should have, too.
fn uninterpreted(tally: &mut Tally, accepted: &[&Case], interpreted: &Interpretations) {
    for case in accepted {
        match interpreted.get(&case.module) {
            Some(Ok(said)) if said != UNMET => {}
            Some(Ok(_) | Err(Refused::Unsupported(_))) => tally.uninterpreted += 1,
            Some(Err(Refused::Model(why))) => {
                tally.findings.push(format!("finding {}: compiled, but not interpreted: {why}", case.title));
            }
            None => tally.findings.push(format!("finding {}: its interpreter ended", case.title)),
        }
    }
}

/// The program that judges these models.
fn program(cases: &[&Case]) -> String {
    let mut text = String::from(
        "#![allow(mixed_script_confusables, unused_imports)]\nuse judge::{WithJacobians, Without};\n",
    );
    for case in cases {
        text += &format!("mod {};\n", case.module);
    }
    text += "fn main() {\n    judge::run(&[\n";
    for case in cases {
        let module = &case.module;
        text += &format!(
            "        (\"{module}\", &judge::Derived \
             {{ model: {module}::glue::model(), own: {module}::glue::own, \
             slopes: (&judge::Find({module}::glue::model)).slopes(), report: {module}::glue::REPORT, \
             interpreted: {module}::glue::INTERPRETED }}),\n"
        );
    }
    text + "    ]);\n}\n"
}

/// Counts a refused model, whose error has to be one.
fn refuse(tally: &mut Tally, case: &Case, said: &Said) {
    *tally.refused.entry(reason_of(&said.errors[0])).or_default() += 1;
    // The same mistake may be written several times, and a model that may be refused may have several
    // reasons: each with a place of its own.
    let several = case.expectation == Expectation::Either;
    let mut different: Vec<String> = Vec::new();
    for (k, error) in said.errors.iter().enumerate() {
        let reason = reason_of(error);
        let is_apart = several && said.errors[..k].iter().all(|other| !is_beside(error, other));
        let is_known = DEGENERATE.iter().any(|degenerate| reason.contains(&without_names(degenerate)))
            || reason.contains(TOO_LARGE);
        let is_rustcs = reason.starts_with("[E") && !reason.starts_with("[E0080]");
        if !is_known && !different.contains(&reason) && (k == 0 || !is_apart || is_rustcs) {
            different.push(reason);
        }
    }
    if different.len() > 1 {
        let errors = said.errors.iter().take(4).map(String::as_str).collect::<Vec<_>>().join("\n    ");
        tally.findings.push(format!(
            "finding {}: {} errors for one:\n    {errors}",
            case.title,
            said.errors.len()
        ));
    }
}

/// Whether two errors are told of the same few words.
fn is_beside(a: &str, b: &str) -> bool {
    let place = |error: &str| -> Option<(usize, usize)> {
        let mut parts = error.split(':').skip(1);
        Some((parts.next()?.parse().ok()?, parts.next()?.trim().parse().ok()?))
    };
    match (place(a), place(b)) {
        (Some(a), Some(b)) => a.0 == b.0 && a.1.abs_diff(b.1) <= 12,
        _ => true,
    }
}

/// What an error says, without place and names.
fn reason_of(error: &str) -> String {
    let message = error.split_once("error").map_or(error, |(_, message)| message);
    let message = message.split(": evaluation of `").next().unwrap_or_default();
    without_names(message.trim_start_matches(": "))
}

/// Names are in backticks: without them reasons are few.
fn without_names(message: &str) -> String {
    message.split('`').enumerate().map(|(i, part)| if i % 2 == 0 { part } else { "`_`" }).collect()
}

/// Errors and warnings by module, from lines as `src/case_1.rs:3:5: error: message`.
fn read(text: &str) -> BTreeMap<String, Said> {
    let mut modules: BTreeMap<String, Said> = BTreeMap::new();
    for line in text.lines() {
        let Some((file, rest)) = line.strip_prefix("src/").and_then(|line| line.split_once(".rs:")) else {
            continue;
        };
        let message = rest.splitn(3, ':').nth(2).unwrap_or_default().trim();
        let said = modules.entry(file.to_owned()).or_default();
        if message.starts_with("error") {
            said.errors.push(format!("{file}.rs:{rest}"));
        } else if message.starts_with("warning") {
            said.warnings.push(format!("{file}.rs:{rest}"));
        }
    }
    modules
}
