//! Learning between passes, in the background.

use controller::passes;

use crate::desk::standing;
use crate::exchange::Access;

/// Steps at a time, so that the record, samples and the sign of life are not late: each is some thousand products at most.
const STEPS: u32 = 2;

/// Learns a little, where there is something to learn: to be called by the background, again and again. The tick is held off only while the player
/// is taken and given back, and plays no pass meanwhile.
pub fn learn(with: &mut Access<'_>) {
    if !passes::POSSIBLE {
        return;
    }
    let mut player = None;
    with(&mut |exchange, _| {
        player = exchange.player.take_if(|player| player.is_busy() && !player.is_running());
        exchange.away = player.as_ref().map(standing);
    });
    let Some(mut learning) = player else { return };
    learning.work(STEPS);
    let mut player = Some(learning);
    with(&mut |exchange, _| {
        exchange.player = player.take();
        exchange.away = None;
    });
}
