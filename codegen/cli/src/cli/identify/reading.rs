//! How the files of the bench are read where their headers do not say it.

use clap::Args;
use specgen_identify::Reading;

use specgen_language::outcome::Failure;

/// Arguments of every kind of record.
#[derive(Args, Debug)]
pub struct ReadingArguments {
    /// Columns by their headers or numbers (from 1), named with their units: drive_mV=Voltage,time_s=1. Without it, by their
    /// headers.
    #[arg(long, value_name = "NAME=COLUMN,…", value_delimiter = ',')]
    columns: Vec<String>,
    /// Samples per second, Hz: counts the time from sample numbers, or from the rows of a file.
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    rate: Option<f64>,
}

impl ReadingArguments {
    pub(super) fn reading(&self) -> Result<Reading, Failure> {
        Reading::new(&self.columns, self.rate).map_err(|why| Failure::Usage(format!("--columns: {why}")))
    }
}

fn rate(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches("Hz").trim().parse::<f64>() {
        Ok(rate) if (1e-3..=1e9).contains(&rate) => Ok(rate),
        _ => Err(format!("expected samples per second above zero, found `{text}`")),
    }
}
