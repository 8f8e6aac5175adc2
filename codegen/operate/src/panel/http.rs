//! HTTP of the panel: access to the page, and the handshake of its WebSocket.

use std::io::{self, Read, Write};
use std::net::{IpAddr, TcpStream};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;

/// Largest head of a request, bytes.
const HEAD: usize = 8192;
/// Largest number of header fields.
const FIELDS: usize = 64;
/// How long a browser may take to send a request, and to accept the answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Bytes of a token.
const TOKEN: usize = 16;

/// Access control: a browser must know the token and use an address of this computer.
pub struct Guard {
    token: String,
    port: u16,
    /// File of the page about a commissioning.
    pub result: Option<PathBuf>,
}

/// The destination of a request.
#[derive(Debug, PartialEq, Eq)]
enum Route {
    Page,
    /// The page about the commissioning.
    Result,
    /// A WebSocket, with the key of its handshake.
    Socket(String),
    /// Status and reason.
    Refused(&'static str, &'static str),
}

impl Guard {
    /// A guard for a server at this port, with a random token.
    ///
    /// # Errors
    /// The system provides no random numbers.
    pub fn new(port: u16) -> io::Result<Self> {
        let mut bytes = [0; TOKEN];
        std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { token, port, result: None })
    }

    /// The token, hexadecimal.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Answers a browser; `read` is called once its request was read. Returns the stream of a WebSocket after its handshake.
    ///
    /// # Errors
    /// The browser is too slow, or has disconnected.
    pub fn admit(&self, mut stream: TcpStream, page: &str, read: impl FnOnce()) -> io::Result<Option<TcpStream>> {
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        let head = head(&mut stream);
        read();
        let head = head?;
        let route = self.route(&head);
        let result = self.result.as_ref().filter(|_| route == Route::Result);
        let result = result.and_then(|path| std::fs::read_to_string(path).ok());
        let (status, kind, body) = match &route {
            Route::Page => ("200 OK", "text/html", page),
            Route::Result => match &result {
                Some(text) => ("200 OK", "text/html", text.as_str()),
                None => ("404 Not Found", "text/plain", "there is no result yet\n"),
            },
            Route::Socket(key) => {
                let accept = derive_accept_key(key.as_bytes());
                let answer = format!(
                    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
                );
                stream.write_all(answer.as_bytes())?;
                return Ok(Some(stream));
            }
            Route::Refused(status, why) => (*status, "text/plain", *why),
        };
        // No other page may frame it, and it may load nothing from elsewhere.
        let answer = format!(
            "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n\
             Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:; \
             connect-src 'self' ws:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n\r\n",
            body.len()
        );
        stream.write_all(answer.as_bytes())?;
        stream.write_all(body.as_bytes())?;
        stream.flush()?;
        Ok(None)
    }

    fn route(&self, head: &[u8]) -> Route {
        let mut fields = [httparse::EMPTY_HEADER; FIELDS];
        let mut request = httparse::Request::new(&mut fields);
        if !matches!(request.parse(head), Ok(httparse::Status::Complete(_))) {
            return Route::Refused("400 Bad Request", "invalid HTTP request\n");
        }
        let field = |name: &str| {
            let found = request.headers.iter().find(|field| field.name.eq_ignore_ascii_case(name));
            found.and_then(|field| core::str::from_utf8(field.value).ok())
        };
        if request.method != Some("GET") {
            return Route::Refused("405 Method Not Allowed", "only GET\n");
        }
        // Against DNS rebinding: another server's name could point to this address.
        if !field("host").is_some_and(|host| self.is_here(host)) {
            return Route::Refused(
                "421 Misdirected Request",
                "open the panel by the address that it printed, not by a host name\n",
            );
        }
        let (path, query) =
            request.path.and_then(|path| path.split_once('?')).unwrap_or((request.path.unwrap_or(""), ""));
        if !matches!(path, "/" | "/commission" | "/socket") {
            return Route::Refused("404 Not Found", "the panel has only the pages / and /commission\n");
        }
        let token = query.split('&').find_map(|part| part.strip_prefix("token=")).unwrap_or("");
        if !is_same(token, &self.token) {
            return Route::Refused(
                "403 Forbidden",
                "the token is missing or wrong: open the address that `specgen panel` printed\n",
            );
        }
        match path {
            "/" => return Route::Page,
            "/commission" => return Route::Result,
            _ => {}
        }
        let of_ours = |origin: &str| origin.strip_prefix("http://").is_some_and(|origin| Some(origin) == field("host"));
        if !field("origin").is_some_and(of_ours) {
            return Route::Refused("403 Forbidden", "only the panel's own page may connect\n");
        }
        let upgrades = field("upgrade").is_some_and(|upgrade| upgrade.eq_ignore_ascii_case("websocket"));
        match field("sec-websocket-key").filter(|_| upgrades && field("sec-websocket-version") == Some("13")) {
            Some(key) => Route::Socket(key.to_owned()),
            None => Route::Refused("426 Upgrade Required", "expected a WebSocket of version 13\n"),
        }
    }

    /// Whether a `Host` is an address with our port, or `localhost`.
    fn is_here(&self, host: &str) -> bool {
        let Some((name, port)) = host.rsplit_once(':') else { return false };
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        port.parse() == Ok(self.port) && (name == "localhost" || bare.parse::<IpAddr>().is_ok())
    }
}

/// Compares tokens in constant time.
fn is_same(given: &str, token: &str) -> bool {
    let differ = given.bytes().zip(token.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b));
    given.len() == token.len() && differ == 0
}

/// Reads the head of a request. Data after it is dropped: a browser waits for the answer.
fn head(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let begun = Instant::now();
    let mut head = Vec::new();
    let mut bytes = [0; 1024];
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let left = PATIENCE.checked_sub(begun.elapsed()).filter(|left| !left.is_zero());
        stream.set_read_timeout(Some(left.ok_or(io::ErrorKind::TimedOut)?))?;
        let count = stream.read(&mut bytes)?;
        if count == 0 || head.len() + count > HEAD {
            return Err(io::ErrorKind::InvalidData.into());
        }
        head.extend_from_slice(&bytes[..count]);
    }
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_panels_own_page_gets_in() {
        let guard = Guard { token: "00ff".to_owned(), port: 8000, result: None };
        let get = |path: &str, fields: &str| guard.route(format!("GET {path} HTTP/1.1\r\n{fields}\r\n").as_bytes());
        let refused = |route: Route, code: &str| matches!(route, Route::Refused(status, _) if status.starts_with(code));
        for host in ["127.0.0.1:8000", "localhost:8000", "[::1]:8000", "192.168.1.7:8000"] {
            assert_eq!(get("/?token=00ff", &format!("Host: {host}\r\n")), Route::Page, "{host}");
        }
        for host in ["evil.example:8000", "127.0.0.1:8001", "127.0.0.1", "localhost.evil.example:8000"] {
            assert!(refused(get("/?token=00ff", &format!("Host: {host}\r\n")), "421"), "{host}");
        }
        for path in ["/", "/?token=", "/?token=00fe", "/?token=00ff0", "/?tokens=00ff"] {
            assert!(refused(get(path, "Host: localhost:8000\r\n"), "403"), "{path}");
        }
        assert_eq!(get("/commission?token=00ff", "Host: localhost:8000\r\n"), Route::Result);
        assert!(refused(get("/commission", "Host: localhost:8000\r\n"), "403"));
        assert!(refused(get("/x?token=00ff", "Host: localhost:8000\r\n"), "404"));
        assert!(refused(guard.route(b"POST / HTTP/1.1\r\n\r\n"), "405"));
        assert!(refused(guard.route(b"\x00\x01\r\n\r\n"), "400"));
        let socket =
            "Host: localhost:8000\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: abc\r\n";
        let with = |origin: &str| get("/socket?token=00ff", &format!("{socket}Origin: {origin}\r\n"));
        assert_eq!(with("http://localhost:8000"), Route::Socket("abc".to_owned()));
        for origin in ["http://evil.example", "null", "https://localhost:8000", "http://127.0.0.1:8000"] {
            assert!(refused(with(origin), "403"), "{origin}");
        }
        assert!(refused(get("/socket?token=00ff", socket), "403"), "no origin: no browser");
        assert!(refused(get("/socket?token=00ff", "Host: localhost:8000\r\nOrigin: http://localhost:8000\r\n"), "426"));
    }
}
