//! The input words of the machine: what the operator wants, what the gauges say.
//!
//! Places are found by the names that the controller gives its words, so that this is the same for six legs and for platforms.

use controller::Real;
use controller::permitted;
use controller::sensing::gauge_reading;
use controller::supervised::{MACHINE_INPUT_NAMES, MACHINE_INPUT_WORDS};
use specgen_hal::CHANNELS;
use specgen_runtime::Permitted;

/// Words of one supervised tick.
pub type Words = [u64; MACHINE_INPUT_WORDS];

/// What gauges are called: on a platform, and on legs with one each.
const GAUGE_STEMS: [&str; 2] = ["gauge", "displacement"];

/// Where the words lie that a target fills in.
#[derive(Debug, Clone)]
pub struct Places {
    gauge: [usize; CHANNELS],
    wrench: Option<[usize; CHANNELS]>,
    request: usize,
    events: usize,
    /// The command of a platform; legs have none.
    command: Option<usize>,
}

/// Word of the command to hold.
const HOLD: u64 = 0;

/// Why the words of a controller are not what this target expects.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoWord(pub String);

impl std::fmt::Display for NoWord {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the controller has no input word `{}`; it has {}", self.0, MACHINE_INPUT_NAMES.join(", "))
    }
}

impl Places {
    /// Of this controller.
    ///
    /// # Errors
    /// If a word is missing: controller and target are of two versions.
    pub fn find() -> Result<Self, NoWord> {
        let gauges = GAUGE_STEMS.iter().find_map(|stem| six(stem).ok());
        Ok(Self {
            gauge: gauges.ok_or_else(|| NoWord("gauge[0]".to_owned()))?,
            wrench: six("wrench").ok(),
            request: place("request")?,
            events: place("events")?,
            command: place("command").ok(),
        })
    }

    /// Whether the operator may set a word: measured ones, request and events have sources of their own.
    #[must_use]
    pub fn is_free(&self, index: usize) -> bool {
        let measured = self.gauge.contains(&index) || self.wrench.is_some_and(|wrench| wrench.contains(&index));
        !measured && index != self.request && index != self.events && index < MACHINE_INPUT_WORDS
    }

    /// Places of the words that the operator may set, in order.
    pub fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..MACHINE_INPUT_WORDS).filter(|index| self.is_free(*index))
    }

    /// A command to stay at a set-point that was reached by a wave about `center`, m and rad: on a platform to hold, for legs the
    /// set-point itself.
    pub fn rest_at(&self, center: &[Real; CHANNELS], words: &mut Words) {
        match self.command {
            Some(place) => words[place] = HOLD,
            None => {
                for (place, value) in self.free().zip(center) {
                    words[place] = word(*value);
                }
            }
        }
    }

    /// Puts readings in. `wrench` is in N and N m.
    pub fn put_readings(&self, words: &mut Words, codes: &[i32; CHANNELS], wrench: &[f64; CHANNELS]) {
        for (place, code) in self.gauge.iter().zip(codes) {
            words[*place] = word(gauge_reading(*code));
        }
        if let Some(places) = &self.wrench {
            for (place, value) in places.iter().zip(wrench) {
                words[*place] = word(*value as Real);
            }
        }
    }

    /// Event bits of a tick's words.
    #[must_use]
    pub fn events(&self, words: &Words) -> u32 {
        words[self.events] as u32
    }

    /// Puts the request and what happened since the last tick in.
    pub fn put_supervision(&self, words: &mut Words, request: u64, events: u32) {
        words[self.request] = request;
        words[self.events] = u64::from(events);
    }
}

/// The place of a named input word.
///
/// # Errors
/// If there is none of this name.
pub fn place(name: &str) -> Result<usize, NoWord> {
    MACHINE_INPUT_NAMES.iter().position(|known| *known == name).ok_or_else(|| NoWord(name.to_owned()))
}

/// A number as a word of this controller's arithmetic, an f32 with zeros above.
#[must_use]
#[allow(clippy::useless_conversion)] // Of the bits of an f64; those of an f32 have 32.
pub fn word(value: Real) -> u64 {
    u64::from(value.to_bits())
}

/// The word of `value` in the input word `index`: the words of the commands are integers, all others numbers.
#[must_use]
pub fn word_of(index: usize, value: f64) -> Option<u64> {
    let name = MACHINE_INPUT_NAMES.get(index)?;
    if name.contains('[') { Some(word(value as Real)) } else { integer(value) }
}

/// The word of `value` in the setting with this place in `CONFIG_NAMES`.
#[must_use]
pub fn setting(place: usize, value: f64) -> Option<u64> {
    match Permitted::of(&permitted::SETTINGS, place)? {
        Permitted::Whole(..) => integer(value),
        Permitted::Number(..) => value.is_finite().then(|| word(value as Real)),
    }
}

/// What the setting with this place may be, in words.
#[must_use]
pub fn range(place: usize) -> String {
    match Permitted::of(&permitted::SETTINGS, place) {
        Some(Permitted::Whole(least, most)) => {
            format!("a whole number from {least} to {most}, and code_min at most code_max")
        }
        Some(Permitted::Number(least, most)) => format!("a number from {least:?} to {most:?}"),
        None => "a setting of this controller".to_owned(),
    }
}

fn integer(value: f64) -> Option<u64> {
    let whole = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
    whole.then_some(value as u64)
}

/// Control period, ns, as the controller describes itself.
#[must_use]
pub fn period() -> Option<u64> {
    let text = controller::DESCRIPTION.lines().find_map(|line| line.strip_prefix("period="))?;
    let seconds: f64 = text.parse().ok()?;
    let nanoseconds = (seconds * 1e9).round();
    (1e3..1e12).contains(&nanoseconds).then_some(nanoseconds as u64)
}

fn six(stem: &str) -> Result<[usize; CHANNELS], NoWord> {
    let mut places = [0; CHANNELS];
    for (k, slot) in places.iter_mut().enumerate() {
        *slot = place(&format!("{stem}[{k}]"))?;
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_and_requests_go_to_their_words_and_to_no_other() {
        let places = Places::find().unwrap();
        let mut words = [7; MACHINE_INPUT_WORDS];
        places.put_readings(&mut words, &[100, 200, 300, 400, 500, 600], &[1.0; CHANNELS]);
        places.put_supervision(&mut words, 2, 9);
        for (index, (name, found)) in MACHINE_INPUT_NAMES.iter().zip(words).enumerate() {
            let gauge = (0..CHANNELS).find(|k| GAUGE_STEMS.iter().any(|stem| *name == format!("{stem}[{k}]")));
            let expected = match (gauge, *name) {
                (Some(k), _) => word(gauge_reading(100 * (k as i32 + 1))),
                (_, "request") => 2,
                (_, "events") => 9,
                (_, name) if name.starts_with("wrench") => word(1.0),
                _ => 7,
            };
            assert_eq!(found, expected, "{name}");
            assert_eq!(places.is_free(index), expected == 7, "{name}");
        }
        assert!(!places.is_free(MACHINE_INPUT_WORDS));
    }

    #[test]
    fn numbers_and_integers_become_words_and_halves_of_integers_do_not() {
        let request = place("request").unwrap();
        assert_eq!(word_of(request, 3.0), Some(3));
        assert_eq!([0.5, -1.0, 5e9, f64::NAN].map(|value| word_of(request, value)), [None; 4]);
        assert_eq!(word_of(place("setpoint[2]").unwrap(), 1e-6), Some(word(1e-6)));
        assert!(place("setpoint[6]").unwrap_err().to_string().contains("no input word `setpoint[6]`"));
    }
}
