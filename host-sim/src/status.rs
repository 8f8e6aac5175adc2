//! The status word of a tick in plain words.

/// Single bits of the status word, with what they mean.
const BITS: [(u32, &str); 4] =
    [(16, "set-point refused"), (17, "stream stale"), (18, "moving"), (19, "wrench not believed")];
/// First bit of six, one for each leg or gauge, with what comes before and behind its number.
const SIXES: [(u32, &str, &str); 3] =
    [(0, "leg", "limited"), (8, "gauge", "not believed"), (24, "leg", "by its static inverse")];

/// What the bits of a status word say, joined by commas; `-` if none is set. Legs and gauges count from 0, in the order of the
/// spec. A bit without a meaning is named by its number, so that a word of another version is not read as good.
///
/// ```
/// assert_eq!(host_sim::status::in_words(0), "-");
/// assert_eq!(host_sim::status::in_words(0x4_0201), "leg 0 limited, gauge 1 not believed, moving");
/// ```
#[must_use]
pub fn in_words(status: u32) -> String {
    let meaning = |bit: u32| {
        let six = SIXES.iter().find(|(first, ..)| (*first..first + 6).contains(&bit));
        let one = BITS.iter().find(|(number, _)| *number == bit);
        match (six, one) {
            (Some((first, what, is)), _) => format!("{what} {} {is}", bit - first),
            (None, Some((_, text))) => (*text).to_owned(),
            (None, None) => format!("bit {bit}"),
        }
    };
    let set: Vec<String> = (0..u32::BITS).filter(|bit| status >> bit & 1 == 1).map(meaning).collect();
    if set.is_empty() { "-".to_owned() } else { set.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::in_words;

    #[test]
    fn every_bit_has_a_text_of_its_own() {
        let texts: std::collections::BTreeSet<String> = (0..32).map(|bit| in_words(1 << bit)).collect();
        assert_eq!(texts.len(), 32);
        let known = (0..32).filter(|bit| !in_words(1 << bit).starts_with("bit ")).count();
        assert_eq!(known, 22, "the bits of docs/control-law.md and those of a rate-dependent inverse");
    }
}
