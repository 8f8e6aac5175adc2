//! A law with its constants, as a [`host_sim::controller::Engine`].

use std::alloc::Layout;
use std::any::Any;

use host_sim::controller::{ControllerError, Engine};
use specgen_law::supervise::{step, supervise};
use specgen_law::{
    Config, ControlLaw as _, Input as _, InputOf, Machine, MachineInput, SettingsOf, Spec as _, StateOf,
    write_machine_output,
};
use specgen_runtime::snapshot::{Reader, Snapshot as _, WordSink as _, Writer};
use specgen_runtime::{Digest, Real as _};

use crate::common::{AtRunTime, Constants};

/// A controller at run time.
struct RunTime<C: Constants> {
    constants: AtRunTime<C>,
    config: Config<AtRunTime<C>>,
    state: Box<StateOf<AtRunTime<C>>>,
    machine: Box<Machine<AtRunTime<C>>>,
}

/// The controller with these constants, which stay in memory, in the spec's configuration.
pub fn boxed<C: Constants>(constants: C) -> Result<Box<dyn Engine>, ControllerError>
where
    SettingsOf<AtRunTime<C>>: Send + Sync,
    StateOf<AtRunTime<C>>: Send + Sync,
{
    let constants = AtRunTime(Box::leak(Box::new(constants)));
    let settings = &constants.0.common().settings;
    let config = Config::read(constants, settings).map_err(|error| ControllerError::Config {
        name: format!("number {}", error.word + 1),
        word: settings.get(error.word).copied().unwrap_or_default(),
    })?;
    let state = Box::new(state_at_reset(constants));
    Ok(Box::new(RunTime { constants, config, machine: Box::new(Machine::new(*state)), state }))
}

fn state_at_reset<C: Constants>(constants: AtRunTime<C>) -> StateOf<AtRunTime<C>> {
    let mut state = C::Law::at_reset(&constants.reset());
    constants.0.complete(&mut state);
    state
}

impl<C: Constants> RunTime<C> {
    fn machine_at_reset(&self) -> Machine<AtRunTime<C>> {
        Machine::new(state_at_reset(self.constants))
    }
}

impl<C: Constants> Engine for RunTime<C>
where
    SettingsOf<AtRunTime<C>>: Send + Sync,
    StateOf<AtRunTime<C>>: Send + Sync,
{
    fn text(&self) -> String {
        format!("{}machine_words={:08}\n", self.constants.0.common().text, self.machine_words())
    }

    fn layouts(&self) -> [Layout; 3] {
        [
            Layout::new::<StateOf<AtRunTime<C>>>(),
            Layout::new::<Config<AtRunTime<C>>>(),
            Layout::new::<Machine<AtRunTime<C>>>(),
        ]
    }

    fn fork(&self) -> Box<dyn Engine> {
        Box::new(Self {
            constants: self.constants,
            config: self.config,
            state: self.state.clone(),
            machine: self.machine.clone(),
        })
    }

    fn take_over(&mut self, other: &dyn Engine) {
        match other.as_any().downcast_ref::<Self>() {
            Some(other) if self.constants == other.constants => {
                self.config = other.config;
                self.state.clone_from(&other.state);
            }
            _ => unreachable!("controllers of the same constants"),
        }
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn default_config(&self, words: &mut [u64]) {
        words.copy_from_slice(&self.constants.0.common().settings);
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), usize> {
        self.config = Config::read(self.constants, words).map_err(|error| error.word)?;
        Ok(())
    }

    fn reset(&mut self) {
        *self.state = state_at_reset(self.constants);
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let input = InputOf::<AtRunTime<C>>::read(self.constants, input);
        let result = step(self.constants, &self.config, &mut self.state, &input);
        C::Law::write_output(self.constants, &result, &self.state, output);
    }

    fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        self.state.digest(&mut digest);
        digest.finish()
    }

    fn reset_machine(&mut self) {
        *self.machine = self.machine_at_reset();
    }

    fn step_machine(&mut self, input: &[u64], output: &mut [u64]) {
        let input = MachineInput::read(self.constants, input);
        let result = supervise(self.constants, &self.config, &mut self.machine, &input);
        write_machine_output(self.constants, &result, &self.machine, output);
    }

    fn machine_digest(&self) -> u64 {
        self.machine.digest()
    }

    fn machine_words(&self) -> usize {
        self.machine.word_count(self.constants.sizes())
    }

    fn save_machine(&self, words: &mut [u64]) {
        let Ok(()) = self.machine.show(&mut Writer::new(words).within(self.constants.sizes()));
    }

    fn load_machine(&mut self, words: &[u64]) -> Result<(), usize> {
        // Into a new machine, which is discarded if a word is refused.
        let mut machine = self.machine_at_reset();
        let restored = machine.restore(&mut Reader::new(words).within(self.constants.sizes()));
        restored.map_err(|invalid| invalid.word)?;
        *self.machine = machine;
        Ok(())
    }

    fn words_per_leg(&self, gauges: &[u64; 6]) -> [[u64; 6]; 6] {
        let rows = C::Law::words_per_leg(self.constants, &gauges.map(C::Real::from_word));
        rows.map(|row| row.map(|number| number.to_word()))
    }
}
