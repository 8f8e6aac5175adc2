//! A Unix socket with a non-blocking listener, which is removed when the program ends.

use std::fs::Permissions;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, fchmod};
use rustix::net;

/// Connections that wait to be accepted, between two rounds.
const BACKLOG: i32 = 128;

pub struct Listener {
    listener: UnixListener,
    path: PathBuf,
}

impl Listener {
    /// Listens at `path`, for this user only, whatever the umask. A socket left by a killed run is replaced; one in use
    /// is not.
    ///
    /// # Errors
    /// If another program listens there, or the path cannot be used.
    pub fn open(path: &Path) -> io::Result<Self> {
        if UnixStream::connect(path).is_ok() {
            return Err(io::Error::new(
                io::ErrorKind::AddrInUse,
                "another program listens there: choose another --link",
            ));
        }
        if std::fs::symlink_metadata(path)
            .is_ok_and(|meta| std::os::unix::fs::FileTypeExt::is_socket(&meta.file_type()))
        {
            std::fs::remove_file(path)?;
        }
        let socket = net::socket_with(
            net::AddressFamily::UNIX,
            net::SocketType::STREAM,
            net::SocketFlags::CLOEXEC | net::SocketFlags::NONBLOCK,
            None,
        )?;
        // The name that `bind` makes has the mode of the socket: no other user can connect before it is set there.
        fchmod(&socket, Mode::RUSR | Mode::WUSR)?;
        net::bind(&socket, &net::SocketAddrUnix::new(path)?)?;
        let this = Self { listener: UnixListener::from(socket), path: path.to_owned() };
        // Restores the permissions that the umask removes.
        std::fs::set_permissions(path, Permissions::from_mode(0o600))?;
        net::listen(&this.listener, BACKLOG)?;
        Ok(this)
    }

    /// A client that came since the last call. Never waits.
    pub fn accept(&self) -> Option<UnixStream> {
        let (stream, _) = self.listener.accept().ok()?;
        stream.set_nonblocking(true).is_ok().then_some(stream)
    }

    pub fn descriptor(&self) -> BorrowedFd<'_> {
        self.listener.as_fd()
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{ErrorKind, Read, Write};

    #[test]
    fn a_socket_is_this_users_alone_and_gone_with_its_listener() {
        let path = std::env::temp_dir().join(format!("rt-pc-listener-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let listener = Listener::open(&path).unwrap();
        assert_eq!(std::fs::symlink_metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert!(listener.accept().is_none(), "nobody came, and nobody is waited for");
        let mut client = UnixStream::connect(&path).unwrap();
        let mut stream = listener.accept().unwrap();
        let mut byte = [0];
        assert_eq!(stream.read(&mut byte).unwrap_err().kind(), ErrorKind::WouldBlock);
        client.write_all(b"a").unwrap();
        assert_eq!(stream.read(&mut byte).unwrap(), 1);
        assert_eq!(Listener::open(&path).err().unwrap().kind(), ErrorKind::AddrInUse);
        assert!(UnixStream::connect(&path).is_ok(), "what is served is not replaced");
        drop(listener);
        assert!(!path.exists());
        // What a killed run left is replaced; a file that is no socket is not.
        drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
        assert!(path.exists());
        drop(Listener::open(&path).unwrap());
        std::fs::write(&path, "mine").unwrap();
        assert!(Listener::open(&path).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
        std::fs::remove_file(&path).unwrap();
    }
}
