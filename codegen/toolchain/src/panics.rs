//! Locates what can still panic in an image: the lines that call the panic machinery, inlined callers included.

use super::callgraph::{CallGraph, Function};
use super::error::TargetError;
use super::owner;
use addr2line::Context;
use addr2line::gimli::{self, Dwarf, EndianSlice, LittleEndian};
use object::{Object, ObjectSection};
use std::collections::BTreeSet;

/// One entry per panic site, in the order of addresses: the source line, then the lines it was
/// inlined into, outwards. Lines of the core library are omitted.
///
/// The image must have been linked with the panic check turned off (see `firmware/qemu/src/panic.rs`).
///
/// # Errors
/// [`TargetError::MalformedImage`] if the file or its debug information is damaged.
pub fn sites(elf: &[u8]) -> Result<Vec<String>, TargetError> {
    let graph = CallGraph::read(elf)?;
    let machinery = machinery(&graph);
    let debug = debug_info(elf)?;
    let mut found = Vec::new();
    for function in graph.functions.iter().filter(|(address, _)| !machinery.contains(address)).map(|(_, f)| f) {
        let calls = function.calls.iter().filter(|(callee, _)| machinery.contains(callee));
        for place in calls.flat_map(|(_, places)| places) {
            found.push((*place, site(&debug, function, *place)?));
        }
    }
    found.sort();
    let mut seen = BTreeSet::new();
    Ok(found.into_iter().map(|(_, line)| line).filter(|line| seen.insert(line.clone())).collect())
}

/// The panic handler and the functions of the core library that reach it.
fn machinery(graph: &CallGraph) -> BTreeSet<u64> {
    let is_handler = |f: &Function| f.name.ends_with("rust_begin_unwind");
    let mut found: BTreeSet<u64> =
        graph.functions.iter().filter(|(_, f)| is_handler(f)).map(|(&address, _)| address).collect();
    loop {
        let reaches = |f: &Function| f.calls.keys().any(|callee| found.contains(callee));
        let more: Vec<u64> = graph
            .functions
            .iter()
            .filter(|(address, f)| !found.contains(address) && f.name.starts_with("core::") && reaches(f))
            .map(|(&address, _)| address)
            .collect();
        if more.is_empty() {
            return found;
        }
        found.extend(more);
    }
}

/// Line information of an image.
pub(super) type DebugInfo<'a> = Context<EndianSlice<'a, LittleEndian>>;

pub(super) fn debug_info(elf: &[u8]) -> Result<DebugInfo<'_>, TargetError> {
    let file = object::File::parse(elf).map_err(TargetError::malformed)?;
    let section = |id: gimli::SectionId| {
        let data = file.section_by_name(id.name()).map_or(Ok(&[][..]), |section| section.data());
        data.map(|data| EndianSlice::new(data, LittleEndian)).map_err(TargetError::malformed)
    };
    Context::from_dwarf(Dwarf::load(section)?).map_err(TargetError::malformed)
}

/// The source lines of some addresses in a function, without duplicates.
pub(super) fn lines<'a>(
    debug: &DebugInfo<'_>,
    function: &Function,
    places: impl Iterator<Item = &'a u64>,
) -> Result<Vec<String>, TargetError> {
    let found: Result<BTreeSet<String>, TargetError> = places.map(|place| site(debug, function, *place)).collect();
    Ok(found?.into_iter().collect())
}

fn site(debug: &DebugInfo<'_>, function: &Function, place: u64) -> Result<String, TargetError> {
    let mut frames = debug.find_frames(place).skip_all_loads().map_err(TargetError::malformed)?;
    let mut lines = Vec::new();
    while let Some(frame) = frames.next().map_err(TargetError::malformed)? {
        if let Some((file, line)) = frame.location.and_then(|l| Some((l.file?.to_owned(), l.line?)))
            && owner::crate_of_file(&file) != "core"
        {
            lines.push(format!("{file}:{line}"));
        }
    }
    if lines.is_empty() {
        lines.push(format!("{place:#x}"));
    }
    Ok(format!("{} (in {})", lines.join(", inlined at "), function.name))
}
