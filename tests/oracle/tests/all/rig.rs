use host_sim::closed_loop::{Preparation, RunError};
use host_sim::controller::{StandIn, TickController};
use host_sim::coverage::Coverage;
use host_sim::plant::LegParameters;
use host_sim::platform::Specimen;
use host_sim::platform::rig::{
    BUSY, Command, GaugeFault, Noise, OnBoard, PlatformRig, PlatformRun, Record, RunOptions,
};
use host_sim::platform::{PlatformParameters, WorkPart};
use host_sim::trajectory::{PoseTarget, PoseTrajectory};

const INTERVAL: f64 = 1e-4;

/// z rises at 10 µm/s.
struct Rise;

impl PoseTrajectory for Rise {
    fn duration(&self) -> f64 {
        0.02
    }
    fn target(&self, time: f64) -> PoseTarget {
        PoseTarget {
            pose: [0.0, 0.0, 10e-6 * time, 0.0, 0.0, 0.0],
            rate: [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0],
            acceleration: [0.0; 6],
        }
    }
}

/// Index of an input word of a platform.
fn input(name: &str) -> usize {
    oracle::platform::description().input(name).unwrap()
}

/// Busy for some ticks, then a voltage of `gain` V per metre of the z set-point on every leg.
fn follower(busy: u64, gain: f64) -> StandIn<impl FnMut(&mut u64, &[u64], &mut [u64])> {
    let tick = move |ticks: &mut u64, row: &[u64], output: &mut [u64]| {
        *ticks += 1;
        let z = f64::from_bits(row[input("setpoint[2]")]);
        output.fill(0);
        output[..6].fill((z * gain).to_bits());
        output[54] = if *ticks <= busy { u64::from(BUSY) } else { 0 };
    };
    StandIn { description: oracle::platform::description(), state: 99, tick }
}

fn rig(noise: &Noise, seed: u64) -> PlatformRig {
    let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
    let mut rig = PlatformRig::new(&specimen, noise, seed);
    rig.prepare(&Preparation { peak: 100.0, rate: 1000.0, settle: 0.1, update: 5e-5, rest: 0.0 });
    rig
}

fn noise() -> Noise {
    Noise::of(&Specimen::reference())
}

fn options() -> RunOptions {
    RunOptions { settle: 0.01, record: Record::Trace, ..RunOptions::new(INTERVAL, [0.0; 6]) }
}

#[test]
fn set_points_are_those_of_the_end_of_the_interval_and_come_after_the_bias() {
    let run = rig(&Noise::NONE, 1).run(&mut follower(30, 0.0), &Rise, &options()).unwrap();
    assert!((run.arming - 31.0 * INTERVAL).abs() < 1e-12);
    assert_eq!(run.samples.len(), 200);
    assert_eq!(run.errors.count(), 200);
    let trace = run.trace.unwrap();
    // 31 ticks to arm, 100 of rest, 200 of the trajectory.
    assert_eq!(trace.len(), 331);
    let [command, sequence, z, rate] = ["command", "sequence", "setpoint[2]", "setpoint_rate[2]"].map(input);
    for (tick, row) in trace.rows().enumerate() {
        let streamed = tick.saturating_sub(130);
        assert_eq!(row[command], u64::from(streamed > 0));
        assert_eq!(row[sequence], streamed as u64);
        let time = streamed as f64 * INTERVAL;
        assert_eq!(f64::from_bits(row[z]), if streamed > 0 { 10e-6 * time } else { 0.0 });
        assert_eq!(f64::from_bits(row[rate]), if streamed > 0 { 10e-6 } else { 0.0 });
    }
    // The error is evaluated at the end of the tick of the target.
    assert!((run.samples[9].time - 10.0 * INTERVAL).abs() < 1e-15);
    assert!((run.samples[9].target[2] - 10e-9).abs() < 1e-20);
}

#[test]
fn a_controller_that_never_arms_or_lacks_a_word_or_asks_for_no_number_is_an_error() {
    let short = RunOptions { arming: 0.01, ..options() };
    let error = rig(&Noise::NONE, 1).run(&mut follower(1000, 0.0), &Rise, &short).unwrap_err();
    assert!(matches!(error, RunError::NotReady { status: BUSY, .. }), "{error}");
    assert!(error.to_string().contains("bias pose after 0.01 s (status 0x40000)"), "{error}");
    let mut lacking = follower(0, 0.0);
    lacking.description.input_names[23] = "gage".to_owned();
    let error = rig(&Noise::NONE, 1).run(&mut lacking, &Rise, &options()).unwrap_err().to_string();
    assert!(error.contains("no word `gauge["), "{error}");
    let error = rig(&Noise::NONE, 1).run(&mut follower(0, f64::NAN), &Rise, &options()).unwrap_err();
    assert!(matches!(error, RunError::NotFinite { tick: 0, leg: 0 }), "{error}");
}

#[test]
fn gauge_words_are_whole_codes_and_seeds_repeat() {
    let run = |seed| rig(&noise(), seed).run(&mut follower(0, 1e6), &Rise, &options()).unwrap();
    let first = run(5);
    assert_eq!(first, run(5));
    assert_ne!(first.trace, run(6).trace);
    let gauge = input("gauge[0]");
    let mut different = 0;
    for row in first.trace.unwrap().rows() {
        let codes = f64::from_bits(row[gauge]) / 0.76e-9;
        assert!((codes - codes.round()).abs() < 1e-6, "{codes}");
        different += u32::from(codes.round() != 0.0);
    }
    assert!(different > 100);
}

#[test]
fn latency_delays_what_the_platform_feels() {
    let poses = |latency| {
        let options = RunOptions { latency, ..options() };
        let run = rig(&Noise::NONE, 1).run(&mut follower(0, 3e7), &Rise, &options).unwrap();
        run.samples.iter().map(|sample| sample.tick.pose[2]).collect::<Vec<_>>()
    };
    let (prompt, late) = (poses(0), poses(3));
    // Creep continues meanwhile, far smaller than the motion.
    for n in 3..200 {
        assert!((late[n] - prompt[n - 3]).abs() < 1e-9, "{n}: {} {}", late[n], prompt[n - 3]);
    }
    assert!(prompt[150] - prompt[100] > 50e-9, "{}", prompt[150] - prompt[100]);
}

#[test]
fn faulty_gauges_read_as_declared_and_recover() {
    let options = RunOptions {
        faults: vec![(2, 0.002, 0.004, GaugeFault::Reading(f64::NAN)), (4, 0.002, 0.004, GaugeFault::Stuck)],
        ..options()
    };
    let run = rig(&noise(), 1).run(&mut follower(0, 1e6), &Rise, &options).unwrap();
    let whole = rig(&noise(), 1).run(&mut follower(0, 1e6), &Rise, &self::options()).unwrap();
    let (nan, stuck) = (input("gauge[2]"), input("gauge[4]"));
    let (run, whole) = (run.trace.unwrap(), whole.trace.unwrap());
    let start = run.len() - 200;
    for (tick, (row, good)) in run.rows().zip(whole.rows()).enumerate() {
        let faulty = (start + 20..start + 40).contains(&tick);
        assert_eq!(f64::from_bits(row[nan]).is_nan(), faulty, "{tick}");
        if faulty {
            assert_eq!(row[stuck], run.rows().nth(start + 19).unwrap()[stuck]);
        } else {
            // The fault does not shift the noise of the run.
            assert_eq!(row[..], good[..], "{tick}");
        }
    }
}

#[test]
fn the_wrench_word_is_what_the_part_does_to_the_platform() {
    let mut rig = rig(&Noise::NONE, 1);
    rig.plant_mut().touch(WorkPart::glass());
    for _ in 0..3000 {
        rig.hold(&[20.0; 6], INTERVAL);
    }
    let z = rig.plant().pose()[2];
    let wrench = rig.read_wrench();
    assert!(z > 5e-6 && (wrench[2] + 3e6 * z).abs() < 1e-6, "{z} {wrench:?}");
}

#[test]
fn a_gauge_ends_at_its_range() {
    let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
    let narrow = PlatformParameters { gauge_range_m: [-1e-6, 2e-6], ..specimen.nominal.clone() };
    let mut rig = PlatformRig::new(&Specimen { nominal: narrow, ..specimen }, &Noise::NONE, 1);
    for _ in 0..3000 {
        rig.hold(&[20.0; 6], INTERVAL);
    }
    assert_eq!(rig.read_gauges()[0], 2e-6);
}

/// Status of a refused set-point.
const REFUSED: u32 = 1 << 16;
/// Error of a micrometre while moving to the start, and the ticks of that.
const OFF: f64 = 1e-6;
const APPROACH: u64 = 30;

/// Moves for [`APPROACH`] ticks under the command to move, then plays for `busy` ticks plus a last one; `bad` is the tick of the play
/// in which it refuses its set-point, if any. Its target has an error only during the move.
fn player(busy: u64, bad: Option<u64>) -> StandIn<impl FnMut(&mut u64, &[u64], &mut [u64])> {
    let target = oracle::platform::description().output("target[0]").unwrap();
    let mut moved = 0;
    let tick = move |played: &mut u64, row: &[u64], output: &mut [u64]| {
        output.fill(0);
        let command = row[input("command")];
        let mut status = 0;
        if command == Command::Move.word() {
            moved += 1;
            output[target] = OFF.to_bits();
            status = if moved < APPROACH { BUSY } else { 0 };
        } else if command == Command::Trajectory.word() {
            *played += 1;
            status = if *played <= busy { BUSY } else { 0 };
            if Some(*played) == bad {
                status = REFUSED;
            }
        }
        output[54] = u64::from(status);
    };
    StandIn { description: oracle::platform::description(), state: 0, tick }
}

fn played(
    controller: &mut dyn TickController,
    path: &OnBoard,
    interval: f64,
    limit: Option<f64>,
) -> Result<PlatformRun, RunError> {
    let options = RunOptions { settle: 0.0, record: Record::Samples, ..RunOptions::new(interval, [0.0; 6]) };
    let mut rig = rig(&Noise::NONE, 1);
    rig.plant_mut().step_whole_ticks(interval);
    rig.play(controller, path, &options, limit)
}

/// A path of 200 ticks that does not start at the bias.
const PATH: OnBoard =
    OnBoard { selector: 1, approach: Some([OFF, 0.0, 0.0, 0.0, 0.0, 0.0]), ticks: 200, repeats: false };

#[test]
fn a_path_is_scored_from_its_first_set_point_to_its_last_and_no_further() {
    let once = OnBoard { approach: None, ..PATH };
    let repeated = OnBoard { repeats: true, ..PATH };
    // A repetition longer than the usual time is followed once.
    let long = OnBoard { ticks: 7000, ..repeated };
    let for_ever = u64::MAX - 1;
    for (path, busy, interval, limit, ticks) in [
        (PATH, 199, INTERVAL, None, 200),
        (once, 199, INTERVAL, None, 200),
        (PATH, 199, INTERVAL, Some(1.0), 200),
        (PATH, 199, INTERVAL, Some(0.0123), 123),
        (repeated, for_ever, 1e-2, None, 6000),
        (repeated, for_ever, 1e-2, Some(2.5), 250),
        (long, for_ever, 1e-2, None, 7000),
    ] {
        let run = played(&mut player(busy, None), &path, interval, limit).unwrap();
        assert_eq!(run.samples.len(), ticks, "{path:?} {limit:?}");
        let errors = run.scored().unwrap();
        assert_eq!(errors.coverage(), Coverage::new(ticks, path.ticks, interval), "{path:?} {limit:?}");
        // The move to the start is not part of the path.
        assert!(errors.peak_nano()[0] < 1.0, "{path:?}: {} nm", errors.peak_nano()[0]);
        assert!((run.samples[ticks - 1].time - ticks as f64 * interval).abs() < 1e-9);
    }
}

#[test]
fn a_run_that_ends_early_is_an_error_and_no_figure() {
    let repeated = OnBoard { repeats: true, ..PATH };
    for (path, busy, seconds) in [(PATH, 0, 1e-4), (PATH, 50, 5.1e-3), (PATH, 198, 19.9e-3), (repeated, 199, 20e-3)] {
        let error = played(&mut player(busy, None), &path, INTERVAL, Some(1.0)).unwrap_err();
        let RunError::EndedEarly { coverage, status } = error else { panic!("{error}") };
        assert!((coverage.seconds - seconds).abs() < 1e-12 && status == 0, "{coverage}");
        assert_eq!(coverage.path_seconds, 200.0 * INTERVAL);
        let text = RunError::EndedEarly { coverage, status }.to_string();
        assert!(text.contains(&format!("after {seconds:.3} s of a path of 0.020 s (status 0x0)")), "{text}");
    }
    // If it continues after its last set-point, it plays another path.
    for busy in [200, 250] {
        let error = played(&mut player(busy, None), &PATH, INTERVAL, None).unwrap_err();
        let RunError::NotEnded { coverage, status: BUSY } = error else { panic!("{error}") };
        assert_eq!(coverage, Coverage::new(200, 200, INTERVAL));
        assert!(error.to_string().contains("busy after 0.020 s, the whole path (status 0x40000: "), "{error}");
    }
    // A refused set-point ends the run; its errors are not those of the path.
    let run = played(&mut player(199, Some(80)), &PATH, INTERVAL, None).unwrap();
    assert!(!run.is_followed() && run.samples.len() == 80);
    let error = run.scored().unwrap_err();
    let RunError::EndedEarly { coverage, status } = error else { panic!("{error}") };
    assert_eq!((coverage, status), (Coverage::new(79, 200, INTERVAL), REFUSED));
    // Also for a stream, although it continues.
    let StandIn { description, state, mut tick } = follower(0, 0.0);
    let mut refuses = StandIn {
        description,
        state,
        tick: move |ticks: &mut u64, row: &[u64], output: &mut [u64]| {
            tick(ticks, row, output);
            if row[input("sequence")] == 42 {
                output[54] = u64::from(REFUSED);
            }
        },
    };
    let run = rig(&Noise::NONE, 1).run(&mut refuses, &Rise, &options()).unwrap();
    assert_eq!((run.samples.len(), run.errors.coverage()), (200, Coverage::new(41, 200, INTERVAL)));
    assert!(matches!(run.scored(), Err(RunError::EndedEarly { status: REFUSED, .. })));
}
