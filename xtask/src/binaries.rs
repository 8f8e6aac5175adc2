//! Every test binary of the workspace, as many at a time as there are processors.
//!
//! `cargo test` runs them one after the other. Most of their time goes into compiling emitted controllers, which keeps one
//! processor busy (one codegen unit, whole-program optimisation), so the others would wait.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::run::{Outcome, cargo, expect_success};

/// Those that take longest, the longest first: one that comes last would run alone.
const SLOWEST: [&str; 6] = [
    "tests platform_tables",
    "tests platform_bits",
    "codegen robust",
    "tests rate_options",
    "tests boards",
    "codegen pil",
];

/// Compiles them all, runs them, then the examples of the documentation.
pub fn test(root: &Path) -> Outcome {
    let binaries = match compile(root) {
        Ok(binaries) => binaries,
        Err(why) => return Outcome::Failed(why),
    };
    // Many tests build the same controller: once in a run is enough. What an earlier run left is not trusted.
    let kept = root.join("target/tests/cache");
    if let Err(error) = std::fs::remove_dir_all(&kept)
        && error.kind() != std::io::ErrorKind::NotFound
    {
        return Outcome::Failed(format!("removing {}: {error}", kept.display()));
    }
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    println!("{} test binaries, {workers} at a time", binaries.len());
    let failed = run(&binaries, workers, &kept);
    if !failed.is_empty() {
        return Outcome::Failed(format!("see the failed tests above, of {}", failed.join(", ")));
    }
    let doc = cargo(root, &["test", "--release", "--workspace", "--doc", "--quiet"]);
    expect_success(doc, "see the failed examples above")
}

/// A compiled test binary.
struct Binary {
    /// Package and target, such as `specgen-tests bit_identity`.
    name: String,
    executable: PathBuf,
    /// Folder of its package: where cargo would run it.
    folder: PathBuf,
}

/// Compiles without running; errors are printed by cargo.
fn compile(root: &Path) -> Result<Vec<Binary>, String> {
    let arguments = ["test", "--release", "--workspace", "--no-run", "--message-format=json-render-diagnostics"];
    let output = cargo(root, &arguments)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("cargo cannot be run: {error}"))?;
    if !output.status.success() {
        return Err(format!("{}; see the errors above", output.status));
    }
    let mut binaries: Vec<Binary> = String::from_utf8_lossy(&output.stdout).lines().filter_map(binary).collect();
    let place = |binary: &Binary| SLOWEST.iter().position(|name| *name == binary.name).unwrap_or(SLOWEST.len());
    binaries.sort_by(|a, b| (place(a), &a.name).cmp(&(place(b), &b.name)));
    if binaries.is_empty() {
        return Err("cargo named no test binary".to_owned());
    }
    Ok(binaries)
}

/// The test binary that a message of cargo speaks of, if it does.
fn binary(line: &str) -> Option<Binary> {
    let message: serde_json::Value = serde_json::from_str(line).ok()?;
    if message["reason"] != "compiler-artifact" || message["profile"]["test"] != true {
        return None;
    }
    let folder = Path::new(message["manifest_path"].as_str()?).parent()?.to_owned();
    let package = folder.file_name()?.to_string_lossy().into_owned();
    Some(Binary {
        name: format!("{package} {}", message["target"]["name"].as_str()?),
        executable: message["executable"].as_str()?.into(),
        folder,
    })
}

/// Runs them and prints what each says when it ends. Returns the names of those that failed.
fn run(binaries: &[Binary], workers: usize, kept: &Path) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(Vec::new());
    let work = || {
        while let Some(binary) = binaries.get(next.fetch_add(1, Ordering::Relaxed)) {
            let start = Instant::now();
            // What cargo sets at run time and a test may read.
            let ended = Command::new(&binary.executable)
                .current_dir(&binary.folder)
                .env("CARGO_MANIFEST_DIR", &binary.folder)
                .env("SPECGEN_CACHE", kept)
                .stdin(Stdio::null())
                .output();
            let (good, text) = match ended {
                Ok(output) => (output.status.success(), [output.stdout, output.stderr].concat()),
                Err(error) => (false, error.to_string().into_bytes()),
            };
            // One at a time, so that outputs do not mix. A poisoned lock would mean that printing panicked.
            let mut failed = failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            print(&binary.name, start.elapsed(), &text);
            if !good {
                println!("FAILED: {}", binary.name);
                failed.push(binary.name.clone());
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(work);
        }
    });
    let mut failed = failed.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    failed.sort();
    failed
}

fn print(name: &str, took: Duration, text: &[u8]) {
    println!("\n--- {name}, {:.1} s\n{}", took.as_secs_f64(), String::from_utf8_lossy(text).trim());
}
