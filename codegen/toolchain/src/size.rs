//! Memory use of an image: by section, and by the source of the bytes.
//!
//! Code is assigned byte by byte by line information, so inlined code counts for the crate it was written in;
//! constants and variables are assigned by their symbols.

use super::checks;
use super::error::TargetError;
use super::image::RECORDER;
use super::owner::{NO_LINES, crate_of_file};
use super::panics::{self, DebugInfo};
use super::targets::Target;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind};
use serde::Serialize;
use std::collections::BTreeMap;

/// Start of the identity line in every image: where its controller comes from.
pub const IDENTITY_MARK: &str = "specgen-identity: ";
/// Start of the next line, which lists unmeasured parameters; absent if all were measured.
pub const ASSUMED_MARK: &str = "assumed: ";
/// Separator of the names.
pub const ASSUMED_SEPARATOR: &str = ", ";
/// Start of the line that names the target of an image.
const BOARD_MARK: &str = "specgen-board: ";
/// Longest accepted list of assumptions, bytes.
const LONGEST_ASSUMED: usize = 1 << 16;
/// Longest accepted identity, bytes.
const LONGEST_IDENTITY: usize = 512;
/// Constants without a symbol: literals, and constants merged by the compiler.
const UNNAMED: &str = "unnamed constants";

/// Memory use by section and by owner.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Compiler, platform and spec from the identity line; `None` for a foreign image.
    pub identity: Option<String>,
    /// The target named in the image; `None` if it names none, as images for custom boards.
    pub target: Option<&'static str>,
    /// Unmeasured parameters named in the image.
    pub assumed: Vec<String>,
    /// In image order.
    pub sections: Vec<Section>,
    /// Owners, the largest in flash first.
    pub owners: Vec<Owner>,
    /// Variables and their bytes, the largest first.
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
    /// Whether it takes flash: everything with content.
    pub flash: bool,
    /// Whether it takes RAM: everything writable.
    pub ram: bool,
}

/// Bytes from one source.
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
    pub fn flash(&self) -> u64 {
        self.code + self.constants
    }
}

impl Size {
    /// Bytes of flash.
    pub fn flash(&self) -> u64 {
        self.sections.iter().filter(|section| section.flash).map(|section| section.bytes).sum()
    }

    /// Bytes of statically allocated RAM, without the recorder.
    pub fn ram(&self) -> u64 {
        self.sections
            .iter()
            .filter(|section| section.ram && section.name != RECORDER)
            .map(|section| section.bytes)
            .sum()
    }

    /// Bytes of the recorder's memory.
    pub fn recorder(&self) -> u64 {
        self.sections.iter().filter(|section| section.name == RECORDER).map(|section| section.bytes).sum()
    }
}

/// Measures an image.
///
/// # Errors
/// [`TargetError::MalformedImage`] if it is not an ELF file or its tables are damaged.
pub fn size(elf: &[u8]) -> Result<Size, TargetError> {
    let file = object::File::parse(elf).map_err(TargetError::malformed)?;
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
        let name = section.name().map_err(TargetError::malformed)?.to_owned();
        sections.push(Section { name, address: section.address(), bytes: section.size(), flash, ram });
        if !flash {
            continue;
        }
        let end = section.address() + section.size();
        if section.kind() == SectionKind::Text {
            code(&debug, section.address(), end, &mut owners)?;
            continue;
        }
        let bytes = section.data().map_err(TargetError::malformed)?;
        found = found.or_else(|| find_identity(bytes));
        target = target.or_else(|| find_target(bytes));
        constants(&file, section.address(), end, &mut owners);
    }
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Data && symbol.size() > 0) {
        let held = |section: &&Section| (section.address..section.address + section.bytes).contains(&symbol.address());
        if sections.iter().find(held).is_some_and(|section| section.ram) {
            let name = demangled(symbol.name().map_err(TargetError::malformed)?);
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

/// Whether the image has a tick function that [`checks::check`] knows.
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

/// Assigns the code between two addresses by source file; a line extends to the next one, including literals after it.
fn code(debug: &DebugInfo<'_>, start: u64, end: u64, owners: &mut BTreeMap<String, Owner>) -> Result<(), TargetError> {
    let lines =
        debug.find_location_range(start, end).map_err(TargetError::malformed)?.map(|(address, bytes, location)| {
            (address, bytes, location.file.map_or_else(|| NO_LINES.to_owned(), crate_of_file))
        });
    assign(start, end, lines, NO_LINES, |name, bytes| owner(owners, name).code += bytes);
    Ok(())
}

/// Assigns the constants between two addresses by the crate of their symbols.
fn constants(file: &object::File<'_>, start: u64, end: u64, owners: &mut BTreeMap<String, Owner>) {
    let mut symbols: Vec<(u64, u64, String)> = file
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Data && (start..end).contains(&symbol.address()))
        .filter_map(|symbol| Some((symbol.address(), symbol.size(), demangled(symbol.name().ok()?))))
        .collect();
    symbols.sort();
    let symbols = symbols.into_iter().map(|(address, bytes, name)| (address, bytes, crate_of_symbol(&name).to_owned()));
    assign(start, end, symbols, UNNAMED, |name, bytes| owner(owners, name).constants += bytes);
}

/// Assigns the bytes between two addresses to owners. `rows` are address, bytes and owner, sorted by address; an overlapping row
/// counts from the end of the last one. Bytes in no row belong to `others`.
fn assign(
    start: u64,
    end: u64,
    rows: impl Iterator<Item = (u64, u64, String)>,
    others: &str,
    mut add: impl FnMut(&str, u64),
) {
    let mut known = start;
    for (address, bytes, name) in rows {
        let (from, to) = (address.max(known), (address + bytes).min(end));
        if to > from {
            add(others, from - known);
            add(&name, to - from);
            known = to;
        }
    }
    add(others, end - known);
}

/// `controller` for `controller::hysteresis::EVERETT_0`, also if it is part of an implementation: `<controller::…`.
fn crate_of_symbol(name: &str) -> &str {
    let name = name.trim_start_matches(['<', '&']);
    match name.split_once("::") {
        Some(("specgen_law", _)) => "law",
        Some(("specgen_runtime", _)) => "runtime",
        Some((krate, _)) if !krate.is_empty() && !krate.contains(' ') => krate,
        _ => UNNAMED,
    }
}

/// The identity in the bytes of a section, and the assumptions on the next line.
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

/// The bytes after a mark.
fn behind<'a>(bytes: &'a [u8], mark: &str) -> Option<&'a [u8]> {
    let start = bytes.windows(mark.len()).position(|window| window == mark.as_bytes())?;
    bytes.get(start + mark.len()..)
}

/// The first line of `bytes`, if it is text.
fn line(bytes: &[u8], longest: usize) -> Option<String> {
    let line: Vec<u8> = bytes.iter().take(longest).take_while(|byte| **byte != b'\n').copied().collect();
    String::from_utf8(line).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_symbols_are_assigned_to_crates() {
        for (path, expected) in [
            ("/home/me/out/controller/src/gauges.rs", "controller"),
            ("controller/src/setpoint/x.rs", "controller"),
            ("/x/registry/src/index-0123/cortex-m-rt-0.7.7/src/lib.rs", "cortex-m-rt"),
            ("/x/registry/src/index-0123/embassy-stm32-0.6.0/src/spi/mod.rs", "embassy-stm32"),
            ("/usr/src/rustc-1.96/library/core/src/num/f64.rs", "core"),
            ("src/main.rs", "firmware"),
            ("qemu/src/main.rs", "qemu"),
            ("asm.S", NO_LINES),
            // Independent of where a user builds.
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
    fn an_identity_is_found_only_after_its_mark() {
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
