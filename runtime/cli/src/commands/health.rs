//! `qcbus status --health`: reports to scripts and service managers whether a broker needs
//! attention.

use std::collections::BTreeMap;

use qcbus_messages::control::{NoticeStatus, PeerStatus, Status};
use qcbus_messages::{Exit, shown};

/// Time in seconds within which a failure may still persist. A persistent failure is reported more
/// often.
const RECENT_S: u64 = 60;

/// Maximum number of unreadable paths that are listed.
const NAMED: usize = 5;

/// Formats one line that says whether the broker is healthy, then one line for each reason why not.
pub fn render(reasons: &[String]) -> String {
    if reasons.is_empty() {
        return "healthy\n".to_owned();
    }
    let lines = reasons.iter().map(|it| format!("{}\n", shown::line(it)));
    std::iter::once("not healthy\n".to_owned())
        .chain(lines)
        .collect()
}

/// Returns the exit code of the command.
pub fn exit(reasons: &[String]) -> Exit {
    match reasons {
        [] => Exit::Accepted,
        _ => Exit::Rejected,
    }
}

/// Returns the reasons why a broker needs attention. The list is empty for a healthy broker.
pub fn reasons(status: &Status) -> Vec<String> {
    let mut reasons = status.troubles.clone();
    reasons.extend(status.peers.iter().filter_map(of_peer));
    let unseen = status.unseen.iter().take(NAMED).map(|it| it.to_string());
    reasons.extend(unseen);
    if let Some(more) = status.unseen.len().checked_sub(NAMED).filter(|it| *it > 0) {
        reasons.push(format!("{more} more cannot be read"));
    }
    let mut told: BTreeMap<&str, u64> = BTreeMap::new();
    for notice in status.notices.iter().filter(|it| is_failure(it)) {
        // A repeated attempt repeats its notice; only the latest one counts.
        let ago_s = told.entry(&notice.text).or_insert(notice.ago_s);
        *ago_s = notice.ago_s.min(*ago_s);
    }
    let told = told.into_iter();
    reasons.extend(told.map(|(text, ago_s)| format!("{text} ({ago_s} s ago)")));
    if status.watching.is_empty() {
        reasons.push("no directory is watched".to_owned());
    }
    reasons
}

/// Returns the problem of a peer. Without a working bundle no file is accepted; without a reporter
/// its reports are missing.
fn of_peer(peer: &PeerStatus) -> Option<String> {
    let PeerStatus {
        role, name, note, ..
    } = peer;
    let what = match peer.state.as_str() {
        "down" => "is down",
        "gave up" => "failed too often and is not restarted for a while",
        "silent" => "has work but does not respond",
        "starting" => "is starting",
        _ if peer.unreported > 0 => "cannot report",
        _ => return None,
    };
    let why = match note.is_empty() {
        true => String::new(),
        false => format!(": {note}"),
    };
    Some(format!("{role} {name} {what}{why}"))
}

/// Checks whether a notice says that something cannot be read, written or given room. For other
/// failures the status itself shows the current state.
fn is_failure(notice: &NoticeStatus) -> bool {
    match notice.kind.as_str() {
        // A loss remains until the broker is restarted.
        "lost" => true,
        "no-room" | "not-read" | "not-written" | "not-delivered" => notice.ago_s <= RECENT_S,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use qcbus_messages::control::Unseen;

    fn status() -> Status {
        Status {
            watching: vec!["/farm/in".into()],
            ..Status::default()
        }
    }

    fn peer(state: &str, unreported: u64) -> PeerStatus {
        PeerStatus {
            name: "acme".into(),
            role: "bundle".into(),
            state: state.into(),
            note: "killed by signal 9".into(),
            unreported,
            ..PeerStatus::default()
        }
    }

    fn of_one(peer: PeerStatus) -> Vec<String> {
        reasons(&Status {
            peers: vec![peer],
            ..status()
        })
    }

    #[test]
    fn broker_is_healthy_while_its_bundles_work() {
        for state in ["ready", "busy", "draining"] {
            assert!(of_one(peer(state, 0)).is_empty(), "{state}");
        }
        assert_eq!(render(&[]), "healthy\n");
        assert_eq!(exit(&[]), Exit::Accepted);
    }

    #[test]
    fn each_health_problem_is_one_line() {
        for state in ["down", "gave up", "silent", "starting"] {
            assert_eq!(of_one(peer(state, 0)).len(), 1, "{state}");
        }
        let found = of_one(peer("ready", 2));
        assert_eq!(found, ["bundle acme cannot report: killed by signal 9"]);
        assert_eq!(exit(&found), Exit::Rejected);
        let text = render(&found);
        assert_eq!(text.lines().next(), Some("not healthy"));
        assert_eq!(text.lines().count(), 2);
    }

    #[test]
    fn only_recent_problem_notices_count() {
        let notice = |kind: &str, ago_s| NoticeStatus {
            kind: kind.into(),
            text: "no space left".into(),
            ago_s,
            about: None,
        };
        let told = |notice| {
            reasons(&Status {
                notices: vec![notice],
                ..status()
            })
        };
        assert_eq!(told(notice("not-written", 3)), ["no space left (3 s ago)"]);
        assert!(told(notice("not-written", 3600)).is_empty());
        let tried_again = reasons(&Status {
            notices: [9, 5, 7].map(|ago_s| notice("not-written", ago_s)).into(),
            ..status()
        });
        assert_eq!(tried_again, ["no space left (5 s ago)"]);
        assert!(told(notice("held-back", 3)).is_empty());
    }

    #[test]
    fn many_unseen_entries_become_few_lines() {
        let one = |number: u32| Unseen {
            path: format!("/farm/in/{number}").into(),
            why: "Permission denied".into(),
        };
        let found = reasons(&Status {
            unseen: (0..20).map(one).collect(),
            ..status()
        });
        assert_eq!(found.len(), NAMED + 1);
        assert_eq!(found[NAMED], "15 more cannot be read");
    }
}
