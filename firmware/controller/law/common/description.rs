//! What a controller says of itself.

use crate::identity::{ABOUT, MOTION};
use crate::{CONFIG_NAMES, INPUT_NAMES, OUTPUT_NAMES};

/// What this controller is, one `key=value` a line, lists separated by commas: for tools that load it at run time.
pub const DESCRIPTION: &str = match core::str::from_utf8(&TEXT) {
    Ok(text) => text,
    Err(_) => "",
};

/// Its bytes.
const TEXT: [u8; describe(&mut [])] = {
    let mut text = [0; describe(&mut [])];
    describe(&mut text);
    text
};

/// Writes the description as far as there is room; its length.
const fn describe(text: &mut [u8]) -> usize {
    let mut end = put(text, 0, ABOUT);
    end = put_list(text, end, "config_names=", &CONFIG_NAMES);
    end = put_list(text, end, "input_names=", &INPUT_NAMES);
    end = put_list(text, end, "output_names=", &OUTPUT_NAMES);
    put(text, end, MOTION)
}

/// A line with a list. Like [`put`] it goes on from `end` and returns the new one.
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
