//! Numbers of sessions.

/// Another one in every run, so that frames of the last one are not taken for those of this.
#[must_use]
pub fn session_number() -> u16 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    (now.subsec_nanos() >> 8 ^ std::process::id()) as u16
}
