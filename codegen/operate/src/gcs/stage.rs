//! The machine as GCS sees it: a servo that is on or off, a goal, and whether it is there.

use std::time::{Duration, Instant};

use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};
use specgen_runtime::setpoint::{BUSY, REFUSED};
use specgen_runtime::supervisor::{Phase, Request};

use super::code::Code;
use crate::frame::Frame;
use crate::motion::{self, Motion};
use crate::session::{Place, Session};

/// Ticks after which a place shows what became of an order.
const SEEN: u64 = 10;
/// A place that is older is asked for anew before it is told.
const FRESH: Duration = Duration::from_micros(500);
/// After so long a machine that makes no ticks is not waited for.
const SILENT: Duration = Duration::from_millis(100);
/// How long it may take until the machine runs.
const UP: Duration = Duration::from_secs(10);
/// A machine that holds for so long after it was asked to run is held by somebody.
const HELD: Duration = Duration::from_millis(500);

/// The status is asked for this often at least.
const POLL: Duration = Duration::from_secs(1);

/// A session with a platform.
pub struct Stage<P> {
    session: Session<P>,
    motion: Motion,
    place: Place,
    seen: Instant,
    /// When its status was asked for last.
    polled: Instant,
    /// Where the last move leads, in the user's coordinates; none if nothing is known of one.
    goal: Option<[f64; 6]>,
    /// The last order: a tick from which on the place shows what became of it, and when it was sent.
    ordered: (u64, Instant),
    /// On the way to a machine that runs.
    rising: Option<StartUp>,
    /// It runs, and goes to its bias pose.
    to_bias: bool,
    /// It is to run no more, and that was asked for here.
    goes_down: bool,
    /// It runs no more, or comes up no further, and that was not asked for here.
    stopped: bool,
    /// The last stop that clients sent was carried out.
    has_halted: bool,
    /// Its tool point is the pivot point of clients: they see it move.
    frame: Frame,
    /// What went wrong after the command that asked for it had been taken.
    mishap: Option<Code>,
}

#[derive(Debug, Clone, Copy)]
struct StartUp {
    since: Instant,
    asked: Request,
}

/// Why an order is not carried out.
pub(super) enum Rejection {
    Code(Code),
    /// Not yet: the machine is coming up, or to rest.
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
    /// Of a session with a platform.
    ///
    /// # Errors
    /// The device has six legs, or does not say where it is.
    pub fn new(mut session: Session<P>) -> Result<Self, String> {
        let motion = session.motion().cloned();
        let place = session.place().map_err(|error| error.to_string())?;
        let (Some(motion), Some(place)) = (motion, place) else {
            return Err("the device controls six legs without a platform: GCS speaks of poses".to_owned());
        };
        Ok(Self {
            session,
            motion,
            place,
            seen: Instant::now(),
            polled: Instant::now(),
            goal: None,
            ordered: (0, Instant::now()),
            rising: None,
            to_bias: place.status & BUSY != 0,
            goes_down: false,
            stopped: false,
            has_halted: false,
            frame: Frame::default(),
            mishap: None,
        })
    }

    /// The session, for what is not GCS.
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
        self.runs() || self.rising.is_some()
    }

    pub(super) fn is_rising(&self) -> bool {
        self.rising.is_some()
    }

    /// Whether the goal is what the device stands at or moves to.
    fn is_at(&self, goal: &[f64; 6]) -> bool {
        goal.iter().zip(&self.place.target).all(|(goal, target)| self.session.is_same(*goal, *target))
    }

    /// Whether something moves, or is about to.
    pub(super) fn moves(&self) -> bool {
        self.is_rising()
            || self.runs()
                && (self.place.status & BUSY != 0
                    || !self.is_answered()
                    || self.goal.is_some_and(|goal| !self.is_at(&goal)))
    }

    /// Whether the place shows what became of the last order.
    pub(super) fn is_answered(&self) -> bool {
        let (tick, sent) = self.ordered;
        self.place.tick >= tick || sent.elapsed() >= SILENT
    }

    /// Whether somebody else stopped it since the last call: another host, a fault, the emergency contact.
    pub(super) fn was_stopped(&mut self) -> bool {
        std::mem::take(&mut self.stopped)
    }

    /// Takes what went wrong since the last call.
    pub(super) fn mishap(&mut self) -> Option<Code> {
        self.mishap.take()
    }

    /// Asks where it is, unless that was just said.
    pub(super) fn refresh(&mut self) -> Result<(), ClientError> {
        if self.seen.elapsed() < FRESH && self.is_answered() {
            return Ok(());
        }
        self.look()
    }

    /// Time since it was asked where it is.
    pub(super) fn age(&self) -> Duration {
        self.seen.elapsed()
    }

    /// Asks where it is, and goes on with what is under way. Keeps the link alive.
    pub(super) fn look(&mut self) -> Result<(), ClientError> {
        let ran = self.runs();
        if let Some(place) = self.session.place()? {
            self.place = place;
        }
        if self.place.phase != self.session.status().phase || self.polled.elapsed() >= POLL {
            // With its cause, to be shown; what the law has fallen back to is no other phase.
            self.session.poll()?;
            self.polled = Instant::now();
        }
        self.seen = Instant::now();
        if self.runs() {
            self.to_bias = (self.to_bias || !ran) && self.place.status & BUSY != 0;
        } else {
            self.goal = None;
            self.stopped |= ran && !self.goes_down;
        }
        let refused = self.runs() && self.place.status & REFUSED != 0 && self.is_answered();
        if refused && self.place.status & BUSY == 0 && self.goal.is_some_and(|goal| !self.is_at(&goal)) {
            self.goal = None;
            self.mishap = Some(Code::Position);
            // It is not to be tried again.
            let halted = self.halt();
            self.granted(halted)?;
        }
        let risen = self.rise();
        self.granted(risen)
    }

    /// What another host or a wave keeps it from is no broken link: whoever asked for it is told.
    fn granted(&mut self, done: Result<(), ClientError>) -> Result<(), ClientError> {
        match done {
            Err(ClientError::Refused(Refusal::Busy | Refusal::State)) => {
                self.stopped |= self.rising.take().is_some();
                self.mishap = Some(Code::NotNow);
                Ok(())
            }
            other => other,
        }
    }

    /// When the device must hear of its host again.
    pub(super) fn due(&self) -> Duration {
        self.session.due()
    }

    fn ask(&mut self, request: Request) -> Result<(), ClientError> {
        self.session.supervise(request)?;
        self.ordered = (self.place.tick + SEEN, Instant::now());
        Ok(())
    }

    /// The next step towards a machine that runs. Each waits for what the last one did.
    fn rise(&mut self) -> Result<(), ClientError> {
        let Some(rising) = self.rising else { return Ok(()) };
        if !self.is_answered() {
            return Ok(());
        }
        let asked = rising.asked;
        let came_up = matches!(asked, Request::Arm | Request::Run);
        let next = match self.phase() {
            Some(Phase::Running) => {
                self.rising = None;
                return Ok(());
            }
            // It faulted on the way, or somebody ramps it down, or holds it.
            Some(Phase::Faulted | Phase::RampingDown) if came_up => None,
            Some(Phase::Disarmed) if asked == Request::Run => None,
            Some(Phase::Holding) if asked == Request::Run && self.ordered.1.elapsed() >= HELD => None,
            Some(Phase::Faulted) => Some(Request::Acknowledge),
            Some(Phase::Disarmed) => Some(Request::Arm),
            Some(Phase::Arming | Phase::Holding) => Some(Request::Run),
            Some(Phase::RampingDown) | None => Some(asked),
        };
        match next.filter(|_| rising.since.elapsed() < UP) {
            Some(next) if next == asked => Ok(()),
            Some(next) => {
                self.rising = Some(StartUp { asked: next, ..rising });
                self.ask(next)
            }
            None => {
                (self.rising, self.stopped) = (None, true);
                self.mishap = Some(Code::ServoOff);
                self.ask(Request::None)
            }
        }
    }

    /// Servo on: acknowledges a fault, arms and runs.
    pub(super) fn start(&mut self) -> Result<(), Rejection> {
        if !self.servo() {
            // A request counts when it begins to be given.
            self.ask(Request::None)?;
            self.goes_down = false;
            self.rising = Some(StartUp { since: Instant::now(), asked: Request::None });
        }
        Ok(())
    }

    /// Servo off: ramps down.
    pub(super) fn shut_down(&mut self) -> Result<(), Rejection> {
        (self.rising, self.goal, self.goes_down) = (None, None, true);
        Ok(self.ask(Request::RampDown)?)
    }

    /// A client has sent a stop: the next one is carried out.
    pub(super) fn must_stop(&mut self) {
        self.has_halted = false;
    }

    /// Stops, once for all stops that had been sent by then, whoever is in control.
    pub(super) fn stop(&mut self) -> Result<(), Rejection> {
        if !self.has_halted {
            self.refresh()?;
            self.come_to_rest()?;
            self.has_halted = true;
        }
        Ok(())
    }

    /// Within the limits of stops. A machine that comes up comes no further, and its servo is off then.
    fn come_to_rest(&mut self) -> Result<(), Rejection> {
        let rises = self.rising.take().is_some();
        let request = match self.phase() {
            Some(Phase::Running) if !self.to_bias => None,
            Some(Phase::Running) => Some(Request::Hold),
            Some(Phase::Holding) if rises => Some(Request::Hold),
            Some(Phase::Arming) => Some(Request::RampDown),
            _ if rises => Some(Request::RampDown),
            _ => return Ok(()),
        };
        if let Some(request) = request {
            self.goes_down = true;
            return Ok(self.ask(request)?);
        }
        self.session.stop_wave().or_else(refused)?;
        match self.halt() {
            Err(ClientError::Refused(_)) => {
                // Set-points are another's, or a wave's until it is at rest.
                (self.goal, self.goes_down) = (None, true);
                Ok(self.ask(Request::Hold)?)
            }
            other => Ok(other?),
        }
    }

    /// To rest, and to stay.
    fn halt(&mut self) -> Result<(), ClientError> {
        let hold = [("command".to_owned(), "hold".to_owned())];
        let words = self.session.assign(&hold).map_err(|_| ClientError::Unexpected)?;
        self.session.command(words)?;
        self.goal = None;
        self.ordered = (self.place.tick + SEEN, Instant::now());
        Ok(())
    }

    /// Where it is to be once nothing moves, as clients see it.
    pub(super) fn goal(&self) -> [f64; 6] {
        self.seen_from_pivot(&self.goal.unwrap_or(self.place.target))
    }

    /// Where it is, as clients see it, m and rad.
    ///
    /// # Errors
    /// [`Code::Sensor`] if it is not measured now.
    pub(super) fn pose(&self) -> Result<[f64; 6], Code> {
        if self.place.is_measured() { Ok(self.seen_from_pivot(&self.place.pose)) } else { Err(Code::Sensor) }
    }

    /// The goal that a move changes: only of a machine that runs, and that is going nowhere that is not known.
    pub(super) fn standing(&self) -> Result<[f64; 6], Rejection> {
        if self.is_rising() {
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

    /// Goes to a pose, after the motion under way if there is one; refused before anything moves if it is out of reach.
    pub(super) fn go(&mut self, pose: &[f64; 6]) -> Result<(), Rejection> {
        let user = self.admitted(pose).ok_or(Code::Position)?;
        let words = self.session.move_words(&user).map_err(|_| Code::Position)?;
        match self.session.command(words) {
            // It runs no more.
            Err(ClientError::Refused(Refusal::State)) if self.look().is_ok() && !self.runs() => {
                return Err(Code::ServoOff.into());
            }
            other => other?,
        }
        self.goal = Some(user);
        self.ordered = (self.place.tick + SEEN, Instant::now());
        Ok(())
    }

    /// The user's pose of one as clients see it, if the platform can stand there.
    pub(super) fn admitted(&self, pose: &[f64; 6]) -> Option<[f64; 6]> {
        let user = self.frame.user(pose)?;
        self.motion.admits(&user).then_some(user)
    }

    /// How far it is from a pose as clients see it along a way, as a multiple of it.
    pub(super) fn reach(&self, start: &[f64; 6], way: &[f64; 6]) -> f64 {
        motion::reach(|pose| self.admitted(pose).is_some(), start, way)
    }

    fn seen_from_pivot(&self, user: &[f64; 6]) -> [f64; 6] {
        self.frame.pose(user).unwrap_or(*user)
    }

    /// m, from the tool point.
    pub(super) fn pivot(&self) -> [f64; 3] {
        *self.frame.tool()
    }

    /// Another pivot point. Only at rest and not turned: no coordinate of a platform that stands still is to change.
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

/// A wave that there is none of, or that is another's, is no reason not to stop.
fn refused(error: ClientError) -> Result<(), ClientError> {
    match error {
        ClientError::Refused(_) => Ok(()),
        other => Err(other),
    }
}
