//! Replays a record on the host and compares every tick bit by bit.

use std::fmt;
use std::io::Read;

use specgen_runtime::record::Reason;

use super::{Block, FileItem, Header, Reader, RecordError, Row};
use crate::controller::{ControllerError, SnapshotError, Supervised};

/// Words of an output row after those of the control law: the supervisor's comes first.
const SUPERVISOR: usize = 0;

/// What a replay found.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Replay {
    /// Replayed ticks.
    pub ticks: u64,
    /// Those of them whose digest of the machine was compared, too.
    pub digests: u64,
    /// Blocks that were run.
    pub blocks: u64,
    /// First and last tick of the record.
    pub span: Option<(u64, u64)>,
    /// The first tick that differs.
    pub divergence: Option<Divergence>,
    /// Ranges of missing ticks between blocks, the end excluded.
    pub gaps: Vec<(u64, u64)>,
    /// Damaged blocks: number (from 1), and damage.
    pub damaged: Vec<(usize, String)>,
    /// The file ends within a block; the first unknown tick.
    pub cut: Option<u64>,
    /// Ticks of triggers.
    pub triggers: Vec<u64>,
    /// Changes of the phase, the first one included.
    pub phases: Vec<PhaseChange>,
}

/// The first difference.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Divergence {
    /// Its tick; for a state, that of the following tick.
    pub tick: u64,
    /// What differs.
    pub signal: String,
    /// Its bits in the record.
    pub recorded: u64,
    /// Its bits on the host.
    pub replayed: u64,
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, signal, recorded, replayed } = self;
        write!(f, "tick {tick} {signal}: recorded {recorded:016x}")?;
        let plain = !(signal.contains("digest") || signal.contains("state"));
        if plain {
            write!(f, " ({})", *recorded as i32)?;
        }
        write!(f, ", replayed {replayed:016x}")?;
        if plain { write!(f, " ({})", *replayed as i32) } else { Ok(()) }
    }
}

/// A change of the phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PhaseChange {
    /// The tick.
    pub tick: u64,
    /// Phase, cause << 8, amplifiers on << 16.
    pub supervisor: u32,
}

/// Reason why a record cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It is no record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// It belongs to another controller: the differing line of the description, in the record and in the library.
    #[error(
        "the record is of another controller: {field} {recorded}, the spec gives {library}; name the spec that the target \
         was built from, and the specgen version that built it"
    )]
    Other {
        /// What differs.
        field: &'static str,
        /// In the record.
        recorded: String,
        /// In the library.
        library: String,
    },
    /// Ticks are left out.
    #[error(
        "only every {0}th tick is in the record, so it cannot be replayed; record with decimation 1 (--csv exports it as it is)"
    )]
    Decimated(u32),
    /// The controller refuses the recorded settings.
    #[error("settings at tick {0}: {1}")]
    Config(u64, ControllerError),
}

/// Replays a record on `machine` and calls `each` with every block and the output words of the replayed rows.
///
/// After a difference the rest is only read, not replayed. If a block follows the one before it without a gap, the
/// machine continues, and must then equal the state in the block.
///
/// # Errors
/// If the record does not belong to this controller, or cannot be replayed.
pub fn replay<R: Read>(
    reader: &mut Reader<R>,
    machine: &mut Supervised,
    mut each: impl FnMut(&Header, &Block, &[Vec<u64>]),
) -> Result<Replay, ReplayError> {
    same_controller(reader.header(), machine)?;
    let mut run = Run {
        input: machine.input_names().len(),
        output: vec![0; machine.output_names().len()],
        machine,
        given: Vec::new(),
        found: Replay::default(),
        next: None,
        config: Vec::new(),
    };
    let header = reader.header().clone();
    while let Some(piece) = reader.next_piece()? {
        match piece {
            FileItem::Block(block) => {
                run.given.clear();
                run.block(&block)?;
                each(&header, &block, &run.given);
            }
            FileItem::Damaged { block, reason } => {
                run.found.damaged.push((block, reason));
            }
            FileItem::Cut { .. } => run.found.cut = Some(run.next.unwrap_or_default()),
        }
    }
    Ok(run.found)
}

fn same_controller(header: &Header, machine: &Supervised) -> Result<(), ReplayError> {
    use crate::controller::TickController;

    let (a, b) = (&header.description, machine.controller().description());
    let fields = [
        ("spec digest", a.digest.clone(), b.digest.clone()),
        ("specgen version", a.version.clone(), b.version.clone()),
        ("scalar bits", a.scalar.bits().to_string(), b.scalar.bits().to_string()),
        ("input words", a.input_names.join(","), b.input_names.join(",")),
        ("settings", a.config_names.join(","), b.config_names.join(",")),
    ];
    match fields.into_iter().find(|(_, a, b)| a != b) {
        None => Ok(()),
        Some((field, recorded, library)) => Err(ReplayError::Other { field, recorded, library }),
    }
}

struct Run<'a> {
    machine: &'a mut Supervised,
    input: usize,
    output: Vec<u64>,
    /// Output words of the rows of this block.
    given: Vec<Vec<u64>>,
    found: Replay,
    /// Tick that follows the last one.
    next: Option<u64>,
    /// Settings in force.
    config: Vec<u64>,
}

impl Run<'_> {
    fn block(&mut self, block: &Block) -> Result<(), ReplayError> {
        if block.decimation != 1 {
            return Err(ReplayError::Decimated(block.decimation));
        }
        let adjoins = self.next == Some(block.first);
        // A controller that was reset starts afresh.
        let follows = adjoins && block.reason != Reason::Started;
        if let Some(next) = self.next
            && !adjoins
        {
            self.found.gaps.push((next, block.first));
        }
        self.found.triggers.extend(block.trigger);
        let last = block.first + block.rows.len() as u64;
        self.next = Some(last);
        let start = self.found.span.map_or(block.first, |(start, _)| start);
        self.found.span = Some((start, last.saturating_sub(1)));
        for row in &block.rows {
            self.note_phase(row);
        }
        if self.found.divergence.is_some() {
            return Ok(());
        }
        if block.config != self.config {
            self.machine.configure(&block.config).map_err(|error| ReplayError::Config(block.first, error))?;
            self.config.clone_from(&block.config);
        }
        self.found.divergence = self.begin(block, follows);
        self.found.blocks += 1;
        for row in &block.rows {
            if self.found.divergence.is_some() {
                break;
            }
            self.found.divergence = self.tick(row);
        }
        Ok(())
    }

    /// Sets the machine to the start of the block, or compares it with that.
    fn begin(&mut self, block: &Block, follows: bool) -> Option<Divergence> {
        let differs =
            |signal: String, recorded, replayed| Some(Divergence { tick: block.first, signal, recorded, replayed });
        if !follows && let Err(error) = self.machine.load(&block.state) {
            return match error {
                SnapshotError::Word { index, word } => differs(format!("state word {index} (invalid)"), word, 0),
                SnapshotError::Length { given, expected } => {
                    differs("number of state words".to_owned(), given as u64, expected as u64)
                }
            };
        }
        let state = self.machine.save();
        if let Some(index) = (0..state.len()).find(|k| block.state.get(*k) != state.get(*k)) {
            let recorded = block.state.get(index).copied().unwrap_or_default();
            return differs(format!("state word {index} before it"), recorded, state[index]);
        }
        let digest = self.machine.digest();
        if digest == block.digest { None } else { differs("state_digest before it".to_owned(), block.digest, digest) }
    }

    fn tick(&mut self, row: &Row) -> Option<Divergence> {
        debug_assert_eq!(row.input.len(), self.input);
        self.machine.step(&row.input, &mut self.output);
        self.given.push(self.output.clone());
        self.found.ticks += 1;
        let description = crate::controller::TickController::description(self.machine.controller());
        let at = |place: usize| self.output.get(place).copied().unwrap_or(u64::MAX);
        let word = |name: &str| description.output(name).map_or(u64::MAX, at);
        let codes = (0..).zip(row.codes).map(|(leg, code): (u32, i32)| {
            let name = format!("dac_code[{leg}]");
            (name.clone(), u64::from(code as u32), word(&name))
        });
        let status = ("status".to_owned(), u64::from(row.status), word("status"));
        let supervisor = [u64::from(row.supervisor), at(description.output_names.len() + SUPERVISOR)];
        let parts = [("phase", 0), ("cause", 8), ("amplifiers_on", 16)].map(|(name, shift)| {
            let [recorded, replayed] = supervisor.map(|word| word >> shift & 0xff);
            (name.to_owned(), recorded, replayed)
        });
        let differs = |(signal, recorded, replayed): (String, u64, u64)| {
            (recorded != replayed).then_some(Divergence { tick: row.tick, signal, recorded, replayed })
        };
        let found = codes.chain([status]).chain(parts).find_map(differs);
        if found.is_some() {
            return found;
        }
        let digest = row.digest?;
        self.found.digests += 1;
        differs(("state_digest".to_owned(), digest, self.machine.digest()))
    }

    fn note_phase(&mut self, row: &Row) {
        let last = self.found.phases.last().map(|change| change.supervisor);
        if last != Some(row.supervisor) {
            self.found.phases.push(PhaseChange { tick: row.tick, supervisor: row.supervisor });
        }
    }
}
