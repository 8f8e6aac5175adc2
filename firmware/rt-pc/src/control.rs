//! The real-time thread: read, control, write, hand over; no allocation, no lock, no file.
//!
//! No control decision is made here: what a missed tick, a silent gauge or an operator who is gone means is the supervisor's
//! business, which is told by event bits.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use controller::supervised::{
    CONVERTER, INTEGRITY, LINK_LOST, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, MISSED_TICK, Machine, MachineInput,
    machine_output_words, supervise,
};
use controller::{Config, LEGS};
use rtrb::{Consumer, Producer};
use specgen_rt::account::{Account, Stamps, Verdict};
use specgen_rt::clock::{self, Usage};
use specgen_rt::{allocation, scheduling};

use crate::devices::Device;
use crate::words::{Places, Words};

/// From the start of the loop to its first tick, ns.
const LEAD: u64 = 20_000_000;
/// A machine that slept this long was suspended, ns.
const SLEPT: u64 = 1_000_000;
/// Without a sign of life of the service for so long the operator's link is lost, ns. The service gives one every few ms.
const SERVICE_PATIENCE: u64 = 2_000_000_000;

/// One tick, as it is handed over.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Number of the tick; skipped ones are left out.
    pub tick: u64,
    /// What went in.
    pub input: Words,
    /// What came out.
    pub output: [u64; MACHINE_OUTPUT_WORDS],
    /// Digest of the machine after the tick.
    pub digest: u64,
    /// Whether it was on time.
    pub verdict: Verdict,
}

/// What the operator wants from the next tick on: the words that are his, and the request.
#[derive(Debug, Clone, Copy)]
pub struct Wish {
    /// Input words; those that are measured are left out of account.
    pub words: Words,
    /// Number of the request.
    pub request: u64,
}

/// What both threads see.
#[derive(Debug, Default)]
pub struct Shared {
    /// The loop is to end.
    pub stop: AtomicBool,
    /// The loop has ended.
    pub ended: AtomicBool,
    /// Last sign of life of the service, ns of [`clock::now`].
    pub service_alive: AtomicU64,
    /// Ticks whose rows found no room.
    pub lost_rows: AtomicU64,
    /// Readings or outputs that the device did not make.
    pub device_faults: AtomicU64,
}

/// Where and how fast the loop runs.
#[derive(Debug, Clone, Copy)]
pub struct Timing {
    /// Control period, ns.
    pub period: u64,
    /// Outputs later than this after the planned time are late, ns.
    pub limit: u64,
    /// Time waits for the loop: no tick is skipped, the next one is planned for when it can be. For machines that are simulated.
    pub elastic: bool,
}

/// The loop with everything that it owns.
pub struct Loop<'a, D> {
    /// The machine outside.
    pub device: &'a mut D,
    /// Settings.
    pub config: Config,
    /// Where readings go.
    pub places: Places,
    /// Event bits that hold for the whole run, such as a failed integrity check.
    pub standing_events: u32,
    /// What the operator wants.
    pub wishes: Consumer<Wish>,
    /// What was done.
    pub rows: Producer<Row>,
    /// Flags and counters.
    pub shared: &'a Shared,
    /// When.
    pub timing: Timing,
}

impl<D: Device> Loop<'_, D> {
    /// Runs until [`Shared::stop`]; then the amplifiers are off. `account` is the book of the run.
    pub fn run(mut self, account: &mut Account) {
        scheduling::touch_stack();
        let mut machine = Machine::new();
        let mut words = [0; MACHINE_INPUT_WORDS];
        let mut request = 0;
        let mut codes = [0; LEGS];
        let mut enabled = false;
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

            if let Ok(wish) = self.wishes.pop() {
                words = wish.words;
                request = wish.request;
            }
            let mut events = self.standing_events;
            if over > 0 {
                events |= MISSED_TICK;
            }
            let silence = woken.saturating_sub(self.shared.service_alive.load(Ordering::Relaxed));
            if silence > SERVICE_PATIENCE {
                events |= LINK_LOST;
            }

            self.device.begin(tick);
            let mut broken = false;
            match self.device.read() {
                Ok(fresh) => codes = fresh,
                // The last codes stay: the supervisor is told that they are old.
                Err(_) => broken = true,
            }
            let usage = Usage::of_this_thread();
            let read = clock::now();

            if broken {
                events |= CONVERTER;
            }
            self.places.put_readings(&mut words, &codes, &self.device.wrench());
            self.places.put_supervision(&mut words, request, events);
            let output = supervise(&self.config, &mut machine, &MachineInput::from_words(&words));
            let computed = clock::now();

            let mut driven = Ok(());
            if enabled && !output.amplifier_on {
                driven = self.device.enable(false);
            }
            driven = driven.and(self.device.write(&output.tick.dac_code));
            if output.amplifier_on && !enabled {
                // The codes are there before the amplifiers show them.
                driven = driven.and(self.device.enable(true));
            }
            enabled = output.amplifier_on;
            let written = clock::now();
            if broken || driven.is_err() {
                self.shared.device_faults.fetch_add(1, Ordering::Relaxed);
            }

            let mut row = Row {
                tick,
                input: words,
                output: machine_output_words(&output, &machine),
                digest: machine.digest(),
                verdict: Verdict::OnTime,
            };
            let usage = Usage::of_this_thread().since(usage);
            let done = clock::now();
            row.verdict = account.tick(&Stamps { planned, woken, read, computed, written, done }, &usage, suspended);
            if self.rows.push(row).is_err() {
                self.shared.lost_rows.fetch_add(1, Ordering::Relaxed);
            }
            planned += period;
            if elastic && planned < done {
                planned = done;
            }
            tick += 1;
        }
        // Twice: a bus that failed once may work now. There is nobody left to tell.
        let _ = self.device.enable(false).or_else(|_| self.device.enable(false));
        allocation::leave();
        self.shared.ended.store(true, Ordering::Release);
    }
}

/// The event bit of tables or settings that are not what the compiler made.
#[must_use]
pub fn integrity_event(intact: bool) -> u32 {
    if intact { 0 } else { INTEGRITY }
}
