//! `kill -9` at any time: the next run succeeds, written files are complete, and no user data is lost.

#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rustix::process::{Pid, Signal, kill_process_group};

use crate::support::{Folder, Run, contents, length};

/// A random number from 0 to 1.
fn part(random: &mut ChaCha8Rng) -> f64 {
    f64::from(random.next_u32()) / f64::from(u32::MAX)
}

fn start(command: &mut Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).process_group(0).spawn().unwrap()
}

/// Kills a process and its children. Returns whether it was still running.
fn kill(mut child: Child) -> bool {
    kill_process_group(Pid::from_raw(child.id().cast_signed()).unwrap(), Signal::KILL).ok();
    child.wait().unwrap().signal() == Some(9)
}

/// One way to write the output.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Way {
    /// From outside the folder: folders are swapped.
    Swap,
    /// From a shell inside the folder: files are replaced one by one.
    InPlace,
}

/// An output folder that two specs write alternately, with user files in and around it.
struct Output {
    folder: Folder,
    /// Output of each spec.
    whole: [BTreeMap<String, Vec<u8>>; 2],
}

const SPECS: [&str; 2] = ["legs.toml", "other.toml"];
/// User data: cargo's files in the output, other files beside it.
const OF_USER: [&str; 4] = ["out/target/release/object.o", "out/Cargo.lock", "out/controller/target/kept", "notes.txt"];

impl Output {
    fn new() -> Self {
        // On a disk, where writing is slow enough to be interrupted.
        let folder = Folder::on_disk();
        folder.spec("other.toml", &[("= \"pcc\"", "= \"ewma\""), ("name = \"legs\"", "name = \"other\"")]);
        let whole = SPECS.map(|spec| {
            assert_eq!(folder.run(&[spec, "-o", spec.trim_end_matches(".toml"), "--no-build"]).code, 0);
            contents(&folder.path(spec.trim_end_matches(".toml")))
        });
        assert_ne!(whole[0], whole[1]);
        assert_eq!(folder.run(&[SPECS[0], "-o", "out", "--no-build"]).code, 0);
        for path in OF_USER {
            fs::create_dir_all(folder.path(path).parent().unwrap()).unwrap();
            folder.write(path, path);
        }
        Self { folder, whole }
    }

    fn command(&self, spec: &str, way: Way) -> Command {
        let mut command = self.folder.command();
        match way {
            Way::Swap => command.args([spec, "-o", "out", "--no-build"]),
            Way::InPlace => {
                command.current_dir(self.folder.path("out")).args([&format!("../{spec}"), "-o", ".", "--no-build"])
            }
        };
        command
    }

    /// Files of specgen in the output.
    fn written(&self) -> BTreeMap<String, Vec<u8>> {
        let mut files = contents(&self.folder.path("out"));
        files.retain(|path, _| !OF_USER.contains(&format!("out/{path}").as_str()));
        files
    }

    fn work(&self) -> PathBuf {
        self.folder.path(".out.specgen")
    }

    /// Asserts that the next run of `spec` succeeds, with the correct output.
    fn recovers(&self, spec: usize, what: &str) {
        let run = Run::of(&mut self.command(SPECS[spec], Way::Swap));
        assert_eq!(run.code, 0, "{what}: {}", run.stderr);
        assert!(self.written() == self.whole[spec], "{what}");
        for path in OF_USER {
            assert_eq!(fs::read_to_string(self.folder.path(path)).unwrap_or_default(), path, "{what}");
        }
        assert!(!self.work().exists(), "{what}");
    }
}

/// Kills as soon as files are staged, or slightly later. Returns how many kills came during the write.
fn aimed(way: Way, rounds: usize, random: &mut ChaCha8Rng) -> usize {
    let output = Output::new();
    let mut hits = 0;
    for round in 0..rounds {
        let (old, new) = (round % 2, (round + 1) % 2);
        let aim = output.work().join(
            [["new/Cargo.toml", "new/.specgen"], ["new/.specgen", "old/Cargo.toml"]][way as usize][round / 2 % 2],
        );
        let mut child = start(&mut output.command(SPECS[new], way));
        while !aim.exists() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(50));
        }
        std::thread::sleep(Duration::from_secs_f64(4e-3 * part(random)));
        hits += usize::from(kill(child) && output.work().join("new").exists());
        let there = output.written();
        let is_whole = there == output.whole[old] || there == output.whole[new];
        let what = format!("{way:?}, round {round}, aimed at {}", aim.display());
        assert!(is_whole || way == Way::InPlace, "{what}: neither the old output nor the new one");
        output.recovers(new, &what);
    }
    hits
}

#[test]
fn a_kill_while_a_folder_is_written_leaves_the_old_one_or_the_new_one() {
    let mut random = ChaCha8Rng::seed_from_u64(14);
    for way in [Way::Swap, Way::InPlace] {
        let rounds = length(4, 16);
        let hits = aimed(way, rounds, &mut random);
        println!("{way:?}: {rounds} kills, {hits} in the midst of writing; every next run succeeded");
        assert!(hits > 0, "{way:?}: no kill came in time");
    }
}

/// Kills each of these commands at random times.
#[test]
#[ignore = "long: 48 kills at random times"]
fn every_run_after_a_kill_succeeds() {
    let mut random = ChaCha8Rng::seed_from_u64(200);
    let output = Output::new();
    let folder = &output.folder;
    let spec = folder.read("legs.toml");
    let commands: [&[&str]; 4] = [
        &["legs.toml", "-o", "out", "--no-build"],
        &["tune", "legs.toml", "--evaluations", "8", "--seconds", "0.1", "--write"],
        &["sim", "legs.toml", "--record", "run.rec", "--seconds", "0.1"],
        &["report", "legs.toml", "--generations", "0", "--no-target", "-o", "page.html"],
    ];
    for arguments in commands {
        // A complete run first, to measure its time with a cached build.
        let run = |what: &str| {
            folder.write("legs.toml", &spec);
            let begun = Instant::now();
            let run = folder.run(arguments);
            assert_eq!(run.code, 0, "{what}: {}", run.stderr);
            begun.elapsed()
        };
        run("first");
        let took = run("second");
        let (rounds, mut killed) = (12, 0);
        for round in 0..rounds {
            let what = format!("{arguments:?}, round {round}");
            folder.write("legs.toml", &spec);
            let child = start(folder.command().args(arguments));
            std::thread::sleep(took.mul_f64(1.05 * part(&mut random)));
            killed += usize::from(kill(child));
            // The old or the new file is complete: the spec compiles, the record replays, the page ends properly.
            assert_eq!(folder.run(&["check", "legs.toml"]).code, 0, "{what}");
            if arguments[0] == "sim" {
                folder.write("legs.toml", &spec);
                assert_eq!(folder.run(&["replay", "run.rec", "--spec", "legs.toml"]).code, 0, "{what}");
            }
            if arguments[0] == "report" {
                assert!(folder.read("page.html").trim_end().ends_with("</html>"), "{what}");
            }
            run(&what);
        }
        println!("{arguments:?}: {rounds} kills within {took:.1?}, {killed} before its end; every next run succeeded");
    }
    output.recovers(0, "at the end");
    let left: Vec<String> = fs::read_dir(folder.path(""))
        .unwrap()
        .map(|one| one.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    assert!(!left.iter().any(|name| name.contains(".specgen-")), "{left:?}");
}
