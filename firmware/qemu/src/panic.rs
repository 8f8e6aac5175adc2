//! The proof that the controller cannot panic.
//!
//! The handler calls a function that nobody defines. If the optimiser has removed every panic path, the
//! handler goes with them and the image links; if one remains, the link fails and names the function.
//!
//! To find where it is, `build.rs` turns the proof off if `SPECGEN_LOCATE_PANICS` is set: such an image links
//! and shows who calls the panic machinery. It is for reading only.

#![allow(unsafe_code)] // A call that cannot be linked cannot be run.

use core::panic::PanicInfo;

#[cfg(specgen_locate_panics)]
use crate::semihosting::{Exit, exit};

#[cfg(not(specgen_locate_panics))]
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: nobody defines it; what calls it does not link.
    unsafe extern "C" {
        fn specgen_panic_path_remains() -> !;
    }
    // SAFETY: never linked.
    unsafe { specgen_panic_path_remains() }
}

// Not inlined, and not without effect: otherwise the calls to it would vanish with it.
#[cfg(specgen_locate_panics)]
#[panic_handler]
#[inline(never)]
fn panic(info: &PanicInfo) -> ! {
    core::hint::black_box(info);
    exit(Exit::Fault)
}
