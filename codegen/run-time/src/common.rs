//! Constants that both laws ask for.

use std::fmt::Debug;

use specgen_compiler::description::description;
use specgen_compiler::ir::{self, Ir, LEGS, Range};
use specgen_language::model::FaultAction;
use specgen_runtime::snapshot::Sizes;
use specgen_runtime::supervisor::{Reaction, Steadiness, Supervision, Wiring};
use specgen_runtime::{Dac, Legs, Permitted, Platform, Real, Series};

use crate::InvalidIr;
use crate::convert::{Convert, kept};
use crate::memory::{Memory, Table, models};

/// The constants, what legs are at reset, and what the controller says of itself.
#[derive(Debug)]
pub struct Common<T: Real> {
    pub tables: [Table<T>; LEGS],
    pub dac: Dac<T>,
    pub supervision: Supervision<T>,
    pub readings_per_leg: [[T; LEGS]; 6],
    pub geometry: Legs<'static, T>,
    pub inverse_jacobian: [[T; LEGS]; 6],
    pub corrections: usize,
    pub pose_bound: [T; 6],
    pub permitted: Vec<(Permitted<T>, usize)>,
    pub sizes: Sizes,
    /// At reset.
    pub memory: Box<[Memory<T>; LEGS]>,
    pub displacement: [T; LEGS],
    pub code: i32,
    /// The inverse dynamics.
    pub body: Platform<T>,
    /// The spec's settings.
    pub settings: Vec<u64>,
    /// See [`host_sim::controller::Engine::text`], but for the words of a machine.
    pub text: String,
}

impl<T: Real + Debug> Common<T> {
    pub fn new(ir: &Ir, convert: &Convert<T>, names: [&[&str]; 2]) -> Result<Self, InvalidIr> {
        let (k, a) = (&ir.kinematics, &ir.actuation);
        let body = ir.dynamics.platform_of(|value| convert.real(value));
        if body.places.iter().chain(&body.rows).any(|place| *place >= LEGS) {
            return Err(InvalidIr::Part("the order of elimination"));
        }
        let (tables, fresh) = models(convert, &ir.hysteresis)?;
        let (memory, displacement, code) = match &ir.supervision.risen {
            None => (Box::new([fresh; LEGS]), [T::ZERO; LEGS], a.code_min),
            Some(rest) => {
                let drive = convert.real(rest.drive);
                let displacement = convert.vector(&rest.displacement);
                let rate = convert.vector(&rest.rate);
                let risen = std::array::from_fn(|leg| fresh.risen(drive, displacement[leg], rate[leg]));
                (Box::new(risen), displacement, ir.supervision.rest)
            }
        };
        Ok(Self {
            tables,
            dac: Dac {
                volts_at_zero: convert.real(a.volts_at_zero),
                volts_per_code: convert.real(a.volts_per_code),
                cells_at_zero: convert.real(a.cells_at_zero),
                cells_per_code: convert.real(a.cells_per_code),
                codes_per_cell: convert.real(a.codes_per_cell),
            },
            supervision: supervision(convert, &ir.supervision),
            readings_per_leg: match &ir.supervision.readings_per_leg {
                Some(rows) => convert.matrix(rows),
                None => {
                    std::array::from_fn(|gauge| std::array::from_fn(|leg| if leg == gauge { T::ONE } else { T::ZERO }))
                }
            },
            geometry: Legs {
                rest_leg: convert.matrix(&k.rest_leg),
                platform_joint: convert.matrix(&k.platform_joint),
                rest_length: convert.vector(&k.rest_length),
                series: Series { sine: convert.slice(&k.sine), versine: convert.slice(&k.versine) },
                root: convert.slice(&k.root),
                newton_steps: k.newton_steps as usize,
            },
            inverse_jacobian: convert.matrix(&k.inverse_jacobian),
            corrections: k.corrections as usize,
            pose_bound: convert.vector(&ir.bounds.pose),
            permitted: permitted(convert, &ir.permitted),
            sizes: sizes(ir),
            memory,
            displacement,
            code,
            body,
            settings: ir.integrity.settings.clone(),
            text: text(ir, names),
        })
    }
}

/// What the controller says of itself; `names` are those of inputs and outputs.
fn text(ir: &Ir, names: [&[&str]; 2]) -> String {
    let [before, after] = description(ir);
    let [inputs, outputs] = names.map(|names| names.join(","));
    let settings = ir.permitted.names().join(",");
    format!("{before}config_names={settings}\ninput_names={inputs}\noutput_names={outputs}\n{after}")
}

/// Ranges of the settings, those that are alike in one row.
fn permitted<T: Real>(convert: &Convert<T>, table: &ir::Permitted) -> Vec<(Permitted<T>, usize)> {
    let ranges: Vec<Range> = table.words().map(|(_, range)| range).collect();
    let alike = ranges.chunk_by(|a, b| a == b);
    alike.filter_map(|alike| Some((permitted_of(convert, *alike.first()?), alike.len()))).collect()
}

fn permitted_of<T: Real>(convert: &Convert<T>, range: Range) -> Permitted<T> {
    match range {
        Range::Whole(least, most) => Permitted::Whole(least as u64, most as u64),
        Range::Number(least, most) => Permitted::Number(convert.real(least), convert.real(most)),
    }
}

fn sizes(ir: &Ir) -> Sizes {
    let s = &ir.permitted.state;
    Sizes {
        place: s.place,
        user: s.user,
        rate: s.rate,
        acceleration: s.acceleration,
        pose: s.pose,
        pose_rate: s.pose_rate,
        error: s.error,
        apart: s.apart,
        wrench: s.wrench,
        leg: s.leg,
        leg_rate: s.leg_rate,
        line: s.line,
        request: s.request,
        reading: s.reading,
        stiffness: s.stiffness,
        codes: [ir.actuation.code_min, ir.actuation.code_max],
        grid: ir.hysteresis.grid as f64,
        memory: ir.hysteresis.memory,
    }
}

fn supervision<T: Real>(convert: &Convert<T>, s: &ir::Supervision) -> Supervision<T> {
    let steadiness = &s.steadiness;
    Supervision {
        arm_ticks: s.arm_ticks,
        rest: s.rest,
        ramp_step: s.ramp_step,
        ramp_every: s.ramp_every,
        timeout: s.timeout,
        weight: s.weight,
        stuck_motion: convert.real(s.stuck_motion),
        stuck_samples: s.stuck_samples,
        disagreement: convert.real(s.disagreement),
        disagreement_samples: s.disagreement_samples,
        tracking: convert.vector(&s.tracking),
        tracking_samples: s.tracking_samples,
        leap: convert.vector(&s.leap),
        repeats: s.repeats,
        steadiness: Steadiness {
            per_limit: convert.vector(&steadiness.per_limit),
            follow: convert.real(steadiness.follow),
            motion: convert.real(steadiness.motion),
            keep: convert.real(steadiness.keep),
            keep_fallen: convert.real(steadiness.keep_fallen),
            one_way: steadiness.one_way,
            first: steadiness.first,
            next: steadiness.next,
        },
        amplifier_fault: match s.amplifier_fault {
            FaultAction::Off => Reaction::Off,
            FaultAction::RampDown => Reaction::RampDown,
            FaultAction::Hold => Reaction::Hold,
        },
        wiring: s.wiring.as_ref().map(|wiring| Wiring {
            ticks: wiring.ticks,
            height: wiring.height,
            turn: convert.matrix(&wiring.turn),
            lag: convert.vector(&wiring.lag),
            weights: convert.vector(&wiring.weights),
            per_metre: convert.vector(&wiring.per_metre),
            gauge_gain: convert.vector(&wiring.gauge_gain),
            leg_gain: wiring.leg_gain.as_ref().map(|range| convert.vector(range)),
            residual: convert.real(wiring.residual),
        }),
    }
}

/// What stays in memory, of one thing.
pub fn constants<C>(constants: C) -> &'static C {
    match kept([constants]) {
        [constants] => constants,
        _ => unreachable!("one was kept"),
    }
}
