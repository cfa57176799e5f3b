//! Atomic writing of files: results, reports, manifests, and the output of a bundle that is run by
//! itself. Readers never see a partial file. The broker removes the remains of killed writers.
//!
//! [`foreign`] reads files that others may write, without being blocked by them. [`trust`] checks
//! whether the content of a path can be trusted.

pub mod foreign;
mod temporary;
pub mod trust;

use std::collections::HashSet;
use std::fs::{DirEntry, File, Metadata};
use std::io::{self, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, PoisonError, RwLock};

use rustix::fs::{FlockOperation, flock};
use tempfile::NamedTempFile;

use temporary::parent;
pub use temporary::{Temporary, Unnamed, remove_left};

/// Prefix of temporary names. The process id and start time of the writer follow. The writer holds
/// a lock on the file, because the id is meaningless in another container.
const PREFIX: &str = ".qcbus-";
/// Suffix of temporary names.
const SUFFIX: &str = ".tmp";

/// Writes `content` under a temporary name in the same directory and renames it into place. Missing
/// directories are created. With `durable`, the content is on the disk before the name is.
///
/// # Errors
/// Returns the error of the file system. The temporary file is then removed, at once or later
/// ([`remove_left`]).
pub fn write_whole(path: &Path, content: &[u8], durable: bool) -> io::Result<()> {
    write_ahead(path, content, durable)?
        .persist(path)
        .map_err(|unnamed| unnamed.error)
}

/// Writes `content` to a path that a person has named, like [`write_whole`]. It writes the target
/// of a link, not the link. It writes into a device or a pipe, which must not be replaced by a
/// file.
///
/// # Errors
/// As [`write_whole`].
pub fn write_named(path: &Path, content: &[u8], durable: bool) -> io::Result<()> {
    let is_special = |data: &Metadata| !data.is_file() && !data.is_dir();
    if std::fs::metadata(path).is_ok_and(|data| is_special(&data)) {
        let mut file = File::options().write(true).open(path)?;
        file.write_all(content)?;
        return file.flush();
    }
    let meant = match path.is_symlink() {
        true => path.canonicalize()?,
        false => path.to_path_buf(),
    };
    write_whole(&meant, content, durable)
}

/// Writes `content` under a temporary name in the directory of `path`, to be renamed later. With
/// `durable`, the content is on the disk when this returns.
///
/// # Errors
/// As [`write_whole`].
pub fn write_ahead(path: &Path, content: &[u8], durable: bool) -> io::Result<Temporary> {
    let (file, temporary) = write_aside(path, content)?;
    if durable {
        file.sync_data()?;
    }
    Ok(temporary)
}

/// Fingerprint that distinguishes a written file from any later file at its path: size, time of
/// modification in nanoseconds, inode. A rename changes none of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileFingerprint {
    /// Size in bytes.
    size: u64,
    /// Time of modification in nanoseconds since 1970.
    modified_ns: i128,
    inode: u64,
}

impl FileFingerprint {
    /// The fingerprint of no file.
    pub const NONE: FileFingerprint = FileFingerprint {
        size: u64::MAX,
        modified_ns: i128::MAX,
        inode: u64::MAX,
    };

    fn of(data: &Metadata) -> FileFingerprint {
        let seconds = i128::from(data.mtime());
        FileFingerprint {
            size: data.len(),
            modified_ns: seconds * 1_000_000_000 + i128::from(data.mtime_nsec()),
            inode: data.ino(),
        }
    }

    /// Parses a displayed [`FileFingerprint`], or returns `None` if the text is invalid.
    pub fn parse(text: &str) -> Option<FileFingerprint> {
        let mut numbers = text.split(' ');
        let fingerprint = FileFingerprint {
            size: numbers.next()?.parse().ok()?,
            modified_ns: numbers.next()?.parse().ok()?,
            inode: numbers.next()?.parse().ok()?,
        };
        numbers.next().is_none().then_some(fingerprint)
    }

    /// Returns the fingerprint of the regular file at this path, if there is one.
    pub fn at(path: &Path) -> Option<FileFingerprint> {
        let data = std::fs::symlink_metadata(path).ok()?;
        data.is_file().then(|| FileFingerprint::of(&data))
    }
}

impl std::fmt::Display for FileFingerprint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {} {}", self.size, self.modified_ns, self.inode)
    }
}

/// A file to be written: its path and its content.
pub type Content<'a> = (&'a Path, &'a [u8]);

/// Writes two files like [`write_whole`]; `first` gets its name before `second` does. Both are
/// synced at the same time, so the file system's journal is written once for both. Returns the
/// fingerprints of both.
///
/// # Errors
/// As [`write_whole`], with the path that could not be written.
pub fn write_both<'a>(
    first: Content<'a>,
    second: Content<'a>,
    durable: bool,
) -> Result<[FileFingerprint; 2], (&'a Path, io::Error)> {
    let of = |path| move |error| (path, error);
    let one = write_aside(first.0, first.1).map_err(of(first.0))?;
    let other = write_aside(second.0, second.1).map_err(of(second.0))?;
    if durable {
        sync_both(&one.0, &other.0).map_err(of(second.0))?;
    }
    let fingerprint = |file: &File| file.metadata().map(|data| FileFingerprint::of(&data));
    let fingerprints = [
        fingerprint(&one.0).map_err(of(first.0))?,
        fingerprint(&other.0).map_err(of(second.0))?,
    ];
    let named = one.1.persist(first.0);
    named.map_err(|unnamed| (first.0, unnamed.error))?;
    let named = other.1.persist(second.0);
    named.map_err(|unnamed| (second.0, unnamed.error))?;
    Ok(fingerprints)
}

fn sync_both(first: &File, second: &File) -> io::Result<()> {
    start_writing(first);
    start_writing(second);
    first.sync_data()?;
    second.sync_data()
}

/// Makes the system start writing a file to the disk, without waiting. A caller that then syncs
/// several files in sequence waits for all of them at once. A thread for each file usually costs
/// more.
fn start_writing(file: &File) {
    // This covers the whole file. Its result is ignored, because only the later sync counts.
    #[expect(unsafe_code, reason = "no safe interface provides this call")]
    // SAFETY: the descriptor is open as long as the file is borrowed, and no memory is passed.
    unsafe {
        libc::sync_file_range(file.as_raw_fd(), 0, 0, libc::SYNC_FILE_RANGE_WRITE);
    }
}

/// Writes `content` under a temporary name beside `path`.
fn write_aside(path: &Path, content: &[u8]) -> io::Result<(File, Temporary)> {
    let directory = parent(path);
    sweep_once(directory);
    remove_left();
    let made = make_temporary_in(directory).map_err(without_path)?;
    let (mut file, path) = made.into_parts();
    let temporary = Temporary::new(path).map_err(without_path)?;
    // Some file systems have no locks. There the name must suffice.
    let _ = flock(&file, FlockOperation::NonBlockingLockExclusive);
    file.write_all(content)?;
    Ok((file, temporary))
}

/// Maximum number of attempts to create a directory that is removed immediately.
const TRIES: usize = 16;

/// Held while a created directory does not contain its file yet. Threads that create files hold it
/// shared, and a thread that removes empty directories holds it exclusively.
static MAKING: RwLock<()> = RwLock::new(());

/// Creates a temporary file, and its directory if missing. Another process may remove the directory
/// while it is empty ([`remove_empty_above`]). It is then created again.
fn make_temporary_in(directory: &Path) -> io::Result<NamedTempFile> {
    let _making = MAKING.read().unwrap_or_else(PoisonError::into_inner);
    for _ in 0..TRIES {
        match make_temporary(directory) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            made => return made,
        }
        match make_directory(directory) {
            // A parent directory was removed meanwhile.
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    make_temporary(directory)
}

fn make_temporary(directory: &Path) -> io::Result<NamedTempFile> {
    // Unlike most temporary files, this one is readable for every user that the umask allows.
    let readable = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    tempfile::Builder::new()
        .prefix(OWN_PREFIX.as_str())
        .suffix(SUFFIX)
        .permissions(readable)
        .tempfile_in(directory)
}

/// Creates a directory and its parents, unless it exists.
fn make_directory(directory: &Path) -> io::Result<()> {
    match std::fs::create_dir_all(directory) {
        // The entry exists, but std could not determine whether it is a directory. The cause of
        // that may be temporary, so it is the error, rather than the existing entry.
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let is_directory = std::fs::metadata(directory)?.is_dir();
            if is_directory { Ok(()) } else { Err(error) }
        }
        made => made,
    }
}

static OWN_PREFIX: LazyLock<String> = LazyLock::new(|| {
    let pid = std::process::id();
    let started = Stat::of(pid).map_or(0, |stat| stat.started);
    format!("{PREFIX}{pid}.{started}-")
});

/// Directories that this process has swept.
static SWEPT: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);

/// Removes the files of killed processes before this process first writes into a directory.
fn sweep_once(directory: &Path) {
    let mut swept = SWEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let swept = swept.get_or_insert_default();
    if swept.contains(directory) {
        return;
    }
    swept.insert(directory.to_path_buf());
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        sweep_entry(&entry, &|writer| !writer.is_own() && writer.is_dead());
    }
}

/// Removes the temporary name from an error: it means nothing to users and always differs.
fn without_path(error: io::Error) -> io::Error {
    let plain = io::Error::from(error.kind());
    let known = error.get_ref().is_some() && plain.to_string() != "uncategorized error";
    if known { plain } else { error }
}

/// Removes a file if it exists.
///
/// # Errors
/// Returns the error of the file system, unless the file does not exist or cannot exist.
pub fn remove(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound && !is_for_good(&error) => Err(error),
        _ => Ok(()),
    }
}

/// Removes the empty directories above `path`, up to `top`, which stays. It stops at a directory
/// that is not empty or cannot be removed.
pub fn remove_empty_above(path: &Path, top: &Path) {
    let _alone = MAKING.write().unwrap_or_else(PoisonError::into_inner);
    let above = path.ancestors().skip(1);
    for directory in above.take_while(|it| *it != top && it.starts_with(top)) {
        if std::fs::remove_dir(directory).is_err() {
            return;
        }
    }
}

/// Checks whether an error is permanent: no file of that name can exist, and waiting does not help.
/// The name is too long, or another entry is in the way.
pub fn is_for_good(error: &io::Error) -> bool {
    use io::ErrorKind::{
        AlreadyExists, InvalidFilename, InvalidInput, IsADirectory, NotADirectory,
    };
    let in_the_way = [
        AlreadyExists,
        InvalidFilename,
        InvalidInput,
        IsADirectory,
        NotADirectory,
    ];
    in_the_way.contains(&error.kind()) || error.raw_os_error() == Some(libc::ELOOP)
}

/// Removes the partial files of killed processes below a directory. Must be called before this
/// process writes, because it may have the id of a dead one. Returns the living writers of the
/// files that stay.
pub fn sweep(directory: &Path) -> Vec<Writer> {
    sweep_where(directory, &|writer| writer.is_own() || writer.is_dead())
}

/// Works like [`sweep`], while this process may be writing.
pub fn sweep_dead(directory: &Path) -> Vec<Writer> {
    sweep_where(directory, &|writer| !writer.is_own() && writer.is_dead())
}

fn sweep_where(directory: &Path, is_over: &dyn Fn(Writer) -> bool) -> Vec<Writer> {
    let mut living = Vec::new();
    // A directory that is missing or cannot be read has no remains to remove.
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => living.extend(sweep_where(&entry.path(), is_over)),
            _ => living.extend(sweep_entry(&entry, is_over)),
        }
    }
    living
}

/// Removes a partial file if its writer is dead, and returns the writer otherwise.
fn sweep_entry(entry: &DirEntry, is_over: &dyn Fn(Writer) -> bool) -> Option<Writer> {
    let writer = Writer::of(&entry.file_name().to_string_lossy())?;
    let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
    let path = entry.path();
    if !is_file {
        return None;
    }
    if !is_over(writer) {
        return Some(writer);
    }
    if !is_locked(&path)
        && let Err(error) = remove(&path)
    {
        tracing::warn!("cannot remove {}: {error}", path.display());
    }
    None
}

/// The process that writes a file, according to its temporary name.
#[derive(Debug, Clone, Copy)]
pub struct Writer {
    pid: u32,
    /// Start time of the process in clock ticks since boot.
    started: u64,
}

impl Writer {
    fn of(name: &str) -> Option<Writer> {
        let rest = name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
        let (pid, started) = rest.split_once('-')?.0.split_once('.')?;
        Some(Writer {
            pid: pid.parse().ok()?,
            started: started.parse().ok()?,
        })
    }

    fn is_own(self) -> bool {
        self.pid == std::process::id()
    }

    /// Checks whether it can no longer be writing: its id is free or belongs to another process, or
    /// it has ended and its parent has not noticed.
    pub fn is_dead(self) -> bool {
        match Stat::of(self.pid) {
            Some(stat) => stat.started != self.started || stat.has_ended(),
            None => !Path::new("/proc").join(self.pid.to_string()).exists(),
        }
    }
}

/// Checks whether a process writes to the file, possibly in another container.
fn is_locked(path: &Path) -> bool {
    let mut how = File::options();
    let how = how
        .read(true)
        .custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
    how.open(path).is_ok_and(|file| {
        flock(&file, FlockOperation::NonBlockingLockShared) == Err(rustix::io::Errno::WOULDBLOCK)
    })
}

/// What the system tells about a process (proc(5), `/proc/PID/stat`).
struct Stat {
    state: char,
    /// Start time in clock ticks since boot.
    started: u64,
}

impl Stat {
    /// Reads the 3rd and the 22nd field. The second is a name in parentheses that may contain
    /// anything.
    fn of(pid: u32) -> Option<Stat> {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let (_, rest) = stat.rsplit_once(')')?;
        let mut fields = rest.split_whitespace();
        Some(Stat {
            state: fields.next()?.chars().next()?,
            started: fields.nth(18)?.parse().ok()?,
        })
    }

    /// Checks whether it is a zombie or about to vanish. It has closed its files then.
    fn has_ended(&self) -> bool {
        matches!(self.state, 'Z' | 'X')
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_follows_links_and_keeps_devices() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("file"), "old").unwrap();
        std::os::unix::fs::symlink("file", at("link")).unwrap();
        write_named(&at("link"), b"new", false).unwrap();
        assert!(at("link").is_symlink());
        assert_eq!(std::fs::read(at("file")).unwrap(), b"new");
        write_named(&at("fresh"), b"first", false).unwrap();
        assert_eq!(std::fs::read(at("fresh")).unwrap(), b"first");
        assert!(write_named(dir.path(), b"x", false).is_err());

        let pipe = at("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let from = pipe.clone();
        let reader = std::thread::spawn(move || std::fs::read(from).unwrap());
        write_named(&pipe, b"through", false).unwrap();
        assert_eq!(reader.join().unwrap(), b"through");
        let is_file = std::fs::symlink_metadata(&pipe).unwrap().is_file();
        assert!(!is_file, "the file is still a pipe");
    }

    #[test]
    fn only_files_of_dead_processes_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        let below = dir.path().join("maps");
        std::fs::create_dir(&below).unwrap();
        let parent = rustix::process::getppid().unwrap().as_raw_nonzero();
        let parent = u32::try_from(parent.get()).unwrap();
        let started = Stat::of(parent).unwrap().started;
        let dead = below.join(".qcbus-4194999.1-a1b2c3.tmp");
        let former = below.join(format!(".qcbus-{parent}.1-a1b2c3.tmp"));
        let living = below.join(format!(".qcbus-{parent}.{started}-a1b2c3.tmp"));
        // This file looks like that of a process in another container.
        let locked = below.join(".qcbus-4194999.1-d4e5f6.tmp");
        let result = below.join("a.xodr.xqar");
        for path in [&dead, &former, &living, &locked, &result] {
            std::fs::write(path, "half").unwrap();
        }
        let writer = File::open(&locked).unwrap();
        flock(&writer, FlockOperation::NonBlockingLockExclusive).unwrap();
        let left = sweep(dir.path());
        assert_eq!(left.iter().map(|it| it.pid).collect::<Vec<_>>(), [parent]);
        assert!(!dead.exists() && !former.exists());
        assert!(living.exists() && locked.exists() && result.exists());
        drop(writer);
        sweep_dead(dir.path());
        assert!(!locked.exists());
    }

    /// In a container whose first process does not wait for its children, zombies stay for ever.
    #[test]
    fn file_of_an_ended_process_is_removed_before_its_parent_notices() {
        let dir = tempfile::tempdir().unwrap();
        let mut child = std::process::Command::new("sleep");
        let mut child = child.arg("1000").spawn().unwrap();
        let started = Stat::of(child.id()).unwrap().started;
        let name = format!(".qcbus-{}.{started}-a1b2c3.tmp", child.id());
        let path = dir.path().join(name);
        std::fs::write(&path, "half").unwrap();
        let [writer] = sweep_dead(dir.path())[..] else {
            panic!("the writer lives")
        };
        child.kill().unwrap();
        while !writer.is_dead() {
            std::thread::yield_now();
        }
        assert!(sweep_dead(dir.path()).is_empty());
        assert!(!path.exists());
        child.wait().unwrap();
    }

    #[test]
    fn first_write_removes_files_of_dead_processes() {
        let dir = tempfile::tempdir().unwrap();
        let dead = dir.path().join(".qcbus-4194999.1-a1b2c3.tmp");
        std::fs::write(&dead, "half").unwrap();
        let ahead = write_ahead(&dir.path().join("later"), b"whole", false).unwrap();
        assert!(!dead.exists());
        write_whole(&dir.path().join("a"), b"whole", false).unwrap();
        sweep_dead(dir.path());
        assert!(
            ahead.path().exists(),
            "the file belongs to this process and is not renamed yet"
        );
    }

    #[test]
    fn empty_directories_are_removed_up_to_the_top() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("top/a/b")).unwrap();
        std::fs::create_dir_all(at("top/c/d")).unwrap();
        std::fs::write(at("top/c/kept"), "").unwrap();
        remove_empty_above(&at("top/a/b/gone"), &at("top"));
        remove_empty_above(&at("top/c/d/gone"), &at("top"));
        assert!(at("top").exists() && !at("top/a").exists());
        assert!(at("top/c/kept").exists() && !at("top/c/d").exists());
        remove_empty_above(&at("top/gone"), &at("elsewhere"));
        assert!(
            at("top").exists(),
            "the directory is not below the given top directory"
        );
    }

    #[test]
    fn files_are_written_while_their_empty_directory_is_removed() {
        let dir = tempfile::tempdir().unwrap();
        let top = dir.path().to_path_buf();
        let place = top.join("a/b/file");
        let done = std::sync::atomic::AtomicBool::new(false);
        let written = std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    remove_empty_above(&place, &top);
                }
            });
            let write = |_| write_whole(&place, b"whole", false).and_then(|()| remove(&place));
            let written = (0..500).try_for_each(write);
            // This also runs after a failure. Otherwise the other thread would never end.
            done.store(true, std::sync::atomic::Ordering::Relaxed);
            written
        });
        written.unwrap();
    }

    #[test]
    fn removing_an_impossible_file_succeeds() {
        let dir = tempfile::TempDir::new().unwrap();
        let file = dir.path().join("file");
        std::fs::write(&file, "").unwrap();
        remove(&dir.path().join("x".repeat(256))).unwrap();
        remove(&file.join("below")).unwrap();
        remove(dir.path()).unwrap();
        assert!(file.exists(), "a directory is not an output file");
        remove(&file).unwrap();
        assert!(!file.exists());
    }

    #[test]
    fn two_files_are_written_together_or_not_at_all() {
        let dir = tempfile::TempDir::new().unwrap();
        let path = |name: &str| dir.path().join(name);
        let (first, second) = (path("a.verdict.json"), path("deep/a.xqar"));
        let fingerprints = write_both((&first, b"verdict"), (&second, b"result"), true).unwrap();
        let there = [&first, &second].map(|it| FileFingerprint::at(it).unwrap());
        assert_eq!(there, fingerprints);
        assert_ne!(fingerprints[0], fingerprints[1]);
        assert_eq!(
            FileFingerprint::parse(&fingerprints[0].to_string()),
            Some(fingerprints[0])
        );
        assert_eq!(FileFingerprint::parse("1 2"), None);
        assert_eq!(FileFingerprint::parse("1 2 3 4"), None);
        assert_eq!(std::fs::read(&first).unwrap(), b"verdict");
        assert_eq!(std::fs::read(&second).unwrap(), b"result");

        let (first, below_a_file) = (path("b.verdict.json"), second.join("b.xqar"));
        let failed = write_both((&first, b"verdict"), (&below_a_file, b"result"), true);
        assert!(failed.is_err());
        let mut there: Vec<_> = std::fs::read_dir(dir.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        there.sort();
        assert_eq!(there, ["a.verdict.json", "deep"]);
    }
}
