//! Who calls whom in a linked Thumb-2 image, read from its instructions.
//!
//! The branches themselves are decoded (ARM DDI 0403, A7.7), so that neither relocations nor a disassembler
//! is needed; mapping symbols tell code from data. What cannot be followed is kept, never dropped.

use super::error::TargetError;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// A function of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Demangled; the first in alphabetical order if several symbols stand here.
    pub name: String,
    /// Bytes of code and literals.
    pub size: u64,
    /// Bytes of stack that it takes for itself, as the compiler says; `None` for assembly.
    pub frame: Option<u64>,
    /// Addresses of the functions that it calls or ends in.
    pub calls: BTreeSet<u64>,
    /// Addresses of calls and jumps through a register.
    pub indirect: Vec<u64>,
    /// Branch targets outside of it that are no function's start.
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
        let file = object::File::parse(elf).map_err(malformed)?;
        let frames = stack_sizes(&file)?;
        let mut names: BTreeMap<u64, (BTreeSet<String>, u64)> = BTreeMap::new();
        let mut marks: BTreeMap<u64, bool> = BTreeMap::new();
        let mut symbols = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().map_err(malformed)?;
            if let Some(is_code) = mapping(name) {
                marks.insert(symbol.address(), is_code);
            } else if symbol.kind() == SymbolKind::Text
                && symbol.is_definition()
                && !name.is_empty()
            {
                let address = symbol.address() & !1;
                symbols.insert(name.to_owned(), address);
                let entry = names.entry(address).or_default();
                entry
                    .0
                    .insert(format!("{:#}", rustc_demangle::demangle(name)));
                entry.1 = entry.1.max(symbol.size());
            }
        }
        let starts: Vec<u64> = names.keys().copied().collect();
        let mut functions = BTreeMap::new();
        for (&address, (aliases, declared)) in &names {
            let Some((section_end, code)) = section_at(&file, address)? else {
                continue;
            };
            // Assembly may declare no size: then it reaches to the next function.
            let next = starts
                .iter()
                .find(|&&start| start > address)
                .copied()
                .unwrap_or(section_end);
            let size = if *declared > 0 {
                *declared
            } else {
                next.min(section_end) - address
            };
            let length = usize::try_from(size).unwrap_or(usize::MAX).min(code.len());
            let mut function = Function {
                name: aliases.first().cloned().unwrap_or_default(),
                size,
                frame: frames.get(&address).copied(),
                calls: BTreeSet::new(),
                indirect: Vec::new(),
                strays: Vec::new(),
            };
            for (place, branch) in branches(address, &code[..length], &marks) {
                function.add(place, branch, address..address + size, &names);
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
                self.calls.insert(target);
            }
            Branch::Call(target) | Branch::Jump(target) => self.strays.push(target),
        }
    }
}

fn malformed(error: object::Error) -> TargetError {
    TargetError::MalformedImage {
        text: error.to_string(),
    }
}

/// `$t`, `$d` and their numbered forms: code and data begin here (ARM IHI 0044, 5.5.5).
fn mapping(name: &str) -> Option<bool> {
    match name.split('.').next() {
        Some("$t" | "$a") => Some(true),
        Some("$d") => Some(false),
        _ => None,
    }
}

/// End of the section that holds the address, and its bytes from there on.
fn section_at<'a>(
    file: &object::File<'a>,
    address: u64,
) -> Result<Option<(u64, &'a [u8])>, TargetError> {
    for section in file.sections() {
        let end = section.address() + section.size();
        if section.kind() == object::SectionKind::Text
            && (section.address()..end).contains(&address)
        {
            let data = section.data().map_err(malformed)?;
            // The offset is below the section's size; an image that lies about its data gives no bytes.
            let offset = usize::try_from(address - section.address()).unwrap_or(usize::MAX);
            return Ok(Some((end, data.get(offset..).unwrap_or_default())));
        }
    }
    Ok(None)
}

/// `.stack_sizes`: pairs of a 32-bit address and the frame as ULEB128.
fn stack_sizes(file: &object::File<'_>) -> Result<BTreeMap<u64, u64>, TargetError> {
    let mut sizes = BTreeMap::new();
    for section in file
        .sections()
        .filter(|section| section.name() == Ok(".stack_sizes"))
    {
        let mut data = section.data().map_err(malformed)?;
        while let Some((address, rest)) = data.split_first_chunk::<4>() {
            let (size, rest) = uleb128(rest).ok_or_else(|| TargetError::MalformedImage {
                text: "section .stack_sizes ends within an entry".into(),
            })?;
            sizes.insert(u64::from(u32::from_le_bytes(*address) & !1), size);
            data = rest;
        }
    }
    Ok(sizes)
}

fn uleb128(data: &[u8]) -> Option<(u64, &[u8])> {
    let mut value = 0;
    for (i, byte) in data.iter().enumerate().take(9) {
        value |= u64::from(byte & 0x7f) << (7 * i);
        if byte & 0x80 == 0 {
            return Some((value, &data[i + 1..]));
        }
    }
    None
}

/// A way out of the straight line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Branch {
    Call(u64),
    Jump(u64),
    Register,
}

/// Branches of the code that stands at `address`, each with its own address.
fn branches(address: u64, code: &[u8], marks: &BTreeMap<u64, bool>) -> Vec<(u64, Branch)> {
    let half = |at: usize| {
        code.get(at..at + 2)
            .map(|b| u16::from_le_bytes([b[0], b[1]]))
    };
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(first) = half(at) {
        let place = address + at as u64;
        // Code unless the last mark at or before here says data.
        if marks
            .range(..=place)
            .next_back()
            .is_some_and(|(_, &is_code)| !is_code)
        {
            at += 2;
            continue;
        }
        if first >> 11 < 0b11101 {
            found.extend(narrow(place, first).map(|branch| (place, branch)));
            at += 2;
        } else {
            found.extend(
                half(at + 2)
                    .and_then(|second| wide(place, first, second))
                    .map(|branch| (place, branch)),
            );
            at += 4;
        }
    }
    found
}

/// A 16-bit instruction.
fn narrow(place: u64, op: u16) -> Option<Branch> {
    const LINK_REGISTER: u16 = 14;
    let register = (op >> 3) & 0xf;
    match op {
        // BLX rM; BX rM except BX LR, a return; MOV PC, rM.
        _ if op & 0xff87 == 0x4780 => Some(Branch::Register),
        _ if op & 0xff87 == 0x4700 && register != LINK_REGISTER => Some(Branch::Register),
        _ if op & 0xff87 == 0x4687 && register != LINK_REGISTER => Some(Branch::Register),
        // B<cond>, conditions 14 and 15 are UDF and SVC.
        _ if op >> 12 == 0b1101 && (op >> 8) & 0xf < 14 => {
            Some(Branch::Jump(target(place, u32::from(op & 0xff) << 1, 9)))
        }
        _ if op >> 11 == 0b11100 => {
            Some(Branch::Jump(target(place, u32::from(op & 0x7ff) << 1, 12)))
        }
        _ => None,
    }
}

/// A 32-bit instruction.
fn wide(place: u64, first: u16, second: u16) -> Option<Branch> {
    let (high, low) = (u32::from(first), u32::from(second));
    if first >> 11 == 0b11110 && second >> 15 == 1 {
        let (sign, j1, j2) = ((high >> 10) & 1, (low >> 13) & 1, (low >> 11) & 1);
        let far = (sign << 24)
            | ((j1 ^ sign ^ 1) << 23)
            | ((j2 ^ sign ^ 1) << 22)
            | ((high & 0x3ff) << 12)
            | ((low & 0x7ff) << 1);
        let near =
            (sign << 20) | (j2 << 19) | (j1 << 18) | ((high & 0x3f) << 12) | ((low & 0x7ff) << 1);
        return match second & 0x5000 {
            // BL, and BLX to ARM code, whose target is a multiple of four.
            0x5000 => Some(Branch::Call(target(place, far, 25))),
            0x4000 => Some(Branch::Call(target(place, far, 25) & !3)),
            0x1000 => Some(Branch::Jump(target(place, far, 25))),
            _ if (first >> 6) & 0xf < 14 => Some(Branch::Jump(target(place, near, 21))),
            _ => None,
        };
    }
    // LDR PC, [...] except from the stack, which is a return.
    let loads_pc = first & 0xff70 == 0xf850 && second >> 12 == 15;
    (loads_pc && first & 0xf != 13).then_some(Branch::Register)
}

/// Target of a branch whose offset has so many bits; the program counter reads as four bytes ahead.
fn target(place: u64, offset: u32, bits: u32) -> u64 {
    let shift = 32 - bits;
    let offset = (offset << shift).cast_signed() >> shift;
    place.wrapping_add(4).wrapping_add_signed(i64::from(offset))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodings as GNU `as` prints them for code at 0x1000.
    #[test]
    fn branches_are_decoded() {
        let decode = |bytes: &[u8]| branches(0x1000, bytes, &BTreeMap::new());
        // bl 0x1000 + 4 - 8 (itself minus four): f7ff fffc
        assert_eq!(
            decode(&[0xff, 0xf7, 0xfc, 0xff]),
            [(0x1000, Branch::Call(0x0ffc))]
        );
        // b.w .+0x1000: f000 bffe
        assert_eq!(
            decode(&[0x00, 0xf0, 0xfe, 0xbf]),
            [(0x1000, Branch::Jump(0x2000))]
        );
        // beq.w .+0x104: f000 8080
        assert_eq!(
            decode(&[0x00, 0xf0, 0x80, 0x80]),
            [(0x1000, Branch::Jump(0x1104))]
        );
        // b . : e7fe; beq . : d0fe
        assert_eq!(decode(&[0xfe, 0xe7]), [(0x1000, Branch::Jump(0x1000))]);
        assert_eq!(decode(&[0xfe, 0xd0]), [(0x1000, Branch::Jump(0x1000))]);
        // blx r3; bx r2; bx lr; ldr pc, [sp], #4; ldr.w pc, [r0]
        assert_eq!(decode(&[0x98, 0x47]), [(0x1000, Branch::Register)]);
        assert_eq!(decode(&[0x10, 0x47]), [(0x1000, Branch::Register)]);
        assert_eq!(decode(&[0x70, 0x47]), []);
        assert_eq!(decode(&[0x5d, 0xf8, 0x04, 0xfb]), []);
        assert_eq!(
            decode(&[0xd0, 0xf8, 0x00, 0xf0]),
            [(0x1000, Branch::Register)]
        );
    }

    #[test]
    fn data_between_code_is_not_decoded() {
        let marks = BTreeMap::from([(0x1000, true), (0x1002, false), (0x1004, true)]);
        let code = [0x98, 0x47, 0x98, 0x47, 0x98, 0x47];
        assert_eq!(
            branches(0x1000, &code, &marks),
            [(0x1000, Branch::Register), (0x1004, Branch::Register)]
        );
    }

    #[test]
    fn uleb128_reads_several_bytes_and_refuses_a_cut_one() {
        assert_eq!(uleb128(&[0xe5, 0x8e, 0x26, 7]), Some((624_485, &[7][..])));
        assert_eq!(uleb128(&[0x80]), None);
    }
}
