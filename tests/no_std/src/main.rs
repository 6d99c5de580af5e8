//! Links the library without `std` and without an allocator, runs it on this machine, and says by its exit code what failed.
#![no_std]
#![no_main]

use dynamics_no_std::{Failure, Pendulum, relations, swing};

// The C library starts the program; nothing else of the system is used.
#[link(name = "c")]
unsafe extern "C" {}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

// The shipped `core` is compiled for unwinding and names this function; panics abort here, so that nothing calls it.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

/// 0 if everything holds.
#[unsafe(no_mangle)]
pub extern "C" fn main() -> i32 {
    let pendulum = Pendulum { m: 2.0, l: 0.5, g: 9.81 };
    match swing(&pendulum).and_then(|()| relations()) {
        Ok(()) => 0,
        Err(Failure::Step) => 1,
        Err(Failure::Drift(_)) => 2,
        Err(Failure::Amplitude(_)) => 3,
        Err(Failure::Relation(_)) => 4,
    }
}
