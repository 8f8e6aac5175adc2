//! `--plot FILE`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::file::write_file;
use crate::cli::ui::Failure;
use specgen_report::plot::html;

#[derive(Args, Debug)]
pub struct Plot {
    /// Draw measurement, model and residual here: .svg, or .html for a page.
    #[arg(long, value_name = "FILE", value_parser = drawable)]
    plot: Option<PathBuf>,
}

fn drawable(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if kind(&path).is_some() {
        Ok(path)
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
pub(in crate::cli) fn wrote(path: &Path) -> String {
    format!("wrote {}\n", path.display())
}
