//! Errors of a session, and the meaning of refusals of the device.

use specgen_link::Refusal;
use specgen_link::client::ClientError;

use specgen_language::outcome::Failure;

/// Reasons why a session ends before its commands do.
#[derive(Debug)]
pub enum SessionError {
    /// A command is not possible here, or the device refuses it.
    Refused(String),
    /// The machine faulted, or did not do in time what a command waits for.
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
            ClientError::Refused(_) => Self::Refused(error.to_string()),
            other => Self::Link(other),
        }
    }
}

/// A board cannot be stopped.
pub(super) fn unsupported(error: ClientError) -> SessionError {
    match error {
        ClientError::Refused(Refusal::Unsupported) => {
            SessionError::Refused("a board does not end; `ramp-down` switches its amplifiers off".to_owned())
        }
        other => other.into(),
    }
}

/// A machine without an input line.
pub(super) fn no_input() -> SessionError {
    SessionError::Refused(
        "the machine has no input line; declare one in its spec: [[trigger]] with name = \"start\" and kind = \"input\""
            .to_owned(),
    )
}

/// Set-points are refused while a wave makes them.
pub(super) fn waving(error: ClientError) -> SessionError {
    match error {
        ClientError::Refused(Refusal::State) => SessionError::Refused(
            "set-points are taken while the machine runs, and not while a wave is under way or a host steps it"
                .to_owned(),
        ),
        other => other.into(),
    }
}
