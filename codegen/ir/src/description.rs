//! A controller's description of itself: `key=value` lines, with lists separated by commas.

use specgen_law::{legs, platform};

use crate::{Frames, Ir, TaskSpace};

/// Input words of a controller without a correction, and with one.
const INPUT_NAMES: [&[&str]; 2] = [&platform::tick::input_names::<33>(), &platform::tick::input_names::<39>()];
/// Output words of a controller without output lines, and with some.
const OUTPUT_NAMES: [&[&str]; 2] = [
    &platform::tick::output_names::<{ platform::tick::output_words_with(0) }>(),
    &platform::tick::output_names::<{ platform::tick::output_words_with(1) }>(),
];

/// All lines.
pub fn description(ir: &Ir) -> String {
    let (name, digest, version) = (&ir.name, &ir.digest, &ir.specgen_version);
    let (kind, bits) = (if ir.task_space.is_some() { "platform" } else { "legs" }, ir.scalar.bits());
    let (leg_gain, period, grid) = (ir.defaults.leg_gain, ir.defaults.period, ir.hysteresis.grid);
    let (low, high) = (ir.actuation.voltage[0], ir.actuation.voltage[1]);
    let about = format!(
        "name={name}\ndigest={digest}\nversion={version}\nkind={kind}\nscalar_bits={bits}\nleg_gain={leg_gain:?}\nperiod={period:?}\ngrid={grid}\ndrive_range={low:?},{high:?}\n"
    );
    let [inputs, outputs] = match &ir.task_space {
        None => [&legs::tick::INPUT_NAMES[..], &legs::tick::OUTPUT_NAMES],
        Some(TaskSpace { law, defaults, .. }) => [
            INPUT_NAMES[usize::from(law.correction.is_some())],
            OUTPUT_NAMES[usize::from(!defaults.triggers.is_empty())],
        ],
    }
    .map(|names| names.join(","));
    let settings = ir.permitted.names().join(",");
    let motion = motion(ir);
    format!("{about}config_names={settings}\ninput_names={inputs}\noutput_names={outputs}\n{motion}")
}

/// Workspace, speed and coordinates of a platform, with which a host can decide whether a pose can be reached. Empty for six legs.
fn motion(ir: &Ir) -> String {
    let Some(task) = &ir.task_space else { return String::new() };
    let setpoints = &task.setpoints;
    let mut text = String::new();
    let mut line = |key: &str, values: &[f64]| {
        let values: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
        text.push_str(&format!("{key}={}\n", values.join(",")));
    };
    line("bias", &task.law.bias);
    line("origin", &setpoints.bias);
    line("bound", &ir.bounds.pose);
    line("speed", &setpoints.speed);
    line("stroke", &[ir.bounds.stroke]);
    line("rest_leg", ir.kinematics.rest_leg.as_flattened());
    line("platform_joint", ir.kinematics.platform_joint.as_flattened());
    match setpoints.frames {
        Frames::Parallel => {}
        Frames::Tool { point, largest_angle } => {
            line("tool", &point);
            line("largest_angle", &[largest_angle]);
        }
        Frames::Work { axes, point, largest_angle } => {
            line("tool", &point);
            line("axes", axes.as_flattened());
            line("largest_angle", &[largest_angle]);
        }
    }
    let names: Vec<&str> = setpoints.trajectories.iter().map(|trajectory| trajectory.name.as_str()).collect();
    text + "trajectories=" + &names.join(",") + "\n"
}
