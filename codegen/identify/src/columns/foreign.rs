//! Files of programs of the bench that are no text: told by their first bytes, answered by the line that exports them.

use crate::findings::Findings;
use specgen_language::diagnostic::codes;

/// Reports a file that is told by its first line; whether it is one.
pub(crate) fn report(first: &[u8], findings: &mut Findings) -> bool {
    report_as(first, "not a text file", findings)
}

/// The same, with what else is to be said of it.
pub(crate) fn report_as(first: &[u8], more: &str, findings: &mut Findings) -> bool {
    let Some((what, help)) = told(first, findings.path()) else { return false };
    findings.add(codes::RECORD_NOT_TEXT, Some(1), format!("is {what}, {more}"), &help);
    true
}

/// What a file is, and how it becomes CSV.
fn told(first: &[u8], path: &str) -> Option<(&'static str, String)> {
    let stem = path.rsplit_once('.').map_or(path, |(stem, _)| stem);
    let csv = format!("{}.csv", stem.strip_suffix(".csv").unwrap_or(stem));
    let python = |import: &str, columns: &str| {
        let packages = import.split('.').next().unwrap_or(import);
        format!(
            "`python3 -c \"import numpy as n,{import};d={columns};n.savetxt('{csv}',n.c_[tuple(d.values())],delimiter=',',header=','.join(d),comments='')\"` \
             writes {csv}: its columns must have one length, and the names have the units (needs `pip install {packages}`)"
        )
    };
    let found = [
        (
            &b"MATLAB 5.0 MAT-file"[..],
            "a MAT-file of version 5",
            "scipy.io as s",
            "{k:n.ravel(v) for k,v in s.loadmat('PATH').items() if k[0]!='_'}",
        ),
        (
            b"MATLAB 7.3 MAT-file",
            "a MAT-file of version 7.3",
            "h5py",
            "{k:n.ravel(v) for k,v in h5py.File('PATH').items() if k[0]!='#'}",
        ),
        (b"\x89HDF", "an HDF5 file", "h5py", "{k:n.ravel(v) for k,v in h5py.File('PATH').items()}"),
        (
            b"TDSm",
            "a TDMS file of LabVIEW",
            "nptdms",
            "{c.name:c[:] for g in nptdms.TdmsFile.read('PATH').groups() for c in g.channels()}",
        ),
    ];
    if let Some((_, what, import, columns)) = found.iter().find(|(magic, ..)| first.starts_with(magic)) {
        return Some((what, python(import, &columns.replace("PATH", path))));
    }
    let others = [
        (&b"PK\x03\x04"[..], "a ZIP archive, as spreadsheets are", "save the sheet as CSV in UTF-8".to_owned()),
        (b"\xd0\xcf\x11\xe0", "a spreadsheet of an old kind", "save the sheet as CSV in UTF-8".to_owned()),
        (b"\x1f\x8b", "packed by gzip", format!("`gunzip -c {path} > {csv}`")),
        (b"\xff\xfe", "text in UTF-16", format!("`iconv -f UTF-16 -t UTF-8 {path} > {csv}`")),
        (b"\xfe\xff", "text in UTF-16", format!("`iconv -f UTF-16 -t UTF-8 {path} > {csv}`")),
        (
            b"\x93NUMPY",
            "an array of NumPy",
            format!(
                "`python3 -c \"import numpy as n;n.savetxt('{csv}',n.load('{path}'),delimiter=',')\"`, then name the columns by `--columns`"
            ),
        ),
    ];
    others.into_iter().find(|(magic, ..)| first.starts_with(magic)).map(|(_, what, help)| (what, help))
}
