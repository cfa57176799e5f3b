//! Client side of the control socket.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use qcbus_bus::{Instance, Process};
use qcbus_messages::control::{Request, Response};

use super::{SOCKET, file_view, others, place};

/// Reason why a broker could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum AskError {
    /// No broker listens.
    #[error("no broker {}", nobody(path, others))]
    NoBroker {
        /// Expected path of the socket.
        path: PathBuf,
        /// Brokers of other users that serve an instance of this name, each as a text.
        others: Vec<String>,
    },
    /// The instance belongs to another user.
    #[error(
        "this user may not access the broker of this instance ({path}): it belongs to {owner}; run this as that \
         user"
    )]
    Forbidden {
        /// Path of the socket.
        path: PathBuf,
        /// Owner of the instance, as a text.
        owner: String,
    },
    /// The socket cannot be reached, whether or not a broker listens.
    #[error("cannot reach the broker of this instance ({path}): {why}")]
    Unreachable {
        /// Path of the socket.
        path: PathBuf,
        /// Error message of the system.
        why: String,
    },
    /// The broker closed the connection before it answered.
    #[error(
        "the broker disconnected before it answered ({0}); see its log, and try again when it runs"
    )]
    Left(String),
    /// The reply of the broker is no valid answer.
    #[error("the broker did not answer: {0}")]
    NoAnswer(String),
}

/// Connection to a broker that listens.
#[derive(Debug)]
pub struct Line {
    stream: BufReader<UnixStream>,
    /// Process that listens. `None` if it cannot be seen, for example in another container.
    process: Option<Process>,
}

/// Sends one request to a broker. Blocks until it answers.
///
/// # Errors
/// See [`AskError`].
pub fn ask_broker(directory: &Path, request: &Request) -> Result<Response, AskError> {
    let stream = place::connect(directory).map_err(|error| refused(directory, &error))?;
    Line::on(stream).ask(request)
}

/// Returns the reason why the connection failed.
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
            "serves this instance ({path}); start one with `qcbus serve`, or name another instance with \
             --instance"
        );
    }
    format!(
        "of this user serves this instance ({path}); it is served by {}; run this as that user, with its \
         XDG_RUNTIME_DIR or with --instance-dir",
        others.join(" and ")
    )
}

impl Line {
    /// Connects to the broker of an instance. Returns `None` if no broker listens at this moment.
    pub fn to(directory: &Path) -> Option<Line> {
        place::connect_at_once(directory).ok().map(Line::on)
    }

    fn on(stream: UnixStream) -> Line {
        // A process must not wait for its own end.
        let process = Process::behind(&stream).filter(|it| it.id() != std::process::id());
        let stream = BufReader::new(stream);
        Line { stream, process }
    }

    /// Returns the id of the process that listens, or `None` if it cannot be seen.
    pub fn process(&self) -> Option<u32> {
        self.process.as_ref().map(Process::id)
    }

    /// Checks whether the broker is the same program, has the rights of this process and sees the same files.
    pub fn is_like_us(&self) -> bool {
        self.process.as_ref().is_some_and(file_view::is_like_us)
    }

    /// Sends one request on this connection. Blocks until it is answered.
    ///
    /// # Errors
    /// See [`AskError`]. After an error the connection cannot be used any more.
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
            let why = format!(
                "the broker has stopped, but its process {id} still exists after {seconds} s"
            );
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
    // The part of the line that was read before a timeout stays in the buffer.
    while let Err(error) = reader.read_until(b'\n', &mut line) {
        if !is_timeout(&error) {
            return Err(lost(error));
        }
        let is_over = limit.is_some_and(|limit| begin.elapsed() >= limit);
        if is_over && has_own_limit(request) {
            // The broker does not respond, but the limit of the client holds all the same.
            return Ok(Response::TimedOut);
        }
        stopped += u32::from(process.is_some_and(Process::is_stopped));
        let waits_in_vain = stopped >= STOPPED_FOR && !has_own_limit(request);
        if let Some(process) = process.filter(|_| waits_in_vain) {
            let id = process.id();
            let why = format!("the broker process {id} is stopped; `kill -CONT {id}` resumes it");
            return Err(AskError::NoAnswer(why));
        }
        if is_over {
            let seconds = limit.unwrap_or_default().as_secs();
            let why = format!("no answer within {seconds} s");
            return Err(AskError::NoAnswer(why));
        }
    }
    if line.is_empty() {
        return Err(AskError::Left("it closed the connection".to_owned()));
    }
    serde_json::from_slice(&line).map_err(|error| AskError::NoAnswer(error.to_string()))
}

/// Interval of the checks whether the broker can answer at all.
const SLICE: Duration = Duration::from_millis(500);
/// Number of checks that find the broker stopped before the request is given up.
const STOPPED_FOR: u32 = 6;
/// Maximum time that a stopped broker may take to release its resources.
const END_WITHIN: Duration = Duration::from_secs(30);
/// Time beyond its own limit that a request waits for a broker that does not respond.
const GRACE: Duration = Duration::from_secs(2);
/// Maximum time that a broker may take to check a file if the client can check it itself.
const CHECKED_WITHIN: Duration = Duration::from_secs(60);
/// Maximum time that a broker may take for a request that needs no waiting.
const AT_ONCE: Duration = Duration::from_secs(30);

/// Checks whether the request contains its own timeout.
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

/// Returns how long to wait for an answer, or `None` if there is no limit.
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
