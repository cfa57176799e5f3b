//! `qcbus doctor`: looks for what may keep a broker from working, and says what to do.

use std::path::Path;

use qcbus_broker::control::ask_broker;
use qcbus_broker::journal::Journal;
use qcbus_bus::{HostOptions, SharedMemory};
use qcbus_messages::control::{Request, Response};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Exit, PROTOCOL_VERSION, shown};

use super::settings::{absolute, instance};
use crate::args::DoctorArgs;
use crate::{standard, talk};

/// What is said of one thing that was looked at.
struct Remark {
    ok: bool,
    what: &'static str,
    text: String,
    advice: &'static str,
}

/// Runs the command.
pub fn run(args: &DoctorArgs) -> Exit {
    let mut remarks = vec![
        shared_memory(),
        addresses(),
        watches(),
        open_files(),
        versions(),
    ];
    remarks.push(match instance(&args.instance) {
        Ok(instance) => runtime_directory(instance.dir()),
        Err(why) => bad(
            "runtime directory",
            why,
            "set XDG_RUNTIME_DIR to a directory of your own",
        ),
    });
    if let Ok(instance) = instance(&args.instance) {
        remarks.push(broker(instance.dir()));
    }
    remarks.push(stale_instances());
    remarks.push(journal(&absolute(&args.state)));
    for remark in &remarks {
        let mark = if remark.ok { "ok  " } else { "FIX " };
        let text = shown::line(&remark.text);
        talk::print(&format!("{mark} {:<18} {text}\n", remark.what));
        if !remark.ok {
            talk::print(&format!("     {:<18} {}\n", "", remark.advice));
        }
    }
    if remarks.iter().all(|remark| remark.ok) {
        Exit::Accepted
    } else {
        Exit::Rejected
    }
}

fn good(what: &'static str, text: String) -> Remark {
    Remark {
        ok: true,
        what,
        text,
        advice: "",
    }
}

fn bad(what: &'static str, text: String, advice: &'static str) -> Remark {
    Remark {
        ok: false,
        what,
        text,
        advice,
    }
}

/// Room that a broker with some large maps in flight wants.
const SHM_WANTED: u64 = 512 << 20;

fn shared_memory() -> Remark {
    let what = "shared memory";
    let advice = "mount /dev/shm larger (`mount -o remount,size=2G /dev/shm`; containers: --shm-size=2g), or remove what others left there";
    match SharedMemory::now() {
        Ok(memory) => {
            let (free, size) = (memory.free, memory.size);
            let text = format!(
                "{} MiB of {} MiB free in /dev/shm: room for images of {} MiB beside the bus",
                free >> 20,
                size >> 20,
                room_for_images(&memory) >> 20
            );
            if free >= SHM_WANTED {
                good(what, text)
            } else {
                bad(what, text, advice)
            }
        }
        Err(error) => bad(what, format!("/dev/shm: {error}"), advice),
    }
}

/// Bytes that images may take now, beside what a broker with the standard bundles takes for the bus.
fn room_for_images(memory: &SharedMemory) -> u64 {
    let host = HostOptions {
        expected_peers: standard::BUNDLES.len() + 1,
        ..HostOptions::default()
    };
    memory.free.saturating_sub(host.shared_memory_bytes())
}

/// Segments are mapped in full, whether they are used or not.
fn addresses() -> Remark {
    let what = "address space";
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
    let (least, all) = HostOptions::default().address_bytes();
    match limit {
        None => good(what, "no limit on it".to_owned()),
        Some(limit) if limit >= all => good(what, format!("limited to {} MiB", limit >> 20)),
        Some(limit) => bad(
            what,
            format!(
                "limited to {} MiB: a broker needs {} MiB, or {} MiB for small files alone",
                limit >> 20,
                all >> 20,
                least >> 20
            ),
            "raise it (`ulimit -v unlimited`; systemd: LimitAS=infinity)",
        ),
    }
}

fn watches() -> Remark {
    let what = "file watches";
    let path = "/proc/sys/fs/inotify/max_user_watches";
    match std::fs::read_to_string(path)
        .ok()
        .and_then(|text| text.trim().parse::<u64>().ok())
    {
        Some(watches) if watches >= 8192 => {
            good(what, format!("{watches} directories can be watched"))
        }
        Some(watches) => bad(
            what,
            format!("only {watches} directories can be watched"),
            "raise it (`sysctl fs.inotify.max_user_watches=524288`), or use `serve --poll`",
        ),
        None => bad(
            what,
            format!("{path} cannot be read"),
            "file events may be missing here: use `serve --poll`",
        ),
    }
}

fn open_files() -> Remark {
    let what = "open files";
    let limit = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
    match limit {
        Some(limit) if limit < 1024 => bad(
            what,
            format!("at most {limit} files may be open"),
            "raise it (`ulimit -n 4096`; systemd: LimitNOFILE=4096)",
        ),
        Some(limit) => good(what, format!("{limit} files may be open")),
        None => good(what, "no limit on open files".to_owned()),
    }
}

fn versions() -> Remark {
    let text = format!(
        "qcbus {}, bus protocol {PROTOCOL_VERSION}, iceoryx2 {}",
        env!("CARGO_PKG_VERSION"),
        qcbus_bus::ICEORYX2_VERSION
    );
    good("versions", text)
}

fn runtime_directory(directory: &Path) -> Remark {
    let what = "runtime directory";
    let probe = directory.join(".doctor");
    let text = to_text(directory);
    match std::fs::create_dir_all(directory).and_then(|()| std::fs::write(&probe, b"")) {
        Ok(()) => {
            // Only just made; if it stays, it harms nobody.
            let _ = std::fs::remove_file(probe);
            good(what, text)
        }
        Err(error) => bad(
            what,
            format!("{text}: {error}"),
            "make it writable, or set XDG_RUNTIME_DIR",
        ),
    }
}

fn broker(directory: &Path) -> Remark {
    let what = "broker";
    match ask_broker(directory, &Request::Status) {
        Ok(Response::Status(status)) => {
            let troubled: Vec<_> = status
                .peers
                .iter()
                .filter(|peer| ["down", "gave up", "silent"].contains(&peer.state.as_str()))
                .map(|peer| format!("{} is {}", peer.name, peer.state))
                .collect();
            let text = format!(
                "process {} runs, {} files known",
                status.pid, status.files.total
            );
            if troubled.is_empty() {
                good(what, text)
            } else {
                bad(
                    what,
                    format!("{text}; {}", troubled.join(", ")),
                    "`qcbus status` says why; the log of the broker says more",
                )
            }
        }
        Ok(_) | Err(_) => good(what, "none runs as this instance".to_owned()),
    }
}

fn stale_instances() -> Remark {
    let swept = qcbus_bus::sweep_private_instances();
    let text = if swept == 0 {
        "none".to_owned()
    } else {
        format!("{swept} left by what was killed, removed")
    };
    good("stale instances", text)
}

fn journal(state: &Path) -> Remark {
    let what = "journal";
    match Journal::examine(state) {
        None => good(
            what,
            format!(
                "{} is sound or not there",
                state.join("journal.sqlite").display()
            ),
        ),
        Some(wrong) => bad(
            what,
            wrong,
            "stop the broker, move journal.sqlite (with -wal and -shm) away and start again: everything is judged anew, results stay",
        ),
    }
}
