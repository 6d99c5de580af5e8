//! `benches/evaluation.rs` with the peers among its candidates: in one process, at the same states, in turn,
//! with errors against the same 31 digits.

use std::ffi::{CStr, c_char, c_void};
use std::mem;

#[path = "../../../evaluation.rs"]
mod evaluation;

#[repr(C)]
struct Peer {
    model: *const c_char,
    name: *const c_char,
    run: *const c_void,
}

unsafe extern "C" {
    /// As many as `PEERS_COUNT`.
    static PEERS: [Peer; 0];
    static PEERS_COUNT: usize;
}

/// What run.sh linked.
struct Peers;

impl evaluation::Others for Peers {
    fn of_model<const N: usize>(model: &str) -> Vec<evaluation::Candidate<N>> {
        // Written by `evaluation_table.py`: texts end with 0, and there are as many entries as it says.
        let peers = unsafe { std::slice::from_raw_parts(PEERS.as_ptr(), PEERS_COUNT) };
        let text = |text: *const c_char| unsafe { CStr::from_ptr(text) }.to_str().expect("ASCII");
        let of_model = peers.iter().filter(|peer| text(peer.model) == model);
        let candidate = |peer: &'static Peer| evaluation::Candidate {
            name: text(peer.name),
            // It is `void function(const double *state, double *accelerations)`, reads 2N numbers and writes
            // N, the number of coordinates of the model.
            function: unsafe { mem::transmute::<*const c_void, evaluation::Function<N>>(peer.run) },
        };
        of_model.map(candidate).collect()
    }
}

fn main() {
    evaluation::tables::<Peers>();
}
