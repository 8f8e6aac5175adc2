//! Binary files of bench programs: recognised by their first bytes; the help has the line that exports them.

use crate::findings::Findings;
use specgen_language::diagnostic::codes;
use specgen_language::shell;

/// Reports a file that is recognised by its first line; returns whether it was.
pub(crate) fn report(first: &[u8], findings: &mut Findings) -> bool {
    report_as(first, "not a text file", findings)
}

/// The same, with an additional text.
pub(crate) fn report_as(first: &[u8], more: &str, findings: &mut Findings) -> bool {
    let Some((what, help)) = identify(first, findings.place()) else { return false };
    findings.add(codes::RECORD_NOT_TEXT, Some(1), format!("is {what}, {more}"), &help);
    true
}

/// Kind of a file, and how to convert it to CSV. A shell line writes a new file, whatever the name of the old one.
fn identify(first: &[u8], path: &str) -> Option<(&'static str, String)> {
    let csv = shell::free(path, ".csv");
    let python = |import: &str, columns: &str| {
        let packages = import.split('.').next().unwrap_or(import);
        let script = format!(
            "import sys,numpy as n,{import};d={columns};n.savetxt(sys.argv[2],n.c_[tuple(d.values())],delimiter=\",\",header=\",\".join(d),comments=\"\")"
        );
        let line = shell::line("python3 -c").word(&script).path(path).path(&csv);
        format!(
            "`{line}` writes {csv}: its columns must have one length, and the names have the units (needs `pip install {packages}`)"
        )
    };
    let found = [
        (
            &b"MATLAB 5.0 MAT-file"[..],
            "a MAT-file of version 5",
            "scipy.io as s",
            "{k:n.ravel(v) for k,v in s.loadmat(sys.argv[1]).items() if k[0]!=\"_\"}",
        ),
        (
            b"MATLAB 7.3 MAT-file",
            "a MAT-file of version 7.3",
            "h5py",
            "{k:n.ravel(v) for k,v in h5py.File(sys.argv[1]).items() if k[0]!=\"#\"}",
        ),
        (b"\x89HDF", "an HDF5 file", "h5py", "{k:n.ravel(v) for k,v in h5py.File(sys.argv[1]).items()}"),
        (
            b"TDSm",
            "a TDMS file of LabVIEW",
            "nptdms",
            "{c.name:c[:] for g in nptdms.TdmsFile.read(sys.argv[1]).groups() for c in g.channels()}",
        ),
    ];
    if let Some((_, what, import, columns)) = found.iter().find(|(magic, ..)| first.starts_with(magic)) {
        return Some((what, python(import, columns)));
    }
    let sheet = || "save the sheet as CSV in UTF-8".to_owned();
    let found = match first {
        [b'P', b'K', 3, 4, ..] => ("a ZIP archive, as spreadsheets are", sheet()),
        [0xd0, 0xcf, 0x11, 0xe0, ..] => ("a spreadsheet of an old kind", sheet()),
        [0x1f, 0x8b, ..] => ("packed by gzip", shell::converted("gunzip -c <", path, ".csv")),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => ("text in UTF-16", shell::as_utf8("UTF-16", path)),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => {
            let script = "import sys,numpy as n;n.savetxt(sys.argv[2],n.load(sys.argv[1]),delimiter=\",\")";
            let line = shell::line("python3 -c").word(script).path(path).path(&csv);
            ("an array of NumPy", format!("`{line}`, then name {csv}, and its columns by `--columns`"))
        }
        _ => return None,
    };
    Some(found)
}
