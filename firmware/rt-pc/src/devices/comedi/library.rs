//! The few functions of libcomedi that single readings and outputs need, opened when the program runs.
//!
//! Types and constants are those of `comedi.h` and `comedilib.h` (comedilib 0.8 and later).
#![allow(unsafe_code)] // Calls of a C library; each says why it is sound.

use core::ffi::{CStr, c_char, c_double, c_int, c_uint, c_void};
use std::ffi::CString;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use libloading::Library;

/// Names of the library, if no file is given.
const NAMES: [&str; 2] = ["libcomedi.so.0", "libcomedi.so"];

/// Kinds of subdevices.
pub const ANALOG_INPUT: c_int = 1;
pub const ANALOG_OUTPUT: c_int = 2;
pub const DIGITAL: c_int = 5;
/// Volts, the unit of a range.
const UNIT_VOLT: c_uint = 0;
/// Direction of a digital line.
pub const OUTPUT: c_uint = 1;
pub const INPUT: c_uint = 0;
const READ: c_uint = 0x0400_0000;
const WRITE: c_uint = 0x0800_0001;

/// One reading or output of one channel.
#[repr(C)]
#[derive(Clone, Copy)]
struct Instruction {
    kind: c_uint,
    count: c_uint,
    data: *mut c_uint,
    subdevice: c_uint,
    channel: c_uint,
    unused: [c_uint; 3],
}

#[repr(C)]
struct List {
    count: c_uint,
    instructions: *mut Instruction,
}

/// Where a channel is referred to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// Ground of the card.
    Ground = 0,
    /// The channel's own second wire.
    Differential = 2,
}

/// A channel with its range, as instructions name it.
pub fn channel(number: u32, range: u32, reference: Reference) -> u32 {
    (reference as u32) << 24 | range << 16 | number
}

type Handle = *mut c_void;

struct Functions {
    open: unsafe extern "C" fn(*const c_char) -> Handle,
    close: unsafe extern "C" fn(Handle) -> c_int,
    errno: unsafe extern "C" fn() -> c_int,
    strerror: unsafe extern "C" fn(c_int) -> *const c_char,
    board_name: unsafe extern "C" fn(Handle) -> *const c_char,
    find_subdevice: unsafe extern "C" fn(Handle, c_int, c_uint) -> c_int,
    channels: unsafe extern "C" fn(Handle, c_uint) -> c_int,
    largest: unsafe extern "C" fn(Handle, c_uint, c_uint) -> c_uint,
    find_range: unsafe extern "C" fn(Handle, c_uint, c_uint, c_uint, c_double, c_double) -> c_int,
    perform: unsafe extern "C" fn(Handle, *mut List) -> c_int,
    configure_line: unsafe extern "C" fn(Handle, c_uint, c_uint, c_uint) -> c_int,
    read_line: unsafe extern "C" fn(Handle, c_uint, c_uint, *mut c_uint) -> c_int,
    write_line: unsafe extern "C" fn(Handle, c_uint, c_uint, c_uint) -> c_int,
    exchange_lines: unsafe extern "C" fn(Handle, c_uint, c_uint, *mut c_uint, c_uint) -> c_int,
    /// Last, so that it is unloaded after everything else.
    _library: Library,
}

pub struct Comedilib {
    functions: Functions,
}

/// An open card. It lives as long as the library that opened it.
pub struct Card<'a> {
    library: &'a Comedilib,
    handle: Handle,
}

// SAFETY: a handle may be used from any thread, but from one at a time, which the borrow checker ensures.
unsafe impl Send for Card<'_> {}
// SAFETY: the functions have no thread-local state.
unsafe impl Sync for Comedilib {}

impl Comedilib {
    /// Opens `file`, or the system's library.
    ///
    /// # Errors
    /// As text: the names tried, and how to install it.
    pub fn open(file: Option<&Path>) -> Result<Self, String> {
        let names: Vec<&Path> = file.map_or_else(|| NAMES.iter().map(Path::new).collect(), |file| vec![file]);
        let mut answers = Vec::new();
        for name in names {
            // SAFETY: loading runs the library's initialisers; those of libcomedi are harmless.
            match unsafe { Library::new(name) } {
                Ok(library) => {
                    // SAFETY: the library is comedilib by its name, the types are those of its headers.
                    let functions = unsafe { Functions::of(library) };
                    return functions.map(|functions| Self { functions }).map_err(|error| {
                        format!("{}: not comedilib: {error}; install libcomedi0 0.11", name.display())
                    });
                }
                Err(error) => answers.push(error.to_string()),
            }
        }
        Err(format!("no comedilib: {}; install it: apt-get install libcomedi0", answers.join("; ")))
    }

    /// Opens a card, such as `/dev/comedi0`.
    ///
    /// # Errors
    /// In words.
    pub fn card(&self, device: &Path) -> Result<Card<'_>, String> {
        let path =
            CString::new(device.as_os_str().as_bytes()).map_err(|_| "a device's path has no zero byte".to_owned())?;
        // SAFETY: a C string that lives through the call.
        let handle = unsafe { (self.functions.open)(path.as_ptr()) };
        if handle.is_null() {
            return Err(format!("{}: {}; see `specgen doctor`", device.display(), self.last_error()));
        }
        Ok(Card { library: self, handle })
    }

    fn last_error(&self) -> String {
        // SAFETY: no arguments but a number; the text is the library's own constant.
        unsafe { text((self.functions.strerror)((self.functions.errno)())) }
    }
}

impl Functions {
    /// # Safety
    /// The library is comedilib.
    unsafe fn of(library: Library) -> Result<Self, libloading::Error> {
        // SAFETY: the caller's duty.
        unsafe {
            Ok(Self {
                open: *library.get(b"comedi_open\0")?,
                close: *library.get(b"comedi_close\0")?,
                errno: *library.get(b"comedi_errno\0")?,
                strerror: *library.get(b"comedi_strerror\0")?,
                board_name: *library.get(b"comedi_get_board_name\0")?,
                find_subdevice: *library.get(b"comedi_find_subdevice_by_type\0")?,
                channels: *library.get(b"comedi_get_n_channels\0")?,
                largest: *library.get(b"comedi_get_maxdata\0")?,
                find_range: *library.get(b"comedi_find_range\0")?,
                perform: *library.get(b"comedi_do_insnlist\0")?,
                configure_line: *library.get(b"comedi_dio_config\0")?,
                read_line: *library.get(b"comedi_dio_read\0")?,
                write_line: *library.get(b"comedi_dio_write\0")?,
                exchange_lines: *library.get(b"comedi_dio_bitfield2\0")?,
                _library: library,
            })
        }
    }
}

impl Card<'_> {
    /// What the driver calls the card.
    pub fn name(&self) -> String {
        // SAFETY: an open handle; the text lives as long as it.
        unsafe { text((self.library.functions.board_name)(self.handle)) }
    }

    /// Number and channels of the first subdevice of a kind.
    pub fn subdevice(&self, kind: c_int) -> Option<(u32, u32)> {
        // SAFETY: an open handle and numbers.
        unsafe {
            let found = u32::try_from((self.library.functions.find_subdevice)(self.handle, kind, 0)).ok()?;
            Some((found, u32::try_from((self.library.functions.channels)(self.handle, found)).ok()?))
        }
    }

    /// Highest code of a channel.
    pub fn highest(&self, subdevice: u32, number: u32) -> u32 {
        // SAFETY: an open handle and numbers.
        unsafe { (self.library.functions.largest)(self.handle, subdevice, number) }
    }

    /// Number of the narrowest range of a channel that holds these voltages.
    pub fn range(&self, subdevice: u32, number: u32, volts: [f64; 2]) -> Option<u32> {
        // SAFETY: an open handle and numbers.
        let found = unsafe {
            (self.library.functions.find_range)(self.handle, subdevice, number, UNIT_VOLT, volts[0], volts[1])
        };
        u32::try_from(found).ok()
    }

    /// Makes a digital line an input or an output.
    ///
    /// # Errors
    /// What the library says.
    pub fn configure_line(&self, subdevice: u32, line: u32, direction: c_uint) -> Result<(), String> {
        // SAFETY: an open handle and numbers.
        let answer = unsafe { (self.library.functions.configure_line)(self.handle, subdevice, line, direction) };
        if answer < 0 { Err(self.library.last_error()) } else { Ok(()) }
    }

    /// Sets a digital line; false if it cannot.
    pub fn set_line(&self, subdevice: u32, line: u32, on: bool) -> bool {
        // SAFETY: an open handle and numbers.
        unsafe { (self.library.functions.write_line)(self.handle, subdevice, line, c_uint::from(on)) >= 0 }
    }

    /// A digital line; none if it cannot be read.
    pub fn line(&self, subdevice: u32, line: u32) -> Option<bool> {
        let mut bit: c_uint = 0;
        // SAFETY: an open handle, numbers, and a word that the library fills.
        let answer = unsafe { (self.library.functions.read_line)(self.handle, subdevice, line, &raw mut bit) };
        (answer >= 0).then_some(bit != 0)
    }

    /// Sets the digital lines of `mask`, as `high` says, and reads all, from line `first` on, in one call; none if it cannot.
    pub fn exchange_lines(&self, subdevice: u32, first: u32, mask: u32, high: u32) -> Option<u32> {
        let mut bits: c_uint = high;
        // SAFETY: an open handle, numbers, and a word that the library reads and fills.
        let answer =
            unsafe { (self.library.functions.exchange_lines)(self.handle, subdevice, mask, &raw mut bits, first) };
        (answer >= 0).then_some(bits)
    }

    /// Reads channels one after the other in one call; false if not all were read.
    #[must_use]
    pub fn read<const N: usize>(&self, subdevice: u32, channels: &[u32; N], codes: &mut [u32; N]) -> bool {
        self.perform(READ, subdevice, channels, N, codes)
    }

    /// Gives codes out one after the other in one call; false if not all were.
    pub fn write<const N: usize>(&self, subdevice: u32, channels: &[u32; N], count: usize, codes: &[u32; N]) -> bool {
        let mut codes = *codes;
        self.perform(WRITE, subdevice, channels, count, &mut codes)
    }

    /// The first `count` of the channels. No allocation: the list is on the stack.
    fn perform<const N: usize>(
        &self,
        kind: c_uint,
        subdevice: u32,
        channels: &[u32; N],
        count: usize,
        codes: &mut [u32; N],
    ) -> bool {
        let count = count.min(N);
        let data = codes.as_mut_ptr();
        let mut list: [Instruction; N] = core::array::from_fn(|k| Instruction {
            kind,
            count: 1,
            // In range: `codes` has as many as the list.
            data: data.wrapping_add(k),
            subdevice,
            channel: channels[k],
            unused: [0; 3],
        });
        let mut list = List { count: count as c_uint, instructions: list.as_mut_ptr() };
        // SAFETY: an open handle; list, instructions and codes live through the call and are of the lengths they state.
        let done = unsafe { (self.library.functions.perform)(self.handle, &raw mut list) };
        usize::try_from(done).is_ok_and(|done| done == count)
    }
}

impl Drop for Card<'_> {
    fn drop(&mut self) {
        // SAFETY: opened in `card`, closed once.
        unsafe { (self.library.functions.close)(self.handle) };
    }
}

/// # Safety
/// A C string or null.
unsafe fn text(start: *const c_char) -> String {
    if start.is_null() {
        return "no reason given".to_owned();
    }
    // SAFETY: the caller's duty.
    unsafe { CStr::from_ptr(start) }.to_string_lossy().into_owned()
}
