//! Files that others may write. Another user may put a pipe, a device or a kernel file there. The
//! file may be replaced while it is opened, or lie on a disk that does not answer.
//!
//! Everything here opens regular files only and never waits for a writer or a lease. It reads no
//! more than the given limit. A [`IoWatchdog`] sees every file that it waits for.

mod behalf;
mod io_watchdog;
mod mounts;

use std::fs::{DirEntry, File, Metadata};
use std::io::{self, Read};
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};
use rustix::io::{Errno, retry_on_intr};

pub use behalf::{Behalf, Reader, on_behalf_of, reader};
use io_watchdog::{Access, note};
pub use io_watchdog::{Attendance, IoWatchdog, Overdue};

/// Reason why a path was not opened.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    /// It is a directory.
    #[error("it is a directory, not a file")]
    Directory,
    /// It is a device, a pipe, a socket, or a virtual file of the kernel.
    #[error("it is {0}, not a file")]
    Special(&'static str),
    /// The operating system returns an error.
    #[error(transparent)]
    System(#[from] io::Error),
}

impl From<Refused> for io::Error {
    fn from(refused: Refused) -> io::Error {
        match refused {
            Refused::System(error) => error,
            Refused::Directory => io::Error::new(io::ErrorKind::IsADirectory, refused),
            // The error is permanent (see [`crate::is_for_good`]): waiting does not help.
            Refused::Special(_) => io::Error::new(io::ErrorKind::InvalidInput, refused),
        }
    }
}

/// Opens a regular file for reading, through links, and returns the file and its metadata.
///
/// The entry is checked before it is opened, and exactly the checked entry is opened. A device that
/// appears there meanwhile is not touched.
///
/// # Errors
/// See [`Refused`]. If another process has a lease on the file, the error says that it would block.
pub fn open(path: &Path) -> Result<(File, Metadata), Refused> {
    let _access = Access::begin(path)?;
    noted(path, open_regular(path))
}

/// Reads the whole content of a regular file, if it has no more than `most` bytes.
///
/// # Errors
/// As [`open`], and [`io::ErrorKind::FileTooLarge`].
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let access = Access::begin(path)?;
    noted(path, read_regular(path, most, &access))
}

/// Reads the rest of a file, but no more than `most` bytes. The I/O watchdog uses `path`.
///
/// # Errors
/// Returns the error of the operating system.
pub fn read_on(path: &Path, file: &mut File, most: u64, bytes: &mut Vec<u8>) -> io::Result<()> {
    let access = Access::begin(path)?;
    noted(path, read_pieces(file, most, bytes, &access))
}

/// Works like [`std::fs::metadata`].
///
/// # Errors
/// Returns the error of the operating system.
pub fn metadata(path: &Path) -> io::Result<Metadata> {
    let _access = Access::begin(path)?;
    noted(path, std::fs::metadata(path))
}

/// Works like [`std::fs::symlink_metadata`].
///
/// # Errors
/// Returns the error of the operating system.
pub fn symlink_metadata(path: &Path) -> io::Result<Metadata> {
    let _access = Access::begin(path)?;
    noted(path, std::fs::symlink_metadata(path))
}

/// Checks whether this is a symbolic link. A missing entry is not.
///
/// # Errors
/// Returns the error of the operating system, except for a missing entry.
pub fn is_symlink(path: &Path) -> io::Result<bool> {
    match symlink_metadata(path) {
        Ok(data) => Ok(data.is_symlink()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Works like [`std::fs::canonicalize`].
///
/// # Errors
/// Returns the error of the operating system.
pub fn canonicalize(path: &Path) -> io::Result<PathBuf> {
    let _access = Access::begin(path)?;
    noted(path, std::fs::canonicalize(path))
}

/// Returns the entries of a directory, without those that cannot be read.
///
/// # Errors
/// Returns the error of the operating system.
pub fn list(directory: &Path) -> io::Result<Vec<DirEntry>> {
    let _access = Access::begin(directory)?;
    let data = noted(directory, std::fs::metadata(directory))?;
    behalf::may_read(&data)?;
    let entries = noted(directory, std::fs::read_dir(directory))?;
    Ok(entries
        .filter_map(|entry| noted(directory, entry).ok())
        .collect())
}

/// Performs another operation on a foreign file that may hang.
///
/// # Errors
/// Returns the error of `work`.
pub fn access<T>(path: &Path, work: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    let _access = Access::begin(path)?;
    noted(path, work())
}

/// Checks whether an error is temporary: there are no descriptors or no memory, or a disk or server
/// did not answer. The operation may succeed later.
pub fn is_of_the_moment(error: &io::Error) -> bool {
    const OF_THE_MOMENT: &[Errno] = &[
        Errno::AGAIN,
        Errno::BUSY,
        Errno::COMM,
        Errno::CONNABORTED,
        Errno::CONNREFUSED,
        Errno::CONNRESET,
        Errno::HOSTDOWN,
        Errno::HOSTUNREACH,
        Errno::INTR,
        Errno::IO,
        Errno::MFILE,
        Errno::NETDOWN,
        Errno::NETUNREACH,
        Errno::NFILE,
        Errno::NOBUFS,
        Errno::NOLCK,
        Errno::NOLINK,
        Errno::NOMEM,
        Errno::NOTCONN,
        Errno::REMOTEIO,
        Errno::STALE,
        Errno::TIMEDOUT,
    ];
    match error.raw_os_error() {
        Some(code) => OF_THE_MOMENT.contains(&Errno::from_raw_os_error(code)),
        None => matches!(
            error.kind(),
            io::ErrorKind::TimedOut | io::ErrorKind::OutOfMemory
        ),
    }
}

/// Records a temporary error for the guard of this thread.
fn noted<T, E: OfTheSystem>(path: &Path, result: Result<T, E>) -> Result<T, E> {
    if let Some(error) = result.as_ref().err().and_then(OfTheSystem::of_the_system)
        && is_of_the_moment(error)
    {
        note(path, error);
    }
    result
}

trait OfTheSystem {
    fn of_the_system(&self) -> Option<&io::Error>;
}

impl OfTheSystem for io::Error {
    fn of_the_system(&self) -> Option<&io::Error> {
        Some(self)
    }
}

impl OfTheSystem for Refused {
    fn of_the_system(&self) -> Option<&io::Error> {
        match self {
            Refused::System(error) => Some(error),
            Refused::Directory | Refused::Special(_) => None,
        }
    }
}

fn open_regular(path: &Path) -> Result<(File, Metadata), Refused> {
    let flags = OFlags::PATH | OFlags::CLOEXEC;
    let handle = retry_on_intr(|| rustix::fs::open(path, flags, Mode::empty()));
    let handle = File::from(handle.map_err(io::Error::from)?);
    behalf::may_read(&regular(&handle)?)?;
    let file = match reopen(&format!("/proc/self/fd/{}", handle.as_raw_fd())) {
        // Without /proc the file is opened again by its name.
        Err(error) if error.kind() == io::ErrorKind::NotFound => reopen(path)?,
        file => file?,
    };
    let found = regular(&file)?;
    behalf::may_read(&found)?;
    Ok((file, found))
}

fn reopen(path: impl rustix::path::Arg + Copy) -> io::Result<File> {
    // This does not block, not even for the holder of a lease.
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let file = retry_on_intr(|| rustix::fs::open(path, flags, Mode::empty()))?;
    Ok(File::from(file))
}

fn regular(file: &File) -> Result<Metadata, Refused> {
    let data = file.metadata()?;
    if data.is_dir() {
        return Err(Refused::Directory);
    }
    if !data.is_file() {
        return Err(Refused::Special("a device, pipe or socket"));
    }
    // File systems without a disk have the major number 0. Only those may contain virtual files.
    if rustix::fs::major(data.dev()) == 0 {
        let system = retry_on_intr(|| rustix::fs::fstatfs(file)).map_err(io::Error::from)?;
        // The type of this field differs between machines, but all the numbers fit.
        if u32::try_from(system.f_type).is_ok_and(|kind| MADE_UP.contains(&kind)) {
            return Err(Refused::Special("a virtual file of the kernel"));
        }
    }
    Ok(data)
}

/// File systems with virtual files. Reading one queries the kernel, may consume the data and may
/// block (`linux/magic.h`): proc, sysfs, debugfs, tracefs, securityfs, cgroup and cgroup2,
/// configfs, bpf, pstore, efivarfs, binfmt_misc, devpts, mqueue, selinuxfs, smackfs, nsfs, fusectl,
/// resctrl.
const MADE_UP: &[u32] = &[
    0x9fa0,
    0x6265_6572,
    0x6462_6720,
    0x7472_6163,
    0x7363_6673,
    0x0027_e0eb,
    0x6367_7270,
    0x6265_6570,
    0xcafe_4a11,
    0x6165_676c,
    0xde5e_81e4,
    0x4249_4e4d,
    0x1cd1,
    0x1980_0202,
    0xf97c_ff8c,
    0x4341_5d53,
    0x6e73_6673,
    0x6573_5543,
    0x0765_5821,
];

fn read_regular(path: &Path, most: u64, access: &Access) -> io::Result<Vec<u8>> {
    let (mut file, data) = open_regular(path)?;
    let mut bytes = Vec::with_capacity(usize::try_from(data.len().min(most)).unwrap_or(0) + 1);
    read_pieces(&mut file, most.saturating_add(1), &mut bytes, access)?;
    if bytes.len() as u64 > most {
        let why = format!("it has more than {most} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, why));
    }
    Ok(bytes)
}

/// Bytes per read. With one large read, a slow disk would look like one that hangs.
const PIECE: u64 = 4 << 20;

fn read_pieces(file: &mut File, most: u64, bytes: &mut Vec<u8>, access: &Access) -> io::Result<()> {
    let mut left = most;
    while left > 0 {
        let read = file.take(PIECE.min(left)).read_to_end(bytes)? as u64;
        access.goes_on();
        left -= read;
        if read < PIECE {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
