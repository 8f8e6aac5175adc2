//! The records in a spec: each is identified, or used as the table that it is, and compared with the spec.

use std::path::Path;

use crate::everett::EverettTable;
use crate::leg_model::{Around, Family, FamilyScore, LegModel, choose, on_grid};
use crate::mode::Mode;
use crate::rate::period::{INVERTED, Invertible};
use crate::rate::{CreepTerm, Inertia, RateModel};
use crate::reading::Reading;
use crate::record::parse_record_as;
use crate::{Options, Report, is_simulated, is_table_csv, rate, read_file, read_leg_csv};
use specgen_language::diagnostic::{Code, Diagnostic, Place, codes};
use specgen_language::model::{Actuator, Hysteresis, MAX_GRID, Mcu, Model, RateDependence, Scalar};
use specgen_language::spec::LegLines;

/// Largest ratio of a record's displacement to that of stack gain and voltage: creep and a rough data sheet explain
/// less than this, a wrong unit gives 1000.
const LARGEST_SCALE: f64 = 5.0;

const ONLY_TABLES: &str = "the legs have a leg model, and this command uses tables only: write hysteresis.model = \"preisach\" for it, or name tables without a leg model";

/// Tables and reports of a spec's records.
#[derive(Debug, Default)]
pub struct SpecRecords {
    /// The table of each record, in the order of `hysteresis.records`.
    pub tables: Vec<EverettTable>,
    /// What is around each of them, if anything.
    pub around: Vec<Option<Around>>,
    /// The choice of a leg model for each record that was fitted with `hysteresis.model`.
    pub choices: Vec<(String, Family, Vec<FamilyScore>)>,
    /// The tables of the second weight of (6), m s/V, in the order of `hysteresis.rate_tables`.
    pub rate_tables: Vec<EverettTable>,
    /// Report of each identification; none for a record that is a table already.
    pub reports: Vec<Option<Report>>,
    /// Records and rate tables that are marked as simulated, in their order.
    pub simulated: Vec<String>,
    /// Warnings; nothing is refused because of them.
    pub warnings: Vec<Diagnostic>,
    /// Name and text of each file that was read.
    pub texts: Vec<(String, String)>,
}

/// Reads and identifies every record that `model` names; file names are relative to `dir`.
///
/// # Errors
/// All findings, if a record cannot be read or identified, or contradicts the spec's grid, voltages or stack gain.
pub fn records(model: &Model, dir: &Path) -> Result<SpecRecords, Vec<Diagnostic>> {
    let mut all = SpecRecords::default();
    let mut errors = Vec::new();
    for name in &model.hysteresis.records {
        let added = read_file(&dir.join(name), name).and_then(|text| all.add_record(model, name, text));
        errors.extend(added.err().unwrap_or_default());
    }
    if let RateDependence::DynamicPreisach(files) = &model.hysteresis.rate {
        for name in files {
            let added = read_file(&dir.join(name), name).and_then(|text| all.add_rate_table(model, name, text));
            errors.extend(added.err().unwrap_or_default());
        }
        all.warnings.push(rate_not_in_stability(model));
        errors.extend(all.not_invertible(model));
    }
    if errors.is_empty() {
        let grid = all.grid(model.hysteresis.grid);
        all.tables.iter_mut().filter(|table| table.grid < grid).for_each(|table| *table = on_grid(table, grid));
        all.take_plays_of_some();
        return Ok(all);
    }
    errors.extend(all.warnings);
    Err(errors)
}

/// The finest grid that a leg model may choose: that of the spec if it gives one or is for a board, whose fast memory holds
/// no larger tables of six legs; otherwise with tables in at most half of the flash.
fn finest(model: &Model) -> usize {
    let Hysteresis { grid, records, .. } = &model.hysteresis;
    // A default value has the place of its section.
    let given = model.spans.get("hysteresis.grid") != model.spans.get("hysteresis");
    if given || matches!(model.target.mcu, Mcu::Board(_)) {
        return *grid;
    }
    let scalar = if model.controller.scalar == Scalar::F32 { 4 } else { 8 };
    let bytes = |grid: usize| (scalar * records.len() * (grid + 1) * (grid + 2) / 2) as u64;
    let fits = |grid: &usize| model.target.budget.flash.is_none_or(|flash| 2 * bytes(*grid) <= flash);
    let doubles = core::iter::successors(Some(2 * grid), |grid| Some(2 * grid));
    doubles.take_while(|grid| *grid <= MAX_GRID && fits(grid)).last().unwrap_or(*grid)
}

impl SpecRecords {
    /// A straight line in place of the records, if the legs of `model` are not identified.
    pub fn complete(&mut self, model: &Model) {
        if !model.hysteresis.is_identified() {
            let (grid, Actuator { voltage, stroke, .. }) = (model.hysteresis.grid, &model.actuator);
            self.tables.push(EverettTable::straight(grid, *voltage, *stroke));
            self.around.push(None);
            self.warnings.push(not_identified(model));
        }
    }

    /// N of its tables, `least` if there is none.
    #[must_use]
    pub fn grid(&self, least: usize) -> usize {
        self.tables.iter().fold(least, |most, table| if table.grid > most { table.grid } else { most })
    }

    /// The model of `leg`, 0 to 5, as in `model`; its dead time counts from the voltage. None without records.
    #[must_use]
    pub fn leg(&self, model: &Model, leg: usize) -> Option<RateModel> {
        let of = |tables: &[EverettTable]| tables.get(leg).or(tables.first()).cloned();
        let mode = Some((mode_of(model), model.actuator.resonance_gain));
        let around = self.around.get(leg).or(self.around.first()).cloned().flatten();
        let found = LegModel { table: of(&self.tables)?, around };
        Some(of_tables(&model.hysteresis, found, of(&self.rate_tables), mode))
    }

    /// For a command that uses tables only.
    ///
    /// # Errors
    /// If a leg has more around its table.
    pub fn tables_only(&self) -> Result<(), &'static str> {
        match self.around.iter().any(Option::is_some) {
            true => Err(ONLY_TABLES),
            false => Ok(()),
        }
    }

    /// Refuses a period so short that most ticks would use the static inverse: that is not the controller in the spec.
    fn not_invertible(&self, model: &Model) -> Option<Diagnostic> {
        let pairs = (0..6).filter_map(|leg| {
            let of = |tables: &[EverettTable]| tables.get(leg).or(tables.first()).cloned();
            Some(Invertible::of(&of(&self.tables)?, &of(&self.rate_tables)?))
        });
        let worst = pairs.reduce(|a, b| if b.period() > a.period() { b } else { a })?;
        let period = model.timing.period;
        let share = worst.share(period);
        (share < INVERTED).then(|| not_invertible(model, share, worst.period()))
    }

    /// Takes the tables at rest in place of plays that not all legs have: a controller has one kind of memory.
    fn take_plays_of_some(&mut self) {
        let widens = |around: &Option<Around>| around.as_ref().is_some_and(|around| around.plays.is_some());
        let with: Vec<&str> = self
            .around
            .iter()
            .zip(&self.texts)
            .filter(|(own, _)| widens(own))
            .map(|(_, (name, _))| name.as_str())
            .collect();
        if with.is_empty() || with.len() == self.around.len() {
            return;
        }
        let message =
            format!("plays that widen with the rate in {} only: the table at rest is used there", with.join(", "));
        let help = "identify those legs again with --model generalized-plays, or name one file for all six";
        let place = Place::File { path: with[0].to_owned(), line: None };
        self.warnings.push(Diagnostic::new(
            codes::PLAYS_OF_SOME_LEGS,
            "hysteresis.records",
            place,
            message,
            help.to_owned(),
        ));
        self.around.iter_mut().flatten().for_each(|around| around.plays = None);
    }

    fn add_record(&mut self, model: &Model, name: &str, text: String) -> Result<(), Vec<Diagnostic>> {
        let found = if is_table_csv(&text) {
            let found = read_leg_csv(&text, name)?;
            let table = &found.table;
            fits_spec(model, name, table, codes::TABLE_MISMATCH, "hysteresis.records")?;
            self.reports.push(None);
            found
        } else {
            let options = Options::new(model.hysteresis.grid, model.actuator.voltage);
            let options = Options { finest: finest(model), ..options };
            let reading = Reading::of_key(model.hysteresis.columns.as_deref(), name, codes::RECORD_HEADER)?;
            let record = parse_record_as(&text, name, &reading)?;
            let choice = choose(&record, None, &options, model.hysteresis.model).map_err(about_voltage)?;
            let identified = choice.table;
            if matches!(model.hysteresis.rate, RateDependence::Creep(_)) {
                self.warnings.push(static_table_with_creep(model, name));
            }
            self.warnings.extend(identified.warnings);
            self.warnings.extend(faster_than_amplifier(model, name, identified.report.fastest));
            self.reports.push(Some(identified.report));
            if !choice.scores.is_empty() {
                self.choices.push((name.to_owned(), choice.family, choice.scores));
            }
            choice.model
        };
        if found.around.is_some() && model.hysteresis.rate != RateDependence::Static {
            return Err(vec![rate_and_leg_model(model, name)]);
        }
        let scale = of_right_scale(model, name, &found.table);
        self.tables.push(found.table);
        self.around.push(found.around);
        self.keep(name, text);
        scale
    }

    fn add_rate_table(&mut self, model: &Model, name: &str, text: String) -> Result<(), Vec<Diagnostic>> {
        let table = rate::read_rate_csv(&text, name)?;
        fits_spec(model, name, &table, codes::RATE_TABLE_MISMATCH, "hysteresis.rate_tables")?;
        self.rate_tables.push(table);
        self.keep(name, text);
        Ok(())
    }

    fn keep(&mut self, name: &str, text: String) {
        if is_simulated(&text) {
            self.simulated.push(name.to_owned());
        }
        self.texts.push((name.to_owned(), text));
    }
}

/// The model of the tables of a leg with the other values of `lines`, and a mode with its share of the mean gain.
fn of_tables(
    lines: &Hysteresis,
    found: LegModel,
    rate: Option<EverettTable>,
    mode: Option<(Mode, Option<f64>)>,
) -> RateModel {
    let mut model = RateModel { rate, dead_time: lines.dead_time, ..RateModel::of_leg(found) };
    if let RateDependence::Creep(terms) = &lines.rate {
        model.creep = CreepTerm::list(terms);
    }
    model.inertia = mode.map(|(mode, share)| Inertia {
        mode,
        gain: share.map_or_else(|| model.reversal_gain(), |share| share * model.still.mean_gain()),
    });
    model
}

/// The model of `leg`, 0 to 5, in the lines of a leg, whose files are relative to `dir`; its records are tables.
///
/// # Errors
/// All findings of a table, or E0642 if the second one has another grid.
pub fn of_lines((lines, mode, share): &LegLines, dir: &Path, leg: usize) -> Result<RateModel, Vec<Diagnostic>> {
    let file = |names: &[String]| -> Result<(String, String), Vec<Diagnostic>> {
        let name = names.get(leg).or(names.first()).cloned().unwrap_or_default();
        Ok((read_file(&dir.join(&name), &name)?, name))
    };
    let (text, name) = file(&lines.records)?;
    let found = read_leg_csv(&text, &name)?;
    let mut second = None;
    if let RateDependence::DynamicPreisach(files) = &lines.rate {
        let (text, name) = file(files)?;
        let table = rate::read_rate_csv(&text, &name)?;
        let wanted = (found.table.grid, [found.table.drive_min, found.table.drive_max]);
        of_grid(wanted, &name, &table, codes::RATE_TABLE_MISMATCH, "hysteresis.rate_tables")?;
        second = Some(table);
    }
    let mode = mode.map(|[frequency, damping]| (Mode { frequency, damping }, *share));
    Ok(of_tables(lines, found, second, mode))
}

/// The leg's resonance in the spec.
fn mode_of(model: &Model) -> Mode {
    Mode { frequency: model.actuator.resonance, damping: model.actuator.damping_ratio }
}

/// Refuses a displacement that stack gain and voltage do not explain: it has another unit, and the controller would be
/// wrong by that factor.
fn of_right_scale(model: &Model, name: &str, table: &EverettTable) -> Result<(), Vec<Diagnostic>> {
    let [min, max] = model.actuator.voltage;
    let expected = model.actuator.leg_gain() * (max - min);
    let found = table.node(table.grid, 0);
    if (expected / LARGEST_SCALE..=expected * LARGEST_SCALE).contains(&found) {
        return Ok(());
    }
    let (moved, stacks, stack_gain) = (found * 1e6, model.actuator.stacks, model.actuator.stack_gain);
    let given = expected * 1e6;
    Err(vec![about_file(
        name,
        codes::RECORD_SCALE,
        "hysteresis.records",
        format!(
            "the record moves by {moved:.4} µm over {min} V to {max} V; {stacks} stacks of {stack_gain} m/V give {given:.4} µm"
        ),
        "check that the displacement is in µm, or fix actuator.stacks and actuator.stack_gain".to_owned(),
    )])
}

/// Refuses a table whose grid or range differs from the spec's.
fn fits_spec(model: &Model, name: &str, table: &EverettTable, code: Code, key: &str) -> Result<(), Vec<Diagnostic>> {
    of_grid((model.hysteresis.grid, model.actuator.voltage), name, table, code, key)
}

/// The same for cells and voltages.
fn of_grid(
    (grid, [min, max]): (usize, [f64; 2]),
    name: &str,
    table: &EverettTable,
    code: Code,
    key: &str,
) -> Result<(), Vec<Diagnostic>> {
    let slack = 1e-9 * (max - min);
    let fits = (table.drive_min - min).abs() <= slack && (table.drive_max - max).abs() <= slack;
    if table.grid == grid && fits {
        return Ok(());
    }
    Err(vec![about_file(
        name,
        code,
        key,
        format!(
            "the table has {} cells over {} V to {} V; the spec declares {} cells (hysteresis.grid) over {min} V to {max} V (actuator.voltage)",
            table.grid, table.drive_min, table.drive_max, grid
        ),
        format!("identify the record again with --grid {grid} --drive {min}:{max}"),
    )])
}

fn about_file(name: &str, code: Code, key: &str, message: String, help: String) -> Diagnostic {
    let place = Place::File { path: name.to_owned(), line: None };
    Diagnostic::new(code, key, place, message, help)
}

/// For a record whose drive differs from the spec: the key that sets it.
fn about_voltage(mut findings: Vec<Diagnostic>) -> Vec<Diagnostic> {
    for one in &mut findings {
        if [codes::DRIVE_RANGE, codes::NOT_EXCITED].iter().any(|code| one.code == *code) {
            one.key = "actuator.voltage".to_owned();
            one.help = format!("{}; `actuator.voltage` sets that range, in volts at the stack", one.help);
        }
    }
    findings
}

fn not_identified(model: &Model) -> Diagnostic {
    let Actuator { stroke, voltage: [low, high], .. } = model.actuator;
    Diagnostic::at(
        &model.spans,
        &["hysteresis.records"],
        codes::NOT_IDENTIFIED,
        format!(
            "no leg is identified: this controller has the open drive only, and takes a straight line of {} um from {low} V to {high} V for each leg",
            micro(stroke * 1e6)
        ),
        "run `specgen commission`, which identifies the legs and names their records here; or name records that you have",
    )
}

/// The stability check of the adaptation uses the static inverse only.
fn rate_not_in_stability(model: &Model) -> Diagnostic {
    Diagnostic::at(
        &model.spans,
        &["hysteresis.rate"],
        codes::RATE_NOT_IN_STABILITY,
        "the stability of the adaptation was checked without the rate term of (6)",
        format!(
            "its inverse at most doubles the gain of fast corrections: let gain_ratio reach twice its upper end ({}), or simulate",
            2.0 * model.adaptation.gain_ratio[1]
        ),
    )
}

/// A record that is faster than the amplifier (times `SLEW`) has another unit of time, or another amplifier.
fn faster_than_amplifier(model: &Model, record: &str, rate: f64) -> Option<Diagnostic> {
    const SLEW: f64 = 1.2;
    let limit = model.actuator.slew_rate;
    (rate > SLEW * limit).then(|| {
        Diagnostic::at(
            &model.spans,
            &["hysteresis.records"],
            codes::RECORD_LONG,
            format!("the drive of `{record}` runs at {rate:.0} V/s, and actuator.slew_rate is {limit:.0} V/s"),
            "if its column of times is in s, name it `time_s`, if in ms, `time_ms`; or correct actuator.slew_rate"
                .to_owned(),
        )
    })
}

fn not_invertible(model: &Model, share: f64, needed: f64) -> Diagnostic {
    // To two digits, upwards.
    let digit = libm::pow(10.0, libm::floor(libm::log10(needed * 1e3)) - 1.0);
    let milliseconds = libm::ceil(needed * 1e3 / digit) * digit;
    let (longer, enough) = (micro(milliseconds), 100.0 * INVERTED);
    let (milliseconds, percent) = (micro(model.timing.period * 1e3), 100.0 * share);
    Diagnostic::at(
        &model.spans,
        &["hysteresis.rate"],
        codes::RATE_NOT_INVERTIBLE,
        format!(
            "at a period of {milliseconds} ms the dynamic Preisach model (6) can be inverted on only {percent:.0} % of the travel; elsewhere ticks use the static inverse"
        ),
        format!(
            "with timing.period = \"{longer} ms\" it can be on {enough:.0} %; or write rate = \"creep\" or \"static\"; or identify the tables again with a dead time, which a controller leads by at any period"
        ),
    )
}

/// Rounds off the last digits.
fn micro(milliseconds: f64) -> f64 {
    libm::round(milliseconds * 1e6) / 1e6
}

/// A leg model has its own creep.
fn rate_and_leg_model(model: &Model, record: &str) -> Diagnostic {
    Diagnostic::at(
        &model.spans,
        &["hysteresis.rate"],
        codes::RATE_KEYS,
        format!("the leg model of `{record}` has its own creep"),
        "remove hysteresis.rate and its keys, or name a table without a leg model",
    )
}

fn static_table_with_creep(model: &Model, record: &str) -> Diagnostic {
    Diagnostic::at(
        &model.spans,
        &["hysteresis.records"],
        codes::STATIC_TABLE_WITH_CREEP,
        format!(
            "the table of `{record}` is fitted without creep, and the creep that is in it is compensated once more"
        ),
        "name the table that `specgen identify rate SLOW.csv FAST.csv -o NAME` writes to NAME-creep.csv",
    )
}
