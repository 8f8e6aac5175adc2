//! The recorder of the loop, as the service sees it: away while it records, here once its record is complete.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use controller::snapshot::RECORD_LAYOUT;
use controller::snapshot::recorder::{Activity, Settings, Trigger};

use crate::handover::{LoopCommand, Tape};
use crate::record;

/// Blocks of the memory, and words of each: together 4 MiB.
const BLOCKS: usize = 8;
const BLOCK: usize = 1 << 16;
/// Ticks that always fit: one block may be about to be replaced.
pub const CAPACITY: u32 = {
    let words = if BLOCK > 4 * RECORD_LAYOUT.preamble() { BLOCK } else { 4 * RECORD_LAYOUT.preamble() };
    ((BLOCKS - 1) * ((words - RECORD_LAYOUT.preamble()) / RECORD_LAYOUT.longest_row())) as u32
};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CaptureState {
    pub running: bool,
    pub triggered: bool,
    pub ticks: u64,
}

/// The recorder's other side.
pub struct Capture {
    here: Option<Tape>,
    settings: Settings,
    standing: CaptureState,
    /// Number of the command that last restarted it while it was away.
    restarted: Option<u32>,
    /// File of its content, as bytes; made on first use.
    image: Vec<u8>,
    /// File that is written each time the record is complete.
    file: Option<PathBuf>,
    /// The written file, or the error.
    pub written: Option<(PathBuf, io::Result<u64>)>,
}

/// Settings: everything until `after` ticks after the first fault.
fn settings(after: u32) -> Settings {
    Settings {
        streaming: false,
        trigger: Trigger { fault: true, phase_change: false },
        after: if after > 0 { after } else { 1 },
        decimation: 1,
        digest_every: 1,
    }
}

impl Capture {
    /// The service's side and a recorder that waits for a fault. `file` is written each time it is complete.
    ///
    /// # Errors
    /// As text, if there is no recorder for this controller.
    pub fn new(file: Option<&Path>) -> Result<(Self, Tape), String> {
        let words = if BLOCK > 4 * RECORD_LAYOUT.preamble() { BLOCK } else { 4 * RECORD_LAYOUT.preamble() };
        let mut tape = Box::new(record::recorder(BLOCKS, words)?);
        let settings = settings(CAPACITY / 2);
        tape.start(settings);
        let capture = Self {
            here: None,
            settings,
            standing: CaptureState { running: true, ..CaptureState::default() },
            restarted: None,
            image: Vec::new(),
            file: file.map(Path::to_owned),
            written: None,
        };
        Ok((capture, tape))
    }

    pub fn standing(&self) -> CaptureState {
        self.standing
    }

    /// Status of the recorder from the loop.
    pub fn update(&mut self, recorded: Option<u64>, triggered: bool) {
        if let Some(ticks) = recorded {
            if self.here.is_none() {
                self.standing = CaptureState { running: true, triggered, ticks };
            }
        }
    }

    /// The command to record again, until `after` ticks after the trigger. `number` is the number that the command will
    /// have.
    pub fn arm(&mut self, after: u32, number: u32) -> LoopCommand {
        self.settings = settings(after);
        self.standing = CaptureState { running: true, ..CaptureState::default() };
        self.image = Vec::new();
        match self.here.take() {
            Some(mut tape) => {
                tape.start(self.settings);
                LoopCommand::Tape(tape)
            }
            None => {
                self.restarted = Some(number);
                LoopCommand::Record(self.settings)
            }
        }
    }

    /// The recorder came back after the loop had taken `taken` commands. Returns a command if it must be sent again: it
    /// was restarted while it was already on its way.
    pub fn receive(&mut self, mut tape: Tape, taken: u32) -> Option<LoopCommand> {
        if self.restarted.take().is_some_and(|number| (number.wrapping_sub(taken) as i32) > 0) {
            tape.start(self.settings);
            return Some(LoopCommand::Tape(tape));
        }
        let triggered = self.standing.triggered || tape.activity() == Activity::Complete;
        self.standing = CaptureState { running: false, triggered, ticks: tape.rows() };
        // A record that was only stopped is written only by a host that downloads it.
        if let Some(path) = self.file.as_ref().filter(|_| triggered) {
            self.written = Some((path.clone(), write(path, &tape)));
        }
        self.here = Some(tape);
        None
    }

    /// The record as the bytes of its file; none while it records.
    pub fn image(&mut self) -> Option<&[u8]> {
        let tape = self.here.as_ref()?;
        if self.image.is_empty() {
            // A vector takes everything.
            let _ = put(&mut self.image, tape);
        }
        Some(&self.image)
    }
}

fn put(out: &mut impl Write, tape: &Tape) -> io::Result<()> {
    record::begin(out)?;
    (0..tape.blocks()).filter_map(|index| tape.block(index)).try_for_each(|block| record::add(out, block))
}

/// Writes its content to a file, completely or not at all; returns the number of ticks. The temporary file beside it
/// replaces no existing file.
fn write(path: &Path, tape: &Tape) -> io::Result<u64> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(format!(".{}.part", std::process::id()));
    let draft = PathBuf::from(draft);
    let mut out = BufWriter::new(File::create_new(&draft)?);
    let written = put(&mut out, tape)
        .and_then(|()| out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all())
        .and_then(|()| std::fs::rename(&draft, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&draft);
    }
    written.map(|()| tape.rows())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_draft_of_a_record_replaces_no_file() {
        let folder = std::env::temp_dir().join(format!("rt-pc-capture-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("run.rec");
        let drafts = [folder.join("run.rec.part"), folder.join(format!("run.rec.{}.part", std::process::id()))];
        let (_, tape) = Capture::new(None).unwrap();
        std::fs::write(&drafts[0], "mine").unwrap();
        write(&path, &tape).unwrap();
        assert!(path.is_file());
        std::fs::write(&drafts[1], "mine").unwrap();
        assert_eq!(write(&path, &tape).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        for draft in &drafts {
            assert_eq!(std::fs::read_to_string(draft).unwrap(), "mine");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    /// A recorder that has so many ticks, triggered or only stopped.
    fn recorded(mut tape: Tape, ticks: u64, triggered: bool) -> Tape {
        let machine = controller::supervised::machine_at_reset();
        let config = controller::Config::new();
        tape.begin(0);
        for tick in 0..ticks {
            controller::snapshot::record_before(&config, &machine, &mut tape);
            let row = crate::bench::row(tick);
            tape.push(&row.input.to_words(), &row.output, || 1);
        }
        if triggered {
            tape.trigger();
            while tape.activity() != Activity::Complete {
                controller::snapshot::record_before(&config, &machine, &mut tape);
                let row = crate::bench::row(tape.rows());
                tape.push(&row.input.to_words(), &row.output, || 1);
            }
        } else {
            tape.stop();
        }
        tape
    }

    #[test]
    fn all_that_is_promised_is_kept_around_a_trigger() {
        let (mut capture, tape) = Capture::new(None).unwrap();
        assert_eq!(capture.settings, settings(CAPACITY / 2));
        assert_eq!((settings(0).after, settings(1).after, settings(9).after), (1, 1, 9));
        assert!(settings(9).trigger.fault && settings(9).digest_every == 1 && settings(9).decimation == 1);
        // But for the block that is about to be given up.
        assert_eq!(tape.capacity() / BLOCKS * (BLOCKS - 1), CAPACITY as usize);
        assert!(tape.capacity() > 10_000, "a second at 10 kHz");
        assert!(capture.image().is_none(), "it is away");
        assert_eq!(capture.standing(), CaptureState { running: true, triggered: false, ticks: 0 });
        capture.update(None, true);
        assert_eq!(capture.standing(), CaptureState { running: true, triggered: false, ticks: 0 });
        capture.update(Some(8), true);
        assert_eq!(capture.standing(), CaptureState { running: true, triggered: true, ticks: 8 });
    }

    #[test]
    fn what_comes_back_complete_is_written_and_what_was_only_stopped_is_not() {
        let path = std::env::temp_dir().join(format!("rt-pc-kept-{}", std::process::id()));
        let (mut capture, tape) = Capture::new(Some(&path)).unwrap();
        assert!(capture.receive(recorded(tape, 5, false), 0).is_none());
        assert_eq!(capture.standing(), CaptureState { running: false, triggered: false, ticks: 5 });
        assert!(capture.written.is_none() && !path.exists());
        // What the loop says later is of the time before.
        capture.update(Some(4), true);
        assert!(!capture.standing().running);
        let LoopCommand::Tape(mut tape) = capture.arm(7, 1) else { panic!("it was here") };
        assert_eq!(capture.standing(), CaptureState { running: true, triggered: false, ticks: 0 });
        assert!(capture.image().is_none());
        tape.begin(0);
        assert!(capture.receive(recorded(tape, 5, true), 1).is_none());
        let standing = CaptureState { running: false, triggered: true, ticks: 5 + 7 };
        assert_eq!(capture.standing(), standing);
        let file = std::fs::read(&path).unwrap();
        assert_eq!(capture.image(), Some(file.as_slice()));
        assert!(matches!(capture.written, Some((written, Ok(12))) if written == path));
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_recorder_that_came_back_before_it_was_started_anew_goes_again() {
        // The command to restart has number 5; the loop had taken `taken` commands when it returned the recorder.
        for (taken, goes) in [(4, true), (5, false), (6, false)] {
            let (mut capture, tape) = Capture::new(None).unwrap();
            assert!(matches!(capture.arm(3, 5), LoopCommand::Record(settings) if settings.after == 3));
            let again = capture.receive(recorded(tape, 2, false), taken);
            assert_eq!(again.is_some(), goes, "{taken}");
            if let Some(LoopCommand::Tape(tape)) = again {
                assert_eq!((tape.rows(), capture.standing().running), (0, true));
            }
            assert_eq!(capture.image().is_some(), !goes);
        }
        // Numbers wrap around.
        let (mut capture, tape) = Capture::new(None).unwrap();
        capture.arm(3, 1);
        assert!(capture.receive(recorded(tape, 2, false), u32::MAX).is_some());
    }
}
