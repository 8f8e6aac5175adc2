//! Learning between passes, in the background.

use controller::passes;

use crate::exchange::Access;
use crate::requests::pass_status;

/// Steps per call, at most a few thousand products each, so that record, samples and the sign of life are not late.
const STEPS: u32 = 2;

/// Does a few steps of learning, if there is something to learn. The background calls it repeatedly. The tick is held
/// off only while the player is taken and returned; it plays no pass meanwhile.
pub fn learn(with: &mut Access<'_>) {
    if !passes::POSSIBLE {
        return;
    }
    let mut player = None;
    with(&mut |exchange, _| {
        player = exchange.source.player.take_if(|player| player.is_busy() && !player.is_running());
        exchange.away = player.as_ref().map(pass_status);
    });
    let Some(mut learning) = player else { return };
    learning.work(STEPS);
    let mut player = Some(learning);
    with(&mut |exchange, _| {
        exchange.source.player = player.take();
        exchange.away = None;
    });
}
