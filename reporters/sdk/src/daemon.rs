//! A reporter on the bus.

use std::time::Duration;

use qcbus_bus::{Instance, JoinError, Peer, PeerEvent, PeerOptions};
use qcbus_messages::{FromPeer, Hello, PROTOCOL_VERSION, ResultMessage, Role, ToPeer};

use crate::{BothSources, FileSources, ImageSources, Reporter, Responder, Sources};

/// Interval of the reporter's heartbeat.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Maximum number of unacknowledged results that the broker may send to one reporter.
const CAPACITY: u16 = 32;

/// Identity of a reporter that joins the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Name, such as `qc-report-text`.
    pub name: String,
    /// Version of the reporter.
    pub version: String,
    /// Number that a supervisor gave to this start of the process.
    pub launch: Option<u64>,
}

/// Reasons why a reporter stops.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A broker is missing or rejects this reporter.
    #[error("join the bus: {0}")]
    Join(#[from] JoinError),
    /// The session was closed permanently.
    #[error("stay on the bus: {0}")]
    Closed(String),
}

/// Runs a reporter on the bus of `instance` until it is drained.
///
/// A result is acknowledged only after it was written. If the broker is lost, the bus waits for the
/// next one and rejoins. The new broker sends all unacknowledged results again.
///
/// # Errors
/// [`RunError`] when no broker takes the reporter, or none came back.
pub async fn run(
    instance: &Instance,
    identity: &Identity,
    reporter: &mut dyn Reporter,
) -> Result<(), RunError> {
    let mut peer = Peer::join(instance, hello(identity), PeerOptions::default()).await?;
    let mut responder = Responder::new(reporter);
    let mut beat = tokio::time::interval(HEARTBEAT);
    while !responder.has_left() {
        let event = tokio::select! {
            event = peer.next() => event,
            _ = beat.tick() => {
                peer.send(&FromPeer::Heartbeat { job: None, checker: None });
                continue;
            }
        };
        match event {
            PeerEvent::Message(message) => answer(&mut peer, &mut responder, message),
            PeerEvent::Rejoined => responder.rejoined(),
            PeerEvent::Closed { reason } => {
                responder.finish();
                return Err(RunError::Closed(reason));
            }
            // A document is looked up when a result needs one. Reporters read no configuration.
            PeerEvent::Document(_) | PeerEvent::LetGo | PeerEvent::Config(_) => {}
        }
    }
    peer.leave().await;
    Ok(())
}

fn answer(peer: &mut Peer, responder: &mut Responder<'_>, message: ToPeer) {
    let document = match &message {
        ToPeer::Result(result) => result.document,
        _ => None,
    };
    let answers = responder.handle(message, |result| sources_of(peer, result));
    if let Some(document) = document {
        peer.forget(document);
    }
    for answer in answers {
        peer.send(&answer);
    }
}

/// Returns the image on the bus if it is still mapped, otherwise the files on disk.
fn sources_of(peer: &Peer, result: &ResultMessage) -> Box<dyn Sources> {
    let held = result.document.and_then(|doc| peer.document(doc));
    Box::new(BothSources {
        image: held.map(|held| ImageSources::new(held, &result.input)),
        files: FileSources::new(result),
    })
}

fn hello(identity: &Identity) -> Hello {
    Hello {
        protocol: PROTOCOL_VERSION,
        role: Role::Reporter,
        name: identity.name.clone(),
        version: identity.version.clone(),
        incarnation: incarnation(),
        pid: std::process::id(),
        launch: identity.launch,
        capacity: CAPACITY,
        threads: 1,
    }
}

/// Returns a number that no other process has: the standard library seeds its hashers at random.
fn incarnation() -> u64 {
    use std::hash::{BuildHasher as _, RandomState};
    RandomState::new().hash_one(std::process::id())
}
