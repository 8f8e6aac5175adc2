//! Times in fixed memory: every value with an error of at most 1/16, the extremes exact. Only the text allocates.

use core::fmt::Write as _;

/// Steps per doubling.
const STEPS: usize = 16;
/// Number of doublings: up to 2^40 ns, 18 minutes.
const OCTAVES: usize = 36;
const BINS: usize = STEPS * (OCTAVES + 1);
/// Characters of the longest bar.
const BAR: u64 = 50;

/// A histogram of times in nanoseconds.
#[derive(Debug, Clone)]
pub struct Histogram {
    bins: [u64; BINS],
    count: u64,
    largest: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

impl Histogram {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self { bins: [0; BINS], count: 0, largest: 0 }
    }

    /// Counts one time, ns.
    pub fn add(&mut self, nanoseconds: u64) {
        if let Some(bin) = self.bins.get_mut(bin_of(nanoseconds)) {
            *bin += 1;
        }
        self.count += 1;
        if nanoseconds > self.largest {
            self.largest = nanoseconds;
        }
    }

    /// Times counted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The longest, ns; none if empty.
    #[must_use]
    pub fn largest(&self) -> Option<u64> {
        (self.count > 0).then_some(self.largest)
    }

    /// A time that at least the fraction `share` (0 to 1) of all values does not exceed, ns: at most 1/16 too long,
    /// never too short; none if empty.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Option<u64> {
        let wanted = (share * self.count as f64).ceil() as u64;
        let mut seen = 0;
        let bin = self.bins.iter().position(|count| {
            seen += count;
            seen >= wanted && seen > 0
        });
        bin.map(|bin| upper_end(bin).min(self.largest))
    }

    /// Counts by doubling: upper end (ns, exclusive) and count, from the first to the last that is not empty.
    #[must_use]
    pub fn octaves(&self) -> Vec<(u64, u64)> {
        let counts: Vec<u64> = self.bins.chunks(STEPS).map(|chunk| chunk.iter().sum()).collect();
        let first = counts.iter().position(|count| *count > 0).unwrap_or(0);
        let last = counts.iter().rposition(|count| *count > 0).map_or(0, |last| last + 1);
        (first..last).map(|octave| (upper_end((octave + 1) * STEPS - 1) + 1, counts[octave])).collect()
    }

    /// A line per doubling with its count and a bar of logarithmic length, so that a single value is visible.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        let octaves = self.octaves();
        let longest = octaves.iter().map(|(_, count)| bits(*count)).max().unwrap_or(1);
        for (end, count) in octaves {
            let bar = "#".repeat((bits(count) * BAR / longest) as usize);
            // Writing to a String cannot fail.
            let _ = writeln!(text, "  < {:>9}  {count:>9}  {bar}", time_text(end));
        }
        text
    }
}

/// A time with a suitable unit: `850 ns`, `12.4 µs`, `3.05 ms`, `2.1 s`.
#[must_use]
pub fn time_text(nanoseconds: u64) -> String {
    let ns = nanoseconds as f64;
    let (value, unit) = match nanoseconds {
        0..1_000 => return format!("{nanoseconds} ns"),
        1_000..1_000_000 => (ns / 1e3, "µs"),
        1_000_000..1_000_000_000 => (ns / 1e6, "ms"),
        _ => (ns / 1e9, "s"),
    };
    match value {
        ..10.0 => format!("{value:.2} {unit}"),
        10.0..100.0 => format!("{value:.1} {unit}"),
        _ => format!("{value:.0} {unit}"),
    }
}

/// The same; `-` if nothing was timed.
#[must_use]
pub fn known_text(nanoseconds: Option<u64>) -> String {
    nanoseconds.map_or_else(|| "-".to_owned(), time_text)
}

/// Number of binary digits: the length of a bar.
fn bits(count: u64) -> u64 {
    u64::from(u64::BITS - count.leading_zeros())
}

fn bin_of(value: u64) -> usize {
    if value < STEPS as u64 {
        return value as usize;
    }
    let octave = (63 - value.leading_zeros()) as usize - 3; // 1 for 16 to 31
    let step = (value >> (octave - 1)) as usize & (STEPS - 1);
    (octave * STEPS + step).min(BINS - 1)
}

/// The largest value of a bin.
fn upper_end(bin: usize) -> u64 {
    let (octave, step) = (bin / STEPS, (bin % STEPS) as u64);
    if octave == 0 { step } else { ((STEPS as u64 + step + 1) << (octave - 1)) - 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_cover_all_times_without_gap_and_to_a_sixteenth() {
        for bin in 1..BINS - 1 {
            let (low, high) = (upper_end(bin - 1) + 1, upper_end(bin));
            assert_eq!((bin_of(low), bin_of(high)), (bin, bin));
            assert!(high - low <= low / 16, "{low} to {high}");
        }
        assert_eq!(bin_of(u64::MAX), BINS - 1);
    }

    #[test]
    fn quantiles_are_those_of_the_sorted_times() {
        let mut histogram = Histogram::new();
        let mut times: Vec<u64> = (0..5000_u64).map(|k| (k * k * 7919) % 1_000_003 + 40).collect();
        times.iter().for_each(|time| histogram.add(*time));
        times.sort_unstable();
        for share in [0.0, 0.25, 0.5, 0.99, 0.999, 1.0] {
            let exact = times[((share * 5000.0) as usize).clamp(1, 5000) - 1];
            let found = histogram.quantile(share).unwrap();
            assert!(found >= exact && found - exact <= exact / 16, "{share}: {found} for {exact}");
        }
        assert_eq!((histogram.count(), histogram.largest()), (5000, Some(times[4999])));
        assert_eq!(histogram.octaves().iter().map(|(_, count)| count).sum::<u64>(), 5000);
    }

    #[test]
    fn an_empty_one_and_a_single_time_are_shown() {
        let mut histogram = Histogram::new();
        assert_eq!((histogram.quantile(0.5), histogram.largest(), histogram.to_text()), (None, None, String::new()));
        assert_eq!([None, Some(850)].map(known_text), ["-", "850 ns"]);
        histogram.add(1_500);
        assert_eq!(histogram.to_text(), format!("  <   2.05 µs          1  {}\n", "#".repeat(50)));
        let times = [999, 1_000, 12_340, 999_999, 3_050_000, 2_100_000_000];
        assert_eq!(times.map(time_text), ["999 ns", "1.00 µs", "12.3 µs", "1000 µs", "3.05 ms", "2.10 s"]);
    }
}
