//! The physical lint: values that are legal one by one and make no sense together.
//!
//! Almost every mistake in a spec is a unit (a factor of a thousand), a sign, or two swapped axes. Such a value is in range,
//! but inconsistent with the rest of the platform. So every rule compares one value with what others imply, reports both
//! numbers, and names the key that it suspects. Thresholds are wide: a factor of a thousand is far outside, an unusual
//! platform well inside.
//!
//! A value seven or more times beyond its threshold is an error, unless `[lint] allow` names its key with a reason: see
//! [`allow()`]. That applies to measured or purchased properties (sizes, masses, stacks, electronics, gauges). Design
//! choices (workspace, limits of moves, budgets) cause at most a warning.
//!
//! Hard limits are checked elsewhere: ranges and consistency in [`specgen_language::spec`], reach in [`crate::reach`],
//! stability in [`crate::stability`], paths in [`crate::lower::setpoint`], gauges in [`crate::lower`].

/// The lints of a file: the rules in the order in which they run, then each finding with its page as the comment above it.
/// The page is Markdown: a heading with code and title, what is checked, and *Why it matters*, *Example* and *Fix*.
macro_rules! lints {
    (rules: $($rule:ident),*; $($(#[doc = $line:literal])* $name:ident = $code:literal;)*) => {
        $($(#[doc = $line])* pub static $name: $crate::lint::Code = $crate::lint::Code::new($code, &[$($line),*]);)*
        pub(super) static LINTS: $crate::lint::Lints = $crate::lint::Lints { rules: &[$($rule),*], codes: &[$($name),*] };
    };
}

mod actuator;
mod alike;
mod allow;
mod bodies;
mod budget;
mod contact;
mod cross_talk;
mod culprit;
mod electronics;
mod factors;
mod frames;
mod gauge_layout;
mod gauge_pattern;
mod gauge_places;
mod gauges;
mod layout;
mod motion;
mod order;
mod pairs;
pub mod paths;
mod requirements;
mod tick;
mod timing;
mod triggers;
mod weights;

pub use allow::{allow, unused};
pub use budget::{estimated, least};
pub use culprit::in_order;
pub use factors::say_once;

use specgen_runtime::Platform;

use crate::figure::{AXES, figure};
use crate::stability::platform::{ModalBasis, RestDynamics};
use frames::OTHER_FRAME;
use specgen_language::diagnostic::{Code, Diagnostic};
use specgen_language::model::Model;

/// A rule looks at the platform and reports what it finds.
type Rule = fn(&Facts, &mut Findings);

/// The lints of a file.
struct Lints {
    rules: &'static [Rule],
    codes: &'static [Code],
}

macro_rules! families {
    ($($family:ident)+) => { static FAMILIES: &[&Lints] = &[$(&$family::LINTS),+]; };
}
// In the order in which they run: a rule may read the findings of earlier ones. The last three have no rule.
families! {
    layout order frames pairs bodies actuator electronics gauges gauge_places gauge_pattern gauge_layout alike contact
    cross_talk weights timing tick motion triggers requirements factors budget allow culprit paths
}

/// A value this many times beyond its threshold is an error. Where a value enters as its square root, as a stiffness does in a
/// resonance, a factor of a thousand counts as 32; no such rule has a threshold wider than 4.5.
const FAR_OFF: f64 = 7.0;

/// How many times `value` lies beyond the nearer end of `sound`; 1 or less: inside.
fn times_beyond(value: f64, sound: &core::ops::RangeInclusive<f64>) -> f64 {
    let (below, above) = (sound.start() / value, value / sound.end());
    if below > above { below } else { above }
}

/// Input of every rule.
pub(crate) struct Facts<'a> {
    model: &'a Model,
    /// The legs at rest; none if the geometry is singular.
    legs: Option<Legs>,
}

/// Legs and modes at rest.
struct Legs {
    /// J = ∂l/∂h, 1 and m/rad.
    jacobian: [[f64; 6]; 6],
    /// m.
    lengths: [f64; 6],
    /// Modes of the platform on its legs, Hz, ascending.
    modes: Option<[f64; 6]>,
}

impl Legs {
    fn of(model: &Model, platform: &Platform<f64>) -> Self {
        let rest = RestDynamics::of(platform);
        let basis = ModalBasis::of(&rest, model.actuator.axial_stiffness);
        Self {
            jacobian: rest.jacobian,
            lengths: platform.rest_lengths(),
            modes: basis.map(|basis| basis.frequencies.map(|omega| omega / core::f64::consts::TAU)),
        }
    }

    /// Stiffness of each axis of the platform on its legs, N/m and N m/rad: the diagonal of Jᵀ k_a J.
    fn stiffness(&self, of_leg: f64) -> [f64; 6] {
        core::array::from_fn(|axis| self.jacobian.iter().fold(0.0, |sum, row| sum + row[axis] * row[axis]) * of_leg)
    }

    fn shortest(&self) -> f64 {
        self.lengths.into_iter().fold(f64::INFINITY, |a, b| if b < a { b } else { a })
    }

    /// Largest leg motion per unit motion of an axis.
    fn steepest(&self, axis: usize) -> f64 {
        self.jacobian.iter().map(|row| row[axis].abs()).fold(0.0, |a: f64, b| if b > a { b } else { a })
    }
}

/// The findings of all lints.
pub(crate) fn codes() -> impl Iterator<Item = Code> {
    FAMILIES.iter().flat_map(|family| family.codes.iter().copied())
}

/// Findings about inconsistent values, in the order of the rules.
pub fn check(model: &Model) -> Vec<Diagnostic> {
    // A singular geometry is reported elsewhere; rules that need the legs are skipped.
    let legs = crate::lower::platform(model).ok().map(|platform| Legs::of(model, &platform));
    let facts = Facts { model, legs };
    let mut found = Findings { model, list: Vec::new() };
    for rule in FAMILIES.iter().flat_map(|family| family.rules) {
        rule(&facts, &mut found);
    }
    found.list
}

/// Collects findings at their places.
pub(crate) struct Findings<'a> {
    model: &'a Model,
    list: Vec<Diagnostic>,
}

impl<'a> Findings<'a> {
    pub(crate) const fn new(model: &'a Model) -> Self {
        Self { model, list: Vec::new() }
    }

    pub(crate) fn list(self) -> Vec<Diagnostic> {
        self.list
    }

    /// Whether this gauge has a finding [`OTHER_FRAME`]: that explains other oddities of the gauge.
    fn is_in_other_frame(&self, gauge: usize) -> bool {
        let of_gauge = format!("gauge[{gauge}].");
        self.list.iter().any(|one| one.code == OTHER_FRAME && one.key.starts_with(&of_gauge))
    }

    /// Adds a finding about a value `times` beyond its threshold: an error from [`FAR_OFF`] on.
    fn add_off(&mut self, times: f64, code: Code, key: &str, message: String, help: &str) {
        if times < FAR_OFF || times.is_nan() {
            return self.add(code, key, message, help);
        }
        let message = match times.is_finite() {
            true => format!("{message}; that is {} times beyond the limit of the check", figure(times)),
            false => format!("{message}; that is infinitely far beyond the limit of the check"),
        };
        let help = format!("{help}; if it is intended, give the reason in [lint]: allow = [\"{key}: <reason>\"]");
        self.add(allow::FAR_OFF, key, message, &help);
    }

    /// Adds a finding at `key`, or at its list or section if only that is in the spec.
    fn add(&mut self, code: Code, key: &str, message: String, help: &str) {
        let list = key.rsplit_once('[').filter(|_| key.ends_with(']')).map_or(key, |(list, _)| list);
        let section = key.rsplit_once('.').map_or(key, |(section, _)| section);
        let keys = [key, list, section];
        let mut finding = Diagnostic::at(&self.model.spans, &keys, code, message, help);
        // The suspected key, even if only its section has a place.
        key.clone_into(&mut finding.key);
        self.list.push(finding);
    }
}

/// A length or an angle of an axis, with its unit.
fn amount(axis: usize, value: f64) -> String {
    format!("{} {}", figure(value * 1e6), if axis < 3 { "um" } else { "urad" })
}
