//! Cross-talk and models of the legs, from the records of a plan in a folder.

use std::path::Path;
use std::slice::from_ref;

use specgen_compiler::compile::Compilation;
use specgen_identify::assembled::{Drive, Kind, Plan};
use specgen_identify::cross_talk::of_records;
use specgen_identify::leg_model::{Choice, LegModel, Selection, choose, strokes};
use specgen_identify::rate::RateModel;
use specgen_identify::{DeadTime, Options, Record, error_on, identify, join, predict, write_leg_csv};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::files;
use specgen_language::model::LegModelKind;
use specgen_language::outcome::{Failure, Refusal};
use specgen_language::output::{edit_file, unread_file};
use specgen_language::ui::Ui;
use specgen_numerics::coupled;
use specgen_studies::open_response::OpenResponse;

use super::plan::records;
use super::rows::Rows;
use super::state::{Coupling, Leg, record};

/// Part of the voltage by which a record may differ from its plan.
const PLANNED: f64 = 0.02;

/// What was identified of a leg, and the rms error of its model on the arbitrary record, m.
pub type LegResult = (Choice, Option<f64>);

/// E of the legs that are coupled in their records.
///
/// # Errors
/// A record cannot be read, or is unsuitable.
pub fn cross_talk(folder: &Path, plan: &Plan) -> Result<Coupling, Failure> {
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

/// Identifies the legs, all at once, from the records of `plan` in a folder. `coupling`: E of the legs; `delays`: from the voltage of
/// each leg to its displacement, s.
///
/// # Errors
/// A record cannot be read, or is unsuitable.
pub fn models(
    folder: &Path,
    compiled: &Compilation,
    plan: &Plan,
    (coupling, delays): (&[[f64; 6]; 6], &[f64; 6]),
    kind: LegModelKind,
) -> Result<Vec<LegResult>, Failure> {
    let cells = compiled.model.hysteresis.grid;
    let read = |leg: usize| LegRecords::read(folder, (plan, cells), leg, (coupling, delays[leg]));
    let sets = (0..6).map(read).collect::<Result<Vec<_>, _>>()?;
    let done: Vec<_> = std::thread::scope(|scope| {
        let work: Vec<_> = sets.iter().map(|leg| scope.spawn(move || leg.identify(compiled, kind))).collect();
        work.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
    });
    let each = done.into_iter().enumerate().map(|(leg, found)| {
        // The panic hook has reported where.
        found.map_err(|_| Failure::Environment(format!("the identification of leg {leg} crashed")))?.map_err(refused)
    });
    each.collect()
}

/// Figures of the legs; shows what to know of them, and `writes` their tables, `leg0.csv` to `leg5.csv`, into the folder.
///
/// # Errors
/// A file cannot be written.
pub(super) fn results(
    (folder, writes): (&Path, bool),
    compiled: &Compilation,
    plan: &Plan,
    found: Vec<LegResult>,
    ui: &mut Ui,
) -> Result<Vec<Leg>, Failure> {
    let mut legs = Vec::new();
    for (number, (Choice { family, model, table, scores }, arbitrary_rms)) in found.into_iter().enumerate() {
        let mut warnings = table.warnings;
        // So it is planned for the fast curves.
        warnings.retain(|one| one.code != codes::SWEEP_TOO_FAST);
        ui.findings(None, &warnings);
        let [low, high] = compiled.model.actuator.voltage;
        let stroke = strokes(from_ref(&model.table), from_ref(&model.around));
        let held_out = scores.iter().find(|score| score.family == family).map(|score| score.held_out_rms);
        legs.push(Leg {
            model: family.name(),
            gain: stroke.first().copied().unwrap_or_default() / (high - low),
            fit_rms: held_out.unwrap_or(table.report.fit_rms),
            arbitrary_rms,
            record: records(plan, number).next().map(|drive| format!("{}.csv", drive.name)).unwrap_or_default(),
        });
        if writes {
            // A spec that was commissioned before names it.
            edit_file(&record(folder, &format!("leg{number}")), write_leg_csv(&model).as_bytes())?;
        }
    }
    Ok(legs)
}

/// From the mean voltage of a row to the mean displacement, s: amplifier, modes, gauges, and half a tick until a code is out; as
/// found, or by the spec.
pub(super) fn delay(compiled: &Compilation, response: Option<&OpenResponse>, leg: usize) -> f64 {
    let model = &compiled.model;
    let modes = compiled.design.as_ref().map_or(0.0, |design| design.leg_damping / model.actuator.axial_stiffness);
    let leg = response.map_or(model.amplifier.lag + modes, |found| found.delay_of(leg) + found.modal_delay());
    leg + 0.5 * model.timing.period + model.sensor.lag
}

/// The records of a leg.
struct LegRecords {
    /// The first curves at their nodes, if their rows show them.
    nodes: Option<Record>,
    curves: Vec<Record>,
    arbitrary: Option<Record>,
}

impl LegRecords {
    /// `coupling`: E; from voltage to displacement it takes `delay`, s; `cells` of a table on an axis.
    fn read(
        folder: &Path,
        (plan, cells): (&Plan, usize),
        leg: usize,
        (coupling, delay): (&[[f64; 6]; 6], f64),
    ) -> Result<Self, Failure> {
        let mut all = Self { nodes: None, curves: Vec::new(), arbitrary: None };
        for drive in records(plan, leg) {
            let (read, first) = read_record(&record(folder, &drive.name), drive, (leg, coupling), delay)?;
            let Kind::Curves { grid, .. } = drive.kind else {
                all.arbitrary = Some(read);
                continue;
            };
            // Between their nodes fewer curves show nothing.
            if all.curves.is_empty()
                && grid.is_multiple_of(cells)
                && let Some([time, volts, displacement]) = drive.nodes(first, &read.displacement, delay, plan.mains)
            {
                let nodes = Record::from_columns(&read.shown_as, time, volts, displacement);
                all.nodes = Some(nodes.map_err(refused)?);
            }
            all.curves.push(read);
        }
        Ok(all)
    }

    fn identify(&self, compiled: &Compilation, kind: LegModelKind) -> Result<LegResult, Vec<Diagnostic>> {
        let drive = compiled.model.actuator.voltage;
        let options =
            Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(compiled.model.hysteresis.grid, drive) };
        let joined = join(&self.curves, drive)?;
        let error = self.arbitrary.as_ref().map(error_on);
        let mut choice = choose(&joined, error.as_ref().map(|error| error as &Selection<'_>), &options, kind)?;
        // A table alone has one rate: that of the first curves.
        if let Some(nodes) = self.nodes.as_ref().filter(|_| choice.model.around.is_none()) {
            choice.table = identify(nodes, &options)?;
            choice.model.table = choice.table.table.clone();
        }
        let arbitrary = self.arbitrary.as_ref().map(|record| error_of(&choice.model, record)).transpose()?;
        Ok((choice, arbitrary))
    }
}

/// The record of a drive, and the tick of the wave with which it begins. The displacement of the leg is that of (I + E) l. Its
/// drive is the voltage of the wave behind the lag, without the error of sampling.
fn read_record(
    path: &Path,
    drive: &Drive,
    (leg, coupling): (usize, &[[f64; 6]; 6]),
    delay: f64,
) -> Result<(Record, f64), Failure> {
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
    let own = |row: usize| coupled(Some(coupling), legs.map(|leg| leg[row]))[leg];
    let displacement = (0..time.len()).map(own).collect();
    let record = Record::from_columns(&path.display().to_string(), time, drive, displacement).map_err(refused)?;
    Ok((record, first))
}

fn error_of(model: &LegModel, record: &Record) -> Result<f64, Vec<Diagnostic>> {
    Ok(predict(&RateModel::of_leg(model.clone()), &record.into())?.compared.map_or(0.0, |compared| compared.rms))
}

fn refused(findings: Vec<Diagnostic>) -> Failure {
    Refusal { source: None, findings }.into()
}
