//! Parses and prints poses of the operator, such as `z=1um rx=-2urad`.

use specgen_language::quantity::{self, Dimension};

/// Names of the axes of a pose.
pub const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// Value of each axis, m and rad; none if it is not named.
pub type AxisValues = [Option<f64>; 6];

/// Parses `AXIS=QUANTITY` words, each axis at most once.
///
/// # Errors
/// A word is invalid; the text says what is expected.
pub(crate) fn named(words: &[&str]) -> Result<AxisValues, String> {
    let mut axes = [None; 6];
    for word in words {
        let expected = || format!("expected AXIS=LENGTH or ANGLE such as z=1um or rx=2urad, found `{word}`");
        let (name, text) = word.split_once('=').ok_or_else(expected)?;
        let axis = AXES.iter().position(|known| *known == name);
        let axis = axis.ok_or_else(|| format!("{}; the axes are {}", expected(), AXES.join(", ")))?;
        let slot = axes.get_mut(axis).ok_or_else(expected)?;
        let (dimension, unit) = if axis < 3 { (Dimension::LENGTH, "um") } else { (Dimension::ANGLE, "urad") };
        let read = quantity::parse_as(text, dimension).map_err(|_| expected())?;
        // Zero needs no unit.
        let is_zero = read.dimension == Dimension::NONE && read.value == 0.0;
        if read.dimension != dimension && !is_zero {
            return Err(format!("`{word}`: {name} needs a unit of {}, such as {unit}", dimension.describe()));
        }
        if slot.replace(read.value).is_some() {
            return Err(format!("`{word}`: {name} is named twice"));
        }
    }
    Ok(axes)
}

/// Speed of translations, m/s, and of rotations, rad/s; none if not given.
pub type Pace = [Option<f64>; 2];

/// Parses `speed=QUANTITY` words, at most one of each dimension.
///
/// # Errors
/// A word is invalid; the text says what is expected.
pub(crate) fn pace(words: &[&str]) -> Result<Pace, String> {
    let mut pace = [None; 2];
    for word in words {
        let expected = || format!("expected a speed such as speed=50um/s or speed=1mrad/s, once each; found `{word}`");
        let read = word.strip_prefix("speed=").and_then(|text| quantity::parse(text).ok()).ok_or_else(expected)?;
        let kinds = [Dimension::SPEED, Dimension::ANGULAR_RATE];
        let kind = kinds.iter().position(|kind| *kind == read.dimension).ok_or_else(expected)?;
        if read.value < 0.0 || pace[kind].replace(read.value).is_some() {
            return Err(expected());
        }
    }
    Ok(pace)
}

/// The destination of a move from the set-point: axes that are not named keep their values.
#[must_use]
pub fn meant(from: &[f64; 6], relative: bool, axes: &AxisValues) -> [f64; 6] {
    core::array::from_fn(|axis| match axes[axis] {
        Some(value) if relative => from[axis] + value,
        Some(value) => value,
        None => from[axis],
    })
}

/// A value of an axis in µm or µrad, with the unit.
#[must_use]
pub fn amount(axis: usize, value: f64) -> String {
    format!("{:.3} {}", value * 1e6, if axis < 3 { "um" } else { "urad" })
}

/// A pose as text, µm and µrad.
#[must_use]
pub fn in_words(pose: &[f64; 6]) -> String {
    let axes = AXES.iter().zip(pose).enumerate();
    axes.map(|(axis, (name, value))| format!("{name} {}", amount(axis, *value))).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_keep_their_place_and_need_their_unit() {
        assert_eq!(named(&["rx=-2urad", "z=1um"]), Ok([None, None, Some(1e-6), Some(-2e-6), None, None]));
        assert_eq!(named(&["x=0"]), Ok([Some(0.0), None, None, None, None, None]));
        for (words, text) in [
            (&["z=1"][..], "z needs a unit of"),
            (&["z=1urad"], "such as um"),
            (&["rx=1um"], "such as urad"),
            (&["w=1um"], "the axes are x, y, z, rx, ry, rz"),
            (&["z"], "expected AXIS="),
            (&["z=um"], "expected AXIS="),
            (&["z=1um", "z=2um"], "named twice"),
        ] {
            let error = named(words).unwrap_err();
            assert!(error.contains(text), "{words:?}: {error}");
        }
    }

    #[test]
    fn axes_that_are_not_named_keep_their_values() {
        let z = [None, None, Some(1e-6), None, None, None];
        let from = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(meant(&from, false, &z), [1.0, 2.0, 1e-6, 4.0, 5.0, 6.0]);
        assert_eq!(meant(&from, true, &z), [1.0, 2.0, 3.0 + 1e-6, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn speeds_are_of_lengths_and_angles() {
        assert_eq!(pace(&["speed=2mrad/s", "speed=5um/s"]), Ok([Some(5e-6), Some(2e-3)]));
        for words in [&["speed=2"][..], &["speed=2um"], &["speed=-2um/s"], &["speed=1um/s", "speed=2um/s"]] {
            assert!(pace(words).unwrap_err().contains("expected a speed such as"), "{words:?}");
        }
    }
}
