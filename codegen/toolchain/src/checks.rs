//! What the tick of an image must not do: panic, allocate, call through a register, recurse, or compute `f64` in software.
//!
//! Checks everything that the tick can reach ([`CallGraph`](super::callgraph)). A finding names the function and, if the image has line
//! information, the lines that call it.

use super::callgraph::{CallGraph, Function};
use super::error::TargetError;
use super::panics::{self, DebugInfo};
use super::{image, stack};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Names of the tick function on the different targets.
pub const TICKS: [&str; 3] = ["specgen_tick", "specgen_supervise", stack::STEP_SYMBOL];
/// Number of places that a finding lists.
const NAMED: usize = 4;

/// Optional rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// The core computes `f64` in software, so a tick must not use it.
    pub single: bool,
    /// No panic and no allocator anywhere in the image, reachable or not.
    pub whole_image: bool,
}

/// A violated rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// A panic is reachable, or present in the image.
    Panic,
    /// An allocator is reachable, or present in the image.
    Allocation,
    /// A call or jump through a register, whose target is unknown.
    IndirectCall,
    /// `f64` in software.
    SoftDouble,
    /// Recursion, or a stack frame whose size is only known at run time: no stack bound.
    Unbounded,
    /// A tick used more stack than the static bound: the bound is wrong.
    StackBound,
}

/// A violation and its place.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// The rule.
    pub rule: Rule,
    /// Function, call path, source lines.
    pub text: String,
}

/// Result of checking the tick of an image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TickChecks {
    /// Name of the tick function.
    pub tick: String,
    /// Number of reachable functions, itself included.
    pub functions: usize,
    /// Bytes of their code.
    pub code: u64,
    /// Static stack bound, bytes; `None` if there is none.
    pub stack: Option<u64>,
    /// The deepest path, each function with its frame, bytes.
    pub path: Vec<(String, u64)>,
    /// Violations; empty for an image that may be flashed.
    pub faults: Vec<Fault>,
}

/// Checks the tick of an image: `tick`, or the first of [`TICKS`] that exists.
///
/// # Errors
/// [`TargetError::MalformedImage`] if the file is damaged or has no such function.
pub fn check(elf: &[u8], tick: Option<&str>, rules: Rules) -> Result<TickChecks, TargetError> {
    let graph = CallGraph::read(elf)?;
    let debug = panics::debug_info(elf)?;
    let named = tick.or_else(|| TICKS.into_iter().find(|name| graph.symbols.contains_key(*name)));
    let root = named.ok_or_else(|| TargetError::MalformedImage {
        text: format!("none of the tick functions {} exists", TICKS.join(", ")),
    })?;
    let start = stack::start_of(&graph, root)?;
    let bound = stack::bound_in(&graph, start);
    let reach = Reach::from(&graph, start);
    let mut faults = Vec::new();
    let mut add = |rule: Rule, text: String| faults.push(Fault { rule, text });
    for (address, function) in reach.functions() {
        let enters = |is: fn(&str) -> bool| is(&function.name) && reach.callers(address).any(|(_, f)| !is(&f.name));
        if enters(image::is_panic) {
            add(Rule::Panic, reach.words(&debug, "can panic", address)?);
        }
        if enters(image::is_allocator) {
            add(Rule::Allocation, reach.words(&debug, "allocates", address)?);
        }
        if rules.single && enters(is_soft_double) {
            add(Rule::SoftDouble, reach.words(&debug, "computes f64 in software", address)?);
        }
        if !function.indirect.is_empty() {
            let lines = panics::lines(&debug, function, function.indirect.iter().take(NAMED))?;
            add(Rule::IndirectCall, format!("{} calls through a register: {}", function.name, lines.join("; ")));
        }
    }
    for cycle in &bound.recursion {
        add(Rule::Unbounded, format!("{} form a recursion", cycle.join(" and ")));
    }
    for name in &bound.unsized_functions {
        add(Rule::Unbounded, format!("{name} moves the stack pointer by an amount known only at run time"));
    }
    for name in &bound.strays {
        add(Rule::Unbounded, format!("{name} branches to an address that is not a function"));
    }
    if rules.whole_image {
        let footprint = image::footprint(elf)?;
        let reached = |rule: Rule, faults: &[Fault]| faults.iter().any(|fault| fault.rule == rule);
        for (rule, symbols, what) in [
            (Rule::Panic, footprint.panic_symbols, "panic"),
            (Rule::Allocation, footprint.allocator_symbols, "allocator"),
        ] {
            if !symbols.is_empty() && !reached(rule, &faults) {
                faults.push(Fault { rule, text: format!("the image contains the {what} {}", some(&symbols)) });
            }
        }
    }
    faults.sort_by_key(|fault| fault.rule);
    Ok(TickChecks {
        tick: root.to_owned(),
        functions: reach.parents.len(),
        code: bound.code_bytes,
        stack: bound.is_complete().then_some(bound.bytes),
        path: bound.path,
        faults,
    })
}

impl TickChecks {
    /// Adds a violation if a tick was measured to use more stack than the bound.
    pub fn check_painted_stack(&mut self, painted: u64) {
        if let Some(bound) = self.stack
            && painted > bound
        {
            let text = format!("a tick used {painted} bytes of stack; the static bound is {bound}");
            self.faults.push(Fault { rule: Rule::StackBound, text });
        }
    }
}

/// Functions of `compiler_builtins` for arithmetic or conversions of `f64`, by their names in the run-time ABI and in
/// libgcc.
fn is_soft_double(name: &str) -> bool {
    let name = name.rsplit("::").next().unwrap_or(name);
    if let Some(helper) = name.strip_prefix("__aeabi_") {
        let arithmetic = ["dadd", "dsub", "drsub", "dmul", "ddiv", "dneg", "d2", "cd", "dcmp"];
        return arithmetic.iter().any(|start| helper.starts_with(start))
            || matches!(helper, "i2d" | "ui2d" | "l2d" | "ul2d" | "f2d" | "h2d");
    }
    let libgcc = name.starts_with("__") && (name.ends_with("df2") || name.ends_with("df3") || name.ends_with("df"));
    libgcc || name.starts_with("__fixdf") || name.starts_with("__fixunsdf") || name.starts_with("__truncdf")
}

fn some(names: &[String]) -> String {
    let more = names.len().saturating_sub(NAMED);
    let list = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    if more == 0 { list } else { format!("{list} and {more} more") }
}

/// Functions reachable from a root.
struct Reach<'a> {
    graph: &'a CallGraph,
    /// Each reachable function and its predecessor on a shortest path.
    parents: BTreeMap<u64, Option<u64>>,
}

impl<'a> Reach<'a> {
    /// Breadth first, for shortest paths.
    fn from(graph: &'a CallGraph, root: u64) -> Self {
        let mut parents = BTreeMap::from([(root, None)]);
        let mut ring = vec![root];
        while !ring.is_empty() {
            let mut next = Vec::new();
            for address in ring {
                let callees = graph.functions.get(&address).into_iter().flat_map(|function| function.calls.keys());
                for callee in callees {
                    if !parents.contains_key(callee) {
                        parents.insert(*callee, Some(address));
                        next.push(*callee);
                    }
                }
            }
            ring = next;
        }
        Self { graph, parents }
    }

    fn functions(&self) -> impl Iterator<Item = (u64, &'a Function)> {
        self.parents.keys().filter_map(|address| Some((*address, self.graph.functions.get(address)?)))
    }

    fn callers(&self, callee: u64) -> impl Iterator<Item = (u64, &'a Function)> {
        self.functions().filter(move |(_, function)| function.calls.contains_key(&callee))
    }

    /// Message with the call path from the tick and the lines that call the function.
    fn words(&self, debug: &DebugInfo<'_>, what: &str, address: u64) -> Result<String, TargetError> {
        let name = |address: u64| self.graph.functions.get(&address).map_or("?", |function| function.name.as_str());
        let mut way = vec![name(address)];
        let mut at = address;
        while let Some(Some(parent)) = self.parents.get(&at) {
            way.push(name(*parent));
            at = *parent;
        }
        way.reverse();
        let mut lines = BTreeSet::new();
        for (_, caller) in self.callers(address).filter(|(_, caller)| caller.name != name(address)) {
            let places = caller.calls.get(&address).into_iter().flatten();
            lines.extend(panics::lines(debug, caller, places.take(NAMED))?);
        }
        let lines: Vec<String> = lines.into_iter().collect();
        Ok(format!("the tick {what}: {}; called at {}", way.join(" → "), some(&lines)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn helpers_for_double_precision_are_recognised() {
        let double = [
            "__aeabi_dmul",
            "__aeabi_dadd",
            "__aeabi_drsub",
            "__aeabi_cdcmple",
            "__aeabi_dcmplt",
            "__aeabi_d2f",
            "__aeabi_d2iz",
            "__aeabi_f2d",
            "__aeabi_i2d",
            "compiler_builtins::float::mul::__muldf3",
            "__extendsfdf2",
            "__truncdfsf2",
            "__fixdfsi",
            "__floatsidf",
            "__gedf2",
        ];
        for name in double {
            assert!(is_soft_double(name), "{name}");
        }
        let other = [
            "__aeabi_fmul",
            "__aeabi_f2iz",
            "__aeabi_i2f",
            "__aeabi_uldivmod",
            "__aeabi_memcpy",
            "__mulsf3",
            "__floatsisf",
            "memcpy",
            "controller::step",
            "__udivmoddi4",
            "pdf",
            "__aeabi_idiv",
        ];
        for name in other {
            assert!(!is_soft_double(name), "{name}");
        }
    }

    #[test]
    fn a_bound_below_the_painted_stack_is_a_fault() {
        let mut checked = TickChecks {
            tick: "t".to_owned(),
            functions: 1,
            code: 2,
            stack: Some(100),
            path: Vec::new(),
            faults: Vec::new(),
        };
        checked.check_painted_stack(100);
        assert!(checked.faults.is_empty());
        checked.check_painted_stack(104);
        assert_eq!(checked.faults.first().map(|fault| fault.rule), Some(Rule::StackBound));
    }
}
