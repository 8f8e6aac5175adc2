//! Input recordings for a controller in task space: streams that are smooth, jump, leave the workspace or stop, moves,
//! trajectories, inconsistent gauges and force sensors, and numbers that no sensor gives.

use core::f64::consts::TAU;

use super::draw::RandomSource;
use super::{InputRecording, in_stretches};
use host_sim::description::{Description, DescriptionError};

/// Words of the command.
const COMMAND: [&str; 3] = ["command", "selector", "sequence"];
/// Vectors of a row, in the order of [`Row::vectors`].
const VECTORS: [&str; 5] = ["setpoint", "setpoint_rate", "setpoint_acceleration", "gauge", "wrench"];
/// The vector of controllers with corrections.
const CORRECTION: &str = "correction";
/// Corrections: some exceed the limits, m and rad.
const CORRECTED: [f64; 2] = [3e-6, 3e-5];

/// What the platform takes.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformInputs {
    /// Bounds on the pose from rest: x, y, z (m), θx, θy, θz (rad).
    pub bounds: [f64; 6],
    /// Pose that set-points are measured from, likewise.
    pub bias: [f64; 6],
    /// Control period, s.
    pub period: f64,
    /// Lowest and highest valid word of each gauge (V or m).
    pub gauge: [f64; 2],
    /// Trajectories on board.
    pub trajectories: u32,
}

/// Kind of a stretch of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Smooth,
    Jumping,
    Dry,
    Beyond,
    Move,
    Trajectory,
    Hold,
    Special,
}

const CYCLE: [Kind; 10] = [
    Kind::Smooth,
    Kind::Hold,
    Kind::Trajectory,
    Kind::Smooth,
    Kind::Dry,
    Kind::Special,
    Kind::Move,
    Kind::Jumping,
    Kind::Smooth,
    Kind::Beyond,
];

/// One row before it becomes words.
struct Row {
    command: [u64; 3],
    vectors: [[f64; 6]; VECTORS.len()],
}

/// Makes `rows` rows for a controller from `seed`.
///
/// # Errors
/// If the controller lacks a word of a platform.
pub fn record(
    description: &Description,
    inputs: &PlatformInputs,
    rows: usize,
    seed: u64,
) -> Result<InputRecording, DescriptionError> {
    let mut command = [0; COMMAND.len()];
    for (place, name) in command.iter_mut().zip(COMMAND) {
        *place = description.input(name)?;
    }
    let mut vectors = [[0; 6]; VECTORS.len()];
    for (places, stem) in vectors.iter_mut().zip(VECTORS) {
        *places = description.inputs(stem)?;
    }
    let correction = description.inputs(CORRECTION).ok();
    let mut generator = Generator::new(inputs, seed);
    Ok(in_stretches(description, rows, &CYCLE, &mut generator, Generator::begin, |generator, kind, row| {
        let made = generator.row(kind);
        for (place, word) in command.iter().zip(made.command) {
            row[*place] = generator.draw.integer(kind == Kind::Special, word);
        }
        for (places, vector) in vectors.iter().zip(made.vectors) {
            for (place, value) in places.iter().zip(vector) {
                row[*place] = generator.draw.word(description.scalar, kind == Kind::Special, value);
            }
        }
        for (axis, place) in correction.iter().flatten().enumerate() {
            let value = CORRECTED[axis / 3] * generator.draw.symmetric();
            row[*place] = generator.draw.word(description.scalar, kind == Kind::Special, value);
        }
    }))
}

struct Generator<'a> {
    draw: RandomSource,
    inputs: &'a PlatformInputs,
    sequence: u64,
    /// Smooth motion: amplitude, angular frequency (rad/s), phase of each axis.
    amplitude: [f64; 6],
    frequency: [f64; 6],
    phase: [f64; 6],
    /// Destination of a move, trajectory, force of the stretch.
    goal: [f64; 6],
    selector: u64,
    wrench: [f64; 6],
    /// Gauges wander between the ends of their range.
    gauge: [f64; 6],
}

impl<'a> Generator<'a> {
    fn new(inputs: &'a PlatformInputs, seed: u64) -> Self {
        Self {
            draw: RandomSource::new(seed),
            inputs,
            sequence: 0,
            amplitude: [0.0; 6],
            frequency: [0.0; 6],
            phase: [0.0; 6],
            goal: [0.0; 6],
            selector: 0,
            wrench: [0.0; 6],
            gauge: [0.5 * (inputs.gauge[0] + inputs.gauge[1]); 6],
        }
    }

    /// Room on either side of the bias.
    fn room(&self, axis: usize) -> f64 {
        self.inputs.bounds[axis] - self.inputs.bias[axis].abs()
    }

    fn begin(&mut self, kind: Kind) -> u64 {
        // A move or a trajectory needs many rows.
        let times = if matches!(kind, Kind::Move | Kind::Trajectory | Kind::Smooth) { 8 } else { 1 };
        let length = times * self.draw.stretch();
        for axis in 0..6 {
            // 1 to 30 Hz, and a phase that begins at the bias so that the stream can be joined.
            self.frequency[axis] = TAU * libm::exp(3.4 * self.draw.unit());
            self.amplitude[axis] = 0.3 * self.room(axis) * self.draw.unit();
            self.phase[axis] = 0.0;
            self.goal[axis] = 0.5 * self.room(axis) * self.draw.symmetric();
            self.wrench[axis] = 3.0 * self.draw.symmetric();
        }
        self.selector = self.draw.below(u64::from(self.inputs.trajectories) + 1);
        length
    }

    fn row(&mut self, kind: Kind) -> Row {
        self.wander();
        if kind != Kind::Dry {
            self.sequence += 1;
        }
        let smooth = self.smooth();
        let (command, [pose, rate, acceleration]) = match kind {
            Kind::Smooth | Kind::Dry => (1, smooth),
            Kind::Jumping => {
                (1, [0, 1, 2].map(|_| std::array::from_fn(|axis| self.room(axis) * self.draw.symmetric())))
            }
            Kind::Beyond => {
                (1, [0, 1, 2].map(|_| std::array::from_fn(|axis| 6.0 * self.room(axis) * self.draw.symmetric())))
            }
            Kind::Move => (2, [self.goal, [0.0; 6], [0.0; 6]]),
            Kind::Trajectory => (3, smooth),
            Kind::Hold => (0, smooth),
            Kind::Special => (self.draw.below(5), smooth),
        };
        Row {
            command: [command, self.selector, self.sequence],
            vectors: [pose, rate, acceleration, self.gauge, self.wrench],
        }
    }

    /// Pose, rate and acceleration of the smooth stream, one period on.
    fn smooth(&mut self) -> [[f64; 6]; 3] {
        let axes: [[f64; 3]; 6] = std::array::from_fn(|axis| {
            let (amplitude, frequency) = (self.amplitude[axis], self.frequency[axis]);
            self.phase[axis] += frequency * self.inputs.period;
            // 1 − cos begins without a jump in pose and rate.
            let (sine, cosine) = (libm::sin(self.phase[axis]), libm::cos(self.phase[axis]));
            [amplitude * (1.0 - cosine), amplitude * frequency * sine, amplitude * frequency * frequency * cosine]
        });
        std::array::from_fn(|order| axes.map(|of_axis| of_axis[order]))
    }

    /// Readings that change by a thousandth of the range and are occasionally out of range.
    fn wander(&mut self) {
        let [low, high] = self.inputs.gauge;
        let span = high - low;
        for axis in 0..6 {
            let next = self.gauge[axis] + 2e-3 * span * self.draw.symmetric();
            let inside = (low - 1e-3 * span..=high + 1e-3 * span).contains(&next);
            self.gauge[axis] = if inside { next } else { 0.5 * (low + high) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_sim::description::indexed;
    use host_sim::word::Scalar;

    fn description() -> Description {
        Description {
            name: "platform".to_owned(),
            digest: "0".to_owned(),
            version: "0".to_owned(),
            scalar: Scalar::F64,
            config_names: vec!["mode".to_owned()],
            input_names: [COMMAND.map(str::to_owned).to_vec(), indexed(&VECTORS)].concat(),
            output_names: vec!["status".to_owned()],
        }
    }

    fn inputs() -> PlatformInputs {
        PlatformInputs {
            bounds: [40e-6, 40e-6, 40e-6, 4e-4, 4e-4, 4e-4],
            bias: [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0],
            period: 1e-4,
            gauge: [-25e-6, 25e-6],
            trajectories: 3,
        }
    }

    #[test]
    fn a_seed_repeats_and_another_differs() {
        let make = |seed| record(&description(), &inputs(), 4000, seed).unwrap();
        assert_eq!(make(1), make(1));
        assert_ne!(make(1), make(2));
        assert_eq!(make(1).rows().len(), 4000);
    }

    #[test]
    fn every_command_occurs_and_so_do_impossible_numbers_and_dry_streams() {
        let recording = record(&description(), &inputs(), 60_000, 1).unwrap();
        for command in 0..4 {
            assert!(recording.rows().filter(|row| row[0] == command).count() > 500, "{command}");
        }
        assert!(recording.rows().any(|row| row[0] > 4));
        assert!(
            recording.rows().filter(|row| row[3..].iter().any(|word| f64::from_bits(*word).is_nan())).count() > 100
        );
        let rows: Vec<&[u64]> = recording.rows().collect();
        assert!(rows.windows(2).filter(|pair| pair[0][0] == 1 && pair[0][2] == pair[1][2]).count() > 200);
        let beyond = rows.iter().filter(|row| f64::from_bits(row[3]).abs() > 40e-6).count();
        assert!(beyond > 500, "{beyond}");
    }

    #[test]
    fn a_smooth_stream_is_what_its_rates_say() {
        let inputs = inputs();
        let mut generator = Generator::new(&inputs, 5);
        generator.begin(Kind::Smooth);
        let rows: Vec<Row> = (0..400).map(|_| generator.row(Kind::Smooth)).collect();
        for three in rows.windows(3) {
            let [before, now, after] = three else { continue };
            for axis in 0..6 {
                let rate = (after.vectors[0][axis] - before.vectors[0][axis]) / (2.0 * inputs.period);
                let change = (after.vectors[1][axis] - before.vectors[1][axis]) / (2.0 * inputs.period);
                let scale = generator.amplitude[axis] * generator.frequency[axis];
                assert!((rate - now.vectors[1][axis]).abs() < 1e-4 * scale);
                assert!((change - now.vectors[2][axis]).abs() < 1e-4 * scale * generator.frequency[axis]);
            }
        }
    }
}
