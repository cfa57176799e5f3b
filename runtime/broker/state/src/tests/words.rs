//! Messages of bundles and answers to clients, and their effects.

use qcbus_messages::control::Response;
use qcbus_messages::{Hello, PROTOCOL_VERSION};
use qcbus_types::{ChildEnd, PrepareFailure, StoreOutcome, Until};

use super::*;

/// Handles an event and returns all its actions. The world does not execute them.
pub(super) fn comes_of(world: &mut World, event: Event) -> Vec<Action> {
    world.state.handle(world.now, event)
}

fn a_hello(name: &str) -> Hello {
    hello(SessionId(99), name, 1, None)
}

fn is_refused(actions: &[Action]) -> bool {
    let refused = actions.iter().any(|it| matches!(it, Action::Refuse { .. }));
    let accepted = actions.iter().any(|it| matches!(it, Action::Accept { .. }));
    assert_ne!(refused, accepted);
    refused
}

#[test]
fn hello_with_invalid_name_or_protocol_is_refused() {
    let strange = Hello {
        protocol: PROTOCOL_VERSION + 1,
        ..a_hello("Mine")
    };
    let long = "x".repeat(65);
    let hellos = [
        (a_hello("Mine"), false),
        (a_hello("M1.n-e_"), false),
        (a_hello(&long[1..]), false),
        (strange, true),
        (a_hello(""), true),
        (a_hello(&long), true),
        (a_hello("my own"), true),
        (a_hello("First"), true),
    ];
    for (hello, refused) in hellos {
        let mut world = World::new();
        world.join("First");
        let shown = format!("{hello:?}");
        let session = SessionId(99);
        let actions = comes_of(&mut world, Event::Hello { session, hello });
        assert_eq!(is_refused(&actions), refused, "{shown}");
    }
}

#[test]
fn second_process_with_invisible_pid_is_refused() {
    let mut world = World::new();
    for (session, refused) in [(98, false), (99, true)] {
        let session = SessionId(session);
        let hello = Hello {
            incarnation: session.0,
            pid: 0,
            ..a_hello("far")
        };
        let actions = world
            .state
            .handle(world.now, Event::Hello { session, hello });
        assert_eq!(is_refused(&actions), refused, "{actions:?}");
    }
}

#[test]
fn process_that_rejoins_takes_its_own_place() {
    let mut world = World::new();
    world.join("First");
    let (incarnation, pid) = (
        world.sessions,
        u32::try_from(world.sessions).unwrap() + 1000,
    );
    for (incarnation, pid) in [(incarnation, 1099), (99, pid)] {
        let hello = Hello {
            incarnation,
            pid,
            ..a_hello("First")
        };
        let session = SessionId(99);
        let actions = world
            .state
            .handle(world.now, Event::Hello { session, hello });
        assert!(!is_refused(&actions));
        world = World::new();
        world.join("First");
    }
}

#[test]
fn catalogue_with_duplicate_checker_is_refused() {
    let mut unsound = [catalogue("First"), catalogue("First")];
    unsound[0].checkers[1].id = unsound[0].checkers[0].id.clone();
    unsound[1].checkers[0].id = "".into();
    for catalogue in unsound {
        let mut world = World::new();
        world.join("First");
        let (session, _) = world.peers.first_key_value().unwrap();
        let session = *session;
        world.say(session, FromPeer::Catalogue(Box::new(catalogue)));
        assert!(!world.peers.contains_key(&session));
    }
}

#[test]
fn document_is_published_again_only_for_its_job() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.prepare(0, true);
    let (session, process) = world.peers.first_key_value().unwrap();
    let (session, job) = (*session, *process.jobs.first().unwrap());
    for (doc, known) in [(job.0, true), (job.0 + 1, false)] {
        let doc = qcbus_messages::DocId(doc);
        let message = FromPeer::NeedDocument { doc };
        let actions = comes_of(&mut world, Event::Message { session, message });
        let again = |it: &Action| matches!(it, Action::PublishAgain { job: of, doc: it } if (*of, *it) == (job, doc));
        assert_eq!(actions.iter().any(again), known, "{actions:?}");
    }
}

#[test]
fn invalid_message_ends_the_session() {
    let mut world = World::new();
    world.join("First");
    let (session, _) = world.peers.first_key_value().unwrap();
    let known = *session;
    for session in [known, SessionId(99)] {
        let what = "noise".to_owned();
        let actions = comes_of(&mut world, Event::Garbage { session, what });
        let closed =
            |it: &Action| matches!(it, Action::Disconnect { session: it } if *it == session);
        assert!(actions.iter().any(closed), "{actions:?}");
    }
    assert!(world.state.bundles["First"].session.is_none());
    assert!(
        world.state.bundles["First"].origin.is_some(),
        "the bundle is still required"
    );
}

#[test]
fn unreadable_file_is_undetermined() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    let (job, _) = world.preparing.remove(0);
    let failure = PrepareFailure::Unreadable("it is a directory".to_owned());
    let result = Err(failure);
    world.event(Event::Prepared { job, result });
    let finished = &world.storing[0];
    assert_eq!(finished.unreadable.as_deref(), Some("it is a directory"));
    assert!(
        finished.prepared.is_none(),
        "there are no documents to refer to"
    );
    assert_eq!(named(&finished.required_set), world.expected_set());
    let failure = finished.bundles[0].failure.as_deref();
    assert_eq!(failure, Some("it is a directory"));
}

#[test]
fn file_without_room_on_bus_is_retried_after_pause() {
    let failures = [
        PrepareFailure::Busy,
        PrepareFailure::NoRoom("full".to_owned()),
    ];
    for failure in failures {
        let mut world = World::new();
        world.join("First");
        world.write(0);
        let (job, _) = world.preparing.remove(0);
        let pause = match failure {
            PrepareFailure::Busy => world.state.settings.busy_pause,
            _ => world.state.settings.retry_after,
        };
        let result = Err(failure);
        world.event(Event::Prepared { job, result });
        let moment = Duration::from_millis(1);
        world.pass(pause - moment);
        assert!(world.preparing.is_empty(), "not yet");
        world.pass(moment);
        assert_eq!(world.preparing.len(), 1);
    }
}

#[test]
fn restored_file_is_rewritten_if_another_result_was_begun() {
    let mut world = World::new();
    world.join("First");
    let (content, other) = (1, 2);
    world.put(0, content);
    world.until_stored(1);
    world.put(0, other);
    world.prepare(0, true);
    world.answer(0);
    // The result file is written. Only the journal could not be written.
    world.store(0, false);
    world.put(0, content);
    world.pass(world.state.settings.retry_after);
    world.store(0, true);
    assert_eq!(world.stored.len(), 1, "a stale result is not stored");
    world.until_stored(2);
    world.put(0, content);
    world.prepare(0, true);
    assert!(
        world.storing.is_empty() && world.stored.len() == 2,
        "the stored result matches the file"
    );
}

#[test]
fn ended_job_retries_one_file_waiting_for_bus() {
    let mut world = World::at_work();
    for file in [1, 2] {
        world.write(file);
        let (job, _) = world.preparing.remove(0);
        let result = Err(PrepareFailure::Busy);
        world.event(Event::Prepared { job, result });
    }
    let waiting = |world: &World| world.preparing.iter().map(|it| it.1).collect::<Vec<_>>();
    assert!(waiting(&world).is_empty(), "no job has ended yet");
    world.until_judged(1);
    assert_eq!(
        waiting(&world),
        [1],
        "only the file that came first is retried"
    );
    let pause = world.state.settings.busy_pause;
    world.pass(pause);
    assert_eq!(waiting(&world), [1, 2]);
}

#[test]
fn temporary_read_error_is_retried_and_then_reported() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    let hinder = |world: &mut World| {
        let (job, _) = world.preparing.remove(0);
        let result = Err(PrepareFailure::Moment("too many open files".to_owned()));
        world.event(Event::Prepared { job, result });
    };
    let settings = world.state.settings.clone();
    let mut pause = settings.moment_pause;
    let tick = Duration::from_millis(1);
    while pause <= settings.moment_pause_max {
        hinder(&mut world);
        world.pass(pause - tick);
        assert!(world.preparing.is_empty(), "not yet");
        assert!(world.storing.is_empty(), "nothing is stored yet");
        world.pass(tick);
        pause *= 2;
    }
    hinder(&mut world);
    assert!(world.preparing.is_empty());
    let finished = &world.storing[0];
    assert_eq!(finished.unreadable.as_deref(), Some("too many open files"));
    // The next successful reading clears the failure.
    let job = world.storing.remove(0).job;
    let outcome = StoreOutcome::Stale {
        half_written: false,
    };
    world.event(Event::Stored { job, outcome });
    world.prepare(0, true);
    world.answer(0);
    assert_eq!(world.storing.len(), 1);
    assert_eq!(world.storing[0].unreadable, None);
}

#[test]
fn file_without_room_is_undetermined_after_long_standstill() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.write(4);
    let no_room = || Err(PrepareFailure::NoRoom("full".to_owned()));
    let limit = world.state.settings.room_limit;
    let begun = world.now;
    while world.storing.is_empty() {
        assert!(world.now <= begun + limit + 2 * world.state.settings.retry_after);
        match world.preparing.pop() {
            Some((job, _)) => world.event(Event::Prepared {
                job,
                result: no_room(),
            }),
            None => world.pass(world.state.settings.retry_after),
        }
    }
    assert!(world.now >= begun + limit);
    let why = "full; no room became free for 60 seconds";
    assert_eq!(world.storing[0].unreadable.as_deref(), Some(why));
    // A file that has waited as long does not wait as long again.
    let (job, _) = world.preparing.pop().unwrap();
    world.event(Event::Prepared {
        job,
        result: no_room(),
    });
    assert_eq!(world.storing.len(), 2);
}

#[test]
fn file_without_room_waits_while_another_is_checked() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.prepare(0, true);
    world.write(4);
    let begun = world.now;
    while world.now < begun + world.state.settings.room_limit / 2 {
        if let Some((job, _)) = world.preparing.pop() {
            let result = Err(PrepareFailure::NoRoom("full".to_owned()));
            world.event(Event::Prepared { job, result });
        }
        world.pass(world.state.settings.retry_after);
    }
    assert!(world.storing.is_empty() && world.state.stuck_since.is_none());
}

#[test]
fn checker_with_too_many_findings_is_not_completed() {
    let mut world = World::new();
    world.state.settings.max_issues = 1;
    world.join("First");
    for (file, findings, completed) in [(0, 1, true), (4, 2, false)] {
        world.write(file);
        world.prepare(0, true);
        world.answer(findings);
        let finished = world.storing.pop().unwrap();
        for checker in finished.bundles[0].said().checkers {
            assert_eq!(checker.issues.len(), 1);
            let ending = checker.ending.as_ref().unwrap();
            let is_completed = *ending == qcbus_formats::pool::Ending::Completed;
            assert_eq!(is_completed, completed, "{ending:?}");
        }
    }
}

fn answer(action: &Action) -> Option<&Response> {
    match action {
        Action::Answer { response, .. } => Some(response),
        _ => None,
    }
}

pub(super) fn answers(actions: &[Action]) -> Vec<&Response> {
    actions.iter().filter_map(answer).collect()
}

pub(super) fn waits(file: u8, unwatched: Option<String>, stamp: Option<Stamp>) -> Event {
    Event::Wait {
        request_id: RequestId(9),
        path: path_of(file),
        stamp,
        unwatched,
        until: Until::default(),
    }
}

#[test]
fn client_waiting_for_unchecked_file_is_informed() {
    let mut world = judged_world();
    let why = Some("it is ignored".to_owned());
    let actions = comes_of(&mut world, waits(4, why, None));
    assert!(matches!(
        answers(&actions)[..],
        [Response::Unwatched { .. }]
    ));
    let actions = comes_of(&mut world, waits(4, None, None));
    assert!(answers(&actions).is_empty());
    world.write(4);
    let path = path_of(4);
    let actions = comes_of(&mut world, Event::Vanished { path });
    assert!(answers(&actions).is_empty(), "the file is being read");
    let (job, _) = world.preparing.remove(0);
    let result = Err(PrepareFailure::Vanished);
    let actions = comes_of(&mut world, Event::Prepared { job, result });
    assert!(matches!(
        answers(&actions)[..],
        [Response::Unwatched { .. }]
    ));
}

#[test]
fn client_waiting_for_vanished_file_gets_no_old_verdict() {
    let mut world = judged_world();
    world.write(1);
    world.wait(1);
    // No event reports the removal. The reader finds no file.
    world.there.remove(&path_of(1));
    let (job, _) = world.preparing.remove(0);
    let result = Err(PrepareFailure::Vanished);
    let actions = comes_of(&mut world, Event::Prepared { job, result });
    let answers = answers(&actions);
    assert!(
        matches!(answers[..], [Response::Unwatched { .. }]),
        "{answers:?}"
    );
}

/// While a result is being written, a client's request looks at the inputs of this result, and not
/// at those of the previous one.
#[test]
fn inputs_of_result_being_written_are_known() {
    let mut world = World::new();
    world.join("First");
    for file in [6, 2] {
        world.there.insert(path_of(file), u64::from(file));
        world.contents.insert(u64::from(file), u64::from(file));
    }
    world.put(2, 20);
    assert!(
        world.state.inputs_of(&path_of(2)).is_empty(),
        "no file is read yet"
    );
    world.prepare(0, true);
    world.answer(0);
    assert_eq!(world.storing.len(), 1);
    let read = world.inputs(2);
    assert_eq!(world.state.inputs_of(&path_of(2)), read);
    world.store(0, true);
    assert_eq!(world.state.inputs_of(&path_of(2)), read);
}

#[test]
fn client_waiting_for_restored_file_gets_no_vanished_answer() {
    let mut world = judged_world();
    world.write(1);
    let (job, _) = world.preparing.remove(0);
    // The reader found no file, but now the file is back.
    world.write(1);
    world.wait(1);
    let result = Err(PrepareFailure::Vanished);
    let actions = comes_of(&mut world, Event::Prepared { job, result });
    assert!(answers(&actions).is_empty());
    let reads = |it: &Action| matches!(it, Action::Prepare { path, .. } if *path == path_of(1));
    assert!(actions.iter().any(reads), "{actions:?}");
}

#[test]
fn client_waiting_for_standing_verdict_is_answered_at_once() {
    let mut world = judged_world();
    let now = stamp(world.there[&path_of(1)]);
    let actions = comes_of(&mut world, waits(1, None, Some(now)));
    assert!(matches!(answers(&actions)[..], [Response::Verdict(_)]));
    let changed = Some(stamp(1000));
    let actions = comes_of(&mut world, waits(1, None, changed));
    assert!(answers(&actions).is_empty());
}

#[test]
fn files_with_waiting_clients_are_checked_first() {
    let mut world = World::new();
    world.state.settings.max_active = 1;
    world.join("First");
    for file in 0..6 {
        world.write(file);
    }
    world.until_judged(6);
    world.join("Second");
    let under_way = world.preparing[0].1;
    // This file depends on no other file that needs a verdict first.
    let alone = |file: &u8| dependencies_of(*file).iter().all(|it| *it >= 6);
    let mut others = (0..6).rev().filter(|file| *file != under_way);
    let last = others.find(alone).unwrap();
    world.wait(last);
    world.until_stored(8);
    assert!(!world.waiting.values().any(|file| *file == last));
}

#[test]
fn client_waiting_for_missing_file_gets_no_old_verdict() {
    let came_back: fn(&mut World) = |world| {
        let (path, stamp) = (path_of(1), stamp(world.there[&path_of(1)]));
        world.event(Event::Settled { path, stamp });
    };
    let went: fn(&mut World) = |world| world.delete(1);
    for ends in [came_back, went] {
        let mut world = judged_world();
        let request_id = RequestId(7);
        world.waiting.insert(request_id, 1);
        // The directory is away, so the verdict is kept.
        world.event(Event::Wait {
            request_id,
            path: path_of(1),
            stamp: None,
            unwatched: None,
            until: Until::default(),
        });
        world.pass(Duration::from_secs(30));
        assert!(world.waiting.contains_key(&request_id));
        ends(&mut world);
        assert!(
            !world.waiting.contains_key(&request_id),
            "the client has an answer"
        );
    }
}

#[test]
fn findings_of_killed_process_are_discarded() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.prepare(0, true);
    world.begin(0);
    world.kill(0);
    world.join("First");
    world.pass(Duration::from_secs(1));
    world.answer(0);
    let said = &world.storing[0].bundles[0].said();
    let found: Vec<usize> = said.checkers.iter().map(|it| it.issues.len()).collect();
    assert_eq!(found, [0, 0], "the second process found nothing");
}

#[test]
fn reading_is_limited_by_room_for_documents() {
    // Limit of documents, and files that are in work at the same time.
    for (documents, at_once) in [(48, 4), (3, 3)] {
        let mut world = World::new();
        world.state.settings.max_documents = documents;
        world.join("First");
        for file in [0, 4, 6, 7, 2, 1] {
            world.write(file);
        }
        assert_eq!(world.preparing.len(), 2, "no more files are read at a time");
        while !world.preparing.is_empty() {
            world.prepare(0, true);
            assert!(world.preparing.len() <= 2);
        }
        assert_eq!(world.state.jobs.len(), at_once);
        world.settle();
    }
}

#[test]
fn missing_room_is_reported_only_occasionally() {
    let mut world = World::new();
    world.join("First");
    let said = |world: &World| {
        let notices = world.state.notices.iter();
        notices.filter(|it| it.0.kind() == "no-room").count()
    };
    for file in [0, 4] {
        world.write(file);
        world.prepare(0, false);
        assert_eq!(said(&world), 1);
    }
    world.settle();
}

#[test]
fn file_changed_while_read_is_given_to_no_bundle() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.write(0);
    world.prepare(0, true);
    assert!(world.peers.values().all(|it| it.jobs.is_empty()));
    world.prepare(0, true);
    assert!(world.peers.values().any(|it| !it.jobs.is_empty()));
}

#[test]
fn run_does_not_wait_for_reporter_that_cannot_start() {
    let mut world = World::with_a_reporter();
    world.state.settings.once = true;
    world.join("First");
    world.write(0);
    world.until_judged(1);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 0, "the reporter may still start");
    world.child_ends(ChildEnd::NotStarted("no such program".to_owned()));
    world.pass(Duration::ZERO);
    world.answer(0);
    world.pass(Duration::from_secs(4));
    assert_eq!(world.stopped, 1);
}

#[test]
fn confirmed_verdict_of_missing_file_is_not_sent() {
    let mut world = judged_world();
    let waits = Event::Wait {
        request_id: RequestId(7),
        path: path_of(1),
        stamp: None,
        unwatched: None,
        until: Until::default(),
    };
    let answered = |it: &Action| matches!(it, Action::Answer { .. });
    assert!(!comes_of(&mut world, waits).iter().any(answered));
    // The file waits for another judgement. When it can start, the judgement is no longer required.
    world.state.settings.max_active = 0;
    world.join("Third");
    world.remove("Third");
    world.leave(world.peers.len() as u8 - 1);
    world.state.settings.max_active = 4;
    let actions = comes_of(&mut world, Event::Tick);
    let confirmed = |it: &Action| matches!(it, Action::Judged { fresh: false, .. });
    assert!(actions.iter().any(confirmed), "{actions:?}");
    assert!(!actions.iter().any(answered), "{actions:?}");
}
