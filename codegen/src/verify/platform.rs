//! The exercise of a controller in task space: closed loop with a simulated machine, on a trajectory of the spec.

use std::f64::consts::{PI, TAU};

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::rig::{BUSY, Bench, Command, Noise, Request, RunOptions};
use host_sim::platform::{GaugeSignal, PlatformParameters, PlatformRig, PlatformScenario, Probe, Specimen};
use host_sim::trace::Trace;
use host_sim::trajectory::PoseTarget;

use super::SEED;
use crate::lower::GRAVITY;
use crate::model::{Model, TaskSpace};

/// Way to the bias pose, then the first trajectory of the spec again and again; without one a slow motion of all six axes.
pub(super) fn exercise(
    controller: &mut dyn TickController,
    model: &Model,
    task: &TaskSpace,
    ticks: u32,
) -> Result<Trace, RunError> {
    let mut rig = rig(model, task);
    let mut bench = Bench::new(&mut rig, controller, model.timing.period, 0)?;
    bench.record();
    let mut busy = true;
    let mut request = Request::default();
    let mut streamed = 0;
    for _ in 0..ticks {
        request = match request.command {
            // A command is obeyed once: another one in between lets the trajectory begin again.
            _ if busy => request,
            Command::Trajectory => Request::default(),
            _ if task.trajectories.is_empty() => {
                streamed += 1;
                Request::stream(motion(model, task, f64::from(streamed) * model.timing.period))
            }
            _ => Request { command: Command::Trajectory, ..Request::default() },
        };
        busy = bench.tick(&request)?.status & BUSY != 0;
    }
    bench.into_trace().ok_or(RunError::Timing { interval: model.timing.period, duration: 0.0 })
}

/// A motion from rest with a share of the room that the workspace leaves.
fn motion(model: &Model, task: &TaskSpace, time: f64) -> PoseTarget {
    let mut target = PoseTarget::default();
    let [x, y, z] = model.workspace.translation;
    let [tilt_x, tilt_y, tilt_z] = model.workspace.rotation;
    for (axis, bound) in [x, y, z, tilt_x, tilt_y, tilt_z].into_iter().enumerate() {
        let amplitude = 0.05 * (bound - task.setpoint.bias[axis].abs());
        let frequency = TAU * (2.0 + 0.7 * axis as f64);
        let (sine, cosine) = libm::sincos(frequency * time);
        target.pose[axis] = amplitude * (1.0 - cosine);
        target.rate[axis] = amplitude * frequency * sine;
        target.acceleration[axis] = amplitude * frequency * frequency * cosine;
    }
    target
}

/// The machine of the spec, out of its tolerances, pre-cycled and zeroed.
fn rig(model: &Model, task: &TaskSpace) -> PlatformRig {
    let specimen = Specimen::within_tolerances(&platform(model, task), &leg(model), SEED);
    let options = RunOptions::new(model.timing.period, task.setpoint.bias);
    let scenario = PlatformScenario::new(&specimen, &Noise::of(&specimen), SEED, options);
    let signal = task.calibration.clone().map_or(GaugeSignal::Metres, GaugeSignal::Volts);
    scenario.rig().clone().with_signal(signal)
}

/// Nominal data of the machine. The simulated joints lie on two circles; explicit joints that do not are taken at their
/// mean radius, which is as good for what an exercise measures.
fn platform(model: &Model, task: &TaskSpace) -> PlatformParameters {
    let reference = PlatformParameters::reference();
    let (geometry, body, leg) = (&model.geometry, &model.platform, &model.leg);
    let [xx, yy, zz] = body.inertia;
    let [xy, xz, yz] = body.products;
    PlatformParameters {
        name: model.name.clone(),
        base_radius_m: mean_radius(&geometry.base_joints),
        platform_radius_m: mean_radius(&geometry.platform_joints),
        base_angle_over_pi: spread(&geometry.base_joints, [0, 1]) / PI,
        platform_angle_over_pi: spread(&geometry.platform_joints, [1, 2]) / PI,
        height_m: geometry.height,
        platform_mass_kg: body.mass,
        platform_inertia_kg_m2: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
        platform_center_m: body.center_of_mass,
        fixed_mass_kg: leg.fixed_mass,
        extensible_mass_kg: leg.extensible_mass,
        fixed_inertia_kg_m2: leg.fixed_inertia,
        extensible_inertia_kg_m2: leg.extensible_inertia,
        fixed_center_m: leg.fixed_center,
        extensible_center_m: leg.extensible_center,
        gravity_m_per_s2: GRAVITY,
        axial_stiffness_n_per_m: model.actuator.axial_stiffness,
        modal_damping: task.modal_damping,
        probes: task.probes.each_ref().map(|probe| Probe {
            point: probe.point,
            direction: probe.direction,
            plane_point: probe.plane_point,
            plane_normal: probe.plane_normal,
        }),
        gauge_range_m: model.sensor.range,
        ..reference
    }
}

/// Mean distance of the joints from the axis, m.
fn mean_radius(joints: &[[f64; 3]; 6]) -> f64 {
    joints.iter().fold(0.0, |sum, [x, y, _]| sum + libm::hypot(*x, *y)) / 6.0
}

/// Angle from one joint of a pair to the other about the axis, rad, at least 0.
fn spread(joints: &[[f64; 3]; 6], [first, second]: [usize; 2]) -> f64 {
    let ([ax, ay, _], [bx, by, _]) = (joints[first], joints[second]);
    libm::fabs(libm::atan2(ax * by - ay * bx, ax * bx + ay * by))
}

/// The hysteresis of host-sim's leg, at the gain, lag and noise of the spec.
fn leg(model: &Model) -> LegParameters {
    let reference = LegParameters::reference();
    let scale = model.actuator.voltage[1] / reference.u_max;
    let stretched = |thresholds: &[f64]| thresholds.iter().map(|volts| volts * scale).collect();
    let sensor = &model.sensor;
    LegParameters {
        name: model.name.clone(),
        u_max: model.actuator.voltage[1],
        // ρ̂ is the secant of the leg at full drive, of which the reference leg has 0.631 µm/V.
        gain_um_per_v: reference.gain_um_per_v * model.actuator.leg_gain() / 0.631e-6,
        tau_amp_s: model.amplifier.lag,
        play_thresholds_v: stretched(&reference.play_thresholds_v),
        creep_thresholds_v: stretched(&reference.creep_thresholds_v),
        noise: NoiseParameters {
            sensor_nm_rms: sensor.noise * 1e9,
            adc_lsb_nm: (sensor.range[1] - sensor.range[0]) / libm::exp2(f64::from(sensor.bits)) * 1e9,
            amplifier_mv_rms: model.amplifier.noise * 1e3,
            ..reference.noise
        },
        ..reference
    }
}
