//! What is wrong with gauges or legs, told from what the gauges showed. Nothing here drives anything.

use serde::Serialize;

/// Part of what is measured that a finding may leave unexplained, in power.
const LEFT: f64 = 0.05;
/// Gain beyond which something is wrong. The inverse of the hysteresis is good to some per cent without feedback.
const GAIN: [f64; 2] = [0.75, 1.25];
/// Less than this part of what is expected is nothing.
const NOTHING: f64 = 0.2;
/// A way on which the gauges show less than this, m each, tells nothing.
const SHORTEST: f64 = 0.1e-6;

/// Readings of the gauges (rows) per displacement of a leg (columns), m each.
pub type Matrix = [[f64; 6]; 6];

/// The way to the bias, as far as the platform came, m.
#[derive(Default)]
pub struct Way {
    /// What each leg lengthens on the whole of it.
    pub legs: [f64; 6],
    /// What each gauge showed, where that was the most.
    pub gauges: [f64; 6],
}

impl Way {
    pub fn seen(&mut self, legs: [f64; 6], gauges: [f64; 6]) {
        if dot(&gauges, &gauges) > dot(&self.gauges, &self.gauges) {
            *self = Self { legs, gauges };
        }
    }
}

/// What was found of one gauge or leg.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    pub good: bool,
    /// Times what the spec says.
    pub gain: f64,
    pub what: String,
    /// What to mend; empty where it is good.
    pub mend: String,
}

/// What was found of all of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    pub good: bool,
    pub what: String,
    pub legs: Vec<Found>,
    pub gauges: Vec<Found>,
}

/// What is wrong with gauges or legs, if `measured` can be told from that.
pub fn judge(expected: &Matrix, measured: &Matrix) -> Verdict {
    let (gauges, left) = matched(expected, measured);
    let (legs, left_by_legs) = matched(&transposed(expected), &transposed(measured));
    let is_plain =
        |rows: &[(usize, f64); 6]| rows.iter().enumerate().all(|(place, row)| row.0 == place && !is_off(row.1));
    let own = core::array::from_fn(|place| (place, 1.0));
    let by_gauges = left <= LEFT && is_order(&gauges);
    let by_legs = left_by_legs <= LEFT && is_order(&legs);
    // What the one explains is not looked for in the other.
    let (legs, gauges) = if by_gauges && by_legs && is_plain(&gauges) && is_plain(&legs) {
        (legs, gauges)
    } else if by_gauges && (!by_legs || left <= left_by_legs) {
        (own, gauges)
    } else if by_legs {
        (legs, own)
    } else {
        return unexplained(expected, measured);
    };
    let legs: Vec<Found> = legs.iter().enumerate().map(|(leg, row)| of_leg(leg, *row)).collect();
    let gauges: Vec<Found> = gauges.iter().enumerate().map(|(gauge, row)| of_gauge(gauge, *row)).collect();
    let bad: Vec<&Found> = legs.iter().chain(&gauges).filter(|one| !one.good).collect();
    let what = match bad.first() {
        None => "every leg lengthens with its voltage, and every gauge is where the spec says.".to_owned(),
        Some(first) if bad.len() == 1 => format!("{}.", first.what),
        Some(first) => format!("{}, and {} more.", first.what, bad.len() - 1),
    };
    Verdict { good: bad.is_empty(), what, legs, gauges }
}

/// What is wrong, from a way of all legs together of which only the direction is known: one gauge or one leg that is turned, if
/// that explains what was seen and nothing else does.
pub fn at_first_sight(per_leg: &Matrix, Way { legs, gauges }: &Way) -> Option<Verdict> {
    let power = dot(gauges, gauges);
    // What is left unexplained by these readings, of whatever size.
    let left = |expected: [f64; 6]| {
        let along = dot(&expected, gauges);
        if along > 0.0 { 1.0 - along * along / (dot(&expected, &expected) * power) } else { 1.0 }
    };
    let plain = times(per_leg, legs);
    if power < 6.0 * SHORTEST * SHORTEST || left(plain) <= LEFT {
        return None;
    }
    let turned = |mut all: [f64; 6], which: usize| {
        all[which] = -all[which];
        all
    };
    let gauge = |which| (left(turned(plain, which)), true, which);
    let leg = |which| (left(times(per_leg, &turned(*legs, which))), false, which);
    let mut all: Vec<_> = (0..6).map(gauge).chain((0..6).map(leg)).collect();
    all.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
    let (best, is_gauge, which) = all[0];
    if best > LEFT || all[1].0 <= 2.0 * LEFT {
        return None;
    }
    let (legs, gauges) = if is_gauge {
        (Vec::new(), vec![of_gauge(which, (which, -1.0))])
    } else {
        (vec![of_leg(which, (which, -1.0))], Vec::new())
    };
    let found = legs.iter().chain(&gauges).map(|one: &Found| one.what.as_str()).collect::<String>();
    let what = format!("{found}. The way to the bias shows it; the supervisor ended that.");
    Some(Verdict { good: false, what, legs, gauges })
}

/// For each row of `measured` the row of `expected` that it is, with its gain; and what that leaves, as part of the power.
fn matched(expected: &Matrix, measured: &Matrix) -> ([(usize, f64); 6], f64) {
    let power = measured.iter().fold(0.0, |sum, row| sum + dot(row, row));
    let mut left = 0.0;
    let rows = core::array::from_fn(|index| {
        let row = &measured[index];
        let gain = |which: usize| dot(row, &expected[which]) / dot(&expected[which], &expected[which]);
        // What is explained of the row's power; its own place first, where that is as good.
        let explained = |which: usize| gain(which) * dot(row, &expected[which]);
        // What does not move is in no other's place.
        let own = dot(&expected[index], &expected[index]);
        let still = dot(row, row) < NOTHING * NOTHING * own;
        let better = |best: usize, which: usize| !still && explained(which) > 1.02 * explained(best);
        let best = (0..6).fold(index, |best, which| if better(best, which) { which } else { best });
        left += dot(row, row) - explained(best);
        (best, gain(best))
    });
    (rows, if power > 0.0 { left / power } else { 1.0 })
}

/// Whether each place is taken once.
fn is_order(rows: &[(usize, f64); 6]) -> bool {
    (0..6).all(|place| rows.iter().any(|(which, _)| *which == place))
}

fn is_off(gain: f64) -> bool {
    !(GAIN[0]..=GAIN[1]).contains(&gain)
}

fn of_gauge(gauge: usize, (place, gain): (usize, f64)) -> Found {
    let (good, what, mend) = if gain.abs() < NOTHING {
        (false, format!("gauge {gauge} does not move"), "Check its cable and its supply.".to_owned())
    } else if place != gauge {
        let turned = if gain < 0.0 { ", and the wrong way" } else { "" };
        let mend = format!(
            "Exchange the cables of gauges {gauge} and {place}, or their `[[gauge]]` in the spec{}.",
            if gain < 0.0 { "; then turn its `direction`" } else { "" }
        );
        (false, format!("gauge {gauge} shows what gauge {place} should{turned}"), mend)
    } else if gain < 0.0 {
        let mend = "Exchange its wires, or turn its `direction` in the spec.".to_owned();
        (false, format!("gauge {gauge} runs the wrong way"), mend)
    } else if is_off(gain) {
        let mend = "Check `sensor.range` or its calibration, and its converter's input range.".to_owned();
        (false, format!("gauge {gauge} shows {gain:.2} times what it should"), mend)
    } else {
        (true, format!("gauge {gauge} is as the spec says"), String::new())
    };
    Found { good, gain, what, mend }
}

fn of_leg(leg: usize, (place, gain): (usize, f64)) -> Found {
    let (good, what, mend) = if gain.abs() < NOTHING {
        (false, format!("leg {leg} does not move"), "Check its amplifier, its cable and its bolts.".to_owned())
    } else if place != leg {
        let mend = format!("Exchange the amplifier cables of legs {leg} and {place}.");
        (false, format!("leg {leg} moves what leg {place} should"), mend)
    } else if gain < 0.0 {
        (false, format!("leg {leg} shortens with its voltage"), "Exchange the wires of its stack.".to_owned())
    } else if is_off(gain) {
        let mend = "Check its amplifier's gain, `dac.range` and its reversal-curve record.".to_owned();
        (false, format!("leg {leg} moves {gain:.2} times as far as it should"), mend)
    } else {
        (true, format!("leg {leg} lengthens with its voltage"), String::new())
    };
    Found { good, gain, what, mend }
}

/// Neither gauges nor legs alone: leg by leg, how well what it does is what it should do.
fn unexplained(expected: &Matrix, measured: &Matrix) -> Verdict {
    let (wanted, seen) = (transposed(expected), transposed(measured));
    let legs = (0..6).map(|leg| {
        let gain = dot(&seen[leg], &wanted[leg]) / dot(&wanted[leg], &wanted[leg]);
        let left = dot(&seen[leg], &seen[leg]) - gain * dot(&seen[leg], &wanted[leg]);
        let good = left <= LEFT * dot(&seen[leg], &seen[leg]) && !is_off(gain);
        let what = if good {
            format!("leg {leg} is as the spec says")
        } else {
            format!("leg {leg} moves otherwise than it should")
        };
        let mend = if good {
            ""
        } else {
            "Check joints and gauges of the spec against the machine, and what is bolted where."
        };
        Found { good, gain, what, mend: mend.to_owned() }
    });
    let what =
        "what the gauges show is neither gauges nor legs exchanged: more than one kind of thing is wrong.".to_owned();
    Verdict { good: false, what, legs: legs.collect(), gauges: Vec::new() }
}

pub fn times(matrix: &Matrix, vector: &[f64; 6]) -> [f64; 6] {
    matrix.map(|row| dot(&row, vector))
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

fn transposed(matrix: &Matrix) -> Matrix {
    core::array::from_fn(|row| core::array::from_fn(|column| matrix[column][row]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_compiler::compile;
    use std::path::Path;

    fn expected() -> Matrix {
        let spec = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs/reference.toml");
        let compiled = compile::compile(&spec).unwrap_or_else(|_| panic!("the reference compiles"));
        compiled.ir.supervision.readings_per_leg.unwrap()
    }

    /// As measured where feed-forward is off by some per cent, otherwise for each leg.
    fn measured(expected: &Matrix) -> Matrix {
        let mut measured = *expected;
        for row in &mut measured {
            row.iter_mut().enumerate().for_each(|(leg, value)| *value *= 0.94 + 0.02 * leg as f64);
        }
        measured
    }

    fn bad(verdict: &Verdict) -> Vec<String> {
        verdict.legs.iter().chain(&verdict.gauges).filter(|one| !one.good).map(|one| one.what.clone()).collect()
    }

    #[test]
    fn every_exchange_and_every_sign_is_told_from_every_other() {
        let expected = expected();
        let good = measured(&expected);
        let verdict = judge(&expected, &good);
        assert!(verdict.good && verdict.legs.len() == 6 && verdict.gauges.len() == 6, "{verdict:?}");
        for one in 0..6 {
            let mut turned = good;
            turned[one] = turned[one].map(|value| -value);
            assert_eq!(bad(&judge(&expected, &turned)), [format!("gauge {one} runs the wrong way")]);
            let mut half = good;
            half[one] = half[one].map(|value| 0.5 * value);
            let found = bad(&judge(&expected, &half));
            assert!(found.len() == 1 && found[0].starts_with(&format!("gauge {one} shows 0.")), "{found:?}");
            let mut dead = good;
            dead[one] = [1e-6; 6];
            assert_eq!(bad(&judge(&expected, &dead)), [format!("gauge {one} does not move")]);
            let mut shortens = transposed(&good);
            shortens[one] = shortens[one].map(|value| -value);
            assert_eq!(
                bad(&judge(&expected, &transposed(&shortens))),
                [format!("leg {one} shortens with its voltage")]
            );
            for other in one + 1..6 {
                let mut exchanged = good;
                exchanged.swap(one, other);
                let words = [(one, other), (other, one)].map(|(a, b)| format!("gauge {a} shows what gauge {b} should"));
                assert_eq!(bad(&judge(&expected, &exchanged)), words);
                let mut exchanged = transposed(&good);
                exchanged.swap(one, other);
                let words = [(one, other), (other, one)].map(|(a, b)| format!("leg {a} moves what leg {b} should"));
                assert_eq!(bad(&judge(&expected, &transposed(&exchanged))), words);
            }
        }
        // Two kinds of mistakes at once are not explained away.
        let mut both = transposed(&good);
        both.swap(0, 3);
        let mut both = transposed(&both);
        both.swap(1, 4);
        let verdict = judge(&expected, &both);
        assert!(!verdict.good && verdict.gauges.is_empty(), "{verdict:?}");
    }

    /// One way up names what is turned where it shows there: where nothing else would look alike, and nothing where all is well.
    #[test]
    fn what_is_turned_is_named_on_the_way_up_or_nothing_is() {
        let expected = expected();
        let legs = [2e-6; 6];
        let good = times(&measured(&expected), &legs);
        let sight = |gauges| at_first_sight(&expected, &Way { legs, gauges });
        assert_eq!(sight(good), None);
        let mut short = good.map(|value| 1e-3 * value);
        short[1] = -short[1];
        assert_eq!(sight(short), None, "too short a way");
        let mut named = Vec::new();
        for one in 0..6 {
            let mut turned = good;
            turned[one] = -turned[one];
            let mut shortened = legs;
            shortened[one] = -shortened[one];
            let cases = [
                (turned, format!("gauge {one} runs the wrong way")),
                (times(&measured(&expected), &shortened), format!("leg {one} shortens with its voltage")),
            ];
            for (seen, what) in cases {
                let Some(verdict) = sight(seen) else { continue };
                assert!(!verdict.good);
                assert_eq!(bad(&verdict), [what.as_str()]);
                named.push(what);
            }
        }
        // Of a way up the three level gauges show too little to tell one from another.
        let gauges = (0..3).map(|gauge| format!("gauge {gauge} runs the wrong way"));
        let mut expected: Vec<String> =
            gauges.chain((0..6).map(|leg| format!("leg {leg} shortens with its voltage"))).collect();
        expected.sort();
        named.sort();
        assert_eq!(named, expected);
    }
}
