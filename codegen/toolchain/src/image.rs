//! Memory use of an image, and symbols it must not contain.

use super::error::TargetError;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind};

/// Section of a board's recorder memory: it uses whatever RAM the program leaves free.
pub const RECORDER: &str = ".record";

/// Memory of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Footprint {
    /// Bytes of flash: vectors, code, constants and the initial values of variables.
    pub flash: u64,
    /// Of these, code and its literals.
    pub code: u64,
    /// Of these, constants: mostly the tables of the controller.
    pub constants: u64,
    /// Bytes of statically allocated RAM, without the recorder. The state and the buffers of the replay are
    /// on the stack.
    pub ram: u64,
    /// Bytes of the recorder's memory.
    pub recorder: u64,
    /// Symbols of the panic machinery, demangled; empty in an image that cannot panic.
    pub panic_symbols: Vec<String>,
    /// Symbols of an allocator, demangled; empty in an image that does not allocate.
    pub allocator_symbols: Vec<String>,
}

/// Measures an image.
///
/// # Errors
/// [`TargetError::MalformedImage`] if it is not an ELF file or its tables are damaged.
pub fn footprint(elf: &[u8]) -> Result<Footprint, TargetError> {
    let file = object::File::parse(elf).map_err(TargetError::malformed)?;
    let mut result = Footprint {
        flash: 0,
        code: 0,
        constants: 0,
        ram: 0,
        recorder: 0,
        panic_symbols: Vec::new(),
        allocator_symbols: Vec::new(),
    };
    for section in file.sections().filter(|section| is_loaded(section.flags())) {
        match section.kind() {
            SectionKind::Text => result.code += section.size(),
            SectionKind::UninitializedData if section.name() == Ok(RECORDER) => result.recorder += section.size(),
            SectionKind::UninitializedData => result.ram += section.size(),
            // Writable: initial values are copied from flash at startup.
            _ if is_writable(section.flags()) => {
                result.ram += section.size();
                result.flash += section.size();
            }
            _ => result.constants += section.size(),
        }
    }
    result.flash += result.code + result.constants;
    for symbol in file.symbols() {
        let mangled = symbol.name().map_err(TargetError::malformed)?;
        let name = format!("{:#}", rustc_demangle::demangle(mangled));
        if is_panic(&name) {
            result.panic_symbols.push(name);
        } else if is_allocator(&name) {
            result.allocator_symbols.push(name);
        }
    }
    result.panic_symbols.sort();
    result.allocator_symbols.sort();
    Ok(result)
}

fn is_loaded(flags: SectionFlags) -> bool {
    matches!(flags, SectionFlags::Elf { sh_flags, .. } if sh_flags.0 & object::elf::SHF_ALLOC.0 != 0)
}

fn is_writable(flags: SectionFlags) -> bool {
    matches!(flags, SectionFlags::Elf { sh_flags, .. } if sh_flags.0 & object::elf::SHF_WRITE.0 != 0)
}

pub(super) fn is_panic(name: &str) -> bool {
    name.contains("panicking") || name.contains("panic_path_remains") || name.contains("begin_unwind")
}

pub(super) fn is_allocator(name: &str) -> bool {
    ["__rust_alloc", "__rust_realloc", "__rg_alloc", "__rdl_alloc", "__rustc::__rust_alloc"]
        .iter()
        .any(|start| name.starts_with(start))
        || name.starts_with("alloc::")
        || matches!(name, "malloc" | "calloc" | "realloc" | "free")
}

/// Functions that a shared library exports, sorted.
///
/// # Errors
/// [`TargetError::MalformedImage`] if it is not an ELF file or its tables are damaged.
pub fn exported(elf: &[u8]) -> Result<Vec<String>, TargetError> {
    let file = object::File::parse(elf).map_err(TargetError::malformed)?;
    let mut names = Vec::new();
    for symbol in file.dynamic_symbols().filter(|symbol| symbol.is_definition()) {
        names.push(symbol.name().map_err(TargetError::malformed)?.to_owned());
    }
    names.sort();
    Ok(names)
}
