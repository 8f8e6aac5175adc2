//! The requests of the link: read and checked here, for boards and PCs alike; a [`Backend`] carries them out.

use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Request as Wanted};
use controller::{COMMAND_WORDS, CONFIG_WORDS, Config, DESCRIPTION, PLACE_WORDS, Real, passes, triggers};
use heapless::Vec;
use specgen_link::lockstep::piece;
use specgen_link::{
    Bytes, CostUnit, EdgeStatus, Health, Identity, KNOT, KNOTS, PassAction, PassStatus, RecorderAction, RecorderStatus,
    Refusal, Reply, Request, Status, WaveAction, put_words,
};
use specgen_runtime::pass::Player;
use specgen_runtime::playback::Knot;
use specgen_runtime::wave::{self, Settings};

use crate::samples;

/// Input words of the controller, without the measured ones.
pub type Command = [u64; COMMAND_WORDS];

/// Carries out the requests of hosts: a board, or the program of a PC.
pub trait Backend {
    /// Most bytes of a piece of the description.
    const PIECE: usize;

    /// A host sent a request.
    fn host_alive(&mut self);

    /// A host opens a session. On a board this ends what the last session requested. Returns the unit of the costs of its ticks.
    fn connect(&mut self) -> CostUnit;

    /// Its status; the counters of the link are left out.
    fn status(&mut self) -> Status;

    /// Its health; clears the events.
    fn health(&mut self) -> Health;

    /// The status after a tick, the time since the last valid gauge readings, µs, and the words of the pose.
    fn place(&mut self) -> (Status, Option<u64>, [u64; PLACE_WORDS]);

    /// Room for the words of an answer.
    fn buffer(&mut self) -> &mut [u8];

    /// Takes control for the host that sent the request, or refuses it. A board has only one host.
    fn authorise(&mut self) -> Result<(), Refusal> {
        Ok(())
    }

    /// The request to the supervisor from now on.
    fn supervise(&mut self, request: Wanted) -> Result<(), Refusal>;

    /// The command from the next tick on.
    fn command(&mut self, command: &Command) -> Result<(), Refusal>;

    /// The command from the tick after the edge on.
    fn command_on_edge(&mut self, command: &Command) -> Result<(), Refusal>;

    /// The status of the input line; drops the waiting command first if `drop` is set.
    fn edge(&mut self, drop: bool) -> Result<EdgeStatus, Refusal>;

    /// Words of the newest settings.
    fn settings(&mut self) -> [u64; CONFIG_WORDS];

    /// Settings from the next tick on.
    fn configure(&mut self, config: Config);

    /// Carries out an action of the recorder.
    fn recorder(&mut self, action: RecorderAction) -> Result<RecorderStatus, Refusal>;

    /// The record from this byte on.
    fn download(&mut self, offset: u32) -> Result<Reply<'_>, Refusal>;

    /// Starts a wave, at the edge of the input line or at once.
    fn start_wave(&mut self, settings: &Settings<Real>, on_edge: bool) -> Result<(), Refusal>;

    /// Stops the wave.
    fn stop_wave(&mut self) -> Result<(), Refusal>;

    /// Stores knots of the correction of passes, from this index on.
    fn put_knots(&mut self, first: u32, knots: &[Knot]) -> Result<(), Refusal>;

    /// Carries out an action of the player of passes.
    fn pass(&mut self, action: PassAction) -> Result<PassStatus, Refusal>;

    /// Some knots of the player, from this byte on.
    fn knots(
        &mut self,
        offset: u32,
        knots: impl for<'p> Fn(&'p Player<'static, Real>) -> &'p [Knot],
    ) -> Result<Reply<'_>, Refusal>;

    /// Starts samples in rows of `every` ticks; 0 stops them.
    fn stream(&mut self, every: u32) -> Result<(), Refusal>;

    /// The oldest block of samples.
    fn samples(&mut self) -> Reply<'_>;

    /// Carries out [`Request::Stop`] and the requests of lock-steps.
    fn other(&mut self, request: &Request<'_>) -> Reply<'_>;
}

/// Carries out a request on a backend.
pub fn execute<'b>(backend: &'b mut impl Backend, request: &Request<'_>) -> Reply<'b> {
    backend.host_alive();
    answer(backend, request).unwrap_or_else(Reply::Refused)
}

fn answer<'b, B: Backend>(backend: &'b mut B, request: &Request<'_>) -> Result<Reply<'b>, Refusal> {
    let done = |()| Reply::Done;
    match *request {
        Request::Hello => Ok(Reply::Identity(identity(backend.connect()))),
        Request::Describe { offset } => Ok(piece(DESCRIPTION.as_bytes(), offset, B::PIECE)),
        Request::Status => Ok(Reply::Status(backend.status())),
        Request::Health => Ok(Reply::Health(backend.health())),
        Request::Place => place(backend),
        Request::Supervise { request } => supervise(backend, request).map(done),
        Request::Setpoint { words } => command(backend, words, B::command).map(done),
        Request::SetpointOnEdge { .. } | Request::Edge { .. } if !triggers::INPUT => Err(Refusal::Unsupported),
        Request::SetpointOnEdge { words } => command(backend, words, B::command_on_edge).map(done),
        Request::Edge { drop } => backend.edge(drop).map(Reply::Edge),
        Request::ReadConfig => settings(backend),
        Request::WriteConfig { words } => configure(backend, words).map(done),
        Request::Recorder { action } => backend.recorder(action).map(Reply::Recorder),
        Request::Download { offset } => backend.download(offset),
        Request::Wave { action, words } => wave(backend, action, words).map(done),
        Request::Knots { .. } | Request::Pass { .. } | Request::Errors { .. } | Request::Correction { .. }
            if !passes::POSSIBLE =>
        {
            Err(Refusal::Unsupported)
        }
        Request::Knots { first, knots } => put_knots(backend, first, knots).map(done),
        Request::Pass { action } => backend.pass(action).map(Reply::Pass),
        Request::Errors { offset } => backend.knots(offset, Player::errors),
        Request::Correction { offset } => backend.knots(offset, Player::correction),
        Request::Stream { .. } | Request::Samples if !samples::POSSIBLE => Err(Refusal::Unsupported),
        Request::Stream { every } => backend.stream(every).map(done),
        Request::Samples => Ok(backend.samples()),
        Request::Stop
        | Request::LockstepReset { .. }
        | Request::LockstepStep { .. }
        | Request::LockstepStage { .. } => Ok(backend.other(request)),
    }
}

fn identity(counted: CostUnit) -> Identity {
    Identity {
        config_words: CONFIG_WORDS as u16,
        input_words: MACHINE_INPUT_WORDS as u16,
        output_words: MACHINE_OUTPUT_WORDS as u16,
        stages: u8::from(counted != CostUnit::Nothing),
        counted,
        description: DESCRIPTION.len() as u32,
    }
}

// Functions with large stack frames are not inlined: only one of them is then on the stack at a time, and none while the
// reply is written.

#[inline(never)]
fn place(backend: &mut impl Backend) -> Result<Reply<'_>, Refusal> {
    let (Status { tick, phase, status, .. }, measured, words) = backend.place();
    match put_words(&words, backend.buffer()) {
        Some(words) if PLACE_WORDS > 0 => Ok(Reply::Place { tick, phase, status, measured, words }),
        _ => Err(Refusal::Unsupported),
    }
}

fn supervise(backend: &mut impl Backend, request: u8) -> Result<(), Refusal> {
    let wanted = Wanted::from_word(u64::from(request));
    if wanted.word() == u64::from(request) { backend.supervise(wanted) } else { Err(Refusal::Word { index: 0 }) }
}

#[inline(never)]
fn command<B: Backend>(
    backend: &mut B,
    words: Bytes<'_>,
    set: impl Fn(&mut B, &Command) -> Result<(), Refusal>,
) -> Result<(), Refusal> {
    backend.authorise()?;
    let mut command = [0; COMMAND_WORDS];
    read(words, &mut command)?;
    set(backend, &command)
}

#[inline(never)]
fn settings(backend: &mut impl Backend) -> Result<Reply<'_>, Refusal> {
    let words = backend.settings();
    put_words(&words, backend.buffer()).map(|words| Reply::Config { words }).ok_or(Refusal::TooLong)
}

#[inline(never)]
fn configure(backend: &mut impl Backend, words: Bytes<'_>) -> Result<(), Refusal> {
    backend.authorise()?;
    let mut row = [0; CONFIG_WORDS];
    read(words, &mut row)?;
    let config = Config::from_words(&row).map_err(|error| Refusal::Word { index: error.word as u16 })?;
    backend.configure(config);
    Ok(())
}

fn wave(backend: &mut impl Backend, action: WaveAction, words: Bytes<'_>) -> Result<(), Refusal> {
    backend.authorise()?;
    match action {
        WaveAction::Stop => backend.stop_wave(),
        WaveAction::StartOnEdge if !triggers::INPUT => Err(Refusal::Unsupported),
        WaveAction::Start | WaveAction::StartOnEdge => {
            backend.start_wave(&wave_settings(words)?, action == WaveAction::StartOnEdge)
        }
    }
}

/// The settings of a wave; their words are released before the wave is built.
#[inline(never)]
fn wave_settings(words: Bytes<'_>) -> Result<Settings<Real>, Refusal> {
    let mut row = [0; wave::WORDS];
    read(words, &mut row)?;
    Settings::from_words(&row).map_err(wave_refusal)
}

#[inline(never)]
fn put_knots(backend: &mut impl Backend, first: u32, knots: Bytes<'_>) -> Result<(), Refusal> {
    backend.authorise()?;
    // Not [`Refusal::Message`]: the sequence number of an unreadable message is used again.
    let whole = Refusal::Length { expected: (KNOTS * KNOT / size_of::<u64>()) as u16 };
    let mut taken = Vec::<Knot, KNOTS>::new();
    for knot in knots.knots().ok_or(whole)? {
        taken.push(knot).map_err(|_| whole)?;
    }
    backend.put_knots(first, &taken)
}

/// Fills `row`, if there are as many words.
fn read(words: Bytes<'_>, row: &mut [u64]) -> Result<(), Refusal> {
    if words.read_words(row) { Ok(()) } else { Err(Refusal::Length { expected: row.len() as u16 }) }
}

/// The link's code for the refusal of a wave.
#[must_use]
pub fn wave_refusal(refused: wave::Refusal) -> Refusal {
    refused.word().map_or(Refusal::State, |index| Refusal::Word { index: index as u16 })
}

/// Status of a player of passes.
#[must_use]
pub fn pass_status(player: &Player<'_, Real>) -> PassStatus {
    PassStatus {
        stage: player.stage().word(),
        status: player.status(),
        knots: player.errors().len() as u32,
        capacity: player.capacity() as u32,
    }
}
