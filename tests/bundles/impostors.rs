//! Impostors are not trusted: no process is killed because of them, and no verdict changes.

use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::support::content::Content;
use crate::support::farm::{Farm, zoo};
use crate::support::processes::{parent_of, signal_pid};
use crate::support::watchdog::{until_or, until_so};
use qcbus_bus::{Claims, Instance, JoinError, Peer, PeerOptions};
use qcbus_messages::control::PeerStatus;
use qcbus_messages::{Hello, PROTOCOL_VERSION, Role, Verdict};

fn peer_of(farm: &Farm, name: &str) -> Option<PeerStatus> {
    let status = farm.status()?;
    status.peers.into_iter().find(|it| it.name == name)
}

/// Waits for a running standard bundle and returns it.
fn bundle_of(farm: &Farm) -> PeerStatus {
    until_or(
        "the bundle runs",
        || peer_of(farm, "xodrBundle").filter(|it| it.pid != 0 && it.state == "ready"),
        || farm.log(),
    )
}

fn is_said(farm: &Farm, text: &str) {
    let said = || {
        let mut notices = farm.status()?.notices.into_iter();
        let said = notices.any(|it| it.kind == "turned-away" && it.text.contains(text));
        said.then_some(())
    };
    until_or("it is said", said, || {
        format!("no `{text}`: {:#?}\n{}", farm.status(), farm.log())
    });
}

/// Joins with false statements.
async fn lie(farm: &Farm, hello: Hello) -> Result<Peer, JoinError> {
    let instance = Instance::at(farm.instance());
    let patient = PeerOptions {
        patience: Duration::from_secs(120),
        grace: Duration::from_secs(120),
        ..PeerOptions::default()
    };
    Peer::join_claiming(Claims::default(), &instance, hello, patient).await
}

fn hello(name: &str, pid: u32, launch: Option<u64>) -> Hello {
    Hello {
        protocol: PROTOCOL_VERSION,
        role: Role::Bundle,
        name: name.to_owned(),
        version: "1".to_owned(),
        incarnation: std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), pid),
        pid,
        launch,
        capacity: 4,
        threads: 1,
    }
}

#[tokio::test]
async fn bundle_of_another_instance_is_not_killed() {
    let (here, elsewhere) = (Farm::new(), Farm::new());
    let _brokers = [here.serve_ready(), elsewhere.serve_ready()];
    let victim = bundle_of(&elsewhere);
    // The hello has a launch, because a broker kills only processes that were started by one.
    let refused = lie(&here, hello("liar", victim.pid, Some(1 << 40))).await;
    let Err(JoinError::Refused(why)) = refused else {
        panic!("the hello must be refused: {:?}", refused.err());
    };
    assert!(why.contains("does not prove it"), "{why}");
    is_said(&here, "`liar` states that a broker has started it");
    // The process may join by hand, and the broker knows which process it is.
    let mut liar = lie(&here, hello("liar", victim.pid, None)).await.unwrap();
    until_or(
        "the liar is known",
        || peer_of(&here, "liar").filter(|it| it.pid == std::process::id()),
        || format!("{:#?}", here.status()),
    );
    liar.send_garbage(&[0xA5; 64]);
    let ended = || {
        let mut notices = here.status()?.notices.into_iter();
        notices
            .any(|it| it.about.as_deref() == Some("liar"))
            .then_some(())
    };
    // Its messages are sent only while it polls.
    while ended().is_none() {
        let _ = tokio::time::timeout(Duration::from_millis(20), liar.next()).await;
    }
    let now = bundle_of(&elsewhere);
    assert_eq!((now.pid, now.restarts), (victim.pid, 0), "{now:?}");
}

/// An animal that joins by hand under another name, until it is dropped.
struct Impostor(Child);

impl Impostor {
    fn start(farm: &Farm, animal: &str, name: &str, more: &[&str]) -> Impostor {
        let mut command = Command::new(zoo());
        command.args([animal, "--name", name, "--instance-dir"]);
        command.arg(farm.instance()).args(more).stdin(Stdio::null());
        Impostor(command.spawn().unwrap())
    }
}

impl Drop for Impostor {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn impostor_cannot_replace_a_standard_bundle() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    farm.write("bad.xodr", &Content::NoHeader(1).bytes());
    assert_eq!(farm.verdict("bad.xodr").verdict, Verdict::Rejected);
    let bundle = bundle_of(&farm);
    // The impostor tries it with and without a running bundle. It never finds an error.
    let first = Impostor::start(&farm, "slow", "xodrBundle", &[]);
    is_said(&farm, "the broker itself starts `xodrBundle`");
    drop(first);
    let stopped = i32::try_from(bundle.pid).unwrap();
    let _impostors: Vec<Impostor> = (0..3)
        .map(|_| Impostor::start(&farm, "slow", "xodrBundle", &[]))
        .collect();
    signal_pid(stopped, rustix::process::Signal::KILL);
    farm.write("worse.xodr", &Content::NoHeader(2).bytes());
    assert_eq!(farm.verdict("worse.xodr").verdict, Verdict::Rejected);
    assert_eq!(farm.verdict("bad.xodr").verdict, Verdict::Rejected);
    let now = bundle_of(&farm);
    assert!(
        now.pid != bundle.pid && now.checkers == bundle.checkers,
        "{now:?}"
    );
}

#[test]
fn child_joins_only_under_its_manifest_name() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    // This bundle comes from a manifest and claims to be a standard bundle.
    farm.let_in("slow", "--name xodrBundle");
    is_said(&farm, "`xodrBundle` states that a broker has started it");
    farm.write("bad.xodr", &Content::NoHeader(1).bytes());
    farm.send_away("slow");
    assert_eq!(farm.verdict("bad.xodr").verdict, Verdict::Rejected);
}

#[test]
fn process_without_proof_does_not_judge() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let mut stranger = Impostor::start(&farm, "proves_nothing", "proves_nothing", &[]);
    is_said(&farm, "`proves_nothing`: it has not proven");
    until_so("it ends", || stranger.0.try_wait().unwrap().is_some());
    assert!(
        peer_of(&farm, "proves_nothing").is_none(),
        "the bundle is not in the registry"
    );
    farm.write("good.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("good.xodr").verdict, Verdict::Accepted);
}

/// A new broker starts a bundle of its own if the old one does not return in half a second, as on a busy machine.
/// Then the test tries again.
#[test]
fn children_prove_themselves_to_the_next_broker() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let returns = || {
        let launcher = parent_of(bundle_of(&farm).pid);
        broker.kill();
        broker = farm.serve_ready();
        let now = bundle_of(&farm);
        assert_eq!(now.restarts, 0, "{}", farm.log());
        let status = farm.status().unwrap();
        let mut notices = status.notices.iter();
        assert!(
            notices.all(|it| it.kind != "turned-away" || it.text.contains("has already joined")),
            "{status:#?}"
        );
        // A confined process joins no other broker, so its launcher has started another one.
        (parent_of(now.pid) == launcher).then_some(())
    };
    until_or("a bundle joins the next broker", returns, || farm.log());
}
