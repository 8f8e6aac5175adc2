//! `--plot FILE`: what a command found, as a picture.

use std::path::{Path, PathBuf};

use clap::Args;

use super::named::OutputFile;
use specgen_language::outcome::Failure;
use specgen_language::output::{check_place, write_file};
use specgen_report::chart::Chart;
use specgen_report::plot::{figure, html};

#[derive(Args, Debug)]
pub struct Plot {
    /// Draw the result here: .svg, or .html for a page.
    #[arg(long, value_name = "FILE", value_parser = drawable)]
    plot: Option<OutputFile>,
}

fn drawable(text: &str) -> Result<OutputFile, String> {
    let path = PathBuf::from(text);
    if kind(&path).is_some() {
        Ok(path.into())
    } else {
        Err(format!("expected a file that ends in .svg or .html, found `{text}`"))
    }
}

/// Whether it is a page; none for neither.
fn kind(path: &Path) -> Option<bool> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "svg" => Some(false),
        "html" => Some(true),
        _ => None,
    }
}

impl Plot {
    /// Whether there is something to draw for; a place that cannot be is refused before the minutes that the rest takes.
    pub fn wanted(&self) -> Result<bool, Failure> {
        self.plot.as_deref().map_or(Ok(()), check_place)?;
        Ok(self.plot.is_some())
    }

    /// Writes charts in two columns, one that is alone in one, if a plot is wanted; then a line about it.
    pub fn charts(&self, title: &str, below: &str, charts: &[Chart]) -> Result<Option<String>, Failure> {
        self.write(title, || figure(title, below, charts, charts.len().clamp(1, 2)))
    }

    /// Writes what `draw` draws, if a plot is wanted; then a line about it.
    pub fn write(&self, title: &str, draw: impl FnOnce() -> String) -> Result<Option<String>, Failure> {
        let Some(path) = &self.plot else { return Ok(None) };
        let svg = draw();
        let text = if kind(path) == Some(true) { html(title, &svg) } else { svg };
        write_file(path, text.as_bytes())?;
        Ok(Some(wrote(path)))
    }
}

/// The line that says so.
pub fn wrote(path: &Path) -> String {
    format!("wrote {}\n", path.display())
}
