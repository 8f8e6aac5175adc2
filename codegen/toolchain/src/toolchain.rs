//! Finds a cross compiler.
//!
//! In this order, without changing any configuration:
//! 1. the `rustc` on `PATH` has the target installed (`rustup target add`);
//! 2. the `rustc` on `PATH` has its sources (`rustup component add rust-src`): `core` is built from them;
//! 3. a `rustc` further down `PATH` or in `/usr/bin`, such as Debian's `rustc-web cargo-web rust-web-src`: likewise;
//! 4. the same packages, unpacked by [`provision`](super::provision).
//!
//! Building `core`, `-Z emit-stack-sizes` and `-Z location-detail` are unstable, so `RUSTC_BOOTSTRAP=1` is set for these builds
//! only. The linker is `rust-lld` of that compiler or of the one on `PATH`, or LLVM's `ld.lld`.

use super::TRIPLE;
use super::error::TargetError;
use super::places::Places;
use super::process::{clean_command, first_line, with_libraries};
use std::path::PathBuf;
use std::process::Command;

/// Name of the linker in [`TargetError::MissingTool`].
pub(super) const LINKER: &str = "a linker for ARM images";

/// Where `core` for the target comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoreLibrary {
    /// Installed with the compiler. Its assembly and `compiler_builtins` have no stack sizes.
    Installed,
    /// Built from the compiler's sources together with the image.
    FromSource,
}

/// A compiler for the target, with its cargo and linker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Toolchain {
    /// The compiler.
    pub rustc: PathBuf,
    /// Its cargo.
    pub cargo: PathBuf,
    /// The linker, if the compiler has none of its own.
    pub linker: Option<PathBuf>,
    /// Where `core` comes from.
    pub core: CoreLibrary,
    /// `rustc --version`.
    pub version: String,
    /// Folders of the compiler's libraries, if the loader does not find them.
    pub libraries: Vec<PathBuf>,
}

/// A compiler to be checked.
#[derive(Debug, Clone)]
struct Candidate {
    rustc: PathBuf,
    cargo: PathBuf,
    libraries: Vec<PathBuf>,
}

/// Debian's packages of a compiler; the first is the name under which they are unpacked.
pub(super) const PACKAGES: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];
/// Debian's package of the linker.
pub(super) const LINKER_PACKAGE: &str = "lld";

/// Finds a cross compiler.
///
/// # Errors
/// [`TargetError::MissingTool`] with the command that installs one.
pub fn find() -> Result<Toolchain, TargetError> {
    find_in(&Places::here())
}

/// [`find`] in the given places.
///
/// # Errors
/// As [`find`].
pub fn find_in(places: &Places) -> Result<Toolchain, TargetError> {
    let mut elsewhere = places.programs.clone();
    elsewhere.extend(places.unpacked(PACKAGES[0]).map(|unpacked| unpacked.programs()));
    choose(&candidates(places), &elsewhere)
}

/// Whether there is a linker for a compiler without one of its own.
pub(super) fn has_linker(places: &Places) -> bool {
    let sysroots = candidates(places).into_iter().filter_map(|candidate| Sysroot::of(&candidate));
    sysroots.into_iter().any(|sysroot| sysroot.rust_lld().is_some()) || lld(&places.programs).is_some()
}

/// Every compiler with a cargo.
fn candidates(places: &Places) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = Vec::new();
    if let (Some(rustc), Some(cargo)) = (places.program("rustc"), places.program("cargo")) {
        found.push(Candidate { rustc, cargo, libraries: Vec::new() });
    }
    for folder in &places.programs {
        let (rustc, cargo) = (folder.join("rustc"), folder.join("cargo"));
        if rustc.is_file() && cargo.is_file() && found.iter().all(|known| known.rustc != rustc) {
            found.push(Candidate { rustc, cargo, libraries: Vec::new() });
        }
    }
    if let Some(unpacked) = places.unpacked(PACKAGES[0])
        && let (Some(rustc), Some(cargo)) = (unpacked.program("rustc"), unpacked.program("cargo"))
    {
        found.push(Candidate { rustc, cargo, libraries: unpacked.libraries() });
    }
    found
}

/// The first suitable candidate; linkers are searched beside every candidate, then in `elsewhere`.
fn choose(candidates: &[Candidate], elsewhere: &[PathBuf]) -> Result<Toolchain, TargetError> {
    let probed: Vec<(&Candidate, Sysroot)> =
        candidates.iter().filter_map(|candidate| Some((candidate, Sysroot::of(candidate)?))).collect();
    let mut without_linker = None;
    for (candidate, sysroot) in &probed {
        let Some(core) = sysroot.core().filter(|_| !is_old(&sysroot.version)) else { continue };
        let linker = if sysroot.rust_lld().is_some() {
            None
        } else if let Some(linker) = probed.iter().find_map(|(_, other)| other.rust_lld()).or_else(|| lld(elsewhere)) {
            Some(linker)
        } else {
            without_linker = Some(candidate.rustc.clone());
            continue;
        };
        return Ok(Toolchain {
            rustc: candidate.rustc.clone(),
            cargo: candidate.cargo.clone(),
            linker,
            core,
            version: sysroot.version.clone(),
            libraries: candidate.libraries.clone(),
        });
    }
    Err(match without_linker {
        Some(rustc) => TargetError::MissingTool {
            tool: LINKER.into(),
            looked: format!("rust-lld beside {} and on PATH, ld.lld on PATH", rustc.display()),
            command: format!("{}   (manually: apt-get install {LINKER_PACKAGE})", super::SET_UP),
        },
        None => TargetError::MissingTool {
            tool: format!("a Rust compiler for {TRIPLE}"),
            looked: "the target or rust-src in the rustc on PATH, Debian's rustc-web in /usr and in specgen's cache"
                .into(),
            command: format!("{}   (manually: {})", super::SET_UP, install_command()),
        },
    })
}

/// The command that installs one.
pub fn install_command() -> String {
    let debian = if cfg!(target_os = "macos") {
        String::new()
    } else {
        format!(", or on Debian: apt-get install {}", PACKAGES.join(" "))
    };
    format!("rustup target add {TRIPLE}{debian}")
}

/// Whether a compiler is older than the one used for measurements, as in Debian without updates. Emitted code itself
/// builds with Rust 1.85.
fn is_old(version: &str) -> bool {
    let numbers = |text: &str| -> Option<(u32, u32)> {
        let mut parts = text.split('.').map(str::parse);
        Some((parts.next()?.ok()?, parts.next()?.ok()?))
    };
    let found = version.split(' ').nth(1).and_then(numbers);
    found.is_some_and(|found| Some(found) < numbers(env!("CARGO_PKG_RUST_VERSION")))
}

/// The sysroot of a compiler.
struct Sysroot {
    path: PathBuf,
    host: String,
    version: String,
}

impl Sysroot {
    fn of(candidate: &Candidate) -> Option<Self> {
        let ask = |words: &[&str]| {
            let mut command = clean_command(&candidate.rustc);
            first_line(with_libraries(&mut command, &candidate.libraries).args(words))
        };
        let path = PathBuf::from(ask(&["--print", "sysroot"])?);
        Some(Self { path, host: ask(&["--print", "host-tuple"])?, version: ask(&["--version"])? })
    }

    fn core(&self) -> Option<CoreLibrary> {
        let rustlib = self.path.join("lib/rustlib");
        if rustlib.join(TRIPLE).join("lib").is_dir() {
            Some(CoreLibrary::Installed)
        } else if rustlib.join("src/rust/library/core/Cargo.toml").is_file() {
            Some(CoreLibrary::FromSource)
        } else {
            None
        }
    }

    fn rust_lld(&self) -> Option<PathBuf> {
        let file = self.path.join("lib/rustlib").join(&self.host).join("bin/rust-lld");
        file.is_file().then_some(file)
    }
}

/// A linker of LLVM's own packages.
fn lld(folders: &[PathBuf]) -> Option<PathBuf> {
    ["rust-lld", "ld.lld"].iter().find_map(|name| folders.iter().map(|f| f.join(name)).find(|file| file.is_file()))
}

impl Toolchain {
    /// `cargo build --release` for the target with these rustc flags, to be followed by the caller's arguments.
    ///
    /// Ignores flags from the caller's environment and configuration, since the figures must not depend on them.
    pub fn cargo_build(&self, rustflags: &[&str]) -> Command {
        let mut flags: Vec<String> = rustflags.iter().map(|&flag| flag.to_owned()).collect();
        flags.push("-Zemit-stack-sizes".into());
        // Panic locations are of no use on a microcontroller, and paths of this machine do not belong in its flash.
        flags.push("-Zlocation-detail=none".into());
        if let Some(linker) = &self.linker {
            flags.push(format!("-Clinker={}", linker.display()));
            flags.push("-Clinker-flavor=ld.lld".into());
        }
        let mut command = clean_command(&self.cargo);
        with_libraries(&mut command, &self.libraries)
            .env("RUSTC", &self.rustc)
            .env("RUSTC_BOOTSTRAP", "1")
            // For a HAL that logs through `defmt`: `examples/own-board/src/machine.rs`.
            .env("DEFMT_LOG", "off")
            // Encoded, so that a path may contain spaces.
            .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"))
            .args(["build", "--release", "--target", TRIPLE]);
        if self.core == CoreLibrary::FromSource {
            command.arg("-Zbuild-std=core");
        }
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    /// A fake compiler that only reports its sysroot.
    fn fake(root: &Path, name: &str, files: &[&str]) -> Candidate {
        let sysroot = root.join(name);
        fs::create_dir_all(&sysroot).unwrap();
        for file in files {
            let path = sysroot.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        let rustc = sysroot.join("rustc");
        let script = format!(
            "#!/bin/sh\ncase \"$2\" in\nsysroot) echo '{}';;\nhost-tuple) echo host;;\n*) echo 'rustc 1.95.0 ({name})';;\nesac\n",
            sysroot.display()
        );
        fs::write(&rustc, script).unwrap();
        fs::set_permissions(&rustc, fs::Permissions::from_mode(0o755)).unwrap();
        Candidate { rustc, cargo: sysroot.join("cargo"), libraries: Vec::new() }
    }

    const TARGET: &str = "lib/rustlib/thumbv7em-none-eabihf/lib/libcore.rlib";
    const SOURCE: &str = "lib/rustlib/src/rust/library/core/Cargo.toml";
    const LLD: &str = "lib/rustlib/host/bin/rust-lld";

    #[test]
    fn an_installed_target_is_preferred_to_sources() {
        let root = tempfile::tempdir().unwrap();
        let rustup = fake(root.path(), "rustup", &[TARGET, SOURCE, LLD]);
        let debian = fake(root.path(), "debian", &[SOURCE]);
        let found = choose(&[rustup.clone(), debian], &[]).unwrap();
        assert_eq!(found.core, CoreLibrary::Installed);
        assert_eq!(found.rustc, rustup.rustc);
        assert_eq!(found.linker, None);
        assert_eq!(found.version, "rustc 1.95.0 (rustup)");
    }

    #[test]
    fn a_compiler_with_sources_uses_the_linker_of_another() {
        let root = tempfile::tempdir().unwrap();
        let rustup = fake(root.path(), "rustup", &[LLD]);
        let debian = fake(root.path(), "debian", &[SOURCE]);
        let found = choose(&[rustup.clone(), debian.clone()], &[]).unwrap();
        assert_eq!(found.core, CoreLibrary::FromSource);
        assert_eq!(found.rustc, debian.rustc);
        assert_eq!(found.linker, Some(rustup.rustc.with_file_name(LLD)));
    }

    #[test]
    fn lld_of_the_distribution_replaces_a_missing_rust_lld() {
        let root = tempfile::tempdir().unwrap();
        let debian = fake(root.path(), "debian", &[SOURCE]);
        let bin = root.path().join("bin");
        fs::create_dir_all(&bin).unwrap();
        fs::write(bin.join("ld.lld"), "").unwrap();
        let found = choose(&[debian], std::slice::from_ref(&bin)).unwrap();
        assert_eq!(found.linker, Some(bin.join("ld.lld")));
    }

    #[test]
    fn an_old_compiler_is_not_used() {
        assert!(is_old("rustc 1.85.1 (4eb161250 2025-03-15)"));
        assert!(!is_old("rustc 1.95.0 (x)") && !is_old("rustc 2.0.0-nightly") && !is_old("mine"));
        let root = tempfile::tempdir().unwrap();
        let debian = fake(root.path(), "debian", &[SOURCE, LLD]);
        let script = fs::read_to_string(&debian.rustc).unwrap().replace("1.95.0", "1.85.0");
        fs::write(&debian.rustc, script).unwrap();
        assert!(choose(&[debian], &[]).is_err());
    }

    #[test]
    fn a_missing_tool_is_reported_with_the_command_that_installs_it() {
        let root = tempfile::tempdir().unwrap();
        let bare = fake(root.path(), "bare", &[LLD]);
        let error = choose(&[bare], &[]).unwrap_err();
        assert!(error.is_of_a_tool());
        assert!(error.to_string().contains("rustup target add thumbv7em-none-eabihf"), "{error}");
        let no_linker = fake(root.path(), "debian", &[SOURCE]);
        let error = choose(&[no_linker], &[]).unwrap_err();
        assert!(error.to_string().contains("apt-get install lld"), "{error}");
    }
}
