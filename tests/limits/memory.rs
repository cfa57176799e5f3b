//! Shared memory that is small, full or used by many at once; low limits of a process; and the
//! remains of killed checks.

use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::support::content::Content;
use crate::support::farm::shm_segments;
use crate::support::inside::{is_inside, run_inside};
use crate::support::processes::{signal_pid, temporary_name};
use crate::support::watchdog::{until, until_so};
use qcbus_bus::HostOptions;
use tempfile::TempDir;

/// Runs a test with a private shared memory of this size in MiB.
fn with_memory(test: &str, mib: u64, body: impl FnOnce()) {
    if is_inside() {
        return body();
    }
    let prepare = format!("mount -t tmpfs -o size={mib}m tmpfs /dev/shm");
    if let Some(status) = run_inside(module_path!(), test, &prepare) {
        assert!(status.success());
    }
}

/// A directory with files. Checks in it find only each other's instances.
struct Place(TempDir);

impl Place {
    fn new() -> Place {
        let place = Place(TempDir::new().unwrap());
        std::fs::create_dir(place.at("run")).unwrap();
        place
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.at(name), bytes).unwrap();
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command
            .args(arguments)
            .current_dir(self.0.path())
            .env("XDG_RUNTIME_DIR", self.at("run"))
            .env("NO_COLOR", "1")
            .stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> (Option<i32>, String) {
        said(&self.command(arguments).output().unwrap())
    }

    /// Counts the unfinished files below the directory of results.
    fn half_files(&self) -> usize {
        let entries = std::fs::read_dir(self.at("out"))
            .into_iter()
            .flatten()
            .flatten();
        let names = entries.map(|entry| entry.file_name());
        names
            .filter(|it| it.as_encoded_bytes().starts_with(b".qcbus-"))
            .count()
    }
}

/// Returns the exit code and the whole output.
fn said(output: &Output) -> (Option<i32>, String) {
    let text = [&*output.stdout, b"\n", &*output.stderr].concat();
    // Lines are wrapped at the width of the terminal.
    let words = String::from_utf8_lossy(&text)
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    (output.status.code(), words)
}

/// Creates a map of this size in bytes. Its image is several times as large.
fn dense(bytes: usize) -> Vec<u8> {
    let head = "<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/><userData code=\"x\">";
    let many = "<a b=\"1\"/>\n".repeat(bytes / 11);
    format!("{head}{many}</userData></OpenDRIVE>").into_bytes()
}

fn fill(mib: u64) {
    let filler = std::fs::File::create("/dev/shm/filler").unwrap();
    rustix::fs::fallocate(&filler, rustix::fs::FallocateFlags::empty(), 0, mib << 20).unwrap();
}

#[test]
fn map_that_never_fits_is_undetermined_at_once() {
    with_memory("map_that_never_fits_is_undetermined_at_once", 32, || {
        let place = Place::new();
        place.write("large.xodr", &dense(10_000_000));
        place.write("small.xodr", &Content::Good(1).bytes());
        let (code, said) = place.run(&["check", "large.xodr", "small.xodr", "-v", "--out", "out"]);
        assert_eq!(code, Some(3), "{said}");
        assert!(said.contains("undetermined: large.xodr"), "{said}");
        assert!(said.contains("small.xodr: "), "{said}");
        assert!(
            said.contains("/dev/shm has only 33554432 in total"),
            "{said}"
        );
        assert!(said.contains("docker run --shm-size="), "{said}");
    });
}

/// The image of this map was once refused. The reasons were an estimate of its size, and a quarter
/// of the memory that was kept free.
#[test]
fn map_that_just_fits_is_checked() {
    with_memory("map_that_just_fits_is_checked", 64, || {
        let place = Place::new();
        place.write("map.xodr", &dense(11_000_000));
        let (code, said) = place.run(&["check", "map.xodr", "-v", "--out", "out"]);
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("rejected: map.xodr"), "{said}");
    });
}

#[test]
fn map_that_may_fit_later_waits_for_limited_time() {
    with_memory("map_that_may_fit_later_waits_for_limited_time", 64, || {
        let place = Place::new();
        place.write("map.xodr", &dense(5_000_000));
        fill(40);
        let bounded = ["check", "map.xodr", "--out", "out", "--room-limit", "1s"];
        let (code, said) = place.run(&bounded);
        assert_eq!(code, Some(3), "{said}");
        assert!(said.contains("no room became free for 1 seconds"), "{said}");

        // The memory is so full that a broker cannot start.
        fill(60);
        let (code, said) = place.run(&bounded);
        assert_eq!(code, Some(5), "{said}");
        assert!(said.contains("waiting for shared memory"), "{said}");
        assert!(
            said.contains("until nothing had changed for 1 seconds"),
            "{said}"
        );

        let mut waiting = place.command(&["check", "map.xodr", "--out", "out"]);
        let mut waiting = waiting
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(waiting.stderr.take().unwrap()).lines();
        let first = lines.next().unwrap().unwrap();
        assert!(first.contains("waiting for shared memory"), "{first}");
        std::fs::remove_file("/dev/shm/filler").unwrap();
        assert_eq!(waiting.wait().unwrap().code(), Some(1));
    });
}

#[test]
fn concurrent_checks_in_small_memory_all_get_a_verdict() {
    with_memory(
        "concurrent_checks_in_small_memory_all_get_a_verdict",
        16,
        || {
            let place = Place::new();
            place.write("a.xodr", &Content::Good(1).bytes());
            let start = |number: usize| {
                let out = format!("out-{number}");
                let mut command = place.command(&["check", "a.xodr", "-q", "--out", &out]);
                command
                    .stdout(Stdio::piped())
                    .stderr(Stdio::piped())
                    .spawn()
                    .unwrap()
            };
            let all: Vec<_> = (0..24).map(start).collect();
            for check in all {
                let (code, said) = said(&check.wait_with_output().unwrap());
                assert_eq!(code, Some(0), "{said}");
            }
            assert_eq!(shm_segments("qc"), [""; 0]);
        },
    );
}

/// Checks whether `nohup` has started this process. Its children survive a closed terminal.
fn ignores_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let mut lines = status.lines();
    let mask = lines.find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & 1 == 1
}

#[test]
fn check_ended_by_a_signal_names_the_unchecked_files() {
    with_memory(
        "check_ended_by_a_signal_names_the_unchecked_files",
        64,
        || {
            let place = Place::new();
            place.write("large.xodr", &dense(5_000_000));
            for (filled, wanted) in [(40, "cannot publish"), (60, "waiting for shared memory")] {
                fill(filled);
                for (signal, name) in [
                    ("INT", rustix::process::Signal::INT),
                    ("TERM", rustix::process::Signal::TERM),
                    ("HUP", rustix::process::Signal::HUP),
                ] {
                    if ignores_hangups() && name == rustix::process::Signal::HUP {
                        eprintln!("skipped: SIGHUP, which programs ignore that nohup has started");
                        continue;
                    }
                    let mut check = place.command(&["check", "large.xodr", "--out", "out"]);
                    let mut check = check
                        .stderr(Stdio::piped())
                        .stdout(Stdio::null())
                        .spawn()
                        .unwrap();
                    let mut lines = BufReader::new(check.stderr.take().unwrap()).lines();
                    let first = lines.next().unwrap().unwrap();
                    assert!(first.contains(wanted), "{first}");
                    signal_pid(i32::try_from(check.id()).unwrap(), name);
                    let rest: Vec<String> = lines.map_while(Result::ok).collect();
                    let rest = rest.join("\n");
                    assert_eq!(check.wait().unwrap().code(), Some(3), "{signal}: {rest}");
                    assert!(rest.contains("stopped by a signal"), "{signal}: {rest}");
                    let named = rest.contains("  large.xodr")
                        || rest.contains("known: nothing was checked");
                    assert!(
                        named && !rest.contains("nothing to check"),
                        "{signal}: {rest}"
                    );
                }
            }
        },
    );
}

#[test]
fn operator_page_states_the_memory_use() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reliability.md");
    let page = std::fs::read_to_string(page).unwrap();
    let page = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let taken_for = |expected_peers| {
        let options = HostOptions {
            expected_peers,
            shm_reserve_bytes: 0,
            ..HostOptions::default()
        };
        options.shared_memory_bytes()
    };
    let kib = |bytes: u64| bytes.div_ceil(1 << 10);
    let (broker, peer) = (kib(taken_for(0)), kib(taken_for(1) - taken_for(0)));
    let taken = format!(
        "A broker takes {broker} KiB for the bus and {peer} KiB for each bundle and reporter"
    );
    assert!(page.contains(&taken), "{taken}");
    let (least, all) = HostOptions::default().address_bytes();
    let gib = |bytes: u64| (bytes as f64 / f64::from(1 << 30) * 10.0).ceil() / 10.0;
    let addresses = format!(
        "a broker needs {} GiB of addresses, or {} GiB",
        gib(all),
        gib(least)
    );
    assert!(page.contains(&addresses), "{addresses}");
}

#[test]
fn low_address_limit_is_reported_or_sufficient() {
    let place = Place::new();
    place.write("a.xodr", &Content::Good(1).bytes());
    let limited = |bytes: u64, arguments: &[&str]| {
        let mut command = place.command(arguments);
        let limit = rustix::process::Rlimit {
            current: Some(bytes),
            maximum: Some(bytes),
        };
        let set = move || {
            Ok(rustix::process::setrlimit(
                rustix::process::Resource::As,
                limit,
            )?)
        };
        #[expect(unsafe_code, reason = "a limit is set between fork and exec")]
        // SAFETY: setrlimit may be called there; nothing is allocated.
        unsafe {
            command.pre_exec(set);
        }
        said(&command.output().unwrap())
    };
    let check = ["check", "a.xodr", "--out", "out"];
    let (code, text) = limited(2 << 30, &check);
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = limited(600 << 20, &check);
    assert_eq!(code, Some(5), "{text}");
    assert!(text.contains("`ulimit -v unlimited`"), "{text}");
    std::fs::create_dir(place.at("inbox")).unwrap();
    let (code, text) = limited(600 << 20, &["serve", "inbox", "--instance-dir", "i"]);
    assert_eq!(code, Some(5), "{text}");
    assert!(text.contains("`ulimit -v unlimited`"), "{text}");
    // This image is larger than the first slots.
    place.write("large.xodr", &dense(5_000_000));
    let (code, text) = limited(2 << 30, &["check", "large.xodr", "--out", "out"]);
    assert_eq!(code, Some(3), "{text}");
    assert!(text.contains("`ulimit -v unlimited`"), "{text}");
    let (_, text) = limited(600 << 20, &["doctor", "--instance-dir", "i"]);
    assert!(text.contains("FIX address space"), "{text}");
}

#[test]
fn leftovers_of_a_killed_check_are_removed_later() {
    let place = Place::new();
    place.write("a.xodr", &Content::Good(1).bytes());
    let private = || {
        let entries = std::fs::read_dir(place.at("run/qcbus"))
            .into_iter()
            .flatten()
            .flatten();
        let names: Vec<_> = entries
            .map(|entry| entry.file_name().into_string().unwrap())
            .collect();
        names
            .into_iter()
            .filter(|it| it.starts_with("check-"))
            .collect::<Vec<_>>()
    };
    let arguments = ["check", "a.xodr", "--out", "out"];
    let mut killed = place.command(&arguments);
    let mut killed = killed
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let identity = || {
        let directory = place.at("run/qcbus").join(private().first()?);
        std::fs::read_to_string(directory.join("id")).ok()
    };
    let mut identity = until_some(identity);
    identity.truncate(18);
    killed.kill().unwrap();
    killed.wait().unwrap();
    // A check that is killed in the middle of a file leaves such a file. One is its own, the other
    // one belongs to a living process.
    std::fs::create_dir_all(place.at("out")).unwrap();
    let half = place
        .at("out")
        .join(format!(".qcbus-{}.1-a1b2c3.tmp", killed.id()));
    let living = place.at("out").join(temporary_name(std::process::id()));
    std::fs::write(&half, "half").unwrap();
    std::fs::write(&living, "half").unwrap();
    let (code, said) = place.run(&arguments);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!((half.exists(), living.exists()), (false, true));
    assert_eq!(place.half_files(), 1);
    // The bundles end by themselves, a moment after the check.
    until_so("its shared memory is gone", || {
        assert_eq!(place.run(&arguments).0, Some(0));
        private().is_empty() && shm_segments(&identity).is_empty()
    });
}

fn until_some<T>(look: impl FnMut() -> Option<T>) -> T {
    until("a private instance", look)
}
