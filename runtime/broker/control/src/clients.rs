//! Clients of the control socket: limits their number, their requests and their time.
//!
//! A client that waits for a verdict stays as long as it lives. Every other client has a few seconds. If there is no
//! room for a new client, the client that has been silent longest is removed.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use qcbus_messages::control::{Request, Response};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::{Notify, mpsc, oneshot};
use tokio::time::{Instant, timeout};

use super::Asked;

/// Maximum length of a request in bytes.
const MAX_REQUEST: usize = 64 << 10;
/// Number of clients that are accepted before other tasks run.
const LET_IN: usize = 16;
/// Interval of the checks whether a waiting client is still connected.
const LOOK: Duration = Duration::from_secs(1);
/// Time that a client may be silent before it can be removed to make room for another.
const GRACE: Duration = Duration::from_millis(250);
/// Maximum time that a new client waits for room.
const ROOM_WITHIN: Duration = Duration::from_secs(2);

/// Limits of the clients.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Maximum number of clients at once.
    pub clients: usize,
    /// Maximum number of clients among them with an answer that may take any time.
    pub waiting: usize,
    /// Maximum time for a request to arrive after the connection or the previous answer.
    pub request_within: Duration,
    /// Maximum time for a client to read an answer.
    pub answer_within: Duration,
}

impl Bounds {
    /// Returns the limits of this process. The broker keeps half of its file descriptors for itself.
    pub(super) fn of_this_process() -> Bounds {
        let limit = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
        let limit = limit.map_or(usize::MAX, |it| usize::try_from(it).unwrap_or(usize::MAX));
        let clients = (limit / 2).clamp(16, 4096);
        Bounds {
            clients,
            waiting: clients - (clients / 4).min(64),
            request_within: Duration::from_secs(10),
            answer_within: Duration::from_secs(10),
        }
    }
}

/// Current state of a client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The broker waits for a request.
    Silent,
    /// The client has sent a request that is answered at once.
    Asking,
    /// The client has sent a request that may take any time.
    Waiting,
    /// The broker waits until the client reads its answer.
    Reading,
}

#[derive(Debug)]
struct Client {
    stage: Stage,
    since: Instant,
    /// Signal that the client must make room.
    go: Arc<Notify>,
}

/// All clients.
#[derive(Debug)]
pub(super) struct Clients {
    bounds: Bounds,
    there: Mutex<BTreeMap<u64, Client>>,
    /// Signal that a client has disconnected.
    gone: Notify,
    inbox: mpsc::UnboundedSender<Asked>,
}

impl Clients {
    pub(super) fn new(bounds: Bounds, inbox: mpsc::UnboundedSender<Asked>) -> Arc<Clients> {
        Arc::new(Clients {
            bounds,
            there: Mutex::default(),
            gone: Notify::new(),
            inbox,
        })
    }

    /// Checks whether an answer is being computed or sent.
    pub(super) fn is_busy(&self) -> bool {
        self.there().values().any(|it| it.stage != Stage::Silent)
    }

    fn there(&self) -> std::sync::MutexGuard<'_, BTreeMap<u64, Client>> {
        // A panic cannot leave the map in an inconsistent state.
        self.there.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Serves all clients that connect. Never returns.
    pub(super) async fn accept(self: Arc<Clients>, listener: UnixListener) {
        let mut number = 0_u64;
        loop {
            let stream = match listener.accept().await {
                Ok((stream, _)) => stream,
                Err(error) => {
                    tracing::warn!("control socket: {error}");
                    tokio::time::sleep(Duration::from_millis(100)).await;
                    continue;
                }
            };
            number += 1;
            if number.is_multiple_of(LET_IN as u64) {
                tokio::task::yield_now().await;
            }
            if self.has_room().await {
                self.let_in(number, stream);
            } else {
                let clients = self.bounds.clients;
                refuse(
                    &stream,
                    format!("the broker already serves {clients} clients"),
                );
            }
        }
    }

    /// Checks whether one more client can be served. If necessary, the client that has been silent
    /// longest is removed.
    async fn has_room(&self) -> bool {
        let until = Instant::now() + ROOM_WITHIN;
        loop {
            let gone = self.gone.notified();
            if self.there().len() < self.bounds.clients || self.send_away_the_silent() {
                return true;
            }
            if Instant::now() >= until {
                return false;
            }
            // Another client may have been silent for long enough meanwhile.
            let _ = timeout(GRACE / 8, gone).await;
        }
    }

    fn send_away_the_silent(&self) -> bool {
        let mut there = self.there();
        let silent = |it: &&Client| matches!(it.stage, Stage::Silent | Stage::Reading);
        let longest = there.iter().filter(|(_, it)| silent(it));
        let longest = longest.min_by_key(|(_, it)| it.since);
        let Some((number, _)) = longest.filter(|(_, it)| it.since.elapsed() >= GRACE) else {
            return false;
        };
        let number = *number;
        if let Some(client) = there.remove(&number) {
            client.go.notify_one();
        }
        true
    }

    fn let_in(self: &Arc<Clients>, number: u64, stream: UnixStream) {
        let go = Arc::new(Notify::new());
        let client = Client {
            stage: Stage::Silent,
            since: Instant::now(),
            go: go.clone(),
        };
        self.there().insert(number, client);
        let connection = Connection {
            clients: self.clone(),
            number,
        };
        tokio::spawn(serve(connection, stream, go));
    }
}

/// One connected client. It is counted until this value is dropped.
struct Connection {
    clients: Arc<Clients>,
    number: u64,
}

impl Connection {
    fn enter(&self, stage: Stage) {
        if let Some(client) = self.clients.there().get_mut(&self.number) {
            (client.stage, client.since) = (stage, Instant::now());
        }
    }

    /// Checks whether one more client may wait for an answer of any duration.
    fn may_wait(&self) -> bool {
        let there = self.clients.there();
        let waiting = there.values().filter(|it| it.stage == Stage::Waiting);
        waiting.count() < self.clients.bounds.waiting
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.clients.there().remove(&self.number);
        self.clients.gone.notify_one();
    }
}

async fn serve(connection: Connection, stream: UnixStream, go: Arc<Notify>) {
    let bounds = connection.clients.bounds;
    let mut stream = BufReader::new(stream);
    loop {
        connection.enter(Stage::Silent);
        let read = tokio::select! {
            read = timeout(bounds.request_within, read_line(&mut stream)) => read,
            () = go.notified() => Ok(Err(made_room(&bounds))),
        };
        let line = match read {
            Ok(Ok(Some(line))) => line,
            Ok(Ok(None)) => return,
            // A client that is silent or sends too long a request is disconnected.
            Ok(Err(reason)) => return refuse(stream.get_ref(), reason),
            Err(_) => {
                let seconds = bounds.request_within.as_secs();
                let reason = format!("no request was received within {seconds} s");
                return refuse(stream.get_ref(), reason);
            }
        };
        let Some(response) = answer(&connection, &line, stream.get_ref()).await else {
            return;
        };
        let Ok(mut text) = serde_json::to_vec(&response) else {
            return;
        };
        drop(response);
        text.push(b'\n');
        connection.enter(Stage::Reading);
        let written = tokio::select! {
            written = timeout(bounds.answer_within, stream.get_mut().write_all(&text)) => written,
            () = go.notified() => return,
        };
        if !matches!(written, Ok(Ok(()))) {
            return;
        }
    }
}

fn made_room(bounds: &Bounds) -> String {
    let clients = bounds.clients;
    format!(
        "the broker serves at most {clients} clients at once, and disconnects silent ones to make room; try \
         again"
    )
}

/// Returns the next request, or `None` when the client has closed its send side.
async fn read_line(stream: &mut BufReader<UnixStream>) -> Result<Option<Vec<u8>>, String> {
    let mut line = Vec::new();
    let limit = MAX_REQUEST as u64 + 1;
    let read = stream.take(limit).read_until(b'\n', &mut line).await;
    match read {
        Ok(0) | Err(_) => Ok(None),
        Ok(_) if line.len() > MAX_REQUEST => {
            Err(format!("a request may have at most {MAX_REQUEST} bytes"))
        }
        Ok(_) => Ok(Some(line)),
    }
}

/// Returns the answer to a request, or `None` if the client disconnects before it exists.
async fn answer(connection: &Connection, line: &[u8], stream: &UnixStream) -> Option<Response> {
    let request = match serde_json::from_slice(line) {
        Ok(request) => request,
        Err(error) => {
            let reason = format!("invalid request: {error}");
            return Some(Response::Failed { reason });
        }
    };
    let takes_long = matches!(
        request,
        Request::Wait { .. } | Request::WaitReported { .. } | Request::Check { .. } | Request::Down
    );
    if takes_long && !connection.may_wait() {
        let waiting = connection.clients.bounds.waiting;
        let reason = format!(
            "{waiting} clients already wait for verdicts, the maximum of this broker; try again when some have \
             received theirs, or start the broker with a higher limit of open files (`ulimit -n`)"
        );
        match request {
            Request::Wait { .. } | Request::WaitReported { .. } => {
                return Some(Response::Failed { reason });
            }
            Request::Check { .. } => return Some(Response::Elsewhere { reason }),
            _ => {}
        }
    }
    connection.enter(if takes_long {
        Stage::Waiting
    } else {
        Stage::Asking
    });
    let (answer, mut answered) = oneshot::channel();
    if connection
        .clients
        .inbox
        .send(Asked { request, answer })
        .is_err()
    {
        return Some(Response::Stopped);
    }
    loop {
        match timeout(LOOK, &mut answered).await {
            Ok(response) => return Some(response.unwrap_or(Response::Stopped)),
            Err(_) if has_left(stream) => return None,
            Err(_) => {}
        }
    }
}

/// Checks whether the client has disconnected. A client that has only closed its send side still listens.
fn has_left(stream: &UnixStream) -> bool {
    let mut ends = [PollFd::new(stream, PollFlags::empty())];
    let at_once = Timespec::default();
    let looked = poll(&mut ends, Some(&at_once));
    looked.is_ok()
        && ends[0]
            .revents()
            .intersects(PollFlags::HUP | PollFlags::ERR)
}

/// Sends the reason to the client if it can be written at once.
fn refuse(stream: &UnixStream, reason: String) {
    if let Ok(mut text) = serde_json::to_vec(&Response::Failed { reason }) {
        text.push(b'\n');
        // The error is ignored: a client that does not read misses the reason.
        let _ = stream.try_write(&text);
    }
}

#[cfg(test)]
mod tests;
