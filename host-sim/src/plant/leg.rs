//! The reference leg: a plant outside the controller's model class.
//!
//! With u the drive (V), v the stack voltage (V), x and c in V, displacement y in µm:
//!
//! ```text
//! amplifier    τ_amp v̇ = u − v
//! plays        x = Σ w_i p_i            thresholds widen with the rate of v, filtered with τ_rate
//! creep        c = Σ w_j mean_k c_jk    ċ_jk = a_j dead(v − c_jk, r_k)
//! asymmetry    s = x + s2 x (1 − x / u_max) + c
//! leg          ÿ = ωn² (gain s − y) − 2 ζ ωn ẏ
//! gauge        τ_gauge ṁ = y − m                 shows m
//! ```
//!
//! A file with `bouc_wen` gives x = v − h in place of the plays, dh = α dv − β |dv| h − γ dv |h|: another class of
//! loop.
//!
//! Creep makes the loop depend on rate and on minutes of history, and the quadratic term breaks congruency: an Everett
//! table represents neither. The feasibility study that calibrated the parameters describes the chain in words. This
//! interpretation (weights divided among the thresholds, asymmetry only on the plays, reversal curves from the leg as
//! built) reproduces its figures, see `scenario.rs`.
//!
//! Step: linear parts and creep are exact for a held input. The plays get the voltage at the end of a step, and the leg
//! holds their sum over it, so the chain leads by half a step. `step_s` belongs to the plant: half of the reference
//! leg's 50 µs changes tracking errors at 10 Hz by less than 2 %, at 1 Hz and below by less than 0.1 % (tested in
//! `scenario.rs`). In the limit of small steps the 10 Hz errors are 2 to 3 % above those of 50 µs.

use super::filter::{Lag, Resonance, SmoothLag};
use super::{LegParameters, Plant, Stack, steps_within};

/// A leg with amplifier lag, hysteresis, creep, asymmetry and one resonance. See the module for its equations.
#[derive(Debug, Clone, PartialEq)]
pub struct LegPlant {
    amplifier: Lag,
    stack: Stack,
    structure: Resonance,
    /// Lag of the gauge, µm; none: no lag.
    gauge: Option<SmoothLag>,
    longest_step: f64,
    step: f64,
}

impl LegPlant {
    /// A leg as built, from checked parameters.
    #[must_use]
    pub fn new(parameters: &LegParameters) -> Self {
        let p = parameters;
        Self {
            amplifier: Lag::new(p.tau_amp_s),
            stack: Stack::new(p),
            structure: Resonance::new(p.fn_hz, p.zeta),
            gauge: (p.gauge_lag_s > 0.0).then(|| SmoothLag::new(p.gauge_lag_s)),
            longest_step: p.step_s,
            step: 0.0,
        }
    }

    fn set_step(&mut self, step: f64) {
        if step.to_bits() != self.step.to_bits() {
            self.step = step;
            self.amplifier.set_step(step);
            self.stack.set_step(step);
            self.structure.set_step(step);
            if let Some(gauge) = &mut self.gauge {
                gauge.set_step(step);
            }
        }
    }

    fn advance(&mut self, drive: f64) {
        let before = self.amplifier.output;
        let v = self.amplifier.advance(drive);
        let free = self.stack.advance(before, v);
        let motion = |structure: &Resonance| [structure.position(), structure.velocity()];
        let before = motion(&self.structure);
        self.structure.advance(free);
        if let Some(gauge) = &mut self.gauge {
            gauge.advance(before, motion(&self.structure));
        }
    }
}

impl Plant for LegPlant {
    fn hold(&mut self, drive: f64, interval: f64) -> f64 {
        let steps = steps_within(interval, self.longest_step);
        self.set_step(interval / f64::from(steps));
        for _ in 0..steps {
            self.advance(drive);
        }
        self.displacement()
    }

    fn displacement(&self) -> f64 {
        self.structure.position() * 1e-6
    }

    fn seen(&self) -> f64 {
        self.gauge.as_ref().map_or_else(|| self.displacement(), |gauge| gauge.output() * 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> LegPlant {
        LegPlant::new(&LegParameters::reference())
    }

    #[test]
    fn the_loop_has_the_width_of_a_piezo_stack() {
        // The study gives 13.1 % at 0.1 Hz.
        let mut leg = reference();
        leg.ramp(0.0, 100.0, 5.0, 1e-3);
        leg.ramp(100.0, 0.0, 5.0, 1e-3);
        let bottom = leg.displacement();
        let up = leg.ramp(0.0, 50.0, 2.5, 1e-3) - bottom;
        let top = leg.ramp(50.0, 100.0, 2.5, 1e-3) - bottom;
        let down = leg.ramp(100.0, 50.0, 2.5, 1e-3) - bottom;
        let width = (down - up) / top;
        assert!((0.125..0.140).contains(&width), "{width}");
        assert!((55e-6..70e-6).contains(&top), "{top}");
    }

    #[test]
    fn minor_loops_between_the_same_voltages_are_not_congruent() {
        // What an Everett table would force: equal strokes of 40 → 60 V whatever came before.
        let stroke = |history: f64| {
            let mut leg = reference();
            leg.ramp(0.0, history, 0.1, 1e-4);
            leg.ramp(history, 40.0, 0.1, 1e-4);
            let low = leg.displacement();
            leg.ramp(40.0, 60.0, 0.1, 1e-4) - low
        };
        assert!((stroke(0.0) - stroke(100.0)).abs() > 50e-9);
    }

    #[test]
    fn a_held_voltage_creeps_on() {
        let mut leg = reference();
        let first = leg.hold(70.0, 0.05);
        let later = leg.hold(70.0, 2.0);
        assert!(later - first > 0.3e-6, "{first} {later}");
    }
}
