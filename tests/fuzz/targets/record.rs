//! Files of records.

use host_sim::record::{FileItem, Reader, write_csv};
use specgen_runtime::record::{FILE_MAGIC, FORMAT, HEADER_WORDS, checksum, write_header};

/// A file is read to its end, as it is and with checksums that fit; what is whole can be exported.
pub fn record(input: &[u8]) {
    read(input);
    read(&sealed(input));
}

fn read(file: &[u8]) {
    let mut reader = match Reader::new(file) {
        Ok(reader) => reader,
        Err(why) => return assert!(!why.to_string().is_empty()),
    };
    let header = reader.header().clone();
    let mut bytes = 0;
    while let Some(piece) = reader.next_piece().unwrap() {
        bytes += HEADER_WORDS * 8;
        match piece {
            FileItem::Block(block) => {
                assert!(block.rows.iter().all(|row| row.input.len() == header.input_names().len()));
                write_csv(&mut Vec::new(), &header, &block, None, true).unwrap();
            }
            FileItem::Damaged { reason, .. } => assert!(!reason.is_empty()),
            FileItem::Cut { bytes } => assert!(bytes < file.len()),
        }
        assert!(bytes <= file.len() + HEADER_WORDS * 8, "more pieces than the file has room for");
    }
    assert!(reader.next_piece().unwrap().is_none());
}

/// The file with the checksums that its bytes ask for, as far as its lengths make sense: a fuzzer does not find them.
fn sealed(input: &[u8]) -> Vec<u8> {
    let mut file = input.to_vec();
    let Some(start) = file.first_chunk_mut::<16>() else { return file };
    start[..8].copy_from_slice(&FILE_MAGIC);
    start[8..12].copy_from_slice(&FORMAT.to_le_bytes());
    let length = u32::from_le_bytes([start[12], start[13], start[14], start[15]]) as usize;
    let mut header = Vec::new();
    let text = file.get(16..length.saturating_add(16)).and_then(|text| str::from_utf8(text).ok());
    let _ = write_header(text.unwrap_or_default(), |piece| {
        header.extend_from_slice(piece);
        Ok::<(), ()>(())
    });
    let mut place = header.len();
    if let Some(slot) = file.get_mut(..place) {
        slot.copy_from_slice(&header);
    }
    loop {
        let word = |place: usize| file.get(place..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
        let Some(length) = word(place + 8).filter(|length| *length <= file.len() as u64 / 8) else { return file };
        let Some(words) = (0..length as usize).map(|k| word(place + 8 * k)).collect::<Option<Vec<u64>>>() else {
            return file;
        };
        place += 8 * words.len();
        if words.len() < HEADER_WORDS {
            return file;
        }
        let Some(slot) = file.get_mut(place..place + 8) else { return file };
        slot.copy_from_slice(&checksum(&words).to_le_bytes());
        place += 8;
    }
}
