//! Replays recorded ticks on the emulated microcontroller.
//!
//! All files are little-endian 64-bit words; `firmware/qemu/src/main.rs` describes the first
//! three, `firmware/qemu/src/stats.rs` the layout of `stats.bin`.

use super::build::Image;
use super::emulator::Emulator;
use super::error::TargetError;
use specgen_language::interrupt::Scratch;
use std::fs;
use std::path::Path;
use std::time::Duration;

const MAGIC: u64 = u64::from_le_bytes(*b"SPECSTAT");
const VERSION: u64 = 1;
/// Words before the first stage record.
const HEADER: usize = 17;
/// Words of a stage record.
const RECORD: usize = 6;
/// Expected counts for 0, 1, 100 and 1000 `nop`s.
const SELF_TEST: [u64; 4] = [0, 1, 100, 1000];

/// Outputs of the microcontroller, and their cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplayResult {
    /// OUTPUT_WORDS words per tick, bit patterns.
    pub outputs: Vec<Vec<u64>>,
    /// Digest of the controller's state after each tick.
    pub digests: Vec<u64>,
    /// What was measured.
    pub stats: ReplayStats,
}

/// Measurements of a replay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReplayStats {
    /// Ticks replayed.
    pub ticks: u64,
    /// CONFIG_WORDS of the controller in the image.
    pub config_words: usize,
    /// INPUT_WORDS of the controller.
    pub input_words: usize,
    /// OUTPUT_WORDS of the controller.
    pub output_words: usize,
    /// Size of `State` on the microcontroller, bytes.
    pub state_bytes: u64,
    /// Size of `Config` on the microcontroller, bytes.
    pub config_bytes: u64,
    /// Most stack used by one `step`, bytes, found by stack painting.
    pub painted_stack: u64,
    /// Size of the painted area, bytes: the most that can be detected.
    pub painted_window: u64,
    /// Instructions per call; the first stage is `step`, the whole tick.
    pub stages: Vec<StageStats>,
}

/// Instructions of one stage, exact: from call to return, less the measuring overhead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageStats {
    /// Its name.
    pub name: String,
    /// Calls measured.
    pub calls: u64,
    /// Fewest instructions of one call.
    pub smallest: u64,
    /// Instructions of all calls together.
    pub sum: u64,
    /// Most instructions of one call.
    pub largest: u64,
}

impl StageStats {
    /// Mean instructions per call; 0 without calls.
    pub fn mean(&self) -> f64 {
        if self.calls == 0 { 0.0 } else { self.sum as f64 / self.calls as f64 }
    }
}

impl ReplayStats {
    /// The stage with that name.
    pub fn stage(&self, name: &str) -> Option<&StageStats> {
        self.stages.iter().find(|stage| stage.name == name)
    }
}

/// Replays `inputs`, one row of INPUT_WORDS words per tick, from a fresh state under `config`.
///
/// Takes about 4 s for 100,000 short ticks. The result depends only on the arguments.
///
/// # Errors
/// [`TargetError::MissingTool`] without QEMU; [`TargetError::BadRequest`] if rows differ in length;
/// [`TargetError::EmulatorFailed`] if the firmware refuses the words; [`TargetError::EmulatorTimeout`];
/// [`TargetError::MalformedStats`] if the output is incomplete or the instruction counter fails its self-test.
pub fn replay(
    image: &Image,
    config: &[u64],
    inputs: &[Vec<u64>],
    limit: Duration,
) -> Result<ReplayResult, TargetError> {
    replay_from("input.bin", image, config, inputs, limit)
}

/// Replays supervised ticks, rows of MACHINE_INPUT_WORDS words, from reset. Output rows have
/// MACHINE_OUTPUT_WORDS words; digests and sizes are those of the supervised machine. Stages: `supervise`, ticks that stay in Running; `law`,
/// the control law alone in these; `other phases`.
///
/// # Errors
/// As [`replay`].
pub fn replay_machine(
    image: &Image,
    config: &[u64],
    inputs: &[Vec<u64>],
    limit: Duration,
) -> Result<ReplayResult, TargetError> {
    replay_from("machine.bin", image, config, inputs, limit)
}

fn replay_from(
    file: &str,
    image: &Image,
    config: &[u64],
    inputs: &[Vec<u64>],
    limit: Duration,
) -> Result<ReplayResult, TargetError> {
    let emulator = Emulator::find()?;
    let width = inputs.first().map_or(0, Vec::len);
    if let Some(tick) = inputs.iter().position(|row| row.len() != width) {
        let text = format!("input row {tick} has {} words, row 0 has {width}", inputs[tick].len());
        return Err(TargetError::BadRequest { text });
    }
    let folder = Scratch::new().map_err(|e| TargetError::io("creating a folder in", std::env::temp_dir(), e))?;
    write_words(&folder.path().join("config.bin"), config.iter().copied())?;
    write_words(&folder.path().join(file), inputs.iter().flatten().copied())?;
    emulator.run(image, folder.path(), &[], limit)?;
    let stats = parse_stats(&read_words(&folder.path().join("stats.bin"))?)?;
    let words = read_words(&folder.path().join("output.bin"))?;
    let row = stats.output_words + 1;
    // Rows of the wrong width could still add up to whole rows.
    if stats.input_words != width && !inputs.is_empty() {
        let text = format!("input rows have {width} words, the controller takes {}", stats.input_words);
        return Err(TargetError::BadRequest { text });
    }
    if stats.ticks != inputs.len() as u64 || words.len() != inputs.len() * row {
        let (rows, ticks, words_read) = (inputs.len(), stats.ticks, words.len());
        let text = format!(
            "{rows} input rows gave {ticks} ticks and {words_read} output words; expected {row} words per tick"
        );
        return Err(TargetError::MalformedStats { text });
    }
    let outputs = words.chunks_exact(row).map(|tick| tick[..row - 1].to_vec()).collect();
    let digests = words.chunks_exact(row).map(|tick| tick[row - 1]).collect();
    Ok(ReplayResult { outputs, digests, stats })
}

pub(super) fn write_words(path: &Path, words: impl Iterator<Item = u64>) -> Result<(), TargetError> {
    let bytes: Vec<u8> = words.flat_map(u64::to_le_bytes).collect();
    fs::write(path, bytes).map_err(|e| TargetError::io("writing", path, e))
}

pub(super) fn read_words(path: &Path) -> Result<Vec<u64>, TargetError> {
    let bytes = fs::read(path).map_err(|e| TargetError::io("reading", path, e))?;
    let (words, rest) = bytes.as_chunks::<8>();
    if !rest.is_empty() {
        let name = path.file_name().unwrap_or_default().display();
        let text = format!("{name} has {} bytes, expected whole words of 8", bytes.len());
        return Err(TargetError::MalformedStats { text });
    }
    Ok(words.iter().map(|&word| u64::from_le_bytes(word)).collect())
}

fn parse_stats(words: &[u64]) -> Result<ReplayStats, TargetError> {
    let malformed = |text: String| Err(TargetError::MalformedStats { text });
    if words.len() < HEADER || words[0] != MAGIC || words[1] != VERSION {
        return malformed(format!(
            "stats.bin ({} words) does not have layout version {VERSION}; rebuild the workspace with this specgen",
            words.len()
        ));
    }
    // `usize` is at least as large here as on the microcontroller.
    let size = |word: u64| usize::try_from(word).unwrap_or(usize::MAX);
    if words[11..15] != SELF_TEST {
        return malformed(format!(
            "the instruction counter read {:?} for {SELF_TEST:?} nops; -icount shift=10 of this QEMU may be inexact",
            &words[11..15]
        ));
    }
    if words[15] != 0 {
        return malformed(format!("{} measurements took more than 655,000 instructions", words[15]));
    }
    if words.len() != HEADER.saturating_add(size(words[16]).saturating_mul(RECORD)) {
        return malformed(format!("stats.bin has {} words, which does not fit {} stages", words.len(), words[16]));
    }
    Ok(ReplayStats {
        ticks: words[2],
        config_words: size(words[3]),
        input_words: size(words[4]),
        output_words: size(words[5]),
        state_bytes: words[6],
        config_bytes: words[7],
        painted_stack: words[8],
        painted_window: words[9],
        stages: words[HEADER..].chunks_exact(RECORD).map(parse_stage).collect(),
    })
}

fn parse_stage(record: &[u64]) -> StageStats {
    let name: Vec<u8> = record[..2].iter().flat_map(|word| word.to_le_bytes()).take_while(|&byte| byte != 0).collect();
    StageStats {
        name: String::from_utf8_lossy(&name).into_owned(),
        calls: record[2],
        smallest: record[3],
        sum: record[4],
        largest: record[5],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Vec<u64> {
        let mut words = vec![MAGIC, VERSION, 3, 8, 12, 37, 100, 64, 500, 8192, 2, 0, 1, 100, 1000, 0, 1];
        words.extend([u64::from_le_bytes(*b"step\0\0\0\0"), 0, 3, 10, 60, 30]);
        words
    }

    #[test]
    fn stats_are_read_as_the_layout_says() {
        let stats = parse_stats(&good()).unwrap();
        assert_eq!((stats.ticks, stats.config_words, stats.input_words, stats.output_words), (3, 8, 12, 37));
        assert_eq!((stats.state_bytes, stats.painted_stack, stats.painted_window), (100, 500, 8192));
        let step = stats.stage("step").unwrap();
        assert_eq!((step.calls, step.smallest, step.largest, step.mean()), (3, 10, 30, 20.0));
        assert_eq!(stats.stage("inverse"), None);
    }

    #[test]
    fn every_kind_of_malformed_stats_is_reported() {
        let spoil = |at: usize, word: u64| {
            let mut words = good();
            words[at] = word;
            parse_stats(&words).unwrap_err().to_string()
        };
        assert!(spoil(0, 0).contains("layout version 1"));
        assert!(spoil(1, 2).contains("layout version 1"));
        assert!(spoil(14, 999).contains("999"));
        assert!(spoil(15, 4).contains("655,000"));
        assert!(spoil(16, 2).contains("not fit 2 stages"));
        assert!(spoil(16, u64::MAX).contains("not fit 18446744073709551615 stages"));
        assert!(parse_stats(&[]).unwrap_err().to_string().contains("0 words"));
    }
}
