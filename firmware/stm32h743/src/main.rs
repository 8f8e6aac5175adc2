//! The emitted controller on a NUCLEO-H743ZI2 with an AD7606 and two AD5686R; wiring and bring-up: docs/bring-up.md.
//!
//! | priority | what |
//! | --- | --- |
//! | 16, the highest | `tick`: TIM2, once a control period |
//! | 8 of the NVIC | DMA and USART3 |
//! | 1 | `link`: requests of the host |
//! | idle | shows the tick that the background is alive, sleeps |
#![no_std]
#![no_main]
#![allow(unsafe_code)] // Names and sections for the linker.

mod caches;
mod clocks;
mod pins;
mod safe;

use specgen_board::{Exchange, Noticed};
use specgen_stm32::converters;

/// The machine on this board's converters.
type Machine = converters::Machine<{ clocks::DELAY }>;

/// A tick without its timer, under a name that the analyses of the image know.
#[unsafe(no_mangle)]
#[inline(never)]
fn specgen_tick(machine: &mut Machine, exchange: &mut Exchange, noticed: Noticed) -> bool {
    machine.tick(exchange, noticed)
}

/// Of the watchdog, µs: some hundred ticks, and starting the converters anew.
const WATCHDOG: u32 = 20_000;

#[rtic::app(device = embassy_stm32, peripherals = false, dispatchers = [CEC])]
mod app {
    use core::mem::MaybeUninit;

    use embassy_stm32::gpio::Input;
    use embassy_stm32::interrupt::{InterruptExt, Priority};
    use embassy_stm32::mode::Async;
    use embassy_stm32::peripherals::IWDG1;
    use embassy_stm32::usart::{RingBufferedUartRx, UartTx};
    use embassy_stm32::wdg::IndependentWatchdog;
    use specgen_board::{Desk, Exchange, Health, Noticed, Schedule};
    use specgen_link::Endpoint;
    use specgen_stm32::converters::BusCell;
    use specgen_stm32::{converters, serial, timer};

    use crate::{Machine, WATCHDOG, caches, clocks, pins};

    #[shared]
    struct Shared {
        exchange: Exchange,
    }

    #[local]
    struct Local {
        machine: Machine,
        schedule: Schedule,
        health: Health,
        watchdog: IndependentWatchdog<'static, IWDG1>,
        stop: Input<'static>,
        receiver: RingBufferedUartRx<'static>,
        sender: UartTx<'static, Async>,
        endpoint: Endpoint,
        desk: Desk,
    }

    #[init(local = [
        dac_bus: BusCell = MaybeUninit::uninit(),
        #[unsafe(link_section = ".axisram.ring")]
        ring: [u8; serial::RING] = [0; serial::RING],
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let core = &mut context.core;
        caches::enable(&mut core.MPU, &mut core.SCB, &mut core.CPUID);
        let wiring = pins::take(embassy_stm32::init(clocks::config()));
        let mut watchdog = IndependentWatchdog::new(wiring.watchdog, WATCHDOG);
        // From here on a start that does not come to its end is a reset.
        watchdog.unleash();

        let intact = controller::integrity::intact();
        let mut exchange = Exchange::new();
        let machine = converters::machine(wiring.adc, wiring.dac, context.local.dac_bus, intact);
        let (Some(mut machine), Ok(uart)) = (machine, wiring.uart) else { crate::safe::stop() };
        machine.start(&mut exchange.report);

        embassy_stm32::interrupt::USART3.set_priority(Priority::P8);
        let (sender, receiver) = uart.split();
        let receiver = receiver.into_ring_buffered(context.local.ring);
        let desk = Desk::new(&exchange);

        let mut schedule = Schedule::new(timer::period(clocks::TIMER), 0);
        if !timer::start(&mut schedule, clocks::TIMER) || link::spawn().is_err() {
            crate::safe::stop();
        }
        watchdog.pet();
        (
            Shared { exchange },
            Local {
                machine,
                schedule,
                health: Health::new(),
                watchdog,
                stop: wiring.stop,
                receiver,
                sender,
                endpoint: Endpoint::new(),
                desk,
            },
        )
    }

    /// One control tick.
    #[task(binds = TIM2, priority = 16, shared = [exchange], local = [machine, schedule, health, watchdog, stop])]
    fn tick(mut context: tick::Context) {
        let local = context.local;
        let begin = timer::now();
        timer::acknowledge();
        let due = local.schedule.begin(begin);
        timer::arm(due.next);
        let noticed = Noticed { missed: due.missed, stop: local.stop.is_high() };
        context.shared.exchange.lock(|exchange| {
            if crate::specgen_tick(local.machine, exchange, noticed) {
                timer::arm(local.schedule.restart(timer::now()));
            }
            exchange.report.took(due.late, timer::now().wrapping_sub(begin));
            if local.health.tick(exchange.beat, due.missed, exchange.report.amplifier_on) {
                local.watchdog.pet();
            }
        });
    }

    /// Requests of the host.
    #[task(
        priority = 1,
        shared = [exchange],
        local = [
            receiver, sender, endpoint, desk,
            #[unsafe(link_section = ".axisram.answer")]
            answer: [u8; serial::ANSWER] = [0; serial::ANSWER],
        ]
    )]
    async fn link(mut context: link::Context) {
        let local = context.local;
        serial::serve(local.receiver, local.sender, local.endpoint, local.desk, local.answer, |action| {
            context.shared.exchange.lock(|exchange| action(exchange));
        })
        .await;
    }

    #[idle(shared = [exchange])]
    fn idle(mut context: idle::Context) -> ! {
        loop {
            context.shared.exchange.lock(|exchange| exchange.beat = exchange.beat.wrapping_add(1));
            cortex_m::asm::wfi();
        }
    }
}
