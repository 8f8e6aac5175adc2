//! The shared library of an emitted controller. Apart from one for CPU instructions, this is the only module with
//! unsafe code.
//!
//! The library's C interface, version 2: `specgen_abi_version`, `_describe`, `_config_default`, `_config_check`,
//! `_config_load`, `_state_reset`, `_step`, `_state_digest`, and under the supervisor `_machine_reset`,
//! `_machine_step`, `_machine_digest`, `_machine_save`, `_machine_load`, `_words_per_leg`.
#![allow(unsafe_code)]

use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::any::Any;
use std::path::Path;
use std::ptr::NonNull;
use std::sync::Arc;

use libloading::Library;

use super::ControllerError;
use super::engine::Engine;
use crate::description::{DescriptionError, fields};

/// Version of the C interface in this module.
pub const ABI_VERSION: u32 = 2;

type Reset = unsafe extern "C" fn(*mut u8);
type Step = unsafe extern "C" fn(*const u8, *mut u8, *const u64, *mut u64);
type Digest = unsafe extern "C" fn(*const u8) -> u64;
type Load = unsafe extern "C" fn(*mut u8, *const u64) -> i32;

/// The library's functions. Valid while the library is loaded.
#[derive(Clone, Copy)]
struct Functions {
    config_default: unsafe extern "C" fn(*mut u64),
    config_check: unsafe extern "C" fn(*const u64) -> i32,
    config_load: Load,
    state_reset: Reset,
    step: Step,
    state_digest: Digest,
    machine_reset: Reset,
    machine_step: Step,
    machine_digest: Digest,
    machine_save: unsafe extern "C" fn(*const u8, *mut u64),
    machine_load: Load,
    words_per_leg: unsafe extern "C" fn(*const u64, *mut u64),
}

/// An emitted controller with one configuration and one state.
pub(super) struct Emitted {
    text: String,
    functions: Functions,
    config: Buffer,
    state: Buffer,
    machine: Buffer,
    /// Words of a machine's snapshot.
    machine_words: usize,
    /// Last, so that it is unloaded after all other fields.
    library: Arc<Library>,
}

// SAFETY: the buffers belong to one controller each and hold plain values without pointers (`Config`, `State` and
// `Machine` of an emitted crate are `Copy`). The library's functions access only their arguments, and the library has
// no state.
unsafe impl Send for Emitted {}
// SAFETY: methods with a shared reference only read configuration, state and machine.
unsafe impl Sync for Emitted {}

impl Emitted {
    /// Loads a library. Configuration, state and machine are zeros until [`Engine::configure`], [`Engine::reset`] and
    /// [`Engine::reset_machine`].
    pub(super) fn load(path: &Path) -> Result<Self, ControllerError> {
        let failed = |cause| ControllerError::Load { path: path.to_owned(), cause };
        // SAFETY: loading runs the library's initialisers. The caller names a controller library; an emitted one has
        // none.
        let library = unsafe { Library::new(path) }.map_err(failed)?;

        // SAFETY: the types are those of the interface version. The version function is the same in every version, and
        // is called before any other. The pointers are used only while `library` lives, see `Emitted`.
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
                machine_reset: *library.get(b"specgen_machine_reset\0").map_err(failed)?,
                machine_step: *library.get(b"specgen_machine_step\0").map_err(failed)?,
                machine_digest: *library.get(b"specgen_machine_digest\0").map_err(failed)?,
                machine_save: *library.get(b"specgen_machine_save\0").map_err(failed)?,
                machine_load: *library.get(b"specgen_machine_load\0").map_err(failed)?,
                words_per_leg: *library.get(b"specgen_words_per_leg\0").map_err(failed)?,
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
        let state = Buffer::new(layout(&text, "state_bytes", "state_align")?);
        let config = Buffer::new(layout(&text, "config_bytes", "config_align")?);
        let machine = Buffer::new(layout(&text, "machine_bytes", "machine_align")?);
        let machine_words = size(&text, "machine_words")?;
        Ok(Self { text, functions, config, state, machine, machine_words, library: Arc::new(library) })
    }
}

impl Engine for Emitted {
    fn text(&self) -> String {
        self.text.clone()
    }

    fn layouts(&self) -> [Layout; 3] {
        [self.state.layout, self.config.layout, self.machine.layout]
    }

    fn fork(&self) -> Box<dyn Engine> {
        Box::new(Self {
            text: self.text.clone(),
            functions: self.functions,
            config: self.config.copy(),
            state: self.state.copy(),
            machine: self.machine.copy(),
            machine_words: self.machine_words,
            library: Arc::clone(&self.library),
        })
    }

    fn take_over(&mut self, other: &dyn Engine) {
        match other.as_any().downcast_ref::<Self>() {
            Some(other) if Arc::ptr_eq(&self.library, &other.library) => {
                self.config.overwrite(&other.config);
                self.state.overwrite(&other.state);
            }
            _ => unreachable!("controllers of one library"),
        }
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn default_config(&self, words: &mut [u64]) {
        // SAFETY: the library writes this number of words.
        unsafe { (self.functions.config_default)(words.as_mut_ptr()) };
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), usize> {
        // SAFETY: the library reads this number of words.
        let mut bad = unsafe { (self.functions.config_check)(words.as_ptr()) };
        if bad == 0 {
            // SAFETY: the buffer has the size and alignment that the library requires; the words as above.
            bad = unsafe { (self.functions.config_load)(self.config.start(), words.as_ptr()) };
        }
        refused(bad)
    }

    fn reset(&mut self) {
        // SAFETY: the buffer has the size and alignment that the library requires.
        unsafe { (self.functions.state_reset)(self.state.start()) };
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        // SAFETY: `Controller::of` initialised both buffers; the slices have the lengths in the description, checked by
        // the caller.
        unsafe {
            (self.functions.step)(self.config.start(), self.state.start(), input.as_ptr(), output.as_mut_ptr());
        }
    }

    fn digest(&self) -> u64 {
        // SAFETY: `Controller::of` initialised the state.
        unsafe { (self.functions.state_digest)(self.state.start()) }
    }

    fn reset_machine(&mut self) {
        // SAFETY: the buffer has the size and alignment that the library requires.
        unsafe { (self.functions.machine_reset)(self.machine.start()) };
    }

    fn step_machine(&mut self, input: &[u64], output: &mut [u64]) {
        // SAFETY: `Supervised::new` initialised the machine; the slices have the lengths in the description, checked by
        // the caller.
        unsafe {
            (self.functions.machine_step)(
                self.config.start(),
                self.machine.start(),
                input.as_ptr(),
                output.as_mut_ptr(),
            );
        }
    }

    fn machine_digest(&self) -> u64 {
        // SAFETY: `Supervised::new` initialised the machine.
        unsafe { (self.functions.machine_digest)(self.machine.start()) }
    }

    fn machine_words(&self) -> usize {
        self.machine_words
    }

    fn save_machine(&self, words: &mut [u64]) {
        // SAFETY: the machine is initialised; the library writes this number of words, checked by the caller.
        unsafe { (self.functions.machine_save)(self.machine.start(), words.as_mut_ptr()) };
    }

    fn load_machine(&mut self, words: &[u64]) -> Result<(), usize> {
        // SAFETY: the buffer has the size and alignment that the library requires; the library reads this number of
        // words, checked by the caller.
        refused(unsafe { (self.functions.machine_load)(self.machine.start(), words.as_ptr()) })
    }

    fn words_per_leg(&self, gauges: &[u64; 6]) -> [[u64; 6]; 6] {
        let mut rows = [[0; 6]; 6];
        // SAFETY: both arrays have the lengths that the function takes.
        unsafe { (self.functions.words_per_leg)(gauges.as_ptr(), rows.as_mut_ptr().cast()) };
        rows
    }
}

/// The index of a refused word, from the library's result: the result less 1; none for 0.
fn refused(bad: i32) -> Result<(), usize> {
    usize::try_from(bad).unwrap_or(usize::MAX).checked_sub(1).map_or(Ok(()), Err)
}

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
    // A gigabyte is far beyond any controller, and a failed allocation would abort the process.
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
}
