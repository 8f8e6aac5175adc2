//! The operator panel: the report's drawing code, and a script that draws data from the link.
//!
//! The page is self-contained: it includes style, script and marks, and loads only the machine's data from its own server.

use serde_json::{Value, json};
use specgen_compiler::stability::platform::Design;
use specgen_language::model::Model;

use super::page::MARKS;
use super::platform;
use super::plot::escaped;
use super::section::Part;

const STYLE: &str = concat!(include_str!("assets/shared.css"), include_str!("assets/panel.css"));
const BODY: &str = include_str!("assets/panel.html");
const SCRIPT: &str = concat!(
    include_str!("assets/draw.js"),
    include_str!("assets/plot.js"),
    include_str!("assets/view.js"),
    include_str!("assets/strips.js"),
    include_str!("assets/spectrum.js"),
    include_str!("assets/controls.js"),
    include_str!("assets/panel.js")
);

/// Static data of a platform for the page: its geometry, limits of the legs (V), its modes (Hz).
pub fn facts(model: &Model, design: Option<&Design>) -> Value {
    let view = match platform::at_rest(model, &[]) {
        Part::View(_, view) => view,
        _ => Value::Null,
    };
    let modes: Vec<f64> = design
        .map(|design| design.modes.iter().map(|mode| mode.frequency / core::f64::consts::TAU).collect())
        .unwrap_or_default();
    // The margin of the worst mode, since every mode of the law may be selected.
    let margins = design.map(|design| design.margins.iter().filter_map(|mode| mode.gain_margin));
    let margin = margins.and_then(|margins| margins.reduce(|least, one| if one < least { one } else { least }));
    json!({
        "name": model.name,
        "period": model.timing.period,
        "view": view,
        "volts": model.actuator.voltage,
        "modes": modes,
        "gain_margin": margin,
    })
}

/// The page of a device, with `facts` for its script.
pub fn html(title: &str, facts: &Value) -> String {
    // `</script>` in a text would end the script.
    let facts = facts.to_string().replace("</", "<\\/");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, \
         initial-scale=1\">\n<title>{}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n{MARKS}{BODY}\
         <script type=\"application/json\" id=\"facts\">{facts}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        escaped(title)
    )
}
