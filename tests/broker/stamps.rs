//! Tests that file times prove little: old times, restored times, times before 1970. The bytes
//! count, of a file and of everything that its verdict depends on.

use std::fs::File;
use std::io::Write;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::support::broker::Broker;
use crate::support::cli::Cli;
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::judge::verdicts_in_journal;
use crate::support::watchdog::{until_or, until_so};
use qcbus_messages::Verdict;
use sha2::{Digest, Sha256};

const HOUR: Duration = Duration::from_secs(3600);

/// Age up to which a file counts as young. Young files are always read once more.
const YOUNG: Duration = Duration::from_secs(3);

/// Returns a farm with a gate.
fn farm_with_gate() -> Farm {
    let mut farm = Farm::new();
    let gate = gate(&farm).to_string_lossy().into_owned();
    farm.arguments.extend(["--gate".to_owned(), gate]);
    farm
}

fn gate(farm: &Farm) -> PathBuf {
    farm.base().join("gate")
}

fn set_modified(path: &Path, time: SystemTime) {
    let file = File::options().write(true).open(path).unwrap();
    file.set_modified(time).unwrap();
}

/// Moves a file into the farm in one step. Its last modification was an hour ago.
fn put_old(farm: &Farm, name: &str, bytes: &[u8]) {
    let outside = farm.base().join("outside");
    std::fs::write(&outside, bytes).unwrap();
    set_modified(&outside, SystemTime::now() - HOUR);
    std::fs::rename(&outside, farm.root().join(name)).unwrap();
}

/// Waits until no file in the farm counts as young.
fn rest(farm: &Farm) {
    let youngest = || {
        let files = std::fs::read_dir(farm.root()).unwrap().flatten();
        let changed = files.filter_map(|it| it.metadata().ok()?.ctime().try_into().ok());
        changed.max().map(|it| UNIX_EPOCH + Duration::from_secs(it))
    };
    until_so("all files have come to rest", || {
        youngest().is_none_or(|it| it.elapsed().is_ok_and(|age| age > YOUNG))
    });
}

fn verdict_becomes(farm: &Farm, name: &str, verdict: Verdict) {
    until_or(
        "the file is judged again",
        || (farm.verdict_file(name)["verdict"] == verdict.as_str()).then_some(()),
        || {
            let result = farm.verdict_file(name);
            format!("not {verdict:?}\n{result:#}\n{}", tail(&farm.log()))
        },
    );
    until_so("the gate follows", || {
        gate(farm).join(name).exists() == (verdict == Verdict::Accepted)
    });
}

/// Returns a farm with a broker that has checked an old map with an old include, and the bytes of
/// the include.
fn old_map_that_was_judged() -> (Farm, Broker, String) {
    let farm = farm_with_gate();
    let (outer, view) = Content::road_in_two_parts();
    put_old(&farm, "a.xodr", outer.as_bytes());
    put_old(&farm, "view.xml", view.as_bytes());
    rest(&farm);
    let broker = farm.serve_ready();
    farm.settle(1);
    (farm, broker, view)
}

#[test]
fn old_map_is_judged_again_when_its_include_changes() {
    let (farm, _broker, view) = old_map_that_was_judged();
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
    put_old(&farm, "view.xml", b"<road><planView></road>");
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);

    // This round asks immediately after the change. Before it, all files are read again at rest.
    rest(&farm);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    put_old(&farm, "view.xml", view.as_bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);

    rest(&farm);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    std::fs::remove_file(farm.root().join("view.xml")).unwrap();
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);

    rest(&farm);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    put_old(&farm, "view.xml", view.as_bytes());
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
}

#[test]
fn map_is_judged_again_when_its_surface_grid_comes_or_goes() {
    let farm = farm_with_gate();
    let surface = "<surface>\n<CRG file=\"quay.crg\" sStart=\"0\" sEnd=\"10\" orientation=\"same\" \
                   mode=\"attached\"/>\n</surface>\n</road>";
    let map = String::from_utf8(Content::Good(1).bytes()).unwrap();
    assert!(map.contains("</road>"), "{map}");
    put_old(
        &farm,
        "a.xodr",
        map.replacen("</road>", surface, 1).as_bytes(),
    );
    let _broker = farm.serve_ready();
    farm.settle(1);
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);
    put_old(&farm, "quay.crg", b"$CRG 1.0\n");
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
    std::fs::remove_file(farm.root().join("quay.crg")).unwrap();
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);
}

fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the hash of a file that a verdict rests on, or `None` if the verdict rests on its
/// absence.
fn rests_on(farm: &Farm, name: &str, other: &Path) -> Option<String> {
    let told = farm.verdict_file(name);
    let all = told["depends_on"].as_array().unwrap();
    let found = all.iter().find(|it| it["path"].as_str() == other.to_str());
    found?["sha256"].as_str().map(str::to_owned)
}

fn rests_on_becomes(farm: &Farm, name: &str, other: &Path, expected: Option<&[u8]>) {
    let expected = expected.map(sha256);
    until_or(
        "the file is judged again",
        || (rests_on(farm, name, other) == expected).then_some(()),
        || {
            let result = farm.verdict_file(name);
            format!("{expected:?}\n{result:#}\n{}", tail(&farm.log()))
        },
    );
}

const SCENARIO: &str = "<OpenSCENARIO>\n<FileHeader revMajor=\"1\" revMinor=\"2\" \
    date=\"2026-01-31T12:00:00\" description=\"d\" author=\"a\"/>\n<CatalogLocations>\
    <VehicleCatalog><Directory path=\"catalogs\"/></VehicleCatalog></CatalogLocations>\n\
    <RoadNetwork><LogicFile filepath=\"map.xodr\"/></RoadNetwork>\n<Entities/>\n\
    <Storyboard><Init><Actions/></Init><StopTrigger/></Storyboard>\n</OpenSCENARIO>\n";

const CATALOG: &str = "<OpenSCENARIO>\n<FileHeader revMajor=\"1\" revMinor=\"2\" \
    date=\"2026-01-31T12:00:00\" description=\"d\" author=\"a\"/>\n<Catalog name=\"c\"/>\n\
    </OpenSCENARIO>\n";

#[test]
fn old_scenario_is_judged_again_when_its_references_change() {
    let farm = farm_with_gate();
    put_old(&farm, "s.xosc", SCENARIO.as_bytes());
    rest(&farm);
    let _broker = farm.serve_ready();
    farm.settle(1);
    let map = farm.root().join("map.xodr");
    rests_on_becomes(&farm, "s.xosc", &map, None);
    for number in 0..2 {
        let bytes = Content::Good(number).bytes();
        put_old(&farm, "map.xodr", &bytes);
        rests_on_becomes(&farm, "s.xosc", &map, Some(&bytes));
        rest(&farm);
        farm.verdict("s.xosc");
    }
    // An immediate question must be answered for the current map.
    let bytes = Content::NoHeader(3).bytes();
    put_old(&farm, "map.xodr", &bytes);
    farm.verdict("s.xosc");
    assert_eq!(rests_on(&farm, "s.xosc", &map), Some(sha256(&bytes)));

    rest(&farm);
    farm.verdict("s.xosc");
    let outside = farm.base().join("catalogs");
    std::fs::create_dir(&outside).unwrap();
    std::fs::write(outside.join("c.xosc"), CATALOG).unwrap();
    std::fs::rename(&outside, farm.root().join("catalogs")).unwrap();
    let catalog = farm.root().join("catalogs/c.xosc");
    rests_on_becomes(&farm, "s.xosc", &catalog, Some(CATALOG.as_bytes()));
}

/// Overwrites the bytes of an existing file and restores its modification time, as
/// `rsync --inplace --times` does.
fn write_over(farm: &Farm, name: &str, bytes: &[u8]) {
    let path = farm.root().join(name);
    let before = std::fs::metadata(&path).unwrap();
    let mut file = File::options().write(true).open(&path).unwrap();
    file.write_all(bytes).unwrap();
    file.set_modified(before.modified().unwrap()).unwrap();
    drop(file);
    let after = std::fs::metadata(&path).unwrap();
    let key = |it: &std::fs::Metadata| (it.len(), it.modified().unwrap(), it.ino());
    assert_eq!(key(&after), key(&before));
}

/// Returns a good file, and a bad one of the same size.
fn good_and_bad() -> (Vec<u8>, Vec<u8>) {
    let good = Content::Good(1).bytes();
    let bad = String::from_utf8(good.clone())
        .unwrap()
        .replace("<header ", "<heeder ");
    (good, bad.into_bytes())
}

#[test]
fn rewritten_file_with_unchanged_time_is_judged_again() {
    let farm = farm_with_gate();
    let (good, bad) = good_and_bad();
    put_old(&farm, "a.xodr", &good);
    rest(&farm);
    let _broker = farm.serve_ready();
    farm.settle(1);
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
    write_over(&farm, "a.xodr", &bad);
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);
    rest(&farm);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    write_over(&farm, "a.xodr", &good);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
}

#[test]
fn new_link_or_permissions_cause_no_new_verdict() {
    let (farm, _broker, _) = old_map_that_was_judged();
    for name in ["a.xodr", "view.xml"] {
        let path = farm.root().join(name);
        std::fs::hard_link(&path, farm.base().join(name)).unwrap();
        assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
        let rights = std::fs::Permissions::from_mode(0o600);
        std::fs::set_permissions(&path, rights).unwrap();
        assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    }
    farm.settle(1);
    let verdicts = verdicts_in_journal(&farm.journal());
    assert_eq!(verdicts.into_values().collect::<Vec<_>>(), [1]);
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
}

#[test]
fn files_from_before_1970_are_judged() {
    let farm = farm_with_gate();
    let (outer, view) = Content::road_in_two_parts();
    for (name, bytes) in [("a.xodr", &outer), ("view.xml", &view)] {
        farm.write(name, bytes.as_bytes());
        set_modified(&farm.root().join(name), UNIX_EPOCH - HOUR);
    }
    // A single run must end.
    let cli = Cli::new();
    let map = farm.root().join("a.xodr").to_string_lossy().into_owned();
    let said = cli.qcbus(&["check", &map, "--out", "out"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let _broker = farm.serve_ready();
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    farm.settle(1);
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
    let bad = outer.replace("<header ", "<heeder ");
    write_over(&farm, "a.xodr", bad.as_bytes());
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);
    farm.settle(1);
}

#[test]
fn unreadable_dependency_does_not_prevent_a_verdict() {
    let farm = farm_with_gate();
    for name in ["map.xodr", "view.xml"] {
        std::fs::create_dir(farm.root().join(name)).unwrap();
    }
    let (outer, view) = Content::road_in_two_parts();
    put_old(&farm, "a.xodr", outer.as_bytes());
    put_old(&farm, "s.xosc", SCENARIO.as_bytes());
    let _broker = farm.serve_ready();
    farm.settle(2);
    verdict_becomes(&farm, "a.xodr", Verdict::Rejected);
    let map = farm.root().join("map.xodr");
    rests_on_becomes(&farm, "s.xosc", &map, None);

    let view_path = farm.root().join("view.xml");
    std::fs::remove_dir(&view_path).unwrap();
    put_old(&farm, "view.xml", view.as_bytes());
    verdict_becomes(&farm, "a.xodr", Verdict::Accepted);
    std::fs::remove_dir(&map).unwrap();
    let bytes = Content::Good(2).bytes();
    put_old(&farm, "map.xodr", &bytes);
    rests_on_becomes(&farm, "s.xosc", &map, Some(&bytes));
    farm.settle(3);
}

/// Returns the inodes of a file's result and report. For the untouched file, it also returns the
/// inode of its published copy.
fn inodes(farm: &Farm, name: &str) -> Vec<u64> {
    let out = |suffix: &str| farm.out().join(format!("{name}.{suffix}"));
    let mut files = vec![out("xqar"), out("txt")];
    // A changed file is withdrawn from the gate until everything is read again.
    files.extend((name == "tomorrow.xodr").then(|| gate(farm).join(name)));
    let inode = |file: PathBuf| std::fs::metadata(file).unwrap().ino();
    files.into_iter().map(inode).collect()
}

#[test]
fn file_with_a_future_time_keeps_its_verdict() {
    let mut farm = farm_with_gate();
    farm.arguments.extend(["--report".into(), "text".into()]);
    farm.write("tomorrow.xodr", &Content::Good(1).bytes());
    set_modified(
        &farm.root().join("tomorrow.xodr"),
        SystemTime::now() + 24 * HOUR,
    );
    farm.write("now.xodr", &Content::Good(2).bytes());
    let names = ["tomorrow.xodr", "now.xodr"];
    let mut broker = farm.serve_ready();
    farm.settle(2);
    for name in names {
        verdict_becomes(&farm, name, Verdict::Accepted);
        let report = farm.out().join(format!("{name}.txt"));
        until_so("there is a report", || report.exists());
    }
    let before = names.map(|name| inodes(&farm, name));
    for restart in 0..3 {
        farm.qcbus(&["down"]);
        broker.wait();
        // Changing the permissions sets the change time (ctime) to the current time.
        let rights = std::fs::Permissions::from_mode(0o640 + restart);
        std::fs::set_permissions(farm.root().join("now.xodr"), rights).unwrap();
        broker = farm.serve_ready();
        farm.settle(2);
        assert_eq!(names.map(|name| inodes(&farm, name)), before);
        for name in names {
            assert_eq!(farm.verdict(name).verdict, Verdict::Accepted);
        }
    }
    farm.settle(2);
    verdict_becomes(&farm, "now.xodr", Verdict::Accepted);
    assert_eq!(names.map(|name| inodes(&farm, name)), before);
    let once = verdicts_in_journal(&farm.journal());
    assert_eq!(once.into_values().collect::<Vec<_>>(), [1, 1]);
}

/// Returns how often a file was read, according to the broker's log of stages.
fn times_read(farm: &Farm, name: &str) -> usize {
    let log = farm.log();
    let read = log.lines().filter(|it| it.contains("stage=\"taken\""));
    read.filter(|it| it.contains(name)).count()
}

#[test]
fn file_with_a_future_time_comes_to_rest() {
    let farm = farm_with_gate();
    let path = farm.root().join("tomorrow.xodr");
    farm.write("tomorrow.xodr", &Content::Good(1).bytes());
    set_modified(&path, SystemTime::now() + 24 * HOUR);
    let mut command = farm.serve_command();
    command.env("QCBUS_LOG", "info,qcbus_broker::stages=debug");
    let _broker = Broker::start(&mut command, &farm.log_path());
    farm.settle(1);
    rest(&farm);
    // The file is read once more, because it was young at the first read. After that it is never
    // read again.
    farm.verdict("tomorrow.xodr");
    let read = times_read(&farm, "tomorrow.xodr");
    assert!(read > 0, "{}", tail(&farm.log()));
    for _ in 0..3 {
        assert_eq!(farm.verdict("tomorrow.xodr").verdict, Verdict::Accepted);
    }
    assert_eq!(times_read(&farm, "tomorrow.xodr"), read);
}
