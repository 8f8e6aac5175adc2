//! Cost of instructions in core cycles: one each, or by a model with these assumptions.
//!
//! | what | Cortex-M7 | Cortex-M4 |
//! |---|---|---|
//! | integer instruction | 1; pairs with a preceding load, store, branch or f32 instruction | 1 |
//! | load, store | 1 per cycle; for several registers, two words per cycle | load 2, store 1; for several registers, 1 + 1 per word |
//! | branch | pairs with the preceding instruction, and is predicted | 3 if taken |
//! | integer division | 8 | 8 |
//! | f32: add, multiply | 1 per cycle, latency 3 | 1 |
//! | f32: multiply-add; divide, square root | latency 6; 16 | 3; 14 |
//! | f64: add; multiply; multiply-add | not paired, latency 4; 7; 11 | none |
//! | f64: divide, square root | 30, blocking | none |
//! | load into a floating-point register | latency 2 | no latency |
//! | code in flash | lines of 32 bytes, 16 KiB two-way LRU cache; a miss costs 2 (wait states + 8) | lines of 16 bytes; a new line costs the wait states, unless it is in the accelerator's 64 lines; a prefetched next line costs the remaining wait states |
//! | code in ITCM | 0 | none |
//! | data in flash | lines of 32 bytes, 16 KiB four-way LRU cache; a miss costs 2 (wait states + 8) | the wait states, unless it is in the accelerator's 8 lines of 16 bytes |
//! | data in DTCM (F4: SRAM) | 0 | 0 |
//! | data in AXI SRAM, uncached: read, write | 16, 4 | none |
//! | literal pool in flash | in the data cache | the wait states, unless the accelerator's data cache is on |
//! | peripheral register: read, write | 24, 8 | 6, 3 |
//! | exception entry or return | 29 | 29 |
//!
//! Not modelled: waits for integer registers, mispredicted branches, and DMA traffic on the buses.
//! Latencies of the M7 are from LLVM's scheduling model, those of the M4 from its manual.

/// Family of microcontrollers, for differences of cores and peripherals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Cortex-M7 with double precision and caches: STM32H7.
    H7,
    /// Cortex-M4F with a flash accelerator: STM32F4.
    F4,
}

/// Sets of the M7's two-way instruction cache.
const SETS: usize = 256;
/// Lines of the F4's accelerator: code, data.
const LINES: [usize; 2] = [64, 8];
/// Sets of the M7's four-way data cache.
const DATA_SETS: usize = 128;
/// Memory regions by the upper 8 address bits: ITCM (H7), flash (both families), AXI SRAM (H7).
const ITCM: u32 = 0x00;
const FLASH: u32 = 0x08;
const AXI_SRAM: u32 = 0x24;

/// State of the cost model.
#[derive(Debug)]
pub struct Cost {
    family: Family,
    modelled: bool,
    /// Issue cycle and kind of the last instruction.
    time: u64,
    last: Kind,
    /// Cycle at which each single-precision register has its value.
    ready: [u64; 32],
    /// Address of the next instruction without a jump.
    follows: u32,
    /// Lines by set, most recently used first.
    ways: [[u32; 2]; SETS],
    /// Lines of the F4's accelerator: code, data.
    lines: [Vec<u32>; 2],
    data_ways: [[u32; 4]; DATA_SETS],
    line: u32,
    /// Cycle at which the current line was entered.
    entered: u64,
    wait_states: u64,
    /// Whether the caches of code and data, or those of the F4's accelerator, are on; whether that prefetches.
    cached: [bool; 2],
    ahead: bool,
}

/// Kind of an instruction, as far as it affects the issue of the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Integer,
    /// A store, with its number of words.
    Memory(u64),
    Load(u64),
    Branch,
    Division,
    Float(Operation),
}

/// A floating-point instruction; registers are numbered as single-precision ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Operation {
    double: bool,
    class: Class,
    sources: [usize; 3],
    target: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    Add,
    Multiply,
    Both,
    Long,
    /// From memory.
    Load,
    /// To memory or to an integer register.
    Out,
}

impl Cost {
    /// Exception entry or return with floating-point registers.
    pub const EXCEPTION: u64 = 29;

    /// The state at reset, with empty caches. `modelled`: costs by the table, otherwise one cycle per instruction.
    pub fn new(family: Family, modelled: bool) -> Self {
        Self {
            family,
            modelled,
            time: 0,
            last: Kind::Integer,
            ready: [0; 32],
            follows: 0,
            ways: [[u32::MAX; 2]; SETS],
            lines: [Vec::new(), Vec::new()],
            data_ways: [[u32::MAX; 4]; DATA_SETS],
            line: u32::MAX,
            entered: 0,
            wait_states: 0,
            cached: [false; 2],
            ahead: false,
        }
    }

    /// Whether costs are by the table.
    pub const fn is_modelled(&self) -> bool {
        self.modelled
    }

    /// Takes the current values of FLASH_ACR and of the core's CCR.
    pub fn configure(&mut self, access: u32, control: u32) {
        self.wait_states = u64::from(access & 0xf);
        self.cached = match self.family {
            Family::H7 => [control >> 17 & 1 == 1, control >> 16 & 1 == 1],
            Family::F4 => [access >> 9 & 1 == 1, access >> 10 & 1 == 1],
        };
        self.ahead = self.family == Family::F4 && access >> 8 & 1 == 1;
    }

    /// Cost of an instruction, given by its halfwords.
    pub fn of(&mut self, address: u32, size: u32, code: [u32; 2]) -> u64 {
        if !self.modelled {
            return 1;
        }
        let before = self.time;
        let jumped = address != self.follows;
        self.follows = address + size;
        self.time += self.fetched(address);
        if size == 4 {
            self.time += self.fetched(address + 2);
        }
        let kind = kind(code, size);
        if self.family == Family::F4 && beside_code(code, size) && !self.cached[1] {
            self.time += self.wait_states;
        }
        match self.family {
            Family::H7 => self.issue(kind, jumped),
            Family::F4 => {
                self.time += match kind {
                    Kind::Integer | Kind::Branch => 1,
                    Kind::Memory(words) if words < 2 => 1,
                    Kind::Load(words) | Kind::Memory(words) => 1 + words,
                    Kind::Division => 8,
                    Kind::Float(operation) => match operation.class {
                        Class::Add | Class::Multiply => 1,
                        Class::Both => 3,
                        Class::Long => 14,
                        Class::Load | Class::Out => 2,
                    },
                } + if jumped { 2 } else { 0 };
            }
        }
        self.last = kind;
        self.time - before
    }

    /// Issues an instruction on an M7.
    fn issue(&mut self, kind: Kind, jumped: bool) {
        let alone = |kind| matches!(kind, Kind::Float(operation) if operation.double && !operation.is_move());
        let pairs = match (self.last, kind) {
            _ if jumped || alone(self.last) || alone(kind) => false,
            (Kind::Branch | Kind::Division, _) | (_, Kind::Division) => false,
            (_, Kind::Branch) => true,
            (Kind::Integer, Kind::Integer) => false,
            (Kind::Integer, _) | (_, Kind::Integer) => true,
            (Kind::Float(one), Kind::Float(other)) => one.is_move() != other.is_move(),
            (Kind::Float(one), _) | (_, Kind::Float(one)) => !one.is_move(),
            _ => false,
        };
        // At most two instructions per cycle.
        let last = if pairs { Kind::Branch } else { kind };
        self.time += u64::from(!pairs);
        match kind {
            Kind::Memory(words) | Kind::Load(words) => self.time += words.div_ceil(2).max(1) - 1,
            Kind::Division => self.time += 7,
            Kind::Float(operation) => {
                let width = 1 + usize::from(operation.double);
                for source in operation.sources {
                    for register in self.ready.iter().skip(source).take(width) {
                        self.time = self.time.max(*register);
                    }
                }
                let latency = operation.latency();
                if let Some(target) = operation.target {
                    for register in self.ready.iter_mut().skip(target).take(width) {
                        *register = self.time + latency;
                    }
                }
                if operation.class == Class::Long && operation.double {
                    self.time += latency - 1;
                }
            }
            Kind::Integer | Kind::Branch => {}
        }
        self.last = last;
    }

    /// Cost of fetching the code at an address.
    fn fetched(&mut self, address: u32) -> u64 {
        match self.family {
            Family::H7 => {
                let line = address >> 5;
                if line == self.line || address >> 24 == ITCM {
                    self.line = line;
                    return 0;
                }
                self.line = line;
                let there = self.cached[0] && used(&mut self.ways[line as usize % SETS], line);
                if there { 0 } else { 2 * (self.wait_states + 8) }
            }
            Family::F4 => {
                let line = address >> 4;
                if line == self.line {
                    return 0;
                }
                let follows = line == self.line.wrapping_add(1);
                self.line = line;
                let before = std::mem::replace(&mut self.entered, self.time);
                let there = kept(&mut self.lines[0], LINES[0], line) && self.cached[0];
                let cost = match (there, self.ahead && follows) {
                    (true, _) => 0,
                    (false, true) => self.wait_states.saturating_sub(self.time - before),
                    (false, false) => self.wait_states,
                };
                self.entered += cost;
                cost
            }
        }
    }

    /// Additional cost of a memory access at this address.
    pub fn data(&mut self, address: u32, write: bool) -> u64 {
        let cost = match (self.family, address >> 24) {
            _ if !self.modelled => 0,
            (Family::H7, FLASH..=0x0b) => {
                let line = address >> 5;
                let there = self.cached[1] && used(&mut self.data_ways[line as usize % DATA_SETS], line);
                if there { 0 } else { 2 * (self.wait_states + 8) }
            }
            (Family::H7, AXI_SRAM) => {
                if write {
                    4
                } else {
                    16
                }
            }
            // Without the accelerator's data cache, `of` adds the wait states.
            (Family::F4, FLASH) if self.cached[1] && !kept(&mut self.lines[1], LINES[1], address >> 4) => {
                self.wait_states
            }
            _ => 0,
        };
        self.time += cost;
        cost
    }

    /// Largest number of words that an instruction writes to memory.
    pub fn stored(size: u32, code: [u32; 2]) -> u64 {
        match kind(code, size) {
            Kind::Memory(words) => words,
            Kind::Float(Operation { class: Class::Out, double, .. }) => 1 + u64::from(double),
            _ => 0,
        }
    }

    /// Additional cost of an access to a peripheral register.
    pub fn access(&self, write: bool) -> u64 {
        match (self.modelled, self.family, write) {
            (false, ..) => 4,
            (true, Family::H7, false) => 24,
            (true, Family::H7, true) => 8,
            (true, Family::F4, false) => 6,
            (true, Family::F4, true) => 3,
        }
    }
}

/// Whether one of the ways has this line; it becomes the most recently used one.
fn used<const WAYS: usize>(ways: &mut [u32; WAYS], line: u32) -> bool {
    let at = ways.iter().position(|known| *known == line);
    ways[..=at.unwrap_or(WAYS - 1)].rotate_right(1);
    ways[0] = line;
    at.is_some()
}

/// Whether this line is cached; it becomes the most recently used of at most `most` lines.
fn kept(lines: &mut Vec<u32>, most: usize, line: u32) -> bool {
    let at = lines.iter().position(|known| *known == line);
    match at {
        Some(at) => drop(lines.remove(at)),
        None => lines.truncate(most - 1),
    }
    lines.insert(0, line);
    at.is_some()
}

impl Operation {
    fn is_move(&self) -> bool {
        matches!(self.class, Class::Load | Class::Out)
    }

    /// Latency on an M7.
    fn latency(&self) -> u64 {
        match (self.class, self.double) {
            (Class::Add | Class::Multiply, false) => 3,
            (Class::Both, false) => 6,
            (Class::Long, false) => 16,
            (Class::Add, true) => 4,
            (Class::Multiply, true) => 7,
            (Class::Both, true) => 11,
            (Class::Long, true) => 30,
            (Class::Load | Class::Out, _) => 2,
        }
    }
}

fn kind(code: [u32; 2], size: u32) -> Kind {
    let [first, second] = code;
    if size == 2 {
        return match first >> 8 {
            // Literal, by register, by offset, on the stack.
            0x48..=0x4f | 0x56..=0x5f | 0x68..=0x6f | 0x78..=0x7f | 0x88..=0x8f | 0x98..=0x9f => Kind::Load(1),
            0x50..=0x55 | 0x60..=0x67 | 0x70..=0x77 | 0x80..=0x87 | 0x90..=0x97 => Kind::Memory(1),
            0xb4 | 0xb5 | 0xc0..=0xc7 => Kind::Memory(u64::from((first & 0x1ff).count_ones())),
            0xbc | 0xbd | 0xc8..=0xcf => Kind::Load(u64::from((first & 0x1ff).count_ones())),
            0xd0..=0xe7 | 0x47 | 0xb1 | 0xb3 | 0xb9 | 0xbb => Kind::Branch,
            _ => Kind::Integer,
        };
    }
    let coprocessor = second >> 8 & 0xf;
    if first >> 10 == 0x3b && matches!(coprocessor, 0xa | 0xb) {
        return float(first, second, coprocessor == 0xb);
    }
    match first >> 4 & 0xfff {
        // LDM, STM; LDRD, STRD.
        0xe88..=0xe8b | 0xe90..=0xe93 if first & 0x40 == 0 => {
            let words = u64::from(second.count_ones());
            if first & 0x10 == 0 { Kind::Memory(words) } else { Kind::Load(words) }
        }
        0xe80..=0xe9f => {
            if first & 0x10 == 0 {
                Kind::Memory(2)
            } else {
                Kind::Load(2)
            }
        }
        0xf80..=0xf9f => {
            if first & 0x10 == 0 {
                Kind::Memory(1)
            } else {
                Kind::Load(1)
            }
        }
        0xfb9 | 0xfbb => Kind::Division,
        0xf00..=0xf7f if second & 0x8000 != 0 => Kind::Branch,
        _ => Kind::Integer,
    }
}

/// Whether it reads a constant from the literal pool.
fn beside_code([first, _]: [u32; 2], size: u32) -> bool {
    if size == 2 { first >> 11 == 0x09 } else { matches!(first & 0xff7f, 0xf85f) || first & 0xff3f == 0xed1f }
}

fn float(first: u32, second: u32, double: bool) -> Kind {
    let register = |number: u32, extra: u32| (if double { 2 * number } else { 2 * number + extra }) as usize % 32;
    let target = register(second >> 12 & 0xf, first >> 6 & 1);
    let left = register(first & 0xf, second >> 7 & 1);
    let right = register(second & 0xf, second >> 5 & 1);
    let operation = |class, sources, target| Kind::Float(Operation { double, class, sources, target });
    // Loads and stores, of one register and of several.
    if first >> 5 == 0x762 {
        // Two integer registers.
        return operation(Class::Load, [right; 3], Some(right));
    }
    if first >> 9 == 0x76 {
        let loads = first & 0x10 != 0;
        let words = u64::from(second & 0xff);
        return match (first & 0x0120 == 0x0100, loads) {
            (true, true) => operation(Class::Load, [target; 3], Some(target)),
            (true, false) => operation(Class::Out, [target; 3], None),
            (false, true) => Kind::Load(words),
            (false, false) => Kind::Memory(words),
        };
    }
    if first >> 8 == 0xee && second & 0x10 != 0 {
        // Between integer and floating-point registers.
        let inward = first & 0x10 == 0;
        return operation(if inward { Class::Load } else { Class::Out }, [left; 3], inward.then_some(left));
    }
    let all = [target, left, right];
    match first >> 4 & 0xb {
        0 | 1 | 9 | 10 => operation(Class::Both, all, Some(target)),
        2 => operation(Class::Multiply, [left, right, right], Some(target)),
        3 => operation(Class::Add, [left, right, right], Some(target)),
        8 => operation(Class::Long, [left, right, right], Some(target)),
        // Square root, by its opcode; others cost as much as an addition of one operand.
        _ if first & 0xf == 1 && second >> 6 & 3 == 3 => operation(Class::Long, [right; 3], Some(target)),
        _ => operation(Class::Add, [right; 3], Some(target)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cycles of these instructions in cached code on an M7, after a first round that fills the cache.
    fn cycles(code: &[[u32; 2]]) -> u64 {
        let mut cost = Cost::new(Family::H7, true);
        cost.configure(2, 1 << 17);
        let mut round = || {
            let mut address = 0x0800_0000;
            let mut sum = 0;
            for halves in code {
                let size = if halves[0] >> 11 >= 0x1d { 4 } else { 2 };
                sum += cost.of(address, size, *halves);
                address += size;
            }
            sum
        };
        round();
        round()
    }

    /// vfma.f64 d0, d1, d2
    const FMA: [u32; 2] = [0xeea1, 0x0b02];
    /// subs r0, #1
    const SUBS: [u32; 2] = [0x3801, 0];
    /// bne
    const BNE: [u32; 2] = [0xd1fd, 0];

    #[test]
    fn a_delay_loop_takes_one_cycle_per_iteration() {
        assert_eq!(cycles(&[SUBS, BNE]), 1);
    }

    #[test]
    fn a_chain_of_multiply_and_add_waits_for_each_result() {
        // vfma.f64 d3, d1, d2
        let other = [0xeea1, 0x3b02];
        assert_eq!(cycles(&[FMA, FMA]), 22);
        assert_eq!(cycles(&[FMA, other]), 11);
    }

    #[test]
    fn instructions_are_classified() {
        let class = |code| match kind(code, 4) {
            Kind::Float(Operation { class, double, .. }) => Some((class, double)),
            _ => None,
        };
        for (code, expected) in [
            (FMA, (Class::Both, true)),
            // vmul.f32 s0, s1, s2; vadd.f64 d0, d1, d2; vdiv.f64 d0, d1, d2; vsqrt.f64 d0, d1
            ([0xee20, 0x0a81], (Class::Multiply, false)),
            ([0xee31, 0x0b02], (Class::Add, true)),
            ([0xee81, 0x0b02], (Class::Long, true)),
            ([0xeeb1, 0x0bc1], (Class::Long, true)),
            // vldr d0, [r0]; vstr d0, [r0]; vmov s0, r0; vmov r0, s0
            ([0xed90, 0x0b00], (Class::Load, true)),
            ([0xed80, 0x0b00], (Class::Out, true)),
            ([0xee00, 0x0a10], (Class::Load, false)),
            ([0xee10, 0x0a10], (Class::Out, false)),
        ] {
            assert_eq!(class(code), Some(expected), "{code:#x?}");
        }
        // ldr.w r0, [r1]; str.w r0, [r1]; sdiv; bl; add.w; vldmia r0, {d0-d3}
        assert_eq!(kind([0xf8d1, 0], 4), Kind::Load(1));
        assert_eq!(kind([0xf8c1, 0], 4), Kind::Memory(1));
        assert_eq!(kind([0xfb90, 0xf0f1], 4), Kind::Division);
        assert_eq!(kind([0xf000, 0xf800], 4), Kind::Branch);
        assert_eq!(kind([0xeb00, 0x0001], 4), Kind::Integer);
        assert_eq!(kind([0xec90, 0x0b08], 4), Kind::Load(8));
        assert_eq!(kind([0xbd10, 0], 2), Kind::Load(2));
    }

    #[test]
    fn the_cores_own_memories_cost_nothing_and_a_line_of_flash_once() {
        let mut cost = Cost::new(Family::H7, true);
        cost.configure(4, 3 << 16);
        let mut fetch = |address| cost.of(address, 2, [0xbf00, 0]);
        assert_eq!([0x20, 0x40, 0x0800_0000, 0x0800_0020, 0x0800_0000].map(&mut fetch), [1, 1, 25, 25, 1]);
        let mut read = |address| cost.data(address, false);
        assert_eq!([0x2000_4000, 0x0800_1000, 0x0800_101c, 0x2400_0000].map(&mut read), [0, 24, 0, 16]);
        // Four ways: the fifth line of a set replaces the first.
        for way in 1..=4 {
            assert_eq!(cost.data(0x0800_1000 + 0x1000 * way, false), 24);
        }
        assert_eq!(cost.data(0x0800_1000, false), 24);
    }

    #[test]
    fn a_prefetched_line_costs_the_remaining_wait_states() {
        let mut cost = Cost::new(Family::F4, true);
        cost.configure(5 | 7 << 8, 0);
        let run: Vec<u64> = (0..16).map(|k| cost.of(0x0800_0000 + 2 * k, 2, [0xbf00, 0])).collect();
        // Eight instructions take longer than the five wait states.
        assert_eq!((run[0], run[8]), (8, 1));
        // A jump to a line that is not cached.
        assert_eq!(cost.of(0x0800_0100, 2, [0xbf00, 0]), 8);
    }

    #[test]
    fn without_a_cache_every_line_is_fetched_again() {
        let mut cost = Cost::new(Family::F4, true);
        cost.configure(5, 0);
        let lines = [0x0800_0000, 0x0800_0010, 0x0800_0000];
        let of = |cost: &mut Cost| lines.map(|address| cost.of(address, 2, [0xbf00, 0]));
        assert_eq!(of(&mut cost), [8, 8, 8]);
        cost.configure(5 | 1 << 9, 0);
        assert_eq!(of(&mut cost), [3, 3, 3]);
    }
}
