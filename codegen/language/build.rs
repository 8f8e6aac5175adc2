//! Lists the boards: the packages in `firmware` whose manifest has the table `package.metadata.board`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

const FIRMWARE: &str = "../../firmware";
const TABLE: &str = "[package.metadata.board]\n";

fn main() -> io::Result<()> {
    // The text of `target.mcu` names every board; the folder itself would be read with all that is built in it.
    println!("cargo:rerun-if-changed=src/model/target.rs");
    let mut boards = Vec::new();
    for entry in fs::read_dir(FIRMWARE)? {
        let folder = entry?;
        let manifest = folder.path().join("Cargo.toml");
        if !manifest.is_file() {
            continue;
        }
        println!("cargo:rerun-if-changed={}", manifest.display());
        let text = fs::read_to_string(manifest)?;
        let Some((_, table)) = text.split_once(TABLE) else { continue };
        let name = folder.file_name().to_string_lossy().into_owned();
        // Those with a double-precision FPU first.
        boards.push((!table.contains("double = true"), name, table.to_owned()));
    }
    boards.sort();
    let mut text = format!("/// Every board.\npub const BOARDS: [&Part; {}] = [\n", boards.len());
    for (_, folder, table) in boards {
        let _ = write!(text, "&Part {{ folder: {folder:?}");
        // Keys are the fields, and values are written in TOML as in Rust.
        let lines = table.lines().take_while(|line| !line.starts_with('['));
        for (key, value) in lines.filter(|line| !line.starts_with('#')).filter_map(|line| line.split_once(" = ")) {
            let value = match value.as_bytes() {
                [b'[', ..] => format!("&{value}"),
                _ if key == "chip" => format!("Some({value})"),
                _ => value.to_owned(),
            };
            let _ = write!(text, ", {key}: {value}");
        }
        text += " },\n";
    }
    let out = env::var_os("OUT_DIR").map(PathBuf::from).unwrap_or_default();
    fs::write(Path::new(&out).join("boards.rs"), text + "];\n")
}
