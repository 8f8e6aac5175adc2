//! The machine in terms of GCS: servo on or off, goal, on target.

use std::time::{Duration, Instant};

use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};
use specgen_runtime::setpoint::{BUSY, REFUSED};
use specgen_runtime::supervisor::{Phase, Request};

use super::code::Code;
use crate::frame::Frame;
use crate::motion::{self, Motion};
use crate::session::{MeasuredPose, Session};

/// Ticks after which a place shows the effect of a command.
const SEEN: u64 = 10;
/// Largest age of a place for an answer.
const MAX_AGE: Duration = Duration::from_micros(500);
/// How long to wait for a machine that is not ticking.
const SILENT: Duration = Duration::from_millis(100);
/// Timeout of starting the machine.
const UP: Duration = Duration::from_secs(10);
/// If the machine still holds this long after a request to run, another host holds it.
const HELD: Duration = Duration::from_millis(500);

/// Interval of status requests.
const POLL: Duration = Duration::from_secs(1);

/// A session with a platform.
pub struct Stage<P> {
    session: Session<P>,
    motion: Motion,
    place: MeasuredPose,
    seen: Instant,
    /// Time of the last status request.
    polled: Instant,
    /// Destination of the last move, in the user's coordinates; none if unknown.
    goal: Option<[f64; 6]>,
    /// The last command: the tick from which the place shows its effect, and when it was sent.
    last_command: (u64, Instant),
    /// Start-up in progress.
    starting: Option<StartUp>,
    /// It is running, and moves to its bias pose.
    to_bias: bool,
    /// A stop was requested here.
    is_stopping: bool,
    /// The machine, or its start-up, was stopped, but not from here.
    stopped: bool,
    /// The last stop of clients was executed.
    has_halted: bool,
    /// The frame of clients; its tool point is their pivot point.
    frame: Frame,
    /// Error of a command that had already been accepted.
    mishap: Option<Code>,
}

#[derive(Debug, Clone, Copy)]
struct StartUp {
    since: Instant,
    asked: Request,
}

/// Why a command is not executed.
pub(super) enum Rejection {
    Code(Code),
    /// Not yet: the machine is starting, or coming to rest.
    Later,
    Link(ClientError),
}

impl From<Code> for Rejection {
    fn from(code: Code) -> Self {
        Self::Code(code)
    }
}

impl From<ClientError> for Rejection {
    fn from(error: ClientError) -> Self {
        match error {
            ClientError::Refused(Refusal::State) => Self::Code(Code::WaveActive),
            ClientError::Refused(Refusal::Busy) => Self::Code(Code::NotNow),
            other => Self::Link(other),
        }
    }
}

impl<P: Port> Stage<P> {
    /// From a session with a platform.
    ///
    /// # Errors
    /// The device controls six legs, or does not report its place.
    pub fn new(mut session: Session<P>) -> Result<Self, String> {
        let motion = session.motion().cloned();
        let place = session.place().map_err(|error| error.to_string())?;
        let (Some(motion), Some(place)) = (motion, place) else {
            return Err("the device controls six legs without a platform: GCS needs poses".to_owned());
        };
        Ok(Self {
            session,
            motion,
            place,
            seen: Instant::now(),
            polled: Instant::now(),
            goal: None,
            last_command: (0, Instant::now()),
            starting: None,
            to_bias: place.status & BUSY != 0,
            is_stopping: false,
            stopped: false,
            has_halted: false,
            frame: Frame::default(),
            mishap: None,
        })
    }

    /// Returns the session.
    pub fn into_session(self) -> Session<P> {
        self.session
    }

    pub(super) fn session(&self) -> &Session<P> {
        &self.session
    }

    pub(super) fn motion(&self) -> &Motion {
        &self.motion
    }

    fn phase(&self) -> Option<Phase> {
        Phase::from_word(u64::from(self.place.phase))
    }

    pub(super) fn runs(&self) -> bool {
        self.phase() == Some(Phase::Running)
    }

    /// Whether the loop is closed, or is about to be.
    pub(super) fn servo(&self) -> bool {
        self.runs() || self.starting.is_some()
    }

    pub(super) fn is_starting(&self) -> bool {
        self.starting.is_some()
    }

    /// Whether the goal is the set-point of the device.
    fn is_at(&self, goal: &[f64; 6]) -> bool {
        goal.iter().zip(&self.place.target).all(|(goal, target)| self.session.is_same(*goal, *target))
    }

    /// Whether a motion is in progress or about to start.
    pub(super) fn moves(&self) -> bool {
        self.is_starting()
            || self.runs()
                && (self.place.status & BUSY != 0
                    || !self.is_answered()
                    || self.goal.is_some_and(|goal| !self.is_at(&goal)))
    }

    /// Whether the place shows the effect of the last command.
    pub(super) fn is_answered(&self) -> bool {
        let (tick, sent) = self.last_command;
        self.place.tick >= tick || sent.elapsed() >= SILENT
    }

    /// Whether another host, a fault or the emergency stop has stopped it since the last call.
    pub(super) fn was_stopped(&mut self) -> bool {
        std::mem::take(&mut self.stopped)
    }

    /// Takes the error since the last call.
    pub(super) fn mishap(&mut self) -> Option<Code> {
        self.mishap.take()
    }

    /// Updates the place, unless it is recent.
    pub(super) fn refresh(&mut self) -> Result<(), ClientError> {
        if self.seen.elapsed() < MAX_AGE && self.is_answered() {
            return Ok(());
        }
        self.look()
    }

    /// Age of the place.
    pub(super) fn age(&self) -> Duration {
        self.seen.elapsed()
    }

    /// Updates the place, and continues a start-up. Keeps the link alive.
    pub(super) fn look(&mut self) -> Result<(), ClientError> {
        let ran = self.runs();
        if let Some(place) = self.session.place()? {
            self.place = place;
        }
        if self.place.phase != self.session.status().phase || self.polled.elapsed() >= POLL {
            // For the cause, and for a fallback of the law, which does not change the phase.
            self.session.poll()?;
            self.polled = Instant::now();
        }
        self.seen = Instant::now();
        if self.runs() {
            self.to_bias = (self.to_bias || !ran) && self.place.status & BUSY != 0;
        } else {
            self.goal = None;
            self.stopped |= ran && !self.is_stopping;
        }
        let refused = self.runs() && self.place.status & REFUSED != 0 && self.is_answered();
        if refused && self.place.status & BUSY == 0 && self.goal.is_some_and(|goal| !self.is_at(&goal)) {
            self.goal = None;
            self.mishap = Some(Code::Position);
            // The device must not retry the move.
            let halted = self.halt();
            self.granted(halted)?;
        }
        let started = self.continue_start();
        self.granted(started)
    }

    /// Turns a refusal, because of another host or a wave, into an error for the client. The link is intact.
    fn granted(&mut self, done: Result<(), ClientError>) -> Result<(), ClientError> {
        match done {
            Err(ClientError::Refused(Refusal::Busy | Refusal::State)) => {
                self.stopped |= self.starting.take().is_some();
                self.mishap = Some(Code::NotNow);
                Ok(())
            }
            other => other,
        }
    }

    /// Time until the device must get the next request.
    pub(super) fn due(&self) -> Duration {
        self.session.due()
    }

    fn ask(&mut self, request: Request) -> Result<(), ClientError> {
        self.session.supervise(request)?;
        self.last_command = (self.place.tick + SEEN, Instant::now());
        Ok(())
    }

    /// Takes the next step of a start-up. Each step waits for the effect of the last one.
    fn continue_start(&mut self) -> Result<(), ClientError> {
        let Some(starting) = self.starting else { return Ok(()) };
        if !self.is_answered() {
            return Ok(());
        }
        let asked = starting.asked;
        let came_up = matches!(asked, Request::Arm | Request::Run);
        let next = match self.phase() {
            Some(Phase::Running) => {
                self.starting = None;
                return Ok(());
            }
            // It faulted, or another host ramps it down or holds it.
            Some(Phase::Faulted | Phase::RampingDown) if came_up => None,
            Some(Phase::Disarmed) if asked == Request::Run => None,
            Some(Phase::Holding) if asked == Request::Run && self.last_command.1.elapsed() >= HELD => None,
            Some(Phase::Faulted) => Some(Request::Acknowledge),
            Some(Phase::Disarmed) => Some(Request::Arm),
            Some(Phase::Arming | Phase::Holding | Phase::Driving) => Some(Request::Run),
            Some(Phase::RampingDown) | None => Some(asked),
        };
        match next.filter(|_| starting.since.elapsed() < UP) {
            Some(next) if next == asked => Ok(()),
            Some(next) => {
                self.starting = Some(StartUp { asked: next, ..starting });
                self.ask(next)
            }
            None => {
                (self.starting, self.stopped) = (None, true);
                self.mishap = Some(Code::ServoOff);
                self.ask(Request::None)
            }
        }
    }

    /// Servo on: acknowledges a fault, arms, and runs the machine.
    pub(super) fn start(&mut self) -> Result<(), Rejection> {
        if !self.servo() {
            // Requests are edge-triggered.
            self.ask(Request::None)?;
            self.is_stopping = false;
            self.starting = Some(StartUp { since: Instant::now(), asked: Request::None });
        }
        Ok(())
    }

    /// Servo off: ramps down.
    pub(super) fn shut_down(&mut self) -> Result<(), Rejection> {
        (self.starting, self.goal, self.is_stopping) = (None, None, true);
        Ok(self.ask(Request::RampDown)?)
    }

    /// A client has sent a stop, so the next call of [`Stage::stop`] must act.
    pub(super) fn must_stop(&mut self) {
        self.has_halted = false;
    }

    /// Stops the machine, once for all stops received so far.
    pub(super) fn stop(&mut self) -> Result<(), Rejection> {
        if !self.has_halted {
            self.refresh()?;
            self.come_to_rest()?;
            self.has_halted = true;
        }
        Ok(())
    }

    /// Stops within the limits of acceleration. A start-up is aborted, and the servo is then off.
    fn come_to_rest(&mut self) -> Result<(), Rejection> {
        let was_starting = self.starting.take().is_some();
        let request = match self.phase() {
            Some(Phase::Running) if !self.to_bias => None,
            Some(Phase::Running) => Some(Request::Hold),
            Some(Phase::Holding) if was_starting => Some(Request::Hold),
            Some(Phase::Driving) => Some(Request::Hold),
            Some(Phase::Arming) => Some(Request::RampDown),
            _ if was_starting => Some(Request::RampDown),
            _ => return Ok(()),
        };
        if let Some(request) = request {
            self.is_stopping = true;
            return Ok(self.ask(request)?);
        }
        self.session.stop_wave().or_else(refused)?;
        match self.halt() {
            Err(ClientError::Refused(_)) => {
                // Another host, or a wave until it is at rest, controls the set-point.
                (self.goal, self.is_stopping) = (None, true);
                Ok(self.ask(Request::Hold)?)
            }
            other => Ok(other?),
        }
    }

    /// Brings the set-point to rest and holds it.
    fn halt(&mut self) -> Result<(), ClientError> {
        let hold = [("command".to_owned(), "hold".to_owned())];
        let words = self.session.assign(&hold).map_err(|_| ClientError::Unexpected)?;
        self.session.command(words)?;
        self.goal = None;
        self.last_command = (self.place.tick + SEEN, Instant::now());
        Ok(())
    }

    /// The destination, in the frame of clients.
    pub(super) fn goal(&self) -> [f64; 6] {
        self.seen_from_pivot(&self.goal.unwrap_or(self.place.target))
    }

    /// The measured pose in the frame of clients, m and rad.
    ///
    /// # Errors
    /// [`Code::Sensor`] if it is not currently measured.
    pub(super) fn pose(&self) -> Result<[f64; 6], Code> {
        if self.place.is_measured() { Ok(self.seen_from_pivot(&self.place.pose)) } else { Err(Code::Sensor) }
    }

    /// The pose that a move starts from. The machine must be running, with no motion to an unknown goal.
    pub(super) fn start_of_move(&self) -> Result<[f64; 6], Rejection> {
        if self.is_starting() {
            return Err(Rejection::Later);
        }
        if !self.runs() {
            return Err(Code::ServoOff.into());
        }
        if self.goal.is_none() && self.moves() {
            return Err(Rejection::Later);
        }
        Ok(self.goal())
    }

    /// Moves to a pose, after the current motion. A pose out of reach is refused.
    pub(super) fn go(&mut self, pose: &[f64; 6]) -> Result<(), Rejection> {
        let user = self.admitted(pose).ok_or(Code::Position)?;
        let words = self.session.move_words(&user).map_err(|_| Code::Position)?;
        match self.session.command(words) {
            // It has stopped running.
            Err(ClientError::Refused(Refusal::State)) if self.look().is_ok() && !self.runs() => {
                return Err(Code::ServoOff.into());
            }
            other => other?,
        }
        self.goal = Some(user);
        self.last_command = (self.place.tick + SEEN, Instant::now());
        Ok(())
    }

    /// Converts a pose of clients to the user's coordinates; none if the platform cannot reach it.
    pub(super) fn admitted(&self, pose: &[f64; 6]) -> Option<[f64; 6]> {
        let user = self.frame.user(pose)?;
        self.motion.admits(&user).then_some(user)
    }

    /// Reach from a pose of clients along a direction, as a multiple of it.
    pub(super) fn reach(&self, start: &[f64; 6], way: &[f64; 6]) -> f64 {
        motion::reach(|pose| self.admitted(pose).is_some(), start, way)
    }

    fn seen_from_pivot(&self, user: &[f64; 6]) -> [f64; 6] {
        self.frame.pose(user).unwrap_or(*user)
    }

    /// The pivot point, relative to the tool point, m.
    pub(super) fn pivot(&self) -> [f64; 3] {
        *self.frame.tool()
    }

    /// Sets the pivot point. The platform must be at rest and not rotated, so that its coordinates do not change.
    pub(super) fn set_pivot(&mut self, pivot: [f64; 3]) -> Result<(), Rejection> {
        if self.moves() {
            return Err(Code::InMotion.into());
        }
        let [_, _, _, u, v, w] = self.goal();
        if [u, v, w] != [0.0; 3] {
            return Err(Code::Pivot.into());
        }
        self.frame = Frame::new([0.0; 6], pivot);
        Ok(())
    }
}

/// Ignores a refusal: without a wave, or with another host's, the stop continues.
fn refused(error: ClientError) -> Result<(), ClientError> {
    match error {
        ClientError::Refused(_) => Ok(()),
        other => Err(other),
    }
}
