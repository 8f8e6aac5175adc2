//! The firmware of the boards, from a spec to its ELF file: it builds, fits, and its tick cannot panic, allocate, call through
//! a register, recurse, or compute `f64` in software on a core that has none.
//!
//! No board is here: what runs is the emulated image (`bit_identity`, `platform_bits`), the parts on the host (`firmware/hal`,
//! `firmware/board`), and both images built here, on an emulated board after the tests (`tests/board`). One build for each
//! family; `-- --nocapture` prints the figures.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;
use std::sync::Mutex;

use specgen::budget::group;
use specgen::emit;
use specgen::model::{BOARDS, Mcu};
use specgen::target::callgraph::CallGraph;
use specgen::target::checks::{self, Rule, Rules};
use specgen::target::toolchain::CoreLibrary;
use specgen::target::{self, Image, build, image, size, stack, toolchain};
use specgen::workspace;
use specgen_tests::{compile_edited, image_target, kept, repository, scratch};

use crate::figures;
use crate::porting::own_board_builds;

struct Board {
    name: &'static str,
    folder: &'static str,
    /// Bytes of flash that the image may take.
    flash: u64,
    /// Bytes of RAM, the stack's reserve included, without the buffer of a recorder.
    ram: u64,
    /// Bytes that memory.x reserves for the stack, below everything else.
    stack: u64,
    /// Below this address the whole tick runs, where the part has memory for that.
    tightly: Option<u64>,
    edits: &'static [(&'static str, &'static str)],
}

impl Board {
    fn mcu(&self) -> Mcu {
        BOARDS.into_iter().find(|board| board.folder == self.folder).map(Mcu::Board).unwrap()
    }
}

/// What the emulation of these images is to wait for is short.
const SHORT: (&str, &str) = (
    "[timing]\n",
    "[supervisor]\narm_time = \"20 ms\"\nramp_rate = \"1 V/ms\"\nhost_lost = [\"100 ms\", \"400 ms\"]\n\n[timing]\n",
);

const H743: Board = Board {
    name: "board-h743",
    folder: "stm32h743",
    flash: 118 * 1024,
    ram: 44 * 1024,
    stack: 16 * 1024,
    tightly: Some(0x1_0000),
    edits: &[("mcu = \"mps2-an500\"", "mcu = \"stm32h743zi\""), SHORT],
};
const F446: Board = Board {
    name: "board-f446",
    folder: "stm32f4",
    flash: 107 * 1024,
    ram: 32 * 1024,
    stack: 12 * 1024,
    tightly: None,
    // Twice the period, which docs/bring-up.md asks for on this part, and what a spec with it needs.
    edits: &[
        ("mcu = \"mps2-an500\"", "mcu = \"stm32f446re\""),
        SHORT,
        ("scalar = \"f64\"", "scalar = \"f32\""),
        ("period = \"100 us\"", "period = \"200 us\""),
        ("velocity_cutoff = \"1.9e4 rad/s\"", "velocity_cutoff = \"9425 rad/s\""),
        ("stale_ticks  = 10", "stale_ticks  = 5"),
    ],
};

/// What is measured of an image.
const FLASH: &str = "bytes of flash";
const RAM: &str = "bytes of RAM";
const STACK: &str = "bytes of stack";

/// One build at a time.
static BUILD: Mutex<()> = Mutex::new(());

/// The image of the board; none, and a line that says so, without a cross compiler where that is permitted.
fn image_of(board: &Board) -> Option<Image> {
    let image = program_of(board, board.folder)?;
    keep(board, &image.elf);
    Some(image)
}

/// A program of the emitted workspace, built for the board.
fn program_of(board: &Board, program: &str) -> Option<Image> {
    let _one = BUILD.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let toolchain = target::found_or_skipped(toolchain::find()).unwrap_or_else(|missing| panic!("{missing}"))?;
    let compiled = compile_edited(board.name, "reference.toml", board.edits, &[]);
    let dir = scratch(board.name);
    let files = workspace::files_with(&compiled.ir, &emit::emit(&compiled.ir), &[program]);
    workspace::write_scratch(&dir, &files).unwrap();
    let built = build::build_folder(&toolchain, &dir, program, board.mcu(), &image_target(), false);
    Some(built.unwrap_or_else(|error| panic!("{error}")))
}

/// Image and spec for `cargo xtask test --full`, which then runs them on an emulated board.
fn keep(board: &Board, elf: &[u8]) {
    let specs = repository().join("specs");
    let folder = kept(board.folder);
    let mut text = fs::read_to_string(specs.join("reference.toml")).unwrap();
    for (old, new) in board.edits {
        text = text.replace(old, new);
    }
    fs::create_dir_all(folder.join("records")).unwrap();
    fs::copy(specs.join("records/reference-forc.csv"), folder.join("records/reference-forc.csv")).unwrap();
    fs::write(folder.join("platform.toml"), text).unwrap();
    fs::write(folder.join("image.elf"), elf).unwrap();
}

fn check(board: &Board) {
    let Some(Image { elf, compiler, .. }) = image_of(board) else { return };
    assert_eq!(size::size(&elf).unwrap().target, Some(board.folder), "what `specgen flash` goes by");
    let single = !board.mcu().part().double;
    let rules = Rules { single, whole_image: false };

    // The whole interrupt, not only the tick that it calls.
    let checked = checks::check(&elf, Some("TIM2"), rules).unwrap();
    assert!(checked.faults.is_empty(), "{}: {:#?}", board.name, checked.faults);
    let tick = checked.stack.expect("a bound: nothing above says otherwise");

    let stack::Reserve { reserved, startup, running } = stack::Reserve::of(&elf).unwrap().unwrap();
    let footprint = image::footprint(&elf).unwrap();
    let reserve = board.stack;
    let ram = footprint.ram + reserve;
    println!(
        "{}: flash {} B, RAM {ram} B with {reserve} B of stack, {} B of recorder; tick: {} functions, {} B of code, \
         {tick} B of stack; stack at startup {} B, running {running} B",
        board.name, footprint.flash, footprint.recorder, checked.functions, checked.code, startup
    );
    let taken = [(FLASH, footprint.flash), (RAM, ram), (STACK, tick)];
    let taken = taken.map(|(what, bytes)| (what.to_owned(), bytes as f64)).into();
    assert_eq!(figures::held("boards.json", board.name, &compiler, taken), Vec::<String>::new());
    assert!(ram <= board.ram, "{}: {ram} B of RAM", board.name);
    assert_eq!(reserved, reserve, "{}", board.name);
    assert!(startup <= reserve, "{}: {startup} B of stack", board.name);
    assert!(running <= reserve, "{}: {running} B of stack", board.name);
    assert!(footprint.flash <= board.flash, "{}: {} B of flash", board.name, footprint.flash);
    assert!(footprint.allocator_symbols.is_empty(), "{:?}", footprint.allocator_symbols);

    if let Some(end) = board.tightly {
        the_whole_tick_runs_below(end, &elf);
    }
    stack_lies_below_all_variables(board, &elf);
    no_path_of_this_machine_is_in_flash(board, &elf);
    // The check is able to find: initialisation can panic.
    let whole = checks::check(&elf, Some("main"), Rules { single, whole_image: true }).unwrap();
    assert!(whole.faults.iter().any(|fault| fault.rule == Rule::Panic), "{:#?}", whole.faults);
    assert!(!CallGraph::read(&elf).unwrap().functions.is_empty());
}

/// From the interrupt on, nothing is fetched from flash; initialisation is, or this looked at nothing.
fn the_whole_tick_runs_below(end: u64, elf: &[u8]) {
    let graph = CallGraph::read(elf).unwrap();
    let elsewhere = |root: &str| {
        let mut reached = BTreeSet::new();
        let mut next = vec![graph.symbols[root]];
        while let Some(address) = next.pop() {
            if reached.insert(address) {
                next.extend(graph.functions[&address].calls.keys());
            }
        }
        let outside = reached.into_iter().filter(|address| *address >= end);
        outside.map(|address| graph.functions[&address].name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(elsewhere("TIM2"), Vec::<String>::new());
    assert!(elsewhere("main").len() > 10, "{:?}", elsewhere("main"));
}

/// An overflow runs out of memory instead of into a variable.
fn stack_lies_below_all_variables(board: &Board, elf: &[u8]) {
    use object::{Object, ObjectSection, ObjectSymbol};
    let file = object::File::parse(elf).unwrap();
    let symbol = |name: &str| file.symbol_by_name(name).unwrap_or_else(|| panic!("{name}")).address();
    let (start, end) = (symbol("_stack_start"), symbol("_stack_end"));
    assert_eq!((start, end), (0x2000_0000 + board.stack, 0x2000_0000), "{}", board.name);
    for name in [".data", ".bss", ".uninit"] {
        let section = file.section_by_name(name).unwrap_or_else(|| panic!("{name}"));
        assert!(section.address() >= start, "{}: {name} at {:#x}", board.name, section.address());
    }
}

/// What is flashed does not say where it was built. The same search finds paths in
/// the line information, which stays in the file, and the identity in flash.
fn no_path_of_this_machine_is_in_flash(board: &Board, elf: &[u8]) {
    use object::{Object, ObjectSection};
    let file = object::File::parse(elf).unwrap();
    let holds = |loaded: bool, text: &str| {
        let wanted = file.sections().filter(|section| (section.address() != 0) == loaded);
        wanted
            .map(|section| section.data().unwrap_or_default())
            .any(|bytes| bytes.windows(text.len()).any(|window| window == text.as_bytes()))
    };
    let here = repository().display().to_string();
    assert!(holds(false, "/src/") && holds(true, "specgen-identity"), "{}: the search finds nothing", board.name);
    for text in [&*here, "/src/", ".rs"] {
        assert!(!holds(true, text), "{}: `{text}` is in flash", board.name);
    }
}

#[test]
fn every_board_is_tested() {
    assert_eq!(BOARDS.map(|board| board.folder), [H743.folder, F446.folder]);
}

/// `specgen build` runs it on the emulated core, to estimate the longest tick; the full run does so.
#[test]
#[ignore = "long: a program of a real board"]
fn the_program_that_times_a_tick_is_built() {
    program_of(&H743, "tick");
}

#[test]
#[ignore = "long: images of real boards"]
fn the_stm32h743_image_fits_and_its_tick_cannot_fail() {
    check(&H743);
    own_board_builds();
}

/// As docs/images.md says it, with what the folder's own `.cargo/config.toml` says and no flag of specgen's.
#[test]
#[ignore = "long: images of real boards"]
fn a_folder_of_a_board_is_built_by_hand() {
    let Some(toolchain) = target::found_or_skipped(toolchain::find()).unwrap_or_else(|missing| panic!("{missing}"))
    else {
        return;
    };
    for board in [&H743, &F446] {
        let compiled = compile_edited(board.name, "reference.toml", board.edits, &[]);
        let dir = scratch(board.name);
        let files = workspace::files_with(&compiled.ir, &emit::emit(&compiled.ir), &[board.folder]);
        workspace::write_scratch(&dir, &files).unwrap();
        let mut cargo = Command::new(&toolchain.cargo);
        cargo.current_dir(dir.join(board.folder)).args(["build", "--release", "--locked"]);
        for name in
            ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_TARGET", "CARGO_TARGET_DIR", "RUSTUP_TOOLCHAIN"]
        {
            cargo.env_remove(name);
        }
        cargo.env("RUSTC", &toolchain.rustc);
        if toolchain.core == CoreLibrary::FromSource {
            // A compiler that has the target's library in source.
            cargo.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
        }
        if let Some(linker) = &toolchain.linker {
            cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker);
        }
        let output = cargo.output().unwrap();
        assert!(output.status.success(), "{}: {}", board.name, String::from_utf8_lossy(&output.stderr));
        let elf = fs::read(dir.join(board.folder).join("target/thumbv7em-none-eabihf/release/firmware")).unwrap();
        let rules = Rules { single: !board.mcu().part().double, whole_image: false };
        let faults = checks::check(&elf, Some("TIM2"), rules).unwrap().faults;
        assert!(faults.is_empty(), "{}: {faults:#?}", board.name);
        let config = fs::read_to_string(dir.join(board.folder).join(".cargo/config.toml")).unwrap();
        let chip = board.mcu().part().chip.unwrap();
        assert!(config.contains(&format!("runner = \"probe-rs run --chip {chip}")), "{config}");
    }
}

#[test]
#[ignore = "long: images of real boards"]
fn the_stm32f446_image_fits_and_its_tick_cannot_fail_nor_compute_doubles() {
    check(&F446);
}

/// The sizes and limits in docs/boards.md are those of the images above.
#[test]
fn the_page_says_what_the_images_take() {
    let row = |board: &Board| {
        let Board { name, flash, ram, stack, .. } = board;
        let taken = [FLASH, RAM, STACK].map(|what| figures::figure("boards.json", name, what));
        let most = [*flash, *ram, *stack].map(group);
        let columns = taken.iter().zip(most).map(|(taken, most)| format!("{taken} of {most} bytes"));
        format!("| {} | {} |", board.mcu().part().board, columns.collect::<Vec<_>>().join(" | "))
    };
    figures::shown("boards.md", &[row(&H743), row(&F446)]);
    for (board, signs) in [(&H743, "48 µs on the H743"), (&F446, "95 µs on the F446")] {
        let source = repository().join("firmware").join(board.folder).join("src/clocks.rs");
        let nanoseconds = signs.split(' ').next().unwrap().to_owned() + "_000";
        assert!(fs::read_to_string(source).unwrap().contains(&format!("const OUTPUT: u32 = {nanoseconds};")));
        for page in ["boards.md", "porting.md"] {
            let text = fs::read_to_string(repository().join("docs").join(page)).unwrap();
            assert!(text.contains(signs), "docs/{page}: {signs}");
        }
    }
}

/// Names of pins of an STM32 (`PA5`) in a text, in order.
fn pins(text: &str) -> BTreeSet<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    let is_pin = |word: &&str| {
        let mut letters = word.chars();
        letters.next() == Some('P')
            && letters.next().is_some_and(|port| ('A'..='I').contains(&port))
            && !letters.as_str().is_empty()
            && letters.as_str().chars().all(|c| c.is_ascii_digit())
    };
    words.filter(is_pin).map(str::to_owned).collect()
}

/// What an engineer wires by is what the program drives, in both directions; the line that the emergency contact takes away is
/// the one that is called enable.
#[test]
fn the_wiring_table_is_that_of_the_programs() {
    let page = fs::read_to_string(repository().join("docs/bring-up.md")).unwrap();
    let table: Vec<Vec<&str>> = page
        .lines()
        .skip_while(|line| !line.starts_with("| signal |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    assert_eq!(table.len(), 19);
    for (board, column) in [(&H743, 3), (&F446, 4)] {
        let source = repository().join("firmware").join(board.folder).join("src/pins.rs");
        let program = fs::read_to_string(source).unwrap();
        let wired: BTreeSet<String> = table.iter().flat_map(|row| pins(row[column])).collect();
        // `Pin(GPIOE, 11)` is PE11.
        let driven = |code: &str| pins(&code.replace("(GPIO", " P").replace(", ", ""));
        assert_eq!(wired, driven(&program), "{}", board.folder);
        let guarded = program.lines().find(|line| line.contains("enable::guarded")).unwrap();
        let (line, contact) = guarded.split_once(", Pin").unwrap();
        for (name, code) in [("**ENABLE**", line), ("STOP", contact)] {
            let row = table.iter().find(|row| row[1] == name).unwrap();
            assert_eq!(pins(row[column]), driven(code), "{}: {name}", board.folder);
        }
    }
    let program = fs::read_to_string(repository().join("firmware/stm32/program.rs")).unwrap();
    assert!(program.contains("enable::off();"), "a fault handler disables the amplifiers");
}
