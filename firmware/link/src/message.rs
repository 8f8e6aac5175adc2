//! What host and device say to each other. The order of the variants is the format: new ones go to the end, and a change
//! of an old one is another [`VERSION`](crate::VERSION).

use serde::{Deserialize, Serialize};

use crate::bytes::Bytes;
use crate::counters::Counters;

/// From the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Opens a session. Answered by [`Reply::Identity`]; nothing else is answered before it.
    Hello,
    /// The controller's own description from this byte on. Answered by [`Reply::Chunk`].
    Describe {
        /// First byte wanted.
        offset: u32,
    },
    /// Answered by [`Reply::Status`].
    Status,
    /// What the supervisor is asked for from now on: the number of `supervisor::Request`. It holds as long as the link
    /// does. Answered by [`Reply::Done`].
    Supervise {
        /// 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge.
        request: u8,
    },
    /// What the controller is asked for from the next tick on: the input words that are no measurements, in their order.
    /// Answered by [`Reply::Done`].
    Setpoint {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Answered by [`Reply::Config`].
    ReadConfig,
    /// Settings, all at once, from the next tick on. Answered by [`Reply::Done`], or [`Refusal::Word`] and nothing changed.
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
    /// Lock-step: what a stage has cost since the device started. Answered by [`Reply::Stage`].
    LockstepStage {
        /// Number of the stage; the first is the whole tick.
        index: u8,
    },
    /// Answered by [`Reply::Recorder`].
    Recorder {
        /// What the recorder is to do.
        action: RecorderAction,
    },
    /// The record, as the bytes of its file, from this one on. Answered by [`Reply::Chunk`].
    Download {
        /// First byte wanted.
        offset: u32,
    },
    /// Answered by [`Reply::Done`].
    Wave {
        /// What the wave generator is to do.
        action: WaveAction,
        /// Words of its settings, for [`WaveAction::Start`] and [`WaveAction::StartOnEdge`].
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Ramp down, then end the program that serves the link. A board has no such end: [`Refusal::Unsupported`]. Answered by
    /// [`Reply::Done`], whoever asks; the connection is closed once the amplifiers are off.
    Stop,
    /// Answered by [`Reply::Health`]; its events are then forgotten, and those of [`Reply::Status`] with them.
    Health,
    /// Where the platform is. Six legs know of none: [`Refusal::Unsupported`]. Answered by [`Reply::Place`].
    Place,
    /// Knots of the correction of passes, from this one on. Answered by [`Reply::Done`], or [`Refusal::Word`] where there is no room.
    Knots {
        /// Number of the first.
        first: u32,
        /// Knots: x, y, z in pm, θx, θy, θz in prad, 32 bits each.
        #[serde(borrow)]
        knots: Bytes<'a>,
    },
    /// Answered by [`Reply::Pass`].
    Pass {
        /// What the player of passes is to do.
        action: PassAction,
    },
    /// What the last pass kept of the error, as the bytes of its knots, from this byte on. Answered by [`Reply::Chunk`].
    Errors {
        /// First byte wanted.
        offset: u32,
    },
    /// Samples for this host from the next tick on, none with 0: see [`samples`](crate::samples). Answered by [`Reply::Done`], or
    /// [`Refusal::Rate`] where the line or the device has no room for so many.
    Stream {
        /// Ticks of a row.
        every: u32,
    },
    /// The oldest block of samples that was not fetched. Answered by [`Reply::Samples`].
    Samples,
    /// The correction that the next pass plays, as the bytes of its knots, from this byte on. Answered by [`Reply::Chunk`].
    Correction {
        /// First byte wanted.
        offset: u32,
    },
    /// As [`Request::Setpoint`], from the tick after the rising edge of the input line on. One order waits, the last one; any that is in force
    /// at once drops it. The machine runs, at rest then and at the edge. Answered by [`Reply::Done`].
    SetpointOnEdge {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// Answered by [`Reply::Edge`].
    Edge {
        /// Drop what waits, before the answer.
        drop: bool,
    },
}

/// What a player of passes is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PassAction {
    /// Only say how it stands.
    Look,
    /// Begin with the next tick, under the correction of the knots that were sent. The machine runs, at rest.
    Begin {
        /// Ticks from knot to knot.
        spacing: u32,
        /// Ticks of rest before the trajectory.
        before: u32,
        /// Ticks in all.
        ticks: u32,
        /// Number of the trajectory.
        trajectory: u32,
    },
    /// End it at once; the correction fades out, the trajectory goes on.
    Abort,
    /// Make the correction of the next pass, in the background, of the one that came to its end, with the plan that was sent behind its knots.
    Learn {
        /// Knots that the plan reaches to both sides.
        reach: u32,
        /// Knots over which the correction fades in and out.
        fade: [u32; 2],
    },
}

/// What a recorder is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RecorderAction {
    /// Only say how it stands.
    Look,
    /// Forget what there is and record anew, until so many ticks after the trigger.
    Arm {
        /// Ticks after the trigger.
        after: u32,
    },
    /// Trigger now.
    Trigger,
    /// Stop at once; what there is stays.
    Stop,
}

/// What a wave generator is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum WaveAction {
    /// Start the wave of the words.
    Start,
    /// Come to rest.
    Stop,
    /// As [`WaveAction::Start`], but begin as [`Request::SetpointOnEdge`] says.
    StartOnEdge,
}

/// From the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reply<'a> {
    /// Not done, and nothing changed.
    Refused(Refusal),
    /// Done.
    Done,
    /// Who is there.
    Identity(Identity),
    /// How it stands.
    Status(Status),
    /// Settings in force.
    Config {
        /// The words.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// What a tick gave.
    Stepped {
        /// What it cost, in the unit of [`Identity::counted`]; 0 if it was not counted.
        cost: u32,
        /// Digest of the machine after the tick.
        digest: u64,
        /// Output words of the machine.
        #[serde(borrow)]
        output: Bytes<'a>,
    },
    /// What a stage has cost.
    #[serde(borrow)]
    Stage(Stage<'a>),
    /// How the recorder stands.
    Recorder(RecorderStatus),
    /// A piece of something longer.
    Chunk {
        /// Place of its first byte.
        offset: u32,
        /// Length of the whole, bytes.
        total: u32,
        /// The piece; empty at or beyond the end.
        #[serde(borrow)]
        bytes: Bytes<'a>,
    },
    /// What it noticed of itself.
    Health(Health),
    /// Where the platform was at the end of a tick.
    Place {
        /// Ticks since power-up.
        tick: u64,
        /// Number of `supervisor::Phase`.
        phase: u8,
        /// The controller's status word.
        status: u32,
        /// Since the gauges were last read and believed, which is when the pose was measured, µs; none if they never were.
        measured: Option<u64>,
        /// The controller's `place_words`: pose measured, set-point, set-point in the user's coordinates, voltages of the legs.
        #[serde(borrow)]
        words: Bytes<'a>,
    },
    /// How the player of passes stands.
    Pass(PassStatus),
    /// A block of samples.
    Samples {
        /// Its number; what is missing before it was given up.
        number: u32,
        /// First tick of its first row.
        tick: u64,
        /// Ticks of each row.
        every: u32,
        /// Whether a whole block waits behind it.
        more: bool,
        /// Its rows, for [`samples::rows`](crate::samples::rows); empty where there is none.
        #[serde(borrow)]
        rows: Bytes<'a>,
    },
    /// How it stands with the input line.
    Edge(EdgeStatus),
}

/// Why a request was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// This device does not do that.
    Unsupported,
    /// No session is open, or another one: say [`Request::Hello`].
    NoSession,
    /// Not the next sequence number: requests were lost, or two hosts talk at once.
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
    /// A word is out of its range.
    Word {
        /// Its place, counted from 0.
        index: u16,
    },
    /// Not in this state: say [`Request::Status`].
    State,
    /// The answer does not fit into a message.
    TooLong,
    /// Another host has the orders, or there are more of them than are carried out: hold, ramp-down and stop are taken all the same.
    Busy,
    /// Samples more often than there is room for.
    Rate {
        /// Ticks of a row at least.
        least: u32,
    },
}

/// What a device counts where it says what something cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CostUnit {
    /// Nothing.
    Nothing,
    /// Instructions.
    Instructions,
    /// Cycles of the core.
    Cycles,
}

/// Who is there. Numbers of words are those of the emitted controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Settings.
    pub config_words: u16,
    /// Inputs of the machine: those of a tick, then request and events.
    pub input_words: u16,
    /// Outputs of the machine: those of a tick, then what the supervisor says.
    pub output_words: u16,
    /// Stages that are counted, the whole tick included.
    pub stages: u8,
    /// In what.
    pub counted: CostUnit,
    /// Bytes of the controller's description.
    pub description: u32,
}

/// How a device stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Ticks since power-up.
    pub tick: u64,
    /// Number of `supervisor::Phase`.
    pub phase: u8,
    /// Number of `supervisor::Cause`.
    pub cause: u8,
    /// Word of what the wiring check found, if that is the cause, or of what the law has fallen back to, a `supervisor::Finding`; else 0.
    pub finding: u16,
    /// Whether the amplifiers are enabled.
    pub amplifier_on: bool,
    /// The controller's status word.
    pub status: u32,
    /// Events seen since the host asked for [`Request::Health`] last. The status does not forget them.
    pub events: u32,
    /// Ticks that came late since power-up.
    pub late: u32,
    /// Since the tick that all of this is of, µs; none before the first.
    pub age: Option<u64>,
    /// What the link has counted; filled in by the endpoint.
    pub link: Counters,
}

/// What a device noticed of itself since power-up. Times are in counts of [`Health::clock`], the last one and the longest; what is not measured is
/// none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Health {
    /// Events seen since the host asked last.
    pub events: u32,
    /// Faults of converters, and each kind that there was: bit `specgen_hal::Fault::number`.
    pub converter_faults: u32,
    /// See [`Health::converter_faults`]; 0 where kinds are not told apart.
    pub faults: u32,
    /// Ticks in which a gauge was not finite, out of range, stuck, or in disagreement.
    pub gauge_faults: u32,
    /// Ticks that ended after the next one was due; none where time waits for them.
    pub overruns: Option<u32>,
    /// Counts in a second.
    pub clock: u32,
    /// A tick, from its beginning to its end.
    pub tick: Option<[u64; 2]>,
    /// From the sampling of the gauges until the outputs changed.
    pub output: Option<[u64; 2]>,
    /// Largest delay of a tick's beginning.
    pub latest: Option<u64>,
    /// Most bytes of the stack seen in use, and bytes there are.
    pub stack: Option<[u32; 2]>,
    /// Why its program began: bits of [`reset_cause`](crate::reset_cause); 0 where that is not known.
    pub reset_cause: u8,
}

/// What a stage has cost.
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
    /// For the whole tick: most stack seen in use, bytes; none where that is not measured.
    pub stack: Option<u32>,
}

/// How a recorder stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecorderStatus {
    /// Whether it records.
    pub running: bool,
    /// Whether the trigger was seen.
    pub triggered: bool,
    /// Ticks that it holds.
    pub ticks: u32,
    /// Most that it can hold.
    pub capacity: u32,
}

/// How it stands with the input line, and with what waits for its edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct EdgeStatus {
    /// Number of the `pending::Stage` of the last order.
    pub stage: u8,
    /// Rising edges since power-up.
    pub edges: u32,
    /// Tick of the edge at which that order began or was refused.
    pub tick: u64,
}

impl EdgeStatus {
    /// No edge seen, nothing ordered for one.
    pub const NONE: Self = Self { stage: 0, edges: 0, tick: 0 };
}

/// How a player of passes stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassStatus {
    /// Number of the `pass::Stage` of the last one.
    pub stage: u8,
    /// All status bits that the controller gave in it.
    pub status: u32,
    /// Knots of its error.
    pub knots: u32,
    /// Most knots of a pass.
    pub capacity: u32,
}
