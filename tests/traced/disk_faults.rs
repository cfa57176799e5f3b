//! System calls of the broker fail: no descriptors, no room, a failing disk, a server that forgot a
//! file, an interruption, a single byte, or no answer at all. During the failure the broker reports
//! nothing false. Afterwards it recovers without any help. `QCBUS_CRASH_POINTS` makes them longer.

use std::time::{Duration, Instant};

use crate::support::content::{CATALOG, Content, Mark};
use crate::support::farm::{Farm, tail, zoo};
use crate::support::inside::skip;
use crate::support::judge::{Files, judge};
use crate::support::programs::copy_program;
use crate::support::tracer::{Answer, Failure, Kind, Traced, no_other_answers};
use crate::support::watchdog::{LONG, pause, until_or};
use nix::errno::Errno;
use qcbus_messages::Verdict;
use qcbus_messages::control::{Request, Response};

/// A farm with a broker that gets wrong answers from the system.
struct Victim {
    farm: Farm,
    broker: Traced,
    files: Files,
}

impl Victim {
    /// Creates the farm. Returns `None` with a message if the answers cannot be replaced here.
    fn new(test: &str) -> Option<Victim> {
        if let Some(why) = no_other_answers() {
            skip(test, &why);
            return None;
        }
        let mut farm = Farm::new();
        let gate = farm.gate().to_string_lossy().into_owned();
        farm.arguments = vec!["--gate".to_owned(), gate];
        std::fs::create_dir(farm.root().join("catalogs")).unwrap();
        let broker = Traced::start(farm.serve_command(), &farm.log_path(), &[], None);
        let mut victim = Victim {
            farm,
            broker,
            files: Files::new(),
        };
        victim.put(CATALOG, Content::Catalog(1, Mark::Clean));
        victim.put("map.xodr", Content::Good(1));
        victim.put("old.xosc", Content::Scenario(1, "map.xodr".to_owned()));
        victim.settles("before anything goes wrong");
        Some(victim)
    }

    fn put(&mut self, name: &str, content: Content) {
        self.farm.write(name, &content.bytes());
        self.files.insert(name.to_owned(), content);
    }

    /// Writes files with every kind of outcome. All of them relate to existing files.
    fn work(&mut self, round: u64) {
        self.put("good.xodr", Content::Good(100 + round));
        self.put("bad.xodr", Content::NoHeader(100 + round));
        self.put(CATALOG, Content::Catalog(100 + round, Mark::Clean));
        self.put("map.xodr", Content::Good(200 + round));
        let map = "map.xodr".to_owned();
        self.put("new.xosc", Content::Scenario(100 + round, map));
    }

    fn explain(&self) -> String {
        format!("{:#?}\n{}", self.farm.status(), tail(&self.farm.log()))
    }

    /// Waits until every file has the required verdict and is at its place.
    fn settles(&self, what: &str) {
        let total = u64::try_from(self.files.len()).unwrap();
        let quiet = || {
            assert_eq!(
                self.broker.ended(),
                None,
                "{what}: the broker must keep running\n{}",
                self.explain()
            );
            let status = self.farm.status()?;
            let queue = status.queue;
            let quiet = queue.waiting + queue.background + queue.active == 0;
            (quiet && status.files.judged == total).then_some(())
        };
        let complaints = || {
            let mut judgement = judge(&self.farm, &self.files, &[]);
            judgement.gate(&self.farm, &self.files, &Files::new(), &self.farm.gate());
            judgement.complaints
        };
        until_or(
            what,
            || quiet().filter(|()| complaints().is_empty()),
            || format!("{:#?}\n{}", complaints(), self.explain()),
        );
    }

    /// Asserts that no current answer is false: a verdict is correct, or there is none.
    fn says_nothing_false(&self, what: &str) {
        for (name, content) in &self.files {
            let file = self.farm.root().join(name);
            let ask = Request::Wait {
                file,
                timeout_ms: Some(20),
            };
            if let Some(Response::Verdict(told)) = self.farm.ask(&ask) {
                let right = [content.verdict(), Verdict::Undetermined];
                assert!(
                    right.contains(&told.verdict),
                    "{what}: {told:?}\n{}",
                    self.explain()
                );
            }
        }
    }

    /// Adds and changes files during a failure.
    fn through(&mut self, what: &str, failure: &Failure, enough: usize, lasts: Duration) {
        self.broker.failure(Some(failure.clone()));
        let begun = Instant::now();
        let mut round = 0;
        while self.broker.troubled() < enough || begun.elapsed() < lasts {
            round += 1;
            self.work(round);
            self.says_nothing_false(what);
            pause(Duration::from_millis(50));
            let limit = *LONG;
            assert!(
                begun.elapsed() < limit,
                "{what}: a write must fail in time\n{}",
                self.explain()
            );
        }
        let times = self.broker.failure(None);
        assert!(times >= enough, "{what}: {times} times");
        self.settles(what);
    }
}

const ANY_READING: &[Kind] = &[Kind::Look, Kind::Read];
const ANYTHING: &[Kind] = &[Kind::Look, Kind::Read, Kind::Deed];

fn error(
    below: std::path::PathBuf,
    kinds: &'static [Kind],
    error: Errno,
    one_in: usize,
) -> Failure {
    Failure {
        below,
        kinds,
        answer: Answer::Error(error),
        one_in,
    }
}

#[test]
fn temporary_disk_errors_have_no_lasting_effect() {
    let Some(mut victim) = Victim::new("temporary_disk_errors_have_no_lasting_effect") else {
        return;
    };
    let root = victim.farm.root();
    let lasts = Duration::from_millis(2500);
    let all = [
        (Errno::EMFILE, 1),
        (Errno::EIO, 2),
        (Errno::ESTALE, 1),
        (Errno::ENOMEM, 3),
    ];
    // Each takes some seconds. A short run tries two.
    let is_long = std::env::var_os("QCBUS_CRASH_POINTS").is_some();
    for (code, one_in) in all.into_iter().take(if is_long { 4 } else { 2 }) {
        let failure = error(root.clone(), ANY_READING, code, one_in);
        victim.through(&format!("{code} for a while"), &failure, 20, lasts);
    }
}

#[test]
fn interruptions_and_short_reads_change_nothing() {
    let Some(mut victim) = Victim::new("interruptions_and_short_reads_change_nothing") else {
        return;
    };
    let base = victim.farm.base().to_path_buf();
    let interrupted = error(base.clone(), &[Kind::Look, Kind::Read], Errno::EINTR, 3);
    victim.through("interruptions", &interrupted, 50, Duration::ZERO);
    let short = Failure {
        below: victim.farm.root(),
        kinds: &[Kind::Read],
        answer: Answer::Short,
        one_in: 2,
    };
    victim.through("short reads", &short, 50, Duration::ZERO);
}

#[test]
fn full_disk_costs_no_verdict() {
    let Some(mut victim) = Victim::new("full_disk_costs_no_verdict") else {
        return;
    };
    let (out, gate) = (victim.farm.out(), victim.farm.gate());
    for (below, one_in) in [
        (out.clone(), 1),
        (out.join(".qcbus"), 2),
        (gate, 1),
        (out, 3),
    ] {
        let what = format!("no room in {}", below.display());
        let full = error(below.clone(), &[Kind::Deed], Errno::ENOSPC, one_in);
        victim.through(&what, &full, 10, Duration::from_secs(1));
        let broken = error(below, ANYTHING, Errno::EIO, 5);
        victim.through(
            &format!("{what}, and it fails"),
            &broken,
            10,
            Duration::from_secs(1),
        );
    }
}

// A server is gone: requests for its files never get an answer. Every lookup may be affected: the
// watcher has several, and the reader has others.

#[test]
fn file_with_hanging_lookups_is_named_and_delays_no_other() {
    let test = "file_with_hanging_lookups_is_named_and_delays_no_other";
    hanging_file_is_named_and_delays_no_other(test, &[Kind::Look], [1, 2]);
}

#[test]
fn file_with_some_hanging_lookups_is_named_and_delays_no_other() {
    let test = "file_with_some_hanging_lookups_is_named_and_delays_no_other";
    hanging_file_is_named_and_delays_no_other(test, &[Kind::Look], [3, 4]);
}

#[test]
fn file_with_few_hanging_lookups_is_named_and_delays_no_other() {
    let test = "file_with_few_hanging_lookups_is_named_and_delays_no_other";
    hanging_file_is_named_and_delays_no_other(test, &[Kind::Look], [5, 6]);
}

#[test]
fn file_with_hanging_reads_is_named_and_delays_no_other() {
    let test = "file_with_hanging_reads_is_named_and_delays_no_other";
    hanging_file_is_named_and_delays_no_other(test, &[Kind::Read], [1]);
}

/// Lets one in so many calls hang, in rounds.
fn hanging_file_is_named_and_delays_no_other(
    test: &str,
    kinds: &'static [Kind],
    rounds: impl IntoIterator<Item = usize>,
) {
    let Some(mut victim) = Victim::new(test) else {
        return;
    };
    for (round, one_in) in (0..).zip(rounds) {
        let map = victim.farm.root().join("map.xodr");
        victim.broker.failure(Some(Failure {
            below: map.clone(),
            kinds,
            answer: Answer::Never,
            one_in,
        }));
        victim.work(round);
        let named = || {
            let status = victim.farm.status()?;
            status.unseen.iter().any(|it| it.path == map).then_some(())
        };
        until_or("it is named", named, || victim.explain());
        // No client asks for this file. The watcher must notice it.
        let unasked = format!("unasked-{round}.xodr");
        victim.put(&unasked, Content::Good(2000 + round));
        let result = victim.farm.out().join(format!("{unasked}.xqar"));
        until_or(
            "a new file is noticed",
            || result.exists().then_some(()),
            || victim.explain(),
        );
        for number in 0..20 {
            let name = format!("honest-{round}-{number}.xodr");
            victim.put(&name, Content::Good(1000 * round + number));
            assert_eq!(victim.farm.verdict(&name).verdict, Verdict::Accepted);
        }
        let ask = Request::Wait {
            file: map,
            timeout_ms: Some(60_000),
        };
        // The answer comes before the timeout, because the file may never answer.
        let said = victim.farm.ask(&ask);
        let is_no_verdict = match &said {
            Some(Response::Unanswered { .. }) => true,
            Some(Response::Verdict(it)) => it.verdict == Verdict::Undetermined,
            _ => false,
        };
        assert!(is_no_verdict, "{said:?}");
        victim.says_nothing_false("a file does not respond");
        victim.broker.failure(None);
        victim.settles("it answers again");
        let unseen = victim.farm.status().unwrap().unseen;
        assert!(unseen.is_empty(), "{unseen:?}");
    }
}

/// The program of a manifest is on a lost server. Its process and all others go on.
#[test]
fn hanging_program_delays_no_other_work() {
    let test = "hanging_program_delays_no_other_work";
    let Some(mut victim) = Victim::new(test) else {
        return;
    };
    let program = victim.farm.base().join("remote/polite");
    std::fs::create_dir(program.parent().unwrap()).unwrap();
    copy_program(&zoo(), &program);
    victim.farm.let_in_by(&program, "polite", "");
    let peer = |victim: &Victim| {
        let peers = victim.farm.status()?.peers;
        peers
            .into_iter()
            .find(|it| it.name == "polite" && it.state == "ready")
    };
    let pid = until_or("it judges", || peer(&victim), || victim.explain()).pid;
    victim.broker.failure(Some(Failure {
        below: program.clone(),
        kinds: &[Kind::Look],
        answer: Answer::Never,
        one_in: 1,
    }));
    let named = || {
        let status = victim.farm.status()?;
        status
            .unseen
            .iter()
            .any(|it| it.path == program)
            .then_some(())
    };
    until_or("it is named", named, || victim.explain());
    for number in 0..20 {
        let name = format!("honest-{number}.xodr");
        victim.put(&name, Content::Good(3000 + number));
        assert_eq!(victim.farm.verdict(&name).verdict, Verdict::Accepted);
        let results = victim.farm.result(&name);
        assert!(
            results.bundles.iter().any(|it| it.name == "polite"),
            "{name}"
        );
    }
    victim.broker.failure(None);
    until_or(
        "it answers again",
        || victim.farm.status()?.unseen.is_empty().then_some(()),
        || victim.explain(),
    );
    // A change is noticed afterwards.
    victim.farm.send_away("polite");
    until_or(
        "it has gone",
        || {
            let peers = victim.farm.status()?.peers;
            peers.iter().all(|it| it.pid != pid).then_some(())
        },
        || victim.explain(),
    );
}

#[test]
fn broker_ends_although_a_file_hangs() {
    let Some(mut victim) = Victim::new("broker_ends_although_a_file_hangs") else {
        return;
    };
    victim.broker.failure(Some(Failure {
        below: victim.farm.root().join("map.xodr"),
        kinds: ANY_READING,
        answer: Answer::Never,
        one_in: 1,
    }));
    victim.work(1);
    until_or(
        "somebody waits in vain",
        || (victim.broker.troubled() > 0).then_some(()),
        || victim.explain(),
    );
    let _ = victim.farm.ask(&Request::Down);
    let ended = until_or(
        "the broker ends",
        || victim.broker.ended(),
        || victim.explain(),
    );
    assert!(ended.success(), "{ended}");
}
