//! Tests of error messages: each message names the problem and the remedy.

#![allow(
    missing_docs,
    reason = "this is all test code, including functions without `#[test]`"
)]

use std::path::Path;
use std::process::{Command, Output};

use crate::support::content::Content;
use crate::support::farm::Farm;
use crate::support::inside::{is_inside, run_inside};
use crate::support::processes::{signal_pid, temporary_name};
use crate::support::watchdog::until_or;
use qcbus_messages::Verdict;
use qcbus_messages::control::{Request, Response};
use rustix::process::Signal;

/// Returns the output of a run without this test's paths, process ids and numbers.
fn told(farm: &Farm, text: &str) -> String {
    let base = farm.base().to_string_lossy();
    let text = text.replace(&*base, "BASE");
    let words = text.lines().map(without_numbers);
    words.collect::<Vec<_>>().join("\n")
}

/// Replaces long numbers, because process ids and byte counts differ from run to run.
fn without_numbers(line: &str) -> String {
    let mut out = String::new();
    let mut digits = String::new();
    for c in line.chars().chain(['\n']) {
        if c.is_ascii_digit() {
            digits.push(c);
            continue;
        }
        let long = digits.len() >= 3;
        out.push_str(if long { "N" } else { &digits });
        digits.clear();
        out.push(c);
    }
    out.trim_end().to_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Waits for a notice in the broker's status that contains these words, and returns its text.
fn notice(farm: &Farm, words: &str) -> String {
    let look = || {
        let notices = farm.status()?.notices;
        notices
            .into_iter()
            .map(|it| it.text)
            .find(|it| it.contains(words))
    };
    let found = until_or("a notice", look, || format!("{words}\n{}", farm.log()));
    told(farm, &found)
}

#[test]
fn corrupt_journal_is_reported() {
    let farm = Farm::new();
    std::fs::create_dir_all(farm.journal().parent().unwrap()).unwrap();
    std::fs::write(
        farm.journal(),
        "this was a database once, before the disk broke",
    )
    .unwrap();
    let output = farm.serve_command().output().unwrap();
    assert_eq!(output.status.code(), Some(5));
    insta::assert_snapshot!(told(&farm, &stderr(&output)));
    assert!(
        !farm.instance().join("control.sock").exists(),
        "no file remains"
    );
}

#[test]
fn second_broker_on_the_same_instance_is_refused() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let output = farm.serve_command().output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    insta::assert_snapshot!(told(&farm, &stderr(&output)));
    farm.write("a.xodr", &Content::Good(1).bytes());
    // The first broker is not affected.
    farm.verdict("a.xodr");
}

#[test]
fn bundle_of_another_version_is_refused() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    farm.let_in("speaks_another_protocol", "");
    let said = notice(&farm, "refused: ");
    let ours = qcbus_messages::PROTOCOL_VERSION;
    // The bundle's version is far from the broker's. The test does not depend on either number.
    let words: Vec<&str> = said.split(' ').collect();
    let number = |word: &str| word.trim_end_matches([':', ',']).parse::<u32>().is_ok();
    assert!(words.contains(&&*format!("{ours}:")), "{said}");
    let shown = |word: &&str| {
        if number(word) {
            word.replace(|c: char| c.is_ascii_digit(), "N")
        } else {
            (*word).to_owned()
        }
    };
    let shown: Vec<String> = words.iter().map(shown).collect();
    insta::assert_snapshot!(shown.join(" ").replace("NN", "N"));
}

#[test]
fn wait_with_a_timeout_ends_beside_a_stopped_broker() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Good(1).bytes());
    farm.verdict("a.xodr");
    let pid = i32::try_from(broker.pid()).unwrap();
    signal_pid(pid, Signal::STOP);
    let file = farm.root().join("a.xodr");
    let said = farm.qcbus(&["wait", "--timeout", "300ms", &file.to_string_lossy()]);
    signal_pid(pid, Signal::CONT);
    assert_eq!(said.status.code(), Some(3), "{said:?}");
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
}

#[test]
fn bundle_that_cannot_be_started_is_reported() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let manifest = r#"{"module": [{"name": "missing", "exec_type": "executable",
        "module_type": "checker_bundle", "exec_command": "/no/such/program", "mode": "bus"}]}"#;
    std::fs::write(farm.bundles_d().join("missing.json"), manifest).unwrap();
    insta::assert_snapshot!(notice(&farm, "missing: "));
}

#[test]
fn missing_watched_directory_is_reported_until_it_is_back() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Good(1).bytes());
    farm.verdict("a.xodr");
    let aside = farm.base().join("aside");
    std::fs::rename(farm.root(), &aside).unwrap();
    insta::assert_snapshot!(notice(&farm, "is gone"));
    assert!(
        farm.out().join("a.xodr.xqar").exists(),
        "the results are kept"
    );
    // The accepted file is missing, so the broker must not report it as accepted.
    let wait = |timeout_ms| Request::Wait {
        file: farm.root().join("a.xodr"),
        timeout_ms: Some(timeout_ms),
    };
    assert_eq!(farm.ask(&wait(300)), Some(Response::TimedOut));
    let told = std::thread::scope(|scope| {
        let waiting = scope.spawn(|| farm.ask(&wait(120_000)));
        std::fs::rename(&aside, farm.root()).unwrap();
        waiting.join().unwrap()
    });
    assert!(matches!(told, Some(Response::Verdict(_))), "{told:?}");
    insta::assert_snapshot!(notice(&farm, "is back"));
    what_must_be_judged_again_while_its_directory_is_away(&farm, &aside);
    farm.write("b.xodr", &Content::Good(2).bytes());
    farm.verdict("b.xodr");
}

#[test]
fn replaced_watched_directory_is_not_reported_as_gone() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let aside = farm.base().join("aside");
    std::fs::write(&aside, "no directory").unwrap();
    // The exchange is atomic. Otherwise the directory would be missing in between.
    let exchange = || {
        let flags = rustix::fs::RenameFlags::EXCHANGE;
        rustix::fs::renameat_with(rustix::fs::CWD, &aside, rustix::fs::CWD, farm.root(), flags)
    };
    exchange().unwrap();
    notice(&farm, "is not a directory any more");
    exchange().unwrap();
    notice(&farm, "is back");
}

/// Checks that files are judged again after their directory was away. A new bundle makes every
/// verdict outdated while nothing can be read.
fn what_must_be_judged_again_while_its_directory_is_away(farm: &Farm, aside: &Path) {
    std::fs::rename(farm.root(), aside).unwrap();
    farm.let_in("polite", "");
    until_or(
        "the file has gone with its directory",
        || farm.status().filter(|it| it.files.total == 0),
        || format!("{:#?}", farm.status()),
    );
    std::fs::rename(aside, farm.root()).unwrap();
    farm.settle(1);
    let bundles = farm.result("a.xodr").bundles;
    assert!(bundles.iter().any(|it| it.name == "polite"), "{bundles:?}");
}

#[test]
fn missing_watched_directory_is_refused_at_the_start() {
    let farm = Farm::new();
    std::fs::remove_dir(farm.root()).unwrap();
    let output = farm.serve_command().output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    insta::assert_snapshot!(told(&farm, &stderr(&output)));
}

/// Runs the test in a namespace where it may mount, or prints why this is not possible.
fn inside(test: &str, prepare: &str, body: fn()) {
    if is_inside() {
        return body();
    }
    if let Some(status) = run_inside(module_path!(), test, prepare) {
        assert!(status.success(), "the inner test must succeed, see above");
    }
}

fn mount(directory: &Path, options: &str) {
    let mut command = Command::new("mount");
    command
        .args(["-t", "tmpfs", "-o", options, "tmpfs"])
        .arg(directory);
    assert!(command.status().unwrap().success());
}

#[test]
fn unwritable_output_directory_is_reported() {
    inside("unwritable_output_directory_is_reported", "true", || {
        let mut farm = Farm::new();
        std::fs::create_dir(farm.out()).unwrap();
        // Root may write anywhere except on a read-only file system.
        mount(&farm.out(), "ro,size=1m");
        let output = farm.serve_command().output().unwrap();
        assert_eq!(output.status.code(), Some(5));
        insta::assert_snapshot!(told(&farm, &stderr(&output)));
        // With the state elsewhere the broker starts, and reports why results are missing.
        let state = farm.base().join("state").to_string_lossy().into_owned();
        farm.arguments = vec!["--state".to_owned(), state];
        let _broker = farm.serve_ready();
        farm.write("a.xodr", &Content::Good(1).bytes());
        insta::assert_snapshot!(notice(&farm, "cannot write"));
    });
}

#[test]
fn full_output_disk_is_reported() {
    inside("full_output_disk_is_reported", "true", || {
        let mut farm = Farm::new();
        std::fs::create_dir(farm.out()).unwrap();
        mount(&farm.out(), "size=1m");
        let state = farm.base().join("state").to_string_lossy().into_owned();
        farm.arguments = vec!["--state".to_owned(), state];
        let filler = farm.out().join("filler");
        std::fs::write(&filler, vec![0; 1 << 20]).unwrap();
        let _broker = farm.serve_ready();
        farm.write("a.xodr", &Content::Good(1).bytes());
        insta::assert_snapshot!(notice(&farm, "cannot write"));
        let left: Vec<String> = std::fs::read_dir(farm.out())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        assert!(
            !left.iter().any(|name| name.ends_with(".xqar")),
            "no partial result may remain: {left:?}"
        );
        let lost = Content::Scenario(1, "nowhere.xodr".to_owned());
        farm.write("lost.xosc", &lost.bytes());
        notice(&farm, "lost.xosc");
        std::fs::remove_file(&filler).unwrap();
        // When there is space again, the verdict appears by itself.
        let verdict = farm.verdict("a.xodr");
        assert_eq!(verdict.verdict, Content::Good(1).verdict());
        // The second attempt also reports the diagnostics from reading the file.
        let verdict = farm.verdict("lost.xosc");
        assert_eq!(verdict.verdict, Verdict::Rejected, "{verdict:?}");
    });
}

#[test]
fn full_state_disk_is_reported() {
    inside("full_state_disk_is_reported", "true", || {
        let mut farm = Farm::new();
        let state = farm.base().join("state");
        std::fs::create_dir(&state).unwrap();
        // The size is enough for the journal with the bundles' catalogues (0.2 MiB) and its log,
        // once there is space.
        mount(&state, "size=4m,mode=700");
        farm.arguments = vec!["--state".to_owned(), state.to_string_lossy().into_owned()];
        let _broker = farm.serve_ready();
        let filler = std::fs::File::create(state.join("filler")).unwrap();
        let free = {
            let space = rustix::fs::statvfs(&state).unwrap();
            space.f_bavail * space.f_frsize
        };
        rustix::fs::fallocate(&filler, rustix::fs::FallocateFlags::empty(), 0, free).unwrap();
        for number in 0..20 {
            farm.write(&format!("{number}.xodr"), &Content::Good(number).bytes());
        }
        insta::assert_snapshot!(notice(&farm, "journal"));
        drop(filler);
        std::fs::remove_file(state.join("filler")).unwrap();
        farm.settle(20);
    });
}

#[test]
fn full_shared_memory_is_reported() {
    let prepare = "mount -t tmpfs -o size=64m tmpfs /dev/shm";
    inside("full_shared_memory_is_reported", prepare, || {
        let farm = Farm::new();
        let _broker = farm.serve_ready();
        let filler = std::fs::File::create("/dev/shm/filler").unwrap();
        let space = rustix::fs::statvfs("/dev/shm").unwrap();
        let size = (space.f_bavail * space.f_frsize).saturating_sub(1 << 20);
        rustix::fs::fallocate(&filler, rustix::fs::FallocateFlags::empty(), 0, size).unwrap();
        farm.write("a.xodr", &Content::Good(1).bytes());
        insta::assert_snapshot!(notice(&farm, "cannot publish"));
        let late = Farm::new();
        let output = late.serve_command().output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(5),
            "the broker must not start, and must not get a bus error"
        );
        insta::assert_snapshot!(told(&late, &stderr(&output)));
        drop(filler);
        std::fs::remove_file("/dev/shm/filler").unwrap();
        let verdict = farm.verdict("a.xodr");
        assert_eq!(verdict.verdict, Content::Good(1).verdict());
    });
}

#[test]
fn shared_memory_filled_by_others_kills_no_broker() {
    let prepare = "mount -t tmpfs -o size=64m tmpfs /dev/shm";
    inside(
        "shared_memory_filled_by_others_kills_no_broker",
        prepare,
        || {
            let farm = Farm::new();
            let _broker = farm.serve_ready();
            for number in 1..4 {
                farm.write("a.xodr", &Content::Good(number).bytes());
                farm.verdict("a.xodr");
            }
            let full = Command::new("dd")
                .args(["if=/dev/zero", "of=/dev/shm/filler", "bs=4k"])
                .output()
                .unwrap();
            assert!(stderr(&full).contains("No space left"), "{full:?}");
            farm.write("a.xodr", &Content::Good(4).bytes());
            notice(&farm, "cannot publish");
            std::fs::remove_file("/dev/shm/filler").unwrap();
            let verdict = farm.verdict("a.xodr");
            assert_eq!(verdict.verdict, Content::Good(4).verdict());
        },
    );
}

#[test]
fn read_only_shared_memory_is_reported() {
    let prepare = "mount -t tmpfs -o ro tmpfs /dev/shm";
    inside("read_only_shared_memory_is_reported", prepare, || {
        let farm = Farm::new();
        let served = farm.serve_command().output().unwrap();
        assert_eq!(served.status.code(), Some(5));
        insta::assert_snapshot!(told(&farm, &stderr(&served)));
        let looked_at = farm.qcbus(&["doctor"]);
        assert_eq!(looked_at.status.code(), Some(1));
        let remarks = String::from_utf8_lossy(&looked_at.stdout).into_owned();
        let remark: Vec<&str> = remarks
            .lines()
            .skip_while(|line| !line.contains("shared memory"))
            .take(2)
            .collect();
        insta::assert_snapshot!(remark.join("\n"));
    });
}

/// A killed process that waits for the disk ends later, and the broker is not its parent.
#[test]
fn remains_of_a_process_that_outlives_the_earlier_broker_are_removed() {
    let farm = Farm::new();
    let mut writer = Command::new("sleep").arg("1000").spawn().unwrap();
    std::fs::create_dir(farm.out()).unwrap();
    let partial = farm.out().join(temporary_name(writer.id()));
    std::fs::write(&partial, "half").unwrap();
    let _broker = farm.serve_ready();
    assert!(partial.exists(), "its writer lives");
    writer.kill().unwrap();
    writer.wait().unwrap();
    let is_removed = || (!partial.exists()).then_some(());
    until_or("the file is removed", is_removed, || farm.log());
}
