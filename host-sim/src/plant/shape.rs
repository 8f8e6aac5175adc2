//! Motions within a step, a lane for each leg.

/// A number of each leg. Lanes after the last leg are idle.
pub(crate) type Lane<const N: usize> = [f64; N];

/// Number of lags in a step above which all moving plays start at once.
const AT_ONCE: f64 = 5.0;

/// A motion over a step of length 1, a lane per leg: its `end`, and its deviation from the shape of the amplifier's
/// lag, as a `mean` and as `skew`, the first moment about the middle of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepShape<const N: usize> {
    pub(crate) end: Lane<N>,
    pub(crate) mean: Lane<N>,
    pub(crate) skew: Lane<N>,
}

impl<const N: usize> StepShape<N> {
    /// At 0 all the time.
    pub(crate) const REST: Self = Self { end: [0.0; N], mean: [0.0; N], skew: [0.0; N] };
}

/// Shape of plays that move only during the last part f of a motion, and so miss 1 − f: their mean is `mean[0]` (1 − f)
/// + `mean[1]` (1 − f²) times their displacement, and likewise the skew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LateShape<const N: usize> {
    pub(super) mean: [Lane<N>; 2],
    pub(super) skew: [Lane<N>; 2],
}

impl<const N: usize> LateShape<N> {
    /// Nothing is late.
    pub(super) const NONE: Self = Self { mean: [[0.0; N]; 2], skew: [[0.0; N]; 2] };

    /// For amplifiers with this number of lags in a step.
    pub(super) fn behind(lags: &Lane<N>) -> Self {
        // With r lags in a step, the last fraction z of the voltage's change takes ln(1 + z (e^r − 1))/r of the step.
        // This is approximated by z + bend z (1 − z), exact at 0, 1/2 and 1. With very many lags the change is
        // immediate.
        let late = lags.map(|r| if r < AT_ONCE { 1.0 } else { 0.0 });
        let bend = lags.map(|r| if r < AT_ONCE { 4.0 * libm::log1p(0.5 * libm::expm1(r)) / r - 2.0 } else { 0.0 });
        Self {
            mean: [std::array::from_fn(|k| -0.5 * (late[k] + bend[k])), bend.map(|bend| bend / 3.0)],
            skew: [late.map(|late| -0.25 * late), late.map(|late| late / 6.0)],
        }
    }

    /// One leg moves linearly for this fraction of the step, and then rests.
    pub(super) fn straight(&mut self, leg: usize, part: f64) {
        let square = part * part;
        self.mean[0][leg] = -0.5 * part;
        self.mean[1][leg] = 0.0;
        self.skew[0][leg] = 0.25 * part - 0.5 * square;
        self.skew[1][leg] = square * (1.0 / 6.0);
    }
}
