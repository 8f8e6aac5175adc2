//! A session with a device: what it runs, how it stands, and what is asked of it.

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

/// How often a device gets a request, at least: five times before it takes the link for lost.
pub const ALIVE: Duration = Duration::from_millis(20);
/// What a board may take to write the end of a record.
const RECORD_END: Duration = Duration::from_secs(5);

/// What is older than this is not said to be so now.
pub const FRESH: Duration = Duration::from_millis(300);

/// Status bits of gauges that were not read or not believed.
pub const GAUGES: u32 = 0x3f00;

/// Names of the word `command` of a platform, by its value.
const COMMANDS: [&str; 4] = ["hold", "stream", "move", "trajectory"];

/// Words of a pose.
const POSE: usize = 6;

/// Where a platform is, m and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Ticks since power-up.
    pub tick: u64,
    /// Number of `supervisor::Phase`.
    pub phase: u8,
    /// The controller's status word.
    pub status: u32,
    /// Pose measured, in the user's coordinates; see [`Place::measured`].
    pub pose: [f64; 6],
    /// Since that pose was measured; none if none ever was, and the pose says nothing.
    pub measured: Option<Duration>,
    /// Set-point, in the user's coordinates: where the platform is to be now, not where a motion ends.
    pub target: [f64; 6],
    /// Voltage of each leg, V.
    pub voltage: [f64; 6],
}

impl Place {
    /// Whether the pose is that of now: the gauges were read and believed in the last tick, and that was not long ago.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.status & GAUGES == 0 && self.measured.is_some_and(|age| age < FRESH)
    }
}

/// An open session.
pub struct Session<P> {
    client: Client<P>,
    identity: Identity,
    description: Description,
    period: f64,
    /// Of a platform.
    motion: Option<Motion>,
    /// Input words that are no measurements, as they were sent last.
    command: Vec<u64>,
    asked: Instant,
    status: Status,
}

impl<P: Port> Session<P> {
    /// Opens a session and asks who is there. With a `digest` only the controller of that spec will do.
    ///
    /// # Errors
    /// No answer, or another controller.
    pub fn open(port: P, timeout: Timeout, digest: Option<&str>) -> Result<Self, OpenError> {
        let OpenSession { client, identity, text, description } = pil::open(port, timeout)?;
        if digest.is_some_and(|digest| digest != description.digest) {
            return Err(OpenError::Other(format!(
                "the device runs the controller `{}` of spec digest {}; the spec gives {}: name the spec that it was built from, \
                 or build and flash it from this one",
                description.name,
                description.digest,
                digest.unwrap_or_default()
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
            asked: Instant::now(),
            status: Status {
                tick: 0,
                phase: 0,
                cause: 0,
                finding: 0,
                amplifier_on: false,
                status: 0,
                events: 0,
                late: 0,
                age: None,
                link: specgen_link::Counters::NONE,
            },
        };
        session.poll()?;
        Ok(session)
    }

    /// What the controller says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Control period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Where the platform may go, by its controller; none of six legs.
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }

    /// Whether two numbers are the same to the controller, whose numbers may be of 32 bits.
    pub fn is_same(&self, a: f64, b: f64) -> bool {
        let scalar = self.description.scalar;
        scalar.decode(scalar.encode(a)) == scalar.decode(scalar.encode(b))
    }

    /// What it said last.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Phase and cause, with what looks like the finding of a wiring check on a geometry with these sets of faults.
    #[must_use]
    pub fn stands(&self, alike: &[Vec<u32>]) -> String {
        let Status { phase, cause, finding, amplifier_on, .. } = self.status;
        MachineWord { phase, cause, amplifier_on, finding: u32::from(finding) }.among(alike)
    }

    /// Frames from the device that came damaged.
    pub fn damaged(&self) -> u32 {
        self.client.damaged()
    }

    /// How it stands, and that the host is there. Events stay until [`Session::health`] is asked for.
    ///
    /// # Errors
    /// As [`Client::ask`], here and below.
    pub fn poll(&mut self) -> Result<&Status, ClientError> {
        match self.client.ask(&Request::Status)? {
            Reply::Status(status) => {
                self.status = status;
                self.asked = Instant::now();
                self.forget(status.phase);
                Ok(&self.status)
            }
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Where the platform is, and that the host is there; none of six legs.
    pub fn place(&mut self) -> Result<Option<Place>, ClientError> {
        let Some(motion) = &self.motion else { return Ok(None) };
        let Reply::Place { tick, phase, status, measured, words } = self.client.ask(&Request::Place)? else {
            return Err(ClientError::Unexpected);
        };
        self.asked = Instant::now();
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
        Ok(Some(Place { tick, phase, status, pose, measured, target, voltage: six(3 * POSE) }))
    }

    /// A machine that does not run has forgotten what it was commanded.
    fn forget(&mut self, phase: u8) {
        if u64::from(phase) != supervisor::Phase::Running.word() {
            self.command.fill(0);
        }
    }

    /// What the device noticed of itself; its events are forgotten with that.
    pub fn health(&mut self) -> Result<Health, ClientError> {
        match self.client.ask(&Request::Health)? {
            Reply::Health(health) => Ok(health),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Time since the device was asked last.
    pub fn silence(&self) -> Duration {
        self.asked.elapsed()
    }

    /// Time until the device must get the next request.
    pub fn due(&self) -> Duration {
        ALIVE.saturating_sub(self.asked.elapsed())
    }

    /// Asks for a block of samples, and that the host is there.
    pub(crate) fn ask_for_samples(&mut self) -> Result<(Option<&Motion>, Reply<'_>), ClientError> {
        self.asked = Instant::now();
        Ok((self.motion.as_ref(), self.client.ask(&Request::Samples)?))
    }

    pub(crate) fn done(&mut self, request: &Request<'_>) -> Result<(), ClientError> {
        match self.client.ask(request)? {
            Reply::Done => Ok(()),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Asks the supervisor; the request holds until the next one.
    pub fn supervise(&mut self, request: supervisor::Request) -> Result<(), ClientError> {
        self.done(&Request::Supervise { request: request.word() as u8 })
    }

    /// Asks the program that serves the link to ramp down and end. Until it does, it goes on answering.
    pub fn stop(&mut self) -> Result<(), ClientError> {
        self.done(&Request::Stop)
    }

    /// Input words that are no measurements, by their names.
    pub fn free_names(&self) -> &[String] {
        self.description.input_names.get(..self.command.len()).unwrap_or_default()
    }

    /// Words for assignments, all of them or none.
    ///
    /// # Errors
    /// A name that cannot be set, or a value that its word cannot hold, in words.
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

    /// Sends all words of the command, as [`Session::assign`] gives them.
    pub fn command(&mut self, words: Vec<u64>) -> Result<(), ClientError> {
        let mut bytes = [0; WORDS * size_of::<u64>()];
        let put = put_words(&words, &mut bytes).ok_or(ClientError::TooLong)?;
        self.done(&Request::Setpoint { words: put })?;
        self.command = words;
        Ok(())
    }

    /// Has a command wait for the rising edge of the input line.
    pub fn command_on_edge(&mut self, words: &[u64]) -> Result<(), ClientError> {
        let mut bytes = [0; WORDS * size_of::<u64>()];
        let words = put_words(words, &mut bytes).ok_or(ClientError::TooLong)?;
        self.done(&Request::SetpointOnEdge { words })
    }

    /// How it stands with the input line; what waits for its edge is dropped first, if that is asked for.
    pub fn edge(&mut self, drop: bool) -> Result<EdgeStatus, ClientError> {
        match self.client.ask(&Request::Edge { drop })? {
            Reply::Edge(status) => Ok(status),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Words of a move to `pose`, m and rad.
    ///
    /// # Errors
    /// As [`Session::assign`]: a controller of six legs knows no moves.
    pub fn move_words(&self, pose: &[f64; 6]) -> Result<Vec<u64>, String> {
        let axes = pose.iter().enumerate().map(|(axis, value)| (format!("setpoint[{axis}]"), format!("{value:?}")));
        let command = ("command".to_owned(), "move".to_owned());
        self.assign(&std::iter::once(command).chain(axes).collect::<Vec<_>>())
    }

    /// Settings in force.
    pub fn config(&mut self) -> Result<Vec<u64>, ClientError> {
        let count = usize::from(self.identity.config_words);
        match self.client.ask(&Request::ReadConfig)? {
            Reply::Config { words } => words.words(count).map(Iterator::collect).ok_or(ClientError::Unexpected),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Other settings, all at once.
    pub fn write_config(&mut self, words: &[u64]) -> Result<(), ClientError> {
        let mut bytes = [0; WORDS * size_of::<u64>()];
        let words = put_words(words, &mut bytes).ok_or(ClientError::TooLong)?;
        self.done(&Request::WriteConfig { words })
    }

    /// Something of the recorder; how it stands then. A board writes the end of a record in its background: after a stop, how it
    /// stands when that is done.
    pub fn recorder(&mut self, action: RecorderAction) -> Result<RecorderStatus, ClientError> {
        let start = Instant::now();
        let mut status = self.recorder_status(action)?;
        while action == RecorderAction::Stop && status.running && start.elapsed() < RECORD_END {
            std::thread::sleep(ALIVE);
            status = self.recorder_status(RecorderAction::Look)?;
        }
        Ok(status)
    }

    fn recorder_status(&mut self, action: RecorderAction) -> Result<RecorderStatus, ClientError> {
        self.asked = Instant::now();
        match self.client.ask(&Request::Recorder { action })? {
            Reply::Recorder(status) => Ok(status),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// The next piece of the record, behind what there is of its file; whether it is whole. Every piece keeps the link alive.
    pub fn download_on(&mut self, whole: &mut Vec<u8>) -> Result<bool, ClientError> {
        let complete = self.client.fetch_on(|offset| Request::Download { offset }, whole)?;
        self.asked = Instant::now();
        Ok(complete)
    }

    /// Sends knots of the correction of passes, or rows of a plan behind them, from the `first` on.
    pub fn put_knots(&mut self, first: usize, knots: &[Knot]) -> Result<(), ClientError> {
        let mut buffer = [0; KNOTS * KNOT];
        for (index, part) in knots.chunks(KNOTS).enumerate() {
            let bytes = specgen_link::Bytes(specgen_link::put_knots(part, 0, &mut buffer));
            self.done(&Request::Knots { first: (first + index * KNOTS) as u32, knots: bytes })?;
            self.asked = Instant::now();
        }
        Ok(())
    }

    /// Something of the player of passes; how it stands then.
    pub fn pass(&mut self, action: PassAction) -> Result<PassStatus, ClientError> {
        match self.client.ask(&Request::Pass { action })? {
            Reply::Pass(status) => Ok(status),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// What the last pass kept of the error.
    pub fn errors(&mut self) -> Result<Vec<Knot>, ClientError> {
        let bytes = self.client.fetch(|offset| Request::Errors { offset })?;
        Ok(specgen_link::Bytes(&bytes).knots().ok_or(ClientError::Unexpected)?.collect())
    }

    /// The correction that the next pass plays.
    pub fn correction(&mut self) -> Result<Vec<Knot>, ClientError> {
        let bytes = self.client.fetch(|offset| Request::Correction { offset })?;
        Ok(specgen_link::Bytes(&bytes).knots().ok_or(ClientError::Unexpected)?.collect())
    }

    /// Starts the wave of these words, at once or at the rising edge of the input line. Where it ends, at its center, is what is commanded from
    /// then on.
    pub fn start_wave(&mut self, words: &[u64], center: &[u64; 6], on_edge: bool) -> Result<(), ClientError> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let action = if on_edge { WaveAction::StartOnEdge } else { WaveAction::Start };
        self.done(&Request::Wave { action, words: specgen_link::Bytes(&bytes) })?;
        let first = self.free_names().iter().position(|name| name == "setpoint[0]").unwrap_or_default();
        for (slot, word) in self.command.iter_mut().skip(first).zip(center) {
            *slot = *word;
        }
        Ok(())
    }

    /// Ends the wave under way, smoothly.
    pub fn stop_wave(&mut self) -> Result<(), ClientError> {
        self.done(&Request::Wave { action: WaveAction::Stop, words: specgen_link::Bytes(&[]) })
    }
}
