//! The bus, the control socket and the processes of the simulated broker.

use std::future::{pending, ready};
use std::io;
use std::path::Path;
use std::sync::Arc;

use qcbus_broker::backend::{Backend, Bus, Control, Processes, Waiting};
use qcbus_bus::{Documents, HostEvent, HostOptions, Instance, PeerId, Process, StartError};
use qcbus_control::Asked;
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use qcbus_messages::{Digest, FromPeer, ToPeer};
use qcbus_supervise::Surroundings;
use qcbus_supervise::launches::Launches;
use qcbus_supervise::stale_children::StaleChildren;
use qcbus_types::{ChildSpec, Event, Launch};
use tokio::sync::mpsc::UnboundedSender;

use super::Simulation;

/// The surroundings of a simulated broker.
pub struct Simulated(pub Arc<Simulation>);

impl Backend for Simulated {
    fn bus(&self, _: &Instance, _: HostOptions) -> Result<Box<dyn Bus>, StartError> {
        let generation = self.0.world().generation;
        Ok(Box::new(Host {
            simulation: self.0.clone(),
            generation,
        }))
    }

    fn children(
        &self,
        _: Surroundings,
        _: Launches,
        _: u64,
        events: UnboundedSender<Event>,
    ) -> Box<dyn Processes> {
        self.0.world().peers.exits = Some(events);
        Box::new(Children(self.0.clone()))
    }

    fn control(&self, _: &Path, inbox: UnboundedSender<Asked>) -> io::Result<Box<dyn Control>> {
        self.0.world().asked = Some(inbox);
        Ok(Box::new(ControlSocket))
    }
}

/// The broker's end of the bus.
struct Host {
    simulation: Arc<Simulation>,
    generation: u64,
}

impl Bus for Host {
    fn generation(&self) -> u64 {
        self.generation
    }

    fn next(&mut self) -> Waiting<'_, HostEvent> {
        match self.simulation.world().peers.words.pop_front() {
            Some(event) => Box::pin(ready(event)),
            None => Box::pin(pending()),
        }
    }

    fn accept(&mut self, peer: PeerId, _: &ToPeer) {
        self.simulation.world().peers.accepted(peer);
    }

    fn refuse(&mut self, peer: PeerId, _: &str) {
        self.simulation.world().peers.dropped(peer);
    }

    fn send(&mut self, peer: PeerId, message: &ToPeer) {
        let images = match message {
            ToPeer::Job(job) => self.simulation.images(job.job),
            _ => Vec::new(),
        };
        self.simulation.world().told(peer, message, &images);
    }

    fn disconnect(&mut self, peer: PeerId) {
        self.simulation.world().peers.dropped(peer);
    }

    fn set_config(&mut self, _: Digest, _: &[u8]) {}

    fn loss(&self) -> Option<String> {
        None
    }

    fn documents(&self) -> Documents {
        self.simulation.documents.clone()
    }

    fn end_with_process(self: Box<Self>) -> bool {
        false
    }
}

/// Control socket for commands.
struct ControlSocket;

impl Control for ControlSocket {
    fn flush(&self) -> Waiting<'_, ()> {
        Box::pin(ready(()))
    }
}

/// The processes that the broker starts.
struct Children(Arc<Simulation>);

impl Processes for Children {
    fn spawn(&mut self, launch: Launch, spec: &ChildSpec) {
        self.0.world().peers.launched(launch, spec);
    }

    fn start_early(&mut self, _: &[ChildSpec]) {}

    fn are_of(&self, _: u64) -> bool {
        true
    }

    fn ended(&mut self, _: Launch) {}

    fn joined(&mut self, _: Launch, _: &str, _: Option<&Process>, _: &str) -> Result<(), String> {
        Ok(())
    }

    fn kill(&self, launch: Launch) {
        let mut world = self.0.world();
        let Some(pid) = world.peers.pid_of(launch) else {
            return;
        };
        world.say(|| format!("  the broker kills process {pid}"));
        world.peers.dies(pid);
    }

    fn kill_all(&self) {}

    fn bury_all(&self) {}

    fn kill_descendants(&self) {}

    fn forget_launches(&self) {}

    fn look_for_descendants(&self) {}

    fn stale_children(&self) -> Option<StaleChildren> {
        None
    }

    fn sandbox_of(&self, _: &PeerStatus) -> Option<SandboxStatus> {
        None
    }

    fn final_output(&self, _: &str) -> Vec<String> {
        Vec::new()
    }
}

/// Returns the bus event for a message of a process.
pub fn word(peer: PeerId, message: FromPeer) -> HostEvent {
    HostEvent::Message { peer, message }
}
