//! The piezo stacks of a leg: from their voltage to the displacement of a free, massless leg.

use super::LegParameters;
use super::bouc_wen::BoucWen;
use super::creep::CreepBank;
use super::filter::Lag;
use super::play::PlayBank;

/// Plays or Bouc-Wen hysteresis, creep and asymmetry of a leg: the equations of a leg between amplifier and structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    pub(super) rate: Lag,
    pub(super) plays: PlayBank,
    /// In place of the plays.
    pub(super) bouc_wen: Option<BoucWen>,
    pub(super) creep: CreepBank,
    pub(super) asymmetry: f64,
    pub(super) drive_max: f64,
    pub(super) gain: f64,
    pub(super) step: f64,
    pub(super) widening: f64,
}

impl Stack {
    /// Stacks as built, from checked parameters.
    #[must_use]
    pub fn new(parameters: &LegParameters) -> Self {
        let p = parameters;
        Self {
            rate: Lag::new(p.tau_rate_s),
            plays: PlayBank::new(&p.play_thresholds_v, &p.play_weights, p.kappa, p.v0_v_per_s),
            bouc_wen: p.bouc_wen.map(BoucWen::new),
            creep: CreepBank::new(&p.creep_rates_per_s, &p.creep_weights, &p.creep_thresholds_v),
            asymmetry: p.s2,
            drive_max: p.u_max,
            gain: p.gain_um_per_v,
            step: 0.0,
            widening: 1.0,
        }
    }

    /// Sets the length of the following steps, s.
    pub fn set_step(&mut self, step: f64) {
        self.step = step;
        self.rate.set_step(step);
        self.creep.set_step(step);
    }

    /// Moves the voltage from `before` to `v` (V) within one step; returns the free displacement at its end, µm.
    pub fn advance(&mut self, before: f64, v: f64) -> f64 {
        let rate = self.rate.advance((v - before) / self.step);
        self.widening = self.plays.widening(rate);
        self.displacement(v)
    }

    /// As [`Stack::advance`], with the last widths of the thresholds: the rate that widens them is filtered over
    /// milliseconds, so they need not be computed at every step.
    pub fn advance_on(&mut self, before: f64, v: f64) -> f64 {
        self.rate.advance((v - before) / self.step);
        self.displacement(v)
    }

    fn displacement(&mut self, v: f64) -> f64 {
        let x = match &mut self.bouc_wen {
            Some(hysteresis) => hysteresis.advance(v),
            None => self.plays.advance(v, self.widening),
        };
        let c = self.creep.advance(v);
        let bent = x + self.asymmetry * x * (1.0 - x / self.drive_max);
        self.gain * (bent + c)
    }
}
