//! Who takes the memory of an image, and what its tick reaches.

use std::path::Path;

use object::{Architecture, Object};
use serde::Serialize;

use super::{BuildResult, Options, Purpose, make, read_image, refusal, text};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use specgen_toolchain::TargetError;
use specgen_toolchain::checks::{self, Rules, TickChecks};
use specgen_toolchain::size::{Size, has_tick, size};

/// What was made of a spec, by owner and function.
#[derive(Serialize)]
struct Built(BuildResult);

impl Outcome for Built {
    fn text(&self) -> String {
        let Self(made) = self;
        let size = made.size.iter().map(|size| text::sections(size) + &text::owners(size));
        let checks = made.checks.iter().map(text::checked);
        format!("{} for {}\n", made.artifact, made.board) + &size.chain(checks).collect::<String>()
    }
}

#[derive(Serialize)]
struct Examined {
    file: String,
    size: Size,
    checks: Option<TickChecks>,
    /// Only Thumb code is followed; on a PC the operating system's own checks apply.
    #[serde(skip)]
    is_thumb: bool,
}

impl Outcome for Examined {
    fn text(&self) -> String {
        let checks = match &self.checks {
            Some(checks) => text::checked(checks),
            None if self.is_thumb => {
                format!("  no function {} in it: name the one that is a tick by --tick\n", checks::TICKS.join(", "))
            }
            None => "  checks of the tick and the stack bound are for images of Cortex-M\n".to_owned(),
        };
        format!("{}\n{}{}{checks}", self.file, text::sections(&self.size), text::owners(&self.size))
    }
}

/// Shows the size of a spec that is built first, or of an image, whose `tick` function computes no f64 if `single`.
///
/// # Errors
/// The spec is refused, a build fails, or the image is malformed or has faults.
pub fn run(path: &Path, options: &Options, tick: Option<&str>, single: bool, ui: &mut Ui) -> Result<(), Failure> {
    let Some(bytes) = read_image(path)? else {
        let built = Built(make(path, options, Purpose::Machine, ui)?);
        return ui.judged(&built, refusal(&built.0));
    };
    let malformed = |error: object::Error| TargetError::MalformedImage { text: format!("{}: {error}", path.display()) };
    let is_thumb = object::File::parse(&*bytes).map_err(malformed)?.architecture() == Architecture::Arm;
    let size = size(&bytes)?;
    let follows = is_thumb && (tick.is_some() || has_tick(&bytes));
    let rules = Rules { single, whole_image: false };
    let checks = if follows { Some(checks::check(&bytes, tick, rules)?) } else { None };
    let faults = checks.as_ref().map_or(0, |checks| checks.faults.len());
    let file = path.display().to_string();
    let failed = (faults > 0).then(|| format!("{faults} faults in {file}"));
    ui.judged(&Examined { file, size, checks, is_thumb }, failed)
}
