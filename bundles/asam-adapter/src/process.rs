//! A run of a module: starts it, monitors it, and ends it with all of its descendants.

use std::io::{self, PipeReader, Read as _};
use std::os::fd::BorrowedFd;
use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::Signal;

use crate::family;
use crate::fork_server::{ForkServer, Run, Started};
use crate::hosted::Limits;

/// Interval of the limit checks while a run is silent.
const TICK: Duration = Duration::from_millis(100);
/// Number of bytes of the final output that are stored.
const SAID: usize = 4 << 10;

/// End of a run.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Reason why the run is rejected, to be read after the name of the module. `None`: exit code
    /// 0.
    pub fault: Option<String>,
    /// Final output of the run.
    pub said: String,
}

/// Reason why the end of a run is unknown.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Broken {
    /// The requesting process has ended.
    #[error("the process that requested it has ended")]
    Unwanted,
    /// The run was not started.
    #[error("it cannot be started: {0}")]
    Start(io::Error),
    /// The fork server has ended, so the exit status of the run is unknown.
    #[error("{0}")]
    Unkept(io::Error),
    /// Descendants of the run cannot be ended, so this process cannot run anything more.
    #[error("{0} of its processes cannot be killed")]
    Lasts(usize),
}

/// Runs the module to its end. The run is aborted if the other end of `caller` is closed.
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
    let mut watched = Watched {
        limits: run.limits,
        begin: Instant::now(),
        fork_server,
        started,
        reader,
        heard: Heard::default(),
    };
    let end = watched.end(caller);
    if let Err(Broken::Unkept(_)) = end {
        watched.fork_server.let_go();
    }
    // All processes must end before the results are read, so that the files cannot change any more.
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
    started: Started,
    reader: PipeReader,
    heard: Heard,
}

impl Watched<'_> {
    /// Waits until the run has ended or must be ended. Returns a reason to reject it, if any.
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

    /// Waits for the next event. Returns `true` if the requesting process has ended.
    fn wait(&self, caller: BorrowedFd<'_>) -> bool {
        let mut fds = vec![PollFd::from_borrowed_fd(caller, PollFlags::empty())];
        if !self.heard.closed {
            fds.push(PollFd::new(&self.reader, PollFlags::IN));
        }
        let ends = self.fork_server.heard(&self.started);
        fds.extend(ends.map(|ends| PollFd::from_borrowed_fd(ends, PollFlags::IN)));
        let tick = Timespec {
            tv_sec: 0,
            tv_nsec: TICK.subsec_nanos().into(),
        };
        // The caller checks everything again, even after an interrupt.
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
                "did not finish within {seconds} s and was killed (`limits.seconds` of its manifest)"
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
                "used more than {most} MB of memory and was killed (`limits.memory_mb` of its manifest)"
            )
        })
    }

    fn fault_of(&self, status: ExitStatus) -> Option<String> {
        if status.success() {
            return None;
        }
        let by_signal = |signal: i32| {
            if signal == Signal::XFSZ.as_raw() {
                let most = self.limits.output >> 20;
                return format!("was killed because it wrote a file of more than {most} MB");
            }
            format!("was killed by signal {signal}")
        };
        Some(match (status.code(), status.signal()) {
            (None, Some(signal)) => by_signal(signal),
            // The shell reports a signal that ended its command in this way.
            (Some(code), _) if (129..160).contains(&code) => {
                format!("ended with exit code {code}: it {}", by_signal(code - 128))
            }
            (Some(127), _) => "was not found (exit code 127)".to_owned(),
            (Some(code), _) => format!("ended with exit code {code}"),
            (None, None) => "ended".to_owned(),
        })
    }
}

/// Output of a run.
#[derive(Default)]
struct Heard {
    bytes: u64,
    last: Vec<u8>,
    closed: bool,
}

impl Heard {
    fn read(&mut self, reader: &mut PipeReader) {
        let mut some = [0; 16 << 10];
        // The number of reads is limited. Otherwise endless output would prevent the check of the
        // time limit.
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

    /// Returns the last lines.
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
