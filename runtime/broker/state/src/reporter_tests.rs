//! Tests of the messages to reporters about removed files, with crashes in between.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_configuration::InForce;
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::control::Response;
use qcbus_messages::{
    Digest, FromPeer, Hello, JobId, PROTOCOL_VERSION, PeerReport, Role, ToPeer, Verdict,
};
use qcbus_types::{ChildEnd, ChildSpec, PrepareFailure, Reading, Restart, Until};

use super::*;

const TEXT: &str = "text";

/// A state machine with one judged file from the journal.
struct Setup {
    state: State,
    path: Arc<Path>,
    sessions: u64,
}

impl Setup {
    /// `delivered` means that the reporter has the result according to the journal.
    fn new(delivered: bool) -> Setup {
        let in_force = InForce::new(None, SearchPath::default()).unwrap();
        let mut state = State::new(Settings::default(), in_force.digest, in_force.demand());
        let path: Arc<Path> = Path::new("/x/a.xodr").into();
        let judged = Judged {
            job: JobId(7),
            verdict: Verdict::Accepted,
            own: Verdict::Accepted,
            own_errors: 0,
            rests_on: Some(Vec::new()),
            digest: Digest::default(),
            basis: Digest::default(),
            config: Digest::default(),
            required_set: Arc::default(),
            epoch: Epoch::default(),
            inputs: Vec::new(),
            racy: false,
            counts: [0; 3],
            why: Vec::new(),
            xqar: Some("/out/a.xodr.xqar".into()),
        };
        let by = [(TEXT.to_owned(), Reported::Of(JobId(7)))];
        state.remember(&path, judged, if delivered { &by } else { &[] });
        Setup {
            state,
            path,
            sessions: 0,
        }
    }

    fn event(&mut self, event: Event) -> Vec<Action> {
        self.state.handle(Duration::from_secs(1), event)
    }

    fn join(&mut self) -> (SessionId, Vec<Action>) {
        self.join_as(None)
    }

    fn join_as(&mut self, launch: Option<u64>) -> (SessionId, Vec<Action>) {
        self.sessions += 1;
        let session = SessionId(self.sessions);
        let hello = hello(self.sessions, launch);
        (session, self.event(Event::Hello { session, hello }))
    }

    /// Adds or changes the manifest of the reporter. Returns the resulting launch.
    fn wants(&mut self, version: u8) -> Launch {
        let specs = vec![spec(version)];
        let actions = self.event(Event::Children { specs });
        let mut launches = actions.iter().filter_map(|it| match it {
            Action::Spawn { launch, .. } => Some(*launch),
            _ => None,
        });
        launches.next().unwrap()
    }

    fn judges_nothing(&mut self) {
        self.state.settings.collect = Duration::MAX;
    }

    /// Makes the verdict valid: no bundle is required now, and the verdict is about the present bytes.
    fn makes_it_stand(&mut self) {
        let config = self.state.config;
        let path = self.path.clone();
        let content = Reading::Read(Stamp::default(), Digest::default());
        let entry = self.state.files.get_mut(0).unwrap();
        let judged = Arc::make_mut(entry.judged.as_mut().unwrap());
        judged.config = config;
        judged.inputs = vec![Input { path, content }];
    }

    fn vanish(&mut self) -> Vec<Action> {
        let mut actions = self.vanish_unrecorded();
        let path = self.path.clone();
        actions.extend(self.event(Event::Withdrawn { path }));
        actions
    }

    /// Removes the file. The journal does not yet contain this.
    fn vanish_unrecorded(&mut self) -> Vec<Action> {
        let path = self.path.clone();
        self.event(Event::Vanished { path })
    }

    fn say(&mut self, session: SessionId, message: FromPeer) -> Vec<Action> {
        self.event(Event::Message { session, message })
    }
}

fn hello(number: u64, launch: Option<u64>) -> Hello {
    Hello {
        protocol: PROTOCOL_VERSION,
        role: Role::Reporter,
        name: TEXT.to_owned(),
        version: "1".to_owned(),
        incarnation: number,
        pid: 100 + u32::try_from(number).unwrap(),
        launch,
        capacity: 4,
        threads: 1,
    }
}

fn exited(launch: Launch) -> Event {
    let end = ChildEnd::Failed("it was killed by signal 9".to_owned());
    Event::Exited { launch, end }
}

fn spec(version: u8) -> ChildSpec {
    ChildSpec {
        name: TEXT.to_owned(),
        role: Role::Reporter,
        version: Some(version.to_string()),
        command: vec!["text".to_owned()],
        restart: Restart::OnFailure,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

fn withdrawn() -> FromPeer {
    FromPeer::WithdrawalDone {
        input: "/x/a.xodr".to_owned(),
        report: PeerReport::Written,
    }
}

fn is_told(actions: &[Action]) -> bool {
    let told =
        |it: &Action| matches!(it, Action::Void { path, .. } if **path == *Path::new("/x/a.xodr"));
    actions.iter().any(told)
}

fn is_over(actions: &[Action]) -> bool {
    let over = |it: &Action| matches!(it, Action::Voided { reporter, .. } if reporter == TEXT);
    actions.iter().any(over)
}

#[test]
fn present_reporter_gets_withdrawal_at_once() {
    let mut setup = Setup::new(true);
    let (session, _) = setup.join();
    let actions = setup.vanish();
    assert!(is_told(&actions), "{actions:?}");
    let named =
        |it: &Action| matches!(it, Action::Withdraw { reporters, .. } if reporters == &[TEXT]);
    assert!(
        actions.iter().any(named),
        "the journal records the withdrawal: {actions:?}"
    );
    assert!(is_over(&setup.say(session, withdrawn())));
    assert!(
        !is_over(&setup.say(session, withdrawn())),
        "reported only once"
    );
}

/// Checks that a report is withdrawn only after the journal has recorded it. If the broker were
/// killed in between, the next one would treat the report as present.
#[test]
fn withdrawal_is_sent_only_after_journal_entry() {
    let mut setup = Setup::new(true);
    let (session, _) = setup.join();
    let actions = setup.vanish_unrecorded();
    assert!(!is_told(&actions), "{actions:?}");
    // The file returns and is removed again.
    let path = setup.path.clone();
    let stamp = Stamp::default();
    let actions = setup.event(Event::Settled { path, stamp });
    let [Action::Prepare { job, .. }] = actions[..] else {
        panic!("{actions:?}");
    };
    setup.vanish_unrecorded();
    let result = Err(PrepareFailure::Vanished);
    setup.event(Event::Prepared { job, result });
    let path = setup.path.clone();
    let once = setup.event(Event::Withdrawn { path: path.clone() });
    assert!(
        !is_told(&once),
        "the second withdrawal is not in the journal yet: {once:?}"
    );
    assert!(is_told(&setup.event(Event::Withdrawn { path })));
    assert!(is_over(&setup.say(session, withdrawn())));
}

#[test]
fn reporter_is_not_sent_known_result_again() {
    for has in [true, false] {
        let mut setup = Setup::new(has);
        let path = setup.path.clone();
        setup.event(Event::Present { path });
        let (_, actions) = setup.join();
        let sent = |it: &Action| matches!(it, Action::Deliver { .. });
        assert_eq!(actions.iter().any(sent), !has, "{actions:?}");
    }
}

#[test]
fn missing_reporter_gets_withdrawal_when_it_joins() {
    let mut setup = Setup::new(true);
    assert!(!is_told(&setup.vanish()));
    let (_, actions) = setup.join();
    assert!(is_told(&actions), "{actions:?}");
}

#[test]
fn killed_reporter_gets_the_withdrawal_again() {
    let mut setup = Setup::new(true);
    let (session, _) = setup.join();
    assert!(is_told(&setup.vanish()));
    setup.event(Event::Gone { session });
    let (session, actions) = setup.join();
    assert!(is_told(&actions), "{actions:?}");
    assert!(is_over(&setup.say(session, withdrawn())));
    let (_, actions) = setup.join();
    assert!(!is_told(&actions), "{actions:?}");
}

#[test]
fn pending_result_is_dropped_when_its_file_vanishes() {
    let mut setup = Setup::new(false);
    let (session, actions) = setup.join();
    let sent = |it: &Action| matches!(it, Action::Deliver { .. });
    assert!(actions.iter().any(sent), "{actions:?}");
    assert!(setup.state.awaits_result(session, JobId(7)));
    assert!(is_told(&setup.vanish()));
    assert!(!setup.state.awaits_result(session, JobId(7)));
}

#[test]
fn unacknowledged_result_of_former_broker_is_withdrawn() {
    let mut setup = Setup::new(false);
    let launch = setup.wants(1);
    setup.vanish();
    let (_, actions) = setup.join_as(Some(launch.0));
    assert!(is_told(&actions), "{actions:?}");
}

#[test]
fn child_role_is_refused_without_launch_id() {
    let mut setup = Setup::new(false);
    let launch = setup.wants(1);
    let is_refused = |actions: &[Action]| {
        let mut actions = actions.iter();
        actions.any(|it| matches!(it, Action::Refuse { .. }))
    };
    assert!(
        is_refused(&setup.join().1),
        "refused while the child is starting"
    );
    let (session, actions) = setup.join_as(Some(launch.0));
    assert!(!is_refused(&actions), "{actions:?}");
    assert!(is_refused(&setup.join().1), "it runs");
    setup.event(Event::Gone { session });
    assert!(
        is_refused(&setup.join().1),
        "refused after the child has died"
    );
}

#[test]
fn journalled_withdrawal_is_sent_after_restart() {
    let mut setup = Setup::new(false);
    let gone: Arc<Path> = Path::new("/x/gone.xodr").into();
    setup.state.remember_void(&gone, TEXT);
    let (_, actions) = setup.join();
    let told = |it: &Action| matches!(it, Action::Void { path, .. } if *path == gone);
    assert!(actions.iter().any(told), "{actions:?}");
}

#[test]
fn newer_result_waits_for_previous_acknowledgement() {
    let mut setup = Setup::new(false);
    let (session, actions) = setup.join();
    let sent = |actions: &[Action]| {
        let of = |it: &Action| match it {
            Action::Deliver { delivery, .. } => Some(delivery.job),
            _ => None,
        };
        actions.iter().filter_map(of).collect::<Vec<_>>()
    };
    assert_eq!(sent(&actions), [JobId(7)]);
    let (id, _) = setup.state.files.iter().next().unwrap();
    let entry = setup.state.files.get_mut(id).unwrap();
    Arc::make_mut(entry.judged.as_mut().unwrap()).job = JobId(8);
    let mut actions = Actions::default();
    setup.state.deliver_to_all(id, &mut actions);
    assert_eq!(
        sent(&actions),
        [],
        "two results of one file must not be sent at the same time"
    );
    let done = |job| FromPeer::ResultDone {
        job,
        report: PeerReport::Written,
    };
    assert_eq!(sent(&setup.say(session, done(JobId(7)))), [JobId(8)]);
    assert_eq!(sent(&setup.say(session, done(JobId(8)))), []);
    assert!(setup.state.all_delivered());
}

#[test]
fn upgraded_reporter_finishes_pending_results() {
    // The reporter leaves as requested or is killed meanwhile. The end of the process may be known
    // before the end of its session.
    let leaves: fn(&mut Setup, SessionId, Launch) -> Vec<Action> =
        |setup, session, _| setup.say(session, FromPeer::Leaving);
    let is_killed: fn(&mut Setup, SessionId, Launch) -> Vec<Action> = |setup, session, launch| {
        let end = ChildEnd::Failed("it was killed by signal 9".to_owned());
        let mut actions = setup.event(Event::Exited { launch, end });
        actions.extend(setup.event(Event::Gone { session }));
        actions
    };
    for ends in [leaves, is_killed] {
        an_upgraded_reporter_finishes(ends);
    }
}

fn an_upgraded_reporter_finishes(ends: fn(&mut Setup, SessionId, Launch) -> Vec<Action>) {
    let mut setup = Setup::new(false);
    let first = setup.wants(1);
    let (old, _) = setup.join_as(Some(first.0));
    let second = setup.wants(2);
    let (new, actions) = setup.join_as(Some(second.0));
    let drained = |it: &Action| matches!(it, Action::Send { session, message: ToPeer::Drain } if *session == old);
    assert!(
        actions.iter().any(drained),
        "the old process is drained: {actions:?}"
    );
    let cut = |it: &Action| matches!(it, Action::Disconnect { session } if *session == old);
    assert!(!actions.iter().any(cut), "{actions:?}");
    let given = |it: &Action| matches!(it, Action::Deliver { session, .. } if *session == new);
    assert!(
        !actions.iter().any(given),
        "the old process may still write the same report"
    );
    let actions = setup.event(exited(Launch(first.0 + 1)));
    assert!(
        !actions.iter().any(given),
        "another process has ended: {actions:?}"
    );
    let actions = ends(&mut setup, old, first);
    assert!(actions.iter().any(given), "{actions:?}");
}

/// Adds further judged files with these numbers of findings. The reporter does not have their results.
fn more(setup: &mut Setup, findings: &[u64]) {
    for (number, count) in (8..).zip(findings) {
        let path: Arc<Path> = Path::new(&format!("/x/{number}.xodr")).into();
        let known = setup.state.files.iter().next();
        let known = known.and_then(|(_, entry)| entry.judged.clone());
        let judged = Judged {
            job: JobId(number),
            counts: [0, 0, *count],
            ..(*known.unwrap()).clone()
        };
        setup.state.remember(&path, judged, &[]);
        setup.event(Event::Present { path });
    }
}

/// Returns the jobs whose results are sent.
fn sent(actions: &[Action]) -> Vec<u64> {
    let jobs = actions.iter().filter_map(|it| match it {
        Action::Deliver { delivery, .. } => Some(delivery.job.0),
        _ => None,
    });
    jobs.collect()
}

fn written(job: u64) -> FromPeer {
    FromPeer::ResultDone {
        job: JobId(job),
        report: PeerReport::Written,
    }
}

#[test]
fn results_with_many_findings_are_sent_in_turn() {
    let mut setup = Setup::new(true);
    more(&mut setup, &[1_500, 500, 1, 3_000, 1]);
    let (session, actions) = setup.join();
    assert_eq!(
        sent(&actions),
        [8, 9],
        "at most 2,000 findings are in transit"
    );
    assert_eq!(sent(&setup.say(session, written(8))), [10]);
    assert!(sent(&setup.say(session, written(9))).is_empty());
    assert_eq!(sent(&setup.say(session, written(10))), [11], "alone");
    assert_eq!(sent(&setup.say(session, written(11))), [12]);
}

/// Checks the limit for large results, which are read back and kept in memory. There may be many
/// reporters: a broker with eight of them took 600 MiB while a bundle reported far too much.
#[test]
fn few_reporters_hold_large_result_at_once() {
    let mut setup = Setup::new(true);
    more(&mut setup, &[3_000]);
    let mut sessions = Vec::new();
    let mut given = Vec::new();
    for name in ["one", "two", "three", "four"] {
        setup.sessions += 1;
        let session = SessionId(setup.sessions);
        let mut hello = hello(setup.sessions, None);
        hello.name = name.to_owned();
        let actions = setup.event(Event::Hello { session, hello });
        sessions.push(session);
        assert_eq!(
            sent(&actions),
            [7],
            "the small result is sent to every reporter"
        );
        let next = setup.say(session, written(7));
        given.push(sent(&next) == [8]);
    }
    assert_eq!(given, [true, true, false, false]);
    let next = setup.say(sessions[0], written(8));
    assert_eq!(
        sent(&next),
        [8],
        "sent to the third reporter when the first is done"
    );
    assert!(sent(&setup.event(Event::Tick)).is_empty());
    let next = setup.say(sessions[2], written(8));
    assert_eq!(sent(&next), [8], "then sent to the fourth reporter");
}

#[test]
fn reporter_has_at_most_its_announced_pending_results() {
    let mut setup = Setup::new(true);
    more(&mut setup, &[1; 6]);
    setup.vanish();
    let (session, actions) = setup.join();
    assert!(is_told(&actions));
    assert_eq!(
        sent(&actions),
        [8, 9, 10],
        "the results are sent in addition to the withdrawal"
    );
    assert_eq!(sent(&setup.say(session, withdrawn())), [11]);
}

#[test]
fn pending_result_is_not_sent_twice() {
    let mut setup = Setup::new(false);
    let path = setup.path.clone();
    setup.event(Event::Present { path });
    let (_, actions) = setup.join();
    assert_eq!(sent(&actions), [7]);
    let mut again = Vec::new();
    setup.state.reporters[0].queue.push_back(0);
    setup.state.deliver(0, &mut again);
    assert!(sent(&again).is_empty());
}

#[test]
fn reporter_that_does_not_leave_on_drain_is_killed() {
    let mut setup = Setup::new(true);
    let launch = setup.wants(1);
    setup.join_as(Some(launch.0));
    setup.event(Event::Drain);
    setup.event(Event::Tick);
    let late = setup.state.handle(Duration::from_secs(5), Event::Tick);
    let killed = |it: &Action| matches!(it, Action::Kill { launch: of } if *of == launch);
    assert!(late.iter().any(killed), "{late:?}");
    assert!(late.iter().any(|it| matches!(it, Action::Stop)));
}

fn not(mut report: FromPeer, why: &str) -> FromPeer {
    let (FromPeer::ResultDone { report: how, .. } | FromPeer::WithdrawalDone { report: how, .. }) =
        &mut report
    else {
        panic!("expected a report, found {report:?}");
    };
    *how = PeerReport::Failed(why.to_owned());
    report
}

#[test]
fn reporter_status_counts_written_and_failed_reports() {
    let mut setup = Setup::new(true);
    more(&mut setup, &[1, 1, 1]);
    setup.vanish();
    let (session, _) = setup.join();
    setup.say(session, written(8));
    let actions = setup.say(session, not(written(9), "no room"));
    let said = |it: &Action| matches!(it, Action::Notice(Notice::NotReported { name, .. }) if name == TEXT);
    assert!(actions.iter().any(said), "{actions:?}");
    setup.say(session, not(withdrawn(), "no rights"));
    setup.say(session, written(10));
    let status = setup.state.status();
    let peer = status.peers.iter().find(|it| it.name == TEXT).unwrap();
    assert_eq!(peer.done, 3);
    assert_eq!(peer.note, "2 not reported: no rights; retried in 1 s");
}

#[test]
fn written_report_does_not_affect_other_reporters() {
    let mut setup = Setup::new(false);
    let path = setup.path.clone();
    setup.event(Event::Present { path });
    let (session, _) = setup.join();
    let entry = setup.state.files.get_mut(0).unwrap();
    entry.delivered.push((5, Reported::Of(JobId(7))));
    setup.say(session, written(7));
    let entry = setup.state.files.get(0).unwrap();
    assert!(entry.has(5, JobId(7)) && entry.has(0, JobId(7)));
}

#[test]
fn unreadable_result_is_reported_and_makes_room_for_next() {
    let mut setup = Setup::new(true);
    more(&mut setup, &[3_000, 1]);
    let (session, actions) = setup.join();
    assert_eq!(sent(&actions), [8]);
    let actions = setup.event(Event::Undeliverable {
        session,
        job: JobId(8),
        why: "the disk is in trouble".to_owned(),
    });
    let said = |it: &Action| matches!(it, Action::Notice(Notice::NotDelivered(why)) if why.contains("trouble"));
    assert!(actions.iter().any(said), "{actions:?}");
    assert_eq!(sent(&actions), [9]);
}

/// Returns the reporters that must withdraw their report, as recorded in the journal.
fn named(actions: &[Action]) -> Vec<String> {
    let names = actions.iter().find_map(|it| match it {
        Action::Withdraw { reporters, .. } => Some(reporters.clone()),
        _ => None,
    });
    names.expect("the result is withdrawn")
}

#[test]
fn reporter_without_report_gets_no_withdrawal() {
    let mut setup = Setup::new(false);
    setup.state.reporter_index(TEXT);
    assert!(named(&setup.vanish()).is_empty());
    let (_, actions) = setup.join();
    assert!(!is_told(&actions), "{actions:?}");
}

#[test]
fn file_that_vanishes_twice_keeps_its_withdrawal() {
    for there in [false, true] {
        let mut setup = Setup::new(true);
        setup.judges_nothing();
        if there {
            setup.join();
        }
        assert_eq!(named(&setup.vanish()), [TEXT]);
        let path = setup.path.clone();
        let stamp = Stamp::default();
        setup.event(Event::Settled { path, stamp });
        assert_eq!(
            named(&setup.vanish()),
            [TEXT],
            "the reporter has not withdrawn its report yet"
        );
    }
}

#[test]
fn leaving_reporter_gets_remaining_results_on_return() {
    let mut setup = Setup::new(false);
    let path = setup.path.clone();
    setup.event(Event::Present { path });
    let (session, actions) = setup.join();
    assert_eq!(sent(&actions), [7]);
    let actions = setup.say(session, FromPeer::Leaving);
    let closed = |it: &Action| matches!(it, Action::Disconnect { session: of } if *of == session);
    assert!(actions.iter().any(closed), "{actions:?}");
    assert!(setup.state.sessions.is_empty());
    assert_eq!(sent(&setup.join().1), [7]);
}

/// Checks whether a reporter that was told to withdraw a report is killed at its limit and just
/// after it. `owes` is whether it was told, `beats` whether it sends heartbeats.
fn waited(owes: bool, beats: bool, limit: fn(&Settings) -> Duration) -> Vec<bool> {
    let mut setup = Setup::new(true);
    let launch = setup.wants(1);
    let (session, _) = setup.join_as(Some(launch.0));
    if owes {
        setup.vanish();
    }
    let start = Duration::from_secs(1);
    let end = start + limit(&setup.state.settings);
    let mut now = start;
    while beats && now + Duration::from_secs(1) < end {
        now += Duration::from_secs(1);
        let message = FromPeer::Heartbeat {
            job: None,
            checker: None,
        };
        setup.state.handle(now, Event::Message { session, message });
    }
    let killed = |it: &Action| matches!(it, Action::Kill { launch: of } if *of == launch);
    let ended = |now| setup.state.handle(now, Event::Tick).iter().any(killed);
    [end, end + Duration::from_millis(1)].map(ended).into()
}

#[test]
fn unacknowledged_reporter_times_out() {
    assert_eq!(waited(true, false, |it| it.silence_limit), [false, true]);
    assert_eq!(waited(true, true, |it| it.job_deadline), [false, true]);
    assert_eq!(waited(false, false, |it| it.job_deadline), [false, false]);
}

#[test]
fn run_ends_only_after_every_report_is_written() {
    let mut setup = Setup::new(false);
    setup.judges_nothing();
    let path = setup.path.clone();
    setup.event(Event::Present { path });
    let (session, _) = setup.join();
    assert!(!setup.state.all_delivered(), "a result is pending");
    setup.say(session, written(7));
    assert!(setup.state.all_delivered());
    setup.vanish();
    assert!(
        !setup.state.all_delivered(),
        "a report must still be withdrawn"
    );
    setup.say(session, withdrawn());
    assert!(setup.state.all_delivered());
    setup.state.reporters[0].queue.push_back(0);
    assert!(!setup.state.all_delivered(), "a result is waiting");
    setup.say(session, FromPeer::Leaving);
    assert!(setup.state.all_delivered(), "no reporter is connected");
}

#[test]
fn reporter_of_ended_process_is_missing_at_once() {
    let mut setup = Setup::new(true);
    let launch = setup.wants(1);
    setup.join_as(Some(launch.0));
    setup.event(exited(Launch(launch.0 + 1)));
    assert!(
        setup.state.reporters[0].session.is_some(),
        "another process has ended"
    );
    let actions = setup.event(exited(launch));
    assert!(setup.state.reporters[0].session.is_none());
    let said =
        |it: &Action| matches!(it, Action::Notice(Notice::Ended { name, .. }) if name == TEXT);
    assert!(actions.iter().any(said), "{actions:?}");
}

#[test]
fn failed_report_is_retried_after_pause_then_the_rest() {
    let mut setup = Setup::new(true);
    more(&mut setup, &[1; 20]);
    let (session, _) = setup.join();
    let mut given: Vec<u64> = (8..12).collect();
    while let Some(job) = given.pop() {
        given.extend(sent(&setup.say(session, not(written(job), "no room"))));
    }
    let remark = |setup: &Setup| setup.state.status().peers[0].note.clone();
    assert_eq!(remark(&setup), "20 not reported: no room; retried in 1 s");
    let after = Duration::from_secs(1) + setup.state.settings.retry_after;
    let early = setup
        .state
        .handle(after - Duration::from_millis(1), Event::Tick);
    assert!(sent(&early).is_empty(), "{early:?}");
    let mut given = sent(&setup.state.handle(after, Event::Tick));
    assert_eq!(given.len(), 4, "as many as the reporter accepts at once");
    let mut all = 0;
    while let Some(job) = given.pop() {
        all += 1;
        given.extend(sent(&setup.say(session, written(job))));
    }
    assert_eq!((all, remark(&setup)), (20, String::new()));
    assert!(setup.state.status().notices.is_empty());
}

#[test]
fn unreadable_result_is_delivered_later() {
    let mut setup = Setup::new(false);
    let path = setup.path.clone();
    setup.event(Event::Present { path });
    let (session, _) = setup.join();
    let (job, why) = (JobId(7), "the disk is in trouble".to_owned());
    setup.event(Event::Undeliverable { session, job, why });
    let after = Duration::from_secs(1) + setup.state.settings.retry_after;
    assert_eq!(sent(&setup.state.handle(after, Event::Tick)), [7]);
}

/// Lets a client wait for the verdict and the reports. Returns the resulting actions.
fn waits(setup: &mut Setup, timeout: Option<Duration>) -> Vec<Action> {
    let path = setup.path.clone();
    let reports = true;
    setup.event(Event::Wait {
        request_id: RequestId(1),
        path,
        stamp: Some(Stamp::default()),
        unwatched: None,
        until: Until { timeout, reports },
    })
}

fn answer(actions: &[Action]) -> Option<&Response> {
    actions.iter().find_map(|it| match it {
        Action::Answer { response, .. } => Some(response),
        _ => None,
    })
}

#[test]
fn client_is_answered_when_all_reports_are_written() {
    let mut setup = Setup::new(false);
    setup.makes_it_stand();
    let launch = setup.wants(1);
    let actions = waits(&mut setup, None);
    assert_eq!(answer(&actions), None, "the reporter has not joined yet");
    let (session, _) = setup.join_as(Some(launch.0));
    let failed = setup.say(session, not(written(7), "no room"));
    assert_eq!(answer(&failed), None, "the report is retried");
    let after = Duration::from_secs(1) + setup.state.settings.retry_after;
    assert_eq!(sent(&setup.state.handle(after, Event::Tick)), [7]);
    let done = setup.say(session, written(7));
    assert!(
        matches!(answer(&done), Some(Response::Verdict(_))),
        "{done:?}"
    );
}

#[test]
fn client_timeout_names_missing_report_and_reason() {
    let mut setup = Setup::new(false);
    setup.makes_it_stand();
    let launch = setup.wants(1);
    let (session, _) = setup.join_as(Some(launch.0));
    let timeout = Duration::from_millis(500);
    waits(&mut setup, Some(timeout));
    setup.say(session, not(written(7), "no room"));
    let over = Duration::from_secs(1) + timeout;
    let actions = setup.state.handle(over, Event::Tick);
    let Some(Response::Unreported { reporters, .. }) = answer(&actions) else {
        panic!("{actions:?}");
    };
    let why = "text: 1 not reported: no room; retried in 1 s";
    assert_eq!(reporters, &[why]);
}

#[test]
fn client_does_not_wait_for_reports_without_reporter() {
    let mut setup = Setup::new(false);
    setup.makes_it_stand();
    let actions = waits(&mut setup, None);
    assert!(
        matches!(answer(&actions), Some(Response::Verdict(_))),
        "{actions:?}"
    );
}

#[test]
fn client_is_answered_when_owing_reporter_is_removed() {
    let mut setup = Setup::new(false);
    setup.makes_it_stand();
    setup.wants(1);
    assert_eq!(answer(&waits(&mut setup, None)), None);
    setup.event(Event::Children { specs: Vec::new() });
    let actions = setup.event(Event::Tick);
    assert!(
        matches!(answer(&actions), Some(Response::Verdict(_))),
        "{actions:?}"
    );
}
