//! The side of whoever asks.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use qcbus_bus::{Instance, Process};
use qcbus_messages::control::{Request, Response};

use super::{SOCKET, file_view, others, place};

/// Why a broker could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum AskError {
    /// Nobody listens.
    #[error("no broker {}", nobody(path, others))]
    NoBroker {
        /// The socket looked for.
        path: PathBuf,
        /// Brokers of other users that serve an instance of this name, each in words.
        others: Vec<String>,
    },
    /// The instance is another user's.
    #[error(
        "this user may not ask the broker of this instance ({path}): it belongs to {owner}; ask as that user"
    )]
    Forbidden {
        /// The socket.
        path: PathBuf,
        /// Whose it is, for a person.
        owner: String,
    },
    /// The socket cannot be reached, whoever listens.
    #[error("cannot ask the broker of this instance ({path}): {why}")]
    Unreachable {
        /// The socket.
        path: PathBuf,
        /// What the system says.
        why: String,
    },
    /// The broker went away before it answered.
    #[error("the broker left before it answered ({0}); see its log, and ask again when it runs")]
    Left(String),
    /// The broker said something else than an answer.
    #[error("the broker did not answer: {0}")]
    NoAnswer(String),
}

/// A broker that listens.
#[derive(Debug)]
pub struct Line {
    stream: BufReader<UnixStream>,
    /// Who listens; `None` where it cannot be seen, in another container for instance.
    process: Option<Process>,
}

/// Asks a broker one thing. Blocks until it answers.
///
/// # Errors
/// See [`AskError`].
pub fn ask_broker(directory: &Path, request: &Request) -> Result<Response, AskError> {
    let stream = place::connect(directory).map_err(|error| refused(directory, &error))?;
    Line::on(stream).ask(request)
}

/// Why there is no connection.
fn refused(directory: &Path, error: &io::Error) -> AskError {
    use io::ErrorKind::{ConnectionRefused, NotADirectory, NotFound, PermissionDenied};
    let path = directory.join(SOCKET);
    match error.kind() {
        NotFound | NotADirectory | ConnectionRefused => {
            let name = Instance::at(directory.to_owned());
            let others = others::brokers(name.name());
            AskError::NoBroker { path, others }
        }
        PermissionDenied => {
            let owner = others::owner_of(directory);
            let owner = owner.map_or("another user".to_owned(), others::user);
            AskError::Forbidden { path, owner }
        }
        _ => {
            let why = error.to_string();
            AskError::Unreachable { path, why }
        }
    }
}

fn nobody(path: &Path, others: &[String]) -> String {
    let path = path.display();
    if others.is_empty() {
        return format!(
            "runs as this instance ({path}); start one with `qcbus serve`, or name another with --instance"
        );
    }
    format!(
        "of this user runs as this instance ({path}), but {}; ask as that user, with its XDG_RUNTIME_DIR or with --instance-dir",
        others.join(" and ")
    )
}

impl Line {
    /// Connects to the broker of an instance; `None` if there is none that listens at this moment.
    pub fn to(directory: &Path) -> Option<Line> {
        place::connect_at_once(directory).ok().map(Line::on)
    }

    fn on(stream: UnixStream) -> Line {
        // Nobody waits for his own end.
        let process = Process::behind(&stream).filter(|it| it.id() != std::process::id());
        let stream = BufReader::new(stream);
        Line { stream, process }
    }

    /// Who listens there; `None` where it cannot be seen.
    pub fn process(&self) -> Option<u32> {
        self.process.as_ref().map(Process::id)
    }

    /// Whether the broker is this very program, with the rights of this process, and sees the files that it sees.
    pub fn is_like_us(&self) -> bool {
        self.process.as_ref().is_some_and(file_view::is_like_us)
    }

    /// Asks one thing after the other. Blocks until it is answered.
    ///
    /// # Errors
    /// See [`AskError`]; nothing more can be asked then.
    pub fn ask(&mut self, request: &Request) -> Result<Response, AskError> {
        let mut text =
            serde_json::to_vec(request).map_err(|error| AskError::NoAnswer(error.to_string()))?;
        text.push(b'\n');
        let written = self.stream.get_mut().write_all(&text);
        written.map_err(|error| AskError::Left(error.to_string()))?;
        let answer = answer(&mut self.stream, request, self.process.as_ref())?;
        if matches!(answer, Response::Stopped) && !matches!(request, Request::Down) {
            return Err(AskError::Left("it has stopped".to_owned()));
        }
        if let (Response::Stopped, Some(process)) = (&answer, &self.process)
            && !process.ends_within(END_WITHIN)
        {
            let (id, seconds) = (process.id(), END_WITHIN.as_secs());
            let why =
                format!("it has stopped, but its process {id} is still there after {seconds} s");
            return Err(AskError::NoAnswer(why));
        }
        Ok(answer)
    }
}

fn answer(
    reader: &mut BufReader<UnixStream>,
    request: &Request,
    process: Option<&Process>,
) -> Result<Response, AskError> {
    let lost = |error: io::Error| AskError::Left(error.to_string());
    let (begin, limit) = (Instant::now(), limit_of(request));
    let mut stopped = 0;
    let timeout = reader.get_ref().set_read_timeout(Some(SLICE));
    timeout.map_err(lost)?;
    let mut line = Vec::new();
    // What has been read of the line is kept when the time is over.
    while let Err(error) = reader.read_until(b'\n', &mut line) {
        if !is_timeout(&error) {
            return Err(lost(error));
        }
        let is_over = limit.is_some_and(|limit| begin.elapsed() >= limit);
        if is_over && has_own_limit(request) {
            // The broker stands still: whoever asked for a limit gets it all the same.
            return Ok(Response::TimedOut);
        }
        stopped += u32::from(process.is_some_and(Process::is_stopped));
        let waits_in_vain = stopped >= STOPPED_FOR && !has_own_limit(request);
        if let Some(process) = process.filter(|_| waits_in_vain) {
            let id = process.id();
            let why = format!("its process {id} is stopped; `kill -CONT {id}` lets it go on");
            return Err(AskError::NoAnswer(why));
        }
        if is_over {
            let seconds = limit.unwrap_or_default().as_secs();
            let why = format!("nothing came within {seconds} s");
            return Err(AskError::NoAnswer(why));
        }
    }
    if line.is_empty() {
        return Err(AskError::Left("it closed the connection".to_owned()));
    }
    serde_json::from_slice(&line).map_err(|error| AskError::NoAnswer(error.to_string()))
}

/// How often it is looked at whether the broker can answer at all.
const SLICE: Duration = Duration::from_millis(500);
/// In so many looks it is stopped before nobody waits any more.
const STOPPED_FOR: u32 = 6;
/// How long a broker that has stopped may take to let go of what it holds.
const END_WITHIN: Duration = Duration::from_secs(30);
/// Beyond its own limit, how long a request waits for a broker that stands still.
const GRACE: Duration = Duration::from_secs(2);
/// How long a broker may take to check a file for somebody who can do it himself.
const CHECKED_WITHIN: Duration = Duration::from_secs(60);
/// How long a broker may take for what needs no waiting.
const AT_ONCE: Duration = Duration::from_secs(30);

/// Whether whoever asks has said how long to wait.
fn has_own_limit(request: &Request) -> bool {
    matches!(
        request,
        Request::Wait {
            timeout_ms: Some(_),
            ..
        } | Request::WaitReported {
            timeout_ms: Some(_),
            ..
        }
    )
}

/// How long to wait for an answer; `None`: as long as it takes.
fn limit_of(request: &Request) -> Option<Duration> {
    match request {
        Request::Wait { timeout_ms, .. } | Request::WaitReported { timeout_ms, .. } => {
            timeout_ms.map(|limit| Duration::from_millis(limit) + GRACE)
        }
        Request::Status
        | Request::Reload
        | Request::RemoveBundle { .. }
        | Request::Bundle { .. }
        | Request::Trials { .. }
        | Request::Offers { .. } => Some(AT_ONCE),
        Request::Check { .. } => Some(CHECKED_WITHIN),
        Request::Down => None,
    }
}

fn is_timeout(error: &io::Error) -> bool {
    use io::ErrorKind::{TimedOut, WouldBlock};
    matches!(error.kind(), TimedOut | WouldBlock)
}
