//! Who takes the memory of an image: by section, and by the source that the bytes come from.
//!
//! Code is assigned by line information, byte by byte, so that what was inlined counts for whom it was written by;
//! constants and variables by their symbols.

use super::checks;
use super::error::TargetError;
use super::image::RECORDER;
use super::owner::{NO_LINES, crate_of_file};
use super::panics::{self, DebugInfo};
use super::targets::Target;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind};
use serde::Serialize;
use std::collections::BTreeMap;

/// What the line in every image begins with that says where its controller comes from.
pub const IDENTITY_MARK: &str = "specgen-identity: ";
/// What the line behind it begins with, which names what nobody measured; there is none where all is.
pub const ASSUMED_MARK: &str = "assumed: ";
/// What stands between the names.
pub const ASSUMED_SEPARATOR: &str = ", ";
/// What the line begins with by which an image names the target that it is built for.
const BOARD_MARK: &str = "specgen-board: ";
/// Longest such line that is believed, bytes.
const LONGEST_ASSUMED: usize = 1 << 16;
/// Longest identity that is believed, bytes.
const LONGEST_IDENTITY: usize = 512;
/// Constants without a symbol: literals of the compiler, and those that it merged.
const UNNAMED: &str = "unnamed constants";

/// Sections that take memory of the microcontroller, and who takes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Compiler, platform and spec, as the image says; none if it was made by something else.
    pub identity: Option<String>,
    /// The target that it is built for, as the image says; none if it says none, as images for boards of one's own.
    pub target: Option<&'static str>,
    /// What its controller rests on that nobody measured, as the image says.
    pub assumed: Vec<String>,
    /// In the order of the image.
    pub sections: Vec<Section>,
    /// By bytes of flash, the most first.
    pub owners: Vec<Owner>,
    /// Variables by their names, the largest first: bytes.
    pub variables: Vec<(String, u64)>,
}

/// A section.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Section {
    /// Its name.
    pub name: String,
    /// First address.
    pub address: u64,
    /// Bytes.
    pub bytes: u64,
    /// Whether it takes flash: all that has content.
    pub flash: bool,
    /// Whether it takes RAM: all that can be written.
    pub ram: bool,
}

/// What comes from one source.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Owner {
    /// `controller`, `runtime`, a crate, `core`.
    pub name: String,
    /// Bytes of code.
    pub code: u64,
    /// Bytes of constants.
    pub constants: u64,
}

impl Owner {
    /// Bytes of flash.
    #[must_use]
    pub fn flash(&self) -> u64 {
        self.code + self.constants
    }
}

impl Size {
    /// Bytes of flash.
    #[must_use]
    pub fn flash(&self) -> u64 {
        self.sections.iter().filter(|section| section.flash).map(|section| section.bytes).sum()
    }

    /// Bytes of RAM that are taken statically, the memory of a recorder left out.
    #[must_use]
    pub fn ram(&self) -> u64 {
        self.sections
            .iter()
            .filter(|section| section.ram && section.name != RECORDER)
            .map(|section| section.bytes)
            .sum()
    }

    /// Bytes of the memory of a recorder.
    #[must_use]
    pub fn recorder(&self) -> u64 {
        self.sections.iter().filter(|section| section.name == RECORDER).map(|section| section.bytes).sum()
    }
}

/// Measures an image.
///
/// # Errors
/// [`TargetError::MalformedImage`] if it is no ELF file or its tables are damaged.
pub fn size(elf: &[u8]) -> Result<Size, TargetError> {
    let malformed = |error: object::Error| TargetError::MalformedImage { text: error.to_string() };
    let file = object::File::parse(elf).map_err(malformed)?;
    let debug = panics::debug_info(elf)?;
    let mut sections = Vec::new();
    let mut owners: BTreeMap<String, Owner> = BTreeMap::new();
    let mut variables: BTreeMap<String, u64> = BTreeMap::new();
    let (mut found, mut target) = (None, None);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else { continue };
        if sh_flags.0 & object::elf::SHF_ALLOC.0 == 0 || section.size() == 0 {
            continue;
        }
        let ram = sh_flags.0 & object::elf::SHF_WRITE.0 != 0;
        let flash = section.kind() != SectionKind::UninitializedData;
        let name = section.name().map_err(malformed)?.to_owned();
        sections.push(Section { name, address: section.address(), bytes: section.size(), flash, ram });
        if !flash {
            continue;
        }
        let end = section.address() + section.size();
        if section.kind() == SectionKind::Text {
            code(&debug, section.address(), end, &mut owners)?;
            continue;
        }
        let bytes = section.data().map_err(malformed)?;
        found = found.or_else(|| find_identity(bytes));
        target = target.or_else(|| find_target(bytes));
        constants(&file, section.address(), end, &mut owners);
    }
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Data && symbol.size() > 0) {
        let held = |section: &&Section| (section.address..section.address + section.bytes).contains(&symbol.address());
        if sections.iter().find(held).is_some_and(|section| section.ram) {
            let name = demangled(symbol.name().map_err(malformed)?);
            variables.insert(name, symbol.size());
        }
    }
    let mut owners: Vec<Owner> = owners.into_values().filter(|owner| owner.flash() > 0).collect();
    owners.sort_by(|a, b| (b.flash(), &a.name).cmp(&(a.flash(), &b.name)));
    let mut variables: Vec<(String, u64)> = variables.into_iter().collect();
    variables.sort_by(|a, b| (b.1, &a.0).cmp(&(a.1, &b.0)));
    let (identity, assumed) = found.map_or((None, Vec::new()), |(identity, assumed)| (Some(identity), assumed));
    Ok(Size { identity, target, assumed, sections, owners, variables })
}

/// The tick of an image, if it has one that is known: see [`checks::check`].
#[must_use]
pub fn has_tick(elf: &[u8]) -> bool {
    let Ok(file) = object::File::parse(elf) else { return false };
    file.symbols().any(|symbol| symbol.name().is_ok_and(|name| checks::TICKS.contains(&name)))
}

fn demangled(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name))
}

fn owner<'a>(owners: &'a mut BTreeMap<String, Owner>, name: &str) -> &'a mut Owner {
    owners.entry(name.to_owned()).or_insert_with(|| Owner { name: name.to_owned(), ..Owner::default() })
}

/// Code between two addresses by the file of its lines; a line reaches to the next, literals after it included.
fn code(debug: &DebugInfo<'_>, start: u64, end: u64, owners: &mut BTreeMap<String, Owner>) -> Result<(), TargetError> {
    let malformed = |error: addr2line::gimli::Error| TargetError::MalformedImage { text: error.to_string() };
    let mut known = start;
    for (address, bytes, location) in debug.find_location_range(start, end).map_err(malformed)? {
        // Rows come in the order of their addresses; one that reaches back counts from where the last one ended.
        let (from, to) = (address.max(known), (address + bytes).min(end));
        if to <= from {
            continue;
        }
        owner(owners, NO_LINES).code += from - known;
        owner(owners, &location.file.map_or_else(|| NO_LINES.to_owned(), crate_of_file)).code += to - from;
        known = to;
    }
    owner(owners, NO_LINES).code += end - known;
    Ok(())
}

/// Constants between two addresses by the crate of their symbols.
fn constants(file: &object::File<'_>, start: u64, end: u64, owners: &mut BTreeMap<String, Owner>) {
    let mut symbols: Vec<(u64, u64, String)> = file
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Data && (start..end).contains(&symbol.address()))
        .filter_map(|symbol| Some((symbol.address(), symbol.size(), demangled(symbol.name().ok()?))))
        .collect();
    symbols.sort();
    let mut known = start;
    for (address, bytes, name) in symbols {
        let (from, to) = (address.max(known), (address + bytes).min(end));
        if to <= from {
            continue;
        }
        owner(owners, UNNAMED).constants += from - known;
        owner(owners, crate_of_symbol(&name)).constants += to - from;
        known = to;
    }
    owner(owners, UNNAMED).constants += end - known;
}

/// `controller` of `controller::hysteresis::EVERETT_0`, also where it stands for an implementation: `<controller::…`.
fn crate_of_symbol(name: &str) -> &str {
    let name = name.trim_start_matches(['<', '&']);
    match name.split_once("::") {
        Some(("specgen_law", _)) => "law",
        Some(("specgen_runtime", _)) => "runtime",
        Some((krate, _)) if !krate.is_empty() && !krate.contains(' ') => krate,
        _ => UNNAMED,
    }
}

/// The identity line in the bytes of a section, and what the line behind it names as assumed.
fn find_identity(bytes: &[u8]) -> Option<(String, Vec<String>)> {
    let bytes = behind(bytes, IDENTITY_MARK)?;
    let identity = line(bytes, LONGEST_IDENTITY)?;
    let behind = bytes.get(identity.len() + 1..).and_then(|bytes| line(bytes, LONGEST_ASSUMED));
    let list = behind.as_deref().and_then(|line| line.strip_prefix(ASSUMED_MARK)).map(str::to_owned);
    let assumed = list.map_or_else(Vec::new, |list| list.split(ASSUMED_SEPARATOR).map(str::to_owned).collect());
    identity.starts_with("specgen ").then_some((identity, assumed))
}

/// The target in the bytes of a section.
fn find_target(bytes: &[u8]) -> Option<&'static str> {
    Target::named(line(behind(bytes, BOARD_MARK)?, LONGEST_IDENTITY)?.trim_end()).map(|target| target.name)
}

/// What stands behind a mark.
fn behind<'a>(bytes: &'a [u8], mark: &str) -> Option<&'a [u8]> {
    let start = bytes.windows(mark.len()).position(|window| window == mark.as_bytes())?;
    bytes.get(start + mark.len()..)
}

/// The line that `bytes` begin with, if it is text.
fn line(bytes: &[u8], longest: usize) -> Option<String> {
    let line: Vec<u8> = bytes.iter().take(longest).take_while(|byte| **byte != b'\n').copied().collect();
    String::from_utf8(line).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_symbols_are_told_by_their_crate() {
        for (path, expected) in [
            ("/home/me/out/controller/src/gauges.rs", "controller"),
            ("controller/src/setpoint/x.rs", "controller"),
            ("/x/registry/src/index-0123/cortex-m-rt-0.7.7/src/lib.rs", "cortex-m-rt"),
            ("/x/registry/src/index-0123/embassy-stm32-0.6.0/src/spi/mod.rs", "embassy-stm32"),
            ("/usr/src/rustc-1.96/library/core/src/num/f64.rs", "core"),
            ("src/main.rs", "firmware"),
            ("qemu/src/main.rs", "qemu"),
            ("asm.S", NO_LINES),
            // Wherever a user builds.
            ("/home/runtime/controller/out/board/src/cycle.rs", "board"),
            ("/home/me/library/core/controller/src/gauges.rs", "controller"),
            ("/rustc/0123abcd/library/alloc/src/vec/mod.rs", "alloc"),
            ("/home/me/registry/src/work/out/runtime/src/memory.rs", "runtime"),
            ("/home/me/out/law/src/platform/step.rs", "law"),
            ("/home/me/src/controller/out/hal/src/lib.rs", "hal"),
            ("/home/controller/.rustup/toolchains/x/lib/rustlib/src/rust/library/core/src/num/f64.rs", "core"),
            ("/home/runtime/.cargo/registry/src/index-0123/crc-3.4.0/src/lib.rs", "crc"),
        ] {
            assert_eq!(crate_of_file(path), expected, "{path}");
        }
        assert_eq!(crate::owner::source_of("/w/src/o/runtime/src/snapshot/walk.rs").1, "snapshot/walk.rs");
        assert_eq!(crate_of_symbol("controller::hysteresis::EVERETT_0"), "controller");
        assert_eq!(crate_of_symbol("<specgen_runtime::crc::Crc32 as x>::TABLE"), "runtime");
        assert_eq!(crate_of_symbol(".Lanon.1"), UNNAMED);
    }

    #[test]
    fn an_identity_is_found_where_it_lies_and_nowhere_else() {
        let line = format!("\0\0{IDENTITY_MARK}specgen 0.1.0, platform x, f64, spec 00\nrest");
        let identity = "specgen 0.1.0, platform x, f64, spec 00".to_owned();
        assert_eq!(find_identity(line.as_bytes()), Some((identity.clone(), Vec::new())));
        let line = line.replace("rest", &format!("{ASSUMED_MARK}sensor.noise, gauge\nrest"));
        let assumed = ["sensor.noise", "gauge"].map(str::to_owned).to_vec();
        assert_eq!(find_identity(line.as_bytes()), Some((identity, assumed)));
        assert_eq!(find_identity(b"specgen-identity"), None);
        for (line, target) in [("stm32f4\n", Some("stm32f4")), ("qemu     \n", Some("qemu")), ("stm32f407\n", None)] {
            assert_eq!(find_target(format!("\0{BOARD_MARK}{line}").as_bytes()), target, "{line}");
        }
        assert_eq!(find_identity(IDENTITY_MARK.as_bytes()), None);
    }
}
