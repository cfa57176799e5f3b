//! Hostile clients of the control socket: an honest `status` beside them is always answered, and
//! they leave nothing behind. `QCBUS_FUZZ_SECONDS` sets the duration.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::dice::{Dice, seed};
use crate::support::farm::{Farm, tail};
use crate::support::watchdog::{pause, until_or};
use qcbus_control::ask_broker;
use qcbus_messages::Verdict;
use qcbus_messages::control::{Request, Response};

/// Number of descriptors that most machines give a process.
const USUAL: u64 = 1024;

/// Starts a broker with the usual number of descriptors.
fn serve(farm: &Farm) -> Broker {
    let plain = farm.serve_command();
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -n {USUAL}; exec \"$@\""), "sh"]);
    command.arg(plain.get_program()).args(plain.get_args());
    let broker = Broker::start(&mut command, &farm.log_path());
    until_or(
        "the broker answers",
        || farm.status().map(drop),
        || farm.log(),
    );
    broker
}

/// Raises the limit of descriptors, because this process needs more than its victims.
fn be_many() {
    use rustix::process::{Resource, getrlimit, setrlimit};
    let mut limit = getrlimit(Resource::Nofile);
    limit.current = limit.maximum.map(|it| it.min(16_384)).or(Some(16_384));
    setrlimit(Resource::Nofile, limit).unwrap();
}

fn descriptors(broker: &Broker) -> usize {
    let path = PathBuf::from(format!("/proc/{}/fd", broker.pid()));
    std::fs::read_dir(path).unwrap().count()
}

/// Returns the number of descriptors after the broker has judged a file.
fn descriptors_at_work(farm: &Farm, broker: &Broker) -> usize {
    farm.write("early.xodr", &Content::Good(0).bytes());
    assert_eq!(farm.verdict("early.xodr").verdict, Verdict::Accepted);
    descriptors(broker)
}

fn until_descriptors_are_back(broker: &Broker, before: usize) {
    until_or(
        "nothing is left of those who have gone",
        || (descriptors(broker) < before + 16).then_some(()),
        || format!("{before} before, {} now", descriptors(broker)),
    );
}

fn socket(farm: &Farm) -> PathBuf {
    farm.instance().join("control.sock")
}

#[test]
fn two_thousand_idle_connections_do_not_stop_the_broker() {
    be_many();
    let farm = Farm::new();
    let broker = serve(&farm);
    let before = descriptors_at_work(&farm, &broker);
    let idle: Vec<UnixStream> = (0..2000)
        .map(|_| UnixStream::connect(socket(&farm)).unwrap())
        .collect();
    assert!(farm.status().is_some(), "status is answered");
    farm.write("good.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("good.xodr").verdict, Verdict::Accepted);
    assert!(
        descriptors(&broker) < 700,
        "half of the descriptors are reserved for the broker"
    );
    drop(idle);
    until_descriptors_are_back(&broker, before);
}

#[test]
fn vanished_clients_make_room_for_others() {
    be_many();
    let farm = Farm::new();
    let broker = serve(&farm);
    let before = descriptors_at_work(&farm, &broker);
    let file = farm.root().join("never.xodr");
    let wait = Request::Wait {
        file,
        timeout_ms: None,
    };
    let mut line = serde_json::to_vec(&wait).unwrap();
    line.push(b'\n');
    let mut told = 0;
    for _ in 0..2 {
        let mut clients: Vec<UnixStream> = Vec::new();
        for _ in 0..600 {
            let mut client = UnixStream::connect(socket(&farm)).unwrap();
            client.write_all(&line).unwrap();
            clients.push(client);
        }
        assert!(farm.status().is_some(), "status is answered meanwhile");
        for client in &mut clients {
            client.set_nonblocking(true).unwrap();
            let mut said = [0; 512];
            if let Ok(read @ 1..) = client.read(&mut said) {
                let said = String::from_utf8_lossy(&said[..read]);
                assert!(said.contains("clients already wait for verdicts"), "{said}");
                told += 1;
            }
        }
        drop(clients);
        until_descriptors_are_back(&broker, before);
    }
    assert!(told > 100, "clients without room are notified: {told}");
    // A client with a valid request gets the verdict.
    farm.write("never.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("never.xodr").verdict, Verdict::Accepted);
}

fn bytes(dice: &mut Dice, count: usize) -> Vec<u8> {
    (0..count).map(|_| dice.roll().to_le_bytes()[0]).collect()
}

/// Runs one hostile client.
fn attack(dice: &mut Dice, socket: &Path, kept: &mut Vec<UnixStream>) {
    let Ok(mut client) = UnixStream::connect(socket) else {
        return;
    };
    let limit = Some(Duration::from_millis(5));
    client.set_write_timeout(limit).unwrap();
    let status = b"{\"request\":\"status\"}\n";
    // A rejected client cannot send any more. This is correct.
    let _ = match dice.below(8) {
        0 => client.write_all(&bytes(dice, 300)),
        1 => client.write_all(&vec![b'['; 200_000]),
        2 => client.write_all(&status[..status.len() / 2]),
        3 => client.write_all(&status.repeat(400)),
        4 => client
            .write_all(&bytes(dice, 20))
            .and_then(|()| client.write_all(b"\n")),
        5 => client.write_all(b"{\"request\":\"wait\",\"file\":\"/x.xodr\",\"timeout_ms\":null}\n"),
        6 => client.write_all(b"{\"request\":\"remove-bundle\",\"name\":\"\\u0000\\n\"}\n"),
        _ => Ok(()),
    };
    if dice.below(4) > 0 {
        // This client neither reads nor disconnects.
        kept.push(client);
    }
    if kept.len() > 700 {
        kept.drain(..usize::try_from(dice.below(700)).unwrap());
    }
}

#[test]
fn honest_client_is_answered_beside_hostile_ones() {
    be_many();
    let farm = Farm::with(&["--no-standard-bundles"]);
    let mut broker = serve(&farm);
    let before = descriptors(&broker);
    let seconds = std::env::var("QCBUS_FUZZ_SECONDS")
        .ok()
        .and_then(|it| it.parse().ok());
    let seed = seed();
    eprintln!("seed {seed}");
    let end = Instant::now() + Duration::from_secs(seconds.unwrap_or(4));
    let (over, attacks) = (AtomicBool::new(false), AtomicUsize::new(0));
    let answered = std::thread::scope(|scope| {
        for thread in 0..3 {
            let (socket, over, attacks) = (socket(&farm), &over, &attacks);
            scope.spawn(move || {
                let mut dice = Dice::new(seed.wrapping_add(thread));
                let mut kept = Vec::new();
                while !over.load(Ordering::Relaxed) {
                    attack(&mut dice, &socket, &mut kept);
                    attacks.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        let mut answered = 0;
        while Instant::now() < end {
            match ask_broker(&farm.instance(), &Request::Status) {
                Ok(Response::Status(_)) => answered += 1,
                other => {
                    over.store(true, Ordering::Relaxed);
                    panic!(
                        "seed {seed}, after {answered} answers: {other:?}\n{}",
                        tail(&farm.log())
                    );
                }
            }
            pause(Duration::from_millis(5));
        }
        over.store(true, Ordering::Relaxed);
        answered
    });
    let attacks = attacks.into_inner();
    eprintln!("{attacks} attacks, {answered} honest answers");
    assert!(
        answered > 0 && attacks > 100,
        "{answered} answers, {attacks} attacks"
    );
    until_descriptors_are_back(&broker, before);
    assert!(farm.qcbus(&["down"]).status.success());
    assert!(broker.wait().success());
}

/// A stopped broker does not answer, and its clients must not hang with it.
#[test]
fn stopped_broker_is_named_and_not_waited_for() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    let pid = i32::try_from(broker.pid()).unwrap();
    broker.signal(rustix::process::Signal::STOP);
    for command in ["status", "down"] {
        let told = farm.qcbus(&[command]);
        let said = String::from_utf8_lossy(&told.stderr);
        assert_eq!(told.status.code(), Some(5), "{command}: {said}");
        let advice = format!("kill -CONT {pid}");
        assert!(said.contains(&advice), "{command}: {said}");
    }
    broker.signal(rustix::process::Signal::CONT);
}

#[test]
fn waiting_client_learns_that_the_broker_left() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    let before = descriptors(&broker);
    let file = farm.root().join("later.xodr");
    let (waited, down) = std::thread::scope(|scope| {
        let waiting = scope.spawn(|| farm.qcbus(&["wait", file.to_str().unwrap()]));
        let is_there = || (descriptors(&broker) > before).then_some(());
        until_or("a client is there", is_there, || farm.log());
        let down = farm.qcbus(&["down"]);
        (waiting.join().unwrap(), down)
    });
    assert_eq!(down.status.code(), Some(0));
    let said = String::from_utf8(waited.stderr).unwrap();
    assert_eq!(waited.status.code(), Some(4), "{said}");
    assert!(
        said.contains("the broker disconnected before it answered"),
        "{said}"
    );
}

/// `qcbus down && qcbus serve` is a common command line.
#[test]
fn broker_can_be_restarted_right_after_down() {
    let farm = Farm::new();
    for number in 0..200 {
        farm.write(&format!("{number}.xodr"), b"<OpenDRIVE/>");
    }
    for _ in 0..8 {
        let mut broker = farm.serve_ready();
        assert_eq!(
            farm.qcbus(&["down"]).status.code(),
            Some(0),
            "{}",
            farm.log()
        );
        let after = farm.serve_ready();
        assert!(broker.wait().success());
        drop(after);
    }
}
