//! What a study was asked to do, and a part of what it did, as a file.

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
use specgen_studies::trajectory::Followed;
use specgen_toolchain::sha256;

/// Part of the stroke beyond which an error counts as diverged, unless asked otherwise.
const BOUND: f64 = 0.05;
/// What the file of a part says that it is.
const FORMAT: &str = "specgen robust part";

/// All that the report of a study depends on, but for its runs. Parts of one study have the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Work {
    /// Version of specgen that ran it.
    pub(super) specgen: String,
    /// The spec's file, as it was named.
    pub(super) spec: String,
    /// Name of the platform.
    pub(super) name: String,
    /// Of the spec and its records.
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
    /// Error beyond which a run has diverged, m.
    pub(super) bound: f64,
    pub(super) factors: Factors,
    /// Of the gate, m.
    pub(super) max_error: Option<f64>,
    /// Of the gate, rad.
    pub(super) max_orientation: Option<f64>,
    /// Of the gate, %.
    pub(super) quantile: Option<f64>,
    /// How the machines learn, if they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) learning: Option<Lessons>,
    /// Of the gate, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) max_learned: Option<f64>,
    /// Options that were given and decide what a member is, each with a space before it.
    pub(super) options: String,
}

/// How machines learn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Lessons {
    pub(super) passes: u32,
    /// Frequencies, Hz.
    pub(super) band: [f64; 2],
}

impl Work {
    /// Of the options, else of the spec.
    pub(super) fn of(
        options: &Options,
        path: &Path,
        compiled: &Compilation,
        followed: &Followed,
        leg: &LegParameters,
        learning: Option<&Learning>,
    ) -> Result<Self, Failure> {
        let declared = &compiled.model.robust;
        let platform = compiled.model.task_space.is_some();
        if options.max_orientation.is_some() && !platform {
            return Err(Failure::Usage(
                "--max-orientation is for a spec with [control]; legs with their own gauges have --max-error"
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
            // Numbers are printed so that they read back to the same bits.
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

    /// What must not be exceeded. Of one machine alone there is one figure.
    pub(super) fn gate(&self, alone: bool) -> Gate {
        Gate {
            error_nm: self.max_error.map(|error| error * 1e9),
            orientation_nrad: self.max_orientation.map(|error| error * 1e9),
            learned_nm: self.max_learned.map(|error| error * 1e9),
            quantile: self.quantile.filter(|_| !alone),
        }
    }
}

/// What a replay of a member has to be given as well.
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

/// A member and what became of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Ran {
    member: Member,
    outcome: Outcome,
}

impl From<(Member, Outcome)> for Ran {
    fn from((member, outcome): (Member, Outcome)) -> Self {
        Self { member, outcome }
    }
}

/// What `--shard` writes.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Part {
    pub(super) shard: Shard,
    /// Machines of all parts.
    pub(super) planned: usize,
    pub(super) work: Work,
    pub(super) runs: Vec<Ran>,
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

    /// Of the text of a file; in words why not.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let document: Value = serde_json::from_str(text).map_err(|error| format!("is no JSON: {error}"))?;
        if document["format"] != FORMAT {
            return Err("was not written by specgen robust --shard".to_owned());
        }
        // The version first: another one may have other fields.
        let (version, ours) = (&document["work"]["specgen"], env!("CARGO_PKG_VERSION"));
        if version != ours {
            return Err(format!("was written by specgen {version}, this is {ours}; run all parts with one version"));
        }
        serde_json::from_value(document).map_err(|error| format!("is not a whole part: {error}"))
    }

    /// The first thing in which this part is of another study than `other`: what it is called, here and there.
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
        let runs = self.runs.into_iter().map(|Ran { member, outcome }| (member, outcome)).collect();
        shard::Part { name, shard: self.shard, runs }
    }
}

/// A part that was written.
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
