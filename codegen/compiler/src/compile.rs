//! The compiler as one function: spec file to the files of a workspace. Touches no output.

use std::collections::BTreeMap;
use std::path::Path;

use crate::emit;
use crate::ir::{Ir, Setpoints};
use crate::lint::{self, paths::PathDemand};
use crate::lower::setpoint::{self, Stopping};
use crate::lower::{PoseNoise, lower, platform, pose_noise, scalar};
use crate::reach::{self, Reach};
use crate::stability::platform::{Design, RestDynamics};
use crate::stability::{self, Margins};
use crate::{requirements, workspace};
use specgen_identify as identify;
use specgen_identify::everett::EverettTable;
use specgen_identify::waveform;
use specgen_language::diagnostic::{Diagnostic, Place, Severity, codes};
use specgen_language::model::{Model, RateDependence, TrajectoryKind};
use specgen_language::spec::{self, SpecSource};

/// Displacement of a record against that of stack gain and voltage: creep and a rough data sheet explain less than this
/// factor, a wrong unit is 1000.
const LARGEST_SCALE: f64 = 5.0;

/// A spec that compiled.
#[derive(Debug)]
pub struct Compiled {
    /// The file as read.
    pub source: SpecSource,
    /// What it says.
    pub model: Model,
    /// How each record was identified, in the order of `hysteresis.records`; none for one that is a table already.
    pub records: Vec<Option<identify::Report>>,
    /// Stability of the adaptation of six legs with their own gauges.
    pub margins: Option<Margins>,
    /// Modes, tuning and margins of a controller in task space.
    pub design: Option<Design>,
    /// Travel of the platform, and how well its legs hold it, for a controller in task space.
    pub reach: Option<Reach>,
    /// What each trajectory asks of the legs, in the order of the spec.
    pub demands: Vec<PathDemand>,
    /// How far stops go, from every declared speed.
    pub stops: Vec<Stopping>,
    /// Noise of the measured pose, with gauges that see the platform.
    pub pose_noise: Option<PoseNoise>,
    /// Every constant of the controller.
    pub ir: Ir,
    /// Files of the workspace: path, text.
    pub files: BTreeMap<String, String>,
    /// Warnings and notes.
    pub findings: Vec<Diagnostic>,
}

/// A spec that was refused: at least one finding is an error.
#[derive(Debug)]
pub struct Refused {
    /// The file, if it could be read.
    pub source: Option<SpecSource>,
    /// All findings of the run.
    pub findings: Vec<Diagnostic>,
}

/// Everything short of writing: reads, checks, identifies, lowers, emits.
///
/// # Errors
/// The spec or a record is refused. Later phases run only on what earlier ones accepted, so a second run may find more.
pub fn compile(path: &Path) -> Result<Compiled, Refused> {
    compile_source(SpecSource::read(path).map_err(|finding| Refused { source: None, findings: vec![finding] })?)
}

/// The same for a text at hand.
///
/// # Errors
/// As [`compile`].
pub fn compile_source(source: SpecSource) -> Result<Compiled, Refused> {
    let (model, mut findings) = spec::load_as_far(&source);
    findings.extend(model.as_ref().map(lint::check).unwrap_or_default());
    let Some(model) = model else {
        return Err(Refused { source: Some(source), findings });
    };
    if findings.iter().any(|finding| finding.severity == Severity::Error) {
        // What the paths are is in the file whatever the platform: say it in the same run.
        findings.extend(lower_setpoints(&source, &model).map_or_else(|found| found, |lowered| lowered.warnings));
        return Err(Refused { source: Some(source), findings });
    }
    // Stability and records do not depend on each other: report both.
    let stability = check_stability(&model).map_err(|found| findings.extend(found));
    let identified = identify_records(&source, &model).map_err(|found| findings.extend(found));
    let setpoints = lower_setpoints(&source, &model).map_err(|found| findings.extend(found));
    let too_coarse = requirements::check(&model);
    let coarse = !too_coarse.is_empty();
    findings.extend(too_coarse);
    let (Ok((margins, design)), Ok(mut identified), Ok(setpoints), false) = (stability, identified, setpoints, coarse)
    else {
        return Err(Refused { source: Some(source), findings });
    };
    findings.extend(identified.findings);
    findings.extend(design.iter().flat_map(|design| design.findings.clone()));
    findings.extend(setpoints.warnings.iter().cloned());
    identified.texts.extend(setpoints.texts.iter().cloned());
    let (reach, demands, stops) = match check_reach(&model, &setpoints, &identified.tables) {
        Ok(Reached { reach, demands, stops, findings: found }) => {
            findings.extend(found);
            (reach, demands, stops)
        }
        Err(found) => {
            findings.extend(found);
            return Err(Refused { source: Some(source), findings });
        }
    };
    let task = design.as_ref().zip(setpoints.setpoints);
    let lowered = lower(&model, task, &identified.tables, &identified.rate_tables, &digest(&source, &identified.texts));
    let (ir, pose_noise) = match lowered.and_then(|ir| Ok((ir, pose_noise(&model)?))) {
        Ok(both) => both,
        Err(found) => {
            findings.extend(found);
            return Err(Refused { source: Some(source), findings });
        }
    };
    let files = workspace::files(&ir, &emit::emit(&ir));
    debug_assert!(findings.iter().all(|finding| finding.severity < Severity::Error));
    Ok(Compiled {
        source,
        model,
        records: identified.reports,
        margins,
        design,
        reach,
        demands,
        stops,
        pose_noise,
        ir,
        files,
        findings,
    })
}

/// Legs with their own gauges adapt each on its own; a controller in task space closes its loops over the platform's modes.
pub fn check_stability(model: &Model) -> Result<(Option<Margins>, Option<Design>), Vec<Diagnostic>> {
    match &model.task_space {
        None => stability::check(model).map(|margins| (Some(margins), None)),
        Some(task) => {
            let rest = RestDynamics::of(&platform(model)?);
            stability::platform::design(model, task, &rest).map(|design| (None, Some(design)))
        }
    }
}

/// What the legs reach and make.
struct Reached {
    reach: Option<Reach>,
    /// What each trajectory asks of the legs.
    demands: Vec<PathDemand>,
    stops: Vec<Stopping>,
    /// Warnings.
    findings: Vec<Diagnostic>,
}

/// Where the legs reach, and that trajectories and stops stay there: as far as both the data sheet's stroke and every leg's
/// table allow. And that stacks and amplifiers make them.
fn check_reach(model: &Model, lowered: &LoweredSetpoints, tables: &[EverettTable]) -> Result<Reached, Vec<Diagnostic>> {
    let largest = tables.iter().map(|table| table.node(table.grid, 0));
    let stroke = largest.fold(model.actuator.stroke, |a, b| if b < a { b } else { a });
    let (Some(task), Some(setpoints)) = (&model.task_space, &lowered.setpoints) else {
        // Legs may be driven one by one where they do not hold a platform: then there is no pose to look at.
        let legs = platform(model).ok().map(|platform| reach::check_legs(model, &platform, stroke));
        let (reach, found) = legs.map_or_else(|| (None, Vec::new()), |(reach, found)| (Some(reach), found));
        return Ok(Reached { reach, demands: Vec::new(), stops: Vec::new(), findings: found });
    };
    let platform = platform(model)?;
    let mut errors = Vec::new();
    let reach = reach::check(model, task, &platform, stroke).map_err(|found| errors.extend(found));
    let paths = setpoint::stretches(model, task, setpoints)?;
    let (demands, asked) = lint::paths::check(model, task, &platform, &paths);
    for (index, path) in paths.iter().enumerate() {
        let key = format!("trajectory[{index}].kind");
        let name = &task.trajectories[index].name;
        let poses = path.iter().flat_map(|stretch| stretch.poses.iter().copied());
        if let Err(found) = reach::check_poses(model, &platform, stroke, [&key, name], poses) {
            errors.extend(found);
        }
    }
    let stops = setpoint::check_stops(model, task, setpoints, &platform, stroke);
    let stops = stops.unwrap_or_else(|found| {
        errors.extend(found);
        Vec::new()
    });
    let refused = !errors.is_empty() || asked.iter().any(|finding| finding.severity == Severity::Error);
    match reach {
        Ok((reach, mut found)) if !refused => {
            found.extend(asked);
            Ok(Reached { reach: Some(reach), demands, stops, findings: found })
        }
        _ => Err(errors.into_iter().chain(asked).collect()),
    }
}

/// What set-points yield.
#[derive(Default)]
struct LoweredSetpoints {
    setpoints: Option<Setpoints>,
    warnings: Vec<Diagnostic>,
    /// Name and text of each table of poses, for the digest.
    texts: Vec<(String, String)>,
}

fn lower_setpoints(source: &SpecSource, model: &Model) -> Result<LoweredSetpoints, Vec<Diagnostic>> {
    let Some(task) = &model.task_space else { return Ok(LoweredSetpoints::default()) };
    let mut texts = Vec::new();
    let mut errors = Vec::new();
    let mut waveforms = Vec::new();
    for trajectory in &task.trajectories {
        let TrajectoryKind::Waveform { file, period, .. } = &trajectory.kind else {
            waveforms.push(None);
            continue;
        };
        let read = waveform::read_file(&source.dir.join(file), file);
        let parsed = read.and_then(|text| {
            let parsed = waveform::parse(&text, file, *period);
            texts.push((file.clone(), text));
            parsed
        });
        waveforms.push(parsed.map_err(|found| errors.extend(found)).ok());
    }
    let stepping: Vec<Diagnostic> = waveforms.iter().flatten().filter_map(lint::paths::steps).collect();
    match setpoint::lower(model, task, &waveforms, scalar(model)) {
        Ok((setpoints, mut warnings)) if errors.is_empty() => {
            warnings.extend(stepping);
            Ok(LoweredSetpoints { setpoints: Some(setpoints), warnings, texts })
        }
        Ok((_, warnings)) => Err(errors.into_iter().chain(warnings).chain(stepping).collect()),
        Err(found) => Err(errors.into_iter().chain(found).chain(stepping).collect()),
    }
}

/// What the records of a spec yield.
struct IdentifiedRecords {
    tables: Vec<EverettTable>,
    /// Of the second weight, m s/V.
    rate_tables: Vec<EverettTable>,
    reports: Vec<Option<identify::Report>>,
    findings: Vec<Diagnostic>,
    /// Name and text of each file, for the digest.
    texts: Vec<(String, String)>,
}

fn identify_records(source: &SpecSource, model: &Model) -> Result<IdentifiedRecords, Vec<Diagnostic>> {
    let mut result = IdentifiedRecords {
        tables: Vec::new(),
        rate_tables: Vec::new(),
        reports: Vec::new(),
        findings: Vec::new(),
        texts: Vec::new(),
    };
    let mut errors = Vec::new();
    for name in &model.hysteresis.records {
        let text = match identify::read_file(&source.dir.join(name), name) {
            Ok(text) => text,
            Err(found) => {
                errors.extend(found);
                continue;
            }
        };
        let one = if identify::is_table_csv(&text) {
            read_table(model, name, &text).map(|table| (table, None, Vec::new()))
        } else {
            identify_record(model, name, &text).map(|found| (found.table, Some(found.report), found.warnings))
        };
        match one {
            Ok((table, report, warnings)) => {
                errors.extend(wrong_scale(model, name, &table));
                if report.is_some() && matches!(model.hysteresis.rate, RateDependence::Creep(_)) {
                    result.findings.push(static_table_with_creep(model, name));
                }
                result.tables.push(table);
                result.reports.push(report);
                result.findings.extend(warnings);
            }
            Err(found) => errors.extend(found),
        }
        result.texts.push((name.clone(), text));
    }
    if let RateDependence::DynamicPreisach(files) = &model.hysteresis.rate {
        for name in files {
            let read = identify::read_file(&source.dir.join(name), name).and_then(|text| {
                let table = identify::rate::read_rate_csv(&text, name)?;
                result.texts.push((name.clone(), text));
                fits_spec(model, name, &table, codes::RATE_TABLE_MISMATCH, "hysteresis.rate_tables")?;
                Ok(table)
            });
            match read {
                Ok(table) => result.rate_tables.push(table),
                Err(found) => errors.extend(found),
            }
        }
        result.findings.push(rate_not_in_stability(model));
    }
    if errors.is_empty() {
        Ok(result)
    } else {
        errors.extend(result.findings);
        Err(errors)
    }
}

fn identify_record(model: &Model, name: &str, text: &str) -> Result<identify::Identified, Vec<Diagnostic>> {
    let options = identify::Options::new(model.hysteresis.grid, model.actuator.voltage);
    identify::identify(&identify::parse_record(text, name)?, &options)
}

/// A displacement that stack gain and voltage do not explain is one in another unit, and the controller would be off by it.
fn wrong_scale(model: &Model, name: &str, table: &EverettTable) -> Option<Diagnostic> {
    let [min, max] = model.actuator.voltage;
    let expected = model.actuator.leg_gain() * (max - min);
    let found = table.node(table.grid, 0);
    if (expected / LARGEST_SCALE..=expected * LARGEST_SCALE).contains(&found) {
        return None;
    }
    Some(Diagnostic {
        severity: Severity::Error,
        code: codes::RECORD_SCALE,
        key: "hysteresis.records".to_owned(),
        place: Place::File { path: name.to_owned(), line: None },
        message: format!(
            "the record moves by {:.4} µm over {min} V to {max} V; {} stacks of {} m/V give {:.4} µm",
            found * 1e6,
            model.actuator.stacks,
            model.actuator.stack_gain,
            expected * 1e6
        ),
        help: "check that the displacement is in µm, or fix actuator.stacks and actuator.stack_gain".to_owned(),
    })
}

/// A table that `specgen identify` wrote: it must be of the grid and the voltage range that the spec declares.
fn read_table(model: &Model, name: &str, text: &str) -> Result<EverettTable, Vec<Diagnostic>> {
    let table = identify::read_table_csv(text, name)?;
    fits_spec(model, name, &table, codes::TABLE_MISMATCH, "hysteresis.records")?;
    Ok(table)
}

/// The check of the adaptation knows the static inverse only.
fn rate_not_in_stability(model: &Model) -> Diagnostic {
    let key = "hysteresis.rate";
    Diagnostic {
        severity: Severity::Warning,
        code: codes::RATE_NOT_IN_STABILITY,
        key: key.to_owned(),
        place: model.spans.get(key).cloned().map_or(Place::Whole, Place::Spec),
        message: "the stability of the adaptation was checked without the rate term of (6)".to_owned(),
        help: format!(
            "its inverse at most doubles the gain of fast corrections: let gain_ratio reach twice its upper end ({}), or simulate",
            2.0 * model.adaptation.gain_ratio[1]
        ),
    }
}

fn static_table_with_creep(model: &Model, record: &str) -> Diagnostic {
    let key = "hysteresis.records";
    Diagnostic {
        severity: Severity::Warning,
        code: codes::STATIC_TABLE_WITH_CREEP,
        key: key.to_owned(),
        place: model.spans.get(key).cloned().map_or(Place::Whole, Place::Spec),
        message: format!(
            "the table of `{record}` is fitted without creep, and the creep that is in it is compensated once more"
        ),
        help: "name the table that `specgen identify rate SLOW.csv FAST.csv -o NAME` writes to NAME-creep.csv"
            .to_owned(),
    }
}

/// Refuses a table of another grid or range than the spec's.
fn fits_spec(
    model: &Model,
    name: &str,
    table: &EverettTable,
    code: &'static str,
    key: &str,
) -> Result<(), Vec<Diagnostic>> {
    let [min, max] = model.actuator.voltage;
    let slack = 1e-9 * (max - min);
    let fits = (table.drive_min - min).abs() <= slack && (table.drive_max - max).abs() <= slack;
    if table.grid == model.hysteresis.grid && fits {
        return Ok(());
    }
    Err(vec![Diagnostic {
        severity: Severity::Error,
        code,
        key: key.to_owned(),
        place: Place::File { path: name.to_owned(), line: None },
        message: format!(
            "the table has {} cells over {} V to {} V; the spec declares {} cells (hysteresis.grid) over {min} V to {max} V (actuator.voltage)",
            table.grid, table.drive_min, table.drive_max, model.hysteresis.grid
        ),
        help: format!("identify the record again with --grid {} --drive {min}:{max}", model.hysteresis.grid),
    }])
}

/// Digest of what the controller depends on: the text of the spec (line ends as `\n`) and the records by name and content.
/// Not the folder it lies in.
fn digest(source: &SpecSource, records: &[(String, String)]) -> String {
    let mut all = source.text.replace("\r\n", "\n").into_bytes();
    for (name, text) in records {
        all.push(0);
        all.extend(name.as_bytes());
        all.push(0);
        all.extend(specgen_toolchain::sha256(text.as_bytes()).as_bytes());
    }
    specgen_toolchain::sha256(&all)
}
