//! What lies between the tick and the background.

use controller::snapshot::recorder::Recorder;
use controller::supervised::{Machine, MachineInput, MachineOutput, Phase, Request, machine_at_reset, supervise};
use controller::supervision::HOST_TICKS;
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, Config, Real, passes, triggers};
use specgen_link::{PassStatus, Refusal, Silence};
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::pending::EdgeWait;
use specgen_runtime::playback::Knot;
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::wave::Stage;

use crate::recording::{MachineSnapshot, recorder};
use crate::report::{Probes, Report};
use crate::samples::{self, SampleMemory, Samples};
#[cfg(feature = "lockstep")]
use crate::words::PERIOD_NANOSECONDS;

/// A lock-step is over after so long without a request, ns: 2 s, for its host also computes, and nothing moves meanwhile.
#[cfg(feature = "lockstep")]
const LOCKSTEP_TIMEOUT: u32 = 2_000_000_000;

/// What the background wants of the ticks to come.
#[derive(Debug, Clone, Copy)]
pub struct TickCommand {
    /// Input words of the controller that are no measurements.
    pub command: [u64; COMMAND_WORDS],
    /// Of the supervisor; it holds for as long as it stands here.
    pub request: Request,
}

/// What waits for the edge of the input line.
#[derive(Debug, Clone, Copy)]
pub(crate) enum EdgeCommand {
    /// This command.
    Command([u64; COMMAND_WORDS]),
    /// The wave of [`Exchange::wave`], which has not begun.
    Wave,
}

/// Orders one way, reports the other. Whoever holds it holds off the tick: copy and let go.
#[derive(Debug)]
pub struct Exchange {
    /// What is wanted.
    pub orders: TickCommand,
    /// Settings in force.
    pub config: Config,
    /// Settings that came: in force after the next tick, see [`Exchange::prepare`].
    pub next: Option<Config>,
    /// How it stands.
    pub report: Report,
    /// What times and stack are measured with.
    pub probes: Probes,
    /// Counted up by the background, so that the tick sees it alive.
    pub beat: u32,
    /// The background is dead, and with it whoever could ask for anything: the tick ramps down.
    pub orphaned: bool,
    /// Whether the host is still there.
    pub silence: Silence,
    /// Keeps what the ticks do, where a memory was given for it.
    pub recorder: Option<Recorder<'static>>,
    /// What it owes is written from this, see [`catch_up`](crate::catch_up); none while the background has it.
    pub(crate) kept: Option<&'static mut MachineSnapshot>,
    /// Makes the set-points while it is under way.
    pub wave: Option<Wave>,
    /// The input line, and what waits for it.
    pub(crate) pending: EdgeWait<EdgeCommand>,
    /// Corrects the motion while a pass is under way, where a memory was given for it.
    pub player: Option<Player<'static, Real>>,
    /// How the player stands while the background has it, which learns.
    pub(crate) away: Option<PassStatus>,
    /// Shows the ticks to a host that looks on, where a memory was given for it.
    pub(crate) samples: Option<Samples>,
    /// The host steps the machine, and the ticks do not: how long it has been silent.
    pub lockstep: Option<Silence>,
    /// The machine ran in the last tick.
    ran: bool,
}

impl Default for Exchange {
    fn default() -> Self {
        Self::new()
    }
}

/// Gives access to the exchange and the machine, with the tick held off for as long as that takes.
pub type Access<'a> = dyn FnMut(&mut dyn FnMut(&mut Exchange, &mut Machine)) + 'a;

impl Exchange {
    /// At power-up: nothing wanted, the spec's settings, the link lost until the host sends something, nothing recorded.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            orders: TickCommand { command: [0; COMMAND_WORDS], request: Request::None },
            config: Config::new(),
            next: None,
            report: Report::NONE,
            probes: Probes::NONE,
            beat: 0,
            orphaned: false,
            silence: Silence::new(HOST_TICKS),
            recorder: None,
            kept: None,
            wave: None,
            pending: EdgeWait::new(),
            player: None,
            away: None,
            samples: None,
            lockstep: None,
            ran: false,
        }
    }

    /// Records into this memory from here on, waiting for a fault; then as much is kept after it as before. Nothing is recorded
    /// if not even two blocks fit, which a controller of very long memory may do to a small part. The background has to call
    /// [`catch_up`](crate::catch_up).
    pub fn record(&mut self, memory: &'static mut [u64], kept: &'static mut MachineSnapshot) {
        self.recorder = recorder(memory);
        self.kept = Some(kept);
    }

    /// Makes passes in this memory from here on, if the controller takes a correction.
    pub fn play(&mut self, memory: &'static mut [Knot]) {
        if passes::POSSIBLE {
            self.player = Some(Player::new(memory));
        }
    }

    /// Has samples for a host in this memory from here on, over a line of `baud` bits a second, if the controller has a pose. The
    /// background has to call [`gather`](crate::gather).
    pub fn show(&mut self, memory: &'static mut SampleMemory, baud: u32) {
        if samples::POSSIBLE {
            self.samples = Some(Samples::new(memory, baud));
        }
    }

    /// Samples in rows of `every` ticks from here on, none with 0.
    ///
    /// # Errors
    /// There is no memory for it, no pose, or no room on the line; the row is too long.
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

    /// Whether a wave is under way.
    #[must_use]
    pub fn waves(&self) -> bool {
        self.wave.as_ref().is_some_and(|wave| wave.stage() != Stage::Idle)
    }

    /// Whether a wave or a pass is under way, which commands in place of the host.
    #[must_use]
    pub fn is_engaged(&self) -> bool {
        self.waves() || self.player.as_ref().is_some_and(Player::is_running)
    }

    /// The newest settings, whether or not they are in force yet.
    #[must_use]
    pub const fn settings(&self) -> &Config {
        match &self.next {
            Some(next) => next,
            None => &self.config,
        }
    }

    /// What a tick leaves until its codes are out, and the first one needs to find done: settings that came, the set-point of a wave
    /// or what a pass corrects in the next tick.
    pub fn prepare(&mut self) {
        // A block begins with settings: not before the one that is owed is written.
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
        if triggers::INPUT {
            self.begin_awaited();
        }
        self.advance_wave();
        if passes::POSSIBLE {
            self.advance_pass();
        }
        let runs = self.report.phase == Phase::Running;
        if core::mem::replace(&mut self.ran, runs) && !runs {
            // What was commanded before is not followed when it runs again.
            waves::rest(&[0.0; 6], &mut self.orders.command);
        }
    }

    /// Begins what waited, with the tick that follows that of the edge. A machine that does not run waits for nothing.
    #[inline(never)]
    fn begin_awaited(&mut self) {
        if self.report.phase != Phase::Running {
            self.cancel_awaited();
        }
        let Some(awaited) = self.pending.due() else { return };
        let (free, status) = (!self.is_engaged() && self.report.status & BUSY == 0, self.report.status);
        let begun = match (awaited, &mut self.wave) {
            (EdgeCommand::Command(command), _) if free => {
                self.orders.command = command;
                true
            }
            (EdgeCommand::Wave, Some(wave)) if free => {
                let limits = waves::limits(&self.config);
                let may = waves::may_begin(status, &self.orders.command, wave.center(), &limits).is_ok();
                if may {
                    wave.start();
                }
                may
            }
            _ => false,
        };
        self.pending.settle(self.report.tick - 1, begun);
    }

    /// Nothing waits for the edge any more.
    pub(crate) fn cancel_awaited(&mut self) {
        self.pending.cancel();
        if !self.waves() {
            self.wave = None;
        }
    }

    /// Waits for the edge, in place of what waited.
    ///
    /// # Errors
    /// The machine does not run at rest, or plays something; there is no input line.
    pub(crate) fn wait_for_edge(&mut self, awaited: EdgeCommand, wave: Option<Wave>) -> Result<(), Refusal> {
        if !triggers::INPUT {
            return Err(Refusal::Unsupported);
        }
        let rests = self.report.phase == Phase::Running && self.report.status & BUSY == 0;
        if !rests || self.in_lockstep() || self.is_engaged() {
            return Err(Refusal::State);
        }
        self.wave = wave;
        self.pending.wait(awaited);
        Ok(())
    }

    /// Writes the set-point of a wave into the command, from where it stays when the wave has ended; only a running machine
    /// follows one. Not inlined: what it works with is done with before the law needs the stack.
    #[inline(never)]
    fn advance_wave(&mut self) {
        let Some(wave) = self.wave.as_mut().filter(|wave| wave.stage() != Stage::Idle) else { return };
        if self.report.phase != Phase::Running {
            self.wave = None;
            return;
        }
        match wave.advance() {
            Some(motion) => waves::write(&motion, wave.sequence(), &mut self.orders.command),
            None => self.wave = None,
        }
    }

    /// Begins a pass with the next tick.
    ///
    /// # Errors
    /// The machine does not run, or not at rest; a wave or a pass is under way; this is no pass, or too long.
    pub(crate) fn begin_pass(&mut self, course: Course) -> Result<(), Refusal> {
        let runs = self.report.phase == Phase::Running && !self.in_lockstep() && !self.is_engaged();
        if !runs || self.away.is_some() || !passes::may_begin(self.report.status, &self.orders.command) {
            return Err(Refusal::State);
        }
        let player = self.player.as_mut().ok_or(Refusal::Unsupported)?;
        if !player.begin(course) {
            return Err(Refusal::Word { index: 0 });
        }
        self.cancel_awaited();
        self.advance_pass();
        Ok(())
    }

    /// Writes what a pass corrects in the next tick into the command. Only a running machine makes one.
    #[inline(never)]
    pub(crate) fn advance_pass(&mut self) {
        if self.report.phase != Phase::Running {
            self.abort_pass();
        }
        if let Some(given) = self.player.as_mut().and_then(Player::give) {
            passes::write(&given, &mut self.orders.command);
        }
    }

    /// Keeps what a tick of a pass showed; after the last one nothing is corrected.
    #[inline(never)]
    pub(crate) fn keep_pass(&mut self, machine: &Machine, status: u32) {
        if let (Some(player), Some([target, pose])) = (&mut self.player, passes::shown(&machine.state)) {
            if player.is_running() {
                player.keep(&target, &pose, status);
                if !player.is_running() {
                    passes::end(&mut self.orders.command);
                }
            }
        }
    }

    /// Ends the pass under way, if there is one: nothing is corrected from here on.
    pub(crate) fn abort_pass(&mut self) {
        if let Some(player) = &mut self.player {
            if player.is_running() {
                player.abort();
                passes::end(&mut self.orders.command);
            }
        }
    }

    /// Whether the host steps the machine. Never in a program without the feature: the compiler then drops what is for it.
    pub(crate) const fn in_lockstep(&self) -> bool {
        cfg!(feature = "lockstep") && self.lockstep.is_some()
    }

    /// The host steps the machine from here on. Only while nothing can move: false, and nothing changed, if something can.
    #[cfg(feature = "lockstep")]
    pub(crate) fn enter_lockstep(&mut self) -> bool {
        let at_rest = self.report.tick > 0 && self.report.phase == Phase::Disarmed && !self.report.amplifier_on;
        if at_rest && self.lockstep.is_none() {
            let mut silence = Silence::new(LOCKSTEP_TIMEOUT.div_ceil(PERIOD_NANOSECONDS));
            silence.heard();
            self.lockstep = Some(silence);
            self.orders.request = Request::None;
            self.wave = None;
            self.abort_pass();
        }
        at_rest
    }

    /// Ends a lock-step, if there is one: machine and settings are as at power-up, which the recorder notes.
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

/// The machine at power-up, in flash: made at run time it would first lie on the stack, which has no room for it.
static AT_RESET: Machine = machine_at_reset();

/// As at power-up.
#[inline(never)]
pub(crate) fn reset(machine: &mut Machine) {
    *machine = AT_RESET;
}

/// The supervised tick. Where lock-steps take it, too, a function of its own, so that its code is there once; else compiled as
/// the program is, for speed.
#[cfg_attr(feature = "lockstep", inline(never))]
#[cfg_attr(not(feature = "lockstep"), inline(always))]
pub(crate) fn step(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
    supervise(config, machine, input)
}
