//! Set-points of a platform controller.

use host_sim::platform::Six;
use host_sim::trajectory::PoseTarget;

/// The set-point of each tick: bias by a polynomial of the fifth order, then hold and stream.
pub(super) struct Generator {
    bias: Six,
    ticks: u64,
    period: f64,
    tick: u64,
    last: PoseTarget,
}

impl Generator {
    /// A generator that moves to `bias` within `time`, s, at a control period, s.
    pub(super) fn new(bias: Six, time: f64, period: f64) -> Self {
        let ticks = libm::round(time / period) as u64;
        Self { bias, ticks, period, tick: 0, last: PoseTarget::default() }
    }

    /// Resets to the state at power-up.
    pub(super) fn reset(&mut self) {
        self.tick = 0;
        self.last = PoseTarget::default();
    }

    /// The target at the end of the coming interval, with the bias, and the status bits (16 to 18).
    pub(super) fn next(&mut self, command: u64, wanted: &PoseTarget) -> (PoseTarget, u64) {
        if self.tick < self.ticks {
            self.tick += 1;
            let length = self.ticks as f64 * self.period;
            let s = self.tick as f64 / self.ticks as f64;
            let way = s * s * s * (10.0 + s * (6.0 * s - 15.0));
            let rate = 30.0 * s * s * (1.0 - s) * (1.0 - s) / length;
            let acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (length * length);
            let of = |factor: f64| self.bias.map(|b| b * factor);
            self.last = PoseTarget { pose: of(way), rate: of(rate), acceleration: of(acceleration) };
            return (self.last, 1 << 18);
        }
        let finite =
            [wanted.pose, wanted.rate, wanted.acceleration].iter().all(|six| six.iter().all(|x| x.is_finite()));
        let refused = command == 1 && !finite;
        self.last = if command == 1 && finite {
            PoseTarget { pose: std::array::from_fn(|k| self.bias[k] + wanted.pose[k]), ..*wanted }
        } else {
            PoseTarget { pose: self.last.pose, ..PoseTarget::default() }
        };
        (self.last, if refused { 1 << 16 } else { 0 })
    }
}
