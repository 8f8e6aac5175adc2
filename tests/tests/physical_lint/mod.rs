//! The physical lint as a whole: slips are found at their key, plausible platforms are not refused, every rule has its
//! boundary, the paper as printed is refused, and rounding errors stay within their bound.

mod boundaries;
mod paper;
mod rounding;
mod slips;
pub mod support;

/// A key without the indices of list items: `gauge[2].point[1]` → `gauge[2].point`.
pub fn list(key: &str) -> &str {
    let table = key.rfind('.').unwrap_or(0);
    key[table..].find('[').map_or(key, |at| &key[..table + at])
}
