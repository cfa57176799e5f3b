//! Admission socket: identifies the process of a peer by the kernel's data, not by the peer's own.
//!
//! Before a peer introduces itself on the bus, it connects to a socket in the instance's directory.
//! There it states which session it will request. The kernel tells the broker which process that
//! is. The broker gets a handle on it that no other process ever inherits.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use qcbus_messages::path_text::to_text;
use rustix::process::Pid;

use crate::instance::Instance;
use crate::link::SessionKey;
use crate::process::Process;

/// Name of the socket in the instance's directory.
const SOCKET: &str = "peers.sock";
/// Environment variable that the process starting a peer sets. Its value proves that the peer was
/// started by that process.
pub const LAUNCH: &str = "QCBUS_LAUNCH";

/// First bytes of a statement.
const MAGIC: &[u8; 8] = b"qcpeer1\n";
/// Bytes of a statement: the magic, three numbers, the length of the proof and room for it.
const STATEMENT: usize = MAGIC.len() + 3 * 8 + 1 + MAX_LAUNCH;
/// Maximum length of the value of [`LAUNCH`] in bytes.
const MAX_LAUNCH: usize = 215;
/// Maximum number of statements that wait for their introduction.
const MAX_KNOWN: usize = 128;
/// Maximum number of connections that have not sent a statement.
const MAX_SILENT: usize = 32;
/// Connections accepted per call.
const TAKEN: usize = 64;
/// Maximum wait of a statement for its introduction, and of a connection for its statement.
const FRESH: Duration = Duration::from_secs(10);
/// Interval of the check that the socket still exists at its path.
const LOOK: Duration = Duration::from_secs(1);

/// Verified facts about a peer, independent of its own statements.
#[derive(Debug)]
pub struct Known {
    /// Its process, or `None` if it is not visible from here, for example in another container.
    pub process: Option<Process>,
    /// The value of [`LAUNCH`] in its environment, empty if unset. Only the process that knows the
    /// value set by the starter can use it as a proof.
    pub launch: String,
    /// Connection that closes with the peer's process, wherever that runs.
    stream: UnixStream,
}

impl Known {
    /// Checks whether the connected process still exists.
    pub(crate) fn is_there(&self) -> bool {
        match &self.process {
            Some(process) => process.is_alive(),
            None => !is_closed(&self.stream),
        }
    }

    /// Tells the peer that its session exists. A peer that does not listen checks this
    /// periodically, so the message may be lost.
    pub(crate) fn tell(&self) {
        // This never blocks: the stream is non-blocking, and one byte fits.
        let _ = (&self.stream).write(&[0]);
    }

    /// Checks whether two statements come from the same process. This is unknown if processes are
    /// not visible.
    pub(crate) fn is_same(&self, other: &Known) -> bool {
        let id = |it: &Known| it.process.as_ref().map(Process::id);
        // Both processes are alive, so their ids are valid.
        id(self) == id(other)
    }
}

fn is_closed(mut stream: &UnixStream) -> bool {
    match stream.read(&mut [0]) {
        Ok(0) => true,
        Ok(_) => false,
        Err(error) => error.kind() != io::ErrorKind::WouldBlock,
    }
}

/// The broker's end of the admission socket.
#[derive(Debug)]
pub(crate) struct Admission {
    directory: PathBuf,
    generation: u64,
    listener: UnixListener,
    /// Device and inode of the socket file.
    file: Option<(u64, u64)>,
    silent: VecDeque<(UnixStream, Instant)>,
    known: VecDeque<(SessionKey, Known, Instant)>,
    looked: Instant,
}

impl Admission {
    /// Opens the socket. The caller holds the instance's lock, so an existing socket file is stale.
    pub(crate) fn open(instance: &Instance, generation: u64) -> io::Result<Admission> {
        let directory = instance.dir().to_path_buf();
        let (listener, file) = listen(&directory)?;
        Ok(Admission {
            directory,
            generation,
            listener,
            file,
            silent: VecDeque::new(),
            known: VecDeque::new(),
            looked: Instant::now(),
        })
    }

    /// Accepts new connections and reads new statements.
    pub(crate) fn exchange(&mut self, now: Instant) {
        for _ in 0..TAKEN {
            // This also covers a lack of file descriptors, because peers connect again.
            let Ok((stream, _)) = self.listener.accept() else {
                break;
            };
            if stream.set_nonblocking(true).is_ok() {
                self.silent.push_back((stream, now));
            }
        }
        for (stream, since) in std::mem::take(&mut self.silent) {
            self.hear(stream, since, now);
        }
        while self.silent.len() > MAX_SILENT {
            self.silent.pop_front();
        }
        while self.known.len() > MAX_KNOWN {
            self.known.pop_front();
        }
        self.known
            .retain(|(.., since)| now.saturating_duration_since(*since) < FRESH);
        if now.saturating_duration_since(self.looked) >= LOOK {
            self.looked = now;
            self.stay_open();
        }
    }

    fn hear(&mut self, mut stream: UnixStream, since: Instant, now: Instant) {
        let mut said = [0; STATEMENT];
        match stream.read(&mut said) {
            Ok(STATEMENT) => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                if now.saturating_duration_since(since) < FRESH {
                    self.silent.push_back((stream, since));
                }
                return;
            }
            // A statement is written at once. Anything else does not come from a peer.
            _ => return,
        }
        let Some((key, launch)) = parse(&said) else {
            return;
        };
        if key.generation != self.generation {
            return;
        }
        if let Some(known) = look_at(stream, launch) {
            self.known.push_back((key, known, now));
        }
    }

    /// Removes and returns the verified facts about the peer that requests this session. The latest
    /// statement counts.
    pub(crate) fn take(&mut self, key: &SessionKey) -> Option<Known> {
        let mut latest = None;
        for (of, known, since) in std::mem::take(&mut self.known) {
            if of == *key {
                latest = Some(known);
            } else {
                self.known.push_back((of, known, since));
            }
        }
        latest
    }

    /// Puts a taken statement back because the peer cannot be admitted yet.
    pub(crate) fn keep(&mut self, key: SessionKey, known: Known, now: Instant) {
        self.known.push_back((key, known, now));
    }

    /// Removes the socket file, so that peers no longer find it.
    pub(crate) fn close(&self) {
        // The directory may already be removed.
        let _ = std::fs::remove_file(self.directory.join(SOCKET));
    }

    /// Opens the socket again if its file was removed, for example by a cleaner of temporary files.
    fn stay_open(&mut self) {
        if file_of(&self.directory).is_some_and(|file| Some(file) == self.file) {
            return;
        }
        match listen(&self.directory) {
            Ok((listener, file)) => (self.listener, self.file) = (listener, file),
            Err(error) => {
                // One warning is enough, because opening is retried every second.
                if self.file.take().is_some() {
                    let directory = to_text(&self.directory);
                    tracing::warn!(%error, directory, "the admission socket is lost, no process can join");
                }
            }
        }
    }
}

impl Drop for Admission {
    fn drop(&mut self) {
        self.close();
    }
}

fn listen(directory: &Path) -> io::Result<(UnixListener, Option<(u64, u64)>)> {
    let path = directory.join(SOCKET);
    qcbus_disk::remove(&path)?;
    let listener = UnixListener::bind(short(directory)?.1)?;
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600))?;
    listener.set_nonblocking(true)?;
    Ok((listener, file_of(directory)))
}

fn file_of(directory: &Path) -> Option<(u64, u64)> {
    let data = std::fs::symlink_metadata(directory.join(SOCKET)).ok()?;
    Some((data.dev(), data.ino()))
}

/// Returns a path to the socket that is short enough for the kernel. The returned file must stay
/// open meanwhile.
fn short(directory: &Path) -> io::Result<(File, PathBuf)> {
    // Only the path is needed: a confined process may not be allowed to read the directory.
    let directory = File::options()
        .read(true)
        .custom_flags(libc::O_PATH | libc::O_DIRECTORY)
        .open(directory)?;
    let path = PathBuf::from(format!("/proc/self/fd/{}", directory.as_raw_fd()));
    Ok((directory, path.join(SOCKET)))
}

/// Tells the broker of an instance which session this process will request. The caller must keep
/// the connection for the lifetime of the session. This never waits for the broker.
pub(crate) fn introduce(instance: &Instance, key: SessionKey) -> io::Result<UnixStream> {
    use rustix::net::{
        AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with,
    };
    let (_directory, path) = short(instance.dir())?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    connect(&socket, &SocketAddrUnix::new(path)?)?;
    let mut stream = UnixStream::from(socket);
    stream.write_all(&statement(key, &std::env::var(LAUNCH).unwrap_or_default()))?;
    Ok(stream)
}

/// A statement sent to the broker, on the connection where the broker answers that the session
/// exists. It must be kept for the lifetime of the session.
pub(crate) struct Statement(tokio::net::UnixStream);

impl Statement {
    /// Creates a statement. Must be called within a tokio runtime.
    pub(crate) fn new(stream: UnixStream) -> io::Result<Statement> {
        tokio::net::UnixStream::from_std(stream).map(Statement)
    }

    /// Returns when the broker has answered, or after `limit`. Cancel-safe.
    pub(crate) async fn answered(&self, limit: Duration) {
        let readable = tokio::time::timeout(limit, self.0.readable()).await;
        let answered = matches!(readable, Ok(Ok(()))).then(|| self.0.try_read(&mut [0; 16]));
        // The connection to a dead broker is always readable, so this waits to avoid a busy loop.
        if matches!(answered, Some(Ok(0) | Err(_))) {
            tokio::time::sleep(limit).await;
        }
    }
}

fn statement(key: SessionKey, launch: &str) -> [u8; STATEMENT] {
    let launch = if launch.len() > MAX_LAUNCH {
        ""
    } else {
        launch
    };
    let mut bytes = Vec::with_capacity(STATEMENT);
    bytes.extend_from_slice(MAGIC);
    for number in [key.generation, key.incarnation, key.attempt] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes.push(u8::try_from(launch.len()).unwrap_or_default());
    bytes.extend_from_slice(launch.as_bytes());
    let mut statement = [0; STATEMENT];
    statement[..bytes.len()].copy_from_slice(&bytes);
    statement
}

fn parse(said: &[u8; STATEMENT]) -> Option<(SessionKey, String)> {
    let rest = said.strip_prefix(MAGIC)?;
    let (numbers, rest) = rest.split_at_checked(3 * 8)?;
    let mut numbers = numbers.chunks_exact(8).map(|it| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(it);
        u64::from_le_bytes(bytes)
    });
    let key = SessionKey {
        generation: numbers.next()?,
        incarnation: numbers.next()?,
        attempt: numbers.next()?,
    };
    let (length, rest) = rest.split_first()?;
    let launch = rest.get(..usize::from(*length))?;
    Some((key, String::from_utf8(launch.to_vec()).ok()?))
}

/// Returns the kernel's data about the connected process. Returns `None` for another user or a
/// process that has ended.
fn look_at(stream: UnixStream, launch: String) -> Option<Known> {
    // The values are process, user and group: `struct ucred` of unix(7).
    let [pid, user, _group] = socket_option(&stream, libc::SO_PEERCRED).ok()?;
    let user = user.cast_unsigned();
    if user != rustix::process::geteuid().as_raw() && user != 0 {
        return None;
    }
    // A process of another container has no id here.
    let process = match Pid::from_raw(pid) {
        Some(pid) => Some(process_of(&stream, pid)?),
        None => None,
    };
    Some(Known {
        process,
        launch,
        stream,
    })
}

impl Process {
    /// Returns the process at the other end of a connection, either the client or the listener.
    /// Returns `None` if it has ended, or lives in another container and has no id here.
    pub fn behind(stream: &UnixStream) -> Option<Process> {
        let [pid, _user, _group] = socket_option(stream, libc::SO_PEERCRED).ok()?;
        process_of(stream, Pid::from_raw(pid)?)
    }
}

/// Returns the connected process, but never a later process with the same id.
fn process_of(stream: &UnixStream, pid: Pid) -> Option<Process> {
    let process = match peer_handle(stream) {
        Ok(fd) => Process::from_fd(pid, fd),
        // Kernels before 6.5 do not have it. If the process ends now, its id may belong to another.
        Err(error) if error.raw_os_error() == Some(libc::ENOPROTOOPT) => {
            Process::open(pid.as_raw_nonzero().get().unsigned_abs(), None)?
        }
        Err(_) => return None,
    };
    process.is_alive().then_some(process)
}

#[expect(unsafe_code, reason = "the kernel returns the descriptor as a number")]
fn peer_handle(stream: &UnixStream) -> io::Result<OwnedFd> {
    let [fd] = socket_option(stream, libc::SO_PEERPIDFD)?;
    // SAFETY: the kernel has just opened this descriptor for this process; no other code knows it.
    Ok(unsafe { OwnedFd::from_raw_fd(fd) })
}

/// Returns a socket option that consists of numbers.
#[expect(
    unsafe_code,
    reason = "rustix supports neither pidfds of peers nor peers without a process id"
)]
fn socket_option<const N: usize>(stream: &UnixStream, name: libc::c_int) -> io::Result<[i32; N]> {
    let mut value = [0_i32; N];
    let wanted = size_of_val(&value);
    let mut length = libc::socklen_t::try_from(wanted).map_err(io::Error::other)?;
    let (fd, to) = (stream.as_raw_fd(), value.as_mut_ptr().cast());
    // SAFETY: `to` and `length` describe `value`, for which any bytes are valid numbers. Both live
    // through the call.
    let done = unsafe { libc::getsockopt(fd, libc::SOL_SOCKET, name, to, &raw mut length) };
    match done {
        0 if usize::try_from(length) == Ok(wanted) => Ok(value),
        0 => Err(io::ErrorKind::InvalidData.into()),
        _ => Err(io::Error::last_os_error()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(incarnation: u64, attempt: u64) -> SessionKey {
        SessionKey {
            generation: 7,
            incarnation,
            attempt,
        }
    }

    fn admission(directory: &Path) -> (Instance, Admission) {
        let instance = Instance::at(directory.to_path_buf());
        let admission = Admission::open(&instance, 7).unwrap();
        (instance, admission)
    }

    /// Returns a directory with a path that is longer than a socket path may be.
    fn far(base: &Path) -> PathBuf {
        let far = base.join("x".repeat(120));
        std::fs::create_dir(&far).unwrap();
        far
    }

    #[test]
    fn kernel_identifies_the_connected_process() {
        let dir = tempfile::TempDir::new().unwrap();
        let (instance, mut admission) = admission(&far(dir.path()));
        let _one = introduce(&instance, key(1, 1)).unwrap();
        let _other = introduce(&instance, key(1, 2)).unwrap();
        let _old = introduce(
            &instance,
            SessionKey {
                generation: 6,
                ..key(1, 1)
            },
        );
        admission.exchange(Instant::now());
        let known = admission.take(&key(1, 1)).unwrap();
        assert_eq!(known.process.as_ref().unwrap().id(), std::process::id());
        assert!(known.is_there());
        assert!(admission.take(&key(1, 1)).is_none(), "taken only once");
        assert!(known.is_same(&admission.take(&key(1, 2)).unwrap()));
        assert!(admission.known.is_empty(), "the old generation is dropped");
    }

    #[test]
    fn other_process_is_distinguished_and_its_end_noticed() {
        let dir = tempfile::TempDir::new().unwrap();
        let (instance, mut admission) = admission(dir.path());
        let _own = introduce(&instance, key(1, 1)).unwrap();
        // A process that makes the same statement.
        let bytes = statement(key(1, 2), "9:x");
        std::fs::write(dir.path().join("said"), bytes).unwrap();
        let script = "import socket, sys, time; s = socket.socket(socket.AF_UNIX); \
             s.connect(sys.argv[1]); s.sendall(open(sys.argv[2], 'rb').read()); time.sleep(1000)";
        let started = std::process::Command::new("python3")
            .args(["-c", script])
            .args([dir.path().join(SOCKET), dir.path().join("said")])
            .spawn();
        let Ok(mut child) = started else {
            eprintln!("SKIPPED: there is no python3 to be another process");
            return;
        };
        while admission.known.len() < 2 {
            admission.exchange(Instant::now());
            std::thread::yield_now();
        }
        let own = admission.take(&key(1, 1)).unwrap();
        let other = admission.take(&key(1, 2)).unwrap();
        assert_eq!(other.process.as_ref().unwrap().id(), child.id());
        assert_eq!(other.launch, "9:x");
        assert!(!own.is_same(&other));
        let far = Known {
            process: None,
            launch: String::new(),
            stream: other.stream.try_clone().unwrap(),
        };
        assert!(other.is_there() && far.is_there());
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!other.is_there());
        assert!(!far.is_there(), "also if its process is not visible");
    }

    #[test]
    fn malformed_statement_is_not_kept() {
        let dir = tempfile::TempDir::new().unwrap();
        let (instance, mut admission) = admission(dir.path());
        let path = dir.path().join(SOCKET);
        let mut kept = Vec::new();
        for length in [1, STATEMENT - 1, STATEMENT] {
            let mut stream = UnixStream::connect(&path).unwrap();
            stream.write_all(&vec![b'x'; length]).unwrap();
            kept.push(stream);
        }
        let mut not_text = statement(key(1, 1), "xx");
        not_text[STATEMENT - MAX_LAUNCH] = 0xff;
        let mut stream = UnixStream::connect(&path).unwrap();
        stream.write_all(&not_text).unwrap();
        admission.exchange(Instant::now());
        assert!(admission.known.is_empty() && admission.silent.is_empty());
        // The number of silent connections and of unused statements is limited.
        for _ in 0..3 {
            for number in 0..TAKEN as u64 {
                kept.push(introduce(&instance, key(number, 1)).unwrap());
            }
            admission.exchange(Instant::now());
            for _ in 0..TAKEN {
                kept.push(UnixStream::connect(&path).unwrap());
            }
            admission.exchange(Instant::now());
        }
        assert_eq!(
            (admission.known.len(), admission.silent.len()),
            (MAX_KNOWN, MAX_SILENT)
        );
        admission.exchange(Instant::now() + FRESH);
        assert!(admission.known.is_empty() && admission.silent.is_empty());
    }

    #[test]
    fn removed_socket_is_created_again() {
        let dir = tempfile::TempDir::new().unwrap();
        let (instance, mut admission) = admission(dir.path());
        std::fs::remove_file(dir.path().join(SOCKET)).unwrap();
        assert!(introduce(&instance, key(1, 1)).is_err());
        admission.exchange(Instant::now() + LOOK);
        let _peer = introduce(&instance, key(1, 1)).unwrap();
        admission.exchange(Instant::now());
        assert!(admission.take(&key(1, 1)).is_some());
        drop(admission);
        assert!(!dir.path().join(SOCKET).exists());
    }

    #[test]
    fn statements_survive_a_round_trip() {
        for launch in ["", "1:abc:name", &"x".repeat(MAX_LAUNCH)] {
            let said = statement(key(1, 2), launch);
            assert_eq!(parse(&said), Some((key(1, 2), launch.to_owned())));
        }
        let said = statement(key(1, 2), &"x".repeat(MAX_LAUNCH + 1));
        assert_eq!(parse(&said), Some((key(1, 2), String::new())));
    }
}
