//! `specgen dynamics` as a user runs it.
use crate::support::{Folder, length, repository};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::Value;

fn reference() -> (String, Value) {
    let path = repository().join("tests/oracle/dynamics-reference.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let document = serde_json::from_str(&text).unwrap();
    (text, document)
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn same(found: &Value, expected: &Value, tolerance: f64) {
    let (found, expected) = (numbers(found), numbers(expected));
    let size = expected.iter().fold(0.0, |sum: f64, x| sum + x * x).sqrt();
    let error = found.iter().zip(&expected).fold(0.0, |sum: f64, (a, b)| sum + (a - b) * (a - b)).sqrt();
    assert!(found.len() == expected.len() && error <= tolerance * size.max(1e-9), "{error:e} of {size}");
}

#[test]
fn the_reference_vectors_come_back_with_every_field() {
    let folder = Folder::new();
    let (text, expected) = reference();
    folder.write("states.json", text);
    let run = folder.run(&["dynamics", "reference.toml", "--states", "states.json", "-o", "out.json"]);
    assert_eq!(run.code, 0, "{run:?}");
    let found: Value = serde_json::from_str(&folder.read("out.json")).unwrap();
    let (found, expected) = (found["vectors"].as_array().unwrap(), expected["vectors"].as_array().unwrap());
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found["id"], expected["id"]);
        for key in ["leg_lengths", "J", "M", "Cv", "G", "F", "leg_forces"] {
            same(&found[key], &expected[key], 1e-12);
        }
    }
}

#[test]
fn csv_from_rest_gives_what_json_gives_from_the_base() {
    let folder = Folder::new();
    folder.write(
        "rest.csv",
        "x,y,z,a,b,c,vx,vy,vz,va,vb,vc,ax,ay,az,aa,ab,ac\n0,0,0.001,0,0.01,0,0,0,0,0,0,0,1,0,0,0,0,2\n",
    );
    folder.write(
        "base.json",
        r#"[{"h": [0, 0, 0.181, 0, 0.01, 0], "hd": [0, 0, 0, 0, 0, 0], "hdd": [1, 0, 0, 0, 0, 2]}]"#,
    );
    let rest = folder.json(&["dynamics", "reference.toml", "--states", "rest.csv", "--from-rest"]);
    let base = folder.json(&["dynamics", "reference.toml", "--states", "base.json"]);
    let (rest, base) = (&rest.value["result"]["vectors"][0], &base.value["result"]["vectors"][0]);
    for key in ["J", "M", "G", "leg_forces"] {
        same(&rest[key], &base[key], 1e-12);
    }
}

#[test]
fn bad_states_are_refused_in_words() {
    let folder = Folder::new();
    for (name, content, words) in [
        ("empty.json", "[]", "no states"),
        ("broken.json", "[{", "not JSON"),
        ("short.json", r#"[{"h": [0, 0], "hd": [], "hdd": []}]"#, "`h` must be six numbers"),
        ("object.json", r#"{"states": []}"#, "`vectors`"),
        ("short.csv", "x,y,z\n1,2,3\n", "there are 3 columns, expected 18"),
        ("unnamed.csv", "0,0,0.18,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "names the columns, but `0` is a number"),
        ("nan.csv", "NAMES\n0,0,NaN,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "`z` is `NaN`, not a finite number"),
        ("tilted.csv", "NAMES\n0,0,0.18,0,0.8,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "range of the dynamics"),
        ("far.csv", "NAMES\n0,0,0.5,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", "range of the dynamics"),
    ] {
        folder.write(name, content.replace("NAMES", "x,y,z,a,b,c,vx,vy,vz,va,vb,vc,ax,ay,az,aa,ab,ac"));
        folder.run(&["dynamics", "reference.toml", "--states", name]).says(1, &[words, name]);
    }
    folder.run(&["dynamics", "reference.toml", "--states", "none.csv"]).says(1, &["none.csv", "cannot be read"]);
}

/// All numbers in the text, without a JSON parser.
fn number_texts(document: &str) -> Vec<String> {
    let pieces = document.split(|c: char| c.is_ascii_whitespace() || "[]{},:".contains(c));
    pieces.filter(|piece| piece.parse::<f64>().is_ok()).map(str::to_owned).collect()
}

/// Number of `texts` that the binary does not parse as the nearest double. They are passed as rates and accelerations, which the
/// result repeats. The nearest double is that of `core`, which parses every decimal exactly.
fn misread(texts: &[String]) -> usize {
    let folder = Folder::new();
    let state = |texts: &[String]| {
        let text = |k: usize| texts.get(k).map_or("0", String::as_str);
        let six = |from: usize| (from..from + 6).map(text).collect::<Vec<_>>().join(", ");
        format!(r#"{{"h": [0, 0, 0.181, 0, 0.01, 0], "hd": [{}], "hdd": [{}]}}"#, six(0), six(6))
    };
    let states: Vec<String> = texts.chunks(12).map(state).collect();
    folder.write("states.json", format!("[{}]", states.join(",\n")));
    let run = folder.run(&["dynamics", "reference.toml", "--states", "states.json", "-o", "out.json"]);
    assert_eq!(run.code, 0, "{run:?}");
    let out = folder.read("out.json");
    let fields = |key: &str| -> Vec<f64> {
        let start = format!("\"{key}\": [");
        let rows = out.split(&start).skip(1).map(|rest| rest.split(']').next().unwrap());
        rows.flat_map(|row| row.split(',').map(|number| number.trim().parse::<f64>().unwrap())).collect()
    };
    let (rates, accelerations) = (fields("hd"), fields("hdd"));
    let found = rates.chunks(6).zip(accelerations.chunks(6)).flat_map(|(a, b)| a.iter().chain(b));
    assert_eq!(rates.len() + accelerations.len(), texts.len().div_ceil(12) * 12);
    found.zip(texts).filter(|(found, text)| found.to_bits() != text.parse::<f64>().unwrap().to_bits()).count()
}

/// The binary under test has the features of a user's binary (`tests/tests/features.rs`): what holds here holds there.
#[test]
fn no_number_of_the_oracle_is_misread() {
    let mut texts = Vec::new();
    for name in ["reference", "asymmetric"] {
        let path = repository().join(format!("tests/oracle/dynamics-{name}.json"));
        texts.extend(number_texts(&std::fs::read_to_string(path).unwrap()));
    }
    assert!(texts.len() >= 4_635, "only {} numbers", texts.len());
    assert_eq!(misread(&texts), 0, "of {}", texts.len());
}

#[test]
fn no_double_is_misread_however_it_is_written() {
    let mut random = ChaCha8Rng::seed_from_u64(13);
    let mut texts: Vec<String> = [
        "-0.0",
        "5e-324",
        "2.2250738585072011e-308",
        "1.7976931348623157e308",
        "1e23",
        "9007199254740993",
        "9007199254740993.0000000000000000000000000000000000000000000000000000001",
        "0.1000000000000000055511151231257827021181583404541015625",
        "123456789012345678901234567890",
    ]
    .map(str::to_owned)
    .to_vec();
    for k in 0..length(6_000, 30_000) {
        // Every tenth is a subnormal, because of the shift.
        let bits = random.next_u64();
        let value = f64::from_bits(if k % 10 == 0 { bits >> 12 } else { bits });
        if !value.is_finite() {
            continue;
        }
        texts.push(match k % 3 {
            0 => format!("{value:?}"),
            1 => format!("{value:e}"),
            // More digits than any double needs.
            _ => format!("{value:.24e}"),
        });
    }
    assert_eq!(misread(&texts), 0, "of {}", texts.len());
}
