//! Joints in the forms that people have: a CSV file, the directions of a data sheet, frames of one's own.

use std::fs;

use crate::support::specs::{errors, folder_with_records, source};
use specgen::compile::compile_source;
use specgen::diagnostic::{Diagnostic, codes};
use specgen::model::Model;
use specgen::spec;
use specgen_tests::repository;

/// The spec with joints one by one, with the lines of its joints replaced.
fn with(joints: &str) -> String {
    let text = fs::read_to_string(repository().join("specs/features/platform-joints.toml")).expect("readable");
    let (start, end) = (text.find("base_joints = ").expect("joints"), text.find("height = ").expect("height"));
    let text = format!("{}{joints}\n{}", &text[..start], &text[end..]);
    // What is assumed of joints that are not there is refused, which is not the subject.
    text.replace("\"geometry.base_joints\", \"geometry.platform_joints\", ", "")
}

fn load(joints: &str) -> (Option<Model>, Vec<Diagnostic>) {
    spec::load(&source(&with(joints), "spec.toml", &folder_with_records()))
}

fn joints(lines: &str) -> [[[f64; 3]; 6]; 2] {
    let (model, findings) = load(lines);
    let geometry = model.unwrap_or_else(|| panic!("{lines}: {findings:#?}")).geometry;
    [geometry.base_joints, geometry.platform_joints]
}

fn original() -> [[[f64; 3]; 6]; 2] {
    let text = fs::read_to_string(repository().join("specs/features/platform-joints.toml")).expect("readable");
    let (start, end) = (text.find("base_joints = ").expect("joints"), text.find("height = ").expect("height"));
    joints(&text[start..end])
}

fn distance(a: &[[[f64; 3]; 6]; 2], b: &[[[f64; 3]; 6]; 2]) -> f64 {
    let pairs = a.as_flattened().as_flattened().iter().zip(b.as_flattened().as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_file_has_the_bits_of_the_same_joints_one_by_one() {
    let expected = original();
    let found = joints("joints = \"joints.csv\"");
    let bits =
        |all: [[[f64; 3]; 6]; 2]| all.as_flattened().as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(found), bits(expected));
}

/// Two machines whose specs differ in the file alone are different controllers: a target refuses the other one's image.
#[test]
fn the_digest_covers_the_joints_of_the_file() {
    let folder = folder_with_records();
    let record = fs::read_to_string(repository().join("specs/records/reference-forc.csv")).expect("readable");
    fs::write(folder.path().join("records/reference-forc.csv"), record).expect("written");
    let place = folder.path().join("specs/joints.csv");
    let csv = fs::read_to_string(&place).expect("readable");
    let digest = |csv: &str| {
        fs::write(&place, csv).expect("written");
        let compiled = compile_source(source(&with("joints = \"joints.csv\""), "spec.toml", &folder));
        compiled.map(|compiled| compiled.ir.digest).unwrap_or_else(|refusal| panic!("{:#?}", refusal.findings))
    };
    let first = digest(&csv);
    assert_eq!(first, digest(&csv.replace("81,125,2", "81.0,125.0,2.0")));
    assert_ne!(first, digest(&csv.replace("81,125,2", "81.001,125,2")));
}

#[test]
fn six_directions_of_a_circle_are_the_joint_circles() {
    let radii = "base_radius = \"150 mm\"\nplatform_radius = \"100 mm\"\n";
    let circles = joints(&format!("{radii}base_angle = \"2.16 deg\"\nplatform_angle = \"2.16 deg\""));
    let base =
        "base_angles = [\"58.92 deg\", \"61.08 deg\", \"178.92 deg\", \"181.08 deg\", \"298.92 deg\", \"301.08 deg\"]";
    let platform = "platform_angles = [\"1.08 deg\", \"118.92 deg\", \"121.08 deg\", \"238.92 deg\", \"241.08 deg\", \"-1.08 deg\"]";
    let angles = joints(&format!("{radii}{base}\n{platform}"));
    assert!(distance(&circles, &angles) < 1e-15, "{}", distance(&circles, &angles));
}

/// A CAD frame with z down and its origin 1 m away: x and the angle about it turn the joints back.
#[test]
fn joints_of_another_frame_are_brought_into_that_of_their_body() {
    let expected = original();
    let quantity = |v: f64| format!("\"{} mm\"", v * 1e3);
    // {B} lies at (1 m, 0.2 m, -0.3 m) of the CAD frame, turned by 180 degrees about x: y and z change their signs.
    let list = |joints: [[f64; 3]; 6]| {
        let rows =
            joints.map(|[x, y, z]| format!("[{}, {}, {}]", quantity(1.0 + x), quantity(0.2 - y), quantity(-0.3 - z)));
        format!("[{}]", rows.join(", "))
    };
    let given = format!("base_joints = {}\nplatform_joints = {}\n", list(expected[0]), list(expected[1]));
    let frame = "[\"1 m\", \"200 mm\", \"-300 mm\", \"180 deg\", \"0 deg\", \"0 deg\"]";
    let found = joints(&format!("{given}base_frame = {frame}\nplatform_frame = {frame}"));
    assert!(distance(&found, &expected) < 1e-15, "{}", distance(&found, &expected));
}

#[test]
fn two_forms_and_half_a_form_are_refused_at_their_key() {
    let radii = "base_radius = \"150 mm\"\nplatform_radius = \"100 mm\"\n";
    let angles = "[\"58 deg\", \"61 deg\", \"178 deg\", \"181 deg\", \"298 deg\", \"301 deg\"]";
    for (lines, code, key) in [
        (format!("{radii}base_angles = {angles}"), codes::MISSING_KEY, "geometry.platform_angles"),
        (format!("{radii}base_angle = \"2 deg\"\nbase_angles = {angles}"), codes::ALTERNATIVES, "geometry.base_angles"),
        (format!("{radii}joints = \"joints.csv\""), codes::ALTERNATIVES, "geometry.joints"),
        ("joints = \"other.csv\"".to_owned(), codes::JOINT_FILE, "geometry.joints"),
        ("joints = \"records/leg1.csv\"".to_owned(), codes::JOINT_FILE, "geometry.joints"),
        ("joints = \"/joints.csv\"".to_owned(), codes::RECORD_PATH, "geometry.joints"),
    ] {
        let (_, findings) = load(&lines);
        let found: Vec<_> = errors(&findings).iter().map(|finding| (finding.code, finding.key.as_str())).collect();
        assert_eq!(found, [(code.id, key)], "{lines}");
    }
    let (_, findings) = load("joints = \"records/leg1.csv\"");
    assert!(findings[0].message.contains("\"records/leg1.csv\", line 1: the file is empty"), "{}", findings[0].message);
}
