//! Properties of a compiled spec, one per line: shown below the verdict of `check` and of the main command, and on the page.

use specgen_compiler::compile::Compilation;
use specgen_compiler::lower::{self, setpoint};
use specgen_compiler::{reach, stability};
use specgen_identify::Report;

use crate::lead::{self, LeadOf};

/// Results of identification and the stability check, one per line.
pub fn of(compiled: &Compilation) -> String {
    let mut text = String::new();
    let assumed = compiled.assumptions.summary();
    if !assumed.is_empty() {
        text += &format!("  not measured: {assumed}\n");
        compiled.assumptions.list().iter().for_each(|one| text.push_str(&format!("    {one}\n")));
    }
    for (name, report) in compiled.model.hysteresis.records.iter().zip(&compiled.records) {
        let what = report.as_ref().map_or_else(|| "a given table".to_owned(), Report::summary);
        text += &format!("  record {name}: {what}\n");
    }
    if let Some(margins) = &compiled.margins
        && let (Some(limit), Some(largest)) = (margins.static_gain_limit, margins.largest_level_weight)
    {
        text += &format!(
            "  adaptation: λ < {limit:.3} without leg dynamics; spectral radius of the sampled leg {:.4}; \
             stable up to level weight {largest:.4} (here {})\n",
            margins.spectral_radius, compiled.model.adaptation.level_weight
        );
    }
    if let Some(design) = &compiled.design {
        text.push_str(&stability::platform::describe(design));
    }
    for one in lead::of(compiled) {
        let LeadOf { name, lead, best, errors: [error, least] } = &one;
        let (milliseconds, error_nm) = (lead * 1e3, error * 1e9);
        text +=
            &format!("  trajectory {name}: lead {milliseconds:.4} ms gives {error_nm:.1} nm rms error by the model");
        text += &if one.is_proposed() {
            format!(
                ";\n    less is better for its corners: lead = \"{:.3} ms\" in its [[trajectory]] gives {:.1} nm\n",
                best * 1e3,
                least * 1e9
            )
        } else {
            format!(", the best {:.1} nm\n", least * 1e9)
        };
    }
    if let Some(reach) = &compiled.reach {
        text.push_str(&reach::describe(reach, compiled.design.is_some()));
    }
    text.push_str(&lower::describe_wiring(&compiled.model, &compiled.ir.supervision));
    for demand in &compiled.demands {
        let current = demand.current.map_or_else(String::new, |amperes| format!(", {:.3} A", amperes));
        let (name, speed, slew) = (&demand.name, demand.leg_speed * 1e6, demand.slew * 1e-3);
        let (allowed, deflection) = (compiled.model.actuator.slew_rate * 1e-3, demand.deflection * 1e9);
        text += &format!(
            "  trajectory {name}: leg speed up to {speed:.1} um/s, using {slew:.3} of {allowed:.3} V/ms{current}; deflection by inertia {deflection:.2} nm\n"
        );
    }
    if let Some(task) = &compiled.ir.task_space {
        text.push_str(&lower::describe_load(&task.load));
    }
    if !compiled.stops.is_empty() {
        text.push_str(&setpoint::describe_stops(&compiled.stops));
    }
    let list = |values: &[f64]| values.iter().map(|v| format!("{:.1}", v * 1e9)).collect::<Vec<_>>().join("/");
    let rest = &compiled.rest_noise;
    let parts = [&rest.pose, &rest.gauges, &rest.amplifiers].map(|part| [list(&part[..3]), list(&part[3..])]);
    let [[pose, turned], [by_gauges, turned_by_gauges], [by_amplifiers, turned_by_amplifiers]] = parts;
    text += &format!(
        "  pose at rest: {pose} nm and {turned} nrad rms as measured; {by_gauges} nm and {turned_by_gauges} nrad from gauge noise, \
         {by_amplifiers} nm and {turned_by_amplifiers} nrad from amplifier noise\n"
    );
    if let (Some(noise), Some(task)) = (&compiled.pose_noise, &compiled.ir.task_space) {
        let (reading, translation, rotation) = (noise.reading * 1e9, list(&noise.pose[..3]), list(&noise.pose[3..]));
        let (legs, passes, metres) = (list(&noise.leg), task.sensing.passes, task.sensing.remainder[0]);
        let radians = task.sensing.remainder[1];
        text += &format!(
            "  gauges: {reading:.2} nm rms each including quantisation; pose {translation} nm and {rotation} nrad rms; legs {legs} nm rms; forward kinematics: {passes} iterations, error {metres:.1e} m, {radians:.1e} rad\n"
        );
    }
    text
}
