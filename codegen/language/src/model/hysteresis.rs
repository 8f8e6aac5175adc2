//! The hysteresis of a leg, and the estimates that adapt its inverse from run to run.

use crate::keys::declare::*;

/// Most intervals per axis of an Everett table: the normal matrix of 128 has 8,256 × 8,256 entries, half a gigabyte.
pub const MAX_GRID: usize = 128;
/// Most control ticks of a run.
pub const LARGEST_RUN_INTERVAL: i32 = 1_000_000;

const CREEP_TIME: Item = item(Dimension::TIME, Range::closed(1e-6, 1e5), "ms");
const CREEP_TIMES: Shape = Shape::Leading(1, &[CREEP_TIME; 6]);
const CREEP_WEIGHTS: Shape = Shape::Leading(1, &[Item::Number(Range::closed(0.0, 1.0)); 6]);
const WEIGHT: Shape = Shape::One(Item::Number(Range::above(0.0, 1.0)));
pub(super) const BANDWIDTH: Shape = one(Dimension::ANGULAR_RATE, Range::above(0.0, 1e6), "rad/s");

section! {
    /// The inverse Preisach model and the measurements that identify it.
    ///
    /// Times in s.
    "hysteresis" ["preisach", "model"], Plain => Hysteresis {
        /// Intervals per axis of the Preisach plane; the table grows and the error falls with its square.
        grid: usize = integer(2, MAX_GRID as i64), Default(32), "N" ["n", "cells", "discretization"], 32;
        /// Reversals that the controller can remember.
        memory: usize = integer(8, 256), Default(64), "" ["depth"], 64;
        /// Reversal-curve files, relative to the spec: one for all legs, or six. A table that `specgen identify -o` wrote is taken as it is.
        records: Vec<String> = Shape::Records, Required, "" ["record", "file", "files", "data"], ["records/reference-forc.csv"];
        /// Rate dependence in model and inverse: none; the dynamic Preisach model (6); creep behind the static model. `specgen identify rate` finds out which is worth it.
        rate = one_of(&["static", "dynamic-preisach", "creep"]), Default("static"), "", "creep";
        /// With "dynamic-preisach": tables of the second weight as `specgen identify rate -o` writes them, one for all legs or six.
        rate_tables = Shape::Records, Rule(r#"error with rate = "dynamic-preisach""#), "mu_1", ["records/leg-mu1.csv"];
        /// With "creep": time constants of up to six creep operators in parallel.
        creep_times = CREEP_TIMES, Rule(r#"error with rate = "creep""#), "", ["0.8 s", "40 ms"];
        /// With "creep": what each adds in the end, as a share of the static displacement; their sum is below 1.
        creep_weights = CREEP_WEIGHTS, Rule(r#"error with rate = "creep""#), "", [0.03, 0.09];
        /// Of six legs with their own gauges: time by which the displacement lags the drive. The demand is led by it, less half a period. With [control] it is `control.lead`.
        dead_time: f64 = one(Dimension::TIME, Range::closed(0.0, 1e-2), "ms"), Default("0 ms"), "", "0.13 ms";
    }
    and |fields, _table| {
        /// How the rate is accounted for.
        rate: RateDependence = rate(fields)?;
    }
}

/// Rate dependence of the leg model.
#[derive(Debug, Clone, PartialEq)]
pub enum RateDependence {
    /// None.
    Static,
    /// (6), with the files of the second table: one for all legs, or six.
    DynamicPreisach(Vec<String>),
    /// Time constant (s) and weight of each operator behind the static model.
    Creep(Vec<[f64; 2]>),
}

fn rate(fields: &Fields) -> Option<RateDependence> {
    Some(match fields.choice("hysteresis.rate")? {
        "dynamic-preisach" => RateDependence::DynamicPreisach(fields.texts("hysteresis.rate_tables")?.to_vec()),
        "creep" => {
            let times = fields.numbers("hysteresis.creep_times")?;
            let weights = fields.numbers("hysteresis.creep_weights")?;
            RateDependence::Creep(times.iter().zip(weights).map(|(time, weight)| [*time, *weight]).collect())
        }
        _ => RateDependence::Static,
    })
}

choice! {
    /// How the run-to-run estimate is used.
    AdaptationMode {
        /// Inverse Preisach alone.
        Invhys = "invhys",
        /// (AII.3).
        Ewma = "ewma",
        /// (AII.5), (AII.6).
        Pcc = "pcc",
    }
}

section! {
    /// Run-to-run adaptation, Appendix B. A mode that uses a weight needs it, as weight per run or as bandwidth. With [control] both bandwidths are given, or neither: the compiler then derives them.
    ///
    /// A bandwidth in the spec is a weight here: ω = Ω·T_run.
    "adaptation", Plain => Adaptation {
        /// Inverse model alone; with the level estimate (AII.3); with level and drift (AII.5), (AII.6).
        mode: AdaptationMode = one_of(AdaptationMode::WORDS), Default("invhys"), "" ["law"], "pcc";
        /// Weight of a new reading in the level estimate, per run: (AII.3), (AII.5).
        level_weight = WEIGHT, InsteadOf("level_bandwidth"), "omega_1", 0.252;
        /// The same as a bandwidth: weight = bandwidth x period x run_interval.
        level_bandwidth = BANDWIDTH, InsteadOf("level_weight"), "", "450 rad/s";
        /// Weight of a new reading in the drift estimate, per run: (AII.6).
        drift_weight = WEIGHT, InsteadOf("drift_bandwidth"), "omega_2", 0.011;
        /// The same as a bandwidth.
        drift_bandwidth = BANDWIDTH, InsteadOf("drift_weight"), "", "20 rad/s";
        /// Control ticks per run.
        run_interval: u32 = integer(1, LARGEST_RUN_INTERVAL as i64), Default(1), "", 1;
        /// Smallest and largest true gain over modelled gain for which the loop must be stable: (AII.18), (AII.19).
        gain_ratio: [f64; 2] = list(&[RATIO; 2]), Default([0.9, 1.1]), "lambda", [0.9, 1.1];
    }
    and |fields, _table| {
        /// ω (EWMA) or ω1 (PCC), per run, in (0, 1]; 0, which leaves the estimate as it is, if the mode does not use it and the
        /// spec does not give it.
        level_weight: f64 = Self::weight(fields, "level").unwrap_or(0.0);
        /// ω2, per run, in (0, 1]; 0 likewise.
        drift_weight: f64 = Self::weight(fields, "drift").unwrap_or(0.0);
    }
}

impl Adaptation {
    /// Weight per run of "level" or "drift", given as such or as a bandwidth: ω = Ω · period · run_interval.
    pub(crate) fn weight(fields: &Fields, which: &str) -> Option<f64> {
        if let Some(weight) = fields.number(&format!("adaptation.{which}_weight")) {
            return Some(weight);
        }
        let run: u32 = fields.whole("adaptation.run_interval")?;
        Some(
            fields.number(&format!("adaptation.{which}_bandwidth"))? * fields.number("timing.period")? * f64::from(run),
        )
    }
}
