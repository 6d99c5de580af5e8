//! Links the library that `run.sh` makes of what the peers generated: its folder is in `PEERS_LIBRARY`.

fn main() {
    println!("cargo:rerun-if-env-changed=PEERS_LIBRARY");
    let folder = std::env::var("PEERS_LIBRARY").expect("run.sh sets it");
    println!("cargo:rustc-link-search=native={folder}");
    println!("cargo:rustc-link-lib=dylib=peers_evaluation");
    println!("cargo:rustc-link-arg=-Wl,-rpath,{folder}");
}
