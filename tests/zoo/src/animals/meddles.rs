//! Does with every job things that a bundle must not do: writes and reads a file, connects, sends a
//! datagram, signals another process, opens its memory, starts a program in a session of its own.
//! Its environment names the targets.

use std::net::{TcpStream, UdpSocket};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use qcbus_bus::Peer;
use qcbus_messages::Job;
use rustix::process::{Pid, Signal, kill_process};

use crate::complain;
use crate::harness::{Animal, GOOD, Manners, Mood, answer};

pub(super) const ANIMAL: Animal = Animal {
    name: "meddles",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Attempt that must fail. Returns a value if it succeeds.
type Try = fn() -> Option<()>;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    let tries: [(&str, Try); 7] = [
        ("wrote a file", write),
        ("read a file", read),
        ("connected", connect),
        ("sent a datagram", send),
        ("started a program", start),
        ("looked into another's memory", look),
        ("signalled another", signal),
    ];
    for (what, attempt) in tries {
        if attempt().is_some() {
            complain(&format!("it meddled: {what}"));
        }
    }
    complain("it has tried everything");
    answer(peer, job.job);
    Mood::GoOn
}

fn told(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

fn write() -> Option<()> {
    std::fs::write(PathBuf::from(told("ZOO_FILE")?), "meddled").ok()
}

fn read() -> Option<()> {
    std::fs::read("/etc/passwd").ok().map(drop)
}

fn connect() -> Option<()> {
    let port: u16 = told("ZOO_PORT")?.parse().ok()?;
    TcpStream::connect(("127.0.0.1", port)).ok().map(drop)
}

fn send() -> Option<()> {
    let port: u16 = told("ZOO_PORT")?.parse().ok()?;
    let socket = UdpSocket::bind(("127.0.0.1", 0)).ok()?;
    socket
        .send_to(b"meddled", ("127.0.0.1", port))
        .ok()
        .map(drop)
}

/// Starts a program through a shell that ends at once. The program that stays has another process
/// group, session and parent.
fn start() -> Option<()> {
    let sleep = format!("setsid sleep {} &", told("ZOO_SLEEP")?);
    let mut shell = Command::new("sh");
    let quiet = shell.args(["-c", &sleep]).stdin(Stdio::null());
    let quiet = quiet.stdout(Stdio::null()).stderr(Stdio::null());
    quiet.status().ok().map(drop)
}

fn victim() -> Option<Pid> {
    Pid::from_raw(told("ZOO_VICTIM")?.parse().ok()?)
}

fn look() -> Option<()> {
    let memory = format!("/proc/{}/mem", victim()?.as_raw_nonzero());
    std::fs::File::open(memory).ok().map(drop)
}

fn signal() -> Option<()> {
    kill_process(victim()?, Signal::TERM).ok()
}
