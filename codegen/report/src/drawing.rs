//! Picture files and result folders.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;
use specgen_language::outcome::Failure;
use specgen_language::output::{check_place, write_file, write_folder};
use specgen_language::ui::Ui;

use crate::chart::Chart;
use crate::plot::{figure, html};

/// Destination of a picture, if requested: .svg, or .html for a page.
#[derive(Debug, Clone)]
pub struct Plot(pub Option<PathBuf>);

/// Whether the file is a page; `None` if it is neither format.
pub fn is_page(path: &Path) -> Option<bool> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "svg" => Some(false),
        "html" => Some(true),
        _ => None,
    }
}

impl Plot {
    /// Whether a picture is requested. Refuses an unusable path before a long run.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn wanted(&self) -> Result<bool, Failure> {
        self.0.as_deref().map_or(Ok(()), check_place)?;
        Ok(self.0.is_some())
    }

    /// Writes charts in two columns (a single one in one), if a plot is requested; returns a line about it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn charts(&self, title: &str, below: &str, charts: &[Chart]) -> Result<Option<String>, Failure> {
        self.write(title, || figure(title, below, charts, charts.len().clamp(1, 2)))
    }

    /// Like [`Plot::charts`], with the line as progress message.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn show(&self, title: &str, below: &str, charts: &[Chart], ui: &Ui) -> Result<(), Failure> {
        self.charts(title, below, charts)?.iter().for_each(|line| ui.progress(line.trim_end()));
        Ok(())
    }

    /// Writes the output of `draw`, if a plot is requested; returns a line about it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, title: &str, draw: impl FnOnce() -> String) -> Result<Option<String>, Failure> {
        let Some(path) = &self.0 else { return Ok(None) };
        let svg = draw();
        let text = if is_page(path) == Some(true) { html(title, &svg) } else { svg };
        write_file(path, text.as_bytes())?;
        Ok(Some(wrote(path)))
    }
}

/// Name and content of a result file.
pub type File = (String, Vec<u8>);

/// A value as a JSON file.
pub fn json(name: &str, value: &impl Serialize) -> File {
    (name.to_owned(), format!("{:#}\n", json!(value)).into_bytes())
}

/// Writes a folder of results and reports it.
///
/// # Errors
/// The folder cannot be written.
pub fn write(folder: &Path, files: &[File], ui: &Ui) -> Result<(), Failure> {
    write_folder(folder, files)?;
    ui.progress(&format!("wrote {} files to {}", files.len(), folder.display()));
    Ok(())
}

/// The line that reports a written file.
pub fn wrote(path: &Path) -> String {
    format!("wrote {}\n", path.display())
}
