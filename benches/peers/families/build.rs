//! Compiles `rivals.c`: once as gcc has it, once with the licence to reorder sums and to drop infinities.

use std::path::PathBuf;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=rivals.c");
    let folder = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    for (library, options) in [("rivals", &[][..]), ("rivals_fast", &["-ffast-math", "-DFAST"][..])] {
        let done = Command::new("gcc")
            .args(["-O3", "-march=native", "-shared", "-fPIC", "rivals.c", "-lm", "-o"])
            .arg(folder.join(format!("lib{library}.so")))
            .args(options)
            .status()
            .expect("gcc starts");
        assert!(done.success(), "gcc could not compile rivals.c");
        println!("cargo:rustc-link-lib=dylib={library}");
    }
    println!("cargo:rustc-link-search=native={}", folder.display());
    println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
}
