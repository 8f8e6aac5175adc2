//! The crate that code belongs to, by the path of its source file.

/// Code without line information: assembly and precompiled libraries.
pub(super) const NO_LINES: &str = "without line information";

/// Crates of the compiler's library that an image may contain.
const LIBRARY: [&str; 5] = ["core", "alloc", "compiler-builtins", "stdarch", "portable-simd"];

/// The crate of a source file: the registry's `name-version`, the compiler's library, else the folder above `src`. Outer folders are ignored.
pub(super) fn crate_of_file(path: &str) -> String {
    source_of(path).0
}

/// The crate of a source file, and the path below its folder `src`.
pub(super) fn source_of(path: &str) -> (String, String) {
    let path = path.replace('\\', "/");
    let parts: Vec<&str> = path.split('/').collect();
    let from = |at: usize| parts.get(at..).unwrap_or_default().join("/");
    let part = |at: usize| parts.get(at).copied().unwrap_or_default();
    // `…/registry/src/INDEX/NAME-VERSION/…`.
    let package = parts.windows(2).rposition(|pair| pair == ["registry", "src"]).map(|at| at + 3);
    if let Some(at) = package.filter(|at| without_version(part(*at)) != part(*at)) {
        return (without_version(part(at)).to_owned(), from(at + 2));
    }
    // `…/rust/library/core/…`, with `rustc-1.96` or a digest in place of `rust`.
    let of_compiler = |at: usize| {
        let above = |by: usize| at.checked_sub(by).map_or("", part);
        above(1) == "rust" || above(1).starts_with("rustc") || above(2) == "rustc"
    };
    let library = parts.iter().rposition(|part| *part == "library").filter(|at| of_compiler(*at)).map(|at| at + 1);
    if let Some(at) = library.filter(|at| LIBRARY.contains(&part(*at))) {
        return (part(at).to_owned(), from(at + 2));
    }
    let source = parts.iter().rposition(|part| *part == "src");
    match source.map(|at| (at, at.checked_sub(1).map_or("", part))) {
        Some((at, folder)) if !folder.is_empty() && folder != "." => (folder.to_owned(), from(at + 1)),
        // Paths of the package being built start with `src`.
        Some((0, _)) => ("firmware".to_owned(), from(1)),
        _ => (NO_LINES.to_owned(), String::new()),
    }
}

/// `cortex-m-rt` of `cortex-m-rt-0.7.7`.
fn without_version(package: &str) -> &str {
    let mut end = package.len();
    for (at, _) in package.match_indices('-') {
        if package[at + 1..].starts_with(|c: char| c.is_ascii_digit()) {
            end = at;
            break;
        }
    }
    &package[..end]
}
