//! Compares the gauges with the codes sent. One gauge and one axis per tick, each once in six ticks: faults last longer
//! than that, and the check takes a sixth of the time.

use super::debounce::rise;
use super::kinds::Cause;
use super::supervision::Supervision;
use crate::real::Real;

/// Every channel once in six ticks, in an order in which none comes at regular intervals. So no oscillation of an error
/// up to a quarter of the tick rate aliases to a constant. Found by search over the worst frequency and phase.
const ORDER: [u8; 36] =
    [2, 4, 0, 1, 5, 3, 1, 3, 5, 2, 4, 0, 4, 1, 0, 5, 2, 3, 3, 1, 2, 5, 0, 4, 2, 1, 3, 4, 0, 5, 5, 3, 4, 1, 2, 0];

/// One gauge in one tick.
#[derive(Debug, Clone, Copy)]
pub struct Sample<T> {
    /// Its word.
    pub word: T,
    /// Reading of the gauge, m.
    pub reading: T,
    /// Expected reading, by the hysteresis model at the voltages sent and the known load, m.
    pub expected: T,
    /// Set-point less measured value of the axis or leg of the same number, m or rad; none while nothing is tracked.
    pub error: Option<T>,
}

crate::state! { |words|
    /// State of one gauge and one axis.
    pub struct Channel<T>[T: Real] {
        /// Last word of the gauge.
        pub word: T = T::ZERO, number(words.sizes().reading);
        /// Whether `word` is valid.
        pub known: bool = false, set;
        /// Smallest and largest expected reading since that word came, m: displacement less the known load, which a
        /// gain may have made large.
        pub expected: [T; 2] = [T::ZERO; 2], numbers(words.sizes().request);
        /// Samples since `expected` spans more than `Supervision::stuck_motion`.
        pub stuck: u32 = 0, tally;
        /// Count of samples in which reading and model disagreed, less samples in which they agreed.
        pub disagreed: u32 = 0, tally;
        /// Count of samples in which the axis was too far from its set-point, less samples in which it was not.
        pub astray: u32 = 0, tally;
    }
}

crate::state! { |words|
    /// All channels, and the position in `ORDER`.
    pub struct Watch<T>[T: Real] {
        /// Channels 0 to 5.
        pub channels: [Channel<T>; 6] = [Channel::new(); 6], parts;
        /// Next index into `ORDER`.
        pub turn: usize = 0, place(ORDER.len());
        /// Channels that are suspected to be stuck, to disagree, or to be off the set-point: three sets of bits.
        pub suspects: [u32; 3] = [0; 3], tallies;
        /// Their causes, before debouncing.
        pub present: u32 = 0, tally;
        /// Causes that have lasted, of the last sample.
        pub lasted: u32 = 0, tally;
    }
}

impl<T: Real> Watch<T> {
    /// Clears all counts and suspicions, but keeps `turn`.
    #[inline(never)]
    pub fn forgive(&mut self) {
        for channel in &mut self.channels {
            channel.known = false;
            channel.stuck = 0;
            channel.disagreed = 0;
            channel.astray = 0;
        }
        self.suspects = [0; 3];
        self.present = 0;
        self.lasted = 0;
    }

    /// The next channel, 0 to 5.
    #[inline]
    pub fn take_turn(&mut self) -> usize {
        let turn = if self.turn < ORDER.len() { self.turn } else { 0 };
        self.turn = turn + 1;
        ORDER[turn] as usize
    }

    /// Checks a channel (0 to 5). Every number of the sample is finite.
    #[inline]
    pub fn look(&mut self, supervision: &Supervision<T>, index: usize, sample: &Sample<T>) {
        let index = if index < 6 { index } else { 0 };
        let channel = &mut self.channels[index];
        let [low, high] = &mut channel.expected;
        let mut moved = false;
        if channel.known && sample.word == channel.word {
            if sample.expected < *low {
                *low = sample.expected;
            }
            if sample.expected > *high {
                *high = sample.expected;
            }
            moved = *high - *low > supervision.stuck_motion;
        } else {
            channel.word = sample.word;
            channel.known = true;
            channel.expected = [sample.expected; 2];
        }
        let disagrees = (sample.reading - sample.expected).abs() > supervision.disagreement;
        let astray = match sample.error {
            Some(error) => error.abs() > supervision.tracking[index],
            None => false,
        };
        let counted = channel.stuck | channel.disagreed | channel.astray;
        if moved | disagrees | astray || counted != 0 {
            self.count(supervision, index, [moved, disagrees, astray]);
        }
    }

    /// Updates the counts of a channel with a suspicion, now or before.
    #[cold]
    #[inline(never)]
    fn count(&mut self, supervision: &Supervision<T>, index: usize, [moved, disagrees, astray]: [bool; 3]) {
        let index = if index < 6 { index } else { 0 };
        let channel = &mut self.channels[index];
        let lasting = [
            // One changed word shows that the gauge works: the count is reset.
            count(&mut channel.stuck, moved, supervision.stuck_samples, u32::MAX),
            count(&mut channel.disagreed, disagrees, supervision.disagreement_samples, 1),
            count(&mut channel.astray, astray, supervision.tracking_samples, 1),
        ];
        let causes = [Cause::GaugeStuck, Cause::GaugeDisagreement, Cause::TrackingError];
        self.present = 0;
        for (place, seen) in [moved, disagrees, astray].into_iter().enumerate() {
            let bit = 1 << index;
            if seen {
                self.suspects[place] |= bit;
            } else {
                self.suspects[place] &= !bit;
            }
            if self.suspects[place] != 0 {
                self.present |= causes[place].bit();
            }
            if lasting[place] {
                self.lasted |= causes[place].bit();
            }
        }
    }

    /// Suspected channels, bit by bit.
    #[inline]
    #[must_use]
    pub fn suspected(&self) -> u32 {
        self.suspects[0] | self.suspects[1] | self.suspects[2]
    }
}

/// Increments for a sample that was `seen`, decrements by `off` for another. Returns whether the count has reached its
/// limit.
#[inline]
fn count(count: &mut u32, seen: bool, timeout: u32, off: u32) -> bool {
    if !seen {
        *count = count.saturating_sub(off);
        return false;
    }
    rise(count, 1, timeout);
    *count >= timeout
}
