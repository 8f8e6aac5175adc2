//! Writer for MCAP containers (mcap.dev/spec, version 0): chunks with an index, so a viewer finds a time without reading the whole file.
//! No compression and no checksums; both are optional in the format.

use std::collections::BTreeMap;
use std::io::{self, Write};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// A chunk ends after the message that makes it exceed this length, bytes.
const CHUNK: usize = 1 << 20;

const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK_OF: u8 = 0x06;
const MESSAGE_INDEX: u8 = 0x07;
const CHUNK_INDEX: u8 = 0x08;
const STATISTICS: u8 = 0x0b;
const METADATA: u8 = 0x0c;
const METADATA_INDEX: u8 = 0x0d;
const DATA_END: u8 = 0x0f;

/// A file being written; every message belongs to a JSON channel with a schema.
pub struct Writer<W> {
    sink: W,
    /// Bytes written so far.
    at: u64,
    chunk: Vec<u8>,
    /// Current chunk: first and last time, and for each channel times and offsets of its messages.
    bounds: Option<[u64; 2]>,
    index: BTreeMap<u16, Fields>,
    /// Repeated at the end of the file: schemas and channels, and offsets of chunks and metadata.
    declared: Vec<u8>,
    chunks: Vec<u8>,
    metadata: Vec<u8>,
    /// Number of chunks and of metadata records; messages per channel; first and last time.
    counts: [u32; 2],
    messages: BTreeMap<u16, u64>,
    all: Option<[u64; 2]>,
}

impl<W: Write> Writer<W> {
    /// # Errors
    /// Writing to the sink fails; likewise below.
    pub fn new(sink: W, library: &str) -> io::Result<Self> {
        let mut this = Self {
            sink,
            at: 0,
            chunk: Vec::with_capacity(2 * CHUNK),
            bounds: None,
            index: BTreeMap::new(),
            declared: Vec::new(),
            chunks: Vec::new(),
            metadata: Vec::new(),
            counts: [0; 2],
            messages: BTreeMap::new(),
            all: None,
        };
        this.put(MAGIC)?;
        this.put(&record(HEADER, Fields::default().text("").text(library)))?;
        Ok(this)
    }

    /// Adds a channel of JSON messages and returns its number.
    pub fn channel(&mut self, topic: &str, name: &str, schema: &str) -> io::Result<u16> {
        let number = self.messages.len() as u16 + 1;
        self.messages.insert(number, 0);
        let schema = Fields::default().u16(number).text(name).text("jsonschema").text(schema);
        let channel = Fields::default().u16(number).u16(number).text(topic).text("json").part(Fields::default());
        let records = [record(SCHEMA, schema), record(CHANNEL, channel)].concat();
        self.put(&records)?;
        self.declared.extend(records);
        Ok(number)
    }

    /// Adds metadata of the file.
    pub fn metadata(&mut self, name: &str, values: &[(&str, &str)]) -> io::Result<()> {
        let values = values.iter().fold(Fields::default(), |fields, (key, value)| fields.text(key).text(value));
        let bytes = record(METADATA, Fields::default().text(name).part(values));
        let place = Fields::default().u64(self.at).u64(bytes.len() as u64).text(name);
        self.metadata.extend(record(METADATA_INDEX, place));
        self.counts[1] += 1;
        self.put(&bytes)
    }

    /// Adds a message to a channel, at a time in ns.
    pub fn message(&mut self, channel: u16, time: u64, sequence: u32, data: &[u8]) -> io::Result<()> {
        let place = self.chunk.len() as u64;
        let message = Fields::default().u16(channel).u32(sequence).u64(time).u64(time).raw(data);
        self.chunk.extend(record(MESSAGE, message));
        let index = self.index.entry(channel).or_default();
        *index = std::mem::take(index).u64(time).u64(place);
        self.bounds = Some(wider(self.bounds, time));
        self.all = Some(wider(self.all, time));
        *self.messages.entry(channel).or_default() += 1;
        if self.chunk.len() >= CHUNK { self.end_chunk() } else { Ok(()) }
    }

    fn end_chunk(&mut self) -> io::Result<()> {
        let Some([begin, end]) = self.bounds.take() else { return Ok(()) };
        let (size, start) = (self.chunk.len() as u64, self.at);
        let head = Fields::default().u64(begin).u64(end).u64(size).u32(0).text("").u64(size);
        let bytes = record(CHUNK_OF, head.raw(&self.chunk));
        self.chunk.clear();
        self.put(&bytes)?;
        let (length, behind) = (self.at - start, self.at);
        let mut places = Fields::default();
        for (channel, entries) in std::mem::take(&mut self.index) {
            places = places.u16(channel).u64(self.at);
            self.put(&record(MESSAGE_INDEX, Fields::default().u16(channel).part(entries)))?;
        }
        let index = Fields::default().u64(begin).u64(end).u64(start).u64(length).part(places);
        let index = index.u64(self.at - behind).text("").u64(size).u64(size);
        self.chunks.extend(record(CHUNK_INDEX, index));
        self.counts[0] += 1;
        Ok(())
    }

    /// Writes the index after the data and returns the sink.
    pub fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        self.put(&record(DATA_END, Fields::default().u32(0)))?;
        let summary = self.at;
        let [begin, end] = self.all.unwrap_or_default();
        let (channels, [chunks, metadata]) = (self.messages.len(), self.counts);
        let statistics = Fields::default().u64(self.messages.values().sum()).u16(channels as u16).u32(channels as u32);
        let counts =
            self.messages.iter().fold(Fields::default(), |fields, (channel, count)| fields.u16(*channel).u64(*count));
        let statistics = statistics.u32(0).u32(metadata).u32(chunks).u64(begin).u64(end).part(counts);
        let parts = [
            std::mem::take(&mut self.declared),
            record(STATISTICS, statistics),
            std::mem::take(&mut self.chunks),
            std::mem::take(&mut self.metadata),
            record(FOOTER, Fields::default().u64(summary).u64(0).u32(0)),
        ];
        self.put(&parts.concat())?;
        self.put(MAGIC)?;
        Ok(self.sink)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.at += bytes.len() as u64;
        self.sink.write_all(bytes)
    }
}

fn wider(bounds: Option<[u64; 2]>, time: u64) -> [u64; 2] {
    bounds.map_or([time; 2], |[begin, end]| [begin.min(time), end.max(time)])
}

fn record(kind: u8, Fields(content): Fields) -> Vec<u8> {
    [&[kind][..], &(content.len() as u64).to_le_bytes(), &content].concat()
}

/// Consecutive fields of a record: numbers are little endian, variable-length data are preceded by their length.
#[derive(Default)]
struct Fields(Vec<u8>);

impl Fields {
    fn raw(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    fn u16(self, value: u16) -> Self {
        self.raw(&value.to_le_bytes())
    }

    fn u32(self, value: u32) -> Self {
        self.raw(&value.to_le_bytes())
    }

    fn u64(self, value: u64) -> Self {
        self.raw(&value.to_le_bytes())
    }

    fn text(self, text: &str) -> Self {
        self.u32(text.len() as u32).raw(text.as_bytes())
    }

    /// Nested fields: a map or an array.
    fn part(self, Fields(part): Fields) -> Self {
        self.u32(part.len() as u32).raw(&part)
    }
}
