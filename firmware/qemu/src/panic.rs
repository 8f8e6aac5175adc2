//! The proof that the controller cannot panic.
//!
//! The handler calls a function that nobody defines. If the optimiser has removed every panic path, the
//! handler goes with them and the image links; if one remains, the link fails and names the function.

#![allow(unsafe_code)] // A call that cannot be linked cannot be run.

use core::panic::PanicInfo;

unsafe extern "C" {
    fn specgen_panic_path_remains() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    unsafe { specgen_panic_path_remains() }
}
