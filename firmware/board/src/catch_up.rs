//! What the recorder owes is written by the background, while ticks go on.

use crate::exchange::{Access, Exchange};
use crate::recording::{PIECE, PREAMBLE};

/// Work of the background, best after each tick: keeps the machine where the recorder wants one, and writes down what is owed then.
/// The tick is held off for each piece that is written, and for the copy: one that begins late finds the conversion over, which is a
/// fault. So nothing is copied unless `calm` says that no tick is due meanwhile. Blocks are whole, and can be fetched, after it.
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
    // Nothing owed; or another one is at it, whom this one has interrupted.
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
