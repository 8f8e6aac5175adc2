//! Every `unsafe` of what is shipped says why it is sound. Clippy asks that of blocks and implementations where it runs; this, of
//! functions and foreign ones too, and of the firmware that is built for other machines.

use std::path::{Path, PathBuf};

use specgen_tests::repository;

/// Hand-written sources, tests that are folders of their own left out.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let (path, name) = (entry.path(), entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            if name != "target" && name != "tests" {
                found.extend(sources(&path));
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found
}

/// Numbers of lines that begin something unsafe without a comment above it. Functions of an implementation that has one are part
/// of it.
fn undocumented(text: &str) -> Vec<usize> {
    let lines: Vec<&str> = text.lines().collect();
    let code = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    let opens = |line: &str| {
        let line = code(line);
        let begins = ["unsafe {", "unsafe impl", "unsafe fn", "unsafe extern"];
        // The type of a function is no function.
        begins.iter().any(|word| line.contains(word)) && !line.contains("unsafe extern \"C\" fn(")
    };
    let is_part = |line: &str| line.starts_with("    unsafe fn") && text.contains("\nunsafe impl");
    let is_said = |number: usize| {
        let above = lines[..number].iter().rev();
        // A statement may begin some lines above; what stands there ends it.
        let mut own = above.take_while(|line| {
            let line = line.trim();
            line.starts_with("//") || line.starts_with("#[") || !(line.is_empty() || line.ends_with([';', '{', '}']))
        });
        lines[number].contains("SAFETY") || own.any(|line| line.contains("SAFETY") || line.contains("# Safety"))
    };
    let unsafe_lines = (0..lines.len()).filter(|&number| opens(lines[number]) && !is_part(lines[number]));
    unsafe_lines.filter(|&number| !is_said(number)).map(|number| number + 1).collect()
}

#[test]
fn everything_unsafe_says_why_it_is_sound() {
    let root = repository();
    let files: Vec<PathBuf> =
        ["firmware", "codegen", "host-sim/src"].iter().flat_map(|folder| sources(&root.join(folder))).collect();
    let (mut seen, mut found) = (0, Vec::new());
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        seen += usize::from(text.contains("SAFETY"));
        let shown = file.strip_prefix(&root).unwrap().display().to_string();
        found.extend(undocumented(&text).into_iter().map(|line| format!("{shown}:{line}")));
    }
    assert!(seen > 15, "{seen} files with something unsafe");
    assert!(found.is_empty(), "no `// SAFETY:` comment above:\n{}", found.join("\n"));
}

#[test]
fn what_says_nothing_is_found() {
    let good = "// SAFETY: it lives.\nlet x =\n    unsafe { *p };\n";
    assert!(undocumented(good).is_empty());
    assert_eq!(undocumented("let x = 1;\nunsafe { f() }\n"), [2]);
    assert_eq!(undocumented("// SAFETY: of the first.\nunsafe { f() };\nunsafe { g() };\n"), [3]);
    assert_eq!(undocumented("/// Says nothing.\n#[inline]\nunsafe fn f() {}\n"), [3]);
    assert_eq!(undocumented("unsafe impl Send for A {}\n"), [1]);
    assert!(undocumented("// SAFETY: passed on.\nunsafe impl A for B {\n    unsafe fn f() {}\n}\n").is_empty());
    assert!(undocumented("type F = unsafe extern \"C\" fn(u8);\n").is_empty());
}
