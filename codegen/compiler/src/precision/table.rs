//! Rounding errors as rows, for `check` and the report.

use std::fmt::Write as _;

use super::{Figures, Precision, SAMPLES};
use crate::ir::Scalar;

/// One axis, nm or nrad.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The commanded or the measured pose.
    pub what: &'static str,
    /// x to θz.
    pub axis: &'static str,
    /// nm or nrad.
    pub unit: &'static str,
    /// Proven bound over the workspace.
    pub bound: f64,
    /// Largest sampled difference from 106 bits.
    pub sampled: f64,
    /// Bound over largest sample; none if all samples are exact.
    pub ratio: Option<f64>,
    /// Largest sampled difference from doubles; none if the controller computes in doubles.
    pub against_f64: Option<f64>,
}

const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];

/// The commanded pose, then the measured one, axis by axis.
pub fn rows(precision: &Precision) -> Vec<Row> {
    let of = |what: &'static str, figures: &Figures| {
        let figures = *figures;
        (0..6)
            .map(move |axis| Row {
                what,
                axis: AXES[axis],
                unit: if axis < 3 { "nm" } else { "nrad" },
                bound: figures.bound[axis] * 1e9,
                sampled: figures.sampled[axis] * 1e9,
                ratio: figures.ratio()[axis],
                against_f64: figures.against_f64.map(|against| against[axis] * 1e9),
            })
            .collect::<Vec<_>>()
    };
    let mut rows = of("commanded pose", &precision.commanded);
    rows.extend(precision.measured.iter().flat_map(|figures| of("measured pose", figures)));
    rows
}

/// The precision as text for `specgen check`.
pub fn describe(precision: &Precision, scalar: Scalar) -> String {
    // Writing to a String cannot fail.
    let mut text = String::new();
    let single = precision.commanded.against_f64.is_some();
    let (bits, poses, with) = (scalar.bits(), SAMPLES + 64, if single { " and with f64" } else { "" });
    let _ = writeln!(
        text,
        "  rounding of f{bits} over the workspace: proven bound, and largest of {poses} poses compared with 106 bits{with}"
    );
    let _ = writeln!(
        text,
        "    {:<24} {:>10} {:>10} {:>6}{}",
        "",
        "bound",
        "found",
        "ratio",
        if single { "        f64" } else { "" }
    );
    for row in rows(precision) {
        let ratio = row.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.1}"));
        let against = row.against_f64.map_or_else(String::new, |value| format!(" {value:>10.2e}"));
        let _ = writeln!(
            text,
            "    {:<14} {:<2} {:>6} {:>10.2e} {:>10.2e} {ratio:>6}{against}",
            row.what, row.axis, row.unit, row.bound, row.sampled
        );
    }
    text
}
