//! Set-points of the compiled controller: trajectories against the host's own formulas, tables against their rows, and what is
//! refused when compiling.

use std::fs;

use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::Noise;
use host_sim::trajectory::{PaperPath, PaperPose, PoseTrajectory, Reading, Step};
use specgen::diagnostic::Diagnostic;
use specgen::ir::{self, Scalar};
use specgen::lower::setpoint;
use specgen::machine;
use specgen::model::{self, Model, Trajectory, TrajectoryKind};
use specgen::spec::{self, SpecSource};
use specgen::waveform::{self, Waveform};
use specgen_runtime::Real;
use specgen_runtime::setpoint as runtime;
use specgen_runtime::setpoint::{
    BUSY, Command, CommandKind, Generator, MoveLimits, Parallel, Setpoints, StopLimits, Target,
};
use specgen_tests::{Emitted, compile_edited, repository, worse};

const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
const PATHS: [(model::PaperPath, PaperPath); 3] = [
    (model::PaperPath::Case1, PaperPath::Case1),
    (model::PaperPath::Case2, PaperPath::Case2),
    (model::PaperPath::Machining, PaperPath::Machining),
];

fn reference() -> Model {
    let source = SpecSource::read(&repository().join("specs/reference.toml")).unwrap();
    spec::load(&source).0.expect("the reference spec is good")
}

fn lowered(model: &Model, waveforms: &[Option<Waveform>], scalar: Scalar) -> Result<ir::Setpoints, Vec<Diagnostic>> {
    setpoint::lower(model, model.task_space.as_ref().unwrap(), waveforms, scalar).map(|(setpoints, _)| setpoints)
}

fn with_trajectories(kinds: Vec<TrajectoryKind>) -> Model {
    let mut model = reference();
    let name = |index: usize| format!("t{index}");
    model.task_space.as_mut().unwrap().trajectories =
        kinds.into_iter().enumerate().map(|(index, kind)| Trajectory { name: name(index), lead: None, kind }).collect();
    model
}

fn paper(path: model::PaperPath, as_printed: bool, frequency: f64) -> TrajectoryKind {
    TrajectoryKind::Paper { path, as_printed, frequency }
}

/// The plan that the emitter prints, as a value.
fn plan<T: Real>(model: &Model, setpoints: &ir::Setpoints) -> Setpoints<T, Parallel> {
    let n = |value: f64| T::from_f64(value);
    let six = |values: [f64; 6]| values.map(T::from_f64);
    let trajectory = |trajectory: &ir::Trajectory| match &trajectory.path {
        ir::Path::Segments { start, segments, ticks, end } => {
            let segments: Vec<runtime::Segment<T>> = segments
                .iter()
                .map(|segment| runtime::Segment {
                    first: segment.first as i32,
                    per_tick: n(segment.per_tick),
                    per_second: n(segment.per_second),
                    phase: segment.phase,
                    phase_step: segment.phase_step,
                    angular: n(segment.angular),
                    axes: segment.axes.map(|axis| runtime::Axis {
                        place: n(axis.place),
                        slope: n(axis.slope),
                        sine: axis.sine.map(n),
                        cosine: axis.cosine.map(n),
                    }),
                })
                .collect();
            runtime::Trajectory::Segments {
                start: six(*start),
                segments: segments.leak(),
                ticks: *ticks as i32,
                end: six(*end),
            }
        }
        ir::Path::Table { rows, row_ticks, per_tick, per_second, bend_rate, repeat } => {
            let rows: Vec<runtime::Row<T>> =
                rows.iter().map(|row| runtime::Row { pose: six(row.pose), bend: six(row.bend) }).collect();
            runtime::Trajectory::Table(runtime::Table {
                rows: rows.leak(),
                row_ticks: *row_ticks as i32,
                per_tick: n(*per_tick),
                per_second: n(*per_second),
                bend_rate: n(*bend_rate),
                repeat: *repeat,
            })
        }
    };
    let trajectories: Vec<runtime::Trajectory<T>> = setpoints.trajectories.iter().map(trajectory).collect();
    let [tx, ty, tz] = model.workspace.translation;
    let [rx, ry, rz] = model.workspace.rotation;
    Setpoints {
        period: n(setpoints.period),
        rate: n(setpoints.rate),
        square_rate: n(setpoints.square_rate),
        bias: six(setpoints.bias),
        home: six(setpoints.home),
        bound: six([tx, ty, tz, rx, ry, rz]),
        limits: MoveLimits {
            speed: six(setpoints.speed_limit),
            acceleration: six(setpoints.acceleration_limit),
            jerk: six(setpoints.jerk_limit),
        },
        stop: StopLimits {
            acceleration: six(setpoints.stop_acceleration_limit),
            jerk: six(setpoints.stop_jerk_limit),
            shortest: setpoints.shortest_stop,
        },
        stream_step: six(setpoints.stream_step),
        stream_rate: six(setpoints.stream_rate),
        stream_acceleration: six(setpoints.stream_acceleration),
        stale_ticks: setpoints.stale_ticks,
        frames: Parallel,
        trajectories: trajectories.leak(),
    }
}

/// Every set-point of trajectory `selector` from its first tick to its last, without the bias.
fn play<T: Real + Into<f64>>(model: &Model, plan: &Setpoints<T, Parallel>, selector: u32) -> Vec<Target<f64>> {
    let mut generator = Generator::new();
    let mut command = Command { kind: CommandKind::Hold, selector, sequence: 0, target: Target::at([T::ZERO; 6]) };
    while generator.next(plan, &command).1 != 0 {}
    command.kind = CommandKind::Trajectory;
    let bias = model.task_space.as_ref().unwrap().setpoint.bias;
    let mut targets = Vec::new();
    loop {
        let (target, status) = generator.next(plan, &command);
        let mut pose = target.pose.map(Into::into);
        pose.iter_mut().zip(bias).for_each(|(value, bias): (&mut f64, f64)| *value -= bias);
        let (rate, acceleration) = (target.rate.map(Into::into), target.acceleration.map(Into::into));
        targets.push(Target { pose, rate, acceleration });
        if status != BUSY {
            assert_eq!(status, 0);
            return targets;
        }
    }
}

/// What is compared is the whole path, and nothing behind it.
fn assert_whole(ticks: usize, host: &dyn PoseTrajectory, period: f64) {
    let seconds = ticks as f64 * period;
    assert!((seconds - host.duration()).abs() < period, "{seconds} s of {} s", host.duration());
}

/// Largest deviation of pose, rate and acceleration from the host's formulas, of lengths (index 0) and angles (1).
fn deviation(targets: &[Target<f64>], host: &dyn PoseTrajectory, period: f64) -> [[f64; 2]; 3] {
    assert_whole(targets.len(), host, period);
    let mut worst = [[0.0_f64; 2]; 3];
    for (tick, target) in (1..).zip(targets) {
        let expected = host.target(f64::from(tick) * period);
        let pairs =
            [(target.pose, expected.pose), (target.rate, expected.rate), (target.acceleration, expected.acceleration)];
        for (worst, (found, expected)) in worst.iter_mut().zip(pairs) {
            for axis in 0..6 {
                let difference = (found[axis] - expected[axis]).abs();
                worst[axis / 3] = worse(worst[axis / 3], difference);
            }
        }
    }
    worst
}

#[test]
fn paths_on_board_are_the_hosts_to_a_picometre_in_f64_and_a_tenth_of_a_nanometre_in_f32() {
    for frequency in [0.1, 1.0, 10.0] {
        let model = with_trajectories(PATHS.map(|(path, _)| paper(path, false, frequency)).to_vec());
        let double = plan::<f64>(&model, &lowered(&model, &[], Scalar::F64).unwrap());
        let single = plan::<f32>(&model, &lowered(&model, &[], Scalar::F32).unwrap());
        for (selector, (_, path)) in (0..).zip(PATHS) {
            let host = PaperPose::corrected(path, frequency);
            let targets = play(&model, &double, selector);
            assert_eq!(targets.len(), (host.duration() / model.timing.period).round() as usize);
            let f64s = deviation(&targets, &host, model.timing.period);
            let f32s = deviation(&play(&model, &single, selector), &host, model.timing.period);
            println!(
                "{path:?} {frequency} Hz: f64 {:.1e} m, f32 {:.1e} m, {:.1e} rad",
                f64s[0][0], f32s[0][0], f32s[0][1]
            );
            assert!(f64s[0][0] <= 1e-12 && f64s[0][1] <= 1e-12, "{path:?} {frequency}: {f64s:?}");
            assert!(f32s[0][0] <= 0.1e-9 && f32s[0][1] <= 1e-9, "{path:?} {frequency}: {f32s:?}");
            // Rates are up to 2π · 15 µm · f, accelerations that times 2π f.
            let (fast, sharp) = (0.1e-3 * frequency, 0.6e-3 * frequency * frequency);
            assert!(f64s[1][0] <= 1e-9 * fast && f64s[2][0] <= 1e-9 * sharp, "{path:?} {frequency}: {f64s:?}");
            assert!(f32s[1][0] <= 1e-5 * fast && f32s[2][0] <= 1e-5 * sharp, "{path:?} {frequency}: {f32s:?}");
        }
    }
}

#[test]
fn a_step_on_board_is_the_hosts_without_a_corner_and_refused_where_it_is_too_fast() {
    let to = [10e-6, 0.0, -4e-6, 20e-6, 0.0, 0.0];
    let step = |time: f64| with_trajectories(vec![TrajectoryKind::Step { to, time }]);
    let (model, host) = (step(5e-3), Step { to, time: 5e-3 });
    let (_, warnings) = setpoint::lower(&model, model.task_space.as_ref().unwrap(), &[], Scalar::F64).unwrap();
    assert!(warnings.is_empty(), "{warnings:#?}");
    let double = play(&model, &plan::<f64>(&model, &lowered(&model, &[], Scalar::F64).unwrap()), 0);
    let single = play(&model, &plan::<f32>(&model, &lowered(&model, &[], Scalar::F32).unwrap()), 0);
    assert_eq!(double.len(), 50);
    let [f64s, f32s] = [&double, &single].map(|targets| deviation(targets, &host, model.timing.period));
    println!("step: f64 {:.1e} m, f32 {:.1e} m", f64s[0][0], f32s[0][0]);
    assert!(f64s[0][0] <= 1e-12 && f64s[1][0] <= 1e-9 && f32s[0][0] <= 0.1e-9, "{f64s:?} {f32s:?}");
    let last = double.last().unwrap();
    assert!((0..6).all(|axis| (last.pose[axis] - to[axis]).abs() < 1e-15 && last.rate[axis].abs() < 1e-12), "{last:?}");
    // 10 µm in 3 ms are 6.7 mm/s in the middle.
    let found = lowered(&step(3e-3), &[], Scalar::F64).unwrap_err();
    assert_eq!(codes(&found), ["E0455"]);
    let needed: f64 = found[0].help.split(' ').nth(2).unwrap().parse().unwrap();
    assert!(needed > 3.9 && lowered(&step(1e-3 * needed), &[], Scalar::F64).is_ok(), "{found:#?}");
    assert_eq!(codes(&lowered(&step(1e-4), &[], Scalar::F64).unwrap_err()), ["E0456"]);
}

#[test]
fn the_comparison_of_paths_sees_a_wrong_phase_and_a_late_tick() {
    let model = with_trajectories(vec![paper(model::PaperPath::Machining, false, 1.0)]);
    let host = PaperPose::corrected(PaperPath::Machining, 1.0);
    let good = lowered(&model, &[], Scalar::F64).unwrap();
    let mut wrong = good.clone();
    if let ir::Path::Segments { segments, .. } = &mut wrong.trajectories[0].path {
        segments[1].phase_step += 1 << 30;
    }
    let targets = play(&model, &plan::<f64>(&model, &wrong), 0);
    assert!(deviation(&targets, &host, model.timing.period)[0][0] > 1e-12);
    let targets = play(&model, &plan::<f64>(&model, &good), 0);
    assert!(deviation(&targets[1..], &host, model.timing.period)[0][0] > 1e-12);
}

#[test]
fn pieces_need_not_end_on_a_tick() {
    let mut model = with_trajectories(PATHS.map(|(path, _)| paper(path, false, 3.7)).to_vec());
    model.timing.period = 130e-6;
    let plan = plan::<f64>(&model, &lowered(&model, &[], Scalar::F64).unwrap());
    for (selector, (_, path)) in (0..).zip(PATHS) {
        let host = PaperPose::corrected(path, 3.7);
        let found = deviation(&play(&model, &plan, selector), &host, model.timing.period);
        assert!(found[0][0] <= 1e-12 && found[0][1] <= 1e-12 && found[1][0] <= 1e-12, "{path:?}: {found:?}");
    }
}

fn codes(found: &[Diagnostic]) -> Vec<&str> {
    let mut codes: Vec<&str> = found.iter().map(|d| d.code).collect();
    codes.dedup();
    codes
}

#[test]
fn printed_paths_that_jump_are_refused_with_place_and_size() {
    for (path, expected) in [
        (model::PaperPath::Case1, "y jumps by -5.000 um after 5.000000 s"),
        (model::PaperPath::Case2, "z jumps by 2.286 um after 5.000000 s"),
        (model::PaperPath::Machining, "y jumps by 1.792 um after 0.500000 s"),
    ] {
        let found = lowered(&with_trajectories(vec![paper(path, true, 0.1)]), &[], Scalar::F64).unwrap_err();
        assert!(codes(&found).contains(&"E0453"), "{found:#?}");
        assert!(found.iter().any(|d| d.message.contains(expected)), "{path:?}: {found:#?}");
        assert!(found.iter().all(|d| !d.help.is_empty() && d.message.contains("\"t0\"")));
    }
    // The host knows the same jumps.
    let host = PaperPose { path: PaperPath::Case2, reading: Reading::AsPrinted, frequency: 0.1 };
    assert!(host.jumps().iter().any(|jump| jump.axis == 2 && (jump.pose * 1e6 - 2.286).abs() < 1e-3));
}

#[test]
fn corrected_paths_are_warned_of_for_their_corners() {
    let model = with_trajectories(vec![paper(model::PaperPath::Machining, false, 1.0)]);
    let (_, warnings) = setpoint::lower(&model, model.task_space.as_ref().unwrap(), &[], Scalar::F64).unwrap();
    assert_eq!(codes(&warnings), ["W0458"]);
    assert!(
        warnings[0].message.contains("after 2.500000 s, where the speed of y changes by 54.049 um/s"),
        "{warnings:#?}"
    );
}

#[test]
fn paths_out_of_reach_too_fast_or_too_slow_for_the_ticks_are_refused() {
    let kinds = || vec![paper(model::PaperPath::Case1, false, 1.0)];
    let refused = |change: fn(&mut Model)| {
        let mut model = with_trajectories(kinds());
        change(&mut model);
        let found = lowered(&model, &[], Scalar::F64).unwrap_err();
        (codes(&found).join(" "), found[0].message.clone())
    };
    // z reaches 40 µm, 50 with the bias.
    let (code, message) = refused(|model| model.workspace.translation[2] = 49e-6);
    assert!(code == "E0454" && message.contains("z at 50.000 um after 2.500000 s"), "{code} {message}");
    let (code, message) = refused(|model| model.task_space.as_mut().unwrap().setpoint.stream_speed[1] = 50e-6);
    assert!(code == "E0455" && message.contains("y moves at"), "{code} {message}");
    let (code, _) = refused(|model| model.timing.period = 0.6);
    assert_eq!(code, "E0456");
    let (code, message) = refused(|model| model.task_space.as_mut().unwrap().setpoint.bias[0] = 60e-6);
    assert!(code.starts_with("E0450") && message.contains("the bias pose puts x at 60.000 um"), "{code} {message}");
    let (code, message) = refused(|model| model.task_space.as_mut().unwrap().setpoint.speed[4] = 1e-9);
    assert!(code == "E0451" && message.contains("more than 210 s"), "{code} {message}");
    let (code, message) = refused(|model| model.task_space.as_mut().unwrap().frames.work[0] = 12e-3);
    assert!(code.starts_with("E0450") && message.contains("the zero of the work frame"), "{code} {message}");
    let (code, _) = refused(|model| {
        model.task_space.as_mut().unwrap().frames.work[5] = 0.5;
        model.workspace.rotation = [0.1; 3];
    });
    assert_eq!(code, "E0452");
}

/// A figure of eight that starts and ends at rest, sampled every ms.
fn eight() -> String {
    let mut text = "# made by a test\ntime_ms,x_um,y_um,theta_z_urad\n".to_owned();
    for k in 0..=400 {
        let w = 0.5 - 0.5 * (std::f64::consts::PI * f64::from(k) / 400.0).cos();
        let turn = std::f64::consts::TAU * w;
        text += &format!("{k},{},{},{}\n", 7.0 * turn.sin(), 3.5 * (2.0 * turn).sin(), 40.0 * (1.0 - turn.cos()));
    }
    text
}

fn table(text: &str, period: f64, repeat: bool) -> (Model, Result<ir::Setpoints, Vec<Diagnostic>>) {
    let file = "eight.csv".to_owned();
    let waveform = waveform::parse(text, &file, period).unwrap();
    let model = with_trajectories(vec![TrajectoryKind::Waveform { file, period, repeat }]);
    let setpoints = lowered(&model, &[Some(waveform)], Scalar::F64);
    (model, setpoints)
}

#[test]
fn a_table_goes_through_its_rows_with_continuous_acceleration_from_rest_to_rest() {
    let text = eight();
    let rows = waveform::parse(&text, "eight.csv", 1e-3).unwrap().rows;
    let (model, setpoints) = table(&text, 1e-3, false);
    let targets = play(&model, &plan::<f64>(&model, &setpoints.unwrap()), 0);
    assert_eq!(targets.len(), 4000);
    let period = model.timing.period;
    for (row, target) in rows[1..].iter().zip(targets.iter().skip(9).step_by(10)) {
        for axis in 0..6 {
            assert!((target.pose[axis] - row[axis]).abs() < 1e-18, "{target:?} {row:?}");
        }
    }
    assert_eq!(targets.last().unwrap().rate, [0.0; 6]);
    assert!(targets[0].rate[0].abs() < 1e-6, "starts at rest: {:?}", targets[0]);
    // Rate and acceleration are those of the pose, also across rows: the third derivative is a few times 10 µm (2π/0.2 s)³.
    let jerk = 4.0 * 10e-6 * (std::f64::consts::TAU / 0.2_f64).powi(3);
    for w in targets.windows(3) {
        for axis in 0..3 {
            let rate = (w[2].pose[axis] - w[0].pose[axis]) / (2.0 * period);
            let acceleration = (w[2].rate[axis] - w[0].rate[axis]) / (2.0 * period);
            assert!((rate - w[1].rate[axis]).abs() < jerk * period * period, "{w:?}");
            assert!((acceleration - w[1].acceleration[axis]).abs() < jerk * period, "{w:?}");
        }
    }
}

#[test]
fn tables_with_jumps_wrong_units_or_places_out_of_reach_are_refused_by_line() {
    let refused = |text: &str, period: f64, repeat: bool| table(text, period, repeat).1.unwrap_err();
    let line = |found: &Diagnostic| match &found.place {
        specgen::diagnostic::Place::File { path, line } => (path.clone(), *line),
        other => panic!("{other:?}"),
    };
    let good = eight();
    // A sample that fell to 0: 6.7 µm within a ms are more than 5 mm/s · 1 ms.
    let mut lines: Vec<&str> = good.lines().collect();
    lines[120] = "118,0,0,0";
    let found = refused(&lines.join("\n"), 1e-3, false);
    assert_eq!((codes(&found), line(&found[0])), (vec!["E0453"], ("eight.csv".to_owned(), Some(121))), "{found:#?}");
    assert!(found[0].message.contains("x jumps by"), "{found:#?}");
    // Micrometres called millimetres.
    let found = refused(&good.replace("x_um", "x_mm"), 1e-3, false);
    assert_eq!(codes(&found)[0], "E0453");
    assert!(found[0].help.contains("unit"), "{found:#?}");
    // Too large, without a jump.
    let slow: String =
        "z_um\n".to_owned() + &(0..=200).map(|k| format!("{}\n", f64::from(k) * 0.26)).collect::<String>();
    let found = refused(&slow, 1e-3, false);
    assert_eq!(codes(&found), ["E0454"], "{found:#?}");
    assert!(found[0].message.contains("outside the workspace of ±") && line(&found[0]).1 == Some(202), "{found:#?}");
    // Rows between ticks, and a closed table closed twice.
    let found = refused(&good, 1e-3 + 0.9e-6, false);
    assert_eq!(codes(&found), ["E0456"]);
    let circle: String = (0..=64)
        .map(|k| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k % 64) / 64.0).sin_cos();
            format!("{},{}\n", 5.0 * c, 5.0 * s)
        })
        .collect();
    let found = refused(&format!("x_um,y_um\n{circle}"), 5e-3, true);
    assert_eq!((codes(&found), line(&found[0]).1), (vec!["E0457"], Some(66)));
}

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
    let rows = waveform::parse(&text, "eight.csv", 1e-3).unwrap().rows;
    for (name, edits, tolerance) in
        [("setpoint-f64", &[WITH_TABLES][..], 1e-12), ("setpoint-f32", &[WITH_TABLES, F32][..], 0.1e-9)]
    {
        let records = [("eight.csv", text.clone()), ("line.csv", line())];
        let emitted = Emitted::with_records(name, "reference.toml", edits, &records);
        let mut controller = emitted.controller();
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
    let task = model.task_space.as_ref().unwrap();
    let specimen = machine::specimen(model, task, &LegParameters::reference(), Some(1));
    let scenario = machine::scenario(model, task, &specimen, &Noise::of(&specimen), 1);
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
fn set_points_stay_within_their_instructions() {
    let emitted = Emitted::new("setpoint-budget", "reference.toml", &[]);
    let Some(image) = emitted.image(model::Mcu::Mps2An500) else { return };
    let mut controller = emitted.controller();
    let description = controller.description().clone();
    let at = |name: &str| description.input(name).unwrap();
    let (command, selector, sequence, x, rate) =
        (at("command"), at("selector"), at("sequence"), at("setpoint[0]"), at("setpoint_rate[0]"));
    for (kind, (name, budget)) in [0, 1, 2, 3].into_iter().zip(BUDGETS) {
        // The bias for a tenth of the ticks, then one thing only. The stage runs after the tick's own generator, with the same
        // command: of a stream it sees the ticks between fresh set-points.
        let mut words = Vec::new();
        for tick in 0..12_000_u64 {
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
        let inputs = host_sim::stimulus::InputRecording { width: description.input_names.len(), words };
        let (host, config) = specgen_tests::host_trace(&mut controller, &[], &inputs);
        let m = specgen::verify::measure(&image, &config, &host).unwrap();
        assert_eq!(m.first_difference, None, "{name}");
        let stage = m.stage("setpoint").unwrap();
        println!("{name}: {:.0} mean, {} to {} of {} calls", stage.mean, stage.min, stage.max, stage.calls);
        assert!(stage.mean <= budget, "{name}: {} instructions", stage.mean);
    }
}
