//! Invalid samples of a record: they get no weight in fits, and a finding states their times. A glitch is replaced by the
//! mean of its neighbours, because a fit with a dead time interpolates between samples.

use super::columns::LineNumbers;
use super::findings::Findings;
use super::mode::{self, Mode};
use super::statistics::{extent, median, noise_floor};
use specgen_language::diagnostic::codes;

/// A sample that differs from the median of its neighbourhood by this fraction of the displacement range is a glitch,
/// if the difference is also far above noise and above the motion of the drive in a sample.
const GLITCH: f64 = 0.02;
/// Multiple of the noise floor that a glitch exceeds.
const ABOVE_NOISE: f64 = 12.0;
/// Multiple of its neighbours' spread that it exceeds.
const ALONE: f64 = 3.0;
/// Half width of the neighbourhood, samples.
const NEAR: usize = 2;
/// A step between two samples by this fraction of the drive's range is a jump: no rate-independent model follows it.
pub(crate) const JUMP: f64 = 0.1;
/// Time constants after which a hundredth of a ring is left.
const SETTLED: f64 = 4.6;
/// Settling time after a jump if nothing is seen to ring, s.
const SETTLING: f64 = 20e-3;

/// Time without weight after a jump (s), while `mode` rings.
pub(crate) fn settling(mode: Option<Mode>) -> f64 {
    mode.map_or(SETTLING, |mode| SETTLED / (core::f64::consts::TAU * mode.frequency * mode.damping))
}

/// Samples without weight: glitches of the displacement, and those after a jump of the drive.
pub(crate) fn weightless(
    lines: &LineNumbers,
    time: &[f64],
    drive: &[f64],
    displacement: &mut [f64],
    findings: &mut Findings,
) -> Vec<bool> {
    let mut weightless = vec![false; time.len()];
    glitches(lines, time, drive, displacement, &mut weightless, findings);
    jumps(lines, [time, drive, displacement], &mut weightless, findings);
    weightless
}

fn glitches(
    lines: &LineNumbers,
    time: &[f64],
    drive: &[f64],
    displacement: &mut [f64],
    weightless: &mut [bool],
    findings: &mut Findings,
) {
    let (low, high) = extent(displacement);
    let (bottom, top) = extent(drive);
    if high <= low || top <= bottom {
        return;
    }
    let gain = (high - low) / (top - bottom);
    let noise = noise_floor(displacement);
    for k in NEAR..time.len().saturating_sub(NEAR) {
        let around = k - NEAR..=k + NEAR;
        let mut near = displacement[around.clone()].to_vec();
        let off = (displacement[k] - median(&mut near)).abs();
        // Cheap test first: few samples pass it.
        if off <= GLITCH * (high - low) || off <= ABOVE_NOISE * noise {
            continue;
        }
        let (near_low, near_high) = extent(&drive[around]);
        // Ringing moves the neighbours too; only a sample that differs from them is a glitch.
        let (least, most) = extent(&[k - 2, k - 1, k + 1, k + 2].map(|i| displacement[i]));
        if off <= GLITCH * (high - low) + 3.0 * gain * (near_high - near_low) || off <= ALONE * (most - least) {
            continue;
        }
        weightless[k] = true;
        displacement[k] = 0.5 * (displacement[k - 1] + displacement[k + 1]);
        let (at_time, distance) = (time[k], off * 1e6);
        let message = format!(
            "at {at_time} s the displacement is off its neighbours by {distance:.3} um for a single sample: it gets no weight"
        );
        let help = "look for interference or a loose contact, or record again";
        findings.add(codes::RECORD_GLITCH, Some(lines.at(k)), message, help);
    }
}

fn jumps(
    lines: &LineNumbers,
    [time, drive, displacement]: [&[f64]; 3],
    weightless: &mut [bool],
    findings: &mut Findings,
) {
    let (low, high) = extent(drive);
    // Further jumps in the settling time belong to the one that was reported.
    let mut reported = 0;
    let is_jump = |k: &usize| (drive[*k] - drive[k - 1]).abs() > JUMP * (high - low);
    let mut settling_time = None;
    for k in (1..drive.len()).filter(is_jump) {
        let ringing = || settling(mode::ring(time, drive, displacement).map(|ring| ring.mode));
        let until = time[k] + *settling_time.get_or_insert_with(ringing);
        let end = time.partition_point(|t| *t < until).max(k + 1);
        weightless[k..end].fill(true);
        if k < reported {
            continue;
        }
        reported = end;
        let (time, before, after, samples) = (time[k], drive[k - 1], drive[k], end - k);
        let settling = 1e3 * settling_time.unwrap_or_default();
        let message = format!(
            "at {time} s the drive jumps from {before} V to {after} V: {samples} samples from there ({settling:.1} ms) get no weight"
        );
        let help = "drive by ramps or sines: a jump excites the resonance, which hides the hysteresis";
        findings.add(codes::RECORD_JUMP, Some(lines.at(k)), message, help);
    }
}
