//! Tests of the models that a bundle caches for a map from one job to the next.

use crate::common;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use qcbus_bus::{Host, HostEvent, HostOptions, Instance, PeerId};
use qcbus_document::{Document, FileKind, Image};
use qcbus_formats::config::Config;
use qcbus_messages::{
    Digest, DocId, DocumentRole, FromPeer, Job, JobDocument, JobId, ToPeer, codec,
};
use qcbus_sdk::run::BusOptions;
use qcbus_sdk::{Bundle, Exit, LinkedModel, Loaded, Mode, Plan, Rule, Sink, examine};

/// The first road of a map, and the number of models of such a map that were built before.
struct FirstRoad {
    id: String,
    before: usize,
}

static BUILT: Mutex<BTreeMap<String, usize>> = Mutex::new(BTreeMap::new());

impl LinkedModel for FirstRoad {
    fn build(image: Image) -> Option<FirstRoad> {
        let road = image.document().ok()?.elements("road").next()?;
        let id = road.attr("id")?.to_owned();
        let mut built = BUILT.lock().unwrap();
        let count = built.entry(id.clone()).or_default();
        *count += 1;
        let before = *count - 1;
        Some(FirstRoad { id, before })
    }
}

fn tell(_: &Document<'_>, found: &mut Sink<'_>) {
    let subject = found.subject();
    let Some(root) = subject.root().root() else {
        return;
    };
    let maps: Vec<_> = subject.with_role(DocumentRole::Map).cloned().collect();
    for map in maps {
        match map.cached::<FirstRoad>() {
            Some(road) => found.issue(root, format!("{}, {} before", road.id, road.before)),
            None => found.issue(root, "no road"),
        };
    }
}

static FIRST: Rule<Document> = Rule {
    id: "first",
    uids: &["x:xosc:1.0.0:a.b"],
    run: tell,
    ..Rule::DEFAULTS
};
static SECOND: Rule<Document> = Rule {
    id: "second",
    uids: &["x:xosc:1.0.0:a.c"],
    run: tell,
    ..Rule::DEFAULTS
};
static FAILS: Rule<Document> = Rule {
    id: "fails",
    uids: &["x:xosc:1.0.0:a.d"],
    run: |document, _| {
        if document
            .root()
            .is_some_and(|root| root.attr("fails").is_some())
        {
            panic!("on purpose");
        }
    },
    ..Rule::DEFAULTS
};
static BUNDLE: Bundle = Bundle {
    kinds: &[FileKind::Xosc],
    rules: &[&FIRST, &SECOND, &FAILS],
    ..common::BUNDLE
};

const CONFIG: Digest = Digest([7; 32]);

/// Returns a map that is large enough to be cached.
fn map(first: &str) -> String {
    let mut text = format!("<OpenDRIVE><header/><road id='{first}'/>");
    for number in 0..20_000 {
        write!(text, "<road id='{number}'/>").unwrap();
    }
    text + "</OpenDRIVE>"
}

const ROOT: &str = "<OpenSCENARIO/>";
const BAD_ROOT: &str = "<OpenSCENARIO fails='1'/>";

/// A test broker.
struct Broker {
    host: Host,
    peer: PeerId,
    jobs: u64,
    docs: u64,
}

impl Broker {
    async fn meet(mut host: Host) -> Broker {
        loop {
            match host.next().await {
                HostEvent::Hello { peer, .. } => {
                    let generation = host.generation();
                    let config = CONFIG;
                    host.accept(peer, &ToPeer::Welcome { generation, config });
                }
                HostEvent::Message { peer, message } => {
                    if let FromPeer::Catalogue(_) = message {
                        return Broker {
                            host,
                            peer,
                            jobs: 0,
                            docs: 0,
                        };
                    }
                }
                other => panic!("{other:?}"),
            }
        }
    }

    fn publish(&mut self, kind: FileKind, text: &str) -> DocId {
        self.docs += 1;
        let doc = DocId(self.docs);
        let path = Path::new("/a").with_extension(kind.as_str());
        let limits = qcbus_ingest::Limits::default();
        let prepared = qcbus_ingest::prepare_bytes(&path, text.as_bytes().to_vec(), &limits);
        let image = prepared.build();
        let mut loan = self.host.documents().loan(image.len()).unwrap();
        loan[..image.len()].copy_from_slice(&image);
        // All documents have the same digest, because it does not identify them.
        let digest = Digest([1; 32]);
        drop(loan.publish(doc, image.len(), digest, kind).unwrap());
        doc
    }

    /// Returns the findings of the rules for a scenario on this map.
    async fn check(&mut self, root: &str, map: DocId) -> Vec<String> {
        self.jobs += 1;
        let document = |doc, role| JobDocument {
            doc,
            role,
            path: "/a".to_owned(),
            digest: Digest([1; 32]),
            referred_at: 0,
            links: Vec::new(),
        };
        let root = self.publish(FileKind::Xosc, root);
        let job = Job {
            job: JobId(self.jobs),
            config: CONFIG,
            kind: FileKind::Xosc,
            documents: vec![
                document(root, DocumentRole::Root),
                document(map, DocumentRole::Map),
            ],
            missing: Vec::new(),
        };
        self.host.send(self.peer, &ToPeer::Job(job));
        let mut said = Vec::new();
        loop {
            match self.host.next().await {
                HostEvent::Message { message, .. } => match message {
                    FromPeer::Issues { issues, .. } => {
                        said.extend(issues.into_iter().map(|issue| issue.description));
                    }
                    FromPeer::JobDone { .. } => return said,
                    FromPeer::NeedDocument { doc } => panic!("{doc:?} must be available"),
                    _ => {}
                },
                other => panic!("{other:?}"),
            }
        }
    }
}

#[test]
fn jobs_share_map_model_until_map_changes() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("instance");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    let daemon = runtime.block_on(async {
        let mut host = Host::start(&Instance::at(dir.clone()), HostOptions::default()).unwrap();
        host.set_config(CONFIG, &codec::encode(&None::<Config>).unwrap());
        let options = BusOptions {
            instance_dir: Some(dir),
            ..BusOptions::default()
        };
        let daemon = std::thread::spawn(move || qcbus_sdk::run(&BUNDLE, Mode::Bus(options)));
        let talk = tokio::time::timeout(Duration::from_secs(60), talk(host));
        let mut broker = talk.await.expect("the bundle answers");
        broker.host.send(broker.peer, &ToPeer::Drain);
        while !daemon.is_finished() {
            let _ = tokio::time::timeout(Duration::from_millis(20), broker.host.next()).await;
        }
        daemon
    });
    assert_eq!(daemon.join().unwrap(), Exit::Accepted);
}

async fn talk(host: Host) -> Broker {
    let mut broker = Broker::meet(host).await;
    let twice = |text: &str| vec![text.to_owned(); 2];
    let town = broker.publish(FileKind::Xodr, &map("a"));
    for _ in 0..3 {
        assert_eq!(broker.check(ROOT, town).await, twice("a, 0 before"));
    }
    // The map has changed, so the findings change, too.
    let changed = broker.publish(FileKind::Xodr, &map("b"));
    for _ in 0..2 {
        assert_eq!(broker.check(ROOT, changed).await, twice("b, 0 before"));
    }
    // The earlier map is still cached for another scenario.
    assert_eq!(broker.check(ROOT, town).await, twice("a, 0 before"));
    // A cached model is dropped after a rule has panicked.
    broker.check(BAD_ROOT, town).await;
    assert_eq!(broker.check(ROOT, town).await, twice("a, 1 before"));
    let empty = broker.publish(FileKind::Xodr, "<OpenDRIVE/>");
    assert_eq!(broker.check(ROOT, empty).await, twice("no road"));
    broker
}

#[test]
fn rules_of_standalone_check_share_model() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xosc");
    let text =
        "<OpenSCENARIO><RoadNetwork><LogicFile filepath='town.xodr'/></RoadNetwork></OpenSCENARIO>";
    std::fs::write(&path, text).unwrap();
    let town = "<OpenDRIVE><header/><road id='town'/></OpenDRIVE>";
    std::fs::write(folder.path().join("town.xodr"), town).unwrap();
    let loaded = Loaded::from_path(&path, folder.path()).unwrap();
    let outcome = examine(&Plan::by_default(&BUNDLE), &loaded).unwrap();
    for checker in &outcome.checkers[..2] {
        assert_eq!(checker.issues[0].description, "town, 0 before");
    }
}
