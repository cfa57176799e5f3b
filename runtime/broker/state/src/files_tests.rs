use super::*;

fn files(count: u32) -> Files {
    let mut files = Files::default();
    for number in 0..count {
        let path: Arc<Path> = Path::new(&format!("/x/{number}.xodr")).into();
        files.insert(&path, FileKind::Xodr, Stamp::default());
    }
    files
}

fn at(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

fn taken(files: &mut Files, now: Duration) -> Vec<FileId> {
    std::iter::from_fn(|| files.dequeue(now)).collect()
}

#[test]
fn waiting_files_are_counted_per_queue() {
    let mut files = files(5);
    files.enqueue(0, Priority::Fresh, at(1));
    files.enqueue(1, Priority::Background, at(1));
    files.enqueue(2, Priority::Background, at(1));
    files.set_stage(3, Stage::Active(JobId(7)));
    let counts = |fresh, background, active, idle| Counts {
        fresh,
        background,
        active,
        idle,
    };
    assert_eq!(files.counts(), counts(1, 2, 1, 1));
    // A client waits for it now.
    files.enqueue(1, Priority::Fresh, at(2));
    assert_eq!(files.counts(), counts(2, 1, 1, 1));
    files.remove(0);
    files.remove(4);
    assert_eq!(files.counts(), counts(1, 1, 1, 0));
}

#[test]
fn queue_is_quiet_when_nothing_waits_or_is_checked() {
    let busy = [
        Stage::Waiting(Priority::Fresh, at(0)),
        Stage::Waiting(Priority::Background, at(0)),
        Stage::Active(JobId(1)),
    ];
    for stage in busy {
        let mut files = files(2);
        assert!(files.is_quiet());
        files.set_stage(0, stage.clone());
        assert!(!files.is_quiet(), "{stage:?}");
        files.set_stage(1, stage.clone());
        assert!(!files.is_quiet(), "two files in {stage:?}");
        files.set_stage(0, Stage::Idle);
        files.set_stage(1, Stage::Idle);
        assert!(files.is_quiet(), "{stage:?}");
    }
}

#[test]
fn promoted_file_is_taken_once_at_its_new_place() {
    let mut files = files(3);
    for (id, priority) in [
        (1, Priority::Background),
        (2, Priority::Background),
        (0, Priority::Fresh),
        (1, Priority::Fresh),
    ] {
        files.enqueue(id, priority, at(1));
    }
    assert_eq!(taken(&mut files, at(3)), [0, 1, 2]);
    assert!(files.is_quiet());
}

#[test]
fn promoted_file_is_not_taken_at_its_former_place() {
    let mut files = files(2);
    files.enqueue(0, Priority::Background, at(1));
    // It moved up, but its former place is still in the background queue.
    files.enqueue(0, Priority::Fresh, at(1));
    files.enqueue(1, Priority::Background, at(1));
    files.since_background = BACKGROUND_SHARE;
    assert_eq!(
        files.dequeue(at(2)),
        Some(1),
        "a background file is taken next"
    );
    assert!(
        files.background.is_empty(),
        "the former queue entry is dropped"
    );
    assert_eq!(files.dequeue(at(2)), Some(0));
}

#[test]
fn background_gets_its_share_while_fresh_files_arrive() {
    let mut files = files(60);
    files.enqueue(0, Priority::Background, at(0));
    (1..60).for_each(|id| files.enqueue(id, Priority::Fresh, at(0)));
    let order = taken(&mut files, at(1));
    let place = order.iter().position(|id| *id == 0);
    assert_eq!(place, Some(usize::from(BACKGROUND_SHARE)));
}

#[test]
fn longest_wait_is_that_of_first_fresh_file() {
    let mut files = files(3);
    assert_eq!(files.oldest_wait(at(9)), Duration::ZERO);
    files.enqueue(0, Priority::Background, at(1));
    assert_eq!(files.oldest_wait(at(9)), Duration::ZERO);
    files.enqueue(1, Priority::Fresh, at(2));
    files.enqueue(2, Priority::Fresh, at(5));
    assert_eq!(files.oldest_wait(at(9)), at(7));
    assert_eq!(files.dequeue(at(9)), Some(1));
    assert_eq!(files.oldest_wait(at(9)), at(4));
}

#[test]
fn file_queued_repeatedly_waits_once() {
    let mut files = files(1);
    for _ in 0..3 {
        files.enqueue(0, Priority::Background, Duration::ZERO);
        files.enqueue(0, Priority::Fresh, Duration::ZERO);
    }
    assert_eq!(files.dequeue(Duration::ZERO), Some(0));
    assert_eq!(files.dequeue(Duration::ZERO), None);
    assert!(files.is_quiet());
}

#[test]
fn paused_file_lets_others_pass() {
    let mut files = files(2);
    files.enqueue(0, Priority::Fresh, Duration::ZERO);
    files.enqueue(1, Priority::Fresh, Duration::ZERO);
    if let Some(entry) = files.get_mut(0) {
        entry.not_before = Duration::from_secs(1);
    }
    assert_eq!(files.dequeue(Duration::ZERO), Some(1));
    assert_eq!(files.dequeue(Duration::ZERO), None);
    assert_eq!(files.dequeue(Duration::from_secs(1)), Some(0));
}
