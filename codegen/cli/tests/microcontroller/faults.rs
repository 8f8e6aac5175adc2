//! Forbidden code planted in a tick is reported by name.

use super::fixture::Workspace;
use super::{build, tools};
use specgen::model::Mcu;
use specgen::target::checks::{Rule, Rules, TickChecks, check};
use specgen::target::size;

const M7: Rules = Rules { single: false, whole_image: true };
const M4F: Rules = Rules { single: true, whole_image: true };
/// A panic handler that links, as a board's does.
const HANDLER: &str = "#![allow(unsafe_code)]
#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    core::hint::black_box(info);
    loop { core::hint::spin_loop(); }
}
";
const PLANTED: &str = "
    static PRIMES: [f64; 3] = [2.0, 3.0, 5.0];
    #[inline(never)] fn unbounded_index(x: f64) -> f64 { PRIMES[x as usize] }
    #[inline(never)] fn by_pointer(n: u32) -> f64 {
        fn one(n: u32) -> u32 { n + 1 }
        fn two(n: u32) -> u32 { n * 2 }
        let table: [fn(u32) -> u32; 2] = core::hint::black_box([one, two]);
        table[n as usize & 1](n) as f64
    }
    static mut HEAP: [u8; 64] = [0; 64];
    #[unsafe(no_mangle)] #[inline(never)] pub extern \"C\" fn malloc(size: usize) -> *mut u8 {
        core::hint::black_box(size);
        (&raw mut HEAP).cast()
    }
    #[inline(never)] fn allocating(n: u32) -> f64 { malloc(n as usize) as usize as f64 }";
const EXTRA: &str = "{ let x = input.setpoint[0]; unbounded_index(x) + by_pointer(x as u32) + allocating(x as u32) }";

fn texts(checked: &TickChecks, rule: Rule) -> Vec<&str> {
    checked.faults.iter().filter(|fault| fault.rule == rule).map(|fault| fault.text.as_str()).collect()
}

#[test]
fn every_planted_fault_is_named_with_its_function_and_its_line() {
    let Some(tools) = tools() else { return };
    let workspace = Workspace::new(&tools, PLANTED, EXTRA);
    std::fs::write(workspace.dir().join("qemu/src/panic.rs"), HANDLER).unwrap();
    let image = build(&workspace, Mcu::Mps2An500);
    let checked = check(&image.elf, None, M7).unwrap();
    println!("{checked:#?}");
    let source = std::fs::read_to_string(workspace.dir().join("controller/src/lib.rs")).unwrap();
    let line_of = |text: &str| 1 + source.lines().position(|line| line.contains(text)).unwrap();

    let [panic] = texts(&checked, Rule::Panic)[..] else { panic!("{checked:#?}") };
    assert!(panic.starts_with("the tick can panic: specgen_step → ") && panic.contains("unbounded_index"), "{panic}");
    assert!(panic.contains(&format!("lib.rs:{}", line_of("PRIMES[x as usize]"))), "{panic}");
    let [allocation] = texts(&checked, Rule::Allocation)[..] else { panic!("{checked:#?}") };
    assert!(allocation.contains("→ malloc") && allocation.contains("allocating"), "{allocation}");
    let [indirect] = texts(&checked, Rule::IndirectCall)[..] else { panic!("{checked:#?}") };
    assert!(indirect.contains("by_pointer calls through a register"), "{indirect}");
    assert!(indirect.contains(&format!("lib.rs:{}", line_of("table[n as usize & 1](n)"))), "{indirect}");
    assert_eq!(checked.stack, None, "what is called through a register has no bound");
    // This core computes f64 itself.
    assert_eq!(texts(&checked, Rule::SoftDouble), Vec::<&str>::new());
}

#[test]
fn double_precision_in_a_tick_is_a_fault_where_the_core_has_none() {
    let Some(tools) = tools() else { return };
    // The dummy controller computes in f64.
    let workspace = Workspace::new(&tools, "", "-0.0");
    let m4f = build(&workspace, Mcu::Mps2An386);
    let checked = check(&m4f.elf, None, M4F).unwrap();
    assert!(checked.faults.iter().all(|fault| fault.rule == Rule::SoftDouble), "{checked:#?}");
    let named = texts(&checked, Rule::SoftDouble).join("\n");
    for operation in ["__aeabi_dmul", "__aeabi_dadd", "__aeabi_ddiv"] {
        assert!(named.contains(operation), "{operation}: {named}");
    }
    assert!(named.contains("controller/src/lib.rs:"), "{named}");
    // For a core with an f64 FPU the same image has no fault, and neither has that core's own image.
    assert_eq!(check(&m4f.elf, None, M7).unwrap().faults, []);
    let m7 = build(&workspace, Mcu::Mps2An500);
    assert_eq!(check(&m7.elf, None, M4F).unwrap().faults, []);
    let wrong = check(&m7.elf, Some("no_such_function"), M7).unwrap_err();
    assert!(wrong.to_string().contains("no_such_function"), "{wrong}");
}

#[test]
#[ignore = "long: an image of its own; that owners sum to the flash is a test of `build`"]
fn every_byte_of_flash_has_one_owner() {
    let Some(tools) = tools() else { return };
    let items = "pub static TABLE: [u32; 3000] = { let mut t = [0; 3000]; let mut i = 0; while i < 3000 { t[i] = (i * i) as u32; i += 1; } t };";
    let extra = "f64::from(TABLE[(input.setpoint[0].to_bits() % 3000) as usize])";
    let image = build(&Workspace::new(&tools, items, extra), Mcu::Mps2An500);
    let found = size::size(&image.elf).unwrap();
    println!("{found:#?}");
    let footprint = specgen::target::image::footprint(&image.elf).unwrap();
    assert_eq!((found.flash(), found.ram()), (footprint.flash, footprint.ram));
    assert_eq!(found.owners.iter().map(size::Owner::flash).sum::<u64>(), found.flash());
    let owner = |name: &str| found.owners.iter().find(|owner| owner.name == name).unwrap_or_else(|| panic!("{name}"));
    assert!(owner("controller").constants >= 12_000, "{found:#?}");
    assert!(owner("controller").code > 50 && owner("qemu").code > 500, "{found:#?}");
    // A dummy has no identity, and damaged files are refused.
    assert_eq!(found.identity, None);
    for length in (0..image.elf.len()).step_by(4999) {
        let _ = size::size(&image.elf[..length]);
        let _ = check(&image.elf[..length], None, M7);
    }
}
