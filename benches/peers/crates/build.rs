//! Compiles the right-hand side of Andrews' mechanism that `python/andrews_c.py` generated into
//! `PEERS_GENERATED`; where that is empty it is not measured.

use std::env;
use std::path::PathBuf;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-env-changed=PEERS_GENERATED");
    println!("cargo:rustc-check-cfg=cfg(andrews)");
    let generated = env::var("PEERS_GENERATED").unwrap_or_default();
    if generated.is_empty() {
        return;
    }
    println!("cargo:rustc-cfg=andrews");
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    let source = out.join("andrews.c");
    let text = "#include \"andrews.h\"\nvoid peers_andrews(const double *y, double *slope) \
         { andrews_ode(y, slope); }\n";
    std::fs::write(&source, text).expect("the folder can be written");
    let run = |program: &str, arguments: &[&str]| {
        let done = Command::new(program).args(arguments).status().expect("a C compiler");
        assert!(done.success(), "{program} {arguments:?}");
    };
    let (object, library) = (out.join("andrews.o"), out.join("libandrews.a"));
    let path = |path: &PathBuf| path.to_str().expect("a path in UTF-8").to_owned();
    let (source, object, library) = (path(&source), path(&object), path(&library));
    run("gcc", &["-O3", "-march=native", &format!("-I{generated}"), "-c", &source, "-o", &object]);
    run("ar", &["crs", &library, &object]);
    println!("cargo:rustc-link-search=native={}", out.display());
    println!("cargo:rustc-link-lib=static=andrews");
    println!("cargo:rustc-link-lib=m");
}
