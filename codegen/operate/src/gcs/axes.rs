//! Names of axes in the protocol.

/// Standard names of a hexapod's axes, by the index of the axis in a pose.
const NAMES: [&str; 6] = ["X", "Y", "Z", "U", "V", "W"];
/// Protocol units per m or rad: µm and µrad.
const SCALE: f64 = 1e6;

/// Axes that clients see, in the order of answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axes(Vec<(String, usize)>);

impl Default for Axes {
    fn default() -> Self {
        Self(NAMES.iter().enumerate().map(|(axis, name)| ((*name).to_owned(), axis)).collect())
    }
}

impl Axes {
    /// Parses `NAME=AXIS` words such as `1=Z`. Without any, all six axes have their standard names.
    ///
    /// # Errors
    /// A word is invalid; the text says what is expected.
    pub fn parse(words: &[String]) -> Result<Self, String> {
        if words.is_empty() {
            return Ok(Self::default());
        }
        let mut axes: Vec<(String, usize)> = Vec::new();
        for word in words {
            let expected =
                || format!("expected NAME=AXIS such as 1=Z, with an axis of {}; found `{word}`", NAMES.join(" "));
            let (name, axis) = word.split_once('=').ok_or_else(expected)?;
            let axis = NAMES.iter().position(|known| *known == axis).ok_or_else(expected)?;
            let is_name = !name.is_empty() && name.len() <= 8 && name.bytes().all(|byte| byte.is_ascii_alphanumeric());
            if !is_name {
                return Err(format!("`{word}`: a name has one to eight letters and digits"));
            }
            if axes.iter().any(|(known, place)| known == name || *place == axis) {
                return Err(format!("`{word}`: each name and each axis can be used only once"));
            }
            axes.push((name.to_owned(), axis));
        }
        Ok(Self(axes))
    }

    /// All axes: name, index in a pose.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&str, usize)> {
        self.0.iter().map(|(name, axis)| (name.as_str(), *axis))
    }

    /// The index in a pose.
    pub(super) fn place(&self, name: &str) -> Option<usize> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, axis)| *axis)
    }
}

/// µm or µrad to m or rad.
pub(super) fn from_wire(value: f64) -> f64 {
    value / SCALE
}

/// m or rad to µm or µrad.
pub(super) fn to_wire(value: f64) -> f64 {
    value * SCALE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_a_hexapod_or_the_given_ones() {
        let words = |words: &[&str]| Axes::parse(&words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>());
        assert_eq!(words(&[]).unwrap().iter().map(|(name, _)| name).collect::<String>(), "XYZUVW");
        let one = words(&["1=Z", "B=U"]).unwrap();
        assert_eq!((one.place("1"), one.place("B"), one.place("Z")), (Some(2), Some(3), None));
        for (wrong, text) in [
            (&["1"][..], "expected NAME=AXIS such as 1=Z"),
            (&["1=z"], "an axis of X Y Z U V W"),
            (&["=X"], "one to eight letters"),
            (&["a b=X"], "one to eight letters"),
            (&["1=X", "1=Y"], "each name and each axis can be used only once"),
            (&["1=X", "2=X"], "each name and each axis can be used only once"),
        ] {
            let error = words(wrong).unwrap_err();
            assert!(error.contains(text), "{wrong:?}: {error}");
        }
    }
}
