//! Set-points as they are compiled: trajectories against the host's own formulas, tables against their rows, and what is refused or
//! warned of.

use std::marker::PhantomData;

use host_sim::trajectory::{PaperPath, PaperPose, PoseTrajectory, Reading, Step};
use specgen::diagnostic::Diagnostic;
use specgen::ir::scalar::{Numbers as _, Rounding, kept};
use specgen::ir::{self, Scalar, constants};
use specgen::lower::setpoint;
use specgen::model::{self, Model, Trajectory, TrajectoryKind};
use specgen::spec::{self, SpecSource};
use specgen::waveform::{self, Waveform};
use specgen_runtime::Real;
use specgen_runtime::setpoint as runtime;
use specgen_runtime::setpoint::{BUSY, Command, CommandKind, Generator, Parallel, Setpoints, Target};
use specgen_tests::{repository, worse};

pub const F32: (&str, &str) = ("scalar = \"f64\"", "scalar = \"f32\"");
pub const PATHS: [(model::PaperPath, PaperPath); 3] = [
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
    let numbers = &Rounding(PhantomData::<T>);
    let trajectory = |trajectory: &ir::Trajectory| match &trajectory.path {
        ir::Path::Segments { start, segments, ticks, end } => runtime::Trajectory::Segments {
            start: numbers.vector(start),
            segments: kept(segments.iter().map(|segment| constants::segment(numbers, segment))),
            ticks: *ticks as i32,
            end: numbers.vector(end),
        },
        ir::Path::Table { rows, row_ticks, per_tick, per_second, bend_rate, repeat } => {
            runtime::Trajectory::Table(runtime::Table {
                rows: kept(rows.iter().map(|row| constants::row(numbers, row))),
                row_ticks: *row_ticks as i32,
                per_tick: numbers.real(*per_tick),
                per_second: numbers.real(*per_second),
                bend_rate: numbers.real(*bend_rate),
                repeat: *repeat,
            })
        }
    };
    let trajectories = kept(setpoints.trajectories.iter().map(trajectory));
    let [tx, ty, tz] = model.workspace.translation;
    let [rx, ry, rz] = model.workspace.rotation;
    constants::setpoints(numbers, &[tx, ty, tz, rx, ry, rz], setpoints, Parallel, trajectories)
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
pub fn assert_whole(ticks: usize, host: &dyn PoseTrajectory, period: f64) {
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
    for frequency in [10.0, 1.0, 0.1].into_iter().take(specgen_tests::length(1, 3)) {
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
    let [before, after] = [5.0 - 1e-6, 5.0].map(|time| host.target(time).pose[2] * 1e6);
    assert!((after - before - 2.286).abs() < 1e-3);
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
    assert!(code == "E0454" && message.contains("z is 50.000 um after 2.500000 s"), "{code} {message}");
    let (code, message) = refused(|model| model.task_space.as_mut().unwrap().setpoint.stream_speed[1] = 50e-6);
    assert!(code == "E0455" && message.contains("y moves at"), "{code} {message}");
    let (code, _) = refused(|model| model.timing.period = 0.6);
    assert_eq!(code, "E0456");
    let (code, message) = refused(|model| model.task_space.as_mut().unwrap().setpoint.bias[0] = 60e-6);
    assert!(code.starts_with("E0450") && message.contains("the bias pose has x = 60.000 um"), "{code} {message}");
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
pub fn eight() -> String {
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
    let waveform = waveform::parse(text, &file, period, None).unwrap();
    let model = with_trajectories(vec![TrajectoryKind::Waveform { file, period, repeat, columns: None }]);
    let setpoints = lowered(&model, &[Some(waveform)], Scalar::F64);
    (model, setpoints)
}

#[test]
fn a_table_goes_through_its_rows_with_continuous_acceleration_from_rest_to_rest() {
    let text = eight();
    let rows = waveform::parse(&text, "eight.csv", 1e-3, None).unwrap().rows;
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

/// A table of x (µm) in rows 1 ms apart that repeats: the warnings, or what refuses it.
fn repeated(rows: impl Iterator<Item = f64>) -> Vec<Diagnostic> {
    let text = rows.fold("x_um\n".to_owned(), |text, um| text + &format!("{um:e}\n"));
    let waveform = waveform::parse(&text, "wave.csv", 1e-3, None).unwrap();
    let kind = TrajectoryKind::Waveform { file: "wave.csv".to_owned(), period: 1e-3, repeat: true, columns: None };
    let model = with_trajectories(vec![kind]);
    let task = model.task_space.as_ref().unwrap();
    match setpoint::lower(&model, task, &[Some(waveform)], Scalar::F64) {
        Ok((_, warnings)) => warnings,
        Err(found) => found,
    }
}

/// 3 µm, so many cycles in a second.
fn sine(cycles: f64) -> impl Iterator<Item = f64> {
    (0..1000).map(move |k| 3.0 * (std::f64::consts::TAU * cycles * f64::from(k) / 1000.0).sin())
}

#[test]
fn the_wrap_of_a_table_is_judged_as_any_corner() {
    for (cycles, expected) in [
        (1.3, "where it starts again: x steps by -2.8"),
        (1.5, "its speed changes by 56.5"),
        (2.5, "its speed changes by 94.2"),
    ] {
        let found = repeated(sine(cycles));
        assert_eq!(codes(&found), ["W0458"], "{cycles}: {found:#?}");
        assert!(found[0].message.contains(expected), "{cycles}: {}", found[0].message);
        assert!(found[0].message.contains("where it starts again") && found[0].help.contains("whole cycles"));
    }
    // Half a cycle turns by 18.8 um/s, at which the lowest mode rings by less than a gauge sees.
    for cycles in [0.5, 1.0, 2.0, 7.0] {
        assert_eq!(codes(&repeated(sine(cycles))), [""; 0], "{cycles}");
    }
    // An ordinary corner, within the table.
    let triangle = (50..450).map(|k: i32| 0.05 * f64::from(100 - (k % 200 - 100).abs()));
    let found = repeated(triangle);
    assert!(
        codes(&found) == ["W0458"] && found[0].message.contains("here, where the speed of x changes by"),
        "{found:#?}"
    );
}

#[test]
fn a_closing_row_is_the_first_again_within_what_a_table_resolves() {
    for closing in [0.0, -1.2e-15, 3.0 * std::f64::consts::TAU.sin(), 1e-9] {
        let found = repeated(sine(1.0).chain([closing]));
        assert_eq!(codes(&found), ["E0457"], "{closing:e}: {found:#?}");
    }
    // A row of its own, as far from the first as its neighbour is; and one that only comes near it.
    assert_eq!(codes(&repeated(sine(1.0))), [""; 0]);
    assert_eq!(codes(&repeated(sine(3.0).chain([1e-3]))), ["W0458"]);
    // About a turning point rows lie close together.
    let cosine = (0..1000).map(|k| 3.0 * (std::f64::consts::TAU * f64::from(k) / 1000.0).cos());
    assert_eq!(codes(&repeated(cosine)), [""; 0]);
}
