//! Exports a record as MCAP messages, JSON with schemas, for robotics log viewers. Time zero is the record's tick 0.

use std::collections::BTreeMap;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use host_sim::controller::MachineWord;
use host_sim::record::{Block, Header, ReplayedRows, Row};
use host_sim::word::{WordKind, status_words};
use serde_json::{Value, json};

use super::mcap::Writer;
use super::signals::{LEG_KEYS, Numbers, Of, Signals};
use specgen_language::outcome::Failure;
use specgen_language::output::{PendingFile, unwritten};

/// A file being written.
pub struct Messages {
    writer: Writer<BufWriter<PendingFile>>,
    /// Name given by the user.
    path: PathBuf,
    /// Channel numbers by name, once the record's header is known.
    channels: BTreeMap<&'static str, u16>,
    /// Last written status and supervisor words.
    last: Option<(u32, u32)>,
    text: String,
}

impl Messages {
    pub fn new(path: &Path) -> Result<Self, Failure> {
        let file = BufWriter::new(PendingFile::create(path)?);
        let library = concat!("specgen ", env!("CARGO_PKG_VERSION"));
        let writer = Writer::new(file, library).map_err(|error| unwritten(path, &error))?;
        Ok(Self { writer, path: path.to_owned(), channels: BTreeMap::new(), last: None, text: String::new() })
    }

    pub fn add(&mut self, header: &Header, block: &Block, again: Option<ReplayedRows>) -> Result<(), Failure> {
        self.put(header, block, again).map_err(|error| unwritten(&self.path, &error))
    }

    /// Writes the index and renames the file to its final name.
    pub fn finish(self) -> Result<(), Failure> {
        let file = self.writer.finish().map_err(|error| unwritten(&self.path, &error))?;
        file.into_inner().map_err(|error| unwritten(&self.path, &error))?.keep()
    }

    fn put(&mut self, header: &Header, block: &Block, again: Option<ReplayedRows>) -> io::Result<()> {
        let scalar = header.description.scalar;
        let signals = Signals::new(header, again);
        if self.channels.is_empty() {
            self.declare(header, &signals)?;
        }
        let settings = header.description.config_names.iter().zip(&block.config).map(|(name, word)| {
            let value = match WordKind::of(name) {
                WordKind::Integer => json!(word),
                WordKind::Real => json!(scalar.decode(*word)),
            };
            (name.clone(), value)
        });
        self.text = Value::Object(settings.collect()).to_string();
        self.send("settings", block.first, header.period)?;
        // Repeated in each block, so a block can be read without earlier ones.
        self.last = None;
        for (index, row) in block.rows.iter().enumerate() {
            self.tick(row, &signals, again.and_then(|again| again.rows.get(index)), header)?;
        }
        Ok(())
    }

    fn tick(&mut self, row: &Row, signals: &Signals, given: Option<&Vec<u64>>, header: &Header) -> io::Result<()> {
        let (scalar, period) = (header.description.scalar, header.period);
        for (name, of) in &signals.0 {
            // There are no outputs beyond the end of the replay.
            let Some(numbers) = of.numbers(scalar, row, given) else { continue };
            self.text.clear();
            numbers.write(signals.keys(name), &mut self.text);
            self.send(name, row.tick, period)?;
        }
        self.text.clear();
        Numbers::Codes(row.codes).write(LEG_KEYS, &mut self.text);
        self.send("codes", row.tick, period)?;
        let now = (row.status, row.supervisor);
        if self.last.is_none_or(|last| last.0 != now.0) {
            self.text = json!({ "status": row.status, "text": status_words(row.status) }).to_string();
            self.send("status", row.tick, period)?;
        }
        if self.last.is_none_or(|last| last.1 != now.1) {
            let [phase, cause, on, _] = row.supervisor.to_le_bytes();
            let text = MachineWord::of(u64::from(row.supervisor)).to_string();
            self.text = json!({ "phase": phase, "cause": cause, "amplifiers_on": on == 1, "text": text }).to_string();
            self.send("phase", row.tick, period)?;
        }
        self.last = Some(now);
        Ok(())
    }

    fn send(&mut self, name: &str, tick: u64, period: f64) -> io::Result<()> {
        let Some(channel) = self.channels.get(name).copied() else { return Ok(()) };
        let time = (tick as f64 * period * 1e9).round() as u64;
        self.writer.message(channel, time, tick as u32, self.text.as_bytes())
    }

    fn declare(&mut self, header: &Header, signals: &Signals) -> io::Result<()> {
        let described = &header.description;
        let period = format!("{:?}", header.period);
        let values = [
            ("name", described.name.as_str()),
            ("spec_digest", &described.digest),
            ("specgen", &described.version),
            ("period_s", &period),
        ];
        self.writer.metadata("specgen", &values)?;
        let six = |unit: &str, keys: [&str; 6], kind: &str| {
            let property = |key: &str| {
                let unit = if unit == "m" && key.starts_with('r') { "rad" } else { unit };
                (key.to_owned(), json!({ "type": kind, "description": unit }))
            };
            Value::Object(keys.into_iter().map(property).collect())
        };
        for (name, of) in &signals.0 {
            // A gauge gives V or m, depending on its calibration.
            let unit = match (of, *name) {
                (Of::Input(_), _) => "V, or m from rest",
                (_, "volts") => "V",
                _ => "m",
            };
            self.channel(name, six(unit, signals.keys(name), "number"))?;
        }
        self.channel("codes", six("converter code", LEG_KEYS, "integer"))?;
        let (number, text) = (json!({ "type": "integer" }), json!({ "type": "string" }));
        self.channel("status", json!({ "status": number, "text": text }))?;
        let on = json!({ "type": "boolean" });
        self.channel("phase", json!({ "phase": number, "cause": number, "amplifiers_on": on, "text": text }))?;
        let names = described.config_names.iter().map(|name| (name.clone(), json!({ "type": "number" })));
        self.channel("settings", Value::Object(names.collect()))
    }

    fn channel(&mut self, name: &'static str, properties: Value) -> io::Result<()> {
        let schema = json!({ "type": "object", "properties": properties });
        let channel = self.writer.channel(&format!("/{name}"), &format!("specgen.{name}"), &schema.to_string())?;
        self.channels.insert(name, channel);
        Ok(())
    }
}
