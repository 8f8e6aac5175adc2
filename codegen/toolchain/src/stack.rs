//! Static bound of the stack that one call of `controller::step` can use.
//!
//! Sum of the frames along the deepest path of the call graph. Frame sizes come from the compiler's `.stack_sizes`;
//! for assembly and precompiled libraries, which have none, from the instructions.
//! The bound holds only if [`StackBound::is_complete`]; anything that invalidates it is listed.
//! Interrupts need 8 more words each, 26 with the FPU.

use super::callgraph::CallGraph;
use super::error::TargetError;
use object::{Object, ObjectSection, ObjectSymbol};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The function of one step: `firmware/qemu/src/main.rs` wraps `controller::step` in it.
pub const STEP_SYMBOL: &str = "specgen_step";

/// A stack bound and what could invalidate it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StackBound {
    /// Bytes along the deepest path, the root's own frame included.
    pub bytes: u64,
    /// That path: function and its frame, bytes, from the root down.
    pub path: Vec<(String, u64)>,
    /// Bytes of reachable code, literals included.
    pub code_bytes: u64,
    /// Cycles of functions that call themselves, directly or indirectly, as names.
    pub recursion: Vec<Vec<String>>,
    /// Functions that call or jump through a register.
    pub indirect: Vec<String>,
    /// Functions that move the stack pointer by an amount known only at run time; their frames count as 0.
    pub unsized_functions: Vec<String>,
    /// Functions that branch to an address that is not a function.
    pub strays: Vec<String>,
}

impl StackBound {
    /// True if nothing invalidates the bound: no run can use more than [`StackBound::bytes`].
    pub fn is_complete(&self) -> bool {
        self.recursion.is_empty()
            && self.indirect.is_empty()
            && self.unsized_functions.is_empty()
            && self.strays.is_empty()
    }
}

/// The bound for everything reachable from `root`, a symbol of the image or a demangled name.
///
/// # Errors
/// [`TargetError::MalformedImage`] if the file is damaged or has no such function.
pub fn bound(elf: &[u8], root: &str) -> Result<StackBound, TargetError> {
    let graph = CallGraph::read(elf)?;
    let start = start_of(&graph, root)?;
    Ok(bound_in(&graph, start))
}

/// Start address of the function.
pub(super) fn start_of(graph: &CallGraph, root: &str) -> Result<u64, TargetError> {
    let demangled = || graph.functions.iter().find(|(_, function)| function.name == root).map(|(address, _)| *address);
    graph.symbols.get(root).copied().or_else(demangled).ok_or_else(|| TargetError::MalformedImage {
        text: format!("it has no function `{root}`; it may be stripped or built by another specgen"),
    })
}

/// The bound for everything reachable from this address.
pub(super) fn bound_in(graph: &CallGraph, start: u64) -> StackBound {
    let mut walk = Walk { graph, deepest: BTreeMap::new(), open: Vec::new(), cycles: BTreeSet::new() };
    let bytes = walk.visit(start);
    let cycles = walk.cycles;
    let deepest = walk.deepest;

    let name = |address: &u64| graph.functions.get(address).map_or_else(String::new, |f| f.name.clone());
    let reached = || deepest.keys().filter_map(|address| graph.functions.get(address));
    let mut path = Vec::new();
    let mut next = Some(start);
    while let Some(address) = next {
        let frame = graph.functions.get(&address).and_then(|f| f.frame).unwrap_or(0);
        path.push((name(&address), frame));
        next = deepest.get(&address).and_then(|&(_, callee)| callee);
    }
    let which = |wanted: fn(&super::callgraph::Function) -> bool| {
        reached().filter(|f| wanted(f)).map(|f| f.name.clone()).collect::<Vec<_>>()
    };
    StackBound {
        bytes,
        path,
        code_bytes: reached().map(|f| f.size).sum(),
        recursion: cycles.iter().map(|cycle| cycle.iter().map(name).collect()).collect(),
        indirect: which(|f| !f.indirect.is_empty()),
        unsized_functions: which(|f| f.frame.is_none()),
        strays: which(|f| !f.strays.is_empty()),
    }
}

/// An exception frame with FPU registers and alignment.
const EXCEPTION: u64 = 26 * 4 + 4;
/// Interrupts of a board's program (`firmware/stm32/program.rs`): the tick has the highest priority, the link handler a lower one.
const TICK: &str = "TIM2";
const BACKGROUND: &str = "CEC";

/// Stack of a board's whole program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Reserve {
    /// Bytes reserved for the stack in the memory map.
    pub reserved: u64,
    /// Bytes used by initialisation, which runs alone.
    pub startup: u64,
    /// Bytes used after it: the program, the link handler, a link interrupt and the tick, nested.
    pub running: u64,
}

impl Reserve {
    /// The stack reserve of an image; `None` if it has no memory map of a board.
    ///
    /// # Errors
    /// [`TargetError::MalformedImage`] if the file is damaged.
    pub fn of(elf: &[u8]) -> Result<Option<Self>, TargetError> {
        let file = object::File::parse(elf).map_err(TargetError::malformed)?;
        let address =
            |name: &str| file.symbols().find(|symbol| symbol.name() == Ok(name)).map(|symbol| symbol.address());
        let (Some(top), Some(end)) = (address("_stack_start"), address("_stack_end")) else { return Ok(None) };
        let graph = CallGraph::read(elf)?;
        let depth = |address: u64| bound_in(&graph, address).bytes;
        let startup = bound_in(&graph, start_of(&graph, "main")?);
        let [tick, background] = [start_of(&graph, TICK)?, start_of(&graph, BACKGROUND)?];
        let vectors = file
            .section_by_name(".vector_table")
            .map(|section| section.data())
            .transpose()
            .map_err(TargetError::malformed)?;
        let handlers = vectors.unwrap_or_default().as_chunks().0.iter().skip(SYSTEM);
        let others = handlers.map(|word| u64::from(u32::from_le_bytes(*word) & !1));
        let others = others.filter(|address| ![tick, background].contains(address));
        let link = others.map(depth).max().unwrap_or_default();
        let idle = startup.path.first().map_or(0, |(_, frame)| *frame);
        Ok(Some(Self {
            reserved: top.saturating_sub(end),
            startup: startup.bytes,
            running: idle + depth(background) + link + depth(tick) + 3 * EXCEPTION,
        }))
    }

    /// The larger of `startup` and `running`.
    pub fn needed(&self) -> u64 {
        self.startup.max(self.running)
    }
}

/// Number of core vectors before those of interrupts.
const SYSTEM: usize = 16;

/// Depth-first walk of the call graph.
struct Walk<'a> {
    graph: &'a CallGraph,
    /// For every finished function: bytes from it down, and the callee that needs them.
    deepest: BTreeMap<u64, (u64, Option<u64>)>,
    /// Functions on the path from the root to the current one.
    open: Vec<u64>,
    /// Cycles found, each rotated to start at its lowest address, so that each is reported once.
    cycles: BTreeSet<Vec<u64>>,
}

impl Walk<'_> {
    /// Bytes from this function down. The recursion is at most as deep as the image has functions.
    fn visit(&mut self, address: u64) -> u64 {
        if let Some(&(bytes, _)) = self.deepest.get(&address) {
            return bytes;
        }
        if let Some(position) = self.open.iter().position(|&open| open == address) {
            let mut cycle = self.open[position..].to_vec();
            let lowest = cycle.iter().enumerate().min_by_key(|&(_, address)| address).map_or(0, |(i, _)| i);
            cycle.rotate_left(lowest);
            self.cycles.insert(cycle);
            return 0;
        }
        let Some(function) = self.graph.functions.get(&address) else {
            return 0;
        };
        self.open.push(address);
        let mut below = (0, None);
        for &callee in function.calls.keys() {
            let bytes = self.visit(callee);
            // A callee that needs no stack still belongs on the path, unless it is still open.
            let closed = self.deepest.contains_key(&callee);
            if closed && (bytes > below.0 || below.1.is_none()) {
                below = (bytes, Some(callee));
            }
        }
        self.open.pop();
        let bytes = function.frame.unwrap_or(0) + below.0;
        self.deepest.insert(address, (bytes, below.1));
        bytes
    }
}
