//! The scalar: bits kept in words, conversions, saturation.

use specgen_runtime::real::{Real, saturate};

fn keeps_its_bits<T: Real + std::fmt::Debug>(highest: u64) {
    for value in [0.0, 1.5, -2.25, 1e30, f64::NEG_INFINITY] {
        let value = T::from_f64(value);
        assert_eq!(T::from_word(value.to_word()), value);
        assert!(value.to_word() <= highest);
        assert_eq!(value.abs(), if value < T::ZERO { -value } else { value });
    }
    assert_eq!((-T::ZERO).abs().to_word(), 0);
    assert!(T::ONE.is_finite() && !T::from_f64(f64::NAN).is_finite() && !T::from_f64(f64::INFINITY).is_finite());
    assert_eq!([1.9, -1.9, 1e30, -1e30, f64::NAN].map(|x| T::from_f64(x).truncate()), [1, -1, i32::MAX, i32::MIN, 0]);
    assert_eq!(T::from_i32(-7) + T::from_i32(9), T::ONE + T::ONE);
}

#[test]
fn numbers_keep_their_bits_in_words() {
    keeps_its_bits::<f64>(u64::MAX);
    keeps_its_bits::<f32>(u64::from(u32::MAX));
}

#[test]
fn saturation_holds_ends_and_takes_what_is_no_number_for_the_lowest() {
    for (value, held) in [(-2.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (3.0, 3.0), (4.0, 3.0), (f64::NAN, -1.0)] {
        assert_eq!(saturate(value, -1.0, 3.0), held, "{value}");
    }
    assert_eq!(saturate(-0.0_f64, 0.0, 3.0).to_bits(), 0);
}
