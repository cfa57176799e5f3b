//! Clients of the control socket: bounded in number, in what they may say and in the time that they take.
//!
//! Whoever waits for a verdict stays as long as it lives. Everybody else has a few seconds, and where there
//! is no room for one more, whoever has been silent longest makes it.

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

/// Longest request, in bytes.
const MAX_REQUEST: usize = 64 << 10;
/// Clients that are let in before everybody else has a turn.
const LET_IN: usize = 16;
/// How often it is looked whether a client that waits is still there.
const LOOK: Duration = Duration::from_secs(1);
/// How long somebody may be silent whom nobody needs to make room for another.
const GRACE: Duration = Duration::from_millis(250);
/// How long a newcomer waits for room.
const ROOM_WITHIN: Duration = Duration::from_secs(2);

/// What clients may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Clients at once.
    pub clients: usize,
    /// Of those, the ones whose answer may take any time.
    pub waiting: usize,
    /// How long a request may take to come, from the connection or the answer before.
    pub request_within: Duration,
    /// How long an answer may take to be read.
    pub answer_within: Duration,
}

impl Bounds {
    /// Half of the descriptors that this process may have are the broker's own.
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

/// What is done for a client at the moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// It is to say something.
    Silent,
    /// It has asked and is answered at once.
    Asking,
    /// It has asked for something that takes as long as it takes.
    Waiting,
    /// It is to read its answer.
    Reading,
}

#[derive(Debug)]
struct Client {
    stage: Stage,
    since: Instant,
    /// It is to make room.
    go: Arc<Notify>,
}

/// All clients.
#[derive(Debug)]
pub(super) struct Clients {
    bounds: Bounds,
    there: Mutex<BTreeMap<u64, Client>>,
    /// One has gone.
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

    /// Whether an answer is being found or read.
    pub(super) fn is_busy(&self) -> bool {
        self.there().values().any(|it| it.stage != Stage::Silent)
    }

    fn there(&self) -> std::sync::MutexGuard<'_, BTreeMap<u64, Client>> {
        // Nothing is half done in there when somebody panics.
        self.there.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Serves whoever connects, for ever.
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
                    format!("the broker serves {clients} clients already"),
                );
            }
        }
    }

    /// Whether one more can be served; if need be whoever has been silent longest has to go.
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
            // Somebody may have been silent for long enough meanwhile.
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

/// One client among all; it is counted until this is dropped, in whatever way.
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

    /// Whether there is room for one more whose answer may take any time.
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
            // Whoever says nothing, or what is no request, gets no other chance.
            Ok(Err(reason)) => return refuse(stream.get_ref(), reason),
            Err(_) => {
                let seconds = bounds.request_within.as_secs();
                let reason = format!("no request came within {seconds} s");
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
        "the broker serves {clients} clients at once, and whoever says nothing makes room; ask again"
    )
}

/// The next request; `None` when the client has said everything.
async fn read_line(stream: &mut BufReader<UnixStream>) -> Result<Option<Vec<u8>>, String> {
    let mut line = Vec::new();
    let limit = MAX_REQUEST as u64 + 1;
    let read = stream.take(limit).read_until(b'\n', &mut line).await;
    match read {
        Ok(0) | Err(_) => Ok(None),
        Ok(_) if line.len() > MAX_REQUEST => {
            Err(format!("a request has at most {MAX_REQUEST} bytes"))
        }
        Ok(_) => Ok(Some(line)),
    }
}

/// The answer to a request; `None` when the client has left before there was one.
async fn answer(connection: &Connection, line: &[u8], stream: &UnixStream) -> Option<Response> {
    let request = match serde_json::from_slice(line) {
        Ok(request) => request,
        Err(error) => {
            let reason = format!("not a request: {error}");
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
            "{waiting} clients wait for verdicts already, as many as this broker may have; ask again when \
             some have theirs, or start the broker with a higher limit of open files (`ulimit -n`)"
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

/// Whether nobody is at the other end any more. One that only has nothing more to say still listens.
fn has_left(stream: &UnixStream) -> bool {
    let mut ends = [PollFd::new(stream, PollFlags::empty())];
    let at_once = Timespec::default();
    let looked = poll(&mut ends, Some(&at_once));
    looked.is_ok()
        && ends[0]
            .revents()
            .intersects(PollFlags::HUP | PollFlags::ERR)
}

/// Says why, if the client is there to read it, and does not wait for that.
fn refuse(stream: &UnixStream, reason: String) {
    if let Ok(mut text) = serde_json::to_vec(&Response::Failed { reason }) {
        text.push(b'\n');
        // Whoever does not read has itself to blame.
        let _ = stream.try_write(&text);
    }
}

#[cfg(test)]
mod tests;
