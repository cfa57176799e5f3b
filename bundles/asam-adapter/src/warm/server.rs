//! The interpreter that is forked for each job, seen from outside.

use std::collections::VecDeque;
use std::ffi::{OsStr, OsString};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, ftruncate, memfd_create};
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitId, WaitIdOptions, pidfd_open, pidfd_send_signal, waitid,
};

use super::entry::Program;
use super::stamps::{self, Stamps};
use super::wire::{self, Answer};
use super::{Entry, WhyCold};

/// What the interpreter executes.
const SERVER: &str = concat!(include_str!("watch.py"), include_str!("server.py"));

/// How much memory what an import prints may take, in bytes, on each of its two streams. Far less than that is too much to
/// be kept warm, so that a write that is refused here, and not heard of, loses nothing.
const PRINTS: u64 = 16 << 20;

/// How much of it is read, when the interpreter has ended, for a reason.
const REASON: usize = 64 << 10;

/// How long a fork is waited for.
const ANSWER: Duration = Duration::from_secs(30);

/// What a process may use. `None`: as much as the caller.
#[derive(Debug, Clone, Copy, Default)]
pub struct Limits {
    /// Bytes of private memory (`RLIMIT_DATA`).
    pub memory: Option<u64>,
    /// Seconds of CPU (`RLIMIT_CPU`).
    pub cpu_seconds: Option<u64>,
    /// Bytes of a file that it writes (`RLIMIT_FSIZE`).
    pub file_size: Option<u64>,
}

/// A job: what differs from one to the next.
#[derive(Debug, Clone, Copy)]
pub struct Run<'r> {
    /// All variables. Those that are not of a job (`ASAM_QC_FRAMEWORK_…`, `QCBUS_…`) are the server's.
    pub environment: &'r [(OsString, OsString)],
    /// Its working directory, by its whole path.
    pub cwd: &'r Path,
    /// What it may use.
    pub limits: Limits,
    /// Its standard streams.
    pub stdin: BorrowedFd<'r>,
    /// See [`Run::stdin`].
    pub stdout: BorrowedFd<'r>,
    /// See [`Run::stdin`].
    pub stderr: BorrowedFd<'r>,
}

/// Why a job does not run.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// This job is to be run plainly. The server goes on.
    #[error("{0}")]
    Cold(#[from] WhyCold),
    /// What the server has loaded is no longer what is installed: end it, start another.
    #[error("{0} has changed since it was loaded")]
    Outdated(String),
    /// The server has gone, or does not answer: end it, start another.
    #[error("{0}")]
    Gone(#[from] io::Error),
}

/// An interpreter that has loaded a program: a child of the caller, who gets a process for each job.
///
/// It ends when it is dropped, and dies with the thread that has started it. Its jobs do not: they are processes of their
/// own, which go to the nearest subreaper when it ends before them.
#[derive(Debug)]
pub struct Server {
    entry: Entry,
    environment: Vec<(OsString, OsString)>,
    socket: UnixStream,
    /// By descriptor, so that no other process can be meant.
    process: OwnedFd,
    pid: u32,
    stamps: Stamps,
    running: Vec<u32>,
    /// Ends that came while another answer was waited for.
    ended: VecDeque<(u32, ExitStatus)>,
}

impl Server {
    /// Starts an interpreter and waits until it has loaded the program, for at most `patience`. `limits` is what loading may
    /// use; of it only `memory` counts.
    ///
    /// # Errors
    ///
    /// Why the program is to be run plainly: it cannot be loaded ahead, or what loading does would be another thing in
    /// each job.
    pub fn start(
        entry: &Entry,
        environment: &[(OsString, OsString)],
        limits: &Limits,
        patience: Duration,
    ) -> Result<Server, WhyCold> {
        check_environment(entry, environment)?;
        let begun = stamps::now();
        let failed = |error: io::Error| {
            let interpreter = entry.interpreter.display();
            WhyCold::new(format!("`{interpreter}` cannot be started: {error}"))
        };
        let mut starting = Starting::new(entry, environment, limits).map_err(failed)?;
        let loaded = starting.wait(patience);
        let files = loaded.inspect_err(|_| starting.stop())?;
        let meanwhile = |file: std::path::PathBuf| {
            let file = file.display();
            WhyCold::new(format!(
                "`{file}` changed while it was loaded; it will be again"
            ))
        };
        let stamps = Stamps::of(files, begun)
            .map_err(meanwhile)
            .inspect_err(|_| starting.stop())?;
        Ok(Server {
            entry: entry.clone(),
            environment: environment.to_vec(),
            socket: starting.socket,
            process: starting.process,
            pid: starting.pid,
            stamps,
            running: Vec::new(),
            ended: VecDeque::new(),
        })
    }

    /// Runs the program for a job, as a process that leads its own session.
    ///
    /// # Errors
    ///
    /// See [`SpawnError`].
    pub fn spawn(&mut self, run: &Run<'_>) -> Result<u32, SpawnError> {
        if let Some(changed) = self.stamps.changed() {
            return Err(SpawnError::Outdated(format!("`{}`", changed.display())));
        }
        if !self.entry.is_current() {
            return Err(SpawnError::Outdated("what its command runs".to_owned()));
        }
        let arguments = self.arguments(run)?;
        wire::ask(&self.socket, run, &arguments).map_err(|error| self.gone(error))?;
        loop {
            match wire::answer(&self.socket).map_err(|error| self.gone(error))? {
                Answer::Pid(pid) => {
                    self.running.push(pid);
                    return Ok(pid);
                }
                Answer::Failed(why) => return Err(WhyCold::new(why).into()),
                Answer::End(pid, status) => self.note_end(pid, status),
                other => return Err(self.strange(&other).into()),
            }
        }
    }

    /// A job that has ended, and how. Does not wait; is worth a call when [`Server::as_fd`] is readable, and after a
    /// [`Server::spawn`].
    ///
    /// # Errors
    ///
    /// The server has ended. [`Server::running`] are then processes of the nearest subreaper.
    pub fn ended(&mut self) -> io::Result<Option<(u32, ExitStatus)>> {
        while self.ended.is_empty() && wire::is_readable(self.socket.as_fd())? {
            match wire::answer(&self.socket).map_err(|error| self.gone(error))? {
                Answer::End(pid, status) => self.note_end(pid, status),
                other => return Err(self.strange(&other)),
            }
        }
        Ok(self.ended.pop_front())
    }

    /// The jobs that have not ended, as far as it is known.
    #[must_use]
    pub fn running(&self) -> &[u32] {
        &self.running
    }

    /// The process of the interpreter.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.pid
    }

    fn note_end(&mut self, pid: u32, status: i32) {
        self.running.retain(|other| *other != pid);
        self.ended.push_back((pid, ExitStatus::from_raw(status)));
    }

    /// What a shell would give to the program in the environment of this job.
    fn arguments(&self, run: &Run<'_>) -> Result<Vec<OsString>, WhyCold> {
        let theirs = plain(run.environment);
        if let Some(name) = difference(&plain(&self.environment), &theirs) {
            let name = name.to_string_lossy();
            return Err(WhyCold::new(format!(
                "this job has another ${name} than it was loaded with"
            )));
        }
        if !run.cwd.is_absolute() {
            return Err(WhyCold::new("the directory of this job is not absolute"));
        }
        if matches!(self.entry.program, Program::Module(_)) {
            nothing_to_import(run.cwd)?;
        }
        let mut arguments = Vec::new();
        for word in &self.entry.arguments {
            word.fill(run.environment, &mut arguments)?;
        }
        Ok(arguments)
    }

    fn gone(&self, error: io::Error) -> io::Error {
        let pid = self.pid;
        let at_end = [
            io::ErrorKind::UnexpectedEof,
            io::ErrorKind::BrokenPipe,
            io::ErrorKind::ConnectionReset,
        ];
        if at_end.contains(&error.kind()) {
            let jobs = self.running.len();
            let text = format!(
                "the interpreter that keeps it warm (process {pid}) has ended, with {jobs} jobs under way"
            );
            return io::Error::new(io::ErrorKind::UnexpectedEof, text);
        }
        if error.kind() == io::ErrorKind::WouldBlock {
            let text =
                format!("the interpreter that keeps it warm (process {pid}) does not answer");
            return io::Error::new(io::ErrorKind::TimedOut, text);
        }
        error
    }

    fn strange(&self, answer: &Answer) -> io::Error {
        let pid = self.pid;
        io::Error::other(format!(
            "the interpreter that keeps it warm (process {pid}) said {answer:?}"
        ))
    }
}

impl AsFd for Server {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        end(&self.process);
    }
}

/// Kills an interpreter and takes its status.
fn end(process: &OwnedFd) {
    // Both fail only when it has ended, and whoever waits for all children has taken its status.
    let _ = pidfd_send_signal(process, Signal::KILL);
    let _ = waitid(WaitId::PidFd(process.as_fd()), WaitIdOptions::EXITED);
}

/// An interpreter that is loading.
struct Starting {
    socket: UnixStream,
    process: OwnedFd,
    pid: u32,
    /// What is written to its standard error, by itself or by what it loads.
    errors: std::fs::File,
}

impl Starting {
    fn new(
        entry: &Entry,
        environment: &[(OsString, OsString)],
        limits: &Limits,
    ) -> io::Result<Starting> {
        let (socket, theirs) = UnixStream::pair()?;
        let (prints, errors) = (bounded_file()?, bounded_file()?);
        let (kind, target) = match &entry.program {
            Program::Script(path) => ("script", path.as_os_str()),
            Program::Module(name) => ("module", OsStr::new(name)),
        };
        let mut command = Command::new(&entry.interpreter);
        command
            .args(&entry.options)
            .args(["-c", SERVER, kind])
            .arg(target)
            .arg(limits.memory.map(|it| it.to_string()).unwrap_or_default())
            .env_clear()
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .current_dir("/")
            .stdin(OwnedFd::from(theirs))
            .stdout(prints)
            .stderr(Stdio::from(errors.try_clone()?));
        die_with_caller(&mut command);
        let child = command.spawn()?;
        let pid = child.id();
        Ok(Starting {
            socket,
            process: process(child)?,
            pid,
            errors,
        })
    }

    /// The files that were loaded.
    fn wait(&mut self, patience: Duration) -> Result<Vec<std::path::PathBuf>, WhyCold> {
        let broken =
            |error: io::Error| WhyCold::new(format!("its interpreter cannot be heard: {error}"));
        self.socket
            .set_read_timeout(Some(patience))
            .map_err(broken)?;
        let answer = wire::answer(&self.socket).map_err(|error| self.silence(&error, patience))?;
        // From now on an answer is a matter of milliseconds. One that is stopped must not stop its caller for good.
        self.socket.set_read_timeout(Some(ANSWER)).map_err(broken)?;
        self.socket
            .set_write_timeout(Some(ANSWER))
            .map_err(broken)?;
        match answer {
            Answer::Ready(files) => Ok(files),
            Answer::Cold(why) => Err(WhyCold::new(why)),
            other => Err(broken(io::Error::other(format!("it said {other:?}")))),
        }
    }

    fn silence(&self, error: &io::Error, patience: Duration) -> WhyCold {
        if error.kind() == io::ErrorKind::WouldBlock {
            return WhyCold::new(format!("it was not loaded within {patience:?}"));
        }
        let mut said = vec![0; REASON];
        let read = self.errors.read_at(&mut said, 0).unwrap_or_default();
        said.truncate(read);
        let said = String::from_utf8_lossy(&said);
        let last = said.trim_end_matches(['\0', '\n']).lines().next_back();
        WhyCold::new(match last {
            Some(last) if !last.is_empty() => {
                format!("its interpreter ended while it was loaded: {last}")
            }
            _ => "its interpreter ended while it was loaded".to_owned(),
        })
    }

    fn stop(&self) {
        end(&self.process);
    }
}

fn process(mut child: Child) -> io::Result<OwnedFd> {
    let pid = Pid::from_child(&child);
    // Nobody has waited for it yet, so that it is still this process.
    pidfd_open(pid, PidfdFlags::empty()).map_err(|error| {
        let _ = child.kill();
        let _ = child.wait();
        error.into()
    })
}

/// A file in memory that takes [`PRINTS`] bytes and no more.
fn bounded_file() -> io::Result<std::fs::File> {
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    let file = memfd_create(c"qcbus-warm", flags)?;
    ftruncate(&file, PRINTS)?;
    fcntl_add_seals(&file, SealFlags::GROW | SealFlags::SHRINK)?;
    Ok(file.into())
}

#[expect(
    unsafe_code,
    reason = "pre_exec is the only place where a child can be bound to its parent"
)]
fn die_with_caller(command: &mut Command) {
    let caller = std::process::id();
    // SAFETY: between fork and exec only prctl and getppid are called, which are async-signal-safe; nothing is allocated
    // and no lock is taken.
    unsafe {
        command.pre_exec(move || {
            if libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) != 0 {
                return Err(io::Error::last_os_error());
            }
            // The caller may have died between fork and prctl.
            if u32::try_from(libc::getppid()) != Ok(caller) {
                return Err(io::Error::from_raw_os_error(libc::ESRCH));
            }
            Ok(())
        });
    }
}

/// Refuses environments in which an interpreter does other things in each directory, or at its end.
fn check_environment(entry: &Entry, environment: &[(OsString, OsString)]) -> Result<(), WhyCold> {
    for (name, value) in environment {
        let set = !value.is_empty();
        if name == "PATH" && *value != entry.path {
            return Err(WhyCold::new(
                "the PATH of the job is not the one its program was looked for in",
            ));
        }
        if name == "PYTHONINSPECT" && set {
            return Err(WhyCold::new("PYTHONINSPECT is set"));
        }
        if name == "PYTHONPATH" && set && !std::env::split_paths(value).all(|it| it.is_absolute()) {
            return Err(WhyCold::new(
                "PYTHONPATH has a directory that is not absolute",
            ));
        }
    }
    Ok(())
}

/// The variables that are the same for each job, in order.
fn plain(environment: &[(OsString, OsString)]) -> Vec<&(OsString, OsString)> {
    let of_job = |name: &OsStr| {
        let name = name.as_encoded_bytes();
        name.starts_with(b"ASAM_QC_FRAMEWORK_")
            || name.starts_with(b"QCBUS_")
            || [&b"PWD"[..], b"OLDPWD", b"SHLVL", b"_", b"TMPDIR"].contains(&name)
    };
    let mut plain: Vec<_> = environment
        .iter()
        .filter(|(name, _)| !of_job(name))
        .collect();
    plain.sort();
    plain
}

fn difference<'e>(
    ours: &[&'e (OsString, OsString)],
    theirs: &[&'e (OsString, OsString)],
) -> Option<&'e OsStr> {
    let missing = |from: &[&'e (OsString, OsString)], in_: &[&(OsString, OsString)]| {
        from.iter()
            .find(|it| !in_.contains(*it))
            .map(|(name, _)| name.as_os_str())
    };
    if ours == theirs {
        return None;
    }
    missing(theirs, ours).or_else(|| missing(ours, theirs))
}

/// `python -m` looks for modules in the working directory first.
fn nothing_to_import(cwd: &Path) -> Result<(), WhyCold> {
    let unreadable = |error: io::Error| {
        WhyCold::new(format!(
            "the directory of this job cannot be looked at: {error}"
        ))
    };
    for entry in cwd.read_dir().map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let name = entry.file_name();
        if stamps::is_importable(&name, &entry) {
            let name = name.to_string_lossy();
            return Err(WhyCold::new(format!(
                "the directory of this job has `{name}`, which Python would look at before installed modules"
            )));
        }
    }
    Ok(())
}
