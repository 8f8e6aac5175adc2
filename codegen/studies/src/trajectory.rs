//! Trajectories by the names that a user gives.

use host_sim::trajectory::{PaperPath, Step};

use crate::lead::streamed;
use crate::tuning::TrajectoryChoice;
use specgen_compiler::compile::Compilation;
use specgen_language::model::TrajectoryKind;
use specgen_language::outcome::Failure;
use specgen_language::shell;

/// Default operating frequency, Hz.
const FREQUENCY: f64 = 10.0;
/// Length of the multisine, s.
const SECONDS: f64 = 1.0;

/// A trajectory and its name.
pub struct NamedTrajectory {
    /// Name given by the user.
    pub name: String,
    /// Hz.
    pub frequency: f64,
    /// What to run.
    pub choice: TrajectoryChoice,
}

/// The trajectory selected by `--trajectory` and `--frequency`.
///
/// A name refers to the spec's own path if it has one, at that path's own frequency by default. Otherwise the paper's names refer to
/// the paper's paths at the default frequency.
///
/// # Errors
/// There is no trajectory with that name.
pub fn chosen(
    trajectory: Option<&str>,
    frequency: Option<f64>,
    seed: u64,
    compiled: &Compilation,
) -> Result<NamedTrajectory, Failure> {
    let platform = compiled.model.task_space.as_ref();
    let asked = frequency;
    let frequency = asked.unwrap_or(FREQUENCY);
    let name = trajectory.unwrap_or(if platform.is_some() { "case-1" } else { "leg" });
    let followed = |frequency, choice| Ok(NamedTrajectory { name: name.to_owned(), frequency, choice });
    let paper = |path, frequency| followed(frequency, TrajectoryChoice::Paper { path, frequency });
    let own = platform.and_then(|task| task.trajectories.iter().find(|one| one.name == name));
    if let (Some(own), Some(_)) = (own, trajectory) {
        return match own.kind {
            TrajectoryKind::Paper { path, as_printed: false, frequency } => {
                paper(streamed(path), asked.unwrap_or(frequency))
            }
            TrajectoryKind::Step { to, time } => {
                let time = asked.map_or(time, |hertz| 1.0 / hertz);
                followed(1.0 / time, TrajectoryChoice::Step(Step { to, time }))
            }
            _ => Err(Failure::Usage(format!(
                "the spec's trajectory `{name}` is a waveform or an uncorrected printed path, which this command does not support; choose \
                 another, or play it once with `{}`",
                shell::line("specgen sim SPEC --trajectory").word(name)
            ))),
        };
    }
    let sines = TrajectoryChoice::Multisine { frequency, seconds: SECONDS, seed, corners: false };
    match (name, platform) {
        ("multisine", _) => followed(frequency, sines),
        ("leg", None) | ("case-1", Some(_)) => paper(PaperPath::Case1, frequency),
        ("case-2", Some(_)) => paper(PaperPath::Case2, frequency),
        ("machining", Some(_)) => paper(PaperPath::Machining, frequency),
        _ => {
            let mut known = match platform {
                Some(_) => vec!["case-1", "case-2", "machining", "multisine"],
                None => vec!["leg", "multisine"],
            };
            for one in platform.iter().flat_map(|task| &task.trajectories) {
                if !known.contains(&one.name.as_str()) {
                    known.push(&one.name);
                }
            }
            let add = if platform.is_some() { ", or add a [[trajectory]] to the spec" } else { "" };
            Err(Failure::Usage(format!(
                "this spec has no trajectory `{name}`; choose one of {}{add}",
                known.join(", ")
            )))
        }
    }
}
