//! Set-points of the emitted controller: paths and tables as it plays them, how a simulation scores them, and what they cost.

use std::fs;

use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;
use host_sim::plant::LegParameters;
use host_sim::trajectory::{PaperPose, PoseTrajectory};
use specgen::machine;
use specgen::model;
use specgen::waveform;
use specgen_runtime::setpoint::BUSY;
use specgen_tests::{Emitted, compile_edited, length, repository, scenario, worse};

use crate::setpoint::{F32, PATHS, assert_whole, eight};

/// What a user does: tables beside the spec, played by the emitted controller.
const WITH_TABLE: (&str, &str) = (
    "[timing]",
    "[[trajectory]]\nname = \"eight\"\nkind = \"waveform\"\nfile = \"records/eight.csv\"\nperiod = \"1 ms\"\n\n[timing]",
);
const WITH_TABLES: (&str, &str) = (
    "[timing]",
    "[[trajectory]]\nname = \"eight\"\nkind = \"waveform\"\nfile = \"records/eight.csv\"\nperiod = \"1 ms\"\n\n\
     [[trajectory]]\nname = \"line\"\nkind = \"waveform\"\nfile = \"records/line.csv\"\nperiod = \"10 ms\"\n\n[timing]",
);

/// From x = −3 µm, where the bias is not, to 3 µm in a second.
fn line() -> String {
    (0..=100).fold("x_um\n".to_owned(), |text, k| text + &format!("{}\n", -3.0 + 0.06 * f64::from(k)))
}

/// `target` of an emitted controller that stands at its bias and then plays a trajectory, and the bias.
fn emitted_targets(controller: &mut Controller, selector: u64) -> (Vec<[f64; 6]>, [f64; 6]) {
    let description = controller.description().clone();
    let at = |name: &str| description.input(name).unwrap();
    let (command, select) = (at("command"), at("selector"));
    let (target, status) = (description.output("target[0]").unwrap(), description.output("status").unwrap());
    let mut input = vec![description.scalar.encode(0.0); description.input_names.len()];
    input[command] = 0;
    input[select] = selector;
    input[at("sequence")] = 0;
    let mut output = vec![0; description.output_names.len()];
    let mut tick = |input: &[u64]| {
        controller.step(input, &mut output);
        let pose: [f64; 6] = std::array::from_fn(|axis| description.scalar.decode(output[target + axis]));
        (pose, output[status] & 0x7_0000)
    };
    let bias = loop {
        let (pose, status) = tick(&input);
        if status == 0 {
            break pose;
        }
    };
    input[command] = 3;
    let mut poses = Vec::new();
    loop {
        let (pose, status) = tick(&input);
        poses.push(std::array::from_fn(|axis| pose[axis] - bias[axis]));
        if status == 0 {
            return (poses, bias);
        }
        assert_eq!(status, u64::from(BUSY));
    }
}

#[test]
fn the_emitted_controller_plays_the_papers_paths_and_a_table() {
    let text = eight();
    let rows = waveform::parse(&text, "eight.csv", 1e-3, None).unwrap().rows;
    let each = [("setpoint-f64", &[WITH_TABLES][..], 1e-12), ("setpoint-f32", &[WITH_TABLES, F32][..], 0.1e-9)];
    for (name, edits, tolerance) in each.into_iter().take(length(1, 2)) {
        let records = [("eight.csv", text.clone()), ("line.csv", line())];
        let emitted = Emitted::with_records(name, "reference.toml", edits, &records);
        let mut controller = emitted.at_run_time();
        for (selector, (_, path)) in (0..).zip(PATHS) {
            controller.reset();
            let host = PaperPose::corrected(path, 1.0);
            let (poses, bias) = emitted_targets(&mut controller, selector);
            assert!((bias[2] - 10e-6).abs() < 1e-12 && bias[0] == 0.0);
            assert_whole(poses.len(), &host, 100e-6);
            let mut worst = 0.0_f64;
            for (tick, pose) in (1..).zip(&poses) {
                let expected = host.target(f64::from(tick) * 100e-6).pose;
                worst = (0..3).fold(worst, |worst, axis| worse(worst, (pose[axis] - expected[axis]).abs()));
            }
            println!("{name} {path:?}: {worst:.1e} m");
            assert!(worst <= tolerance, "{name} {path:?}: {worst:e}");
        }
        controller.reset();
        let (poses, _) = emitted_targets(&mut controller, 3);
        assert_eq!(poses.len(), 10 * (rows.len() - 1));
        for (row, pose) in rows[1..].iter().zip(poses.iter().skip(9).step_by(10)) {
            assert!((0..3).all(|axis| (pose[axis] - row[axis]).abs() <= tolerance), "{row:?} {pose:?}");
        }
        // A path that does not start at the bias: busy from the first tick of the way there to the end.
        controller.reset();
        let (poses, _) = emitted_targets(&mut controller, 4);
        let approach = poses.len().checked_sub(10_000).expect("the path is played");
        assert!(approach > 100 && (poses[approach - 1][0] + 3e-6).abs() <= tolerance, "{approach} ticks");
        assert!(
            (poses[approach + 4999][0]).abs() <= tolerance && (poses[approach + 9999][0] - 3e-6).abs() <= tolerance
        );
        if name == "setpoint-f64" {
            scored_whole(&emitted, &mut controller);
        }
    }
}

/// The simulation scores that path, and nothing else.
fn scored_whole(emitted: &Emitted, controller: &mut Controller) {
    let model = &emitted.compiled.model;
    let scenario = scenario(&emitted.compiled, &LegParameters::reference(), 1);
    let path = machine::on_board(&emitted.compiled, 4).unwrap();
    assert_eq!((path.ticks, path.repeats, path.approach.unwrap()[0]), (10_000, false, -3e-6));
    let run = scenario.play(controller, &path, None).unwrap();
    let errors = run.scored().unwrap();
    println!("line: {}, {:.2} nm rms", errors.coverage(), errors.rms_translation_nm());
    assert_eq!(errors.coverage(), Coverage::new(10_000, 10_000, model.timing.period));
    assert!((0.5..5.0).contains(&errors.rms_translation_nm()));
    // Case 1 begins at the bias.
    assert_eq!(machine::on_board(&emitted.compiled, 0).unwrap().approach, None);
    assert_eq!(machine::on_board(&emitted.compiled, 5), None);
}

#[test]
fn a_table_is_part_of_the_digest_and_its_absence_is_reported() {
    let digest = |text: String| {
        compile_edited("setpoint-digest", "reference.toml", &[WITH_TABLE], &[("eight.csv", text)]).ir.digest
    };
    assert_ne!(digest(eight()), digest(eight().replacen("# made", "# Made", 1)));
    let folder = tempfile::tempdir().unwrap();
    let specs = repository().join("specs");
    let text = fs::read_to_string(specs.join("reference.toml")).unwrap().replace(WITH_TABLE.0, WITH_TABLE.1);
    fs::create_dir(folder.path().join("records")).unwrap();
    fs::copy(specs.join("records/reference-forc.csv"), folder.path().join("records/reference-forc.csv")).unwrap();
    let path = folder.path().join("platform.toml");
    fs::write(&path, text).unwrap();
    let refused = specgen::compile::compile(&path).unwrap_err();
    assert!(refused.findings.iter().any(|d| d.code == "E0501" || d.code == "E0306"), "{:#?}", refused.findings);
}

/// Mean instructions of the stage on the M7 in f64: standing, streaming, moving, playing.
const BUDGETS: [(&str, f64); 4] = [("hold", 150.0), ("stream", 300.0), ("move", 300.0), ("trajectory", 450.0)];

/// `cargo test -p specgen-tests setpoint instructions -- --nocapture` prints the figures.
#[test]
#[ignore = "long: an image of its own; the stages of the reference are held in the short run"]
fn set_points_stay_within_their_instructions() {
    let emitted = Emitted::new("setpoint-budget", "reference.toml", &[]);
    let Some(image) = emitted.image(model::Mcu::Mps2An500) else { return };
    let mut controller = emitted.at_run_time();
    let description = controller.description().clone();
    let at = |name: &str| description.input(name).unwrap();
    let (command, selector, sequence, x, rate) =
        (at("command"), at("selector"), at("sequence"), at("setpoint[0]"), at("setpoint_rate[0]"));
    for (kind, (name, budget)) in [0, 1, 2, 3].into_iter().zip(BUDGETS) {
        // The bias for a tenth of the ticks, then one thing only. The stage runs after the tick's own generator, with the same
        // command: of a stream it sees the ticks between fresh set-points.
        let mut words = Vec::new();
        for tick in 0..length(6_000, 12_000_u64) {
            let mut row = vec![0; description.input_names.len()];
            row[command] = kind;
            // Machining, whose sinusoids turn on five axes.
            row[selector] = 2;
            row[sequence] = tick;
            let time = 1e-4 * tick as f64;
            let place =
                if kind == 2 { 30e-6 } else { 5e-6 * (6.0 * (time - 0.13)).sin() * f64::from(u8::from(time > 0.13)) };
            row[x] = description.scalar.encode(place);
            row[rate] = description.scalar.encode(if kind == 1 { 30e-6 } else { 0.0 });
            words.extend(row);
        }
        let inputs = oracle::stimulus::InputRecording { width: description.input_names.len(), words };
        let (host, config) = specgen_tests::host_trace(&mut controller, &[], &inputs);
        let m = specgen::verify::measure(&image, &config, &host).unwrap();
        assert_eq!(m.first_difference, None, "{name}");
        let stage = m.stage("setpoint").unwrap();
        println!("{name}: {:.0} mean, {} to {} of {} calls", stage.mean, stage.min, stage.max, stage.calls);
        assert!(stage.mean <= budget, "{name}: {} instructions", stage.mean);
    }
}
