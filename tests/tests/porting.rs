//! docs/porting.md: a board of one's own, in a crate outside of what specgen generates, is built against what it generates.

use std::fs;
use std::path::Path;

use specgen::emit;
use specgen::model::Mcu;
use specgen::target::checks::{self, Rules};
use specgen::target::{build, toolchain};
use specgen::workspace;
use specgen_tests::{compile_edited, image_target, kept, repository};

/// As of the page: the board in `examples/own-board` beside a generated folder, on an ADC of 16 bits.
const EDITS: &[(&str, &str)] = &[("mcu = \"mps2-an500\"", "mcu = \"stm32h743zi\""), ("bits  = 17", "bits  = 16")];

/// Builds both programs of the example; its tick cannot fail. Called by the test of the generated board of the same part, which says so
/// where there is no cross compiler.
pub fn own_board_builds() {
    let Ok(toolchain) = toolchain::find() else { return };
    let compiled = compile_edited("own-board", "reference.toml", EDITS, &[]);
    let dir = kept("own-board");
    let _ = fs::remove_dir_all(&dir);
    let files = workspace::files_with(&compiled.ir, &emit::emit(&compiled.ir), &["board"]);
    workspace::write_scratch(&dir.join("generated"), &files).unwrap();
    copy(&repository().join("examples/own-board"), &dir.join("own-board"));
    let mcu = Mcu::named("stm32h743zi").unwrap();
    let built = build::build_folder(&toolchain, &dir, "own-board", mcu, &image_target(), false);
    let elf = built.unwrap_or_else(|error| panic!("{error}")).elf;
    let checked = checks::check(&elf, Some("specgen_tick"), Rules { single: false, whole_image: false }).unwrap();
    assert!(checked.faults.is_empty(), "{:#?}", checked.faults);
    assert!(checked.functions > 20, "{} functions", checked.functions);
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            // Where somebody has built it in place.
            if entry.file_name() != "target" {
                copy(&path, &target);
            }
        } else {
            fs::copy(path, target).unwrap();
        }
    }
}
