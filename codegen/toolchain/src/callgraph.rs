//! Call graph of a linked Thumb-2 image, read from its instructions.
//!
//! Branches are decoded directly, so neither relocations nor a disassembler are needed; mapping
//! symbols distinguish code from data. Unresolvable branches are recorded, never dropped.

use super::error::TargetError;
use super::thumb::{self, Branch};
use addr2line::gimli::{EndianSlice, LittleEndian, leb128};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// A function of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Demangled; the first in alphabetical order if several symbols share the address.
    pub name: String,
    /// Bytes of code and literals.
    pub size: u64,
    /// Bytes of its own stack frame: from the compiler, else from its instructions, else unknown.
    pub frame: Option<u64>,
    /// Whether [`Function::frame`] comes from the compiler.
    pub from_compiler: bool,
    /// Frame size from the instructions alone.
    pub pushed: Option<u64>,
    /// Addresses of called functions, tail calls included, each with the addresses of the calls.
    pub calls: BTreeMap<u64, Vec<u64>>,
    /// Addresses of calls and jumps through a register.
    pub indirect: Vec<u64>,
    /// Branch targets outside the function that are not the start of a function.
    pub strays: Vec<u64>,
}

/// All functions by address.
#[derive(Debug, Clone, Default)]
pub struct CallGraph {
    /// By address, without the Thumb bit.
    pub functions: BTreeMap<u64, Function>,
    /// Address by symbol name, mangled.
    pub symbols: BTreeMap<String, u64>,
}

impl CallGraph {
    /// Reads an image.
    ///
    /// # Errors
    /// [`TargetError::MalformedImage`] if it is no ELF file or its tables are damaged.
    pub fn read(elf: &[u8]) -> Result<Self, TargetError> {
        let file = object::File::parse(elf).map_err(TargetError::malformed)?;
        let frames = stack_sizes(&file)?;
        let mut names: BTreeMap<u64, (BTreeSet<String>, u64)> = BTreeMap::new();
        let mut marks: BTreeMap<u64, bool> = BTreeMap::new();
        let mut symbols = BTreeMap::new();
        let mut thunks = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().map_err(TargetError::malformed)?;
            if let Some(is_code) = mapping(name) {
                marks.insert(symbol.address(), is_code);
            } else if symbol.kind() == SymbolKind::Text && symbol.is_definition() && !name.is_empty() {
                let address = symbol.address() & !1;
                if let Some(target) = name.strip_prefix(THUNK) {
                    thunks.insert(address, target.to_owned());
                }
                symbols.insert(name.to_owned(), address);
                let entry = names.entry(address).or_default();
                entry.0.insert(format!("{:#}", rustc_demangle::demangle(name)));
                entry.1 = entry.1.max(symbol.size());
            }
        }
        let starts: Vec<u64> = names.keys().copied().collect();
        let mut functions = BTreeMap::new();
        for (&address, (aliases, declared)) in &names {
            let Some((section_end, code)) = section_at(&file, address)? else {
                continue;
            };
            // Assembly may declare no size: then the function extends to the next one.
            let next = starts.iter().find(|&&start| start > address).copied().unwrap_or(section_end);
            let size = if *declared > 0 { *declared } else { next.min(section_end) - address };
            let length = usize::try_from(size).unwrap_or(usize::MAX).min(code.len());
            let instructions = thumb::decode(address, &code[..length], &marks);
            let pushed = thumb::frame(&instructions);
            let mut function = Function {
                name: aliases.first().cloned().unwrap_or_default(),
                size,
                frame: frames.get(&address).copied().or(pushed),
                from_compiler: frames.contains_key(&address),
                pushed,
                calls: BTreeMap::new(),
                indirect: Vec::new(),
                strays: Vec::new(),
            };
            for instruction in &instructions {
                if let Some(branch) = instruction.branch() {
                    function.add(instruction.place, branch, address..address + size, &names);
                }
            }
            // A thunk jumps through a register to the function in its name.
            if let Some(target) = thunks.get(&address).and_then(|name| symbols.get(name)) {
                function.calls = BTreeMap::from([(*target, std::mem::take(&mut function.indirect))]);
            }
            functions.insert(address, function);
        }
        Ok(Self { functions, symbols })
    }
}

impl Function {
    fn add(
        &mut self,
        place: u64,
        branch: Branch,
        own: std::ops::Range<u64>,
        names: &BTreeMap<u64, (BTreeSet<String>, u64)>,
    ) {
        match branch {
            Branch::Register => self.indirect.push(place),
            // A jump within the function, its own start included, is a loop.
            Branch::Jump(target) if own.contains(&target) => {}
            Branch::Call(target) | Branch::Jump(target) if names.contains_key(&target) => {
                self.calls.entry(target).or_default().push(place);
            }
            Branch::Call(target) | Branch::Jump(target) => self.strays.push(target),
        }
    }
}

/// Prefix of the linker's thunks: jumps to functions out of branch range, in another memory.
const THUNK: &str = "__Thumbv7ABSLongThunk_";

/// `$t`, `$d` and their numbered forms mark the start of code and data (ARM IHI 0044, 5.5.5).
fn mapping(name: &str) -> Option<bool> {
    match name.split('.').next() {
        Some("$t" | "$a") => Some(true),
        Some("$d") => Some(false),
        _ => None,
    }
}

/// End of the section that contains the address, and its bytes from there on.
fn section_at<'a>(file: &object::File<'a>, address: u64) -> Result<Option<(u64, &'a [u8])>, TargetError> {
    for section in file.sections() {
        let end = section.address() + section.size();
        if section.kind() == object::SectionKind::Text && (section.address()..end).contains(&address) {
            let data = section.data().map_err(TargetError::malformed)?;
            // The offset is below the section's size; if the image lies about its data, the result is empty.
            let offset = usize::try_from(address - section.address()).unwrap_or(usize::MAX);
            return Ok(Some((end, data.get(offset..).unwrap_or_default())));
        }
    }
    Ok(None)
}

/// `.stack_sizes`: pairs of a 32-bit address and the frame as ULEB128.
fn stack_sizes(file: &object::File<'_>) -> Result<BTreeMap<u64, u64>, TargetError> {
    let mut sizes = BTreeMap::new();
    for section in file.sections().filter(|section| section.name() == Ok(".stack_sizes")) {
        let mut data = section.data().map_err(TargetError::malformed)?;
        while let Some((address, rest)) = data.split_first_chunk::<4>() {
            let mut rest = EndianSlice::new(rest, LittleEndian);
            let size = leb128::read::unsigned(&mut rest).map_err(|_| TargetError::MalformedImage {
                text: "section .stack_sizes ends within an entry".into(),
            })?;
            sizes.insert(u64::from(u32::from_le_bytes(*address) & !1), size);
            data = rest.slice();
        }
    }
    Ok(sizes)
}
