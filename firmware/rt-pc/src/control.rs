//! The real-time thread: read, control, write, hand over; no allocation, no lock, no file.
//!
//! No control decision is made here: what a missed tick, a silent gauge or an operator who is gone means is the supervisor's
//! business, which sees it as event bits.

mod keeper;
mod setpoints;

use core::sync::atomic::Ordering;

use controller::sensing;
use controller::snapshot::recorder;
use controller::supervised::{
    AMPLIFIER, CONVERTER, INTEGRITY, LINK_LOST, MISSED_TICK, Machine, MachineInput, MachineOutput, Phase, STALLED,
    STOP, supervise,
};
use controller::supervision::STALL_TICKS;
use controller::{Config, LEGS, Real, place_words, triggers};
use specgen_rt::account::{Account, Stamps};
use specgen_rt::clock::{self, Usage};
use specgen_rt::{allocation, scheduling};
use specgen_runtime::pending::EDGE;
use specgen_runtime::supervisor::OF_GAUGES;

use crate::devices::Device;
use crate::handover::{Inner, Order, Row, Shared, Tape};
use keeper::Keeper;
use setpoints::Setpoints;

/// From the start of the loop to its first tick, ns.
const LEAD: u64 = 20_000_000;
/// A machine that slept this long was suspended, ns.
const SLEPT: u64 = 1_000_000;
/// Without a sign of life of the service for so long the operator's link is lost, ns. The service gives one every few ms.
const SERVICE_TIMEOUT: u64 = 2_000_000_000;

/// Where and how fast the loop runs.
#[derive(Debug, Clone, Copy)]
pub struct Timing {
    /// Control period, ns.
    pub period: u64,
    /// Outputs later than this after the planned time are late, ns.
    pub limit: u64,
    /// Ticks without a request after which a link is lost.
    pub silence: u64,
    /// Time waits for the loop: no tick is skipped, the next one is planned for when it can be. For machines that are simulated.
    pub elastic: bool,
}

/// The loop with everything that it owns.
pub struct Loop<'a, D> {
    pub device: &'a mut D,
    pub config: Config,
    /// Event bits that hold for the whole run, such as a failed integrity check.
    pub standing_events: u32,
    pub rings: Inner,
    pub tape: Option<Tape>,
    pub shared: &'a Shared,
    pub timing: Timing,
}

impl<D: Device> Loop<'_, D> {
    /// Runs until [`Shared::stop`]; then the amplifiers are off. `account` is the book of the run.
    pub fn run(mut self, account: &mut Account) {
        scheduling::touch_stack();
        let mut machine = Machine::new();
        let mut setpoints = Setpoints::new(&self.config);
        let Inner { outlets, mut orders, mut players } = self.rings;
        let mut keeper = Keeper::new(outlets, self.tape.take(), self.shared, (&machine, &self.config));
        let mut phase = Phase::Disarmed;
        let mut enabled = false;
        // An output of the last tick may not be what was asked for.
        let mut undriven = false;
        let mut link = Link { number: 0, asked: 0, silence: self.timing.silence };
        let mut count = 0;
        let Timing { period, elastic, .. } = self.timing;
        let mut planned = clock::now() + LEAD;
        let mut tick = 0;
        let mut slept = clock::since_boot().wrapping_sub(clock::now());
        allocation::enter();
        while !self.shared.stop.load(Ordering::Relaxed) {
            clock::sleep_until(planned);
            let woken = clock::now();
            let slept_now = clock::since_boot().wrapping_sub(woken);
            let suspended = slept_now.wrapping_sub(slept) > SLEPT && slept_now > slept;
            slept = slept_now;
            let over = if elastic { 0 } else { account.arrive(planned, woken, suspended) };
            planned += over * period;
            tick += over;

            let mut events = self.standing_events;
            if over > 0 {
                events |= MISSED_TICK;
            }
            // In a PC that sleeps this clock stands still, too.
            if over > u64::from(STALL_TICKS) || (suspended && !elastic) {
                events |= STALLED;
            }
            let silence = woken.saturating_sub(self.shared.service_alive.load(Ordering::Relaxed));
            if silence > SERVICE_TIMEOUT || link.is_lost(self.shared.link.load(Ordering::Relaxed), tick) {
                events |= LINK_LOST;
            }

            self.device.tick(tick);
            let read = self.device.read();
            let mut broken = read.is_err();
            let contacts = self.device.beat();
            broken |= contacts.is_err();
            let contacts = contacts.unwrap_or_default();
            if contacts.stop {
                events |= STOP;
            }
            if contacts.fault {
                events |= AMPLIFIER;
            }
            let mut rose = false;
            if triggers::INPUT {
                let line = self.device.input();
                broken |= line.is_err();
                rose = setpoints.sense(line);
            }
            let usage = Usage::of_this_thread();
            let sensed = clock::now();

            if broken || undriven {
                events |= CONVERTER;
            }
            let command = setpoints.next(phase, &self.config);
            let (gauge, wrench) = match read {
                Ok(codes) => (
                    codes.map(|code| sensing::CONVERTER.reading(code)),
                    self.device.wrench().map(|value| value as Real),
                ),
                // What was not read is not believed: no number stands for it.
                Err(_) => ([Real::NAN; LEGS], [Real::NAN; LEGS]),
            };
            // None of the supervisor's business, and in every record.
            let seen = if rose { events | EDGE } else { events };
            let input = MachineInput::measured(&command, &gauge, &wrench, setpoints.request(), seen);
            let output = supervise(&self.config, &mut machine, &input);
            let computed = clock::now();

            let mut driven = Ok(());
            if enabled && !output.amplifier_on {
                // Until it is done.
                driven = self.device.enable(false);
                enabled = driven.is_err();
            }
            driven = driven.and(self.device.write(&output.tick.dac_code));
            if triggers::LINES != 0 {
                driven = driven.and(self.device.set(triggers::lines(output.tick.status)));
            }
            if output.amplifier_on && !enabled && driven.is_ok() {
                // The codes are there before the amplifiers show them. They may be on whatever it answers.
                driven = self.device.enable(true);
                enabled = true;
            }
            undriven = driven.is_err();
            let written = clock::now();
            if broken || driven.is_err() {
                self.shared.device_faults.fetch_add(1, Ordering::Relaxed);
            }

            if machine.supervisor.conditions & OF_GAUGES != 0 {
                self.shared.gauge_faults.fetch_add(1, Ordering::Relaxed);
            }
            phase = output.phase;
            setpoints.keep(&machine.state, output.tick.status);
            let digest = if keeper.wants_digest() { machine.digest() } else { 0 };
            keeper.keep(Row {
                tick,
                count,
                input,
                output: row_of(&output),
                place: place_words(&machine.state),
                digest,
                late: account.late().iter().sum(),
                orders: 0,
                opens: false,
                waving: setpoints.waving(),
                edge: setpoints.edge(),
                recorded: None,
                triggered: false,
            });
            if triggers::INPUT {
                setpoints.begin_awaited(tick, phase, output.tick.status, &self.config);
            }
            count += 1;
            let mut configured = false;
            if let Ok(order) = orders.pop() {
                keeper.ordered();
                match order {
                    Order::Wish(wish) => setpoints.wish(wish),
                    Order::Configure(config) => (self.config, configured) = (config, true),
                    Order::Wave(settings) => setpoints.start(&settings, &self.config),
                    Order::StopWave => setpoints.stop(),
                    Order::Await(awaited) => setpoints.wait_for_edge(awaited),
                    Order::StopWaiting => setpoints.stop_waiting(),
                    Order::Pass(player) => setpoints.pass(player),
                    Order::AbortPass => setpoints.abort_pass(),
                    Order::Tape(tape) => keeper.take(tape, count),
                    Order::Record(settings) => keeper.record(settings, count),
                    Order::Trigger => keeper.trigger(),
                    Order::StopRecorder => keeper.stop(),
                }
            }
            keeper.prepare(&machine, &self.config, count, configured);
            // After the next tick, if there is no room now.
            if let Some(Err(rtrb::PushError::Full(player))) = setpoints.take_player().map(|player| players.push(player))
            {
                setpoints.put_player(player);
            }
            let usage = Usage::of_this_thread().since(usage);
            let done = clock::now();
            self.shared.took([planned, woken, sensed, written, done], period, elastic);
            account.tick(&Stamps { planned, woken, read: sensed, computed, written, done }, &usage, suspended);
            planned += period;
            if elastic && planned < done {
                planned = done;
            }
            tick += 1;
        }
        // Twice: a bus that failed once may work now. A failure here can be reported to nothing.
        let _ = self.device.enable(false).or_else(|_| self.device.enable(false));
        keeper.finish();
        allocation::leave();
        self.shared.ended.store(true, Ordering::Release);
    }
}

/// Whether the host at the other end of a link is still there.
struct Link {
    /// Number of the last request seen; 0 where no host's silence matters.
    number: u64,
    /// Tick in which it was.
    asked: u64,
    /// Ticks of silence that are none yet.
    silence: u64,
}

impl Link {
    /// `number` is that of the last request, `tick` is now: skipped ticks are silence, too.
    fn is_lost(&mut self, number: u64, tick: u64) -> bool {
        if number != self.number {
            (self.number, self.asked) = (number, tick);
        }
        number != 0 && tick - self.asked > self.silence
    }
}

/// What a record keeps of a tick's outputs.
fn row_of(output: &MachineOutput) -> recorder::Row {
    recorder::Row { codes: output.tick.dac_code, status: output.tick.status, supervisor: output.supervisor_word() }
}

/// The event bit of tables or settings that are not what the compiler made.
#[must_use]
pub fn integrity_event(intact: bool) -> u32 {
    if intact { 0 } else { INTEGRITY }
}
