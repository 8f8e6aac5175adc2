//! `specgen new` for a new user: from a data sheet to a spec that passes `check`, at the first attempt.

use std::fs;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::support::{Folder, Run, length, repository};

/// Realistic platforms: strokes, sizes, masses and rates over the ranges of catalogues, physically consistent.
fn plausible(rng: &mut ChaCha8Rng) -> Vec<String> {
    let mut within = |low: f64, high: f64| {
        let share = rng.next_u64() as f64 / u64::MAX as f64;
        low + (high - low) * share * share
    };
    let platform = within(30.0, 250.0);
    let base = platform * within(1.0, 1.8);
    let height = base * within(0.7, 1.6);
    let (stroke, mass) = (within(8.0, 200.0), within(0.2, 20.0));
    let volts = within(60.0, 1000.0);
    let stiffness = within(5e6, 2e8);
    let rate = within(2.0, 20.0);
    let joint = within(0.03, 0.4);
    let values = [
        ("--r_B", format!("{base:.1} mm")),
        ("--r_P", format!("{platform:.1} mm")),
        ("--alpha_B", format!("{joint:.3} rad")),
        ("--alpha_P", format!("{joint:.3} rad")),
        ("--height", format!("{height:.1} mm")),
        ("--mass", format!("{mass:.2} kg")),
        ("--stroke", format!("{stroke:.1} um")),
        ("--voltage", format!("0 V, {volts:.0} V")),
        ("--stiffness", format!("{:.1} N/um", stiffness * 1e-6)),
        ("--rate", format!("{rate:.1} kHz")),
    ];
    values.into_iter().flat_map(|(option, value)| [option.to_owned(), value]).collect()
}

#[test]
fn a_platform_from_its_data_sheet_passes_check_in_the_first_round() {
    let folder = Folder::new();
    // An engineer's values: symbols of the paper, a rate in kHz, capacitive gauges.
    let made = folder.line(
        "new mine --like reference --r_B '200 mm' --r_P '120 mm' --alpha_B '10 deg' --m '2.4 kg' --I \
         '0.012 kg m^2, 0.012 kg m^2, 0.02 kg m^2' --stroke '100 um' --voltage '-20 V, 120 V' --stiffness \
         '25 N/um' --gauge-noise '1 nm' --rate '20 kHz'",
    );
    assert_eq!(made.code, 0, "{}{}", made.stdout, made.stderr);
    assert_eq!(made.stdout.lines().filter(|line| line.starts_with("  specgen ")).count(), 3, "{}", made.stdout);
    assert!(made.stdout.lines().all(|line| line.chars().count() <= 80), "{}", made.stdout);
    let text = folder.read("mine/platform.toml");
    for line in ["= \"200 mm\"", "= \"50 us\"", "[\"-20 V\", \"120 V\"]"] {
        let found = text.lines().find(|found| found.contains(line));
        assert!(found.is_some_and(|line| !line.contains("(assumed)") && !line.contains("(computed)")), "{line}");
    }
    let check = folder.run(&["check", "mine/platform.toml"]);
    assert_eq!(check.code, 0, "{}", check.stderr);
    assert!(!check.stderr.contains("error"), "{}", check.stderr);
    let built = folder.run(&["mine/platform.toml", "-o", "mine/controller", "--no-build"]);
    assert_eq!(built.code, 0, "{}", built.stderr);
}

#[test]
fn plausible_platforms_pass_check_in_the_first_round() {
    let folder = Folder::new();
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    let count = length(2, 34);
    let mut refused = Vec::new();
    for number in 0..count {
        for like in ["reference", "legs"] {
            let name = format!("{like}-{number}");
            let values = plausible(&mut rng);
            let mut arguments = vec!["new", &name, "--like", like];
            arguments.extend(values.iter().map(String::as_str));
            let made = folder.run(&arguments);
            if made.code != 0 {
                refused.push(format!("{}\n{}", values.join(" "), made.stderr));
            }
        }
    }
    println!("first round: {} of {} pass", 2 * count - refused.len(), 2 * count);
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// `specgen new NAME` with these answers on standard input.
fn asked(folder: &Folder, name: &str, answers: &str) -> Run {
    folder.write("answers.txt", answers);
    let input = fs::File::open(folder.path("answers.txt")).unwrap();
    Run::of(folder.command().args(["new", name]).stdin(input))
}

#[test]
fn questions_are_asked_again_until_the_answer_holds_and_blank_lines_take_what_is_offered() {
    let folder = Folder::new();
    // The kind of gauges; then a radius without unit, one in a wrong unit, a correct one; defaults for the rest.
    let answers = format!("platform\n200\n200 kg\n200 mm\n{}", "\n".repeat(40));
    let made = asked(&folder, "mine", &answers);
    assert_eq!(made.code, 0, "{}", made.stderr);
    assert_eq!(made.stderr.matches("r_B [").count(), 3, "{}", made.stderr);
    assert!(folder.read("mine/platform.toml").contains("base_radius     = \"200 mm\""));
    let early = asked(&folder, "other", "platform\n200 mm\n");
    assert_eq!(early.code, 2);
    assert!(early.stderr.contains("--platform-radius") && early.stderr.contains("--like"), "{}", early.stderr);
    assert!(!folder.path("other").exists());
}

#[test]
fn what_cannot_be_is_refused_by_its_option_and_nothing_of_the_users_is_touched() {
    let folder = Folder::new();
    let slips = folder.line("new mine --like reference --stroke 100 --rate '20 kg' --inertia 0.0012");
    assert_eq!(slips.code, 2);
    for option in ["--stroke", "--rate", "--inertia"] {
        assert!(slips.stderr.contains(option), "{option}: {}", slips.stderr);
    }
    assert!(!folder.path("mine").exists());
    assert_eq!(folder.run(&["new", "9 lives", "--like", "legs"]).code, 2);
    fs::create_dir(folder.path("full")).unwrap();
    fs::write(folder.path("full/notes.txt"), "mine").unwrap();
    assert_eq!(folder.run(&["new", "full", "--like", "legs"]).code, 2);
    assert_eq!(folder.read("full/notes.txt"), "mine");
    // Answers that are only inconsistent together are kept in the refused spec.
    let heavy = ["--mass", "900 kg", "--inertia", "1 kg m^2, 1 kg m^2, 1.2 kg m^2"];
    let together = folder.run(&[&["new", "heavy", "--like", "reference"], &heavy[..]].concat());
    together.says(1, &["E0459", "wrote heavy"]);
    assert!(folder.read("heavy/platform.toml").contains("900 kg"));
}

#[test]
fn a_record_of_a_leg_of_a_spec_has_its_stroke_its_voltages_and_its_noise() {
    let folder = Folder::new();
    let text = fs::read_to_string(repository().join("specs/minimal.toml")).unwrap();
    let text = text
        .replace("[\"0 V\", \"100 V\"]", "[\"-20 V\", \"130 V\"]")
        .replace("[\"0 V\", \"150 V\"]", "[\"-20 V\", \"130 V\"]");
    // The record that it names does not exist yet.
    folder.write("own.toml", text.replace("records/reference-forc.csv", "own.csv"));
    let made = folder.run(&["forc", "own.toml", "-o", "own.csv"]);
    assert_eq!(made.code, 0, "{}", made.stderr);
    let record = folder.read("own.csv");
    let rows: Vec<[f64; 3]> = record
        .lines()
        .skip(1)
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let mut cells = line.split(',').map(|cell| cell.parse().unwrap());
            std::array::from_fn(|_| cells.next().unwrap())
        })
        .collect();
    let largest = |column: usize| rows.iter().map(|row| row[column]).fold(f64::MIN, f64::max);
    let smallest = |column: usize| rows.iter().map(|row| row[column]).fold(f64::MAX, f64::min);
    assert_eq!((smallest(1), largest(1)), (-20.0, 130.0));
    // Five stacks of 0.1262 um/V over 150 V, and the creep on top.
    let expected = 5.0 * 0.1262 * 150.0;
    assert!((0.95..1.2).contains(&(largest(2) / expected)), "{}", largest(2));
    assert_eq!(folder.run(&["check", "own.toml"]).code, 0);
}
