//! Definition of a study, and the file of a part of its results.

use std::path::Path;

use host_sim::plant::LegParameters;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::Options;
use specgen_compiler::compile::Compilation;
use specgen_language::outcome::{Failure, Outcome as CommandOutcome};
use specgen_language::output::write_file;
use specgen_language::shell;
use specgen_language::ui::Ui;
use specgen_studies::robust::{Factors, Gate, Learning, Member, Outcome, Plan, Shard, shard};
use specgen_studies::trajectory::NamedTrajectory;
use specgen_toolchain::sha256;

/// Default error above which a run has diverged, relative to the stroke.
const BOUND: f64 = 0.05;
/// Format name in the file of a part.
const FORMAT: &str = "specgen robust part";

/// Everything that the report of a study depends on except its runs. Parts of one study have the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Work {
    /// Version of specgen that ran it.
    pub(super) specgen: String,
    /// The spec file, as given.
    pub(super) spec: String,
    /// Name of the platform.
    pub(super) name: String,
    /// Digest of the spec and its records.
    pub(super) digest: String,
    /// Whether it has `[control]`.
    pub(super) platform: bool,
    pub(super) trajectory: String,
    /// Hz.
    pub(super) frequency: f64,
    pub(super) seed: u64,
    pub(super) draws: u32,
    pub(super) noise: bool,
    /// SHA-256 of the parameters of the simulated leg.
    pub(super) plant: String,
    /// Error above which a run has diverged, m.
    pub(super) bound: f64,
    pub(super) factors: Factors,
    /// Limit of the gate, m.
    pub(super) max_error: Option<f64>,
    /// Limit of the gate, rad.
    pub(super) max_orientation: Option<f64>,
    /// Quantile of the gate, %.
    pub(super) quantile: Option<f64>,
    /// Learning settings, if the machines learn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) learning: Option<Lessons>,
    /// Limit of the gate after learning, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) max_learned: Option<f64>,
    /// Given options that affect a member, each preceded by a space.
    pub(super) options: String,
}

/// Learning settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Lessons {
    pub(super) passes: u32,
    /// Frequencies, Hz.
    pub(super) band: [f64; 2],
}

impl Work {
    /// From the options, else from the spec.
    pub(super) fn of(
        options: &Options,
        path: &Path,
        compiled: &Compilation,
        followed: &NamedTrajectory,
        leg: &LegParameters,
        learning: Option<&Learning>,
    ) -> Result<Self, Failure> {
        let declared = &compiled.model.robust;
        let platform = compiled.model.task_space.is_some();
        if options.max_orientation.is_some() && !platform {
            return Err(Failure::Usage(
                "--max-orientation needs a spec with [control]; use --max-error for legs with their own gauges"
                    .to_owned(),
            ));
        }
        Ok(Self {
            specgen: env!("CARGO_PKG_VERSION").to_owned(),
            spec: path.display().to_string(),
            name: compiled.ir.name.clone(),
            digest: compiled.ir.digest.clone(),
            platform,
            trajectory: followed.name.clone(),
            frequency: followed.frequency,
            seed: options.plant.seed,
            draws: options.draws,
            noise: !options.plant.no_noise,
            // The printed numbers read back to the same bits.
            plant: sha256(format!("{leg:?}").as_bytes()),
            bound: options.diverged_above.unwrap_or(BOUND * compiled.model.actuator.stroke),
            factors: Factors::of(&compiled.model, &options.vary),
            max_error: options.max_error.or(declared.max_error),
            max_orientation: options.max_orientation.or(declared.max_orientation.filter(|_| platform)),
            quantile: options.quantile,
            learning: learning
                .map(|learning| Lessons { passes: options.learn.unwrap_or(0), band: learning.convergence.band }),
            max_learned: options.max_learned.or(declared.max_learned.filter(|_| learning.is_some())),
            options: replay_options(options),
        })
    }

    /// All machines.
    pub(super) fn plan(&self) -> Plan {
        Plan::new(&self.factors, self.draws, self.seed)
    }

    /// The limits. A single machine has only one figure.
    pub(super) fn gate(&self, alone: bool) -> Gate {
        Gate {
            error_nm: self.max_error.map(|error| error * 1e9),
            orientation_nrad: self.max_orientation.map(|error| error * 1e9),
            learned_nm: self.max_learned.map(|error| error * 1e9),
            quantile: self.quantile.filter(|_| !alone),
        }
    }
}

/// Options needed to replay a member.
fn replay_options(options: &Options) -> String {
    let Options { vary, trajectory, frequency, plant, diverged_above, learn, .. } = options;
    let mut out = shell::line("");
    if plant.seed != 1 {
        out = out.words(&format!("--seed {}", plant.seed));
    }
    if let Some(name) = trajectory {
        out = out.words("--trajectory").word(name);
    }
    if let Some(hertz) = frequency {
        out = out.words(&format!("--frequency {hertz}"));
    }
    for given in vary {
        out = out.words("--vary").word(&format!("{}={}:{}", given.factor, given.range[0], given.range[1]));
    }
    if let Some(bound) = diverged_above {
        out = out.words("--diverged-above").word(&format!("{bound:e} m"));
    }
    if let Some(passes) = learn {
        out = out.words(&format!("--learn {passes}"));
    }
    if let Some(path) = &plant.plant {
        out = out.words("--plant").path(path);
    }
    if plant.no_noise {
        out = out.words("--no-noise");
    }
    out.into()
}

/// A member and its outcome.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct MemberRun {
    member: Member,
    outcome: Outcome,
}

impl From<(Member, Outcome)> for MemberRun {
    fn from((member, outcome): (Member, Outcome)) -> Self {
        Self { member, outcome }
    }
}

/// The output of `--shard`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Part {
    pub(super) shard: Shard,
    /// Number of machines in all parts.
    pub(super) planned: usize,
    pub(super) work: Work,
    pub(super) runs: Vec<MemberRun>,
}

impl Part {
    pub(super) fn write(&self, file: &Path, ui: &Ui) -> Result<(), Failure> {
        let mut document = json!(self);
        document["format"] = json!(FORMAT);
        write_file(file, format!("{document:#}\n").as_bytes())?;
        ui.result(&PartFile {
            file: file.display().to_string(),
            shard: self.shard,
            planned: self.planned,
            machines: self.runs.len(),
            diverged: self.runs.iter().filter(|ran| ran.outcome.figures().is_none()).count(),
        });
        Ok(())
    }

    /// Parses the text of a file; returns a message if it is invalid.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let document: Value = serde_json::from_str(text).map_err(|error| format!("is not JSON: {error}"))?;
        if document["format"] != FORMAT {
            return Err("was not written by specgen robust --shard".to_owned());
        }
        // Check the version first: another version may have other fields.
        let (version, ours) = (&document["work"]["specgen"], env!("CARGO_PKG_VERSION"));
        if version != ours {
            return Err(format!("was written by specgen {version}, this is {ours}; run all parts with one version"));
        }
        serde_json::from_value(document).map_err(|error| format!("is not a complete part: {error}"))
    }

    /// The first difference between the study of this part and that of `other`: name, value here and there.
    pub(super) fn differs(&self, other: &Self) -> Option<(String, Value, Value)> {
        let fields = |part: &Self| match json!(part.work) {
            Value::Object(fields) => fields,
            _ => Map::new(),
        };
        let there = fields(other);
        let mut ours = fields(self).into_iter();
        ours.find_map(|(name, value)| {
            let other = &there[&name];
            (value != *other).then(|| (name.clone(), value, other.clone()))
        })
    }

    pub(super) fn named(self, name: String) -> shard::Part {
        let runs = self.runs.into_iter().map(|MemberRun { member, outcome }| (member, outcome)).collect();
        shard::Part { name, shard: self.shard, runs }
    }
}

/// A written part.
#[derive(Serialize)]
struct PartFile {
    file: String,
    shard: Shard,
    planned: usize,
    machines: usize,
    diverged: usize,
}

impl CommandOutcome for PartFile {
    fn text(&self) -> String {
        let Self { file, shard: Shard { index, of }, planned, machines, diverged } = self;
        format!("wrote part {index} of {of} to {file}: {machines} of {planned} machines, {diverged} diverged\n")
    }
}
