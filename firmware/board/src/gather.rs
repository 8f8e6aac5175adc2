//! Samples made of what the ticks left, in the background.

use crate::exchange::Access;
use crate::samples::{COPIES, Rows};

/// Work of the background, best after each tick: makes rows of what the ticks left. The tick is held off for each copy that is taken.
pub fn gather(with: &mut Access<'_>) {
    with_rows(with, |_| {});
}

/// Brings the rows up to date and does something with them; nothing if another one is at it, whom this one has interrupted.
pub(crate) fn with_rows(with: &mut Access<'_>, action: impl FnOnce(&mut Rows)) {
    let mut taken = None;
    with(&mut |exchange, _| {
        if let Some(samples) = &mut exchange.samples {
            if samples.every > 0 || samples.anew {
                taken = samples.rows.take();
            }
        }
    });
    let Some(rows) = taken else { return };
    // No more than a ring of them, so that it ends.
    for _ in 0..COPIES {
        let (mut copied, mut anew) = (None, None);
        with(&mut |exchange, _| {
            if let Some(samples) = &mut exchange.samples {
                anew = samples.anew.then_some(samples.every);
                samples.anew = false;
                copied = samples.pop();
            }
        });
        if let Some(every) = anew {
            rows.start(every);
        }
        let Some(copied) = copied else { break };
        rows.add(&copied.sample());
    }
    action(rows);
    let mut rows = Some(rows);
    with(&mut |exchange, _| {
        if let Some(samples) = &mut exchange.samples {
            samples.rows = rows.take();
        }
    });
}
