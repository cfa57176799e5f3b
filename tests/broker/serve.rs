//! Tests `qcbus serve`: each file in a watched directory gets its verdict, and the verdict stays
//! correct.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::cli::{Cli, files_below, issues, sample_farm};
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::inside::skip;
use crate::support::watchdog::{until_or, until_so};
use qcbus_bus::Instance;
use qcbus_control::ask_broker;
use qcbus_document::FileKind;
use qcbus_formats::xqar::Results;
use qcbus_messages::Verdict;
use qcbus_messages::control::{Request, Response};
use sha2::{Digest, Sha256};

/// Files to copy: source and destination.
type Load = Vec<(PathBuf, PathBuf)>;

fn load(from: &Path, wanted: impl Fn(&Path) -> bool) -> Load {
    let files = files_below(from).into_iter().filter(|file| wanted(file));
    files.map(|file| (from.join(&file), file)).collect()
}

fn is_checkable(file: &Path) -> bool {
    FileKind::of_path(file).is_some()
}

/// Serves an empty directory, copies all files into it, and compares the results with those of
/// `check`.
fn copied_in_and_compared(load: &Load) {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    for (from, to) in load {
        let to = farm.root().join(to);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(from, to).unwrap();
    }
    let names: Vec<&Path> = load
        .iter()
        .map(|(_, to)| to.as_path())
        .filter(|to| is_checkable(to))
        .collect();
    farm.settle(names.len());
    let cli = Cli::new();
    cli.check_in(&farm.root(), &["."], "out");
    let same = || differences(&farm.out(), &cli.path().join("out"));
    // A file may have been checked before a file that it refers to arrived. It is then checked
    // again.
    until_or(
        "the results are those of `check`",
        || same().is_empty().then_some(()),
        || format!("{:#?}\n{}", same(), tail(&farm.log())),
    );
    let written: Vec<PathBuf> = results_below(&farm.out());
    let expected: Vec<PathBuf> = names
        .iter()
        .map(|name| format!("{}.xqar", name.display()).into())
        .collect();
    assert_eq!(
        written, expected,
        "exactly one result for each file, and nothing else"
    );
    every_checker_is_there(&farm, &names);
    the_status_agrees(&farm, &names);
}

fn results_below(out: &Path) -> Vec<PathBuf> {
    let mut files = files_below(out);
    files.retain(|file| file.extension().is_some_and(|it| it == "xqar"));
    files
}

/// Returns the results whose bytes differ between both directories.
fn differences(one: &Path, two: &Path) -> Vec<PathBuf> {
    let all: BTreeSet<PathBuf> = results_below(one)
        .into_iter()
        .chain(results_below(two))
        .collect();
    let read = |out: &Path, file: &Path| std::fs::read(out.join(file)).ok();
    all.into_iter()
        .filter(|file| read(one, file) != read(two, file))
        .collect()
}

/// Returns the ids that `qcbus rule` lists as enabled, by bundle.
fn demanded() -> BTreeMap<String, BTreeSet<String>> {
    let cli = Cli::new();
    let said = cli.qcbus(&["rule", "--format", "json"]);
    let rules: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
    let mut demanded: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for rule in rules
        .as_array()
        .unwrap()
        .iter()
        .filter(|rule| rule["default"] == true)
    {
        let text = |field: &str| rule[field].as_str().unwrap().to_owned();
        demanded
            .entry(text("bundle"))
            .or_default()
            .insert(text("id"));
    }
    demanded
}

fn every_checker_is_there(farm: &Farm, names: &[&Path]) {
    let demanded = demanded();
    for name in names {
        let bundle = match FileKind::of_path(name).unwrap() {
            FileKind::Xodr => "xodrBundle",
            _ => "xoscBundle",
        };
        let results = farm.result(&name.to_string_lossy());
        let found = results.bundles.iter().find(|it| it.name == bundle).unwrap();
        let found: BTreeSet<String> = found.checkers.iter().map(|it| it.id.to_string()).collect();
        assert_eq!(found, demanded[bundle], "{}", name.display());
    }
}

fn the_status_agrees(farm: &Farm, names: &[&Path]) {
    let said = farm.qcbus(&["status", "--json"]);
    let status: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
    let mut counted: BTreeMap<String, u64> = BTreeMap::new();
    for name in names {
        let verdict = farm.verdict_file(&name.to_string_lossy())["verdict"]
            .as_str()
            .unwrap()
            .to_owned();
        *counted.entry(verdict).or_default() += 1;
    }
    let count = |verdict: &str| counted.get(verdict).copied().unwrap_or(0);
    for verdict in ["accepted", "rejected", "undetermined"] {
        assert_eq!(
            status["files"][verdict],
            count(verdict),
            "{verdict}: {status:#}"
        );
    }
    assert_eq!(count("undetermined"), 0);
    assert_eq!(status["files"]["total"], names.len());
    assert_eq!(status["files"]["judged"], names.len());
    assert_eq!(status["queue"]["waiting"], 0);
    assert_eq!(status["queue"]["active"], 0);
}

#[test]
fn sample_farm_is_judged_when_copied_in() {
    copied_in_and_compared(&load(&sample_farm(), |file| {
        file.extension().is_some_and(|it| it != "md")
    }));
}

#[test]
fn two_hundred_real_files_are_judged_when_copied_in() {
    let real = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/cases/real"
    ));
    if !real.is_dir() {
        return skip(
            "two_hundred_real_files_are_judged_when_copied_in",
            "../shared/cases/real is not here",
        );
    }
    // Hidden directories are skipped.
    let is_visible = |file: &Path| !file.to_string_lossy().contains("/.");
    let mut load = load(real, |file| is_checkable(file) && is_visible(file));
    load.truncate(200);
    assert_eq!(load.len(), 200);
    copied_in_and_compared(&load);
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

#[test]
fn file_renamed_into_the_farm_is_judged() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let outside = farm.base().join("outside.xodr");
    std::fs::write(&outside, Content::Good(1).bytes()).unwrap();
    std::fs::rename(&outside, farm.root().join("in.xodr")).unwrap();
    assert_eq!(farm.verdict("in.xodr").verdict, Verdict::Accepted);
    // A whole directory is moved in at once.
    let outside = farm.base().join("outside");
    std::fs::create_dir_all(outside.join("deep")).unwrap();
    std::fs::write(outside.join("deep/a.xodr"), Content::NoHeader(2).bytes()).unwrap();
    std::fs::rename(&outside, farm.root().join("batch")).unwrap();
    farm.settle(2);
    assert_eq!(farm.verdict("batch/deep/a.xodr").verdict, Verdict::Rejected);
    // The result follows a file that gets another name.
    std::fs::rename(farm.root().join("in.xodr"), farm.root().join("out.xodr")).unwrap();
    until_so("the old name's result is withdrawn", || {
        !farm.out().join("in.xodr.xqar").exists()
    });
    assert_eq!(farm.verdict("out.xodr").verdict, Verdict::Accepted);
}

#[test]
fn verdict_follows_the_newest_bytes() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    for round in 0..30 {
        let content = if round % 2 == 0 {
            Content::Good(round)
        } else {
            Content::NoHeader(round)
        };
        farm.write("a.xodr", &content.bytes());
        // In the other rounds the test does not wait, so the next bytes arrive during the check.
        if round % 3 == 0 {
            let verdict = farm.verdict("a.xodr");
            assert_eq!(verdict.digest, sha256(&content.bytes()), "round {round}");
            assert_eq!(verdict.verdict, content.verdict(), "round {round}");
        }
    }
    let verdict = farm.verdict("a.xodr");
    assert_eq!(verdict.digest, sha256(&Content::NoHeader(29).bytes()));
    farm.settle(1);
    assert_eq!(
        farm.verdict_file("a.xodr")["sha256"].as_str(),
        Some(&*verdict.digest)
    );
    assert!(issues(&farm.result("a.xodr")).count() > 0);
}

#[test]
fn results_of_a_deleted_file_are_removed() {
    let farm = Farm::with(&["--report", "text", "--report", "json"]);
    let _broker = farm.serve_ready();
    farm.write("a.xodr", &Content::Good(1).bytes());
    farm.write("stays.xodr", &Content::Good(2).bytes());
    farm.settle(2);
    let of_a = || {
        let mut files = files_below(&farm.out());
        files.retain(|file| file.starts_with("a.xodr") || file.to_string_lossy().starts_with("a."));
        files
    };
    until_so("reports are written", || of_a().len() >= 4);
    std::fs::remove_file(farm.root().join("a.xodr")).unwrap();
    until_so("result and reports are withdrawn", || of_a().is_empty());
    farm.settle(1);
    // The file could come back, but it does not within the time limit.
    farm.wait_in_vain(&farm.root().join("a.xodr"), &[], "the file does not exist");
    assert!(farm.out().join("stays.xodr.xqar").exists());
}

/// After a reboot the runtime directory is empty and generations start at one again. The journal is
/// unchanged. A report of the last broker must not be taken for this broker's job of the same
/// number.
#[test]
fn verdict_is_reported_after_the_runtime_directory_is_lost() {
    let mut farm = Farm::with(&["--report", "text", "--absence-limit", "1s"]);
    let config = farm.base().join("config.xml");
    let demand = |names: &[&str]| {
        let bundle = |name: &&str| format!("<CheckerBundle application=\"{name}\"/>");
        let bundles: String = names.iter().map(bundle).collect();
        std::fs::write(&config, format!("<Config>{bundles}</Config>")).unwrap();
    };
    let named = config.to_string_lossy().into_owned();
    farm.arguments.extend(["-c".to_owned(), named]);
    let report = farm.out().join("a.xodr.txt");
    let says = |word: &str| {
        until_so("the report says the verdict", || {
            std::fs::read_to_string(&report).is_ok_and(|text| text.starts_with(word))
        });
    };
    farm.write("a.xodr", &Content::Good(1).bytes());
    for (bundles, word) in [
        (&["xodrBundle"][..], "accepted: a.xodr"),
        (&["xodrBundle", "nobody"], "undetermined: a.xodr"),
        (&["xodrBundle"], "accepted: a.xodr"),
    ] {
        demand(bundles);
        let mut broker = farm.serve_ready();
        says(word);
        broker.kill();
        let _ = std::fs::remove_dir_all(farm.instance());
    }
}

#[test]
fn future_file_is_awaited_through_a_link() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    let link = farm.root().with_file_name("link");
    std::os::unix::fs::symlink(farm.root(), &link).unwrap();
    let wait = |name: &str, limit: &str| {
        let file = link.join(name);
        farm.qcbus(&["wait", &file.to_string_lossy(), "--timeout", limit])
    };
    let said = wait("later.xodr", "100ms");
    assert_eq!(
        said.status.code(),
        Some(3),
        "watched, but missing: {said:?}"
    );
    farm.write("later.xodr", &Content::Good(1).bytes());
    let said = wait("later.xodr", "60s");
    assert_eq!(said.status.code(), Some(0), "{said:?}");
    drop(broker);
}

fn is_unwatched(farm: &Farm, name: &str) -> bool {
    let request = Request::Wait {
        file: farm.root().join(name),
        timeout_ms: Some(60_000),
    };
    matches!(farm.ask(&request), Some(Response::Unwatched { .. }))
}

#[test]
fn ignored_files_get_no_verdict() {
    let farm = Farm::new();
    std::fs::create_dir(farm.root().join("drafts")).unwrap();
    farm.write(
        ".qcignore",
        b"# not yet\n/drafts/\n*_wip.xodr\n!good_wip.xodr\n",
    );
    let _broker = farm.serve_ready();
    let ignored = [
        "drafts/a.xodr",
        "b_wip.xodr",
        ".hidden.xodr",
        "c.xodr~",
        "d.xodr.tmp",
        "e.xodr.part",
        "f.xodr.swp",
        "notes.txt",
        "island_roads.xml",
    ];
    for name in ignored.iter().chain(&["good_wip.xodr", "g.xodr"]) {
        farm.write(name, &Content::Good(1).bytes());
    }
    assert_eq!(farm.verdict("good_wip.xodr").verdict, Verdict::Accepted);
    assert_eq!(farm.verdict("g.xodr").verdict, Verdict::Accepted);
    farm.settle(2);
    for name in ignored {
        assert!(is_unwatched(&farm, name), "{name}");
    }
    // A file that is no longer ignored appears immediately, and a newly ignored one vanishes.
    farm.write(".qcignore", b"*_wip.xodr\n");
    until_so("drafts are judged", || {
        farm.out().join("drafts/a.xodr.xqar").exists()
    });
    until_so("a result is withdrawn", || {
        !farm.out().join("good_wip.xodr.xqar").exists()
    });
    farm.settle(2);
}

#[test]
fn requested_polling_finds_new_files() {
    let farm = Farm::with(&["--poll", "100ms"]);
    let _broker = farm.serve_ready();
    assert_eq!(
        farm.status().unwrap().watch_mode,
        "poll every 0.1 s, as requested"
    );
    farm.write("a.xodr", &Content::Good(1).bytes());
    until_so("it is seen", || farm.out().join("a.xodr.xqar").exists());
    farm.write("a.xodr", &Content::NoHeader(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    std::fs::remove_file(farm.root().join("a.xodr")).unwrap();
    until_so("it is gone", || !farm.out().join("a.xodr.xqar").exists());
}

/// A broker that starts again with other levels judges its files again.
#[test]
fn strict_broker_rejects_what_the_standard_forbids() {
    let mut farm = Farm::new();
    farm.write("a.xodr", &Content::colourless_road_mark());
    farm.write("b.xodr", &Content::Good(1).bytes());
    let states_levels = |farm: &Farm| {
        let params = &farm.result("a.xodr").bundles[0].params;
        params
            .iter()
            .any(|it| it.name == "qcbus.levels" && it.value == "asam")
    };
    for (strict, expected) in [
        (false, Verdict::Accepted),
        (true, Verdict::Rejected),
        (false, Verdict::Accepted),
    ] {
        farm.arguments = strict.then(|| "--strict".to_owned()).into_iter().collect();
        let broker = farm.serve_ready();
        assert_eq!(farm.verdict("a.xodr").verdict, expected, "strict: {strict}");
        assert_eq!(farm.verdict("b.xodr").verdict, Verdict::Accepted);
        farm.settle(2);
        assert_eq!(states_levels(&farm), strict);
        // `check` does not use a broker with other levels.
        let file = farm.root().join("a.xodr");
        let (file, out) = (file.to_string_lossy(), farm.base().join("checked"));
        let said = farm.qcbus(&["check", &file, "--out", &out.to_string_lossy()]);
        assert_eq!(said.status.code(), Some(0), "strict: {strict}");
        drop(broker);
    }
}

fn scenario(map: &str) -> String {
    format!(
        "<OpenSCENARIO>\n<FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-31T12:00:00\" \
         description=\"d\" author=\"a\"/>\n<CatalogLocations/>\n\
         <RoadNetwork><LogicFile filepath=\"{map}\"/></RoadNetwork>\n<Entities/>\n\
         <Storyboard><Init><Actions/></Init><StopTrigger/></Storyboard>\n</OpenSCENARIO>\n"
    )
}

/// Returns the hash of the map that a verdict rests on, or `None` if the map was missing.
fn map_of(farm: &Farm, name: &str, map: &Path) -> Option<String> {
    let told = farm.verdict_file(name);
    let all = told["depends_on"].as_array().unwrap();
    let found = all.iter().find(|it| it["path"].as_str() == map.to_str());
    found?["sha256"].as_str().map(str::to_owned)
}

/// Creates, changes and removes a scenario's map. The scenario must be checked again each time.
fn follows_its_map(farm: &Farm, reference: &str, map: &Path) {
    let is_watched = map.starts_with(farm.root());
    farm.write("s.xosc", scenario(reference).as_bytes());
    farm.verdict("s.xosc");
    let rests_on = |expected: Option<String>| {
        until_or(
            "the scenario is judged again",
            || (map_of(farm, "s.xosc", map) == expected).then_some(()),
            || {
                format!(
                    "{expected:?}\n{:#}\n{}",
                    farm.verdict_file("s.xosc"),
                    tail(&farm.log())
                )
            },
        );
    };
    rests_on(None);
    for number in 0..2 {
        let bytes = Content::Good(number).bytes();
        std::fs::write(map, &bytes).unwrap();
        rests_on(Some(sha256(&bytes)));
    }
    if !is_watched {
        farm.settle(1);
        let of_map = |file: &PathBuf| file.to_string_lossy().contains(".xodr");
        let of_map: Vec<PathBuf> = files_below(&farm.out())
            .into_iter()
            .filter(of_map)
            .collect();
        assert!(of_map.is_empty(), "the map is not watched: {of_map:?}");
    }
    std::fs::remove_file(map).unwrap();
    rests_on(None);
}

#[test]
fn scenario_is_judged_again_when_its_map_changes() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    follows_its_map(&farm, "map.xodr", &farm.root().join("map.xodr"));
}

#[test]
fn map_outside_the_watched_directory_is_followed() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    std::fs::create_dir(farm.base().join("library")).unwrap();
    let map = farm.base().join("library/town.xodr");
    follows_its_map(&farm, "../library/town.xodr", &map);
    assert!(
        !farm.out().join("town.xodr.xqar").exists(),
        "the map gets no result of its own"
    );
    assert_eq!(farm.status().unwrap().files.total, 1);
}

#[test]
fn map_is_judged_again_when_an_included_file_changes() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let whole = String::from_utf8(Content::Good(1).bytes()).unwrap();
    let (begin, end) = (
        whole.find("<planView>").unwrap(),
        whole.find("<lanes>").unwrap(),
    );
    let outer = format!(
        "{}<include file=\"view.xml\"/>{}",
        &whole[..begin],
        &whole[end..]
    );
    farm.write("a.xodr", outer.as_bytes());
    farm.verdict("a.xodr");
    let inner = format!("<road>{}</road>", &whole[begin..end]);
    let becomes = |faults: usize| {
        until_or(
            "the map is judged again",
            || (faults_of_form(&farm.result("a.xodr")) == faults).then_some(()),
            || {
                format!(
                    "{faults}: {:#?}\n{}",
                    farm.result("a.xodr"),
                    tail(&farm.log())
                )
            },
        );
    };
    becomes(1);
    farm.write("view.xml", inner.as_bytes());
    becomes(0);
    farm.write("view.xml", b"<road><planView></road>");
    becomes(1);
    farm.write("view.xml", inner.as_bytes());
    becomes(0);
    std::fs::remove_file(farm.root().join("view.xml")).unwrap();
    becomes(1);
}

/// Counts the issues about well-formedness.
fn faults_of_form(results: &Results) -> usize {
    issues(results)
        .filter(|(checker, _)| checker.id.ends_with("xml_valid_xml_document"))
        .count()
}

/// Returns `qcbus serve` for any directories, with the farm's output and gate.
fn serve_of(farm: &Farm, instance: &str, directories: &[&Path]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    command.arg("serve").args(directories);
    for (option, place) in [
        ("--instance-dir", instance),
        ("--out", "out"),
        ("--bundles-d", "bundles.d"),
        ("--gate", "gate"),
    ] {
        command.arg(option).arg(farm.base().join(place));
    }
    command.args(["--report", "json"]).env("NO_COLOR", "1");
    command
}

/// Serves these directories until all outputs of `there` exist and those of `gone` are removed, and
/// ends.
fn served(farm: &Farm, directories: &[&Path], there: &[&str], gone: &[&str]) {
    let mut broker = Broker::start(
        &mut serve_of(farm, "instance", directories),
        &farm.log_path(),
    );
    let traces = |of: &str| {
        let out = |suffix: &str| farm.out().join(format!("{of}.{suffix}"));
        let gate = farm.base().join("gate").join(of);
        let all = [out("xqar"), out("verdict.json"), out("json"), gate];
        all.map(|path| (path.exists(), path))
    };
    let files = directories.iter().flat_map(|it| files_below(it));
    let total = files.filter(|it| is_checkable(it)).count() as u64;
    let wrong = || -> Vec<PathBuf> {
        let missing = there.iter().flat_map(|of| traces(of)).filter(|it| !it.0);
        let left = gone.iter().flat_map(|of| traces(of)).filter(|it| it.0);
        missing.chain(left).map(|it| it.1).collect()
    };
    let quiet = || {
        let (queue, files) = farm.status().map(|it| (it.queue, it.files))?;
        let left = queue.waiting + queue.background + queue.active;
        let judged = files.judged == files.total && files.total == total;
        (left == 0 && judged && wrong().is_empty()).then_some(())
    };
    until_or("everything is where it belongs", quiet, || {
        format!("{:?}\n{}", wrong(), tail(&farm.log()))
    });
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
    assert_eq!(
        wrong(),
        Vec::<PathBuf>::new(),
        "also after the broker has ended"
    );
}

#[test]
fn results_move_with_the_watched_directories() {
    let farm = Farm::new();
    let second = farm.base().join("second");
    std::fs::create_dir(&second).unwrap();
    farm.write("a.xodr", &Content::Good(1).bytes());
    std::fs::write(second.join("b.xodr"), Content::Good(2).bytes()).unwrap();
    let root = farm.root();
    served(&farm, &[&root], &["a.xodr"], &[]);
    let both = [&*root, &*second];
    let moved = ["farm/a.xodr", "second/b.xodr"];
    served(&farm, &both, &moved, &["a.xodr"]);
    std::fs::remove_file(root.join("a.xodr")).unwrap();
    served(&farm, &[&second], &["b.xodr"], &moved);
}

#[test]
fn removed_directory_leaves_the_results_of_others() {
    let farm = Farm::new();
    let (one, other) = (farm.base().join("z1"), farm.base().join("a2"));
    std::fs::create_dir_all(one.join("sub")).unwrap();
    std::fs::create_dir(&other).unwrap();
    for file in [one.join("sub/a.xodr"), one.join("a.xodr")] {
        std::fs::write(file, Content::Good(1).bytes()).unwrap();
    }
    std::fs::write(other.join("a.xodr"), Content::Good(2).bytes()).unwrap();
    served(&farm, &[&one], &["sub/a.xodr", "a.xodr"], &[]);
    // A file that is no longer watched has no result.
    served(&farm, &[&other], &["a.xodr"], &["sub/a.xodr"]);
    let of_other = std::fs::read_to_string(farm.out().join("a.xodr.xqar")).unwrap();
    assert!(of_other.contains(&*other.to_string_lossy()));
    std::fs::remove_dir_all(&one).unwrap();
    served(&farm, &[&other], &["a.xodr"], &["sub/a.xodr"]);
    let after = std::fs::read_to_string(farm.out().join("a.xodr.xqar")).unwrap();
    assert_eq!(after, of_other);
}

#[test]
fn second_broker_on_the_same_results_is_refused() {
    let farm = Farm::new();
    farm.write("a.xodr", &Content::Good(1).bytes());
    let other = farm.base().join("other");
    std::fs::create_dir(&other).unwrap();
    let mut first = Broker::start(
        &mut serve_of(&farm, "instance", &[&farm.root()]),
        &farm.log_path(),
    );
    farm.verdict("a.xodr");
    let mut second = serve_of(&farm, "second", &[&other]);
    let refused = second.output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    let state = farm.out().join(".qcbus");
    let holder = format!("(instance `instance`, process {})", first.pid());
    for words in [&*state.to_string_lossy(), &holder, "qcbus down", "--out"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(farm.out().join("a.xodr.xqar").exists());
    assert!(farm.base().join("gate/a.xodr").exists());
    // Reading is harmless and therefore allowed.
    let doctor = farm.qcbus(&["doctor", "--state", &state.to_string_lossy()]);
    let found = String::from_utf8_lossy(&doctor.stdout).into_owned();
    assert!(found.contains("ok   journal"), "{found}");
    // A killed broker holds no locks.
    first.kill();
    let mut second = Broker::start(&mut second, &farm.log_path());
    let instance = Instance::at(farm.base().join("second"));
    let ready = || ask_broker(instance.dir(), &Request::Status).ok();
    until_or("the second is there", ready, || farm.log());
    second.kill();
}
