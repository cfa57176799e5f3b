//! Reports an error in every file with the word [`MARK`] in one of its parts: the file itself, its
//! includes, its map, its catalogs.

use qcbus_bus::Peer;
use qcbus_formats::xqar::{Issue, Level};
use qcbus_messages::{FromPeer, Job};

use crate::harness::{Animal, GOOD, Manners, Mood, answer};

/// Word that it rejects.
pub const MARK: &str = "forbidden";

pub(super) const ANIMAL: Animal = Animal {
    name: "judges_strictly",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(peer: &mut Peer, job: &Job) -> Mood {
    let marked = job.documents.iter().filter(|it| is_marked(peer, it.doc));
    let issues: Vec<Issue> = marked.map(|it| issue(&it.path)).collect();
    if !issues.is_empty() {
        peer.send(&FromPeer::Issues {
            job: job.job,
            checker: 0,
            issues,
        });
    }
    answer(peer, job.job);
    Mood::GoOn
}

fn is_marked(peer: &Peer, document: qcbus_messages::DocId) -> bool {
    let marked = |bytes: &[u8]| bytes.windows(MARK.len()).any(|it| it == MARK.as_bytes());
    peer.document(document).is_some_and(|image| marked(&image))
}

fn issue(path: &str) -> Issue {
    Issue {
        id: 0,
        description: format!("`{MARK}` in {path}"),
        level: Level::Error,
        rule_uid: "example.org:xodr:1.0.0:zoo.0".to_owned(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}
