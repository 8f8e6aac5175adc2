//! One control tick on real converters.

use controller::snapshot::record_after;
use controller::supervised::{
    AMPLIFIER, CONVERTER, INTEGRITY, LINK_LOST, MISSED_TICK, Machine, MachineInput, Request, STALLED, STOP,
    measured_input,
};
use controller::supervision::STALL_TICKS;
use controller::{GAUGE_FAULT, Real, passes, sensing, triggers};
use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};
use specgen_link::Silence;
use specgen_runtime::pending::EDGE;

use crate::exchange::{self, Exchange, TickCommand};
use crate::report::Report;
use crate::words::GAUGE_BITS;

/// Observations of the target since the last tick.
#[derive(Debug, Clone, Copy, Default)]
pub struct TargetStatus {
    /// Number of consecutive missed ticks.
    pub missed: u32,
    /// The emergency stop is open.
    pub stop: bool,
    /// An amplifier reports a fault, or the wire of that line is broken.
    pub amplifier: bool,
}

/// The machine with its converters. Owned by the tick's interrupt.
#[derive(Debug)]
pub struct Board<'m, G, A, L = ()> {
    gauges: G,
    amplifiers: A,
    lines: L,
    /// A reference, because it has some kilobytes and moving it would use the stack.
    machine: &'m mut Machine,
    /// Whether tables and settings in flash are as the compiler wrote them.
    intact: bool,
    /// Whether both converters were started and tested.
    started: bool,
    /// Events after the call of the supervisor, for the next tick.
    carried: u32,
    /// The request of the last tick, to detect a new one.
    request: Request,
    /// Input of the last tick. Here and not on the stack, which the law needs.
    input: Option<MachineInput>,
    /// The last codes written; none before the first tick.
    codes: Option<[i32; CHANNELS]>,
}

impl<'m, G: Gauges, A: Amplifiers> Board<'m, G, A> {
    /// [`Self::with_lines`] for a spec without triggers.
    #[must_use]
    pub const fn new(gauges: G, amplifiers: A, machine: &'m mut Machine, intact: bool) -> Self {
        Self::with_lines(gauges, amplifiers, (), machine, intact)
    }
}

impl<'m, G: Gauges, A: Amplifiers, L: Lines> Board<'m, G, A, L> {
    /// Additional bits of an ADC code that the controller does not use.
    const SPARE_BITS: u32 = {
        assert!(GAUGE_BITS <= G::BITS, "sensor.bits of the spec is more than the ADC of this board has");
        G::BITS - GAUGE_BITS
    };
    /// Codes are written unchanged, so spec and DAC must have the same full scale.
    const SAME_CODES: () =
        assert!(controller::limits::DAC_BITS == A::BITS, "dac.bits of the spec is not what the DAC of this board has");

    /// Every trigger of the spec has a line.
    const LINE_EACH: () = assert!(
        L::COUNT.checked_sub(triggers::LINES).is_some(),
        "the spec has more [[trigger]] than this board has lines for"
    );
    /// The input of the spec, if there is one, has a line.
    const HAS_INPUT: () =
        assert!(L::INPUT || !triggers::INPUT, "the spec has a [[trigger]] of kind \"input\", this board no input line");

    /// At power-up, before [`Self::start`], with converters, and a line for each trigger of the spec (`()` for none). `machine` is at reset;
    /// `intact`: the result of `controller::integrity`.
    #[must_use]
    pub const fn with_lines(gauges: G, amplifiers: A, lines: L, machine: &'m mut Machine, intact: bool) -> Self {
        let () = Self::SAME_CODES;
        let () = Self::LINE_EACH;
        let () = Self::HAS_INPUT;
        Self {
            gauges,
            amplifiers,
            lines,
            machine,
            intact,
            started: false,
            carried: 0,
            request: Request::None,
            input: None,
            codes: None,
        }
    }

    /// Brings the converters into their working state, amplifiers disabled. May take a millisecond. A failure is in the
    /// report, and is an event of every tick until a start succeeds.
    pub fn start(&mut self, report: &mut Report) {
        // First the line, whatever the converters report; then both converters, even if one fails.
        let disabled = self.amplifiers.enable(false);
        let amplifiers = self.amplifiers.start().and_then(|()| self.rest());
        let gauges = self.gauges.start();
        self.started = true;
        for fault in [disabled, amplifiers, gauges].into_iter().filter_map(Result::err) {
            self.started = false;
            report.converter(fault);
        }
    }

    /// Writes the codes that the machine holds, at once: a DAC starts at code 0, which may differ from the rest code.
    fn rest(&mut self) -> Result<(), Fault> {
        let codes = self.machine.state.legs.each_ref().map(|leg| leg.code);
        if codes == [0; CHANNELS] { Ok(()) } else { self.amplifiers.write(&codes) }
    }

    /// One tick. Returns true if it started the converters again and therefore took longer than a period: the caller
    /// then restarts the schedule.
    ///
    /// A new request to acknowledge starts the converters again while the amplifiers are off, whatever the cause: both
    /// are tested before the amplifiers are enabled again. The supervisor gets the request in the tick after that, when no reading
    /// from before the start is left.
    pub fn tick(&mut self, exchange: &mut Exchange, noticed: TargetStatus) -> bool {
        self.timed_tick(exchange, noticed, || 0)
    }

    /// The same, where `now` is the counter of [`Probes::hertz`](crate::Probes::hertz).
    #[inline]
    pub fn timed_tick(&mut self, exchange: &mut Exchange, noticed: TargetStatus, now: impl Fn() -> u32) -> bool {
        if exchange.in_lockstep() {
            self.stand_by(exchange, noticed);
            return false;
        }
        let Exchange { command, config, report, silence, recorder, orphaned, source, .. } = exchange;
        let acknowledged = command.request == Request::Acknowledge && self.request != Request::Acknowledge;
        self.request = command.request;
        let restart = acknowledged && !report.amplifier_on;
        let request = match command.request {
            _ if restart => Request::None,
            // The background is dead, and with it the host's access.
            _ if *orphaned => Request::RampDown,
            asked => asked,
        };
        if restart {
            self.carried = 0;
            self.start(report);
        }

        let sampled = now();
        let begun = self.gauges.begin();
        let mut events = core::mem::take(&mut self.carried);
        // Read-back of the DACs, while the gauges are converted.
        self.try_amplifiers(report, A::ask);
        for (happened, event) in [
            (noticed.missed > 0, MISSED_TICK),
            (noticed.missed > STALL_TICKS, STALLED),
            (noticed.stop, STOP),
            (noticed.amplifier, AMPLIFIER),
            (silence.tick(), LINK_LOST),
            (!self.intact, INTEGRITY),
            (!self.started, CONVERTER),
        ] {
            if happened {
                events |= event;
            }
        }
        let readings = match begun.and_then(|()| self.gauges.read()) {
            Ok(codes) => codes.map(|code| sensing::CONVERTER.reading(code >> Self::SPARE_BITS)),
            Err(fault) => {
                report.converter(fault);
                events |= CONVERTER;
                // A reading that failed is invalid: it is passed as NaN.
                [Real::NAN; CHANNELS]
            }
        };

        // The trigger input, sampled with the gauges. The supervisor ignores its edge.
        let rose = triggers::INPUT
            && source.pending.sense(self.lines.input().map_err(|fault| {
                report.converter(fault);
                self.carried |= CONVERTER;
            }));
        let seen = if rose { events | EDGE } else { events };
        let input = store_input(&mut self.input, command, &readings, request, seen);
        let output = exchange::step(config, self.machine, input);

        // Off before the codes change; on only after they are written.
        if !output.amplifier_on {
            self.try_amplifiers(report, |amplifiers| amplifiers.enable(false));
        }
        self.codes = Some(output.tick.dac_code);
        self.try_amplifiers(report, |amplifiers| amplifiers.write(&output.tick.dac_code));
        self.set_trigger_lines(report, triggers::lines(output.tick.status));
        report.record_output(now().wrapping_sub(sampled));
        // Never enable the amplifiers while a converter has not started, whatever the supervisor says.
        if output.amplifier_on && self.started {
            self.try_amplifiers(report, |amplifiers| amplifiers.enable(true));
        }

        report.tick += 1;
        report.phase = output.phase;
        report.cause = output.cause;
        report.finding = output.finding as u16;
        report.amplifier_on = output.amplifier_on;
        report.status = output.tick.status;
        if output.tick.status & GAUGE_FAULT == 0 {
            report.measured = Some(report.tick);
        }
        report.health.events |= events;
        report.conditions(self.machine.supervisor.conditions);
        report.missed = report.missed.saturating_add(noticed.missed);
        // Work that can wait until the outputs have changed.
        if let (Some(recorder), Some(input)) = (recorder, &self.input) {
            record_after(self.machine, input, &output, recorder);
        }
        if passes::POSSIBLE {
            let Exchange { source, command, .. } = exchange;
            source.keep_pass(&self.machine.state, output.tick.status, &mut command.command);
        }
        if let Some(samples) = &mut exchange.samples {
            // Time in ticks, missed ones included; `stand_by` and `tick` have counted this one.
            let due = exchange.report.tick + u64::from(exchange.report.missed);
            samples.keep(due - 1, self.machine, &output);
        }
        exchange.prepare();
        restart
    }

    /// A tick while the host steps the machine: amplifiers off, codes unchanged. If the host goes silent, the ticks of the
    /// board resume.
    fn stand_by(&mut self, exchange: &mut Exchange, noticed: TargetStatus) {
        let report = &mut exchange.report;
        self.try_amplifiers(report, |amplifiers| amplifiers.enable(false));
        if let Some(codes) = self.codes {
            self.try_amplifiers(report, |amplifiers| amplifiers.write(&codes));
        }
        self.set_trigger_lines(report, 0);
        report.tick += 1;
        report.missed = report.missed.saturating_add(noticed.missed);
        for (happened, event) in [(noticed.stop, STOP), (noticed.amplifier, AMPLIFIER)] {
            if happened {
                report.health.events |= event;
            }
        }
        if exchange.lockstep.as_mut().is_none_or(Silence::tick) {
            exchange.leave_lockstep(self.machine);
        }
    }

    /// Sets the trigger lines; a fault is an event of the next tick.
    #[inline]
    fn set_trigger_lines(&mut self, report: &mut Report, high: u32) {
        if triggers::LINES != 0 {
            if let Err(fault) = self.lines.set(high) {
                report.converter(fault);
                self.carried |= CONVERTER;
            }
        }
    }

    /// State of the controller.
    #[must_use]
    pub const fn machine(&self) -> &Machine {
        self.machine
    }

    /// The same, for a host that steps the machine.
    pub const fn machine_mut(&mut self) -> &mut Machine {
        self.machine
    }

    /// Performs an amplifier operation; a fault is an event of the next tick.
    fn try_amplifiers(&mut self, report: &mut Report, action: impl FnOnce(&mut A) -> Result<(), Fault>) {
        if let Err(fault) = action(&mut self.amplifiers) {
            report.converter(fault);
            self.carried |= CONVERTER;
        }
    }
}

/// Writes the tick's input to `slot`. It has its own stack frame, which is released before the law needs the stack.
#[inline(never)]
fn store_input<'a>(
    slot: &'a mut Option<MachineInput>,
    command: &TickCommand,
    readings: &[Real; CHANNELS],
    request: Request,
    events: u32,
) -> &'a MachineInput {
    slot.insert(measured_input(&command.command, readings, &[Real::NAN; CHANNELS], request, events))
}
