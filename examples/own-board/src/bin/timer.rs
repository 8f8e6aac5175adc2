//! By a bare timer interrupt: what tick and background share lies behind a critical section.
#![no_std]
#![no_main]

use core::cell::RefCell;

use controller::supervised::{Machine, machine_at_reset};
use cortex_m_rt::{ExceptionFrame, entry, exception};
use critical_section::Mutex;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use own_board::machine::{RECORD, Running, start, stop};
use specgen_board::MachineSnapshot;

static RUNNING: Mutex<RefCell<Option<Running>>> = Mutex::new(RefCell::new(None));

/// Does something to the machine with all interrupts held off. Never nested, so that nothing else holds it.
fn with(action: impl FnOnce(&mut Running)) {
    critical_section::with(|section| {
        if let Ok(mut running) = RUNNING.borrow(section).try_borrow_mut()
            && let Some(running) = running.as_mut()
        {
            action(running);
        }
    });
}

#[entry]
fn main() -> ! {
    static mut MACHINE: Machine = machine_at_reset();
    static mut RECORDED: [u64; RECORD] = [0; RECORD];
    static mut KEPT: MachineSnapshot = MachineSnapshot::new();
    static mut BUFFERS: [[u8; 512]; 2] = [[0; 512]; 2];
    let Some(mut core) = cortex_m::Peripherals::take() else { stop() };
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
    let Some((running, mut link)) = start(MACHINE, RECORDED, KEPT, BUFFERS) else { stop() };
    critical_section::with(|section| RUNNING.borrow(section).replace(Some(running)));

    interrupt::USART3.set_priority(Priority::P8);
    interrupt::TIM2.set_priority(Priority::P0);
    // SAFETY: what the interrupt touches is there, and behind a critical section.
    unsafe { interrupt::TIM2.enable() };
    loop {
        link.serve(&mut |action| with(|running| running.access(action)));
    }
}

#[interrupt]
fn TIM2() {
    with(Running::tick);
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
