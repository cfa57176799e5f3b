//! What the kernel is asked for, and how its events are waited for.

use std::ffi::{OsStr, OsString};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::time::Duration;

use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec};
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, Reader, WatchFlags};
use rustix::io::Errno;

/// Bytes of events that are taken at once: some hundreds of events.
const AT_ONCE: usize = 64 * 1024;

/// How long a wait is that cannot be one.
const PAUSE: Duration = Duration::from_millis(20);

/// What is worth an event. Who only opens or reads a file, as we do ourselves, is not.
fn worth() -> WatchFlags {
    WatchFlags::ONLYDIR
        | WatchFlags::DONT_FOLLOW
        | WatchFlags::ATTRIB
        | WatchFlags::CREATE
        | WatchFlags::DELETE
        | WatchFlags::DELETE_SELF
        | WatchFlags::CLOSE_WRITE
        | WatchFlags::MODIFY
        | WatchFlags::MOVED_FROM
        | WatchFlags::MOVED_TO
        | WatchFlags::MOVE_SELF
}

/// An event as the kernel tells it.
#[derive(Debug)]
pub struct Told {
    /// Number of the watch.
    pub watch: i32,
    /// What happened.
    pub what: ReadFlags,
    /// To what in the directory; `None`: to itself.
    pub name: Option<OsString>,
}

/// The kernel, which tells of files.
#[derive(Debug)]
pub struct Kernel(OwnedFd);

impl Kernel {
    /// Begins to ask for events.
    ///
    /// # Errors
    /// When it gives none.
    pub fn open() -> io::Result<Kernel> {
        let flags = CreateFlags::CLOEXEC | CreateFlags::NONBLOCK;
        Ok(Kernel(inotify::init(flags)?))
    }

    /// Asks for the events of a directory, and gives the number of the watch.
    ///
    /// # Errors
    /// What the system says when there is no watch on it.
    pub fn watch(&self, directory: &Path) -> Result<i32, Errno> {
        inotify::add_watch(&self.0, directory, worth())
    }

    /// Asks for them no more.
    pub fn forget(&self, watch: i32) {
        // The directory may have gone, and its watch with it.
        let _ = inotify::remove_watch(&self.0, watch);
    }

    /// The events that are there now, some hundreds at most.
    ///
    /// # Errors
    /// What the system says when it gives none that are there.
    pub fn events(&self) -> io::Result<Vec<Told>> {
        let mut buffer = Box::new_uninit_slice(AT_ONCE);
        let mut reader = Reader::new(&self.0, &mut buffer);
        let mut events = Vec::new();
        loop {
            match reader.next() {
                Ok(event) => events.push(Told {
                    watch: event.wd(),
                    what: event.events(),
                    name: event
                        .file_name()
                        .map(|name| OsStr::from_bytes(name.to_bytes()).to_owned()),
                }),
                Err(Errno::AGAIN) => return Ok(events),
                Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
            if reader.is_buffer_empty() {
                return Ok(events);
            }
        }
    }
}

/// Wakes who waits for events.
#[derive(Debug)]
pub struct Bell(OwnedFd);

impl Bell {
    /// One that has not rung.
    ///
    /// # Errors
    /// When there is no descriptor left.
    pub fn new() -> io::Result<Bell> {
        let flags = EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK;
        Ok(Bell(rustix::event::eventfd(0, flags)?))
    }

    /// Wakes who waits, or is about to.
    pub fn ring(&self) {
        // A bell that has rung too often for one more has been heard.
        let _ = rustix::io::write(&self.0, &1_u64.to_ne_bytes());
    }

    /// Waits until it rings, the kernel has events, or the time is over.
    pub fn wait(&self, kernel: Option<&Kernel>, rest: Duration) {
        let timeout = Timespec::try_from(rest).unwrap_or_default();
        let mut descriptors = vec![PollFd::new(&self.0, PollFlags::IN)];
        descriptors.extend(kernel.map(|it| PollFd::new(&it.0, PollFlags::IN)));
        match rustix::event::poll(&mut descriptors, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => {}
            // There is no other way to wait; that it does not spin is enough.
            Err(_) => std::thread::sleep(rest.min(PAUSE)),
        }
        // Rung or not: what was ordered is looked for anyway.
        let _ = rustix::io::read(&self.0, &mut [0_u8; 8]);
    }
}
