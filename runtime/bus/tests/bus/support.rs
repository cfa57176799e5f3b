//! Instances in directories of their own, and waiting with a watchdog.

use std::future::Future;
use std::time::Duration;

use qcbus_bus::{Host, HostEvent, HostOptions, Instance, Peer, PeerEvent, PeerId, PeerOptions};
use qcbus_document::FileKind;
use qcbus_formats::xqar::Level;
use qcbus_messages::{
    Absence, CheckerEnd, Digest, DocumentRole, FromPeer, Hello, Job, JobId, MissingDocument, Role,
    ToPeer,
};
use tempfile::TempDir;

/// Limit that is longer than anything takes on the slowest machine. Only a hang reaches it.
pub const WATCHDOG: Duration = Duration::from_secs(60);

/// Own directory of an instance.
pub struct Site {
    _dir: Option<TempDir>,
    pub instance: Instance,
}

impl Site {
    pub fn new() -> Site {
        let dir = TempDir::new().unwrap();
        let instance = Instance::at(dir.path().join("i"));
        Site {
            _dir: Some(dir),
            instance,
        }
    }

    /// Uses a directory that was created by someone else.
    pub fn at(instance: &Instance) -> Site {
        Site {
            _dir: None,
            instance: instance.clone(),
        }
    }

    pub fn host(&self) -> Host {
        Host::start(&self.instance, HostOptions::default()).unwrap()
    }
}

/// Runs a test on a runtime like the broker's.
pub fn run(test: impl Future<Output = ()>) {
    run_forever(watched(test));
}

pub fn run_forever(test: impl Future<Output = ()>) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(test);
}

/// Panics if something never happens.
pub async fn watched<T>(future: impl Future<Output = T>) -> T {
    tokio::time::timeout(WATCHDOG, future)
        .await
        .expect("watchdog timeout: this did not happen")
}

pub fn hello(name: &str) -> Hello {
    Hello {
        protocol: 0,
        role: Role::Bundle,
        name: name.to_owned(),
        version: "1.0".to_owned(),
        incarnation: fresh_number(),
        pid: 0,
        launch: None,
        capacity: 4,
        threads: 1,
    }
}

pub fn fresh_number() -> u64 {
    use std::hash::{BuildHasher, RandomState};
    RandomState::new().hash_one(0)
}

pub fn welcome(host: &Host) -> ToPeer {
    ToPeer::Welcome {
        generation: host.generation(),
        config: Digest::default(),
    }
}

/// Joins a peer of this process while the host is served.
pub async fn join(host: &mut Host, site: &Site, name: &str) -> (PeerId, Peer) {
    join_with(host, site, name, PeerOptions::default()).await
}

pub async fn join_with(
    host: &mut Host,
    site: &Site,
    name: &str,
    options: PeerOptions,
) -> (PeerId, Peer) {
    let joining = Peer::join(&site.instance, hello(name), options);
    tokio::pin!(joining);
    let mut id = None;
    let mut peer = loop {
        tokio::select! {
            joined = &mut joining => break joined.unwrap(),
            event = host.next() => {
                if let HostEvent::Hello { peer, .. } = event {
                    let welcome = welcome(host);
                    host.accept(peer, &welcome);
                    id = Some(peer);
                }
            }
        }
    };
    let first = peer.next().await;
    assert!(
        matches!(first, PeerEvent::Message(ToPeer::Welcome { .. })),
        "{first:?}"
    );
    (id.unwrap(), peer)
}

/// Creates a message with a size and content that follow from `number` and `len`.
pub fn numbered(number: u64, len: usize) -> FromPeer {
    FromPeer::CheckersDone {
        job: JobId(number),
        ended: vec![CheckerEnd {
            checker: 0,
            ending: qcbus_formats::pool::Ending::Failed {
                reason: char::from(b'a' + (number % 26) as u8)
                    .to_string()
                    .repeat(len),
            },
            params: Vec::new(),
            metadata: Vec::new(),
        }],
    }
}

/// Creates a message to a peer of about `len` bytes that contains its number.
pub fn numbered_job(number: u64, len: usize) -> ToPeer {
    ToPeer::Job(Job {
        job: JobId(number),
        config: Digest::default(),
        kind: FileKind::Xodr,
        documents: Vec::new(),
        missing: vec![MissingDocument {
            role: DocumentRole::Map,
            reference: "x".repeat(len),
            path: String::new(),
            why: Absence::NotThere,
            level: Level::Error,
            within: None,
            referred_at: 0,
        }],
    })
}

/// Returns the names of this instance's shared memory, as long as a broker exists.
pub fn shared_memory_of(instance: &Instance) -> Vec<String> {
    let identity = std::fs::read_to_string(instance.dir().join("id")).unwrap();
    shared_memory_named(&identity)
}

pub fn shared_memory_named(identity: &str) -> Vec<String> {
    std::fs::read_dir("/dev/shm")
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().into_string().ok())
        .filter(|name| name.contains(identity))
        .collect()
}

pub fn identity_of(instance: &Instance) -> String {
    std::fs::read_to_string(instance.dir().join("id")).unwrap()
}

/// Returns the names in the instance's directory.
pub fn files_of(instance: &Instance) -> Vec<String> {
    std::fs::read_dir(instance.dir())
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().into_string().ok())
        .collect()
}

/// Checks whether all bytes are this one. Comparing pages is fast without optimisation.
pub fn is_uniform(bytes: &[u8], byte: u8) -> bool {
    let page = [byte; 4096];
    bytes
        .chunks(page.len())
        .all(|chunk| *chunk == page[..chunk.len()])
}

/// Checks whether /dev/shm has room for a test, and reports it if not.
pub fn has_room(bytes: u64) -> bool {
    let stat = rustix::fs::statvfs("/dev/shm").unwrap();
    let enough = stat.f_bavail * stat.f_frsize > bytes;
    if !enough {
        println!("skipped: /dev/shm has less than {bytes} bytes free");
    }
    enough
}
