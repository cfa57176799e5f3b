//! Tests that a check is correct, whatever happens to the broker and its bundles during the check.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use qcbus_messages::control::PeerStatus;
use rustix::process::Signal;

use super::bench::{Bench, Made, Outcome, signal};
use crate::support::content::Content;
use crate::support::dice::{Dice, seed};
use crate::support::watchdog::{pause, until_so};

/// Disturbs the broker or its bundles while they check a file. Compares the outcome with that of a
/// check without a broker. Returns how the check was made.
fn in_the_middle(bench: &Bench, content: &Content, trouble: impl FnOnce(&PeerStatus)) -> Made {
    let file = bench.beside("map.xodr", content.bytes());
    let words = [file.as_str(), "-v"];
    let cold = bench.cold(&words);
    let bundle = bench.stop_maps();
    let asked = std::thread::scope(|scope| {
        let asked = scope.spawn(|| bench.told(bench.command(&words)));
        bench.until_under_way();
        trouble(&bundle);
        asked.join().unwrap()
    });
    assert_eq!(asked.1, cold);
    asked.0
}

#[test]
fn killed_broker_leaves_the_check_to_the_caller() {
    for content in [Content::Good(1), Content::NoHeader(2)] {
        let bench = Bench::new();
        let mut broker = bench.farm.serve_ready();
        let made = in_the_middle(&bench, &content, |_| broker.kill());
        assert_eq!(made, Made::Cold);
    }
}

#[test]
fn stopped_broker_is_not_waited_for() {
    let bench = Bench::new();
    let broker = bench.farm.serve_ready();
    let mut stopped = PeerStatus::default();
    let made = in_the_middle(&bench, &Content::NoHeader(1), |bundle| {
        stopped = bundle.clone();
        broker.signal(Signal::STOP);
    });
    assert_eq!(made, Made::Cold);
    // The check does not wait either if the broker is stopped from the start.
    let file = bench.beside("other.xodr", Content::Good(2).bytes());
    assert_eq!(bench.compared(&[&file]), Made::Cold);
    broker.signal(Signal::CONT);
    signal(&stopped, Signal::CONT);
    bench.until_quiet();
    assert_eq!(bench.compared(&[&file]), Made::Warm);
}

#[test]
fn draining_broker_finishes_or_declines_a_check() {
    let bench = Bench::new();
    let mut broker = bench.farm.serve_ready();
    std::thread::scope(|scope| {
        let trouble = |bundle: &PeerStatus| {
            scope.spawn(|| assert!(bench.farm.qcbus(&["down"]).status.success()));
            // The other bundles are not stopped. One of them would answer if the broker were not
            // draining.
            let other = bench.beside("other.xosc", "<OpenSCENARIO/>");
            until_so("it drains", || bench.is_asked_in_vain(&other));
            signal(bundle, Signal::CONT);
        };
        in_the_middle(&bench, &Content::NoHeader(1), trouble);
    });
    assert!(broker.wait().success());
}

/// Writes several files, good and bad.
fn many(bench: &Bench) -> Vec<String> {
    let content = |number| match number % 3 {
        0 => Content::NoHeader(number),
        _ => Content::Good(number),
    };
    let write = |number| bench.beside(&format!("m/{number}.xodr"), content(number).bytes());
    (0..40).map(write).collect()
}

#[test]
fn broker_ending_at_any_moment_changes_no_check() {
    let bench = Bench::new();
    let files = many(&bench);
    let mut words: Vec<&str> = files.iter().map(String::as_str).collect();
    words.push("-v");
    let cold = bench.cold(&words);
    let mut dice = Dice::new(seed());
    for round in 0..8 {
        let mut broker = bench.farm.serve_ready();
        let asked = std::thread::scope(|scope| {
            let asked = scope.spawn(|| bench.told(bench.command(&words)));
            pause(Duration::from_millis(dice.below(120)));
            match round % 2 {
                0 => broker.kill(),
                _ => assert!(bench.farm.qcbus(&["down"]).status.success()),
            }
            asked.join().unwrap()
        });
        assert_eq!(asked.1, cold, "round {round}, seed {}", seed());
    }
}

/// Runs checks while the bundle that checks maps receives a signal again and again.
fn besieged(bench: &Bench, sent: Signal) {
    let files = many(bench);
    let words: Vec<&str> = files.iter().map(String::as_str).take(6).collect();
    let cold = bench.cold(&words);
    let over = AtomicBool::new(false);
    let all: Vec<Outcome> = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !over.load(Ordering::Relaxed) {
                let peers = bench.farm.status().map(|it| it.peers).unwrap_or_default();
                for peer in peers
                    .iter()
                    .filter(|it| it.name == "xodrBundle" && it.pid != 0)
                {
                    signal(peer, sent);
                }
                pause(Duration::from_millis(20));
            }
        });
        let check = || bench.outcome(&mut bench.command(&words));
        let all = (0..6).map(|_| check()).collect();
        over.store(true, Ordering::Relaxed);
        all
    });
    for outcome in all {
        assert_eq!(outcome, cold);
    }
}

#[test]
fn bundle_dying_on_every_file_does_not_change_answers() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    besieged(&bench, Signal::KILL);
}

#[test]
fn bundle_hanging_on_every_file_does_not_change_answers() {
    let bench = Bench::with(&["--silence-limit", "1s"]);
    let _broker = bench.farm.serve_ready();
    besieged(&bench, Signal::STOP);
}

#[test]
fn file_that_killed_a_bundle_is_not_retried_there() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let kill = |bundle: &PeerStatus| signal(bundle, Signal::KILL);
    // A file that kills the bundle three times would finally cost the farm its bundle.
    let made = in_the_middle(&bench, &Content::NoHeader(1), kill);
    assert_eq!(made, Made::Cold);
}

/// Returns a map that keeps a bundle busy for a while.
fn large() -> Vec<u8> {
    let whole = String::from_utf8(Content::Good(1).bytes()).unwrap();
    let (begin, end) = (
        whole.find("<road").unwrap(),
        whole.find("</OpenDRIVE>").unwrap(),
    );
    let road = |id: u32| whole[begin..end].replacen("id=\"1\"", &format!("id=\"{id}\""), 1);
    let roads: String = (1..1000).map(road).collect();
    [&whole[..begin], &roads, &whole[end..]]
        .concat()
        .into_bytes()
}

#[test]
fn file_with_a_repeatedly_killed_bundle_is_still_checked() {
    let bench = Bench::with(&["--max-restarts", "100"]);
    let _broker = bench.farm.serve_ready();
    let file = bench.beside("map.xodr", large());
    let words = [file.as_str(), "-v"];
    let cold = bench.cold(&words);
    let over = AtomicBool::new(false);
    let asked = std::thread::scope(|scope| {
        let asked = scope.spawn(|| {
            let asked = bench.told(bench.command(&words));
            over.store(true, Ordering::Relaxed);
            asked
        });
        // The bundle is killed as soon as it has the file.
        while !over.load(Ordering::Relaxed) {
            let peers = bench.farm.status().map(|it| it.peers).unwrap_or_default();
            for peer in peers
                .iter()
                .filter(|it| it.name == "xodrBundle" && it.active > 0)
            {
                signal(peer, Signal::KILL);
            }
        }
        asked.join().unwrap()
    });
    assert_eq!(asked.1, cold);
}

#[test]
fn check_ended_by_a_signal_names_the_unjudged_files() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let files = many(&bench);
    for (count, sent) in [(1, Signal::TERM), (3, Signal::INT)] {
        let bundle = bench.stop_maps();
        let words: Vec<&str> = files.iter().map(String::as_str).take(count).collect();
        let ended = std::thread::scope(|scope| {
            let asked = scope.spawn(|| bench.outcome(&mut bench.command(&words)));
            bench.until_under_way();
            let checks = bench.farm.processes().into_iter();
            for check in checks.filter(|it| it.words.iter().any(|word| word == "check")) {
                check.signal(sent);
            }
            asked.join().unwrap()
        });
        assert_eq!(ended.code(), Some(3), "{ended:?}");
        assert!(ended.says("not judged: stopped by a signal"), "{ended:?}");
        assert!(ended.says("m/0.xodr"), "{ended:?}");
        bench.until_quiet();
        signal(&bundle, Signal::CONT);
    }
}
