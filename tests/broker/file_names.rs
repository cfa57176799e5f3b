//! Unusual contents of a directory: symbolic links, names that are not valid text, and files that
//! cannot be read. Each is checked or reported, and each report counts.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::cli::{Cli, Said, files_below};
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::inside::skip;
use crate::support::judge::verdicts_in_journal;
use crate::support::programs::copy_program;
use crate::support::watchdog::{until_or, until_so};
use qcbus_messages::Verdict;
use qcbus_messages::control::{FileVerdict, Request, Response};
use qcbus_messages::path_text::to_text;

/// Creates a farm with a gate, and with a directory beside it that is not watched.
fn farm_with_gate() -> (Farm, PathBuf, PathBuf) {
    let mut farm = Farm::new();
    let gate = farm.base().join("gate");
    let arguments = ["--gate".to_owned(), gate.to_string_lossy().into_owned()];
    farm.arguments.extend(arguments);
    let beside = farm.base().join("beside");
    std::fs::create_dir(&beside).unwrap();
    (farm, gate, beside)
}

/// Waits for the verdict on a file's current bytes.
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

/// Waits until the watcher itself notices a change. No client asks.
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
fn linked_file_is_judged_again_when_its_target_changes() {
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
    // The gate contains the bytes, not another link to them.
    let published = std::fs::symlink_metadata(gate.join("a.xodr")).unwrap();
    assert!(published.is_file());
    assert_eq!(std::fs::read(gate.join("a.xodr")).unwrap(), good);

    // The target is rewritten in place.
    std::fs::write(&target, Content::NoHeader(2).bytes()).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Rejected));
    // The target is replaced.
    std::fs::write(beside.join("new"), Content::Good(3).bytes()).unwrap();
    std::fs::rename(beside.join("new"), &target).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    // The link points elsewhere.
    std::fs::write(beside.join("bad"), Content::NoHeader(4).bytes()).unwrap();
    std::fs::remove_file(&link).unwrap();
    symlink(beside.join("bad"), &link).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Rejected));
    // The link points to nothing, and then to a file again.
    std::fs::remove_file(beside.join("bad")).unwrap();
    becomes(&farm, &gate, "a.xodr", None);
    let unseen = || farm.status().is_some_and(|it| it.unseen.len() == 1);
    until_so("the status says what is unseen", unseen);
    std::fs::write(beside.join("bad"), Content::Good(5).bytes()).unwrap();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    until_so("nothing is unseen any more", || {
        farm.status().is_some_and(|it| it.unseen.is_empty())
    });
    // A client that asks at once gets the verdict on the current bytes.
    std::fs::write(beside.join("bad"), Content::NoHeader(6).bytes()).unwrap();
    assert_eq!(verdict(&farm, &link).verdict, Verdict::Rejected);
    std::fs::remove_file(&link).unwrap();
    becomes(&farm, &gate, "a.xodr", None);
}

#[test]
fn verdict_on_a_linked_file_survives_a_restart() {
    let (farm, gate, beside) = farm_with_gate();
    std::fs::write(beside.join("target"), Content::Good(1).bytes()).unwrap();
    symlink(beside.join("target"), farm.root().join("a.xodr")).unwrap();
    let broker = farm.serve_ready();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Accepted));
    farm.settle(1);
    down(&farm, broker);
    // The target changes while no broker watches.
    std::fs::write(beside.join("target"), Content::NoHeader(2).bytes()).unwrap();
    let _broker = farm.serve_ready();
    becomes(&farm, &gate, "a.xodr", Some(Verdict::Rejected));
}

#[test]
fn directory_with_several_links_keeps_its_own_name() {
    let (farm, gate, beside) = farm_with_gate();
    std::fs::create_dir(farm.root().join("maps")).unwrap();
    // One link sorts before the name of the directory, the other one after it.
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

fn check(cli: &Cli, more: &[&str]) -> Said {
    cli.qcbus(&[&["check"][..], more, &["--out", "out"]].concat())
}

#[test]
fn includes_of_a_linked_file_lie_beside_the_link() {
    let cli = Cli::new();
    let (outer, view) = Content::road_in_two_parts();
    let target = cli.write("store/4711", outer);
    cli.write("maps/view.xml", view);
    symlink(&target, cli.path().join("maps/a.xodr")).unwrap();
    // A program that opens the given path finds the same file.
    for named in ["maps", "maps/a.xodr"] {
        let said = check(&cli, &[named]);
        assert_eq!(said.code, Some(0), "{named}: {}", said.whole(&cli));
        assert!(cli.path().join("out/maps/a.xodr.xqar").exists());
        std::fs::remove_dir_all(cli.path().join("out")).unwrap();
    }
    std::fs::remove_file(cli.path().join("maps/view.xml")).unwrap();
    assert_eq!(check(&cli, &["maps"]).code, Some(1));
}

/// Creates a cli with one good file in `maps`.
fn cli_with_a_good_file() -> Cli {
    let cli = Cli::new();
    cli.write("maps/a.xodr", Content::Good(1).bytes());
    cli
}

#[test]
fn unscanned_entry_is_reported_and_prevents_acceptance() {
    type Failure = fn(&Cli, &Path);
    let troubles: [(&str, Failure); 5] = [
        ("maps/b.xodr", |_, path| symlink("gone", path).unwrap()),
        ("maps/loop", |_, path| symlink("loop", path).unwrap()),
        ("maps/b.xosc", |_, path| symlink("b.xosc", path).unwrap()),
        ("maps/more", |cli, path| {
            cli.write("elsewhere/b.xodr", Content::NoHeader(2).bytes());
            symlink(cli.path().join("elsewhere"), path).unwrap();
        }),
        ("maps/c.xodr", |_, path| symlink("/dev/null", path).unwrap()),
    ];
    for (name, failure) in troubles {
        let cli = cli_with_a_good_file();
        failure(&cli, &cli.path().join(name));
        let said = check(&cli, &["maps"]);
        assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
        let note = format!("note: not scanned: [DIR]/{name}: ");
        let told = cli.tidy(&said.stderr);
        assert_eq!(told.matches(&note).count(), 1, "{told}");
        // An error has a higher priority.
        cli.write("maps/d.xodr", Content::NoHeader(3).bytes());
        assert_eq!(check(&cli, &["maps"]).code, Some(1));
        // There are no other visible files.
        for file in ["maps/a.xodr", "maps/d.xodr"] {
            std::fs::remove_file(cli.path().join(file)).unwrap();
        }
        let said = check(&cli, &["maps"]);
        assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
    }
}

#[test]
fn links_to_scanned_entries_are_not_reported() {
    let cli = cli_with_a_good_file();
    cli.write("maps/deep/b.xodr", Content::Good(2).bytes());
    symlink("deep", cli.path().join("maps/again")).unwrap();
    symlink("..", cli.path().join("maps/deep/up")).unwrap();
    symlink("nowhere", cli.path().join("maps/readme")).unwrap();
    cli.write("other/c.xodr", Content::Good(3).bytes());
    symlink("../other", cli.path().join("maps/other")).unwrap();
    let said = check(&cli, &["maps", "other"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(said.stdout.contains("of 3 files;"), "{}", said.stdout);
    assert!(!said.stderr.contains("note"), "{}", said.stderr);
}

#[test]
fn file_behind_a_directory_link_is_judged_once() {
    let (farm, gate, beside) = farm_with_gate();
    let day = farm.root().join("2026-11-20");
    std::fs::create_dir(&day).unwrap();
    std::fs::write(day.join("a.xodr"), Content::Good(1).bytes()).unwrap();
    std::fs::write(beside.join("b.xodr"), Content::Good(2).bytes()).unwrap();
    symlink("2026-11-20", farm.root().join("latest")).unwrap();
    symlink(&beside, farm.root().join("other")).unwrap();
    let _broker = farm.serve_ready();
    becomes(&farm, &gate, "2026-11-20/a.xodr", Some(Verdict::Accepted));
    let told = verdict(&farm, &farm.root().join("latest/a.xodr"));
    assert_eq!(told.file, day.join("a.xodr"));
    // Files behind the other link are not watched, and the answer says so.
    let request = Request::Wait {
        file: farm.root().join("other/b.xodr"),
        timeout_ms: Some(120_000),
    };
    let answer = farm.ask(&request);
    let Some(Response::Unwatched { reason }) = &answer else {
        panic!("{answer:?}");
    };
    assert!(reason.contains("links are not followed"), "{reason}");
    // The link points to another day: the same name means another file.
    let next = farm.root().join("2026-11-21");
    std::fs::create_dir(&next).unwrap();
    std::fs::write(next.join("a.xodr"), Content::NoHeader(3).bytes()).unwrap();
    symlink("2026-11-21", farm.root().join("new")).unwrap();
    std::fs::rename(farm.root().join("new"), farm.root().join("latest")).unwrap();
    let told = verdict(&farm, &farm.root().join("latest/a.xodr"));
    assert_eq!(
        (told.file, told.verdict),
        (next.join("a.xodr"), Verdict::Rejected)
    );
    let published = gate.join("latest");
    assert!(!published.exists() && farm.settle(2).unseen.len() == 1);
}

/// User id of nobody. It is needed because root can read every directory.
const NOBODY: &str = "65534";

fn rights(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

/// Returns the beginning of a command that runs as a user who cannot read `closed`. It is empty if
/// the current user cannot. Returns `None` with a message if it is impossible here.
fn as_nobody(test: &str, closed: &Path) -> Option<Vec<&'static str>> {
    if std::fs::read_dir(closed).is_err() {
        return Some(Vec::new());
    }
    let who = [
        "setpriv",
        "--reuid",
        NOBODY,
        "--regid",
        NOBODY,
        "--clear-groups",
    ];
    let tried = Command::new(who[0]).args(&who[1..]).arg("true").output();
    if tried.is_ok_and(|it| it.status.success()) {
        return Some(who.to_vec());
    }
    skip(test, "this user may read everything and cannot be another");
    None
}

/// Returns a command of another user, with a copy of the program that everybody can run.
fn command_of(who: &[&str], program: &Path) -> Command {
    copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), program);
    let mut words = who.iter().map(OsStr::new).chain([program.as_os_str()]);
    let mut command = Command::new(words.next().unwrap());
    command.args(words);
    command
}

fn give_to_nobody(path: &Path) {
    let nobody = NOBODY.parse().ok();
    // Only a user who can read everything needs to give files away.
    let _ = std::os::unix::fs::chown(path, nobody, nobody);
}

#[test]
fn unreadable_directory_prevents_acceptance() {
    let cli = cli_with_a_good_file();
    let closed = cli.path().join("maps/closed");
    std::fs::create_dir(&closed).unwrap();
    rights(&closed, 0o000);
    let Some(who) = as_nobody("unreadable_directory_prevents_acceptance", &closed) else {
        return;
    };
    let run = cli.path().join(".run");
    for path in [cli.path(), &run, &cli.path().join("maps")] {
        rights(path, 0o1777);
    }
    give_to_nobody(&run);
    rights(&run, 0o700);
    let mut command = command_of(&who, &cli.path().join("qcbus"));
    let said = cli.run(command.args(["check", "maps", "--out", "out"]));
    rights(&closed, 0o700);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
    let told = cli.tidy(&said.stderr);
    let note = "note: not scanned: [DIR]/maps/closed: cannot read this directory";
    assert_eq!(told.matches(note).count(), 1, "{told}");
}

/// Creates a farm of another user, and the command that serves it.
fn farm_of(who: &[&str]) -> (Farm, Command) {
    let farm = Farm::new();
    let program = farm.base().join("qcbus");
    let mut command = command_of(who, &program);
    command.args(farm.serve_command().get_args());
    command.env("NO_COLOR", "1");
    rights(farm.base(), 0o777);
    for path in [farm.base(), &farm.root(), &farm.bundles_d()] {
        give_to_nobody(path);
    }
    rights(farm.base(), 0o755);
    (farm, command)
}

fn wait_for_mode(farm: &Farm, mode: &str) {
    let now = || farm.status().map(|it| it.watch_mode);
    until_or(
        "the mode",
        || now().filter(|it| it.starts_with(mode)),
        || format!("{:?}\n{}", now(), tail(&farm.log())),
    );
}

#[test]
fn unreadable_directory_does_not_stop_events_elsewhere() {
    let place = tempfile::tempdir().unwrap();
    rights(place.path(), 0o000);
    let test = "unreadable_directory_does_not_stop_events_elsewhere";
    let who = as_nobody(test, place.path());
    rights(place.path(), 0o700);
    let Some(who) = who else { return };
    let (farm, mut command) = farm_of(&who);
    // Every file system has such a directory at its top.
    let found = farm.root().join("lost+found");
    std::fs::create_dir(&found).unwrap();
    std::fs::write(found.join("a.xodr"), Content::Good(1).bytes()).unwrap();
    symlink("/", farm.root().join("everything")).unwrap();
    rights(&found, 0o000);
    let _broker = Broker::start(&mut command, &farm.log_path());
    wait_for_mode(&farm, "events");
    until_so("what is unseen is said", || {
        farm.status().is_some_and(|it| it.unseen.len() == 2)
    });
    assert_eq!(farm.status().unwrap().watch_mode, "events");
    std::fs::create_dir(farm.root().join("maps")).unwrap();
    farm.write("maps/b.xodr", &Content::Good(2).bytes());
    until_so("its file is judged", || {
        farm.out().join("maps/b.xodr.xqar").exists()
    });
    // The watcher notices at once that the directory can be read.
    rights(&found, 0o755);
    until_so("the other is judged", || {
        farm.out().join("lost+found/a.xodr.xqar").exists()
    });
    assert_eq!(farm.status().unwrap().watch_mode, "events");
    drop(farm.qcbus(&["down"]));
}

/// Starts a broker with a limit of inotify. Returns `None` with a message if the limit cannot be
/// set here.
fn serve_with(test: &str, limit: &str, farm: &Farm) -> Option<Broker> {
    let set = format!("echo {limit}");
    let alone = ["--user", "--map-root-user", "sh", "-c"];
    let tried = Command::new("unshare").args(alone).arg(&set).output();
    if !tried.as_ref().is_ok_and(|it| it.status.success()) {
        let why = format!("the limits of inotify cannot be set here: {tried:?}");
        skip(test, &why);
        return None;
    }
    let serve = farm.serve_command();
    let mut command = Command::new("unshare");
    command
        .args(alone)
        .arg(format!("{set} && exec \"$@\""))
        .arg("sh");
    command.arg(serve.get_program()).args(serve.get_args());
    Some(Broker::start(&mut command, &farm.log_path()))
}

#[test]
fn only_directories_without_watches_are_polled() {
    let test = "only_directories_without_watches_are_polled";
    let farm = Farm::with(&["--rescan", "1h"]);
    for number in 0..10 {
        std::fs::create_dir(farm.root().join(number.to_string())).unwrap();
    }
    let limit = "4 > /proc/sys/user/max_inotify_watches";
    let Some(_broker) = serve_with(test, limit, &farm) else {
        return;
    };
    // The watched directory and three in it use all available watches.
    wait_for_mode(
        &farm,
        "events; 7 directories that cannot be watched are scanned every 2 s",
    );
    for number in 0..10 {
        farm.write(&format!("{number}/a.xodr"), &Content::Good(number).bytes());
    }
    std::fs::create_dir_all(farm.root().join("9/new/deep")).unwrap();
    farm.write("9/new/deep/b.xodr", &Content::Good(11).bytes());
    farm.settle(11);
    std::fs::remove_file(farm.root().join("8/a.xodr")).unwrap();
    std::fs::remove_dir_all(farm.root().join("9")).unwrap();
    farm.settle(8);
    let log = farm.log();
    assert_eq!(
        log.matches("fs.inotify.max_user_watches").count(),
        1,
        "{log}"
    );
    drop(farm.qcbus(&["down"]));
}

#[test]
fn missing_events_lead_to_polling_and_advice() {
    let test = "missing_events_lead_to_polling_and_advice";
    let farm = Farm::new();
    let limit = "0 > /proc/sys/user/max_inotify_instances";
    let Some(_broker) = serve_with(test, limit, &farm) else {
        return;
    };
    wait_for_mode(&farm, "poll every 2 s, because events are not available");
    std::fs::create_dir(farm.root().join("maps")).unwrap();
    farm.write("maps/a.xodr", &Content::Good(1).bytes());
    farm.settle(1);
    let log = farm.log();
    assert_eq!(
        log.matches("fs.inotify.max_user_instances").count(),
        1,
        "{log}"
    );
    drop(farm.qcbus(&["down"]));
}

/// Two names that differ in one byte, which is not valid text in either.
const NAMES: [&[u8]; 2] = [b"stra\xDFe.xodr", b"stra\xFEe.xodr"];

fn name(bytes: &[u8]) -> &Path {
    Path::new(OsStr::from_bytes(bytes))
}

/// Writes a good file and one with an error under these names.
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
fn non_utf8_names_get_separate_results() {
    let cli = Cli::new();
    std::fs::create_dir(cli.path().join("maps")).unwrap();
    put_both(&cli.path().join("maps"));
    let said = check(&cli, &["maps", "-v"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    assert!(said.stdout.contains("of 2 files; 1 accepted, 1 rejected"));
    // The output contains the place of the error with its line.
    assert!(
        said.stdout.contains("bytes:maps/stra%FEe.xodr:"),
        "{}",
        said.stdout
    );
    assert!(said.stdout.contains("<OpenDRIVE"), "{}", said.stdout);
    let written = files_below(&cli.path().join("out/maps"));
    assert_eq!(written, NAMES.map(|it| with_suffix(name(it), ".xqar")));
    for file in NAMES {
        let result = std::fs::read(
            cli.path()
                .join("out/maps")
                .join(with_suffix(name(file), ".xqar")),
        );
        let result = String::from_utf8(result.unwrap()).unwrap();
        let input = to_text(
            &cli.path()
                .canonicalize()
                .unwrap()
                .join("maps")
                .join(name(file)),
        );
        assert!(result.contains(&input), "{input}\n{result}");
    }
}

#[test]
fn non_utf8_names_keep_separate_verdicts() {
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
fn scenario_with_a_non_utf8_path_finds_its_map() {
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

/// A name with a line of its own and one that controls a terminal, each with its shown form.
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

/// Asserts that no line comes from a file name and that no character controls the terminal.
fn has_only_lines_of_ours(what: &str, text: &str) {
    let steering = |c: char| qcbus_messages::shown::moves(c) && c != '\n';
    assert!(!text.chars().any(steering), "{what}: {text:?}");
    let forged = |line: &str| line.starts_with("important.xodr: accepted");
    assert!(!text.lines().any(forged), "{what}:\n{text}");
}

#[test]
fn control_characters_in_names_add_no_output_lines() {
    let cli = Cli::new();
    std::fs::create_dir(cli.path().join("in")).unwrap();
    for (bytes, _) in STEERING {
        let path = cli.path().join("in").join(name(bytes));
        std::fs::write(path, Content::NoHeader(1).bytes()).unwrap();
    }
    for more in [&[][..], &["-q"], &["--format", "json"]] {
        let said = check(&cli, &[&["in"], more].concat());
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
fn foreign_text_adds_no_lines_to_broker_output() {
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
fn foreign_text_adds_no_lines_to_a_text_report() {
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
fn lost_output_is_not_a_success() {
    let cli = Cli::new();
    cli.write("in/a.xodr", Content::Good(1).bytes());
    let run = |stdout: std::process::Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.args(["check", "in"]).current_dir(cli.path());
        command.stdout(stdout).output().unwrap()
    };
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    let lost = run(full.unwrap().into());
    let said = String::from_utf8(lost.stderr).unwrap();
    assert_eq!(lost.status.code(), Some(5), "{said}");
    assert!(said.contains("cannot write to stdout"), "{said}");
    // A program that stops reading the output knows it itself.
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
