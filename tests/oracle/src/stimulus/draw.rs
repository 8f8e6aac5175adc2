//! Random numbers of a recording, with occasional words that no sensor gives.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use host_sim::noise::unit;
use host_sim::word::Scalar;

/// In a stretch of special numbers, one word in this many is special.
const SPECIAL_SHARE: u64 = 16;

/// Shortest and longest stretch, rows.
const STRETCH: (u64, u64) = (20, 200);

/// A stream of random numbers.
pub(super) struct RandomSource(ChaCha8Rng);

impl RandomSource {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// One of 0 to `bound` − 1; 0 for a bound of 0.
    pub(super) fn below(&mut self, bound: u64) -> u64 {
        self.0.next_u64() % bound.max(1)
    }

    /// Rows of a stretch.
    pub(super) fn stretch(&mut self) -> u64 {
        STRETCH.0 + self.below(STRETCH.1 - STRETCH.0)
    }

    /// Uniform in [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        unit(&mut self.0)
    }

    /// Uniform in [−1, 1).
    pub(super) fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Word of `value`, or occasionally of a special number, if those are enabled.
    pub(super) fn word(&mut self, scalar: Scalar, special: bool, value: f64) -> u64 {
        if special && self.below(SPECIAL_SHARE) == 0 {
            let specials = specials(scalar);
            let pick = self.below(specials.len() as u64) as usize;
            return specials[pick];
        }
        scalar.encode(value)
    }

    /// `value`, or occasionally any bits, if those are enabled.
    pub(super) fn integer(&mut self, special: bool, value: u64) -> u64 {
        if special && self.below(SPECIAL_SHARE) == 0 { self.0.next_u64() } else { value }
    }
}

/// Bit patterns that no sensor gives.
pub(super) fn specials(scalar: Scalar) -> [u64; 20] {
    // Fraction bits and exponent of all ones, shifted into place.
    let (fraction, sign) = match scalar {
        Scalar::F32 => (23, 1_u64 << 31),
        Scalar::F64 => (52, 1_u64 << 63),
    };
    let infinity = (sign >> fraction).wrapping_sub(1) << fraction;
    let quiet = 1_u64 << (fraction - 1);
    let one_fraction = (1_u64 << fraction) - 1;
    [
        0,                              // +0
        sign,                           // −0
        1,                              // smallest subnormal
        sign | 1,                       // its negative
        one_fraction,                   // largest subnormal
        sign | one_fraction,            // its negative
        quiet,                          // a subnormal in between
        1 << fraction,                  // smallest normal
        sign | 1 << fraction,           // its negative
        infinity,                       // +∞
        sign | infinity,                // −∞
        infinity - 1,                   // largest finite
        sign | (infinity - 1),          // its negative
        infinity - (1 << fraction),     // 2^1023, or 2^127
        infinity | quiet,               // default NaN of ARM
        sign | infinity | quiet,        // default NaN of x86
        infinity | quiet | 0x2a,        // quiet with a payload
        infinity | 1,                   // signalling
        sign | infinity | (quiet - 1),  // signalling, all payload bits
        sign | infinity | one_fraction, // all ones
    ]
}
