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
    assert_eq!(problem("5 S"), Problem::UnknownUnit("S".into(), vec!["s".into()]));
    assert_eq!(problem("5 KB"), Problem::UnknownUnit("KB".into(), vec!["kB".into(), "KiB".into()]));
    assert_eq!(problem("5 furlong"), Problem::UnknownUnit("furlong".into(), Vec::new()));
    assert_eq!(problem("5 MHZ"), Problem::AmbiguousUnit(vec!["5 mHz".into(), "5 MHz".into()]));
    assert_eq!(problem("5 N/m s"), Problem::AmbiguousQuotient(vec!["5 N s/m".into(), "5 N/(m s)".into()]));
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
    assert_eq!(parse("5 KB").expect_err("unknown").range, 2..4);
    assert_eq!(parse(" 5 MM ").expect_err("ambiguous").range, 3..5);
}

#[test]
fn a_zero_is_no_underflow_and_a_bare_number_has_no_dimension() {
    assert_eq!(si("0e-999 m"), 0.0);
    assert_eq!(parse("17").expect("number").dimension, Dimension::NONE);
}

/// Spellings of engineers, the same in symbols of SI, and the value.
#[rustfmt::skip]
const SPELLINGS: &[(&str, &str, f64)] = &[
    // Inches, pounds and ounces, exact by definition.
    ("5.9 in", "149.86 mm", 0.149_86),
    ("5.9 IN", "149.86 mm", 0.149_86),
    ("5.9 in.", "149.86 mm", 0.149_86),
    ("5.9 inch", "149.86 mm", 0.149_86),
    ("5.9 inches", "149.86 mm", 0.149_86),
    ("0.5 ft", "152.4 mm", 0.152_4),
    ("3 feet", "914.4 mm", 0.914_4),
    ("2 mil", "50.8 um", 50.8e-6),
    ("2 mils", "50.8 um", 50.8e-6),
    ("2 thou", "50.8 um", 50.8e-6),
    ("3 µin", "76.2 nm", 76.2e-9),
    ("2.6 lb", "1.179340162 kg", 1.179_340_162),
    ("2.6 lbs", "1.179340162 kg", 1.179_340_162),
    ("2.6 LB", "1.179340162 kg", 1.179_340_162),
    ("2.6 lbm", "1.179340162 kg", 1.179_340_162),
    ("3 oz", "85.048569375 g", 0.085_048_569_375),
    ("10 lbf", "44.482216152605 N", 44.482_216_152_605),
    ("10 LBF", "44.482216152605 N", 44.482_216_152_605),
    ("2 kgf", "19.6133 N", 19.613_3),
    // Quotients, correctly rounded: from a calculation with 40 digits.
    ("1 slug", "14.593902937206364829 kg", 14.593_902_937_206_364),
    ("57000 lbf/in", "9982229.6090491535433 N/m", 9_982_229.609_049_154),
    ("111 lb in^2", "0.0324830015306412 kg m^2", 0.032_483_001_530_641_2),
    ("1 slug ft^2", "1.3558179483314004 kg m^2", 1.355_817_948_331_400_4),
    // Powers, dots, slashes and blanks.
    ("95 kg cm^2", "0.0095 kg m^2", 0.0095),
    ("95 kg cm²", "0.0095 kg m^2", 0.0095),
    ("95 kg·cm²", "0.0095 kg m^2", 0.0095),
    ("95 kg⋅cm2", "0.0095 kg m^2", 0.0095),
    ("95 kg*cm**2", "0.0095 kg m^2", 0.0095),
    ("95 kg-cm^2", "0.0095 kg m^2", 0.0095),
    ("95 kg.cm²", "0.0095 kg m^2", 0.0095),
    ("95kgcm²", "0.0095 kg m^2", 0.0095),
    ("95 KG CM^2", "0.0095 kg m^2", 0.0095),
    ("9500 kgmm2", "0.0095 kg m^2", 0.0095),
    ("3.26e7 gmm²", "0.0326 kg m^2", 0.0326),
    ("3.26×10^7 g mm²", "0.0326 kg m^2", 0.0326),
    ("3.26 x 10^7 g mm²", "0.0326 kg m^2", 0.0326),
    ("3.26·10⁷ g mm²", "0.0326 kg m^2", 0.0326),
    ("10^7 N/m", "1e7 N/m", 1e7),
    ("10⁻³ m", "1 mm", 1e-3),
    ("10 N/µm", "1e7 N/m", 1e7),
    ("10 N∕μm", "1e7 N/m", 1e7),
    ("5 V s⁻¹", "5 V/s", 5.0),
    ("5 V s-1", "5 V/s", 5.0),
    ("5 m s⁻³", "5 m/s^3", 5.0),
    ("0.1 um per V", "0.1 um/V", 0.1e-6),
    ("12 Nm/rad", "12 N m/rad", 12.0),
    ("12 N-m/rad", "12 N m/rad", 12.0),
    ("12 mNm/rad", "0.012 N m/rad", 0.012),
    ("7 V/Nm", "7 V/(N m)", 7.0),
    // Words and capital letters.
    ("1.2 Kg", "1.2 kg", 1.2),
    ("1.2 kilograms", "1.2 kg", 1.2),
    ("200 usec", "200 us", 200e-6),
    ("200 µsec", "200 us", 200e-6),
    ("200 microseconds", "200 us", 200e-6),
    ("60 micron", "60 um", 60e-6),
    ("60 Microns", "60 um", 60e-6),
    ("60 micrometres", "60 um", 60e-6),
    ("5 khz", "5 kHz", 5000.0),
    ("5 KHZ", "5 kHz", 5000.0),
    ("5 Mhz", "5 MHz", 5e6),
    ("100 volts", "100 V", 100.0),
    ("100 v", "100 V", 100.0),
    ("20 KN", "20 kN", 20e3),
    ("3 mdeg", "0.003 deg", 5.235_987_755_982_989e-5),
    ("2 degrees", "2 deg", 0.034_906_585_039_886_59),
    // Noise densities.
    ("3 nm/√Hz", "3 nm/√Hz", 3e-9),
    ("3 nm/rtHz", "3 nm/√Hz", 3e-9),
    ("3 nm/sqrt(Hz)", "3 nm/√Hz", 3e-9),
    ("3 nm/√(Hz)", "3 nm/√Hz", 3e-9),
    ("3 nm/rt Hz", "3 nm/√Hz", 3e-9),
    ("3 nm/Hz^0.5", "3 nm/√Hz", 3e-9),
    ("3 nm/Hz^(1/2)", "3 nm/√Hz", 3e-9),
    ("3 nm Hz^-1/2", "3 nm/√Hz", 3e-9),
];

#[test]
fn engineers_spellings_have_the_bits_of_their_definitions() {
    for (text, same, expected) in SPELLINGS {
        let same = parse(same).unwrap_or_else(|e| panic!("{same}: {e:?}"));
        let found = parse_as(text, same.dimension).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        assert_eq!(found.value.to_bits(), expected.to_bits(), "{text}: {} and {expected}", found.value);
        assert_eq!(found, same, "{text}");
    }
}

/// What a key of a dimension takes, although the unit alone has another or several meanings.
#[test]
fn the_dimension_decides_between_readings() {
    let stiffness = parse("7 lbf/in").expect("a stiffness").value;
    for (text, dimension, expected) in [
        ("7 lb/in", Dimension::STIFFNESS, stiffness),
        ("7 lbs/inch", Dimension::STIFFNESS, stiffness),
        ("7 pounds", Dimension::MASS, 7.0 * 0.453_592_37),
        ("7 pounds", Dimension::FORCE, 31.137_551_306_823_5),
        ("7 lb", Dimension::FORCE, 31.137_551_306_823_5),
        ("7 gm", Dimension::MASS, 7e-3),
        ("7 NM/RAD", Dimension::TURN_STIFFNESS, 7.0),
        ("7 Nms/rad", Dimension::TURN_DAMPING, 7.0),
        ("7\u{2033}", Dimension::LENGTH, 0.177_8),
        ("7'", Dimension::LENGTH, 2.133_6),
        ("7 ms", Dimension::TIME, 7e-3),
        ("7 MINS", Dimension::TIME, 420.0),
    ] {
        let found = parse_as(text, dimension).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        assert_eq!(found.value.to_bits(), f64::to_bits(expected), "{text}: {} and {expected}", found.value);
        assert_eq!(found.dimension, dimension, "{text}");
    }
    // As written these are something else, or two things.
    assert_eq!(
        parse_as("7 Nm", Dimension::LENGTH).map(|found| found.dimension),
        Ok(Dimension::new([2, 1, -2, 0, 0, 0]))
    );
    assert_eq!(readings("7 Nm", Dimension::LENGTH), [("7 nm".to_owned(), 7e-9)]);
    for (text, dimension, all) in [
        ("7 MM", Dimension::LENGTH, ["7 mm", "7 Mm"]),
        ("7 mhz", Dimension::FREQUENCY, ["7 mHz", "7 MHz"]),
        ("7 NM", Dimension::MASS, ["7 nm", "7 N m"]),
        ("7 pounds", Dimension::LENGTH, ["7 lb", "7 lbf"]),
        ("7 V/NMS", Dimension::LENGTH, ["7 V/(N ms)", "7 V/(N Ms)"]),
    ] {
        let problem = parse_as(text, dimension).expect_err(text).problem;
        let Problem::AmbiguousUnit(found) = problem else { panic!("{text}: {problem:?}") };
        assert_eq!(found[..2], all, "{text}");
    }
}

/// What is offered is itself read, with the meaning that it was offered for.
#[test]
fn every_reading_reads_back() {
    let mut count = 0;
    for text in [
        "7 MM",
        "7 NM/RAD",
        "7 V/NMS^2",
        "7 lbs/inch",
        "7 pounds*Feet**2",
        "7″/MS",
        "7 KgCM²",
        "-7 MV per GM",
        "7 lbfins2",
    ] {
        for meaning in meanings(text).expect(text) {
            count += 1;
            assert_eq!(parse(&meaning.text).map_err(|e| e.problem), meaning.quantity(), "{text}: {}", meaning.text);
        }
    }
    assert!(count >= 20, "{count} readings");
}

#[test]
fn every_offered_unit_is_a_unit() {
    for unit in COMMON.iter().chain(FURTHER) {
        assert!(
            unit_value(unit).is_some_and(|one| offered_units(one.dimension).any(|offered| offered == *unit)),
            "{unit}"
        );
    }
}

#[test]
fn only_three_digits_behind_a_sign_may_follow_thousands() {
    for (text, sign, expected) in [
        ("21,484", ',', true),
        ("-1,000", ',', true),
        ("\u{2212}999.999", '.', true),
        ("0,484", ',', false),
        ("21,48", ',', false),
        ("21,4840", ',', false),
        ("1234,567", ',', false),
        ("21.484", ',', false),
        ("1,234,567", ',', false),
        ("1,234e3", ',', false),
        (",484", ',', false),
    ] {
        assert_eq!(may_divide_thousands(text, sign), expected, "{text}");
    }
}
