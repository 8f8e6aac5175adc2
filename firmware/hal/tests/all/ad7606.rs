//! Tests of the ADC driver with frames of the data sheet, and with parts that answer differently.

use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as PinStep};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction as SpiStep};
use specgen_hal::ad7606::{Ad7606, BusyLine, CONVST_LOW, POLLS, Window};
use specgen_hal::{Fault, Gauges, Pulse};

/// Codes of 16 bits in two's complement, as the part sends them.
fn frame16(codes: [i16; 8]) -> Vec<u8> {
    codes.iter().flat_map(|code| code.to_be_bytes()).collect()
}

/// Codes of 18 bits without gaps, assembled as text, independently of the driver.
fn frame18(codes: [i32; 8]) -> Vec<u8> {
    let text: String = codes.iter().map(|code| format!("{:018b}", code & 0x3_ffff)).collect();
    assert_eq!(text.len(), 144);
    (0..18).map(|byte| u8::from_str_radix(&text[8 * byte..8 * byte + 8], 2).unwrap()).collect()
}

/// The 2.5 V reference at ±5 V, 16 bits: a quarter of the range above zero.
const REFERENCE: i16 = 0x4000;

fn window(bits: u32) -> Window {
    Window::around(2500, 50, 5000, bits)
}

type Start = Pulse<Pin, NoopDelay, CONVST_LOW>;

/// A line that is high and gets so many low pulses.
fn pulses(count: usize) -> Start {
    let steps: Vec<PinStep> = (0..count).flat_map(|_| [PinStep::set(State::Low), PinStep::set(State::High)]).collect();
    Pulse { pin: Pin::new(&steps), delay: NoopDelay }
}

fn answer(frame: &[u8]) -> Vec<SpiStep<u8>> {
    vec![
        SpiStep::transaction_start(),
        SpiStep::transfer_in_place(vec![0; frame.len()], frame.to_vec()),
        SpiStep::transaction_end(),
    ]
}

/// One read: BUSY at each poll, and the steps of the SPI.
fn read<const BITS: usize>(busy: &[State], spi: &[SpiStep<u8>]) -> Result<[i32; 6], Fault> {
    // After the frame BUSY is polled once more.
    let after = (!spi.is_empty()).then_some(Low);
    read_with_busy::<BITS>(busy, after, spi)
}

fn read_with_busy<const BITS: usize>(
    busy: &[State],
    after: Option<State>,
    spi: &[SpiStep<u8>],
) -> Result<[i32; 6], Fault> {
    let looks: Vec<PinStep> = busy.iter().copied().chain(after).map(PinStep::get).collect();
    let (spi, start, busy, reset) = (Spi::new(spi), pulses(1), Pin::new(&looks), Pin::new(&[]));
    let mut adc: Ad7606<BITS, _, _, _, _, _> = Ad7606::new(spi, start, busy, reset, NoopDelay, window(BITS as u32));
    let result = adc.begin().and_then(|()| adc.read());
    let (mut spi, mut start, mut busy, mut reset, _) = adc.release();
    spi.done();
    start.pin.done();
    busy.done();
    reset.done();
    result
}

use State::{High, Low};

#[test]
fn codes_in_twos_complement_become_codes_from_zero_on() {
    let frame = frame16([i16::MIN, -1, 0, 1, i16::MAX, 0x1234, 77, REFERENCE]);
    let codes = read::<16>(&[High, High, Low], &answer(&frame));
    assert_eq!(codes, Ok([0, 0x7fff, 0x8000, 0x8001, 0xffff, 0x9234]));
}

#[test]
fn codes_of_18_bits_come_without_gaps() {
    let frame = frame18([-131_072, -1, 0, 1, 131_071, 0x1_2345, 77, 0x1_0000]);
    let codes = read::<18>(&[High, Low], &answer(&frame));
    assert_eq!(codes, Ok([0, 0x1_ffff, 0x2_0000, 0x2_0001, 0x3_ffff, 0x3_2345]));
}

#[test]
fn a_conversion_that_does_not_begin_is_a_fault() {
    assert_eq!(read::<16>(&[Low], &[]), Err(Fault::NotStarted));
}

#[test]
fn a_conversion_that_does_not_end_is_given_up() {
    assert_eq!(read::<16>(&vec![High; 1 + POLLS as usize], &[]), Err(Fault::NotEnded));
    // The last poll still counts.
    let mut looks = vec![High; POLLS as usize];
    looks.push(Low);
    let frame = frame16([3, 3, 3, 3, 3, 3, 3, REFERENCE]);
    assert_eq!(read::<16>(&looks, &answer(&frame)), Ok([0x8003; 6]));
}

/// A line that latches falling edges: its level at each poll, whether it falls after watching began, and whether it is watched.
struct Latching(std::vec::IntoIter<bool>, bool, bool);

impl BusyLine for Latching {
    fn is_high(&mut self) -> Result<bool, Fault> {
        self.0.next().ok_or(Fault::Pin)
    }

    fn watch(&mut self) {
        self.2 = true;
    }

    fn converts_again(&mut self) -> Result<bool, Fault> {
        assert!(self.2, "watched since it was low");
        Ok(self.1 | self.is_high()?)
    }
}

#[test]
fn a_conversion_that_no_tick_asked_for_is_a_fault() {
    let good = answer(&frame16([3, 3, 3, 3, 3, 3, 3, REFERENCE]));
    assert_eq!(read_with_busy::<16>(&[High, Low], Some(High), &good), Err(Fault::Again), "it still converts");
    for (falls, expected) in [(false, Ok([0x8003; 6])), (true, Err(Fault::Again))] {
        let busy = Latching(vec![true, true, false, false].into_iter(), falls, false);
        let mut adc: Ad7606<16, _, _, _, _, _> =
            Ad7606::new(Spi::new(&good), pulses(1), busy, Pin::new(&[]), NoopDelay, window(16));
        assert_eq!(adc.begin().and_then(|()| adc.read()), expected);
        let (mut spi, mut start, _, mut reset, _) = adc.release();
        spi.done();
        start.pin.done();
        reset.done();
    }
}

#[test]
fn a_stuck_data_line_is_a_fault() {
    for byte in [0x00, 0xff] {
        assert_eq!(read::<16>(&[High, Low], &answer(&[byte; 16])), Err(Fault::Blank));
        assert_eq!(read::<18>(&[High, Low], &answer(&[byte; 18])), Err(Fault::Blank));
    }
}

/// A frame that is shifted by a bit, and a range of ±10 V instead of ±5 V.
#[test]
fn a_frame_whose_reference_is_elsewhere_is_a_fault() {
    let good = frame16([5, -5, 5, -5, 5, -5, 5, REFERENCE]);
    for shift in 1..16 {
        let bits: String = good.iter().map(|byte| format!("{byte:08b}")).collect();
        let shifted = format!("{}{}", &bits[shift..], &bits[..shift]);
        let frame: Vec<u8> = (0..16).map(|i| u8::from_str_radix(&shifted[8 * i..8 * i + 8], 2).unwrap()).collect();
        assert_eq!(read::<16>(&[High, Low], &answer(&frame)), Err(Fault::Reference), "shifted by {shift}");
    }
    let other_range = frame16([5, -5, 5, -5, 5, -5, 5, REFERENCE / 2]);
    assert_eq!(read::<16>(&[High, Low], &answer(&other_range)), Err(Fault::Reference));
    assert!(read::<16>(&[High, Low], &answer(&good)).is_ok());
}

#[test]
fn the_window_is_in_codes_of_the_part() {
    // 2.45 V and 2.55 V at ±5 V: 7.45/10 and 7.55/10 of 2^16.
    assert_eq!(window(16), Window { low: 48_824, high: 49_479 });
    assert_eq!(window(18), Window { low: 195_297, high: 197_918 });
}

/// The start: reset, then one conversion that must be valid.
fn start(busy: &[State], spi: &[SpiStep<u8>]) -> Result<(), Fault> {
    let reset = [PinStep::set(High), PinStep::set(Low)];
    let after = (!spi.is_empty()).then_some(Low);
    let looks: Vec<PinStep> = busy.iter().copied().chain(after).map(PinStep::get).collect();
    let (spi, start, busy, reset) = (Spi::new(spi), pulses(1), Pin::new(&looks), Pin::new(&reset));
    let mut adc: Ad7606<16, _, _, _, _, _> = Ad7606::new(spi, start, busy, reset, NoopDelay, window(16));
    let result = adc.start();
    let (mut spi, mut start, mut busy, mut reset, _) = adc.release();
    spi.done();
    start.pin.done();
    busy.done();
    reset.done();
    result
}

#[test]
fn start_resets_the_part_and_proves_it() {
    assert_eq!(start(&[High, Low], &answer(&frame16([0, 0, 0, 0, 0, 0, 0, REFERENCE]))), Ok(()));
    assert_eq!(start(&[Low], &[]), Err(Fault::NotStarted));
    assert_eq!(start(&[High, Low], &answer(&[0; 16])), Err(Fault::Blank));
}
