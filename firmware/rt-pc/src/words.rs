//! Words that an operator may set, by the controller's names, so that this is the same for six legs and for platforms.

use controller::permitted;
use controller::supervised::MACHINE_INPUT_NAMES;
use controller::{COMMAND_WORDS, Real};
use specgen_runtime::PermittedRange;

/// Words of a command: those that an operator may set. The others are measured or have their own source.
pub type Command = [u64; COMMAND_WORDS];

/// The index of a named input word.
///
/// # Errors
/// As text, if there is none of this name.
pub fn place(name: &str) -> Result<usize, String> {
    MACHINE_INPUT_NAMES
        .iter()
        .position(|known| *known == name)
        .ok_or_else(|| format!("the controller has no input word `{name}`; it has {}", MACHINE_INPUT_NAMES.join(", ")))
}

/// A number as a word of this controller's arithmetic, an f32 with zeros above.
#[allow(clippy::useless_conversion)] // Of the bits of an f64; those of an f32 have 32.
pub fn word(value: Real) -> u64 {
    u64::from(value.to_bits())
}

/// The word of `value` in the input word `index`: the words of the commands are integers, all others numbers.
pub fn word_of(index: usize, value: f64) -> Option<u64> {
    let name = MACHINE_INPUT_NAMES.get(index)?;
    if name.contains('[') { Some(word(value as Real)) } else { integer(value) }
}

/// The word of `value` in the setting at this index of `CONFIG_NAMES`.
pub fn setting(place: usize, value: f64) -> Option<u64> {
    match PermittedRange::of(&permitted::SETTINGS, place)? {
        PermittedRange::Whole(..) => integer(value),
        PermittedRange::Number(..) => value.is_finite().then(|| word(value as Real)),
    }
}

/// The permitted range of the setting at this index, as text.
pub fn range(place: usize) -> String {
    match PermittedRange::of(&permitted::SETTINGS, place) {
        Some(PermittedRange::Whole(least, most)) => {
            format!("a whole number from {least} to {most}, and code_min at most code_max")
        }
        Some(PermittedRange::Number(least, most)) => format!("a number from {least:?} to {most:?}"),
        None => "a setting of this controller".to_owned(),
    }
}

fn integer(value: f64) -> Option<u64> {
    let whole = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
    whole.then_some(value as u64)
}

/// Control period, ns, from the controller's description.
pub fn period() -> Option<u64> {
    let text = controller::DESCRIPTION.lines().find_map(|line| line.strip_prefix("period="))?;
    let seconds: f64 = text.parse().ok()?;
    let nanoseconds = (seconds * 1e9).round();
    (1e3..1e12).contains(&nanoseconds).then_some(nanoseconds as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::supervised::{MachineInput, Request};

    #[test]
    fn readings_and_requests_go_to_their_words_and_to_no_other() {
        let input = MachineInput::measured(&[1; COMMAND_WORDS], &[2.0; 6], &[3.0; 6], Request::Hold, 9);
        for (index, (name, found)) in MACHINE_INPUT_NAMES.iter().zip(input.to_words()).enumerate() {
            let (measured, expected) = match *name {
                "request" => (true, 3),
                "events" => (true, 9),
                name if name.starts_with("wrench") => (true, word(3.0)),
                name if name.starts_with("gauge") || name.starts_with("displacement") => (true, word(2.0)),
                _ => (false, 1),
            };
            assert_eq!(found, expected, "{name}");
            assert_eq!(index >= COMMAND_WORDS, measured, "{name}");
        }
    }

    #[test]
    fn numbers_and_integers_become_words_and_halves_of_integers_do_not() {
        let request = place("request").unwrap();
        assert_eq!(word_of(request, 3.0), Some(3));
        assert_eq!([0.5, -1.0, 5e9, f64::NAN].map(|value| word_of(request, value)), [None; 4]);
        assert_eq!(word_of(place("setpoint[2]").unwrap(), 1e-6), Some(word(1e-6)));
        assert!(place("setpoint[6]").unwrap_err().contains("no input word `setpoint[6]`"));
    }

    #[test]
    fn a_setting_is_whole_where_it_is_a_choice_and_has_a_range() {
        let place = |name: &str| controller::CONFIG_NAMES.iter().position(|known| *known == name).unwrap();
        let (mode, gain) = (place("mode"), place("kp[0]"));
        assert_eq!([3.0, 0.5, f64::INFINITY].map(|value| setting(mode, value)), [Some(3), None, None]);
        assert_eq!(
            [3.0, 0.5, f64::INFINITY].map(|value| setting(gain, value)),
            [Some(word(3.0)), Some(word(0.5)), None]
        );
        assert_eq!(setting(controller::CONFIG_WORDS, 1.0), None);
        assert!(range(mode).contains("a whole number from 0 to") && range(gain).contains("a number from"));
        assert!(range(controller::CONFIG_WORDS).contains("a setting of this controller"));
        assert_eq!(word_of(MACHINE_INPUT_NAMES.len(), 1.0), None);
        assert_eq!(period(), Some(100_000));
    }
}
