//! The Unicorn engine (GPL-2.0), a library that is opened at run time; all that is unsafe is here.
//!
//! The core is opened as Thumb with the model of a Cortex-M7, not as M-class, which forces an M33: exceptions are therefore the
//! caller's. Every instruction is announced before it runs, so that time, interrupts and sleep can be modelled exactly.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};
use std::marker::PhantomData;
use std::path::Path;

use libloading::Library;

/// A register, by the engine's number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register(c_int);

/// IT[7:2] and IT[1:0] of CPSR.
const BLOCK: u32 = 0x3f << 10 | 3 << 25;

impl Register {
    pub const APSR: Self = Self(1);
    const CPSR: Self = Self(3);
    pub const FPSCR: Self = Self(6);
    pub const LR: Self = Self(10);
    pub const PC: Self = Self(11);
    pub const SP: Self = Self(12);
    pub const R12: Self = Self(78);
    pub const PRIMASK: Self = Self(123);
    pub const BASEPRI: Self = Self(124);

    /// R0 to R12.
    pub const fn general(number: u8) -> Self {
        Self(66 + number as c_int)
    }

    /// S0 to S31.
    pub const fn single(number: u8) -> Self {
        Self(79 + number as c_int)
    }
}

/// What runs around the core.
pub trait Guest {
    /// Called before each instruction. False: it is not run, and [`Engine::run`] returns.
    fn instruction(&mut self, core: &Core<'_>, address: u32, size: u32) -> bool;
    /// An access to memory that [`Engine::watch`] watches.
    fn data(&mut self, address: u32, write: bool);
    /// A read of `size` bytes where no memory is.
    fn read(&mut self, address: u32, size: u32) -> u32;
    /// A write of `size` bytes where no memory is.
    fn write(&mut self, address: u32, size: u32, value: u32);
}

type Uc = *mut c_void;
type Hook<G> = unsafe extern "C" fn(Uc, u64, u32, *mut Attachment<G>);
type Data<G> = unsafe extern "C" fn(Uc, c_int, u64, c_int, i64, *mut Attachment<G>);
type Read<G> = unsafe extern "C" fn(Uc, u64, u32, *mut Region<G>) -> u64;
type Write<G> = unsafe extern "C" fn(Uc, u64, u32, u64, *mut Region<G>);

const ARCH_ARM: c_int = 1;
const MODE_THUMB: c_int = 1 << 4;
/// UC_CTL_WRITE(UC_CTL_CPU_MODEL, 1).
const WRITE_CPU_MODEL: c_int = 7 | 1 << 26 | 1 << 30;
const CORTEX_M7: c_int = 10;
const HOOK_CODE: c_int = 4;
const HOOK_MEMORY: c_int = 1 << 10 | 1 << 11;
const WRITES: c_int = 17;
const ALL_RIGHTS: u32 = 7;

/// The functions of the library that are used, as its header declares them.
struct Api {
    close: unsafe extern "C" fn(Uc) -> c_int,
    map: unsafe extern "C" fn(Uc, u64, usize, u32) -> c_int,
    stop: unsafe extern "C" fn(Uc) -> c_int,
    start: unsafe extern "C" fn(Uc, u64, u64, u64, usize) -> c_int,
    reg_read: unsafe extern "C" fn(Uc, c_int, *mut c_void) -> c_int,
    reg_write: unsafe extern "C" fn(Uc, c_int, *const c_void) -> c_int,
    mem_read: unsafe extern "C" fn(Uc, u64, *mut c_void, usize) -> c_int,
    mem_write: unsafe extern "C" fn(Uc, u64, *const c_void, usize) -> c_int,
    /// `uc_hook_add` itself.
    hook_add: *const c_void,
    /// Keeps the functions valid.
    _library: Library,
}

/// The engine with its guest.
pub struct Engine<G> {
    uc: Uc,
    attached: *mut Attachment<G>,
    regions: Vec<*mut Region<G>>,
}

/// What a callback gets.
struct Attachment<G> {
    api: Api,
    guest: G,
}

/// An area that the guest answers for.
struct Region<G> {
    attached: *mut Attachment<G>,
    base: u32,
}

/// The core while it stands at an instruction.
pub struct Core<'a> {
    uc: Uc,
    api: &'a Api,
    /// Not for another thread.
    _here: PhantomData<*mut ()>,
}

impl<G: Guest> Engine<G> {
    /// Opens the library and a core, with memory at `memories` and the guest at `devices` (begin, length; multiples of 4 KiB).
    ///
    /// # Errors
    /// In words: no such library, another one, or it refuses.
    pub fn open(library: &Path, guest: G, memories: &[[u32; 2]], devices: &[[u32; 2]]) -> Result<Self, String> {
        let failed = |error: libloading::Error| format!("{}: {error}", library.display());
        // SAFETY: the initialisers of this library have no conditions.
        let opened = unsafe { Library::new(library) }.map_err(failed)?;
        macro_rules! function {
            ($name:literal) => {{
                // SAFETY: the types are those of the library's header, unicorn.h of version 2.
                let found = unsafe { opened.get($name) };
                *found.map_err(failed)?
            }};
        }
        let open: unsafe extern "C" fn(c_int, c_int, *mut Uc) -> c_int = function!(b"uc_open\0");
        let control: unsafe extern "C" fn(Uc, c_int, ...) -> c_int = function!(b"uc_ctl\0");
        let hook_add: unsafe extern "C" fn(Uc, *mut usize, c_int, Hook<G>, *mut Attachment<G>, u64, u64, ...) -> c_int =
            function!(b"uc_hook_add\0");
        type MapDevices<G> =
            unsafe extern "C" fn(Uc, u64, usize, Read<G>, *mut Region<G>, Write<G>, *mut Region<G>) -> c_int;
        let map_devices: MapDevices<G> = function!(b"uc_mmio_map\0");
        let api = Api {
            close: function!(b"uc_close\0"),
            map: function!(b"uc_mem_map\0"),
            stop: function!(b"uc_emu_stop\0"),
            start: function!(b"uc_emu_start\0"),
            reg_read: function!(b"uc_reg_read\0"),
            reg_write: function!(b"uc_reg_write\0"),
            mem_read: function!(b"uc_mem_read\0"),
            mem_write: function!(b"uc_mem_write\0"),
            hook_add: hook_add as *const c_void,
            _library: opened,
        };
        let mut uc: Uc = std::ptr::null_mut();
        // SAFETY: it writes the handle.
        checked(unsafe { open(ARCH_ARM, MODE_THUMB, &raw mut uc) }, "uc_open")?;
        let attached = Box::into_raw(Box::new(Attachment { api, guest }));
        let mut engine = Self { uc, attached, regions: Vec::new() };
        // SAFETY: one argument of type int, as this control has.
        checked(unsafe { control(uc, WRITE_CPU_MODEL, CORTEX_M7) }, "the model of a Cortex-M7")?;
        for [base, length] in memories {
            // SAFETY: the engine allocates it.
            let result = unsafe { (engine.api().map)(uc, u64::from(*base), *length as usize, ALL_RIGHTS) };
            checked(result, &format!("memory at {base:#x}"))?;
        }
        for [base, length] in devices {
            let region = Box::into_raw(Box::new(Region { attached, base: *base }));
            engine.regions.push(region);
            // SAFETY: `region` lives until the engine is dropped, which closes the core first.
            let result =
                unsafe { map_devices(uc, u64::from(*base), *length as usize, on_read, region, on_write, region) };
            checked(result, &format!("devices at {base:#x}"))?;
        }
        let mut handle = 0;
        // SAFETY: as above for `attached`; begin 1 after end 0 means every address.
        checked(unsafe { hook_add(uc, &raw mut handle, HOOK_CODE, on_code, attached, 1, 0) }, "uc_hook_add")?;
        Ok(engine)
    }

    /// Has [`Guest::data`] called for every access to this memory (begin, length), which takes time.
    ///
    /// # Errors
    /// In words: the engine refuses.
    pub fn watch(&mut self, [base, length]: [u32; 2]) -> Result<(), String> {
        type HookData<G> =
            unsafe extern "C" fn(Uc, *mut usize, c_int, Data<G>, *mut Attachment<G>, u64, u64, ...) -> c_int;
        // SAFETY: `uc_hook_add`, whose third argument decides about the type of the fourth.
        let hook_add: HookData<G> = unsafe { std::mem::transmute(self.api().hook_add) };
        let (mut handle, end) = (0, u64::from(base) + u64::from(length) - 1);
        // SAFETY: as in `open`.
        let result =
            unsafe { hook_add(self.uc, &raw mut handle, HOOK_MEMORY, on_data, self.attached, u64::from(base), end) };
        checked(result, "uc_hook_add")
    }

    fn api(&self) -> &Api {
        // SAFETY: made by `open` and freed by `drop` alone; nobody changes the functions.
        unsafe { &(*self.attached).api }
    }

    /// The guest.
    pub fn guest(&mut self) -> &mut G {
        // SAFETY: callbacks, which have it as well, run only while `run` borrows the engine.
        unsafe { &mut (*self.attached).guest }
    }

    /// The core and the guest, at once.
    pub fn parts(&mut self) -> (Core<'_>, &mut G) {
        // SAFETY: as `guest`; the functions are another field, which nobody changes.
        let (api, guest) = unsafe { (&(*self.attached).api, &mut (*self.attached).guest) };
        (Core { uc: self.uc, api, _here: PhantomData }, guest)
    }

    /// The core.
    pub fn core(&self) -> Core<'_> {
        Core { uc: self.uc, api: self.api(), _here: PhantomData }
    }

    /// Runs Thumb code from `address` on until the guest stops it; an error if the core cannot go on, with the engine's number.
    pub fn run(&mut self, address: u32) -> Result<(), i32> {
        // SAFETY: no borrow of the guest lives now. Nothing is at the address until which it would run.
        let result = unsafe { ((*self.attached).api.start)(self.uc, u64::from(address | 1), u64::MAX, 0, 0) };
        if result == 0 { Ok(()) } else { Err(result) }
    }
}

impl<G> Drop for Engine<G> {
    fn drop(&mut self) {
        // SAFETY: each is freed once, the core before what its callbacks have.
        unsafe {
            ((*self.attached).api.close)(self.uc);
            for region in &self.regions {
                drop(Box::from_raw(*region));
            }
            drop(Box::from_raw(self.attached));
        }
    }
}

impl Core<'_> {
    /// No instruction from here on belongs to an IT block. A callback for memory leaves the engine with the block of the instruction that
    /// it was called for; where it comes to its next jump it would skip what the block's condition skips.
    pub fn end_block(&self) {
        self.set(Register::CPSR, self.get(Register::CPSR) & !BLOCK);
    }

    /// A register.
    pub fn get(&self, register: Register) -> u32 {
        let mut value = 0_u32;
        // SAFETY: these registers have 32 bits.
        unsafe { (self.api.reg_read)(self.uc, register.0, (&raw mut value).cast()) };
        value
    }

    /// Sets a register.
    pub fn set(&self, register: Register, value: u32) {
        // SAFETY: these registers have 32 bits.
        unsafe { (self.api.reg_write)(self.uc, register.0, (&raw const value).cast()) };
    }

    /// Fills `bytes` from memory; false if there is none.
    pub fn load(&self, address: u32, bytes: &mut [u8]) -> bool {
        // SAFETY: as many bytes as there is room for.
        unsafe { (self.api.mem_read)(self.uc, u64::from(address), bytes.as_mut_ptr().cast(), bytes.len()) == 0 }
    }

    /// Puts `bytes` into memory; false if there is none.
    pub fn store(&self, address: u32, bytes: &[u8]) -> bool {
        // SAFETY: as many bytes as there are.
        unsafe { (self.api.mem_write)(self.uc, u64::from(address), bytes.as_ptr().cast(), bytes.len()) == 0 }
    }

    /// A word of memory.
    pub fn word(&self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.load(address, &mut bytes).then(|| u32::from_le_bytes(bytes))
    }
}

fn checked(result: c_int, what: &str) -> Result<(), String> {
    if result == 0 { Ok(()) } else { Err(format!("the engine refuses {what}: error {result}")) }
}

unsafe extern "C" fn on_code<G: Guest>(uc: Uc, address: u64, size: u32, attached: *mut Attachment<G>) {
    // SAFETY: from `open`; nobody else uses the guest while the core runs.
    let (api, guest) = unsafe { (&(*attached).api, &mut (*attached).guest) };
    let core = Core { uc, api, _here: PhantomData };
    if !guest.instruction(&core, address as u32, size) {
        // SAFETY: the core runs.
        unsafe { (api.stop)(uc) };
    }
}

unsafe extern "C" fn on_data<G: Guest>(
    _: Uc,
    kind: c_int,
    address: u64,
    _: c_int,
    _: i64,
    attached: *mut Attachment<G>,
) {
    // SAFETY: as in `on_code`.
    unsafe { (*attached).guest.data(address as u32, kind == WRITES) };
}

unsafe extern "C" fn on_read<G: Guest>(_: Uc, offset: u64, size: u32, region: *mut Region<G>) -> u64 {
    // SAFETY: as in `on_code`.
    let (guest, base) = unsafe { (&mut (*(*region).attached).guest, (*region).base) };
    u64::from(guest.read(base + offset as u32, size))
}

unsafe extern "C" fn on_write<G: Guest>(_: Uc, offset: u64, size: u32, value: u64, region: *mut Region<G>) {
    // SAFETY: as in `on_code`.
    let (guest, base) = unsafe { (&mut (*(*region).attached).guest, (*region).base) };
    guest.write(base + offset as u32, size, value as u32);
}
