//! The background writes the recorder's pending data while ticks go on.

use crate::exchange::{Access, Exchange};
use crate::recording::{PIECE, PREAMBLE};

/// Background task, best called after each tick: copies the machine if the recorder wants a copy, and then writes the
/// pending data. The copy and each written piece hold off the tick. A tick that begins late finds the conversion
/// already finished, which is a fault. So nothing is copied unless `calm` confirms that no tick is due meanwhile. After
/// this task, blocks are complete and can be fetched.
pub fn catch_up(with: &mut Access<'_>, calm: impl Fn() -> bool) {
    let (mut taken, mut block) = (None, false);
    with(&mut |exchange, machine| {
        let Exchange { recorder: Some(recorder), kept, config, .. } = exchange else { return };
        if let (Some(want), Some(kept)) = (recorder.wants(), &mut *kept) {
            if calm() {
                kept.keep(config, machine);
                recorder.owe(want);
            }
        }
        if recorder.owes() {
            block = recorder.owes_block();
            taken = kept.take();
        }
    });
    // Nothing is pending; or another call, which this one has interrupted, is writing it.
    let Some(kept) = taken else { return };
    let digest = kept.digest();
    let mut first = if block { 0 } else { PREAMBLE };
    while first < PREAMBLE {
        let mut words = [0; PIECE];
        let count = kept.words(first, &mut words);
        with(&mut |exchange, _| {
            if let (Some(recorder), Some(words)) = (&mut exchange.recorder, words.get(..count)) {
                recorder.hand_in(first, words);
            }
        });
        first += count;
    }
    let mut kept = Some(kept);
    with(&mut |exchange, _| {
        exchange.kept = kept.take();
        if let Some(recorder) = &mut exchange.recorder {
            recorder.settle(digest);
        }
    });
}
