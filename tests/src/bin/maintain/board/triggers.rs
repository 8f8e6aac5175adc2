//! Compares the trigger pins of the emulated board with the record of the same ticks.

use std::fs;
use std::path::Path;

use specgen_runtime::pending::EDGE;

/// A change of a pin: line, level, and the tick or sample that it belongs to.
type Edge = (usize, bool, i64);

/// The edges of a record's table: by line, in the order of the ticks.
fn recorded(table: &str) -> (Vec<Edge>, [i64; 2]) {
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let columns: Vec<usize> = (0..names.len()).filter(|place| names[*place].starts_with("trigger[")).collect();
    let (mut edges, mut before, mut span) = (Vec::new(), None::<Vec<bool>>, [i64::MAX, i64::MIN]);
    for row in lines {
        let values: Vec<&str> = row.split(',').collect();
        let tick: i64 = values[0].parse().unwrap_or_default();
        let high: Vec<bool> = columns.iter().map(|place| values[*place] == "1").collect();
        if let Some(before) = &before {
            for (line, (after, before)) in high.iter().zip(before).enumerate() {
                if after != before {
                    edges.push((line, *after, tick));
                }
            }
        }
        before = Some(high);
        span = [span[0].min(tick), span[1].max(tick)];
    }
    (edges, span)
}

/// The edges in the board's log.
fn seen(log: &[String]) -> Vec<Edge> {
    let edge = |line: &String| {
        let words: Vec<&str> = line.split(" ms: trigger ").nth(1)?.split(' ').collect();
        let [line, level, "after", "sample", sample] = words[..] else { return None };
        Some((line.parse().ok()?, level == "1", sample.parse().ok()?))
    };
    log.iter().filter_map(edge).collect()
}

/// Number of edges in the record. The board must have logged exactly these in the same ticks.
///
/// Samples are counted from power-up, like ticks, but include those of starting the converters; the first edge gives the offset.
fn compare(recorded: &[Edge], seen: &[Edge], [begin, end]: [i64; 2]) -> Result<usize, String> {
    let mut best = None;
    for (_, _, sample) in seen {
        let Some((_, _, first)) = recorded.first() else { break };
        let offset = sample - first;
        // Edges before the first row are not in the record.
        let within: Vec<Edge> = seen
            .iter()
            .map(|(line, level, sample)| (*line, *level, sample - offset))
            .filter(|(_, _, tick)| *tick > begin && *tick <= end)
            .collect();
        if within == recorded {
            return Ok(recorded.len());
        }
        let wrong = within.iter().zip(recorded).position(|(seen, recorded)| seen != recorded);
        let wrong = wrong.unwrap_or(within.len().min(recorded.len()));
        if best.is_none_or(|best| wrong > best) {
            best = Some(wrong);
        }
    }
    let (all, found, in_order) = (recorded.len(), seen.len(), best.unwrap_or(0));
    Err(format!(
        "the pins of triggers are not those of the record: {all} edges recorded, {found} seen, {in_order} of them in order"
    ))
}

/// Compares a record's table with the board's log.
pub fn check(table: &Path, log: &[String]) -> Result<usize, String> {
    let text = fs::read_to_string(table).map_err(|error| format!("{}: {error}", table.display()))?;
    let (edges, span) = recorded(&text);
    compare(&edges, &seen(log), span)
}

/// The tick of the only edge of the input line in a record's table, and the tick of the following move, which must be the next.
pub fn started(table: &Path) -> Result<[i64; 2], String> {
    let text = fs::read_to_string(table).map_err(|error| format!("{}: {error}", table.display()))?;
    rose_and_moved(&text)
}

fn rose_and_moved(table: &str) -> Result<[i64; 2], String> {
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |name: &str| names.iter().position(|known| *known == name).ok_or(format!("the record has no {name}"));
    let [tick, events, command] = [place("tick")?, place("events")?, place("command")?];
    let rows: Vec<Vec<u64>> = lines
        .map(|row| {
            let values: Vec<&str> = row.split(',').collect();
            [tick, events, command]
                .map(|place| values.get(place).and_then(|text| text.parse().ok()).unwrap_or(0))
                .to_vec()
        })
        .collect();
    let rose: Vec<u64> = rows.iter().filter(|row| row[1] & u64::from(EDGE) != 0).map(|row| row[0]).collect();
    let moved = rows.windows(2).find(|pair| pair[0][2] != pair[1][2]).map(|pair| pair[1][0]);
    match (&rose[..], moved) {
        ([rose], Some(moved)) if moved == rose + 1 => Ok([*rose as i64, moved as i64]),
        _ => Err(format!(
            "the input line rose in ticks {rose:?}, and what waited began in tick {moved:?}, expected the next"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_begins_in_the_tick_after_the_edge_or_is_found() {
        let table = |events: [u64; 4], commands: [u64; 4]| {
            let rows = (0..4).map(|row| format!("{},{},{}\n", 10 + row, events[row], commands[row]));
            format!("tick,events,command\n{}", rows.collect::<String>())
        };
        assert_eq!(rose_and_moved(&table([0, 32, 0, 0], [0, 0, 1, 1])), Ok([11, 12]));
        for (events, commands) in [
            ([0, 32, 0, 0], [0, 1, 1, 1]),
            ([0, 32, 0, 0], [0, 0, 0, 1]),
            ([0, 0, 0, 0], [0, 0, 1, 1]),
            ([32, 32, 0, 0], [0, 0, 1, 1]),
            ([0, 32, 0, 0], [0; 4]),
        ] {
            assert!(rose_and_moved(&table(events, commands)).is_err());
        }
    }

    #[test]
    fn an_edge_that_is_a_tick_off_or_missing_is_found() {
        let table = "tick,trigger[0],trigger[1]\n10,0,0\n11,1,0\n12,0,1\n13,0,1\n14,1,0\n";
        let (edges, span) = recorded(table);
        assert_eq!(edges.len(), 5);
        let log: Vec<String> = [(0, 1, 3), (0, 1, 14), (0, 0, 15), (1, 1, 15), (0, 1, 17), (1, 0, 17)]
            .map(|(line, level, sample)| format!("1.000 ms: trigger {line} {level} after sample {sample}"))
            .to_vec();
        assert_eq!(compare(&edges, &seen(&log), span), Ok(5));
        let mut late = log.clone();
        late[4] = "1.000 ms: trigger 0 1 after sample 18".to_owned();
        assert!(compare(&edges, &seen(&late), span).is_err());
        assert!(compare(&edges, &seen(&log[..5]), span).is_err());
        assert!(compare(&edges, &[], span).is_err());
    }
}
