//! A supervised controller with a recorder: it closes the loop of any scenario.

use std::io::{self, Write};

use specgen_runtime::recorder::{Recorder, Row};

use super::Writer;
use crate::controller::{ControllerError, MachineWord, Supervised, TickController};
use crate::description::Description;

/// Most ticks of arming.
const ARMING: u64 = 1_000_000;
/// Phases of the supervisor.
const DISARMED: u8 = 0;
const RUNNING: u8 = 2;
const FAULTED: u8 = 5;
/// Requests to it.
const ARM: u64 = 1;
const RUN: u64 = 2;
const RAMP_DOWN: u64 = 4;

/// Reason why a recording ended early.
#[derive(Debug)]
pub enum RecordingEnd {
    /// The block cannot be stored.
    Io(io::Error),
    /// The machine cannot be saved.
    Controller(ControllerError),
    /// The supervisor did not reach its running phase, or left it.
    Supervisor {
        /// Tick of the record.
        tick: u64,
        /// What it says.
        word: MachineWord,
    },
}

/// A controller under its supervisor, with a recorder. After a reset the first tick is preceded by arming ticks, with
/// the readings of that tick plus the motion of the legs in the wiring check by the controller's model. They are
/// recorded too.
///
/// After a failure it outputs voltages that are not finite, which ends any scenario at once;
/// [`RecordedController::ended`] has the reason.
pub struct RecordedController<'r, 'm, W> {
    machine: Supervised,
    recorder: &'r mut Recorder<'m>,
    writer: &'r mut Writer<W>,
    config: Vec<u64>,
    input: Vec<u64>,
    output: Vec<u64>,
    /// Indices of codes and status in an output.
    codes: [usize; 6],
    status: usize,
    supervisor: usize,
    fresh: bool,
    ended: Option<RecordingEnd>,
}

impl<'r, 'm, W: Write> RecordedController<'r, 'm, W> {
    /// Records `machine`; `recorder` must be started as a stream, and its blocks go to `writer`.
    ///
    /// # Errors
    /// If the controller has no codes or no status.
    pub fn new(
        machine: Supervised,
        recorder: &'r mut Recorder<'m>,
        writer: &'r mut Writer<W>,
    ) -> Result<Self, ControllerError> {
        let description = machine.controller().description();
        let codes = description.outputs("dac_code")?;
        let status = description.output("status")?;
        let supervisor = description.output_names.len();
        Ok(Self {
            config: machine.controller().default_config(),
            input: vec![0; machine.input_names().len()],
            output: vec![0; machine.output_names().len()],
            machine,
            recorder,
            writer,
            codes,
            status,
            supervisor,
            fresh: true,
            ended: None,
        })
    }

    /// Reason why it ended early, if it did.
    pub fn ended(&self) -> Option<&RecordingEnd> {
        self.ended.as_ref()
    }

    /// Ramps down and disarms with the readings of the last tick, and ends the record.
    ///
    /// # Errors
    /// As [`RecordedController::ended`].
    pub fn finish(mut self) -> Result<(), RecordingEnd> {
        if let Some(ended) = self.ended {
            return Err(ended);
        }
        let readings = self.input.clone();
        for left in (0..ARMING).rev() {
            let word = self.tick(&readings, RAMP_DOWN)?;
            if word.phase == DISARMED {
                break;
            }
            if left == 0 || word.phase == FAULTED {
                return Err(RecordingEnd::Supervisor { tick: self.recorder.tick(), word });
            }
        }
        self.recorder.stop();
        self.writer.drain(self.recorder).map_err(RecordingEnd::Io)
    }

    /// One tick with this request.
    fn tick(&mut self, input: &[u64], request: u64) -> Result<MachineWord, RecordingEnd> {
        let law = self.machine.controller().description().input_names.len();
        for (slot, word) in self.input.iter_mut().zip(input.iter().take(law).chain(&[request, 0])) {
            *slot = *word;
        }
        if self.recorder.opens() {
            let state = self.machine.save();
            let digest = self.machine.digest();
            self.recorder.open(&self.config, digest, |words| {
                for (slot, word) in words.iter_mut().zip(&state) {
                    *slot = *word;
                }
            });
        }
        let word = self.machine.step(&self.input, &mut self.output);
        let place = |place: usize| self.output.get(place).copied().unwrap_or_default();
        let row = Row {
            codes: self.codes.map(|code| place(code) as i32),
            status: place(self.status) as u32,
            supervisor: place(self.supervisor) as u32,
        };
        let machine = &self.machine;
        self.recorder.push(&self.input, &row, || machine.digest());
        self.writer.drain(self.recorder).map_err(RecordingEnd::Io)?;
        Ok(word)
    }

    fn advance(&mut self, input: &[u64]) -> Result<(), RecordingEnd> {
        if self.fresh {
            self.fresh = false;
            let mut input = input.to_vec();
            let mut standing = self.machine.standing(&input).map_err(RecordingEnd::Controller)?;
            let mut word = self.tick(&input, ARM)?;
            let start = self.recorder.tick();
            while word.phase != RUNNING {
                if self.recorder.tick() - start >= ARMING || word.cannot_run() {
                    return Err(RecordingEnd::Supervisor { tick: self.recorder.tick() - 1, word });
                }
                // A request to arm that could not be followed at once waits as long as it is given.
                standing.show(&self.machine, &self.output, &mut input);
                word = self.tick(&input, if word.phase == DISARMED { ARM } else { RUN })?;
            }
        }
        let word = self.tick(input, RUN)?;
        if word.phase == RUNNING {
            Ok(())
        } else {
            Err(RecordingEnd::Supervisor { tick: self.recorder.tick() - 1, word })
        }
    }
}

impl<W: Write> TickController for RecordedController<'_, '_, W> {
    fn description(&self) -> &Description {
        self.machine.controller().description()
    }

    fn default_config(&self) -> Vec<u64> {
        self.machine.controller().default_config()
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.machine.configure(words)?;
        self.config = words.to_vec();
        self.recorder.settings_changed();
        Ok(())
    }

    fn reset(&mut self) {
        self.machine.reset();
        self.recorder.restarted();
        self.fresh = true;
        self.ended = None;
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        if self.ended.is_none() {
            self.ended = self.advance(input).err();
        }
        if self.ended.is_some() {
            output.fill(u64::MAX);
            return;
        }
        for (slot, word) in output.iter_mut().zip(&self.output) {
            *slot = *word;
        }
    }

    fn state_digest(&self) -> u64 {
        self.machine.digest()
    }
}
