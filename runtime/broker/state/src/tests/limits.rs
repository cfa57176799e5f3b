//! Tests of the exact time limits and size limits of a bundle.

use qcbus_document::FileKind;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Metadata;
use qcbus_messages::{Catalogue, CheckerEnd};
use qcbus_types::{facts_weight, weight};

use super::*;

/// Returns a world in which a bundle has one job.
fn busy() -> (World, SessionId, JobId) {
    let world = World::at_work();
    let session = world.nth_peer(0).unwrap();
    let job = *world.peers[&session].jobs.first().unwrap();
    (world, session, job)
}

/// Asserts that the bundle is ended exactly after this limit, while `meanwhile` runs every second.
/// Returns the reason of the end.
fn is_ended_after(
    world: &mut World,
    limit: Duration,
    mut meanwhile: impl FnMut(&mut World),
) -> String {
    let end = world.now + limit;
    while world.now + Duration::from_secs(1) < end {
        world.pass(Duration::from_secs(1));
        meanwhile(world);
    }
    world.pass(end - world.now);
    assert!(!world.peers.is_empty(), "not closed before the time limit");
    world.pass(Duration::from_millis(1));
    assert!(world.peers.is_empty(), "closed at the time limit");
    let notice = world.state.notices.back().map(|(it, _)| it.why());
    notice.unwrap_or_default()
}

fn alive(world: &mut World) {
    let beat = FromPeer::Heartbeat {
        job: None,
        checker: None,
    };
    if let Some(session) = world.nth_peer(0) {
        world.say(session, beat);
    }
}

#[test]
fn silent_bundle_with_job_is_ended() {
    let (mut world, ..) = busy();
    let limit = world.state.settings.silence_limit;
    let why = is_ended_after(&mut world, limit, |_| {});
    assert!(why.contains("sent nothing"), "{why}");
}

#[test]
fn bundle_with_unfinished_job_is_ended_at_deadline() {
    let (mut world, ..) = busy();
    let limit = world.state.settings.job_deadline;
    let why = is_ended_after(&mut world, limit, alive);
    assert!(why.contains("did not finish a job"), "{why}");
}

#[test]
fn idle_bundle_may_stay_silent() {
    let mut world = World::new();
    world.join("First");
    world.pass(Duration::from_secs(100_000));
    assert_eq!(world.peers.len(), 1);
}

#[test]
fn bundle_without_catalogue_is_ended() {
    let mut world = World::new();
    world.join("First");
    let session = world.nth_peer(0).unwrap();
    // This simulates a missing catalogue.
    world.state.bundles.get_mut("First").unwrap().ready = false;
    let limit = world.state.settings.silence_limit;
    let why = is_ended_after(&mut world, limit, |_| {});
    assert!(why.contains("did not register its checkers"), "{why}");
    assert!(!world.state.sessions.contains_key(&session));
}

#[test]
fn forgotten_job_times_out_despite_later_jobs() {
    let (mut world, session, _) = busy();
    world.write(4);
    world.prepare(0, true);
    let later = *world.peers[&session].jobs.last().unwrap();
    world.peers.get_mut(&session).unwrap().jobs.remove(&later);
    world.say(
        session,
        FromPeer::JobDone {
            job: later,
            micros: 1,
        },
    );
    let limit = world.state.settings.job_deadline;
    // Further jobs come and go, so that the bundle is never idle.
    let why = is_ended_after(&mut world, limit, |world| {
        world.state.bundles.get_mut("First").unwrap().moved = world.now;
        alive(world);
    });
    assert!(
        why.contains("did not finish a job, but finished a later one"),
        "{why}"
    );
}

#[test]
fn drained_bundle_is_ended_after_leave_limit() {
    let mut world = World::new();
    world.join("First");
    world.state.drain_peer("First", &mut Vec::new());
    let limit = draining::LEAVE_LIMIT;
    let why = is_ended_after(&mut world, limit, alive);
    assert!(why.contains("asked to leave"), "{why}");
}

#[test]
fn protocol_violations_beyond_limit_end_session() {
    let (mut world, session, _) = busy();
    let lie = |world: &mut World| {
        let job = JobId(1 << 40);
        world.say(session, FromPeer::JobDone { job, micros: 1 });
    };
    for _ in 0..64 {
        lie(&mut world);
    }
    assert!(world.peers.contains_key(&session));
    lie(&mut world);
    assert!(!world.peers.contains_key(&session));
}

#[test]
fn findings_for_unknown_checker_or_ended_job_are_ignored() {
    let (mut world, session, job) = busy();
    let issues = |checker| FromPeer::Issues {
        job,
        checker,
        issues: vec![finding()],
    };
    world.say(session, issues(1));
    world.say(session, issues(2));
    let task = &world.state.jobs[&job].tasks["First"];
    assert_eq!(task.pending.keys().copied().collect::<Vec<_>>(), [1]);
    assert_eq!(world.state.bundles["First"].offences, 1);
    world.say(session, FromPeer::JobDone { job, micros: 1 });
    world.say(session, issues(1));
    let task = world.state.jobs.get(&job).map(|it| &it.tasks["First"]);
    let kept = task.and_then(|it| it.pending.get(&1));
    assert!(kept.is_none_or(|it| it.issues.len() == 1));
}

#[test]
fn reported_findings_are_bounded_by_number_and_weight() {
    let each = weight(&finding());
    for (issues, bytes, kept) in [
        (3, usize::MAX, 3),
        (10, 4 * each, 4),
        (10, 4 * each - 1, 3),
        (10, 10 * each, 5),
    ] {
        let (mut world, session, job) = busy();
        world.state.settings.max_issues = issues;
        world.state.settings.max_pending_bytes = bytes;
        world.say(
            session,
            FromPeer::Issues {
                job,
                checker: 0,
                issues: vec![finding(); 5],
            },
        );
        let pending = &world.state.jobs[&job].tasks["First"].pending[&0];
        assert_eq!(pending.issues.len(), kept);
        assert_eq!(pending.withheld, 5 - kept as u64);
    }
}

#[test]
fn finished_jobs_of_bundle_are_counted() {
    let mut world = World::new();
    world.join("First");
    for file in [0, 4] {
        world.write(file);
    }
    world.until_judged(2);
    let status = world.state.status();
    let first = status.peers.iter().find(|it| it.name == "First").unwrap();
    assert_eq!(first.done, 2);
}

fn done(job: JobId, checker: u32, value: &str, facts: usize) -> FromPeer {
    let fact = Metadata {
        key: "key".to_owned(),
        value: value.to_owned(),
        description: String::new(),
    };
    FromPeer::CheckersDone {
        job,
        ended: vec![CheckerEnd {
            checker,
            ending: Ending::Completed,
            params: Vec::new(),
            metadata: vec![fact; facts],
        }],
    }
}

/// Returns the ending of a checker in the task, and the number of facts of its run that are kept.
fn kept(world: &World, job: JobId, checker: u32) -> (Ending, usize) {
    let pending = &world.state.jobs[&job].tasks["First"].pending[&checker];
    let (ending, params, metadata) = pending.done.clone().unwrap();
    (ending, params.len() + metadata.len())
}

#[test]
fn checker_with_too_much_metadata_fails() {
    let one = facts_weight(&[], &[Metadata::default()]) + "key".len();
    for (text, facts, is_kept) in [
        ("", 0, true),
        ("", 10, true),
        ("", 11, false),
        (&*"x".repeat(10 * one), 1, false),
        (&*"x".repeat(9 * one), 1, true),
    ] {
        let (mut world, session, job) = busy();
        world.state.settings.max_facts = 10 * one;
        world.say(session, done(job, 0, text, facts));
        let (ending, left) = kept(&world, job, 0);
        assert_eq!(
            (ending.is_open(), left),
            if is_kept { (false, facts) } else { (true, 0) }
        );
        assert!(
            is_kept || ending.reason().contains("metadata"),
            "{ending:?}"
        );
        // Only this checker has failed, and no other.
        world.say(session, done(job, 1, "", 0));
        assert_eq!(kept(&world, job, 1).0, Ending::Completed);
    }
}

#[test]
fn checker_endings_count_to_memory_limit() {
    let (mut world, session, job) = busy();
    let fact = facts_weight(&[], &[Metadata::default()]) + "key".len();
    world.state.settings.max_pending_bytes = 3 * fact;
    world.say(session, done(job, 0, "", 2));
    assert_eq!(
        world.state.jobs[&job].tasks["First"].pending_bytes,
        2 * fact
    );
    world.say(session, done(job, 1, "", 2));
    assert!(
        kept(&world, job, 1).0.is_open(),
        "there is no room for the second outcome"
    );
    // A repeated message replaces the earlier one.
    world.say(session, done(job, 0, "", 1));
    world.say(session, done(job, 1, "", 2));
    assert_eq!(kept(&world, job, 1), (Ending::Completed, 2));
    assert_eq!(
        world.state.jobs[&job].tasks["First"].pending_bytes,
        3 * fact
    );
}

#[test]
fn reasons_and_blocking_checkers_count_to_weight() {
    let (mut world, session, job) = busy();
    world.state.settings.max_pending_bytes = 100_000;
    for by in [vec!["x".repeat(4000); 60], vec!["x".repeat(4000); 6000]] {
        let ending = Ending::Blocked {
            by,
            reason: "y".repeat(1 << 20),
        };
        world.say(
            session,
            FromPeer::CheckersDone {
                job,
                ended: vec![CheckerEnd {
                    checker: 0,
                    ending,
                    params: Vec::new(),
                    metadata: Vec::new(),
                }],
            },
        );
        let task = &world.state.jobs[&job].tasks["First"];
        assert!((30_000..60_000).contains(&task.pending_bytes));
        assert!(kept(&world, job, 0).0.is_open());
    }
}

#[test]
fn repeatedly_requested_document_is_published_rarely() {
    let (mut world, session, job) = busy();
    let doc = qcbus_messages::DocId(job.0);
    let mut published = 0;
    let second = Duration::from_secs(1);
    for _ in 0..1000 {
        world.now += second / 1000;
        let message = FromPeer::NeedDocument { doc };
        let actions = world
            .state
            .handle(world.now, Event::Message { session, message });
        let again = |it: &&Action| matches!(it, Action::PublishAgain { .. });
        published += actions.iter().filter(again).count();
    }
    assert_eq!(published, 4);
}

#[test]
fn catalogue_beyond_limits_is_refused() {
    type Change = fn(&mut Catalogue);
    let changes: [(&str, Change); 9] = [
        ("names", |it| {
            it.checkers[0].id = "a\nimportant.xodr: accepted".into();
        }),
        ("names", |it| {
            it.checkers[0].rule_uids = ["\u{1b}[2K"].into_iter().collect();
        }),
        ("names", |it| it.alias = "\u{202e}".into()),
        ("names", |it| it.build_date = "x".repeat(257)),
        ("bytes", |it| it.description = "x".repeat(1 << 20)),
        ("bytes", |it| it.kinds = vec![FileKind::Xodr; (1 << 20) + 1]),
        ("bytes", |it| {
            it.checkers[0].rule_uids = std::iter::repeat_n("", 50_000).collect();
        }),
        ("checkers", |it| {
            it.checkers = vec![it.checkers[0].clone(); 4097];
        }),
        ("duplicate", |it| {
            it.checkers[1].id = it.checkers[0].id.clone();
        }),
    ];
    for (word, change) in changes {
        let mut world = World::new();
        world.join("First");
        let session = world.nth_peer(0).unwrap();
        let mut said = catalogue("First");
        change(&mut said);
        world.say(session, FromPeer::Catalogue(Box::new(said)));
        assert!(!world.peers.contains_key(&session), "{word}");
        let why = world.state.notices.back().unwrap().0.to_string();
        assert!(why.contains(word), "{why}");
        assert!(!why.chars().any(qcbus_messages::shown::moves), "{why:?}");
    }
}

#[test]
fn number_of_known_names_is_limited() {
    let mut world = World::new();
    let mut is_refused = |name: &str, role: Role| {
        let session = SessionId(99);
        let hello = qcbus_messages::Hello {
            role,
            ..hello(session, name, 1, None)
        };
        let actions = world
            .state
            .handle(world.now, Event::Hello { session, hello });
        actions.iter().any(|it| matches!(it, Action::Refuse { .. }))
    };
    for role in [Role::Bundle, Role::Reporter] {
        let refused = (0..300).filter(|it| is_refused(&format!("{role:?}{it}"), role));
        assert_eq!(refused.count(), 300 - 256);
        assert!(
            !is_refused(&format!("{role:?}0"), role),
            "a known name is accepted"
        );
    }
}
