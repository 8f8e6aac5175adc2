//! From a workspace to measured figures, on a dummy controller: build, replay, footprint, stack bound.
//!
//! Needs a cross compiler and QEMU; without them it skips.

mod faults;
mod fixture;

use crate::support::{length, skipped, tools};
use fixture::{INPUT_WORDS, OUTPUT_WORDS, Workspace, expected, target_dir};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::model::Mcu;
use specgen::target::stack::{STEP_SYMBOL, StackBound, bound};
use specgen::target::{self, Image, TargetError, build_image, replay};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

fn build(workspace: &Workspace, mcu: Mcu) -> Image {
    build_image(workspace.dir(), mcu, &target_dir()).unwrap_or_else(|error| panic!("{error}"))
}

fn step_bound(image: &Image) -> StackBound {
    bound(&image.elf, STEP_SYMBOL).unwrap()
}

fn config() -> Vec<u64> {
    vec![0.631_f64.to_bits(), 0.25_f64.to_bits()]
}

/// Rows of numbers in −1..1.
fn inputs(ticks: usize) -> Vec<Vec<u64>> {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut word = || (random.next_u64() as i64 as f64 / i64::MAX as f64).to_bits();
    (0..ticks).map(|_| (0..INPUT_WORDS).map(|_| word()).collect()).collect()
}

#[test]
fn both_parts_compute_the_same_bits_as_this_machine() {
    let Some(tools) = tools() else { return };
    let workspace = Workspace::new(&tools, "", "-0.0");
    // Two whole batches of the firmware and a part of one.
    let rows = inputs(700);
    let (outputs, digests) = expected(&config(), &rows);
    for mcu in [Mcu::Mps2An500, Mcu::Mps2An386] {
        let image = build(&workspace, mcu);
        let result = replay(&image, &config(), &rows, LIMIT).unwrap();
        assert_eq!(result.outputs, outputs, "{mcu:?}");
        assert_eq!(result.digests, digests, "{mcu:?}");
        assert_eq!(result.stats.ticks, 700);
        assert_eq!(result.stats.output_words, OUTPUT_WORDS);
        assert_eq!(result.stats.state_bytes, 56);
        let again = replay(&image, &config(), &rows, LIMIT).unwrap();
        assert_eq!(again, result, "{mcu:?}: counts and depth must repeat exactly");

        let stack = step_bound(&image);
        assert!(stack.is_complete(), "{mcu:?}: {stack:?}");
        assert!(result.stats.painted_stack > 0 && result.stats.painted_stack <= stack.bytes, "{stack:?}");
        let memory = target::image::footprint(&image.elf).unwrap();
        assert_eq!((memory.panic_symbols.len(), memory.allocator_symbols.len()), (0, 0), "{memory:?}");
    }
}

#[test]
#[ignore = "long: two images; the committed counts are held in the test run"]
fn instructions_are_counted_exactly() {
    let Some(tools) = tools() else { return };
    let mean = |nops: usize| {
        let items = format!(
            "#[inline(never)] fn nops() {{ unsafe {{ core::arch::asm!(\".rept {nops}\", \"nop\", \".endr\") }} }}"
        );
        let image = build(&Workspace::new(&tools, &items, "{ nops(); -0.0 }"), Mcu::Mps2An500);
        let result = replay(&image, &config(), &inputs(40), LIMIT).unwrap();
        let step = result.stats.stage("step").unwrap().clone();
        assert_eq!((step.calls, step.smallest), (40, step.largest), "nothing in it depends on the data");
        assert_eq!(step.sum, 40 * step.smallest);
        let other = result.stats.stage("setpoint").unwrap();
        // Parts are measured only in some ticks.
        assert!((1..=40).contains(&other.calls) && other.smallest == other.largest, "{other:?}");
        assert!((8..30).contains(&other.smallest), "6 additions, loads and stores of several at once: {other:?}");
        step.smallest
    };
    assert_eq!(mean(777) - mean(100), 677);
}

#[test]
#[ignore = "long: an image of its own"]
fn the_painted_stack_meets_the_static_bound_of_a_deep_call() {
    let Some(tools) = tools() else { return };
    let items = "#[inline(never)] fn deep(seed: f64) -> f64 {
        let mut room = [seed; 300];
        core::hint::black_box(&mut room);
        room[7]
    }";
    let image = build(&Workspace::new(&tools, items, "deep(input.setpoint[0])"), Mcu::Mps2An500);
    let stack = step_bound(&image);
    assert!(stack.is_complete(), "{stack:?}");
    assert!(stack.path.iter().any(|(name, frame)| name.contains("deep") && *frame >= 2400), "{stack:?}");
    let painted = replay(&image, &config(), &inputs(3), LIMIT).unwrap().stats.painted_stack;
    assert!((2400..=stack.bytes).contains(&painted), "painted {painted}, bound {}", stack.bytes);
}

#[test]
fn frames_read_from_instructions_are_those_of_the_compiler() {
    let Some(tools) = tools() else { return };
    let workspace = Workspace::new(&tools, "", "-0.0");
    for mcu in [Mcu::Mps2An500, Mcu::Mps2An386] {
        let graph = target::callgraph::CallGraph::read(&build(&workspace, mcu).elf).unwrap();
        let said: Vec<_> = graph.functions.values().filter(|f| f.from_compiler).collect();
        assert!(said.len() >= 5, "{said:?}");
        for function in said {
            assert_eq!(function.frame, function.pushed, "{mcu:?} {function:?}");
        }
    }
}

#[test]
#[ignore = "long: an image of its own"]
fn what_no_bound_can_follow_is_reported() {
    let Some(tools) = tools() else { return };
    let items = "
        #[inline(never)] fn even(n: u32) -> u32 { if n == 0 { 1 } else { odd(core::hint::black_box(n - 1)) ^ 2 } }
        #[inline(never)] fn odd(n: u32) -> u32 { if n == 0 { 3 } else { even(core::hint::black_box(n - 1)) ^ 4 } }
        #[inline(never)] fn either(n: u32) -> f64 {
            let table: [fn(u32) -> u32; 2] = core::hint::black_box([even, odd]);
            table[n as usize & 1](n) as f64
        }
        core::arch::global_asm!(\".thumb_func\", \".type bare,%function\", \".globl bare\", \"bare: mov r3, sp; mov sp, r3; bx lr\", \".size bare, . - bare\");
        unsafe extern \"C\" { fn bare(); }";
    let extra = "{ unsafe { bare() }; even(7) as f64 + either(input.setpoint[0] as u32) }";
    let image = build(&Workspace::new(&tools, items, extra), Mcu::Mps2An500);
    let stack = step_bound(&image);
    assert!(!stack.is_complete());
    let cycle: Vec<&str> =
        stack.recursion.first().unwrap().iter().map(|name| name.rsplit(':').next().unwrap()).collect();
    assert!(cycle == ["even", "odd"] || cycle == ["odd", "even"], "{stack:?}");
    assert!(stack.indirect.iter().any(|name| name.ends_with("either")), "{stack:?}");
    assert_eq!(stack.unsized_functions, ["bare"], "{stack:?}");
    assert_eq!(stack.strays.len(), 0, "{stack:?}");
}

#[test]
#[ignore = "long: an image of its own"]
fn constants_of_the_controller_count_as_flash() {
    let Some(tools) = tools() else { return };
    let items = "static TABLE: [u32; 5000] = { let mut t = [0; 5000]; let mut i = 0; while i < 5000 { t[i] = (i * i) as u32; i += 1; } t };";
    let extra = "f64::from(TABLE[(input.setpoint[0].to_bits() % 5000) as usize])";
    let plain = build(&Workspace::new(&tools, "", "-0.0"), Mcu::Mps2An500);
    let with_table = build(&Workspace::new(&tools, items, extra), Mcu::Mps2An500);
    let (plain, with_table) =
        (target::image::footprint(&plain.elf).unwrap(), target::image::footprint(&with_table.elf).unwrap());
    let gained = with_table.constants - plain.constants;
    assert!((20_000..20_100).contains(&gained), "{plain:?} {with_table:?}");
    assert_eq!(with_table.flash - plain.flash, gained + with_table.code - plain.code);
    assert_eq!(with_table.ram, plain.ram);
}

#[test]
fn a_panic_path_is_refused_in_our_words_on_both_machines() {
    let Some(tools) = tools() else { return };
    let items = "static TABLE: [f64; 3] = [1.0, 2.0, 3.0];
fn lookup(x: f64) -> f64 {
    /* the line that the test looks for */ TABLE[x as usize]
}";
    let workspace = Workspace::new(&tools, items, "lookup(input.setpoint[0])");
    let error = build_image(workspace.dir(), Mcu::Mps2An500, &target_dir()).unwrap_err();
    assert!(matches!(error, TargetError::PanicPath { .. }), "{error}");
    let message = error.to_string();
    assert!(message.contains("unchecked index"), "{message}");
    let source = std::fs::read_to_string(workspace.dir().join("controller/src/lib.rs")).unwrap();
    let line = 1 + source.lines().position(|line| line.contains("the test looks for")).unwrap();
    assert!(message.contains(&format!("controller/src/lib.rs:{line}, inlined at ")), "{message}");
    println!("{message}");
    assert!(!error.is_of_a_tool());
    if length(true, false) {
        return skipped("only in the full run: a panic path in the host library");
    }
    let error = target::host::build_library(workspace.dir(), &target_dir()).unwrap_err();
    assert!(matches!(error, TargetError::PanicPath { .. }), "{error}");
}

#[test]
#[ignore = "long: two libraries"]
fn the_host_library_is_built_and_later_builds_leave_it_alone() {
    let Some(tools) = tools() else { return };
    let first = target::host::build_library(Workspace::new(&tools, "", "1.5").dir(), &target_dir()).unwrap();
    let bytes = std::fs::read(&first).unwrap();
    let second = target::host::build_library(Workspace::new(&tools, "", "2.5").dir(), &target_dir()).unwrap();
    assert_ne!(first, second);
    assert_eq!(std::fs::read(&first).unwrap(), bytes);
    let symbols = target::image::exported(&bytes).unwrap();
    assert_eq!(symbols, ["specgen_step"]);
}

#[test]
fn a_compile_error_is_shown_without_the_noise() {
    let Some(tools) = tools() else { return };
    let workspace = Workspace::new(&tools, "", "no_such_name");
    let error = build_image(workspace.dir(), Mcu::Mps2An500, &target_dir()).unwrap_err();
    let TargetError::BuildFailed { what, text } = &error else { panic!("{error}") };
    assert!(what.contains("mps2-an500"), "{what}");
    assert!(text.starts_with("error[E0425]") && text.contains("no_such_name"), "{text}");
}

#[test]
fn requests_that_do_not_fit_are_explained() {
    let Some(tools) = tools() else { return };
    let extra = "{
        while input.setpoint[0] == 42.0 { core::hint::black_box(()); }
        if input.setpoint[0] == 43.0 { for i in 0..400_000 { core::hint::black_box(i); } }
        0.0
    }";
    // In the short run, use the image of other tests.
    let extra = length("-0.0", extra);
    let image = build(&Workspace::new(&tools, "", extra), Mcu::Mps2An500);
    let refused = |config: &[u64], rows: &[Vec<u64>]| replay(&image, config, rows, LIMIT).unwrap_err().to_string();

    assert!(refused(&[config()[0], 0], &inputs(1)).contains("word 1 of the configuration"));
    assert!(refused(&config()[..1], &inputs(1)).contains("config.bin"));
    assert!(refused(&[0, 0, 0], &inputs(1)).contains("config.bin"));
    assert!(refused(&config(), &[vec![0; 12], vec![0; 11]]).contains("input row 1 has 11 words"));
    assert!(refused(&config(), &[vec![0; 5]]).contains("ends within a row"));
    assert!(refused(&config(), &[vec![0; 6], vec![0; 6]]).contains("the controller takes 12"));
    let nothing = replay(&image, &config(), &[], LIMIT).unwrap();
    assert_eq!((nothing.outputs.len(), nothing.stats.ticks), (0, 0));

    if length(true, false) {
        return skipped("only in the full run: a tick that is too long or never ends");
    }
    assert!(refused(&config(), &[vec![43.0_f64.to_bits(); 12]]).contains("655,000"));
    let endless = replay(&image, &config(), &[vec![42.0_f64.to_bits(); 12]], Duration::from_secs(2)).unwrap_err();
    assert!(matches!(endless, TargetError::EmulatorTimeout { seconds: 2 }), "{endless}");
}

#[test]
fn damaged_images_are_refused_not_read() {
    let Some(tools) = tools() else { return };
    let image = build(&Workspace::new(&tools, "", "-0.0"), Mcu::Mps2An500);
    assert!(matches!(bound(&image.elf, "absent"), Err(TargetError::MalformedImage { .. })));
    assert!(matches!(bound(b"not an image", STEP_SYMBOL), Err(TargetError::MalformedImage { .. })));
    // Any prefix: an error or a result, never a panic.
    for length in (0..image.elf.len()).step_by(997) {
        let _ = bound(&image.elf[..length], STEP_SYMBOL);
        let _ = target::image::footprint(&image.elf[..length]);
    }
}
