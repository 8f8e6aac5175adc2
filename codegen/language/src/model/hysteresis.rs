//! The hysteresis of a leg, and the run-to-run adaptation of its inverse.

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
        /// Intervals per axis of the Preisach plane; the size of the table grows, and the error falls, with the square of this number. If it is not given, a leg model with plays chooses 32, 64 or 128.
        grid: usize = integer(2, MAX_GRID as i64), Default(32), "N" ["n", "cells", "discretization"], 32;
        /// Number of reversals that the controller can store.
        memory: usize = integer(8, 256), Default(64), "" ["depth"], 64;
        /// Reversal-curve files, relative to the spec: one for all legs, or six. A table written by `specgen identify -o` is used as it is. With [control], [] as long as no leg is identified: the controller then has the open drive only.
        records: Vec<String> = Shape::Records, Required, "" ["record", "file", "files", "data"], ["records/reference-forc.csv"];
        /// Columns of reversal-curve files by header or number, with units, scale and offset as in `--columns` of `specgen identify`.
        columns: Option<String> = Shape::One(Item::Columns), Rule("found by the names in the files"), "", "drive_V=2,displacement_um=3";
        /// Leg model of reversal-curve records: the Preisach table; or chosen by its error on curves that were held out, "auto"; or a family by name, with creep where the record shows it. A table written by `specgen identify -o` keeps its own.
        model: LegModelKind = one_of(LegModelKind::WORDS), Default("preisach"), "" ["leg_model", "family"], "preisach";
        /// Rate dependence in model and inverse: none; the dynamic Preisach model (6); creep after the static model. `specgen identify rate` compares them.
        rate = one_of(&["static", "dynamic-preisach", "creep"]), Default("static"), "", "creep";
        /// With "dynamic-preisach": tables of the second weight, from `specgen identify rate -o`: one for all legs or six.
        rate_tables = Shape::Records, Rule(r#"error with rate = "dynamic-preisach""#), "mu_1", ["records/leg-mu1.csv"];
        /// With "creep": time constants of up to six creep operators in parallel.
        creep_times = CREEP_TIMES, Rule(r#"error with rate = "creep""#), "", ["0.8 s", "40 ms"];
        /// With "creep": final contribution of each operator, as a fraction of the static displacement; their sum is below 1.
        creep_weights = CREEP_WEIGHTS, Rule(r#"error with rate = "creep""#), "", [0.03, 0.09];
        /// For six legs with their own gauges: delay of the displacement behind the drive. The demand leads by it, less half a period. With [control], use `control.lead`.
        dead_time: f64 = one(Dimension::TIME, Range::closed(0.0, 1e-2), "ms"), Default("0 ms"), "", "0.13 ms";
    }
    and |fields, _table| {
        /// Rate dependence of the model.
        rate: RateDependence = rate(fields)?;
    }
}

impl Hysteresis {
    /// Whether there are records of the legs; otherwise the controller has the open drive only.
    #[must_use]
    pub fn is_identified(&self) -> bool {
        !self.records.is_empty()
    }
}

choice! {
    /// Families of leg models, the simplest first.
    LegModelKind {
        /// The Everett table.
        Preisach = "preisach",
        /// One Bouc-Wen state with a read-out.
        BoucWen = "bouc-wen",
        /// Plays, each with a cubic read-out: a generalized Prandtl-Ishlinskii model.
        GeneralizedPlays = "generalized-plays",
        /// Plays with a common read-out.
        Plays = "plays",
        /// Plays and one Bouc-Wen state with a common read-out.
        Hybrid = "bouc-wen-plays",
        /// The one with the least error on curves that were held out.
        Auto = "auto",
    }
}

impl LegModelKind {
    /// That of a word in a spec.
    pub fn of_word(word: &str) -> Option<Self> {
        Self::FITTED.into_iter().chain([Self::Auto]).find(|kind| kind.word() == word)
    }

    /// All words.
    pub fn words() -> String {
        Self::WORDS.join(", ")
    }

    /// Those that are fitted.
    pub const FITTED: [Self; 5] = [Self::Preisach, Self::BoucWen, Self::GeneralizedPlays, Self::Plays, Self::Hybrid];
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
    /// Estimates that adapt the inverse.
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
    /// Run-to-run adaptation, Appendix B. A mode needs the weights that it uses, each as weight per run or as bandwidth. With [control] give both bandwidths, or neither: the compiler then derives them.
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
        /// ω (EWMA) or ω1 (PCC), per run, in (0, 1]. 0, which leaves the estimate unchanged, if the mode does not use
        /// it and the spec does not give it.
        level_weight: f64 = Self::weight(fields, "level").unwrap_or(0.0);
        /// ω2, per run, in (0, 1]; otherwise as above.
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
