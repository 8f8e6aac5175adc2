//! Memory use of an image by owner, and the code that its tick reaches.

use std::path::Path;

use object::{Architecture, Object};
use serde::Serialize;

use super::{BuildResult, Options, Purpose, make, read_image, refusal, text};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use specgen_toolchain::TargetError;
use specgen_toolchain::checks::{self, Rules, TickChecks};
use specgen_toolchain::size::{Size, has_tick, size};

/// Size of a build, by owner and function.
#[derive(Serialize)]
struct BuildListing(BuildResult);

impl Outcome for BuildListing {
    fn text(&self) -> String {
        let Self(made) = self;
        let size = made.size.iter().map(|size| text::sections(size) + &text::owners(size));
        let checks = made.checks.iter().map(text::checked);
        format!("{} for {}\n", made.artifact, made.board) + &size.chain(checks).collect::<String>()
    }
}

#[derive(Serialize)]
struct ImageListing {
    file: String,
    size: Size,
    checks: Option<TickChecks>,
    /// Whether the tick can be checked: only Thumb code is analysed. On a PC the operating system's own checks apply.
    #[serde(skip)]
    is_thumb: bool,
}

impl Outcome for ImageListing {
    fn text(&self) -> String {
        let checks = match &self.checks {
            Some(checks) => text::checked(checks),
            None if self.is_thumb => {
                format!("  it has no function {}: name its tick function with --tick\n", checks::TICKS.join(", "))
            }
            None => "  tick checks and the stack bound are available only for Cortex-M images\n".to_owned(),
        };
        format!("{}\n{}{}{checks}", self.file, text::sections(&self.size), text::owners(&self.size))
    }
}

/// Shows the size of a spec's build, or of an image. `tick` names its tick function, which must not compute f64 if `single`.
///
/// # Errors
/// The spec is refused, a build fails, or the image is malformed or has faults.
pub fn run(path: &Path, options: &Options, tick: Option<&str>, single: bool, ui: &mut Ui) -> Result<(), Failure> {
    let Some(bytes) = read_image(path)? else {
        let built = BuildListing(make(path, options, Purpose::Machine, ui)?);
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
    ui.judged(&ImageListing { file, size, checks, is_thumb }, failed)
}
