//! The target that `SPECGEN_FUZZ` names, under libFuzzer.
#![no_main]

mod targets;

use std::sync::OnceLock;

use targets::TARGETS;

static TARGET: OnceLock<fn(&[u8])> = OnceLock::new();

libfuzzer_sys::fuzz_target!(
    init: {
        let name = std::env::var("SPECGEN_FUZZ").unwrap_or_default();
        let found = TARGETS.into_iter().find(|(known, _)| *known == name);
        let (_, target) = found.unwrap_or_else(|| panic!("SPECGEN_FUZZ={name}: expected one of {:?}", TARGETS.map(|(known, _)| known)));
        let _ = TARGET.set(target);
    },
    |input: &[u8]| TARGET.get().unwrap()(input)
);
