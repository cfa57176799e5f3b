//! Launcher: a small process outside the sandbox that starts each session in a fresh process
//! inside.

use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;

use crate::SandboxError;
use crate::inner::threads;

/// Exit code by which a session's process requests another one (sysexits' `EX_TEMPFAIL`). No bundle
/// ends with it by itself.
const AGAIN: i32 = 75;

/// Action after a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum After {
    /// Starts another session in a fresh process.
    Again,
    /// Ends the launcher with this exit code.
    End(u8),
}

/// End of the last session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LauncherEnd {
    /// The session ended with this exit code.
    Ended(u8),
    /// The session was killed by this signal.
    Killed(i32),
}

impl LauncherEnd {
    /// Ends this process in the same way, so that its parent learns how the session ended.
    #[expect(
        unsafe_code,
        reason = "a signal ends the process only with its default action"
    )]
    pub fn end(self) -> ! {
        match self {
            LauncherEnd::Ended(code) => std::process::exit(i32::from(code)),
            LauncherEnd::Killed(signal) => {
                // SAFETY: plain system calls on this process; no handler of this program is
                // involved. The session's memory was dumped where wanted, and a dump of this
                // process would be useless.
                unsafe {
                    let none = libc::rlimit {
                        rlim_cur: 0,
                        rlim_max: 0,
                    };
                    libc::setrlimit(libc::RLIMIT_CORE, &raw const none);
                    libc::signal(signal, libc::SIG_DFL);
                    libc::raise(signal);
                }
                std::process::exit(128 + signal)
            }
        }
    }
}

/// Runs sessions, each in a process of its own that dies with this one. Number 0 runs first, and
/// the next one follows if a session requests it. Must be called before any thread is started. With
/// `unsupervised`, signals by which a person stops a program are forwarded to the session.
///
/// # Errors
/// Returns [`SandboxError::Kernel`] if there are threads or no process can be created. No session
/// has run then, unless a later session failed to start.
pub fn run_sessions(
    unsupervised: bool,
    session: impl Fn(u32) -> After,
) -> Result<LauncherEnd, SandboxError> {
    if threads() != Some(1) {
        let why = "this process has already started threads";
        return Err(SandboxError::kernel("starting a session process", why));
    }
    let signals = Signals::take(unsupervised);
    let ended = sessions(&signals, unsupervised, session);
    signals.give_back();
    ended
}

fn sessions(
    signals: &Signals,
    unsupervised: bool,
    session: impl Fn(u32) -> After,
) -> Result<LauncherEnd, SandboxError> {
    let mut number = 0;
    loop {
        let child = start(signals, unsupervised, || session(number))?;
        match signals.wait(child)? {
            LauncherEnd::Ended(code) if i32::from(code) == AGAIN => number += 1,
            ended => return Ok(ended),
        }
    }
}

/// Forks a process that continues from here. Returns in the parent only.
#[expect(
    unsafe_code,
    reason = "a session continues from the state of this process, so it is forked"
)]
fn start(
    signals: &Signals,
    unsupervised: bool,
    session: impl FnOnce() -> After,
) -> Result<i32, SandboxError> {
    let parent = std::process::id();
    // SAFETY: this process has a single thread, which was checked. So no lock can be held by
    // another thread that would be missing in the child.
    let child = unsafe { libc::fork() };
    match child {
        -1 => Err(SandboxError::kernel(
            "starting a session process",
            std::io::Error::last_os_error(),
        )),
        0 => {
            follow(parent, unsupervised);
            signals.give_back();
            let code = match session() {
                After::Again => AGAIN,
                After::End(code) => i32::from(code),
            };
            std::process::exit(code)
        }
        child => Ok(child),
    }
}

/// Makes this process die with its parent and not receive keyboard signals. The parent receives
/// those and forwards them.
#[expect(unsafe_code, reason = "prctl and setpgid have no safe interface here")]
fn follow(parent: u32, unsupervised: bool) {
    // SAFETY: plain system calls on this process.
    let followed = unsafe {
        if unsupervised {
            libc::setpgid(0, 0);
        }
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) == 0
    };
    let there = rustix::process::getppid().map(|it| it.as_raw_nonzero().get().unsigned_abs());
    if !followed || there != Some(parent) {
        std::process::exit(1);
    }
}

/// Signals that this process blocks and waits for.
struct Signals {
    set: libc::sigset_t,
    before: libc::sigset_t,
}

#[expect(
    unsafe_code,
    reason = "waiting for signals in a single thread has no safe interface here"
)]
impl Signals {
    fn take(unsupervised: bool) -> Signals {
        // SAFETY: the sets are plain memory that sigemptyset and sigprocmask initialise; an
        // all-zero set is valid.
        unsafe {
            let mut set: libc::sigset_t = std::mem::zeroed();
            let mut before: libc::sigset_t = std::mem::zeroed();
            libc::sigemptyset(&raw mut set);
            libc::sigaddset(&raw mut set, libc::SIGCHLD);
            if unsupervised {
                libc::sigaddset(&raw mut set, libc::SIGTERM);
                libc::sigaddset(&raw mut set, libc::SIGINT);
            }
            libc::sigprocmask(libc::SIG_BLOCK, &raw const set, &raw mut before);
            Signals { set, before }
        }
    }

    fn give_back(&self) {
        // SAFETY: `before` was filled by the kernel.
        unsafe {
            libc::sigprocmask(
                libc::SIG_SETMASK,
                &raw const self.before,
                std::ptr::null_mut(),
            );
        }
    }

    /// Waits for the end of the child.
    fn wait(&self, child: i32) -> Result<LauncherEnd, SandboxError> {
        loop {
            let mut raw = 0;
            // SAFETY: the child is a child of this process and not yet waited for; the kernel
            // writes `raw`.
            let done = unsafe { libc::waitpid(child, &raw mut raw, libc::WNOHANG) };
            match done {
                0 => {}
                done if done == child => {
                    let status = ExitStatus::from_raw(raw);
                    return Ok(match (status.code(), status.signal()) {
                        (Some(code), _) => {
                            LauncherEnd::Ended(u8::try_from(code).unwrap_or(u8::MAX))
                        }
                        (None, signal) => LauncherEnd::Killed(signal.unwrap_or(libc::SIGKILL)),
                    });
                }
                _ => {
                    let error = std::io::Error::last_os_error();
                    if error.raw_os_error() != Some(libc::EINTR) {
                        return Err(SandboxError::kernel("waiting for a session", error));
                    }
                }
            }
            let mut signal = 0;
            // SAFETY: the set was made in `take`; the call writes `signal`.
            unsafe {
                if libc::sigwait(&raw const self.set, &raw mut signal) == 0
                    && signal != libc::SIGCHLD
                {
                    libc::kill(child, signal);
                }
            }
        }
    }
}
