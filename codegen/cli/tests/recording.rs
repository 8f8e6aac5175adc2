//! `specgen sim --record` and `specgen replay` as a user runs them, for both kinds of controller.

use std::collections::BTreeMap;
use std::fs;

use serde_json::Value;

use crate::support::Folder;

/// MCAP, read back by its own library, against the CSV of the same run.
fn messages_say_what_the_rows_say(bytes: &[u8], names: &str, rows: &str, spec: &str) {
    let mut found: BTreeMap<String, Vec<(u64, Value)>> = BTreeMap::new();
    for message in mcap::MessageStream::new(bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("jsonschema", "json"));
        let value: Value = serde_json::from_slice(&message.data).unwrap();
        let schema: Value = serde_json::from_slice(&schema.data).unwrap();
        let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        assert_eq!(keys(&value), keys(&schema["properties"]), "{}", message.channel.topic);
        found.entry(message.channel.topic.clone()).or_default().push((message.log_time, value));
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
        // The CSV has seven digits of it.
        let error = cell(row, "error[2]_m");
        assert!((number("/error", key) - error).abs() <= 1e-6 * error.abs(), "row {k}");
        let gauge = if legs { "displacement[2]_m" } else { "gauge[2]" };
        assert_eq!(number("/gauges", "gauge2").to_bits(), cell(row, gauge).to_bits());
    }
    // Those that change seldom hold until they are said again.
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
fn what_sim_records_replays_bit_for_bit_and_a_changed_bit_does_not() {
    let folder = Folder::new();
    for spec in ["legs.toml", "reference.toml"] {
        let recorded = folder.json(&["sim", spec, "--record", "run.rec", "--seconds", "2"]);
        assert_eq!(recorded.code, 0, "{spec}: {}", recorded.value);
        let replayed = folder.json(&["replay", "run.rec", "--spec", spec]);
        let result = &replayed.value["result"];
        assert_eq!((replayed.code, &result["bit_equal"]), (0, &true.into()), "{spec}: {result}");
        assert_eq!(result["ticks"], recorded.value["result"]["ticks"]);
        // For people: what the words mean, volts, and where the platform or the legs were and were to be.
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
        let number = |name: &str| row[place(name)].parse::<f64>().unwrap();
        assert!((number(target) - number(at) - number("error[2]_m")).abs() < 1e-12, "{row:?}");
        assert!(number("voltage[5]_V") > 0.0 && number("error[2]_m").abs() < 1e-6, "{row:?}");
        assert_eq!(row[place("supervisor_text")], "running");
        assert!(folder.read("out/run.svg").contains("<path"));
        messages_say_what_the_rows_say(&fs::read(folder.path("out/run.mcap")).unwrap(), names, rows, spec);
        let mut bytes = fs::read(folder.path("run.rec")).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        folder.write("bad.rec", bytes);
        let text = folder.run(&["replay", "bad.rec", "--spec", spec]);
        assert!(text.code == 1 && text.stdout.contains("is damaged"), "{spec}: {} {}", text.stdout, text.stderr);
        // What is left is exported, and said to have a hole.
        let exported = folder.run(&["replay", "bad.rec", "--csv", "bad.csv", "--mcap", "bad.mcap"]);
        exported.says(1, &["is damaged", "its rows are missing"]);
        assert!(folder.path("bad.csv").is_file());
        assert!(mcap::MessageStream::new(&fs::read(folder.path("bad.mcap")).unwrap()).unwrap().all(|one| one.is_ok()));
    }
}
