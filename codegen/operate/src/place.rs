//! Where a platform is to go, in words: `z=1um rx=-2urad`.

use specgen_language::quantity::{self, Dimension};

/// Names of the axes of a pose.
pub(crate) const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// What is said of each axis, m and rad; none of one that is not named.
pub type Named = [Option<f64>; 6];

/// Reads `AXIS=QUANTITY` words, each axis at most once.
///
/// # Errors
/// The first word that is wrong, and what is expected.
pub(crate) fn named(words: &[&str]) -> Result<Named, String> {
    let mut axes = [None; 6];
    for word in words {
        let expected = || format!("expected AXIS=LENGTH or ANGLE such as z=1um or rx=2urad, found `{word}`");
        let (name, text) = word.split_once('=').ok_or_else(expected)?;
        let axis = AXES.iter().position(|known| *known == name);
        let axis = axis.ok_or_else(|| format!("{}; the axes are {}", expected(), AXES.join(", ")))?;
        let slot = axes.get_mut(axis).ok_or_else(expected)?;
        let read = quantity::parse(text).map_err(|_| expected())?;
        let (dimension, unit) = if axis < 3 { (Dimension::LENGTH, "um") } else { (Dimension::ANGLE, "urad") };
        // Nothing is nothing in any unit.
        let is_zero = read.dimension == Dimension::NONE && read.value == 0.0;
        if read.dimension != dimension && !is_zero {
            return Err(format!("`{word}`: {name} wants a unit of {}, such as {unit}", dimension.describe()));
        }
        if slot.replace(read.value).is_some() {
            return Err(format!("`{word}`: {name} is named twice"));
        }
    }
    Ok(axes)
}

/// The pose that is meant, from the one commanded last: axes that are not named stay as they are.
///
/// # Errors
/// None was commanded, and not every axis is given.
pub fn meant(from: Option<[f64; 6]>, relative: bool, axes: &Named) -> Result<[f64; 6], String> {
    let mut pose = from.unwrap_or_default();
    let is_given = !relative && axes.iter().all(Option::is_some);
    if from.is_none() && !is_given {
        // Zeros in place of what another session commanded would move axes that nobody named.
        return Err(format!(
            "this session has commanded no pose since the machine runs, so that axes not named would be guessed: \
             begin with a `move` of all six ({})",
            AXES.map(|axis| format!("{axis}=…")).join(" ")
        ));
    }
    for (place, value) in pose.iter_mut().zip(axes) {
        if let Some(value) = value {
            *place = if relative { *place + value } else { *value };
        }
    }
    Ok(pose)
}

/// A pose as people say it, µm and µrad.
#[must_use]
pub fn in_words(pose: &[f64; 6]) -> String {
    let axes = AXES.iter().zip(pose).enumerate();
    let text =
        axes.map(|(axis, (name, value))| format!("{name} {:.3} {}", value * 1e6, if axis < 3 { "um" } else { "urad" }));
    text.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_keep_their_place_and_need_their_unit() {
        assert_eq!(named(&["rx=-2urad", "z=1um"]), Ok([None, None, Some(1e-6), Some(-2e-6), None, None]));
        assert_eq!(named(&["x=0"]), Ok([Some(0.0), None, None, None, None, None]));
        for (words, text) in [
            (&["z=1"][..], "z wants a unit of"),
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
    fn what_is_not_named_stays_and_is_never_guessed() {
        let z = [None, None, Some(1e-6), None, None, None];
        let from = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(meant(Some(from), false, &z), Ok([1.0, 2.0, 1e-6, 4.0, 5.0, 6.0]));
        assert_eq!(meant(Some(from), true, &z), Ok([1.0, 2.0, 3.0 + 1e-6, 4.0, 5.0, 6.0]));
        assert_eq!(meant(None, false, &from.map(Some)), Ok(from));
        assert!(meant(None, false, &z).unwrap_err().contains("all six"));
        assert!(meant(None, true, &from.map(Some)).unwrap_err().contains("all six"));
    }
}
