//! Gauges of a machine without a plant: their readings while it is armed, when each leg in turn makes a small pulse.

use super::Supervised;
use crate::controller::{ControllerError, TickController};

/// Constant readings, plus the motion of the legs by the controller's own model.
#[derive(Debug, Clone)]
pub struct RestingReadings {
    /// Indices of the gauges' words in an input, and of the legs' displacements in an output.
    gauges: usize,
    requested: usize,
    words: [f64; 6],
    per_leg: [[f64; 6]; 6],
    /// Displacements at rest; none before the first tick.
    rest: Option<[f64; 6]>,
}

impl Supervised {
    /// For a machine at rest, with the readings of this input.
    ///
    /// # Errors
    /// A word is missing.
    pub fn standing(&self, input: &[u64]) -> Result<RestingReadings, ControllerError> {
        let description = self.controller.description();
        let gauges = description.input("gauge[0]").or_else(|_| description.input("displacement[0]"))?;
        let [requested, ..] = description.outputs("requested")?;
        let mut bits = [0; 6];
        for (bits, word) in bits.iter_mut().zip(input.iter().skip(gauges)) {
            *bits = *word;
        }
        let rows = self.controller.engine.words_per_leg(&bits);
        let scalar = description.scalar;
        let per_leg = rows.map(|row| row.map(|word| scalar.decode(word)));
        Ok(RestingReadings { gauges, requested, words: bits.map(|word| scalar.decode(word)), per_leg, rest: None })
    }
}

impl RestingReadings {
    /// Writes the readings after a tick with this output into an input.
    pub fn show(&mut self, machine: &Supervised, output: &[u64], input: &mut [u64]) {
        let scalar = machine.controller.description().scalar;
        let moved =
            std::array::from_fn(|leg| scalar.decode(output.get(self.requested + leg).copied().unwrap_or_default()));
        let rest = *self.rest.get_or_insert(moved);
        for ((slot, word), row) in input.iter_mut().skip(self.gauges).zip(self.words).zip(self.per_leg) {
            let way: f64 = (0..6).map(|leg| row[leg] * (moved[leg] - rest[leg])).sum();
            *slot = scalar.encode(word + way);
        }
    }
}
