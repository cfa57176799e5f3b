//! Where the control socket is: however long the path to it is, and again when a cleaner has taken it.

use std::fs::Permissions;
use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{Mode, OFlags, open};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, socket_with};
use tokio::net::UnixListener;
use tokio::task::AbortHandle;

use super::SOCKET;

/// How often somebody looks whether the socket is still there.
const EVERY: Duration = Duration::from_millis(500);

/// The socket by way of a descriptor of its directory: the kernel takes 107 bytes of a path to a
/// socket, and the way there may be longer. Good as long as the descriptor is open.
fn short(directory: &Path) -> io::Result<(OwnedFd, PathBuf)> {
    let flags = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let descriptor = open(directory, flags, Mode::empty())?;
    let through = PathBuf::from(format!("/proc/self/fd/{}", descriptor.as_raw_fd()));
    // Without /proc only a short way is left; an error tells when it is too long.
    let way = if through.exists() {
        &through
    } else {
        directory
    };
    let path = way.join(SOCKET);
    Ok((descriptor, path))
}

/// Listens, readable and writable by the owner only.
pub(super) fn listen(directory: &Path) -> io::Result<UnixListener> {
    let (_directory, path) = short(directory)?;
    let listener = UnixListener::bind(&path)?;
    std::fs::set_permissions(&path, Permissions::from_mode(0o600))?;
    Ok(listener)
}

/// Connects to whoever listens.
pub(super) fn connect(directory: &Path) -> io::Result<UnixStream> {
    let (_directory, path) = short(directory)?;
    UnixStream::connect(path)
}

/// Connects to whoever listens, if he takes a client at this moment: one that is stopped lets clients wait.
pub(super) fn connect_at_once(directory: &Path) -> io::Result<UnixStream> {
    let (_directory, path) = short(directory)?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    rustix::net::connect(&socket, &SocketAddrUnix::new(path)?)?;
    let stream = UnixStream::from(socket);
    stream.set_nonblocking(false)?;
    Ok(stream)
}

/// Listens again whenever the socket has gone. `serve` starts to take clients from a listener, and
/// gives back how to stop it.
pub(super) async fn keep(
    directory: PathBuf,
    first: UnixListener,
    serve: impl Fn(UnixListener) -> AbortHandle,
) {
    let mut serving = serve(first);
    loop {
        tokio::time::sleep(EVERY).await;
        // The directory itself comes back with the rest of the bus' files.
        if directory.join(SOCKET).exists() || !directory.is_dir() {
            continue;
        }
        match listen(&directory) {
            Ok(listener) => {
                tracing::warn!("the control socket was removed; it was made again");
                // Nobody finds the one before any more.
                serving.abort();
                serving = serve(listener);
            }
            Err(error) => tracing::debug!(%error, "cannot make the control socket again"),
        }
    }
}

#[cfg(test)]
mod tests {
    use qcbus_messages::control::{Request, Response};
    use tokio::sync::mpsc;

    use crate::control::{Asked, ControlSocket, SOCKET, ask_broker};

    /// Longer than anything takes; only a hang gets here.
    const WATCHDOG: std::time::Duration = std::time::Duration::from_secs(60);

    /// Asks over the socket, and answers.
    async fn ask(directory: &std::path::Path, asked: &mut mpsc::UnboundedReceiver<Asked>) {
        let directory = directory.to_owned();
        let client = tokio::task::spawn_blocking(move || ask_broker(&directory, &Request::Reload));
        let question = asked.recv().await.unwrap();
        question.answer.send(Response::TimedOut).unwrap();
        assert!(matches!(client.await.unwrap(), Ok(Response::TimedOut)));
    }

    #[test]
    fn a_long_path_and_a_cleaner_are_no_obstacles() {
        let base = tempfile::TempDir::new().unwrap();
        let directory = base.path().join("a".repeat(100)).join("b".repeat(80));
        std::fs::create_dir_all(&directory).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let test = async {
            let (inbox, mut asked) = mpsc::unbounded_channel();
            let socket = ControlSocket::listen(&directory, inbox).unwrap();
            ask(&directory, &mut asked).await;
            let path = directory.join(SOCKET);
            std::fs::remove_file(&path).unwrap();
            while !path.exists() {
                tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            }
            ask(&directory, &mut asked).await;
            drop(socket);
            assert!(!path.exists());
        };
        let watched = async { tokio::time::timeout(WATCHDOG, test).await };
        runtime.unwrap().block_on(watched).unwrap();
    }
}
