//! Does with every job what is no business of a bundle: writes a file, connects and sends somewhere, signals another
//! process, looks into its memory, starts a program in a session of its own. Where to, it is told by its environment.

use std::net::{TcpStream, UdpSocket};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use qcbus_bus::Peer;
use qcbus_messages::Job;
use rustix::process::{Pid, Signal, kill_process};

use crate::complain;
use crate::keeper::{Animal, GOOD, Manners, Mood, answer};

pub(super) const ANIMAL: Animal = Animal {
    name: "meddles",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Something that must not succeed; what it gives when it does.
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

/// Through a shell that ends at once, so that what stays has neither its group nor its session nor its parent.
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
