//! Errors of a session, and messages for refusals of the device.

use specgen_link::Refusal;
use specgen_link::client::ClientError;

use specgen_language::outcome::Failure;

/// Why a session or a command fails.
#[derive(Debug)]
pub enum SessionError {
    /// A command is not possible, or the device refuses it.
    Refused(String),
    /// The machine faulted, or a wait timed out.
    Fault(String),
    /// A failure of the command line, such as a file that cannot be written.
    Failed(Failure),
    /// The link broke.
    Link(ClientError),
    /// Ctrl-C.
    Interrupted,
    /// The program that served the link has ended, as requested.
    Stopped,
}

impl From<ClientError> for SessionError {
    fn from(error: ClientError) -> Self {
        match error {
            // A board that was reset knows no session.
            ClientError::Refused(Refusal::NoSession | Refusal::Sequence) => Self::Link(error),
            ClientError::Refused(_) => Self::Refused(error.to_string()),
            other => Self::Link(other),
        }
    }
}

/// The error of `stop`: the program of a board cannot be ended.
pub(super) fn unsupported(error: ClientError) -> SessionError {
    match error {
        ClientError::Refused(Refusal::Unsupported) => SessionError::Refused(
            "the program of a board cannot be ended; `ramp-down` switches its amplifiers off".to_owned(),
        ),
        other => other.into(),
    }
}

/// The error of a machine without an input line.
pub(super) fn no_input() -> SessionError {
    SessionError::Refused(
        "the machine has no input line; declare one in its spec: [[trigger]] with name = \"start\" and kind = \"input\""
            .to_owned(),
    )
}

/// The error of a set-point: a running wave excludes others.
pub(super) fn waving(error: ClientError) -> SessionError {
    match error {
        ClientError::Refused(Refusal::State) => SessionError::Refused(
            "set-points are accepted only while the machine is running or driving, with no wave and no lock-step in progress"
                .to_owned(),
        ),
        other => other.into(),
    }
}
