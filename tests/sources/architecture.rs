//! Who may use whom: the rules of ARCHITECTURE.md, checked against the sources.

mod modules;
mod type_names;

use std::fs;
use std::path::{Path, PathBuf};

/// The library's crates but the façade.
const CRATES: &[&str] = &[
    "dynamics-simd",
    "dynamics-symbolic",
    "dynamics-vocabulary",
    "dynamics-macros",
    "dynamics-view",
    "dynamics-runtime",
    "dynamics-families",
    "dynamics-analysis",
    "dynamics-ensembles",
    "dynamics-gpu",
    "dynamics-python",
];

/// Where the workspace is.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All Rust files below `folder`, with their text; folders of unit tests are left out.
fn sources(folder: &str) -> Vec<(PathBuf, String)> {
    fn collect(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
        let mut entries: Vec<_> = fs::read_dir(folder)
            .unwrap_or_else(|e| panic!("cannot list {}: {e}", folder.display()))
            .map(|entry| entry.expect("a readable folder entry").path())
            .collect();
        entries.sort();
        for path in entries {
            if path.is_dir() {
                // Tests may look at files and at everything else.
                if path.file_name().is_some_and(|name| name != "tests") {
                    collect(&path, found);
                }
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("a source file is UTF-8");
                found.push((path, text));
            }
        }
    }
    let mut found = Vec::new();
    collect(&root().join(folder), &mut found);
    assert!(!found.is_empty(), "no sources below {folder}");
    found
}

/// The code of a file without comments and without its unit tests.
fn code(text: &str) -> String {
    let text = text.split("\n#[cfg(test)]\nmod tests").next().unwrap_or(text);
    text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// Asserts that no file of `folder` contains one of `words` in its code.
fn forbid(folder: &str, words: &[&str], why: &str) {
    for (path, text) in sources(folder) {
        let code = code(&text);
        for word in words {
            assert!(!code.contains(word), "{} uses `{word}`: {why}", path.display());
        }
    }
}

#[test]
fn the_engine_knows_no_tokens_and_no_spans() {
    forbid(
        "dynamics-symbolic/src",
        &["proc_macro", "syn::", "quote!", "Span", "dynamics_macros", "dynamics_runtime"],
        "the engine works on opaque origins and is usable without a macro",
    );
    let manifest = include_str!("../../dynamics-symbolic/Cargo.toml");
    let dependencies =
        manifest.split("\n[dependencies]").nth(1).unwrap_or("").split("\n[").next().unwrap_or("");
    assert!(
        dependencies.trim().is_empty(),
        "the engine depends on the standard library alone, not on {dependencies}"
    );
}

#[test]
fn the_runtime_knows_no_engine() {
    forbid(
        "dynamics-runtime/src",
        &["dynamics_symbolic", "dynamics_macros"],
        "the runtime sees only what is emitted",
    );
    let manifest = include_str!("../../dynamics-runtime/Cargo.toml");
    assert!(!manifest.contains("dynamics-symbolic") && !manifest.contains("dynamics-macros"));
}

/// Analyses stand above all but the façade and ensembles, which make many runs of what they vary: whoever
/// only simulates does not compile them.
#[test]
fn nothing_but_the_root_and_ensembles_use_the_analysis() {
    let above = ["dynamics-analysis", "dynamics-ensembles"];
    for name in CRATES.iter().filter(|name| !above.contains(name)) {
        let why = "an analysis asks a model, and no model, motion or picture asks an analysis";
        forbid(&format!("{name}/src"), &["dynamics_analysis"], why);
        let manifest = root().join(name).join("Cargo.toml");
        let manifest = fs::read_to_string(manifest).expect("every crate has a manifest");
        assert!(!manifest.contains("dynamics-analysis"), "{name} depends on the analysis: {why}");
    }
    forbid("dynamics-analysis/src", &["dynamics_symbolic", "dynamics_macros"], "it asks what is emitted");
    forbid("dynamics-ensembles/src", &["dynamics_symbolic", "dynamics_macros"], "it runs what is emitted");
}

#[test]
fn pictures_know_no_mechanics() {
    forbid(
        "dynamics-view/src",
        &["dynamics_runtime", "dynamics_symbolic", "dynamics_macros", "nalgebra"],
        "figures in, files out: whoever has a picture to draw brings its numbers",
    );
    let manifest = include_str!("../../dynamics-view/Cargo.toml");
    let dependencies = manifest.split("dependencies]").skip(1);
    let lines = dependencies.flat_map(|part| part.split("\n[").next().unwrap_or("").lines());
    let ours: Vec<_> = lines.filter(|line| line.starts_with("dynamics")).collect();
    assert!(ours.is_empty(), "pictures need nothing of the other crates, not {ours:?}");
}

#[test]
fn the_vocabulary_knows_pictures_alone() {
    forbid(
        "dynamics-vocabulary/src",
        &["dynamics_symbolic", "dynamics_macros", "dynamics_runtime"],
        "what models are written in knows neither their equations nor what moves them",
    );
    let manifest = include_str!("../../dynamics-vocabulary/Cargo.toml");
    let lines = manifest.split("dependencies]").skip(1).flat_map(str::lines);
    let ours: Vec<_> = lines.filter(|line| line.starts_with("dynamics")).collect();
    let permitted =
        ["simd", "view"].map(|of| format!("dynamics-{of} = {{ workspace = true, optional = true }}"));
    assert_eq!(ours, permitted, "vectors and pictures alone, if at all");
}

/// Vector instructions, and libraries and kernels of graphics cards, are what the compiler cannot check: each
/// stand in one file, behind what the rest uses safely.
#[test]
fn unsafe_code_stands_in_one_file_per_crate() {
    const FILES: [(&str, &str); 2] = [("dynamics-simd", "x86.rs"), ("dynamics-gpu", "launch.rs")];
    for name in CRATES {
        let manifest = fs::read_to_string(root().join(name).join("Cargo.toml")).expect("a manifest");
        let forbids = manifest.contains("[lints]\nworkspace = true");
        let denies = manifest.contains("unsafe_code = \"deny\"");
        let may = FILES.iter().any(|(of, _)| of == name);
        assert!(if may { denies } else { forbids }, "{name}");
    }
    for (name, file) in FILES {
        let all = sources(&format!("{name}/src"));
        let allowing = all.into_iter().filter(|(_, text)| text.contains("unsafe_code"));
        let files: Vec<_> = allowing.map(|(path, _)| path.file_name().map(|name| name.to_owned())).collect();
        assert_eq!(files, [Some(file.into())], "{name}");
    }
}

/// The macros need the text of bodies and joints, and no code that a build would have to compile for them.
#[test]
fn the_macros_read_the_text_of_the_vocabulary_alone() {
    for (path, text) in sources("dynamics-macros/src") {
        let code = code(&text);
        let uses = code.matches("dynamics_vocabulary").count();
        assert_eq!(uses, code.matches("dynamics_vocabulary::sources").count(), "{}", path.display());
    }
    let manifest = include_str!("../../dynamics-macros/Cargo.toml");
    let normal = manifest.split("[dev-dependencies]").next().unwrap_or("");
    assert!(normal.contains("\ndynamics-vocabulary.workspace = true\n"), "without features");
    assert!(!normal.contains("dynamics-runtime"));
}

#[test]
fn the_engine_is_layered() {
    let engine = "dynamics-symbolic/src";
    let layers = [
        "crate::calculus",
        "crate::algebra",
        "crate::mechanics",
        "crate::check",
        "crate::schedule",
        "crate::text",
    ];
    forbid(&format!("{engine}/graph"), &layers, "the graph is the bottom layer");
    forbid(&format!("{engine}/calculus"), &layers[1..], "differentiation needs the graph alone");
    forbid(&format!("{engine}/algebra"), &layers[2..], "linear algebra needs the graph alone");
    forbid(&format!("{engine}/mechanics"), &layers[3..], "equations come before checks, programs and texts");
}

#[test]
fn emission_never_sees_elaboration() {
    forbid("dynamics-macros/src/emit", &["crate::elaborate"], "emission prints what was compiled");
    forbid("dynamics-macros/src/syntax", &["crate::elaborate", "crate::emit"], "parsing comes first");
    forbid("dynamics-macros/src/elaborate", &["crate::emit"], "elaboration comes before emission");
}

#[test]
fn no_result_depends_on_the_order_of_a_hash_map() {
    for folder in ["dynamics-symbolic/src", "dynamics-macros/src"] {
        for (path, text) in sources(folder) {
            let code = code(&text);
            // The engine's one hash map cannot be iterated; everything else is a BTreeMap or a Vec.
            let lookup = path.ends_with("graph/arena.rs");
            assert!(
                lookup || !(code.contains("HashMap") || code.contains("HashSet")),
                "{} uses a hash container: iterate a BTreeMap or a Vec so that the same tokens give the same \
                 bytes",
                path.display()
            );
            if lookup {
                for use_ in
                    [".0.iter", ".0.keys", ".0.values", ".0.drain", ".0.into_iter", "in &self.0", "in self.0"]
                {
                    assert!(!code.contains(use_), "the lookup of {} is iterated", path.display());
                }
            }
        }
    }
}

#[test]
fn macros_are_pure_functions_of_their_tokens() {
    for folder in ["dynamics-symbolic/src", "dynamics-macros/src"] {
        forbid(
            folder,
            &["std::env", "std::fs", "std::time", "std::net", "std::process", "RandomState", "SystemTime"],
            "the same tokens must give the same bytes on every machine",
        );
    }
}

#[test]
fn every_method_runs_without_an_allocator() {
    let methods = include_str!("../../dynamics-runtime/src/integrate/choice.rs");
    // The documentation of a method names its scheme.
    let schemes = methods.split("[`integrate::").skip(1).filter_map(|rest| rest.split("`]").next());
    let mut schemes: Vec<&str> = schemes.collect();
    schemes.sort_unstable();
    schemes.dedup();
    assert!(schemes.len() >= 15, "{schemes:?}");
    let proof = code(include_str!("../no_std/src/lib.rs"));
    for scheme in schemes {
        assert!(proof.contains(&format!("{scheme}<")), "tests/no_std does not link `{scheme}`");
    }
}

/// Modules of a folder use each other in one direction, each with all that is below it, and hand results on
/// through their folder's own file. A circle is told with the names that tie its modules.
#[test]
fn modules_of_a_folder_use_each_other_in_one_direction() {
    for name in CRATES {
        let source = root().join(name).join("src");
        let read = modules::Crate::read(&source);
        if let Some(circle) = read.circles().first() {
            let pairs = circle.iter().flat_map(|from| circle.iter().map(move |to| (from, to)));
            let arrows = pairs.filter(|(from, to)| from != to).flat_map(|(from, to)| read.arrows(from, to));
            panic!(
                "{name}: {circle:?} use each other in a circle, by these names: {:#?}",
                arrows.collect::<Vec<_>>()
            );
        }
    }
}

/// A type name stands for one type of its crate. A choice of a method alone has the name of its scheme.
#[test]
fn a_type_name_stands_for_one_type() {
    for name in CRATES {
        for (word, files) in type_names::definitions(&root().join(name).join("src")) {
            let choices = files.iter().filter(|file| file.ends_with("integrate/choice.rs")).count();
            let types = files.len() - choices.min(1);
            assert!(types <= 1, "{name}: `{word}` stands for several types, in {files:#?}");
        }
    }
}
