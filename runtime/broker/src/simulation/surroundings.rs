//! The bus, the control socket and the processes of the simulated broker.

use std::path::Path;
use std::sync::Arc;

use qcbus_bus::{Documents, HostEvent, HostOptions, Instance, PeerId, Process, StartError};
use qcbus_messages::control::{PeerStatus, SandboxStatus};
use qcbus_messages::{Digest, FromPeer, ToPeer};
use tokio::sync::mpsc::UnboundedSender;

use super::Simulation;
use super::threads::here;
use crate::control::Asked;
use crate::core::{ChildSpec, Event, Launch};
use crate::launches::Launches;
use crate::stale_children::StaleChildren;
use crate::supervise::{self, Surroundings};

fn simulation() -> Arc<Simulation> {
    here()
        .expect("in tests, a simulation starts the broker")
        .simulation
}

/// The broker's end of the bus.
pub struct Host {
    simulation: Arc<Simulation>,
    generation: u64,
}

impl Host {
    pub fn start(_: &Instance, _: HostOptions) -> Result<Host, StartError> {
        let simulation = simulation();
        let generation = simulation.world().generation;
        Ok(Host {
            simulation,
            generation,
        })
    }

    pub fn generation(&self) -> u64 {
        self.generation
    }

    pub async fn next(&mut self) -> HostEvent {
        std::future::pending().await
    }

    /// Takes the next event on the bus for the broker.
    pub fn take(&mut self) -> Option<HostEvent> {
        self.simulation.world().peers.words.pop_front()
    }

    pub fn has_words(&self) -> bool {
        !self.simulation.world().peers.words.is_empty()
    }

    pub fn accept(&mut self, peer: PeerId, _: &ToPeer) {
        self.simulation.world().peers.accepted(peer);
    }

    pub fn refuse(&mut self, peer: PeerId, _: &str) {
        self.simulation.world().peers.dropped(peer);
    }

    pub fn send(&mut self, peer: PeerId, message: &ToPeer) {
        let images = match message {
            ToPeer::Job(job) => self.simulation.images(job.job),
            _ => Vec::new(),
        };
        let now = self.simulation.now();
        self.simulation.world().told(peer, message, &images, now);
    }

    pub fn disconnect(&mut self, peer: PeerId) {
        self.simulation.world().peers.dropped(peer);
    }

    pub fn set_config(&mut self, _: Digest, _: &[u8]) {}

    pub fn loss(&self) -> Option<String> {
        None
    }

    pub fn end_with_process(self) -> bool {
        false
    }

    pub fn documents(&self) -> Documents {
        self.simulation.documents.clone()
    }
}

/// Control socket for commands.
pub struct ControlSocket;

impl ControlSocket {
    pub fn listen(_: &Path, inbox: UnboundedSender<Asked>) -> std::io::Result<ControlSocket> {
        simulation().world().asked = Some(inbox);
        Ok(ControlSocket)
    }

    pub async fn flush(&self) {}
}

/// The processes that the broker starts.
pub enum Children {
    Real(Box<supervise::Children>),
    Simulated(Arc<Simulation>),
}

impl Children {
    pub fn new(
        surroundings: Surroundings,
        launches: Launches,
        generation: u64,
        events: UnboundedSender<Event>,
    ) -> Children {
        let Some(here) = here() else {
            let real = supervise::Children::new(surroundings, launches, generation, events);
            return Children::Real(Box::new(real));
        };
        here.simulation.world().peers.exits = Some(events);
        Children::Simulated(here.simulation)
    }

    pub fn spawn(&mut self, launch: Launch, spec: &ChildSpec) {
        match self {
            Children::Real(real) => real.spawn(launch, spec),
            Children::Simulated(it) => it.world().peers.launched(launch, spec),
        }
    }

    pub fn start_early(&mut self, specs: &[ChildSpec]) {
        if let Children::Real(real) = self {
            real.start_early(specs);
        }
    }

    pub fn are_of(&self, generation: u64) -> bool {
        match self {
            Children::Real(real) => real.are_of(generation),
            Children::Simulated(_) => true,
        }
    }

    pub fn ended(&mut self, launch: Launch) {
        if let Children::Real(real) = self {
            real.ended(launch);
        }
    }

    pub fn joined(
        &mut self,
        launch: Launch,
        name: &str,
        process: Option<&Process>,
        proof: &str,
    ) -> Result<(), String> {
        match self {
            Children::Real(real) => real.joined(launch, name, process, proof),
            Children::Simulated(_) => Ok(()),
        }
    }

    pub fn kill(&self, launch: Launch) {
        let simulation = match self {
            Children::Real(real) => return real.kill(launch),
            Children::Simulated(simulation) => simulation,
        };
        let mut world = simulation.world();
        let Some(pid) = world.peers.pid_of(launch) else {
            return;
        };
        world.say(|| format!("  the broker kills process {pid}"));
        world.peers.dies(pid);
    }

    pub fn kill_what_they_started(&self) {
        if let Children::Real(real) = self {
            real.kill_what_they_started();
        }
    }

    pub fn forget_launches(&self) {
        if let Children::Real(real) = self {
            real.forget_launches();
        }
    }

    pub fn stale_children(&self) -> Option<StaleChildren> {
        match self {
            Children::Real(real) => real.stale_children(),
            Children::Simulated(_) => None,
        }
    }

    pub fn look_for_descendants(&self) {
        if let Children::Real(real) = self {
            real.look_for_descendants();
        }
    }

    pub fn sandbox_of(&self, peer: &PeerStatus) -> Option<SandboxStatus> {
        match self {
            Children::Real(real) => real.sandbox_of(peer),
            Children::Simulated(_) => None,
        }
    }

    pub fn final_output(&self, name: &str) -> Vec<String> {
        match self {
            Children::Real(real) => real.final_output(name),
            Children::Simulated(_) => Vec::new(),
        }
    }

    pub fn kill_all(&self) {
        if let Children::Real(real) = self {
            real.kill_all();
        }
    }

    pub fn bury_all(&self) {
        if let Children::Real(real) = self {
            real.bury_all();
        }
    }
}

/// Returns the bus event for a message of a process.
pub fn word(peer: PeerId, message: FromPeer) -> HostEvent {
    HostEvent::Message { peer, message }
}
