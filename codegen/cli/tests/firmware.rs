//! `build`, `size` and `flash` as a user runs them, with a fake probe-rs that logs its arguments.
//!
//! Needs a cross compiler; without one it skips.

use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use crate::support::{Document, Folder, Run, length, tools};

/// Where images are built: kept between runs, so that `core` is compiled once.
fn target_dir() -> String {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("images").display().to_string()
}

/// A folder in front of `PATH` with a `probe-rs` that writes its arguments to `asked.txt` and ends with `status`.
fn fake_probe_rs(folder: &Folder, status: i32) -> OsString {
    fs::create_dir_all(folder.path("bin")).unwrap();
    let script = format!("#!/bin/sh\necho \"$@\" >> '{}'\nexit {status}\n", folder.path("asked.txt").display());
    folder.write("bin/probe-rs", script);
    fs::set_permissions(folder.path("bin/probe-rs"), fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::iter::once(folder.path("bin"))
        .chain(std::env::split_paths(&path).filter(|f| !f.join("probe-rs").exists()));
    std::env::join_paths(folders).unwrap()
}

/// `PATH` without a `probe-rs`.
fn without_probe_rs() -> OsString {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::env::split_paths(&path).filter(|folder| !folder.join("probe-rs").exists())).unwrap()
}

fn json(folder: &Folder, arguments: &[&str]) -> (i32, serde_json::Value) {
    let run = Run::of(folder.command().args(arguments).arg("--json"));
    let value: serde_json::Value =
        serde_json::from_str(&run.stdout).unwrap_or_else(|error| panic!("{error}: {run:#?}"));
    assert_eq!(run.stderr, "");
    (run.code, value)
}

#[test]
fn an_image_is_built_checked_weighed_and_only_flashed_if_it_passes() {
    if tools().is_none() {
        return;
    }
    let folder = Folder::new();
    let dir = target_dir();
    let build = ["build", "legs.toml", "--target", "qemu", "-o", "out", "--no-measure", "--target-dir", &dir];
    let run = folder.run(&build);
    assert_eq!(run.code, 0, "{run:#?}");
    for word in [
        "legs → out/target/qemu.elf for mps2-an500",
        "flash by owner",
        "controller",
        "no panic, no allocation",
        "stack: ",
    ] {
        assert!(run.stdout.contains(word), "no `{word}` in\n{}", run.stdout);
    }
    let (code, document) = json(&folder, &build);
    let made = &document["result"];
    assert_eq!((code, &made["failures"]), (0, &serde_json::json!([])));
    let flash = made["used"]["flash"].as_u64().unwrap();
    let owners = made["size"]["owners"].as_array().unwrap();
    let sum: u64 = owners.iter().map(|o| o["code"].as_u64().unwrap() + o["constants"].as_u64().unwrap()).sum();
    assert_eq!(sum, flash);

    // The image contains its origin, and the numbers are the same.
    let image = "out/target/qemu.elf";
    let size = folder.run(&["size", image]);
    assert_eq!(size.code, 0, "{size:#?}");
    let digest = made["digest"].as_str().unwrap();
    let identity = format!("made by specgen {}, platform legs, f64, spec {digest}", env!("CARGO_PKG_VERSION"));
    assert!(size.stdout.contains(&identity), "{}", size.stdout);
    assert!(size.stdout.contains("  assumed: geometry.base_radius, "), "{}", size.stdout);
    let (_, weighed) = json(&folder, &["size", image]);
    assert_eq!(weighed["result"]["size"], made["size"]);
    assert_eq!(weighed["result"]["checks"], made["checks"]);

    // Over budget: the largest parts, and by how much to shrink. It is another image; the short run has the words in `budgets`.
    if length(false, true) {
        folder.spec("tight.toml", &[("flash        = \"128 KiB\"", &format!("flash = \"{} B\"", flash - 10))]);
        let tight = ["build", "tight.toml", "--target", "qemu", "-o", "tight", "--no-measure", "--target-dir", &dir];
        folder.run(&tight).says(1, &["target.budget.flash allows", "reduce it by 10", "largest: "]);
        let (code, document) = json(&folder, &tight);
        assert_eq!((code, document["result"]["failures"].as_array().unwrap().len()), (1, 1), "{document:#}");
    }

    flashing(&folder, image);
}

/// Writes the image with one text replaced, which must occur once.
fn edited(folder: &Folder, image: &str, name: &str, from: &[u8], to: &[u8]) {
    let mut bytes = fs::read(folder.path(image)).unwrap();
    let places: Vec<usize> = bytes.windows(from.len()).enumerate().filter(|at| at.1 == from).map(|at| at.0).collect();
    assert_eq!((places.len(), from.len()), (1, to.len()), "{}", String::from_utf8_lossy(from));
    bytes[places[0]..][..to.len()].copy_from_slice(to);
    folder.write(name, bytes);
}

/// The image of the emulated machine, under the name of a board: to probe-rs it is a file.
fn flashing(folder: &Folder, emulated: &str) {
    let image = "board.elf";
    let own = b"specgen-board: qemu     \n";
    edited(folder, emulated, image, own, b"specgen-board: stm32h743\n");
    edited(folder, emulated, "nameless.elf", own, b"specgen-board: esp32    \n");
    let flash = |path: &OsString, arguments: &[&str]| {
        Run::of(folder.command().env("PATH", path).args(["flash", image]).args(arguments))
    };
    let unasked = ["--yes"];
    let board = ["--yes", "--assumed-ok"];
    let commands = [format!("download --chip STM32H743ZITx --verify {image}"), "reset --chip STM32H743ZITx".to_owned()];
    // Without probe-rs: what is missing, and the exact commands.
    let bare = without_probe_rs();
    let missing = flash(&bare, &board);
    missing.says(3, &["probe-rs is not installed", "cargo install probe-rs-tools", &commands[0], &commands[1]]);

    let path = fake_probe_rs(folder, 0);
    let asked = || fs::read_to_string(folder.path("asked.txt")).unwrap_or_default();
    // Without confirmation that the amplifiers are off.
    flash(&path, &["--assumed-ok"]).says(2, &["switch the amplifiers off", "--yes"]);
    // The image contains the assumed values of its spec, and that its record is simulated.
    let known = ["E0348", "geometry.base_radius, ", "records/reference-forc.csv (simulated)", "nothing was flashed"];
    flash(&path, &unasked).says(1, &known);
    // The image determines its board, not an argument; the emulated machine is not a board.
    let other =
        ["nothing was flashed: board.elf is for stm32h743, not for stm32f4", "specgen build SPEC --target stm32f4"];
    flash(&path, &[&board[..], &["--target", "stm32f4"]].concat()).says(2, &other);
    flash(&path, &[&board[..], &["--target", "qemu"]].concat()).says(2, &["is for stm32h743, not for qemu"]);
    for (image, words) in [(emulated, "qemu is not a board"), ("nameless.elf", "does not name its board")] {
        let refused = Run::of(folder.command().env("PATH", &path).args(["flash", image]).args(board));
        refused.says(2, &["nothing was flashed", words]);
    }
    let size = folder.run(&["size", image]);
    assert!(size.stdout.contains(", for stm32h743\n"), "{}", size.stdout);
    assert_eq!(asked(), "", "nothing may have been flashed so far");
    // An image that fails a check is not flashed.
    edited(folder, image, "spoilt.elf", b"specgen-identity: ", b"specgen-identitx: ");
    let refused = Run::of(folder.command().env("PATH", &path).args(["flash", "spoilt.elf"]).args(board));
    refused.says(1, &["no specgen identity line", "nothing was flashed"]);
    assert_eq!(asked(), "");

    let done = flash(&path, &[&board[..], &["--target", "stm32h743"]].concat());
    assert_eq!(done.code, 0, "{done:#?}");
    assert!(done.stdout.contains("verified and restarted"), "{}", done.stdout);
    assert_eq!(asked(), format!("{}\n{}\n", commands[0], commands[1]));
    let probe = flash(&path, &[&board[..], &["--probe", "0483:374e:1"]].concat());
    assert_eq!(probe.code, 0, "{probe:#?}");
    assert!(asked().contains("--verify --probe 0483:374e:1 board.elf"), "{}", asked());
    let chosen = ["--speed", "500", "--connect-under-reset"];
    let slow = flash(&path, &[&board[..], &chosen].concat());
    assert_eq!(slow.code, 0, "{slow:#?}");
    let both = [
        "download --chip STM32H743ZITx --verify --speed 500 --connect-under-reset board.elf",
        "reset --chip STM32H743ZITx --speed 500 --connect-under-reset",
    ];
    assert!(asked().ends_with(&format!("{}\n", both.join("\n"))), "{}", asked());
    flash(&path, &[&board[..], &["--speed", "0"]].concat()).says(2, &["--speed"]);
    // It fails half-way, with the command to run again.
    let failing = fake_probe_rs(folder, 5);
    flash(&failing, &board).says(3, &["probe-rs failed", "keep the amplifiers", &commands[0]]);
}

#[test]
fn what_does_not_fit_together_is_refused_before_anything_is_built() {
    let folder = Folder::new();
    let flash = folder.run(&["flash", "legs.toml", "-o", "unwritten"]);
    flash.says(2, &["qemu is not a board", "--target stm32h743"]);
    assert!(!folder.path("unwritten").exists());
    let before = folder.listing();
    folder
        .run(&["build", "legs.toml", "--target", "esp32"])
        .says(2, &["esp32", "host, qemu, stm32h743, stm32f4, rt-pc"]);
    folder.run(&["build"]).says(2, &["<SPEC>"]);
    folder.run(&["size"]).says(2, &["<SPEC|ELF>"]);
    folder.run(&["flash", "absent.toml", "--yes"]).says(1, &["E0101"]);
    // A board with another core than the spec's.
    let wrong = folder.run(&["build", "legs.toml", "--target", "stm32f4"]);
    wrong.says(1, &["E0333", "the spec is for mps2-an500 (cortex-m7)", "mcu = \"stm32f446re\"", "scalar = \"f32\""]);
    let document =
        Document::of(&Run::of(folder.command().args(["build", "legs.toml", "--target", "stm32f4", "--json"])));
    assert!(document.finding("E0333")["line"].as_u64().unwrap() > 1);
    // A file that only starts like an image.
    folder.write("broken.elf", b"\x7fELF and no more");
    folder.run(&["size", "broken.elf"]).says(3, &["cannot be analysed"]);
    fs::remove_file(folder.path("broken.elf")).unwrap();
    assert_eq!(folder.listing(), before);
}

#[test]
fn an_image_of_this_machine_is_weighed_without_the_checks_of_another() {
    let folder = Folder::new();
    let own: PathBuf = std::env::current_exe().unwrap();
    let run = folder.run(&["size", &own.display().to_string()]);
    assert_eq!(run.code, 0, "{run:#?}");
    assert!(run.stdout.contains("flash by owner") && run.stdout.contains("only for Cortex-M images"), "{}", run.stdout);
}
