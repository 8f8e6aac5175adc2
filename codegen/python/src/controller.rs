//! A controller, emitted or from a compiled spec, on rows of words in Python's memory.
#![allow(unsafe_code)]

use std::path::PathBuf;

use host_sim::controller::{Controller, Supervised, TickController};
use host_sim::word::{Scalar, WordKind};
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, PyResult, Python, pyclass, pymethods};
use specgen::{compile, files, run_time};

use crate::Error;

/// Ticks between checks for signals.
const BLOCK: usize = 1 << 16;

/// The law alone, or with its supervisor.
enum Tick {
    Law(Box<Controller>),
    Supervised(Box<Supervised>),
}

impl Tick {
    fn controller(&self) -> &Controller {
        match self {
            Self::Law(law) => law,
            Self::Supervised(supervised) => supervised.controller(),
        }
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        match self {
            Self::Law(law) => law.step(input, output),
            Self::Supervised(supervised) => {
                supervised.step(input, output);
            }
        }
    }
}

/// Indices of reals, and buffers for rows, if the controller's scalar is not that of Python.
struct Conversion {
    reals: [Vec<usize>; 2],
    rows: [Vec<u64>; 2],
}

/// A controller with one configuration and one state: a host library, or the law with the constants of a compiled spec. A row has a
/// 64-bit word for each name: integers, and reals as f64, which are rounded to the controller's scalar.
#[pyclass(module = "specgen._native")]
pub struct Library {
    tick: Tick,
    rounded: Option<Conversion>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    /// Rows of [`Library::step`].
    bound: Option<[PyBuffer<u64>; 2]>,
}

fn refused(error: impl std::fmt::Display) -> PyErr {
    Error::new_err(error.to_string())
}

fn reals(names: &[String]) -> Vec<usize> {
    (0..names.len()).filter(|place| WordKind::of(&names[*place]) == WordKind::Real).collect()
}

fn kinds(names: &[String]) -> Vec<(String, bool)> {
    names.iter().map(|name| (name.clone(), WordKind::of(name) == WordKind::Real)).collect()
}

#[pymethods]
impl Library {
    /// Loads a host library; with its supervisor if `supervised`.
    #[new]
    fn new(path: PathBuf, supervised: bool) -> PyResult<Self> {
        // Refuses a pipe, on which loading would block.
        drop(files::open_file(&path).map_err(|unread| refused(format!("{}: {unread}", path.display())))?);
        Self::of(Controller::load(&path).map_err(refused)?, supervised)
    }

    /// Compiles a spec, and runs the law with its constants, without a build. With its supervisor if `supervised`.
    #[staticmethod]
    fn of_spec(py: Python<'_>, spec: PathBuf, supervised: bool) -> PyResult<Self> {
        let controller = py.detach(|| {
            let compiled = compile::compile(&spec).map_err(|_| format!("{} is refused", spec.display()))?;
            run_time::controller(&compiled.ir).map_err(|error| error.to_string())
        });
        Self::of(controller.map_err(refused)?, supervised)
    }

    /// Name of the spec, its digest, version of specgen, bits of the scalar.
    fn about(&self) -> (String, String, String, u32) {
        let about = self.tick.controller().description();
        (about.name.clone(), about.digest.clone(), about.version.clone(), about.scalar.bits())
    }

    /// Names of the input words, and which are reals.
    fn inputs(&self) -> Vec<(String, bool)> {
        kinds(&self.inputs)
    }

    /// Names of the output words, and which are reals.
    fn outputs(&self) -> Vec<(String, bool)> {
        kinds(&self.outputs)
    }

    /// Names and values of the settings of the spec.
    fn settings(&self) -> Vec<(String, f64)> {
        let controller = self.tick.controller();
        let about = controller.description();
        let value = |(name, word): (&String, u64)| match WordKind::of(name) {
            WordKind::Real => (name.clone(), about.scalar.decode(word)),
            WordKind::Integer => (name.clone(), word as f64),
        };
        about.config_names.iter().zip(controller.default_config()).map(value).collect()
    }

    /// Sets settings; others get the values of the spec. The state is kept.
    fn configure(&mut self, settings: Vec<(String, f64)>) -> PyResult<()> {
        let controller = self.tick.controller();
        let mut words = controller.default_config();
        for (name, value) in settings {
            controller.description().set_config(&mut words, &name, value).map_err(refused)?;
        }
        match &mut self.tick {
            Tick::Law(law) => law.configure(&words),
            Tick::Supervised(supervised) => supervised.configure(&words),
        }
        .map_err(refused)
    }

    /// Resets the state to power-up.
    fn reset(&mut self) {
        match &mut self.tick {
            Tick::Law(law) => law.reset(),
            Tick::Supervised(supervised) => supervised.reset(),
        }
    }

    /// Digest of the state.
    fn state_digest(&self) -> u64 {
        match &self.tick {
            Tick::Law(law) => law.state_digest(),
            Tick::Supervised(supervised) => supervised.digest(),
        }
    }

    /// Sets the rows that [`Library::step`] reads and writes.
    fn bind(&mut self, input: PyBuffer<u64>, output: PyBuffer<u64>) -> PyResult<()> {
        rows(&input, self.inputs.len(), false)?;
        rows(&output, self.outputs.len(), true)?;
        self.bound = Some([input, output]);
        Ok(())
    }

    /// One tick on the bound rows.
    fn step(&mut self) -> PyResult<()> {
        let Some([input, output]) = &self.bound else { return Err(PyValueError::new_err("no rows are bound")) };
        let (input, output) = (input.buf_ptr().cast::<u64>(), output.buf_ptr().cast::<u64>());
        // SAFETY: `bind` checked length, alignment and that the second is writable. We hold the buffers, and the interpreter, without
        // which nobody else writes to them.
        unsafe { self.tick(input, output) };
        Ok(())
    }

    /// One tick per row, from `inputs` to `outputs`, which must not overlap. The interpreter is released; nobody may write to either
    /// meanwhile. After Ctrl-C the rows so far are written.
    fn run(&mut self, py: Python<'_>, inputs: PyBuffer<u64>, outputs: PyBuffer<u64>) -> PyResult<()> {
        let count = rows(&inputs, self.inputs.len(), false)?;
        if rows(&outputs, self.outputs.len(), true)? != count {
            return Err(PyValueError::new_err("expected as many rows of outputs as of inputs"));
        }
        let (from, to) = (inputs.buf_ptr() as usize, outputs.buf_ptr() as usize);
        if from < to + outputs.len_bytes() && to < from + inputs.len_bytes() {
            return Err(PyValueError::new_err("inputs and outputs overlap"));
        }
        for block in (0..count).step_by(BLOCK) {
            let end = count.min(block + BLOCK);
            py.detach(|| {
                for row in block..end {
                    // SAFETY: `rows` checked that there are `count` aligned rows, and that the outputs are writable; we hold both
                    // buffers until the end. The caller must ensure that nobody writes to them meanwhile, as for every function of
                    // numpy that releases the interpreter.
                    unsafe {
                        let input = (from as *const u64).add(row * self.inputs.len());
                        self.tick(input, (to as *mut u64).add(row * self.outputs.len()));
                    }
                }
            });
            py.check_signals()?;
        }
        Ok(())
    }
}

impl Library {
    fn of(controller: Controller, supervised: bool) -> PyResult<Self> {
        let tick = if supervised {
            Tick::Supervised(Box::new(Supervised::new(controller)))
        } else {
            Tick::Law(Box::new(controller))
        };
        let (inputs, outputs) = match &tick {
            Tick::Law(law) => (law.description().input_names.clone(), law.description().output_names.clone()),
            Tick::Supervised(supervised) => (supervised.input_names(), supervised.output_names()),
        };
        let rounded = (tick.controller().description().scalar != Scalar::F64).then(|| Conversion {
            reals: [reals(&inputs), reals(&outputs)],
            rows: [vec![0; inputs.len()], vec![0; outputs.len()]],
        });
        Ok(Self { tick, rounded, inputs, outputs, bound: None })
    }

    /// # Safety
    /// The pointers must be to a row of inputs and a row of outputs, which do not overlap.
    unsafe fn tick(&mut self, input: *const u64, output: *mut u64) {
        // SAFETY: guaranteed by the caller.
        let (input, output) = unsafe {
            (
                std::slice::from_raw_parts(input, self.inputs.len()),
                std::slice::from_raw_parts_mut(output, self.outputs.len()),
            )
        };
        let Some(Conversion { reals, rows: [row_in, row_out] }) = &mut self.rounded else {
            return self.tick.step(input, output);
        };
        row_in.copy_from_slice(input);
        for place in &reals[0] {
            row_in[*place] = Scalar::F32.encode(f64::from_bits(input[*place]));
        }
        self.tick.step(row_in, row_out);
        output.copy_from_slice(row_out);
        for place in &reals[1] {
            output[*place] = Scalar::F32.decode(row_out[*place]).to_bits();
        }
    }
}

/// Number of rows of `words` in a buffer.
fn rows(buffer: &PyBuffer<u64>, words: usize, written: bool) -> PyResult<usize> {
    let fits = buffer.item_count().is_multiple_of(words) && buffer.is_c_contiguous();
    let aligned = (buffer.buf_ptr() as usize).is_multiple_of(align_of::<u64>());
    if !fits || !aligned || (written && buffer.readonly()) {
        return Err(PyValueError::new_err(format!(
            "expected contiguous and aligned rows of {words} words, and writable outputs"
        )));
    }
    Ok(buffer.item_count() / words)
}
