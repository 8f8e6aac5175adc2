//! `specgen export fmu` as a user runs it: outputs of the controller's unit equal those of the controller in Rust, and outputs of the
//! plant's unit equal those of `specgen sim`.

use std::fs;
use std::process::{Command, Stdio};

use crate::support::{Folder, length, repository, skipped};
use host_sim::controller::{Controller, Supervised, TickController};
use host_sim::record::{Reader, replay};
use host_sim::word::WordKind;
use rawzip::ZipArchive;

const TICKS: u32 = 10_000;

/// Extracts a unit, which is not compressed, into the folder `unit`.
fn extract(folder: &Folder, file: &str) {
    let bytes = fs::read(folder.path(file)).unwrap();
    let archive = ZipArchive::from_slice(&bytes).unwrap();
    for entry in archive.entries() {
        let entry = entry.unwrap();
        let name = String::from_utf8(entry.file_path().as_ref().to_vec()).unwrap();
        let path = folder.path("unit").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, archive.get_entry(entry.wayfinder()).unwrap().data()).unwrap();
    }
}

/// Settings of a plant.
const SETTINGS: usize = 5;

/// Asserts that no output of the unit in `unit/` depends directly on an input, except those in `at_first` before the first step.
fn is_no_loop(folder: &Folder, at_first: &str) {
    let text = folder.read("unit/modelDescription.xml");
    for (part, on) in [("Outputs", ""), ("InitialUnknowns", at_first)] {
        let lines = text.split(&format!("<{part}>\n")).nth(1).unwrap().split("</").next().unwrap().lines();
        let found: Vec<&str> = lines.map(|line| line.split(" dependencies=").nth(1).unwrap()).collect();
        assert!(!found.is_empty() && found.iter().all(|of| *of == format!("\"{on}\"/>")), "{part}: {found:?}");
    }
}

/// Inputs that arm and run the machine, and move its set-points.
fn inputs(machine: &Supervised) -> Vec<Vec<u64>> {
    let scalar = machine.controller().description().scalar;
    let names = machine.input_names();
    let word = |name: &String, tick: u32| {
        let swing = f64::from(tick % 997) / 997.0 - 0.5;
        match name.split('[').next().unwrap() {
            "gauge" | "displacement" => scalar.encode(1e-7 * swing + 1e-10 * f64::from(tick % 7)),
            "setpoint" => scalar.encode(1e-8 * swing),
            "request" => [0, 1, 2][usize::from(tick > 5) + usize::from(tick > 4000)],
            _ => 0,
        }
    };
    (0..TICKS).map(|tick| names.iter().map(|name| word(name, tick)).collect()).collect()
}

fn bytes(words: impl Iterator<Item = u64>) -> Vec<u8> {
    words.flat_map(u64::to_ne_bytes).collect()
}

/// Builds the importer of these tests, and lets it step the library of the unit in `unit/` through `inputs.bin`.
fn drive(folder: &Folder, library: &str, inputs: usize, kinds: &str) -> Vec<u8> {
    let driver = repository().join("codegen/cli/tests/support/fmu.c");
    let built = Command::new("cc").arg(driver).args(["-o", "driver", "-ldl"]).current_dir(folder.path("")).status();
    assert!(built.unwrap().success());
    let text = folder.read("unit/modelDescription.xml");
    let attribute = |name: &str| text.split(&format!(" {name}=\"")).nth(1).unwrap().split('"').next().unwrap();
    let mut command = Command::new(folder.path("driver"));
    command.arg(folder.path(library)).args([attribute("guid"), "inputs.bin", "outputs.bin"]);
    command.args([attribute("stepSize"), &inputs.to_string(), kinds]);
    assert_eq!(command.current_dir(folder.path("")).status().unwrap().code(), Some(0), "{library}");
    fs::read(folder.path("outputs.bin")).unwrap()
}

#[test]
fn an_importer_gets_the_bits_of_the_controller() {
    if !cfg!(target_os = "linux") {
        skipped("the importer of this test is written for Linux");
        return;
    }
    for (spec, name) in [("legs.toml", "legs"), ("reference.toml", "reference")].into_iter().take(length(1, 2)) {
        let folder = Folder::new();
        for output in ["fmu", "again"] {
            let run = folder.run(&["export", "fmu", spec, "-o", output]);
            assert!(run.code == 0 && run.stdout.contains("FMI 2.0 co-simulation"), "{run:#?}");
        }
        let file = format!("fmu/{name}.fmu");
        assert!(fs::read(folder.path(&file)).unwrap() == fs::read(folder.path(format!("again/{name}.fmu"))).unwrap());
        extract(&folder, &file);
        is_no_loop(&folder, "");

        assert_eq!(folder.run(&["export", "c", spec, "-o", "c"]).code, 0);
        let library = Controller::load(&folder.path("c/libcontroller.so")).unwrap();
        let mut machine = Supervised::new(library);
        let settings = machine.controller().default_config();
        machine.configure(&settings).unwrap();
        let inputs = inputs(&machine);
        let outputs = machine.output_names();
        let mut expected = Vec::new();
        let mut row = vec![0; outputs.len()];
        for input in &inputs {
            machine.step(input, &mut row);
            expected.extend_from_slice(&row);
        }
        let names: Vec<String> = machine.input_names().into_iter().chain(outputs).collect();
        let kind = |name: &String| if WordKind::of(name) == WordKind::Real { 'r' } else { 'i' };
        let kinds: String = names.iter().map(kind).collect();
        folder.write("inputs.bin", bytes(inputs.iter().flatten().copied()));
        let run = |library: &str| drive(&folder, library, inputs[0].len(), &kinds);
        let found = run(&format!("unit/binaries/linux64/{name}.so"));
        let wanted = bytes(expected.iter().copied());
        assert!(found == wanted, "{name}: words differ");
        // The comparison is able to fail, and the machine has left its first phase.
        let supervisor = expected.chunks(row.len()).map(|row| row[row.len() - 2]);
        assert!(supervisor.collect::<std::collections::BTreeSet<u64>>().len() > 2);
        assert_ne!(found[found.len() / 2..], vec![0; found.len() - found.len() / 2]);
        if name == "legs" && length(false, true) {
            // Built from its own sources it is the same controller.
            let made = Command::new("sh").arg(folder.path("unit/sources/build.sh")).arg("made.so").output().unwrap();
            assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
            assert!(run("unit/sources/made.so") == wanted, "from its sources");
        }
    }
}

/// Phase in which the law runs.
const RUNNING: u64 = 2;

/// Replays a recording of `specgen sim --record`: input and output words of every tick.
fn recorded(folder: &Folder, record: &str, machine: &mut Supervised) -> [Vec<Vec<u64>>; 2] {
    let mut reader = Reader::new(fs::File::open(folder.path(record)).unwrap()).unwrap();
    let [mut inputs, mut outputs] = [Vec::new(), Vec::new()];
    let found = replay(&mut reader, machine, |_, block, given| {
        inputs.extend(block.rows.iter().map(|row| row.input.clone()));
        outputs.extend_from_slice(given);
    });
    let found = found.unwrap();
    assert!(found.divergence.is_none() && inputs.len() == outputs.len() && inputs.len() > TICKS as usize, "{found:?}");
    [inputs, outputs]
}

/// Indices of the names with these stems, in the order of the stems.
fn places(names: &[String], stems: &[&str]) -> Vec<usize> {
    let of =
        |stem: &&str| (0..6).map(|k| names.iter().position(|name| *name == format!("{stem}[{k}]")).unwrap()).collect();
    stems.iter().flat_map(|stem: &&str| -> Vec<usize> { of(stem) }).collect()
}

/// Number of words that differ.
fn differing<'a>(found: impl Iterator<Item = &'a u64>, wanted: impl Iterator<Item = &'a u64>) -> usize {
    found.zip(wanted).filter(|(a, b)| a != b).count()
}

fn words(bytes: &[u8]) -> Vec<u64> {
    bytes.chunks_exact(8).map(|word| u64::from_ne_bytes(word.try_into().unwrap())).collect()
}

#[test]
#[ignore = "long: the unit of a plant is compiled from its sources, twice"]
fn a_controller_on_the_unit_of_its_plant_gets_the_bits_of_specgen_sim() {
    if !cfg!(target_os = "linux") {
        skipped("the importer of this test is written for Linux");
        return;
    }
    // The periods are 100 and 200 us. Each machine is compiled from its sources: six legs as well for the full run.
    let all = [("reference.toml", "reference", "1.1"), ("legs.toml", "legs", "2.1")];
    for &(spec, name, seconds) in length(&all[..1], &all) {
        let folder = Folder::new();
        let run = folder.run(&["export", "fmu", spec, "-o", "fmu", "--plant"]);
        assert!(run.code == 0 && run.stdout.contains(&format!("{name}_plant.fmu, FMI 2.0")), "{run:#?}");
        assert_eq!(folder.run(&["export", "c", spec, "-o", "c"]).code, 0);
        let run = folder.run(&["sim", spec, "--record", "run.rec", "--seconds", seconds]);
        assert_eq!(run.code, 0, "{run:#?}");
        let mut machine = Supervised::new(Controller::load(&folder.path("c/libcontroller.so")).unwrap());
        let (inputs, outputs) = (machine.input_names(), machine.output_names());
        let [given, answers] = recorded(&folder, "run.rec", &mut machine);

        // The plant alone, with the voltages of the record, must read the gauges of the next tick.
        let readings: &[&str] = if name == "legs" { &["displacement"] } else { &["gauge", "wrench"] };
        let (voltages, read) = (places(&outputs, &["voltage"]), places(&inputs, readings));
        let pick = |row: &[u64], places: &[usize]| places.iter().map(|place| row[*place]).collect::<Vec<_>>();
        // It arms before the plant moves. The first tick of the law repeats the first readings.
        let start = 1 + answers.iter().position(|row| row[row.len() - 2] & 0xff == RUNNING).unwrap();
        let moved = start + 1;
        assert_eq!(pick(&given[start], &read), pick(&given[0], &read));
        let own = if name == "legs" { (6, 12) } else { (12, 30) };
        let fed = |fault: Option<usize>| {
            let mut rows: Vec<Vec<u64>> =
                answers[start..start + TICKS as usize].iter().map(|row| pick(row, &voltages)).collect();
            rows.iter_mut().for_each(|row| row.resize(own.0, 0));
            if let Some(tick) = fault {
                rows[tick][2] ^= 1 << 20;
            }
            bytes(rows.into_iter().flatten())
        };
        extract(&folder, &format!("fmu/{name}_plant.fmu"));
        let variables = own.0 + own.1;
        is_no_loop(&folder, &(1..=SETTINGS).map(|k| (variables + k).to_string()).collect::<Vec<_>>().join(" "));
        let driven = |library: &str, inputs: Vec<u8>| {
            folder.write("inputs.bin", inputs);
            let found = drive(&folder, library, own.0, &"r".repeat(own.0 + own.1));
            words(&found).chunks(own.1).map(<[u64]>::to_vec).collect::<Vec<_>>()
        };
        let library = format!("unit/binaries/linux64/{name}_plant.so");
        let found = driven(&library, fed(None));
        let mut wanted: Vec<Vec<u64>> =
            given[moved..moved + TICKS as usize].iter().map(|row| pick(row, &read)).collect();
        assert_eq!(found.len(), TICKS as usize);
        let compare = |wanted: &[Vec<u64>]| {
            found.iter().zip(wanted).map(|(row, wanted)| differing(row.iter(), wanted.iter())).sum::<usize>()
        };
        assert_eq!(compare(&wanted), 0, "{name}: words differ");
        // A change of one ulp in a reading is detected, and a change of a voltage larger than its rounding moves the machine.
        wanted[TICKS as usize / 2][1] ^= 1;
        assert_eq!(compare(&wanted), 1, "{name}");
        let faulty = driven(&library, fed(Some(TICKS as usize / 2)));
        let first = faulty.iter().zip(&found).position(|(a, b)| a != b);
        // A stack may take some ticks to be off by a bit of its voltage.
        assert!(first.is_some_and(|tick| tick >= TICKS as usize / 2), "{name}: {first:?}");
        let made = Command::new("sh").arg(folder.path("unit/sources/build.sh")).arg("made.so").output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        assert!(driven("unit/sources/made.so", fed(None)) == found, "from its sources");
        let setpoint = places(&inputs, &["setpoint"])[2];
        with_fmpy(&folder, name, &given[..TICKS as usize], &answers, setpoint, start);
    }
}

/// Both units in fmpy, which validates them: the closed loop equals the record.
fn with_fmpy(folder: &Folder, name: &str, given: &[Vec<u64>], answers: &[Vec<u64>], setpoint: usize, first: usize) {
    let python = std::env::var("SPECGEN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python).args(["-c", "import fmpy"]).stderr(Stdio::null()).status();
    if !has.is_ok_and(|status| status.success()) {
        skipped("no Python with fmpy: units are not validated, nor connected (pip install fmpy, SPECGEN_PYTHON)");
        return;
    }
    let run = |given: &[Vec<u64>]| {
        folder.write("given.bin", bytes(given.iter().flatten().copied()));
        let mut command = Command::new(&python);
        command.arg(repository().join("codegen/cli/tests/support/fmu.py"));
        command.args([&format!("fmu/{name}.fmu"), &format!("fmu/{name}_plant.fmu"), "given.bin"]);
        let done = command
            .args([&given.len().to_string(), "loop.bin", &first.to_string()])
            .current_dir(folder.path(""))
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let found = words(&fs::read(folder.path("loop.bin")).unwrap());
        let wanted: Vec<u64> =
            given.iter().zip(answers).flat_map(|(input, output)| [&input[..], output].concat()).collect();
        assert_eq!(found.len(), wanted.len());
        differing(found.iter(), wanted.iter())
    };
    assert_eq!(run(given), 0, "{name}: words differ in the loop");
    // A set-point of another bit, late in the run.
    let mut given = given.to_vec();
    let at = given.len() - 100;
    given[at][setpoint] ^= 1 << 20;
    assert!(run(&given) > 0, "{name}");
}
