//! The fork server: the interpreter that is forked for each job, as seen by its parent.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, ftruncate, memfd_create};
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitId, WaitIdOptions, getppid, pidfd_open, pidfd_send_signal,
    set_parent_process_death_signal, waitid,
};

use super::entry::Program;
use super::stamps::{self, Stamps};
use super::wire::{self, Answer};
use super::{Entry, WhyCold};

/// Python code that the interpreter executes.
const SERVER: &str = concat!(include_str!("watch.py"), include_str!("server.py"));

/// Maximum size of the output of an import in memory, in bytes, for each of its two streams. The
/// fork server already rejects far less output, so a write that fails silently at this limit loses
/// nothing.
const PRINTS: u64 = 16 << 20;

/// Number of bytes of this output that are searched for a reason when the interpreter has ended.
const REASON: usize = 64 << 10;

/// Time limit for the answer to a fork request.
const ANSWER: Duration = Duration::from_secs(30);

/// Resource limits of a process. `None` means the limits of the caller.
#[derive(Debug, Clone, Copy, Default)]
pub struct Limits {
    /// Private memory in bytes (`RLIMIT_DATA`).
    pub memory: Option<u64>,
    /// Size of a written file in bytes (`RLIMIT_FSIZE`).
    pub file_size: Option<u64>,
}

/// A job: all values that differ between jobs.
#[derive(Debug, Clone, Copy)]
pub struct Run<'r> {
    /// All environment variables. Except for those of the job (`ASAM_QC_FRAMEWORK_…`, `QCBUS_…`),
    /// they must equal the server's variables.
    pub environment: &'r [(OsString, OsString)],
    /// Absolute path of the working directory.
    pub cwd: &'r Path,
    /// Resource limits of the job.
    pub limits: Limits,
    /// Standard input. All three streams belong to the job.
    pub stdin: BorrowedFd<'r>,
    /// See [`Run::stdin`].
    pub stdout: BorrowedFd<'r>,
    /// See [`Run::stdin`].
    pub stderr: BorrowedFd<'r>,
}

/// Reason why a job does not run.
#[derive(Debug, thiserror::Error)]
pub enum SpawnError {
    /// This job must be run plainly. The server stays usable.
    #[error("{0}")]
    Cold(#[from] WhyCold),
    /// The loaded program is not the installed one. The caller must start another server.
    #[error("{0} has changed since it was loaded")]
    Outdated(String),
    /// The server has ended or does not answer. The caller must end it and start another.
    #[error("{0}")]
    Gone(#[from] io::Error),
}

/// An interpreter that has loaded a program. It is a child of the caller and forks a process for
/// each job.
///
/// It ends when it is dropped or when the thread that started it ends. Its jobs continue as
/// processes of their own. The nearest subreaper adopts them if the server ends before them.
#[derive(Debug)]
pub struct Server {
    entry: Entry,
    environment: Vec<(OsString, OsString)>,
    interpreter: Interpreter,
    stamps: Stamps,
}

impl Server {
    /// Starts an interpreter and waits at most `patience` until it has loaded the program. Only
    /// `memory` of `limits` applies to the loading.
    ///
    /// # Errors
    ///
    /// The reason why the program must be run plainly: it cannot be loaded in advance, or loading
    /// has other effects in each job.
    pub fn start(
        entry: &Entry,
        environment: &[(OsString, OsString)],
        limits: &Limits,
        patience: Duration,
    ) -> Result<Server, WhyCold> {
        check_environment(entry, environment)?;
        let begun = stamps::now();
        let (interpreter, errors) =
            Interpreter::start(entry, environment, limits).map_err(|error| {
                let interpreter = entry.interpreter.display();
                WhyCold::new(format!("`{interpreter}` cannot be started: {error}"))
            })?;
        let files = interpreter.loaded(patience, &errors)?;
        let stamps = Stamps::of(files, begun).map_err(|file| {
            let file = file.display();
            WhyCold::new(format!(
                "`{file}` changed while it was loaded; it would change again at each load"
            ))
        })?;
        Ok(Server {
            entry: entry.clone(),
            environment: environment.to_vec(),
            interpreter,
            stamps,
        })
    }

    /// Runs the program for a job as a process that leads its own session.
    ///
    /// # Errors
    ///
    /// See [`SpawnError`].
    pub fn spawn(&mut self, run: &Run<'_>) -> Result<u32, SpawnError> {
        if let Some(changed) = self.stamps.changed() {
            return Err(SpawnError::Outdated(format!("`{}`", changed.display())));
        }
        if !self.entry.is_current() {
            return Err(SpawnError::Outdated(
                "the program of its command".to_owned(),
            ));
        }
        let arguments = self.arguments(run)?;
        let asked = wire::ask(&self.interpreter.socket, run, &arguments);
        asked.map_err(|error| self.gone(error))?;
        loop {
            match self.answer()? {
                Answer::Pid(pid) => return Ok(pid),
                Answer::Failed(why) => return Err(WhyCold::new(why).into()),
                // An earlier job was killed, and nobody waits for its end.
                Answer::End(..) => {}
                other => return Err(self.strange(&other).into()),
            }
        }
    }

    /// Returns a job that has ended and its exit status, without waiting. Call it when
    /// [`Server::as_fd`] is readable. An end that arrives during [`Server::spawn`] is lost.
    ///
    /// # Errors
    ///
    /// The server has ended. Its jobs then belong to the nearest subreaper.
    pub fn ended(&mut self) -> io::Result<Option<(u32, ExitStatus)>> {
        if !wire::is_readable(self.as_fd())? {
            return Ok(None);
        }
        match self.answer()? {
            Answer::End(pid, status) => Ok(Some((pid, ExitStatus::from_raw(status)))),
            other => Err(self.strange(&other)),
        }
    }

    /// Returns the process id of the interpreter.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.interpreter.pid
    }

    fn answer(&self) -> io::Result<Answer> {
        wire::answer(&self.interpreter.socket).map_err(|error| self.gone(error))
    }

    /// Returns the arguments that a shell would pass to the program in the environment of this job.
    fn arguments(&self, run: &Run<'_>) -> Result<Vec<OsString>, WhyCold> {
        let (ours, theirs) = (plain(&self.environment), plain(run.environment));
        if let Some((name, _)) = ours.symmetric_difference(&theirs).next() {
            let name = name.to_string_lossy();
            return Err(WhyCold::new(format!(
                "${name} of this job differs from its value at load time"
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
        use io::ErrorKind::{BrokenPipe, ConnectionReset, TimedOut, UnexpectedEof, WouldBlock};
        let (kind, what) = match error.kind() {
            UnexpectedEof | BrokenPipe | ConnectionReset => (UnexpectedEof, "has ended"),
            WouldBlock => (TimedOut, "does not answer"),
            _ => return error,
        };
        let pid = self.id();
        io::Error::new(kind, format!("its fork server (process {pid}) {what}"))
    }

    fn strange(&self, answer: &Answer) -> io::Error {
        let pid = self.id();
        io::Error::other(format!(
            "its fork server (process {pid}) sent an unexpected answer: {answer:?}"
        ))
    }
}

impl AsFd for Server {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.interpreter.socket.as_fd()
    }
}

/// The process of an interpreter, which ends when this value is dropped.
#[derive(Debug)]
struct Interpreter {
    socket: UnixStream,
    /// Process descriptor. Unlike a process id it cannot refer to another process.
    process: OwnedFd,
    pid: u32,
}

impl Drop for Interpreter {
    fn drop(&mut self) {
        // Both fail only if the process has ended and another wait for children has reaped it.
        let _ = pidfd_send_signal(&self.process, Signal::KILL);
        let _ = waitid(WaitId::PidFd(self.process.as_fd()), WaitIdOptions::EXITED);
    }
}

impl Interpreter {
    /// Starts an interpreter. Also returns its standard error, which the code that it loads shares.
    fn start(
        entry: &Entry,
        environment: &[(OsString, OsString)],
        limits: &Limits,
    ) -> io::Result<(Interpreter, std::fs::File)> {
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
        let process = process(child)?;
        let interpreter = Interpreter {
            socket,
            process,
            pid,
        };
        Ok((interpreter, errors))
    }

    /// Waits for the loading and returns the loaded files.
    fn loaded(&self, patience: Duration, errors: &std::fs::File) -> Result<Vec<PathBuf>, WhyCold> {
        let broken = |error: io::Error| {
            WhyCold::new(format!("cannot communicate with its interpreter: {error}"))
        };
        let socket = &self.socket;
        socket.set_read_timeout(Some(patience)).map_err(broken)?;
        let answer = wire::answer(socket).map_err(|error| match error.kind() {
            io::ErrorKind::WouldBlock => {
                WhyCold::new(format!("it was not loaded within {patience:?}"))
            }
            _ => end_of_loading(errors),
        })?;
        // From here an answer takes milliseconds. A stopped interpreter must not block its caller
        // forever.
        socket.set_read_timeout(Some(ANSWER)).map_err(broken)?;
        socket.set_write_timeout(Some(ANSWER)).map_err(broken)?;
        match answer {
            Answer::Ready(files) => Ok(files),
            Answer::Cold(why) => Err(WhyCold::new(why)),
            other => Err(broken(io::Error::other(format!(
                "unexpected answer: {other:?}"
            )))),
        }
    }
}

/// Returns the reason why an interpreter has ended during loading: the last line of its errors.
fn end_of_loading(errors: &std::fs::File) -> WhyCold {
    let mut said = vec![0; REASON];
    let read = errors.read_at(&mut said, 0).unwrap_or_default();
    said.truncate(read);
    let said = String::from_utf8_lossy(&said);
    let last = said.trim_end_matches(['\0', '\n']).lines().next_back();
    let last = last.filter(|it| !it.is_empty());
    let last = last.map(|it| format!(": {it}")).unwrap_or_default();
    WhyCold::new(format!("its interpreter ended during loading{last}"))
}

fn process(mut child: Child) -> io::Result<OwnedFd> {
    let pid = Pid::from_child(&child);
    // The child is not reaped yet, so the id still refers to it.
    pidfd_open(pid, PidfdFlags::empty()).map_err(|error| {
        let _ = child.kill();
        let _ = child.wait();
        error.into()
    })
}

/// Creates a file in memory that takes at most [`PRINTS`] bytes.
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
    // SAFETY: only system calls are made between fork and exec; nothing is allocated and no lock is
    // taken.
    unsafe {
        command.pre_exec(move || die_with(caller));
    }
}

/// Makes this process die with its parent. Makes only system calls.
///
/// # Errors
/// System errors; `ESRCH` if the parent has already ended.
pub(crate) fn die_with(parent: u32) -> io::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    match getppid() {
        Some(pid) if pid.as_raw_nonzero().get().cast_unsigned() == parent => Ok(()),
        _ => Err(rustix::io::Errno::SRCH.into()),
    }
}

/// Rejects environments in which an interpreter behaves differently in each directory or at its
/// end.
fn check_environment(entry: &Entry, environment: &[(OsString, OsString)]) -> Result<(), WhyCold> {
    for (name, value) in environment {
        let set = !value.is_empty();
        if name == "PATH" && *value != entry.path {
            return Err(WhyCold::new(
                "the PATH of the job differs from the PATH in which its program was found",
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

/// Returns the variables that are the same for each job.
fn plain(environment: &[(OsString, OsString)]) -> BTreeSet<&(OsString, OsString)> {
    let of_job = |name: &OsStr| {
        let name = name.as_encoded_bytes();
        name.starts_with(b"ASAM_QC_FRAMEWORK_")
            || name.starts_with(b"QCBUS_")
            || [&b"PWD"[..], b"OLDPWD", b"SHLVL", b"_", b"TMPDIR"].contains(&name)
    };
    let all = environment.iter();
    all.filter(|(name, _)| !of_job(name)).collect()
}

/// Rejects a directory with importable files: `python -m` searches it first.
fn nothing_to_import(cwd: &Path) -> Result<(), WhyCold> {
    let unreadable = |error: io::Error| {
        WhyCold::new(format!("the directory of this job cannot be read: {error}"))
    };
    for entry in cwd.read_dir().map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let name = entry.file_name();
        if stamps::is_importable(&name, &entry) {
            let name = name.to_string_lossy();
            return Err(WhyCold::new(format!(
                "the directory of this job has `{name}`, which Python would find before installed modules"
            )));
        }
    }
    Ok(())
}
