//! What a controller says of itself: one `key=value` a line, lists separated by commas.
//!
//! All of it runs at compile time: inlined, so that none of it is in the object of this crate, where it could panic.

/// Writes the description as far as there is room; its length. `before` and `after` stand before and behind the lists.
#[inline]
pub const fn describe(text: &mut [u8], before: &str, lists: &[(&str, &[&str])], after: &str) -> usize {
    let mut end = put(text, 0, before);
    let mut k = 0;
    while k < lists.len() {
        let (key, names) = lists[k];
        end = put_list(text, end, key, names);
        k += 1;
    }
    put(text, end, after)
}

/// The text; empty if it is none.
#[inline]
#[must_use]
pub const fn text(bytes: &[u8]) -> &str {
    match core::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(_) => "",
    }
}

/// A line with a list. Like [`put`] it goes on from `end` and returns the new one.
#[inline]
const fn put_list(text: &mut [u8], end: usize, key: &str, names: &[&str]) -> usize {
    let mut end = put(text, end, key);
    let mut k = 0;
    while k < names.len() {
        end = put(text, end, names[k]);
        k += 1;
        end = put(text, end, if k < names.len() { "," } else { "\n" });
    }
    end
}

#[inline]
const fn put(text: &mut [u8], end: usize, part: &str) -> usize {
    let part = part.as_bytes();
    let mut k = 0;
    while k < part.len() {
        if end + k < text.len() {
            text[end + k] = part[k];
        }
        k += 1;
    }
    end + part.len()
}
