//! Learning on machines that are not what their spec says, with the model's response and with the one that was measured on them.

use std::ops::ControlFlow;

use host_sim::plant::LegParameters;
use host_sim::platform::rig::{Bench as Rig, Noise};
use host_sim::platform::{ModePlace, PlatformScenario, StructuralMode};
use host_sim::trajectory::{PaperPath, PaperPose};
use specgen::learning::{
    Bin, Convergence, Excitation, LearnError, Learnable, Learner, LearningResult, Motion, PassObservation,
    RepeatableMachine, Response, Update, learn,
};
use specgen::machine;
use specgen::robust::factors::UserRange;
use specgen::robust::{Deviation, Factor, Factors};
use specgen_runtime::playback::Knot;
use specgen_tests::{length, worse};

use super::bench::{Bench, PERIOD, in_parallel, scenario};
use super::learning::{CLASSES, RADIUS, SPEED, WISH, other, plays};

/// Of control.correction, m, and of a gauge, m rms.
const LIMITS: [f64; 2] = [6e-6, 2.2e-9];

/// What differs from the spec.
const OFF: [(&str, Factor, f64); 2] = [("stiffness -20 %", Factor::Stiffness, 0.8), ("mass +30 %", Factor::Mass, 1.3)];

fn motion() -> Motion {
    Motion::of(&PaperPose::corrected(PaperPath::Case1, 10.0), PERIOD, &SPEED, RADIUS).unwrap()
}

/// Does work on a machine that is `times` what the spec of a bench says.
fn on<T>(
    bench: &Bench,
    leg: &LegParameters,
    (factor, times): (Factor, f64),
    work: impl FnOnce(&mut dyn RepeatableMachine) -> T,
) -> T {
    let model = &bench.emitted.compiled.model;
    let task = model.task_space.as_ref().unwrap();
    let deviation = Deviation::common(|one| if one == factor { times } else { one.nominal() });
    let specimen = deviation.specimen(model, task, leg);
    session(bench, &machine::scenario(model, task, &specimen, &Noise::of(&specimen), 1), work)
}

/// Does work on a machine with the controller of a bench.
fn session<T>(bench: &Bench, scenario: &PlatformScenario, work: impl FnOnce(&mut dyn RepeatableMachine) -> T) -> T {
    let mut controller = bench.controller();
    let mut prepared = scenario.rig().clone();
    let mut rig = Rig::new(&mut prepared, &mut controller, PERIOD, 0).unwrap();
    rig.arm(60.0).unwrap();
    work(&mut rig)
}

fn learned(
    machine: &mut dyn RepeatableMachine,
    learnable: &Learnable,
    convergence: &Convergence,
    count: usize,
) -> LearningResult {
    let (motion, spacing) = (motion(), convergence.spacing(PERIOD));
    let update = Update::new(learnable, &motion, convergence, spacing);
    learn(machine, &motion, Learner::Host(&update), &[], spacing, count, |_, _| ControlFlow::Continue(())).unwrap()
}

fn measured(machine: &mut dyn RepeatableMachine, learnable: &Learnable, wish: f64) -> Response {
    let excitation = Excitation::new(learnable, &motion(), wish, LIMITS);
    let spectra = excitation.measure(machine, learnable, &motion(), |_| ControlFlow::Continue(())).unwrap();
    spectra.response(["digest", "machine"])
}

#[test]
#[ignore = "long: learning with a measured response on other machines"]
fn a_machine_that_is_not_its_spec_learns_with_its_own_response() {
    let legs = [
        ("plays", plays as fn() -> &'static Bench, LegParameters::reference()),
        ("Bouc-Wen", other, LegParameters::bouc_wen()),
    ];
    let cases: Vec<_> = legs.iter().flat_map(|legs| OFF.map(|off| (legs, off))).take(length(1, 4)).collect();
    let found = in_parallel(cases.len() as u32, |which| {
        let ((_, bench, leg), (_, factor, times)) = &cases[which as usize];
        let (bench, off) = (bench(), (*factor, *times));
        let compiled = &bench.emitted.compiled;
        let model = Learnable::of(compiled).unwrap();
        let usual = model.convergence(&Factors::of(&compiled.model, &[]), WISH).unwrap();
        // What somebody would declare who knows that much of the machine, and what comes of it if nobody does.
        let part = (times - 1.0).abs();
        let declared = [UserRange { factor: *factor, range: [1.0 - part, 1.0 + part] }];
        let limited = model.convergence(&Factors::of(&compiled.model, &declared), WISH).map(|found| found.band[1]);
        let blind = on(bench, leg, off, |machine| learned(machine, &model, &usual, 6));
        let (modes, convergence, own) = on(bench, leg, off, |machine| {
            let response = measured(machine, &model, WISH);
            let modes = model.mode_measurements(&response);
            let with = Learnable::of(compiled).unwrap().with(Response::read(&response.to_json()).unwrap());
            let convergence = with.convergence(&Factors::of(&compiled.model, &[]), WISH).unwrap();
            let own = learned(machine, &with, &convergence, 8);
            (modes, convergence, own)
        });
        (limited, blind, modes, convergence, own)
    });
    for (((legs, ..), (what, ..)), (limited, blind, modes, convergence, own)) in cases.iter().zip(&found) {
        let errors =
            |learned: &LearningResult| -> Vec<f64> { learned.passes.iter().map(|pass| pass.translation_nm).collect() };
        let [low, high] = convergence.band;
        let (blind_nm, grew, radius, at) = (errors(blind), blind.grew(), convergence.radius, convergence.at);
        let (own_nm, own_nrad) = (errors(own), own.passes[own.best].orientation_nrad);
        println!(
            "{legs}, {what}: model, declared: f_c {limited:.0?} Hz; model, not declared: {blind_nm:.1?} nm, grew {grew}; measured {low:.1} to {high:.0} Hz, radius \
             {radius:.2} at {at:.0} Hz: {own_nm:.1?} nm, {own_nrad:.0} nrad"
        );
        for one in modes {
            println!("    {one:?}");
        }
        assert!(limited.is_none_or(|hertz| hertz < 600.0), "{limited:?}");
        assert!(blind.grew() || blind.passes[blind.best].translation_nm > 6.0, "{blind:?}");
        assert!(high >= 600.0 && convergence.radius <= 0.9, "{convergence:?}");
        assert!(!own.grew() && own.passes[own.best].translation_nm <= 6.0, "{own:?}");
    }
}

/// A mode of the legs that nobody knows rings on under what the model's response may learn. With a measured one, it is learned, too.
#[test]
#[ignore = "long: learning with a measured response on three classes of legs with structural modes"]
fn a_leg_mode_that_nobody_knows_is_learned_with_a_measured_response() {
    const MODES: [f64; 3] = [905.0, 1000.0, 1200.0];
    for (name, bench) in CLASSES.into_iter().take(length(1, 3)) {
        let bench = bench();
        let compiled = &bench.emitted.compiled;
        let model = Learnable::of(compiled).unwrap();
        let factors = Factors::of(&compiled.model, &[]);
        let reach = model.convergence(&factors, WISH).unwrap().reach();
        let found = in_parallel(MODES.len() as u32, |which| {
            let mut specimen = bench.specimen.clone();
            let frequency_hz = MODES[which as usize];
            let mode =
                StructuralMode { place: ModePlace::Leg(None), frequency_hz, damping_ratio: 0.01, participation: None };
            specimen.nominal.imperfections.modes.push(mode);
            session(bench, &scenario(&specimen), |machine| {
                let response = measured(machine, &model, reach);
                let own = Learnable::of(compiled).unwrap().with(response);
                let convergence = own.convergence(&factors, reach).unwrap();
                (convergence.band, learned(machine, &own, &convergence, 8))
            })
        });
        for (hertz, ([low, high], learned)) in MODES.iter().zip(&found) {
            let errors: Vec<f64> = learned.passes.iter().map(|pass| pass.translation_nm).collect();
            println!(
                "{name}, leg {hertz:.0} Hz: measured {low:.1} to {high:.0} Hz, {errors:.1?} nm, best {}",
                learned.best
            );
            let within_five = errors[..errors.len().min(6)].iter().copied().fold(f64::INFINITY, f64::min);
            // Passes differ by the noise once nothing is left to learn.
            let falls = errors.windows(2).all(|pair| pair[1] <= 1.2 * pair[0]);
            let bar = if name == "rate-widening plays" { 6.1 } else { 6.0 };
            assert!(!learned.grew() && falls && within_five <= bar, "{learned:?}");
        }
    }
}

/// A linear machine of a known response, with gauges that are late by the way that a pass keeps errors, and noise.
struct Reference {
    /// Ticks late, and how much of each pose is shown.
    late: usize,
    gain: f64,
    noise: f64,
    state: u64,
}

impl RepeatableMachine for Reference {
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError> {
        let ticks = motion.corrected;
        let at = |tick: usize| specgen_runtime::playback::at::<f64>(knots, spacing, tick as u32);
        let error: Vec<[f64; 6]> = (0..ticks)
            .map(|tick| {
                let shown = tick.checked_sub(self.late).map_or([0.0; 6], at);
                std::array::from_fn(|axis| {
                    self.state =
                        self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    let uniform = (self.state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                    let scale = if axis < 3 { 1.0 } else { 1.0 / RADIUS };
                    // What the motion itself leaves is in every pass.
                    let motion = 1e-6 * (0.01 * tick as f64).sin() * scale;
                    motion - self.gain * shown[axis] + self.noise * 12_f64.sqrt() * uniform * scale
                })
            })
            .collect();
        let width = spacing as usize;
        let measured = error
            .chunks(width)
            .flat_map(|chunk| {
                let mean: [f64; 6] =
                    std::array::from_fn(|axis| chunk.iter().map(|e| e[axis]).sum::<f64>() / chunk.len() as f64);
                std::iter::repeat_n(mean, chunk.len())
            })
            .collect();
        Ok(PassObservation { measured, real: error, kept: Vec::new(), status: 0 })
    }
}

/// T comes out as it is, and as uncertain as it is.
#[test]
fn a_known_response_is_found_within_its_errors() {
    let learnable = Learnable::of(&plays().emitted.compiled).unwrap();
    let find = |noise: f64| measured(&mut Reference { late: 2, gain: 0.7, noise, state: 1 }, &learnable, WISH);
    for (noise, within) in [(0.0, 0.03), (2.2e-9, 0.15)] {
        let response = find(noise);
        let (mut squares, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
        for bin in response.bins.iter().filter(|bin| bin.hertz > 20.0 && bin.hertz < 1000.0) {
            let angle = std::f64::consts::TAU * bin.hertz * 2.0 * PERIOD;
            for i in 0..6 {
                for j in 0..6 {
                    let expected = if i == j { [0.7 * angle.cos(), -0.7 * angle.sin()] } else { [0.0; 2] };
                    let [re, im] = bin.response[i][j];
                    let off = (re - expected[0]).hypot(im - expected[1]);
                    largest = worse(largest, if i == j { off } else { 0.0 });
                    squares += (off / bin.error[i][j]).powi(2);
                    count += 1.0;
                }
            }
        }
        let ratio = (squares / count).sqrt();
        println!("noise {noise:e}: largest {largest:.4}, rms of errors over their standard error {ratio:.2}");
        assert!(largest < within, "{largest}");
        assert!(noise == 0.0 || (ratio > 0.7 && ratio < 1.4), "{ratio}");
        let with = Learnable::of(&plays().emitted.compiled).unwrap().with(response);
        let convergence = with.convergence(&Factors::of(&plays().emitted.compiled.model, &[]), WISH).unwrap();
        assert!(convergence.measured && convergence.band[1] > 700.0, "{convergence:?}");
    }
    // Noise a hundred times as large as the sweep leaves nothing to learn with.
    let with = Learnable::of(&plays().emitted.compiled).unwrap().with(find(1e-5));
    assert_eq!(with.convergence(&Factors::of(&plays().emitted.compiled.model, &[]), WISH), None);
}

/// The feedback holds the pose at rest. Learning leaves that to it for every bandwidth, also if no frequency below is tried.
#[test]
fn nothing_is_learned_where_the_feedback_leaves_nothing() {
    let compiled = &plays().emitted.compiled;
    let unity = std::array::from_fn(|i| std::array::from_fn(|j| [f64::from(u8::from(i == j)), 0.0]));
    // Measured from 30 Hz on; the model's T below.
    let bin = |k: u32| Bin { hertz: 30.0 + 5.0 * f64::from(k), response: unity, error: [[1e-3; 6]; 6] };
    let response = Response::new(["digest", "machine"], (0..400).map(bin).collect());
    let learnable = Learnable::of(compiled).unwrap().with(response);
    for wish in [WISH, 1400.0] {
        let convergence = learnable.convergence(&Factors::of(&compiled.model, &[]), wish).unwrap();
        assert!(convergence.band[0] > 2.0 && convergence.band[0] < 6.0, "{wish} Hz: {convergence:?}");
    }
}

#[test]
fn a_response_is_refused_for_anything_else() {
    let learnable = Learnable::of(&plays().emitted.compiled).unwrap();
    let response = measured(&mut Reference { late: 0, gain: 1.0, noise: 1e-9, state: 2 }, &learnable, WISH);
    let text = response.to_json();
    let back = Response::read(&text).unwrap();
    assert_eq!(back, response);
    assert_eq!(back.is_for("digest", "machine"), Ok(()));
    for (digest, machine) in [("other", "machine"), ("digest", "other")] {
        assert!(back.is_for(digest, machine).unwrap_err().to_string().contains("measure it again with --excite"));
    }
    let cut = text.lines().take(4).collect::<Vec<_>>().join("\n");
    for wrong in ["", "{}", &cut, &text.replace("response 1", "response 9")] {
        let error = Response::read(wrong).unwrap_err().to_string();
        assert!(error.contains("--excite"), "{error}");
    }
}
