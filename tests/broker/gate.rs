//! Every file behind the gate is complete and was judged in this state. Results belong to their
//! writer, and no forgotten result stays.

use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::cli::{Cli, files_below, sample_farm};
use crate::support::content::{self, Content, Mark};
use crate::support::farm::{Farm, tail};
use crate::support::programs::write_script;
use crate::support::watchdog::{until_or, until_so};
use qcbus_messages::Verdict;

const MAP: &str = "maps/quay_straight.xodr";
const SCENARIO: &str = "scenarios/van_follows.xosc";
const CATALOG: &str = "catalogs/vehicles.xosc";
const ISLAND: &str = "maps/island/island.xodr";
const ISLAND_ROADS: &str = "maps/island/island_roads.xml";

/// Creates a farm with a gate and these files of the sample farm.
fn farm_of(names: &[&str], arguments: &[&str]) -> Farm {
    let mut farm = Farm::with(arguments);
    let gate = gate(&farm).to_string_lossy().into_owned();
    farm.arguments.extend(["--gate".to_owned(), gate]);
    names.iter().for_each(|name| bring(&farm, name));
    farm
}

/// Puts a file of the sample farm into the farm in one step.
fn bring(farm: &Farm, name: &str) {
    put(
        farm,
        name,
        &std::fs::read(sample_farm().join(name)).unwrap(),
    );
}

fn put(farm: &Farm, name: &str, bytes: &[u8]) {
    let (to, aside) = (farm.root().join(name), farm.base().join("aside"));
    std::fs::create_dir_all(to.parent().unwrap()).unwrap();
    std::fs::write(&aside, bytes).unwrap();
    std::fs::rename(aside, to).unwrap();
}

fn gate(farm: &Farm) -> PathBuf {
    farm.base().join("gate")
}

/// Returns the published names in order.
fn published(farm: &Farm) -> Vec<String> {
    let files = files_below(&gate(farm)).into_iter();
    let names = files.map(|it| it.to_string_lossy().into_owned());
    names
        .filter(|it| !it.contains("/.qcbus-") && !it.starts_with(".qcbus-"))
        .collect()
}

fn publishes(farm: &Farm, expected: &[&str]) {
    until_or(
        "exactly that is published",
        || (published(farm) == expected).then_some(()),
        || {
            format!(
                "{:?}, not {expected:?}\n{}",
                published(farm),
                tail(&farm.log())
            )
        },
    );
}

/// Asserts that a single run accepts everything behind the gate in its current state.
fn is_sound(farm: &Farm) {
    let cli = Cli::new();
    let said = cli.check_in(&gate(farm), &["."], "out");
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
}

#[test]
fn accepted_files_are_published_with_their_dependencies() {
    let all = files_below(&sample_farm());
    let names: Vec<String> = all
        .iter()
        .map(|it| it.to_string_lossy().into_owned())
        .collect();
    let names: Vec<&str> = names.iter().map(|it| &**it).collect();
    let farm = farm_of(&names, &[]);
    let _broker = farm.serve_ready();
    let sound: Vec<&str> = names
        .into_iter()
        .filter(|it| it.contains('/') && !it.starts_with("faulty"))
        .collect();
    publishes(&farm, &sound);
    is_sound(&farm);
    let gate = farm.status().unwrap().gate.unwrap();
    assert_eq!((gate.published, gate.held_back), (15, 0), "{gate:?}");
}

/// There are no symbolic links behind the gate, so the same path leads to another map there.
#[test]
fn scenario_using_the_parent_of_a_link_is_withheld() {
    let farm = farm_of(&[], &[]);
    let far = farm.base().join("far");
    std::fs::create_dir_all(far.join("deep")).unwrap();
    std::fs::write(far.join("m.xodr"), Content::Good(1).bytes()).unwrap();
    std::os::unix::fs::symlink(far.join("deep"), farm.root().join("link")).unwrap();
    put(&farm, "m.xodr", &Content::Good(2).bytes());
    put(
        &farm,
        content::CATALOG,
        &Content::Catalog(1, Mark::Clean).bytes(),
    );
    let _broker = farm.serve_ready();
    let scenario = Content::Scenario(1, "link/../m.xodr".to_owned());
    put(&farm, "a.xosc", &scenario.bytes());
    assert_eq!(farm.verdict("a.xosc").verdict, Verdict::Accepted);
    publishes(&farm, &[content::CATALOG, "m.xodr"]);
    let held_back = || farm.status()?.gate.filter(|it| it.held_back == 1);
    until_or("it is told", held_back, || farm.log());
    let said = farm.log();
    assert!(said.contains("link/../m.xodr"), "{said}");
}

/// Scripts wait for the verdict and then run the file behind the gate.
#[test]
fn accepted_file_is_published_before_the_answer() {
    let farm = farm_of(&[], &[]);
    let _broker = farm.serve_ready();
    for number in 0..50 {
        let bytes = Content::Good(number).bytes();
        put(&farm, "a.xodr", &bytes);
        assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
        let there = std::fs::read(gate(&farm).join("a.xodr"));
        assert!(there.is_ok_and(|it| it == bytes), "{number}");
    }
}

#[test]
fn map_is_withdrawn_and_published_again_with_its_include() {
    let farm = farm_of(&[ISLAND, ISLAND_ROADS], &[]);
    let _broker = farm.serve_ready();
    publishes(&farm, &[ISLAND, ISLAND_ROADS]);
    is_sound(&farm);
    put(&farm, ISLAND_ROADS, b"<no roads");
    publishes(&farm, &[]);
    assert_eq!(farm.verdict(ISLAND).verdict, Verdict::Rejected);
    bring(&farm, ISLAND_ROADS);
    publishes(&farm, &[ISLAND, ISLAND_ROADS]);
    std::fs::remove_file(farm.root().join(ISLAND)).unwrap();
    publishes(&farm, &[]);
}

#[test]
fn removed_part_of_a_published_map_is_restored() {
    let farm = farm_of(&[ISLAND, ISLAND_ROADS], &[]);
    let _broker = farm.serve_ready();
    publishes(&farm, &[ISLAND, ISLAND_ROADS]);
    for part in [ISLAND_ROADS, ISLAND] {
        std::fs::remove_file(gate(&farm).join(part)).unwrap();
        publishes(&farm, &[ISLAND, ISLAND_ROADS]);
        is_sound(&farm);
    }
}

#[test]
fn scenario_is_withdrawn_and_published_again_with_its_map() {
    let farm = farm_of(&[MAP, SCENARIO, CATALOG], &[]);
    let _broker = farm.serve_ready();
    publishes(&farm, &[CATALOG, MAP, SCENARIO]);
    is_sound(&farm);
    // The map is rejected, and so is the scenario, in every answer.
    put(&farm, MAP, &Content::NoHeader(1).bytes());
    assert_eq!(farm.verdict(SCENARIO).verdict, Verdict::Rejected);
    assert_eq!(farm.verdict(MAP).verdict, Verdict::Rejected);
    publishes(&farm, &[CATALOG]);
    let scenario = farm.root().join(SCENARIO).to_string_lossy().into_owned();
    assert_eq!(farm.qcbus(&["wait", &scenario]).status.code(), Some(1));
    let told = farm.verdict_file(SCENARIO);
    assert_eq!(told["own"], "accepted", "{told:#}");
    let at = farm.root().join(MAP).to_string_lossy().into_owned();
    let mut under = told["rests_on"].as_array().unwrap().iter();
    let map = under.find(|it| it["path"] == *at).unwrap();
    assert_eq!(
        (&map["verdict"], &map["errors"]),
        (&"rejected".into(), &1.into())
    );
    // Another accepted map replaces it.
    put(&farm, MAP, &Content::Good(2).bytes());
    publishes(&farm, &[CATALOG, MAP, SCENARIO]);
    let there = std::fs::read(gate(&farm).join(MAP)).unwrap();
    assert_eq!(there, Content::Good(2).bytes());
    // The map is missing: the file that was published with it does not stay.
    std::fs::remove_file(farm.root().join(MAP)).unwrap();
    until_so("the map has gone", || !gate(&farm).join(MAP).exists());
    bring(&farm, MAP);
    publishes(&farm, &[CATALOG, MAP, SCENARIO]);
    std::fs::write(farm.root().join(CATALOG), "<no catalog").unwrap();
    publishes(&farm, &[MAP]);
}

#[test]
fn scenario_with_own_verdict_is_withheld_with_its_map() {
    let farm = farm_of(&[MAP, SCENARIO, CATALOG], &["--own-verdict"]);
    let _broker = farm.serve_ready();
    publishes(&farm, &[CATALOG, MAP, SCENARIO]);
    put(&farm, MAP, &Content::NoHeader(1).bytes());
    assert_eq!(farm.verdict(MAP).verdict, Verdict::Rejected);
    assert_eq!(farm.verdict(SCENARIO).verdict, Verdict::Accepted);
    publishes(&farm, &[CATALOG]);
    until_so("it is said why", || {
        let status = farm.status().unwrap();
        let why = |text: &str| text.contains(MAP) && text.contains("not accepted");
        let mut said = status.notices.iter();
        said.any(|it| it.kind == "held-back" && why(&it.text))
    });
    let held = farm.status().unwrap().gate.unwrap();
    assert_eq!(held.held_back, held.examples.len() as u64, "{held:?}");
}

#[test]
fn map_outside_is_named_and_optionally_refused() {
    for refused in [false, true] {
        let arguments: &[&str] = if refused {
            &["--gate-outside", "refuse"]
        } else {
            &[]
        };
        let farm = farm_of(&[CATALOG], arguments);
        let library = farm.base().join("library.xodr");
        std::fs::copy(sample_farm().join(MAP), &library).unwrap();
        let text = std::fs::read_to_string(sample_farm().join(SCENARIO)).unwrap();
        let text = text.replace("../maps/quay_straight.xodr", "../../library.xodr");
        put(&farm, SCENARIO, text.as_bytes());
        let _broker = farm.serve_ready();
        assert_eq!(farm.verdict(SCENARIO).verdict, Verdict::Accepted);
        let named = farm.verdict_file(SCENARIO)["outside_gate"].clone();
        assert_eq!(named, serde_json::json!([library.to_string_lossy()]));
        if refused {
            publishes(&farm, &[CATALOG]);
            until_so("it is said", || {
                farm.log().contains("--gate-outside refuse")
            });
        } else {
            publishes(&farm, &[CATALOG, SCENARIO]);
        }
    }
}

/// Waits until the farm is at rest, and kills its broker.
fn stopped(farm: &Farm, mut broker: Broker, total: usize) {
    farm.settle(total);
    broker.kill();
}

#[test]
fn start_removes_stale_files_from_the_gate() {
    let farm = farm_of(&[MAP, SCENARIO, CATALOG], &[]);
    let broker = farm.serve_ready();
    publishes(&farm, &[CATALOG, MAP, SCENARIO]);
    stopped(&farm, broker, 3);
    std::fs::write(
        gate(&farm).join("maps/stale.xodr"),
        Content::Good(1).bytes(),
    )
    .unwrap();
    std::fs::remove_file(gate(&farm).join(CATALOG)).unwrap();
    // The map is changed while no broker watches.
    put(&farm, MAP, &Content::NoHeader(1).bytes());
    let broker = farm.serve_ready();
    publishes(&farm, &[CATALOG]);
    assert_eq!(farm.verdict(MAP).verdict, Verdict::Rejected);
    bring(&farm, MAP);
    publishes(&farm, &[CATALOG, MAP, SCENARIO]);
    is_sound(&farm);
    drop(broker);
}

#[test]
fn start_publishes_again_only_with_every_required_bundle() {
    let farm = farm_of(&[MAP], &["--absence-limit", "1h"]);
    let broker = farm.serve_ready();
    publishes(&farm, &[MAP]);
    stopped(&farm, broker, 1);
    std::fs::remove_file(gate(&farm).join(MAP)).unwrap();
    let sleeper = farm.base().join("sleeper");
    write_script(&sleeper, "#!/bin/sh\nexec sleep 9999\n");
    farm.let_in_by(&sleeper, "sleeper", "");
    let broker = farm.serve_ready();
    farm.wait_in_vain(&farm.root().join(MAP), &[], "in time");
    assert_eq!(published(&farm), [""; 0]);
    farm.send_away("sleeper");
    publishes(&farm, &[MAP]);
    stopped(&farm, broker, 1);
    std::fs::remove_file(gate(&farm).join(MAP)).unwrap();
    let broker = farm.serve_ready();
    publishes(&farm, &[MAP]);
    drop(broker);
}

#[test]
fn start_replaces_changed_bytes_of_the_same_size() {
    let farm = farm_of(&[MAP], &[]);
    let (source, copy) = (farm.root().join(MAP), gate(&farm).join(MAP));
    let whole = std::fs::read(&source).unwrap();
    let other = || {
        let modified = std::fs::metadata(&copy).unwrap().modified().unwrap();
        std::fs::write(&copy, vec![b' '; whole.len()]).unwrap();
        let file = std::fs::File::options().write(true).open(&copy).unwrap();
        file.set_modified(modified).unwrap();
    };
    let link = || {
        std::fs::remove_file(&copy).unwrap();
        std::fs::hard_link(&source, &copy).unwrap();
    };
    for change in [&other as &dyn Fn(), &link] {
        let broker = farm.serve_ready();
        publishes(&farm, &[MAP]);
        stopped(&farm, broker, 1);
        change();
        let broker = farm.serve_ready();
        publishes(&farm, &[MAP]);
        assert!(std::fs::read(&copy).unwrap() == whole);
        assert_eq!(std::fs::metadata(&copy).unwrap().nlink(), 1);
        drop(broker);
    }
}

fn refused(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    said
}

#[test]
fn directory_with_other_files_is_refused_as_gate() {
    let farm = farm_of(&[MAP], &[]);
    std::fs::create_dir(gate(&farm)).unwrap();
    let precious = gate(&farm).join("precious.txt");
    std::fs::write(&precious, "").unwrap();
    let said = refused(&mut farm.serve_command());
    assert!(
        said.contains("touch") && said.contains(".qcbus-gate"),
        "{said}"
    );
    assert!(precious.exists());
    std::fs::write(gate(&farm).join(".qcbus-gate"), "").unwrap();
    let _broker = farm.serve_ready();
    publishes(&farm, &[MAP]);
}

#[test]
fn results_and_gate_must_be_separate() {
    for (gate, out) in [("out", "out"), ("out/gate", "out"), ("gate", "gate/out")] {
        let farm = Farm::new();
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command
            .arg("serve")
            .arg(farm.root())
            .current_dir(farm.base());
        let said = refused(command.args(["--gate", gate, "--out", out]));
        assert!(said.contains("separate directory for the gate"), "{said}");
    }
}

/// Returns the command of another broker with its own directories, except for the given ones.
fn another(farm: &Farm, shared: &[(&str, &Path)]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    let other = farm.base().join("other");
    std::fs::create_dir_all(other.join("farm")).unwrap();
    command.arg("serve").arg(other.join("farm"));
    for option in ["--out", "--gate", "--state", "--instance-dir"] {
        let given = shared.iter().find(|it| it.0 == option);
        let own = other.join(&option[2..]);
        command.arg(option).arg(given.map_or(&*own, |it| it.1));
    }
    command
}

#[test]
fn gate_results_and_state_belong_to_one_broker() {
    let farm = farm_of(&[MAP], &[]);
    let broker = farm.serve_ready();
    publishes(&farm, &[MAP]);
    let holder = format!("instance `instance`, process {}", broker.pid());
    for (option, what) in [("--gate", "the gate"), ("--out", "the results directory")] {
        let path = if option == "--gate" {
            gate(&farm)
        } else {
            farm.out()
        };
        let said = refused(&mut another(&farm, &[(option, &path)]));
        for words in [what, &holder, option, "qcbus down"] {
            assert!(said.contains(words), "{words}: {said}");
        }
    }
    // A single run must not write there, either.
    let cli = Cli::new();
    cli.write("a.xodr", Content::Good(1).bytes());
    let out = farm.out().to_string_lossy().into_owned();
    let said = cli.qcbus(&["check", "a.xodr", "--out", &out]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    assert!(said.stderr.contains(&holder), "{}", said.stderr);
    assert!(!farm.out().join("a.xodr.xqar").exists());
    assert_eq!(published(&farm), [MAP]);
}

/// Returns the names of results, verdict files and reports.
fn results(out: &Path) -> Vec<String> {
    let files = files_below(out).into_iter();
    let names = files.map(|it| it.to_string_lossy().into_owned());
    names.filter(|it| !it.starts_with(".qcbus")).collect()
}

#[test]
fn earlier_results_do_not_look_current() {
    let cli = Cli::new();
    for name in ["in/a.xodr", "in/b.xodr", "else/c.xodr"] {
        cli.write(name, Content::Good(1).bytes());
    }
    let out = cli.path().join("qcbus-out");
    let foreign = cli.write(
        "qcbus-out/in/Result.xqar",
        "<CheckerResults version=\"1\"/>",
    );
    cli.qcbus(&["check", "in", "else"]);
    let all = [
        "else/c.xodr.xqar",
        "in/Result.xqar",
        "in/a.xodr.xqar",
        "in/b.xodr.xqar",
    ];
    assert_eq!(results(&out), all);
    std::fs::remove_file(cli.path().join("in/a.xodr")).unwrap();
    cli.write("else/.qcignore", "*.xodr\n");
    let said = cli.qcbus(&["check", "in"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert_eq!(
        results(&out),
        ["else/c.xodr.xqar", "in/Result.xqar", "in/b.xodr.xqar"]
    );
    // A run without any verdict leaves no earlier result behind.
    cli.write("config.xml", "<Config/>");
    let said = cli.qcbus(&[
        "check",
        "in/b.xodr",
        "--job-deadline",
        "0ms",
        "--max-file",
        "0",
    ]);
    assert_ne!(said.code, Some(0), "{}", said.whole(&cli));
    let left = results(&out);
    let read = || std::fs::read_to_string(out.join("in/b.xodr.xqar")).unwrap();
    assert!(
        !left.contains(&"in/b.xodr.xqar".to_owned()) || read().contains("status=\"error\""),
        "{left:?}"
    );
    cli.qcbus(&["check", "else"]);
    assert_eq!(
        results(&out).first().unwrap(),
        "in/Result.xqar",
        "the ignored file has no result"
    );
    assert!(foreign.exists());
}

/// Returns the files of the journal. The broker must be dead.
fn journal_files(farm: &Farm) -> Vec<PathBuf> {
    ["", "-wal", "-shm"]
        .map(|suffix| {
            let mut name = farm.journal().into_os_string();
            name.push(suffix);
            PathBuf::from(name)
        })
        .into_iter()
        .filter(|it| it.exists())
        .collect()
}

/// Simulates a broker that is killed between writing results and recording them: everything is
/// written, but the journal is the earlier one.
fn killed_before_the_journal(farm: &Farm, change: impl Fn()) {
    let before = farm.base().join("before");
    std::fs::create_dir(&before).unwrap();
    for file in journal_files(farm) {
        std::fs::copy(&file, before.join(file.file_name().unwrap())).unwrap();
    }
    let mut broker = farm.serve_ready();
    change();
    broker.kill();
    for file in journal_files(farm) {
        std::fs::remove_file(file).unwrap();
    }
    for file in files_below(&before) {
        std::fs::copy(before.join(&file), farm.journal().with_file_name(&file)).unwrap();
    }
}

fn comes_to(farm: &Farm, expected: &[&str]) {
    let written = || results(&farm.out());
    until_or(
        "exactly these results are there",
        || (written() == expected).then_some(()),
        || format!("{:?}\n{}", written(), tail(&farm.log())),
    );
}

/// Returns all output files of a file.
fn all_of(name: &str) -> [String; 3] {
    ["json", "verdict.json", "xqar"].map(|suffix| format!("{name}.{suffix}"))
}

#[test]
fn unrecorded_result_is_removed_with_its_file() {
    let farm = farm_of(&[], &["--report", "json"]);
    put(&farm, "old.xodr", &Content::Good(1).bytes());
    let broker = farm.serve_ready();
    stopped(&farm, broker, 1);
    killed_before_the_journal(&farm, || {
        put(&farm, "old.xodr", &Content::Good(2).bytes());
        put(&farm, "new.xodr", &Content::Good(3).bytes());
        farm.settle(2);
        publishes(&farm, &["new.xodr", "old.xodr"]);
        let all = [all_of("new.xodr"), all_of("old.xodr")].concat();
        comes_to(&farm, &all.iter().map(|it| &**it).collect::<Vec<_>>());
    });
    for name in ["old.xodr", "new.xodr"] {
        std::fs::remove_file(farm.root().join(name)).unwrap();
    }
    let _broker = farm.serve_ready();
    comes_to(&farm, &[]);
    publishes(&farm, &[]);
    assert!(farm.log().contains("results withdrawn"), "{}", farm.log());
}

#[test]
fn unrecorded_verdict_is_given_again() {
    let farm = farm_of(&[], &[]);
    put(&farm, "a.xodr", &Content::Good(1).bytes());
    let broker = farm.serve_ready();
    stopped(&farm, broker, 1);
    let good = std::fs::read(farm.root().join("a.xodr")).unwrap();
    killed_before_the_journal(&farm, || {
        put(&farm, "a.xodr", &Content::NoHeader(2).bytes());
        assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Rejected);
    });
    // The exact file of the old verdict is back, so that the journal seems to be correct.
    put(&farm, "a.xodr", &good);
    let _broker = farm.serve_ready();
    farm.settle(1);
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    assert_eq!(farm.verdict_file("a.xodr")["verdict"], "accepted");
    publishes(&farm, &["a.xodr"]);
}

#[test]
fn outputs_are_removed_when_the_journal_is_missing() {
    let farm = farm_of(&[MAP, CATALOG], &["--report", "json"]);
    let broker = farm.serve_ready();
    let json = farm.out().join(format!("{MAP}.json"));
    until_so("it is reported", || json.exists());
    stopped(&farm, broker, 2);
    for file in journal_files(&farm) {
        std::fs::remove_file(file).unwrap();
    }
    std::fs::remove_file(farm.root().join(MAP)).unwrap();
    // These files are foreign or belong to another broker.
    let kept = ["Result.xqar", "nested/x.xodr.xqar", "x.verdict.json"];
    let result = std::fs::read(farm.out().join(format!("{CATALOG}.xqar"))).unwrap();
    for name in kept {
        let path = farm.out().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, &result).unwrap();
    }
    std::fs::create_dir(farm.out().join("nested/.qcbus")).unwrap();
    let _broker = farm.serve_ready();
    let mut expected = all_of(CATALOG).to_vec();
    expected.extend(kept.map(str::to_owned));
    expected.sort();
    comes_to(&farm, &expected.iter().map(|it| &**it).collect::<Vec<_>>());
    publishes(&farm, &[CATALOG]);
}
