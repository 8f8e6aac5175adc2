//! The state machine that generates set-points.
//!
//! ```text
//! reset ─► bias ─► hold ─┬─► move ───────────────────────────┬─► hold
//!                        ├─► move to the start ─► trajectory ─┤
//!                        └─► stream ◄──────────┐              │
//!          any motion, on another command ─► stop ────────────┘
//! ```
//! * **Bias**: a move from rest to the bias pose, before any command is followed.
//! * **Hold**: the set-point is constant.
//! * **Move**: one straight motion of limited speed, acceleration and jerk ([`Profile`]) to the pose of the command,
//!   which is latched at the start. If the pose changes under the same command, another move follows.
//! * **Trajectory**: a move to its start, then the trajectory, once. It is played again after another command or selector.
//! * **Stream**: a fresh set-point is followed at once if it and its derivatives are valid: finite, within the
//!   workspace, no step beyond the stream's speed. Between fresh ones the last rate is continued, for fewer than
//!   `stale_ticks` ticks. Then, or at an invalid set-point, the platform stops ([`Stop`]). It follows again as soon as a
//!   fresh set-point is within a step of its pose.
//! * **Stop**: another command during a motion stops it first. A motion that would leave the workspace (because the
//!   frames bend the path) is frozen at its last pose.
//!
//! [`BUSY`] stays set from the first to the last of several motions. It also stays set in the tick in which a motion
//! ends if the command begins another with the next tick.
//!
//! No set-point is ever non-finite or outside the workspace, whatever the command. From tick to tick no axis moves
//! further than speed · T_s in a move, or the stream's speed · T_s in a stream.

use super::profile::Profile;
use super::stop::Stop;
use super::trajectory::{Cursor, MOST};
use super::{Command, CommandKind, Frames, Setpoints, Target};
use crate::real::{Real, saturate};
use crate::snapshot::Sizes;

mod snapshot;

/// Status: a set-point or command is refused and the platform held, because it is not finite, out of the workspace, or
/// a jump.
pub const REFUSED: u32 = 1 << 16;
/// Status: the stream is stale and the platform held.
pub const STALE: u32 = 1 << 17;
/// Status: bias, move, trajectory or stop under way, or started by the command with the next tick.
pub const BUSY: u32 = 1 << 18;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Reset,
    Bias,
    Hold,
    Stream,
    Move,
    Approach(u32),
    Play(u32),
    Stop,
}

crate::state! { |words|
    /// Set-points of one platform. At reset: at rest, bias not yet approached.
    pub struct Generator<T>[T: Real] {
        phase: Phase = Phase::Reset, part;
        /// Pose in the user's frames and the present motion; the end of the bias move until it is reached.
        place: [T; 6] = [T::ZERO; 6], axes(words.sizes().user);
        rate: [T; 6] = [T::ZERO; 6], axes(words.sizes().rate);
        /// Straight motion under way: start, end, end − start; its profile and tick follow.
        start: [T; 6] = [T::ZERO; 6], axes(ends(*phase, &words.sizes()));
        goal: [T; 6] = [T::ZERO; 6], axes(ends(*phase, &words.sizes()));
        way: [T; 6] = [T::ZERO; 6], axes(ends(*phase, &words.sizes()).map(|most| 2.0 * most));
        /// The last set-point.
        target: Target<T> = Target::new(), part;
        profile: Profile<T> = Profile::new(), part;
        tick: i32 = 0, ticks(MOST);
        stop: Stop<T> = Stop::new(), part;
        cursor: Cursor = Cursor::new(), part;
        /// Trajectory that the present command has completed.
        finished: Option<u32> = None, choice;
        /// Last counter of the stream, and ticks since the last valid set-point under a stream command.
        sequence: u32 = 0, tally;
        age: u32 = 0, tally;
    }
}

/// Bounds for the ends of a straight motion. The bias move is in platform coordinates; no check of user coordinates
/// applies to it.
fn ends(phase: Phase, sizes: &Sizes) -> [f64; 6] {
    if phase == Phase::Bias { sizes.place } else { sizes.user }
}

impl<T: Real> Generator<T> {
    /// At rest at a pose of the platform (finite, limited to the workspace). The bias is approached from there.
    #[must_use]
    pub fn starting_at<F>(setpoints: &Setpoints<T, F>, pose: &[T; 6]) -> Self {
        let mut generator = Self::new();
        for ((slot, value), bound) in generator.target.pose.iter_mut().zip(pose).zip(setpoints.bound) {
            *slot = saturate(*value, -bound, bound);
        }
        generator
    }

    /// Stops at once at the last set-point, whatever motion was under way. If the bias was not reached, it is
    /// approached again.
    pub fn stand_still(&mut self) {
        let began = !matches!(self.phase, Phase::Reset | Phase::Bias);
        self.rest();
        if !began {
            self.phase = Phase::Reset;
        }
    }

    /// Whether a motion is under way that a hold command stops within the stop limits. The bias move is not one.
    #[must_use]
    pub fn can_stop(&self) -> bool {
        match self.phase {
            Phase::Reset | Phase::Bias | Phase::Hold => false,
            Phase::Stream => self.rate != [T::ZERO; 6],
            Phase::Move | Phase::Approach(_) | Phase::Play(_) | Phase::Stop => true,
        }
    }

    /// The trajectory that is being played, if any; none on the way to its start.
    #[inline]
    #[must_use]
    pub fn plays(&self) -> Option<u32> {
        match self.phase {
            Phase::Play(selector) => Some(selector),
            _ => None,
        }
    }

    /// Set-point from rest, with the bias: before [`Generator::tick`] that of the last interval, after it that of the
    /// next.
    #[inline]
    #[must_use]
    pub fn target(&self) -> &Target<T> {
        &self.target
    }

    /// The same set-point in the user's coordinates, m and rad; that of the bias until it is reached.
    #[must_use]
    pub fn place(&self) -> &[T; 6] {
        &self.place
    }

    /// As [`Generator::tick`], with a copy of the set-point.
    #[inline]
    pub fn next<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, command: &Command<T>) -> (Target<T>, u32) {
        let status = self.tick(setpoints, command);
        (self.target, status)
    }

    /// Moves [`Generator::target`] to the end of the next interval; returns [`REFUSED`], [`STALE`], [`BUSY`].
    #[inline]
    pub fn tick<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, command: &Command<T>) -> u32 {
        self.tick_as(setpoints, command.kind, command)
    }

    /// [`Generator::tick`] with `kind` in place of the command's, so that the command need not be copied.
    #[inline]
    pub fn tick_as<F: Frames<T>>(
        &mut self,
        setpoints: &Setpoints<T, F>,
        kind: CommandKind,
        command: &Command<T>,
    ) -> u32 {
        let fresh = command.sequence != self.sequence;
        self.sequence = command.sequence;
        let streams = kind == CommandKind::Stream;
        if streams && matches!(self.phase, Phase::Stream | Phase::Hold | Phase::Stop) {
            return self.stream(setpoints, command, fresh);
        }
        self.age = 0;
        let refused = self.obey(setpoints, kind, command);
        let moved = !matches!(self.phase, Phase::Hold);
        let status = self.advance(setpoints, refused);
        if moved && matches!(self.phase, Phase::Hold) && status == 0 && self.begins_next(setpoints, kind, command) {
            return BUSY;
        }
        status
    }

    /// Whether the command begins a motion with the next tick, now that the platform is at rest.
    #[cold]
    #[inline(never)]
    fn begins_next<F: Frames<T>>(&self, setpoints: &Setpoints<T, F>, kind: CommandKind, command: &Command<T>) -> bool {
        let goal = match kind {
            CommandKind::Move => command.target.pose,
            CommandKind::Trajectory if self.finished != Some(command.selector) => {
                match setpoints.trajectories.get(command.selector as usize) {
                    Some(trajectory) if trajectory.start() == self.place => return true,
                    Some(trajectory) => trajectory.start(),
                    None => return false,
                }
            }
            _ => return false,
        };
        goal != self.place && setpoints.admitted(&goal).is_some()
    }

    /// One tick under a stream command.
    #[inline]
    fn stream<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, command: &Command<T>, fresh: bool) -> u32 {
        self.finished = None;
        let mut status = 0;
        if fresh {
            if self.is_believed(setpoints, &command.target) && setpoints.admit(&command.target, &mut self.target) {
                self.phase = Phase::Stream;
                self.age = 0;
                self.place = command.target.pose;
                self.rate = command.target.rate;
                return 0;
            }
            status = REFUSED;
        }
        self.age = self.age.saturating_add(1);
        let stale = self.age >= setpoints.stale_ticks;
        if stale {
            status |= STALE;
        }
        if self.phase == Phase::Stream && (fresh || stale) {
            self.begin_stop(setpoints);
        }
        self.advance(setpoints, status)
    }

    /// Whether a streamed set-point is not a jump and its derivatives are possible.
    #[inline]
    fn is_believed<F>(&self, setpoints: &Setpoints<T, F>, user: &Target<T>) -> bool {
        // A NaN fails every comparison.
        (0..6).all(|axis| {
            (user.pose[axis] - self.place[axis]).abs() <= setpoints.stream_step[axis]
                && user.rate[axis].abs() <= setpoints.stream_rate[axis]
                && user.acceleration[axis].abs() <= setpoints.stream_acceleration[axis]
        })
    }

    /// Begins and ends motions as commanded; returns the status of a refusal.
    #[inline]
    fn obey<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, kind: CommandKind, command: &Command<T>) -> u32 {
        let played = match kind {
            CommandKind::Trajectory => Some(command.selector),
            _ => None,
        };
        if self.finished != played {
            self.finished = None;
        }
        match self.phase {
            Phase::Reset => {
                if !self.begin_bias(setpoints) {
                    return REFUSED;
                }
            }
            Phase::Bias | Phase::Stop => {}
            Phase::Stream => self.begin_stop(setpoints),
            Phase::Move if kind == CommandKind::Move => {}
            Phase::Approach(index) | Phase::Play(index) if played == Some(index) => {}
            Phase::Move | Phase::Approach(_) | Phase::Play(_) => self.begin_stop(setpoints),
            Phase::Hold => {}
        }
        let accepted = match kind {
            CommandKind::Hold | CommandKind::Stream => true,
            CommandKind::Drive | CommandKind::Unknown => false,
            CommandKind::Move => {
                self.phase != Phase::Hold || self.begin_move(setpoints, &command.target.pose, Phase::Move)
            }
            CommandKind::Trajectory => self.phase != Phase::Hold || self.begin_trajectory(setpoints, command.selector),
        };
        if accepted { 0 } else { REFUSED }
    }

    /// Starts the move to the bias, in platform coordinates, because the user's frames may bend the path. Nothing else
    /// moves before it. It starts from the present pose: after reset, from rest.
    #[inline(never)]
    fn begin_bias<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>) -> bool {
        self.place = setpoints.home;
        match setpoints.admitted(&setpoints.home) {
            Some(goal) => {
                let from = self.target.pose;
                self.begin_straight(setpoints, &from, &goal, Phase::Bias)
            }
            None => false,
        }
    }

    /// Starts a move, unless it is already at the goal. Returns whether the goal is valid.
    #[inline(never)]
    fn begin_move<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, goal: &[T; 6], phase: Phase) -> bool {
        if *goal == self.place {
            return true;
        }
        let from = self.place;
        setpoints.admitted(goal).is_some() && self.begin_straight(setpoints, &from, goal, phase)
    }

    fn begin_straight<F: Frames<T>>(
        &mut self,
        setpoints: &Setpoints<T, F>,
        from: &[T; 6],
        to: &[T; 6],
        phase: Phase,
    ) -> bool {
        self.start = *from;
        self.goal = *to;
        for axis in 0..6 {
            self.way[axis] = to[axis] - from[axis];
        }
        match Profile::plan(&self.way, &setpoints.limits) {
            Some(profile) => {
                self.profile = profile;
                self.tick = 0;
                self.phase = phase;
                true
            }
            None => false,
        }
    }

    /// Whether the platform is at, or can move to, the start of a trajectory.
    fn begin_trajectory<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, selector: u32) -> bool {
        if self.finished == Some(selector) {
            return true;
        }
        let Some(trajectory) = setpoints.trajectories.get(selector as usize) else {
            return false;
        };
        let start = trajectory.start();
        if start == self.place {
            self.phase = Phase::Play(selector);
            self.cursor = Cursor::new();
            return true;
        }
        self.begin_move(setpoints, &start, Phase::Approach(selector))
    }

    fn begin_stop<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>) {
        if self.rate == [T::ZERO; 6] {
            self.rest();
        } else {
            self.stop = Stop::plan(setpoints, &self.place, &self.rate);
            self.phase = Phase::Stop;
        }
    }

    /// Stops at the present pose.
    fn rest(&mut self) {
        self.phase = Phase::Hold;
        self.rate = [T::ZERO; 6];
        self.target = Target::at(self.target.pose);
    }

    /// One tick of the motion under way.
    #[inline]
    fn advance<F: Frames<T>>(&mut self, setpoints: &Setpoints<T, F>, status: u32) -> u32 {
        let busy = status | BUSY;
        match self.phase {
            Phase::Hold | Phase::Reset => status,
            Phase::Bias => {
                let (target, ended) = self.straight(setpoints);
                if !setpoints.reaches(&target.pose) {
                    // Only if a snapshot had a profile that does not belong to its path.
                    self.stand_still();
                    return status | REFUSED;
                }
                self.target = target;
                self.arrive(ended);
                if ended { status } else { busy }
            }
            Phase::Stream => {
                let mut user = Target { rate: self.rate, ..Target::at(self.place) };
                for (value, rate) in user.pose.iter_mut().zip(&user.rate) {
                    *value = *value + *rate * setpoints.period;
                }
                self.commit(setpoints, &user, false, status, status)
            }
            Phase::Move | Phase::Approach(_) => {
                let (user, ended) = self.straight(setpoints);
                self.commit(setpoints, &user, ended, busy, status)
            }
            Phase::Stop => {
                let (user, ended) = self.stop.next(setpoints);
                self.commit(setpoints, &user, ended, busy, status)
            }
            Phase::Play(index) => {
                let (user, ended) = match setpoints.trajectories.get(index as usize) {
                    Some(trajectory) => trajectory.next(&mut self.cursor),
                    None => (Target::at(self.place), true),
                };
                if ended {
                    self.finished = Some(index);
                }
                self.commit(setpoints, &user, ended, busy, status)
            }
        }
    }

    /// The straight motion after one tick, and whether it is complete.
    #[inline]
    fn straight<F>(&mut self, setpoints: &Setpoints<T, F>) -> (Target<T>, bool) {
        self.tick += 1;
        let ended = self.tick >= self.profile.ticks();
        let progress = self.profile.at(self.tick);
        let (rate, acceleration) = (progress.rate * setpoints.rate, progress.acceleration * setpoints.square_rate);
        if ended {
            // Exactly: start + delta may differ by a rounding.
            return (Target::at(self.goal), true);
        }
        let mut target = Target::at(self.start);
        for axis in 0..6 {
            let way = self.way[axis];
            target.pose[axis] = target.pose[axis] + way * progress.place;
            target.rate[axis] = way * rate;
            target.acceleration[axis] = way * acceleration;
        }
        (target, false)
    }

    /// Takes the proposed set-point; if it is outside the workspace, freezes.
    #[inline]
    fn commit<F: Frames<T>>(
        &mut self,
        setpoints: &Setpoints<T, F>,
        user: &Target<T>,
        ended: bool,
        moving: u32,
        standing: u32,
    ) -> u32 {
        if !setpoints.admit(user, &mut self.target) {
            self.rest();
            return standing | REFUSED;
        }
        self.place = user.pose;
        self.rate = user.rate;
        self.arrive(ended);
        if ended { standing } else { moving }
    }

    #[inline]
    fn arrive(&mut self, ended: bool) {
        if ended {
            self.phase = Phase::Hold;
        }
    }
}
