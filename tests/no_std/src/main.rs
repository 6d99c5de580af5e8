//! Links the library without `std` and without an allocator, runs it on this machine, and says by its exit
//! code what failed.
#![no_std]
#![no_main]

use dynamics_no_std::{
    Failure, agreement, control, expand, hold, pendulum, swing, swing_evenly, swing_roughly,
};

// The C library starts the program; nothing else of the system is used.
#[link(name = "c")]
unsafe extern "C" {}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

// The shipped `core` is compiled for unwinding and names this function; panics abort here, so that nothing
// calls it.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

/// 0 if everything holds.
#[unsafe(no_mangle)]
pub extern "C" fn main() -> i32 {
    let model = pendulum();
    match swing(&model)
        .and_then(|()| swing_roughly(&model))
        .and_then(|()| swing_evenly(&model))
        .and_then(|()| control(&model))
        .and_then(|()| agreement(&model))
        .and_then(|()| hold())
        .and_then(|()| expand())
    {
        Ok(()) => 0,
        Err(Failure::Refused) => 1,
        Err(Failure::Step) => 2,
        Err(Failure::Energy(_)) => 3,
        Err(Failure::Difference(_)) => 4,
        Err(Failure::Singular) => 5,
    }
}
