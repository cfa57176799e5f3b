//! Control socket: short-lived commands send requests, and the broker answers with one JSON object per line.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::control::{Request, Response};
use tokio::sync::{mpsc, oneshot};
use tokio::task::AbortHandle;

mod ask;
mod clients;
mod file_view;
mod others;
mod place;

pub use self::ask::{AskError, Line, ask_broker};
use self::clients::{Bounds, Clients};

/// File name of the socket in the instance's directory.
pub const SOCKET: &str = "control.sock";

/// Maximum time that the shutdown waits for answers to be written.
const FLUSH_LIMIT: Duration = Duration::from_millis(500);

/// A request with the channel for its answer.
#[derive(Debug)]
pub struct Asked {
    /// The request of the client.
    pub request: Request,
    /// Channel for the answer. The client may have disconnected meanwhile.
    pub answer: oneshot::Sender<Response>,
}

/// The listening socket. Its file is removed when this value is dropped.
#[derive(Debug)]
pub struct ControlSocket {
    path: PathBuf,
    clients: Arc<Clients>,
    kept: AbortHandle,
}

impl ControlSocket {
    /// Listens in the instance's directory. Only the owner can read and write the socket. The
    /// caller holds the instance's lock, so an existing socket file is a leftover.
    ///
    /// # Errors
    /// Returns an error if the socket cannot be created.
    pub fn listen(
        directory: &Path,
        inbox: mpsc::UnboundedSender<Asked>,
    ) -> std::io::Result<ControlSocket> {
        let path = directory.join(SOCKET);
        qcbus_disk::remove(&path)?;
        let listener = place::listen(directory)?;
        let clients = Clients::new(Bounds::of_this_process(), inbox);
        let of_all = clients.clone();
        let serve = move |listener| tokio::spawn(of_all.clone().accept(listener)).abort_handle();
        let kept = tokio::spawn(place::keep(directory.to_owned(), listener, serve));
        Ok(ControlSocket {
            path,
            clients,
            kept: kept.abort_handle(),
        })
    }

    /// Waits until the given answers are written. It does not wait for clients that do not read.
    pub async fn flush(&self) {
        let deadline = tokio::time::Instant::now() + FLUSH_LIMIT;
        while self.clients.is_busy() && tokio::time::Instant::now() < deadline {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        // The task stops first, because it would create the socket again.
        self.kept.abort();
        // The error is ignored because the directory may have been removed already.
        let _ = qcbus_disk::remove(&self.path);
    }
}
