//! Learning between passes on the device: the background updates the correction of the next pass from the error of the
//! last.
//!
//! ```text
//! c_j ← w_j V ( Σ_m q_|m| V⁻¹ c_{j−m} + Σ_m h_m V⁻¹ e_{j−m} )        |m| ≤ M, j = 0 … N − 1
//! ```
//! c is the correction and e = h_d − h the error of a pass, knot by knot; V are the modes. q and h are impulse
//! responses of Q and of Q T⁻¹. Both reach as far ahead as back, so that they add no delay. w fades the correction in
//! and out. Convergence is the responsibility of the design of q and h. Sums are of `f32` in written order, so that
//! every device learns the same bits from the same errors.
//!
//! Learning needs a [*plan*](plan_rows). It lies in the memory of the player after the knots of the pass: rows of six
//! words, the bits of an `f32` each.

use crate::playback::Knot;
use crate::real::Real as _;

/// Rows of a plan before its taps: V⁻¹ and V.
pub const HEAD: usize = 12;

/// Rows of a plan whose impulse responses reach M knots to each side: its head, h_−M to h_M of each mode, q_0 to q_M.
#[must_use]
pub const fn plan_rows(reach: usize) -> usize {
    HEAD + 2 * reach + 1 + (reach + 1).div_ceil(6)
}

/// Settings of learning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// M, knots.
    pub reach: u32,
    /// Knots over which the correction fades in and out.
    pub fade: [u32; 2],
}

/// The next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// Transforms the correction and error of this knot to modal coordinates.
    ToModes(usize),
    /// Computes the correction of this mode at this knot.
    Mode(usize, usize),
    /// Transforms this knot to a pose.
    ToPose(usize),
    /// Nothing.
    Done,
}

/// Computes the correction of the next pass.
#[derive(Debug)]
pub struct Learning {
    settings: Settings,
    knots: usize,
    step: Step,
}

impl Learning {
    /// Nothing to do.
    pub const NONE: Self = Self { settings: Settings { reach: 0, fade: [0; 2] }, knots: 0, step: Step::Done };

    /// Learns from a pass of `knots` knots. None if there is no valid plan after them or not enough room. `table` is
    /// the half of the memory with the correction and the plan, `errors` the other.
    #[must_use]
    pub fn new(settings: Settings, knots: usize, table: &[Knot], errors: &[Knot]) -> Option<Self> {
        let reach = settings.reach as usize;
        let fits = reach < table.len() && knots.checked_add(knots.div_ceil(6))? <= errors.len();
        if knots == 0 || !fits {
            return None;
        }
        let plan = table.get(knots..knots.checked_add(plan_rows(reach))?)?;
        let known = plan.as_flattened().iter().all(|word| number(*word).is_finite());
        known.then_some(Self { settings, knots, step: Step::ToModes(0) })
    }

    /// Whether steps remain.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        !matches!(self.step, Step::Done)
    }

    /// Does `steps` steps, each of at most 4 M + 2 products. Returns whether more remain.
    pub fn work(&mut self, steps: u32, table: &mut [Knot], errors: &mut [Knot]) -> bool {
        let Some((played, plan)) = table.split_at_mut_checked(self.knots) else { return false };
        let Some((errors, scratch)) = errors.split_at_mut_checked(self.knots) else { return false };
        let Some((head, taps)) = plan.split_at_checked(HEAD) else { return false };
        for _ in 0..steps {
            self.step = match self.step {
                Step::ToModes(knot) => {
                    for rows in [&mut *played, &mut *errors] {
                        if let Some(row) = rows.get_mut(knot) {
                            let pose = row.map(|value| value as f32);
                            *row = mapped(head, 0, &pose).map(word);
                        }
                    }
                    self.after(knot, Step::ToModes, Step::Mode(0, 0))
                }
                Step::Mode(mode, knot) => {
                    // A copy of the old correction: the new one overwrites it.
                    let old = scratch.as_flattened_mut();
                    if knot == 0 {
                        for (slot, row) in old.iter_mut().zip(&*played) {
                            *slot = row.get(mode).copied().unwrap_or(0);
                        }
                    }
                    let value = self.filtered(mode, knot, taps, old, errors);
                    if let Some(slot) = played.get_mut(knot).and_then(|row| row.get_mut(mode)) {
                        *slot = word(value);
                    }
                    let next = if mode < 5 { Step::Mode(mode + 1, 0) } else { Step::ToPose(0) };
                    self.after(knot, |knot| Step::Mode(mode, knot), next)
                }
                Step::ToPose(knot) => {
                    if let Some(row) = played.get_mut(knot) {
                        let share = self.share(knot);
                        let modes = row.map(number);
                        *row = mapped(head, 6, &modes).map(|value| rounded(share * value));
                    }
                    self.after(knot, Step::ToPose, Step::Done)
                }
                Step::Done => return false,
            };
        }
        self.is_busy()
    }

    /// The same for the next knot, or `last` behind the last.
    fn after(&self, knot: usize, same: impl Fn(usize) -> Step, last: Step) -> Step {
        if knot + 1 < self.knots { same(knot + 1) } else { last }
    }

    /// Σ q c + Σ h e of a mode at a knot.
    fn filtered(&self, mode: usize, knot: usize, taps: &[Knot], old: &[i32], errors: &[Knot]) -> f32 {
        let reach = self.settings.reach as usize;
        let first = knot.saturating_sub(reach);
        let last = if knot + reach < self.knots { knot + reach } else { self.knots - 1 };
        let (taps, smoothing) = taps.split_at_checked(2 * reach + 1).unwrap_or_default();
        let smoothing = smoothing.as_flattened();
        let mut sum = 0.0;
        let past = old.get(first..=knot).unwrap_or_default();
        for (value, tap) in past.iter().zip(smoothing.get(..=knot - first).unwrap_or_default().iter().rev()) {
            sum += number(*tap) * number(*value);
        }
        let ahead = old.get(knot + 1..=last).unwrap_or_default();
        for (value, tap) in ahead.iter().zip(smoothing.get(1..).unwrap_or_default()) {
            sum += number(*tap) * number(*value);
        }
        let seen = errors.get(first..=last).unwrap_or_default();
        let taps = taps.get(reach + knot - last..=reach + knot - first).unwrap_or_default();
        for (error, tap) in seen.iter().zip(taps.iter().rev()) {
            if let (Some(tap), Some(error)) = (tap.get(mode), error.get(mode)) {
                sum += number(*tap) * number(*error);
            }
        }
        sum
    }

    /// w: 0 at both ends, 1 between the fades.
    fn share(&self, knot: usize) -> f32 {
        let part = |inward: usize, fade: u32| {
            if inward >= fade as usize {
                return 1.0;
            }
            let s = inward as f32 / fade as f32;
            s * s * (3.0 - 2.0 * s)
        };
        let [rise, fall] = self.settings.fade;
        part(knot, rise) * part(self.knots - 1 - knot, fall)
    }
}

/// The six rows of a matrix from this row of the plan on, times a vector.
fn mapped(plan: &[Knot], first: usize, vector: &[f32; 6]) -> [f32; 6] {
    let mut found = [0.0; 6];
    for (slot, row) in found.iter_mut().zip(plan.iter().skip(first)) {
        for (factor, value) in row.iter().zip(vector) {
            *slot += number(*factor) * *value;
        }
    }
    found
}

/// The word of a plan.
const fn word(number: f32) -> i32 {
    number.to_bits() as i32
}

/// The number of a word.
const fn number(word: i32) -> f32 {
    f32::from_bits(word as u32)
}

/// Rounds to the nearest whole number, saturated; a NaN gives 0.
fn rounded(value: f32) -> i32 {
    (if value < 0.0 { value - 0.5 } else { value + 0.5 }).truncate()
}
