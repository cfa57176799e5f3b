//! The file events of the simulation: they are those of the real kernel, but the schedule decides
//! when events are passed on, or that they are lost.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use qcbus_environment::{FileEvent, Inotify, Signal};
use rustix::fs::inotify::ReadFlags;

/// Queue of kernel events of the simulation.
#[derive(Default)]
pub struct Telling {
    /// Real kernel that provides the events, if the broker has opened it.
    pub kernel: Option<Arc<Inotify>>,
    /// Events that are not passed on yet.
    waiting: VecDeque<FileEvent>,
    /// Events that are passed on but not read yet.
    pub told: Vec<FileEvent>,
    pub bell: Signal,
}

impl Telling {
    /// Takes over the real kernel's events about the latest changes.
    pub fn hear(&mut self) {
        let Some(kernel) = &self.kernel else { return };
        self.waiting
            .extend(kernel.events().expect("the kernel reports events"));
    }

    /// Drops the events about the latest changes: only the first `of` events stay.
    pub fn drop_new(&mut self, of: usize) {
        self.hear();
        self.waiting.truncate(of);
    }

    pub fn count(&mut self) -> usize {
        self.hear();
        self.waiting.len()
    }

    /// Simulates a full event queue of the kernel.
    pub fn overflow(&mut self) {
        self.hear();
        self.waiting.clear();
        if self.kernel.is_some() {
            self.waiting.push_back(FileEvent {
                watch: -1,
                what: ReadFlags::QUEUE_OVERFLOW,
                name: None,
            });
        }
    }

    /// Passes the next event on and returns its text.
    pub fn tell(&mut self) -> Option<String> {
        self.hear();
        let event = self.waiting.pop_front()?;
        let said = format!("{:?} {:?} of {}", event.what, event.name, event.watch);
        self.told.push(event);
        self.bell.store(true, Ordering::Relaxed);
        Some(said)
    }

    /// Drops all state because the broker is dead.
    pub fn forget(&mut self) {
        *self = Telling::default();
    }
}
