//! How long a bundle is waited for, how much it may say, and that it is no moment or word less.

use super::*;

/// A world in which a bundle has one job.
fn busy() -> (World, SessionId, JobId) {
    let world = World::at_work();
    let session = world.nth_peer(0).unwrap();
    let job = *world.peers[&session].jobs.first().unwrap();
    (world, session, job)
}

/// It is waited for exactly that long, while `meanwhile` goes on every second; what it is ended for.
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
    assert!(!world.peers.is_empty(), "not before its time");
    world.pass(Duration::from_millis(1));
    assert!(world.peers.is_empty(), "not after its time");
    let notice = world.state.notices.back().map(Notice::why);
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
fn a_bundle_with_a_job_that_says_nothing_is_silent() {
    let (mut world, ..) = busy();
    let limit = world.state.settings.silence_limit;
    let why = is_ended_after(&mut world, limit, |_| {});
    assert!(why.contains("said nothing"), "{why}");
}

#[test]
fn a_bundle_that_does_not_end_a_job_is_ended_at_the_deadline() {
    let (mut world, ..) = busy();
    let limit = world.state.settings.job_deadline;
    let why = is_ended_after(&mut world, limit, alive);
    assert!(why.contains("did not end a job"), "{why}");
}

#[test]
fn a_bundle_without_a_job_may_be_as_silent_as_it_likes() {
    let mut world = World::new();
    world.join("First");
    world.pass(Duration::from_secs(100_000));
    assert_eq!(world.peers.len(), 1);
}

#[test]
fn a_bundle_that_never_says_what_it_checks_is_ended() {
    let mut world = World::new();
    world.join("First");
    let session = world.nth_peer(0).unwrap();
    // As if its catalogue had not come.
    world.state.bundles.get_mut("First").unwrap().ready = false;
    let limit = world.state.settings.silence_limit;
    let why = is_ended_after(&mut world, limit, |_| {});
    assert!(why.contains("never said what it checks"), "{why}");
    assert!(!world.state.sessions.contains_key(&session));
}

#[test]
fn a_job_that_is_overtaken_has_the_time_of_one_job() {
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
    // Further jobs come and go, so that it is never idle.
    let why = is_ended_after(&mut world, limit, |world| {
        world.state.bundles.get_mut("First").unwrap().moved = world.now;
        alive(world);
    });
    assert!(why.contains("forgot a job"), "{why}");
}

#[test]
fn a_bundle_that_was_told_to_go_has_its_time() {
    let mut world = World::new();
    world.join("First");
    world.state.drain_peer("First", &mut Vec::new());
    let limit = leaving::LEAVE_LIMIT;
    let why = is_ended_after(&mut world, limit, alive);
    assert!(why.contains("told to go"), "{why}");
}

#[test]
fn so_many_lies_are_forgiven_and_no_more() {
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
fn words_on_a_checker_that_was_not_offered_or_a_job_that_is_over_count_for_nothing() {
    let (mut world, session, job) = busy();
    let issues = |checker| FromPeer::Issues {
        job,
        checker,
        issues: vec![finding()],
    };
    world.say(session, issues(1));
    world.say(session, issues(2));
    let share = &world.state.jobs[&job].shares["First"];
    assert_eq!(share.staged.keys().copied().collect::<Vec<_>>(), [1]);
    assert_eq!(world.state.bundles["First"].offences, 1);
    world.say(session, FromPeer::JobDone { job, micros: 1 });
    world.say(session, issues(1));
    let share = world.state.jobs.get(&job).map(|it| &it.shares["First"]);
    let kept = share.and_then(|it| it.staged.get(&1));
    assert!(kept.is_none_or(|it| it.issues.len() == 1));
}

#[test]
fn what_a_bundle_may_report_is_bounded_by_number_and_by_weight() {
    let each = weight(&finding());
    for (issues, bytes, kept) in [
        (3, usize::MAX, 3),
        (10, 4 * each, 4),
        (10, 4 * each - 1, 3),
        (10, 10 * each, 5),
    ] {
        let (mut world, session, job) = busy();
        world.state.settings.max_issues = issues;
        world.state.settings.max_staged_bytes = bytes;
        world.say(
            session,
            FromPeer::Issues {
                job,
                checker: 0,
                issues: vec![finding(); 5],
            },
        );
        let staged = &world.state.jobs[&job].shares["First"].staged[&0];
        assert_eq!(staged.issues.len(), kept);
        assert_eq!(staged.withheld, 5 - kept as u64);
    }
}

#[test]
fn what_a_bundle_has_done_is_counted() {
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
