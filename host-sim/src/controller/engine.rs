//! The engine that computes the ticks of a controller.

use std::alloc::Layout;
use std::any::Any;

/// One configuration, one state of the control law, and one machine (the law under its supervisor). All numbers are
/// words, as in the C interface of emitted libraries.
///
/// Callers pass slices of the lengths in the description.
pub trait Engine: Send + Sync {
    /// The controller's self-description, `key=value` lines.
    fn text(&self) -> String;
    /// Sizes and alignments of a state, a configuration, and a machine.
    fn layouts(&self) -> [Layout; 3];
    /// The same constants and configuration in the same state, law and machine.
    fn fork(&self) -> Box<dyn Engine>;
    /// Takes configuration and state of the law.
    ///
    /// # Panics
    /// If `other` has other constants.
    fn take_over(&mut self, other: &dyn Engine);
    /// For distinguishing engines.
    fn as_any(&self) -> &dyn Any;

    /// Configuration of the spec.
    fn default_config(&self, words: &mut [u64]);
    /// Takes a configuration.
    ///
    /// # Errors
    /// Index of the first refused word; the present configuration is then kept.
    fn configure(&mut self, words: &[u64]) -> Result<(), usize>;
    /// The law as at power-up.
    fn reset(&mut self);
    /// One tick of the law.
    fn step(&mut self, input: &[u64], output: &mut [u64]);
    /// Digest of the law's state.
    fn digest(&self) -> u64;

    /// Resets the machine to power-up: disarmed. Required before any other use of the machine.
    fn reset_machine(&mut self);
    /// One supervised tick.
    fn step_machine(&mut self, input: &[u64], output: &mut [u64]);
    /// Digest of the machine.
    fn machine_digest(&self) -> u64;
    /// Words of a snapshot of the machine.
    fn machine_words(&self) -> usize;
    /// Snapshot of the machine.
    fn save_machine(&self, words: &mut [u64]);
    /// Takes a snapshot.
    ///
    /// # Errors
    /// Index of the first invalid word; the machine is then unchanged.
    fn load_machine(&mut self, words: &[u64]) -> Result<(), usize>;

    /// Word of each gauge (rows) per displacement of each leg (columns) near these words.
    fn words_per_leg(&self, gauges: &[u64; 6]) -> [[u64; 6]; 6];
}
