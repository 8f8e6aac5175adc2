//! Writes MAT-files of version 5, to test how they are read.

/// An element with its type, length and bytes.
pub(super) fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut all = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    all.extend(bytes);
    all.resize(all.len().next_multiple_of(8), 0);
    all
}

fn array(class: u8, size: [u32; 2], name: &str, data: &[Vec<u8>]) -> Vec<u8> {
    sized(class, &element(5, &size.map(u32::to_le_bytes).concat()), &element(1, name.as_bytes()), &data.concat())
}

/// An array of these elements.
pub(super) fn sized(class: u8, size: &[u8], name: &[u8], data: &[u8]) -> Vec<u8> {
    let flags = element(6, &[class, 0, 0, 0, 0, 0, 0, 0]);
    element(14, &[&flags, size, name, data].concat())
}

/// A matrix, column by column.
pub(super) fn doubles(name: &str, size: [u32; 2], values: &[f64]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    array(6, size, name, &[element(9, &bytes)])
}

pub(super) fn column(name: &str, values: &[f64]) -> Vec<u8> {
    doubles(name, [values.len() as u32, 1], values)
}

/// A scalar of class int32, stored in the short form.
pub(super) fn int32(name: &str, value: i32) -> Vec<u8> {
    array(12, [1, 1], name, &[[0x0004_0005_u32.to_le_bytes(), value.to_le_bytes()].concat()])
}

pub(super) fn text(name: &str, text: &str) -> Vec<u8> {
    let bytes: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    array(4, [1, text.len() as u32], name, &[element(4, &bytes)])
}

/// An object of a class, such as a time series or a text in double quotes.
pub(super) fn object(name: &str, class: &str) -> Vec<u8> {
    let texts = [name, "MCOS", class].map(|text| element(1, text.as_bytes()));
    let flags = element(6, &[17, 0, 0, 0, 0, 0, 0, 0]);
    element(14, &[flags, texts.concat(), doubles("", [1, 1], &[1.0])].concat())
}

/// Structs, each with a value for every field.
pub(super) fn structs(name: &str, fields: &[&str], values: &[Vec<Vec<u8>>]) -> Vec<u8> {
    let mut names = Vec::new();
    for field in fields {
        names.extend(field.as_bytes());
        names.resize(names.len().next_multiple_of(32), 0);
    }
    let heads = vec![element(5, &32_u32.to_le_bytes()), element(1, &names)];
    array(2, [1, values.len() as u32], name, &[heads, values.concat()].concat())
}

/// The content of the objects, which is the last variable and has no name.
pub(super) fn subsystem() -> Vec<u8> {
    array(9, [1, 5000], "", &[element(2, &[7; 5000])])
}

pub(super) fn file(variables: &[Vec<u8>]) -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file, made for a test".to_vec();
    file.resize(124, b' ');
    file.extend(b"\0\x01IM");
    file.extend(variables.concat());
    file
}
