//! Runs an emitted controller's host shared library; the only module with unsafe code but for one that picks instructions.
//!
//! The library's C interface, version 2: `specgen_abi_version`, `_describe`, `_config_default`, `_config_check`,
//! `_config_load`, `_state_reset`, `_step`, `_state_digest`, for analysis `_dynamics`, and under the supervisor `_machine_reset`,
//! `_machine_step`, `_machine_digest` ([`Supervised`]).
#![allow(unsafe_code)]

use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::fmt;
use std::path::{Path, PathBuf};
use std::ptr::NonNull;
use std::sync::Arc;

use libloading::Library;

use crate::description::{Description, DescriptionError, fields};

/// Version of the C interface that this module speaks.
pub const ABI_VERSION: u32 = 2;

/// Something that runs one control tick: the emitted controller, or a stand-in in a test.
pub trait TickController {
    /// Names and arithmetic.
    fn description(&self) -> &Description;

    /// Configuration words of the spec.
    fn default_config(&self) -> Vec<u64>;

    /// Takes a configuration; state is kept.
    ///
    /// # Errors
    /// If the number of words is wrong or a word is refused; the configuration in force then stays.
    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError>;

    /// State as at power-up.
    fn reset(&mut self);

    /// One tick.
    ///
    /// # Panics
    /// If `input` or `output` has not as many words as the description names.
    fn step(&mut self, input: &[u64], output: &mut [u64]);

    /// Digest of the state.
    fn state_digest(&self) -> u64;
}

/// A controller of a few lines, for tests: a function of its state, input and output is its tick. It takes any settings and
/// has none; its digest is its state, which a reset makes 0.
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

/// Why a controller cannot be run.
#[derive(Debug)]
pub enum ControllerError {
    /// The library cannot be opened, or lacks a function.
    Load {
        /// The library file.
        path: PathBuf,
        /// What the loader says.
        cause: libloading::Error,
    },
    /// It speaks another version of the interface.
    Abi {
        /// The library file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// Its self-description is unusable.
    Description(DescriptionError),
    /// A configuration of the wrong length.
    ConfigLength {
        /// Number of words given.
        given: usize,
        /// Number of words of the controller.
        expected: usize,
    },
    /// A configuration word is refused.
    Config {
        /// Name of the word.
        name: String,
        /// Its bits.
        word: u64,
    },
}

impl fmt::Display for ControllerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Load { path, cause } => {
                write!(
                    f,
                    "{}: not a controller library: {}; build the host library of the emitted workspace and name its file",
                    path.display(),
                    reasons(cause)
                )
            }
            Self::Abi { path, found } => {
                write!(
                    f,
                    "{}: interface version {found}, expected {ABI_VERSION}; build it with this specgen",
                    path.display()
                )
            }
            Self::Description(error) => error.fmt(f),
            Self::ConfigLength { given, expected } => {
                write!(f, "{given} configuration words; this controller has {expected}")
            }
            Self::Config { name, word } => {
                write!(
                    f,
                    "the controller refuses configuration word `{name}` = {word:016x}; docs/settings.md has its range, which the spec limits"
                )
            }
        }
    }
}

/// An error with the reasons behind it, which the loader keeps apart.
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

impl std::error::Error for ControllerError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Load { cause, .. } => Some(cause),
            Self::Description(error) => Some(error),
            _ => None,
        }
    }
}

impl From<DescriptionError> for ControllerError {
    fn from(error: DescriptionError) -> Self {
        Self::Description(error)
    }
}

/// The library's functions. Valid while the library is loaded.
#[derive(Clone, Copy)]
struct Functions {
    config_default: unsafe extern "C" fn(*mut u64),
    config_check: unsafe extern "C" fn(*const u64) -> i32,
    config_load: unsafe extern "C" fn(*mut u8, *const u64) -> i32,
    state_reset: unsafe extern "C" fn(*mut u8),
    step: unsafe extern "C" fn(*const u8, *mut u8, *const u64, *mut u64),
    state_digest: unsafe extern "C" fn(*const u8) -> u64,
}

/// Words of a motion: pose, rate, acceleration.
const MOTION_WORDS: usize = 18;
/// Words of an analysis: J, M, C ḣ, G, leg forces, leg displacements.
const ANALYSIS_WORDS: usize = 96;

/// The emitted controller's dynamics at a motion, in its own arithmetic.
#[derive(Debug, Clone, PartialEq)]
pub struct Dynamics {
    /// ∂l/∂h, a row per leg: m/m, m/rad.
    pub jacobian: [[f64; 6]; 6],
    /// M(h).
    pub mass: [[f64; 6]; 6],
    /// C(h, ḣ) ḣ: N, N m.
    pub coriolis: [f64; 6],
    /// G(h): N, N m.
    pub gravity: [f64; 6],
    /// N, > 0 pushes the platform.
    pub leg_forces: [f64; 6],
    /// Δl from rest, m.
    pub displacements: [f64; 6],
}

/// An emitted controller with one configuration and one state.
pub struct Controller {
    /// What it says of itself, in its own words and parsed.
    text: String,
    description: Description,
    functions: Functions,
    config: Buffer,
    state: Buffer,
    /// Memory of a machine: the state with its supervisor.
    machine_layout: Layout,
    /// Words of its snapshot.
    machine_words: usize,
    /// Where it came from.
    path: PathBuf,
    /// Last, so that it is unloaded after everything else.
    library: Arc<Library>,
}

// SAFETY: the buffers belong to one controller each and hold plain values without pointers (`Config` and `State` of an
// emitted crate are `Copy`); the library's functions touch nothing but what they are given, and the library has no state.
unsafe impl Send for Controller {}
// SAFETY: what takes a shared reference only reads configuration and state.
unsafe impl Sync for Controller {}

impl Controller {
    /// Sizes and alignments of its state, its configuration, and its machine.
    #[must_use]
    pub fn layouts(&self) -> [Layout; 3] {
        [self.state.layout, self.config.layout, self.machine_layout]
    }

    /// Loads a controller's host library, with the spec's configuration and the power-up state.
    ///
    /// # Errors
    /// If the file is no such library, speaks another version, or describes itself badly.
    pub fn load(path: &Path) -> Result<Self, ControllerError> {
        let failed = |cause| ControllerError::Load { path: path.to_owned(), cause };
        // SAFETY: loading runs the library's initialisers. The caller names a controller library; an emitted one has none.
        let library = unsafe { Library::new(path) }.map_err(failed)?;

        // SAFETY: the types are those of the interface version; the version function itself is the same in every version,
        // and is asked before any other is called. The pointers are used only while `library` lives, see `Controller`.
        let (describe, functions) = unsafe {
            let abi_version: unsafe extern "C" fn() -> u32 = *library.get(b"specgen_abi_version\0").map_err(failed)?;
            let found = abi_version();
            if found != ABI_VERSION {
                return Err(ControllerError::Abi { path: path.to_owned(), found });
            }
            let describe: unsafe extern "C" fn(*mut *const u8, *mut usize) =
                *library.get(b"specgen_describe\0").map_err(failed)?;
            let functions = Functions {
                config_default: *library.get(b"specgen_config_default\0").map_err(failed)?,
                config_check: *library.get(b"specgen_config_check\0").map_err(failed)?,
                config_load: *library.get(b"specgen_config_load\0").map_err(failed)?,
                state_reset: *library.get(b"specgen_state_reset\0").map_err(failed)?,
                step: *library.get(b"specgen_step\0").map_err(failed)?,
                state_digest: *library.get(b"specgen_state_digest\0").map_err(failed)?,
            };
            (describe, functions)
        };

        let mut start = std::ptr::null();
        let mut length = 0;
        // SAFETY: both pointers are to live locals.
        unsafe { describe(&raw mut start, &raw mut length) };
        let text = if start.is_null() {
            String::new()
        } else {
            // SAFETY: the library points to `length` bytes of its own constant data; they are copied here.
            String::from_utf8_lossy(unsafe { std::slice::from_raw_parts(start, length) }).into_owned()
        };
        let description = Description::parse(&text)?;
        let state = Buffer::new(layout(&text, "state_bytes", "state_align")?);
        let config = Buffer::new(layout(&text, "config_bytes", "config_align")?);

        let machine_layout = layout(&text, "machine_bytes", "machine_align")?;
        let machine_words = size(&text, "machine_words")?;

        let path = path.to_owned();
        let library = Arc::new(library);
        let mut controller =
            Self { text, description, functions, config, state, machine_layout, machine_words, path, library };
        let words = controller.default_config();
        controller.configure(&words)?;
        controller.reset();
        Ok(controller)
    }

    /// What the controller says of itself: `key=value` lines, as files of its records begin with.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Another controller of the same library, with the same configuration and in the same state: to continue from here
    /// more than once, or in another thread.
    #[must_use]
    pub fn fork(&self) -> Self {
        Self {
            text: self.text.clone(),
            description: self.description.clone(),
            functions: self.functions,
            config: self.config.copy(),
            state: self.state.copy(),
            machine_layout: self.machine_layout,
            machine_words: self.machine_words,
            path: self.path.clone(),
            library: Arc::clone(&self.library),
        }
    }

    /// Takes the configuration and the state of another controller of the same library.
    ///
    /// # Panics
    /// If `other` is of another library.
    pub fn take_over(&mut self, other: &Self) {
        assert!(Arc::ptr_eq(&self.library, &other.library), "controllers of one library");
        self.config.overwrite(&other.config);
        self.state.overwrite(&other.state);
    }

    /// The dynamics of the platform at a pose from rest (m, rad) with its first and second time derivatives, rounded to the
    /// controller's arithmetic.
    ///
    /// # Errors
    /// If the library does not offer them.
    pub fn dynamics(
        &self,
        pose: &[f64; 6],
        rate: &[f64; 6],
        acceleration: &[f64; 6],
    ) -> Result<Dynamics, ControllerError> {
        let scalar = self.description.scalar;
        let motion: Vec<u64> =
            [pose, rate, acceleration].into_iter().flatten().map(|value| scalar.encode(*value)).collect();
        debug_assert_eq!(motion.len(), MOTION_WORDS);
        let mut analysis = [0; ANALYSIS_WORDS];
        // SAFETY: the function reads and writes as many words as there are here.
        unsafe {
            let function: libloading::Symbol<'_, unsafe extern "C" fn(*const u64, *mut u64)> = self
                .library
                .get(b"specgen_dynamics\0")
                .map_err(|cause| ControllerError::Load { path: self.path.clone(), cause })?;
            function(motion.as_ptr(), analysis.as_mut_ptr());
        }
        let mut values = analysis.iter().map(|word| scalar.decode(*word));
        let mut six = || std::array::from_fn(|_| values.next().unwrap_or(f64::NAN));
        Ok(Dynamics {
            jacobian: [six(), six(), six(), six(), six(), six()],
            mass: [six(), six(), six(), six(), six(), six()],
            coriolis: six(),
            gravity: six(),
            leg_forces: six(),
            displacements: six(),
        })
    }
}

impl TickController for Controller {
    fn description(&self) -> &Description {
        &self.description
    }

    fn default_config(&self) -> Vec<u64> {
        let mut words = vec![0; self.description.config_names.len()];
        // SAFETY: as many words as the library says it writes.
        unsafe { (self.functions.config_default)(words.as_mut_ptr()) };
        words
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        let expected = self.description.config_names.len();
        if words.len() != expected {
            return Err(ControllerError::ConfigLength { given: words.len(), expected });
        }
        // SAFETY: as many words as the library says it reads.
        let mut bad = unsafe { (self.functions.config_check)(words.as_ptr()) };
        if bad == 0 {
            // SAFETY: the buffer has the size and alignment that the library asks for; the words as above.
            bad = unsafe { (self.functions.config_load)(self.config.start(), words.as_ptr()) };
        }
        if bad == 0 {
            return Ok(());
        }
        let index = usize::try_from(bad).ok().and_then(|bad| bad.checked_sub(1));
        let name = index.and_then(|index| self.description.config_names.get(index));
        Err(ControllerError::Config {
            name: name.cloned().unwrap_or_else(|| format!("number {bad}")),
            word: index.and_then(|index| words.get(index).copied()).unwrap_or_default(),
        })
    }

    fn reset(&mut self) {
        // SAFETY: the buffer has the size and alignment that the library asks for.
        unsafe { (self.functions.state_reset)(self.state.start()) };
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        assert_eq!(input.len(), self.description.input_names.len(), "input words");
        assert_eq!(output.len(), self.description.output_names.len(), "output words");
        // SAFETY: `load` initialised both buffers; the slices have the lengths that the library says, checked above.
        unsafe {
            (self.functions.step)(self.config.start(), self.state.start(), input.as_ptr(), output.as_mut_ptr());
        }
    }

    fn state_digest(&self) -> u64 {
        // SAFETY: `load` initialised the state.
        unsafe { (self.functions.state_digest)(self.state.start()) }
    }
}

mod supervised;

pub use supervised::{MachineWord, SnapshotError, Standing, Supervised};

/// Zeroed memory of a given size and alignment.
struct Buffer {
    start: NonNull<u8>,
    layout: Layout,
}

impl Buffer {
    /// `layout` has a size above 0, see [`layout`].
    fn new(layout: Layout) -> Self {
        // SAFETY: the size is above 0.
        let start = unsafe { alloc_zeroed(layout) };
        match NonNull::new(start) {
            Some(start) => Self { start, layout },
            None => handle_alloc_error(layout),
        }
    }

    fn start(&self) -> *mut u8 {
        self.start.as_ptr()
    }

    fn copy(&self) -> Self {
        let copy = Self::new(self.layout);
        copy.overwrite(self);
        copy
    }

    /// `other` has the same layout.
    fn overwrite(&self, other: &Self) {
        assert_eq!(self.layout, other.layout, "buffers of one library");
        // SAFETY: both have as many bytes, and are two allocations.
        unsafe { std::ptr::copy_nonoverlapping(other.start(), self.start(), self.layout.size()) };
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: allocated in `new` with this layout, and freed once.
        unsafe { dealloc(self.start.as_ptr(), self.layout) };
    }
}

/// A size under a key of a description.
fn size(text: &str, key: &'static str) -> Result<usize, DescriptionError> {
    let fields = fields(text);
    let value = fields.get(key).ok_or(DescriptionError::Missing(key))?;
    // A gigabyte is far beyond any controller, and an allocation that would abort the process.
    value.parse().ok().filter(|size| *size <= 1 << 30).ok_or_else(|| DescriptionError::Bad {
        key,
        value: (*value).to_owned(),
        expected: "a number of bytes up to 2^30",
    })
}

/// Size and alignment under two keys of a description; a size of 0 becomes 1.
fn layout(text: &str, size_key: &'static str, align_key: &'static str) -> Result<Layout, DescriptionError> {
    let (size, align) = (size(text, size_key)?, size(text, align_key)?);
    Layout::from_size_align(size.max(1), align).map_err(|_| DescriptionError::Bad {
        key: align_key,
        value: align.to_string(),
        expected: "a power of two",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffer_has_the_alignment_asked_for_and_starts_zeroed() {
        for align in [1, 8, 64, 4096] {
            let buffer = Buffer::new(Layout::from_size_align(100, align).unwrap());
            assert_eq!(buffer.start() as usize % align, 0);
            // SAFETY: the first of 100 bytes.
            assert_eq!(unsafe { *buffer.start() }, 0);
        }
    }

    #[test]
    fn a_bad_layout_is_refused_by_key() {
        let refused = |text: &str| layout(text, "state_bytes", "state_align").unwrap_err().to_string();
        assert!(refused("state_bytes=8\n").contains("lacks `state_align`"));
        assert!(refused("state_bytes=8\nstate_align=3\n").contains("`state_align=3`; expected a power of two"));
        assert!(refused("state_bytes=99999999999\nstate_align=8\n").contains("up to 2^30"));
        assert!(refused("state_bytes=-1\nstate_align=8\n").contains("`state_bytes=-1`"));
    }

    #[test]
    fn a_file_that_is_no_library_is_refused_with_its_name() {
        let Err(error) = Controller::load(Path::new("no/such/library.so")) else { panic!("loaded") };
        let text = error.to_string();
        assert!(text.starts_with("no/such/library.so: not a controller library"), "{text}");
    }
}
