//! Files that a user names: how they are opened, and which outputs are refused.
//!
//! [`open`] checks the kind of a file before it opens it, and notes that the command has read it. [`guard`] refuses an
//! output that would replace one of these files, under any name. The notes belong to one command: [`forget_inputs`]
//! clears them. A command opens its files in the thread that runs it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::arrays::Form;
use rustix::fs::{Access, OFlags, access, fcntl_setfl};

/// Largest file whose content is kept in memory, bytes.
pub const MAX_BYTES: u64 = 256 << 20;
/// Time for a program to open the read end of a pipe that is written to.
const READER: Duration = Duration::from_secs(2);
/// Longest chain of links, as in Linux.
const LINKS: usize = 40;

/// Identity of a file under any name: device and inode.
type Identity = (u64, u64);

thread_local! {
    /// The files that the command of this thread has read, by the first name of each.
    static INPUTS: RefCell<BTreeMap<Identity, PathBuf>> = const { RefCell::new(BTreeMap::new()) };
}

/// Clears the list of inputs: a new command starts.
pub fn forget_inputs() {
    INPUTS.take();
}

fn identity(found: &Metadata) -> Identity {
    (found.dev(), found.ino())
}

fn remember(found: &Metadata, path: &Path) {
    INPUTS.with_borrow_mut(|inputs| {
        inputs.entry(identity(found)).or_insert_with(|| path.to_owned());
    });
}

/// Kind of a file, in words.
fn kind(found: &Metadata) -> &'static str {
    let kind = found.file_type();
    if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a named pipe (FIFO)"
    } else if kind.is_socket() {
        "a socket"
    } else if kind.is_file() {
        "a regular file"
    } else {
        "a device"
    }
}

/// Reason why a file cannot be read.
#[derive(Debug)]
pub enum ReadError {
    /// It is not a regular file, but of this kind.
    Kind(&'static str),
    /// It has more bytes than this.
    Large(u64),
    /// It is not UTF-8 text from this byte on, which is in this line (from 1).
    Text {
        /// From 0.
        byte: usize,
        /// From 1.
        line: usize,
    },
    /// The error of the operating system.
    System(io::Error),
}

impl ReadError {
    /// How to fix it.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Kind("a folder") => "name a file in it",
            Self::Kind(_) => "store its output in a file, and name that file",
            Self::Large(_) => "name a smaller file",
            Self::Text { .. } => "save it as UTF-8 text",
            Self::System(_) => "check the path and its permissions",
        }
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kind(kind) => write!(f, "it is {kind}, expected a regular file"),
            Self::Large(limit) if *limit < 1 << 20 => write!(f, "it is larger than {limit} bytes"),
            Self::Large(limit) => write!(f, "it is larger than {} MiB", limit >> 20),
            Self::Text { byte, line } => write!(f, "it is not UTF-8 text: byte {byte}, in line {line}"),
            Self::System(error) => match error.kind() {
                io::ErrorKind::NotFound => f.write_str("there is no such file"),
                io::ErrorKind::PermissionDenied => f.write_str("reading it is not permitted"),
                _ => write_error(error, f),
            },
        }
    }
}

/// The error of the operating system, reworded if its own text is of no help.
fn write_error(error: &io::Error, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match error.kind() {
        io::ErrorKind::InvalidFilename => f.write_str("its name is too long"),
        _ => write!(f, "{error}"),
    }
}

impl std::error::Error for ReadError {}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        Self::System(error)
    }
}

/// Opens a regular file to read, or a pipe that this process was given, such as `/dev/stdin` or a shell's `<(…)`. A
/// named pipe is refused: without a writer it would block for ever.
///
/// # Errors
/// If it is of another kind, or the operating system refuses.
pub fn open(path: &Path) -> Result<File, ReadError> {
    let found = fs::metadata(path)?;
    // A file without a name was passed to this process.
    let given = found.file_type().is_fifo() && fs::canonicalize(path).is_err();
    if given { opened(path, &found, true) } else { open_file(path) }
}

/// Opens a regular file to read.
///
/// # Errors
/// As [`open`].
pub fn open_file(path: &Path) -> Result<File, ReadError> {
    opened(path, &fs::metadata(path)?, false)
}

fn opened(path: &Path, found: &Metadata, pipe: bool) -> Result<File, ReadError> {
    let fits = |found: &Metadata| found.is_file() || (pipe && found.file_type().is_fifo());
    if !fits(found) {
        return Err(ReadError::Kind(kind(found)));
    }
    // It may be another file by now: open without blocking, and check again.
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let file = OpenOptions::new().read(true).custom_flags(flags.bits().cast_signed()).open(path)?;
    let found = file.metadata()?;
    if !fits(&found) {
        return Err(ReadError::Kind(kind(&found)));
    }
    if pipe {
        fcntl_setfl(&file, OFlags::empty()).map_err(io::Error::from)?;
    } else {
        remember(&found, path);
    }
    Ok(file)
}

/// Checks whether [`read`] would read a file of at most [`MAX_BYTES`].
///
/// # Errors
/// As [`read`].
pub fn look(path: &Path) -> Result<(), ReadError> {
    let found = open(path)?.metadata()?;
    if found.is_file() && found.len() > MAX_BYTES { Err(ReadError::Large(MAX_BYTES)) } else { Ok(()) }
}

/// The content of a file.
///
/// # Errors
/// As [`open`], or if it has more bytes than `limit`.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    content(open(path)?, limit)
}

/// The rest of an open file.
///
/// # Errors
/// If it has more bytes than `limit`, or the operating system refuses.
pub fn content(file: File, limit: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    // One byte more shows that it is too large.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(ReadError::Large(limit)) } else { Ok(bytes) }
}

/// The content of a text file of at most [`MAX_BYTES`].
///
/// # Errors
/// As [`read`], or if it is not UTF-8.
pub fn text(path: &Path) -> Result<String, ReadError> {
    text_of(path, MAX_BYTES)
}

/// The same with another limit, bytes.
///
/// # Errors
/// As [`text`].
pub fn text_of(path: &Path, limit: u64) -> Result<String, ReadError> {
    String::from_utf8(read(path, limit)?).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..byte].iter().filter(|byte| **byte == b'\n').count();
        ReadError::Text { byte, line }
    })
}

/// Notes, before a command reads this file, that it does.
pub fn note_input(path: &Path) {
    if let Ok(found) = fs::metadata(path)
        && found.is_file()
    {
        remember(&found, path);
    }
}

/// The input that is this file, by the name under which it was read; none if the command has not read it.
fn input(path: &Path) -> Option<PathBuf> {
    let found = fs::metadata(path).ok()?;
    INPUTS.with_borrow(|inputs| inputs.get(&identity(&found)).cloned())
}

/// Reason why a file cannot be written.
#[derive(Debug)]
pub enum OutputError {
    /// It is this input of the same command.
    Input(PathBuf),
    /// Another output of the same command has this name.
    Twice,
    /// It has the suffix of a table as arrays, but no table; this name has none.
    Arrays(PathBuf),
    /// It is write-protected.
    Protected,
    /// It is of a kind that cannot be an output.
    Kind(&'static str),
    /// It is a pipe without a reader.
    Unheard,
    /// The error of the operating system.
    System(io::Error),
}

impl fmt::Display for OutputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(name) => {
                write!(f, "it is an input of this command, `{}`; name another file", name.display())
            }
            Self::Twice => f.write_str("another output of this command has the same name; name two files"),
            Self::Arrays(name) => {
                write!(f, "only tables are written as .npz and .mat; name another file, such as `{}`", name.display())
            }
            Self::Protected => f.write_str("it is write-protected; name another file, or permit writing to this one"),
            Self::Kind("a folder") => f.write_str("it is a folder, name a file in it"),
            Self::Kind(kind) => write!(f, "it is {kind}; name a regular file"),
            Self::Unheard => f.write_str("no program reads this pipe; start its reader first"),
            Self::System(error) => write_error(error, f),
        }
    }
}

impl std::error::Error for OutputError {}

impl From<io::Error> for OutputError {
    fn from(error: io::Error) -> Self {
        Self::System(error)
    }
}

/// Destination of an output.
#[derive(Debug)]
pub enum Destination {
    /// A regular file of this name, existing or not, but not a link.
    File(PathBuf),
    /// A device or a pipe.
    Device,
}

/// Checks whether a command may write this file: it is not one of its inputs, by device and inode, its permissions allow
/// it, and its suffix is not that of a table as arrays.
///
/// # Errors
/// Why not.
pub fn guard(path: &Path) -> Result<Destination, OutputError> {
    if Form::of(path).is_some() { Err(OutputError::Arrays(path.with_extension(""))) } else { guard_table(path) }
}

/// The same for a table, which may have any suffix.
///
/// # Errors
/// As [`guard`].
pub fn guard_table(path: &Path) -> Result<Destination, OutputError> {
    if let Some(name) = input(path) { Err(OutputError::Input(name)) } else { guard_edit(path) }
}

/// The same for a command whose purpose is to edit an input.
///
/// # Errors
/// As [`guard`].
pub fn guard_edit(path: &Path) -> Result<Destination, OutputError> {
    let target = behind_links(path)?;
    let found = match fs::metadata(path) {
        Ok(found) => found,
        // A missing parent folder is made later, or causes an error then.
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(Destination::File(target));
        }
        Err(error) => return Err(error.into()),
    };
    let of = found.file_type();
    if of.is_dir() || of.is_socket() || of.is_block_device() {
        return Err(OutputError::Kind(if of.is_block_device() { "a disk" } else { kind(&found) }));
    }
    if !found.is_file() {
        return Ok(Destination::Device);
    }
    // Root may write everything, but the permissions still count.
    if found.mode() & 0o222 == 0 || access(path, Access::WRITE_OK).is_err() {
        return Err(OutputError::Protected);
    }
    Ok(Destination::File(target))
}

/// The name at the end of a chain of links; it need not exist.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    if let Ok(whole) = fs::canonicalize(path) {
        return Ok(whole);
    }
    let mut target = path.to_owned();
    for _ in 0..LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = target.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("links lead in a circle"))
}

/// Opens a device or a pipe to write to. A pipe without a reader is refused after a moment.
///
/// # Errors
/// If nobody reads the pipe, or the operating system refuses.
pub fn open_device(path: &Path) -> Result<File, OutputError> {
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let until = Instant::now() + READER;
    loop {
        match OpenOptions::new().write(true).custom_flags(flags.bits().cast_signed()).open(path) {
            Ok(file) => {
                fcntl_setfl(&file, OFlags::empty()).map_err(io::Error::from)?;
                return Ok(file);
            }
            Err(error) if error.raw_os_error() != Some(rustix::io::Errno::NXIO.raw_os_error()) => {
                return Err(error.into());
            }
            Err(_) if Instant::now() >= until => return Err(OutputError::Unheard),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

/// Waits until a file, or the list of a folder, is on the disk.
///
/// # Errors
/// As the file system reports them.
pub fn sync(path: &Path) -> io::Result<()> {
    match File::open(path)?.sync_all() {
        // A file system that knows no such thing.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        done => done,
    }
}

#[cfg(test)]
mod tests;
