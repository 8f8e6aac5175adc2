//! The memory of a Preisach model: the reversals that later drive has not wiped out.
//!
//! This is the identification's own memory, in f64 and with unlimited depth. The controller's bounded one is a separate
//! implementation; tests compare both with brute-force relays.

/// Alternating extrema of the drive, in V: a minimum first, then a maximum, a minimum, …; the last one is the present drive.
///
/// The first entry is the lower end of the range: the memory starts in negative saturation and returns to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Staircase {
    range: [f64; 2],
    extrema: Vec<f64>,
}

impl Staircase {
    /// Negative saturation: every relay is off. `range` in V, lower end first.
    #[must_use]
    pub fn negative_saturation(range: [f64; 2]) -> Self {
        Self { range, extrema: vec![range[0]] }
    }

    /// Moves the drive monotonically to `drive` (V, saturated to the range).
    pub fn push(&mut self, drive: f64) {
        let u = saturate(drive, self.range);
        if u <= self.range[0] {
            self.extrema.truncate(1);
            return;
        }
        // The top extremum, and what the drive wipes out, depend on the direction. The bottom entry is a minimum, so
        // entries of odd index are maxima.
        while let [.., last] = self.extrema[..] {
            let top_is_maximum = self.extrema.len().is_multiple_of(2);
            let passed = if top_is_maximum { u >= last } else { u <= last };
            if passed && self.extrema.len() > 1 {
                // The drive continues in the direction of the top extremum, which was then not a reversal.
                self.extrema.pop();
                continue;
            }
            // Against it: the pair below is wiped out when the drive passes its far end.
            match self.extrema[..] {
                [.., before, _] if self.extrema.len() > 2 && beyond(u, before, top_is_maximum) => {
                    self.extrema.truncate(self.extrema.len() - 2);
                }
                _ => break,
            }
        }
        self.extrema.push(u);
    }

    /// The extrema, from negative saturation to the present drive.
    #[must_use]
    pub fn extrema(&self) -> &[f64] {
        &self.extrema
    }
}

/// Whether `u` passes the extremum before the top one, which is a minimum if the top is a maximum.
fn beyond(u: f64, before: f64, top_is_maximum: bool) -> bool {
    if top_is_maximum { u <= before } else { u >= before }
}

/// `x` limited to `range`.
pub(crate) fn saturate(x: f64, range: [f64; 2]) -> f64 {
    if x < range[0] {
        range[0]
    } else if x > range[1] {
        range[1]
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(path: &[f64]) -> Vec<f64> {
        let mut memory = Staircase::negative_saturation([0.0, 10.0]);
        for &u in path {
            memory.push(u);
        }
        memory.extrema().to_vec()
    }

    #[test]
    fn wiping_out_a_larger_extremum_forgets_the_smaller_ones() {
        assert_eq!(after(&[8.0, 2.0, 6.0, 3.0, 5.0]), [0.0, 8.0, 2.0, 6.0, 3.0, 5.0]);
        assert_eq!(after(&[8.0, 2.0, 6.0, 3.0, 6.5]), [0.0, 8.0, 2.0, 6.5]);
        assert_eq!(after(&[8.0, 2.0, 6.0, 3.0, 1.0]), [0.0, 8.0, 1.0]);
        assert_eq!(after(&[8.0, 2.0, 6.0, 9.0]), [0.0, 9.0]);
        assert_eq!(after(&[8.0, 2.0, 6.0, -3.0]), [0.0]);
        assert_eq!(after(&[8.0, 2.0, 6.0, 20.0]), [0.0, 10.0]);
    }

    #[test]
    fn steps_along_a_branch_leave_no_trace() {
        assert_eq!(after(&[1.0, 2.0, 8.0, 7.0, 5.0, 2.0]), after(&[8.0, 2.0]));
        assert_eq!(after(&[8.0, 8.0, 2.0, 2.0, 2.0]), after(&[8.0, 2.0]));
    }
}
