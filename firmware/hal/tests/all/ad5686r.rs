//! Tests of the DAC driver with words of the data sheet, and with parts that answer differently.

use embedded_hal::spi::ErrorKind;
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as PinStep};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction as SpiStep};
use specgen_hal::ad5686r::{Ad5686rPair, Channel, Command, LDAC_LOW};
use specgen_hal::{Amplifiers, Fault, Pulse};

type Word = [u8; 3];
type Ldac = Pulse<Pin, NoopDelay, LDAC_LOW>;
type Pair = Ad5686rPair<Spi<u8>, Spi<u8>, Ldac, Pin, NoopDelay>;

/// A frame of the data sheet, and the simultaneous answer of the part.
fn frames(pairs: &[(Word, Word)]) -> Vec<SpiStep<u8>> {
    pairs
        .iter()
        .flat_map(|(sent, answer)| {
            // Only the answer of the no-operation frame is used.
            let step = match sent {
                [0, 0, 0] => SpiStep::transfer_in_place(sent.to_vec(), answer.to_vec()),
                _ => SpiStep::write_vec(sent.to_vec()),
            };
            [SpiStep::transaction_start(), step, SpiStep::transaction_end()]
        })
        .collect()
}

const NONE: Word = [0xff, 0xff, 0xff];

/// Power-up by the module's table; channel D returns `answers`.
fn start_words(answers: [u16; 3]) -> Vec<(Word, Word)> {
    let mut words: Vec<(Word, Word)> = [
        [0x60, 0x00, 0x00], // software reset
        [0x80, 0x00, 0x00], // DCEN = 0
        [0x70, 0x00, 0x00], // reference on
        [0x50, 0x00, 0x00], // LDAC mask = 0
        [0x4f, 0x00, 0x00], // all channels normal
        [0x3f, 0x00, 0x00], // all to zero
    ]
    .map(|word| (word, NONE))
    .to_vec();
    for (pattern, answer) in [[0xa5, 0x5a], [0x5a, 0xa5], [0x00, 0x00]].into_iter().zip(answers) {
        let [high, low] = answer.to_be_bytes();
        words.push(([0x38, pattern[0], pattern[1]], NONE));
        words.push(([0x98, 0x00, 0x00], NONE));
        // The upper eight bits of an answer are undefined.
        words.push(([0x00, 0x00, 0x00], [0x5c, high, low]));
    }
    words
}

const GOOD: [u16; 3] = [0xa55a, 0x5aa5, 0x0000];

/// Words to a part in a tick: the channel to read back, if it is its turn, with its answer; then the three codes.
fn write_words(asked: Option<(u8, u16)>, codes: [u16; 3]) -> Vec<(Word, Word)> {
    let mut words = Vec::new();
    if let Some((address, answer)) = asked {
        let [high, low] = answer.to_be_bytes();
        words.extend([([0x90 | address, 0, 0], NONE), ([0; 3], [0, high, low])]);
    }
    for (channel, code) in [0x11, 0x12, 0x14].into_iter().zip(codes) {
        let [high, low] = code.to_be_bytes();
        words.push(([channel, high, low], NONE));
    }
    words
}

fn pair(first: &[(Word, Word)], second: &[(Word, Word)], ldac: &[PinStep], enable: &[PinStep]) -> Pair {
    let (first, second) = (Spi::new(&frames(first)), Spi::new(&frames(second)));
    Ad5686rPair::new(first, second, pulse(ldac), Pin::new(enable), NoopDelay)
}

fn pulse(ldac: &[PinStep]) -> Ldac {
    Pulse { pin: Pin::new(ldac), delay: NoopDelay }
}

/// A tick: read-back during the conversion of the gauges, then the codes.
fn tick(dacs: &mut Pair, codes: [i32; 6]) -> Result<(), Fault> {
    dacs.ask().and(dacs.write(&codes))
}

fn done(pair: Pair) {
    let (mut first, mut second, mut ldac, mut enable, _) = pair.release();
    first.done();
    second.done();
    ldac.pin.done();
    enable.done();
}

fn low() -> PinStep {
    PinStep::set(State::Low)
}

fn high() -> PinStep {
    PinStep::set(State::High)
}

/// Table 7 and Table 8 of the data sheet, written out.
#[test]
fn words_are_those_of_the_data_sheet() {
    let table: [(Command, u32); 12] = [
        (Command::NoOperation, 0x000000),
        (Command::WriteInput(Channel::A, 0x1234), 0b0001_0001_0001_0010_0011_0100),
        (Command::WriteInput(Channel::B, 0xffff), 0b0001_0010_1111_1111_1111_1111),
        (Command::WriteInput(Channel::C, 0x0001), 0b0001_0100_0000_0000_0000_0001),
        (Command::WriteThrough(Channel::D, 0x8000), 0b0011_1000_1000_0000_0000_0000),
        (Command::WriteThroughAll(0), 0x3f0000),
        (Command::PowerUp, 0x4f0000),
        (Command::LdacUnmasked, 0x500000),
        (Command::Reset, 0x600000),
        (Command::ReferenceOn, 0x700000),
        (Command::NoDaisyChain, 0x800000),
        (Command::ReadBack(Channel::C), 0x940000),
    ];
    for (command, word) in table {
        assert_eq!(command.frame(), word.to_be_bytes()[1..], "{command:?}");
    }
}

#[test]
fn start_disables_the_amplifiers_first_and_proves_both_parts() {
    let words = start_words(GOOD);
    let mut dacs = pair(&words, &words, &[], &[low()]);
    assert_eq!(dacs.start(), Ok(()));
    done(dacs);
}

#[test]
fn a_part_that_gives_nothing_back_is_found_at_start_and_the_other_is_at_zero_all_the_same() {
    // SDO open: all ones. The first pattern differs.
    let silent = &start_words([0xffff; 3])[..9];
    let mut dacs = pair(silent, &start_words(GOOD), &[], &[low()]);
    assert_eq!(dacs.start(), Err(Fault::ReadBack));
    done(dacs);
    // One bit of one pattern.
    let one_bit = &start_words([0xa55a, 0x5aa4, 0])[..12];
    let mut dacs = pair(&start_words(GOOD), one_bit, &[], &[low()]);
    assert_eq!(dacs.start(), Err(Fault::ReadBack));
    done(dacs);
}

#[test]
fn six_codes_and_one_ldac_and_each_channel_read_back_within_six_ticks() {
    let mut parts = [start_words(GOOD), start_words(GOOD)];
    let codes = |tick: u16| [1, 2, 3, 4, 5, 6].map(|leg| 0x100 * leg + tick);
    let mut expected = [0; 6];
    for tick in 0..7 {
        let [a, b, c, d, e, f] = codes(tick as u16);
        for ((part, words), codes) in parts.iter_mut().enumerate().zip([[a, b, c], [d, e, f]]) {
            let channel = tick / 2 % 3;
            let asked = (tick % 2 == part).then_some(([1, 2, 4][channel], expected[3 * part + channel]));
            words.extend(write_words(asked, codes));
        }
        expected = codes(tick as u16);
    }
    // The turn of the seventh tick is that of the first.
    let [mut first, mut second] = parts;
    let [a, b, c, d, e, f] = codes(7);
    first.extend(write_words(None, [a, b, c]));
    second.extend(write_words(Some((1, expected[3])), [d, e, f]));
    let ldac: Vec<PinStep> = (0..8).flat_map(|_| [low(), high()]).collect();
    let mut dacs = pair(&first, &second, &ldac, &[low(), high(), low()]);
    assert_eq!(dacs.start(), Ok(()));
    assert_eq!(dacs.enable(true), Ok(()));
    for k in 0..8 {
        assert_eq!(tick(&mut dacs, codes(k).map(i32::from)), Ok(()));
    }
    assert_eq!(dacs.enable(false), Ok(()));
    done(dacs);
}

/// In every tick, so that a count of them adds up, until the channel gives the right code in its turn.
#[test]
fn a_code_that_comes_back_changed_is_a_fault_until_it_is_right_and_the_codes_go_out_all_the_same() {
    for bit in 0..16 {
        let mut parts = [start_words(GOOD), start_words(GOOD)];
        for tick in 0..8_u16 {
            for (part, words) in (0..).zip(&mut parts) {
                // All six have the same code; the first answer of all is another one.
                let answer = if tick == 0 { 1 << bit } else { 6 + tick };
                let asked = (tick % 2 == part).then_some(([1, 2, 4][usize::from(tick) / 2 % 3], answer));
                words.extend(write_words(asked, [7 + tick; 3]));
            }
        }
        let ldac: Vec<PinStep> = (0..8).flat_map(|_| [low(), high()]).collect();
        let [first, second] = parts;
        let mut dacs = pair(&first, &second, &ldac, &[low()]);
        assert_eq!(dacs.start(), Ok(()));
        for tick in 0..8 {
            let expected = if tick < 6 { Err(Fault::ReadBack) } else { Ok(()) };
            assert_eq!(dacs.ask(), expected, "bit {bit}, tick {tick}");
            assert_eq!(dacs.write(&[7 + tick; 6]), Ok(()));
        }
        done(dacs);
    }
}

#[test]
fn a_code_out_of_range_is_a_fault_and_nothing_is_written() {
    for bad in [-1, 0x1_0000, i32::MIN, i32::MAX] {
        for leg in 0..6 {
            let mut codes = [0x8000; 6];
            codes[leg] = bad;
            let mut dacs = pair(&[], &[], &[], &[]);
            assert_eq!(dacs.write(&codes), Err(Fault::Code));
            done(dacs);
        }
    }
}

/// An SPI that reports errors, and counts how often it was asked.
struct FailingSpi(u32);

impl embedded_hal::spi::ErrorType for FailingSpi {
    type Error = ErrorKind;
}

impl embedded_hal::spi::SpiDevice for FailingSpi {
    fn transaction(&mut self, _: &mut [embedded_hal::spi::Operation<'_, u8>]) -> Result<(), ErrorKind> {
        self.0 += 1;
        Err(ErrorKind::Overrun)
    }
}

#[test]
fn an_error_of_the_bus_is_a_fault_and_the_other_part_still_gets_its_codes() {
    let mut second = start_words(GOOD);
    // The registers of the first part are unknown, so nothing is read back.
    second.extend(write_words(None, [4, 5, 6]));
    let ldac = [low(), high()];
    let mut dacs =
        Ad5686rPair::new(FailingSpi(0), Spi::new(&frames(&second)), pulse(&ldac), Pin::new(&[low()]), NoopDelay);
    assert_eq!(dacs.start(), Err(Fault::Bus));
    assert_eq!(dacs.ask(), Ok(()));
    assert_eq!(dacs.write(&[1, 2, 3, 4, 5, 6]), Err(Fault::Bus));
    let (first, mut second, mut ldac, mut enable, _) = dacs.release();
    assert_eq!(first.0, 4, "once at start, three codes");
    second.done();
    ldac.pin.done();
    enable.done();
}
