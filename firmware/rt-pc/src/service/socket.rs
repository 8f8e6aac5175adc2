//! Lines on a Unix socket: one request a line, one answer a line.

use std::io::{self, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use crate::operator::{Operator, Said};

/// Connections at once; more are closed at once.
const MOST: usize = 8;
/// Longest line, bytes.
const LONGEST: usize = 4096;

/// The socket with its connections.
pub struct Socket {
    listener: UnixListener,
    path: PathBuf,
    connections: Vec<Connection>,
}

struct Connection {
    stream: UnixStream,
    line: Vec<u8>,
}

impl Socket {
    /// Listens at `path`. What a killed run left there is replaced; what is served is not.
    ///
    /// # Errors
    /// If somebody listens there, or the path cannot be used.
    pub fn listen(path: &Path) -> io::Result<Self> {
        if UnixStream::connect(path).is_ok() {
            return Err(io::Error::new(
                io::ErrorKind::AddrInUse,
                "another program listens there: choose another --socket",
            ));
        }
        if std::fs::symlink_metadata(path)
            .is_ok_and(|meta| std::os::unix::fs::FileTypeExt::is_socket(&meta.file_type()))
        {
            std::fs::remove_file(path)?;
        }
        let listener = UnixListener::bind(path)?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener, path: path.to_owned(), connections: Vec::new() })
    }

    /// Answers what came since the last call. Never waits.
    pub fn serve(&mut self, operator: &mut Operator, last: Option<&Said>, now: u64) {
        while let Ok((stream, _)) = self.listener.accept() {
            if self.connections.len() < MOST && stream.set_nonblocking(true).is_ok() {
                self.connections.push(Connection { stream, line: Vec::new() });
            }
        }
        self.connections.retain_mut(|connection| connection.serve(operator, last, now).is_ok());
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

impl Connection {
    /// An error ends the connection.
    fn serve(&mut self, operator: &mut Operator, last: Option<&Said>, now: u64) -> io::Result<()> {
        let mut bytes = [0; 512];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.line.extend_from_slice(&bytes[..count]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
            if self.line.len() > LONGEST {
                let _ = self.stream.write_all(b"error: a line has at most 4096 bytes\n");
                return Err(io::ErrorKind::InvalidData.into());
            }
        }
        while let Some(end) = self.line.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.line.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line);
            let answer = match line.trim() {
                "status" => status(last),
                line => operator.obey(line, now).unwrap_or_else(|error| format!("error: {error}")),
            };
            // A reader that does not read is closed: nobody waits for it.
            self.stream.write_all(format!("{answer}\n").as_bytes())?;
        }
        Ok(())
    }
}

fn status(last: Option<&Said>) -> String {
    match last {
        None => "no tick yet".to_owned(),
        Some(Said { phase, cause, on, status, tick }) => {
            format!("tick={tick} phase={phase:?} cause={cause:?} amplifiers={} status={status:#x}", u8::from(*on))
        }
    }
}
