//! Values that were not measured: the spec and records name them, the verdict counts them, and a real machine needs confirmation.

use std::fs;

use serde_json::{Value, json};

use crate::support::{Folder, Run, cases, length, repository};
use specgen::diagnostic::{Diagnostic, Severity};
use specgen::spec::{self, SpecSource};
use specgen::target;

/// Assumed in specs/reference.toml, all gauges as one.
const OF_REFERENCE: usize = 14;
const MARK: &str = "# simulated by specgen: no leg was measured\n";

/// The whole list of a spec, its brackets included.
fn list_of(text: &str) -> &str {
    let start = text.find("assumed = [").unwrap();
    let end = start + text[start..].find("]\n").unwrap() + 2;
    &text[start..end]
}

/// A spec of the folder with another list; an empty one removes the key.
fn with_list(folder: &Folder, spec: &str, list: &str) -> String {
    let text = folder.read(spec);
    text.replacen(list_of(&text), list, 1)
}

/// Exit code and document, whether there is a result or not.
fn json_of(folder: &Folder, arguments: &[&str]) -> (i32, Value) {
    let run = Run::of(folder.command().args(arguments).arg("--json"));
    (run.code, serde_json::from_str(&run.stdout).unwrap_or_else(|error| panic!("{error}: {run:#?}")))
}

/// The errors of a spec: code, message and help, key, replacement.
fn errors_of(text: &str) -> Vec<[String; 4]> {
    let source =
        SpecSource { display_name: "own.toml".to_owned(), text: text.to_owned(), dir: repository().join("specs") };
    let found = spec::load(&source).1.into_iter().filter(|one| one.severity == Severity::Error);
    let parts = |one: Diagnostic| {
        let said = format!("{}; {}", one.message, one.help);
        [one.code.to_owned(), said, one.key, one.replacement.unwrap_or_default()]
    };
    found.map(parts).collect()
}

#[test]
fn each_entry_is_the_path_of_a_value_that_the_spec_has_once() {
    let folder = Folder::new();
    let errors = |list: &str| errors_of(&with_list(&folder, "reference.toml", &format!("assumed = [{list}]\n")));
    for good in [
        "",
        "\"sensor.noise\"",
        "\"gauge\"",
        "\"gauge[5].point\", \"gauge[4].point\", \"gauge[4].direction\"",
        "\"gauge.point\", \"gauge.direction\"",
        "\"workspace.translation[2]\", \"workspace.translation[1]\"",
        "\"hysteresis.records\", \"trajectory[2].frequency\"",
        // A default is also a value.
        "\"sensor.lag\", \"platform.products\"",
    ] {
        let found = errors(good);
        assert!(found.is_empty(), "{good}: {found:#?}");
    }
    cases::hold(&repository().join("tests/cases/assumed.txt"), 1, |case| {
        let (bad, found) = (&case.title, errors(&case.title));
        let [[code, said, key, fix]] = &found[..] else { panic!("{bad}: {found:#?}") };
        assert!(key.starts_with("assumed["), "{bad}: {found:#?}");
        assert!(fix.is_empty() || errors(fix).is_empty(), "{bad}: the fix is accepted");
        format!("{code} {key}: {said}\n{fix}")
    });
    // Only at the entry; a wrong value has its own finding and no second one.
    let legs = |list: &str| with_list(&folder, "legs.toml", list);
    let noise = "assumed = [\"sensor.noise\"]\n";
    for (text, code, words) in [
        (
            legs("").replace("[sensor]\n", &format!("[sensor]\n{noise}")),
            "E0202",
            "`assumed` exists: did it slip out of its section?",
        ),
        (legs(noise).replace("noise = \"2.2 nm\"", "noise = 2.2"), "E0208", "sensor.noise"),
        (legs("assumed = [\"control.modal_damping\"]\n"), "E0345", "this spec has no value `control.modal_damping`"),
    ] {
        let found = errors_of(&text);
        let [[id, said, ..]] = &found[..] else { panic!("{code}: {found:#?}") };
        assert!(id == code && said.contains(words), "{found:#?}");
    }
    // The message as a user sees it, at the entry.
    folder.write(
        "own.toml",
        with_list(&folder, "reference.toml", "assumed = [\n    \"gauge\",\n    \"sensor.nois\",\n]\n"),
    );
    folder.run(&["check", "own.toml"]).says(1, &["E0345", "own.toml:9:5", "did you mean \"sensor.noise\"?"]);
}

#[test]
fn the_verdict_counts_them() {
    let folder = Folder::new();
    let summary = format!("  assumed  {OF_REFERENCE} values, simulated leg record\n");
    let headline = format!("reference is good so far on {OF_REFERENCE} assumed values: 8 limits kept, 3 warnings\n");
    let ways = [&["reference.toml", "-o", "out", "--no-build"][..], &["check", "reference.toml"]];
    for arguments in ways.into_iter().take(length(1, 2)) {
        let run = folder.run(arguments);
        assert!(run.code == 0 && run.stdout.starts_with(&headline) && run.stdout.contains(&summary), "{run:#?}");
        let details = folder.run(&[arguments, &["--details"]].concat()).stdout;
        for one in ["control.modal_damping", "gauge", "hysteresis: records/reference-forc.csv (simulated)"] {
            assert!(details.contains(&format!("\n    {one}\n")), "{one}: {details}");
        }
        let (_, document) = json_of(&folder, arguments);
        let assumed = &document["result"]["verdict"]["assumed"];
        assert_eq!(assumed["values"].as_array().unwrap().len(), OF_REFERENCE, "{assumed}");
        assert_eq!(assumed["simulated"], json!(["records/reference-forc.csv"]));
    }
    let (_, document) = json_of(&folder, &["dump-ir", "reference.toml"]);
    assert_eq!(document["result"]["assumed"].as_array().unwrap().len(), OF_REFERENCE + 1);
    assert!(folder.read("out/controller/src/identity.rs").contains("pub const ASSUMED: &[&str] = &["));
    // All measured, with a record of a leg: the verdict is unchanged.
    let record = folder.read("records/reference-forc.csv");
    folder.write("records/reference-forc.csv", record.replacen(MARK, "", 1));
    let structure = "\n[robust.structure]\nf0 = \"900 Hz\"\n";
    folder.write("own.toml", with_list(&folder, "reference.toml", "") + structure);
    let run = folder.run(&["check", "own.toml"]);
    assert!(run.stdout.starts_with("reference is good so far: 8 limits kept, 3 warnings\n"), "{}", run.stdout);
    assert!(!run.stdout.contains("assumed"), "{}", run.stdout);
}

/// A file is marked as simulated itself, as a record and as a table made from it, whichever program wrote the mark.
#[test]
fn a_record_says_itself_that_it_is_simulated_and_so_does_what_is_made_of_it() {
    let folder = Folder::new();
    let spec = with_list(&folder, "minimal.toml", "");
    let simulated = |record: &str| {
        folder.write("own.toml", spec.replace("records/reference-forc.csv", record));
        let run = folder.run(&["check", "own.toml"]);
        assert_eq!(run.code, 0, "{run:#?}");
        run.stdout.contains("\n  assumed  simulated leg record\n")
    };
    assert_eq!(folder.run(&["forc", "minimal.toml", "-o", "leg.csv"]).code, 0);
    assert!(simulated("leg.csv"));
    assert!(
        folder.run(&["check", "own.toml"]).stdout.starts_with("minimal is good so far on a simulated leg record: ")
    );
    let identify = ["identify", "leg.csv", "--drive", "0:100", "--grid", "32", "-o", "table.csv"];
    let run = folder.run(&identify);
    assert!(run.code == 0 && run.stdout.contains("# simulated, not measured: do not change `assumed`"), "{run:#?}");
    assert!(run.stdout.contains("leg.csv: simulated: "), "{}", run.stdout);
    assert_eq!(json_of(&folder, &identify).1["result"]["measured"], json!([]));
    assert!(simulated("table.csv"));
    // The same samples from a real bench.
    let text = folder.read("leg.csv");
    let bare = text.replacen(MARK, "", 1);
    assert_ne!(text, bare);
    folder.write("bench.csv", &bare);
    assert!(!simulated("bench.csv"));
    let run = folder.run(&["identify", "bench.csv", "--drive", "0:100", "--grid", "32", "-o", "table.csv"]);
    assert!(
        run.stdout.contains("remove from `assumed` in the spec") && run.stdout.contains("\"hysteresis.records\""),
        "{run:#?}"
    );
    assert!(!simulated("table.csv"));
    for (name, marked) in
        [("above.csv", format!("% Simulated, by hand\n{bare}")), ("below.csv", format!("{bare}# simulated\n"))]
    {
        folder.write(name, marked);
        assert!(simulated(name), "{name}");
    }
    folder.write("other.csv", format!("# not simulated\n{bare}"));
    assert!(!simulated("other.csv"));
    assert_eq!(host_sim::forc::SIMULATED, specgen::identify::SIMULATED);
}

/// A board, an image for one, and everything written to it need confirmation; nothing else does.
#[test]
fn a_real_board_takes_assumptions_only_if_they_are_accepted() {
    let folder = Folder::new();
    let build = ["build", "reference.toml", "--target", "stm32h743", "--no-measure", "-o", "out"];
    let flash = ["flash", "reference.toml", "--target", "stm32h743", "--yes", "-o", "out"];
    let words = [
        "E0348",
        "14 assumed values, simulated leg record",
        "amplifier.lag",
        "records/reference-forc.csv (simulated)",
        "--assumed-ok",
    ];
    // `size` also writes the image.
    let size = ["size", "reference.toml", "--target", "stm32h743", "--no-measure", "-o", "out"];
    for arguments in [&build[..], &flash, &size] {
        folder.run(arguments).says(1, &words);
        assert!(!folder.path("out").exists());
    }
    // Also for the spec's own part; a list, or only a simulated record, is enough.
    let board = |text: String| {
        text.replace("mcu = \"mps2-an500\"", "mcu = \"stm32h743zi\"") + "\n[robust.structure]\nf0 = \"900 Hz\"\n"
    };
    folder.write("own.toml", board(with_list(&folder, "reference.toml", "assumed = [\"sensor.noise\"]\n")));
    folder.run(&["build", "own.toml", "-o", "out"]).says(1, &["E0348", "1 assumed value, simulated leg record"]);
    let record = folder.read("records/reference-forc.csv");
    folder.write("records/bench.csv", record.replacen(MARK, "", 1));
    let measured =
        |list: &str| board(with_list(&folder, "reference.toml", list)).replace("reference-forc.csv", "bench.csv");
    folder.write("own.toml", measured("assumed = [\"sensor.noise\"]\n"));
    folder.run(&["build", "own.toml", "-o", "out"]).says(1, &["E0348", "1 assumed value: sensor.noise"]);
    folder.write("own.toml", board(with_list(&folder, "reference.toml", "")));
    folder.run(&["build", "own.toml", "-o", "out"]).says(1, &["E0348", "simulated leg record", "hysteresis.records"]);
    if target::available().is_err() {
        return;
    }
    // After that check comes the folder, which belongs to someone else.
    fs::create_dir(folder.path("out")).unwrap();
    folder.write("out/notes.txt", "mine");
    let accepted = [&build[..], &["--assumed-ok"]].concat();
    let accepted_size = [&size[..], &["--assumed-ok"]].concat();
    let qemu = ["build", "reference.toml", "--target", "qemu", "--no-measure", "-o", "out"];
    folder.write("own.toml", measured(""));
    let all = [&accepted[..], &["build", "own.toml", "--no-measure", "-o", "out"], &accepted_size, &qemu];
    for arguments in all.into_iter().take(length(2, 4)) {
        let run = folder.run(arguments);
        assert!(
            run.code == 1
                && run.stderr.contains("did not write or that were changed since: notes.txt")
                && !run.stderr.contains("E0348"),
            "{run:#?}"
        );
    }
}

#[test]
fn a_new_spec_names_what_nobody_gave() {
    let folder = Folder::new();
    let given = [
        ("--mass", "2 kg", "platform.mass"),
        ("--gauge-noise", "1 nm", "sensor.noise"),
        ("--lag", "0.2 ms", "amplifier.lag"),
    ];
    for like in ["reference", "legs"].into_iter().take(length(1, 2)) {
        let mut arguments = vec!["new", like, "--like", like];
        given.iter().for_each(|(option, value, _)| arguments.extend([*option, *value]));
        let (code, document) = json_of(&folder, &arguments);
        assert_eq!(code, 0, "{document:#}");
        let assumed = document["result"]["assumed"].as_array().unwrap();
        let text = folder.read(&format!("{like}/platform.toml"));
        let marks = text.lines().filter(|line| line.ends_with("(assumed)") || line.ends_with("(computed)")).count();
        // The positions of six gauges are one entry, although one of them has a comment for each of its two keys.
        let gauges = usize::from(like == "reference");
        assert_eq!(assumed.len(), marks - gauges, "{text}");
        assert!(list_of(&text).lines().all(|line| line.len() <= 120), "{text}");
        for (_, _, key) in given {
            assert!(!assumed.contains(&json!(key)), "{key} was given");
        }
        for key in ["platform.inertia", "actuator.resonance", "dac.range", "timing.period"] {
            assert!(
                assumed.contains(&json!(key)) && list_of(&text).contains(&format!("\"{key}\"")),
                "{key}: {assumed:?}"
            );
        }
        let spec = format!("{like}/platform.toml");
        // A platform's range of structural modes, which the spec leaves out, counts as well.
        let counted = assumed.len() + gauges;
        let line = format!("\n  assumed  {counted} values, simulated leg record\n");
        let check = folder.run(&["check", &spec]);
        assert!(check.code == 0 && check.stdout.contains(&line), "{check:#?}");
        // One is measured.
        folder
            .write(&spec, text.replacen("\"actuator.resonance\", ", "", 1).replacen("\"actuator.resonance\",", "", 1));
        let check = folder.run(&["check", &spec]).stdout;
        assert!(check.contains(&format!("\n  assumed  {} values, simulated", counted - 1)), "{check}");
    }
}

#[test]
#[ignore = "long: seven verdicts, with their studies of the noise"]
fn a_pose_that_is_noisier_at_rest_than_asked_for_is_not_good() {
    let folder = Folder::new();
    // Spec, noise of a gauge, requirements; the headline and the key of the limit, or none if it is met.
    for (spec, noise, requirements, expected) in [
        (
            "reference.toml",
            "80 nm",
            "precision = \"5 nm\"",
            Some(("noise x/y/z 101/58.3/47.4 > 5/5/5 nm", "requirements.precision")),
        ),
        ("reference.toml", "80 nm", "noise = \"60 nm\"", Some(("noise x 101 > 60 nm", "requirements.noise"))),
        ("reference.toml", "80 nm", "precision = \"5 nm\"\nnoise = \"110 nm\"", None),
        ("reference.toml", "2.2 nm", "precision = \"5 nm\"", None),
        (
            "reference.toml",
            "2.2 nm",
            "rotation_noise = \"20 nrad\"",
            Some(("noise θx/θy/θz 26.9/26.9/22.4 > 20/20/20 nrad", "requirements.rotation_noise")),
        ),
        ("legs.toml", "80 nm", "precision = \"5 nm\"", Some(("noise x/y/z ", "requirements.precision"))),
        ("legs.toml", "2.2 nm", "precision = \"20 nm\"", None),
    ] {
        let text = folder.read(spec).replace("noise = \"2.2 nm\"", &format!("noise = \"{noise}\""));
        // A wiring check as long as the noise requires.
        let supervisor = "[supervisor]\nwiring_check.time = \"5 s\"";
        let more = format!("{supervisor}\n\n[requirements]\n{requirements}\n\n[timing]");
        folder.write("own.toml", text.replace("[timing]", &more));
        let case = format!("{spec}, {noise}, {requirements}");
        let run = folder.run(&["own.toml", "-o", "out", "--no-build"]);
        let (code, document) = json_of(&folder, &["check", "own.toml"]);
        let verdict = &document["result"]["verdict"];
        let figures = verdict["figures"].as_array().unwrap();
        let beyond: Vec<&Value> = figures.iter().filter(|one| one["mark"] == "beyond").collect();
        let Some((headline, key)) = expected else {
            assert!((run.code, code) == (0, 0) && beyond.is_empty(), "{case}: {run:#?}");
            assert_eq!(verdict["answer"], "not-measured", "{case}");
            continue;
        };
        assert!((run.code, code) == (1, 1) && verdict["answer"] == "not-ready", "{case}: {run:#?}");
        assert!(run.stdout.contains(&format!(" is NOT ready: {headline}")), "{case}: {}", run.stdout);
        run.says(1, &["E0347", key, "in [requirements]: ", "is NOT ready: "]);
        assert!(!beyond.is_empty() && beyond.iter().all(|one| one["limit"]["from"] == key), "{beyond:#?}");
        assert!(document["error"].as_str().unwrap().contains(" is NOT ready: noise "), "{case}");
        // The help is accepted.
        let findings = document["findings"].as_array().unwrap();
        let help = findings.iter().find(|one| one["code"] == "E0347").unwrap()["help"].as_str().unwrap();
        let line = help.rsplit("in [requirements]: ").next().unwrap();
        let name = line.split(' ').next().unwrap();
        let kept: Vec<&str> = requirements.lines().filter(|one| !one.starts_with(&format!("{name} "))).collect();
        let fixed = folder.read("own.toml").replace(requirements, &format!("{}\n{line}", kept.join("\n")));
        folder.write("fixed.toml", fixed);
        assert_eq!(folder.run(&["check", "fixed.toml"]).code, 0, "{case}: {line}");
    }
}
