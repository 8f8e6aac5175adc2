//! An image: what goes where in flash, and what its controller says of itself.

/// A loaded part: where it is in flash, where it runs or is read, and its bytes.
pub struct Segment {
    pub address: u32,
    pub runs_at: u32,
    pub bytes: Vec<u8>,
}

/// The segments of a 32-bit little-endian ELF file, at the addresses from which they are loaded; none if it is something else.
pub fn segments(file: &[u8]) -> Option<Vec<Segment>> {
    let half = |at: usize| Some(u16::from_le_bytes(file.get(at..at + 2)?.try_into().ok()?) as usize);
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?));
    if file.get(..6)? != b"\x7fELF\x01\x01" {
        return None;
    }
    let (table, size, count) = (word(28)? as usize, half(42)?, half(44)?);
    let mut found = Vec::new();
    for header in (0..count).map(|k| table + k * size) {
        let (kind, offset, address, length) =
            (word(header)?, word(header + 4)?, word(header + 12)?, word(header + 16)?);
        let runs_at = word(header + 8)?;
        if kind == 1 && length > 0 {
            let bytes = file.get(offset as usize..(offset + length) as usize)?.to_vec();
            found.push(Segment { address, runs_at, bytes });
        }
    }
    Some(found)
}

/// What the controller says of itself under `key`: the first line `key=value` of its description.
pub fn described<'a>(file: &'a [u8], key: &str) -> Option<&'a str> {
    let key = format!("\n{key}=");
    let at = file.windows(key.len()).position(|window| window == key.as_bytes())? + key.len();
    let rest = file.get(at..)?;
    let end = rest.iter().position(|byte| *byte == b'\n')?;
    std::str::from_utf8(rest.get(..end)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_is_none() {
        assert!(segments(b"\x7fELF\x02\x01").is_none());
        assert!(segments(b"").is_none());
    }

    #[test]
    fn a_description_is_read_by_its_keys() {
        assert_eq!(described(b"x\nname=reference\nperiod=0.0001\n\0", "period"), Some("0.0001"));
        assert_eq!(described(b"x\nname=reference", "name"), None);
    }
}
