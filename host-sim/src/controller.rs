//! Runs a controller: the shared library of an emitted one ([`Controller::load`]), or any other engine
//! ([`Controller::of`]). Callers see no difference.

mod engine;
mod library;
mod supervised;

use std::alloc::Layout;
use std::path::{Path, PathBuf};

use crate::description::{Description, DescriptionError};

pub use engine::Engine;
pub use library::ABI_VERSION;
pub use supervised::{MachineWord, RestingReadings, SnapshotError, Supervised};

/// A controller that runs one tick at a time: the emitted one, or a stand-in in a test.
pub trait TickController {
    /// Names and arithmetic.
    fn description(&self) -> &Description;

    /// Configuration words of the spec.
    fn default_config(&self) -> Vec<u64>;

    /// Takes a configuration; state is kept.
    ///
    /// # Errors
    /// If the number of words is wrong or a word is refused; the present configuration is then kept.
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError>;

    /// State as at power-up.
    fn reset(&mut self);

    /// One tick.
    ///
    /// # Panics
    /// If `input` or `output` does not have the number of words in the description.
    fn step(&mut self, input: &[u64], output: &mut [u64]);

    /// Digest of the state.
    fn state_digest(&self) -> u64;
}

/// A small controller for tests: a function of its state, input and output is its tick. It accepts any settings and has
/// none. Its digest is its state, which a reset sets to 0.
pub struct StandIn<F> {
    /// Names and arithmetic.
    pub description: Description,
    /// What it remembers.
    pub state: u64,
    /// One tick.
    pub tick: F,
}

impl<F: FnMut(&mut u64, &[u64], &mut [u64])> TickController for StandIn<F> {
    fn description(&self) -> &Description {
        &self.description
    }
    fn default_config(&self) -> Vec<u64> {
        vec![0; self.description.config_names.len()]
    }
    fn configure(&mut self, _words: &[u64]) -> Result<(), ControllerError> {
        Ok(())
    }
    fn reset(&mut self) {
        self.state = 0;
    }
    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        (self.tick)(&mut self.state, input, output);
    }
    fn state_digest(&self) -> u64 {
        self.state
    }
}

/// Reason why a controller cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// The library cannot be opened, or lacks a function.
    #[error(
        "{}: not a controller library: {}; build the host library of the emitted workspace and name its file",
        path.display(),
        reasons(cause)
    )]
    Load {
        /// The library file.
        path: PathBuf,
        /// What the loader says.
        #[source]
        cause: libloading::Error,
    },
    /// It has another version of the interface.
    #[error("{}: interface version {found}, expected {ABI_VERSION}; build it with this specgen", path.display())]
    Abi {
        /// The library file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// Its self-description is unusable.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// A configuration of the wrong length.
    #[error("{given} configuration words; this controller has {expected}")]
    ConfigLength {
        /// Number of words given.
        given: usize,
        /// Number of words of the controller.
        expected: usize,
    },
    /// A configuration word is refused.
    #[error(
        "the controller refuses configuration word `{name}` = {word:016x}; docs/settings.md has its range, which the spec limits"
    )]
    Config {
        /// Name of the word.
        name: String,
        /// Its bits.
        word: u64,
    },
}

/// An error with its chain of causes, which the loader keeps separate.
fn reasons(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(error) = next {
        text.push_str(": ");
        text.push_str(&error.to_string());
        next = error.source();
    }
    text
}

/// A controller with one configuration and one state.
pub struct Controller {
    /// Its self-description, as text and parsed.
    text: String,
    description: Description,
    engine: Box<dyn Engine>,
}

impl Controller {
    /// Sizes and alignments of its state, its configuration, and its machine.
    pub fn layouts(&self) -> [Layout; 3] {
        self.engine.layouts()
    }

    /// Loads the host library of an emitted controller, with the spec's configuration and the power-up state.
    ///
    /// # Errors
    /// If the file is not such a library, has another version, or an invalid description.
    pub fn load(path: &Path) -> Result<Self, ControllerError> {
        Self::of(Box::new(library::Emitted::load(path)?))
    }

    /// Runs `engine`, with the spec's configuration and the power-up state.
    ///
    /// # Errors
    /// If its description is invalid or it refuses its own configuration.
    pub fn of(engine: Box<dyn Engine>) -> Result<Self, ControllerError> {
        let text = engine.text();
        let description = Description::parse(&text)?;
        let mut controller = Self { text, description, engine };
        let words = controller.default_config();
        controller.configure(&words)?;
        controller.reset();
        Ok(controller)
    }

    /// The controller's self-description: `key=value` lines, as at the start of its record files.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Another controller with the same constants, configuration and state: for several continuations from here, also
    /// in other threads.
    pub fn fork(&self) -> Self {
        Self { text: self.text.clone(), description: self.description.clone(), engine: self.engine.fork() }
    }

    /// Takes the configuration and the state of another controller with the same constants.
    ///
    /// # Panics
    /// If `other` has others.
    pub fn take_over(&mut self, other: &Self) {
        self.engine.take_over(&*other.engine);
    }
}

impl TickController for Controller {
    fn description(&self) -> &Description {
        &self.description
    }

    fn default_config(&self) -> Vec<u64> {
        let mut words = vec![0; self.description.config_names.len()];
        self.engine.default_config(&mut words);
        words
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        let expected = self.description.config_names.len();
        if words.len() != expected {
            return Err(ControllerError::ConfigLength { given: words.len(), expected });
        }
        self.engine.configure(words).map_err(|index| ControllerError::Config {
            name: self.description.config_names.get(index).cloned().unwrap_or_else(|| format!("number {}", index + 1)),
            word: words.get(index).copied().unwrap_or_default(),
        })
    }

    fn reset(&mut self) {
        self.engine.reset();
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        assert_eq!(input.len(), self.description.input_names.len(), "input words");
        assert_eq!(output.len(), self.description.output_names.len(), "output words");
        self.engine.step(input, output);
    }

    fn state_digest(&self) -> u64 {
        self.engine.digest()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_library_is_refused_with_its_name() {
        let Err(error) = Controller::load(Path::new("no/such/library.so")) else { panic!("loaded") };
        let text = error.to_string();
        assert!(text.starts_with("no/such/library.so: not a controller library"), "{text}");
    }
}
