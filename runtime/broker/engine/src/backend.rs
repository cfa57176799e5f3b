//! The bus, the child processes and the control socket of a broker. By default they are those of the
//! system. A simulation replaces them.

use std::future::Future;
use std::io;
use std::path::Path;
use std::pin::Pin;

use qcbus_bus::{Documents, Host, HostEvent, HostOptions, Instance, PeerId, Process, StartError};
use qcbus_control::{Asked, ControlSocket};
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use qcbus_messages::{Digest, ToPeer};
use qcbus_supervise::launches::Launches;
use qcbus_supervise::stale_children::StaleChildren;
use qcbus_supervise::{Children, Surroundings};
use qcbus_types::{ChildSpec, Event, Launch};
use tokio::sync::mpsc::UnboundedSender;

/// Result of a function that waits.
pub type Waiting<'a, T> = Pin<Box<dyn Future<Output = T> + 'a>>;

/// Creates the parts of a broker that reach other processes.
pub trait Backend {
    /// Locks the instance and creates the broker's end of the bus.
    ///
    /// # Errors
    /// If another broker uses the instance, or the bus cannot be created.
    fn bus(&self, instance: &Instance, options: HostOptions) -> Result<Box<dyn Bus>, StartError>;

    /// Returns the starter of child processes. It reports their ends as events.
    fn children(
        &self,
        surroundings: Surroundings,
        launches: Launches,
        generation: u64,
        events: UnboundedSender<Event>,
    ) -> Box<dyn Processes>;

    /// Listens for commands in the directory of the instance.
    ///
    /// # Errors
    /// If the socket cannot be created.
    fn control(
        &self,
        directory: &Path,
        inbox: UnboundedSender<Asked>,
    ) -> io::Result<Box<dyn Control>>;
}

/// The broker's end of the bus; see [`Host`].
pub trait Bus {
    /// Returns the number of brokers that this instance has had.
    fn generation(&self) -> u64;
    /// Waits for the next event.
    fn next(&mut self) -> Waiting<'_, HostEvent>;
    /// Accepts a peer.
    fn accept(&mut self, peer: PeerId, welcome: &ToPeer);
    /// Refuses a peer, with the reason.
    fn refuse(&mut self, peer: PeerId, reason: &str);
    /// Sends a message to a peer.
    fn send(&mut self, peer: PeerId, message: &ToPeer);
    /// Ends the session of a peer.
    fn disconnect(&mut self, peer: PeerId);
    /// Publishes the configuration in force.
    fn set_config(&mut self, digest: Digest, bytes: &[u8]);
    /// Returns a loss of shared memory since the last call, as a text for the user.
    fn loss(&self) -> Option<String>;
    /// Returns the publisher of document images.
    fn documents(&self) -> Documents;
    /// Leaves the cleaning up to the end of the process. Returns whether that is possible.
    fn end_with_process(self: Box<Self>) -> bool;
}

/// The child processes of a broker; see [`Children`].
pub trait Processes {
    /// Starts a child.
    fn spawn(&mut self, launch: Launch, spec: &ChildSpec);
    /// Starts children before the state machine requests them.
    fn start_early(&mut self, specs: &[ChildSpec]);
    /// Checks whether the early children belong to this generation of the broker.
    fn are_of(&self, generation: u64) -> bool;
    /// Records the end of a child.
    fn ended(&mut self, launch: Launch);
    /// Checks a process that joins as a child.
    ///
    /// # Errors
    /// The reason why it is not this child.
    fn joined(
        &mut self,
        launch: Launch,
        name: &str,
        process: Option<&Process>,
        proof: &str,
    ) -> Result<(), String>;
    /// Kills a child.
    fn kill(&self, launch: Launch);
    /// Kills all children.
    fn kill_all(&self);
    /// Waits for the ends of killed children.
    fn bury_all(&self);
    /// Kills the processes that children have started.
    fn kill_descendants(&self);
    /// Removes the record of the launches.
    fn forget_launches(&self);
    /// Searches for processes that children have started.
    fn look_for_descendants(&self);
    /// Returns the children of earlier brokers, to end them.
    fn stale_children(&self) -> Option<StaleChildren>;
    /// Returns the state of the sandbox of a peer.
    fn sandbox_of(&self, peer: &PeerStatus) -> Option<SandboxStatus>;
    /// Returns the last lines that a child has printed.
    fn final_output(&self, name: &str) -> Vec<String>;
}

/// The socket for commands; see [`ControlSocket`].
pub trait Control {
    /// Waits until the given answers are written.
    fn flush(&self) -> Waiting<'_, ()>;
}

/// The system.
#[derive(Debug, Clone, Copy)]
pub struct System;

impl Backend for System {
    fn bus(&self, instance: &Instance, options: HostOptions) -> Result<Box<dyn Bus>, StartError> {
        Ok(Box::new(Host::start(instance, options)?))
    }

    fn children(
        &self,
        surroundings: Surroundings,
        launches: Launches,
        generation: u64,
        events: UnboundedSender<Event>,
    ) -> Box<dyn Processes> {
        Box::new(Children::new(surroundings, launches, generation, events))
    }

    fn control(
        &self,
        directory: &Path,
        inbox: UnboundedSender<Asked>,
    ) -> io::Result<Box<dyn Control>> {
        Ok(Box::new(ControlSocket::listen(directory, inbox)?))
    }
}

impl Bus for Host {
    fn generation(&self) -> u64 {
        self.generation()
    }

    fn next(&mut self) -> Waiting<'_, HostEvent> {
        Box::pin(self.next())
    }

    fn accept(&mut self, peer: PeerId, welcome: &ToPeer) {
        self.accept(peer, welcome);
    }

    fn refuse(&mut self, peer: PeerId, reason: &str) {
        self.refuse(peer, reason);
    }

    fn send(&mut self, peer: PeerId, message: &ToPeer) {
        self.send(peer, message);
    }

    fn disconnect(&mut self, peer: PeerId) {
        self.disconnect(peer);
    }

    fn set_config(&mut self, digest: Digest, bytes: &[u8]) {
        self.set_config(digest, bytes);
    }

    fn loss(&self) -> Option<String> {
        self.loss()
    }

    fn documents(&self) -> Documents {
        self.documents()
    }

    fn end_with_process(self: Box<Self>) -> bool {
        (*self).end_with_process()
    }
}

impl Processes for Children {
    fn spawn(&mut self, launch: Launch, spec: &ChildSpec) {
        self.spawn(launch, spec);
    }

    fn start_early(&mut self, specs: &[ChildSpec]) {
        self.start_early(specs);
    }

    fn are_of(&self, generation: u64) -> bool {
        self.are_of(generation)
    }

    fn ended(&mut self, launch: Launch) {
        self.ended(launch);
    }

    fn joined(
        &mut self,
        launch: Launch,
        name: &str,
        process: Option<&Process>,
        proof: &str,
    ) -> Result<(), String> {
        self.joined(launch, name, process, proof)
    }

    fn kill(&self, launch: Launch) {
        self.kill(launch);
    }

    fn kill_all(&self) {
        self.kill_all();
    }

    fn bury_all(&self) {
        self.bury_all();
    }

    fn kill_descendants(&self) {
        self.kill_descendants();
    }

    fn forget_launches(&self) {
        self.forget_launches();
    }

    fn look_for_descendants(&self) {
        self.look_for_descendants();
    }

    fn stale_children(&self) -> Option<StaleChildren> {
        self.stale_children()
    }

    fn sandbox_of(&self, peer: &PeerStatus) -> Option<SandboxStatus> {
        self.sandbox_of(peer)
    }

    fn final_output(&self, name: &str) -> Vec<String> {
        self.final_output(name)
    }
}

impl Control for ControlSocket {
    fn flush(&self) -> Waiting<'_, ()> {
        Box::pin(self.flush())
    }
}
