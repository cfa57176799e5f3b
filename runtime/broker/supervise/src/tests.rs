use qcbus_types::Restart;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use super::*;

fn children() -> (Children, UnboundedReceiver<Event>) {
    let (events, inbox) = unbounded_channel();
    let dir = tempfile::tempdir().unwrap();
    let surroundings = Surroundings {
        instance_dir: "/nowhere".into(),
        die_with_broker: true,
        sandbox: false,
        memory_limit: None,
        descriptors: None,
    };
    let launches = Launches::of(dir.path()).unwrap();
    (Children::new(surroundings, launches, 2, events), inbox)
}

fn spec(command: &[&str]) -> ChildSpec {
    ChildSpec {
        name: "child".to_owned(),
        role: Role::Bundle,
        version: None,
        command: command.iter().map(|it| (*it).to_owned()).collect(),
        restart: Restart::Never,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

async fn end(inbox: &mut UnboundedReceiver<Event>) -> (Launch, ChildEnd) {
    let watchdog = Duration::from_secs(60);
    let event = tokio::time::timeout(watchdog, inbox.recv()).await;
    match event.expect("watchdog timeout: no child has ended") {
        Some(Event::Exited { launch, end }) => (launch, end),
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn end_of_child_is_classified() {
    let (mut children, mut inbox) = children();
    type Told = fn(&ChildEnd) -> bool;
    let not_started: Told = |it| matches!(it, ChildEnd::NotStarted(_));
    let failed: Told = |it| matches!(it, ChildEnd::Failed(_));
    let done: Told = |it| matches!(it, ChildEnd::Done(_));
    let ends = [
        (spec(&["/nowhere/at/all"]), not_started),
        (spec(&[]), not_started),
        (
            spec(&["sh", "-c", "exec /nowhere/at/all", "sh"]),
            not_started,
        ),
        (spec(&["sh", "-c", "exec /", "sh"]), not_started),
        (spec(&["sh", "-c", "exit 0", "sh"]), done),
        (spec(&["sh", "-c", "exit 3", "sh"]), failed),
        (spec(&["sh", "-c", "kill -9 $$", "sh"]), failed),
    ];
    for (number, (spec, is_told)) in (1..).zip(ends) {
        children.spawn(Launch(number), &spec);
        let (launch, end) = end(&mut inbox).await;
        assert_eq!(launch, Launch(number));
        assert!(is_told(&end), "{spec:?}: {end:?}");
        assert!(!end.how().is_empty());
    }
}

/// A program may end before its handle is opened, for example on a busy machine.
#[tokio::test]
async fn child_that_ends_at_once_still_counts_as_own() {
    let (mut children, mut inbox) = children();
    let spec = spec(&["sh", "-c", "exit 3", "sh"]);
    children.start_early(std::slice::from_ref(&spec));
    let [pid] = pids_of(&children)[..] else {
        panic!("exactly one child must be started");
    };
    let launch = Launch::first_of(2).next(&spec);
    assert_eq!(children.ours(), BTreeMap::from([(launch, Some(pid))]));
    let process = Process::open(pid, None).into_iter();
    for process in process {
        assert!(process.ends_within(Duration::from_secs(60)));
    }
    children.spawn(launch, &spec);
    assert_eq!(children.ours(), BTreeMap::from([(launch, Some(pid))]));
    let (_, end) = end(&mut inbox).await;
    assert_eq!(end.how(), "it ended with exit code 3");
}

fn pids_of(children: &Children) -> Vec<u32> {
    let early = children.early.values();
    early
        .filter_map(|(_, started)| started.child.id())
        .collect()
}

async fn is_gone(pid: u32) {
    let stat = PathBuf::from(format!("/proc/{pid}/stat"));
    let gone = async {
        // A zombie that is not reaped yet counts as ended.
        let runs = || std::fs::read_to_string(&stat).is_ok_and(|it| !it.contains(") Z "));
        while runs() {
            tokio::task::yield_now().await;
        }
    };
    let watchdog = Duration::from_secs(60);
    tokio::time::timeout(watchdog, gone).await.unwrap();
}

#[tokio::test]
async fn early_started_process_is_used_when_requested() {
    let (mut children, mut inbox) = children();
    let spec = spec(&["sh", "-c", "exec sleep 1000", "sh"]);
    children.start_early(std::slice::from_ref(&spec));
    let early = pids_of(&children);
    let launch = Launch::first_of(2).next(&spec);
    children.spawn(launch, &spec);
    let own = children.own[&launch].process.clone().unwrap();
    assert_eq!(early, [own.id()], "only one process is started");
    assert!(children.early.is_empty());
    children.kill(launch);
    assert_eq!(end(&mut inbox).await.0, launch);
}

#[tokio::test]
async fn end_of_early_started_child_is_noticed() {
    let (mut children, mut inbox) = children();
    let spec = spec(&["sh", "-c", "exit 3", "sh"]);
    children.start_early(std::slice::from_ref(&spec));
    let launch = Launch::first_of(2).next(&spec);
    children.spawn(launch, &spec);
    let (ended, how) = end(&mut inbox).await;
    assert_eq!(ended, launch);
    assert!(matches!(how, ChildEnd::Failed(_)), "{how:?}");
}

#[tokio::test]
async fn failed_early_start_is_reported_when_requested() {
    let (mut children, mut inbox) = children();
    let spec = spec(&["/nowhere/at/all"]);
    children.start_early(std::slice::from_ref(&spec));
    let launch = Launch::first_of(2).next(&spec);
    children.spawn(launch, &spec);
    let (ended, how) = end(&mut inbox).await;
    assert_eq!(ended, launch);
    assert!(matches!(how, ChildEnd::NotStarted(_)), "{how:?}");
}

#[tokio::test]
async fn unused_early_started_process_is_ended() {
    let (mut children, _inbox) = children();
    let spec = spec(&["sh", "-c", "exec sleep 1000", "sh"]);
    children.start_early(std::slice::from_ref(&spec));
    let [unasked] = pids_of(&children)[..] else {
        panic!("exactly one child must be started");
    };
    drop(children);
    is_gone(unasked).await;
}

#[tokio::test]
async fn child_is_killed_with_its_descendants() {
    let (mut children, mut inbox) = children();
    let dir = tempfile::tempdir().unwrap();
    let pid = dir.path().join("pid");
    let script = format!(
        "sleep 1000 & echo $! > {0}.x; mv {0}.x {0}; wait",
        pid.display()
    );
    children.spawn(Launch(1), &spec(&["sh", "-c", &script, "sh"]));
    let started = async {
        while !pid.exists() {
            tokio::task::yield_now().await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), started)
        .await
        .unwrap();
    children.kill(Launch(1));
    let (_, end) = end(&mut inbox).await;
    assert!(matches!(end, ChildEnd::Failed(how) if how.contains("signal 9")));
    let grandchild = std::fs::read_to_string(&pid).unwrap();
    let stat = PathBuf::from(format!("/proc/{}/stat", grandchild.trim()));
    let gone = async {
        // A zombie that is not reaped yet counts as ended.
        let runs = || std::fs::read_to_string(&stat).is_ok_and(|it| !it.contains(") Z "));
        while runs() {
            tokio::task::yield_now().await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), gone)
        .await
        .unwrap();
}

#[tokio::test]
async fn only_proven_children_are_accepted_and_killed() {
    let (mut children, mut inbox) = children();
    let start = || {
        let mut command = std::process::Command::new("sleep");
        command.arg("1000").spawn().unwrap()
    };
    let [mut stranger, mut stale_children] = [start(), start()];
    let process = |it: &std::process::Child| Process::open(it.id(), None).unwrap();
    let (strange, adopted) = (process(&stranger), process(&stale_children));
    let earlier = Launch::first_of(1);
    let proof = children.launches.proof(earlier, "child");
    let lies = [
        (earlier, "child", ""),
        (earlier, "other", &proof),
        (Launch(earlier.0 + 1), "child", &proof),
    ];
    for (launch, name, proof) in lies {
        let refused = children.joined(launch, name, Some(&strange), proof);
        assert!(refused.unwrap_err().contains("does not prove it"));
        children.kill(launch);
    }
    children
        .joined(earlier, "child", Some(&adopted), &proof)
        .unwrap();
    children.kill(earlier);
    assert!(!stale_children.wait().unwrap().success());
    // A child of this broker is known without any proof. No other process is taken for it.
    children.spawn(Launch(1), &spec(&["sh", "-c", "exec sleep 1000", "sh"]));
    let own = children.own[&Launch(1)].process.clone().unwrap();
    children.joined(Launch(1), "child", Some(&own), "").unwrap();
    let refused = children.joined(Launch(1), "child", Some(&strange), "");
    assert!(refused.is_err());
    children.kill(Launch(1));
    let (_, end) = end(&mut inbox).await;
    assert!(
        matches!(&end, ChildEnd::Failed(how) if how.contains("signal 9")),
        "{end:?}"
    );
    assert!(stranger.try_wait().unwrap().is_none());
    stranger.kill().unwrap();
    stranger.wait().unwrap();
}
