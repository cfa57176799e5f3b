//! What a directory may hold besides plain files with plain names: symbolic links, names that are
//! no text, and what cannot be looked at. Each is checked, or said, and what is said counts.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails where it stands"
)]

mod support;

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use qcbus_messages::Verdict;
use qcbus_messages::control::{FileVerdict, Request, Response};
use qcbus_messages::path_text::to_text;
use support::broker::Broker;
use support::content::Content;
use support::desk::{Desk, Said, files_below};
use support::farm::{Farm, tail};
use support::judge::verdicts_in_journal;
use support::watchdog::{until_or, until_so};

/// A farm with a gate, and with a directory beside it that nobody watches.
fn farm_with_gate() -> (Farm, PathBuf, PathBuf) {
    let mut farm = Farm::new();
    let gate = farm.base().join("gate");
    let arguments = ["--gate".to_owned(), gate.to_string_lossy().into_owned()];
    farm.arguments.extend(arguments);
    let beside = farm.base().join("beside");
    std::fs::create_dir(&beside).unwrap();
    (farm, gate, beside)
}

/// The verdict on a file's present bytes.
fn verdict(farm: &Farm, path: &Path) -> FileVerdict {
    let request = Request::Wait {
        file: path.to_path_buf(),
        timeout_ms: Some(120_000),
    };
    let explain = || format!("{:#?}\n{}", farm.status(), tail(&farm.log()));
    let answered = || match farm.ask(&request)? {
        Response::Verdict(verdict) => Some(verdict),
        _ => None,
    };
    until_or("a verdict", answered, explain)
}

fn down(farm: &Farm, mut broker: Broker) {
    farm.qcbus(&["down"]);
    broker.wait();
}

/// Nobody asks: the watcher itself notices.
fn becomes(farm: &Farm, gate: &Path, name: &str, verdict: Option<Verdict>) {
    let file = farm.out().join(format!("{name}.verdict.json"));
    let said = || {
        let told: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).ok()?).ok()?;
        told["verdict"].as_str().map(str::to_owned)
    };
    let expected = verdict.map(|it| it.as_str().to_owned());
    until_or(
        "the watcher notices",
        || (said() == expected).then_some(()),
        || format!("{name}: {expected:?}\n{:?}\n{}", said(), tail(&farm.log())),
    );
    let published = gate.join(name);
    until_so("the gate follows", || {
        published.exists() == (verdict == Some(Verdict::Accepted))
    });
}

#[test]
fn a_file_behind_a_link_is_judged_whatever_happens_behind_it() {
    let (farm, gate, beside) = farm_with_gate();
    let target = beside.join("target");
    let good = Content::Good(1).bytes();
    std::fs::write(&target, &good).unwrap();
    let link = farm.root().join("a.xodr");
    symlink(&target, &link).unwrap();
    let _broker = farm.serve_ready();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    let told = verdict(&farm, &link);
    assert_eq!(told.file, link);
    assert_eq!(told.xqar, farm.out().join("a.xodr.xqar"));
    // Its bytes, not another link to them.
    let published = std::fs::symlink_metadata(gate.join("a.xodr")).unwrap();
    assert!(published.is_file());
    assert_eq!(std::fs::read(gate.join("a.xodr")).unwrap(), good);

    // Rewritten in place.
    std::fs::write(&target, Content::NoHeader(2).bytes()).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Rejected));
    // Replaced.
    std::fs::write(beside.join("new"), Content::Good(3).bytes()).unwrap();
    std::fs::rename(beside.join("new"), &target).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    // Pointed elsewhere.
    std::fs::write(beside.join("bad"), Content::NoHeader(4).bytes()).unwrap();
    std::fs::remove_file(&link).unwrap();
    symlink(beside.join("bad"), &link).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Rejected));
    // To nothing, and back.
    std::fs::remove_file(beside.join("bad")).unwrap();
    becomes(&farm, &gate, "a.xodr", None);
    let unseen = || farm.status().is_some_and(|it| it.unseen.len() == 1);
    until_so("the status says what is unseen", unseen);
    std::fs::write(beside.join("bad"), Content::Good(5).bytes()).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    until_so("nothing is unseen any more", || {
        farm.status().is_some_and(|it| it.unseen.is_empty())
    });
    // Whoever asks at once is told of what is there now.
    std::fs::write(beside.join("bad"), Content::NoHeader(6).bytes()).unwrap();
    assert_eq!(verdict(&farm, &link).verdict, Verdict::Rejected);
    std::fs::remove_file(&link).unwrap();
    becomes(&farm, &gate, "a.xodr", None);
}

#[test]
fn a_verdict_on_what_lies_behind_a_link_outlives_the_broker() {
    let (farm, gate, beside) = farm_with_gate();
    std::fs::write(beside.join("target"), Content::Good(1).bytes()).unwrap();
    symlink(beside.join("target"), farm.root().join("a.xodr")).unwrap();
    let broker = farm.serve_ready();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    farm.settle(1);
    down(&farm, broker);
    // While nobody watches.
    std::fs::write(beside.join("target"), Content::NoHeader(2).bytes()).unwrap();
    let _broker = farm.serve_ready();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Rejected));
}

#[test]
fn a_directory_keeps_its_name_however_many_links_lead_to_it() {
    let (farm, gate, beside) = farm_with_gate();
    std::fs::create_dir(farm.root().join("maps")).unwrap();
    // Before the name of the directory, and after it.
    for link in ["again", "once_more"] {
        symlink("maps", farm.root().join(link)).unwrap();
    }
    let _broker = farm.serve_ready();
    std::fs::write(beside.join("new"), Content::Good(1).bytes()).unwrap();
    std::fs::rename(beside.join("new"), farm.root().join("maps/a.xodr")).unwrap();
    becomes(&farm, &gate, "maps/a.xodr", Some(Verdict::Accepted));
    assert!(farm.settle(1).unseen.is_empty());
    let mut published: Vec<PathBuf> = files_below(&gate);
    published.retain(|it| it != Path::new(".qcbus-gate"));
    assert_eq!(published, [Path::new("maps/a.xodr")]);
}

fn check(desk: &Desk, more: &[&str]) -> Said {
    desk.qcbus(&[&["check"][..], more, &["--out", "out"]].concat())
}

#[test]
fn what_a_linked_file_includes_lies_beside_the_link() {
    let desk = Desk::new();
    let (outer, view) = Content::road_in_two_parts();
    let target = desk.write("store/4711", outer);
    desk.write("maps/view.xml", view);
    symlink(&target, desk.path().join("maps/a.xodr")).unwrap();
    // As a program finds it that opens the path that it is given.
    for named in ["maps", "maps/a.xodr"] {
        let said = check(&desk, &[named]);
        assert_eq!(said.code, Some(0), "{named}: {}", said.whole(&desk));
        assert!(desk.path().join("out/maps/a.xodr.xqar").exists());
        std::fs::remove_dir_all(desk.path().join("out")).unwrap();
    }
    std::fs::remove_file(desk.path().join("maps/view.xml")).unwrap();
    assert_eq!(check(&desk, &["maps"]).code, Some(1));
}

/// A desk with one good file in `maps`.
fn desk_with_a_good_file() -> Desk {
    let desk = Desk::new();
    desk.write("maps/a.xodr", Content::Good(1).bytes());
    desk
}

#[test]
fn what_cannot_be_looked_at_is_said_and_counts() {
    type Trouble = fn(&Desk, &Path);
    let troubles: [(&str, Trouble); 5] = [
        ("maps/b.xodr", |_, path| symlink("gone", path).unwrap()),
        ("maps/loop", |_, path| symlink("loop", path).unwrap()),
        ("maps/b.xosc", |_, path| symlink("b.xosc", path).unwrap()),
        ("maps/more", |desk, path| {
            desk.write("elsewhere/b.xodr", Content::NoHeader(2).bytes());
            symlink(desk.path().join("elsewhere"), path).unwrap();
        }),
        ("maps/c.xodr", |_, path| symlink("/dev/null", path).unwrap()),
    ];
    for (name, trouble) in troubles {
        let desk = desk_with_a_good_file();
        trouble(&desk, &desk.path().join(name));
        let said = check(&desk, &["maps"]);
        assert_eq!(said.code, Some(3), "{}", said.whole(&desk));
        let note = format!("note: not looked at: [DESK]/{name}: ");
        let told = desk.tidy(&said.stderr);
        assert_eq!(told.matches(&note).count(), 1, "{told}");
        // An error weighs more.
        desk.write("maps/d.xodr", Content::NoHeader(3).bytes());
        assert_eq!(check(&desk, &["maps"]).code, Some(1));
        // Nothing else to be seen.
        for file in ["maps/a.xodr", "maps/d.xodr"] {
            std::fs::remove_file(desk.path().join(file)).unwrap();
        }
        let said = check(&desk, &["maps"]);
        assert_eq!(said.code, Some(3), "{}", said.whole(&desk));
    }
}

#[test]
fn links_to_what_is_looked_at_anyway_are_nothing_to_speak_of() {
    let desk = desk_with_a_good_file();
    desk.write("maps/deep/b.xodr", Content::Good(2).bytes());
    symlink("deep", desk.path().join("maps/again")).unwrap();
    symlink("..", desk.path().join("maps/deep/up")).unwrap();
    symlink("nowhere", desk.path().join("maps/readme")).unwrap();
    desk.write("other/c.xodr", Content::Good(3).bytes());
    symlink("../other", desk.path().join("maps/other")).unwrap();
    let said = check(&desk, &["maps", "other", "-q"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&desk));
    assert!(said.stderr.contains("3 files"), "{}", said.stderr);
    assert!(!said.stderr.contains("note"), "{}", said.stderr);
}

/// Who is nobody: root may look into every directory.
const NOBODY: &str = "65534";

#[test]
fn a_directory_that_may_not_be_read_counts() {
    let desk = desk_with_a_good_file();
    let closed = desk.path().join("maps/closed");
    std::fs::create_dir(&closed).unwrap();
    let rights = |path: &Path, mode| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    };
    rights(&closed, 0o000);
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    if std::fs::read_dir(&closed).is_ok() {
        // As somebody else, with a program and places that everybody may use.
        let program = desk.path().join("qcbus");
        std::fs::copy(env!("CARGO_BIN_EXE_qcbus"), &program).unwrap();
        let run = desk.path().join(".run");
        for path in [desk.path(), &run, &desk.path().join("maps")] {
            rights(path, 0o1777);
        }
        let _ = std::os::unix::fs::chown(&run, NOBODY.parse().ok(), NOBODY.parse().ok());
        rights(&run, 0o700);
        command = Command::new("setpriv");
        command.args(["--reuid", NOBODY, "--regid", NOBODY, "--clear-groups"]);
        if !command
            .arg("true")
            .output()
            .is_ok_and(|it| it.status.success())
        {
            let why = "this user may read everything and cannot be another";
            support::inside::skip("a_directory_that_may_not_be_read_counts", why);
            return;
        }
        command = Command::new("setpriv");
        command.args(["--reuid", NOBODY, "--regid", NOBODY, "--clear-groups"]);
        command.arg(program);
    }
    let said = desk.run(command.args(["check", "maps", "--out", "out"]));
    rights(&closed, 0o700);
    assert_eq!(said.code, Some(3), "{}", said.whole(&desk));
    let told = desk.tidy(&said.stderr);
    let note = "note: not looked at: [DESK]/maps/closed: cannot look into this directory";
    assert_eq!(told.matches(note).count(), 1, "{told}");
}

/// Two names that differ in one byte, which is no text in either.
const NAMES: [&[u8]; 2] = [b"stra\xDFe.xodr", b"stra\xFEe.xodr"];

fn name(bytes: &[u8]) -> &Path {
    Path::new(OsStr::from_bytes(bytes))
}

/// A good file and one with an error, under these names.
fn put_both(directory: &Path) {
    let [good, bad] = NAMES.map(|it| directory.join(name(it)));
    std::fs::write(good, Content::Good(1).bytes()).unwrap();
    std::fs::write(bad, Content::NoHeader(2).bytes()).unwrap();
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

#[test]
fn names_that_are_no_text_have_a_result_each() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path().join("maps")).unwrap();
    put_both(&desk.path().join("maps"));
    let said = check(&desk, &["maps"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&desk));
    assert!(said.stderr.contains("2 files: 1 accepted, 1 rejected"));
    // The place of the error, with its line.
    assert!(
        said.stdout.contains("bytes:maps/stra%FEe.xodr:"),
        "{}",
        said.stdout
    );
    assert!(said.stdout.contains("<OpenDRIVE"), "{}", said.stdout);
    let written = files_below(&desk.path().join("out/maps"));
    assert_eq!(written, NAMES.map(|it| with_suffix(name(it), ".xqar")));
    for file in NAMES {
        let result = std::fs::read(
            desk.path()
                .join("out/maps")
                .join(with_suffix(name(file), ".xqar")),
        );
        let result = String::from_utf8(result.unwrap()).unwrap();
        let input = to_text(
            &desk
                .path()
                .canonicalize()
                .unwrap()
                .join("maps")
                .join(name(file)),
        );
        assert!(result.contains(&input), "{input}\n{result}");
    }
}

#[test]
fn names_that_are_no_text_have_a_verdict_each_and_keep_it() {
    let (mut farm, gate, _) = farm_with_gate();
    farm.arguments
        .extend(["--report".to_owned(), "text".to_owned()]);
    put_both(&farm.root());
    let paths = NAMES.map(|it| farm.root().join(name(it)));
    let broker = farm.serve_ready();
    let verdicts = || {
        let told = paths.each_ref().map(|path| verdict(&farm, path));
        for (path, told) in paths.iter().zip(&told) {
            assert_eq!(told.file, *path);
            assert!(told.xqar.exists(), "{told:?}");
        }
        told.map(|it| it.verdict)
    };
    let expected = [Verdict::Accepted, Verdict::Rejected];
    assert_eq!(verdicts(), expected);
    farm.settle(2);
    let asked = Command::new(env!("CARGO_BIN_EXE_qcbus"))
        .arg("wait")
        .arg(&paths[1])
        .arg("--instance-dir")
        .arg(farm.instance())
        .output()
        .unwrap();
    assert_eq!(asked.status.code(), Some(1), "{asked:?}");
    let published = || gate.join(name(NAMES[0])).exists() && !gate.join(name(NAMES[1])).exists();
    assert!(published());
    let report = |file| farm.out().join(with_suffix(name(file), ".txt"));
    until_so("each has its report", || {
        NAMES.iter().all(|it| report(it).exists())
    });
    down(&farm, broker);

    let broker = farm.serve_ready();
    farm.settle(2);
    assert_eq!(verdicts(), expected);
    assert!(published());
    let once = verdicts_in_journal(&farm.journal());
    assert_eq!(once.into_values().collect::<Vec<_>>(), [1, 1]);

    std::fs::remove_file(&paths[1]).unwrap();
    until_so("only the report of the one is taken back", || {
        report(NAMES[0]).exists() && !report(NAMES[1]).exists()
    });
    farm.settle(1);
    down(&farm, broker);
    let _broker = farm.serve_ready();
    farm.settle(1);
    assert!(published());
}

const SCENARIO: &str = "<OpenSCENARIO>\n<FileHeader revMajor=\"1\" revMinor=\"2\" \
    date=\"2026-01-31T12:00:00\" description=\"d\" author=\"a\"/>\n\
    <RoadNetwork><LogicFile filepath=\"map.xodr\"/></RoadNetwork>\n<Entities/>\n\
    <Storyboard><Init><Actions/></Init><StopTrigger/></Storyboard>\n</OpenSCENARIO>\n";

#[test]
fn a_scenario_with_such_a_path_finds_its_map() {
    let farm = Farm::new();
    let directory = farm.root().join(name(b"m\xFCnchen"));
    std::fs::create_dir(&directory).unwrap();
    std::fs::write(directory.join("map.xodr"), Content::Good(1).bytes()).unwrap();
    let scenario = directory.join(name(b"\xFCberholen.xosc"));
    std::fs::write(&scenario, SCENARIO).unwrap();
    let _broker = farm.serve_ready();
    let told = verdict(&farm, &scenario);
    let file = told.xqar.with_extension("verdict.json");
    let file: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let map = to_text(&directory.join("map.xodr"));
    let found = file["depends_on"].as_array().unwrap().iter();
    let found = found.filter(|it| it["path"] == *map && it["sha256"].is_string());
    assert_eq!(found.count(), 1, "{file:#}");
}

/// A name that prints a line of its own, one that steers a terminal, and what each is called.
const STEERING: [(&[u8], &str); 2] = [
    (
        b"x.xodr\nimportant.xodr: accepted\n.xodr",
        "bytes:x.xodr%0Aimportant.xodr: accepted%0A.xodr",
    ),
    (
        b"\x1b[2Kb\xe2\x80\xaec.xodr",
        "bytes:%1B[2Kb%E2%80%AEc.xodr",
    ),
];

/// No line is another's, and nothing steers.
fn has_only_lines_of_ours(what: &str, text: &str) {
    let steering = |c: char| qcbus_messages::shown::moves(c) && c != '\n';
    assert!(!text.chars().any(steering), "{what}: {text:?}");
    let forged = |line: &str| line.starts_with("important.xodr: accepted");
    assert!(!text.lines().any(forged), "{what}:\n{text}");
}

#[test]
fn names_that_would_be_lines_are_none_in_what_check_prints() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path().join("in")).unwrap();
    for (bytes, _) in STEERING {
        let path = desk.path().join("in").join(name(bytes));
        std::fs::write(path, Content::NoHeader(1).bytes()).unwrap();
    }
    for more in [&[][..], &["-q"], &["--format", "json"]] {
        let said = check(&desk, &[&["in"], more].concat());
        assert_eq!(said.code, Some(1), "{}", said.stderr);
        for (what, text) in [("stdout", &said.stdout), ("stderr", &said.stderr)] {
            has_only_lines_of_ours(what, text);
        }
        for (_, text) in STEERING {
            let called = text.trim_start_matches("bytes:");
            assert!(said.stdout.contains(called), "{}", said.stdout);
        }
    }
}

#[test]
fn names_and_words_of_others_are_no_lines_of_a_broker() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    farm.let_in("speaks_in_lines", "");
    for (bytes, _) in STEERING {
        std::fs::write(farm.root().join(name(bytes)), Content::Good(1).bytes()).unwrap();
    }
    farm.write("plain.xodr", &Content::Good(2).bytes());
    let spoken = || {
        let why = verdict(&farm, &farm.root().join("plain.xodr")).why;
        why.iter()
            .any(|why| why.contains("important"))
            .then_some(())
    };
    until_or("the animal has judged", spoken, || tail(&farm.log()));
    farm.settle(3);
    for (bytes, text) in STEERING {
        let path = farm.root().join(name(bytes));
        let mut wait = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        wait.arg("wait")
            .arg(&path)
            .arg("--instance-dir")
            .arg(farm.instance());
        let waited = wait.output().unwrap();
        let waited = String::from_utf8(waited.stdout).unwrap();
        has_only_lines_of_ours("wait", &waited);
        let called = to_text(&path);
        assert!(called.ends_with(text.trim_start_matches("bytes:")));
        assert!(waited.starts_with(&format!("{called}: ")), "{waited}");
    }
    for command in [&["status"][..], &["bundle", "list"], &["doctor"]] {
        let said = farm.qcbus(command);
        has_only_lines_of_ours(command[0], &String::from_utf8(said.stdout).unwrap());
        has_only_lines_of_ours(command[0], &String::from_utf8(said.stderr).unwrap());
    }
    down(&farm, broker);
    has_only_lines_of_ours("log", &farm.log());
}

#[test]
fn words_of_others_are_no_lines_of_a_text_report() {
    let mut farm = Farm::new();
    farm.arguments.extend(["--report".into(), "text".into()]);
    let broker = farm.serve_ready();
    farm.let_in("speaks_in_lines", "");
    farm.write("plain.xodr", &Content::Good(2).bytes());
    let report = || {
        let files = files_below(&farm.out());
        let text = files.iter().find(|it| it.ends_with("plain.xodr.txt"))?;
        let text = std::fs::read_to_string(farm.out().join(text)).ok()?;
        text.contains("important").then_some(text)
    };
    let text = until_or("the animal is reported", report, || tail(&farm.log()));
    has_only_lines_of_ours("report", &text);
    down(&farm, broker);
}

#[test]
fn what_is_printed_and_lost_is_no_success() {
    let desk = Desk::new();
    desk.write("in/a.xodr", Content::Good(1).bytes());
    let run = |stdout: std::process::Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.args(["check", "in"]).current_dir(desk.path());
        command.stdout(stdout).output().unwrap()
    };
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    let lost = run(full.unwrap().into());
    let said = String::from_utf8(lost.stderr).unwrap();
    assert_eq!(lost.status.code(), Some(5), "{said}");
    assert!(said.contains("cannot write to stdout"), "{said}");
    // Whoever reads no further knows so itself.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let closed = run(writer.into());
    assert_eq!(closed.status.code(), Some(0));
    assert!(
        closed.stderr.is_empty(),
        "{:?}",
        String::from_utf8(closed.stderr)
    );
}
