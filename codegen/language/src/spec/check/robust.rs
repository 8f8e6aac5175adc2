//! Ranges of `[robust]`.

use super::in_order;
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;

const RANGES: [&str; 9] = [
    "robust.mass",
    "robust.stiffness",
    "robust.damping",
    "robust.gain",
    "robust.hysteresis",
    "robust.creep",
    "robust.lag",
    "robust.gauge_lag",
    "robust.noise",
];

/// Two equal numbers are a known factor, which then must differ from 1.
pub(super) fn ranges_in_order(f: &Fields, findings: &mut Findings) -> Option<()> {
    for path in RANGES {
        let _ = in_order(f, findings, path, true);
    }
    Some(())
}
