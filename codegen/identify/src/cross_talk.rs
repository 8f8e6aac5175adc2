//! Cross-talk of an assembled platform: what the lengths of the other legs do while one leg is driven.
//!
//! With stiff joints and tilted gauges the measured lengths l are T C d for free strokes d of the legs. One record a leg,
//! in which only that leg i moves, gives column i of B = T C up to a factor: B_ji is the slope of l_j on l_i, beside a
//! constant, a drift and creep. With W = B⁻¹, E_ij = W_ij/W_ii for j ≠ i, E_ii = 0: leg i reaches the length l_i with
//! l_i + Σ E_ij l_j times a constant, which merges with its gain.

use nalgebra::Matrix6;
use serde::Serialize;
use specgen_language::diagnostic::{Diagnostic, codes};

use crate::columns::names::Conversion;
use crate::columns::{self, Column, RECORD};
use crate::findings::Findings;
use crate::least_squares::{fit, independent_samples, mean_square};
use crate::statistics::extent;

/// Part of a record at its beginning that is left out: creep of the first stroke.
const SETTLING: f64 = 1.0 / 3.0;
/// Least travel of the leg that is driven, m: below it, creep and drift hide the slopes.
const TRAVEL: f64 = 2e-6;
/// Most volts by which another leg may be driven, as a share of the leg that moves.
const STILL: f64 = 0.01;
/// Least number of samples after the beginning.
const SAMPLES: usize = 24;
/// Number of the phase of an open drive.
const DRIVING: f64 = 6.0;
/// Largest entry of E that a spec accepts.
const MOST: f64 = 0.5;
/// Time constant of creep in the fit, s.
const CREEP: f64 = 0.3;

/// The cross-talk of six legs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrossTalk {
    /// E, by row and column; its diagonal is zero.
    pub matrix: [[f64; 6]; 6],
    /// Largest standard error of a slope.
    pub error: f64,
    /// Displacement of each leg in its record, m.
    pub travel: [f64; 6],
    /// Largest root mean square residual of a length, m.
    pub residual_rms: f64,
    /// Whether a comment marks a record as simulated.
    pub simulated: bool,
}

/// A record of `watch` while one leg was driven.
struct Record {
    time: Vec<f64>,
    volts: [Vec<f64>; 6],
    lengths: [Vec<f64>; 6],
    simulated: bool,
}

/// Cross-talk from the texts of six records of `watch`, one for each leg in order, with their names.
///
/// # Errors
/// A record cannot be read, another leg was driven as well, or the leg did not move enough.
pub fn of_records(records: &[(String, String); 6]) -> Result<CrossTalk, Vec<Diagnostic>> {
    let mut responses = Matrix6::identity();
    let mut found =
        CrossTalk { matrix: [[0.0; 6]; 6], error: 0.0, travel: [0.0; 6], residual_rms: 0.0, simulated: false };
    for (leg, (shown_as, text)) in records.iter().enumerate() {
        let mut findings = Findings::new(shown_as);
        let column = read(text, &mut findings).and_then(|record| {
            found.simulated |= record.simulated;
            column(&record, leg, &mut found, &mut findings)
        });
        let (column, _) = findings.conclude(column)?;
        for (other, slope) in column.into_iter().enumerate() {
            responses[(other, leg)] = slope;
        }
    }
    let inverse = responses.try_inverse().unwrap_or_else(Matrix6::zeros);
    for (i, row) in found.matrix.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = if i == j { 0.0 } else { inverse[(i, j)] / inverse[(i, i)] };
        }
    }
    let alike = (0..36).any(|k| k % 7 != 0 && responses[(k / 6, k % 6)].abs() > MOST);
    // Written so that a NaN is refused.
    if alike || !found.matrix.iter().flatten().all(|entry| entry.abs() <= MOST) {
        let mut findings = Findings::new(&records[0].0);
        let message = format!("another leg moves by more than {MOST} of the leg that is driven");
        findings.add(codes::CROSS_TALK_RECORD, None, message, "check mounts and gauges, and record all six again");
        return Err(findings.conclude(None::<()>).err().unwrap_or_default());
    }
    Ok(found)
}

fn read(text: &str, findings: &mut Findings) -> Option<Record> {
    let (header, lines) = columns::open(text.as_bytes(), &RECORD, findings)?;
    let names: Vec<String> = ["time_s", "phase"]
        .map(str::to_owned)
        .into_iter()
        .chain((0..6).map(|leg| format!("volts[{leg}]_mean_V")))
        .chain((0..6).map(|leg| format!("leg[{leg}]_m")))
        .collect();
    let place = |name: &String| header.names.iter().position(|header| header == name);
    if let Some(missing) = names.iter().find(|name| place(name).is_none()) {
        let message = format!("column `{missing}` is missing: this is no file of `watch`");
        let help = "record it with `watch 200 2 leg0.csv` of `specgen operate` in an open drive";
        return findings.refuse(codes::RECORD_HEADER, Some(header.line), message, help);
    }
    let wanted =
        names.iter().filter_map(|name| Some(Column { at: place(name)?, name, conversion: Conversion::unit(1.0) }));
    let wanted: Vec<Column> = wanted.collect();
    let read = lines.read(&wanted, findings);
    let mut columns = read.columns.into_iter();
    let mut next = || columns.next().unwrap_or_default();
    let (time, phase) = (next(), next());
    if let Some(row) = phase.iter().position(|phase| *phase != DRIVING) {
        let message = format!("the machine was not in an open drive at {} s", time[row]);
        let help = "record while `wait driving` has returned and the wave runs";
        return findings.refuse(codes::CROSS_TALK_RECORD, None, message, help);
    }
    Some(Record {
        time,
        volts: std::array::from_fn(|_| next()),
        lengths: std::array::from_fn(|_| next()),
        simulated: read.simulated,
    })
}

/// Slope of each length on that of the `leg` that is driven.
fn column(record: &Record, leg: usize, found: &mut CrossTalk, findings: &mut Findings) -> Option<[f64; 6]> {
    let swing = |values: &[f64]| extent(values).1 - extent(values).0;
    let driven = swing(&record.volts[leg]);
    if let Some(other) = (0..6).find(|other| *other != leg && swing(&record.volts[*other]) > STILL * driven) {
        let message = format!("leg {other} is driven by {:.3} V beside leg {leg}", swing(&record.volts[other]));
        return findings.refuse(
            codes::CROSS_TALK_RECORD,
            None,
            message,
            "drive one leg at a time, legs 0 to 5 in order",
        );
    }
    let first = (record.time.len() as f64 * SETTLING) as usize;
    let time = record.time.get(first..).filter(|time| time.len() >= SAMPLES);
    let Some(time) = time else {
        let message = format!("has {} samples; at least {} are needed", record.time.len(), SAMPLES * 3 / 2);
        return findings.refuse(codes::CROSS_TALK_RECORD, None, message, "record three strokes of 0.5 s");
    };
    let own = &record.lengths[leg][first..];
    found.travel[leg] = swing(own);
    if found.travel[leg] < TRAVEL {
        let message =
            format!("leg {leg} moves by {:.3} µm; at least {} are needed", found.travel[leg] * 1e6, TRAVEL * 1e6);
        return findings.refuse(codes::CROSS_TALK_RECORD, None, message, "drive it further, such as 20 V");
    }
    let since = |of: fn(f64) -> f64| time.iter().map(|t| of(t - time[0])).collect::<Vec<f64>>();
    let (one, linear, square) = (since(|_| 1.0), since(|t| t), since(|t| t * t));
    let creep = since(|t| libm::exp(-t / CREEP));
    let mut slopes = [1.0; 6];
    for other in (0..6).filter(|other| *other != leg) {
        let length = &record.lengths[other][first..];
        let regressors: [&[f64]; 5] = [own, &one, &linear, &square, &creep];
        let Some(fitted) = fit(&regressors, length) else {
            let message = format!("leg {leg} moves like its drift, so its slope is not determined");
            return findings.refuse(codes::CROSS_TALK_RECORD, None, message, "record three strokes of 0.5 s");
        };
        slopes[other] = fitted.coefficients[0];
        let square = mean_square(&fitted.residual);
        // Of the correlated residual of creep, as if the independent samples were fewer.
        let shares = time.len() as f64 / independent_samples(&fitted.residual);
        let error = (fitted.covariance[(0, 0)] * square * shares).sqrt();
        found.error = if error > found.error { error } else { found.error };
        let rms = square.sqrt();
        found.residual_rms = if rms > found.residual_rms { rms } else { found.residual_rms };
    }
    Some(slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Records = [(String, String); 6];

    /// Records of legs that are coupled like this, with a drift.
    fn records(coupling: &[[f64; 6]; 6]) -> Records {
        std::array::from_fn(|leg| {
            let names = (0..6).map(|k| format!(",volts[{k}]_mean_V")).chain((0..6).map(|k| format!(",leg[{k}]_m")));
            let mut text = format!("phase,time_s{}\n", names.collect::<String>());
            for row in 0..75 {
                let time = f64::from(row) * 0.02;
                let volts = 10.0 * (1.0 - libm::cos(std::f64::consts::TAU * 2.0 * time));
                text += &format!("6,{time}");
                (0..6).for_each(|k| text += &format!(",{}", if k == leg { volts } else { 0.0 }));
                for row in coupling {
                    text += &format!(",{:e}", 0.6e-6 * volts * row[leg] + 3e-9 * time - 1e-9);
                }
                text += "\n";
            }
            (format!("leg{leg}.csv"), text)
        })
    }

    const COUPLING: [[f64; 6]; 6] = {
        let mut rows = [[0.0; 6]; 6];
        let mut i = 0;
        while i < 6 {
            let mut j = 0;
            while j < 6 {
                // Columns of different gains, none symmetric.
                rows[i][j] = if i == j { 0.9 + 0.02 * j as f64 } else { 0.004 * i as f64 - 0.003 * j as f64 + 0.001 };
                j += 1;
            }
            i += 1;
        }
        rows
    };

    /// The strokes l + E l are those of one leg alone: (I + E) B is diagonal.
    #[test]
    fn the_cross_talk_of_coupled_legs_is_removed() {
        let found = of_records(&records(&COUPLING)).unwrap();
        for (i, (row, own)) in COUPLING.iter().zip(&found.matrix).enumerate() {
            for j in (0..6).filter(|j| *j != i) {
                let left: f64 = row[j] + own.iter().zip(&COUPLING).map(|(share, other)| share * other[j]).sum::<f64>();
                assert!(left.abs() < 1e-9, "{i} {j}: {left}");
            }
            assert_eq!(own[i], 0.0);
        }
        assert!(found.error < 1e-9 && !found.simulated, "{found:?}");
    }

    #[test]
    fn records_that_do_not_show_it_are_refused_with_their_name() {
        let refused = |change: &dyn Fn(&mut Records)| {
            let mut records = records(&COUPLING);
            change(&mut records);
            let findings = of_records(&records).unwrap_err();
            findings.into_iter().map(|finding| finding.message).collect::<String>()
        };
        assert!(refused(&|records| records.swap(1, 2)).contains("leg 2 is driven by"));
        assert!(refused(&|records| records[3].1 = "time_s,drive_V\n0,1\n".to_owned()).contains("no file of `watch`"));
        assert!(refused(&|records| records[0].1.truncate(2000)).contains("samples"));
        assert!(
            refused(&|records| records[4].1 = records[4].1.replacen("\n6,", "\n3,", 1))
                .contains("not in an open drive")
        );
        let alike = [[1.0; 6]; 6];
        assert!(refused(&|records| *records = self::records(&alike)).contains("more than 0.5"));
        let none = [[0.0; 6]; 6];
        assert!(refused(&|records| *records = self::records(&none)).contains("leg 0 moves by 0.00"));
    }
}
