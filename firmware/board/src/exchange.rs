//! Data shared by the tick and the background.

use controller::snapshot::recorder::Recorder;
use controller::supervised::{Machine, MachineInput, MachineOutput, Phase, Request, machine_at_reset, supervise};
use controller::supervision::HOST_TICKS;
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, Config, Real, passes, triggers};
use specgen_link::{PassStatus, Refusal, Silence};
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::Knot;
use specgen_runtime::setpoint::BUSY;

use crate::recording::{MachineSnapshot, recorder};
use crate::report::{Probes, Report};
use crate::samples::{self, SampleMemory, Samples};
use crate::source::{EdgeCommand, Source};
#[cfg(feature = "lockstep")]
use crate::words::PERIOD_NANOSECONDS;

/// Time without a request after which a lock-step ends, ns: 2 s, because its host also computes, and nothing moves
/// meanwhile.
#[cfg(feature = "lockstep")]
const LOCKSTEP_TIMEOUT: u32 = 2_000_000_000;

/// Command for the next ticks, from the host.
#[derive(Debug, Clone, Copy)]
pub struct TickCommand {
    /// Input words of the controller, without the measured ones.
    pub command: [u64; COMMAND_WORDS],
    /// Request to the supervisor. It applies to every tick while it is here.
    pub request: Request,
}

/// Commands in one direction, reports in the other. Its lock holds off the tick: copy and release.
#[derive(Debug)]
pub struct Exchange {
    /// Command for the next ticks, from the host.
    pub command: TickCommand,
    /// Settings in force.
    pub config: Config,
    /// New settings, which take effect after the next tick, see [`Exchange::prepare`].
    pub next: Option<Config>,
    /// State of the machine after the last tick.
    pub report: Report,
    /// Probes of times and stack.
    pub probes: Probes,
    /// Counter that the background increments to show that it is alive.
    pub beat: u32,
    /// The background is dead, and with it the host's access: the tick ramps down.
    pub orphaned: bool,
    /// Time since the host was heard.
    pub silence: Silence,
    /// The recorder, if it was given memory.
    pub recorder: Option<Recorder<'static>>,
    /// Source of the recorder's pending data, see [`catch_up`](crate::catch_up); none while the background uses it.
    pub(crate) kept: Option<&'static mut MachineSnapshot>,
    /// Wave, pass and waiting command.
    pub source: Source<Player<'static, Real>>,
    /// Status of the player while the background uses it for learning.
    pub(crate) away: Option<PassStatus>,
    /// Samples for a subscribed host, if they were given memory.
    pub(crate) samples: Option<Samples>,
    /// Lock-step: the host steps the machine, and the ticks do not. Time since its last request.
    pub lockstep: Option<Silence>,
    /// Phase of the last tick.
    phase: Phase,
}

impl Default for Exchange {
    fn default() -> Self {
        Self::new()
    }
}

/// Gives access to exchange and machine, with the tick held off meanwhile.
pub type Access<'a> = dyn FnMut(&mut dyn FnMut(&mut Exchange, &mut Machine)) + 'a;

impl Exchange {
    /// At power-up: no command, the spec's settings, the link lost until the host sends something, nothing recorded.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            command: TickCommand { command: [0; COMMAND_WORDS], request: Request::None },
            config: Config::new(),
            next: None,
            report: Report::NONE,
            probes: Probes::NONE,
            beat: 0,
            orphaned: false,
            silence: Silence::new(HOST_TICKS),
            recorder: None,
            kept: None,
            source: Source::at_reset(),
            away: None,
            samples: None,
            lockstep: None,
            phase: Phase::Disarmed,
        }
    }

    /// Starts to record into this memory and waits for a fault; half of the memory is for rows after it. Nothing is
    /// recorded if not even two blocks fit, for example with a controller of very long memory on a small part. The
    /// background must call [`catch_up`](crate::catch_up).
    pub fn record(&mut self, memory: &'static mut [u64], kept: &'static mut MachineSnapshot) {
        self.recorder = recorder(memory);
        self.kept = Some(kept);
    }

    /// Provides memory for passes, if the controller takes a correction.
    pub fn play(&mut self, memory: &'static mut [Knot]) {
        if passes::POSSIBLE {
            self.source.player = Some(Player::new(memory));
        }
    }

    /// Provides memory for samples over a line of `baud` bits a second, if the controller has a pose. The background
    /// must call [`gather`](crate::gather).
    pub fn show(&mut self, memory: &'static mut SampleMemory, baud: u32) {
        if samples::POSSIBLE {
            self.samples = Some(Samples::new(memory, baud));
        }
    }

    /// Starts samples in rows of `every` ticks; 0 stops them.
    ///
    /// # Errors
    /// If there is no memory for it, no pose, or not enough capacity on the line, or the row is too long.
    pub fn watch(&mut self, every: u32) -> Result<(), Refusal> {
        self.samples.as_mut().map_or(Err(Refusal::Unsupported), |samples| samples.start(every))
    }

    /// A request of the host was carried out or refused.
    pub fn host_alive(&mut self) {
        self.silence.heard();
        if let Some(silence) = &mut self.lockstep {
            silence.heard();
        }
    }

    /// The newest settings, in force or not.
    #[must_use]
    pub const fn settings(&self) -> &Config {
        match &self.next {
            Some(next) => next,
            None => &self.config,
        }
    }

    /// New settings. A machine that the host steps has them at once, because no tick takes them over.
    pub(crate) const fn configure(&mut self, config: Config) {
        if self.in_lockstep() { self.config = config } else { self.next = Some(config) }
    }

    /// Work after a tick's codes are written, needed by the next tick: new settings, the next set-point of a wave, or
    /// the next correction of a pass.
    pub fn prepare(&mut self) {
        // New settings start a block, which must wait until the pending one is written.
        let owes = self.recorder.as_ref().is_some_and(Recorder::owes);
        if let Some(next) = &self.next {
            if !owes {
                self.config = *next;
                self.next = None;
                if let Some(recorder) = &mut self.recorder {
                    recorder.settings_changed();
                }
            }
        }
        let Self { command: TickCommand { command, .. }, report, .. } = self;
        let phase = report.phase;
        if triggers::INPUT {
            self.source.begin_awaited(report.tick - 1, phase, report.status, &self.config, command);
        }
        self.source.advance_wave(phase, command);
        if passes::POSSIBLE {
            self.source.advance_pass(phase, command);
        }
        let before = core::mem::replace(&mut self.phase, phase);
        if before.is_commanded() && phase != before {
            // An old command must not take effect when the machine runs or is driven again.
            waves::rest(&[0.0; 6], command);
        }
    }

    /// Waits for the edge, in place of another waiting command.
    ///
    /// # Errors
    /// If the machine does not run at rest, or plays something, or there is no input line.
    pub(crate) fn wait_for_edge(&mut self, awaited: EdgeCommand, wave: Option<Wave>) -> Result<(), Refusal> {
        if !triggers::INPUT {
            return Err(Refusal::Unsupported);
        }
        let rests = self.report.phase == Phase::Running && self.report.status & BUSY == 0;
        if !rests || self.in_lockstep() || self.source.is_engaged() {
            return Err(Refusal::State);
        }
        self.source.wave = wave;
        self.source.pending.wait(awaited);
        Ok(())
    }

    /// Begins a pass with the next tick.
    ///
    /// # Errors
    /// If the machine does not run at rest, a wave or a pass is under way, or the pass is invalid or too long.
    pub(crate) fn begin_pass(&mut self, course: Course) -> Result<(), Refusal> {
        let runs = self.report.phase == Phase::Running && !self.in_lockstep() && !self.source.is_engaged();
        if !runs || self.away.is_some() || !passes::may_begin(self.report.status, &self.command.command) {
            return Err(Refusal::State);
        }
        let player = self.source.player.as_mut().ok_or(Refusal::Unsupported)?;
        if !player.begin(course) {
            return Err(Refusal::Word { index: 0 });
        }
        self.source.cancel_awaited();
        self.source.advance_pass(Phase::Running, &mut self.command.command);
        Ok(())
    }

    /// Ends the pass under way, if there is one, and its correction.
    pub(crate) fn abort_pass(&mut self) {
        self.source.abort_pass(&mut self.command.command);
    }

    /// Whether the host steps the machine. Always false in a program without the feature: the compiler then drops its
    /// code.
    pub(crate) const fn in_lockstep(&self) -> bool {
        cfg!(feature = "lockstep") && self.lockstep.is_some()
    }

    /// Starts a lock-step. Only while nothing can move: false, with nothing changed, if something can.
    #[cfg(feature = "lockstep")]
    pub(crate) fn enter_lockstep(&mut self) -> bool {
        let at_rest = self.report.tick > 0 && self.report.phase == Phase::Disarmed && !self.report.amplifier_on;
        if at_rest && self.lockstep.is_none() {
            let mut silence = Silence::new(LOCKSTEP_TIMEOUT.div_ceil(PERIOD_NANOSECONDS));
            silence.heard();
            self.lockstep = Some(silence);
            self.command.request = Request::None;
            self.source.wave = None;
            self.abort_pass();
        }
        at_rest
    }

    /// Ends a lock-step, if there is one: machine and settings return to power-up, which the recorder notes.
    pub(crate) fn leave_lockstep(&mut self, machine: &mut Machine) {
        if self.in_lockstep() {
            self.lockstep = None;
            (self.config, self.next) = (Config::new(), None);
            if let Some(recorder) = &mut self.recorder {
                recorder.restarted();
            }
            reset(machine);
        }
    }
}

/// The machine at power-up, in flash: built at run time it would need room on the stack.
static AT_RESET: Machine = machine_at_reset();

/// As at power-up.
#[inline(never)]
pub(crate) fn reset(machine: &mut Machine) {
    *machine = AT_RESET;
}

/// The supervised tick. If lock-steps use it, too, it is a separate function, so that its code exists once; otherwise
/// it is compiled with the program, for speed.
#[cfg_attr(feature = "lockstep", inline(never))]
#[cfg_attr(not(feature = "lockstep"), inline(always))]
pub(crate) fn step(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
    supervise(config, machine, input)
}
