//! Types of path arguments: input, output, folder, device. From these types one check of all commands ensures that no output is
//! an input and that no two outputs are the same file.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::ops::Deref;
use std::path::{Path, PathBuf};

use clap::builder::{MapValueParser, PathBufValueParser, TypedValueParser, ValueParserFactory};
use clap::{ArgMatches, ValueHint};

use specgen_language::files::{self, Destination, OutputError};
use specgen_language::outcome::Failure;
use specgen_language::output::refused_output;

macro_rules! path_types {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq)]
        pub struct $name(PathBuf);

        impl Deref for $name {
            type Target = Path;
            fn deref(&self) -> &Path {
                &self.0
            }
        }

        impl AsRef<Path> for $name {
            fn as_ref(&self) -> &Path {
                self
            }
        }

        impl AsRef<OsStr> for $name {
            fn as_ref(&self) -> &OsStr {
                self.0.as_ref()
            }
        }

        impl From<PathBuf> for $name {
            fn from(path: PathBuf) -> Self {
                Self(path)
            }
        }

        impl ValueParserFactory for $name {
            type Parser = MapValueParser<PathBufValueParser, fn(PathBuf) -> Self>;
            fn value_parser() -> Self::Parser {
                PathBufValueParser::new().map(Self)
            }
        }
    )*};
}

path_types! {
    /// A file that the command reads.
    InputFile
    /// A file that the command writes.
    OutputFile
    /// A table that the command writes, as CSV or as arrays.
    TableFile
    /// A table that the command writes, or a folder that it writes files into.
    OutputFileOrFolder
    /// A folder that the command writes files into, or a prefix of their names.
    OutputFolder
    /// A device or a socket.
    Endpoint
}

/// Check of an output.
type Guard = fn(&Path) -> Result<Destination, OutputError>;

/// Refuses outputs that would replace an input or another output, and outputs that cannot be written, before anything is read.
pub fn check(matches: &ArgMatches) -> Result<(), Failure> {
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    collect(matches, &mut inputs, &mut outputs);
    inputs.iter().for_each(|path| files::note_input(path));
    let mut seen = BTreeSet::new();
    for (path, guard) in &outputs {
        let way = guard(path).map_err(|why| refused_output(path, &why))?;
        let Destination::File(target) = way else { continue };
        if !seen.insert(whole(&target)) {
            return Err(refused_output(path, &OutputError::Twice));
        }
    }
    Ok(())
}

/// A canonical path of a file that need not exist.
fn whole(target: &Path) -> PathBuf {
    let absolute = std::path::absolute(target).unwrap_or_else(|_| target.to_owned());
    let folder = absolute.parent().and_then(|folder| folder.canonicalize().ok());
    folder.zip(absolute.file_name()).map_or(absolute.clone(), |(folder, name)| folder.join(name))
}

fn collect(matches: &ArgMatches, inputs: &mut Vec<PathBuf>, outputs: &mut Vec<(PathBuf, Guard)>) {
    for id in matches.ids().map(clap::Id::as_str) {
        if let Ok(Some(found)) = matches.try_get_many::<InputFile>(id) {
            inputs.extend(found.map(|one| one.0.clone()));
        }
        if let Ok(Some(found)) = matches.try_get_many::<OutputFile>(id) {
            outputs.extend(found.map(|one| (one.0.clone(), files::guard as Guard)));
        }
        if let Ok(Some(found)) = matches.try_get_many::<TableFile>(id) {
            outputs.extend(found.map(|one| (one.0.clone(), files::guard_table as Guard)));
        }
        if let Ok(Some(found)) = matches.try_get_many::<OutputFileOrFolder>(id) {
            outputs.extend(found.filter(|one| !one.0.is_dir()).map(|one| (one.0.clone(), files::guard_table as Guard)));
        }
    }
    if let Some((_, below)) = matches.subcommand() {
        collect(below, inputs, outputs);
    }
}

/// Role of a path argument; none for other arguments.
pub fn role(argument: &clap::Arg) -> Option<Role> {
    use clap::builder::ValueParser;
    let is = |parser: ValueParser| argument.get_value_parser().type_id() == parser.type_id();
    let roles = [
        (ValueParser::from(InputFile::value_parser()), Role::Input),
        (ValueParser::from(OutputFile::value_parser()), Role::Output),
        (ValueParser::from(TableFile::value_parser()), Role::Output),
        (ValueParser::from(OutputFileOrFolder::value_parser()), Role::Output),
        (ValueParser::from(OutputFolder::value_parser()), Role::Folder),
        (ValueParser::from(Endpoint::value_parser()), Role::Endpoint),
        (ValueParser::path_buf(), Role::Unknown),
    ];
    roles.into_iter().find(|(parser, _)| is(parser.clone())).map(|(_, role)| role)
}

/// Role of a path argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It is read.
    Input,
    /// It is written.
    Output,
    /// Files are written into it.
    Folder,
    /// A device or a socket.
    Endpoint,
    /// A plain path, which no argument may be.
    Unknown,
}

/// Adds hints, so that shells complete file names.
pub fn with_hints(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|argument| match role(&argument) {
        Some(_) => argument.value_hint(ValueHint::AnyPath),
        None => argument,
    });
    command.mut_subcommands(with_hints)
}
