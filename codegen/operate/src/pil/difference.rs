//! The first word in which host and device differ, without tolerance.

use std::fmt;

use host_sim::word::{Scalar, WordKind};
use serde::Serialize;

/// The first difference of host and device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Tick since power-up, counted from 0, including those of arming.
    pub tick: u64,
    /// Name of the output word; `machine_digest` if only the internal state differs.
    pub signal: String,
    /// Bits on the host.
    pub host: u64,
    /// Bits on the device.
    pub device: u64,
    /// Distance in representable numbers, for reals that are not NaN.
    pub ulps: Option<u64>,
}

impl Difference {
    /// Compares two rows of output words and the digests after them.
    pub(super) fn first(
        tick: u64,
        names: &[String],
        scalar: Scalar,
        host: (&[u64], u64),
        device: (&[u64], u64),
    ) -> Option<Self> {
        let digest = || std::iter::once(("machine_digest", host.1, device.1));
        let words = names.iter().zip(host.0).zip(device.0).map(|((name, a), b)| (name.as_str(), *a, *b));
        let (signal, host, device) = words.chain(digest()).find(|(_, host, device)| host != device)?;
        let real = WordKind::of(signal) == WordKind::Real && !INTEGERS.contains(&signal);
        let ulps = if real { scalar.ulps(host, device) } else { None };
        Some(Self { tick, signal: signal.to_owned(), host, device, ulps })
    }
}

/// Words of the supervised tick that are integers.
const INTEGERS: [&str; 3] = ["supervisor", "conditions", "machine_digest"];

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, signal, host, device, ulps } = self;
        write!(f, "tick {tick} {signal}: host {host:016x}, device {device:016x}")?;
        match ulps {
            Some(1) => f.write_str(" (1 ulp)"),
            Some(ulps) => write!(f, " ({ulps} ulps)"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(host: (&[u64], u64), device: (&[u64], u64)) -> Option<String> {
        let names = ["voltage[0]", "dac_code[0]", "supervisor"].map(str::to_owned);
        Difference::first(7, &names, Scalar::F64, host, device).map(|difference| difference.to_string())
    }

    #[test]
    fn the_first_word_is_named_with_its_bits_and_the_digest_comes_last() {
        let one = 1.0_f64.to_bits();
        assert_eq!(first((&[one, 2, 3], 4), (&[one, 2, 3], 4)), None);
        let found = first((&[one, 2, 3], 4), (&[one + 1, 0, 0], 0)).unwrap();
        assert_eq!(found, "tick 7 voltage[0]: host 3ff0000000000000, device 3ff0000000000001 (1 ulp)");
        let found = first((&[one, 2, 3], 4), (&[one, 2, 5], 4)).unwrap();
        assert_eq!(found, "tick 7 supervisor: host 0000000000000003, device 0000000000000005");
        assert!(first((&[one, 2, 3], 4), (&[one, 2, 3], 5)).unwrap().starts_with("tick 7 machine_digest: "));
    }
}
