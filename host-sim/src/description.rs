//! A controller's self-description: its spec, its arithmetic and the names of its words.

use std::collections::BTreeMap;

use crate::word::{Scalar, WordKind};

/// Self-description of a controller, as `key=value` lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// Name of the spec.
    pub name: String,
    /// Digest of the spec, hexadecimal.
    pub digest: String,
    /// Version of the compiler that emitted it.
    pub version: String,
    /// Arithmetic.
    pub scalar: Scalar,
    /// Configuration words in order.
    pub config_names: Vec<String>,
    /// Input words in order.
    pub input_names: Vec<String>,
    /// Output words in order.
    pub output_names: Vec<String>,
}

/// Reason why a description or a name was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DescriptionError {
    /// A key is missing.
    #[error("the controller's description lacks `{0}`; it was built by another version of specgen: build it again")]
    Missing(&'static str),
    /// A key has an invalid value.
    #[error("the controller's description has `{key}={value}`; expected {expected}: build it again")]
    Bad {
        /// The key.
        key: &'static str,
        /// Its value.
        value: String,
        /// What is expected.
        expected: &'static str,
    },
    /// The controller does not have the requested word.
    #[error("the controller has no word `{name}`; it has {}", known.join(", "))]
    NoWord {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// A number that the word cannot represent.
    #[error("`{name}` cannot be {value}; expected a whole number from 0 to 2^53")]
    NotAWord {
        /// The word's name.
        name: String,
        /// The number.
        value: f64,
    },
}

impl Description {
    /// Output lines of triggers.
    pub fn lines(&self) -> usize {
        self.config_names.iter().filter(|name| name.starts_with("trigger_kind[")).count()
    }

    /// Parses `key=value` lines. Unknown keys are ignored; they may belong to a later version.
    ///
    /// # Errors
    /// If a key is missing or has an invalid value.
    pub fn parse(text: &str) -> Result<Self, DescriptionError> {
        let fields = fields(text);
        let field = |key: &'static str| fields.get(key).copied().ok_or(DescriptionError::Missing(key));
        let names = |key| -> Result<Vec<String>, DescriptionError> {
            let text = field(key)?;
            Ok(if text.is_empty() { Vec::new() } else { text.split(',').map(str::to_owned).collect() })
        };
        let bits = field("scalar_bits")?;
        let scalar = bits.parse().ok().and_then(Scalar::from_bits).ok_or_else(|| DescriptionError::Bad {
            key: "scalar_bits",
            value: bits.to_owned(),
            expected: "32 or 64",
        })?;
        Ok(Self {
            name: field("name")?.to_owned(),
            digest: field("digest")?.to_owned(),
            version: field("version")?.to_owned(),
            scalar,
            config_names: names("config_names")?,
            input_names: names("input_names")?,
            output_names: names("output_names")?,
        })
    }

    /// The lines that [`Description::parse`] reads.
    pub fn to_text(&self) -> String {
        let (name, digest, version, bits) = (&self.name, &self.digest, &self.version, self.scalar.bits());
        let (config, inputs) = (self.config_names.join(","), self.input_names.join(","));
        let outputs = self.output_names.join(",");
        format!(
            "name={name}\ndigest={digest}\nversion={version}\nscalar_bits={bits}\nconfig_names={config}\ninput_names={inputs}\noutput_names={outputs}\n"
        )
    }

    /// Index of an input word.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn input(&self, name: &str) -> Result<usize, DescriptionError> {
        position(&self.input_names, name)
    }

    /// Index of an output word.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn output(&self, name: &str) -> Result<usize, DescriptionError> {
        position(&self.output_names, name)
    }

    /// Indices of the six input words `stem[0]` to `stem[5]`.
    ///
    /// # Errors
    /// If one is missing.
    pub fn inputs(&self, stem: &str) -> Result<[usize; 6], DescriptionError> {
        six(&self.input_names, stem)
    }

    /// Indices of the six output words `stem[0]` to `stem[5]`.
    ///
    /// # Errors
    /// If one is missing.
    pub fn outputs(&self, stem: &str) -> Result<[usize; 6], DescriptionError> {
        six(&self.output_names, stem)
    }

    /// Index of a configuration word.
    ///
    /// # Errors
    /// If there is no such word.
    pub fn config(&self, name: &str) -> Result<usize, DescriptionError> {
        position(&self.config_names, name)
    }

    /// Sets one configuration word by name, as a real or an integer according to its kind.
    ///
    /// # Errors
    /// If there is none of that name, or the value of an integer word is not an integer.
    pub fn set_config(&self, words: &mut [u64], name: &str, value: f64) -> Result<(), DescriptionError> {
        let place = self.config(name)?;
        if let Some(slot) = words.get_mut(place) {
            *slot = self.encode(name, value)?;
        }
        Ok(())
    }

    /// Word of `value` for the signal `name`.
    ///
    /// # Errors
    /// If the signal is an integer and `value` is not one.
    pub fn encode(&self, name: &str, value: f64) -> Result<u64, DescriptionError> {
        match WordKind::of(name) {
            WordKind::Real => Ok(self.scalar.encode(value)),
            WordKind::Integer if value >= 0.0 && value <= (1_u64 << 53) as f64 && value == libm::trunc(value) => {
                Ok(value as u64)
            }
            WordKind::Integer => Err(DescriptionError::NotAWord { name: name.to_owned(), value }),
        }
    }
}

/// The `key=value` lines of a text; the last of equal keys counts.
pub(crate) fn fields(text: &str) -> BTreeMap<&str, &str> {
    text.lines().filter_map(|line| line.split_once('=')).collect()
}

/// Names of words that come in sixes, `stem[0]` to `stem[5]` of each stem.
pub fn indexed(stems: &[&str]) -> Vec<String> {
    stems.iter().flat_map(|stem| (0..6).map(move |k| format!("{stem}[{k}]"))).collect()
}

fn six(names: &[String], stem: &str) -> Result<[usize; 6], DescriptionError> {
    let mut places = [0; 6];
    for (place, name) in places.iter_mut().zip(indexed(&[stem])) {
        *place = position(names, &name)?;
    }
    Ok(places)
}

fn position(names: &[String], name: &str) -> Result<usize, DescriptionError> {
    names
        .iter()
        .position(|known| known == name)
        .ok_or_else(|| DescriptionError::NoWord { name: name.to_owned(), known: names.to_vec() })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A controller of six legs with the interface of the emitted one.
    pub(crate) fn six_legs(scalar: Scalar) -> Description {
        let mut output_names = indexed(&["voltage", "requested", "demand", "level", "drift", "dac_code"]);
        output_names.push("status".to_owned());
        Description {
            name: "oracle".to_owned(),
            digest: "00".to_owned(),
            version: "0".to_owned(),
            scalar,
            config_names: ["mode", "level_weight", "drift_weight"].map(str::to_owned).to_vec(),
            input_names: indexed(&["setpoint", "displacement"]),
            output_names,
        }
    }

    #[test]
    fn a_description_reads_back_and_unknown_keys_are_left_alone() {
        let description = six_legs(Scalar::F32);
        let text = description.to_text() + "colour=blue\n";
        assert_eq!(Description::parse(&text), Ok(description));
    }

    #[test]
    fn what_is_missing_or_bad_is_named() {
        let text = six_legs(Scalar::F64).to_text();
        assert_eq!(Description::parse(&text.replace("digest=", "digits=")), Err(DescriptionError::Missing("digest")));
        let bad = Description::parse(&text.replace("scalar_bits=64", "scalar_bits=16")).unwrap_err().to_string();
        assert!(bad.contains("`scalar_bits=16`; expected 32 or 64"), "{bad}");
    }

    #[test]
    fn configuration_is_set_by_name_and_kind() {
        let description = six_legs(Scalar::F32);
        let mut words = [9; 3];
        description.set_config(&mut words, "mode", 2.0).unwrap();
        description.set_config(&mut words, "level_weight", 0.5).unwrap();
        assert_eq!(words, [2, 0x3F00_0000, 9]);
        assert!(
            description.set_config(&mut words, "mode", 0.5).unwrap_err().to_string().contains("`mode` cannot be 0.5")
        );
        let unknown = description.set_config(&mut words, "weight", 1.0).unwrap_err().to_string();
        assert!(unknown.contains("no word `weight`; it has mode, level_weight"), "{unknown}");
    }
}
