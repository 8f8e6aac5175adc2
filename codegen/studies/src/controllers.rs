//! The controller that a study runs.

use host_sim::controller::{Controller, ControllerError, TickController};
use host_sim::description::Description;

use specgen_compiler::compile::Compilation;
use specgen_compiler::workspace;
use specgen_language::interrupt::{self, Scratch};
use specgen_language::outcome::{Failure, environment};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_toolchain::host::build_loadable;

/// A controller that stops when the command is interrupted.
pub struct Interruptible(pub Controller);

impl TickController for Interruptible {
    fn description(&self) -> &Description {
        self.0.description()
    }
    fn default_config(&self) -> Vec<u64> {
        self.0.default_config()
    }
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.0.configure(words)
    }
    fn reset(&mut self) {
        self.0.reset();
    }
    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        interrupt::point();
        self.0.step(input, output);
    }
    fn state_digest(&self) -> u64 {
        self.0.state_digest()
    }
}

/// The emitted controller if requested, else [`at_run_time`].
///
/// # Errors
/// It cannot be built or loaded.
pub fn chosen(compiled: &Compilation, is_emitted: bool, ui: &Ui) -> Result<Controller, Failure> {
    if is_emitted { emitted(compiled, ui) } else { at_run_time(compiled, ui) }
}

/// The law with the constants of a compiled spec: bit-identical to the emitted controller, without a build.
///
/// # Errors
/// The constants are inconsistent.
pub fn at_run_time(compiled: &Compilation, ui: &Ui) -> Result<Controller, Failure> {
    ui.runs(ControllerForm::RunTime);
    ui.progress("controller: run-time law on the compiled spec");
    specgen_run_time::controller(&compiled.ir).map_err(environment)
}

/// The emitted controller, built for this host from the files that the main command writes. The build folder is removed
/// on return; the library stays loaded.
fn emitted(compiled: &Compilation, ui: &Ui) -> Result<Controller, Failure> {
    let scratch = Scratch::new().map_err(environment)?;
    let workspace = scratch.path().join("controller");
    workspace::write_scratch(&workspace, &compiled.files())?;
    ui.runs(ControllerForm::Emitted);
    ui.progress("controller: emitted code, built for this host");
    let library = build_loadable(&workspace, &scratch.path().join("target"))?;
    Controller::load(&library).map_err(environment)
}

/// Number of worker threads: as requested, else as the computer has.
pub fn threads(asked: Option<u32>) -> usize {
    asked.map_or_else(
        || std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        |threads| threads as usize,
    )
}
