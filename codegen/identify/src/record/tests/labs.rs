//! Files as laboratories have them, made for the tests: read as they are, or refused with what helps.

use super::files::{assert_same, comma, file, read, read_as, rows};
use super::mat_file::{self as mat, column, doubles, int32, object, structs, subsystem, text};
use super::*;
use specgen_language::arrays::Form;
use std::io::Write as _;

fn values(k: usize) -> Vec<f64> {
    rows().iter().map(|row| row[k]).collect()
}

fn variables() -> Vec<Vec<u8>> {
    ["time_s", "drive_V", "displacement_um"].iter().enumerate().map(|(k, name)| column(name, &values(k))).collect()
}

fn series(list: &str, series: &str) -> Reading {
    Reading::new(&[list.to_owned()], None).unwrap().of_series(Some(series.to_owned()))
}

/// The text of the note that the record is a part of its file.
fn note(record: &Record) -> &str {
    let found: Vec<_> = record.warnings.iter().filter(|one| one.code == "N0523").collect();
    assert_eq!(found.len(), 1, "{:?}", record.warnings);
    &found[0].message
}

#[test]
fn structs_of_dspace_are_read() {
    let x = structs("", &["Name", "Data"], &[vec![text("", "Time"), doubles("", [1, 240], &values(0))]]);
    let signal = |name: &str, k: usize| vec![text("", name), doubles("", [1, 240], &values(k)), int32("", 1)];
    let signals = [signal("Model Root/Drive", 1), signal("Model Root/Gauge", 2)];
    let y = structs("", &["Name", "Data", "XIndex"], &signals);
    let whole = structs("measured_001", &["X", "Y", "Description"], &[vec![x, y, text("", "nothing")]]);
    let names = ["drive_V=Model Root/Drive", "displacement_um=Model Root/Gauge"];
    let record = assert_same("dSPACE", read(&mat::file(std::slice::from_ref(&whole)), &names, None));
    assert!(record.warnings.is_empty(), "{:?}", record.warnings);
    let found = read(&mat::file(&[whole]), &[], None).unwrap_err();
    assert!(found[0].message.contains("`Model Root/Drive`"), "{found:?}");
    // Units beside the names are part of the suggestion.
    let nanometres: Vec<f64> = values(2).iter().map(|value| 1e3 * value).collect();
    let signal = |name: &str, unit: &str, values: &[f64]| {
        vec![text("", name), doubles("", [1, 240], values), text("", unit), text("", "a remark")]
    };
    let signals = [signal("Amp/Out", "V", &values(1)), signal("Gauge/Out", "nm", &nanometres)];
    let y = structs("", &["Name", "Data", "Unit", "Description"], &signals);
    let milliseconds: Vec<f64> = values(0).iter().map(|value| 1e3 * value).collect();
    let x = structs("", &["Data", "Unit"], &[vec![doubles("", [1, 240], &milliseconds), text("", "ms")]]);
    let ticks = structs("", &["Data", "Unit"], &[vec![doubles("", [1, 240], &milliseconds), text("", "ticks")]]);
    let found = read(&mat::file(&[structs("exp", &["X", "Y"], &[vec![ticks, y.clone()]])]), &[], None).unwrap_err();
    assert!(
        found[0].message.contains("`time_s` is missing") && found[0].message.contains("`time [ticks]`"),
        "{found:?}"
    );
    let file = mat::file(&[structs("exp", &["X", "Y"], &[vec![x, y]])]);
    let found = read(&file, &[], None).unwrap_err();
    assert!(found[0].help.contains("'drive_V=Amp/Out [V],displacement_nm=Gauge/Out [nm]'"), "{found:?}");
    assert_same("units", read(&file, &["drive_V=Amp/Out", "displacement_nm=Gauge/Out [nm]"], None));
}

/// A struct with times for each signal, as Simulink saves them.
#[test]
fn signals_with_the_same_times_are_one_table() {
    for labels in [["drive_V", "displacement_um"], ["", ""]] {
        let file = |scale: f64| {
            let signal = |name: &str, label: &str, k: usize| {
                let inner = [vec![column("", &values(k)), text("", label)]];
                let inner = structs("", &["values", "label"], &inner);
                let times: Vec<f64> = values(0).iter().map(|time| if k == 1 { scale * time } else { *time }).collect();
                structs(name, &["time", "signals"], &[vec![column("", &times), inner]])
            };
            mat::file(&[signal("amp", labels[0], 1), signal("gauge", labels[1], 2)])
        };
        let names: &[&str] = match labels[0] {
            "" => &["time_s=time", "drive_V=amp.signals.values", "displacement_um=gauge.signals.values"],
            _ => &["time_s=time"],
        };
        let record = assert_same("one table", read(&file(1.0), names, None));
        assert!(record.warnings.is_empty(), "{:?}", record.warnings);
        assert!(read(&file(2.0), names, None).is_err());
    }
}

#[test]
fn what_is_no_array_of_numbers_is_left_out_and_named() {
    let others = [int32("count", 7), text("operator", "nobody"), object("when", "timeseries"), object("why", "string")];
    let all = [&others[..2], &variables(), &others[2..], &[subsystem()]].concat();
    let record = assert_same("others", read(&mat::file(&all), &[], None));
    for word in ["`count` (a number)", "`operator` (a text)", "`when` (an object of class timeseries)", "class string"]
    {
        assert!(note(&record).contains(word), "{}", note(&record));
    }
    let found = read(&mat::file(&others), &[], None).unwrap_err();
    assert!(found[0].code == "E0503" && found[0].message.contains("`operator` (a text)"), "{found:?}");
}

#[test]
fn a_matrix_and_several_records_are_chosen_by_number_and_name() {
    let all: Vec<f64> = [2, 0, 1].iter().flat_map(|k| values(*k)).collect();
    let by_number = &["displacement_um=1", "time_s=2", "drive_V=3"];
    assert_same("matrix", read(&mat::file(&[doubles("data", [240, 3], &all)]), by_number, None));
    // No times.
    let untimed = mat::file(&[column("U", &values(1)), column("y", &values(2))]);
    assert_same("no times", read(&untimed, &["drive_V=U", "displacement_um=2"], Some(1e3)));
    let found = read(&untimed, &[], None).unwrap_err();
    assert!(found[0].help.contains("`--columns drive_V=U,displacement_um=y --rate HZ`"), "{found:?}");
    // Two records of one length, and a longer one.
    let other = doubles("other", [240, 3], &all.iter().map(|value| 2.0 * value).collect::<Vec<_>>());
    let long = doubles("long", [3, 300], &(0..900).map(f64::from).collect::<Vec<_>>());
    let several = mat::file(&[doubles("first", [240, 3], &all), other, long]);
    let list = by_number.join(",");
    for name in ["first", "1"] {
        let record = assert_same(name, read_as(&several, &series(&list, name)));
        assert!(record.warnings.is_empty(), "{:?}", record.warnings);
    }
    assert_eq!(read_as(&several, &series(&list, "other")).unwrap().drive[7], 2.0 * rows()[7][1]);
    let found = read_as(&several, &series(&list, "4")).unwrap_err();
    assert!(found[0].message.contains("3 `long` (300 rows of `long(:,1)`"), "{found:?}");
    let found = read(&several, &["time_s=1", "drive_V=2", "displacement_um=3"], None).unwrap();
    assert!(
        note(&found).contains("table 3 `long`") && note(&found).contains("1 `first` (240 rows"),
        "{}",
        note(&found)
    );
}

#[test]
fn numpy_gzip_and_utf_16_are_read() {
    let plain = file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t},{u},{y}"));
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(plain.as_bytes()).unwrap();
    let packed = packed.finish().unwrap();
    assert_same("gzip", read(&packed, &[], None));
    let cut = read(&packed[..packed.len() / 2], &[], None).unwrap_err();
    assert!(cut[0].message.contains("cannot be unpacked"), "{cut:?}");
    let zip = |files: &[(&str, &[u8])]| specgen_language::arrays::zipped(files.iter().copied()).unwrap();
    assert_same("ZIP", read(&zip(&[("__MACOSX/._r.csv", b"x"), ("r.csv", plain.as_bytes())]), &[], None));
    let found = read(&zip(&[("r.csv", plain.as_bytes()), ("s.csv", plain.as_bytes())]), &[], None).unwrap_err();
    assert!(found[0].code == "E0503" && found[0].message.contains("a ZIP archive"), "{found:?}");
    let mut damaged = zip(&[("r.csv", plain.as_bytes())]);
    damaged[60] ^= 1;
    let found = read(&damaged, &[], None).unwrap_err();
    assert!(found[0].code == "E0503" && found[0].message.contains("`r.csv` is damaged"), "{found:?}");
    let utf16 = |to: fn(u16) -> [u8; 2]| {
        ['\u{feff}'.to_string(), plain.clone()].concat().encode_utf16().flat_map(to).collect::<Vec<u8>>()
    };
    assert_same("UTF-16, low byte first", read(&utf16(u16::to_le_bytes), &[], None));
    assert_same("UTF-16, high byte first", read(&utf16(u16::to_be_bytes), &[], None));
    assert_same("UTF-16 without mark", read(&utf16(u16::to_le_bytes)[2..], &[], None));
    assert_same("UTF-16 without mark, high byte first", read(&utf16(u16::to_be_bytes)[2..], &[], None));
    let npy = |descr: &str, shape: &str, values: &[u8]| {
        let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), values].concat()
    };
    let values: Vec<u8> = rows().iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let fields = "[('time_s', '<f8'), ('drive_V', '<f8'), ('displacement_um', '<f8')]";
    assert_same("fields", read(&npy(fields, "(240,)", &values), &[], None));
    let columns = npy("'<f8'", "(240, 3)", &values);
    assert_same("columns", read(&columns, &["time_s=1", "drive_V=2", "displacement_um=3"], None));
    let found = read(&columns, &[], None).unwrap_err();
    assert!(found[0].message.contains("`column 1`, `column 2`, `column 3`"), "{found:?}");
}

#[test]
fn a_scaled_gauge_is_read() {
    let volts = file("time_s,drive_V,CH2 (mV),y,Gauge (nm)", |[t, u, y]| {
        format!("{t},{u},{},{y},{}", 1e3 * (y - 0.3) / 5.0, 1e3 * y)
    });
    for scale in [
        "displacement=CH2 (mV)*5 um/V+0.3 um",
        "displacement=3*5 um/V+300 nm",
        "displacement_nm=y*1e3",
        "displacement_nm=Gauge (nm)+0 um",
        "displacement=Gauge (nm)*1 nm",
        "displacement=Gauge (nm)*1e-3 um/nm",
    ] {
        assert_same(scale, read(volts.as_bytes(), &[scale], None));
    }
    for (wrong, help) in [
        ("drive_V=CH2 (mV)", "drive_mV=CH2 (mV)"),
        ("displacement_um=CH2 (mV)", "displacement=CH2 (mV)*1 um/mV"),
        ("displacement_um=Gauge (nm)+0.3", "displacement_nm=Gauge (nm)'`, followed by scale and offset in nm"),
        ("displacement=Gauge (nm)*1 um", "displacement_nm=Gauge (nm)'`, followed"),
    ] {
        let found = read(volts.as_bytes(), &[wrong], None).unwrap_err();
        assert!(found.iter().any(|one| one.code == "E0504" && one.help.contains(help)), "{found:?}");
    }
    let found = read(volts.as_bytes(), &["displacement=CH2 (mV)*5 um/N"], None).unwrap_err();
    assert!(found[0].message.contains("its unit is mv"), "{found:?}");
}

#[test]
fn the_data_table_of_a_text_is_found() {
    let data = file("Time [s];Drive [V];Displacement [um]", |row| row.map(comma).join(";"));
    let small = "Program 3\n\nR;C;T\n10,5;2;25\n11,5;3;26\n";
    let before = assert_same("small table", read(format!("{small}\n{data}").as_bytes(), &[], None));
    assert!(note(&before).contains("1 `Program 3` (2 rows of `R`, `C`, `T` from line 4)"), "{}", note(&before));
    let run =
        |first: usize| file("t;U;y", |row| row.map(comma).join(";")).lines().skip(first).collect::<Vec<_>>().join("\n");
    let short = |first: usize| format!("Run\nt;U;y\n{}\n", run(first));
    let all = format!("{small}{}{}{}", short(150), short(1), short(100));
    let list = "time_s=t,drive_V=U,displacement_um=y";
    let longest = assert_same("longest", read(all.as_bytes(), &[list], None));
    assert!(note(&longest).contains("table 3 `Run` (240 rows"), "{}", note(&longest));
    let lines = (0..3).map(|k| values(k).iter().map(f64::to_string).collect::<Vec<_>>().join("\t")).collect::<Vec<_>>();
    let found = read(lines.join("\n").as_bytes(), &[], None).unwrap_err();
    assert!(found[0].message.contains("3 lines of 240 numbers: rows and columns are exchanged"), "{found:?}");
    let others = (0..300).map(|k| format!(",c{k}")).collect::<String>();
    let wide = file(&format!("time_s,drive_V,displacement_um{others}"), |[t, u, y]| {
        format!("{t},{u},{y}{}", ",0".repeat(300))
    });
    assert_same("wide", read(wide.as_bytes(), &[], None));
    let fourth = read_as(all.as_bytes(), &series(list, "4")).unwrap();
    assert_eq!((fourth.time.len(), fourth.time[0], fourth.warnings.len()), (141, 0.099, 0));
}

/// A line of units that contradicts a name is not left out: which of them is right is not known.
#[test]
fn a_line_of_units_that_contradicts_a_name_is_refused() {
    let with = |units: &str| {
        let rows = file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t:?},{u:?},{y:?}"));
        rows.replacen('\n', &format!("\n{units}\n"), 1)
    };
    for units in ["s,V,um", "[s],[V],[um]", "(s),(V),(µm)"] {
        assert_same(units, read(with(units).as_bytes(), &[], None));
    }
    for (units, named) in
        [("s,V,nm", "displacement_um [nm]"), ("[s],[mV],[um]", "drive_V [mV]"), ("ms,V,um", "time_s [ms]")]
    {
        let found = read(with(units).as_bytes(), &[], None).map(|record| record.warnings).unwrap_err();
        assert!(found[0].message.contains(named), "{units}: {found:?}");
    }
}

#[test]
fn one_column_is_not_two_quantities() {
    let rows = file("time_s,CH,CH", |[t, u, y]| format!("{t:?},{u:?},{y:?}"));
    for (columns, words) in [
        ("drive_V=CH,displacement_um=3", "`CH` is the name of columns 2 and 3"),
        ("drive_V=2,displacement_um=2", "column 2 is named for"),
    ] {
        let found = read(rows.as_bytes(), &[columns], None).map(|record| record.warnings).unwrap_err();
        assert!(found[0].code == "E0505" && found[0].message.contains(words), "{found:?}");
    }
    assert_same("by number", read(rows.as_bytes(), &["drive_V=2,displacement_um=3"], None));
}

/// A note names a few lines; more would be half a record.
#[test]
fn rows_behind_a_text_are_named() {
    let data = file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t},{u},{y}"));
    let more = |count: usize| (0..count).map(|k| format!("{},0,0,OVL\n", k + 1)).collect::<String>();
    let few = assert_same("few", read(format!("{data}overload\n{}", more(3)).as_bytes(), &[], None));
    assert!(note(&few).contains("3 from line 243 on"), "{}", note(&few));
    let found = read(format!("{data}overload\n{}", more(80)).as_bytes(), &[], None).unwrap_err();
    assert!(found[0].code == "E0506" && found[0].message.contains("80 from line 243 on"), "{found:?}");
}

#[test]
fn times_that_no_number_holds_are_refused() {
    let long =
        file("X,CH1,CH2,Start,Increment\nSequence,Volt,Volt,0,1e307", |[t, u, y]| format!("{},{u},{y}", 1e3 * t));
    let untimed = file("drive_V,displacement_um", |[_, u, y]| format!("{u},{y}"));
    let columns: &[&str] = &["drive_V=CH1", "displacement=CH2*1 um/V"];
    for (text, columns, rate) in [(long, columns, None), (untimed, &[], Some(1e-320))] {
        let found = read(text.as_bytes(), columns, rate).unwrap_err();
        assert!(found.len() == 1 && found[0].help.contains("--rate HZ"), "{found:?}");
    }
}

#[test]
fn stretches_between_gaps_and_joined_runs_are_records() {
    let gap =
        file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{},{u},{y}", if t < 0.1 { t } else { t + 0.05 }));
    let record = read(gap.as_bytes(), &[], None).unwrap();
    assert!(record.time.len() == 140 && (record.time[0] - 0.15).abs() < 1e-9, "{}", record.time[0]);
    assert!(note(&record).contains("not read: 1 (0 s to 0.099 s)"), "{}", note(&record));
    assert!(record.warnings[0].help.contains("`--series 1`"), "{:?}", record.warnings);
    let plain = |series: &str| Reading::default().of_series(Some(series.to_owned()));
    let first = read_as(gap.as_bytes(), &plain("1")).unwrap();
    assert_eq!((first.time.len(), first.time[99], first.warnings.len()), (100, rows()[99][0], 0));
    let found = read_as(gap.as_bytes(), &plain("3")).unwrap_err();
    assert!(found[0].message.contains("stretch 3") && found[0].message.contains("2 (0.15"), "{found:?}");
    let after = read_as(format!("R;C\n10;2\n\n{gap}").as_bytes(), &plain("2.1")).unwrap();
    assert_eq!(after.time.len(), 100);
    let whole = file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t},{u},{y}"));
    let joined = whole.clone() + &whole.lines().skip(1).take(150).collect::<Vec<_>>().join("\n");
    assert!(note(&assert_same("joined", read(joined.as_bytes(), &[], None))).contains("starts again"));
}

#[test]
fn times_of_day_are_of_the_time_column() {
    let clock = |first: &str, later: &str| {
        file("Timestamp,drive_V,displacement_um", |[t, u, y]| {
            let date = if t < 0.1 { first } else { later };
            format!("{date} 10:00:00.{:03.0},{u},{y}", 1e3 * t)
        })
    };
    let one = clock("2024-03-04", "2024-03-04");
    // The unit of the name is not that of the clock.
    assert_same("minutes", read(one.replace("Timestamp", "Time (min)").as_bytes(), &[], None));
    let lines: Vec<&str> = one.lines().skip(1).collect();
    let apart = lines.chunks(80).map(|lines| lines.join("\n")).collect::<Vec<_>>().join("\n\n");
    let names = "Timestamp,drive_V,displacement_um";
    assert_same("blank lines", read(format!("{names}\n{apart}\n").as_bytes(), &[], None));
    let record = read(clock("2024-03-04", "2024-03-07").as_bytes(), &[], None).unwrap();
    assert!(record.time.len() == 140 && note(&record).contains("stretch without, from 259200.1"), "{}", note(&record));
    let named = clock("4-Mar-2024", "7-MAR-2024");
    // In a column of their own.
    for text in [named.replace("Timestamp", "Date,Time").replace(" 10:", ",10:"), named] {
        let record = read(text.as_bytes(), &[], None).unwrap();
        assert!(note(&record).contains("stretch without, from 259200.1"), "{}", note(&record));
    }
    // Elsewhere they are no numbers.
    let found = read(file(names, |[t, u, _]| format!("{t},{u},0:21.35")).as_bytes(), &["time_s=1"], None).unwrap_err();
    assert!(found[0].code == "E0506" && found[0].message.contains("`0:21.35`"), "{found:?}");
    let found = read(one.replace("00:00.", "00:00,").as_bytes(), &[], None).unwrap_err();
    assert!(found[0].code == "E0506" && found[0].message.contains("comma before the decimals"), "{found:?}");
    let semicolons = one.replace(',', ";").replace("00:00.", "00:00,");
    assert_same("semicolons", read(semicolons.as_bytes(), &[], None));
}

#[test]
fn curves_without_their_ways_back_are_refused_for_that() {
    let curve = |k: u32| {
        (0..20)
            .map(|i| format!("{:+.4E},{:+.4E}\n", f64::from(i) - f64::from(k), 1e-6 * f64::from(i)))
            .collect::<String>()
    };
    let curves: Vec<String> = (0..12).map(|k| format!("{}\n+2.0E+01,+1.0E-05\n", curve(k))).collect();
    let text = format!("MicroMag\nNForc = 12\n\n   Field       Moment\n   (Oe)         (emu)\n\n{}", curves.join("\n"));
    let found = read(text.as_bytes(), &[], None).unwrap_err();
    assert!(found[0].code == "E0511" && found[0].message.contains("12 curves"), "{found:?}");
    // Without blank lines between them.
    let text = format!("Field (Oe),Moment (emu)\n{}", (0..12).map(curve).collect::<String>());
    let found = read(text.as_bytes(), &[], None).unwrap_err();
    assert!(found[0].code == "E0511" && found[0].message.contains("12 curves"), "{found:?}");
}

/// What is written as arrays is read back to the bit, with its mark.
#[test]
fn written_arrays_are_the_same_record() {
    let third = |value: f64| value / 3.0;
    let plain = file("time_s,drive_V,displacement_um", |row| {
        let [t, u, y] = row.map(third);
        format!("{t:?},{u:?},{y:?}")
    });
    for text in [plain.clone(), crate::marked_as_simulated(&plain)] {
        let wanted = read(text.as_bytes(), &[], None).unwrap();
        for form in [Form::Npz, Form::Mat] {
            let record = read(&form.of_csv(text.as_bytes()).unwrap(), &[], None).unwrap();
            let bits = |record: &Record| {
                let all = [&record.time, &record.drive, &record.displacement].map(|values| values.iter());
                all.into_iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(bits(&record), bits(&wanted), "{form:?}");
            assert_eq!((record.simulated, record.warnings.len()), (wanted.simulated, 0), "{form:?}");
        }
    }
    // Texts and other sizes are left out; what is packed is unpacked; a damaged archive is named.
    let named = file("time_s,mode,drive_V,displacement_um", |[t, u, y]| format!("{t:?},on,{u:?},{y:?}"));
    for form in [Form::Npz, Form::Mat] {
        let written = form.of_csv(named.as_bytes()).unwrap();
        let record = assert_same("texts", read(&written, &[], None));
        assert!(note(&record).contains("left out: `mode`"), "{form:?}: {}", note(&record));
        if form == Form::Npz {
            let at = written.windows(8).position(|bytes| bytes == 2.5_f64.to_le_bytes()).unwrap();
            let mut damaged = written.clone();
            damaged[at] ^= 1;
            let found = read(&damaged, &[], None).unwrap_err();
            assert!(found[0].code == "E0503" && found[0].message.contains("`drive_V.npy` is damaged"), "{found:?}");
        }
        let cut = read(&written[..written.len() / 2], &[], None).unwrap_err();
        assert!(cut[0].code == "E0503" && cut[0].message.contains("cut off"), "{form:?}: {cut:?}");
    }
}
