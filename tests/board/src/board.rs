//! The board: every device at its address, and what the pins do to the converters.

use specgen_cycles::Cost;

use crate::ad5686r::Ad5686r;
use crate::ad7606::Ad7606;
use crate::dma::Dma;
use crate::enable::Enable;
use crate::exti::Exti;
use crate::fault::Fault;
use crate::gpio::{self, Gpio};
use crate::line::Line;
use crate::meter::Meter;
use crate::mpu::{self, Access, Mpu};
use crate::nvic::Nvic;
use crate::part::{
    DMA_INTERRUPTS, Family, HSE_ON, PLLS_ON, PULSES_FUNCTION, Part, Pin, SECURED, SPI1, SUPPLY_INTERRUPT, TIM1, TIM2,
    TIM2_INTERRUPT,
};
use crate::plant::Plant;
use crate::pulses::Pulses;
use crate::rcc::{self, Clocks};
use crate::spi::Spi;
use crate::store::{self, Store};
use crate::time::{MICROSECOND, Time, cycle, microseconds};
use crate::timer::Timer;
use crate::unicorn::{Core, Guest, Register};
use crate::usart::Usart;
use crate::violations::Violations;
use crate::watchdog::Watchdog;

/// How often the line and the commands are looked at.
const LOOK: Time = 100 * MICROSECOND;
const WFI: u32 = 0xbf30;
/// Of the core: whether its caches are on.
const CCR: u32 = 0xe000_ed14;
/// Below this address is code that the program has copied.
pub const TIGHTLY: u32 = 0x1_0000;
/// SYSCFG_PWRCR of an H7, whose bit 0 is voltage scale 0, and what the core may have without it, Hz.
const OVERDRIVE: u32 = 0x5800_042c;
const WITHOUT_OVERDRIVE: u64 = 400_000_000;
const CYCCNT: u32 = 0xe000_1004;

/// Why the core stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// An exception is due before the instruction at this address.
    Exception { number: usize, at: u32 },
    /// It came to the address that means the end of an exception.
    Return,
    /// It sleeps at this address.
    Sleep { at: u32 },
    /// A reset.
    Reset,
    /// Line and commands are to be looked at, before the instruction at this address.
    Look { at: u32 },
}

/// Devices that a reset sets back.
struct Devices {
    nvic: Nvic,
    store: Store,
    gpio: Gpio,
    timer: Timer,
    enable: Enable,
    pulses: Pulses,
    /// Of the ADC and of the DACs.
    spi: [Spi; 2],
    dma: Dma,
    usart: Usart,
    watchdog: Watchdog,
    exti: Exti,
    mpu: Mpu,
    clocks: Clocks,
}

impl Devices {
    /// `cause`: bits of [`Part::reset_cause`].
    fn new(part: &Part, cause: u32) -> Self {
        let mut store = Store::default();
        // HSI is on.
        store.set(part.rcc, 1);
        store.set(part.reset_cause.register, cause);
        if let Some([address, word]) = part.identity {
            store.set(address, word);
        }
        let clocks = rcc::clocks(part.family, part.rcc, &store);
        Self {
            nvic: Nvic::new(),
            store,
            gpio: Gpio::default(),
            timer: Timer::default(),
            enable: Enable::default(),
            pulses: Pulses::default(),
            spi: [Spi::new(part.family), Spi::new(part.family)],
            dma: Dma::default(),
            usart: Usart::new(part.family, part.usart),
            watchdog: Watchdog::new(),
            exti: Exti::default(),
            mpu: Mpu::default(),
            clocks,
        }
    }
}

/// Pins that lead to a part, and how they stand: CONVST, CS, RESET of the ADC, both SYNC, LDAC, enable, triggers.
#[derive(Clone, Copy, PartialEq)]
struct Levels {
    convst: bool,
    select: bool,
    reset: bool,
    sync: [bool; 2],
    ldac: bool,
    enable: bool,
    triggers: [bool; 4],
}

pub struct Board {
    pub part: &'static Part,
    devices: Devices,
    /// From `part.flash` on, and what is copied from it to address 0 and on.
    code: [Vec<u8>; 2],
    pub now: Time,
    /// Edges of CONVST that the ADC took.
    samples: u64,
    /// Of the core.
    cycle: Time,
    advanced: Time,
    /// When something happens next.
    due: Time,
    looked: Time,
    cost: Cost,
    pub instructions: u64,
    /// Instructions that still belong to an IT block; whether this one does, and whether one that did has used memory.
    conditional: u32,
    in_block: bool,
    used_in_block: bool,
    levels: Levels,
    pub adc: Ad7606,
    pub dacs: [Ad5686r; 2],
    plant: Plant,
    /// The part whose fault stops all: an answer that never came.
    pub broken: Option<String>,
    bits: [u32; 2],
    pub violations: Violations,
    pub meter: Meter,
    pub stop: Stop,
    pub resets: u32,
    /// Lowest address of the stack at an exception.
    pub stack: u32,
    pub faults: Vec<Fault>,
    /// What the enable line did, and what else there is to say.
    pub log: Vec<String>,
    /// Registers without a model that were touched.
    pub unmodelled: std::collections::BTreeSet<u32>,
}

impl Board {
    /// `bits`: of the ADC and of a gauge; `modelled`: cycles by the model of [`Cost`].
    pub fn new(part: &'static Part, code: [Vec<u8>; 2], bits: [u32; 2], plant: Plant, modelled: bool) -> Self {
        let cause = &part.reset_cause;
        let devices = Devices::new(part, cause.power | cause.brown_out | cause.pin);
        let levels = Levels {
            convst: true,
            select: true,
            reset: false,
            sync: [true; 2],
            ldac: true,
            enable: false,
            triggers: [false; 4],
        };
        let mut board = Self {
            part,
            samples: 0,
            cycle: cycle(devices.clocks.core),
            devices,
            code,
            now: 0,
            advanced: 0,
            due: 0,
            looked: 0,
            cost: Cost::new(part.family, modelled),
            instructions: 0,
            conditional: 0,
            in_block: false,
            used_in_block: false,
            levels,
            adc: Ad7606::new(bits[0]),
            dacs: [Ad5686r::new("DAC 1"), Ad5686r::new("DAC 2")],
            plant,
            broken: None,
            bits,
            violations: Violations::default(),
            meter: Meter::default(),
            stop: Stop::Reset,
            resets: 0,
            stack: u32::MAX,
            faults: Vec::new(),
            log: Vec::new(),
            unmodelled: std::collections::BTreeSet::new(),
        };
        board.clocked();
        board.contact();
        board
    }

    /// The microcontroller is reset; the converters are not.
    pub fn reset(&mut self, why: &str) {
        self.say(&format!("reset: {why}"));
        let known = &self.part.reset_cause;
        let cause = match why {
            "watchdog" => known.watchdog,
            "brown-out" => known.brown_out,
            _ => known.software,
        };
        // What the program did not clear is still there.
        let before = self.devices.store.word(known.register);
        self.devices = Devices::new(self.part, before | cause | known.pin);
        self.resets += 1;
        self.conditional = 0;
        self.meter = Meter::default();
        self.clocked();
        self.contact();
    }

    pub fn say(&mut self, text: &str) {
        self.log.push(format!("{:.3} ms: {text}", microseconds(self.now) / 1e3));
    }

    pub fn nvic(&mut self) -> &mut Nvic {
        &mut self.devices.nvic
    }

    /// Whether the amplifiers are on.
    pub fn enabled(&self) -> bool {
        self.levels.enable
    }

    pub fn has(&self, fault: Fault) -> bool {
        self.faults.contains(&fault)
    }

    /// Puts a fault in.
    pub fn fail(&mut self, fault: Fault) {
        self.say(&format!("fault {fault:?}"));
        self.faults.push(fault);
        match fault {
            Fault::Adc(fault) => self.adc.fault = Some(fault),
            Fault::Dac(fault) => self.dacs[0].fault = Some(fault),
            Fault::Stop | Fault::Amplifier => self.contact(),
            Fault::HangStop => {
                self.faults.extend([Fault::Hang, Fault::Stop]);
                self.contact();
            }
            Fault::Clock => self.clock_failed(),
            Fault::Uart => self.devices.usart.damaged = true,
            Fault::Noise => self.devices.usart.noise = true,
            _ => {}
        }
    }

    /// Takes all faults away.
    pub fn heal(&mut self) {
        self.say("healed");
        self.faults.clear();
        self.adc.heal();
        self.dacs[0].fault = None;
        self.devices.usart.noise = false;
        self.contact();
    }

    /// The clock at the HSE pin stops: with the clock security system the part goes on with HSI, without it the core stands.
    fn clock_failed(&mut self) {
        let (rcc, switch) = (self.part.rcc, self.part.rcc + self.part.switch);
        let control = self.devices.store.word(rcc);
        if control & HSE_ON == 0 {
            return;
        }
        if control & SECURED == 0 {
            self.faults.push(Fault::Hang);
            return;
        }
        self.devices.store.set(rcc, control & !(HSE_ON | PLLS_ON));
        let chosen = self.devices.store.word(switch);
        self.devices.store.set(switch, chosen & !7);
        self.clocked();
        self.devices.enable.clock_failed();
        self.pins();
    }

    /// Whether its failure is an exception of the core.
    pub fn is_secured(&self) -> bool {
        self.devices.store.word(self.part.rcc) & SECURED != 0
    }

    /// A debugger takes the core, for so long, or gives it back. The watchdog stands still meanwhile: that is the debugger's doing.
    pub fn hold(&mut self, time: Option<Time>) {
        self.devices.enable.frozen = time.is_some() && self.devices.store.word(self.part.freeze) & 1 == 1;
        self.devices.watchdog.frozen(time.unwrap_or(0));
        self.pins();
    }

    /// A tick begins.
    pub fn tick_begins(&mut self) {
        self.meter.begin(self.now, self.instructions);
        if self.has(Fault::Supply) {
            self.faults.retain(|fault| *fault != Fault::Supply);
            self.say("fault Supply, in a tick");
            self.devices.nvic.line(SUPPLY_INTERRUPT, true);
        }
        self.check_access();
    }

    /// An M7 reads ahead of its program where it has access: it must have none where no memory is, and some where there is.
    fn check_access(&mut self) {
        let part = self.part;
        if part.family != Family::H7 {
            return;
        }
        for [base, length] in part.memories {
            let last = base + (length - 1);
            let beyond = last.wrapping_add(1);
            if [*base, last].iter().any(|at| self.devices.mpu.access(*at) == Access::None) {
                self.violations.note("MPU", &format!("no access to memory at {base:#x}"), self.now);
            }
            if self.devices.mpu.access(beyond) != Access::None {
                self.violations.note("MPU", &format!("absent memory at {beyond:#x} may be read ahead"), self.now);
            }
        }
        for absent in [0x6000_0000, 0xdfff_ffff] {
            if self.devices.mpu.access(absent) != Access::None {
                self.violations.note("MPU", &format!("absent memory at {absent:#x} may be read ahead"), self.now);
            }
        }
    }

    /// The emergency contact works on the enable line by itself; that of the amplifiers is read.
    fn contact(&mut self) {
        let open = self.has(Fault::Amplifier);
        self.devices.gpio.contact(self.part.fault, open);
        self.devices.enable.contact(self.has(Fault::Stop));
        self.pins();
    }

    /// The registers of the clocks changed.
    fn clocked(&mut self) {
        let clocks = rcc::clocks(self.part.family, self.part.rcc, &self.devices.store);
        self.devices.clocks = clocks;
        self.cycle = cycle(clocks.core.max(1));
        self.devices.timer.clock(self.now, clocks.timer.max(1));
        self.devices.pulses.clock(clocks.timer.max(1));
        if clocks.core > WITHOUT_OVERDRIVE && self.devices.store.word(OVERDRIVE) & 1 == 0 {
            self.violations.note("PWR", "more than 400 MHz without voltage scale 0", self.now);
        }
        for (spi, hertz) in self.devices.spi.iter_mut().zip(clocks.spi) {
            spi.clock(hertz.max(1));
        }
        self.devices.usart.clock(clocks.usart.max(1));
        self.schedule();
    }

    /// Moves line bytes; true once per look.
    pub fn look(&mut self, line: Option<&mut Line>) {
        self.looked = self.now;
        let usart = &mut self.devices.usart;
        if let Some(line) = line {
            line.exchange(self.now, &mut usart.incoming, &mut usart.outgoing);
        }
        self.schedule();
    }

    /// Whether line and commands are to be looked at.
    pub fn due_look(&self) -> bool {
        self.now >= self.looked + LOOK
    }

    /// The converters as at power-up.
    pub fn power_up(&mut self) {
        self.adc = Ad7606::new(self.bits[0]);
        self.dacs = [Ad5686r::new("DAC 1"), Ad5686r::new("DAC 2")];
        self.faults.clear();
    }

    /// Whether times are by the model of [`Cost`].
    pub fn is_modelled(&self) -> bool {
        self.cost.is_modelled()
    }

    /// What entering or leaving an exception takes.
    pub fn entry(&self) -> Time {
        self.cycle * Cost::EXCEPTION
    }

    /// The stack reached down to here.
    pub fn lowest_stack(&mut self, address: u32) {
        self.stack = self.stack.min(address);
    }

    /// Clocks and rate, to show.
    pub fn clock_text(&self) -> String {
        let Clocks { core, timer, spi, usart } = self.devices.clocks;
        let baud = self.devices.usart.baud();
        format!("core={core} timer={timer} spi={spi:?} usart={usart} baud={baud}")
    }

    fn schedule(&mut self) {
        let Devices { timer, pulses, usart, watchdog, dma, .. } = &self.devices;
        let events = [
            timer.next(self.advanced),
            pulses.next(),
            usart.next(self.now, dma),
            watchdog.due,
            Some(self.looked + LOOK),
        ];
        self.due = events.into_iter().flatten().min().unwrap_or(Time::MAX);
    }

    /// Goes on to the next event, asleep.
    pub fn sleep(&mut self, core: &Core<'_>) {
        self.now = self.now.max(self.due);
        self.advance(core);
    }

    /// What is due by now happens.
    fn advance(&mut self, core: &Core<'_>) {
        self.advance_timers();
        self.devices.usart.advance(self.now, &mut self.devices.dma, core);
        self.lines();
        self.schedule();
    }

    /// TIM2, and the timer that it starts, whose edges come at their own times.
    fn advance_timers(&mut self) {
        let due = self.devices.timer.next(self.advanced).filter(|at| *at <= self.now);
        self.devices.timer.advance(self.advanced, self.now);
        self.advanced = self.now;
        if let Some(at) = due.filter(|_| self.devices.timer.leads()) {
            self.devices.pulses.trigger(at);
        }
        let now = self.now;
        while let Some(at) = self.devices.pulses.next().filter(|at| *at <= now) {
            self.now = at;
            self.advance_spi();
            self.devices.pulses.pass(at);
            self.pins();
        }
        self.now = now;
    }

    /// Interrupt lines as the devices have them.
    fn lines(&mut self) {
        let Devices { nvic, timer, usart, dma, .. } = &mut self.devices;
        nvic.line(TIM2_INTERRUPT, timer.line());
        nvic.line(self.part.usart_interrupt, usart.line());
        for (stream, interrupt) in DMA_INTERRUPTS.into_iter().enumerate() {
            nvic.line(interrupt, dma.line(stream));
        }
    }

    /// Whether the watchdog has bitten.
    pub fn bitten(&self) -> bool {
        self.devices.watchdog.due.is_some_and(|due| due <= self.now)
    }

    /// Bytes on the converters' wires.
    fn advance_spi(&mut self) {
        let [first, second] = &mut self.devices.spi;
        first.advance(self.now, |byte| self.adc.exchange(byte, &mut self.violations));
        second.advance(self.now, |byte| {
            let [first, second] = &mut self.dacs;
            let answers = [first, second].map(|dac| dac.exchange(byte, &mut self.violations));
            match answers {
                [None, None] => {
                    self.violations.note("DAC", "SCLK without SYNC", byte.begin);
                    0xff
                }
                [Some(_), Some(_)] => {
                    self.violations.note("DAC", "both parts drive SDO", byte.begin);
                    0xff
                }
                [Some(value), None] | [None, Some(value)] => value,
            }
        });
    }

    /// Drives the input line.
    pub fn drive_input(&mut self, high: bool) {
        self.devices.gpio.drive(self.part.input, high);
        self.say(&format!("input {} after sample {}", u8::from(high), self.samples));
    }

    /// What pins that changed do.
    fn pins(&mut self) {
        let gpio = &self.devices.gpio;
        let level = |pin: Pin, floating: bool| if gpio.is_output(pin) { gpio.level(pin) } else { floating };
        let part = self.part;
        let [convst, ldac] = [part.convst, part.ldac];
        let timed = |pin: Pin, channel: usize| match gpio.alternate(pin) {
            Some(PULSES_FUNCTION) => self.devices.pulses.level(channel, self.now),
            _ => level(pin, true),
        };
        let levels = Levels {
            convst: timed(convst, part.channels[0]),
            select: level(part.adc_select, true),
            reset: level(part.adc_reset, false),
            sync: part.dac_select.map(|pin| level(pin, true)),
            ldac: timed(ldac, part.channels[1]),
            enable: match part.enable {
                (pin, channel) if gpio.alternate(pin).is_some() => self.devices.enable.level(channel),
                (pin, _) => level(pin, false),
            },
            triggers: part.triggers.map(|pin| level(pin, false)),
        };
        let before = std::mem::replace(&mut self.levels, levels);
        if before == levels {
            return;
        }
        let now = self.now;
        let moving = self.devices.spi.each_ref().map(Spi::moves);
        let Self { adc, dacs, violations, .. } = self;
        if levels.reset != before.reset {
            adc.reset(levels.reset, now, violations);
        }
        if levels.select != before.select {
            adc.select(!levels.select, moving[0], now, violations);
        }
        for (dac, (after, before)) in dacs.iter_mut().zip(levels.sync.iter().zip(before.sync)) {
            if *after != before {
                dac.select(!after, moving[1], now, violations);
            }
        }
        if levels.ldac != before.ldac {
            dacs.iter_mut().for_each(|dac| dac.ldac(levels.ldac, now, violations));
        }
        if levels.convst != before.convst && adc.convst(levels.convst, now, violations) {
            self.meter.sampled(now);
            self.samples += 1;
            match self.plant.sample(now, self.bits[1]) {
                Ok(codes) => {
                    let reference = self.dacs[0].reference();
                    self.adc.sample(codes.map(|code| code << (self.bits[0] - self.bits[1])), reference);
                }
                Err(text) => self.broken = Some(text),
            }
        }
        for (line, (after, before)) in levels.triggers.into_iter().zip(before.triggers).enumerate() {
            if after != before {
                self.say(&format!("trigger {line} {} after sample {}", u8::from(after), self.samples));
            }
        }
        if levels.enable != before.enable {
            self.say(if levels.enable { "amplifiers on" } else { "amplifiers off" });
        }
        if !levels.ldac && before.ldac {
            self.meter.loaded(now);
        }
        if levels.enable != before.enable || (!levels.ldac && before.ldac) {
            let [a, b] = self.dacs.each_ref().map(|dac| dac.output);
            self.plant.actuate(levels.enable, [a[0], a[1], a[2], b[0], b[1], b[2]]);
        }
    }

    fn fetch(&self, address: u32) -> Option<u32> {
        let [flash, copied] = &self.code;
        let at = if address < TIGHTLY { address } else { address.checked_sub(self.part.flash)? } as usize;
        let code = if address < TIGHTLY { copied } else { flash };
        Some(u32::from(u16::from_le_bytes(code.get(at..at + 2)?.try_into().ok()?)))
    }
}

impl Guest for Board {
    fn instruction(&mut self, core: &Core<'_>, address: u32, size: u32) -> bool {
        if self.now >= self.due {
            self.advance(core);
            if self.bitten() || self.devices.nvic.reset {
                self.stop = Stop::Reset;
                return false;
            }
            if self.conditional == 0 && self.now >= self.looked + LOOK {
                self.stop = Stop::Look { at: address };
                return false;
            }
        }
        self.in_block = self.conditional > 0;
        if !self.in_block && std::mem::take(&mut self.used_in_block) {
            core.end_block();
        }
        if self.in_block {
            self.conditional -= 1;
        } else if self.devices.nvic.next().is_some() {
            let masks = [Register::PRIMASK, Register::BASEPRI].map(|register| core.get(register));
            if let Some(number) = self.devices.nvic.ready(masks[0], masks[1]) {
                self.stop = Stop::Exception { number, at: address };
                return false;
            }
        }
        let code = self.fetch(address).unwrap_or(0);
        if code == WFI && (self.devices.nvic.next().is_none() || self.has(Fault::Background)) {
            self.stop = Stop::Sleep { at: address };
            return false;
        }
        if code & 0xff00 == 0xbf00 && code & 0xf != 0 {
            self.conditional = 4 - (code & 0xf).trailing_zeros();
        }
        let second = if size == 4 { self.fetch(address + 2).unwrap_or(0) } else { 0 };
        self.now += self.cycle * self.cost.of(address, size, [code, second]);
        self.instructions += 1;
        true
    }

    fn data(&mut self, address: u32, write: bool) {
        self.used_in_block |= self.in_block;
        self.now += self.cycle * self.cost.data(address, write);
    }

    fn read(&mut self, address: u32, size: u32) -> u32 {
        self.now += self.cycle * self.cost.access(false);
        self.advance_spi();
        let aligned = address & !3;
        let part = self.part;
        let within = |base: u32, length: u32| address.wrapping_sub(base) < length;
        let devices = &mut self.devices;
        let word = match address {
            CYCCNT => (self.now / self.cycle) as u32,
            _ if Nvic::has(address) => return devices.nvic.read(address, size),
            _ if within(part.gpio, gpio::SPAN) => {
                devices.gpio.drive(part.busy, self.adc.busy(self.now));
                devices.gpio.read(aligned - part.gpio)
            }
            _ if within(TIM1, 0x400) => devices.enable.read(aligned - TIM1),
            _ if within(TIM2, 0x400) => {
                self.advance_timers();
                self.devices.timer.read(aligned - TIM2, self.now)
            }
            _ if within(part.pulses, 0x400) => {
                self.advance_timers();
                self.devices.pulses.read(aligned - part.pulses, self.now)
            }
            _ if within(SPI1, 0x400) => devices.spi[0].read(aligned - SPI1),
            _ if within(part.dac_spi, 0x400) => devices.spi[1].read(aligned - part.dac_spi),
            _ if within(part.dma, 0x400) => devices.dma.read(aligned - part.dma),
            _ if within(part.usart, 0x400) => {
                let word = devices.usart.read(aligned - part.usart);
                self.lines();
                word
            }
            _ if within(part.watchdog, 0x400) => devices.watchdog.read(aligned - part.watchdog),
            _ if aligned == part.pending => devices.exti.read(part, &devices.store, &self.adc, self.now),
            _ if aligned == part.rcc && self.faults.contains(&Fault::Clock) => {
                rcc::read(part.family, 0, devices.store.word(aligned)) & !rcc::HSE_READY
            }
            _ if within(part.rcc, 0x400) => rcc::read(part.family, aligned - part.rcc, devices.store.word(aligned)),
            _ if mpu::REGISTERS.contains(&address) => devices.mpu.read(aligned),
            _ if within(part.pwr, 0x400) => rcc::power(part.family, aligned - part.pwr, devices.store.word(aligned)),
            _ => {
                self.unmodelled.insert(aligned);
                devices.store.word(aligned)
            }
        };
        store::part(word, address, size)
    }

    fn write(&mut self, address: u32, size: u32, value: u32) {
        self.now += self.cycle * self.cost.access(true);
        self.advance_spi();
        self.advance_timers();
        let aligned = address & !3;
        let part = self.part;
        let within = |base: u32, length: u32| address.wrapping_sub(base) < length;
        let devices = &mut self.devices;
        let clocked = |offset: u32, bit: u32| devices.store.word(part.rcc + offset) >> bit & 1 == 1;
        if part.clocks.iter().any(|&[base, offset, bit]| within(base, 0x400) && !clocked(offset, bit)) {
            self.violations.note("RCC", "a device is written without its clock", self.now);
        }
        match address {
            _ if Nvic::has(address) => {
                devices.nvic.write(address, size, value);
                if devices.nvic.reset {
                    self.due = self.now;
                }
                return;
            }
            _ if within(part.gpio, gpio::SPAN) => {
                // BSRR takes halves as they are; every other register is changed in part.
                let offset = aligned - part.gpio;
                let before = devices.gpio.read(offset);
                devices.gpio.write(offset, store::merged(before, address, size, value));
                self.pins();
            }
            _ if within(TIM1, 0x400) => {
                devices.enable.write(aligned - TIM1, value);
                self.pins();
            }
            _ if within(TIM2, 0x400) => devices.timer.write(aligned - TIM2, value, self.now),
            _ if within(SPI1, 0x400) => devices.spi[0].write(aligned - SPI1, size, value, self.now),
            _ if within(part.dac_spi, 0x400) => devices.spi[1].write(aligned - part.dac_spi, size, value, self.now),
            _ if within(part.pulses, 0x400) => {
                devices.pulses.write(aligned - part.pulses, value, self.now);
                self.pins();
            }
            _ if within(part.dma, 0x400) => devices.dma.write(aligned - part.dma, value),
            _ if within(part.usart, 0x400) => devices.usart.write(aligned - part.usart, value),
            _ if within(part.watchdog, 0x400) => devices.watchdog.write(aligned - part.watchdog, value, self.now),
            _ if aligned == part.pending => devices.exti.write(part, value, &self.adc, self.now),
            _ if mpu::REGISTERS.contains(&address) => devices.mpu.write(aligned, value),
            _ if aligned == part.reset_cause.register && value & part.reset_cause.clear != 0 => {
                devices.store.set(aligned, 0);
            }
            _ if aligned == part.rcc + rcc::SOURCE
                && rcc::refused(part.family, devices.store.word(part.rcc), devices.store.word(aligned), value) =>
            {
                self.violations.note("RCC", "PLLCKSELR changed for a PLL that runs, which has no effect", self.now);
            }
            _ => {
                devices.store.write(address, size, value);
                if within(part.rcc, 0x400) {
                    self.clocked();
                } else if !within(part.pwr, 0x400) {
                    self.unmodelled.insert(aligned);
                    let [access, control] = [part.flash_access, CCR].map(|at| self.devices.store.word(at));
                    self.cost.configure(access, control);
                }
            }
        }
        self.lines();
        self.schedule();
    }
}
