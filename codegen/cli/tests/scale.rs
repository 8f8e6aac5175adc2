//! Runs the scheduler files of `docs/scale.md`; each gives the bytes of the single run.

use std::fs;
use std::process::Command;

use crate::support::commands::{blocks, shell};
use crate::support::{Folder, contents, repository, skipped};

/// The block of the document with `word`, changed to a study of seconds.
fn block(word: &str) -> String {
    let text = fs::read_to_string(repository().join("docs/scale.md")).unwrap();
    let mut found = blocks(&text).into_iter().filter(|block| block.body.contains(word));
    let block = found.next().unwrap_or_else(|| panic!("no block has `{word}`")).body;
    assert!(found.next().is_none(), "one block has `{word}`");
    let short = block.replace("platform.toml", "legs.toml").replace("--draws 1000", "--draws 3 --frequency 50");
    assert_ne!(short, block);
    short
}

const MERGE: &str = "specgen robust merge parts/*.json -o robust";

#[test]
#[ignore = "long: parts as separate processes; the short run merges parts of one"]
fn files_for_schedulers_give_the_bytes_of_a_single_run() {
    let slurm = block("#SBATCH");
    assert!(slurm.contains("--array=1-8\n"));
    let job = block("kind: Job");
    assert!(job.contains("completions: 8\n"));
    let command: String = job
        .lines()
        .skip_while(|line| line.trim() != "- |")
        .skip(1)
        .take_while(|line| line.starts_with("              "))
        .map(|line| format!("{}\n", line.trim()))
        .collect();
    assert_eq!(command.lines().count(), 3, "{command}");
    // One after the other, out of order, one of them twice.
    let slurm = format!("for SLURM_ARRAY_TASK_ID in 3 8 7 6 5 4 3 2 1; do (\n{slurm}\n) done\n{MERGE}");
    let kubernetes = format!("for JOB_COMPLETION_INDEX in 7 6 5 4 3 2 1 0; do (\n{command}) done\n{MERGE}");
    let parallel = block("--joblog");
    assert!(parallel.ends_with(&format!("{MERGE}\n")));

    let folder = Folder::new();
    let single = folder.run(&["robust", "legs.toml", "--draws", "3", "--frequency", "50", "-o", "single"]);
    assert_eq!(single.code, 0, "{single:#?}");
    let mut ways = vec![("Slurm", slurm), ("Kubernetes", kubernetes)];
    if Command::new("parallel").arg("--version").output().is_ok_and(|out| out.stdout.starts_with(b"GNU parallel")) {
        ways.push(("GNU parallel", parallel));
    } else {
        skipped("GNU parallel is not installed");
    }
    for (name, script) in ways {
        let run = shell(&folder.path(""), &script);
        assert_eq!(run.code, 0, "{name}: {run:#?}");
        assert!(run.stdout.ends_with(&single.stdout), "{name}: {}", run.stdout);
        assert_eq!(contents(&folder.path("robust")), contents(&folder.path("single")), "{name}");
        fs::remove_dir_all(folder.path("robust")).unwrap();
        fs::remove_dir_all(folder.path("parts")).unwrap();
    }
}
