//! The law's sensing and forward kinematics on emitted constants against the runtime with the constants of the IR, bit for bit: the
//! emitter puts every constant where it belongs.

use std::fs;
use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::support::gauges::{
    Random, legs, lowered, model, real, runtime, sensing, task, three_two_one, tilted, with_scalar,
};
use specgen::emit::emit;
use specgen::ir::Ir;
use specgen::model::{Model, Scalar};
use specgen::workspace;
use specgen_runtime::sensing::faults;
use specgen_runtime::{Calibration, GaugeCalibration as _, Real};
use specgen_tests::{length, scratch};

const ROWS: usize = 500;

/// A program that reads rows of six words and prints, in hex: faults, pose from gauges if there are none, pose from legs.
const PROGRAM: &str = r#"
use controller::{Constants, Real};
use specgen_law::platform::sensing::pose;
use specgen_law::{Spec as _, kinematics};
use specgen_runtime::Real as _;
use specgen_runtime::sensing::faults;
fn main() {
    for line in std::io::stdin().lines() {
        let words: Vec<u64> = line.unwrap().split(' ').map(|w| u64::from_str_radix(w, 16).unwrap()).collect();
        let input: [Real; 6] = std::array::from_fn(|k| Real::from_word(words[k]));
        let legs: [Real; 6] = std::array::from_fn(|k| Real::from_word(words[6 + k]));
        let faults = faults(&input, Constants.raw_limits());
        let pose = if faults == 0 { pose(Constants, &input) } else { [0.0; 6] };
        print!("{faults:x}");
        for value in pose.iter().chain(&kinematics::pose_from_legs(Constants, &legs)) {
            print!(" {:x}", value.to_word());
        }
        println!();
    }
}
"#;

const MANIFEST: &str = r#"
[package]
name = "probe"
version = "0.1.0"
edition = "2024"
[dependencies]
controller = { path = "../controller" }
specgen-law = { path = "../law" }
specgen-runtime = { path = "../runtime" }
[workspace]
"#;

/// Gauge words about the range of the gauges, some beyond and some no numbers; leg displacements within the workspace.
fn rows<T: Real>(model: &Model, ir: &Ir) -> Vec<([T; 6], [T; 6])> {
    let limits = sensing(ir).raw_limits;
    let (legs, _) = legs::<T>(ir);
    let mut random = Random::new(21);
    (0..ROWS)
        .map(|row| {
            let mut raw = limits.map(|[low, high]| 0.5 * (low + high) + 0.5 * (high - low) * random.unit());
            match row % 10 {
                7 => raw[row % 6] = limits[row % 6][1] + 1e-5,
                8 => raw[row % 6] = f64::NAN,
                9 => raw = [limits[0][0], limits[1][1], limits[2][0], limits[3][1], limits[4][0], limits[5][1]],
                _ => {}
            }
            let pose = random.pose(model).map(|value| real::<T>(f64::from(value as f32)));
            (
                raw.map(
                    |value| {
                        if T::from_i32(1).to_word() >> 32 == 0 { real(f64::from(value as f32)) } else { real(value) }
                    },
                ),
                legs.displacements(&pose),
            )
        })
        .collect()
}

/// What the runtime says, a line a row.
fn expected<T: Real>(ir: &Ir, rows: &[([T; 6], [T; 6])]) -> Vec<String> {
    let s = sensing(ir);
    let gauges = runtime::<T>(ir);
    let (legs, inverse) = legs::<T>(ir);
    let limits = s.raw_limits.map(|limits| limits.map(real));
    let readings = |raw: &[T; 6]| match &s.calibration {
        None => *raw,
        Some(of_gauge) => {
            let coefficients = of_gauge.clone().map(|c| [real(c[0]), real(c[1]), real(c[2])]);
            Calibration::<T, 3> { coefficients }.readings(raw)
        }
    };
    rows.iter()
        .map(|(raw, displacements)| {
            let faults = faults(raw, &limits);
            let pose = if faults == 0 { gauges.pose(&readings(raw)) } else { [T::ZERO; 6] };
            let from_legs = legs.pose(&inverse, ir.kinematics.corrections as usize, displacements);
            let mut line = format!("{faults:x}");
            line.extend(pose.iter().chain(&from_legs).map(|value| format!(" {:x}", value.to_word())));
            line
        })
        .collect()
}

/// What the emitted crate says.
fn emitted<T: Real>(name: &str, ir: &Ir, rows: &[([T; 6], [T; 6])]) -> Vec<String> {
    let dir = scratch(name);
    workspace::write_scratch(&dir, &workspace::files(ir, &emit(ir))).unwrap();
    fs::create_dir_all(dir.join("probe/src")).unwrap();
    fs::write(dir.join("probe/Cargo.toml"), MANIFEST).unwrap();
    fs::write(dir.join("probe/src/main.rs"), PROGRAM).unwrap();
    let built = Command::new(env!("CARGO"))
        .args(["build", "--release", "--quiet", "--offline"])
        .current_dir(dir.join("probe"))
        .env("RUSTFLAGS", "-D warnings")
        .env("CARGO_TARGET_DIR", dir.join("target"))
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let mut program =
        Command::new(dir.join("target/release/probe")).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let lines: Vec<String> = rows
        .iter()
        .map(|(raw, legs)| {
            raw.iter().chain(legs).map(|value| format!("{:x}", value.to_word())).collect::<Vec<_>>().join(" ")
        })
        .collect();
    let mut input = program.stdin.take().unwrap();
    let writer = std::thread::spawn(move || input.write_all(lines.join("\n").as_bytes()).unwrap());
    let output = program.wait_with_output().unwrap();
    writer.join().unwrap();
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

fn agrees<T: Real>(name: &str, model: &Model) {
    let ir = lowered(model).unwrap();
    let rows = rows::<T>(model, &ir);
    let found = emitted(name, &ir, &rows);
    let wanted = expected(&ir, &rows);
    assert_eq!(found.len(), ROWS);
    let first = found.iter().zip(&wanted).position(|(found, wanted)| found != wanted);
    if let Some(row) = first {
        panic!("{name}, row {row}:\n{}\n{}", found[row], wanted[row]);
    }
    assert!(found.iter().any(|line| !line.starts_with("0 ")) && found.iter().any(|line| line.starts_with("0 ")));
    // The comparison sees the last bit of a constant.
    let mut wrong = ir;
    let constant = &mut wrong.task_space.as_mut().unwrap().sensing.inverse[2][0];
    *constant *= 1.0 + 2.0 * wrong.scalar.epsilon();
    assert!(expected(&wrong, &rows) != found, "{name}");
}

#[test]
#[ignore = "long: programs of their own; in the short run `run_time` compares the bits of an emitted platform"]
fn emitted_sensing_and_forward_kinematics_are_those_of_the_runtime_bit_for_bit() {
    if length(false, true) {
        agrees::<f64>("sensing-aligned", &model(three_two_one()));
    }
    let mut calibrated = with_scalar(model(tilted()), Scalar::F32);
    task(&mut calibrated).calibration =
        Some([0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(|k| vec![1e-7 * k, -(6.0 + 0.1 * k) * 1e-6, 1e-8 * k]));
    agrees::<f32>("sensing-tilted", &calibrated);
}

/// A controller that does not see the platform has no gauges of it.
#[test]
fn a_pose_is_sensed_only_where_gauges_see_the_platform() {
    let mut model = model(three_two_one());
    let platform = emit(&lowered(&model).unwrap());
    assert!(platform["src/gauges.rs"].contains("pub const GAUGES"));
    model.task_space = None;
    let ir = lowered(&model).unwrap();
    let files = emit(&ir);
    // Codes of the legs' own gauges, and nothing that finds a pose.
    let legs = &files["src/gauges.rs"];
    assert!(legs.contains("CONVERTER") && !legs.contains("GAUGES") && !legs.contains("pose"), "{legs}");
    assert!(!workspace::ir_text(&ir).contains("task_space"));
}
