//! Set-points of a controller without a generator, from where the legs are to where they are asked for.

use crate::choice::choice;
use crate::real::Real;

choice! {
    /// How far an approach has come.
    enum Stage {
        Done = 0,
        /// No set-point has been accepted yet.
        Waiting = 1,
        Fading = 2,
    }
}

crate::state! { |words|
    /// An offset on the set-point that fades: at first it is where the legs are, in the end where they are asked for. At reset
    /// set-points go through as they are.
    pub struct Approach<T>[T: Real] {
        stage: Stage = Stage::Done, choice;
        /// Where it starts, then what is left of the way; in the coordinates of the set-point.
        offset: [T; 6] = [T::ZERO; 6], axes(words.sizes().user);
    }
}

impl<T: Real> Approach<T> {
    /// Begins where the legs are (finite).
    #[inline]
    pub fn begin(&mut self, from: [T; 6]) {
        *self = Self { stage: Stage::Waiting, offset: from };
    }

    /// Whether set-points go through as they are.
    #[inline]
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// The set-point to give to the law for the one that is asked for. One that is not `accepted` (finite, within bounds) goes
    /// through as it is, for the law to refuse. `keep` (in [0, 1)) of the way is left after each tick, and none of what is below
    /// `negligible`.
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
