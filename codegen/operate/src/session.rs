//! A session with a device: its description, its state, and requests to it.

use std::time::{Duration, Instant};

use host_sim::controller::MachineWord;
use host_sim::description::Description;
use specgen_link::client::{Client, ClientError, Port, Timeout};
use specgen_link::{
    EdgeStatus, Health, Identity, KNOT, KNOTS, PassAction, PassStatus, RecorderAction, RecorderStatus, Reply, Request,
    Status, WORDS, WaveAction, put_words,
};
use specgen_runtime::playback::Knot;
use specgen_runtime::supervisor;

use crate::motion::Motion;
use crate::pil::{self, OpenError, OpenSession};
use crate::wave::WaveWords;

/// Interval of requests to a device. It treats the link as lost after five times this interval.
pub const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// How long a board may take to write the end of a record.
const RECORD_END: Duration = Duration::from_secs(5);

/// Largest age of a current state.
pub const MAX_AGE: Duration = Duration::from_millis(300);

/// Status bits of gauges whose reading failed or is implausible.
pub const GAUGES: u32 = 0x3f00;

/// Names of the values of a platform's word `command`.
const COMMANDS: [&str; 5] = ["hold", "stream", "move", "trajectory", "drive"];

/// Number of words of a pose.
const POSE: usize = 6;

/// The content of a reply of the expected kind, or [`ClientError::Unexpected`].
macro_rules! expect {
    ($reply:expr, $kind:pat => $content:expr) => {
        match $reply {
            $kind => Ok($content),
            _ => Err(ClientError::Unexpected),
        }
    };
}

/// Pose, set-point and voltages of a platform; m and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPose {
    /// Ticks since power-up.
    pub tick: u64,
    /// Number of `supervisor::Phase`.
    pub phase: u8,
    /// The controller's status word.
    pub status: u32,
    /// Last measured pose, in the user's coordinates; see [`MeasuredPose::measured`].
    pub pose: [f64; 6],
    /// Age of that pose; none if no pose was ever measured, and `pose` is meaningless.
    pub measured: Option<Duration>,
    /// Current set-point, in the user's coordinates; not the destination of a motion.
    pub target: [f64; 6],
    /// Voltage of each leg, V.
    pub voltage: [f64; 6],
}

impl MeasuredPose {
    /// Whether the pose is current: the gauges were read and plausible in the last tick, which is recent.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.status & GAUGES == 0 && self.measured.is_some_and(|age| age < MAX_AGE)
    }
}

/// An open session.
pub struct Session<P> {
    client: Client<P>,
    identity: Identity,
    description: Description,
    period: f64,
    /// None for a controller of six legs.
    motion: Option<Motion>,
    /// Input words that were sent last, without measurements.
    command: Vec<u64>,
    last_request: Instant,
    status: Status,
}

impl<P: Port> Session<P> {
    /// Opens a session and reads the device's description. With a `digest`, the device must run the controller of that spec.
    ///
    /// # Errors
    /// The device does not answer, or runs another controller.
    pub fn open(port: P, timeout: Timeout, digest: Option<&str>) -> Result<Self, OpenError> {
        let OpenSession { client, identity, text, description } = pil::open(port, timeout)?;
        if digest.is_some_and(|digest| digest != description.digest) {
            let (name, theirs, ours) = (&description.name, &description.digest, digest.unwrap_or_default());
            return Err(OpenError::Other(format!(
                "the device runs the controller `{name}` of spec digest {theirs}; the spec gives {ours}: name the spec that it was built from, \
                 or build and flash it from this one"
            )));
        }
        let period = text.lines().find_map(|line| line.strip_prefix("period=")).and_then(|text| text.parse().ok());
        let period = period.filter(|period| *period > 0.0 && f64::is_finite(*period)).ok_or_else(|| {
            OpenError::Other("the controller's description lacks `period`: build and flash it with this specgen".into())
        })?;
        let motion = Motion::parse(&text).map_err(OpenError::Other)?;
        let measured = |name: &String| name.starts_with("gauge[") || name.starts_with("displacement[");
        let words = description.input_names.iter().position(measured).unwrap_or(description.input_names.len());
        let mut session = Self {
            client,
            identity,
            description,
            period,
            motion,
            command: vec![0; words],
            last_request: Instant::now(),
            status: Status::default(),
        };
        session.poll()?;
        Ok(session)
    }

    /// The controller's description.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Control period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Workspace and coordinates of the platform; none for six legs.
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }

    /// Whether two numbers are equal in the scalar type of the controller.
    pub fn is_same(&self, a: f64, b: f64) -> bool {
        let scalar = self.description.scalar;
        scalar.decode(scalar.encode(a)) == scalar.decode(scalar.encode(b))
    }

    /// The last status.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Phase and cause as text. `alike` are sets of faults that the wiring check cannot distinguish on this geometry.
    #[must_use]
    pub fn state(&self, alike: &[Vec<u32>]) -> String {
        let Status { phase, cause, finding, amplifier_on, .. } = self.status;
        MachineWord { phase, cause, amplifier_on, finding: u32::from(finding) }.among(alike)
    }

    /// Number of damaged frames from the device.
    pub fn damaged(&self) -> u32 {
        self.client.damaged()
    }

    /// Updates the status; also a heartbeat. Events stay until [`Session::health`] is called.
    ///
    /// # Errors
    /// As [`Client::ask`], here and below.
    pub fn poll(&mut self) -> Result<&Status, ClientError> {
        self.status = expect!(self.client.ask(&Request::Status)?, Reply::Status(status) => status)?;
        self.last_request = Instant::now();
        self.forget(self.status.phase);
        Ok(&self.status)
    }

    /// Pose of the platform; none for six legs. Also a heartbeat.
    pub fn place(&mut self) -> Result<Option<MeasuredPose>, ClientError> {
        let Some(motion) = &self.motion else { return Ok(None) };
        let Reply::Place { tick, phase, status, measured, words } = self.client.ask(&Request::Place)? else {
            return Err(ClientError::Unexpected);
        };
        self.last_request = Instant::now();
        let mut numbers = [0.0; 4 * POSE];
        let given = words.words(numbers.len()).ok_or(ClientError::Unexpected)?;
        for (number, word) in numbers.iter_mut().zip(given) {
            *number = self.description.scalar.decode(word);
        }
        let six = |first: usize| -> [f64; POSE] { core::array::from_fn(|axis| numbers[first + axis]) };
        let (shown, target) = (six(0), six(2 * POSE));
        let pose = motion.user(&shown).unwrap_or(shown);
        let measured = measured.map(Duration::from_micros);
        self.forget(phase);
        Ok(Some(MeasuredPose { tick, phase, status, pose, measured, target, voltage: six(3 * POSE) }))
    }

    /// Resets the command words unless the machine follows commands: in any other phase it has discarded its command.
    fn forget(&mut self, phase: u8) {
        let phase = supervisor::Phase::from_word(u64::from(phase));
        if !phase.is_some_and(supervisor::Phase::is_commanded) {
            self.command.fill(0);
        }
    }

    /// Health of the device; this clears its events.
    pub fn health(&mut self) -> Result<Health, ClientError> {
        expect!(self.client.ask(&Request::Health)?, Reply::Health(health) => health)
    }

    /// Time since the last request.
    pub fn silence(&self) -> Duration {
        self.last_request.elapsed()
    }

    /// Time until the next request is due.
    pub fn due(&self) -> Duration {
        POLL_INTERVAL.saturating_sub(self.last_request.elapsed())
    }

    /// Requests a block of samples; also a heartbeat.
    pub(crate) fn ask_for_samples(&mut self) -> Result<(Option<&Motion>, Reply<'_>), ClientError> {
        self.last_request = Instant::now();
        Ok((self.motion.as_ref(), self.client.ask(&Request::Samples)?))
    }

    /// Sends a request whose only answer is that it was done.
    pub(crate) fn done(&mut self, request: &Request<'_>) -> Result<(), ClientError> {
        expect!(self.client.ask(request)?, Reply::Done => ())
    }

    /// Sends a request to the supervisor; it stays in effect until the next one.
    pub fn supervise(&mut self, request: supervisor::Request) -> Result<(), ClientError> {
        self.done(&Request::Supervise { request: request.word() as u8 })
    }

    /// Asks the program that serves the link to ramp down and exit. Until then it continues to answer.
    pub fn stop(&mut self) -> Result<(), ClientError> {
        self.done(&Request::Stop)
    }

    /// Names of the input words that a host may set: all but measurements.
    pub fn free_names(&self) -> &[String] {
        self.description.input_names.get(..self.command.len()).unwrap_or_default()
    }

    /// The present command words with these assignments, not yet sent.
    ///
    /// # Errors
    /// A name cannot be set, or its word cannot hold the value.
    pub fn assign(&self, assignments: &[(String, String)]) -> Result<Vec<u64>, String> {
        let mut words = self.command.clone();
        for (name, value) in assignments {
            let place = self.free_names().iter().position(|known| known == name);
            let slot = place
                .and_then(|place| words.get_mut(place))
                .ok_or_else(|| format!("`{name}` cannot be set; these can: {}", self.free_names().join(", ")))?;
            let known = COMMANDS.iter().position(|known| name == "command" && known == value);
            let number =
                known.map(|place| place as f64).or_else(|| value.parse().ok()).filter(|number| number.is_finite());
            let number = number.ok_or_else(|| match name.as_str() {
                "command" => format!("`command`: expected {}, found `{value}`", COMMANDS.join(", ")),
                _ => format!("`{name}`: expected a finite number, found `{value}`"),
            })?;
            *slot = self.description.encode(name, number).map_err(|error| error.to_string())?;
        }
        Ok(words)
    }

    /// Sends all words of a command, see [`Session::assign`].
    pub fn command(&mut self, words: Vec<u64>) -> Result<(), ClientError> {
        let mut bytes = [0; WORDS * size_of::<u64>()];
        let put = put_words(&words, &mut bytes).ok_or(ClientError::TooLong)?;
        self.done(&Request::Setpoint { words: put })?;
        self.command = words;
        Ok(())
    }

    /// Queues a command for the next rising edge of the input line.
    pub fn command_on_edge(&mut self, words: &[u64]) -> Result<(), ClientError> {
        let mut bytes = [0; WORDS * size_of::<u64>()];
        let words = put_words(words, &mut bytes).ok_or(ClientError::TooLong)?;
        self.done(&Request::SetpointOnEdge { words })
    }

    /// State of the input line for triggered commands. With `drop`, the waiting command is cancelled first.
    pub fn edge(&mut self, drop: bool) -> Result<EdgeStatus, ClientError> {
        expect!(self.client.ask(&Request::Edge { drop })?, Reply::Edge(status) => status)
    }

    /// Words of a move to `pose`, m and rad.
    ///
    /// # Errors
    /// As [`Session::assign`]: a controller of six legs has no moves.
    pub fn move_words(&self, pose: &[f64; 6]) -> Result<Vec<u64>, String> {
        let axes = pose.iter().enumerate().map(|(axis, value)| (format!("setpoint[{axis}]"), format!("{value:?}")));
        let command = ("command".to_owned(), "move".to_owned());
        self.assign(&std::iter::once(command).chain(axes).collect::<Vec<_>>())
    }

    /// The settings in force.
    pub fn config(&mut self) -> Result<Vec<u64>, ClientError> {
        let count = usize::from(self.identity.config_words);
        let words = expect!(self.client.ask(&Request::ReadConfig)?, Reply::Config { words } => words)?;
        words.words(count).map(Iterator::collect).ok_or(ClientError::Unexpected)
    }

    /// Replaces all settings at once.
    pub fn write_config(&mut self, words: &[u64]) -> Result<(), ClientError> {
        let mut bytes = [0; WORDS * size_of::<u64>()];
        let words = put_words(words, &mut bytes).ok_or(ClientError::TooLong)?;
        self.done(&Request::WriteConfig { words })
    }

    /// Performs a recorder action and returns the state after it. A board writes the end of a record in its idle time; after a stop
    /// this waits until that is done.
    pub fn recorder(&mut self, action: RecorderAction) -> Result<RecorderStatus, ClientError> {
        let start = Instant::now();
        let mut status = self.recorder_status(action)?;
        while action == RecorderAction::Stop && status.running && start.elapsed() < RECORD_END {
            std::thread::sleep(POLL_INTERVAL);
            status = self.recorder_status(RecorderAction::Look)?;
        }
        Ok(status)
    }

    fn recorder_status(&mut self, action: RecorderAction) -> Result<RecorderStatus, ClientError> {
        self.last_request = Instant::now();
        expect!(self.client.ask(&Request::Recorder { action })?, Reply::Recorder(status) => status)
    }

    /// Appends the next part of the record, and returns whether it is complete. Also a heartbeat.
    pub fn download_part(&mut self, whole: &mut Vec<u8>) -> Result<bool, ClientError> {
        let complete = self.client.fetch_on(|offset| Request::Download { offset }, whole)?;
        self.last_request = Instant::now();
        Ok(complete)
    }

    /// Sends knots of a correction, starting at index `first`. Rows of a learning plan follow the knots.
    pub fn put_knots(&mut self, first: usize, knots: &[Knot]) -> Result<(), ClientError> {
        let mut buffer = [0; KNOTS * KNOT];
        for (index, part) in knots.chunks(KNOTS).enumerate() {
            let bytes = specgen_link::Bytes(specgen_link::put_knots(part, 0, &mut buffer));
            self.done(&Request::Knots { first: (first + index * KNOTS) as u32, knots: bytes })?;
            self.last_request = Instant::now();
        }
        Ok(())
    }

    /// Performs an action of the pass player and returns the state after it.
    pub fn pass(&mut self, action: PassAction) -> Result<PassStatus, ClientError> {
        expect!(self.client.ask(&Request::Pass { action })?, Reply::Pass(status) => status)
    }

    /// The error recorded by the last pass.
    pub fn errors(&mut self) -> Result<Vec<Knot>, ClientError> {
        let bytes = self.client.fetch(|offset| Request::Errors { offset })?;
        Ok(specgen_link::Bytes(&bytes).knots().ok_or(ClientError::Unexpected)?.collect())
    }

    /// The correction that the device has computed for the next pass.
    pub fn correction(&mut self) -> Result<Vec<Knot>, ClientError> {
        let bytes = self.client.fetch(|offset| Request::Correction { offset })?;
        Ok(specgen_link::Bytes(&bytes).knots().ok_or(ClientError::Unexpected)?.collect())
    }

    /// Starts a wave, at once or at the next rising edge of the input line. Its center, where it ends, becomes the set-point.
    pub fn start_wave(&mut self, wave: &WaveWords, on_edge: bool) -> Result<(), ClientError> {
        let bytes: Vec<u8> = wave.words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let action = if on_edge { WaveAction::StartOnEdge } else { WaveAction::Start };
        self.done(&Request::Wave { action, words: specgen_link::Bytes(&bytes) })?;
        let first = self.free_names().iter().position(|name| name == "setpoint[0]").unwrap_or_default();
        for (slot, word) in self.command.iter_mut().skip(first).zip(&wave.center) {
            *slot = *word;
        }
        Ok(())
    }

    /// Ends the running wave smoothly.
    pub fn stop_wave(&mut self) -> Result<(), ClientError> {
        self.done(&Request::Wave { action: WaveAction::Stop, words: specgen_link::Bytes(&[]) })
    }
}
