//! One run of a module: started, watched, and ended with everything that it has started.

use std::ffi::OsString;
use std::io::{self, PipeReader, Read as _};
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use qcbus_formats::manifest::May;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, pidfd_open};

use crate::family;
use crate::fork_server::{ForkServer, Started};
use crate::hosted::Limits;

/// How often a run is looked at while nothing is heard of it.
const TICK: Duration = Duration::from_millis(100);
/// Bytes that are kept of what it printed last.
const SAID: usize = 4 << 10;

/// What is run, and within what.
pub(crate) struct Run<'r> {
    /// For a shell.
    pub command: &'r str,
    /// Variables besides those of this process.
    pub environment: &'r [(OsString, OsString)],
    /// Where it runs.
    pub directory: &'r Path,
    pub limits: Limits,
    /// What it may do to others: nothing but this and writing in its room. `None`: it is not confined.
    pub may: Option<May>,
}

/// How a run has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Why nothing of it counts, reads on after the name of the module. `None`: exit code 0.
    pub fault: Option<String>,
    /// What it printed last.
    pub said: String,
}

/// Why a run has no end that could be told.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Broken {
    /// Nobody waits for it any more.
    #[error("nobody waits for it any more")]
    Unwanted,
    /// It was not started.
    #[error("it cannot be started: {0}")]
    Start(io::Error),
    /// The interpreter that keeps it warm has gone, and nobody can tell how it ended.
    #[error("{0}")]
    Unkept(io::Error),
    /// What it has started cannot be ended, so that nothing else can be run here.
    #[error("{0} of its processes cannot be killed")]
    Lasts(usize),
}

/// Runs it to its end. `caller` is looked at: when nobody is at its other end any more the run is over.
///
/// # Errors
/// [`Broken`].
pub(crate) fn run(
    run: &Run<'_>,
    caller: BorrowedFd<'_>,
    fork_server: &mut ForkServer,
    plainly: bool,
) -> Result<Ended, Broken> {
    let (reader, writer) = io::pipe().map_err(Broken::Start)?;
    rustix::fs::fcntl_setfl(&reader, rustix::fs::OFlags::NONBLOCK)
        .map_err(|error| Broken::Start(error.into()))?;
    let started = fork_server
        .start(run, writer, plainly)
        .map_err(Broken::Start)?;
    let handle = match &started {
        Started::Cold(child) => Pid::from_raw(child.id().cast_signed())
            .and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok()),
        Started::Warm(_) => None,
    };
    let mut watched = Watched {
        limits: run.limits,
        begin: Instant::now(),
        fork_server,
        handle,
        started,
        reader,
        heard: Heard::default(),
    };
    let end = watched.end(caller);
    if let Err(Broken::Unkept(_)) = end {
        watched.fork_server.let_go();
    }
    // Before anything is looked at: nothing is written any more by then.
    family::end(&watched.fork_server.spared()).map_err(Broken::Lasts)?;
    watched.hear();
    let fault = end?;
    Ok(Ended {
        fault,
        said: watched.heard.text(),
    })
}

struct Watched<'k> {
    limits: Limits,
    begin: Instant,
    fork_server: &'k mut ForkServer,
    /// Can be waited for together with other things; older kernels have none.
    handle: Option<OwnedFd>,
    started: Started,
    reader: PipeReader,
    heard: Heard,
}

impl Watched<'_> {
    /// Waits until it has ended, or must. Gives why nothing of it counts.
    fn end(&mut self, caller: BorrowedFd<'_>) -> Result<Option<String>, Broken> {
        let mut looked = Instant::now();
        loop {
            self.hear();
            match self.fork_server.ended(&mut self.started) {
                Ok(None) => {}
                Ok(Some(status)) => return Ok(self.fault_of(status)),
                Err(error) if matches!(self.started, Started::Warm(_)) => {
                    return Err(Broken::Unkept(error));
                }
                Err(error) => return Ok(Some(format!("cannot be waited for: {error}"))),
            }
            if let Some(fault) = self.is_over() {
                return Ok(Some(fault));
            }
            if looked.elapsed() >= TICK {
                looked = Instant::now();
                if let Some(fault) = self.takes_too_much() {
                    return Ok(Some(fault));
                }
            }
            if self.wait(caller) {
                return Err(Broken::Unwanted);
            }
        }
    }

    /// Waits until something happens. `true`: nobody waits for it any more.
    fn wait(&self, caller: BorrowedFd<'_>) -> bool {
        let mut fds = vec![PollFd::from_borrowed_fd(caller, PollFlags::empty())];
        if !self.heard.closed {
            fds.push(PollFd::new(&self.reader, PollFlags::IN));
        }
        let ends = match self.started {
            Started::Cold(_) => self.handle.as_ref().map(|it| it.as_fd()),
            Started::Warm(_) => self.fork_server.heard(),
        };
        if let Some(ends) = ends {
            fds.push(PollFd::from_borrowed_fd(ends, PollFlags::IN));
        }
        let tick = Timespec {
            tv_sec: 0,
            tv_nsec: TICK.subsec_nanos().into(),
        };
        // Interrupted or not, everything is looked at again.
        let _ = poll(&mut fds, Some(&tick));
        fds[0].revents().intersects(PollFlags::HUP | PollFlags::ERR)
    }

    fn hear(&mut self) {
        self.heard.read(&mut self.reader);
    }

    fn is_over(&self) -> Option<String> {
        let limits = &self.limits;
        if self.begin.elapsed() > limits.time {
            let seconds = limits.time.as_secs();
            return Some(format!(
                "was not done after {seconds} s and was killed (`limits.seconds` of its manifest)"
            ));
        }
        (self.heard.bytes > limits.output).then(|| {
            let most = limits.output >> 20;
            format!(
                "printed more than {most} MB and was killed (`limits.output_mb` of its manifest)"
            )
        })
    }

    fn takes_too_much(&self) -> Option<String> {
        let family = family::living(&self.fork_server.spared());
        let limits = &self.limits;
        if family.len() > limits.processes {
            let most = limits.processes;
            return Some(format!(
                "had more than {most} processes at the same time and was killed"
            ));
        }
        (family::memory(&family) > limits.memory).then(|| {
            let most = limits.memory >> 20;
            format!(
                "took more than {most} MB of memory and was killed (`limits.memory_mb` of its manifest)"
            )
        })
    }

    fn fault_of(&self, status: ExitStatus) -> Option<String> {
        if status.success() {
            return None;
        }
        let by_signal = |signal: i32| match signal {
            libc::SIGXFSZ => {
                let most = self.limits.output >> 20;
                format!("was killed because it wrote a file of more than {most} MB")
            }
            signal => format!("was killed by signal {signal}"),
        };
        Some(match (status.code(), status.signal()) {
            (None, Some(signal)) => by_signal(signal),
            // What the shell says of what it has run.
            (Some(code), _) if (129..160).contains(&code) => {
                format!("ended with exit code {code}: it {}", by_signal(code - 128))
            }
            (Some(127), _) => "was not found (exit code 127)".to_owned(),
            (Some(code), _) => format!("ended with exit code {code}"),
            (None, None) => "ended".to_owned(),
        })
    }
}

/// What was printed.
#[derive(Default)]
struct Heard {
    bytes: u64,
    last: Vec<u8>,
    closed: bool,
}

impl Heard {
    fn read(&mut self, reader: &mut PipeReader) {
        let mut some = [0; 16 << 10];
        // A turn, not until there is nothing left: one that floods would never let us look at the clock.
        for _ in 0..64 {
            match reader.read(&mut some) {
                Ok(0) => {
                    self.closed = true;
                    return;
                }
                Ok(count) => {
                    self.bytes += count as u64;
                    self.last.extend_from_slice(&some[..count]);
                    let before = self.last.len().saturating_sub(SAID);
                    self.last.drain(..before);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => return,
            }
        }
    }

    /// The last lines.
    fn text(&self) -> String {
        let text = String::from_utf8_lossy(&self.last);
        let begins = usize::try_from(self.bytes).is_ok_and(|it| it <= SAID);
        let whole = match text.split_once('\n') {
            Some((_, rest)) if !begins => rest,
            _ => &text,
        };
        whole.trim_end().to_owned()
    }
}
