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
