//! Hostile files in the watched directory: pipes, devices, files of the kernel and files with a
//! lease, which are swapped all the time. The files of others are judged as usual, and the broker
//! stops when it is told to. The same holds with few descriptors and with a clock that jumps.

use std::fs::{File, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::support::broker::Broker;
use crate::support::content::{CATALOG, Content, Mark};
use crate::support::farm::Farm;
use crate::support::inside::skip;
use crate::support::watchdog::until_or;
use nix::libc;
use qcbus_messages::Verdict;
use qcbus_messages::control::{NoticeStatus, Request, Response};

fn fifo(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success());
}

fn is_judged(farm: &Farm, name: &str, content: &Content) {
    farm.write(name, &content.bytes());
    assert_eq!(farm.verdict(name).verdict, content.verdict(), "{name}");
}

#[test]
fn files_that_become_pipes_delay_no_other() {
    const NAMES: usize = 16;
    const ROUNDS: usize = 150;
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let pipes = farm.base().join("pipes");
    std::fs::create_dir(&pipes).unwrap();
    let bytes = Content::Good(1).bytes();
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let swapping = scope.spawn(|| {
            for round in 0..ROUNDS {
                for name in 0..NAMES {
                    let (pipe, file) = (pipes.join("pipe"), pipes.join("file"));
                    let at = farm.root().join(format!("{name}.xodr"));
                    std::fs::write(&file, &bytes).unwrap();
                    std::fs::rename(&file, &at).unwrap();
                    if (name + round) % 2 == 0 {
                        fifo(&pipe);
                        std::fs::rename(&pipe, &at).unwrap();
                    }
                }
            }
            ended.store(true, Ordering::Release);
        });
        let mut number = 100;
        while !ended.load(Ordering::Acquire) && !swapping.is_finished() {
            number += 1;
            is_judged(
                &farm,
                &format!("honest-{number}.xodr"),
                &Content::Good(number),
            );
        }
    });
    is_judged(&farm, "last.xodr", &Content::NoHeader(9));
    for name in 0..NAMES {
        let name = format!("{name}.xodr");
        std::fs::remove_file(farm.root().join(&name)).unwrap();
        is_judged(&farm, &name, &Content::Good(2));
    }
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

/// A map disappears and becomes a pipe. That is not a missing map, and the author is told.
#[test]
fn map_that_becomes_a_pipe_is_not_reported_missing() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    std::fs::create_dir(farm.root().join("catalogs")).unwrap();
    is_judged(&farm, CATALOG, &Content::Catalog(1, Mark::Clean));
    is_judged(&farm, "map.xodr", &Content::Good(1));
    let scenario = Content::Scenario(1, "map.xodr".to_owned());
    is_judged(&farm, "drive.xosc", &scenario);
    let map = farm.root().join("map.xodr");
    let becomes = |what: &str, wanted: Verdict| {
        let verdict = || (farm.verdict("drive.xosc").verdict == wanted).then_some(());
        until_or(what, verdict, || farm.log());
    };
    std::fs::remove_file(&map).unwrap();
    becomes("the map is missing", Verdict::Rejected);
    fifo(&map);
    becomes("the map cannot be read", Verdict::Undetermined);
    std::fs::remove_file(&map).unwrap();
    becomes("the map is missing again", Verdict::Rejected);
    is_judged(&farm, "map.xodr", &Content::Good(2));
    becomes("the map is back", Verdict::Accepted);
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

/// A client that waits for an impossible verdict gets the reason at once.
#[test]
fn waiting_for_a_special_file_gives_the_reason() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let at = |name: &str| farm.root().join(name);
    fifo(&at("pipe.xodr"));
    std::fs::create_dir(at("directory.xodr")).unwrap();
    symlink("loop.xodr", at("loop.xodr")).unwrap();
    symlink(farm.base(), at("outside.xodr")).unwrap();
    symlink("/dev/zero", at("zero.xodr")).unwrap();
    for (name, why) in [
        ("pipe.xodr", "a pipe, a socket or a device"),
        ("zero.xodr", "a pipe, a socket or a device"),
        ("directory.xodr", "a directory"),
        ("loop.xodr", "leads back to itself"),
        ("outside.xodr", "a symbolic link to the directory"),
    ] {
        // There is no timeout: the command ends because there is an answer.
        let path = at(name);
        let told = farm.qcbus(&["wait", path.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&told.stderr);
        assert_eq!(told.status.code(), Some(2), "{name}: {said}");
        assert!(said.contains(why), "{name}: {said}");
    }
    // A missing file may still appear.
    farm.wait_in_vain(&at("gone.xodr"), &[], "the file does not exist");
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

#[test]
fn kernel_files_as_maps_delay_no_other() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let maps = ["/proc/kmsg", "/dev/zero", "/dev/tty", "/proc/self/maps"];
    for (number, map) in maps.iter().enumerate() {
        for copy in 0..4 {
            farm.write(
                &format!("{number}-{copy}.xosc"),
                &Content::Scenario(copy, (*map).to_owned()).bytes(),
            );
        }
    }
    is_judged(&farm, "honest.xodr", &Content::Good(1));
    for number in 0..maps.len() {
        let verdict = farm.verdict(&format!("{number}-0.xosc"));
        assert_ne!(
            verdict.verdict,
            Verdict::Accepted,
            "the map was not checked"
        );
    }
    symlink("/dev/zero", farm.root().join("zero.xodr")).unwrap();
    symlink("/proc/kmsg", farm.root().join("kernel.xodr")).unwrap();
    is_judged(&farm, "another.xodr", &Content::Good(2));
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

/// Takes a lease: its holder is asked before others read the file, and does not answer.
#[expect(unsafe_code, reason = "no crate wraps leases")]
fn lease(file: &File) -> bool {
    use std::os::fd::AsRawFd;
    // SAFETY: a bare system call on an open descriptor.
    unsafe { libc::fcntl(file.as_raw_fd(), libc::F_SETLEASE, libc::F_WRLCK) == 0 }
}

#[test]
fn leased_files_delay_no_other() {
    // The kernel requests the lease back by this signal, which would end the process.
    #[expect(unsafe_code, reason = "no other call disables the default action")]
    // SAFETY: no function is called when the signal arrives.
    unsafe {
        libc::signal(libc::SIGIO, libc::SIG_IGN);
    }
    let farm = Farm::new();
    let aside = farm.base().join("aside");
    std::fs::create_dir(&aside).unwrap();
    let mut leased = Vec::new();
    for number in 0..8 {
        let path = aside.join(format!("{number}.xodr"));
        std::fs::write(&path, Content::Good(number).bytes()).unwrap();
        let file = File::options().read(true).write(true).open(&path).unwrap();
        if !lease(&file) {
            let why = std::io::Error::last_os_error();
            return skip(
                "leased_files_delay_no_other",
                &format!("no lease is given: {why}"),
            );
        }
        leased.push(file);
    }
    let mut broker = farm.serve_ready();
    for number in 0..8 {
        let name = format!("{number}.xodr");
        std::fs::rename(aside.join(&name), farm.root().join(&name)).unwrap();
    }
    for number in 20..40 {
        is_judged(&farm, &format!("{number}.xodr"), &Content::Good(number));
    }
    drop(leased);
    for number in 0..8 {
        let name = format!("{number}.xodr");
        let verdict = || {
            let request = Request::Wait {
                file: farm.root().join(&name),
                timeout_ms: Some(1_000),
            };
            match farm.ask(&request)? {
                Response::Verdict(it) => (it.verdict == Verdict::Accepted).then_some(()),
                _ => None,
            }
        };
        until_or("what was leased is judged", verdict, || farm.log());
    }
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

/// A process of the same user was stopped at the wrong moment, for instance in a debugger. It holds
/// the lock that serializes the allocation of shared memory.
#[test]
fn stopped_process_does_not_keep_bundles_from_joining() {
    let farm = Farm::new();
    let runtime = farm.base().join("runtime");
    std::fs::create_dir_all(runtime.join("qcbus")).unwrap();
    for directory in [&runtime, &runtime.join("qcbus")] {
        std::fs::set_permissions(directory, Permissions::from_mode(0o700)).unwrap();
    }
    let held = File::create(runtime.join("qcbus/.memory")).unwrap();
    held.lock().unwrap();
    let mut command = farm.serve_command();
    command.env("XDG_RUNTIME_DIR", &runtime);
    let _broker = Broker::start(&mut command, &farm.log_path());
    farm.write("a.xodr", &Content::Good(1).bytes());
    is_judged(&farm, "a.xodr", &Content::Good(1));
    let log = farm.log();
    assert!(!log.contains("does not respond"), "{log}");
}

#[test]
fn low_descriptor_limit_is_reported_and_sufficient() {
    let farm = Farm::new();
    let serve = farm.serve_command();
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -n 256 && exec \"$@\"", "sh"]);
    limited.arg(serve.get_program()).args(serve.get_args());
    let _broker = Broker::start(&mut limited, &farm.log_path());
    for number in 0..200 {
        farm.write(&format!("{number}.xodr"), &Content::Good(number).bytes());
    }
    let status = farm.settle(200);
    assert_eq!(status.files.accepted, 200);
    let said = |it: &NoticeStatus| it.kind == "limited" && it.text.contains("LimitNOFILE=");
    assert!(status.notices.iter().any(said), "{:#?}", status.notices);
}

/// Builds the library that makes the clock jump. Returns `None` with a message if that is
/// impossible.
fn clock(farm: &Farm) -> Option<PathBuf> {
    let library = farm.base().join("libclock.so");
    let compiler = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/clock/clock.rs");
    let mut build = Command::new(compiler);
    build.args(["--edition", "2024", "--crate-type", "cdylib", "-O", "-o"]);
    let built = build.arg(&library).arg(source).output();
    let why = match built {
        Ok(built) if built.status.success() => return Some(library),
        Ok(built) => String::from_utf8_lossy(&built.stderr).into_owned(),
        Err(error) => error.to_string(),
    };
    skip("clock_jumps_cost_no_verdict", &why);
    None
}

#[test]
fn clock_jumps_cost_no_verdict() {
    const YEAR: i64 = 366 * 24 * 3600;
    let farm = Farm::new();
    let Some(library) = clock(&farm) else { return };
    let offset = farm.base().join("offset");
    let jump = |seconds: i64| {
        let aside = farm.base().join("offset.new");
        std::fs::write(&aside, seconds.to_string()).unwrap();
        std::fs::rename(aside, &offset).unwrap();
    };
    jump(0);
    let serve = || {
        let mut command = farm.serve_command();
        command
            .env("LD_PRELOAD", &library)
            .env("QCBUS_TEST_CLOCK", &offset);
        Broker::start(&mut command, &farm.log_path())
    };
    let mut broker = serve();
    is_judged(&farm, "map.xodr", &Content::Good(1));
    is_judged(&farm, "stays.xodr", &Content::NoHeader(1));
    for (round, seconds) in (1..).zip([YEAR, -YEAR, 3600, -3600, -20 * YEAR, 2, 0]) {
        jump(seconds);
        is_judged(&farm, "map.xodr", &Content::Good(10 + round));
        is_judged(&farm, "map.xodr", &Content::NoHeader(10 + round));
        is_judged(
            &farm,
            &format!("new-{round}.xodr"),
            &Content::Good(20 + round),
        );
        assert_eq!(farm.verdict("stays.xodr").verdict, Verdict::Rejected);
        if round % 3 == 0 {
            broker.kill();
            broker = serve();
        }
    }
    let status = farm.settle(2 + 7);
    assert_eq!((status.files.accepted, status.files.rejected), (7, 2));
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}
