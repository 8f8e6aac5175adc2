//! By RTIC: the tick is a task of the highest priority, and the background locks what both share.
#![no_std]
#![no_main]

use cortex_m_rt::{ExceptionFrame, exception};
use own_board::machine::stop;

#[rtic::app(device = embassy_stm32, peripherals = false)]
mod app {
    use controller::supervised::{Machine, machine_at_reset};
    use embassy_stm32::interrupt::{self, InterruptExt, Priority};
    use own_board::machine::{Link, RECORD, Running, start, stop};
    use specgen_board::MachineSnapshot;

    #[shared]
    struct Shared {
        running: Running,
    }

    #[local]
    struct Local {
        link: Link,
    }

    #[init(local = [
        machine: Machine = machine_at_reset(),
        record: [u64; RECORD] = [0; RECORD],
        kept: MachineSnapshot = MachineSnapshot::new(),
        buffers: [[u8; 512]; 2] = [[0; 512]; 2],
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let core = &mut context.core;
        core.SCB.enable_icache();
        core.SCB.enable_dcache(&mut core.CPUID);
        let local = context.local;
        let Some((running, link)) = start(local.machine, local.record, local.kept, local.buffers) else { stop() };
        interrupt::USART3.set_priority(Priority::P8);
        (Shared { running }, Local { link })
    }

    #[task(binds = TIM2, priority = 16, shared = [running])]
    fn tick(mut context: tick::Context) {
        context.shared.running.lock(Running::tick);
    }

    #[idle(shared = [running], local = [link])]
    fn idle(mut context: idle::Context) -> ! {
        loop {
            context.local.link.serve(&mut |action| context.shared.running.lock(|running| running.access(action)));
        }
    }
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
