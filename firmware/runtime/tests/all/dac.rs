//! Voltage and slew limits hold for every drive, whatever its bits.

use specgen_runtime::{CodeLimits, Dac};

const DAC: Dac<f64> = Dac {
    volts_at_zero: 0.0,
    volts_per_code: 150.0 / 65535.0,
    cells_at_zero: 0.0,
    cells_per_code: 150.0 / 65535.0 * 0.32,
    codes_per_cell: 65535.0 / 150.0 / 0.32,
};
const LIMITS: CodeLimits = CodeLimits { min: 100, max: 43_690, max_step: 500 };

#[test]
fn every_bit_pattern_gives_a_permitted_code() {
    let mut state = 1_u64;
    let mut previous = 200;
    let edge = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 5e-324, f64::MAX, f64::MIN, 32.0, 1e10];
    let random = std::iter::repeat_with(|| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        f64::from_bits(state)
    });
    for drive in edge.into_iter().chain(random.take(200_000)) {
        let (code, _) = DAC.code(drive, previous, LIMITS);
        assert!((LIMITS.min..=LIMITS.max).contains(&code), "{drive:e}");
        assert!((code - previous).abs() <= LIMITS.max_step, "{drive:e}");
        previous = code;
    }
}

#[test]
fn the_nearest_code_is_chosen() {
    for wanted in [150, 999, 20_000, 43_690] {
        let drive = DAC.drive(wanted);
        for offset in [-0.49, 0.0, 0.49] {
            let (code, limited) = DAC.code(drive + offset * DAC.cells_per_code, wanted, LIMITS);
            assert_eq!((code, limited), (wanted, false), "{wanted} {offset}");
        }
    }
    assert_eq!(DAC.code(DAC.drive(43_691), 43_690, LIMITS), (43_690, true));
    assert_eq!(DAC.code(DAC.drive(10_000), 9000, LIMITS), (9500, true));
}

#[test]
fn limits_that_move_past_the_present_code_are_come_back_to_at_the_slew_rate() {
    for (limits, wanted) in [
        (CodeLimits { min: 10_000, max: 43_690, max_step: 500 }, 10_000),
        (CodeLimits { min: 0, max: 1000, max_step: 500 }, 1000),
    ] {
        for drive in [f64::MIN, 0.0, 8.0, f64::MAX, f64::NAN] {
            let mut previous = 5_000;
            for _ in 0..10 {
                let (code, held_back) = DAC.code(drive, previous, limits);
                assert!((code - previous).abs() <= limits.max_step, "{drive}: {previous} to {code}");
                assert!((code - wanted).abs() < (previous - wanted).abs() || (limits.min..=limits.max).contains(&code));
                assert!(held_back || (limits.min..=limits.max).contains(&code));
                previous = code;
            }
            assert!((limits.min..=limits.max).contains(&previous), "{drive}: {previous}");
        }
    }
}

/// A converter of either polarity, and a grid that begins elsewhere: straight lines through what they say, and the code of a drive
/// is the nearest of its own.
#[test]
fn voltages_and_drives_lie_on_straight_lines_from_code_zero() {
    for (volts, cells, codes) in [(-20.0, -3.0, 400.0), (5.0, 2.5, 64.0)] {
        let dac = Dac {
            volts_at_zero: volts,
            volts_per_code: 0.0025,
            cells_at_zero: cells,
            cells_per_code: 1.0 / codes,
            codes_per_cell: codes,
        };
        let limits = CodeLimits { min: 0, max: 65_535, max_step: 65_535 };
        for code in [0, 1, 2, 20_000, 65_535] {
            let part = f64::from(code);
            assert!((dac.voltage(code) - (volts + part * 0.0025)).abs() < 1e-12, "{code}");
            assert!((dac.drive(code) - (cells + part / codes)).abs() < 1e-12, "{code}");
            for offset in [-0.4, 0.0, 0.4] {
                assert_eq!(dac.code(dac.drive(code) + offset / codes, 9, limits).0, code, "{code} {offset}");
            }
        }
    }
    // Where a converter starts at zero so do both, without a sum.
    assert_eq!((DAC.drive(0), DAC.voltage(0)), (0.0, 0.0));
    assert_eq!((DAC.drive(1), DAC.voltage(3)), (DAC.cells_per_code, 3.0 * DAC.volts_per_code));
}
