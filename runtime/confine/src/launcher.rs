//! A small process outside that starts each session of a bundle in a fresh process inside.

use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;

use crate::SandboxError;
use crate::inner::threads;

/// With this a session's process asks for another one. No bundle ends so by itself (sysexits' `EX_TEMPFAIL`).
const AGAIN: i32 = 75;

/// What follows a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum After {
    /// Another one, in a fresh process.
    Again,
    /// Nothing; the whole ends with this code.
    End(u8),
}

/// How the last session ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LauncherEnd {
    /// With this exit code.
    Ended(u8),
    /// By this signal.
    Killed(i32),
}

impl LauncherEnd {
    /// Ends this process in the same way, so that whoever started it learns how it was.
    #[expect(
        unsafe_code,
        reason = "to end by a signal it must have its first meaning again"
    )]
    pub fn end(self) -> ! {
        match self {
            LauncherEnd::Ended(code) => std::process::exit(i32::from(code)),
            LauncherEnd::Killed(signal) => {
                // SAFETY: plain system calls on this process; no handler of ours is involved. The memory of the
                // session has been dumped where that is wanted, this one would say nothing.
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

/// Runs sessions, each in a process of its own that dies with this one: number 0 first, the next as long as one
/// asks for it. To be called before any thread is started. With `unsupervised`, signals by which a person stops a
/// program are handed on to the session.
///
/// # Errors
/// [`SandboxError::Kernel`]: there are threads, or no process can be made. Nothing has been run then, unless it was
/// a later session that could not be started.
pub fn run_sessions(
    unsupervised: bool,
    session: impl Fn(u32) -> After,
) -> Result<LauncherEnd, SandboxError> {
    if threads() != Some(1) {
        let why = "this process has started threads before";
        return Err(SandboxError::kernel("a session's own process", why));
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

/// Starts a process that goes on from here. Returns in the parent only.
#[expect(
    unsafe_code,
    reason = "a session begins as what this process is, so it is forked"
)]
fn start(
    signals: &Signals,
    unsupervised: bool,
    session: impl FnOnce() -> After,
) -> Result<i32, SandboxError> {
    let parent = std::process::id();
    // SAFETY: this process has a single thread, which was looked at, so no lock is held by another one that would
    // not be there any more.
    let child = unsafe { libc::fork() };
    match child {
        -1 => Err(SandboxError::kernel(
            "a session's own process",
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

/// Dies with the parent, and not by what a person types at it: the parent hears of that and hands it on.
#[expect(unsafe_code, reason = "prctl and setpgid have no safe form here")]
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

/// Signals that this process waits for instead of being struck by them.
struct Signals {
    set: libc::sigset_t,
    before: libc::sigset_t,
}

#[expect(
    unsafe_code,
    reason = "waiting for signals in a single thread has no safe form here"
)]
impl Signals {
    fn take(unsupervised: bool) -> Signals {
        // SAFETY: the sets are plain memory that sigemptyset and sigprocmask initialise; an all-zero set is valid.
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
            // SAFETY: the child is ours and was not yet waited for; `raw` is written by the kernel.
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
            // SAFETY: the set was made in `take`; `signal` is written by the call.
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
