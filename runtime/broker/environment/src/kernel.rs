//! Kernel interface for file events (inotify), and the wait for them.

use std::ffi::{OsStr, OsString};
use std::fmt;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec};
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, Reader, WatchFlags};
use rustix::io::Errno;

use crate::simulation::{Signal, Simulation, current};

/// Size of the event buffer in bytes: a few hundred events.
const AT_ONCE: usize = 64 * 1024;

/// Pause if `poll` fails.
const PAUSE: Duration = Duration::from_millis(20);

/// Returns the events to watch. Opening or reading a file is not included, because the broker does this itself.
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

/// An event from the kernel.
#[derive(Debug)]
pub struct FileEvent {
    /// Number of the watch.
    pub watch: i32,
    /// Kind of the event.
    pub what: ReadFlags,
    /// Name of the entry in the directory, or `None` for the directory itself.
    pub name: Option<OsString>,
}

/// The kernel's event queue (inotify).
#[derive(Debug)]
pub struct Inotify(OwnedFd);

impl Inotify {
    /// Opens the event queue.
    ///
    /// # Errors
    /// When the kernel provides none.
    pub fn open() -> io::Result<Inotify> {
        let flags = CreateFlags::CLOEXEC | CreateFlags::NONBLOCK;
        Ok(Inotify(inotify::init(flags)?))
    }

    /// Watches a directory and returns the number of the watch.
    ///
    /// # Errors
    /// The error of the system if the directory cannot be watched.
    pub fn watch(&self, directory: &Path) -> Result<i32, Errno> {
        inotify::add_watch(&self.0, directory, worth())
    }

    /// Removes a watch.
    pub fn forget(&self, watch: i32) {
        // The directory may be gone, together with its watch.
        let _ = inotify::remove_watch(&self.0, watch);
    }

    /// Returns the pending events, at most a few hundred.
    ///
    /// # Errors
    /// The error of the system if the events cannot be read.
    pub fn events(&self) -> io::Result<Vec<FileEvent>> {
        let mut buffer = Box::new_uninit_slice(AT_ONCE);
        let mut reader = Reader::new(&self.0, &mut buffer);
        let mut events = Vec::new();
        loop {
            match reader.next() {
                Ok(event) => events.push(FileEvent {
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

#[derive(Debug)]
struct EventFd(OwnedFd);

impl EventFd {
    fn new() -> io::Result<EventFd> {
        let flags = EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK;
        Ok(EventFd(rustix::event::eventfd(0, flags)?))
    }

    fn ring(&self) {
        // The write fails only if the counter is full. The bell has rung then.
        let _ = rustix::io::write(&self.0, &1_u64.to_ne_bytes());
    }

    fn wait(&self, kernel: Option<&Inotify>, rest: Duration) {
        let timeout = Timespec::try_from(rest).unwrap_or_default();
        let mut descriptors = vec![PollFd::new(&self.0, PollFlags::IN)];
        descriptors.extend(kernel.map(|it| PollFd::new(&it.0, PollFlags::IN)));
        match rustix::event::poll(&mut descriptors, Some(&timeout)) {
            Ok(_) | Err(Errno::INTR) => {}
            // No other way to wait is available. The pause prevents a busy loop.
            Err(_) => std::thread::sleep(rest.min(PAUSE)),
        }
        // The result does not matter, because the caller checks for orders anyway.
        let _ = rustix::io::read(&self.0, &mut [0_u8; 8]);
    }
}

/// Source of file events. In a simulation it is the kernel, too, but the simulation decides when
/// events arrive, and which are lost.
pub struct Kernel {
    inotify: Arc<Inotify>,
    simulation: Option<Arc<dyn Simulation>>,
}

impl fmt::Debug for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Kernel").field(&self.inotify).finish()
    }
}

impl Kernel {
    /// Opens the event queue.
    ///
    /// # Errors
    /// When the kernel provides none.
    pub fn open() -> io::Result<Kernel> {
        let kernel = Kernel {
            inotify: Arc::new(Inotify::open()?),
            simulation: current(),
        };
        if let Some(simulation) = &kernel.simulation {
            simulation.take_over(kernel.inotify.clone());
        }
        Ok(kernel)
    }

    /// Watches a directory and returns the number of the watch.
    ///
    /// # Errors
    /// The error of the system if the directory cannot be watched.
    pub fn watch(&self, directory: &Path) -> Result<i32, Errno> {
        self.inotify.watch(directory)
    }

    /// Removes a watch.
    pub fn forget(&self, watch: i32) {
        self.inotify.forget(watch);
    }

    /// Returns the pending events, at most a few hundred.
    ///
    /// # Errors
    /// The error of the system if the events cannot be read.
    pub fn events(&self) -> io::Result<Vec<FileEvent>> {
        match &self.simulation {
            Some(simulation) => Ok(simulation.file_events()),
            None => self.inotify.events(),
        }
    }
}

/// Wakes the thread that waits for events.
#[derive(Debug)]
pub struct Bell(Wake);

#[derive(Debug)]
enum Wake {
    System(EventFd),
    Simulated(Signal),
}

impl Bell {
    /// Creates a bell that has not rung.
    ///
    /// # Errors
    /// When no file descriptor is available.
    pub fn new() -> io::Result<Bell> {
        let Some(simulation) = current() else {
            return Ok(Bell(Wake::System(EventFd::new()?)));
        };
        let signal = Signal::default();
        simulation.bell(signal.clone());
        Ok(Bell(Wake::Simulated(signal)))
    }

    /// Wakes the waiting thread, or prevents its next wait.
    pub fn ring(&self) {
        match &self.0 {
            Wake::System(event) => event.ring(),
            Wake::Simulated(signal) => signal.store(true, Ordering::Relaxed),
        }
    }

    /// Waits until the bell rings, the kernel has events, or the time is over.
    pub fn wait(&self, kernel: Option<&Kernel>, rest: Duration) {
        let signal = match &self.0 {
            Wake::System(event) => return event.wait(kernel.map(|it| &*it.inotify), rest),
            Wake::Simulated(signal) => signal,
        };
        if let Some(simulation) = current().filter(|it| it.is_thread()) {
            simulation.wait(signal, Some(simulation.now() + rest));
            signal.store(false, Ordering::Relaxed);
        }
    }
}
