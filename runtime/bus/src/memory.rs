//! Shared memory: measures its size and reserves it.
//!
//! Writing to a page of /dev/shm that cannot be allocated raises SIGBUS. So all memory is allocated
//! before it is written to. A process that needs much checks and takes the free memory while no
//! other process of the same user does. The broker allocates the memory of its peers in advance in
//! a file, from which each takes its part. The slots of a stream are allocated a few ahead of those
//! in use.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::ops::Range;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use qcbus_messages::services::STREAM_STEP_BYTES;
use rustix::fs::{FallocateFlags, FlockOperation, fallocate, flock};
use rustix::io::{Errno, retry_on_intr};

use crate::instance::Instance;

/// Path of the shared memory.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";

/// Maximum wait for the lock. Each holder takes milliseconds, and several processes may wait on a
/// busy machine. A longer wait means that a stopped process holds the lock. This is well below the
/// time in which a peer must join.
const IN_LINE: Duration = Duration::from_secs(2);

/// Whether the last wait of this process for the lock has timed out. It does not wait again until
/// it has held the lock. Otherwise each wait would be as long, and a peer would join too late.
static IN_VAIN: AtomicBool = AtomicBool::new(false);

/// Bytes allocated by one call, which takes some hundred microseconds.
const HAVE_STEP: u64 = 256 << 10;

/// The shared memory of this system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedMemory {
    /// Total bytes.
    pub size: u64,
    /// Bytes that an ordinary user may still take.
    pub free: u64,
}

impl SharedMemory {
    /// Checks whether it is mounted read-only, so that no broker can start.
    ///
    /// # Errors
    /// Fails if there is no shared memory.
    pub fn is_read_only() -> io::Result<bool> {
        let stat = rustix::fs::statvfs(SHARED_MEMORY)?;
        Ok(stat.f_flag.contains(rustix::fs::StatVfsMountFlags::RDONLY))
    }

    /// Returns the current size and free bytes.
    ///
    /// # Errors
    /// Fails if there is no shared memory.
    pub fn now() -> io::Result<SharedMemory> {
        let stat = rustix::fs::statvfs(SHARED_MEMORY)?;
        Ok(SharedMemory {
            size: stat.f_blocks.saturating_mul(stat.f_frsize),
            free: stat.f_bavail.saturating_mul(stat.f_frsize),
        })
    }
}

/// Returns the bytes that an ordinary user may still take in /dev/shm.
pub(crate) fn free_shared_memory() -> u64 {
    SharedMemory::now().map_or(0, |memory| memory.free)
}

/// Returns the requested reserve, limited to an eighth of /dev/shm. For a memory without a limit
/// (size 0) the reserve is 0.
pub(crate) fn fitting_reserve(wanted: u64) -> u64 {
    match SharedMemory::now() {
        Ok(memory) => wanted.min(memory.size / 8),
        Err(_) => wanted,
    }
}

/// A lock by which only one process of this user at a time takes shared memory.
pub(crate) struct RoomLocks(Mutex<Option<File>>);

impl RoomLocks {
    /// Opens the lock file. If that fails, the process relies on the free memory alone.
    pub(crate) fn new() -> RoomLocks {
        let open = || -> Option<File> {
            let path = Instance::base_dir().ok()?.join(".memory");
            let mut how = OpenOptions::new();
            how.read(true).write(true).create(true).truncate(false);
            how.mode(0o600).custom_flags(libc::O_NOFOLLOW);
            // A bundle started by the broker cannot write there. Read access is enough for a lock.
            let read = || {
                let mut how = OpenOptions::new();
                how.read(true).custom_flags(libc::O_NOFOLLOW).open(&path)
            };
            how.open(&path).or_else(|_| read()).ok()
        };
        RoomLocks(Mutex::new(open()))
    }

    /// Waits for the lock, up to a limit. A stopped holder must not block the other processes.
    pub(crate) fn take(&self) -> RoomLock<'_> {
        let file = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let locked = file.as_ref().is_some_and(wait_for);
        RoomLock { file, locked }
    }
}

/// Checks whether the lock was taken within the time limit.
fn wait_for(file: &File) -> bool {
    let patience = match IN_VAIN.load(Ordering::Relaxed) {
        true => Duration::ZERO,
        false => IN_LINE,
    };
    let until = Instant::now() + patience;
    let locked = loop {
        match flock(file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => break true,
            Err(_) if Instant::now() >= until => break false,
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    };
    IN_VAIN.store(!locked, Ordering::Relaxed);
    locked
}

/// Guard of the lock: no other process takes shared memory meanwhile.
pub(crate) struct RoomLock<'t> {
    file: MutexGuard<'t, Option<File>>,
    locked: bool,
}

impl Drop for RoomLock<'_> {
    fn drop(&mut self) {
        if let (true, Some(file)) = (self.locked, self.file.as_ref()) {
            let _ = flock(file, FlockOperation::Unlock);
        }
    }
}

/// Reserves shared memory for the peers that will join a generation, as a file of that size.
///
/// # Errors
/// Fails if the memory cannot be allocated. The file is then removed.
pub(crate) fn keep_room(root: &Path, bytes: u64) -> io::Result<()> {
    let path = room(root);
    let mut how = OpenOptions::new();
    let file = how.write(true).create_new(true).mode(0o600).open(&path)?;
    have(&file, FallocateFlags::empty(), 0..bytes.max(1)).map_err(|error| {
        let _ = fs::remove_file(&path);
        error.into()
    })
}

/// Allocates the memory of a part of a file.
fn have(file: &File, flags: FallocateFlags, part: Range<u64>) -> Result<(), Errno> {
    in_steps(part, |from, bytes| fallocate(file, flags, from, bytes))
}

/// Runs an allocation in short steps and retries each step. Older kernels end a call at any signal
/// and undo it.
fn in_steps(
    part: Range<u64>,
    mut take: impl FnMut(u64, u64) -> Result<(), Errno>,
) -> Result<(), Errno> {
    let mut from = part.start;
    while from < part.end {
        let step = HAVE_STEP.min(part.end - from);
        retry_on_intr(|| take(from, step))?;
        from += step;
    }
    Ok(())
}

/// Releases a part of the memory reserved for peers. Returns `false` if not enough is left.
pub(crate) fn take_room(root: &Path, bytes: u64) -> bool {
    let mut how = OpenOptions::new();
    let file = how.write(true).custom_flags(libc::O_NOFOLLOW);
    let Ok(file) = file.open(room(root)) else {
        return false;
    };
    let left = file
        .metadata()
        .ok()
        .and_then(|data| data.len().checked_sub(bytes));
    left.is_some_and(|left| file.set_len(left).is_ok())
}

fn room(root: &Path) -> PathBuf {
    root.join("room")
}

/// The memory of one publisher's slots of a fixed size, allocated some slots ahead of those in use.
/// Slots are first used one after the other, and most never are.
pub(crate) struct Backing {
    file: Option<File>,
    /// Size of the segment in bytes.
    len: u64,
    /// Bytes allocated from its beginning.
    had: u64,
    /// Address of the first lent slot, and the highest end of all lent slots relative to it.
    first: Option<usize>,
    used: u64,
}

impl Backing {
    /// Returns the memory of the publisher with this id, which has not lent anything yet.
    ///
    /// # Errors
    /// Returns the error of the operating system, for example if there is no room.
    pub(crate) fn of(root: &Path, publisher: u128) -> io::Result<Backing> {
        let mut backing = Backing {
            file: segment(root, publisher),
            len: 0,
            had: 0,
            first: None,
            used: 0,
        };
        match &backing.file {
            Some(file) => backing.len = file.metadata()?.len(),
            None => tracing::debug!(publisher, "the memory of a publisher was not found"),
        }
        backing.go_ahead()?;
        Ok(backing)
    }

    /// Allocates the whole memory at once.
    ///
    /// # Errors
    /// Returns the error of the operating system, for example if there is no room.
    pub(crate) fn whole(root: &Path, publisher: u128) -> io::Result<()> {
        Backing::of(root, publisher)?.reach(u64::MAX)
    }

    /// Checks whether the next slot may be lent. Must be called before every loan.
    pub(crate) fn is_ahead(&mut self) -> bool {
        let ahead = self.go_ahead();
        if let Err(error) = &ahead {
            tracing::debug!(%error, "no shared memory for further frames");
        }
        ahead.is_ok()
    }

    fn go_ahead(&mut self) -> io::Result<()> {
        self.reach(self.used + STREAM_STEP_BYTES / 2)
    }

    /// Records that a slot of this size was lent at this address.
    pub(crate) fn lent(&mut self, address: usize, bytes: usize) {
        let first = *self.first.get_or_insert(address);
        self.used = match address.checked_sub(first) {
            Some(offset) => self.used.max((offset + bytes) as u64),
            // The order of addresses is unexpected, so all slots may be in use.
            None => self.len,
        };
    }

    fn reach(&mut self, wanted: u64) -> io::Result<()> {
        let Some(file) = self.file.as_ref() else {
            return Ok(());
        };
        if wanted <= self.had || self.had >= self.len {
            return Ok(());
        }
        let until = wanted.saturating_add(STREAM_STEP_BYTES / 2).min(self.len);
        match have(file, FallocateFlags::KEEP_SIZE, self.had..until) {
            Ok(()) => self.had = until,
            // The file system does not support this, so the reserve alone must suffice.
            Err(Errno::OPNOTSUPP) => self.had = self.len,
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }
}

/// Opens the segment of a publisher. Its name ends with the publisher's unique number.
fn segment(root: &Path, publisher: u128) -> Option<File> {
    let end = format!("_{publisher}.data");
    let mut entries = fs::read_dir(root).ok()?.flatten();
    let found = entries.find(|entry| {
        entry
            .file_name()
            .as_encoded_bytes()
            .ends_with(end.as_bytes())
    })?;
    let mut how = OpenOptions::new();
    let how = how.read(true).write(true).custom_flags(libc::O_NOFOLLOW);
    how.open(found.path()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::StartError;

    #[test]
    fn interrupted_step_is_repeated_without_gaps() {
        let (mut calls, mut had) = (0, 0);
        let done = in_steps(0..HAVE_STEP * 2 + 1, |from, bytes| {
            calls += 1;
            if calls % 2 == 1 {
                return Err(Errno::INTR);
            }
            assert_eq!(from, had);
            had += bytes;
            Ok(())
        });
        assert_eq!((done, had, calls), (Ok(()), HAVE_STEP * 2 + 1, 6));
    }

    #[test]
    fn step_without_space_is_reported() {
        let done = in_steps(0..1, |_, _| Err(Errno::NOSPC));
        assert_eq!(done, Err(Errno::NOSPC));
    }

    #[test]
    fn removed_directory_is_not_reported_as_lack_of_space() {
        let dir = tempfile::TempDir::new_in(SHARED_MEMORY).unwrap();
        let error = keep_room(&dir.path().join("gone"), 1).unwrap_err();
        let said = StartError::no_room(error, u64::MAX).to_string();
        let expected = "cannot use the shared memory in /dev/shm: No such file or directory";
        assert!(said.starts_with(expected), "{said}");
    }
}
