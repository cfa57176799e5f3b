//! The control socket: short-lived commands ask, the broker answers, one JSON object per line.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::control::{Request, Response};
use tokio::sync::{mpsc, oneshot};
use tokio::task::AbortHandle;

mod place;

use clients::{Bounds, Clients};

mod clients;

/// File name of the socket in the instance's directory.
pub const SOCKET: &str = "control.sock";

/// How long the end waits for answers to be written.
const FLUSH_LIMIT: Duration = Duration::from_millis(500);

/// A request with the place for its answer.
#[derive(Debug)]
pub struct Asked {
    /// What is asked.
    pub request: Request,
    /// Where the answer goes; the client may have left meanwhile.
    pub answer: oneshot::Sender<Response>,
}

/// The listening socket; its file is removed when this is dropped.
#[derive(Debug)]
pub struct ControlSocket {
    path: PathBuf,
    clients: Arc<Clients>,
    kept: AbortHandle,
}

impl ControlSocket {
    /// Listens in the instance's directory, readable and writable by the owner only. The caller
    /// holds the instance's lock, so a socket file that is there is a leftover.
    ///
    /// # Errors
    /// When the socket cannot be made.
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

    /// Waits until answers that have been given are written, but not for clients that do not read.
    pub async fn flush(&self) {
        let deadline = tokio::time::Instant::now() + FLUSH_LIMIT;
        while self.clients.is_busy() && tokio::time::Instant::now() < deadline {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        // First, or it would be made again.
        self.kept.abort();
        // The directory may have been removed already.
        let _ = qcbus_disk::remove(&self.path);
    }
}

/// Why a broker could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum AskError {
    /// Nobody listens.
    #[error(
        "no broker runs as this instance ({path}); start one with `qcbus serve`, or name another with --instance"
    )]
    NoBroker {
        /// The socket looked for.
        path: PathBuf,
    },
    /// The broker went away before it answered.
    #[error("the broker left before it answered ({0}); see its log, and ask again when it runs")]
    Left(String),
    /// The broker said something else than an answer.
    #[error("the broker did not answer: {0}")]
    NoAnswer(String),
}

/// Asks a broker one thing. Blocks until it answers.
///
/// # Errors
/// See [`AskError`].
pub fn ask_broker(directory: &Path, request: &Request) -> Result<Response, AskError> {
    use std::io::{BufRead, Write};
    let path = directory.join(SOCKET);
    let mut stream = place::connect(directory).map_err(|_| AskError::NoBroker { path })?;
    let lost = |error: std::io::Error| AskError::Left(error.to_string());
    let mut text =
        serde_json::to_vec(request).map_err(|error| AskError::NoAnswer(error.to_string()))?;
    text.push(b'\n');
    stream.write_all(&text).map_err(lost)?;
    let limit = limit_of(request);
    stream.set_read_timeout(limit).map_err(lost)?;
    let mut line = String::new();
    let read = match std::io::BufReader::new(stream).read_line(&mut line) {
        Ok(read) => read,
        // The broker stands still: whoever asked for a limit gets it all the same.
        Err(error) if is_timeout(&error) && matches!(request, Request::Wait { .. }) => {
            return Ok(Response::TimedOut);
        }
        Err(error) if is_timeout(&error) => {
            let seconds = limit.unwrap_or_default().as_secs();
            let why = format!("nothing came within {seconds} s; is its process stopped?");
            return Err(AskError::NoAnswer(why));
        }
        Err(error) => return Err(lost(error)),
    };
    if read == 0 {
        return Err(AskError::Left("it closed the connection".to_owned()));
    }
    serde_json::from_str(&line).map_err(|error| AskError::NoAnswer(error.to_string()))
}

/// Beyond its own limit, how long a request waits for a broker that stands still.
const GRACE: Duration = Duration::from_secs(2);
/// How long a broker may take for what needs no waiting.
const AT_ONCE: Duration = Duration::from_secs(30);

/// How long to wait for an answer; `None`: as long as it takes.
fn limit_of(request: &Request) -> Option<Duration> {
    match request {
        Request::Wait { timeout_ms, .. } => {
            timeout_ms.map(|limit| Duration::from_millis(limit) + GRACE)
        }
        Request::Status | Request::Reload | Request::RemoveBundle { .. } => Some(AT_ONCE),
        Request::Down => None,
    }
}

fn is_timeout(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{TimedOut, WouldBlock};
    matches!(error.kind(), TimedOut | WouldBlock)
}
