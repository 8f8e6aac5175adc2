//! Time since the host was last heard, in control ticks.

/// Counts ticks since the host was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Silence {
    limit: u32,
    ticks: u32,
}

impl Silence {
    /// Lost after more than `limit` ticks of silence, and until the host is first heard.
    #[must_use]
    pub const fn new(limit: u32) -> Self {
        Self { limit, ticks: u32::MAX }
    }

    /// A request was carried out.
    pub fn heard(&mut self) {
        self.ticks = 0;
    }

    /// A tick has passed. Returns whether the link is lost: then the supervisor gets its `LINK_LOST`.
    pub fn tick(&mut self) -> bool {
        self.ticks = self.ticks.saturating_add(1);
        self.ticks > self.limit
    }
}
