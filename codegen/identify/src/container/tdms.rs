//! TDMS files (NI, TDMS File Format Internal Structure): segments, each with the changes of its objects, and their
//! values.

use std::collections::BTreeMap;

use super::bytes::{Bytes, DAMAGED, MOST_ARRAYS, Refusal, Space};
use super::{Array, Contents};

/// What a segment has.
const OBJECTS: u32 = 1 << 1;
const OBJECTS_ALL_NEW: u32 = 1 << 2;
const VALUES: u32 = 1 << 3;
/// Values are interleaved: one value of each object in turn.
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
/// A type of variable length.
const TEXT: u32 = 0x20;

/// A channel, a group, or the file.
struct Object {
    path: String,
    kind: u32,
    /// Bytes of all its values in a chunk.
    size: usize,
    values: Vec<f64>,
    /// Its key in [`Objects::listed`].
    listed: Option<u64>,
}

/// The objects of a file.
#[derive(Default)]
struct Objects {
    all: Vec<Object>,
    /// Indices by path.
    places: BTreeMap<String, usize>,
    /// Indices of the objects with values, in their order.
    listed: BTreeMap<u64, usize>,
    /// Next key in `listed`.
    next: u64,
}

impl Objects {
    /// Index of the object with this path, a new one if there is none.
    fn place(&mut self, path: String) -> usize {
        let place = *self.places.entry(path.clone()).or_insert(self.all.len());
        if place == self.all.len() {
            self.all.push(Object { path, kind: TEXT, size: 0, values: Vec::new(), listed: None });
        }
        place
    }

    fn list(&mut self, place: usize) {
        if self.all[place].listed.is_none() {
            self.listed.insert(self.next, place);
            self.all[place].listed = Some(self.next);
            self.next += 1;
        }
    }

    fn unlist(&mut self, place: usize) {
        if let Some(key) = self.all[place].listed.take() {
            self.listed.remove(&key);
        }
    }

    fn unlist_all(&mut self) {
        for place in std::mem::take(&mut self.listed).into_values() {
            self.all[place].listed = None;
        }
    }

    /// Those with bytes in each chunk, with the bytes of all of them and of a value of each.
    fn in_chunk(&self) -> Result<Chunk, String> {
        let mut chunk = Chunk::default();
        for place in self.listed.values() {
            let Object { size, kind, .. } = self.all[*place];
            if size > 0 {
                chunk.places.push(*place);
                chunk.size = chunk.size.checked_add(size).ok_or(DAMAGED)?;
                chunk.row += width(kind)?;
            }
        }
        Ok(chunk)
    }
}

/// Layout of a chunk.
#[derive(Default)]
struct Chunk {
    places: Vec<usize>,
    size: usize,
    row: usize,
}

/// Flags, of a byte each, and times.
const FLAG: u32 = 0x21;
const TIME: u32 = 0x44;

/// Bytes of a value.
fn width(kind: u32) -> Result<usize, String> {
    match kind {
        TEXT => Ok(0),
        FLAG => Ok(1),
        TIME => Ok(16),
        _ => form(kind).map(|(_, bytes)| bytes).ok_or_else(|| format!("it has values of type {kind:#x}")),
    }
}

/// Format for [`Bytes::numbers`]; none for texts, flags and times.
fn form(kind: u32) -> Option<(char, usize)> {
    Some(match kind {
        1..=4 => ('i', 1 << (kind - 1)),
        5..=8 => ('u', 1 << (kind - 5)),
        9 | 0x19 => ('f', 4),
        10 | 0x1a => ('f', 8),
        _ => return None,
    })
}

fn text(from: &mut Bytes) -> Result<String, String> {
    let length = from.word()? as usize;
    Ok(String::from_utf8_lossy(from.take(length)?).into_owned())
}

/// Reads the changes of `objects`.
fn read_objects(mut from: Bytes, objects: &mut Objects) -> Result<(), String> {
    for _ in 0..from.word()? {
        let place = objects.place(text(&mut from)?);
        if place > MOST_ARRAYS {
            return Err(format!("it has more than {MOST_ARRAYS} channels and groups"));
        }
        match from.word()? {
            u32::MAX => objects.unlist(place),
            given => {
                let object = &mut objects.all[place];
                // Zero: as it was.
                if given > 0 {
                    let kind = from.word()?;
                    object.kind = kind;
                    let (_, count) = (from.word()?, from.count()?);
                    let size = if kind == TEXT { Some(from.count()?) } else { count.checked_mul(width(kind)?) };
                    object.size = size.ok_or(DAMAGED)?;
                }
                objects.list(place);
            }
        }
        // Properties: a name, a type, a value.
        for _ in 0..from.word()? {
            let name = text(&mut from)?;
            match from.word()? {
                TEXT => {
                    let value = text(&mut from)?;
                    if name == "NI_Scaling_Status" && value == "unscaled" {
                        return Err("its channels are raw numbers of the acquisition: save them scaled".to_owned());
                    }
                }
                kind => {
                    from.take(width(kind)?)?;
                }
            }
        }
    }
    Ok(())
}

/// The channels of a file.
pub(super) fn contents(file: &[u8], limit: u64) -> Result<Contents, Refusal> {
    let (mut objects, mut space) = (Objects::default(), Space::new(limit));
    let mut chunk = Chunk::default();
    let mut file = Bytes { rest: file, is_big_endian: false };
    let mut is_interrupted = false;
    while !file.rest.is_empty() {
        if file.take(4)? != b"TDSm" {
            return Err(DAMAGED.into());
        }
        file.is_big_endian = false;
        let has = file.word()?;
        file.is_big_endian = has & BIG_ENDIAN > 0;
        let (_version, length, before_values) = (file.word()?, file.count()?, file.count()?);
        // An interrupted writer leaves all bits set.
        is_interrupted |= length == usize::MAX;
        let segment = file.take(if length == usize::MAX { file.rest.len() } else { length })?;
        let (rest, values) = segment.split_at_checked(before_values).ok_or(DAMAGED)?;
        if has & OBJECTS_ALL_NEW > 0 {
            objects.unlist_all();
            chunk = Chunk::default();
        }
        if has & OBJECTS > 0 {
            read_objects(Bytes { rest, ..file }, &mut objects)?;
            chunk = objects.in_chunk()?;
        }
        if has & VALUES == 0 || chunk.size == 0 {
            continue;
        }
        let is_interleaved = has & INTERLEAVED > 0;
        for values in values.chunks_exact(chunk.size) {
            let mut at = 0;
            for place in &chunk.places {
                let object = &mut objects.all[*place];
                let own = if is_interleaved { width(object.kind)? } else { object.size };
                let step = if is_interleaved { chunk.row } else { chunk.size };
                let rows = values.chunks_exact(step.max(1));
                let from = at;
                at += own;
                let Some(form) = form(object.kind) else { continue };
                if !space.has(rows.len() * (own / form.1)) {
                    continue;
                }
                let bytes: Vec<u8> = rows.flat_map(|row| row.get(from..from + own)).flatten().copied().collect();
                object.values.extend(Bytes { rest: &bytes, ..file }.numbers(form));
            }
        }
    }
    space.check()?;
    let mut contents = Contents::default();
    if is_interrupted {
        contents.others.push(("end of the file".to_owned(), "its writer was interrupted there".to_owned()));
    }
    for Object { path, kind, values, .. } in objects.all {
        // The path of a channel is `/'group'/'channel'`, with quotes in names doubled.
        let Some((group, name)) = path.rsplit_once("'/'") else { continue };
        let plain = |name: &str| name.trim_start_matches("/'").trim_end_matches('\'').replace("''", "'");
        let (group, name) = (plain(group), plain(name));
        match form(kind) {
            Some(_) => contents.arrays.push(Array { group, name, size: vec![values.len()], values }),
            None => contents.others.push((name, "no array of numbers".to_owned())),
        }
    }
    Ok(contents)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A segment with channels `a` (doubles) and `b` (words), two values of each in a chunk.
    fn segment(has: u32, values: &[u8]) -> Vec<u8> {
        let is_big_endian = has & BIG_ENDIAN > 0;
        let word = |value: u32| if is_big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        let long = |value: u64| if is_big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        let text = |text: &str| [&word(text.len() as u32)[..], text.as_bytes()].concat();
        let mut objects = Vec::new();
        if has & OBJECTS > 0 {
            objects.extend(word(3));
            objects.extend([text("/'scan'"), word(u32::MAX).to_vec(), word(1).to_vec()].concat());
            objects.extend([text("operator"), word(TEXT).to_vec(), text("nobody")].concat());
            for (path, kind) in [("/'scan'/'a'", 10), ("/'scan'/'it''s b'", 7)] {
                objects.extend([text(path), word(20).to_vec(), word(kind).to_vec(), word(1).to_vec()].concat());
                objects.extend([long(2).to_vec(), word(0).to_vec()].concat());
            }
        }
        let lengths = [long((objects.len() + values.len()) as u64), long(objects.len() as u64)].concat();
        let version = word(4713);
        [b"TDSm", &has.to_le_bytes()[..], &version, &lengths, &objects, values].concat()
    }

    #[test]
    fn channels_that_are_not_scaled_are_refused() {
        let word = |value: u32| value.to_le_bytes().to_vec();
        let text = |text: &str| [word(text.len() as u32), text.as_bytes().to_vec()].concat();
        let property = |status: &str| [text("NI_Scaling_Status"), word(TEXT), text(status)].concat();
        let read = |status: &str| {
            let object = [word(1), text("/'scan'/'a'"), word(u32::MAX), word(1), property(status)].concat();
            read_objects(Bytes { rest: &object, is_big_endian: false }, &mut Objects::default())
        };
        assert_eq!(read("scaled"), Ok(()));
        assert!(read("unscaled").unwrap_err().contains("save them scaled"));
    }

    #[test]
    fn chunks_and_interleaved_values_of_both_orders_of_bytes_are_put_together() {
        let (mut plain, mut mixed) = (Vec::new(), Vec::new());
        for chunk in [0_u32, 2] {
            let [a, b] = [chunk, chunk + 1];
            plain.extend([a, b].map(f64::from).map(f64::to_le_bytes).concat());
            plain.extend([a, b].map(u32::to_le_bytes).concat());
            mixed.extend([a, b].map(|k| [&f64::from(k).to_be_bytes()[..], &k.to_be_bytes()].concat()).concat());
        }
        let new = OBJECTS | OBJECTS_ALL_NEW | VALUES;
        let file = [
            segment(new, &plain),
            // As before, with a chunk that is cut off.
            segment(VALUES, &plain[..30]),
            segment(new | INTERLEAVED | BIG_ENDIAN, &mixed),
        ];
        let expected = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 1.0, 2.0, 3.0].to_vec();
        let wanted = ["a", "it's b"].map(|name| ("scan".to_owned(), name.to_owned(), expected.clone()));
        let found = contents(&file.concat(), u64::MAX).unwrap().arrays.into_iter();
        assert_eq!(found.map(|array| (array.group, array.name, array.values)).collect::<Vec<_>>(), wanted);
        let mut other = file.concat();
        other.pop();
        assert!(contents(&other, u64::MAX).is_err());
    }
}
