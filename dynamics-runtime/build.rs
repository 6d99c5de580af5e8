//! Tells the crate whether it is compiled without optimisation, which `debug_assertions` do not: they stay on
//! in a `dev` profile with `opt-level = 3`.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(unoptimized)");
    if std::env::var("OPT_LEVEL").is_ok_and(|level| level == "0") {
        println!("cargo::rustc-cfg=unoptimized");
    }
}
