//! A broker's end of the bus with peers that only answer. The peers are separate processes of the
//! bench's own program.

use std::path::Path;
use std::process::{Child, Command};

use qcbus_bus::{Documents, Host, HostEvent, HostOptions, Instance, MappedImage, Peer, PeerEvent};
use qcbus_bus::{PeerId, PeerOptions};
use qcbus_document::FileKind;
use qcbus_messages::{
    Digest, DocId, DocumentRole, FromPeer, Hello, Job, JobDocument, JobId, Role, ToPeer,
};

use crate::Result;

const PLACE: &str = "QCBUS_BENCH_PLACE";

/// Creates a runtime like that of brokers and bundles.
///
/// # Errors
/// If the system has no descriptors left.
pub fn runtime() -> Result<tokio::runtime::Runtime> {
    let mut builder = tokio::runtime::Builder::new_current_thread();
    Ok(builder.enable_all().build()?)
}

/// Checks whether this process was started as a peer. If so, it answers until it is told to leave,
/// and returns `true`.
///
/// # Errors
/// If there is no broker.
pub fn was_started_as_peer() -> Result<bool> {
    let Some(place) = std::env::var_os(PLACE) else {
        return Ok(false);
    };
    runtime()?.block_on(answer(Path::new(&place)))?;
    Ok(true)
}

/// Runs a peer that reads the first and last byte and answers every job at once.
async fn answer(place: &Path) -> Result<()> {
    let instance = Instance::at(place.to_owned());
    let mut peer = Peer::join(&instance, hello(), PeerOptions::default()).await?;
    loop {
        match peer.next().await {
            PeerEvent::Message(ToPeer::Job(job)) => {
                let doc = job.documents[0].doc;
                let message = match peer.document(doc) {
                    Some(held) => FromPeer::JobDone {
                        job: job.job,
                        micros: held
                            .first()
                            .zip(held.last())
                            .map_or(0, |(a, b)| u64::from(a ^ b)),
                    },
                    None => FromPeer::NeedDocument { doc },
                };
                peer.forget(doc);
                peer.send(&message);
            }
            PeerEvent::Message(ToPeer::Drain) => {
                peer.leave().await;
                return Ok(());
            }
            PeerEvent::Closed { .. } => return Ok(()),
            _ => {}
        }
    }
}

fn hello() -> Hello {
    Hello {
        protocol: 0,
        role: Role::Bundle,
        name: format!("answers-{}", std::process::id()),
        version: "1".to_owned(),
        incarnation: u64::from(std::process::id()) << 20,
        pid: 0,
        launch: None,
        capacity: 8,
        threads: 1,
    }
}

/// A broker's end with joined peers.
pub struct Broker {
    /// The bus.
    pub host: Host,
    peers: Vec<PeerId>,
    children: Vec<Child>,
    _dir: tempfile::TempDir,
}

impl Broker {
    /// Starts the peers and waits until they have joined.
    ///
    /// # Errors
    /// If the bus or a process cannot be started.
    pub async fn with(peers: usize) -> Result<Broker> {
        let dir = tempfile::TempDir::new()?;
        let place = dir.path().join("i");
        let host = Host::start(&Instance::at(place.clone()), HostOptions::default())?;
        let mut broker = Broker {
            host,
            peers: Vec::new(),
            children: Vec::new(),
            _dir: dir,
        };
        for _ in 0..peers {
            let mut command = Command::new(std::env::current_exe()?);
            broker.children.push(command.env(PLACE, &place).spawn()?);
        }
        while broker.peers.len() < peers {
            if let HostEvent::Hello { peer, .. } = broker.host.next().await {
                let welcome = ToPeer::Welcome {
                    generation: broker.host.generation(),
                    config: Digest::default(),
                };
                broker.host.accept(peer, &welcome);
                broker.peers.push(peer);
            }
        }
        Ok(broker)
    }

    /// Sends every peer a job with a document.
    pub fn send_job(&mut self, number: u64) {
        let job = ToPeer::Job(Job {
            job: JobId(number),
            config: Digest::default(),
            kind: FileKind::Xodr,
            documents: vec![JobDocument {
                doc: DocId(number),
                role: DocumentRole::Root,
                path: "/farm/maps/town.xodr".to_owned(),
                digest: Digest::default(),
                referred_at: 0,
                links: Vec::new(),
            }],
            missing: Vec::new(),
        });
        for peer in &self.peers {
            self.host.send(*peer, &job);
        }
    }

    /// Returns the next job that a peer has ended.
    ///
    /// # Errors
    /// If a peer sends anything else, or has gone.
    pub async fn next_done(&mut self) -> Result<JobId> {
        match self.host.next().await {
            HostEvent::Message {
                message: FromPeer::JobDone { job, .. },
                ..
            } => Ok(job),
            other => Err(format!("not an answer: {other:?}").into()),
        }
    }

    /// Tells the peers to leave and waits for their end.
    ///
    /// # Errors
    /// If a process cannot be waited for.
    pub async fn end(mut self) -> Result<()> {
        for peer in &self.peers {
            self.host.send(*peer, &ToPeer::Drain);
        }
        let mut there = self.peers.len();
        while there > 0 {
            if let HostEvent::Gone { .. } = self.host.next().await {
                there -= 1;
            }
        }
        for child in &mut self.children {
            child.wait()?;
        }
        Ok(())
    }
}

/// Fills and publishes a document of this size in bytes.
///
/// # Errors
/// If there is no room.
pub fn publish(documents: &Documents, number: u64, bytes: usize) -> Result<MappedImage> {
    let mut loan = documents.loan(bytes)?;
    loan.fill(number as u8);
    Ok(loan.publish(DocId(number), bytes, Digest::default(), FileKind::Xodr)?)
}
