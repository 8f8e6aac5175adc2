//! `specgen export fmu` as a user runs it: every output word of the unit is that of the same controller under Rust.

use std::fs;
use std::process::Command;

use crate::support::{Folder, repository, skipped};
use host_sim::controller::{Controller, Supervised, TickController};
use host_sim::word::WordKind;
use rawzip::ZipArchive;

const TICKS: u32 = 10_000;

/// Extracts a unit into the folder `unit`: what is in it is stored, not compressed.
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

/// Inputs that arm the machine, run it and move its set-points.
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

#[test]
fn an_importer_gets_the_bits_of_the_controller() {
    if !cfg!(target_os = "linux") {
        skipped("the importer of this test is written for Linux");
        return;
    }
    let driver = repository().join("codegen/cli/tests/support/fmu.c");
    for (spec, name) in [("reference.toml", "reference"), ("legs.toml", "legs")] {
        let folder = Folder::new();
        for output in ["fmu", "again"] {
            let run = folder.run(&["export", "fmu", spec, "-o", output]);
            assert!(run.code == 0 && run.stdout.contains("FMI 2.0 co-simulation"), "{run:#?}");
        }
        let file = format!("fmu/{name}.fmu");
        assert!(fs::read(folder.path(&file)).unwrap() == fs::read(folder.path(format!("again/{name}.fmu"))).unwrap());
        extract(&folder, &file);
        let built =
            Command::new("cc").arg(&driver).args(["-o", "driver", "-ldl"]).current_dir(folder.path("")).status();
        assert!(built.unwrap().success());

        assert_eq!(folder.run(&["export", "c", spec, "-o", "c"]).code, 0);
        let library = Controller::load(&folder.path("c/libcontroller.so")).unwrap();
        let mut machine = Supervised::new(library).unwrap();
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
        let text = folder.read("unit/modelDescription.xml");
        let attribute = |name: &str| text.split(&format!(" {name}=\"")).nth(1).unwrap().split('"').next().unwrap();
        let run = |library: &str| {
            let mut command = Command::new(folder.path("driver"));
            command.arg(folder.path(library)).args([attribute("guid"), "inputs.bin", "outputs.bin"]);
            command.args([attribute("stepSize"), &inputs[0].len().to_string(), &kinds]);
            assert_eq!(command.current_dir(folder.path("")).status().unwrap().code(), Some(0), "{name}");
            fs::read(folder.path("outputs.bin")).unwrap()
        };
        let found = run(&format!("unit/binaries/linux64/{name}.so"));
        let wanted = bytes(expected.iter().copied());
        assert!(found == wanted, "{name}: words differ");
        // The comparison can fail, and the machine left its first phase.
        let supervisor = expected.chunks(row.len()).map(|row| row[row.len() - 2]);
        assert!(supervisor.collect::<std::collections::BTreeSet<u64>>().len() > 2);
        assert_ne!(found[found.len() / 2..], vec![0; found.len() - found.len() / 2]);
        if name == "legs" {
            // Built from its own sources it is the same controller.
            let made = Command::new("sh").arg(folder.path("unit/sources/build.sh")).arg("made.so").output().unwrap();
            assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
            assert!(run("unit/sources/made.so") == wanted, "from its sources");
        }
    }
}
