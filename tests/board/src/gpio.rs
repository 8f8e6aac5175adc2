//! GPIO: outputs by ODR and BSRR, inputs by what drives the pin, else by the pull.

use crate::part::Pin;

const PORTS: usize = 11;
/// Of a port in the address space.
pub const SPAN: u32 = 0x400 * PORTS as u32;

#[derive(Default, Clone, Copy)]
struct Port {
    /// MODER, OTYPER, OSPEEDR, PUPDR.
    settings: [u32; 4],
    output: u32,
    /// LCKR, AFRL, AFRH.
    others: [u32; 3],
    /// Pins that are driven from outside, and how.
    driven: u32,
    level: u32,
}

/// All ports.
#[derive(Default)]
pub struct Gpio {
    ports: [Port; PORTS],
}

impl Gpio {
    /// Drives a pin from outside.
    pub fn drive(&mut self, (port, pin): Pin, high: bool) {
        let port = &mut self.ports[port];
        port.driven |= 1 << pin;
        port.level = port.level & !(1 << pin) | u32::from(high) << pin;
    }

    /// A contact from the pin to ground, closed or open.
    pub fn contact(&mut self, pin: Pin, open: bool) {
        self.drive(pin, false);
        if open {
            self.ports[pin.0].driven &= !(1 << pin.1);
        }
    }

    /// Whether the pin is an output.
    pub fn is_output(&self, (port, pin): Pin) -> bool {
        self.ports[port].settings[0] >> (2 * pin) & 3 == 1
    }

    /// The alternate function that drives the pin.
    pub fn alternate(&self, (port, pin): Pin) -> Option<u32> {
        let port = &self.ports[port];
        let function = port.others[1 + (pin / 8) as usize] >> (4 * (pin % 8)) & 0xf;
        (port.settings[0] >> (2 * pin) & 3 == 2).then_some(function)
    }

    /// The level of a pin.
    pub fn level(&self, pin: Pin) -> bool {
        let (port, number) = pin;
        let at = &self.ports[port];
        if self.is_output(pin) {
            at.output >> number & 1 == 1
        } else if at.driven >> number & 1 == 1 {
            at.level >> number & 1 == 1
        } else {
            at.settings[3] >> (2 * number) & 3 == 1
        }
    }

    pub fn read(&self, offset: u32) -> u32 {
        let number = (offset / 0x400) as usize;
        let port = &self.ports[number];
        match offset % 0x400 {
            at @ (0 | 4 | 8 | 0xc) => port.settings[at as usize / 4],
            0x10 => (0..16).fold(0, |word, pin| word | u32::from(self.level((number, pin))) << pin),
            0x14 => port.output,
            at @ (0x1c | 0x20 | 0x24) => port.others[(at as usize - 0x1c) / 4],
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        let port = &mut self.ports[(offset / 0x400) as usize];
        match offset % 0x400 {
            at @ (0 | 4 | 8 | 0xc) => port.settings[at as usize / 4] = value,
            0x14 => port.output = value & 0xffff,
            // Set wins over reset.
            0x18 => port.output = port.output & !(value >> 16) | value & 0xffff,
            at @ (0x1c | 0x20 | 0x24) => port.others[(at as usize - 0x1c) / 4] = value,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_follows_its_bits_and_an_input_what_drives_it() {
        let mut gpio = Gpio::default();
        gpio.write(0x400, 1 << 2);
        gpio.write(0x418, 1 << 1);
        assert!(gpio.level((1, 1)));
        gpio.write(0x418, 1 << 17);
        assert!(!gpio.level((1, 1)));
        assert!(!gpio.level((1, 5)));
        gpio.write(0x40c, 1 << 10);
        assert!(gpio.level((1, 5)));
        gpio.drive((1, 5), false);
        assert!(!gpio.level((1, 5)));
        for open in [true, false, true] {
            gpio.contact((1, 5), open);
            assert_eq!(gpio.level((1, 5)), open, "pulled up");
        }
        gpio.write(0x40c, 0);
        assert!(!gpio.level((1, 5)), "without a pull an open contact is low here");
    }
}
