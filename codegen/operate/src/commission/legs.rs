//! Cross-talk and models of the legs, from their records in the folder.

use std::path::Path;
use std::slice::from_ref;

use specgen_compiler::compile::Compilation;
use specgen_identify::assembled::{Drive, Kind, Plan};
use specgen_identify::cross_talk::of_records;
use specgen_identify::leg_model::{Choice, LegModel, Selection, choose, strokes};
use specgen_identify::rate::RateModel;
use specgen_identify::{DeadTime, Options, Record, error_on, join, predict, write_leg_csv};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::files;
use specgen_language::model::LegModelKind;
use specgen_language::outcome::{Failure, Refusal};
use specgen_language::output::{edit_file, unread_file};
use specgen_language::ui::Ui;

use super::plan::records;
use super::rows::Rows;
use super::state::{Coupling, Leg, record};

/// Part of the voltage by which a record may differ from its plan.
const PLANNED: f64 = 0.02;

/// E of the legs that are coupled in their records.
///
/// # Errors
/// A record cannot be read, or is unsuitable.
pub(super) fn cross_talk(folder: &Path, plan: &Plan) -> Result<Coupling, Failure> {
    let mut texts: [(String, String); 6] = Default::default();
    let drives = plan.drives.iter().filter(|drive| drive.kind == Kind::CrossTalk);
    for ((shown, text), drive) in texts.iter_mut().zip(drives) {
        let path = record(folder, &drive.name);
        *text = files::text(&path).map_err(|unread| unread_file(&path, &unread))?;
        *shown = path.display().to_string();
    }
    let found = of_records(&texts).map_err(refused)?;
    Ok(Coupling { matrix: found.matrix, error: found.error })
}

/// Identifies the legs, all at once, from the records of `plan`, and writes the table of each, `leg0.csv` to `leg5.csv`. `coupling`:
/// E of the legs.
///
/// # Errors
/// A record cannot be read, or is unsuitable; a file cannot be written.
pub(super) fn identify(
    folder: &Path,
    compiled: &Compilation,
    plan: &Plan,
    coupling: &[[f64; 6]; 6],
    kind: LegModelKind,
    ui: &mut Ui,
) -> Result<Vec<Leg>, Failure> {
    let delay = delay(compiled);
    let read = |leg: usize| LegRecords::read(folder, plan, leg, &coupling[leg], delay);
    let sets = (0..6).map(read).collect::<Result<Vec<_>, _>>()?;
    let done = ui.during("identifying the legs", || {
        std::thread::scope(|scope| {
            let work: Vec<_> = sets.iter().map(|leg| scope.spawn(move || leg.identify(compiled, kind))).collect();
            work.into_iter().map(std::thread::ScopedJoinHandle::join).collect::<Vec<_>>()
        })
    });
    let (mut legs, mut tables) = (Vec::new(), Vec::new());
    for (number, (found, set)) in done.into_iter().zip(&sets).enumerate() {
        // The panic hook has reported where.
        let found = found.map_err(|_| Failure::Environment(format!("the identification of leg {number} crashed")))?;
        let Choice { family, model, table, scores } = found.map_err(refused)?;
        let mut warnings = table.warnings;
        // So it is planned for the fast curves.
        warnings.retain(|one| one.code != codes::SWEEP_TOO_FAST);
        ui.findings(None, &warnings);
        tables.push(write_leg_csv(&model));
        let [low, high] = compiled.model.actuator.voltage;
        let stroke = strokes(from_ref(&model.table), from_ref(&model.around));
        let held_out = scores.iter().find(|score| score.family == family).map(|score| score.held_out_rms);
        let predicted = set.arbitrary.as_ref().map(|record| error_of(&model, record));
        legs.push(Leg {
            model: family.name(),
            gain: stroke.first().copied().unwrap_or_default() / (high - low),
            fit_rms: held_out.unwrap_or(table.report.fit_rms),
            arbitrary_rms: predicted.transpose().map_err(refused)?,
            record: records(plan, number).next().map(|drive| format!("{}.csv", drive.name)).unwrap_or_default(),
        });
    }
    for (number, table) in tables.iter().enumerate() {
        // A spec that was commissioned before names it.
        edit_file(&record(folder, &format!("leg{number}")), table.as_bytes())?;
    }
    Ok(legs)
}

/// From the mean voltage of a row to the mean displacement: amplifier, modes, gauges, and half a tick until a code is out.
fn delay(compiled: &Compilation) -> f64 {
    let model = &compiled.model;
    let modes = compiled.design.as_ref().map_or(0.0, |design| design.leg_damping / model.actuator.axial_stiffness);
    model.amplifier.lag + modes + 0.5 * model.timing.period + model.sensor.lag
}

/// The records of a leg.
struct LegRecords {
    curves: Vec<Record>,
    arbitrary: Option<Record>,
}

impl LegRecords {
    /// `coupling`: the row of E of this leg.
    fn read(folder: &Path, plan: &Plan, leg: usize, coupling: &[f64; 6], delay: f64) -> Result<Self, Failure> {
        let mut all = Self { curves: Vec::new(), arbitrary: None };
        for drive in records(plan, leg) {
            let read = read_record(&record(folder, &drive.name), drive, (leg, coupling), delay)?;
            match drive.kind {
                Kind::Arbitrary { .. } => all.arbitrary = Some(read),
                _ => all.curves.push(read),
            }
        }
        Ok(all)
    }

    fn identify(&self, compiled: &Compilation, kind: LegModelKind) -> Result<Choice, Vec<Diagnostic>> {
        let drive = compiled.model.actuator.voltage;
        let options =
            Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(compiled.model.hysteresis.grid, drive) };
        let joined = join(&self.curves, drive)?;
        let error = self.arbitrary.as_ref().map(error_on);
        choose(&joined, error.as_ref().map(|error| error as &Selection<'_>), &options, kind)
    }
}

/// The displacement of the leg is l + E l. Its drive is the voltage of the wave behind the lag, without the error of sampling.
fn read_record(path: &Path, drive: &Drive, (leg, coupling): (usize, &[f64; 6]), delay: f64) -> Result<Record, Failure> {
    let rows = Rows::read(path)?;
    let (time, legs) = (rows.time()?, rows.legs()?);
    let planned = f64::from(drive.average);
    if let Some(ticks) = rows.column("ticks")?.iter().find(|ticks| **ticks != planned) {
        let shown = path.display();
        return Err(Failure::Gate(format!(
            "{shown}: rows of {ticks} ticks, {planned} were planned; use a faster line"
        )));
    }
    let volts = rows.column(&format!("volts[{leg}]_mean_V"))?;
    let first = drive.first_tick(volts);
    let most = PLANNED * (drive.range[1] - drive.range[0]);
    let same = |(planned, measured): (&f64, &f64)| (planned - measured).abs() <= most;
    if !drive.rows(first, volts.len(), 0.0).iter().zip(volts).all(same) {
        let shown = path.display();
        return Err(Failure::Gate(format!("{shown} does not have the voltages that were planned; record it again")));
    }
    let drive = drive.rows(first, volts.len(), delay);
    let own = |row: usize| (0..6).fold(legs[leg][row], |sum, other| sum + coupling[other] * legs[other][row]);
    let displacement = (0..time.len()).map(own).collect();
    Record::from_columns(&path.display().to_string(), time, drive, displacement).map_err(refused)
}

fn error_of(model: &LegModel, record: &Record) -> Result<f64, Vec<Diagnostic>> {
    Ok(predict(&RateModel::of_leg(model.clone()), &record.into())?.compared.map_or(0.0, |compared| compared.rms))
}

fn refused(findings: Vec<Diagnostic>) -> Failure {
    Refusal { source: None, findings }.into()
}
