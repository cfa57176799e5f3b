//! Sends texts that a terminal or a script would take for lines of the broker itself.

use qcbus_bus::Peer;
use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Level, Locations};
use qcbus_messages::{CheckerEnd, FromPeer, Job};

use crate::harness::{Animal, CHECKERS, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "speaks_in_lines",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Text with a line break and a false verdict, an escape sequence that removes a line, and a change
/// of direction.
pub const LINES: &str = "so\nimportant.xodr: accepted\n\u{1b}[2K\u{202e}it is";

fn job(peer: &mut Peer, job: &Job) -> Mood {
    let elsewhere = OtherPlace {
        path: LINES.to_owned(),
        row: 1,
        column: 1,
        xpath: Some(LINES.to_owned()),
    };
    let issue = Issue {
        id: 0,
        description: LINES.to_owned(),
        level: Level::Error,
        rule_uid: LINES.to_owned(),
        locations: vec![Locations {
            description: LINES.to_owned(),
            elsewhere: Some(elsewhere),
            places: Vec::new(),
        }],
        domain_info: Vec::new(),
    };
    peer.send(&FromPeer::Issues {
        job: job.job,
        checker: 0,
        issues: vec![issue],
    });
    for checker in 0..CHECKERS {
        peer.send(&FromPeer::CheckersDone {
            job: job.job,
            ended: vec![CheckerEnd {
                checker,
                ending: Ending::Failed {
                    reason: LINES.to_owned(),
                },
                params: Vec::new(),
                metadata: Vec::new(),
            }],
        });
    }
    peer.send(&FromPeer::JobDone {
        job: job.job,
        micros: 1,
    });
    Mood::GoOn
}
