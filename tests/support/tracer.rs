//! Runs a broker under a tracer, which sees every system call that changes the disk (a *deed*). The
//! tracer kills the broker before or after a certain deed, like a crash at that moment. It can also
//! replace the result of a system call, or delay the call as long as the test wants.

use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::fs::FileExt;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use nix::errno::Errno;
use nix::libc;
use nix::sys::ptrace::{self, Options};
use nix::sys::signal::Signal;
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;

/// Whether the broker is killed before or after a deed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The system call has not been made.
    Before,
    /// The system call has been made, but the broker has not seen its result.
    After,
}

/// Moment of the kill: the number of the deed, counted from 1 since the aim was set, and the side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Aim {
    /// Number of the deed.
    pub deed: usize,
    /// Before or after the deed.
    pub side: Side,
}

/// Replacement for the result of a system call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// The call returns this error, and nothing is done.
    Error(Errno),
    /// A read returns one byte.
    Short,
    /// The call does not return until the failure is over.
    Never,
}

/// Kind of access of a system call to a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The call looks up or opens the file.
    Look,
    /// The call reads from the file.
    Read,
    /// The call changes the content of the disk.
    Deed,
}

/// Injected failure.
#[derive(Debug, Clone)]
pub struct Failure {
    /// Path of the affected files: this one and everything below it.
    pub below: PathBuf,
    /// Affected kinds of calls.
    pub kinds: &'static [Kind],
    /// Result of the affected calls.
    pub answer: Answer,
    /// One in this many calls is affected.
    pub one_in: usize,
}

/// Returns the reason why results cannot be replaced here, or `None` if they can.
pub fn no_other_answers() -> Option<String> {
    let known = cfg!(target_arch = "x86_64");
    let why = "the registers of this processor are not known to the test";
    (!known).then(|| why.to_owned()).or_else(refused)
}

/// A broker that runs under a tracer. Killed when dropped.
#[derive(Debug)]
pub struct Traced {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    /// Only deeds below these directories count.
    below: Vec<PathBuf>,
}

#[derive(Debug, Default)]
struct State {
    pid: Option<Pid>,
    aim: Option<Aim>,
    deeds: Vec<String>,
    hit: Option<String>,
    ended: Option<ExitStatus>,
    failure: Option<Failure>,
    /// Number of calls that match the failure, and number of those that received it.
    troubled: (usize, usize),
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Traced {
    /// Starts a broker and appends its log to `log`. Deeds below these directories count from the
    /// very first one.
    pub fn start(mut command: Command, log: &Path, below: &[PathBuf], aim: Option<Aim>) -> Traced {
        let mut options = std::fs::OpenOptions::new();
        let log = options.create(true).append(true).open(log).unwrap();
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log);
        let state = Mutex::new(State {
            aim,
            ..State::default()
        });
        let below = below.to_vec();
        let shared = Arc::new(Shared { state, below });
        let tracer = shared.clone();
        let thread = std::thread::spawn(move || trace(&mut command, &tracer));
        Traced {
            shared,
            thread: Some(thread),
        }
    }

    /// Restarts the count of deeds and sets the deed at which the broker is killed.
    pub fn aim(&self, aim: Option<Aim>) {
        let mut state = self.shared.state();
        state.aim = aim;
        state.deeds.clear();
    }

    /// Sets or clears the failure. Returns how often the previous failure took effect.
    pub fn failure(&self, failure: Option<Failure>) -> usize {
        let mut state = self.shared.state();
        state.failure = failure;
        std::mem::take(&mut state.troubled).1
    }

    /// Returns how often the failure has taken effect.
    pub fn troubled(&self) -> usize {
        self.shared.state().troubled.1
    }

    /// Returns the deeds of the broker since the aim was set.
    pub fn deeds(&self) -> Vec<String> {
        self.shared.state().deeds.clone()
    }

    /// Returns the exit status of the broker if it has ended.
    pub fn ended(&self) -> Option<ExitStatus> {
        self.shared.state().ended
    }

    /// Returns the deed at which the broker was killed.
    pub fn hit(&self) -> Option<String> {
        self.shared.state().hit.clone()
    }
}

impl Drop for Traced {
    fn drop(&mut self) {
        let pid = self.shared.state().pid;
        if self.ended().is_none()
            && let Some(pid) = pid
        {
            let _ = nix::sys::signal::kill(pid, Signal::SIGKILL);
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Returns the reason why nothing can be traced here, or `None` if tracing works.
pub fn refused() -> Option<String> {
    let mut command = Command::new("true");
    let traced = std::thread::spawn(move || {
        let pid = spawn_stopped(&mut command)?;
        ptrace::cont(pid, None)?;
        waitpid(pid, None)?;
        Ok::<_, std::io::Error>(())
    });
    let refused = traced.join().unwrap().err()?;
    Some(format!("a process may not be traced: {refused}"))
}

/// Starts a program that this thread traces. The program is stopped before its first instruction.
fn spawn_stopped(command: &mut Command) -> std::io::Result<Pid> {
    let be_traced = || ptrace::traceme().map_err(Into::into);
    #[expect(
        unsafe_code,
        reason = "only one system call is made between fork and exec"
    )]
    // SAFETY: `ptrace` is a bare system call: it allocates no memory and takes no lock.
    let child = unsafe { command.pre_exec(be_traced) }.spawn()?;
    let pid = Pid::from_raw(i32::try_from(child.id()).unwrap());
    waitpid(pid, Some(WaitPidFlag::__WALL))?;
    Ok(pid)
}

fn trace(command: &mut Command, shared: &Shared) {
    let pid = spawn_stopped(command).unwrap();
    shared.state().pid = Some(pid);
    let options =
        Options::PTRACE_O_TRACESYSGOOD | Options::PTRACE_O_TRACECLONE | Options::PTRACE_O_EXITKILL;
    ptrace::setoptions(pid, options).unwrap();
    let mut tracer = Tracer {
        pid,
        shared,
        known: BTreeSet::from([pid]),
        dies_after: BTreeMap::new(),
        answers: BTreeMap::new(),
        held: Vec::new(),
    };
    // The call fails if the process was killed meanwhile. The loop below waits for its end.
    let _ = ptrace::syscall(pid, None);
    let flags = WaitPidFlag::__WALL | WaitPidFlag::__WNOTHREAD;
    while let Ok(status) = waitpid(None, Some(flags)) {
        if let Some(ended) = tracer.saw(status) {
            shared.state().ended = Some(ended);
            return;
        }
    }
}

struct Tracer<'s> {
    pid: Pid,
    shared: &'s Shared,
    /// Threads that have been seen.
    known: BTreeSet<Pid>,
    /// Threads that kill the broker when they return from a system call, with the deed of that
    /// call.
    dies_after: BTreeMap<Pid, String>,
    /// Errors that suppressed system calls return, by thread.
    answers: BTreeMap<Pid, Errno>,
    /// Threads that wait for the end of the failure.
    held: Vec<Pid>,
}

impl Tracer<'_> {
    /// Handles a stop and lets the thread continue. Returns the status if the whole process has
    /// ended.
    fn saw(&mut self, status: WaitStatus) -> Option<ExitStatus> {
        let (thread, signal) = match status {
            WaitStatus::Exited(pid, code) if pid == self.pid => {
                return Some(ExitStatus::from_raw(code << 8));
            }
            WaitStatus::Signaled(pid, signal, _) if pid == self.pid => {
                return Some(ExitStatus::from_raw(signal as i32));
            }
            WaitStatus::PtraceSyscall(thread) => {
                self.let_go();
                if self.system_call(thread) {
                    self.held.push(thread);
                    return None;
                }
                (thread, None)
            }
            // Every thread begins with a stop that the tracer causes.
            WaitStatus::Stopped(thread, Signal::SIGSTOP) if self.known.insert(thread) => {
                (thread, None)
            }
            WaitStatus::Stopped(thread, signal) => (thread, Some(signal)),
            WaitStatus::PtraceEvent(thread, _, _) => (thread, None),
            _ => return None,
        };
        // The call fails if the thread was killed meanwhile. The tracer then waits for its end.
        let _ = ptrace::syscall(thread, signal);
        None
    }

    /// Lets the waiting threads continue after the failure has ended. Some thread always makes
    /// system calls, so this is called soon.
    fn let_go(&mut self) {
        if !self.held.is_empty() && self.shared.state().failure.is_none() {
            for thread in self.held.drain(..) {
                // The call fails if the thread was killed meanwhile. The tracer then waits for its
                // end.
                let _ = ptrace::syscall(thread, None);
            }
        }
    }

    /// Handles a stop at a system call. Returns whether the thread must wait.
    fn system_call(&mut self, thread: Pid) -> bool {
        let Ok(info) = ptrace::syscall_info(thread) else {
            return false;
        };
        if info.op == libc::PTRACE_SYSCALL_INFO_EXIT {
            if let Some(error) = self.answers.remove(&thread) {
                say_it_came_to(thread, error);
            }
            if let Some(what) = self.dies_after.remove(&thread) {
                self.kill(format!("after {what}"));
            }
        } else if info.op == libc::PTRACE_SYSCALL_INFO_ENTRY {
            #[expect(
                unsafe_code,
                reason = "the kernel reports which field of the union is set"
            )]
            // SAFETY: at an entry stop the kernel fills this field, and all bit patterns are valid
            // numbers.
            let call = unsafe { info.u.entry };
            if let Some(what) = deed(thread, call.nr, &call.args, &self.shared.below) {
                self.count(thread, what);
            }
            return self.meddle(thread, call.nr, &call.args);
        }
        false
    }

    /// Replaces the result of this call if the failure matches it. Returns `true` if the call must
    /// wait.
    fn meddle(&mut self, thread: Pid, number: u64, args: &[u64; 6]) -> bool {
        let Some(answer) = self.failure_of(thread, number, args) else {
            return false;
        };
        match answer {
            Answer::Never => return true,
            Answer::Short => read_one_byte(thread),
            Answer::Error(error) => {
                make_no_call(thread);
                self.answers.insert(thread, error);
            }
        }
        false
    }

    fn failure_of(&self, thread: Pid, number: u64, args: &[u64; 6]) -> Option<Answer> {
        let failure = self.shared.state().failure.clone()?;
        let (kind, path) = touched(thread, number, args)?;
        let concerned = failure.kinds.contains(&kind) && path.starts_with(&failure.below);
        let mut state = self.shared.state();
        if !concerned || state.failure.is_none() {
            return None;
        }
        state.troubled.0 += 1;
        let now = state.troubled.0.is_multiple_of(failure.one_in);
        state.troubled.1 += usize::from(now);
        now.then_some(failure.answer)
    }

    fn count(&mut self, thread: Pid, what: String) {
        let mut state = self.shared.state();
        state.deeds.push(what.clone());
        let number = state.deeds.len();
        let Some(aim) = state.aim.filter(|aim| aim.deed == number) else {
            return;
        };
        drop(state);
        match aim.side {
            Side::Before => self.kill(format!("before {what}")),
            Side::After => drop(self.dies_after.insert(thread, what)),
        }
    }

    fn kill(&self, what: String) {
        self.shared.state().hit = Some(what);
        let _ = nix::sys::signal::kill(self.pid, Signal::SIGKILL);
    }
}

/// Describes the change that a system call makes to the disk below certain directories.
fn deed(thread: Pid, number: u64, args: &[u64; 6], below: &[PathBuf]) -> Option<String> {
    let call = CALLS
        .iter()
        .find(|it| u64::try_from(it.number) == Ok(number))?;
    let path = path_of(thread, call, args)?;
    if call.flags.is_some_and(|at| !writes(args[at])) {
        return None;
    }
    let base = below.iter().find(|it| path.starts_with(it))?;
    let shown = path.strip_prefix(base.parent()?).unwrap();
    Some(format!("{} {}", call.name, shown.display()))
}

/// Returns the kind of access of a system call and the path of its file.
fn touched(thread: Pid, number: u64, args: &[u64; 6]) -> Option<(Kind, PathBuf)> {
    let of = |calls: &'static [Call]| {
        let mut calls = calls.iter();
        calls.find(|it| u64::try_from(it.number) == Ok(number))
    };
    let (kind, call) = match (of(LOOKS), of(READS), of(CALLS)) {
        (_, Some(call), _) => (Kind::Read, call),
        (_, _, Some(call)) if call.flags.is_none_or(|at| writes(args[at])) => (Kind::Deed, call),
        (Some(call), ..) => (Kind::Look, call),
        _ => return None,
    };
    Some((kind, path_of(thread, call, args)?))
}

fn writes(flags: u64) -> bool {
    flags & u64::try_from(libc::O_ACCMODE | libc::O_CREAT).unwrap() != 0
}

fn path_of(thread: Pid, call: &Call, args: &[u64; 6]) -> Option<PathBuf> {
    let path = match call.of {
        Of::Descriptor => of_descriptor(thread, args[0])?,
        Of::Path(at) => absolute(thread, None, args[at])?,
        Of::PathAt(at) => absolute(thread, Some(args[at]), args[at + 1])?,
    };
    // A path below `/proc/self/fd` opens a file a second time by its descriptor.
    let Ok(descriptor) = path.strip_prefix("/proc/self/fd") else {
        return Some(path);
    };
    of_descriptor(thread, descriptor.to_str()?.parse().ok()?)
}

/// Replaces the call number with one that the kernel does not know, so that nothing is done.
#[cfg(target_arch = "x86_64")]
fn make_no_call(thread: Pid) {
    with_registers(thread, |registers| registers.orig_rax = u64::MAX);
}

#[cfg(target_arch = "x86_64")]
fn say_it_came_to(thread: Pid, error: Errno) {
    let answer = -i64::from(error as i32);
    with_registers(thread, |registers| registers.rax = answer.cast_unsigned());
}

/// Limits a read to one byte. Its third argument is the length.
#[cfg(target_arch = "x86_64")]
fn read_one_byte(thread: Pid) {
    with_registers(thread, |registers| registers.rdx = registers.rdx.min(1));
}

#[cfg(target_arch = "x86_64")]
fn with_registers(thread: Pid, change: impl FnOnce(&mut libc::user_regs_struct)) {
    // A thread that was killed meanwhile has no registers.
    if let Ok(mut registers) = ptrace::getregs(thread) {
        change(&mut registers);
        let _ = ptrace::setregs(thread, registers);
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn make_no_call(_: Pid) {}

#[cfg(not(target_arch = "x86_64"))]
fn say_it_came_to(_: Pid, _: Errno) {}

#[cfg(not(target_arch = "x86_64"))]
fn read_one_byte(_: Pid) {}

/// How a system call refers to its file.
#[derive(Debug, Clone, Copy)]
enum Of {
    /// File behind the descriptor in the first argument.
    Descriptor,
    /// Path in this argument.
    Path(usize),
    /// Path in the argument after this one. This argument is the directory to which the path is
    /// relative.
    PathAt(usize),
}

struct Call {
    number: libc::c_long,
    name: &'static str,
    of: Of,
    /// Index of the argument with the flags that say whether a file is opened for writing.
    flags: Option<usize>,
}

const fn call(number: libc::c_long, name: &'static str, of: Of) -> Call {
    Call {
        number,
        name,
        of,
        flags: None,
    }
}

/// System calls that look up or open a file.
const LOOKS: &[Call] = &[
    call(libc::SYS_openat, "open", Of::PathAt(0)),
    call(libc::SYS_statx, "look", Of::PathAt(0)),
    call(libc::SYS_newfstatat, "look", Of::PathAt(0)),
    call(libc::SYS_readlinkat, "look", Of::PathAt(0)),
    call(libc::SYS_getdents64, "list", Of::Descriptor),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_open, "open", Of::Path(0)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_stat, "look", Of::Path(0)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_lstat, "look", Of::Path(0)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_readlink, "look", Of::Path(0)),
];

/// System calls that read from a file. Their third argument is the length.
const READS: &[Call] = &[
    call(libc::SYS_read, "read", Of::Descriptor),
    call(libc::SYS_pread64, "read", Of::Descriptor),
];

/// System calls that change the content of the disk, with the path that changes. For a rename it is
/// the new path.
const CALLS: &[Call] = &[
    call(libc::SYS_write, "write", Of::Descriptor),
    call(libc::SYS_pwrite64, "write", Of::Descriptor),
    call(libc::SYS_writev, "write", Of::Descriptor),
    call(libc::SYS_fsync, "sync", Of::Descriptor),
    call(libc::SYS_fdatasync, "sync", Of::Descriptor),
    call(libc::SYS_ftruncate, "truncate", Of::Descriptor),
    call(libc::SYS_unlinkat, "unlink", Of::PathAt(0)),
    call(libc::SYS_mkdirat, "mkdir", Of::PathAt(0)),
    call(libc::SYS_renameat, "rename", Of::PathAt(2)),
    call(libc::SYS_renameat2, "rename", Of::PathAt(2)),
    call(libc::SYS_linkat, "link", Of::PathAt(2)),
    call(libc::SYS_symlinkat, "link", Of::PathAt(1)),
    Call {
        flags: Some(2),
        ..call(libc::SYS_openat, "open", Of::PathAt(0))
    },
    // Newer architectures have only the variants that start at a directory.
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_unlink, "unlink", Of::Path(0)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_rmdir, "unlink", Of::Path(0)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_mkdir, "mkdir", Of::Path(0)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_rename, "rename", Of::Path(1)),
    #[cfg(target_arch = "x86_64")]
    call(libc::SYS_link, "link", Of::Path(1)),
    #[cfg(target_arch = "x86_64")]
    Call {
        flags: Some(1),
        ..call(libc::SYS_open, "open", Of::Path(0))
    },
];

fn of_descriptor(thread: Pid, descriptor: u64) -> Option<PathBuf> {
    let path = std::fs::read_link(format!("/proc/{thread}/fd/{descriptor}")).ok()?;
    path.is_absolute().then_some(path)
}

fn absolute(thread: Pid, directory: Option<u64>, address: u64) -> Option<PathBuf> {
    let path = text(thread, address)?;
    if path.is_absolute() {
        return Some(path);
    }
    // A descriptor is an `int`, so the bits above 32 have no meaning.
    let here = |it: &u64| *it as u32 != libc::AT_FDCWD as u32;
    let base = match directory.filter(here) {
        Some(descriptor) => of_descriptor(thread, descriptor)?,
        None => std::fs::read_link(format!("/proc/{thread}/cwd")).ok()?,
    };
    Some(base.join(path))
}

/// Reads a path from the memory of a process.
fn text(thread: Pid, address: u64) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStringExt;
    let memory = std::fs::File::open(format!("/proc/{thread}/mem")).ok()?;
    let mut bytes = vec![0; 4096];
    let read = memory.read_at(&mut bytes, address).ok()?;
    bytes.truncate(read);
    let end = bytes.iter().position(|byte| *byte == 0)?;
    bytes.truncate(end);
    Some(std::ffi::OsString::from_vec(bytes).into())
}
