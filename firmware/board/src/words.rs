//! Where the readings stand among the input words, and what the converters must be able to do: from the controller's own
//! constants, when it is compiled.

use controller::sensing::CONVERTER;
use controller::{INPUT_NAMES, INPUT_WORDS, PERIOD_SECONDS};

/// Gauges.
pub(crate) const GAUGES: usize = 6;

/// Words of a command: they stand before those that are measured.
pub const COMMAND_WORDS: usize = {
    let mut index = 0;
    while index < INPUT_WORDS && !is_gauge(INPUT_NAMES[index]) {
        index += 1;
    }
    assert!(index + GAUGES <= INPUT_WORDS, "the controller's inputs name no six gauges");
    assert!(is_gauge(INPUT_NAMES[index + GAUGES - 1]), "the controller's gauges do not stand together");
    index
};

/// Bits of a gauge's code, from `sensor.bits`.
pub const GAUGE_BITS: u32 = u32::BITS - CONVERTER.highest.leading_zeros();

/// Control period, ns; from `timing.period`.
pub const PERIOD_NANOSECONDS: u32 = (PERIOD_SECONDS * 1e9 + 0.5) as u32;

/// `gauge[0]` and its like of a platform, `displacement[0]` of legs that have their own.
const fn is_gauge(name: &str) -> bool {
    starts(name, "gauge") || starts(name, "displacement")
}

const fn starts(name: &str, prefix: &str) -> bool {
    let (name, prefix) = (name.as_bytes(), prefix.as_bytes());
    let mut index = 0;
    while index < prefix.len() {
        if index >= name.len() || name[index] != prefix[index] {
            return false;
        }
        index += 1;
    }
    true
}
