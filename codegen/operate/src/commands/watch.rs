//! `watch`: shows samples of the running machine, writes them to a file, or keeps them for the JSON document.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::place::AXES;
use crate::samples::{Block, Row, Spread};
use serde::Serialize;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};

use super::error::SessionError;
use super::operator::Operator;
use specgen_language::outcome::Outcome;
use specgen_language::output::{TableFile, unwritten};
use specgen_language::table::{Column, right, row};
use specgen_language::ui::Ui;

/// Default duration of a row, s.
const ROW: f64 = 0.1;
/// Polling interval.
const LOOK: Duration = Duration::from_millis(10);
/// After this time without a sample the machine is not ticking.
const SILENT: Duration = Duration::from_secs(2);

/// Answer to `watch`.
#[derive(Serialize)]
struct WatchReport {
    /// Ticks per row.
    every: u32,
    rows: u64,
    gaps: Vec<Gap>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// Rows that were not written to a file; SI.
    #[serde(rename = "samples", skip_serializing_if = "Vec::is_empty")]
    kept: Vec<Sample>,
}

impl WatchReport {
    fn new(every: u32, path: Option<&Path>) -> Self {
        let file = path.map(|path| path.display().to_string());
        Self { every, rows: 0, gaps: Vec::new(), file, kept: Vec::new() }
    }
}

/// Begins the motion of a record.
pub(crate) type Start<'a, P> = dyn FnMut(&mut Operator<P>) -> Result<(), SessionError> + 'a;

/// Ticks without samples.
#[derive(Serialize)]
struct Gap {
    from: u64,
    /// The first tick after the gap.
    to: u64,
    /// Blocks that were not fetched in time.
    blocks: u32,
}

/// A row with its time.
#[derive(Serialize)]
struct Sample {
    /// Its first tick.
    tick: u64,
    time: f64,
    ticks: u32,
    #[serde(flatten)]
    row: Row,
}

impl Outcome for WatchReport {
    fn text(&self) -> String {
        let ticks = if self.every == 1 { "tick" } else { "ticks" };
        let mut text = format!("{} rows of {} {ticks}", self.rows, self.every);
        if let Some(file) = &self.file {
            text += &format!(" in {file}");
        }
        let missing: u64 = self.gaps.iter().map(|gap| gap.to.saturating_sub(gap.from)).fold(0, u64::saturating_add);
        text + &match self.gaps.len() {
            0 => ", without a gap\n".to_owned(),
            gaps => format!(", {gaps} gaps with {missing} ticks in total\n"),
        }
    }
}

/// Destination of rows.
enum Sink {
    Shown,
    Kept,
    File { file: Box<BufWriter<TableFile>>, path: PathBuf, as_json: bool },
}

impl Sink {
    fn new(path: Option<&Path>, ui: &Ui) -> Result<Self, SessionError> {
        let Some(path) = path else { return Ok(if ui.is_json() { Self::Kept } else { Self::Shown }) };
        let as_json = path.extension().is_some_and(|extension| extension == "jsonl");
        let mut file = Box::new(BufWriter::new(TableFile::create(path).map_err(SessionError::Failed)?));
        if !as_json {
            writeln!(file, "{}", titles()).map_err(|error| SessionError::Failed(unwritten(path, &error)))?;
        }
        Ok(Self::File { file, path: path.to_owned(), as_json })
    }

    fn begin(&self, ui: &Ui) {
        if let Self::Shown = self {
            let mut text = "pose in um and urad; largest error of a row in nm and nrad\n".to_owned();
            let [x, y, z, rx, ry, rz] = AXES;
            row(&mut text, &COLUMNS, &[&"tick", &x, &y, &z, &rx, &ry, &rz, &"nm", &"nrad"]);
            ui.out(&text);
        }
    }

    fn gap(&self, gap: &Gap, ui: &Ui) {
        if let Self::Shown = self {
            ui.out(&format!("  ticks {} to {} are missing\n", gap.from, gap.to.saturating_sub(1)));
        }
    }

    fn put(&mut self, sample: Sample, kept: &mut Vec<Sample>, ui: &Ui) -> Result<(), SessionError> {
        match self {
            Self::Shown => ui.out(&line(&sample)),
            Self::Kept => kept.push(sample),
            Self::File { file, path, as_json } => {
                let written = if *as_json {
                    serde_json::to_writer(&mut *file, &sample).map_err(Into::into).and_then(|()| writeln!(file))
                } else {
                    writeln!(file, "{}", values(&sample))
                };
                written.map_err(|error| SessionError::Failed(unwritten(path, &error)))?;
            }
        }
        Ok(())
    }

    /// Lets the reader of a pipe follow.
    fn flush(&mut self) -> Result<(), SessionError> {
        match self {
            Self::File { file, path, .. } => {
                file.flush().map_err(|error| SessionError::Failed(unwritten(path, &error)))
            }
            Self::Shown | Self::Kept => Ok(()),
        }
    }

    fn finish(self) -> Result<(), SessionError> {
        let Self::File { file, path, .. } = self else { return Ok(()) };
        let file = file.into_inner().map_err(|error| SessionError::Failed(unwritten(&path, &error.into_error())))?;
        file.keep().map_err(SessionError::Failed)
    }
}

const COLUMNS: [Column; 9] =
    [right(10), right(9), right(9), right(9), right(9), right(9), right(9), right(8), right(8)];

fn line(Sample { tick, row: given, .. }: &Sample) -> String {
    let nothing = || "-".to_owned();
    let pose: [String; 6] =
        std::array::from_fn(|axis| given.pose.map_or_else(nothing, |pose| format!("{:.3}", pose[axis] * 1e6)));
    let largest = |axes: std::ops::Range<usize>| {
        let ends: Option<Vec<f32>> =
            given.error.map(|error| error[axes].iter().flat_map(|error| [error.least, error.most]).collect());
        let most =
            |ends: Vec<f32>| ends.iter().fold(0.0, |most: f32, end| if end.abs() > most { end.abs() } else { most });
        ends.map_or_else(nothing, |ends| format!("{:.1}", 1e9 * most(ends)))
    };
    let [x, y, z, rx, ry, rz] = &pose;
    let mut text = String::new();
    row(&mut text, &COLUMNS, &[tick, x, y, z, rx, ry, rz, &largest(0..3), &largest(3..6)]);
    text
}

/// Column names, with units as in the CSV of a record.
fn titles() -> String {
    let mut titles = "tick,time_s,ticks,status,phase".to_owned();
    let unit = |axis: usize| if axis < 3 { "m" } else { "rad" };
    for name in ["pose", "target"] {
        (0..AXES.len()).for_each(|axis| titles += &format!(",{name}[{axis}]_{}", unit(axis)));
    }
    for name in ["error", "volts"] {
        for axis in 0..AXES.len() {
            let unit = if name == "volts" { "V" } else { unit(axis) };
            ["least", "mean", "most"].iter().for_each(|which| titles += &format!(",{name}[{axis}]_{which}_{unit}"));
        }
    }
    (0..6).for_each(|leg| titles += &format!(",leg[{leg}]_m"));
    titles
}

/// Numbers as the shortest decimals that give the same bits; `nan` if not measured.
fn values(Sample { tick, time, ticks, row }: &Sample) -> String {
    let mut values = format!("{tick},{time:.9},{ticks},{},{}", row.status, row.phase);
    let place = |place: Option<f64>| place.map_or_else(|| ",nan".to_owned(), |value| format!(",{value:e}"));
    let spread = |spread: Option<Spread>| {
        spread.map_or_else(|| ",nan".repeat(3), |Spread { least, mean, most }| format!(",{least:e},{mean:e},{most:e}"))
    };
    (0..6).for_each(|axis| values += &place(row.pose.map(|pose| pose[axis])));
    row.target.iter().for_each(|value| values += &place(Some(*value)));
    (0..6).for_each(|axis| values += &spread(row.error.map(|error| error[axis])));
    row.volts.iter().for_each(|volts| values += &spread(Some(*volts)));
    (0..6).for_each(|leg| values += &place(row.legs.map(|legs| legs[leg])));
    values
}

impl<P: Port> Operator<P> {
    /// Takes rows of `every` ticks for a duration in the machine's time.
    pub(super) fn watch(
        &mut self,
        every: Option<u32>,
        seconds: f64,
        path: Option<&Path>,
        line: &str,
        ui: &Ui,
    ) -> Result<(), SessionError> {
        self.motion().map_err(SessionError::Refused)?;
        let period = self.session.period();
        let every = every.unwrap_or((ROW / period).ceil() as u32);
        let mut sink = Sink::new(path, ui)?;
        self.session.stream(every).map_err(|error| match error {
            ClientError::Refused(Refusal::Word { .. }) => SessionError::Refused(format!(
                "rows of {every} ticks are too long for the device: at most {}",
                specgen_link::samples::MOST_EVERY
            )),
            other => other.into(),
        })?;
        let mut watched = WatchReport::new(every, path);
        sink.begin(ui);
        let ticks = (seconds / period).ceil() as u64;
        let ended = self.take(ticks, None, &mut watched, &mut sink, ui);
        // Keep the samples so far, even after an error.
        match ended {
            Ok(()) => self.beside(|| sink.finish())??,
            Err(_) => sink.finish()?,
        }
        ended?;
        self.session.stream(0)?;
        self.note(line, &watched, ui);
        Ok(())
    }

    /// Writes rows of `every` ticks, or of the fewest that the line carries, up to `most`, to a CSV file for a lead and a duration, s;
    /// `start` is called after the lead. A file without a gap, or none.
    pub(crate) fn record_rows(
        &mut self,
        (every, most): (u32, u32),
        [lead, seconds]: [f64; 2],
        path: &Path,
        start: &mut Start<'_, P>,
        ui: &Ui,
    ) -> Result<(), SessionError> {
        let mut sink = Sink::new(Some(path), ui)?;
        let every = match self.session.stream(every) {
            Ok(()) => every,
            Err(ClientError::Refused(Refusal::Rate { least })) if least <= most => {
                self.session.stream(least)?;
                least
            }
            Err(ClientError::Refused(Refusal::Rate { least })) => {
                return Err(SessionError::Refused(format!(
                    "the line carries rows of {least} ticks at least, {every} are planned: use a faster line"
                )));
            }
            Err(other) => return Err(other.into()),
        };
        let mut watched = WatchReport::new(every, Some(path));
        let [lead, ticks] = [lead, lead + seconds].map(|time| (time / self.session.period()).ceil() as u64);
        self.take(ticks, Some((lead, start)), &mut watched, &mut sink, ui)?;
        self.session.stream(0)?;
        if !watched.gaps.is_empty() {
            let text = watched.text();
            return Err(SessionError::Fault(format!("{}: record it again, on a less busy computer", text.trim_end())));
        }
        self.beside(|| sink.finish())??;
        ui.progress(watched.text().trim_end());
        Ok(())
    }

    /// `start`: called after so many ticks.
    fn take(
        &mut self,
        ticks: u64,
        mut start: Option<(u64, &mut Start<'_, P>)>,
        watched: &mut WatchReport,
        sink: &mut Sink,
        ui: &Ui,
    ) -> Result<(), SessionError> {
        let (mut next, mut number, mut end) = (None, 0_u32, None);
        let mut heard = Instant::now();
        loop {
            for block in self.session.take_blocks()? {
                heard = Instant::now();
                let Block { number: found, tick, .. } = block;
                if let Some(from) = next
                    && tick != from
                {
                    let gap = Gap { from, to: tick, blocks: found.wrapping_sub(number) };
                    sink.gap(&gap, ui);
                    watched.gaps.push(gap);
                }
                let end = *end.get_or_insert(tick.saturating_add(ticks));
                (next, number) = (Some(block.end()), found.wrapping_add(1));
                for sample in self.samples(block).take_while(|sample| sample.tick < end) {
                    watched.rows += 1;
                    sink.put(sample, &mut watched.kept, ui)?;
                }
            }
            sink.flush()?;
            let lead = next.zip(end).map_or(0, |(next, end)| next.saturating_sub(end.saturating_sub(ticks)));
            if let Some((_, start)) = start.take_if(|(after, _)| end.is_some() && lead >= *after) {
                start(self)?;
            }
            if next.zip(end).is_some_and(|(next, end)| next >= end) {
                return Ok(());
            }
            let most = SILENT + Duration::from_secs_f64(f64::from(watched.every) * self.session.period());
            if heard.elapsed() > most {
                return Err(SessionError::Fault(format!("the machine is {}, but not ticking", self.state())));
            }
            self.look()?;
            self.show(ui);
            std::thread::sleep(LOOK);
        }
    }

    /// The rows of a block, in the session's frame.
    fn samples(&self, block: Block) -> impl Iterator<Item = Sample> {
        let (frame, period) = (self.frame, self.session.period());
        let Block { tick, every, rows, .. } = block;
        rows.into_iter().enumerate().map(move |(index, mut row)| {
            row.pose = row.pose.map(|pose| frame.pose(&pose).unwrap_or(pose));
            row.target = frame.pose(&row.target).unwrap_or(row.target);
            let tick = tick.saturating_add(u64::from(every) * index as u64);
            Sample { tick, time: tick as f64 * period, ticks: every, row }
        })
    }
}
