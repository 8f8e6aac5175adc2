//! A command that waits for the rising edge of the input line.
//!
//! The line is sampled once a tick, with the gauges. After an edge in tick n, the waiting command takes effect from
//! tick n + 1 on. The edge is bit [`EDGE`] of the events of tick n: the supervisor ignores it, and every record stores
//! it.

use crate::choice::choice;

/// Bit of an event word that the supervisor does not use: the input line has risen in this tick.
pub const EDGE: u32 = 32;

choice! {
    /// Outcome of the last command that was to wait.
    pub enum Stage {
        /// There was no such command.
        None = 0 => "no command for the edge",
        /// It waits.
        Waiting = 1 => "waits for the edge",
        /// It took effect in the tick of the edge.
        Begun = 2 => "begun at the edge",
        /// At the edge, the machine was not running at rest, or something else was under way.
        Refused = 3 => "refused at the edge",
        /// Another command replaced it before the edge, or the machine left the running phase.
        Dropped = 4 => "dropped before the edge",
    }
}

/// A waiting command, and the input line.
#[derive(Debug, Clone, Copy)]
pub struct EdgeWait<T> {
    order: Option<T>,
    stage: Stage,
    /// Level of the line in the last tick. It is high at first: a line must be seen low before it can rise.
    high: bool,
    rose: bool,
    edges: u32,
    tick: u64,
}

impl<T> Default for EdgeWait<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> EdgeWait<T> {
    /// Nothing waits, and no edge was seen.
    #[must_use]
    pub const fn new() -> Self {
        Self { order: None, stage: Stage::None, high: true, rose: false, edges: 0, tick: 0 }
    }

    /// Makes this command wait, in place of another one.
    pub fn wait(&mut self, order: T) {
        (self.order, self.stage) = (Some(order), Stage::Waiting);
    }

    /// Removes the waiting command.
    pub fn cancel(&mut self) {
        if self.order.take().is_some() {
            self.stage = Stage::Dropped;
        }
    }

    /// Takes the level of the line in this tick and returns whether it rose. If the line cannot be read, it must be
    /// seen low again before it can rise.
    #[inline]
    pub fn sense<E>(&mut self, high: Result<bool, E>) -> bool {
        let high = high.ok();
        self.rose = high == Some(true) && !self.high;
        self.high = high != Some(false);
        self.edges = self.edges.wrapping_add(u32::from(self.rose));
        self.rose
    }

    /// The command whose edge came in this tick. The caller reports the outcome with [`Self::settle`].
    #[inline]
    pub fn due(&mut self) -> Option<T> {
        if self.rose { self.order.take() } else { None }
    }

    /// Records whether the command was begun at the edge of this tick, or refused.
    pub fn settle(&mut self, tick: u64, begun: bool) {
        (self.stage, self.tick) = (if begun { Stage::Begun } else { Stage::Refused }, tick);
    }

    /// Outcome of the last command.
    #[must_use]
    pub const fn stage(&self) -> Stage {
        self.stage
    }

    /// Rising edges since power-up.
    #[must_use]
    pub const fn edges(&self) -> u32 {
        self.edges
    }

    /// Tick of the edge at which the last order was begun or refused.
    #[must_use]
    pub const fn tick(&self) -> u64 {
        self.tick
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIGH: Result<bool, ()> = Ok(true);
    const LOW: Result<bool, ()> = Ok(false);

    #[test]
    fn an_order_is_due_once_in_the_tick_of_a_rising_edge() {
        let mut pending = EdgeWait::new();
        pending.wait('a');
        // High from the start: no edge.
        assert!(!pending.sense(HIGH) && pending.due().is_none());
        assert!(!pending.sense(LOW) && pending.due().is_none());
        assert!(pending.sense(HIGH));
        assert_eq!((pending.due(), pending.due()), (Some('a'), None));
        pending.settle(7, true);
        assert_eq!((pending.stage(), pending.tick(), pending.edges()), (Stage::Begun, 7, 1));
        // Still high.
        pending.wait('b');
        assert!(!pending.sense(HIGH) && pending.due().is_none());
        assert_eq!(pending.stage(), Stage::Waiting);
    }

    #[test]
    fn the_last_order_waits_and_one_that_is_dropped_does_not() {
        let mut pending = EdgeWait::new();
        pending.cancel();
        assert_eq!(pending.stage(), Stage::None);
        pending.wait('a');
        pending.wait('b');
        pending.sense(LOW);
        pending.sense(HIGH);
        assert_eq!(pending.due(), Some('b'));
        pending.settle(3, false);
        assert_eq!(pending.stage(), Stage::Refused);
        pending.wait('c');
        pending.cancel();
        pending.sense(LOW);
        assert!(pending.sense(HIGH) && pending.due().is_none());
        assert_eq!((pending.stage(), pending.edges()), (Stage::Dropped, 2));
    }

    #[test]
    fn a_line_that_was_not_read_does_not_rise_until_it_was_seen_low() {
        let mut pending = EdgeWait::<()>::new();
        let seen = [LOW, Err(()), HIGH, HIGH, LOW, HIGH].map(|line| pending.sense(line));
        assert_eq!(seen, [false, false, false, false, false, true]);
    }
}
