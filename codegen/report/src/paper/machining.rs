//! Figs 23 to 28 and Table 9: machining with interaction forces.

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{Record, RunOptions};
use host_sim::platform::scenario::{MACHINING_MODES, select};
use host_sim::platform::table::MachiningTable;
use host_sim::trajectory::{PaperPath, PaperPose};

use super::motion::{REFUSED_PATH, TARGETS, change, error};
use crate::chart::{Axis, Chart, DASHED, EDGE, LINE};
use crate::section::Section;
use crate::tracking::AXES;
use specgen_studies::reproduce::platform::{MACHINING_FREQUENCY, parts, table_9};

/// The section for both work parts.
///
/// # Errors
/// As [`PlatformScenario::against`].
pub fn section(
    machine: &PlatformScenario,
    controller: &mut dyn TickController,
    command: &str,
) -> Result<Section, RunError> {
    let mut sampled = machine.clone();
    sampled.options = RunOptions { record: Record::Samples, ..machine.options.clone() };
    let trajectory = PaperPose::corrected(PaperPath::Machining, MACHINING_FREQUENCY);
    let mut section = Section::new("machining", "Machining, P against P/F", command)
        .text("The tip presses into a linear work part from the start of the path. Forces and torques act from the part on the platform, about P_C in base axes.");
    let mut table = MachiningTable::default();
    let mut refused = Vec::new();
    for (number, (name, part)) in [23, 26].into_iter().zip(parts()) {
        let make = |kind: &str, figure: usize, what: &str, y: Axis| {
            let id = format!("{kind}-{figure}-{name}");
            Chart::new(&id, &format!("Fig. {figure}: {what}, {name}"), Axis::linear("time", "s"), y)
        };
        let mut paths = [
            make("path", number, "translation with P/F", Axis::linear("pose from rest", "µm")),
            make("path", number + 1, "rotation with P/F", Axis::linear("pose from rest", "µrad")),
        ];
        let mut errors = [
            make("error", number, "translation error", Axis::linear("error", "nm")),
            make("error", number + 1, "rotation error", Axis::linear("error", "nrad")),
        ];
        let mut wrench = [
            make("force", number + 2, "interaction force with P/F", Axis::linear("force", "N")),
            make("torque", number + 2, "interaction torque with P/F", Axis::linear("torque", "N m")),
        ];
        let times = [sampled.options.interval; 2];
        for (mode, word) in MACHINING_MODES {
            select(controller, word)?;
            let run = sampled.against(controller, &trajectory, part)?;
            let Ok(found) = run.scored() else {
                refused.push(format!("{name} with {mode}"));
                continue;
            };
            table.push(name, mode, found);
            for axis in 0..6 {
                let (turning, label) = (axis / 3, AXES[axis]);
                let combined = mode != "p";
                let law = if combined { "P/F" } else { "P" };
                let values: Vec<f64> = run.samples.iter().map(|sample| error(sample, axis)).collect();
                change(&mut errors[turning], |chart| {
                    chart.over_time(&format!("{label}, {law}"), LINE, times, &values).colored(if combined {
                        axis % 3
                    } else {
                        EDGE
                    })
                });
                if combined {
                    let target: Vec<f64> = run.samples.iter().map(|sample| sample.target[axis] * 1e6).collect();
                    let pose: Vec<f64> = run.samples.iter().map(|sample| sample.tick.pose[axis] * 1e6).collect();
                    let load: Vec<f64> = run.samples.iter().map(|sample| sample.tick.wrench.numbers()[axis]).collect();
                    change(&mut paths[turning], |chart| {
                        chart
                            .over_time(label, LINE, times, &pose)
                            .colored(axis % 3)
                            .over_time(&format!("{label} target"), DASHED, times, &target)
                            .colored(TARGETS)
                    });
                    let name = [["Fx", "Fy", "Fz"], ["Tx", "Ty", "Tz"]][turning][axis % 3];
                    change(&mut wrench[turning], |chart| chart.over_time(name, LINE, times, &load));
                }
            }
        }
        if !paths[0].series.is_empty() {
            let ([path, turn], [error, error_turn], [force, torque]) = (paths, errors, wrench);
            section = section.charts(vec![path, error, turn, error_turn, force, torque]);
        }
    }
    if !refused.is_empty() {
        section = section.text(&format!("{REFUSED_PATH} Not scored: {}.", refused.join(", ")));
    }
    Ok(section.comparison(&table_9(&table)))
}
