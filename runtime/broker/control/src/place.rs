//! Location of the control socket: its path may have any length, and a removed socket is created again.

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

/// Interval of the checks whether the socket still exists.
const EVERY: Duration = Duration::from_millis(500);

/// Returns the path of the socket through a descriptor of its directory. The kernel accepts at most 107 bytes for a
/// socket path, and the real path may be longer. The returned path is valid as long as the descriptor is open.
fn short(directory: &Path) -> io::Result<(OwnedFd, PathBuf)> {
    let flags = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let descriptor = open(directory, flags, Mode::empty())?;
    let through = PathBuf::from(format!("/proc/self/fd/{}", descriptor.as_raw_fd()));
    // Without /proc only the direct path remains. If it is too long, an error is returned.
    let way = if through.exists() {
        &through
    } else {
        directory
    };
    let path = way.join(SOCKET);
    Ok((descriptor, path))
}

/// Listens on the socket. Only the owner can read and write it.
pub(super) fn listen(directory: &Path) -> io::Result<UnixListener> {
    let (_directory, path) = short(directory)?;
    let listener = UnixListener::bind(&path)?;
    std::fs::set_permissions(&path, Permissions::from_mode(0o600))?;
    Ok(listener)
}

/// Connects to the broker that listens.
pub(super) fn connect(directory: &Path) -> io::Result<UnixStream> {
    let (_directory, path) = short(directory)?;
    UnixStream::connect(path)
}

/// Connects to the broker if it accepts a client at this moment. A stopped broker would let the client wait.
pub(super) fn connect_at_once(directory: &Path) -> io::Result<UnixStream> {
    let (_directory, path) = short(directory)?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    rustix::net::connect(&socket, &SocketAddrUnix::new(path)?)?;
    let stream = UnixStream::from(socket);
    stream.set_nonblocking(false)?;
    Ok(stream)
}

/// Listens again whenever the socket was removed. `serve` starts to accept clients of a listener
/// and returns a handle that stops it.
pub(super) async fn keep(
    directory: PathBuf,
    first: UnixListener,
    serve: impl Fn(UnixListener) -> AbortHandle,
) {
    let mut serving = serve(first);
    loop {
        tokio::time::sleep(EVERY).await;
        // The directory itself is created again with the other files of the bus.
        if directory.join(SOCKET).exists() || !directory.is_dir() {
            continue;
        }
        match listen(&directory) {
            Ok(listener) => {
                tracing::warn!("the control socket was removed; it was created again");
                // No client can find the old socket any more.
                serving.abort();
                serving = serve(listener);
            }
            Err(error) => tracing::debug!(%error, "cannot create the control socket again"),
        }
    }
}

#[cfg(test)]
mod tests {
    use qcbus_messages::control::{Request, Response};
    use tokio::sync::mpsc;

    use crate::{Asked, ControlSocket, SOCKET, ask_broker};

    /// Longer than any step takes. Only a hang reaches this limit.
    const WATCHDOG: std::time::Duration = std::time::Duration::from_secs(60);

    /// Sends a request over the socket and answers it.
    async fn ask(directory: &std::path::Path, asked: &mut mpsc::UnboundedReceiver<Asked>) {
        let directory = directory.to_owned();
        let client = tokio::task::spawn_blocking(move || ask_broker(&directory, &Request::Reload));
        let question = asked.recv().await.unwrap();
        question.answer.send(Response::TimedOut).unwrap();
        assert!(matches!(client.await.unwrap(), Ok(Response::TimedOut)));
    }

    #[test]
    fn control_socket_supports_long_path_and_is_restored() {
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
