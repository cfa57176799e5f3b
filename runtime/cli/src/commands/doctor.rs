//! `qcbus doctor`: looks for conditions that may prevent a broker from working, and suggests fixes.

use std::path::{Path, PathBuf};

use qcbus_bus::{HostOptions, SharedMemory};
use qcbus_configuration::unwritable;
use qcbus_control::{AskError, ask_broker};
use qcbus_messages::control::{Request, Response, ScratchStatus, Status};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Exit, PROTOCOL_VERSION, shown};
use qcbus_publish::journal::Journal;

use super::health;
use super::settings::{absolute, instance};
use crate::args::DoctorArgs;
use crate::{standard, talk};

/// Result of one check of the environment.
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
            "set XDG_RUNTIME_DIR to a directory that you own",
        ),
    });
    let asked = instance(&args.instance).ok();
    let asked = asked.map(|it| ask_broker(it.dir(), &Request::Status));
    remarks.extend(asked.as_ref().map(broker));
    remarks.push(stale_instances());
    let status = match asked {
        Some(Ok(Response::Status(status))) => Some(*status),
        _ => None,
    };
    remarks.extend(status.as_ref().and_then(replaced));
    remarks.push(temporary(status.as_ref()));
    remarks.extend(directories(args, status.as_ref()));
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

/// Shared memory that a broker needs with several large maps in work.
const SHM_WANTED: u64 = 512 << 20;

fn shared_memory() -> Remark {
    let what = "shared memory";
    let advice = "increase the size of /dev/shm (`mount -o remount,size=2G /dev/shm`; containers: \
                  --shm-size=2g), or remove files that others left there";
    if let Ok(true) = SharedMemory::is_read_only() {
        let text = "/dev/shm is mounted for reading only: no broker can start".to_owned();
        let advice = "make it writable: `mount -o remount,rw /dev/shm`";
        return bad(what, text, advice);
    }
    match SharedMemory::now() {
        Ok(memory) => {
            let (free, size) = (memory.free, memory.size);
            let text = format!(
                "{} MiB of {} MiB free in /dev/shm: room for {} MiB of images in addition to the bus",
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

/// Returns the bytes that are free for images after a broker with the standard bundles has
/// allocated the bus.
fn room_for_images(memory: &SharedMemory) -> u64 {
    let host = HostOptions {
        expected_peers: standard::BUNDLES.len() + 1,
        ..HostOptions::default()
    };
    memory.free.saturating_sub(host.shared_memory_bytes())
}

/// Checks the limit on address space. Segments are mapped in full, whether they are used or not.
fn addresses() -> Remark {
    let what = "address space";
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
    let (least, all) = HostOptions::default().address_bytes();
    match limit {
        None => good(what, "no limit".to_owned()),
        Some(limit) if limit >= all => good(what, format!("limited to {} MiB", limit >> 20)),
        Some(limit) => bad(
            what,
            format!(
                "limited to {} MiB: a broker needs {} MiB, or {} MiB for small files only",
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
            // The file was created a moment ago. It is harmless if it remains.
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

fn broker(asked: &Result<Response, AskError>) -> Remark {
    let what = "broker";
    let status = match asked {
        Ok(Response::Status(status)) => status,
        Ok(other) => {
            return bad(what, format!("unexpected answer: {other:?}"), UPGRADE);
        }
        Err(AskError::NoBroker { others, .. }) if others.is_empty() => {
            return good(what, "no broker runs as this instance".to_owned());
        }
        Err(error) => return bad(what, error.to_string(), "name the broker with --instance"),
    };
    let text = format!(
        "process {} is running, {} files known",
        status.pid, status.files.total
    );
    match health::reasons(status) {
        reasons if reasons.is_empty() => good(what, text),
        reasons => bad(
            what,
            format!("{text}; {}", reasons.join("; ")),
            "see `qcbus status` and the log of the broker",
        ),
    }
}

const UPGRADE: &str = "use the program that the broker was started from";

/// Checks whether the program file of the running broker has been replaced since its start.
fn replaced(status: &Status) -> Option<Remark> {
    let text = status.replaced.clone()?;
    Some(bad("program", text, "restart the broker"))
}

/// Checks the parent of the private directories of ASAM modules. It reports the view of the running
/// broker, which may have another `TMPDIR` and another view of the disk than this command.
fn temporary(status: Option<&Status>) -> Remark {
    let what = "temporary files";
    let own = |directory: PathBuf| ScratchStatus {
        why: unwritable(&directory),
        directory,
    };
    let told = status.and_then(|it| it.scratch.clone());
    let scratch = told.unwrap_or_else(|| own(qcbus_asam_adapter::usual_scratch()));
    match scratch.why {
        None => good(what, to_text(&scratch.directory)),
        Some(why) => bad(
            what,
            format!("one-shot modules cannot run, cannot write to {why}"),
            "start the broker with TMPDIR set to a directory that it may write to (systemd: PrivateTmp=yes)",
        ),
    }
}

/// Checks the directories given as arguments, else those of the running broker, else the defaults.
fn directories(args: &DoctorArgs, status: Option<&Status>) -> Vec<Remark> {
    let out = args.out.as_deref().map(absolute);
    let running = status.filter(|_| out.is_none());
    let out = out
        .or_else(|| running.map(|it| it.out.clone()))
        .unwrap_or_else(|| absolute(Path::new("qcbus-out")));
    let state = args.state.as_deref().map(absolute);
    let state = state
        .or_else(|| running.and_then(|it| it.state.clone()))
        .unwrap_or_else(|| out.join(".qcbus"));
    let mut remarks = vec![directory("results", &out), journal(&state)];
    let gate = running.and_then(|it| it.gate.as_ref());
    remarks.extend(gate.map(|it| directory("gate", &it.directory)));
    remarks
}

fn directory(what: &'static str, path: &Path) -> Remark {
    use rustix::fs::{Access, access};
    let shown = to_text(path);
    match access(path, Access::WRITE_OK | Access::EXEC_OK) {
        Err(rustix::io::Errno::NOENT) => {
            good(what, format!("{shown} does not exist; `serve` creates it"))
        }
        Ok(()) if path.is_dir() => good(what, shown),
        Ok(()) => bad(
            what,
            format!("{shown} is not a directory"),
            "use another directory",
        ),
        Err(error) => bad(what, format!("{shown}: {error}"), "make it writable"),
    }
}

fn stale_instances() -> Remark {
    let swept = qcbus_bus::sweep_private_instances();
    let text = if swept == 0 {
        "none".to_owned()
    } else {
        format!("removed {swept} that killed processes left behind")
    };
    good("stale instances", text)
}

fn journal(state: &Path) -> Remark {
    let what = "journal";
    let journal = state.join("journal.sqlite");
    let shown = to_text(&journal);
    match Journal::examine(state) {
        None if !journal.exists() => good(
            what,
            format!("{shown} does not exist; name the directory of a broker with --out or --state"),
        ),
        None => good(what, format!("{shown} is intact")),
        Some(wrong) => bad(
            what,
            wrong,
            "stop the broker, move journal.sqlite (with -wal and -shm) away and start the broker again: the \
             results and the gate are removed, and all files are judged again",
        ),
    }
}
