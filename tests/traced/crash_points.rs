//! Crash points: the broker is killed before and after each of its disk operations in a small job.
//! The next broker repairs every resulting state.
//!
//! The job: a file is written and accepted, written again and rejected, and deleted; then the
//! broker is told to end. `QCBUS_CRASH_POINTS` sets the number of points, or `all` (a sample by
//! default); `QCBUS_CHAOS_SEED` repeats a sample.

use std::process::ExitStatus;
use std::time::Instant;

use crate::support::content::Content;
use crate::support::dice::{Dice, seed};
use crate::support::farm::{Farm, tail};
use crate::support::inside::skip;
use crate::support::judge::{Files, judge, verdicts_in_journal};
use crate::support::tracer::{Aim, Side, Traced, refused};
use crate::support::watchdog::until_or;
use qcbus_messages::control::{Request, Response};

/// Number of points in a sample. `.ci/run` takes a larger one.
const SAMPLE: usize = 4;
/// File of the small job, and a file that never changes.
const NAME: &str = "job.xodr";
const BYSTANDER: &str = "bystander.xodr";

/// Change of the file between the crash and the next broker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meanwhile {
    Nothing,
    Deleted,
    Rewritten,
}

/// A farm with a gate and traced brokers.
struct Victim {
    farm: Farm,
    broker: Option<Traced>,
    files: Files,
    /// Number that makes the bytes of every round different.
    number: u64,
}

impl Victim {
    fn new() -> Victim {
        let mut farm = Farm::new();
        let gate = farm.gate().to_string_lossy().into_owned();
        farm.arguments = vec!["--gate".to_owned(), gate];
        let mut victim = Victim {
            farm,
            broker: None,
            files: Files::new(),
            number: 0,
        };
        victim.put(BYSTANDER, Content::Good(u64::MAX));
        victim
    }

    fn put(&mut self, name: &str, content: Content) {
        self.farm.write(name, &content.bytes());
        self.files.insert(name.to_owned(), content);
    }

    fn delete(&mut self) {
        let _ = std::fs::remove_file(self.farm.root().join(NAME));
        self.files.remove(NAME);
    }

    fn fresh(&mut self) -> u64 {
        self.number += 1;
        self.number
    }

    /// Starts a broker. It is killed at the given point if it reaches it.
    fn start(&mut self, aim: Option<Aim>) -> &Traced {
        let below = [self.farm.out(), self.farm.gate(), self.farm.instance()];
        let (command, log) = (self.farm.serve_command(), self.farm.log_path());
        self.broker
            .insert(Traced::start(command, &log, &below, aim))
    }

    fn broker(&self) -> &Traced {
        self.broker.as_ref().unwrap()
    }

    /// Waits until a condition holds or the broker has ended.
    fn until(&self, what: &str, is_so: impl Fn() -> bool) -> Option<ExitStatus> {
        until_or(
            what,
            || match self.broker().ended() {
                Some(ended) => Some(Some(ended)),
                None => is_so().then_some(None),
            },
            || self.explain(),
        )
    }

    fn explain(&self) -> String {
        let (status, log) = (self.farm.status(), self.farm.log());
        let deeds = self.broker().deeds();
        format!("{deeds:#?}\n{status:#?}\n{}", tail(&log))
    }

    /// Runs the small job until the job or the broker ends.
    fn job(&mut self) -> ExitStatus {
        let steps = [Victim::accept, Victim::reject, Victim::remove];
        let ended = steps.iter().find_map(|step| step(self));
        ended.unwrap_or_else(|| self.down())
    }

    fn accept(&mut self) -> Option<ExitStatus> {
        let content = Content::Good(self.fresh());
        self.judged(content)
    }

    fn reject(&mut self) -> Option<ExitStatus> {
        let content = Content::NoHeader(self.fresh());
        self.judged(content)
    }

    fn judged(&mut self, content: Content) -> Option<ExitStatus> {
        let expected = content.verdict();
        self.put(NAME, content);
        let file = self.farm.root().join(NAME);
        let ask = Request::Wait {
            file,
            timeout_ms: Some(60_000),
        };
        self.until("a verdict", || match self.farm.ask(&ask) {
            Some(Response::Verdict(told)) => {
                assert_eq!(told.verdict, expected, "{told:?}\n{}", self.explain());
                true
            }
            _ => false,
        })
    }

    fn remove(&mut self) -> Option<ExitStatus> {
        self.delete();
        let forgotten = || {
            let status = self.farm.status();
            status.is_some_and(|it| it.files.total == 1 && it.queue.active == 0)
        };
        self.until("the file is forgotten", || {
            forgotten() && !self.farm.out().join(format!("{NAME}.xqar")).exists()
        })
    }

    /// Tells the broker to end.
    fn down(&self) -> ExitStatus {
        let _ = self.farm.ask(&Request::Down);
        let ended = self.until("the broker ends", || false);
        ended.unwrap()
    }

    /// Starts a broker that is not killed, and waits until it has repaired everything.
    fn recover(&mut self, what: &str) {
        self.start(None);
        let total = u64::try_from(self.files.len()).unwrap();
        let ended = self.until(what, || {
            self.farm.status().is_some_and(|status| {
                let queue = status.queue;
                let quiet = queue.waiting + queue.background + queue.active == 0;
                quiet && status.files.total == total && status.files.judged == total
            })
        });
        assert_eq!(ended, None, "{what}: the next broker must keep running");
        self.demand(what);
    }

    fn demand(&self, what: &str) {
        // A late withdrawal is allowed. Only a remaining file is a complaint.
        let complaints = || {
            let mut judgement = judge(&self.farm, &self.files, &[]);
            judgement.gate(&self.farm, &self.files, &Files::new(), &self.farm.gate());
            assert!(judgement.condemned.is_empty());
            judgement.complaints
        };
        until_or(
            what,
            || complaints().is_empty().then_some(()),
            || format!("{:#?}\n{}", complaints(), self.explain()),
        );
        let counts = verdicts_in_journal(&self.farm.journal());
        let doubled: Vec<_> = counts.iter().filter(|(_, count)| **count != 1).collect();
        assert!(
            doubled.is_empty(),
            "{what}: no file may be judged twice: {doubled:#?}"
        );
    }
}

/// Work that is interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Work {
    /// The small job, with a ready broker.
    Job,
    /// The start of a broker that finds a rewritten file.
    Start,
}

impl Victim {
    /// Does the work. The broker is killed at the given point if it reaches it.
    fn work(&mut self, work: Work, aim: Option<Aim>) -> ExitStatus {
        match work {
            Work::Job => {
                self.broker().aim(aim);
                self.job()
            }
            Work::Start => {
                self.down();
                let content = Content::Good(self.fresh());
                self.put(NAME, content.clone());
                self.start(aim);
                let ended = self.judged(content);
                ended.unwrap_or_else(|| self.down())
            }
        }
    }

    fn meanwhile(&mut self, meanwhile: Meanwhile) {
        match meanwhile {
            Meanwhile::Nothing => {}
            Meanwhile::Deleted => self.delete(),
            Meanwhile::Rewritten => {
                let content = Content::NoVersion(self.fresh());
                self.put(NAME, content);
            }
        }
    }
}

/// Returns the points to try for a work with this number of disk operations.
fn points(deeds: usize) -> Vec<Aim> {
    let sides = [Side::Before, Side::After];
    let of = |deed| sides.map(|side| Aim { deed, side });
    let all: Vec<Aim> = (1..=deeds).flat_map(of).collect();
    let wanted = std::env::var("QCBUS_CRASH_POINTS").unwrap_or_default();
    if wanted == "all" {
        return all;
    }
    let wanted = wanted.parse().unwrap_or(SAMPLE).clamp(1, all.len());
    let seed = seed();
    report(&format!("crash points: QCBUS_CHAOS_SEED={seed}"));
    let mut dice = Dice::new(seed);
    // One point is taken from each stretch of the work, so that every stage is covered.
    let stretch = |at: usize| &all[at * all.len() / wanted..(at + 1) * all.len() / wanted];
    let chosen = (0..wanted).filter_map(|at| dice.pick(stretch(at)));
    chosen.copied().collect()
}

fn killed_anywhere(work: Work, meanwhile: Meanwhile) {
    if let Some(why) = refused() {
        return skip(&format!("crash points, {work:?}, {meanwhile:?}"), &why);
    }
    let mut victim = Victim::new();
    victim.recover("nothing has happened yet");
    // Later jobs do not repeat some journal entries of the first job (lists of skipped checkers).
    // The points must be those of later jobs.
    let ended = victim.work(work, None);
    assert!(ended.success(), "{ended}\n{}", victim.explain());
    victim.recover("nothing has happened yet");
    let ended = victim.work(work, None);
    assert!(ended.success(), "{ended}\n{}", victim.explain());
    let deeds = victim.broker().deeds().len();
    victim.recover("nothing has happened yet");
    let points = points(deeds);
    let (mut hits, start) = (0, Instant::now());
    for point in &points {
        let ended = victim.work(work, Some(*point));
        let hit = victim.broker().hit();
        assert_eq!(
            ended.success(),
            hit.is_none(),
            "{ended}\n{}",
            victim.explain()
        );
        hits += usize::from(hit.is_some());
        victim.meanwhile(meanwhile);
        let hit = hit.unwrap_or_else(|| "at no time".to_owned());
        victim.recover(&format!(
            "{work:?}, {meanwhile:?}, killed at {point:?}, {hit}"
        ));
    }
    // The order of threads varies, so that the last points of one run may be missing in another.
    assert!(
        hits * 2 > points.len(),
        "{hits} of {} points were hit",
        points.len()
    );
    report(&format!(
        "crash points: {work:?}, {meanwhile:?}: killed at {hits} points of {deeds} deeds in {:.0} s",
        start.elapsed().as_secs_f64()
    ));
    victim.down();
}

#[test]
fn kill_during_a_job_is_repaired_after_restart() {
    killed_anywhere(Work::Job, Meanwhile::Nothing);
}

#[test]
fn kill_during_the_start_is_repaired_after_restart() {
    killed_anywhere(Work::Start, Meanwhile::Nothing);
}

#[test]
fn file_deleted_after_a_crash_leaves_nothing_behind() {
    killed_anywhere(Work::Job, Meanwhile::Deleted);
}

#[test]
fn file_rewritten_after_a_crash_gets_a_current_verdict() {
    killed_anywhere(Work::Job, Meanwhile::Rewritten);
}

#[expect(
    clippy::print_stderr,
    reason = "the figures are for the person who runs the test"
)]
fn report(text: &str) {
    eprintln!("{text}");
}
