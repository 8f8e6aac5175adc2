//! The proof that the controller cannot panic.
//!
//! The handler calls an undefined function. If the optimiser has removed every panic path, the handler is removed, too, and
//! the image links; if a panic path remains, the link fails with the name of the function.
//!
//! To locate a panic path, `build.rs` disables the proof if `SPECGEN_LOCATE_PANICS` is set. Such an image links and shows which
//! functions can panic. It is only for inspection.

#![allow(unsafe_code)] // A call that cannot be linked cannot be run.

use core::panic::PanicInfo;

#[cfg(specgen_locate_panics)]
use crate::semihosting::{Exit, exit};

#[cfg(not(specgen_locate_panics))]
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: it is not defined, so code that calls it does not link.
    unsafe extern "C" {
        fn specgen_panic_path_remains() -> !;
    }
    // SAFETY: never linked.
    unsafe { specgen_panic_path_remains() }
}

// Neither inlined nor without effect: otherwise the optimiser would remove the calls.
#[cfg(specgen_locate_panics)]
#[panic_handler]
#[inline(never)]
fn panic(info: &PanicInfo) -> ! {
    core::hint::black_box(info);
    exit(Exit::Fault)
}
