//! The board: pins, clocks, timer and link of an STM32H743, and one tick. What runs it is in `src/bin`.

use controller::supervised::Machine;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{IWDG1, TIM2, USART3};
use embassy_stm32::rcc::{self, AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts};
use embedded_hal::delay::DelayNs;
use embedded_hal_bus::spi::ExclusiveDevice;
use embedded_io::{Read, ReadReady, Write};
use specgen_board::{
    Access, Board, Exchange, Health, LinkHandler, MachineSnapshot, PERIOD_NANOSECONDS, Probes, RequestContext,
    Schedule, Stopwatch, TargetStatus, catch_up,
};
use specgen_link::Endpoint;

use crate::ad7685::Chain;
use crate::dac80508::Dac80508;

/// Clock of TIM2, MHz.
const TIMER: u32 = 200;
/// What `cortex_m::asm::delay` gets through in a microsecond at most: two a cycle at 400 MHz.
const DELAY: u32 = 800;
/// Of the link. Slow enough that no byte is lost while a tick runs: there is no DMA here.
const BAUD: u32 = 115_200;
/// Words of the recorder.
pub const RECORD: usize = 6 * 1024;

bind_interrupts!(struct Interrupts {
    USART3 => usart::BufferedInterruptHandler<USART3>;
});

/// Waits at least as long as asked for.
#[derive(Debug, Clone, Copy)]
pub struct Cycles;

impl DelayNs for Cycles {
    fn delay_ns(&mut self, ns: u32) {
        cortex_m::asm::delay(ns.saturating_mul(DELAY) / 1000 + 1);
    }
}

type Bus = Spi<'static, Blocking, Master>;
type Pin = Output<'static>;
type Gauges = Chain<Bus, Pin, Cycles>;
type Amplifiers = Dac80508<ExclusiveDevice<Bus, Pin, Cycles>, Pin, Cycles>;

type OnBoard = Board<'static, Gauges, Amplifiers>;

/// A tick without its timer, under the name by which `specgen size` finds it in the image.
// SAFETY: nothing else has the name.
#[unsafe(no_mangle)]
#[inline(never)]
fn specgen_tick(board: &mut OnBoard, exchange: &mut Exchange, noticed: TargetStatus) -> bool {
    board.timed_tick(exchange, noticed, timer::now)
}

/// Everything that a tick needs.
pub struct Running {
    board: OnBoard,
    exchange: Exchange,
    schedule: Schedule,
    health: Health,
    watchdog: IndependentWatchdog<'static, IWDG1>,
    stop: Input<'static>,
    fault: Input<'static>,
}

/// The line to the host, served by the background.
pub struct Link {
    uart: BufferedUart<'static>,
    endpoint: Endpoint,
    handler: LinkHandler,
}

/// Clocks, pins, converters: the board at power-up, its amplifiers off. `machine` is at reset. None if something is not as it has
/// to be: then [`stop`].
pub fn start(
    machine: &'static mut Machine,
    record: &'static mut [u64; RECORD],
    kept: &'static mut MachineSnapshot,
    buffers: &'static mut [[u8; 512]; 2],
) -> Option<(Running, Link)> {
    let p = embassy_stm32::init(clocks());
    // First of all: the line that enables the amplifiers is driven, and low.
    let enable = Output::new(p.PE0, Level::Low, Speed::Low);
    let mut watchdog = IndependentWatchdog::new(p.IWDG1, 20_000);
    watchdog.unleash();

    let gauges = Chain::new(
        Spi::new_blocking(p.SPI1, p.PB3, p.PB5, p.PB4, spi(spi::MODE_0)),
        Output::new(p.PA8, Level::Low, Speed::VeryHigh),
        Cycles,
    );
    let dac = Spi::new_blocking(p.SPI4, p.PE2, p.PE6, p.PE5, spi(spi::MODE_1));
    let dac = ExclusiveDevice::new(dac, Output::new(p.PE4, Level::High, Speed::VeryHigh), Cycles).ok()?;
    let mut board = Board::new(gauges, Dac80508::new(dac, enable, Cycles), machine, controller::integrity::intact());
    let mut exchange = Exchange::new();
    exchange.record(record, kept);
    // Times of ticks; the stack is not measured.
    exchange.probes = Probes { hertz: TIMER * 1_000_000, ..Probes::NONE };
    board.start(&mut exchange.report);
    exchange.prepare();

    let mut line = usart::Config::default();
    line.baudrate = BAUD;
    let [send, receive] = buffers;
    let uart = BufferedUart::new(p.USART3, p.PD9, p.PD8, send, receive, Interrupts, line).ok()?;

    let mut schedule = Schedule::new(PERIOD, 0);
    timer::start(&mut schedule)?;
    // Contacts to ground: open is a stop, a fault of the amplifiers.
    let (stop, fault) = (Input::new(p.PB12, Pull::Up), Input::new(p.PB13, Pull::Up));
    let running = Running { board, exchange, schedule, health: Health::new(), watchdog, stop, fault };
    Some((running, Link { uart, endpoint: Endpoint::new(), handler: LinkHandler::new(Stopwatch::NONE) }))
}

/// 8 MHz from outside, core 400 MHz, timers 200 MHz, SPI 100 MHz.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    config.rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV1,
        mul: PllMul::MUL100,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config.rcc.voltage_scale = rcc::VoltageScale::Scale1;
    config
}

/// 12.5 MHz, which both parts take at 3.3 V.
fn spi(mode: spi::Mode) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = mode;
    config.frequency = Hertz(12_500_000);
    config
}

impl Running {
    /// One tick: to be called by the interrupt of TIM2, at the highest priority of all.
    pub fn tick(&mut self) {
        let begin = timer::now();
        timer::acknowledge();
        let due = self.schedule.begin(begin);
        timer::arm(due.next);
        let noticed = TargetStatus { missed: due.missed, stop: self.stop.is_high(), amplifier: self.fault.is_high() };
        if specgen_tick(&mut self.board, &mut self.exchange, noticed) {
            // It started the converters anew, which takes longer than a tick.
            timer::arm(self.schedule.restart(timer::now()));
        }
        let report = &mut self.exchange.report;
        report.record_tick(due.late, timer::now().wrapping_sub(begin), PERIOD.get());
        if self.health.tick(self.exchange.beat, due.missed, report.amplifier_on) {
            self.watchdog.pet();
        }
        // A dead background: the next tick ramps down.
        self.exchange.orphaned = self.health.is_orphaned();
    }

    /// For the background, with the tick held off: the shorter the better.
    pub fn access(&mut self, action: &mut dyn FnMut(&mut Exchange, &mut Machine)) {
        action(&mut self.exchange, self.board.machine_mut());
    }
}

impl Link {
    /// Shows the tick that the background is alive, and answers what has come in.
    pub fn serve(&mut self, with: &mut Access<'_>) {
        with(&mut |exchange, _| exchange.beat = exchange.beat.wrapping_add(1));
        // What the recorder's blocks begin with is written here, not in the tick.
        catch_up(with, timer::is_calm);
        let mut bytes = [0; 64];
        while self.uart.read_ready().unwrap_or(false) {
            // A frame in which a byte was lost has a wrong CRC, and the host asks again.
            let Ok(count) = self.uart.read(&mut bytes) else { break };
            for byte in bytes.iter().take(count) {
                let mut context = RequestContext { handler: &mut self.handler, with: &mut *with };
                if let Some(answer) = self.endpoint.push(*byte, &mut context) {
                    let _ = self.uart.write_all(answer);
                }
            }
        }
    }
}

/// Amplifiers off and nothing more: the watchdog, which only the tick feeds, resets the part within 20 ms, and reset leaves the
/// line to its pull-down.
pub fn stop() -> ! {
    cortex_m::interrupt::disable();
    loop {
        // PE0 low, by the register that needs no reading.
        pac::GPIOE.bsrr().write(|w| w.set_br(0, true));
    }
}

/// TIM2 as a free-running counter whose first compare channel says when a tick is due.
mod timer {
    use core::num::NonZeroU32;

    use super::{PERIOD_NANOSECONDS, Schedule, TIM2, TIMER, pac, rcc};

    /// Counts in a control period.
    pub const PERIOD: NonZeroU32 = {
        let counts = PERIOD_NANOSECONDS as u64 * TIMER as u64 / 1000;
        assert!(counts < 1 << 31, "timing.period is too long for the timer of this board");
        match NonZeroU32::new(counts as u32) {
            Some(counts) => counts,
            None => panic!("timing.period is shorter than a count of the timer"),
        }
    };

    /// The first interrupt comes one period later. None if the clock is not what it has to be.
    pub fn start(schedule: &mut Schedule) -> Option<()> {
        rcc::enable_and_reset::<TIM2>();
        pac::TIM2.psc().write_value(0);
        pac::TIM2.arr().write_value(u32::MAX);
        arm(schedule.restart(now()));
        acknowledge();
        pac::TIM2.dier().write(|w| w.set_ccie(0, true));
        pac::TIM2.cr1().write(|w| w.set_cen(true));
        (rcc::frequency::<TIM2>() == super::Hertz(TIMER * 1_000_000)).then_some(())
    }

    /// The counter.
    pub fn now() -> u32 {
        pac::TIM2.cnt().read()
    }

    /// Whether no interrupt comes while the machine is copied: 20 µs.
    pub fn is_calm() -> bool {
        let left = pac::TIM2.ccr(0).read().wrapping_sub(now());
        left > 20 * TIMER && left < u32::MAX / 2
    }

    /// The next interrupt comes at this counter value, or at once if it has passed.
    pub fn arm(next: u32) {
        pac::TIM2.ccr(0).write_value(next);
        if now().wrapping_sub(next) < u32::MAX / 2 {
            pac::TIM2.egr().write(|w| w.set_ccg(0, true));
        }
    }

    /// Takes the interrupt back: zeros clear, ones leave alone.
    pub fn acknowledge() {
        pac::TIM2.sr().write(|w| {
            w.0 = u32::MAX;
            w.set_ccif(0, false);
        });
    }
}

use timer::PERIOD;

/// Where the HAL's checks of itself end: its feature `defmt` keeps 8 KB of texts out of the image that nobody would read.
mod silent {
    #[defmt::panic_handler]
    fn failed() -> ! {
        core::panic!()
    }

    /// Drops what it gets.
    #[defmt::global_logger]
    struct Silent;

    // SAFETY: it holds nothing that two writers could spoil.
    unsafe impl defmt::Logger for Silent {
        fn acquire() {}

        unsafe fn flush() {}

        unsafe fn release() {}

        unsafe fn write(_: &[u8]) {}
    }
}

/// A panic of the HAL, and whatever else should not happen. The tick has no path that leads here.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    stop()
}
