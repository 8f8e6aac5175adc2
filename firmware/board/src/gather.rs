//! Makes samples from the ticks' copies, in the background.

use crate::exchange::Access;
use crate::samples::{COPIES, Rows};

/// Background task, best called after each tick: makes rows from the ticks' copies. Each copy holds off the tick.
pub fn gather(with: &mut Access<'_>) {
    with_rows(with, |_| {});
}

/// Updates the rows and applies a function to them; does nothing if another call, which this one has interrupted, is
/// using them.
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
    // At most the length of the ring, so that it ends.
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
