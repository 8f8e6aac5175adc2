//! The output folder is written completely or not at all, and user files are not overwritten.

use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

use crate::support::unprivileged::{Unprivileged, set_mode};
use crate::support::{Folder, Run, contents, digest, length, listing};

/// Writes the reference workspace to `out`.
fn write(folder: &Folder) {
    let run = folder.run(&["legs.toml", "-o", "out", "--no-build"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
}

/// A run into `out` is refused with `code` and `words`, and nothing changes anywhere in the folder.
fn refused(folder: &Folder, output: &str, code: i32, words: &[&str]) {
    let before = folder.listing();
    folder.run(&["legs.toml", "-o", output, "--no-build"]).says(code, words);
    assert_eq!(folder.listing(), before);
}

#[test]
fn the_manifest_lists_every_file_with_its_digest() {
    let folder = Folder::new();
    write(&folder);
    let mut files = contents(&folder.path("out"));
    let manifest = String::from_utf8(files.remove(".specgen").unwrap()).unwrap();
    let listed: Vec<(String, String)> = manifest
        .lines()
        .map(|line| line.split_once("  ").unwrap())
        .map(|(digest, path)| (path.to_owned(), digest.to_owned()))
        .collect();
    let present: Vec<(String, String)> = files.iter().map(|(path, bytes)| (path.clone(), digest(bytes))).collect();
    assert_eq!(listed, present);
    for path in [
        "Cargo.toml",
        "ir.json",
        "controller/src/lib.rs",
        "law/src/platform/step.rs",
        "runtime/src/lib.rs",
        "host/build.rs",
        "qemu/link.x",
    ] {
        assert!(files.contains_key(path), "{path}");
    }
    for (path, bytes) in &files {
        assert!(bytes.ends_with(b"\n") && !bytes.contains(&b'\r'), "{path}");
    }
}

#[test]
fn a_second_run_changes_nothing_and_leaves_what_cargo_made() {
    let folder = Folder::new();
    write(&folder);
    for made in ["target", "qemu/target", "controller/target/release"] {
        fs::create_dir_all(folder.path("out").join(made)).unwrap();
        folder.write(&format!("out/{made}/object.o"), "built");
    }
    folder.write("out/Cargo.lock", "locked");
    let before = folder.listing();
    write(&folder);
    assert_eq!(folder.listing(), before);
}

#[test]
fn another_spec_replaces_an_earlier_output_as_if_it_were_new() {
    let folder = Folder::new();
    folder.spec("other.toml", &[("= \"pcc\"", "= \"ewma\""), ("name = \"legs\"", "name = \"other\"")]);
    assert_eq!(folder.run(&["other.toml", "-o", "new", "--no-build"]).code, 0);
    write(&folder);
    assert_ne!(contents(&folder.path("out")), contents(&folder.path("new")));
    assert_eq!(folder.run(&["other.toml", "-o", "out", "--no-build"]).code, 0);
    assert_eq!(contents(&folder.path("out")), contents(&folder.path("new")));
}

#[test]
fn a_file_that_is_no_longer_made_goes_and_a_deleted_one_comes_back() {
    let folder = Folder::new();
    write(&folder);
    let fresh = listing(&folder.path("out"));
    fs::create_dir_all(folder.path("out/controller/old/deep")).unwrap();
    folder.write("out/controller/old/deep/stale.rs", "// of an older version");
    // An older version of the manifest; a path outside of the folder is not ours.
    folder.write("victim", "precious");
    let mut manifest = folder.read("out/.specgen");
    manifest += &format!("{}  controller/old/deep/stale.rs\n", digest(b"// of an older version"));
    manifest += &format!("{}  ../victim\n", digest(b"precious"));
    folder.write("out/.specgen", manifest);
    fs::remove_file(folder.path("out/README.md")).unwrap();
    write(&folder);
    assert_eq!(listing(&folder.path("out")), fresh);
    assert_eq!(folder.read("victim"), "precious");
}

#[test]
fn a_target_that_is_built_for_no_more_leaves_only_what_cargo_made_and_may_come_back() {
    let folder = Folder::new();
    write(&folder);
    let fresh = listing(&folder.path("out"));
    // A folder of another target, used for a build; cargo changed its lock file.
    fs::create_dir_all(folder.path("out/rt-pc/target")).unwrap();
    folder.write("out/rt-pc/target/rt-pc", "built");
    folder.write("out/rt-pc/Cargo.lock", "changed by cargo");
    folder.write("Cargo.lock", "precious");
    let manifest = folder.read("out/.specgen");
    let lock = digest(b"as it was written");
    folder.write("out/.specgen", format!("{manifest}{lock}  rt-pc/Cargo.lock\n{lock}  ../Cargo.lock\n"));
    for _ in 0..length(1, 2) {
        write(&folder);
        assert_eq!(folder.read("out/rt-pc/target/rt-pc"), "built");
        assert!(!folder.path("out/rt-pc/Cargo.lock").exists());
        assert_eq!(folder.read("Cargo.lock"), "precious");
    }
    fs::remove_dir_all(folder.path("out/rt-pc")).unwrap();
    assert_eq!(listing(&folder.path("out")), fresh);
    // Other files in it belong to the user.
    fs::create_dir_all(folder.path("out/rt-pc/src")).unwrap();
    folder.write("out/rt-pc/src/main.rs", "mine");
    refused(&folder, "out", 1, &["rt-pc/"]);
}

/// A lock file beside one of our manifests is cargo's; any other belongs to the user.
#[test]
fn a_lock_file_in_a_folder_that_specgen_did_not_write_is_not_overwritten() {
    let folder = Folder::new();
    for (path, named) in [("Cargo.lock", "Cargo.lock"), ("qemu/Cargo.lock", "qemu/")] {
        let place = folder.path("theirs").join(path);
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        fs::write(&place, "precious").unwrap();
        refused(&folder, "theirs", 1, &[&format!("were changed since: {named};")]);
        fs::remove_dir_all(folder.path("theirs")).unwrap();
    }
    // Nor one in a folder of the output that is not a package.
    write(&folder);
    folder.write("out/controller/src/Cargo.lock", "precious");
    refused(&folder, "out", 1, &["controller/src/Cargo.lock"]);
}

/// States that a killed run can leave, made by hand; `kills` tests real ones.
#[test]
fn what_a_killed_run_left_is_taken_up() {
    let folder = Folder::new();
    write(&folder);
    let fresh = folder.listing();
    let work = folder.path(".out.specgen");
    // After the swap: cargo's folder and new user files are in the old output.
    for (path, text) in [("target/object.o", "built"), ("Cargo.lock", "locked")] {
        fs::create_dir_all(folder.path("out/target")).unwrap();
        fs::write(folder.path("out").join(path), text).unwrap();
    }
    let with_target = folder.listing();
    fs::create_dir(&work).unwrap();
    fs::rename(folder.path("out"), work.join("new")).unwrap();
    assert_eq!(folder.run(&["legs.toml", "-o", "again", "--no-build"]).code, 0);
    fs::rename(folder.path("again"), folder.path("out")).unwrap();
    write(&folder);
    assert_eq!(folder.listing(), with_target);

    // Files that are not cargo's are also restored, and are then user files in the way.
    fs::create_dir(&work).unwrap();
    fs::rename(folder.path("out"), work.join("new")).unwrap();
    fs::write(work.join("new/notes.txt"), "mine").unwrap();
    folder.run(&["legs.toml", "-o", "out", "--no-build"]).says(1, &["notes.txt"]);
    assert_eq!(folder.read("out/notes.txt"), "mine");
    fs::remove_dir_all(folder.path("out")).unwrap();

    // Before the swap: new files without their manifest are incomplete.
    fs::create_dir_all(work.join("new/controller")).unwrap();
    fs::write(work.join("new/controller/half.rs"), "fn ha").unwrap();
    write(&folder);
    assert_eq!(folder.listing(), fresh);
    // While files are replaced one by one; the manifest has both versions.
    fs::create_dir_all(work.join("old")).unwrap();
    fs::rename(folder.path("out/README.md"), work.join("old/README.md")).unwrap();
    write(&folder);
    assert_eq!(folder.listing(), fresh);
}

/// Two simultaneous runs neither mix files nor report an error of the user.
#[test]
fn runs_at_once_write_one_after_the_other() {
    let folder = Folder::new();
    folder.spec("other.toml", &[("= \"pcc\"", "= \"ewma\""), ("name = \"legs\"", "name = \"other\"")]);
    let whole = ["legs", "other"].map(|name| {
        assert_eq!(folder.run(&[&format!("{name}.toml"), "-o", name, "--no-build"]).code, 0);
        contents(&folder.path(name))
    });
    let begin = |k: usize| {
        let mut command = folder.command();
        command.args([["legs.toml", "other.toml"][k % 2], "-o", "out", "--no-build"]);
        command.stderr(std::process::Stdio::piped()).stdout(std::process::Stdio::piped()).spawn().unwrap()
    };
    let running: Vec<_> = (0..length(2, 4)).map(begin).collect();
    for run in running {
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(whole.contains(&contents(&folder.path("out"))));
    assert!(!folder.path(".out.specgen").exists());
}

#[test]
fn an_empty_folder_and_one_whose_parents_are_missing_are_taken() {
    let folder = Folder::new();
    fs::create_dir(folder.path("out")).unwrap();
    write(&folder);
    assert_eq!(folder.run(&["legs.toml", "-o", "a/b/c", "--no-build"]).code, 0);
    assert_eq!(contents(&folder.path("a/b/c")), contents(&folder.path("out")));
    fs::create_dir(folder.path("here")).unwrap();
    let mut inside = folder.command();
    let inside = inside.current_dir(folder.path("here")).args(["../legs.toml", "-o", ".", "--no-build"]);
    assert_eq!(Run::of(inside).code, 0);
    assert_eq!(contents(&folder.path("here")), contents(&folder.path("out")));
}

#[test]
fn a_file_of_the_user_is_not_overwritten() {
    let folder = Folder::new();
    write(&folder);
    folder.write("out/notes.txt", "mine");
    refused(&folder, "out", 1, &["`out` contains files", "notes.txt", "nothing was written", "-o"]);
    fs::remove_file(folder.path("out/notes.txt")).unwrap();

    folder.write("out/law/src/platform/step.rs", folder.read("out/law/src/platform/step.rs") + "// tuned by hand\n");
    refused(&folder, "out", 1, &["changed since: law/src/platform/step.rs;"]);

    // A folder without a manifest, with a name like one of ours.
    fs::create_dir_all(folder.path("theirs/controller/src")).unwrap();
    folder.write("theirs/controller/src/step.rs", "mine");
    folder.write("theirs/Cargo.toml", "mine");
    refused(&folder, "theirs", 1, &["Cargo.toml, controller/"]);

    for k in 0..8 {
        folder.write(&format!("theirs/file{k}"), "mine");
    }
    refused(&folder, "theirs", 1, &["and 5 more"]);
}

#[test]
fn a_link_in_the_output_belongs_to_the_user() {
    let folder = Folder::new();
    write(&folder);
    fs::rename(folder.path("out/README.md"), folder.path("moved.md")).unwrap();
    symlink("../moved.md", folder.path("out/README.md")).unwrap();
    refused(&folder, "out", 1, &["README.md"]);
}

#[test]
fn what_is_no_folder_is_not_overwritten() {
    let folder = Folder::new();
    folder.write("file", "mine");
    refused(&folder, "file", 1, &["`file` exists and is not a folder", "nothing was written", "-o"]);
    refused(&folder, "file/below", 3, &["`file/below`", "nothing was changed"]);
    symlink("nowhere", folder.path("link")).unwrap();
    refused(&folder, "link", 1, &["`link` exists and is not a folder"]);
}

/// An empty folder in place of a file is replaced.
#[test]
fn an_empty_folder_in_the_way_of_a_file_does_no_harm() {
    let folder = Folder::new();
    write(&folder);
    let fresh = folder.listing();
    fs::remove_file(folder.path("out/ir.json")).unwrap();
    fs::create_dir(folder.path("out/ir.json")).unwrap();
    write(&folder);
    assert_eq!(folder.listing(), fresh);
}

#[test]
fn a_refused_run_leaves_no_folder_behind() {
    let folder = Folder::new();
    folder.spec("bad-key.toml", &[("grid    = 32", "grit    = 32")]);
    folder.spec("bad-unit.toml", &[("height          = \"180 mm\"", "height          = \"180 V\"")]);
    folder.spec("no-record.toml", &[("records/reference-forc.csv", "records/none.csv")]);
    folder.spec("bad-record.toml", &[("records/reference-forc.csv", "records/bad.csv")]);
    folder.write("records/bad.csv", "time_s,drive_V\n0,1\n");
    folder.spec("unstable.toml", &[("level_weight = 0.252", "level_weight = 1.0")]);
    // Accepted by all checks of the spec, but refused when its constants are computed.
    folder.spec(
        "coarse.toml",
        &[
            ("bits  = 16\nrange = [\"0 V\", \"150 V\"]", "bits  = 8\nrange = [\"0 V\", \"500 V\"]"),
            ("[timing]", "[lint]\nallow = [\"dac.bits: what there was\"]\n\n[timing]"),
        ],
    );
    let before = folder.listing();
    for (spec, code) in [
        ("bad-key.toml", "E0202"),
        ("bad-unit.toml", "E0211"),
        ("no-record.toml", "E0306"),
        ("bad-record.toml", "E0504"),
        ("unstable.toml", "E0402"),
        ("coarse.toml", "E0410"),
    ] {
        let document = folder.json(&[spec, "-o", "a/out", "--no-build"]);
        assert_eq!(document.code, 1, "{spec}");
        document.finding(code);
        assert_eq!(folder.listing(), before, "{spec}");
    }
}

#[test]
fn without_permission_nothing_changes() {
    let folder = Folder::new();
    let Some(user) = Unprivileged::owning(&folder) else { return };
    let arguments = |output| ["legs.toml", "-o", output, "--no-build"];
    fs::create_dir(folder.path("readonly")).unwrap();
    set_mode(&folder.path("readonly"), 0o555);
    let before = folder.listing();
    for output in ["readonly", "readonly/a/b/out", "readonly/out"].into_iter().take(length(2, 3)) {
        let words = ["Permission denied", "nothing was changed", "readonly", "name another folder with -o"];
        user.run(&folder, &arguments(output)).says(3, &words);
        assert_eq!(folder.listing(), before, "{output}");
    }

    // The first missing parent can be created, the second cannot, because the umask removes all permissions.
    let plain = user.command(&folder);
    let mut masked = Command::new("sh");
    masked.args(["-c", "umask 0777; exec \"$@\"", "sh"]).arg(plain.get_program()).args(plain.get_args());
    masked.current_dir(folder.path("")).args(arguments("a/b/out"));
    Run::of(&mut masked).says(3, &["could not write `a/b/out`", "nothing was changed"]);
    assert_eq!(folder.listing(), before);

    // The failure comes in the middle: some files are already moved, and must be restored.
    assert_eq!(user.run(&folder, &arguments("out")).code, 0);
    folder.write("out/controller/old.rs", "// older");
    folder
        .write("out/.specgen", folder.read("out/.specgen") + &format!("{}  controller/old.rs\n", digest(b"// older")));
    set_mode(&folder.path("out/runtime/src"), 0o555);
    let before = folder.listing();
    user.run(&folder, &arguments("out")).says(3, &["runtime/src", "Permission denied", "nothing was changed"]);
    assert_eq!(folder.listing(), before);
    set_mode(&folder.path("out/runtime/src"), 0o755);
    assert_eq!(user.run(&folder, &arguments("out")).code, 0);
    assert!(!folder.path("out/controller/old.rs").exists());

    // A folder that cannot be read cannot be checked.
    set_mode(&folder.path("out"), 0o333);
    user.run(&folder, &arguments("out")).says(3, &["could not read `out`"]);
    set_mode(&folder.path("out"), 0o755);
}
