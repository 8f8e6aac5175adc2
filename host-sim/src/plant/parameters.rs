//! Parameter file of a leg plant: JSON, V, µm and s.

use std::fmt;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::bouc_wen::BoucWenParameters;
use super::bound::Bound;

/// Parameters of [`super::LegPlant`], field for field as in the file. Its module has the equations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegParameters {
    /// Name of the plant in reports.
    #[serde(default)]
    pub name: String,
    /// Must be `"V, um, s"`: the units of fields without a unit in their name.
    pub units: String,
    /// Full drive u_max, V.
    pub u_max: f64,
    /// Gain from volts to µm.
    #[serde(rename = "gain_um_per_V")]
    pub gain_um_per_v: f64,
    /// s2 of the quadratic asymmetry, −1 < s2 < 1.
    pub s2: f64,
    /// κ of the rate-dependent thresholds of the plays, ≥ 0.
    pub kappa: f64,
    /// v0 of these, V/s.
    #[serde(rename = "v0_V_per_s")]
    pub v0_v_per_s: f64,
    /// Lag of the rate that widens the thresholds, s.
    pub tau_rate_s: f64,
    /// Lag of the amplifier, s.
    pub tau_amp_s: f64,
    /// Lag of the gauge and its filter, s; 0 for none. On a platform the first leg's value is for all six gauges.
    #[serde(default)]
    pub gauge_lag_s: f64,
    /// Axial resonance, Hz.
    pub fn_hz: f64,
    /// Damping ratio of that resonance, below 1.
    pub zeta: f64,
    /// r_i of the plays, V.
    #[serde(rename = "play_thresholds_V", default)]
    pub play_thresholds_v: Vec<f64>,
    /// w_i of the plays.
    #[serde(default)]
    pub play_weights: Vec<f64>,
    /// Bouc-Wen hysteresis, in place of plays.
    #[serde(default)]
    pub bouc_wen: Option<BoucWenParameters>,
    /// a_j of the creep, 1/s.
    pub creep_rates_per_s: Vec<f64>,
    /// w_j of the creep, one per rate, divided among the thresholds.
    pub creep_weights: Vec<f64>,
    /// r_k of the creep, V.
    #[serde(rename = "creep_thresholds_V")]
    pub creep_thresholds_v: Vec<f64>,
    /// Rest at 0 V between the saturating pre-cycle and the zeroing of the gauge, s.
    pub settle_s: f64,
    /// Speed of reversal curves and of the pre-cycle, V/s.
    #[serde(rename = "forc_rate_V_per_s")]
    pub forc_rate_v_per_s: f64,
    /// Longest integration step, s.
    #[serde(default = "default_step")]
    pub step_s: f64,
    /// Noise and quantisation around the leg.
    pub noise: NoiseParameters,
}

/// Noise and quantisation around a leg. All zero: none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseParameters {
    /// Gauge, white, per reading, nm rms.
    pub sensor_nm_rms: f64,
    /// Gauge converter, nm per code; 0 for none.
    pub adc_lsb_nm: f64,
    /// Drive converter, mV per code. The controller outputs exact codes, so the plant ignores it.
    #[serde(rename = "dac_lsb_mV")]
    pub dac_lsb_mv: f64,
    /// Amplifier, white, per held voltage, mV rms.
    #[serde(rename = "amplifier_mV_rms")]
    pub amplifier_mv_rms: f64,
}

impl NoiseParameters {
    /// No noise, no quantisation.
    pub const NONE: Self = Self { sensor_nm_rms: 0.0, adc_lsb_nm: 0.0, dac_lsb_mv: 0.0, amplifier_mv_rms: 0.0 };
}

fn default_step() -> f64 {
    5e-5
}

/// Reason why a parameter file was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: not a usable plant{}", findings.iter().map(|finding| format!("\n  {finding}")).collect::<String>())]
pub struct ParameterError {
    /// The file.
    pub file: String,
    /// Every finding: field, value, what is expected.
    pub findings: Vec<String>,
}

/// The reference leg's parameter file, as shipped.
pub const REFERENCE_LEG: &str = include_str!("../../plants/reference-leg.json");

/// The shipped legs, a file for each class: name, text.
pub const SHIPPED: [(&str, &str); 2] =
    [("plays", REFERENCE_LEG), ("bouc-wen", include_str!("../../plants/bouc-wen-leg.json"))];

impl LegParameters {
    /// The reference leg, whose hysteresis is plays.
    pub fn reference() -> Self {
        let [(name, text), _] = SHIPPED;
        Self::known(name, text)
    }

    /// The shipped leg with Bouc-Wen hysteresis and equal creep over five decades of time.
    pub fn bouc_wen() -> Self {
        let [_, (name, text)] = SHIPPED;
        Self::known(name, text)
    }

    fn known(name: &str, text: &str) -> Self {
        match Self::from_json(text, name) {
            Ok(parameters) => parameters,
            // The texts are part of the crate and tested; no input of a user leads here.
            Err(error) => unreachable!("{error}"),
        }
    }

    /// The shipped leg of that name, or the leg in the file that `read` returns as text.
    ///
    /// # Errors
    /// If the file cannot be read, is not JSON of this form, or a value is out of range: all findings, each with its
    /// field.
    pub fn named<E: fmt::Display>(
        name: &Path,
        read: impl FnOnce(&Path) -> Result<String, E>,
    ) -> Result<Self, ParameterError> {
        if let Some((name, text)) = SHIPPED.iter().find(|(shipped, _)| name.as_os_str() == *shipped) {
            return Self::from_json(text, name);
        }
        let file = name.display().to_string();
        match read(name) {
            Ok(text) => Self::from_json(&text, &file),
            Err(error) => {
                let finding = format!(
                    "cannot be read as text: {error}; name a JSON file of a leg plant, or `plays` or `bouc-wen`"
                );
                Err(ParameterError { file, findings: vec![finding] })
            }
        }
    }

    /// Scales the width of its hysteresis by `factor` (> 0).
    pub fn widen(&mut self, factor: f64) {
        self.play_thresholds_v.iter_mut().for_each(|threshold| *threshold *= factor);
        if let Some(bouc_wen) = &mut self.bouc_wen {
            bouc_wen.widen(factor);
        }
    }

    /// Parses and checks the text of a parameter file; `file` names it in errors.
    ///
    /// # Errors
    /// If it is not JSON of this form, or a value is out of range: all findings, each with its field.
    pub fn from_json(text: &str, file: &str) -> Result<Self, ParameterError> {
        checked(text, file, "reference-leg.json", Self::findings)
    }

    fn findings(&self) -> Vec<String> {
        let mut out = Vec::new();
        if self.units != "V, um, s" {
            out.push(format!("`units` is {:?}; expected \"V, um, s\": convert the values", self.units));
        }
        let mut expect = |field: &str, value: f64, low: Bound, high: Bound| {
            out.extend(low.and(high, field, value));
        };
        use Bound::{Above, AtLeast, AtMost, Below};
        expect("u_max", self.u_max, Above(0.0), AtMost(1000.0));
        expect("gain_um_per_V", self.gain_um_per_v, Above(0.0), AtMost(1000.0));
        expect("s2", self.s2, Above(-1.0), Below(1.0));
        expect("kappa", self.kappa, AtLeast(0.0), AtMost(10.0));
        expect("v0_V_per_s", self.v0_v_per_s, Above(0.0), AtMost(1e9));
        expect("tau_rate_s", self.tau_rate_s, AtLeast(0.0), AtMost(10.0));
        expect("tau_amp_s", self.tau_amp_s, AtLeast(0.0), AtMost(10.0));
        expect("gauge_lag_s", self.gauge_lag_s, AtLeast(0.0), AtMost(0.01));
        expect("fn_hz", self.fn_hz, Above(0.0), AtMost(1e6));
        expect("zeta", self.zeta, AtLeast(0.0), Below(1.0));
        expect("settle_s", self.settle_s, AtLeast(0.0), AtMost(600.0));
        expect("forc_rate_V_per_s", self.forc_rate_v_per_s, AtLeast(1.0), AtMost(1e6));
        expect("step_s", self.step_s, AtLeast(1e-6), AtMost(1e-3));
        expect("noise.sensor_nm_rms", self.noise.sensor_nm_rms, AtLeast(0.0), AtMost(1e6));
        expect("noise.adc_lsb_nm", self.noise.adc_lsb_nm, AtLeast(0.0), AtMost(1e6));
        expect("noise.dac_lsb_mV", self.noise.dac_lsb_mv, AtLeast(0.0), AtMost(1e6));
        expect("noise.amplifier_mV_rms", self.noise.amplifier_mv_rms, AtLeast(0.0), AtMost(1e6));
        let lists: [(&str, &[f64], Bound, f64); 5] = [
            ("play_thresholds_V", &self.play_thresholds_v, AtLeast(0.0), 1e4),
            ("play_weights", &self.play_weights, AtLeast(0.0), 1e3),
            ("creep_rates_per_s", &self.creep_rates_per_s, Above(0.0), 1e6),
            ("creep_weights", &self.creep_weights, AtLeast(0.0), 1e3),
            ("creep_thresholds_V", &self.creep_thresholds_v, AtLeast(0.0), 1e4),
        ];
        for (field, values, low, high) in lists {
            for (index, value) in values.iter().enumerate() {
                expect(&format!("{field}[{index}]"), *value, low, AtMost(high));
            }
        }
        for (field, values, ..) in lists {
            let least = usize::from(!field.starts_with("play") || self.bouc_wen.is_none());
            let count = values.len();
            let most = if least == 0 { 0 } else { 1000 };
            if !(least..=most).contains(&count) {
                out.push(format!("`{field}` has {count} values; expected {least} to {most}"));
            }
        }
        if let Some(bouc_wen) = &self.bouc_wen {
            out.extend(bouc_wen.findings());
        }
        let pairs = [
            ("play_weights", self.play_weights.len(), "play_thresholds_V", self.play_thresholds_v.len()),
            ("creep_weights", self.creep_weights.len(), "creep_rates_per_s", self.creep_rates_per_s.len()),
        ];
        for (field, count, other, expected) in pairs {
            if count != expected {
                out.push(format!("`{field}` has {count} values but `{other}` has {expected}; give one for each"));
            }
        }
        out
    }
}

/// Parameters from the text of a file, if there are no findings; `example` is the shipped file to compare with.
pub(crate) fn checked<P: DeserializeOwned>(
    text: &str,
    file: &str,
    example: &str,
    findings: fn(&P) -> Vec<String>,
) -> Result<P, ParameterError> {
    let refused = |findings| ParameterError { file: file.to_owned(), findings };
    let parameters =
        serde_json::from_str(text).map_err(|error| refused(vec![format!("{error}; compare with plants/{example}")]))?;
    let findings = findings(&parameters);
    if findings.is_empty() { Ok(parameters) } else { Err(refused(findings)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(from: &str, to: &str) -> String {
        let text = REFERENCE_LEG.replacen(from, to, 1);
        assert_ne!(text, REFERENCE_LEG, "{from} is not in the file");
        LegParameters::from_json(&text, "leg.json").unwrap_err().to_string()
    }

    #[test]
    fn the_shipped_file_is_good() {
        let reference = LegParameters::reference();
        assert_eq!(reference.play_weights.len(), 24);
        assert_eq!(reference.noise.sensor_nm_rms, 2.2);
    }

    #[test]
    fn a_leg_of_bouc_wen_has_no_plays_and_never_shortens_while_its_voltage_rises() {
        let shipped = SHIPPED[1].1;
        assert!(LegParameters::bouc_wen().bouc_wen.is_some());
        assert_eq!(
            LegParameters::named(Path::new("bouc-wen"), |path| std::fs::read_to_string(path)).unwrap(),
            LegParameters::bouc_wen()
        );
        let refused = |from: &str, to: &str| {
            let text = shipped.replacen(from, to, 1);
            assert_ne!(text, shipped, "{from}");
            LegParameters::from_json(&text, "leg.json").unwrap_err().to_string()
        };
        let plays = refused("\"fn_hz\"", "\"play_thresholds_V\": [0.0], \"play_weights\": [1.0], \"fn_hz\"");
        assert!(plays.contains("`play_weights` has 1 values; expected 0 to 0"), "{plays}");
        assert!(refused("0.43", "1.2").contains("`bouc_wen.alpha` is 1.2; expected a number > 0 and < 1"));
        assert!(refused("0.016", "-0.04").contains("would shorten while its voltage rises"));
        assert!(refused("0.016", "-0.06").contains("`bouc_wen.gamma_per_V` is -0.06; expected a number > -0.05"));
    }

    #[test]
    fn the_shipped_file_has_the_values_of_the_feasibility_study() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference/leg-plant.json");
        if !path.exists() {
            eprintln!("skipped 1: a test: ../shared is not beside the repository");
            return;
        }
        let mut study = LegParameters::named(&path, |path| std::fs::read_to_string(path)).unwrap();
        study.name = "reference-leg".to_owned();
        assert_eq!(study, LegParameters::reference());
    }

    #[test]
    fn findings_name_file_field_value_and_expectation() {
        assert_eq!(
            refused("\"u_max\": 100.0", "\"u_max\": -5"),
            "leg.json: not a usable plant\n  `u_max` is -5; expected a number > 0 and <= 1000"
        );
        assert!(refused("45.0\n", "-45.0\n").contains("`play_thresholds_V[23]` is -45"));
        assert!(refused("[0.05, ", "[").contains("`creep_weights` has 5 values but `creep_rates_per_s` has 4"));
        assert!(refused("[0.0, 6.0]", "[]").contains("`creep_thresholds_V` has 0 values"));
        assert!(refused("\"V, um, s\"", "\"V, nm, s\"").contains("`units` is \"V, nm, s\"; expected \"V, um, s\""));
        assert!(refused("\"zeta\": 0.1", "\"zeta\": 1.5").contains("`zeta` is 1.5; expected a number >= 0 and < 1"));
    }

    #[test]
    fn all_findings_come_in_one_run() {
        let text = REFERENCE_LEG.replace("\"u_max\": 100.0", "\"u_max\": 0").replace("\"s2\": 0.05", "\"s2\": 3");
        assert_eq!(LegParameters::from_json(&text, "leg.json").unwrap_err().findings.len(), 2);
    }

    #[test]
    fn missing_unknown_and_mistyped_fields_are_named_with_their_line() {
        assert!(refused("  \"kappa\": 1.2445442636136678e-06,\n", "").contains("missing field `kappa`"));
        let unknown = refused("\"kappa\"", "\"capa\"");
        assert!(unknown.contains("unknown field `capa`") && unknown.contains("line 7"), "{unknown}");
        assert!(refused("\"zeta\": 0.1", "\"zeta\": \"0.1\"").contains("invalid type: string"));
        assert!(refused("\"zeta\": 0.1", "\"zeta\": NaN").contains("line 12"));
        let absent = LegParameters::named(Path::new("no/such.json"), |path| std::fs::read_to_string(path))
            .unwrap_err()
            .to_string();
        assert!(absent.starts_with("no/such.json: not a usable plant\n  cannot be read"), "{absent}");
    }
}
