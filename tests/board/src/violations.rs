//! What was done to a part that its data sheet does not allow.

use std::collections::BTreeMap;

use crate::time::{MICROSECOND, Time, microseconds};

/// Each kind once, with how often and when first.
#[derive(Debug, Default)]
pub struct Violations {
    seen: BTreeMap<String, (u64, Time)>,
}

impl Violations {
    pub fn note(&mut self, part: &str, what: &str, now: Time) {
        self.seen.entry(format!("{part}: {what}")).or_insert((0, now)).0 += 1;
    }

    /// Notes a time below its limit.
    pub fn shorter(&mut self, part: &str, what: &str, time: Time, limit: Time, now: Time) {
        if time < limit {
            let [time, limit] = [time, limit].map(|time| time * 1000 / MICROSECOND);
            self.note(part, &format!("{what}: {time} ns, at least {limit} ns"), now);
        }
    }

    #[cfg(test)]
    pub fn none(&self) -> bool {
        self.seen.is_empty()
    }

    /// Whether one with these words was seen.
    #[cfg(test)]
    pub fn has(&self, words: &str) -> bool {
        self.seen.keys().any(|text| text.contains(words))
    }

    /// A line each.
    pub fn lines(&self) -> impl Iterator<Item = String> {
        self.seen.iter().map(|(text, (count, first))| {
            format!("{text} ({count} times, first at {:.3} ms)", microseconds(*first) / 1e3)
        })
    }
}
