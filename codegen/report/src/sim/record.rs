//! `specgen sim --record`: records every tick of a supervised run. The set-points come from the wave generator
//! of the targets.

use std::cell::RefCell;
use std::io::BufWriter;
use std::path::Path;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, Supervised, TickController};
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::rig::{Bench, Request};
use host_sim::record::{RecordedController, RecordingEnd, Writer};
use host_sim::scenario::select;
use host_sim::trajectory::{LegTrajectory, PoseTarget, PoseTrajectory};
use serde::Serialize;
use specgen_runtime::Motion;
use specgen_runtime::record::Layout;
use specgen_runtime::recorder::{Recorder, Settings as Recording};
use specgen_runtime::wave::{AxisWave, Limits, Settings, Shape, Tone, Wave, step_of};

use super::Options;
use specgen_compiler::compile::Compilation;
use specgen_language::model::TaskSpace;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::{PendingFile, unwritten};
use specgen_language::ui::Ui;
use specgen_studies::machine;

/// Number of blocks of the recorder, and words per block: a tenth of a second at 10 kHz.
const BLOCKS: usize = 2;
const BLOCK: usize = 1 << 15;
/// Frequencies of the axes over the lowest; none is a multiple of another.
const FREQUENCIES: [f64; 6] = [1.0, 1.3, 1.7, 2.1, 2.3, 2.9];
/// Amplitude of an axis over that of the third, each relative to its free range. The legs share their stroke.
const OTHERS: f64 = 0.15;
/// Longest time to reach the bias pose, s.
const ARMING: f64 = 60.0;

/// A written recording.
#[derive(Serialize)]
struct RecordFile {
    ticks: u64,
    bytes: u64,
    file: String,
    /// s.
    #[serde(skip)]
    seconds: f64,
}

impl Outcome for RecordFile {
    fn text(&self) -> String {
        let (bytes, ticks) = (self.bytes as f64, self.ticks as f64);
        let (seconds, file, megabytes, each) = (self.seconds, &self.file, bytes / 1e6, bytes / ticks);
        format!("wrote {ticks} ticks, {seconds:.3} s, to {file}: {megabytes:.1} MB, {each:.0} bytes per tick\n")
    }
}

pub(super) fn run(
    options: &Options,
    path: &Path,
    compiled: &Compilation,
    controller: Controller,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let period = compiled.model.timing.period;
    let seconds = options.seconds;
    let ticks = (seconds / period).round();
    if !(1.0..1e9).contains(&ticks) {
        return Err(Failure::Usage(format!(
            "--seconds {seconds} gives {ticks} ticks of {period} s; expected 1 to 10^9 ticks"
        )));
    }
    let lowest = match options.frequency.as_deref() {
        None => 1.0,
        Some([one]) => *one,
        Some(_) => return Err(Failure::Usage("--record takes one --frequency, that of the slowest axis".to_owned())),
    };
    let text = controller.text().to_owned();
    let machine = Supervised::new(controller);
    let layout = Layout {
        config: machine.controller().description().config_names.len(),
        input: machine.input_names().len(),
        state: machine.state_words(),
    };
    // A machine with a large state needs longer blocks.
    let block = if BLOCK < 2 * layout.preamble() { 2 * layout.preamble() } else { BLOCK };
    let mut memory = vec![0; BLOCKS * block];
    let mut recorder = Recorder::new(&mut memory, BLOCKS, layout)
        .map_err(|unfit| Failure::Environment(format!("the recorder does not fit this controller: {unfit:?}")))?;
    recorder.start(Recording::STREAM);
    let file = BufWriter::with_capacity(1 << 20, PendingFile::create(path)?);
    let mut writer = Writer::new(file, &text).map_err(|error| unwritten(path, &error))?;
    let mut recorded = RecordedController::new(machine, &mut recorder, &mut writer).map_err(environment)?;
    recorded.reset();
    ui.progress(&format!("recording {seconds} s of a wave on all axes under the supervisor"));
    let shares = [options.amplitude, OTHERS * options.amplitude];
    let (wave, _) = wave(compiled, ticks as i32, FREQUENCIES.map(|own| own * lowest), shares)?;
    let ran = match &compiled.model.task_space {
        Some(task) => platform(options, compiled, task, &mut recorded, wave, ticks as u64),
        None => legs(options, compiled, &mut recorded, wave, seconds),
    };
    let ended = match (recorded.ended().is_some(), ran) {
        // If the recorder ended the run itself, it reports why.
        (true, _) | (false, Ok(())) => recorded.finish(),
        (false, Err(error)) => return Err(environment(error)),
    };
    ended.map_err(|ended| match ended {
        RecordingEnd::Io(error) => unwritten(path, &error),
        RecordingEnd::Controller(error) => environment(error),
        RecordingEnd::Supervisor { tick, word } => {
            Failure::Gate(format!("tick {tick}: the machine is {word} instead of running; nothing was written"))
        }
    })?;
    let file = writer.finish().map_err(|error| unwritten(path, &error))?;
    let file = file.into_inner().map_err(|error| unwritten(path, &error))?;
    file.keep()?;
    let bytes = std::fs::metadata(path).map(|found| found.len()).unwrap_or_default();
    let ticks = recorder.tick();
    ui.result(&RecordFile { ticks, bytes, file: path.display().to_string(), seconds: ticks as f64 * period });
    Ok(())
}

/// A wave of all axes, each at its own frequency (Hz), within the limits of the spec; reduced where it would be too fast. `shares`:
/// amplitudes relative to the free range, for the third axis and for the others. Also returns the amplitude of the third axis, m.
pub(super) fn wave(
    compiled: &Compilation,
    ticks: i32,
    frequencies: [f64; 6],
    shares: [f64; 2],
) -> Result<(Wave<f64>, f64), Failure> {
    let (ir, period) = (&compiled.ir, compiled.model.timing.period);
    let mut settings = Settings::still();
    let limits = match &ir.task_space {
        Some(task) => {
            let setpoints = &task.setpoints;
            settings.center = setpoints.home;
            let range = |sign: f64| std::array::from_fn(|axis| sign * ir.bounds.pose[axis] - setpoints.bias[axis]);
            Limits {
                low: range(-1.0),
                high: range(1.0),
                rate: setpoints.stream_rate,
                acceleration: setpoints.stream_acceleration,
                ticks_per_second: setpoints.rate,
            }
        }
        None => {
            // Limited by gauge and stack; the bounds of set-points are wider than both.
            let high = compiled.model.actuator.stroke.min(ir.bounds.sensor[1]).min(ir.bounds.leg[1]);
            let low = ir.bounds.sensor[0].max(ir.bounds.leg[0]);
            // The amplifier limits the speed of a leg; the spec does not limit its acceleration.
            let rate = compiled.model.actuator.slew_rate * compiled.model.actuator.leg_gain();
            Limits {
                low: [low; 6],
                high: [high; 6],
                rate: [rate; 6],
                acceleration: [1e6; 6],
                ticks_per_second: 1.0 / period,
            }
        }
    };
    settings.ticks = ticks;
    settings.ramp_ticks = if ticks < 20 { 1 } else { ticks / 10 };
    let on_legs = ir.task_space.is_none();
    let (mut share, mut third) = (1.0, 0.0);
    for _ in 0..20 {
        for axis in 0..6 {
            let room = limits.high[axis] - settings.center[axis];
            let below = settings.center[axis] - limits.low[axis];
            let room = if on_legs || room < below { room } else { below };
            let amplitude = share * shares[usize::from(axis != 2 && !on_legs)] * room;
            if axis == 2 {
                third = amplitude;
            }
            let tone = Tone { amplitude, phase: 0, step: step_of(frequencies[axis], period) };
            let offset = if on_legs { 0.4 * room } else { 0.0 };
            settings.axes[axis] = AxisWave { offset, shape: Shape::Sine { tone } };
        }
        let mut wave = Wave::new(limits);
        if wave.set(&settings).is_ok() {
            wave.start();
            return Ok((wave, third));
        }
        share /= 2.0;
    }
    Err(Failure::Gate(
        "no wave fits within the limits of workspace and stream speed around the bias pose; increase control.setpoint.stream_speed".to_owned(),
    ))
}

fn platform(
    options: &Options,
    compiled: &Compilation,
    task: &TaskSpace,
    controller: &mut dyn TickController,
    mut wave: Wave<f64>,
    ticks: u64,
) -> Result<(), RunError> {
    let mut rig = options.plant.platform_of(&compiled.model, task, &LegParameters::reference()).1.rig().clone();
    let mut bench = Bench::new(&mut rig, controller, compiled.model.timing.period, options.latency as usize)?;
    bench.arm(ARMING)?;
    for _ in 0..ticks {
        let request = match wave.advance() {
            Some(motion) => Request::stream(target_of(motion)),
            None => Request::default(),
        };
        bench.tick(&request)?;
    }
    Ok(())
}

fn legs(
    options: &Options,
    compiled: &Compilation,
    controller: &mut dyn TickController,
    wave: Wave<f64>,
    seconds: f64,
) -> Result<(), RunError> {
    let leg = machine::leg(&compiled.model, &LegParameters::reference());
    let noise = if options.plant.no_noise { NoiseParameters::NONE } else { leg.noise };
    let legs = std::array::from_fn(|_| leg.clone());
    let scenario = machine::legs(&compiled.model, &legs, &noise, options.plant.seed, 1);
    let law = controller.default_config().first().copied().unwrap_or_default();
    select(controller, u32::try_from(law).unwrap_or_default())?;
    let wave = WavePath { wave: RefCell::new(wave), seconds };
    scenario
        .rig()
        .clone()
        .follow(controller, &wave, compiled.model.timing.period, |_, _| std::ops::ControlFlow::Continue(()))
        .map(|_| ())
}

/// A wave as a trajectory, evaluated once per tick.
pub(super) struct WavePath {
    pub(super) wave: RefCell<Wave<f64>>,
    pub(super) seconds: f64,
}

impl LegTrajectory for WavePath {
    fn duration(&self) -> f64 {
        self.seconds
    }

    fn displacements(&self, _time: f64) -> [f64; 6] {
        self.wave.borrow_mut().advance().map_or([0.0; 6], |motion| motion.pose)
    }
}

impl PoseTrajectory for WavePath {
    fn duration(&self) -> f64 {
        self.seconds
    }

    fn target(&self, _time: f64) -> PoseTarget {
        self.wave.borrow_mut().advance().map_or_else(PoseTarget::default, target_of)
    }
}

/// A motion as a set-point.
fn target_of(motion: Motion<f64>) -> PoseTarget {
    PoseTarget { pose: motion.pose, rate: motion.rate, acceleration: motion.acceleration }
}
