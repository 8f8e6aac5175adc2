//! What has changed between two responses of a machine that were recorded in the same way: the bias of hysteresis is the same in both.

use serde::Serialize;

use super::{OpenResponse, OtherMode};

/// Least changes that are reported: of a leg's gain and of a mode's frequency, relative; of a delay, s.
const GAIN: f64 = 0.01;
const DELAY: f64 = 10e-6;
const FREQUENCY: f64 = 0.005;
/// The same of the damping ratios, relative.
const DAMPING: f64 = 0.2;
/// Other modes are the same within this part of their frequency; less participation in both is not compared.
const SAME: f64 = 0.03;
const LEAST_PART: f64 = 0.06;
/// A leg is driven above this part of its stroke.
const DRIVEN: f64 = 0.01;
/// Gains changed together if each by this part of the mean.
const TOGETHER: f64 = 0.6;

/// A change, and what to do about it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// What has changed, and by how much.
    pub what: String,
    /// What to do.
    pub advice: &'static str,
}

/// What has changed in a machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Health {
    /// Gain of each leg over that before.
    pub gains: [f64; 6],
    /// Change of the delay of each leg, s.
    pub delays: [f64; 6],
    /// Frequency of each mode over that before.
    pub modes: Vec<f64>,
    /// What has changed.
    pub changes: Vec<Change>,
}

impl Health {
    /// Compares two responses, each with the displacement of the legs per volt in strokes, m/V.
    #[must_use]
    pub fn of((before, small): (&OpenResponse, &[f64; 6]), (after, large): (&OpenResponse, &[f64; 6])) -> Self {
        let pairs = || before.modes.iter().zip(&after.modes);
        let mut health = Self {
            gains: std::array::from_fn(|leg| large[leg] / small[leg]),
            delays: std::array::from_fn(|leg| after.delay_of(leg) - before.delay_of(leg)),
            modes: pairs().map(|(before, after)| after.frequency.value / before.frequency.value).collect(),
            changes: Vec::new(),
        };
        health.legs();
        health.platform();
        let damping = pairs().map(|(before, after)| libm::log(after.zeta.value / before.zeta.value));
        let damping = libm::exp(damping.fold(0.0, |sum, one| sum + one) / 6.0);
        if (damping - 1.0).abs() > DAMPING {
            health.add(
                format!("damping of the modes is {damping:.2} times what it was"),
                "look for something that touches the platform, such as a cable, and for loose screws",
            );
        }
        health.others(before, after);
        health
    }

    /// Adds a change.
    pub fn add(&mut self, what: String, advice: &'static str) {
        self.changes.push(Change { what, advice });
    }

    fn legs(&mut self) {
        let gains = self.gains;
        // All together look like the gauges, or the temperature.
        let mean = gains.iter().fold(0.0, |sum, gain| sum + gain - 1.0) / 6.0;
        let together =
            gains.iter().all(|gain| (gain - 1.0) * mean.signum() > TOGETHER * mean.abs() && mean.abs() > GAIN);
        if together {
            self.add(
                format!("gain of all legs {:+.1} %", 100.0 * mean),
                "compare the temperature with that at the commissioning, and check the supply of gauges and amplifiers; if it stays, \
                 commission again from the step `curves`",
            );
        }
        let common = if together { mean } else { 0.0 };
        for (leg, gain) in gains.iter().enumerate().filter(|(_, gain)| (*gain - 1.0 - common).abs() > GAIN) {
            self.add(
                format!("gain of leg {leg} {:+.1} %", 100.0 * (gain - 1.0)),
                "check its amplifier, connector and preload; if it stays, measure its curves again: --step curves --again",
            );
        }
        for (leg, delay) in self.delays.into_iter().enumerate().filter(|(_, delay)| delay.abs() > DELAY) {
            self.add(
                format!("delay of leg {leg} {:+.0} us", delay * 1e6),
                "check its amplifier and the capacitance of its stacks, and filters that were changed; then --step response --again \
                 and --step spec --write",
            );
        }
    }

    fn platform(&mut self) {
        let all: Vec<(usize, f64)> = self.modes.iter().map(|ratio| ratio - 1.0).enumerate().collect();
        let moved = || all.iter().filter(|(_, change)| change.abs() > FREQUENCY);
        let mean = all.iter().fold(0.0, |sum, (_, change)| sum + change) / all.len() as f64;
        let one = |(mode, change): &(usize, f64)| format!("mode {} {:+.1} %", mode + 1, 100.0 * change);
        let what = match moved().count() {
            0 => return,
            count if count == all.len() => {
                format!("all modes {:+.1} %: stiffness over mass {:+.1} %", 100.0 * mean, 200.0 * mean)
            }
            _ => moved().map(one).collect::<Vec<_>>().join(", "),
        };
        self.add(
            what,
            "check what is mounted on the platform, and the screws and preload of joints; if the load has changed, edit [platform]",
        );
    }

    fn others(&mut self, before: &OpenResponse, after: &OpenResponse) {
        // A mode that the spec has is in every fit, with little participation if it is gone.
        let is_there = |one: &OtherMode, mode: &OtherMode| {
            (one.frequency.value / mode.frequency.value - 1.0).abs() < SAME
                && one.participation.value.abs() > 0.3 * mode.participation.value.abs()
        };
        let lists = [(&after.others, &before.others, "new"), (&before.others, &after.others, "gone")];
        for (of, other, word) in lists {
            let clear = of.iter().filter(|mode| mode.participation.value.abs() > LEAST_PART);
            for mode in clear.filter(|mode| !other.iter().any(|one| is_there(one, mode))) {
                self.add(
                    format!("mode of {} at {:.0} Hz is {word}", mode.place, mode.frequency.value),
                    "look for what was mounted, removed or loosened there; then --step response --again and --step spec --write",
                );
            }
        }
    }
}

/// Displacement per volt in the second half of a record of strokes between two rests, m/V, without a drift; rows are evenly spaced, and
/// the strokes begin anywhere in a row. None if nothing was driven.
#[must_use]
pub fn gain_of_strokes(volts: &[f64], moved: &[f64]) -> Option<f64> {
    let rest = *volts.first()?;
    let height = |volts: &f64| (volts - rest).abs();
    let most = volts.iter().map(height).fold(0.0, |most, one| if one > most { one } else { most });
    let drives = |volts: &f64| height(volts) > DRIVEN * most;
    let (first, last) = (volts.iter().position(drives)?, volts.iter().rposition(drives)?);
    // Two strokes meet at rest in the middle.
    let second = usize::midpoint(first, last)..=last;
    let (volts, moved) = (volts.get(second.clone())?, moved.get(second)?);
    let count = volts.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let still = |values: &[f64]| -> Vec<f64> {
        let [level, slope, square] = values.iter().enumerate().fold([0.0; 3], |[level, slope, square], (k, x)| {
            let off = k as f64 - middle;
            [level + x, slope + off * x, square + off * off]
        });
        values.iter().enumerate().map(|(k, x)| x - level / count - slope / square * (k as f64 - middle)).collect()
    };
    let (volts, moved) = (still(volts), still(moved));
    let product = |a: &[f64]| a.iter().zip(&volts).fold(0.0, |sum, (a, volts)| sum + a * volts);
    Some(product(&moved) / product(&volts)).filter(|gain| gain.is_finite())
}
