//! Lists the files that are copied into outputs, each source behind a line with its licence: all files in these folders and in those
//! of boards, except tests and nested packages. Their texts are packed: 2.3 MB are 0.6 MB of the program.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Folders in the repository. In an output they are side by side under their own names.
const FOLDERS: [&str; 13] = [
    "firmware/board",
    "firmware/hal",
    "firmware/host",
    "firmware/law",
    "firmware/link",
    "firmware/qemu",
    "firmware/rt",
    "firmware/rt-pc",
    "firmware/runtime",
    "firmware/stm32",
    "firmware/tick",
    "host-sim",
    "host-sim/unit",
];

/// Folder of the boards: packages with a table `package.metadata.board`.
const FIRMWARE: &str = "../../firmware";

/// Extensions of copied files; others may be left by an editor.
const KINDS: [&str; 7] = ["csv", "json", "lock", "md", "rs", "toml", "x"];

/// First line of a copied source file.
const LICENCE: &str = "SPDX-License-Identifier: MIT OR Apache-2.0";

fn main() -> io::Result<()> {
    let (mut text, mut all) = (String::new(), String::new());
    let mut folders = FOLDERS.map(str::to_owned).to_vec();
    // The text of `target.mcu` names every board.
    println!("cargo:rerun-if-changed=../language/src/model/target.rs");
    for entry in fs::read_dir(FIRMWARE)? {
        let entry = entry?;
        let manifest = fs::read_to_string(entry.path().join("Cargo.toml")).unwrap_or_default();
        if manifest.contains("[package.metadata.board]") {
            folders.push(format!("firmware/{}", entry.file_name().to_string_lossy()));
        }
    }
    folders.sort();
    text.push_str("/// Of each folder: paths below the workspace, each with the bytes of its text.\n");
    text.push_str("const FOLDERS: &[(&str, &[(&str, usize)])] = &[\n");
    for place in folders {
        let folder = Path::new("../..").join(&place).canonicalize()?;
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut files = Vec::new();
        collect(&folder, &mut files)?;
        // Cargo may leave a lock file in a member of some other workspace.
        let is_workspace = fs::read_to_string(folder.join("Cargo.toml"))?.contains("[workspace]");
        files.retain(|file| is_workspace || !file.ends_with("Cargo.lock"));
        // The tests of the simulator have further dependencies.
        files.retain(|file| place.starts_with("firmware") || !file.ends_with("tests.rs"));
        files.sort();
        let _ = writeln!(text, "({name:?}, &[");
        for file in &files {
            println!("cargo:rerun-if-changed={}", file.display());
            let inner = Path::new(&name).join(file.strip_prefix(&folder).unwrap_or(file));
            let start = all.len();
            match inner.extension().and_then(|kind| kind.to_str()) {
                Some("rs") => all += &format!("// {LICENCE}\n"),
                Some("x") => all += &format!("/* {LICENCE} */\n"),
                _ => {}
            }
            all += &fs::read_to_string(file)?;
            let _ = writeln!(text, "({inner:?}, {}),", all.len() - start);
        }
        text.push_str("]),\n");
    }
    // What the studies write: the record of the paper's specs, and the versions of an FMU's packages.
    text.push_str("(\"repository\", &[");
    for name in ["specs/records/reference-forc.csv", "Cargo.lock"] {
        let file = Path::new("../..").join(name);
        println!("cargo:rerun-if-changed={}", file.display());
        let start = all.len();
        all += &fs::read_to_string(file)?;
        let _ = write!(text, "({name:?}, {}), ", all.len() - start);
    }
    text.push_str("])];\n");
    let out = env::var_os("OUT_DIR").map(PathBuf::from).unwrap_or_default();
    fs::write(out.join("files.deflate"), miniz_oxide::deflate::compress_to_vec(all.as_bytes(), 6))?;
    fs::write(out.join("files.rs"), text)
}

/// Files below a folder. A new file in a folder inside it reruns the script.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            if path.ends_with("tests") || path.ends_with("target") || path.join("Cargo.toml").is_file() {
                continue;
            }
            println!("cargo:rerun-if-changed={}", path.display());
            collect(&path, files)?;
        } else if path.extension().is_some_and(|kind| KINDS.iter().any(|of| kind == *of)) {
            files.push(path);
        }
    }
    Ok(())
}
