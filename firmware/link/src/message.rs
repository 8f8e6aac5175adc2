//! Messages between host and device. The order of the variants is the format: new ones are added at the end, and a
//! change of an old one needs another [`VERSION`](crate::VERSION).

use serde::{Deserialize, Serialize};

use crate::bytes::Bytes;
use crate::counters::Counters;

/// From the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Opens a session. Answered by [`Reply::Identity`]; required before any other request.
    Hello,
    /// The controller's own description from this byte on. Answered by [`Reply::Chunk`].
    Describe {
        /// First byte wanted.
        offset: u32,
    },
    /// Answered by [`Reply::Status`].
    Status,
    /// The request to the supervisor from now on: the number of a `supervisor::Request`. It stays in force while the
    /// link is alive. Answered by [`Reply::Done`].
    Supervise {
        /// 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge, 6 open drive.
        request: u8,
    },
    /// The command from the next tick on: the controller's input words, without the measured ones, in their order.
    /// Answered by [`Reply::Done`].
    Setpoint {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Answered by [`Reply::Config`].
    ReadConfig,
    /// Settings, all at once, from the next tick on. Answered by [`Reply::Done`], or by [`Refusal::Word`] with nothing
    /// changed.
    WriteConfig {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Lock-step: the machine as at power-up, with these settings. Answered by [`Reply::Done`].
    LockstepReset {
        /// Words of the settings.
        #[serde(borrow)]
        config: Bytes<'a>,
    },
    /// Lock-step: one tick. Answered by [`Reply::Stepped`].
    LockstepStep {
        /// Input words of the machine.
        #[serde(borrow)]
        input: Bytes<'a>,
    },
    /// Lock-step: cost of a stage since the device started. Answered by [`Reply::Stage`].
    LockstepStage {
        /// Number of the stage; the first is the whole tick.
        index: u8,
    },
    /// Answered by [`Reply::Recorder`].
    Recorder {
        /// Action of the recorder.
        action: RecorderAction,
    },
    /// The record as the bytes of its file, from this byte on. Answered by [`Reply::Chunk`].
    Download {
        /// First byte wanted.
        offset: u32,
    },
    /// Answered by [`Reply::Done`].
    Wave {
        /// Action of the wave generator.
        action: WaveAction,
        /// Words of its settings, for [`WaveAction::Start`] and [`WaveAction::StartOnEdge`].
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Ramps down, then ends the program that serves the link. A board refuses it: [`Refusal::Unsupported`]. Answered
    /// by [`Reply::Done`], for any host; the connection is closed once the amplifiers are off.
    Stop,
    /// Answered by [`Reply::Health`]; this clears its events, and those of [`Reply::Status`].
    Health,
    /// The platform's pose. Refused by six legs, which have none: [`Refusal::Unsupported`]. Answered by
    /// [`Reply::Place`].
    Place,
    /// Knots of the correction of passes, from this index on. Answered by [`Reply::Done`], or [`Refusal::Word`] if
    /// there is no room.
    Knots {
        /// Number of the first.
        first: u32,
        /// Knots: x, y, z in pm, θx, θy, θz in prad, 32 bits each.
        #[serde(borrow)]
        knots: Bytes<'a>,
    },
    /// Answered by [`Reply::Pass`].
    Pass {
        /// Action of the player of passes.
        action: PassAction,
    },
    /// Errors of the last pass, as the bytes of its knots, from this byte on. Answered by [`Reply::Chunk`].
    Errors {
        /// First byte wanted.
        offset: u32,
    },
    /// Starts samples for this host with the next tick; 0 stops them: see [`samples`](crate::samples). Answered by
    /// [`Reply::Done`], or by [`Refusal::Rate`] if line or device cannot carry that many.
    Stream {
        /// Ticks of a row.
        every: u32,
    },
    /// The oldest unread block of samples. Answered by [`Reply::Samples`].
    Samples,
    /// The correction of the next pass, as the bytes of its knots, from this byte on. Answered by [`Reply::Chunk`].
    Correction {
        /// First byte wanted.
        offset: u32,
    },
    /// As [`Request::Setpoint`], from the tick after the rising edge of the input line on. Only the last such command
    /// waits; any immediate command drops it. The machine must run at rest, now and at the edge. Answered by
    /// [`Reply::Done`].
    SetpointOnEdge {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Answered by [`Reply::Edge`].
    Edge {
        /// Drop the waiting command, before the answer.
        drop: bool,
    },
}

/// Action of a player of passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PassAction {
    /// Only report the status.
    Look,
    /// Start a pass with the next tick, under the correction of the knots that were sent. The machine must run at rest.
    Begin {
        /// Ticks from knot to knot.
        spacing: u32,
        /// Ticks at rest before the trajectory.
        before: u32,
        /// Ticks in all.
        ticks: u32,
        /// Number of the trajectory.
        trajectory: u32,
    },
    /// End the pass at once; the correction fades out, the trajectory continues.
    Abort,
    /// Compute the correction of the next pass in the background, from the pass that completed and the plan that was
    /// sent after its knots.
    Learn {
        /// Knots that the plan reaches to each side.
        reach: u32,
        /// Knots over which the correction fades in and out.
        fade: [u32; 2],
    },
}

/// Action of a recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RecorderAction {
    /// Only report the status.
    Look,
    /// Clear the memory and record, until this many ticks after the trigger.
    Arm {
        /// Ticks after the trigger.
        after: u32,
    },
    /// Trigger now.
    Trigger,
    /// Stop at once; the memory is kept.
    Stop,
}

/// Action of a wave generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WaveAction {
    /// Start the wave with these words.
    Start,
    /// Come to rest.
    Stop,
    /// As [`WaveAction::Start`], but at the edge, as with [`Request::SetpointOnEdge`].
    StartOnEdge,
}

/// From the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reply<'a> {
    /// Not carried out, and nothing changed.
    Refused(Refusal),
    /// Done.
    Done,
    /// Identity of the device.
    Identity(Identity),
    /// Its status.
    Status(Status),
    /// Settings in force.
    Config {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// What a tick gave.
    Stepped {
        /// Its cost, in the unit of [`Identity::counted`]; 0 if it was not counted.
        cost: u32,
        /// Digest of the machine after the tick.
        digest: u64,
        /// Output words of the machine.
        #[serde(borrow)]
        output: Bytes<'a>,
    },
    /// Cost of a stage.
    #[serde(borrow)]
    Stage(Stage<'a>),
    /// Status of the recorder.
    Recorder(RecorderStatus),
    /// A piece of something longer.
    Chunk {
        /// Index of its first byte.
        offset: u32,
        /// Length of the whole, bytes.
        total: u32,
        /// The piece; empty at or beyond the end.
        #[serde(borrow)]
        bytes: Bytes<'a>,
    },
    /// The device's health.
    Health(Health),
    /// Pose and set-point of the platform at the end of a tick.
    Place {
        /// Ticks since power-up.
        tick: u64,
        /// Number of `supervisor::Phase`.
        phase: u8,
        /// The controller's status word.
        status: u32,
        /// Time since the last valid gauge readings, which is the age of the pose, µs; none if there were none.
        measured: Option<u64>,
        /// The controller's `place_words`: measured pose, set-point, set-point in the user's coordinates, voltages of
        /// the legs.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Status of the player of passes.
    Pass(PassStatus),
    /// A block of samples.
    Samples {
        /// Its number; a gap in the numbers means lost blocks.
        number: u32,
        /// First tick of its first row.
        tick: u64,
        /// Ticks of each row.
        every: u32,
        /// Whether a complete block waits after it.
        more: bool,
        /// Its rows, for [`samples::rows`](crate::samples::rows); empty if there are none.
        #[serde(borrow)]
        rows: Bytes<'a>,
    },
    /// Status of the input line.
    Edge(EdgeStatus),
}

/// Reason why a request was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// This device does not support it.
    Unsupported,
    /// No session is open, or another one: send [`Request::Hello`].
    NoSession,
    /// Not the next sequence number: requests were lost, or two hosts are sending.
    Sequence,
    /// Another version of the protocol; the header of this reply has the device's.
    Version,
    /// A message that the device cannot read.
    Message,
    /// The number of words is not the controller's.
    Length {
        /// What it has.
        expected: u16,
    },
    /// A word is out of range.
    Word {
        /// Its index, counted from 0.
        index: u16,
    },
    /// Not in this state: send [`Request::Status`].
    State,
    /// The answer does not fit into a message.
    TooLong,
    /// Another host is in control, or too many requests are waiting. Hold, ramp-down and stop are accepted all the
    /// same.
    Busy,
    /// The samples exceed the capacity of the line.
    Rate {
        /// Least number of ticks per row.
        least: u32,
    },
}

/// Unit of the costs that a device reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CostUnit {
    /// Nothing.
    Nothing,
    /// Instructions.
    Instructions,
    /// Cycles of the core.
    Cycles,
}

/// Identity of the device. Numbers of words are those of the emitted controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Settings.
    pub config_words: u16,
    /// Inputs of the machine: those of a tick, then request and events.
    pub input_words: u16,
    /// Outputs of the machine: those of a tick, then those of the supervisor.
    pub output_words: u16,
    /// Number of counted stages, the whole tick included.
    pub stages: u8,
    /// In what.
    pub counted: CostUnit,
    /// Bytes of the controller's description.
    pub description: u32,
}

/// Status of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Status {
    /// Ticks since power-up.
    pub tick: u64,
    /// Number of `supervisor::Phase`.
    pub phase: u8,
    /// Number of `supervisor::Cause`.
    pub cause: u8,
    /// Word of a `supervisor::Finding`: of the wiring check, if that is the cause, or of the law's fallback stage;
    /// otherwise 0.
    pub finding: u16,
    /// Whether the amplifiers are enabled.
    pub amplifier_on: bool,
    /// The controller's status word.
    pub status: u32,
    /// Events since the last [`Request::Health`]. The status does not clear them.
    pub events: u32,
    /// Late ticks since power-up.
    pub late: u32,
    /// Age of this status since its tick, µs; none before the first tick.
    pub age: Option<u64>,
    /// Counters of the link; the endpoint fills them in.
    pub link: Counters,
}

/// Health of a device since power-up. Times are in counts of [`Health::clock`], the last and the longest; values that
/// are not measured are none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Health {
    /// Events since the host's last request.
    pub events: u32,
    /// Faults of converters, and each kind that occurred: bit `specgen_hal::Fault::number`.
    pub converter_faults: u32,
    /// See [`Health::converter_faults`]; 0 if the device does not distinguish kinds.
    pub faults: u32,
    /// Ticks in which a gauge was not finite, out of range, stuck, or in disagreement.
    pub gauge_faults: u32,
    /// Ticks that ended after the start time of the next one; none if time waits for the ticks.
    pub overruns: Option<u32>,
    /// Counts in a second.
    pub clock: u32,
    /// Duration of a tick.
    pub tick: Option<[u64; 2]>,
    /// Time from sampling the gauges to the change of the outputs.
    pub output: Option<[u64; 2]>,
    /// Largest delay of a tick's start.
    pub latest: Option<u64>,
    /// Peak use of the stack and its size, bytes.
    pub stack: Option<[u32; 2]>,
    /// Reset cause: bits of [`reset_cause`](crate::reset_cause); 0 if it is not known.
    pub reset_cause: u8,
}

/// Cost of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stage<'a> {
    /// Its name.
    pub name: &'a str,
    /// Calls counted.
    pub calls: u64,
    /// Least of a call.
    pub smallest: u64,
    /// All calls together.
    pub sum: u64,
    /// Most of a call.
    pub largest: u64,
    /// For the whole tick: peak stack, bytes; none if it is not measured.
    pub stack: Option<u32>,
}

/// Status of a recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecorderStatus {
    /// Whether it records.
    pub running: bool,
    /// Whether the trigger was seen.
    pub triggered: bool,
    /// Ticks that it holds.
    pub ticks: u32,
    /// Its capacity.
    pub capacity: u32,
}

/// Status of the input line, and of the command that waits for its edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct EdgeStatus {
    /// Number of the `pending::Stage` of the last command.
    pub stage: u8,
    /// Rising edges since power-up.
    pub edges: u32,
    /// Tick of the edge at which that command was begun or refused.
    pub tick: u64,
}

impl EdgeStatus {
    /// No edge seen, no command for one.
    pub const NONE: Self = Self { stage: 0, edges: 0, tick: 0 };
}

/// Status of a player of passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassStatus {
    /// Number of the `pass::Stage` of the last pass.
    pub stage: u8,
    /// Union of the controller's status bits in it.
    pub status: u32,
    /// Knots of its error.
    pub knots: u32,
    /// Most knots of a pass.
    pub capacity: u32,
}
