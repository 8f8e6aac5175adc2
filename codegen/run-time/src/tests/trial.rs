//! The trial of a constant: runs law and machine with inputs that reach every use of a constant.

use host_sim::controller::{Controller, RestingReadings, Supervised, TickController as _};
use host_sim::description::Description;
use oracle::stimulus::platform::{self as platform_stimulus, PlatformInputs};
use oracle::stimulus::{self, Setpoints};
use specgen_compiler::compile::Compilation;
use specgen_ir::{Ir, Path, Range};
use specgen_runtime::Digest;

/// Largest number of ticks of a part.
const TICKS: usize = 10_000;
/// Ticks in each mode, if a part goes through all modes.
const MODE: usize = 1_400;
/// Ticks from one digest to the next.
const EVERY: usize = 20;
/// Phase of a running machine.
const RUNNING: u8 = 2;

/// Reproducible uniform random numbers from 0 to 1.
struct RandomSource(u64);

impl RandomSource {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

/// A part of a trial, from reset.
enum Part {
    /// Whether settings at the ends of their ranges are accepted.
    Settings(Vec<Vec<u64>>),
    /// Runs of the law, each with its settings.
    Law(Vec<(Vec<u64>, Vec<Vec<u64>>)>),
    /// The machine from power-up through its wiring check. It then plays or moves; at the end its gauges are constant.
    Machine { first: Vec<u64>, then: Vec<u64> },
    /// The machine from the snapshot of a running one, with these rows.
    Running { state: Vec<u64>, rows: Vec<Vec<u64>> },
}

/// All parts, the most sensitive ones first.
pub struct Trial(Vec<Part>);

impl Trial {
    /// The trial for a spec and its unchanged controller.
    pub fn of(compiled: &Compilation, controller: &Controller) -> Self {
        let make = Make { ir: &compiled.ir, compiled, controller, about: controller.description() };
        let mut parts = vec![make.settings(), make.hostile(), make.exact()];
        parts.extend(make.sweeps());
        if compiled.ir.task_space.is_some() {
            parts.push(make.damped());
            parts.extend(make.trajectories());
            parts.extend(make.moves());
        }
        parts.extend(make.machines());
        Self(parts)
    }

    /// Digests of each part.
    pub fn digests(&self, controller: &Controller) -> Vec<Vec<u64>> {
        let of = |part: &Part| {
            let mut seen = DigestTrail { digests: Vec::new(), expected: None };
            part.run(controller.fork(), &mut seen);
            seen.digests
        };
        self.0.iter().map(of).collect()
    }

    /// A part whose digests differ from the expected ones; `first` is tried before the others.
    pub fn differs_in(&self, controller: &Controller, expected: &[Vec<u64>], first: usize) -> Option<usize> {
        let others = (0..self.0.len()).filter(|part| *part != first);
        std::iter::once(first).chain(others).find(|part| {
            let expected = &expected[*part];
            let mut seen = DigestTrail { digests: Vec::new(), expected: Some(expected) };
            self.0[*part].run(controller.fork(), &mut seen) || seen.digests.len() != expected.len()
        })
    }
}

/// Digests so far, and the expected ones.
struct DigestTrail<'a> {
    digests: Vec<u64>,
    expected: Option<&'a [u64]>,
}

impl DigestTrail<'_> {
    /// Adds a digest; whether it differs from the expected one.
    fn differs(&mut self, digest: u64) -> bool {
        let place = self.digests.len();
        self.digests.push(digest);
        self.expected.is_some_and(|expected| expected.get(place) != Some(&digest))
    }
}

fn of(words: &[u64]) -> u64 {
    let mut digest = Digest::new();
    words.iter().for_each(|word| digest.word(*word));
    digest.finish()
}

impl Part {
    /// Runs the part; whether a digest differs from the expected one.
    fn run(&self, mut controller: Controller, seen: &mut DigestTrail<'_>) -> bool {
        controller.reset();
        match self {
            Self::Settings(tried) => {
                let taken: Vec<u64> =
                    tried.iter().map(|words| u64::from(controller.configure(words).is_ok())).collect();
                seen.differs(of(&taken))
            }
            Self::Law(stretches) => {
                let mut output = vec![0; controller.description().output_names.len()];
                stretches.iter().any(|(settings, rows)| {
                    controller.configure(settings).unwrap();
                    let mut outputs = Digest::new();
                    rows.chunks(EVERY).any(|rows| {
                        for row in rows {
                            controller.step(row, &mut output);
                            output.iter().for_each(|word| outputs.word(*word));
                        }
                        seen.differs(controller.state_digest()) || seen.differs(outputs.finish())
                    })
                })
            }
            Self::Machine { first, then } => machine(controller, first, then, seen).is_none(),
            Self::Running { state, rows } => {
                let mut machine = Supervised::new(controller);
                if machine.load(state).is_err() {
                    return seen.differs(1);
                }
                let mut output = vec![0; machine.output_names().len()];
                rows.chunks(EVERY).any(|rows| {
                    for row in rows {
                        machine.step(row, &mut output);
                    }
                    seen.differs(machine.digest()) || seen.differs(of(&machine.save()))
                })
            }
        }
    }
}

/// Runs a machine, whose gauges follow its legs, from power-up for [`TICKS`]: with `first` while it arms, with `then` while it runs.
/// Returns its snapshot and input after a thousand running ticks, or at the end; none if a digest differs from the expected one.
fn machine(
    controller: Controller,
    first: &[u64],
    then: &[u64],
    seen: &mut DigestTrail<'_>,
) -> Option<(Vec<u64>, Vec<u64>)> {
    let mut machine = Supervised::new(controller);
    let mut output = vec![0; machine.output_names().len()];
    let mut standing: RestingReadings = machine.standing(first).unwrap();
    let request = first.len() - 2;
    let about = machine.controller().description();
    let gauges = about.input("gauge[0]").or_else(|_| about.input("displacement[0]")).unwrap();
    let (mut input, mut phase, mut ran, mut saved) = (first.to_vec(), 0, 0, None);
    for tick in 0..TICKS {
        if ran == 1 {
            input[..gauges].copy_from_slice(&then[..gauges]);
        }
        input[request] = [1, 2, 2, 2, 4, 5][usize::from(phase)];
        phase = machine.step(&input, &mut output).phase;
        ran += usize::from(phase == RUNNING);
        if tick < TICKS - 1_000 {
            standing.show(&machine, &output, &mut input);
        }
        if ran == 1_000 && saved.is_none() {
            saved = Some((machine.save(), input.clone()));
        }
        if tick % EVERY == EVERY - 1 && (seen.differs(machine.digest()) || seen.differs(of(&output))) {
            return None;
        }
        if tick % 1_000 == 999 && seen.differs(of(&machine.save())) {
            return None;
        }
    }
    saved.or_else(|| Some((machine.save(), input)))
}

/// Makes the parts.
struct Make<'a> {
    ir: &'a Ir,
    compiled: &'a Compilation,
    controller: &'a Controller,
    about: &'a Description,
}

impl Make<'_> {
    fn word(&self, value: f64) -> u64 {
        self.about.scalar.encode(value)
    }

    fn input(&self, name: &str) -> usize {
        self.about.input(name).unwrap()
    }

    fn gauges(&self) -> usize {
        self.about.input("gauge[0]").or_else(|_| self.about.input("displacement[0]")).unwrap()
    }

    /// Plausible range of a gauge.
    fn believed(&self, gauge: usize) -> [f64; 2] {
        self.ir.task_space.as_ref().map_or(self.ir.bounds.sensor, |task| task.sensing.raw_limits[gauge])
    }

    /// A row without a command. Calibrated gauges read the middle of their range, others zero.
    fn at_rest(&self) -> Vec<u64> {
        let mut row = vec![0; self.about.input_names.len()];
        if self.ir.task_space.as_ref().is_some_and(|task| task.sensing.calibration.is_some()) {
            for gauge in 0..6 {
                let [low, high] = self.believed(gauge);
                row[self.gauges() + gauge] = self.word(0.5 * (low + high));
            }
        }
        row
    }

    /// The spec's settings with these first two values: mode, and source of forces or kind of set-points.
    fn config(&self, first: [u64; 2]) -> Vec<u64> {
        let mut words = self.controller.default_config();
        words[..2].copy_from_slice(&first);
        words
    }

    fn modes(&self) -> u64 {
        if self.ir.task_space.is_some() { 7 } else { 3 }
    }

    /// Every setting at both ends of its range, an ulp inside and an ulp outside.
    fn settings(&self) -> Part {
        let defaults = self.controller.default_config();
        let mut tried = Vec::new();
        for (place, (_, range)) in self.ir.permitted.words().enumerate() {
            let Range::Number(least, most) = range else { continue };
            for end in [least, most].map(|end| self.word(end)) {
                for word in [end.wrapping_sub(1), end, end.wrapping_add(1)] {
                    let mut words = defaults.clone();
                    words[place] = word;
                    tried.push(words);
                }
            }
        }
        Part::Settings(tried)
    }

    /// All kinds of inputs, in one mode after the other.
    fn hostile(&self) -> Part {
        let model = &self.compiled.model;
        let count = self.modes() as usize * MODE;
        let rows = match &model.task_space {
            Some(task) => {
                let inputs = PlatformInputs {
                    bounds: self.ir.bounds.pose,
                    bias: task.setpoint.bias,
                    period: self.ir.defaults.period,
                    gauge: self.ir.bounds.sensor,
                    trajectories: task.trajectories.len() as u32,
                };
                platform_stimulus::record(self.about, &inputs, count, 3)
            }
            None => {
                let setpoints = Setpoints::Pose { bounds: self.ir.bounds.pose, stroke: model.actuator.stroke };
                stimulus::record(self.about, &setpoints, count, 3)
            }
        };
        let rows = rows.unwrap();
        let rows: Vec<Vec<u64>> = rows.rows().map(<[u64]>::to_vec).collect();
        let second = if model.task_space.is_some() { 3 } else { 2 };
        let stretches = rows.chunks(MODE).enumerate();
        Part::Law(
            stretches.map(|(mode, rows)| (self.config([mode as u64, mode as u64 % second]), rows.to_vec())).collect(),
        )
    }

    /// Position feedback with derivative gains, which no spec here has.
    fn damped(&self) -> Part {
        let Part::Law(mut stretches) = self.hostile() else { unreachable!("of the law") };
        for (settings, _) in &mut stretches {
            for (word, (name, range)) in settings.iter_mut().zip(self.ir.permitted.words()) {
                if let (true, Range::Number(_, most)) = (name.contains("derivative"), range) {
                    *word = self.word(1e-3 * most);
                }
            }
        }
        Part::Law(stretches)
    }

    /// Moves legs up and down over their whole range, with random reversals: a platform through its gauges in mode P, six legs through
    /// their set-points.
    fn sweeps(&self) -> Vec<Part> {
        let platform = self.ir.task_space.is_some();
        let mut draw = RandomSource(5);
        let place = if platform { self.gauges() } else { self.input("setpoint[0]") };
        (0..4)
            .map(|part| {
                let (mut row, mut left) = (self.at_rest(), [0; 6]);
                let rows = (0..TICKS).map(|_| {
                    for leg in 0..6 {
                        if left[leg] == 0 {
                            left[leg] = 1 + draw.below([6, 20, 60, 120][part]);
                            let [low, high] = if platform { self.believed(leg) } else { self.ir.bounds.leg };
                            // For a platform, to the ends in one step, or slowly by the integral.
                            let share = if platform { [1.0, 0.2, 0.04, 0.01][part] } else { 1.0 };
                            let way = 0.5 * (1.0 - share) + share * draw.unit();
                            row[place + leg] = self.word(low + (high - low) * way);
                        }
                        left[leg] -= 1;
                    }
                    if part == 3 && !platform {
                        // Inconsistent gauges, so that the estimates push a leg to both ends.
                        for leg in 0..6 {
                            let [low, high] = self.believed(leg);
                            row[self.gauges() + leg] = self.word(if left[leg] > 40 { low } else { high });
                        }
                    }
                    row.clone()
                });
                let rows = rows.collect();
                // Mode P; for leg set-points the inverse model alone, in the last part with estimates.
                let mode = if part == 3 && !platform { 1 } else { 0 };
                Part::Law(vec![(self.config([mode, u64::from(!platform)]), rows)])
            })
            .collect()
    }

    /// Words that are exactly at a limit, or within two ulps of it, one per tick.
    fn exact(&self) -> Part {
        let mut at: Vec<(usize, u64)> = Vec::new();
        let mut six = |place: Option<usize>, values: &dyn Fn(usize) -> Vec<f64>| {
            let Some(place) = place else { return };
            for axis in 0..6 {
                for value in values(axis) {
                    at.extend((0..5).map(|ulps| (place + axis, self.word(value).wrapping_add(ulps).wrapping_sub(2))));
                }
            }
        };
        let both = |value: f64| vec![value, -value];
        six(Some(self.gauges()), &|gauge| self.believed(gauge).to_vec());
        let place = |name: &str| self.about.input(name).ok();
        match &self.ir.task_space {
            Some(task) => {
                let (s, bound) = (&task.setpoints, &self.ir.bounds.pose);
                six(place("setpoint[0]"), &|axis| both(s.stream_step[axis]));
                six(place("setpoint[0]"), &|axis| {
                    [both(bound[axis] - s.bias[axis]), both(bound[axis] + s.bias[axis])].concat()
                });
                six(place("setpoint_rate[0]"), &|axis| both(s.stream_rate[axis]));
                six(place("setpoint_acceleration[0]"), &|axis| both(s.stream_acceleration[axis]));
                six(place("wrench[0]"), &|axis| both(task.law.wrench_limit[axis]));
                if let Some(limits) = &task.law.correction {
                    six(place("correction[0]"), &|axis| [both(limits[axis].most), both(limits[axis].step)].concat());
                }
            }
            None => {
                six(place("setpoint[0]"), &|_| self.ir.bounds.leg.to_vec());
                six(place("setpoint[0]"), &|axis| both(self.ir.bounds.pose[axis]));
            }
        }
        let platform = self.ir.task_space.is_some();
        let rest = self.at_rest();
        let stretches = [0, 1].map(|kind| {
            let mut rows = vec![rest.clone(); 2_000];
            for (place, word) in &at {
                let mut row = rest.clone();
                row[*place] = *word;
                rows.extend([row, rest.clone()]);
            }
            if platform {
                for (tick, row) in rows.iter_mut().enumerate() {
                    // A stream, or moves; new in every tick.
                    (row[0], row[2]) = (1 + kind, tick as u64);
                }
            }
            let config = if platform { [self.modes() - 1, 2] } else { [2, kind] };
            (self.config(config), rows)
        });
        Part::Law(stretches.into())
    }

    /// Every trajectory, once to its end, and once interrupted repeatedly.
    fn trajectories(&self) -> Vec<Part> {
        let Some(task) = &self.ir.task_space else { return Vec::new() };
        let ticks = |path: &Path| match path {
            Path::Segments { ticks, .. } => *ticks as usize,
            Path::Table { rows, row_ticks, .. } => rows.len() * *row_ticks as usize,
        };
        let lengths = task.setpoints.trajectories.iter().map(|trajectory| ticks(&trajectory.path));
        lengths
            .enumerate()
            .flat_map(|(number, length)| {
                [None, Some(700)].map(|stop| {
                    let mut rest = self.at_rest();
                    (rest[0], rest[1], rest[2]) = (3, number as u64, 1);
                    // First the approach to its start.
                    let mut rows = vec![rest; length + TICKS];
                    if let Some(stop) = stop {
                        rows.truncate(TICKS);
                        for (tick, row) in rows.iter_mut().enumerate().skip(4_000) {
                            let turn = (tick - 4_000) / stop;
                            row[0] = if turn % 2 == 0 { 0 } else { 3 };
                            row[2] = turn as u64;
                        }
                    }
                    Part::Law(vec![(self.config([1, 0]), rows)])
                })
            })
            .collect()
    }

    /// Moves along each axis alone, so that its own limits apply, sometimes interrupted by a hold.
    fn moves(&self) -> Vec<Part> {
        let Some(task) = &self.ir.task_space else { return Vec::new() };
        let place = self.input("setpoint[0]");
        let of_axis = |axis: usize| {
            let room = self.ir.bounds.pose[axis] - task.setpoints.bias[axis].abs();
            let rest = self.at_rest();
            // To the bound, and an ulp beyond it.
            let ends = [1.0, -1.0].map(|sign| self.word(sign * self.ir.bounds.pose[axis] - task.setpoints.bias[axis]));
            let goals = [self.word(0.7 * room), ends[0] + 1, ends[1], self.word(0.1 * room), ends[1] + 1];
            let rows = (0..TICKS).map(|tick| {
                let mut row = rest.clone();
                // The bias first.
                let turn = tick / 1_900;
                (row[0], row[2]) = (if tick % 1_900 > 1_850 { 0 } else { 2 }, turn as u64);
                row[place + axis] = goals[turn % 5];
                row
            });
            Part::Law(vec![(self.config([1, 0]), rows.collect())])
        };
        (0..6).map(of_axis).collect()
    }

    fn machines(&self) -> Vec<Part> {
        let mut first = self.at_rest();
        first.extend([0, 0]);
        let setpoint = self.input("setpoint[0]");
        if self.ir.task_space.is_none() {
            // Approached when it is armed.
            (0..6).for_each(|axis| first[setpoint + axis] = self.word(0.05 * self.ir.bounds.pose[axis]));
        }
        let mut then = first.clone();
        if self.ir.task_space.is_some() {
            (then[0], then[2]) = (2, 1);
        }
        let bound = self.ir.bounds.pose;
        (0..6).for_each(|axis| then[setpoint + axis] = self.word(0.1 * bound[axis]));
        let mut nothing = DigestTrail { digests: Vec::new(), expected: None };
        let (state, last) = machine(self.controller.fork(), &first, &then, &mut nothing).unwrap();
        // Gauges that stay, drift, jump and ring.
        let mut draw = RandomSource(9);
        let running = (0..6).map(|kind| {
            let mut rows = Vec::with_capacity(TICKS / 2);
            for tick in 0..TICKS / 2 {
                let mut row = last.clone();
                let request = row.len() - 2;
                row[request] = 2;
                for gauge in 0..6 {
                    let [low, high] = self.believed(gauge);
                    let slot = self.gauges() + gauge;
                    let (middle, span) = (self.about.scalar.decode(last[slot]), high - low);
                    let phase = (tick as f64 * [0.01, 0.03, 0.1, 0.17, 0.3, 0.43][kind]) % 1.0;
                    let way = match kind {
                        0 => 0.0,
                        1 => 1e-5 * span * tick as f64,
                        _ => 2e-3 * span * (4.0 * (phase - 0.5).abs() - 1.0),
                    };
                    let leap = if draw.below(500) == 0 { 0.2 * span * draw.unit() } else { 0.0 };
                    row[slot] = self.word(middle + way + leap);
                }
                rows.push(row);
            }
            Part::Running { state: state.clone(), rows }
        });
        let mut parts: Vec<Part> = running.collect();
        if self.ir.task_space.is_some() {
            // A move along each axis alone, ended by a hold with the limits of a stop.
            parts.extend((0..6).map(|axis| {
                let mut row = last.clone();
                (0..6).for_each(|axis| row[setpoint + axis] = self.word(0.1 * bound[axis]));
                row[setpoint + axis] = self.word(-0.3 * bound[axis]);
                row[2] = 2;
                let rows = (0..1_500).map(|tick| {
                    let mut row = row.clone();
                    let request = row.len() - 2;
                    row[request] = if tick < 700 { 2 } else { 3 };
                    row
                });
                Part::Running { state: state.clone(), rows: rows.collect() }
            }));
        }
        parts.insert(0, Part::Machine { first, then });
        parts
    }
}
