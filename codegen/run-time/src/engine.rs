//! A law over its constants, as [`host_sim::controller::Engine`].

use std::alloc::Layout;
use std::any::Any;
use std::fmt::Debug;

use host_sim::controller::{ANALYSIS_WORDS, ControllerError, Engine};
use specgen_law::supervise::supervise;
use specgen_law::{ConfigError, ConfigOf, ControlLaw as _, InputOf, Machine, MachineInput, OutputOf, Spec, StateOf};
use specgen_runtime::snapshot::{Reader, Snapshot as _, Words as _, Writer};
use specgen_runtime::supervisor::Request;
use specgen_runtime::{Digest, Motion, Real};

use crate::common::Common;

/// A scalar that a controller can be run in.
pub trait Number: Real + Debug + Send + Sync {}
impl<T: Real + Debug + Send + Sync> Number for T {}

/// Constants, and what the two laws do each in its own way.
pub trait Constants: Spec<Real: Number> + Send + Sync + 'static {
    fn common(&self) -> &'static Common<Self::Real>;
    /// Settings from their words.
    fn read_config(self, words: &[u64]) -> Result<ConfigOf<Self>, ConfigError>;
    fn state_at_reset(self) -> StateOf<Self>;
    /// A tick of the law alone.
    fn step(self, config: &ConfigOf<Self>, state: &mut StateOf<Self>, input: &InputOf<Self>) -> OutputOf<Self>;
    /// Word of each gauge per displacement of each leg.
    fn words_per_leg(self, gauges: &[Self::Real; 6]) -> [[Self::Real; 6]; 6];
}

/// A controller at run time.
struct RunTime<P: Constants> {
    constants: P,
    config: ConfigOf<P>,
    state: Box<StateOf<P>>,
    machine: Option<Box<Machine<P>>>,
}

/// The controller of these constants, in the spec's configuration.
pub fn boxed<P>(constants: P) -> Result<Box<dyn Engine>, ControllerError>
where
    P: Constants,
    ConfigOf<P>: Send + Sync,
    StateOf<P>: Send + Sync,
{
    let settings = &constants.common().settings;
    let config = constants.read_config(settings).map_err(|error| ControllerError::Config {
        name: format!("number {}", error.word + 1),
        word: settings.get(error.word).copied().unwrap_or_default(),
    })?;
    Ok(Box::new(RunTime { constants, config, state: Box::new(constants.state_at_reset()), machine: None }))
}

impl<P: Constants> RunTime<P> {
    fn machine_at_reset(&self) -> Machine<P> {
        Machine::new(self.constants.state_at_reset())
    }

    fn machine(&self) -> &Machine<P> {
        match &self.machine {
            Some(machine) => machine,
            None => unreachable!("`add_machine` comes before the use of a machine"),
        }
    }
}

impl<P> Engine for RunTime<P>
where
    P: Constants,
    ConfigOf<P>: Send + Sync,
    StateOf<P>: Send + Sync,
{
    fn text(&self) -> String {
        format!("{}machine_words={:08}\n", self.constants.common().text, self.machine_words())
    }

    fn layouts(&self) -> [Layout; 3] {
        [Layout::new::<StateOf<P>>(), Layout::new::<ConfigOf<P>>(), Layout::new::<Machine<P>>()]
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
        words.copy_from_slice(&self.constants.common().settings);
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), usize> {
        self.config = self.constants.read_config(words).map_err(|error| error.word)?;
        Ok(())
    }

    fn reset(&mut self) {
        *self.state = self.constants.state_at_reset();
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        let input = P::Law::read_input(self.constants, input);
        let result = self.constants.step(&self.config, &mut self.state, &input);
        P::Law::write_output(self.constants, &result, &self.state, output);
    }

    fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        self.state.digest(&mut digest);
        digest.finish()
    }

    fn add_machine(&mut self) -> Result<(), ControllerError> {
        self.machine = Some(Box::new(self.machine_at_reset()));
        Ok(())
    }

    fn reset_machine(&mut self) {
        self.machine = Some(Box::new(self.machine_at_reset()));
    }

    fn step_machine(&mut self, input: &[u64], output: &mut [u64]) {
        let Some(machine) = &mut self.machine else { unreachable!("`add_machine` comes before the use of a machine") };
        let (Some((law, [request, events])), Some((law_output, last))) =
            (input.split_last_chunk(), output.split_last_chunk_mut())
        else {
            unreachable!("as many words as the description names")
        };
        let input = MachineInput {
            tick: P::Law::read_input(self.constants, law),
            request: Request::from_word(*request),
            events: *events as u32,
        };
        let result = supervise(self.constants, &self.config, machine, &input);
        P::Law::write_output(self.constants, &result.tick, &machine.state, law_output);
        *last = [u64::from(result.supervisor_word()), u64::from(machine.supervisor.conditions)];
    }

    fn machine_digest(&self) -> u64 {
        self.machine().digest()
    }

    fn machine_words(&self) -> usize {
        let sizes = self.constants.sizes();
        match &self.machine {
            Some(machine) => machine.word_count(sizes),
            None => self.machine_at_reset().word_count(sizes),
        }
    }

    fn save_machine(&self, words: &mut [u64]) -> Result<(), ControllerError> {
        let Ok(()) = self.machine().show(&mut Writer::new(words).within(self.constants.sizes()));
        Ok(())
    }

    fn load_machine(&mut self, words: &[u64]) -> Result<Option<usize>, ControllerError> {
        // Into a machine at reset, which is given up where a word is refused.
        let mut machine = self.machine_at_reset();
        match machine.restore(&mut Reader::new(words).within(self.constants.sizes())) {
            Ok(()) => {
                self.machine = Some(Box::new(machine));
                Ok(None)
            }
            Err(invalid) => Ok(Some(invalid.word)),
        }
    }

    fn dynamics(&self, motion: &[[u64; 6]; 3]) -> Result<[u64; ANALYSIS_WORDS], ControllerError> {
        let body = &self.constants.common().body;
        let [pose, rate, acceleration] = motion.map(|six| six.map(P::Real::from_word));
        let motion = Motion { pose, rate, acceleration };
        let vectors = [
            body.coriolis(&pose, &rate),
            body.gravity(&pose),
            body.leg_forces(&motion),
            body.load(&motion, None).displacement,
        ];
        let numbers = body.jacobian(&pose).into_iter().chain(body.mass_matrix(&pose)).chain(vectors).flatten();
        let mut analysis = [0; ANALYSIS_WORDS];
        for (word, number) in analysis.iter_mut().zip(numbers) {
            *word = number.to_word();
        }
        Ok(analysis)
    }

    fn words_per_leg(&self, gauges: &[u64; 6]) -> Result<[[u64; 6]; 6], ControllerError> {
        let rows = self.constants.words_per_leg(&gauges.map(P::Real::from_word));
        Ok(rows.map(|row| row.map(|number| number.to_word())))
    }
}
