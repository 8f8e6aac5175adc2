//! TDMS files (NI, TDMS File Format Internal Structure): segments, each with the changes of its objects, and their
//! values.

use std::collections::BTreeMap;

use super::bytes::{Bytes, DAMAGED, MOST_ARRAYS, Refusal, Space};
use super::{Array, Contents, is_time};
use crate::columns::decoded;
use crate::columns::names::with_unit;

/// What a segment has.
const OBJECTS: u32 = 1 << 1;
const OBJECTS_ALL_NEW: u32 = 1 << 2;
const VALUES: u32 = 1 << 3;
/// Values are interleaved: one value of each object in turn.
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
/// A type of variable length.
const TEXT: u32 = 0x20;
/// Longest path of a channel, bytes.
const LONGEST_PATH: usize = 1024;

/// A channel, a group, or the file.
struct Object<'a> {
    path: &'a [u8],
    /// Its property `unit_string`.
    unit: &'a [u8],
    /// Its property `wf_increment`: time between its values, s; 0 if it has none.
    interval: f64,
    kind: u32,
    /// Bytes of all its values in a chunk.
    size: usize,
    values: Vec<f64>,
    /// First second of times.
    start: Option<i64>,
    /// Its place among the objects with values, from [`Objects::first`] on.
    order: Option<u64>,
}

/// The objects of a file. A segment costs time for its changes and values, not for objects without either.
#[derive(Default)]
struct Objects<'a> {
    all: Vec<Object<'a>>,
    /// Indices by path.
    places: BTreeMap<&'a [u8], usize>,
    /// Indices of the objects with values, in their order.
    listed: BTreeMap<u64, usize>,
    /// Orders of the present list: the first, and the next one.
    first: u64,
    next: u64,
    /// Bytes of a chunk, and of a value of each object in it.
    chunk: usize,
    row: usize,
}

impl<'a> Objects<'a> {
    /// Index of the object with this path, a new one if there is none.
    fn place(&mut self, path: &'a [u8]) -> usize {
        let place = *self.places.entry(path).or_insert(self.all.len());
        if place == self.all.len() {
            self.all.push(Object {
                path,
                unit: b"",
                interval: 0.0,
                kind: TEXT,
                size: 0,
                values: Vec::new(),
                start: None,
                order: None,
            });
        }
        place
    }

    /// Takes an object from the list, or changes its layout there. An object keeps its place while every segment lists it.
    fn list(&mut self, place: usize, layout: Option<(u32, usize)>) -> Result<(), String> {
        let object = &mut self.all[place];
        let order = object.order.filter(|order| *order >= self.first);
        if order.is_some_and(|order| self.listed.remove(&order).is_some()) {
            self.chunk -= object.size;
            self.row -= width(object.kind)?;
        }
        object.order = None;
        let Some((kind, size)) = layout else { return Ok(()) };
        let order = order.unwrap_or(self.next);
        self.next += u64::from(order == self.next);
        (object.kind, object.size, object.order) = (kind, size, Some(order));
        if size > 0 {
            self.listed.insert(order, place);
            self.chunk = self.chunk.checked_add(size).ok_or(DAMAGED)?;
            self.row += width(kind)?;
        }
        Ok(())
    }

    fn unlist_all(&mut self) {
        self.listed.clear();
        (self.first, self.chunk, self.row) = (self.next, 0, 0);
    }
}

/// Numbers of 8 bytes; flags, of a byte each; and times.
const DOUBLE: u32 = 10;
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

/// Appends the values of a channel, `from`, to those before; times in s since the second of the first one, `start`.
fn append(kind: u32, from: Bytes, values: &mut Vec<f64>, start: &mut Option<i64>) {
    if let Some(form) = form(kind) {
        return from.append_numbers(form, values);
    }
    // Seconds, and their fraction in units of 2⁻⁶⁴ s, which is first where the low bytes are.
    for time in from.rest.as_chunks::<16>().0 {
        let number = if from.is_big_endian { i128::from_be_bytes(*time) } else { i128::from_le_bytes(*time) };
        let (seconds, fraction) = ((number >> 64) as i64, number as u64);
        let start = *start.get_or_insert(seconds);
        values.push(seconds.saturating_sub(start) as f64 + fraction as f64 / 18_446_744_073_709_551_616.0);
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

fn text<'a>(from: &mut Bytes<'a>) -> Result<&'a [u8], String> {
    let length = from.word()? as usize;
    from.take(length)
}

/// Reads the changes of `objects`.
fn read_objects<'a>(mut from: Bytes<'a>, objects: &mut Objects<'a>) -> Result<(), String> {
    for _ in 0..from.word()? {
        let path = text(&mut from)?;
        if path.len() > LONGEST_PATH {
            return Err(format!("it has a channel whose path is longer than {LONGEST_PATH} bytes"));
        }
        let place = objects.place(path);
        if place > MOST_ARRAYS {
            return Err(format!("it has more than {MOST_ARRAYS} channels and groups"));
        }
        let layout = match from.word()? {
            u32::MAX => None,
            // As it was.
            0 => Some((objects.all[place].kind, objects.all[place].size)),
            _ => {
                let kind = from.word()?;
                let (_, count) = (from.word()?, from.count()?);
                let size = if kind == TEXT { Some(from.count()?) } else { count.checked_mul(width(kind)?) };
                Some((kind, size.ok_or(DAMAGED)?))
            }
        };
        objects.list(place, layout)?;
        // Properties: a name, a type, a value.
        for _ in 0..from.word()? {
            let name = text(&mut from)?;
            match from.word()? {
                TEXT => {
                    let value = text(&mut from)?;
                    match name {
                        b"NI_Scaling_Status" if value == b"unscaled" => {
                            return Err("its channels are raw numbers of the acquisition: save them scaled".to_owned());
                        }
                        b"unit_string" => objects.all[place].unit = value,
                        _ => {}
                    }
                }
                kind => {
                    let value = Bytes { rest: from.take(width(kind)?)?, ..from };
                    if name == b"wf_increment" && kind == DOUBLE {
                        objects.all[place].interval = value.numbers(('f', 8)).first().copied().unwrap_or_default();
                    }
                }
            }
        }
    }
    Ok(())
}

impl Objects<'_> {
    /// Adds the values of a chunk, or of its first rows if it is interleaved.
    fn add(&mut self, chunk: Bytes, is_interleaved: bool, space: &mut Space) -> Result<(), String> {
        let mut at = 0;
        for place in self.listed.values() {
            let Object { kind, size, values, start, .. } = &mut self.all[*place];
            if is_interleaved && *kind == TEXT {
                return Err("it has texts among interleaved numbers: save it with each channel in one piece".to_owned());
            }
            let own = if is_interleaved { width(*kind)? } else { *size };
            let from = at;
            at += own;
            if matches!(*kind, TEXT | FLAG) {
                continue;
            }
            if !is_interleaved {
                if space.has(own / width(*kind)?) {
                    let rest = chunk.rest.get(from..at).ok_or(DAMAGED)?;
                    append(*kind, Bytes { rest, ..chunk }, values, start);
                }
                continue;
            }
            let rows = chunk.rest.chunks_exact(self.row);
            if space.has(rows.len()) {
                let bytes: Vec<u8> = rows.flat_map(|row| &row[from..from + own]).copied().collect();
                append(*kind, Bytes { rest: &bytes, ..chunk }, values, start);
            }
        }
        Ok(())
    }
}

/// The channels of a file.
pub(super) fn contents(file: &[u8], limit: u64) -> Result<Contents, Refusal> {
    let (mut objects, mut space) = (Objects::default(), Space::new(limit));
    let mut file = Bytes { rest: file, is_big_endian: false };
    let mut is_interrupted = false;
    // Bytes of chunks that are cut off.
    let mut cut = 0;
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
        }
        if has & OBJECTS > 0 {
            read_objects(Bytes { rest, ..file }, &mut objects)?;
        }
        if has & VALUES == 0 || objects.chunk == 0 {
            continue;
        }
        let is_interleaved = has & INTERLEAVED > 0 && objects.row > 0;
        let whole = if is_interleaved { objects.row } else { objects.chunk };
        let chunks = values.chunks_exact(whole);
        cut += chunks.remainder().len();
        if is_interleaved {
            let rest = &values[..values.len() - chunks.remainder().len()];
            if !rest.is_empty() {
                objects.add(Bytes { rest, ..file }, true, &mut space)?;
            }
            continue;
        }
        for rest in chunks {
            objects.add(Bytes { rest, ..file }, false, &mut space)?;
        }
    }
    space.check()?;
    let mut contents = Contents::default();
    if is_interrupted {
        contents.others.push(("end of the file".to_owned(), "its writer was interrupted there".to_owned()));
    }
    if cut > 0 {
        contents.others.push(("last values".to_owned(), format!("{cut} bytes without those of the other channels")));
    }
    let mut waves: Vec<(String, usize, f64)> = Vec::new();
    for Object { path, unit, interval, kind, values, .. } in objects.all {
        // The path of a channel is `/'group'/'channel'`, with quotes in names doubled.
        let path = decoded(path);
        let Some((group, name)) = path.rsplit_once("'/'") else { continue };
        let plain = |name: &str| name.trim_start_matches("/'").trim_end_matches('\'').replace("''", "'");
        let unit = if kind == TIME { "s".to_owned() } else { decoded(unit) };
        let (group, name) = (plain(group), with_unit(&plain(name), &unit));
        let form = form(kind).or_else(|| (kind == TIME).then_some(('f', 8)));
        let Some(form) = form else {
            contents.others.push((name, "no array of numbers".to_owned()));
            continue;
        };
        if interval > 0.0 || is_time(&name) {
            waves.push((group.clone(), values.len(), if is_time(&name) { 0.0 } else { interval }));
        }
        contents.add(Array { group, name, size: vec![values.len()], values }, form);
    }
    add_times(&waves, &mut space, &mut contents);
    space.check()?;
    Ok(contents)
}

/// Adds the times of waveforms, which have a group, a length and an interval each: for each length of which all have one
/// interval. That of a channel with times is 0.
fn add_times(waves: &[(String, usize, f64)], space: &mut Space, contents: &mut Contents) {
    for (k, (group, length, interval)) in waves.iter().enumerate() {
        let mut same = waves.iter().filter(|(_, other, _)| other == length);
        let is_first = waves[..k].iter().all(|(_, other, _)| other != length);
        if is_first && *interval > 0.0 && same.all(|(.., other)| other == interval) && space.has(*length) {
            let values = (0..*length).map(|row| row as f64 * interval).collect();
            let (group, name) = (group.clone(), "time_s".to_owned());
            contents.add(Array { group, name, size: vec![*length], values }, ('f', 8));
        }
    }
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
    fn times_are_those_of_a_channel_or_of_the_waveforms() {
        let (mut values, mut start) = (Vec::new(), None);
        let time = |seconds: i64, fraction: u64| [fraction.to_le_bytes(), seconds.to_le_bytes()].concat();
        let rest = [time(3_800_000_000, 1 << 63), time(3_800_000_002, 1 << 62)].concat();
        append(TIME, Bytes { rest: &rest, is_big_endian: false }, &mut values, &mut start);
        let reversed: Vec<u8> = rest[..16].iter().rev().copied().collect();
        append(TIME, Bytes { rest: &reversed, is_big_endian: true }, &mut values, &mut start);
        assert_eq!(values, [0.5, 2.25, 0.5]);
        let wave = |group: &str, length, interval| (group.to_owned(), length, interval);
        for (waves, expected) in [
            (vec![wave("a", 3, 0.5), wave("b", 3, 0.5), wave("b", 2, 0.25)], &[("a", 1.0), ("b", 0.25)][..]),
            (vec![wave("a", 3, 0.5), wave("b", 3, 0.25)], &[]),
            (vec![wave("a", 3, 0.5), wave("b", 3, 0.0)], &[]),
        ] {
            let mut contents = Contents::default();
            add_times(&waves, &mut Space::new(1000), &mut contents);
            let found =
                contents.arrays.iter().map(|array| (array.group.as_str(), array.values[array.values.len() - 1]));
            assert_eq!(found.collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn channels_that_are_not_scaled_are_refused() {
        let word = |value: u32| value.to_le_bytes().to_vec();
        let text = |text: &str| [word(text.len() as u32), text.as_bytes().to_vec()].concat();
        let read = |name: &str, value: &str| {
            let property = [text(name), word(TEXT), text(value)].concat();
            let object = [word(1), text("/'scan'/'a'"), word(u32::MAX), word(1), property].concat();
            let mut objects = Objects::default();
            read_objects(Bytes { rest: &object, is_big_endian: false }, &mut objects)?;
            Ok::<_, String>(decoded(objects.all[0].unit))
        };
        assert_eq!(read("NI_Scaling_Status", "scaled"), Ok(String::new()));
        assert_eq!(read("unit_string", "mV"), Ok("mV".to_owned()));
        assert!(read("NI_Scaling_Status", "unscaled").unwrap_err().contains("save them scaled"));
    }

    /// A minute, if each segment looked at all channels.
    #[test]
    fn segments_take_time_for_their_own_changes() {
        let word = |value: u32| value.to_le_bytes();
        let form = |has: u32, objects: &[u8], values: &[u8]| {
            let lengths = [(objects.len() + values.len()) as u64, objects.len() as u64].map(u64::to_le_bytes).concat();
            [b"TDSm", &word(has)[..], &word(4713), &lengths, objects, values].concat()
        };
        let segment =
            |objects: &[u8], values: &[u8]| form(OBJECTS | if values.is_empty() { 0 } else { VALUES }, objects, values);
        let channel = |name: u32, count: u64| {
            let path = format!("/'g'/'{name}'");
            let layout = [&word(20)[..], &word(1), &word(1), &count.to_le_bytes(), &word(0)].concat();
            [&word(path.len() as u32)[..], path.as_bytes(), &layout].concat()
        };
        // Listed, all but one without values.
        let channels: Vec<u8> = (0..9_000).flat_map(|name| channel(name, u64::from(name == 0))).collect();
        let many = segment(&[&word(9_000)[..], &channels].concat(), &[7]);
        let again = [segment(&word(0), &[]), segment(&word(0), &[8])].concat();
        let begun = std::time::Instant::now();
        let found = contents(&[many, again.repeat(400_000)].concat(), u64::MAX).unwrap();
        let (first, second) = (&found.arrays[0].values, &found.arrays[1].values);
        assert!(first.len() == 400_001 && first[400_000] == 8.0 && second.is_empty());
        // Interleaved, without values.
        let channels: Vec<u8> = (0..9_000).flat_map(|name| channel(name, 1)).collect();
        let many = segment(&[&word(9_000)[..], &channels].concat(), &[7; 9_000]);
        let none = form(VALUES | INTERLEAVED, &[], &[]);
        let found = contents(&[many, none.repeat(200_000)].concat(), u64::MAX).unwrap();
        assert!(found.arrays.len() == 9_000 && found.arrays[8_999].values == [7.0]);
        assert!(begun.elapsed().as_secs() < 10, "{:?}", begun.elapsed());
        let texts = [&word(8)[..], b"/'g'/'t'", &word(28), &word(TEXT), &word(1), &[1, 0, 0, 0, 0, 0, 0, 0].repeat(2)];
        let objects = [&word(2)[..], &channel(0, 1), &texts.concat(), &word(0)].concat();
        let found = contents(&form(OBJECTS | VALUES | INTERLEAVED, &objects, &[7]), u64::MAX).map(|_| ()).unwrap_err();
        assert!(matches!(found, Refusal::Because(why) if why.contains("texts among interleaved numbers")));
        let long = [&word(1)[..], &word(2000), &[b'a'; 2000], &[0; 8]].concat();
        let found = contents(&segment(&long, &[]), u64::MAX).map(|_| ()).unwrap_err();
        assert!(matches!(found, Refusal::Because(why) if why.contains("longer than 1024 bytes")));
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
        let found = contents(&file.concat(), u64::MAX).unwrap();
        assert!(found.others.iter().any(|(name, what)| name == "last values" && what.starts_with("6 bytes")));
        let found = found.arrays.into_iter();
        assert_eq!(found.map(|array| (array.group, array.name, array.values)).collect::<Vec<_>>(), wanted);
        // Interleaved rows need no whole chunk.
        let found = contents(&segment(new | INTERLEAVED | BIG_ENDIAN, &mixed[..40]), u64::MAX).unwrap();
        assert_eq!(found.arrays[1].values, [0.0, 1.0, 2.0]);
        assert!(found.others[0].1.starts_with("4 bytes"), "{:?}", found.others);
        let mut other = file.concat();
        other.pop();
        assert!(contents(&other, u64::MAX).is_err());
    }
}
