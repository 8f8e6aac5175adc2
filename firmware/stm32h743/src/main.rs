#![no_std]
#![no_main]
#[panic_handler]
fn p(_: &core::panic::PanicInfo) -> ! { loop {} }
#[rtic::app(device = embassy_stm32, peripherals = false)]
mod app {
    #[shared]
    struct Shared {}
    #[local]
    struct Local {}
    #[init]
    fn init(_: init::Context) -> (Shared, Local) {
        let _p = embassy_stm32::init(embassy_stm32::Config::default());
        (Shared {}, Local {})
    }
    #[task(binds = TIM2, priority = 14)]
    fn tick(_: tick::Context) {}
}
