//! Set-points of a controller without a generator: a smooth approach from the present position to the requested
//! set-point.

use crate::choice::choice;
use crate::real::Real;

choice! {
    /// State of an approach.
    enum Stage {
        Done = 0,
        /// No set-point has been accepted yet.
        Waiting = 1,
        Fading = 2,
    }
}

crate::state! { |words|
    /// An offset on the set-point that fades: it starts at the present position and ends at the requested set-point. At
    /// reset set-points pass unchanged.
    pub struct Approach<T>[T: Real] {
        stage: Stage = Stage::Done, choice;
        /// The remaining offset, in the coordinates of the set-point.
        offset: [T; 6] = [T::ZERO; 6], axes(words.sizes().user);
    }
}

impl<T: Real> Approach<T> {
    /// Starts at the position of the legs (finite).
    #[inline]
    pub fn begin(&mut self, from: [T; 6]) {
        *self = Self { stage: Stage::Waiting, offset: from };
    }

    /// Whether set-points pass unchanged.
    #[inline]
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// The set-point for the law, from the requested one. A set-point that is not `accepted` (finite, within bounds)
    /// passes unchanged, so that the law refuses it. Each tick leaves the fraction `keep` (in [0, 1)) of the offset,
    /// and nothing below `negligible`.
    #[inline]
    pub fn setpoint(&mut self, asked: &[T; 6], accepted: bool, keep: T, negligible: T) -> [T; 6] {
        if self.stage == Stage::Done || !accepted {
            return *asked;
        }
        self.fade(asked, keep, negligible)
    }

    #[cold]
    #[inline(never)]
    fn fade(&mut self, asked: &[T; 6], keep: T, negligible: T) -> [T; 6] {
        let mut setpoint = *asked;
        if self.stage == Stage::Waiting {
            for (offset, asked) in self.offset.iter_mut().zip(asked) {
                *offset = *asked - *offset;
            }
        }
        self.stage = Stage::Done;
        for (value, offset) in setpoint.iter_mut().zip(&mut self.offset) {
            *value = *value - *offset;
            let faded = keep * *offset;
            let left = faded.abs() > negligible;
            *offset = if left { faded } else { T::ZERO };
            if left {
                self.stage = Stage::Fading;
            }
        }
        setpoint
    }
}
