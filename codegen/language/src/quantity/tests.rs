//! Quantities against doubles written out by hand.

use super::*;

fn si(text: &str) -> f64 {
    parse(text).unwrap_or_else(|e| panic!("{text}: {e:?}")).value
}

fn problem(text: &str) -> Problem {
    parse(text).expect_err(text).problem
}

#[test]
fn every_form_of_the_reference_platform_is_exact() {
    for (text, expected, dimension) in [
        ("1.195 kg", 1.195_f64, Dimension::MASS),
        ("90.26 g", 0.090_26, Dimension::MASS),
        ("3.26e7 g mm^2", 0.0326, Dimension::INERTIA),
        ("5.27e4 g mm^2", 5.27e-5, Dimension::INERTIA),
        ("150 mm", 0.15, Dimension::LENGTH),
        ("60 um", 60e-6, Dimension::LENGTH),
        ("60 \u{b5}m", 60e-6, Dimension::LENGTH),
        ("60 \u{3bc}m", 60e-6, Dimension::LENGTH),
        ("-2 um", -2e-6, Dimension::LENGTH),
        ("2.2 nm", 2.2e-9, Dimension::LENGTH),
        ("0.1262 um/V", 0.1262e-6, Dimension::PIEZO_GAIN),
        ("0.35 ms", 0.35e-3, Dimension::TIME),
        ("40 V/ms", 40e3, Dimension::SLEW_RATE),
        ("5 kHz", 5000.0, Dimension::FREQUENCY),
        ("450 rad/s", 450.0, Dimension::ANGULAR_RATE),
        ("1e7 N/m", 1e7, Dimension::STIFFNESS),
        ("3 N/(m s)", 3.0, Dimension::STIFFNESS_RATE),
        ("3 N s/m", 3.0, Dimension::DAMPING),
        ("12 N m/rad", 12.0, Dimension::TURN_STIFFNESS),
        ("12 N m/(rad s)", 12.0, Dimension::TURN_STIFFNESS_RATE),
        ("0.6 mrad", 0.6e-3, Dimension::ANGLE),
        ("7 urad", 7e-6, Dimension::ANGLE),
        ("96 KiB", 98_304.0, Dimension::MEMORY),
        ("128 kB", 128_000.0, Dimension::MEMORY),
        ("2 min", 120.0, Dimension::TIME),
    ] {
        let quantity = parse(text).expect(text);
        assert_eq!(quantity.value.to_bits(), expected.to_bits(), "{text}: {} and {expected}", quantity.value);
        assert_eq!(quantity.dimension, dimension, "{text}");
    }
}

#[test]
fn angles_are_correctly_rounded() {
    // 0.012 π and 25° to 17 digits, from a calculation with 50 digits.
    assert_eq!(si("0.012 pi rad"), 0.037_699_111_843_077_52);
    assert_eq!(si("25 deg"), 0.436_332_312_998_582_4);
    assert_eq!(si("25°"), si("25 deg"));
    assert_eq!(si("1 pi rad").to_bits(), std::f64::consts::PI.to_bits());
}

#[test]
fn spellings_that_mean_the_same_agree() {
    for other in ["3.26e7 g*mm^2", "3.26e7 g·mm²", "32600000g mm^2", "+3.26E+7 mm^2 g", " 3.26e7  g mm mm "] {
        assert_eq!(parse(other).expect(other), parse("3.26e7 g mm^2").expect("reference"), "{other}");
    }
    assert_eq!(parse("5 V/s"), parse("5 V s^-1"));
    assert_eq!(parse("5 V/s/s"), parse("5 V/s^2"));
    assert_eq!(parse("\u{2212}5 V"), parse("-5 V"));
    assert_eq!(parse("7 (N/m)^2").expect("power of a group").dimension, parse("7 N^2/m^2").expect("powers").dimension);
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    assert_eq!(problem("mm"), Problem::NoNumber);
    assert_eq!(problem(""), Problem::NoNumber);
    assert_eq!(problem("."), Problem::NoNumber);
    assert_eq!(problem("1,5 mm"), Problem::Comma);
    assert_eq!(problem("5 khz"), Problem::UnknownUnit("khz".into(), Some("kHz")));
    assert_eq!(problem("5 furlong"), Problem::UnknownUnit("furlong".into(), None));
    assert_eq!(problem("5 N/m s"), Problem::AmbiguousQuotient);
    assert_eq!(problem("5 mm^99"), Problem::BadPower);
    assert_eq!(problem("5 mm^"), Problem::BadPower);
    assert_eq!(problem("5 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9 m^9"), Problem::BadPower);
    assert_eq!(problem("1 (((pi^9)^9)^9)^9"), Problem::BadPower);
    assert_eq!(problem("nan mm"), Problem::NotFinite);
    assert_eq!(problem("-Infinity mm"), Problem::NotFinite);
    assert_eq!(problem("1e400 mm"), Problem::Overflow);
    assert_eq!(problem("1e99999999999999999999 mm"), Problem::Overflow);
    assert_eq!(problem("1e-400 mm"), Problem::Underflow);
    assert_eq!(problem("5 mm/"), Problem::Unexpected("the end".into()));
    assert_eq!(problem("5 (mm"), Problem::Unexpected("the end".into()));
    assert_eq!(problem("5 5"), Problem::Unexpected("\"5\"".into()));
    assert_eq!(problem(&"((((((".repeat(9)), Problem::NoNumber);
    assert_eq!(problem(&format!("1 {}", "(".repeat(50))), Problem::Unexpected("\"(\"".into()));
    assert_eq!(problem(&"1".repeat(MAX_LENGTH + 1)), Problem::TooLong);
    assert_eq!(parse("5 Kg").expect_err("unknown").range, 2..4);
}

#[test]
fn a_zero_is_no_underflow_and_a_bare_number_has_no_dimension() {
    assert_eq!(si("0e-999 m"), 0.0);
    assert_eq!(parse("17").expect("number").dimension, Dimension::NONE);
}
