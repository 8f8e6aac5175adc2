//! Why a session ends, and what a refusal of the device means to an operator.

use specgen_link::Refusal;
use specgen_link::client::ClientError;

use specgen_language::outcome::Failure;

/// Why a session ends before its orders do.
pub enum Ended {
    /// An order makes no sense here, or the device refuses it.
    Refused(String),
    /// The machine faulted, or did not do in time what was waited for.
    Fault(String),
    Failed(Failure),
    Link(ClientError),
    Interrupted,
    /// The program that served the link was asked to end, and has.
    Stopped,
}

impl From<ClientError> for Ended {
    fn from(error: ClientError) -> Self {
        match error {
            ClientError::Refused(_) => Self::Refused(error.to_string()),
            other => Self::Link(other),
        }
    }
}

/// Why a board cannot be stopped.
pub(super) fn unsupported(error: ClientError) -> Ended {
    match error {
        ClientError::Refused(Refusal::Unsupported) => {
            Ended::Refused("a board does not end; `ramp-down` switches its amplifiers off".to_owned())
        }
        other => other.into(),
    }
}

/// Why nothing waits for an edge.
pub(super) fn no_input() -> Ended {
    Ended::Refused(
        "the machine has no input line; declare one in its spec: [[trigger]] with name = \"start\" and kind = \"input\""
            .to_owned(),
    )
}

/// Why set-points are refused while a wave makes them.
pub(super) fn waving(error: ClientError) -> Ended {
    match error {
        ClientError::Refused(Refusal::State) => Ended::Refused(
            "set-points are taken while the machine runs, and not while a wave is under way or a host steps it"
                .to_owned(),
        ),
        other => other.into(),
    }
}
