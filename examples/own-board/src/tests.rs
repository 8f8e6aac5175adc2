//! The drivers against words of the data sheets, and against parts that do not answer as these say.

use embedded_hal::spi::{ErrorKind, ErrorType, SpiBus};
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction as Step};
use specgen_hal::{Amplifiers, Fault, Gauges};

use crate::ad7685::Chain;
use crate::dac80508::Dac80508;

/// What a tick reads of a chain that answers so.
fn read(answer: [u8; 14]) -> Result<[i32; 6], Fault> {
    let mut spi = Spi::new(&[Step::transfer_in_place(vec![0; 14], answer.to_vec()), Step::flush()]);
    let mut start = Pin::new(&[Level::set(State::High), Level::set(State::Low)]);
    let mut chain = Chain::new(spi.clone(), start.clone(), NoopDelay::new());
    let codes = chain.begin().and_then(|()| chain.read());
    spi.done();
    start.done();
    codes
}

const GOOD: [u8; 14] = [0x00, 0x01, 0xff, 0xff, 0x12, 0x34, 0x80, 0x00, 0x7f, 0xff, 0x00, 0x00, 0x80, 0x10];

#[test]
fn codes_are_straight_binary_next_part_first() {
    assert_eq!(read(GOOD), Ok([1, 65_535, 0x1234, 0x8000, 0x7fff, 0]));
}

#[test]
fn a_line_that_is_stuck_a_bit_too_many_and_a_missing_part_are_found() {
    assert_eq!(read([0; 14]), Err(Fault::Blank));
    assert_eq!(read([0xff; 14]), Err(Fault::Blank));
    // One bit late.
    let mut shifted = [0; 14];
    let mut carry = 0;
    for (slot, byte) in shifted.iter_mut().zip(GOOD) {
        *slot = byte >> 1 | carry << 7;
        carry = byte & 1;
    }
    assert_eq!(read(shifted), Err(Fault::Reference));
    // A part less: the grounded SDI of the first comes where half of the reference should be.
    let mut fewer = [0; 14];
    fewer[..12].copy_from_slice(&GOOD[2..]);
    assert_eq!(read(fewer), Err(Fault::Reference));
    // The reference is 2 % off, and a little more.
    for (half, good) in [(0x8000 + 655_u16, true), (0x8000 + 656, false), (0x8000 - 655, true), (0x8000 - 656, false)] {
        let mut frame = GOOD;
        frame[12..].copy_from_slice(&half.to_be_bytes());
        assert_eq!(read(frame).is_ok(), good, "{half:#x}");
    }
}

/// A bus that fails in every transfer.
struct Overrun;

impl ErrorType for Overrun {
    type Error = ErrorKind;
}

impl SpiBus for Overrun {
    fn read(&mut self, _: &mut [u8]) -> Result<(), ErrorKind> {
        Err(ErrorKind::Overrun)
    }

    fn write(&mut self, _: &[u8]) -> Result<(), ErrorKind> {
        Err(ErrorKind::Overrun)
    }

    fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), ErrorKind> {
        Err(ErrorKind::Overrun)
    }

    fn transfer_in_place(&mut self, _: &mut [u8]) -> Result<(), ErrorKind> {
        Err(ErrorKind::Overrun)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

#[test]
fn cnv_is_low_again_after_an_error_of_the_bus() {
    let mut start = Pin::new(&[Level::set(State::High), Level::set(State::Low)]);
    let mut chain = Chain::new(Overrun, start.clone(), NoopDelay::new());
    assert_eq!(chain.begin().and_then(|()| chain.read()), Err(Fault::Bus));
    start.done();
}

/// A frame, and what comes back.
type Frame = ([u8; 3], u16);

fn frames(list: &[Frame]) -> Vec<Step<u8>> {
    list.iter()
        .flat_map(|(sent, answer)| {
            let [high, low] = answer.to_be_bytes();
            [
                Step::transaction_start(),
                Step::transfer_in_place(sent.to_vec(), vec![0, high, low]),
                Step::transaction_end(),
            ]
        })
        .collect()
}

/// Power-up of a part that says it is `kind` and gives back `wrong` in place of the second pattern of leg 4.
fn start(kind: u16, wrong: Option<u16>) -> Vec<Frame> {
    let mut list = vec![([0x05, 0x00, 0x0a], 0), ([0x81, 0, 0], 0), ([0, 0, 0], kind)];
    if kind != 0x0800 {
        return list;
    }
    list.extend([([0x04, 0x00, 0xff], 0), ([0x02, 0x00, 0x3f], 0)]);
    for pattern in [0xa55a_u16, 0x5aa5, 0x0000] {
        let [high, low] = pattern.to_be_bytes();
        for leg in 0..6 {
            let answer = if leg == 4 && pattern == 0x5aa5 { wrong.unwrap_or(pattern) } else { pattern };
            list.extend([([0x08 + leg, high, low], 0), ([0x88 + leg, 0, 0], 0), ([0, 0, 0], answer)]);
            if answer != pattern {
                return list;
            }
        }
    }
    list.push(([0x05, 0x00, 0x10], 0));
    list
}

/// A tick: `turn` is read back and answers `held`.
fn write(turn: u8, held: u16, codes: [u16; 6]) -> Vec<Frame> {
    let mut list = vec![([0x88 + turn, 0, 0], 0)];
    for (leg, code) in (0_u8..).zip(codes) {
        let [high, low] = code.to_be_bytes();
        list.push(([0x08 + leg, high, low], if leg == 0 { held } else { 0xdead }));
    }
    list.push(([0x05, 0x00, 0x10], 0));
    list
}

#[test]
fn a_dac_is_started_with_the_amplifiers_off_and_proved() {
    for (kind, wrong, expected) in [
        (0x0800, None, Ok(())),
        // A DAC60508, of 12 bits.
        (0x2800, None, Err(Fault::ReadBack)),
        (0x0000, None, Err(Fault::ReadBack)),
        (0x0800, Some(0x5aa4), Err(Fault::ReadBack)),
    ] {
        let (mut spi, mut enable) = (Spi::new(&frames(&start(kind, wrong))), Pin::new(&[Level::set(State::Low)]));
        let mut dac = Dac80508::new(spi.clone(), enable.clone(), NoopDelay::new());
        assert_eq!(dac.start(), expected, "{kind:#x} {wrong:?}");
        spi.done();
        enable.done();
    }
}

#[test]
fn outputs_change_together_and_each_is_read_back_in_its_turn() {
    let codes = |tick: u16| [0, 1, 2, 3, 4, 5].map(|leg| 1000 * tick + leg);
    let mut list = Vec::new();
    for tick in 0..7_u16 {
        // What the last tick sent; after power-up nothing has been.
        let turn = tick % 6;
        let held = if tick == 0 { 0 } else { codes(tick)[usize::from(turn)] };
        list.extend(write(turn as u8, held, codes(tick + 1)));
    }
    let (mut spi, mut enable) = (Spi::new(&frames(&list)), Pin::new(&[]));
    let mut dac = Dac80508::new(spi.clone(), enable.clone(), NoopDelay::new());
    for tick in 0..7 {
        assert_eq!(dac.ask(), Ok(()));
        assert_eq!(dac.write(&codes(tick + 1).map(i32::from)), Ok(()), "tick {tick}");
    }
    spi.done();
    enable.done();
}

#[test]
fn a_part_that_holds_another_code_is_found_and_a_code_out_of_range_is_not_written() {
    let mut list = write(0, 0, [7; 6]);
    list.extend(write(1, 6, [8; 6]));
    // Nothing asked for, nothing compared.
    list.extend(write(2, 0xdead, [9; 6]).into_iter().skip(1));
    let (mut spi, mut enable) = (Spi::new(&frames(&list)), Pin::new(&[]));
    let mut dac = Dac80508::new(spi.clone(), enable.clone(), NoopDelay::new());
    assert_eq!((dac.ask(), dac.write(&[7; 6])), (Ok(()), Ok(())));
    assert_eq!((dac.ask(), dac.write(&[8; 6])), (Ok(()), Err(Fault::ReadBack)));
    assert_eq!(dac.write(&[9; 6]), Ok(()));
    assert_eq!(dac.write(&[0, 0, 0, 0, 0, 65_536]), Err(Fault::Code));
    assert_eq!(dac.write(&[-1, 0, 0, 0, 0, 0]), Err(Fault::Code));
    spi.done();
    enable.done();
}
