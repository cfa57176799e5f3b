//! Turns of the main loop: each handles one input of one source.

use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use qcbus_bus::HostEvent;
use qcbus_control::Asked;
use qcbus_publish::store::Store;
use qcbus_state::State;
use qcbus_types::{Event, Notice};
use qcbus_watch::Seen;

use super::looks::Looked;
use super::{Broker, OperatorSignal, Ready};
use crate::intake::Intake;

/// One input of the loop.
pub enum Turn {
    /// An event on the bus.
    Bus(HostEvent),
    /// An event for the state machine.
    Event(Event),
    /// A report of the watcher.
    Seen(Seen),
    /// A command.
    Asked(Asked),
    /// A notice for the user.
    Notice(Notice),
    /// A result for a reporter.
    Delivery(Ready),
    /// A request of the operator.
    Signal(OperatorSignal),
    /// A file access that was made outside the loop.
    Looked(Looked),
    /// The timer.
    Tick,
}

/// Sources of the inputs, except for the bus, the operator and the timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Events for the state machine.
    Events,
    /// Reports of the watcher.
    Seen,
    /// Commands.
    Asked,
    /// File accesses that were made outside the loop.
    Looked,
    /// Notices for the user.
    Notices,
    /// Results for reporters.
    Deliveries,
}

impl Broker {
    /// Handles one input. Returns `false` at the end of the loop.
    pub fn turn(&mut self, turn: Turn) -> bool {
        match turn {
            Turn::Bus(event) => self.bus_event(event),
            Turn::Event(event) => self.own_event(event),
            Turn::Seen(seen) => self.seen(seen),
            Turn::Asked(asked) => self.asked(asked),
            Turn::Notice(notice) => {
                self.say(notice);
                true
            }
            Turn::Delivery(ready) => self.delivery(ready),
            Turn::Signal(OperatorSignal::Drain) => {
                self.notify_stopping();
                self.handle(Event::Drain)
            }
            Turn::Signal(OperatorSignal::Quit) => false,
            Turn::Signal(OperatorSignal::Reload) => {
                self.reload_on_signal();
                true
            }
            Turn::Looked(looked) => self.looked(looked),
            Turn::Tick => self.handle(Event::Tick),
        }
    }

    /// Returns the sources that have an input. A simulation chooses one of them.
    pub fn sources(&self) -> Vec<Source> {
        let all = [
            (!self.inbox.events.is_empty(), Source::Events),
            (!self.inbox.seen.is_empty(), Source::Seen),
            (!self.inbox.asked.is_empty(), Source::Asked),
            (!self.inbox.looked.is_empty(), Source::Looked),
            (!self.inbox.notices.is_empty(), Source::Notices),
            (!self.inbox.deliveries.is_empty(), Source::Deliveries),
        ];
        let with_input = all.into_iter().filter(|(has_input, _)| *has_input);
        with_input.map(|(_, source)| source).collect()
    }

    /// Takes the next input of a source.
    pub fn take(&mut self, source: Source) -> Option<Turn> {
        match source {
            Source::Events => self.inbox.events.try_recv().ok().map(Turn::Event),
            Source::Seen => self.inbox.seen.try_recv().ok().map(Turn::Seen),
            Source::Asked => self.inbox.asked.try_recv().ok().map(Turn::Asked),
            Source::Looked => self.inbox.looked.try_recv().ok().map(Turn::Looked),
            Source::Notices => self.inbox.notices.try_recv().ok().map(Turn::Notice),
            Source::Deliveries => self.inbox.deliveries.try_recv().ok().map(Turn::Delivery),
        }
    }

    /// Takes the next event on the bus, if there is one.
    pub fn take_from_bus(&mut self) -> Option<Turn> {
        let mut next = self.host.next();
        match next.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(event) => Some(Turn::Bus(event)),
            Poll::Pending => None,
        }
    }

    /// Returns the state machine.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Returns the reader of files, which maps them for bundles.
    pub fn intake(&self) -> Arc<Intake> {
        self.intake.clone()
    }

    /// Returns the store of the results.
    pub fn store(&self) -> Arc<Store> {
        self.store.clone()
    }

    /// Begins the loop: starts the children.
    pub fn begin(&mut self) {
        let specs = self.loaded.children.clone();
        self.handle(Event::Children { specs });
    }
}
