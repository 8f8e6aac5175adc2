//! What ticks take, as a scope at the pins and a counter at the interrupt would show it.

use crate::time::{Time, microseconds};

/// Smallest, largest, sum and count of a time.
#[derive(Debug, Clone, Copy)]
pub struct Spread {
    smallest: Time,
    largest: Time,
    sum: Time,
    count: u64,
}

impl Default for Spread {
    fn default() -> Self {
        Self { smallest: Time::MAX, largest: 0, sum: 0, count: 0 }
    }
}

impl Spread {
    fn add(&mut self, time: Time) {
        self.smallest = self.smallest.min(time);
        self.largest = self.largest.max(time);
        self.sum += time;
        self.count += 1;
    }

    /// Smallest, mean, largest; µs, or the same of a plain number.
    fn text(&self, of: impl Fn(Time) -> f64) -> String {
        if self.count == 0 {
            return "none".to_owned();
        }
        let mean = of(self.sum) / self.count as f64;
        format!("{:.2}/{:.2}/{:.2}", of(self.smallest), mean, of(self.largest))
    }
}

/// Times of the ticks since the last report.
#[derive(Default)]
pub struct Meter {
    begun: Option<(Time, u64)>,
    pub ticks: Spread,
    /// Instructions of a tick.
    instructions: Spread,
    /// From CONVST to LDAC.
    pub latency: Spread,
    sampled: Option<Time>,
}

impl Meter {
    pub fn begin(&mut self, now: Time, instructions: u64) {
        self.begun = Some((now, instructions));
    }

    pub fn end(&mut self, now: Time, instructions: u64) {
        if let Some((begun, before)) = self.begun.take() {
            self.ticks.add(now - begun);
            self.instructions.add(instructions - before);
        }
    }

    pub fn sampled(&mut self, now: Time) {
        self.sampled = Some(now);
    }

    pub fn loaded(&mut self, now: Time) {
        if let Some(sampled) = self.sampled.take() {
            self.latency.add(now - sampled);
        }
    }

    /// Smallest/mean/largest of each.
    pub fn text(&self) -> String {
        let (ticks, tick_us) = (self.ticks.count, self.ticks.text(microseconds));
        let (instructions, latency) = (self.instructions.text(|count| count as f64), self.latency.text(microseconds));
        format!("ticks={ticks} tick_us={tick_us} instructions={instructions} convst_to_ldac_us={latency}")
    }
}
