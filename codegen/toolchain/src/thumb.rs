//! Decodes the few Thumb-2 instructions that determine control flow and stack use
//! (ARM DDI 0403, A5 and A7.7). All others are skipped.

use std::collections::BTreeMap;

const STACK_POINTER: u16 = 13;
const LINK_REGISTER: u16 = 14;

/// One instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// Its address.
    pub place: u64,
    first: u16,
    /// Second half of a 32-bit instruction.
    second: Option<u16>,
}

/// A branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// With return.
    Call(u64),
    /// Without return: a loop, or a tail call.
    Jump(u64),
    /// To an address in a register.
    Register,
}

/// Decodes the code at `address`. `marks` gives where code (true) and data (false) begin.
pub fn decode(address: u64, code: &[u8], marks: &BTreeMap<u64, bool>) -> Vec<Instruction> {
    let half = |at: usize| code.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(first) = half(at) {
        let place = address + at as u64;
        // Code, unless the last mark up to here is for data.
        if marks.range(..=place).next_back().is_some_and(|(_, &is_code)| !is_code) {
            at += 2;
            continue;
        }
        let second = if first >> 11 < 0b11101 { None } else { half(at + 2) };
        found.push(Instruction { place, first, second });
        at += if first >> 11 < 0b11101 { 2 } else { 4 };
    }
    found
}

/// The first instruction of `code`, which is at `address`.
pub fn one(address: u64, code: &[u8]) -> Option<Instruction> {
    let length = if u16::from_le_bytes([*code.first()?, *code.get(1)?]) >> 11 < 0b11101 { 2 } else { 4 };
    decode(address, code.get(..length)?, &BTreeMap::new()).pop()
}

/// Upper bound of the stack frame of a function, bytes: the sum of all its pushes.
/// `None` if the stack pointer is moved by an amount known only at run time.
///
/// Valid for compiled code, which moves the stack pointer in its prologue and never in a loop.
pub fn frame(instructions: &[Instruction]) -> Option<u64> {
    instructions.iter().map(Instruction::takes_stack).sum()
}

impl Instruction {
    /// Size, bytes.
    pub fn size(&self) -> u32 {
        if self.second.is_some() { 4 } else { 2 }
    }

    /// Its halfwords; the second is 0 for a short instruction.
    pub fn halves(&self) -> [u32; 2] {
        [u32::from(self.first), u32::from(self.second.unwrap_or(0))]
    }

    /// Whether control may continue elsewhere than at the next instruction.
    pub fn ends_block(&self) -> bool {
        let op = self.first;
        self.branch().is_some()
            || match self.second {
                // CBZ, CBNZ; POP with PC; BX LR, MOV PC, LR; BKPT; SVC.
                None => {
                    matches!(op >> 8, 0xb1 | 0xb3 | 0xb9 | 0xbb | 0xbd | 0xbe | 0xdf)
                        || matches!(op, 0x4770..=0x4777 | 0x46f7)
                }
                // LDM with PC; LDR PC; TBB, TBH.
                Some(second) => {
                    op & 0xfe50 == 0xe810 && second >> 15 == 1
                        || op & 0xff70 == 0xf850 && second >> 12 == 15
                        || op & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000
                }
            }
    }

    /// The branch, if it is one.
    pub fn branch(&self) -> Option<Branch> {
        match self.second {
            None => self.narrow_branch(),
            Some(second) => self.wide_branch(second),
        }
    }

    fn narrow_branch(&self) -> Option<Branch> {
        let op = self.first;
        let register = (op >> 3) & 0xf;
        match op {
            // BLX rM; BX rM and MOV PC, rM except from LR, a return.
            _ if op & 0xff87 == 0x4780 => Some(Branch::Register),
            _ if matches!(op & 0xff87, 0x4700 | 0x4687) && register != LINK_REGISTER => Some(Branch::Register),
            // B<cond>; conditions 14 and 15 are UDF and SVC.
            _ if op >> 12 == 0b1101 && (op >> 8) & 0xf < 14 => {
                Some(Branch::Jump(self.target(u32::from(op & 0xff) << 1, 9)))
            }
            _ if op >> 11 == 0b11100 => Some(Branch::Jump(self.target(u32::from(op & 0x7ff) << 1, 12))),
            _ => None,
        }
    }

    fn wide_branch(&self, second: u16) -> Option<Branch> {
        let (high, low) = (u32::from(self.first), u32::from(second));
        if self.first >> 11 == 0b11110 && second >> 15 == 1 {
            let (sign, j1, j2) = ((high >> 10) & 1, (low >> 13) & 1, (low >> 11) & 1);
            let far = (sign << 24)
                | ((j1 ^ sign ^ 1) << 23)
                | ((j2 ^ sign ^ 1) << 22)
                | ((high & 0x3ff) << 12)
                | ((low & 0x7ff) << 1);
            let near = (sign << 20) | (j2 << 19) | (j1 << 18) | ((high & 0x3f) << 12) | ((low & 0x7ff) << 1);
            return match second & 0x5000 {
                // BL, and BLX to ARM code, whose target is a multiple of four.
                0x5000 => Some(Branch::Call(self.target(far, 25))),
                0x4000 => Some(Branch::Call(self.target(far, 25) & !3)),
                // B.W and B<cond>.W.
                0x1000 => Some(Branch::Jump(self.target(far, 25))),
                _ if (self.first >> 6) & 0xf < 14 => Some(Branch::Jump(self.target(near, 21))),
                _ => None,
            };
        }
        // LDR PC, [...] except from the stack, which is a return.
        let loads_pc = self.first & 0xff70 == 0xf850 && second >> 12 == 15;
        (loads_pc && self.first & 0xf != STACK_POINTER).then_some(Branch::Register)
    }

    /// Target of a branch with an offset of `bits` bits; the program counter reads four bytes ahead.
    fn target(&self, offset: u32, bits: u32) -> u64 {
        let shift = 32 - bits;
        let offset = (offset << shift).cast_signed() >> shift;
        self.place.wrapping_add(4).wrapping_add_signed(i64::from(offset))
    }

    /// Bytes by which it lowers the stack pointer; `None` if known only at run time.
    fn takes_stack(&self) -> Option<u64> {
        match self.second {
            None => self.narrow_takes_stack(),
            Some(second) => self.wide_takes_stack(second),
        }
    }

    fn narrow_takes_stack(&self) -> Option<u64> {
        let op = self.first;
        match op {
            // PUSH: eight registers and LR.
            _ if op & 0xfe00 == 0xb400 => Some(4 * u64::from((op & 0x1ff).count_ones())),
            // SUB SP, #imm7 words.
            _ if op & 0xff80 == 0xb080 => Some(4 * u64::from(op & 0x7f)),
            // MOV SP, rM and ADD SP, rM.
            _ if matches!(op & 0xff87, 0x4685 | 0x4485) => None,
            _ => Some(0),
        }
    }

    fn wide_takes_stack(&self, second: u16) -> Option<u64> {
        let (first, low) = (self.first, u64::from(second));
        let destination = (second >> 8) & 0xf;
        match first {
            // STMDB SP!, {...}: PUSH.W.
            0xe92d => Some(4 * u64::from(second.count_ones())),
            // STR rT, [SP, #-imm8]!, of which PUSH of one register is a case.
            0xf84d if second & 0x0f00 == 0x0d00 => Some(low & 0xff),
            // STRD rT, rT2, [SP, #-imm8 words]!; VPUSH: imm8 words.
            0xe96d => Some(4 * (low & 0xff)),
            _ if first & 0xffbf == 0xed2d => Some(4 * (low & 0xff)),
            // SUBW SP, SP, #imm12.
            _ if first & 0xfbff == 0xf2ad && destination == STACK_POINTER => Some(immediate12(first, second)),
            // SUB.W SP, SP, #constant.
            _ if first & 0xfbef == 0xf1ad && destination == STACK_POINTER => {
                Some(u64::from(expanded(immediate12(first, second))))
            }
            // ADD.W and ADDW SP, SP, #constant release stack.
            _ if matches!(first & 0xfbef, 0xf10d | 0xf20d) && destination == STACK_POINTER => Some(0),
            // Any other data processing into SP, with a register or an immediate operand.
            _ if (first >> 9 == 0b111_0101 || (first >> 11 == 0b11110 && second >> 15 == 0))
                && destination == STACK_POINTER =>
            {
                None
            }
            _ => Some(0),
        }
    }
}

/// i:imm3:imm8.
fn immediate12(first: u16, second: u16) -> u64 {
    u64::from(first >> 10 & 1) << 11 | u64::from(second >> 12 & 7) << 8 | u64::from(second & 0xff)
}

/// ThumbExpandImm.
fn expanded(immediate: u64) -> u32 {
    let immediate = (immediate & 0xfff) as u32;
    let byte = immediate & 0xff;
    match immediate >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (0x80 | byte & 0x7f).rotate_right(immediate >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<Instruction> {
        decode(0x1000, bytes, &BTreeMap::new())
    }

    fn branches(bytes: &[u8]) -> Vec<Branch> {
        all(bytes).iter().filter_map(Instruction::branch).collect()
    }

    /// Encodings as printed by GNU `as` for code at 0x1000.
    #[test]
    fn branches_are_decoded() {
        // bl 0xffc: f7ff fffc
        assert_eq!(branches(&[0xff, 0xf7, 0xfc, 0xff]), [Branch::Call(0x0ffc)]);
        // b.w 0x2000: f000 bffe
        assert_eq!(branches(&[0x00, 0xf0, 0xfe, 0xbf]), [Branch::Jump(0x2000)]);
        // beq.w 0x1104: f000 8080
        assert_eq!(branches(&[0x00, 0xf0, 0x80, 0x80]), [Branch::Jump(0x1104)]);
        // b . : e7fe; beq . : d0fe
        assert_eq!(branches(&[0xfe, 0xe7]), [Branch::Jump(0x1000)]);
        assert_eq!(branches(&[0xfe, 0xd0]), [Branch::Jump(0x1000)]);
        // blx r3; bx r2; bx lr; ldr pc, [sp], #4; ldr.w pc, [r0]
        assert_eq!(branches(&[0x98, 0x47]), [Branch::Register]);
        assert_eq!(branches(&[0x10, 0x47]), [Branch::Register]);
        assert_eq!(branches(&[0x70, 0x47]), []);
        assert_eq!(branches(&[0x5d, 0xf8, 0x04, 0xfb]), []);
        assert_eq!(branches(&[0xd0, 0xf8, 0x00, 0xf0]), [Branch::Register]);
    }

    #[test]
    fn data_between_code_is_not_decoded() {
        let marks = BTreeMap::from([(0x1000, true), (0x1002, false), (0x1004, true)]);
        let places: Vec<u64> =
            decode(0x1000, &[0x98, 0x47, 0x98, 0x47, 0x98, 0x47], &marks).iter().map(|i| i.place).collect();
        assert_eq!(places, [0x1000, 0x1004]);
    }

    #[test]
    fn pushes_add_up_to_the_frame() {
        // push {r4, r5, lr}; sub sp, #16; vpush {d8}; push.w {r8, r9}; str r11, [sp, #-8]!; sub.w sp, sp, #1024
        let code = [
            0x30, 0xb5, 0x84, 0xb0, 0x2d, 0xed, 0x02, 0x8b, 0x2d, 0xe9, 0x00, 0x03, 0x4d, 0xf8, 0x08, 0xbd, 0xad, 0xf5,
            0x80, 0x6d,
        ];
        assert_eq!(frame(&all(&code)), Some(12 + 16 + 8 + 8 + 8 + 1024));
        // add sp, #16; add.w sp, sp, #1024; msr msp, r0 take nothing.
        assert_eq!(frame(&all(&[0x04, 0xb0, 0x0d, 0xf5, 0x80, 0x6d, 0x80, 0xf3, 0x08, 0x88])), Some(0));
        // mov sp, r0; sub.w sp, sp, r0
        assert_eq!(frame(&all(&[0x85, 0x46])), None);
        assert_eq!(frame(&all(&[0xad, 0xeb, 0x00, 0x0d])), None);
    }
}
