// The program of an STM32 board, included by the `main.rs` of each: what is its own are `clocks`, `pins`, `spi`, `RECORD`,
// `PASSES`, `prepare` and `memory_intact`.

use specgen_board::{Exchange, Noticed, SampleMemory};
use specgen_stm32::{converters, timer};

/// The machine on this board's converters.
type Board = converters::OnBoard<spi::Registers, { pins::OUTPUT }, { clocks::DELAY }>;

const _: () = assert!(timer::period(clocks::TIMER).is_some(), "timing.period is nothing that the timer of this board counts");

/// For specgen's estimate of the tick.
#[unsafe(no_mangle)]
static SPECGEN_TIMES: specgen_stm32::times::Times = clocks::TIMES;

/// A tick without its timer, under a name that the analyses of the image know.
#[unsafe(no_mangle)]
#[inline(never)]
fn specgen_tick(board: &mut Board, exchange: &mut Exchange, noticed: Noticed) -> bool {
    board.timed_tick(exchange, noticed, timer::now)
}

/// Of the watchdog, µs: some hundred ticks, and starting the converters anew.
const WATCHDOG: u32 = 20_000;

#[rtic::app(device = embassy_stm32, peripherals = false, dispatchers = [CEC])]
mod app {
    use core::mem::MaybeUninit;

    use controller::supervised::Machine;
    use embassy_stm32::interrupt::{InterruptExt, Priority};
    use embassy_stm32::wdg::IndependentWatchdog;
    use specgen_board::{Desk, Exchange, Health, Noticed, Probes, Schedule, Kept, SampleMemory, catch_up, gather, learn};
    use specgen_link::Endpoint;
    use specgen_stm32::cycles::{self, CYCLES};
    use specgen_stm32::enable::Stop;
    use specgen_stm32::{converters, serial, stack_used, supply, timer};

    use crate::pins::{self, Link, Watchdog};
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
        watchdog: IndependentWatchdog<'static, Watchdog>,
        stop: Stop,
        line: Link,
    }

    // What is large is made where it stays: a move of some kilobytes would go over the stack.
    #[init(local = [
        machine: MaybeUninit<Machine> = MaybeUninit::uninit(),
        exchange: Exchange = Exchange::new(),
        #[unsafe(link_section = ".record.memory")]
        record: [u64; RECORD] = [0; RECORD],
        #[unsafe(link_section = ".record.passes")]
        passes: [[i32; 6]; PASSES] = [[0; 6]; PASSES],
        kept: MaybeUninit<Kept> = MaybeUninit::uninit(),
        #[unsafe(link_section = ".record.samples")]
        samples: SampleMemory = SampleMemory::new(),
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let core = &mut context.core;
        prepare(core);
        // Or the linker leaves it out.
        core::hint::black_box(&raw const crate::SPECGEN_TIMES);
        cycles::start(&mut core.DCB, &mut core.DWT);
        let wiring = pins::take(clocks::start());
        let mut watchdog = IndependentWatchdog::new(wiring.watchdog, WATCHDOG);
        // From here on a start that does not come to its end is a reset.
        watchdog.unleash();
        // No handler of its own: what nobody handles stops with the amplifiers off.
        if !supply::watch(pins::SUPPLY) {
            safe::stop();
        }

        let intact = memory_intact() && controller::integrity::intact();
        let exchange = context.local.exchange;
        exchange.probes = Probes { hertz: timer::hertz(), stack: stack_used };
        let machine = converters::at_reset(context.local.machine);
        exchange.record(context.local.record, converters::kept(context.local.kept, machine));
        exchange.play(context.local.passes);
        exchange.show(context.local.samples, serial::BAUD);
        let mut board = converters::board(wiring.adc, wiring.dac, wiring.lines, machine, intact);
        let Some(period) = timer::period(timer::hertz()) else { safe::stop() };
        board.start(&mut exchange.report);
        exchange.prepare();

        pins::LINK.set_priority(Priority::P8);
        let mut schedule = Schedule::new(period, 0);
        if link::spawn().is_err() {
            safe::stop();
        }
        timer::start(&mut schedule);
        watchdog.pet();
        (
            Shared { exchange, board },
            Local { schedule, health: Health::new(), watchdog, stop: wiring.stop, line: wiring.link },
        )
    }

    #[task(binds = TIM2, priority = 16, shared = [exchange, board], local = [schedule, health, watchdog, stop])]
    fn tick(context: tick::Context) {
        let local = context.local;
        let begin = timer::now();
        timer::acknowledge();
        let due = local.schedule.begin(begin);
        timer::arm(due.next);
        let noticed = Noticed { missed: due.missed, stop: local.stop.is_open() };
        (context.shared.exchange, context.shared.board).lock(|exchange, board| {
            if crate::specgen_tick(board, exchange, noticed) {
                timer::restart(local.schedule);
            }
            exchange.report.took(due.late, timer::now().wrapping_sub(begin), local.schedule.period());
            exchange.orphaned = local.health.is_orphaned();
            if local.health.tick(exchange.beat, due.missed, exchange.report.amplifier_on) {
                local.watchdog.pet();
            }
        });
    }

    /// Requests of the host.
    #[task(
        priority = 1,
        shared = [exchange, board],
        local = [
            line,
            #[unsafe(link_section = ".axisram.ring")]
            ring: [u8; serial::RING] = [0; serial::RING],
            endpoint: Endpoint = Endpoint::new(),
            desk: Desk = Desk::new(CYCLES),
            #[unsafe(link_section = ".axisram.answer")]
            answer: [u8; serial::ANSWER] = [0; serial::ANSWER],
        ]
    )]
    async fn link(context: link::Context) {
        let local = context.local;
        let mut shared = (context.shared.exchange, context.shared.board);
        serial::serve(local.line, local.ring, local.endpoint, local.desk, local.answer, |action| {
            shared.lock(|exchange, board| action(exchange, board.machine_mut()));
        })
        .await;
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

/// What happens where nothing should: amplifiers off, then the watchdog resets the part.
mod safe {
    use core::panic::PanicInfo;

    use cortex_m_rt::{ExceptionFrame, exception};

    use specgen_stm32::enable;

    /// Amplifiers off and nothing more: the watchdog is fed by the tick alone, and resets the part within 20 ms. Reset leaves
    /// the enable line to its pull-down.
    pub fn stop() -> ! {
        cortex_m::interrupt::disable();
        loop {
            enable::off();
        }
    }

    /// Initialisation and the drivers of the HAL have paths that end here; the tick has none, see docs/bring-up.md.
    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        stop()
    }

    #[exception]
    // SAFETY: called by the vector table alone; does not return.
    unsafe fn HardFault(_: &ExceptionFrame) -> ! {
        stop()
    }

    #[exception]
    // SAFETY: called by the vector table alone; does not return.
    unsafe fn DefaultHandler(_: i16) -> ! {
        stop()
    }
}
