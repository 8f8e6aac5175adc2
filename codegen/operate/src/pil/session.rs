//! Opens a session with a device, and reads its description.

use host_sim::description::Description;
use specgen_link::client::{Client, ClientError, Port, Timeout};
use specgen_link::{Identity, Request};

/// Why there is no session.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The link does not open.
    #[error(transparent)]
    Link(#[from] ClientError),
    /// There is something else at its other end.
    #[error("{0}")]
    Other(String),
}

/// A session that was opened, with the device's own description.
pub struct OpenSession<P> {
    /// The link.
    pub client: Client<P>,
    /// What the device says of itself first.
    pub identity: Identity,
    /// Its description as it came.
    pub text: String,
    /// The same, read.
    pub description: Description,
}

/// Opens a session and asks who is there.
///
/// # Errors
/// No answer, or a description that cannot be read.
pub fn open<P: Port>(port: P, timeout: Timeout) -> Result<OpenSession<P>, OpenError> {
    let (mut client, identity) = Client::open(port, session_number(), timeout)?;
    let text = client.fetch(|offset| Request::Describe { offset })?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let description = Description::parse(&text).map_err(|error| OpenError::Other(error.to_string()))?;
    Ok(OpenSession { client, identity, text, description })
}

/// Another one in every run, so that frames of the last one are not taken for those of this.
fn session_number() -> u16 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    (now.subsec_nanos() >> 8 ^ std::process::id()) as u16
}
