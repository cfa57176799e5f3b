//! A broker under a tracer. It sees every system call that changes something on the disk (a *deed*),
//! and kills the broker before or after a certain one, as a crash at that very moment would. Or it gives
//! the broker another answer than the system would, or none for as long as it likes.

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

/// On which side of a deed the broker is killed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The system call has not been made.
    Before,
    /// It has been made, and the broker knows nothing of it yet.
    After,
}

/// A moment to be killed at: the deed's number, counted from 1 since it was aimed, and the side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Aim {
    /// Number of the deed.
    pub deed: usize,
    /// Before or after it.
    pub side: Side,
}

/// What a system call comes to instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// This error, and nothing is done.
    Error(Errno),
    /// A read that gives one byte.
    Short,
    /// Nothing, until the trouble is over.
    Never,
}

/// What a system call has to do with a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It looks at it or opens it.
    Look,
    /// It reads from it.
    Read,
    /// It changes what lies on the disk.
    Deed,
}

/// What goes wrong.
#[derive(Debug, Clone)]
pub struct Failure {
    /// With files below this path, or with this one.
    pub below: PathBuf,
    /// With these calls.
    pub kinds: &'static [Kind],
    /// What they come to.
    pub answer: Answer,
    /// Of so many calls one.
    pub one_in: usize,
}

/// Why no other answers can be given here; `None` when they can.
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
    /// Only deeds below these count.
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
    /// Calls that the trouble is about, and those of them that it was given to.
    troubled: (usize, usize),
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Traced {
    /// Starts a broker; its log is appended to `log`. Deeds below these directories count, from the
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

    /// From now on deeds are counted anew, and this one is the last.
    pub fn aim(&self, aim: Option<Aim>) {
        let mut state = self.shared.state();
        state.aim = aim;
        state.deeds.clear();
    }

    /// From now on this goes wrong, or nothing. Says how often the last trouble came to something.
    pub fn failure(&self, failure: Option<Failure>) -> usize {
        let mut state = self.shared.state();
        state.failure = failure;
        std::mem::take(&mut state.troubled).1
    }

    /// How often the trouble has come to something.
    pub fn troubled(&self) -> usize {
        self.shared.state().troubled.1
    }

    /// What it has done since it was aimed at.
    pub fn deeds(&self) -> Vec<String> {
        self.shared.state().deeds.clone()
    }

    /// How it ended, if it has.
    pub fn ended(&self) -> Option<ExitStatus> {
        self.shared.state().ended
    }

    /// The deed at which it was killed.
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

/// Why nothing can be traced here; `None` when it can.
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

/// Starts a program; it stands still before its first instruction and is traced by this thread.
fn spawn_stopped(command: &mut Command) -> std::io::Result<Pid> {
    let be_traced = || ptrace::traceme().map_err(Into::into);
    #[expect(
        unsafe_code,
        reason = "nothing but one system call happens between fork and exec"
    )]
    // SAFETY: `ptrace` is a bare system call: no memory is taken, no lock is touched.
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
    // Any that has been killed meanwhile is waited for below.
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
    /// Threads at whose return from a system call all is over, with what they do there.
    dies_after: BTreeMap<Pid, String>,
    /// What system calls that are not made are said to have come to.
    answers: BTreeMap<Pid, Errno>,
    /// Threads that wait for the trouble to be over.
    held: Vec<Pid>,
}

impl Tracer<'_> {
    /// Lets a thread go on after a stop. The status, when the whole process has ended.
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
            // Every thread begins with a stop of the tracer's making.
            WaitStatus::Stopped(thread, Signal::SIGSTOP) if self.known.insert(thread) => {
                (thread, None)
            }
            WaitStatus::Stopped(thread, signal) => (thread, Some(signal)),
            WaitStatus::PtraceEvent(thread, _, _) => (thread, None),
            _ => return None,
        };
        // A thread that was killed meanwhile cannot go on, and is waited for.
        let _ = ptrace::syscall(thread, signal);
        None
    }

    /// Lets those go on who waited for the end of the trouble. Somebody calls the system all the time.
    fn let_go(&mut self) {
        if !self.held.is_empty() && self.shared.state().failure.is_none() {
            for thread in self.held.drain(..) {
                // One that was killed meanwhile is waited for.
                let _ = ptrace::syscall(thread, None);
            }
        }
    }

    /// Whether the thread is to wait.
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
                reason = "the kernel says which field of the union it filled"
            )]
            // SAFETY: at an entry it is this one, and all bit patterns are numbers.
            let call = unsafe { info.u.entry };
            if let Some(what) = deed(thread, call.nr, &call.args, &self.shared.below) {
                self.count(thread, what);
            }
            return self.meddle(thread, call.nr, &call.args);
        }
        false
    }

    /// Gives another answer, if there is trouble for this call. `true`: none for now.
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

/// What a system call does to the disk below certain directories, in words.
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

/// What a system call has to do with which file.
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
    // What is opened a second time by its descriptor.
    let Ok(descriptor) = path.strip_prefix("/proc/self/fd") else {
        return Some(path);
    };
    of_descriptor(thread, descriptor.to_str()?.parse().ok()?)
}

/// The call is none that the system knows, so that nothing is done.
#[cfg(target_arch = "x86_64")]
fn make_no_call(thread: Pid) {
    with_registers(thread, |registers| registers.orig_rax = u64::MAX);
}

#[cfg(target_arch = "x86_64")]
fn say_it_came_to(thread: Pid, error: Errno) {
    let answer = -i64::from(error as i32);
    with_registers(thread, |registers| registers.rax = answer.cast_unsigned());
}

/// The third argument of a read says how much.
#[cfg(target_arch = "x86_64")]
fn read_one_byte(thread: Pid) {
    with_registers(thread, |registers| registers.rdx = registers.rdx.min(1));
}

#[cfg(target_arch = "x86_64")]
fn with_registers(thread: Pid, change: impl FnOnce(&mut libc::user_regs_struct)) {
    // A thread that was killed meanwhile has none.
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

/// What a system call is about.
#[derive(Debug, Clone, Copy)]
enum Of {
    /// The file behind its first argument.
    Descriptor,
    /// The path in this argument.
    Path(usize),
    /// The path in the argument behind this one, which is the directory that it begins at.
    PathAt(usize),
}

struct Call {
    number: libc::c_long,
    name: &'static str,
    of: Of,
    /// Where the flags are that say whether a file is opened to be written.
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

/// All that looks at a file or opens it.
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

/// All that reads from a file, so much as the third argument says.
const READS: &[Call] = &[
    call(libc::SYS_read, "read", Of::Descriptor),
    call(libc::SYS_pread64, "read", Of::Descriptor),
];

/// All that changes what lies on the disk, by the path that is changed: a rename's is the new one.
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
    // Younger processors have only those that begin at a directory.
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
    // A descriptor is an `int`: what is above 32 bits says nothing.
    let here = |it: &u64| *it as u32 != libc::AT_FDCWD as u32;
    let base = match directory.filter(here) {
        Some(descriptor) => of_descriptor(thread, descriptor)?,
        None => std::fs::read_link(format!("/proc/{thread}/cwd")).ok()?,
    };
    Some(base.join(path))
}

/// A path in the memory of a process.
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
