// The program of an STM32 board, included by the `main.rs` of each board, which defines `clocks`, `pins`, `spi`, `BOARD`, `RECORD`,
// `PASSES`, `prepare` and `memory_intact`.

use specgen_board::{Exchange, SampleMemory, TargetStatus};
use specgen_stm32::{converters, timer};

/// The machine on this board's converters.
type Board = converters::OnBoard<spi::Registers, { pins::OUTPUT }, { clocks::DELAY }>;

const _: () = assert!(timer::period(clocks::TIMER).is_some(), "the timer of this board cannot count timing.period");

/// Figures for specgen's estimate of the tick.
#[unsafe(no_mangle)]
static SPECGEN_TIMES: specgen_stm32::times::Times = clocks::TIMES;

/// A tick without its timer, under a symbol that the analyses of the image look up.
#[unsafe(no_mangle)]
#[inline(never)]
fn specgen_tick(board: &mut Board, exchange: &mut Exchange, noticed: TargetStatus) -> bool {
    board.timed_tick(exchange, noticed, timer::now)
}

/// Timeout of the watchdog, µs: some hundred ticks, and a restart of the converters.
const WATCHDOG: u32 = 20_000;

#[rtic::app(device = stm32_metapac, peripherals = false)]
mod app {
    use core::mem::MaybeUninit;
    use core::sync::atomic::AtomicU8;

    use controller::supervised::Machine;
    use specgen_board::{
        Exchange, Health, LinkHandler, MachineSnapshot, Probes, SampleMemory, Schedule, TargetStatus, catch_up, gather,
        learn,
    };
    use specgen_link::Endpoint;
    use specgen_stm32::cycles::{self, CYCLES};
    use specgen_stm32::enable::Stop;
    use specgen_stm32::pins::Input;
    use specgen_stm32::serial::{Answer, Line, Ring};
    use specgen_stm32::watchdog::Watchdog;
    use specgen_stm32::{converters, serial, stack_used, supply, timer};

    use crate::pins::{self, Link};
    use crate::{Board, PASSES, RECORD, WATCHDOG, clocks, memory_intact, prepare, safe};

    #[shared]
    struct Shared {
        exchange: &'static mut Exchange,
        board: Board,
    }

    #[local]
    struct Local {
        schedule: Schedule,
        health: Health,
        watchdog: Watchdog,
        stop: Stop,
        fault: Input,
        line: Line<Link>,
    }

    // Large values are created in place: moving some kilobytes would use the stack.
    #[init(local = [
        machine: MaybeUninit<Machine> = MaybeUninit::uninit(),
        exchange: Exchange = Exchange::new(),
        #[unsafe(link_section = ".record.memory")]
        record: [u64; RECORD] = [0; RECORD],
        #[unsafe(link_section = ".record.passes")]
        passes: [[i32; 6]; PASSES] = [[0; 6]; PASSES],
        kept: MaybeUninit<MachineSnapshot> = MaybeUninit::uninit(),
        #[unsafe(link_section = ".record.samples")]
        samples: SampleMemory = SampleMemory::new(),
        #[unsafe(link_section = ".axisram.ring")]
        ring: Ring = [const { AtomicU8::new(0) }; _],
        #[unsafe(link_section = ".axisram.answer")]
        answer: Answer = [const { AtomicU8::new(0) }; _],
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let core = &mut context.core;
        prepare(core);
        // Keeps the symbols in the image.
        core::hint::black_box((&raw const crate::SPECGEN_TIMES, &raw const crate::BOARD));
        cycles::start(&mut core.DCB, &mut core.DWT);
        let hertz = clocks::start();
        let wiring = pins::take(hertz);
        // From here on, a start that hangs ends in a reset.
        let mut watchdog = Watchdog::start(pins::WATCHDOG, WATCHDOG);
        // It has no handler of its own: the default handler stops with the amplifiers off.
        if !supply::watch(pins::SUPPLY) {
            safe::stop();
        }

        let intact = memory_intact() && controller::integrity::intact();
        let exchange = context.local.exchange;
        exchange.probes = Probes { hertz, stack: stack_used, reset_cause: clocks::reset_cause() };
        let machine = converters::at_reset(context.local.machine);
        exchange.record(context.local.record, converters::kept(context.local.kept, machine));
        exchange.play(context.local.passes);
        exchange.show(context.local.samples, serial::BAUD);
        let mut board = converters::board(wiring.adc, wiring.dac, wiring.lines, machine, intact);
        let Some(period) = timer::period(hertz) else { safe::stop() };
        board.start(&mut exchange.report);
        exchange.prepare();

        let mut schedule = Schedule::new(period, 0);
        // The bus clock of the USART is half that of the timers.
        let line = Line::open(&mut core.NVIC, hertz / 2, context.local.ring, context.local.answer);
        timer::start(&mut schedule);
        watchdog.feed();
        (
            Shared { exchange, board },
            Local { schedule, health: Health::new(), watchdog, stop: wiring.stop, fault: wiring.fault, line },
        )
    }

    // One below the highest priority, which the voltage detector has.
    #[task(binds = TIM2, priority = 15, shared = [exchange, board], local = [schedule, health, watchdog, stop, fault])]
    fn tick(context: tick::Context) {
        let local = context.local;
        let begin = timer::now();
        timer::acknowledge();
        let due = local.schedule.begin(begin);
        timer::arm(due.next);
        let noticed = TargetStatus { missed: due.missed, stop: local.stop.is_open(), amplifier: local.fault.level() };
        (context.shared.exchange, context.shared.board).lock(|exchange, board| {
            if crate::specgen_tick(board, exchange, noticed) {
                timer::restart(local.schedule);
            }
            exchange.report.record_tick(due.late, timer::now().wrapping_sub(begin), local.schedule.period());
            exchange.orphaned = local.health.is_orphaned();
            if local.health.tick(exchange.beat, due.missed, exchange.report.amplifier_on) {
                local.watchdog.feed();
            }
        });
    }

    /// Requests of the host. Only the interrupts of `serial` pend this task.
    #[task(
        binds = CEC,
        priority = 1,
        shared = [exchange, board],
        local = [line, endpoint: Endpoint = Endpoint::new(), handler: LinkHandler = LinkHandler::new(CYCLES)]
    )]
    fn link(context: link::Context) {
        let local = context.local;
        let mut shared = (context.shared.exchange, context.shared.board);
        local.line.serve(local.endpoint, local.handler, &mut |action| {
            shared.lock(|exchange, board| action(exchange, board.machine_mut()));
        });
    }

    #[idle(shared = [exchange, board])]
    fn idle(context: idle::Context) -> ! {
        let mut shared = (context.shared.exchange, context.shared.board);
        loop {
            shared.0.lock(|exchange| exchange.beat = exchange.beat.wrapping_add(1));
            catch_up(
                &mut |action| shared.lock(|exchange, board| action(exchange, board.machine_mut())),
                timer::is_calm::<{ clocks::COPY }>,
            );
            gather(&mut |action| shared.lock(|exchange, board| action(exchange, board.machine_mut())));
            learn(&mut |action| shared.lock(|exchange, board| action(exchange, board.machine_mut())));
            cortex_m::asm::wfi();
        }
    }
}

/// Handlers of unexpected events: amplifiers off, then the watchdog resets the part.
mod safe {
    use core::panic::PanicInfo;

    use cortex_m_rt::{ExceptionFrame, exception};

    use specgen_stm32::enable;

    /// Switches the amplifiers off and waits: only the tick feeds the watchdog, so it resets the part within 20 ms. After a reset the
    /// pull-down holds the enable line low.
    pub fn stop() -> ! {
        cortex_m::interrupt::disable();
        loop {
            enable::off();
        }
    }

    /// Only initialisation and the link can reach this; the tick cannot panic, see docs/bring-up.md.
    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        stop()
    }

    #[exception]
    // SAFETY: called only through the vector table; does not return.
    unsafe fn HardFault(_: &ExceptionFrame) -> ! {
        stop()
    }

    #[exception]
    // SAFETY: called only through the vector table; does not return.
    unsafe fn DefaultHandler(_: i16) -> ! {
        stop()
    }
}
