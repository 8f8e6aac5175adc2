//! Feeds recorded inputs to a controller: the host's side of the bit-identity check.

use crate::stimulus::InputRecording;
use host_sim::controller::TickController;
use host_sim::trace::Trace;

/// Runs `controller`, reset to power-up and configured as it is, over recorded inputs; one row of trace per row of input.
///
/// # Panics
/// If the recording has another number of input words than the controller.
pub fn replay(controller: &mut dyn TickController, recording: &InputRecording) -> Trace {
    let mut trace = Trace::new(controller.description().clone());
    let mut output = vec![0; controller.description().output_names.len()];
    controller.reset();
    for input in recording.rows() {
        controller.step(input, &mut output);
        trace.push(input, &output, controller.state_digest());
    }
    trace
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description;
    use crate::stimulus::{Setpoints, record};
    use host_sim::controller::StandIn;
    use host_sim::trace::first_difference;

    fn trace(constant: u64) -> Trace {
        let setpoints = Setpoints::Leg { stroke: 6e-5, everett: vec![vec![0.0], vec![6e-5, 0.0]] };
        let description = description();
        let recording = record(&description, &setpoints, 2000, 5).unwrap();
        // Adds its inputs' bits, scaled by one constant: every bit of history shows in its digest.
        let tick = |sum: &mut u64, input: &[u64], output: &mut [u64]| {
            for (word, slot) in input.iter().zip(output) {
                *sum = sum.wrapping_mul(31).wrapping_add(*word);
                *slot = word.wrapping_add(if *word == 0 { constant } else { 0 });
            }
        };
        replay(&mut StandIn { description, state: 77, tick }, &recording)
    }

    #[test]
    fn a_replay_repeats_to_the_bit_and_shows_one_changed_constant() {
        assert_eq!(first_difference(&trace(1), &trace(1)), None);
        let found = first_difference(&trace(1), &trace(2)).unwrap().to_string();
        assert!(found.contains("voltage[") && found.ends_with("(1 ulp)"), "{found}");
    }

    #[test]
    fn the_trace_holds_the_recording() {
        let trace = trace(1);
        assert_eq!(trace.len(), 2000);
        let digests: Vec<u64> = trace.rows().map(|row| row[42]).collect();
        assert!(digests.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
