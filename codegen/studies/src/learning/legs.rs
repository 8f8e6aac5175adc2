//! The legs of a spec in its own leg model, driven through the amplifier's lag by the inverse that the tick uses.
//!
//! The inverse of a leg is exact for a drive that follows at once. Behind a lag, the leg turns back later and less far than the inverse
//! assumes, and its slope is not the one for which the lag is compensated.

use specgen_compiler::compile::Compilation;
use specgen_numerics::complex6::mapped;
use specgen_numerics::{Matrix6, multiply6};
use specgen_run_time::{InvalidIr, ModelLegs, dynamics};
use specgen_runtime::Motion as Place;

use super::convergence::Learnable;
use super::motion::Motion;
use crate::machine::bias;

/// Ticks in which the legs rise to the start of a motion.
const RISE: u32 = 5000;
/// Passes before the one that counts: after one the hysteresis is as in every repetition.
const BEFORE: usize = 1;

/// Legs at rest in the start pose of a motion.
pub struct HystereticLegs {
    /// As the controller believes them to be, and as they are.
    believed: ModelLegs,
    real: ModelLegs,
    /// Displacements at the start, m.
    start: [f64; 6],
    /// e^(−T_s/τ).
    kept: f64,
    to_legs: Matrix6,
    to_modal: Matrix6,
}

impl HystereticLegs {
    /// For passes of a motion; `None` for a spec of six legs.
    ///
    /// # Errors
    /// The IR is not one from the compiler.
    pub fn of(compiled: &Compilation, learnable: &Learnable, motion: &Motion) -> Result<Option<Self>, InvalidIr> {
        let Some(task) = &compiled.model.task_space else { return Ok(None) };
        let (ir, closed_loop) = (&compiled.ir, &learnable.closed_loop);
        let (bias, user) = (bias(task), motion.targets[0].pose);
        let pose = std::array::from_fn(|axis| bias[axis] + user[axis]);
        let place = dynamics(ir, &Place { pose, rate: [0.0; 6], acceleration: [0.0; 6] });
        let legs = ModelLegs::of(ir)?;
        let mut found = Self {
            believed: legs.clone(),
            real: legs,
            start: place.displacements,
            kept: if closed_loop.lag > 0.0 { libm::exp(-closed_loop.period / closed_loop.lag) } else { 0.0 },
            to_legs: multiply6(&place.jacobian, &closed_loop.basis.from_modal),
            to_modal: multiply6(&closed_loop.basis.to_modal, &ir.kinematics.inverse_jacobian),
        };
        let first = found.real.displacements();
        for tick in 1..=RISE {
            let share = f64::from(tick) / f64::from(RISE);
            found.tick(&std::array::from_fn(|leg| first[leg] + share * (place.displacements[leg] - first[leg])));
        }
        Ok(Some(found))
    }

    /// What would have to be added to the requests of a pass (modal coordinates, m) so that linear legs move as these do, tick by tick.
    pub fn excess(&self, requests: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let mut legs = Self { believed: self.believed.clone(), real: self.real.clone(), ..*self };
        let mut pass = || -> Vec<[f64; 6]> {
            requests
                .iter()
                .map(|request| {
                    let moved = mapped(&self.to_legs, request);
                    let wanted = std::array::from_fn(|leg| self.start[leg] + moved[leg]);
                    mapped(&self.to_modal, &legs.tick(&wanted))
                })
                .collect()
        };
        (0..BEFORE).for_each(|_| drop(pass()));
        pass()
    }

    /// A tick; returns what a linear leg would have to be asked for beyond `wanted`, m of each leg.
    fn tick(&mut self, wanted: &[f64; 6]) -> [f64; 6] {
        self.believed.follow(wanted);
        let (held, last, before) = (self.believed.drives(), self.real.drives(), self.real.displacements());
        self.real.apply(&std::array::from_fn(|leg| held[leg] + self.kept * (last[leg] - held[leg])));
        let after = self.real.displacements();
        std::array::from_fn(|leg| (after[leg] - self.kept * before[leg]) / (1.0 - self.kept) - wanted[leg])
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use host_sim::trajectory::Step;
    use specgen_compiler::compile::compile;

    use super::*;

    #[test]
    fn legs_with_hysteresis_move_as_requested_but_for_the_lag() {
        let compiled = compile(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../specs/reference.toml"))).unwrap();
        let step = Step { to: [10e-6, 0.0, 0.0, 0.0, 0.0, 0.0], time: 5e-3 };
        let motion = Motion::of(&step, 1e-4, &[1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2], 0.1).unwrap();
        let mut learnable = Learnable::of(&compiled).unwrap();
        let basis = learnable.closed_loop.basis.clone();
        let requests: Vec<[f64; 6]> =
            motion.targets.iter().map(|target| mapped(&basis.to_modal, &target.pose)).collect();
        // Largest in x, nm.
        let [none, usual] = [0.0, 0.35e-3].map(|lag| {
            learnable.closed_loop.lag = lag;
            let legs = HystereticLegs::of(&compiled, &learnable, &motion).unwrap().unwrap();
            let excess = legs.excess(&requests);
            excess.iter().map(|modal| 1e9 * mapped(&basis.from_modal, modal)[0].abs()).fold(0.0, f64::max)
        });
        println!("{none:.1e} nm without a lag, {usual:.1} behind 0.35 ms");
        assert!(none < 1e-3 && usual > 1.0 && usual < 1000.0, "{none} {usual}");
    }
}
