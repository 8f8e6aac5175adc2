//! The page *Settings* of the book: the permitted values of a `Config`, from the controller's own table.

use std::fmt::Write as _;

use crate::ir::{Ir, Range, Setting};

/// The document, for a platform and for six legs.
pub fn markdown(platform: &Ir, legs: &Ir) -> String {
    let mut text = String::from(
        "# Settings\n\n\
         The `Config` of a controller is what may change while it runs: in code (`Config::with`), as words \
         (records, `--config` of a real-time PC, `specgen tune`) or over the link (`config write SPEC` of `specgen operate`). Each \
         word has a range that includes both ends. The ranges come from the spec and are in the emitted `permitted.rs`. A `Config` \
         with a word out of range is refused with the name of the word: no setting makes a machine leave the limits of its spec. \
         `specgen check` tells whether a setting is stable.\n\n\
         The same table checks a snapshot of a state (the start of a record): it permits every state that these settings and any \
         inputs can lead to.\n",
    );
    for (title, spec, ir) in
        [("Of a platform", "specs/reference.toml", platform), ("Of six legs", "specs/legs.toml", legs)]
    {
        // Writing to a String cannot fail, here and below.
        let _ = write!(
            text,
            "\n## {title}\n\nIn the order of the words; the numbers are those of `{spec}`.\n\n| setting | range | unit | from | what |\n|---|---|---|---|---|\n"
        );
        for setting in &ir.permitted.settings {
            let Setting { name, six, doc, from, .. } = setting;
            let index = if *six { "[0…5]" } else { "" };
            let (range, unit) = (both(&setting.range.map(range)), both(&setting.unit.map(str::to_owned)));
            let _ = writeln!(text, "| `{name}{index}` | {range} | {unit} | {from} | {doc} |");
        }
    }
    text
}

/// The text for translations and that for rotations, or one if they are equal.
fn both([first, last]: &[String; 2]) -> String {
    if first == last { first.clone() } else { format!("{first}; {last}") }
}

fn range(range: Range) -> String {
    match range {
        Range::Whole(least, most) => format!("{least} to {most}"),
        Range::Number(least, most) => format!("{} to {}", number(least), number(most)),
    }
}

fn number(value: f64) -> String {
    if value.abs() < 1e6 { value.to_string() } else { format!("{value:e}") }
}
