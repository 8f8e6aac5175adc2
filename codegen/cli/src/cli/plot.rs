//! `--plot FILE`: plots the result of a command.

use std::path::PathBuf;

use clap::Args;
use specgen_report::drawing::{self, is_page};

use super::path_roles::OutputFile;

#[derive(Args, Debug)]
pub struct Plot {
    /// Plot the result to this file, .svg or .html.
    #[arg(long, value_name = "FILE", value_parser = drawable)]
    plot: Option<OutputFile>,
}

fn drawable(text: &str) -> Result<OutputFile, String> {
    let path = PathBuf::from(text);
    if is_page(&path).is_some() {
        Ok(path.into())
    } else {
        Err(format!("expected a file that ends in .svg or .html, found `{text}`"))
    }
}

impl Plot {
    pub fn place(&self) -> drawing::Plot {
        drawing::Plot(self.plot.as_deref().map(Into::into))
    }
}
