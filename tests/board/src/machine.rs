//! The core with its board: reset, exceptions, sleep.

use std::path::Path;

use crate::board::{Board, Stop};
use crate::elf::Segment;
use crate::fault::Fault;
use crate::nvic::{FIRST, HARD_FAULT, NMI};
use crate::part::{DEVICES, TIM2_INTERRUPT};
use crate::time::{MICROSECOND, Time};
use crate::unicorn::{Core, Engine, Register};

/// Returns from exceptions are jumps to here, from where nothing can be executed.
const RETURNS: u32 = 0xffff_ff00;
/// EXC_RETURN with floating-point registers on the main stack: to a handler, to the program.
const TO_HANDLER: u32 = 0xffff_ffe1;
const TO_THREAD: u32 = 0xffff_ffe9;
/// R0 to R3, R12, LR, PC, xPSR, S0 to S15, FPSCR, one for alignment.
const FRAME: u32 = 26;
const ALIGNED: u32 = 1 << 9;
/// How long a debugger holds the core.
const HALT: Time = 1_000_000 * MICROSECOND;

pub struct Machine {
    engine: Engine<Board>,
    /// Where it goes on.
    at: u32,
}

impl Machine {
    /// A board with this image, at reset.
    pub fn new(library: &Path, board: Board, image: &[Segment]) -> Result<Self, String> {
        let memories = board.part.memories;
        let modelled = board.is_modelled();
        let mut engine = Engine::open(library, board, memories, &DEVICES)?;
        if modelled {
            // Flash and AXI SRAM: what is at the core costs nothing.
            for memory in memories.iter().filter(|[base, _]| base >> 24 != 0 && base >> 24 != 0x20) {
                engine.watch(*memory)?;
            }
        }
        for Segment { address, bytes, .. } in image {
            if !engine.core().store(*address, bytes) {
                return Err(format!(
                    "the image has {} bytes at {address:#x}, where this part has no memory",
                    bytes.len()
                ));
            }
        }
        let mut machine = Self { engine, at: 0 };
        machine.begin();
        Ok(machine)
    }

    pub fn board(&mut self) -> &mut Board {
        self.engine.guest()
    }

    /// The core as after a reset: stack and program from the vector table.
    fn begin(&mut self) {
        let (core, board) = self.engine.parts();
        let word = |k: u32| core.word(board.part.flash + 4 * k).unwrap_or(0);
        core.set(Register::SP, word(0));
        core.set(Register::PRIMASK, 0);
        core.set(Register::BASEPRI, 0);
        core.set(Register::LR, u32::MAX);
        self.at = word(1) & !1;
    }

    /// Runs until line and commands are to be looked at.
    pub fn run(&mut self) {
        loop {
            if self.board().has(Fault::Hang) {
                let (core, board) = self.engine.parts();
                while !board.bitten() {
                    board.sleep(&core);
                    board.look(None);
                }
                board.faults.retain(|fault| *fault != Fault::Hang);
                board.stop = Stop::Reset;
            } else if let Err(error) = self.engine.run(self.at) {
                let (core, board) = self.engine.parts();
                let (pc, sp) = (core.get(Register::PC), core.get(Register::SP));
                board.stop = if pc >= RETURNS {
                    Stop::Return
                } else {
                    board.say(&format!("hard fault at {pc:#x}, stack {sp:#x}: error {error} of the engine"));
                    Stop::Exception { number: HARD_FAULT, at: pc }
                };
            }
            match self.board().stop {
                Stop::Exception { number, at } => self.enter(number, at),
                Stop::Return => self.leave(),
                Stop::Sleep { at } => {
                    let (core, board) = self.engine.parts();
                    // A dead background never comes back from here.
                    self.at = at + if board.has(Fault::Background) { 0 } else { 2 };
                    if board.nvic().next().is_none() {
                        board.sleep(&core);
                    }
                    if board.nvic().next().is_none() {
                        self.at = at;
                    }
                    if board.due_look() {
                        return;
                    }
                }
                Stop::Look { at } => {
                    self.at = at;
                    return;
                }
                Stop::Reset => {
                    let watchdog = self.board().bitten();
                    self.board().reset(if watchdog { "watchdog" } else { "by the program" });
                    self.begin();
                }
            }
        }
    }

    /// What is no matter of the board alone: exceptions of the core, a debugger, a supply that broke down.
    pub fn fail(&mut self, fault: Fault) {
        self.board().fail(fault);
        match fault {
            Fault::Hard => self.enter(HARD_FAULT, self.at),
            Fault::Clock if self.board().is_secured() => self.enter(NMI, self.at),
            Fault::Halt => {
                let (core, board) = self.engine.parts();
                let end = board.now + HALT;
                board.hold(Some(HALT));
                while board.now < end {
                    board.sleep(&core);
                    board.look(None);
                }
                board.hold(None);
            }
            Fault::BrownOut => {
                let (core, board) = self.engine.parts();
                for [base, length] in &board.part.memories[1..] {
                    core.store(*base, &vec![0xa5; *length as usize]);
                }
                board.power_up();
                board.reset("brown-out");
                self.begin();
            }
            _ => {}
        }
    }

    /// Stacks what an exception stacks and goes to its handler.
    fn enter(&mut self, number: usize, at: u32) {
        let (core, board) = self.engine.parts();
        let before = core.get(Register::SP);
        let aligned = before & !7;
        let base = aligned.wrapping_sub(4 * FRAME);
        let status = core.get(Register::APSR) & 0xf80f_0000 | 1 << 24 | if before == aligned { 0 } else { ALIGNED };
        let mut frame: Vec<u32> = general(&core);
        frame.extend([core.get(Register::R12), core.get(Register::LR), at, status]);
        frame.extend((0..16).map(|k| core.get(Register::single(k))));
        frame.extend([core.get(Register::FPSCR), 0]);
        let bytes: Vec<u8> = frame.iter().flat_map(|word| word.to_le_bytes()).collect();
        if !core.store(base, &bytes) {
            // No memory below the stack: the core locks up, which the watchdog ends.
            board.say(&format!("lock-up: no memory for the frame of exception {number} at {base:#x}"));
            board.faults.push(Fault::Hang);
            return;
        }
        core.set(Register::SP, base);
        core.set(Register::LR, if board.nvic().depth() == 0 { TO_THREAD } else { TO_HANDLER });
        self.at = core.word(board.part.flash + 4 * number as u32).unwrap_or(0) & !1;
        if number == FIRST + TIM2_INTERRUPT {
            board.nvic().enter(number);
            board.tick_begins();
        } else {
            board.nvic().enter(number);
        }
        board.now += board.entry();
        board.lowest_stack(base);
    }

    /// Goes back to what an exception interrupted.
    fn leave(&mut self) {
        let (core, board) = self.engine.parts();
        let base = core.get(Register::SP);
        let mut bytes = [0; 4 * FRAME as usize];
        core.load(base, &mut bytes);
        let word = |k: usize| u32::from_le_bytes([bytes[4 * k], bytes[4 * k + 1], bytes[4 * k + 2], bytes[4 * k + 3]]);
        for k in 0..4 {
            core.set(Register::general(k), word(k as usize));
        }
        core.set(Register::R12, word(4));
        core.set(Register::LR, word(5));
        core.set(Register::APSR, word(7) & 0xf80f_0000);
        for k in 0..16 {
            core.set(Register::single(k), word(8 + k as usize));
        }
        core.set(Register::FPSCR, word(24));
        core.set(Register::SP, base + 4 * FRAME + if word(7) & ALIGNED == 0 { 0 } else { 4 });
        self.at = word(6);
        if board.nvic().running() == Some(FIRST + TIM2_INTERRUPT) {
            board.meter.end(board.now, board.instructions);
        }
        board.nvic().leave();
        board.now += board.entry();
    }
}

fn general(core: &Core<'_>) -> Vec<u32> {
    (0..4).map(|k| core.get(Register::general(k))).collect()
}
