//! `specgen export` as a user runs it: the header is C11 and C++17 without a warning, and programs in C and Python give the digest of
//! the same library under Rust, after as many ticks.

use std::process::{Command, Stdio};

use crate::support::{Folder, length, skipped};
use host_sim::controller::{Controller, Supervised, TickController};

const TICKS: u64 = 1000;

/// Digest after the inputs of example.c, computed in Rust, with each gauge off by some ulps.
fn digest(folder: &Folder, dir: &str, ulps: u64) -> u64 {
    let library = folder.path(dir).join("libcontroller.so");
    let mut machine = Supervised::new(Controller::load(&library).unwrap());
    let words = machine.controller().description().config_names.len();
    let mut settings = vec![0; words];
    machine.controller().default_config().clone_into(&mut settings);
    machine.configure(&settings).unwrap();
    let scalar = machine.controller().description().scalar;
    let names = machine.input_names();
    let place = |name: &str| names.iter().position(|one| one == name).unwrap();
    let gauges = names.iter().position(|name| name == "gauge[0]" || name == "displacement[0]").unwrap();
    let (mut input, mut output) = (vec![0; names.len()], vec![0; machine.output_names().len()]);
    for tick in 0..TICKS {
        for leg in 0..6 {
            input[gauges + leg] = scalar.encode(1e-9 * ((tick + leg as u64) % 7) as f64) + ulps;
        }
        input[place("request")] = u64::from(tick > 0);
        machine.step(&input, &mut output);
    }
    machine.digest()
}

#[test]
fn a_program_in_c_links_the_controller_and_gets_its_bits() {
    let folder = Folder::new();
    for (spec, dir) in [("reference.toml", "c"), ("legs.toml", "six/c")].into_iter().take(length(1, 2)) {
        let run = folder.run(&["export", "c", spec, "-o", dir]);
        assert!(run.code == 0 && run.stdout.contains("cc -std=c11"), "{}{}", run.stdout, run.stderr);
        let wanted = format!("digest {:016x}", digest(&folder, dir, 0));
        assert_ne!(wanted, format!("digest {:016x}", digest(&folder, dir, 1)));
        let strict = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wl,-rpath,$ORIGIN", "-o", "example"];
        for (compiler, language) in [("cc", &["-std=c11"][..]), ("c++", &["-std=c++17", "-x", "c++"])] {
            let sources = ["example.c", "tick.c", "-x", "none", "-L.", "-lcontroller"];
            let sources = if compiler == "cc" { [&sources[..2], &sources[4..]].concat() } else { sources.to_vec() };
            let built =
                Command::new(compiler).args(language).args(strict).args(sources).current_dir(folder.path(dir)).output();
            let Ok(built) = built else {
                skipped(&format!("there is no {compiler} here"));
                continue;
            };
            assert!(built.status.success(), "{compiler}: {}", String::from_utf8_lossy(&built.stderr));
            let ran = Command::new(folder.path(dir).join("example")).arg(TICKS.to_string()).output().unwrap();
            let text = String::from_utf8(ran.stdout).unwrap();
            assert!(ran.status.success() && text.contains(&wanted), "{compiler}: {text} for {wanted}");
        }
        // The library of another spec is refused.
        let header = folder.path(dir).join("controller.h");
        let other = std::fs::read_to_string(&header).unwrap();
        let line = other.lines().find(|line| line.starts_with("#define SPECGEN_DIGEST")).unwrap();
        std::fs::write(&header, other.replace(line, "#define SPECGEN_DIGEST \"0\"")).unwrap();
        let source = ["-std=c11", "example.c", "tick.c", "-L.", "-lcontroller", "-Wl,-rpath,$ORIGIN", "-o", "example"];
        assert!(Command::new("cc").args(source).current_dir(folder.path(dir)).status().unwrap().success());
        let ran = Command::new(folder.path(dir).join("example")).output().unwrap();
        assert!(!ran.status.success() && String::from_utf8_lossy(&ran.stderr).contains("do not match"));
    }
}

/// The test in C, and a possible mistake.
const SCRIPT: &str = "
import sys
from controller import Controller

law = Controller()
gauges = 'gauge' if 'gauge' in law.inputs else 'displacement'
for tick in range(int(sys.argv[1])):
    law.step(request=int(tick > 0), **{gauges: [1e-9 * ((tick + leg) % 7) for leg in range(6)]})
print(f'digest {law.state_digest:016x}')
row = law.step()
assert row['supervisor'] & 255 in (1, 3) and row['dac_code'] == [code for code in row['dac_code'] if abs(code) < 2**24], row
law.configure(mode=1)
for wrong, error in ((dict(mode=99), ValueError), (dict(modus=1), KeyError), (dict(code_min=[1, 2]), ValueError)):
    try:
        law.configure(**wrong)
    except error as said:
        print(said)
    else:
        raise AssertionError(wrong)
law.reset()
assert Controller(supervised=False).step(**{gauges: [0.0] * 6})['voltage'][0] == Controller().step()['voltage'][0]
";

#[test]
fn a_module_in_python_steps_the_controller_and_gets_its_bits() {
    let folder = Folder::new();
    let single = folder.read("reference.toml").replace("scalar = \"f64\"", "scalar = \"f32\"");
    folder.write("single.toml", single);
    let all = [("legs.toml", "six/python"), ("reference.toml", "python"), ("single.toml", "single")];
    for (spec, dir) in all.into_iter().take(length(1, 3)) {
        let run = folder.run(&["export", "python", spec, "-o", dir]);
        assert!(run.code == 0 && run.stdout.contains("controller.py"), "{}{}", run.stdout, run.stderr);
        let python = |script: &str| {
            let mut python = Command::new("python3");
            python.args(["-I", "-c", &format!("import sys; sys.path.insert(0, '.'){script}"), &TICKS.to_string()]);
            python.current_dir(folder.path(dir)).output()
        };
        let Ok(ran) = python(SCRIPT) else { return skipped("there is no python3 here") };
        let text = String::from_utf8(ran.stdout).unwrap();
        let wanted = format!("digest {:016x}", digest(&folder, dir, 0));
        assert!(
            ran.status.success() && text.contains(&wanted),
            "{text} for {wanted}: {}",
            String::from_utf8_lossy(&ran.stderr)
        );
        assert!(text.contains("mode is out of its range") && text.contains("modus: expected one of mode, "), "{text}");
        // The line that is printed, without an input.
        let line = run.stdout.lines().map(str::trim).find(|line| line.starts_with("python3 ")).unwrap();
        let shell = Command::new("sh").args(["-c", line]).current_dir(folder.path(dir)).stdin(Stdio::null()).output();
        assert!(shell.unwrap().status.success(), "{line}");
        // The library of another spec is refused.
        let module = folder.read(&format!("{dir}/controller.py"));
        let other = module.replace("DIGEST = \"", "DIGEST = \"0");
        folder.write(&format!("{dir}/controller.py"), other);
        let ran = python("\nimport controller; controller.Controller()").unwrap();
        let text = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(!ran.status.success() && text.contains("the controller of another spec: export both again"), "{text}");
    }
}
