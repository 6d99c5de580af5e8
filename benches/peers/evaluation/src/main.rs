//! `benches/evaluation.rs` with the peers among its candidates: in one process, at the same states, in turn,
//! with errors against the same 31 digits.

use std::ffi::{CStr, c_char};

#[path = "../../../evaluation.rs"]
mod evaluation;

/// q, u and q̈.
type Function = unsafe extern "C" fn(*const f64, *const f64, *mut f64);

#[repr(C)]
struct Peer {
    model: *const c_char,
    name: *const c_char,
    run: Function,
}

unsafe extern "C" {
    /// As many as `PEERS_COUNT`.
    static PEERS: [Peer; 0];
    static PEERS_COUNT: usize;
}

/// The peers of a model.
fn peers(model: &str) -> Vec<evaluation::Other> {
    // Written by `evaluation_table.py`: texts end with 0, and there are as many entries as it says.
    let peers = unsafe { std::slice::from_raw_parts(PEERS.as_ptr(), PEERS_COUNT) };
    let text = |text: *const c_char| unsafe { CStr::from_ptr(text) }.to_str().expect("ASCII");
    let of_model = peers.iter().filter(|peer| text(peer.model) == model);
    let other = |peer: &'static Peer| evaluation::Other {
        name: text(peer.name),
        // They read and write as many numbers as the model has coordinates, which are the lengths of the
        // slices.
        run: Box::new(|q, u, a| unsafe { (peer.run)(q.as_ptr(), u.as_ptr(), a.as_mut_ptr()) }),
    };
    of_model.map(other).collect()
}

fn main() {
    assert!(evaluation::OTHERS.set(peers).is_ok(), "set once");
    evaluation::main();
}
