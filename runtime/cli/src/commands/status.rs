//! `qcbus status`.

use std::fmt::Write;

use qcbus_messages::Exit;
use qcbus_messages::control::{GateStatus, PeerStatus, Request, Response, Status};
use qcbus_messages::path_text::to_text;
use qcbus_messages::shown;

use super::{health, remote::ask};
use crate::args::StatusArgs;
use crate::talk;

/// Runs the command.
pub fn run(args: &StatusArgs) -> Exit {
    let status = match ask(&args.instance, &Request::Status) {
        Ok(Response::Status(status)) => status,
        Ok(other) => {
            talk::fail(&format!("unexpected answer from the broker: {other:?}"));
            return Exit::Internal;
        }
        // The broker runs but does not answer. The error has already been printed.
        Err(Exit::Internal) if args.health => return Exit::Rejected,
        Err(exit) => return exit,
    };
    if args.health {
        let reasons = health::reasons(&status);
        talk::print(&health::render(&reasons));
        return health::exit(&reasons);
    }
    if args.json {
        match serde_json::to_string_pretty(&status) {
            Ok(text) => talk::print(&format!("{text}\n")),
            Err(error) => {
                talk::fail(&error.to_string());
                return Exit::Internal;
            }
        }
    } else {
        talk::print(&render(&status));
    }
    Exit::Accepted
}

/// Formats the status for people.
pub fn render(status: &Status) -> String {
    let mut text = String::new();
    let files = &status.files;
    let queue = &status.queue;
    let mut line = |what: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{what:<10} {}", shown::line(&value));
    };
    line(
        "broker",
        format!(
            "instance `{}`, qcbus {}, process {}, up {}",
            status.instance,
            status.version,
            status.pid,
            span(status.uptime_s as f64)
        ),
    );
    for (number, directory) in status.watching.iter().enumerate() {
        let mode = if number == 0 {
            format!(" ({})", status.watch_mode)
        } else {
            String::new()
        };
        line("watching", format!("{}{mode}", to_text(directory)));
    }
    line("results", to_text(&status.out));
    if let Some(gate) = &status.gate {
        line("gate", gate_line(gate));
        for held in &gate.examples {
            line(
                "held back",
                format!("{}: {}", to_text(&held.file), held.why),
            );
        }
    }
    line(
        "files",
        format!(
            "{}: {} accepted, {} rejected, {} undetermined, {} without a verdict",
            files.total,
            files.accepted,
            files.rejected,
            files.undetermined,
            files.total - files.judged
        ),
    );
    line("queue", queue_line(queue));
    for peer in &status.peers {
        line(&shown::line(&peer.role), peer_line(peer));
    }
    if let Some(replaced) = &status.replaced {
        line("note", replaced.clone());
    }
    for unseen in status.unseen.iter().take(5) {
        line("note", unseen.to_string());
    }
    if let Some(more) = status.unseen.len().checked_sub(5).filter(|it| *it > 0) {
        line("note", format!("and {more} more that cannot be read"));
    }
    for unfinished in status.unfinished.iter().take(5) {
        line("note", unfinished.to_string());
    }
    if let Some(more) = status.unfinished.len().checked_sub(5).filter(|it| *it > 0) {
        line("note", format!("and {more} more that are being written"));
    }
    // Current unseen files are listed above; older notices about them are outdated.
    let notices = status.notices.iter().filter(|it| it.kind != "unseen");
    for notice in notices.rev().take(5).collect::<Vec<_>>().into_iter().rev() {
        line(
            "note",
            format!("{} ({} ago)", notice.text, span(notice.ago_s as f64)),
        );
    }
    text
}

fn gate_line(gate: &GateStatus) -> String {
    let mut line = format!("{}: {} published", to_text(&gate.directory), gate.published);
    if gate.held_back > 0 {
        let _ = write!(line, ", {} accepted and held back", gate.held_back);
    }
    line
}

fn queue_line(queue: &qcbus_messages::control::QueueStatus) -> String {
    let mut line = format!("{} waiting, {} being checked", queue.waiting, queue.active);
    if queue.background > 0 {
        let _ = write!(line, ", {} to be checked again", queue.background);
    }
    if queue.waiting > 0 {
        let _ = write!(
            line,
            "; the oldest has waited {}",
            span(queue.oldest_waiting_s)
        );
    }
    if let Some(left) = queue.estimated_s.filter(|left| *left > 0.0) {
        let _ = write!(line, "; {:.0} per second, {} left", queue.rate, span(left));
    }
    line
}

fn peer_line(peer: &PeerStatus) -> String {
    let what = if peer.trials.is_some() {
        "a shadow, "
    } else {
        ""
    };
    let mut line = format!("{} {}: {what}{}", peer.name, peer.version, peer.state);
    if peer.checkers > 0 {
        let _ = write!(line, ", {} checkers", peer.checkers);
    }
    if peer.threads > 0 {
        let plural = if peer.threads == 1 { "" } else { "s" };
        let _ = write!(line, ", {} thread{plural}", peer.threads);
    }
    let _ = write!(line, ", {} done", peer.done);
    if let Some(trials) = &peer.trials {
        let _ = write!(line, ", {}", super::trials::counted(trials));
    }
    match peer.restarts {
        0 => {}
        1 => line.push_str(", restarted once"),
        times => {
            let _ = write!(line, ", restarted {times} times");
        }
    }
    if let Some(sandbox) = &peer.sandbox {
        let _ = match sandbox.state.as_str() {
            "confined" => write!(line, ", confined"),
            "partly" => write!(line, ", only partly confined: {}", sandbox.why),
            _ => write!(line, ", not confined: {}", sandbox.why),
        };
    }
    if !peer.note.is_empty() {
        let _ = write!(line, " ({})", peer.note);
    }
    line
}

fn span(seconds: f64) -> String {
    let whole = seconds as u64;
    match whole {
        0..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        3600..86400 => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
        _ => format!("{} d {} h", whole / 86400, whole % 86400 / 3600),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use qcbus_messages::control::{FileCounts, NoticeStatus, QueueStatus, SandboxStatus, Unseen};

    #[test]
    fn status_of_a_busy_broker_as_text() {
        let status = Status {
            instance: "farm".into(),
            version: "0.1.0".into(),
            pid: 4711,
            uptime_s: 93784,
            watching: vec!["/farm/in".into(), "/farm/more".into()],
            watch_mode: "events".into(),
            out: "/farm/out".into(),
            files: FileCounts {
                total: 120,
                judged: 100,
                accepted: 80,
                rejected: 19,
                undetermined: 1,
            },
            queue: QueueStatus {
                waiting: 18,
                background: 3,
                active: 2,
                oldest_waiting_s: 1.25,
                rate: 250.0,
                estimated_s: Some(75.0),
            },
            peers: vec![PeerStatus {
                name: "xodrBundle".into(),
                role: "bundle".into(),
                version: "0.1.0".into(),
                pid: 1,
                state: "busy".into(),
                checkers: 26,
                active: 2,
                threads: 4,
                done: 99,
                restarts: 1,
                note: "slow: 16 jobs wait only for this bundle".into(),
                sandbox: Some(SandboxStatus {
                    state: "partly".into(),
                    why: "this kernel does not support Landlock".into(),
                }),
                ..PeerStatus::default()
            }],
            epoch: (3 << 32) + 2,
            notices: vec![NoticeStatus {
                kind: "not-written".into(),
                about: None,
                text: "cannot write /farm/out/a.xqar: No space left on device".into(),
                ago_s: 75,
            }],
            unseen: vec![Unseen {
                path: "/farm/closed".into(),
                why: "cannot read this directory: Permission denied".into(),
            }],
            ..Status::default()
        };
        insta::assert_snapshot!(render(&status));
    }
}
