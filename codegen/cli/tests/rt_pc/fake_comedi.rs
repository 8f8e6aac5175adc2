//! A stand-in for libcomedi, built by the test: two cards with sixteen inputs and four outputs each. On closing it writes what was done
//! with it. Its inputs stand still, or follow the outputs: `FAKE_PER_CODE` has 36 numbers, steps of each of six inputs (rows) per step of
//! each of six outputs. `FAKE_FAIL_AFTER`: readings after which it fails;
//! `FAKE_REFUSES`: how often it refuses to take the enable line low once that was high; `FAKE_HIGH_AFTER`: looks at a digital line after which that is high; `FAKE_CONTACTS`: file whose first letters are the contacts of
//! emergency stop and amplifiers, `0` for open, both closed without one; `FAKE_BEATS`: file that gets time (ns since 1970, u64) and level (u64) of
//! every beat of the heartbeat; `FAKE_LOG`: file to write.

use std::ffi::{c_char, c_double, c_int, c_uint, c_void};
use std::sync::{LazyLock, Mutex};

#[repr(C)]
pub struct Instruction {
    kind: c_uint,
    count: c_uint,
    data: *mut c_uint,
    subdevice: c_uint,
    channel: c_uint,
    unused: [c_uint; 3],
}

#[repr(C)]
pub struct List {
    count: c_uint,
    instructions: *mut Instruction,
}

struct Log {
    cards: u64,
    reads: u64,
    writes: [u64; 3],
    codes: [u32; 2],
    outputs: [u32; 6],
    lines: Vec<u32>,
    refused: u64,
    /// Digital lines with their directions, and how often one was looked at or, but for the first, set.
    directions: Vec<(u32, u32)>,
    looks: u64,
    sets: u64,
    beats: u64,
    beat_file: Option<std::fs::File>,
    bad: Vec<String>,
}

static LOG: Mutex<Log> = Mutex::new(Log {
    cards: 0,
    reads: 0,
    writes: [0; 3],
    codes: [u32::MAX, 0],
    outputs: [0; 6],
    lines: Vec::new(),
    refused: 0,
    directions: Vec::new(),
    looks: 0,
    sets: 0,
    beats: 0,
    beat_file: None,
    bad: Vec::new(),
});

/// Code of an input, in the middle of its range with every output at 0.
fn follow(input: usize, outputs: &[u32; 6]) -> u32 {
    static PER_CODE: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let text = std::env::var("FAKE_PER_CODE").unwrap_or_default();
        text.split_whitespace().map(|number| number.parse().unwrap()).collect()
    });
    let row = PER_CODE.iter().skip(6 * input).zip(outputs);
    (65_536.0 + row.map(|(per_code, code)| per_code * f64::from(*code)).sum::<f64>()).round() as u32
}

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

// SAFETY: as libcomedi's: the path is a string that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn comedi_open(path: *const c_char) -> *mut c_void {
    // SAFETY: see above.
    let path = unsafe { std::ffi::CStr::from_ptr(path) }.to_string_lossy().into_owned();
    // /dev/fake1 is card 1, and so on.
    match path.strip_prefix("/dev/fake").and_then(|number| number.parse::<usize>().ok()) {
        Some(card @ 1..=2) => {
            LOG.lock().unwrap().cards += 1;
            card as *mut c_void
        }
        _ => std::ptr::null_mut(),
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_close(_: *mut c_void) -> c_int {
    let mut log = LOG.lock().unwrap();
    log.cards -= 1;
    if let (0, Ok(file)) = (log.cards, std::env::var("FAKE_LOG")) {
        let lines: Vec<String> = log.lines.iter().map(u32::to_string).collect();
        let directions: Vec<String> = log.directions.iter().map(|(line, way)| format!("{line}:{way}")).collect();
        let text = format!(
            "reads={}\nwrites1={}\nwrites2={}\nlowest={}\nhighest={}\nline={}\ndirections={}\nlooks={}\nsets={}\nbeats={}\nbad={}\n",
            log.reads,
            log.writes[1],
            log.writes[2],
            log.codes[0],
            log.codes[1],
            lines.join(","),
            directions.join(","),
            log.looks,
            log.sets,
            log.beats,
            log.bad.join(";")
        );
        std::fs::write(file, text).unwrap();
    }
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_errno() -> c_int {
    2
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_strerror(_: c_int) -> *const c_char {
    c"No such device".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_get_board_name(_: *mut c_void) -> *const c_char {
    c"fake-6229".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_find_subdevice_by_type(_: *mut c_void, kind: c_int, _: c_uint) -> c_int {
    match kind {
        1 => 0,
        2 => 1,
        5 => 2,
        _ => -1,
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_get_n_channels(_: *mut c_void, subdevice: c_uint) -> c_int {
    [16, 4, 32][subdevice as usize]
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_get_maxdata(_: *mut c_void, _: c_uint, _: c_uint) -> c_uint {
    number("FAKE_HIGHEST", 131_071) as c_uint
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_find_range(_: *mut c_void, _: c_uint, _: c_uint, _: c_uint, low: c_double, high: c_double) -> c_int {
    if low >= -10.0 && high <= 10.0 { 3 } else { -1 }
}

// SAFETY: as libcomedi's: the list leads to its instructions, and each of them to its data.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn comedi_do_insnlist(card: *mut c_void, list: *mut List) -> c_int {
    let mut log = LOG.lock().unwrap();
    // SAFETY: see above.
    let list = unsafe { &*list };
    // SAFETY: see above.
    let instructions = unsafe { std::slice::from_raw_parts(list.instructions, list.count as usize) };
    for (place, instruction) in (0_u32..).zip(instructions) {
        // SAFETY: see above.
        let code = unsafe { &mut *instruction.data };
        let (differential, ground) = (2 << 24 | 3 << 16 | place, 3 << 16 | place);
        match (instruction.kind, instruction.subdevice, instruction.count) {
            (0x0400_0000, 0, 1) if instruction.channel == differential => {
                log.reads += 1;
                if log.reads > number("FAKE_FAIL_AFTER", u64::MAX) {
                    return -1;
                }
                *code = follow(place as usize, &log.outputs);
            }
            (0x0800_0001, 1, 1) if instruction.channel == ground && place < 4 => {
                log.writes[card as usize] += 1;
                log.outputs[(card as usize - 1) * 4 + place as usize] = *code;
                log.codes = [log.codes[0].min(*code), log.codes[1].max(*code)];
            }
            odd => log.bad.push(format!("{odd:?} channel {:x}", instruction.channel)),
        }
    }
    list.count as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_dio_config(_: *mut c_void, subdevice: c_uint, line: c_uint, direction: c_uint) -> c_int {
    let mut log = LOG.lock().unwrap();
    if subdevice != 2 {
        log.bad.push(format!("line {line} of subdevice {subdevice}"));
    }
    log.directions.push((line, direction));
    1
}

// SAFETY: as libcomedi's: the word is the caller's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn comedi_dio_read(_: *mut c_void, _: c_uint, _: c_uint, bit: *mut c_uint) -> c_int {
    let mut log = LOG.lock().unwrap();
    log.looks += 1;
    // SAFETY: see above.
    unsafe { *bit = c_uint::from(log.looks > number("FAKE_HIGH_AFTER", u64::MAX)) };
    1
}

#[unsafe(no_mangle)]
pub extern "C" fn comedi_dio_write(_: *mut c_void, _: c_uint, line: c_uint, bit: c_uint) -> c_int {
    let mut log = LOG.lock().unwrap();
    if (line, bit, log.lines.last()) == (0, 0, Some(&1)) && log.refused < number("FAKE_REFUSES", 0) {
        log.refused += 1;
        return -1;
    }
    match line {
        0 => log.lines.push(bit),
        _ => log.sets += 1,
    }
    1
}

// SAFETY: as libcomedi's: the word is the caller's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn comedi_dio_bitfield2(_: *mut c_void, subdevice: c_uint, mask: c_uint, bits: *mut c_uint, first: c_uint) -> c_int {
    let mut log = LOG.lock().unwrap();
    // SAFETY: see above.
    let bits = unsafe { &mut *bits };
    let heartbeat = log.directions.iter().filter(|(_, way)| *way == 1).map(|(line, _)| *line).max();
    if (subdevice, mask, Some(first)) != (2, 1, heartbeat) {
        log.bad.push(format!("lines {mask:b} from {first} of subdevice {subdevice}"));
    }
    let level = u64::from(*bits & 1);
    if level != (log.beats + 1) % 2 {
        log.bad.push("a beat without a change".to_owned());
    }
    log.beats += 1;
    if let (None, Ok(path)) = (&log.beat_file, std::env::var("FAKE_BEATS")) {
        log.beat_file = Some(std::fs::File::create(path).unwrap());
    }
    if let Some(file) = &mut log.beat_file {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        let words = [now.as_nanos() as u64, level];
        std::io::Write::write_all(file, &words.map(u64::to_le_bytes).concat()).unwrap();
    }
    let contacts = std::env::var("FAKE_CONTACTS").map_or("11".to_owned(), |path| std::fs::read_to_string(path).unwrap());
    let closed = |place: usize| u32::from(contacts.as_bytes().get(place) != Some(&b'0'));
    *bits = *bits & 1 | closed(0) << 1 | closed(1) << 2;
    0
}
