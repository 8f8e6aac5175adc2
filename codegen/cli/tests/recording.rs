//! `specgen sim --record` and `specgen replay` as a user runs them, for both kinds of controller.

use std::collections::BTreeMap;
use std::fs;

use serde_json::Value;

use crate::support::{Folder, length};

/// Takes a field from the front of an MCAP record: a number, or data after its length.
fn number(bytes: &mut &[u8], size: usize) -> u64 {
    let (field, rest) = bytes.split_at(size);
    *bytes = rest;
    field.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn text<'a>(bytes: &mut &'a [u8]) -> &'a str {
    let length = number(bytes, 4) as usize;
    let (text, rest) = bytes.split_at(length);
    *bytes = rest;
    std::str::from_utf8(text).unwrap()
}

/// Offset, kind and content of each record.
fn records(bytes: &[u8]) -> Vec<(usize, u8, &[u8])> {
    let (mut rest, mut all) = (bytes, Vec::new());
    while !rest.is_empty() {
        let place = bytes.len() - rest.len();
        let (kind, length) = (number(&mut rest, 1) as u8, number(&mut rest, 8) as usize);
        let (content, behind) = rest.split_at(length);
        all.push((place, kind, content));
        rest = behind;
    }
    all
}

/// Every message (topic, time, schema, value), parsed by the specification of the format; also checks the index.
fn messages(bytes: &[u8]) -> Vec<(String, u64, Value, Value)> {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let inner = bytes.strip_prefix(MAGIC).and_then(|bytes| bytes.strip_suffix(MAGIC)).unwrap();
    let (mut channels, mut all) = (BTreeMap::new(), Vec::new());
    let (mut schemas, mut indexed) = (BTreeMap::new(), 0);
    let records_of_all = records(inner);
    for (_, kind, content) in &records_of_all {
        let mut fields = *content;
        match kind {
            3 => {
                let id = number(&mut fields, 2);
                let (_, encoding) = (text(&mut fields), text(&mut fields));
                assert_eq!(encoding, "jsonschema");
                schemas.insert(id, serde_json::from_str::<Value>(text(&mut fields)).unwrap());
            }
            4 => {
                let (id, schema) = (number(&mut fields, 2), number(&mut fields, 2));
                channels.insert(id, (text(&mut fields).to_owned(), schema));
                assert_eq!(text(&mut fields), "json");
            }
            6 => {
                fields = &fields[8 + 8 + 8 + 4..];
                assert_eq!(text(&mut fields), "");
                assert_eq!(number(&mut fields, 8) as usize, fields.len());
                for (_, kind, content) in records(fields) {
                    let mut fields = content;
                    let (id, _, time, _) = (
                        number(&mut fields, 2),
                        number(&mut fields, 4),
                        number(&mut fields, 8),
                        number(&mut fields, 8),
                    );
                    assert_eq!(kind, 5);
                    let (topic, schema) = &channels[&id];
                    let value = serde_json::from_slice(fields).unwrap();
                    all.push((topic.clone(), time, schemas[schema].clone(), value));
                }
            }
            // The index of a chunk has its offset and its times.
            8 => {
                let [begin, end, place, _] = [(); 4].map(|()| number(&mut fields, 8));
                let (_, kind, chunk) =
                    records_of_all.iter().find(|(at, ..)| at + MAGIC.len() == place as usize).unwrap();
                let mut chunk = *chunk;
                assert_eq!((*kind, number(&mut chunk, 8), number(&mut chunk, 8)), (6, begin, end));
                indexed += 1;
            }
            _ => {}
        }
    }
    assert_eq!(indexed, records_of_all.iter().filter(|(_, kind, _)| *kind == 6).count());
    all
}

/// Compares MCAP with the CSV of the same run.
fn messages_say_what_the_rows_say(bytes: &[u8], names: &str, rows: &str, spec: &str) {
    let mut found: BTreeMap<String, Vec<(u64, Value)>> = BTreeMap::new();
    for (topic, time, schema, value) in messages(bytes) {
        let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        assert_eq!(keys(&value), keys(&schema["properties"]), "{topic}");
        found.entry(topic).or_default().push((time, value));
    }
    let names: Vec<&str> = names.split(',').collect();
    let rows: Vec<Vec<&str>> = rows.lines().map(|line| line.split(',').collect()).collect();
    let cell =
        |row: &[&str], name: &str| row[names.iter().position(|one| *one == name).unwrap()].parse::<f64>().unwrap();
    let legs = spec == "legs.toml";
    let (at, key) = if legs { ("demand", "leg2") } else { ("pose", "z") };
    for topic in ["/gauges", "/codes", "/volts", "/error", &format!("/{at}")] {
        assert_eq!(found[topic].len(), rows.len(), "{topic}");
    }
    for (k, row) in rows.iter().enumerate() {
        let number = |topic: &str, key: &str| found[topic][k].1[key].as_f64().unwrap();
        assert_eq!(found["/codes"][k].0, (cell(row, "time_s") * 1e9).round() as u64);
        assert_eq!(number("/codes", "leg3").to_bits(), cell(row, "dac_code[3]").to_bits());
        assert_eq!(number("/volts", "leg5").to_bits(), cell(row, "voltage[5]_V").to_bits());
        assert_eq!(number(&format!("/{at}"), key).to_bits(), cell(row, &format!("{at}[2]_m")).to_bits());
        // The CSV has only seven digits.
        let error = cell(row, "error[2]_m");
        assert!((number("/error", key) - error).abs() <= 1e-6 * error.abs(), "row {k}");
        let gauge = if legs { "displacement[2]_m" } else { "gauge[2]" };
        assert_eq!(number("/gauges", "gauge2").to_bits(), cell(row, gauge).to_bits());
    }
    // Signals that change seldom keep their value until the next message.
    let held = |topic: &str, time: u64| {
        let said = found[topic].iter().take_while(|(at, _)| *at <= time);
        said.last().unwrap().1.clone()
    };
    for row in rows.iter().step_by(rows.len() / 50) {
        let time = (cell(row, "time_s") * 1e9).round() as u64;
        assert_eq!(held("/status", time)["status"].as_f64().unwrap().to_bits(), cell(row, "status").to_bits());
        let phase = held("/phase", time);
        assert_eq!(phase["phase"].as_f64().unwrap().to_bits(), cell(row, "phase").to_bits());
        assert_eq!(phase["amplifiers_on"].as_bool().unwrap(), cell(row, "amplifiers_on") > 0.5);
    }
    assert!(found["/settings"][0].1.as_object().unwrap().len() > 5);
}

#[test]
fn what_one_controller_records_the_other_replays() {
    let folder = Folder::new();
    let forms: [(&str, &[&str]); 2] = [("run-time", &[]), ("emitted", &["--emitted"])];
    let both = [(forms[0], forms[1]), (forms[1], forms[0])];
    for ((recorder, sim), (player, replay)) in both.into_iter().take(length(1, 2)) {
        let record = ["sim", "legs.toml", "--record", "run.rec", "--seconds", "0.5"];
        let recorded = folder.json(&[&record[..], sim].concat());
        let replayed = folder.json(&[&["replay", "run.rec", "--spec", "legs.toml"][..], replay].concat());
        assert_eq!([&recorded.value["controller"], &replayed.value["controller"]], [recorder, player]);
        let result = &replayed.value["result"];
        assert_eq!((replayed.code, &result["bit_equal"]), (0, &true.into()), "{recorder}: {result}");
        assert_eq!(result["ticks"], recorded.value["result"]["ticks"]);
        assert!(result["ticks"].as_u64() > Some(1000), "{result}");
    }
}

#[test]
fn what_sim_records_replays_bit_for_bit_and_a_changed_bit_does_not() {
    let folder = Folder::new();
    for spec in ["reference.toml", "legs.toml"].into_iter().take(length(1, 2)) {
        let recorded = folder.json(&["sim", spec, "--record", "run.rec", "--seconds", length("0.8", "2")]);
        assert_eq!(recorded.code, 0, "{spec}: {}", recorded.value);
        let replayed = folder.json(&["replay", "run.rec", "--spec", spec]);
        let result = &replayed.value["result"];
        assert_eq!((replayed.code, &result["bit_equal"]), (0, &true.into()), "{spec}: {result}");
        assert_eq!(result["ticks"], recorded.value["result"]["ticks"]);
        // Decoded values: meanings of the words, volts, and pose and target of the platform or the legs.
        let more = ["replay", "run.rec", "--spec", spec, "--csv", "out/run.csv", "--plot", "out/run.svg"];
        assert_eq!(folder.run(&[&more[..], &["--mcap", "out/run.mcap"]].concat()).code, 0);
        let csv = folder.read("out/run.csv");
        let (names, rows) = csv.split_once('\n').unwrap();
        let place =
            |name: &str| names.split(',').position(|one| one == name).unwrap_or_else(|| panic!("{name}: {names}"));
        let (target, at) =
            if spec == "legs.toml" { ("demand[2]_m", "displacement[2]_m") } else { ("target[2]_m", "pose[2]_m") };
        let row: Vec<&str> = rows.lines().nth(15_000.min(rows.lines().count() / 2)).unwrap().split(',').collect();
        assert_eq!(row.len(), names.split(',').count());
        let cell = |name: &str| row[place(name)].parse::<f64>().unwrap();
        assert!((cell(target) - cell(at) - cell("error[2]_m")).abs() < 1e-12, "{row:?}");
        assert!(cell("voltage[5]_V") > 0.0 && cell("error[2]_m").abs() < 1e-6, "{row:?}");
        assert_eq!(row[place("supervisor_text")], "running");
        assert!(folder.read("out/run.svg").contains("<path"));
        messages_say_what_the_rows_say(&fs::read(folder.path("out/run.mcap")).unwrap(), names, rows, spec);
        let mut bytes = fs::read(folder.path("run.rec")).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        folder.write("bad.rec", bytes);
        let text = folder.run(&["replay", "bad.rec", "--spec", spec]);
        assert!(text.code == 1 && text.stdout.contains("is damaged"), "{spec}: {} {}", text.stdout, text.stderr);
        // The rest is exported, and the gap is reported.
        let exported = folder.run(&["replay", "bad.rec", "--csv", "bad.csv", "--mcap", "bad.mcap"]);
        exported.says(1, &["is damaged", "its rows are missing"]);
        assert!(folder.path("bad.csv").is_file());
        let left = messages(&fs::read(folder.path("bad.mcap")).unwrap());
        let codes = left.iter().filter(|(topic, ..)| topic == "/codes").count();
        assert!(codes + 1 == folder.read("bad.csv").lines().count() && left.iter().all(|(topic, ..)| topic != "/pose"));
    }
}
