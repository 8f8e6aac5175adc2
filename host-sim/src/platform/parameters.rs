//! Parameter file of a platform plant: JSON, SI units. Values that the paper does not give are assumed, as in the spec
//! of the reference platform. The legs have their own file ([`LegParameters`]).

use serde::{Deserialize, Serialize};

use super::gauge::Probe;
use super::geometry::Geometry;
use super::imperfections::Imperfections;
use super::inertia::Masses;
use super::linear::{Matrix3, Six, Three, dot};
use crate::plant::{Bound, ParameterError, checked};

/// Places of the joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joints {
    /// B_i in {B}, m.
    #[serde(rename = "base_m")]
    pub base: [Three; 6],
    /// P_i in {P}, m.
    #[serde(rename = "platform_m")]
    pub platform: [Three; 6],
}

/// Parameters of a platform, field for field as in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlatformParameters {
    /// Name of the plant in reports.
    #[serde(default)]
    pub name: String,
    /// Must be `"SI"`.
    pub units: String,
    /// r_B, m.
    #[serde(default)]
    pub base_radius_m: f64,
    /// r_P, m.
    #[serde(default)]
    pub platform_radius_m: f64,
    /// α_B in half turns.
    #[serde(default)]
    pub base_angle_over_pi: f64,
    /// α_P in half turns.
    #[serde(default)]
    pub platform_angle_over_pi: f64,
    /// Joints one by one, in place of the four numbers above.
    #[serde(default)]
    pub joints: Option<Joints>,
    /// z of P_C at rest, m.
    pub height_m: f64,
    /// Platform, kg.
    pub platform_mass_kg: f64,
    /// Its inertia tensor about its centre of mass in {P}, kg m².
    pub platform_inertia_kg_m2: Matrix3,
    /// Its centre of mass in {P}, m.
    pub platform_center_m: Three,
    /// Fixed part of a leg, kg.
    pub fixed_mass_kg: f64,
    /// Extensible part of a leg, kg.
    pub extensible_mass_kg: f64,
    /// Transverse inertia of the fixed part, kg m².
    pub fixed_inertia_kg_m2: f64,
    /// Transverse inertia of the extensible part, kg m².
    pub extensible_inertia_kg_m2: f64,
    /// l_s, m.
    pub fixed_center_m: f64,
    /// l_e, m.
    pub extensible_center_m: f64,
    /// g, m/s².
    pub gravity_m_per_s2: f64,
    /// k_a of a leg, N/m.
    pub axial_stiffness_n_per_m: f64,
    /// ζ of the lowest mode: every leg has c_a = β k_a with β = 2ζ/ω_1.
    pub modal_damping: f64,
    /// Capacitance of the stacks of a leg, F.
    pub stack_capacitance_f: f64,
    /// Largest current of an amplifier, A: with the capacitance it limits the rate of the stack voltage.
    pub amplifier_current_a: f64,
    /// Lowest voltage, V: zero of the legs' drive; gauges are zeroed there.
    #[serde(default)]
    pub lowest_voltage_v: f64,
    /// Voltage of the legs before a run, V, not below the lowest.
    #[serde(default)]
    pub rest_voltage_v: f64,
    /// The six gauges.
    pub probes: [Probe; 6],
    /// Lowest and highest reading of a gauge, m.
    pub gauge_range_m: [f64; 2],
    /// Force sensor: N and N m rms.
    pub force_noise: Six,
    /// Force sensor: largest readings, N and N m.
    pub force_range: Six,
    /// Longest integration step, s, at most 20 µs.
    pub step_s: f64,
    /// What it has beyond a rigid platform on ideal legs; none if absent.
    #[serde(default, skip_serializing_if = "Imperfections::is_none")]
    pub imperfections: Imperfections,
}

/// The reference platform's parameter file, as shipped.
pub const REFERENCE_PLATFORM: &str = include_str!("../../plants/reference-platform.json");

impl PlatformParameters {
    /// The reference platform.
    pub fn reference() -> Self {
        match Self::from_json(REFERENCE_PLATFORM, "reference-platform.json") {
            Ok(parameters) => parameters,
            // The text is part of the crate and tested; no input of a user leads here.
            Err(error) => unreachable!("{error}"),
        }
    }

    /// Parses and checks the text of a parameter file; `file` names it in errors.
    ///
    /// # Errors
    /// If it is not JSON of this form, or a value is out of range: all findings, each with its field.
    pub fn from_json(text: &str, file: &str) -> Result<Self, ParameterError> {
        checked(text, file, "reference-platform.json", Self::findings)
    }

    /// Joints.
    pub fn geometry(&self) -> Geometry {
        if let Some(Joints { base, platform }) = self.joints {
            return Geometry { base_joints: base, platform_joints: platform, height: self.height_m };
        }
        let angle = |over_pi: f64| over_pi * core::f64::consts::PI;
        Geometry::hexagonal(
            [self.base_radius_m, self.platform_radius_m],
            [angle(self.base_angle_over_pi), angle(self.platform_angle_over_pi)],
            self.height_m,
        )
    }

    /// Masses.
    pub fn masses(&self) -> Masses {
        Masses {
            platform: self.platform_mass_kg,
            platform_inertia: self.platform_inertia_kg_m2,
            center: self.platform_center_m,
            fixed: self.fixed_mass_kg,
            extensible: self.extensible_mass_kg,
            fixed_inertia: self.fixed_inertia_kg_m2,
            extensible_inertia: self.extensible_inertia_kg_m2,
            fixed_center: self.fixed_center_m,
            extensible_center: self.extensible_center_m,
            gravity: self.gravity_m_per_s2,
        }
    }

    fn findings(&self) -> Vec<String> {
        use Bound::{Above, AtLeast, AtMost, Below};
        let mut out = Vec::new();
        if self.units != "SI" {
            out.push(format!("`units` is {:?}; expected \"SI\": convert the values", self.units));
        }
        let mut expect = |field: &str, value: f64, low: Bound, high: Bound| out.extend(low.and(high, field, value));
        for (field, value, high) in [
            ("height_m", self.height_m, 100.0),
            ("platform_mass_kg", self.platform_mass_kg, 1e6),
            ("axial_stiffness_n_per_m", self.axial_stiffness_n_per_m, 1e12),
            ("stack_capacitance_f", self.stack_capacitance_f, 1.0),
            ("amplifier_current_a", self.amplifier_current_a, 1e6),
        ] {
            expect(field, value, Above(0.0), AtMost(high));
        }
        for (field, value, high) in [
            ("fixed_mass_kg", self.fixed_mass_kg, 1e6),
            ("extensible_mass_kg", self.extensible_mass_kg, 1e6),
            ("fixed_inertia_kg_m2", self.fixed_inertia_kg_m2, 1e6),
            ("extensible_inertia_kg_m2", self.extensible_inertia_kg_m2, 1e6),
            ("fixed_center_m", self.fixed_center_m, 100.0),
            ("extensible_center_m", self.extensible_center_m, 100.0),
            ("gravity_m_per_s2", self.gravity_m_per_s2, 100.0),
        ] {
            expect(field, value, AtLeast(0.0), AtMost(high));
        }
        if let Some(Joints { base, platform }) = &self.joints {
            for (field, joints) in [("base_m", base), ("platform_m", platform)] {
                for (k, value) in joints.as_flattened().iter().enumerate() {
                    expect(&format!("joints.{field}[{}][{}]", k / 3, k % 3), *value, AtLeast(-100.0), AtMost(100.0));
                }
            }
        } else {
            expect("base_radius_m", self.base_radius_m, Above(0.0), AtMost(100.0));
            expect("platform_radius_m", self.platform_radius_m, Above(0.0), AtMost(100.0));
            expect("base_angle_over_pi", self.base_angle_over_pi, AtLeast(0.0), Below(2.0 / 3.0));
            expect("platform_angle_over_pi", self.platform_angle_over_pi, AtLeast(0.0), Below(2.0 / 3.0));
        }
        expect("lowest_voltage_v", self.lowest_voltage_v, AtLeast(-1e4), AtMost(1e4));
        expect("rest_voltage_v", self.rest_voltage_v, AtLeast(self.lowest_voltage_v), AtMost(1e4));
        expect("modal_damping", self.modal_damping, AtLeast(0.0), Below(0.5));
        expect("step_s", self.step_s, AtLeast(1e-7), AtMost(2e-5));
        expect("gauge_range_m[0]", self.gauge_range_m[0], AtLeast(-1.0), Below(0.0));
        expect("gauge_range_m[1]", self.gauge_range_m[1], Above(0.0), AtMost(1.0));
        for k in 0..6 {
            expect(&format!("force_noise[{k}]"), self.force_noise[k], AtLeast(0.0), AtMost(1e6));
            expect(&format!("force_range[{k}]"), self.force_range[k], Above(0.0), AtMost(1e9));
            let probe = &self.probes[k];
            for (field, vector) in [("direction", probe.direction), ("plane_normal", probe.plane_normal)] {
                let length = libm::sqrt(dot(&vector, &vector));
                expect(&format!("length of probes[{k}].{field}"), length, AtLeast(1.0 - 1e-9), AtMost(1.0 + 1e-9));
            }
            let facing = dot(&probe.direction, &probe.plane_normal);
            expect(&format!("probes[{k}].direction · plane_normal"), facing.abs(), AtLeast(0.1), AtMost(1.0 + 1e-9));
            for (field, vector) in [("point_m", probe.point), ("plane_point_m", probe.plane_point)] {
                for value in vector {
                    expect(&format!("probes[{k}].{field}"), value, AtLeast(-100.0), AtMost(100.0));
                }
            }
            expect(
                &format!("platform_center_m[{}]", k / 2),
                self.platform_center_m[k / 2],
                AtLeast(-100.0),
                AtMost(100.0),
            );
        }
        let inertia = &self.platform_inertia_kg_m2;
        for row in 0..3 {
            expect(&format!("platform_inertia_kg_m2[{row}][{row}]"), inertia[row][row], Above(0.0), AtMost(1e9));
            for column in 0..row {
                let asymmetry = inertia[row][column] - inertia[column][row];
                expect(&format!("asymmetry of platform_inertia_kg_m2[{row}]"), asymmetry, AtLeast(0.0), AtMost(0.0));
            }
        }
        out.extend(self.imperfections.findings());
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(from: &str, to: &str) -> String {
        let text = REFERENCE_PLATFORM.replacen(from, to, 1);
        assert_ne!(text, REFERENCE_PLATFORM, "{from} is not in the file");
        PlatformParameters::from_json(&text, "platform.json").unwrap_err().to_string()
    }

    #[test]
    fn the_shipped_file_is_good() {
        assert_eq!(PlatformParameters::reference().platform_mass_kg, 1.195);
    }

    #[test]
    fn joints_one_by_one_are_those_of_the_circles_they_lie_on() {
        let circles = PlatformParameters::reference();
        let Geometry { base_joints, platform_joints, .. } = circles.geometry();
        let list = format!("\"joints\": {{\"base_m\": {base_joints:?}, \"platform_m\": {platform_joints:?}}}");
        let from = REFERENCE_PLATFORM.find("\"base_radius_m\"").unwrap();
        let to = REFERENCE_PLATFORM.find("\"height_m\"").unwrap();
        let text = format!("{}{list},\n  {}", &REFERENCE_PLATFORM[..from], &REFERENCE_PLATFORM[to..]);
        let explicit = PlatformParameters::from_json(&text, "platform.json").unwrap();
        // The JSON reader may miss the last bit of a number.
        let (found, expected) = (explicit.geometry(), circles.geometry());
        let joints = |g: &Geometry| [g.base_joints, g.platform_joints].as_flattened().as_flattened().to_vec();
        assert!(joints(&found).iter().zip(joints(&expected)).all(|(a, b)| (a - b).abs() < 1e-16));
        assert_eq!(found.height, expected.height);
        let neither = format!("{}{}", &REFERENCE_PLATFORM[..from], &REFERENCE_PLATFORM[to..]);
        let refusal = PlatformParameters::from_json(&neither, "platform.json").unwrap_err().to_string();
        assert!(refusal.contains("`base_radius_m` is 0; expected a number > 0"), "{refusal}");
    }

    #[test]
    fn findings_name_the_field_its_value_and_what_is_expected() {
        assert_eq!(
            refused("\"height_m\": 0.18", "\"height_m\": -0.18"),
            "platform.json: not a usable plant\n  `height_m` is -0.18; expected a number > 0 and <= 100"
        );
        assert!(refused("\"SI\"", "\"mm\"").contains("`units` is \"mm\"; expected \"SI\""));
        assert!(refused("2e-5", "5e-5").contains("`step_s` is 0.00005"));
        assert!(refused("[0.0326, 0.0, 0.0]", "[0.0326, 0.1, 0.0]").contains("asymmetry of platform_inertia"));
        let slanted = refused("\"direction\": [0.0, 0.0, 1.0]", "\"direction\": [1.0, 0.0, 0.0]");
        assert!(slanted.contains("probes[0].direction · plane_normal"), "{slanted}");
        assert!(refused("\"height_m\"", "\"heigth_m\"").contains("unknown field `heigth_m`"));
    }
}
