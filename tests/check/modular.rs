//! Modular scenarios from end to end: expanded and packed on the command line, judged by a broker,
//! and judged again after a library changes.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::cli::{Cli, files_below, issues, places, sample_farm};
use crate::support::farm::{Farm, tail};
use crate::support::inside::skip;
use crate::support::watchdog::until_or;
use qcbus_formats::Verdict;

const MAIN: &str = "modular/convoy.xosc";
const LIBRARY: &str = "modular/moves.xosc";
const PACKED: &str = "modular/convoy_packed.mosc";
const MAP: &str = "maps/quay_straight.xodr";

fn sample(name: &str) -> Vec<u8> {
    std::fs::read(sample_farm().join(name)).unwrap()
}

fn text(name: &str) -> String {
    String::from_utf8(sample(name)).unwrap()
}

/// Creates a cli with the sample's modular scenario, its library and its map.
fn cli() -> Cli {
    let cli = Cli::new();
    for name in [MAIN, LIBRARY, MAP] {
        cli.write(name, sample(name));
    }
    cli
}

fn files(cli: &Cli) -> Vec<PathBuf> {
    let mut files = files_below(cli.path());
    files.sort();
    files
}

#[test]
fn packed_scenario_expands_to_the_same_text() {
    let cli = cli();
    let said = cli.qcbus(&["expand", MAIN]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert_eq!(said.stderr, "");
    let plain = said.stdout;
    assert!(
        plain.contains("<ManeuverGroup name=\"lead.brake\""),
        "{plain}"
    );
    assert!(!plain.contains("ScenarioReference") && !plain.contains("parameterAttributes"));

    let said = cli.qcbus(&["pack", MAIN, LIBRARY, "-o", "modular/x.mosc"]);
    assert_eq!((said.code, &*said.stderr), (Some(0), ""));
    let first = std::fs::read(cli.path().join("modular/x.mosc")).unwrap();
    assert_eq!(cli.qcbus(&["expand", "modular/x.mosc"]).stdout, plain);
    cli.qcbus(&["pack", MAIN, LIBRARY, "-o", "modular/x.mosc"]);
    let again = std::fs::read(cli.path().join("modular/x.mosc")).unwrap();
    assert!(first == again, "the same files make the same archive");
    assert!(
        first == sample(PACKED),
        "the sample's archive is up to date"
    );

    // The expanded scenario is a plain one, and expanding it again changes nothing.
    cli.write("modular/plain.xosc", &plain);
    assert_eq!(cli.qcbus(&["expand", "modular/plain.xosc"]).stdout, plain);
    let said = cli.qcbus(&["check", "modular/plain.xosc"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
}

#[test]
fn expand_writes_only_the_requested_file() {
    let cli = cli();
    let before = files(&cli);
    let said = cli.qcbus(&["expand", MAIN, "-o", "plain.xosc"]);
    assert_eq!((said.code, &*said.stdout), (Some(0), ""));
    let mut after = before.clone();
    after.push("plain.xosc".into());
    after.sort();
    assert_eq!(files(&cli), after);

    // A reference without a target: there is no output, and an older output stays unchanged.
    cli.write(
        "modular/lost.xosc",
        text(MAIN).replace("moves.xosc", "mooves.xosc"),
    );
    cli.write("old.xosc", "as it was");
    let said = cli.qcbus(&["expand", "modular/lost.xosc", "-o", "old.xosc"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    assert!(
        said.stderr.contains("modular/lost.xosc:88:"),
        "{}",
        said.stderr
    );
    let said = cli.qcbus(&["expand", "modular/lost.xosc", "-o", "new.xosc"]);
    assert_eq!(said.code, Some(1));
    assert_eq!(
        std::fs::read(cli.path().join("old.xosc")).unwrap(),
        b"as it was"
    );
    assert!(!cli.path().join("new.xosc").exists());
}

#[test]
fn inputs_of_a_scenario_are_not_overwritten() {
    let cli = cli();
    cli.write(PACKED, sample(PACKED));
    for (file, output) in [(MAIN, MAIN), (MAIN, LIBRARY), (PACKED, PACKED)] {
        let said = cli.qcbus(&["expand", file, "-o", output]);
        assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
        assert!(
            said.stderr.contains("a source file of the scenario"),
            "{}",
            said.stderr
        );
        let now = std::fs::read(cli.path().join(output)).unwrap();
        assert!(now == sample(output), "{output}");
    }
    let said = cli.qcbus(&["pack", MAIN, PACKED, "-o", PACKED]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    assert!(std::fs::read(cli.path().join(PACKED)).unwrap() == sample(PACKED));
}

#[test]
fn failed_packing_leaves_nothing_behind() {
    let cli = cli();
    cli.write("other/moves.xosc", sample(LIBRARY));
    let before = files(&cli);
    let cases: [(&[&str], &str); 5] = [
        (
            &["pack", MAIN, LIBRARY, "other/moves.xosc", "-o", "x.mosc"],
            "would both be called moves.xosc",
        ),
        (
            &["pack", MAIN, "gone.xosc", "-o", "x.mosc"],
            "cannot read gone.xosc",
        ),
        (&["pack", MAIN, "-o", "x.zip"], "must end in .mosc"),
        (&["pack", MAP, "-o", "x.mosc"], "must end in .xosc"),
        (&["expand", "gone.mosc", "-o", "x.xosc"], "no such file"),
    ];
    for (arguments, part) in cases {
        let said = cli.qcbus(arguments);
        assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
        assert!(said.stderr.contains(part), "{}", said.whole(&cli));
        assert_eq!(files(&cli), before);
    }
}

#[test]
fn concurrent_expansions_do_not_disturb_each_other() {
    let cli = cli();
    cli.write(PACKED, sample(PACKED));
    let start = |number: usize| {
        let output = format!("out{number}.xosc");
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.current_dir(cli.path());
        command
            .args(["expand", PACKED, "-o", &output])
            .spawn()
            .unwrap()
    };
    let children: Vec<_> = (0..8).map(start).collect();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    let read = |number: usize| std::fs::read(cli.path().join(format!("out{number}.xosc"))).unwrap();
    assert!((1..8).all(|number| read(number) == read(0)));
}

/// Creates a farm with the sample's modular scenario, its library and its map.
fn farm() -> Farm {
    let farm = Farm::new();
    for name in ["maps", "modular"] {
        std::fs::create_dir(farm.root().join(name)).unwrap();
    }
    farm.write(MAP, &sample(MAP));
    farm
}

/// Waits until a file has this verdict, and this text among its issues.
fn becomes(farm: &Farm, name: &str, verdict: &str, part: &str) {
    let is_so = || {
        let told = farm.verdict_file(name);
        let results = farm.result(name);
        let says = part.is_empty() || issues(&results).any(|(_, it)| it.description.contains(part));
        (told["verdict"] == verdict && says).then_some(())
    };
    until_or(&format!("{name} is {verdict}: {part}"), is_so, || {
        let results = farm.result(name);
        let all: Vec<_> = issues(&results).map(|(_, it)| &it.description).collect();
        format!(
            "{all:#?}\n{:#}\n{}",
            farm.verdict_file(name),
            tail(&farm.log())
        )
    });
}

#[test]
fn scenarios_are_judged_again_when_their_library_changes() {
    let farm = farm();
    let _broker = farm.serve_ready();
    farm.write(LIBRARY, &sample(LIBRARY));
    farm.write(MAIN, &sample(MAIN));
    farm.write("modular/second.xosc", &sample(MAIN));
    for name in [MAIN, "modular/second.xosc"] {
        assert_eq!(farm.verdict(name).verdict, Verdict::Accepted);
    }
    let both = |verdict: &str, part: &str| {
        becomes(&farm, MAIN, verdict, part);
        becomes(&farm, "modular/second.xosc", verdict, part);
    };
    // Only the expanded scenario has this fault: the library's own scenario runs for a minute.
    let faulty = text(LIBRARY).replace(
        "dynamicsDimension=\"time\" value=\"3\"",
        "dynamicsDimension=\"tiem\" value=\"3\"",
    );
    farm.write(LIBRARY, faulty.as_bytes());
    both("rejected", "tiem");
    farm.write(LIBRARY, &sample(LIBRARY));
    both("accepted", "");
    std::fs::remove_file(farm.root().join(LIBRARY)).unwrap();
    both("rejected", "moves.xosc");
    farm.write(LIBRARY, &sample(LIBRARY));
    both("accepted", "");
    let renamed = text(LIBRARY).replace("name=\"brake\" maximum", "name=\"halt\" maximum");
    farm.write(LIBRARY, renamed.as_bytes());
    both("rejected", "has no maneuver group `brake`");
}

#[test]
fn findings_name_the_faulty_file() {
    let farm = farm();
    let _broker = farm.serve_ready();
    let faulty = text(LIBRARY).replace(
        "\"linear\" dynamicsDimension=\"time\"",
        "\"linear\" dynamicsDimension=\"tiem\"",
    );
    farm.write(LIBRARY, faulty.as_bytes());
    farm.write(MAIN, &sample(MAIN));
    farm.verdict(MAIN);
    let results = farm.result(MAIN);
    let of_library = format!("{}:61:", farm.root().join(LIBRARY).display());
    let said: Vec<_> = issues(&results)
        .filter(|(_, it)| it.description.contains("tiem"))
        .flat_map(|(_, it)| {
            it.locations
                .iter()
                .map(|place| place.written().into_owned())
        })
        .collect();
    assert!(said.iter().any(|it| it.contains(&of_library)), "{said:#?}");
    // Both groups use it, so there is one finding with both references.
    let found = issues(&results).filter(|(_, it)| it.description.contains("tiem"));
    let places: Vec<Vec<(u64, u64)>> = found.map(|(_, it)| places(it)).collect();
    assert_eq!(places.len(), 1, "{places:?}");
    assert_eq!(places[0].len(), 2, "{places:?}");

    let cli = Cli::new();
    cli.write("main.xosc", sample(MAIN));
    cli.write("moves.xosc", &faulty);
    cli.qcbus(&["pack", "main.xosc", "moves.xosc", "-o", "x.mosc"]);
    farm.write(
        "modular/x.mosc",
        &std::fs::read(cli.path().join("x.mosc")).unwrap(),
    );
    farm.verdict("modular/x.mosc");
    becomes(&farm, "modular/x.mosc", "rejected", "tiem");
    let results = farm.result("modular/x.mosc");
    let mut said = issues(&results).flat_map(|(_, it)| &it.locations);
    assert!(said.any(|it| it.written().contains("x.mosc!moves.xosc:61:")));
}

fn serve_with(farm: &Farm, search: &Path) -> Broker {
    let mut command = farm.serve_command();
    command.env("SCENARIO_PATH", format!("/nowhere;{}", search.display()));
    Broker::start(&mut command, &farm.log_path())
}

#[test]
fn library_on_the_search_path_counts_outside_the_farm() {
    let farm = farm();
    let library = farm.base().join("library");
    std::fs::create_dir(&library).unwrap();
    std::fs::write(library.join("moves.xosc"), sample(LIBRARY)).unwrap();
    farm.write(MAIN, &sample(MAIN));
    let _broker = serve_with(&farm, &library);
    until_or(
        "the broker answers",
        || farm.status().map(drop),
        || farm.log(),
    );
    assert_eq!(farm.verdict(MAIN).verdict, Verdict::Accepted);
    let renamed = text(LIBRARY).replace("name=\"brake\" maximum", "name=\"halt\" maximum");
    std::fs::write(library.join("moves.xosc"), renamed).unwrap();
    becomes(&farm, MAIN, "rejected", "has no maneuver group `brake`");
    // A library that appears at a nearer place takes precedence.
    farm.write(LIBRARY, &sample(LIBRARY));
    becomes(&farm, MAIN, "accepted", "");
}

#[test]
fn reload_applies_the_configured_search_path() {
    let mut farm = farm();
    let library = farm.base().join("library");
    std::fs::create_dir(&library).unwrap();
    std::fs::write(library.join("moves.xosc"), sample(LIBRARY)).unwrap();
    farm.write(MAIN, &sample(MAIN));
    let config = farm.base().join("config.xml");
    let write = |path: &str| {
        let bundles = "<CheckerBundle application=\"xoscBundle\"/><CheckerBundle application=\"modularBundle\"/>\
                       <CheckerBundle application=\"xodrBundle\"/>";
        let param = format!("<Param name=\"qcbus.scenarioPath\" value=\"{path}\"/>");
        std::fs::write(&config, format!("<Config>{param}{bundles}</Config>")).unwrap();
    };
    write("elsewhere");
    farm.arguments
        .extend(["-c".to_owned(), config.to_string_lossy().into_owned()]);
    let _broker = farm.serve_ready();
    assert_eq!(farm.verdict(MAIN).verdict, Verdict::Rejected);
    write("library");
    let said = farm.qcbus(&["reload"]);
    assert!(said.status.success(), "{said:?}");
    becomes(&farm, MAIN, "accepted", "");
    let log = farm.log();
    assert!(
        !log.contains("scenarioPath"),
        "the parameter must be known: {log}"
    );
}

#[test]
fn scenario_that_cannot_be_expanded_is_never_accepted() {
    let cli = cli();
    let tied = "<ParameterReference key=\"AbsoluteTargetSpeed.value\" value=\"8\"/>";
    let two = format!("{tied}{}", tied.replace("\"8\"", "\"9\""));
    cli.write("modular/tied.xosc", text(MAIN).replace(tied, &two));
    let config = "<Config><CheckerBundle application=\"xoscBundle\">\
                  <Checker checkerId=\"check_asam_xosc_xml_valid_schema\"/></CheckerBundle></Config>";
    cli.write("config.xml", config);
    let said = cli.qcbus(&["check", "-c", "config.xml", "modular/tied.xosc"]);
    let whole = said.whole(&cli);
    assert_eq!(said.code, Some(1), "{whole}");
    assert!(said.stdout.contains("cannot be expanded"), "{whole}");
    assert!(said.stdout.contains("gives it `8` and `9`"), "{whole}");
}

#[test]
fn unreadable_library_is_not_skipped() {
    let cli = cli();
    std::fs::remove_file(cli.path().join(LIBRARY)).unwrap();
    std::fs::create_dir(cli.path().join(LIBRARY)).unwrap();
    cli.write("far/moves.xosc", sample(LIBRARY));
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    let far = cli.path().join("far");
    let said = cli.run(command.args(["check", MAIN]).env("SCENARIO_PATH", &far));
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    std::fs::remove_dir(cli.path().join(LIBRARY)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    let said = cli.run(command.args(["check", MAIN]).env("SCENARIO_PATH", &far));
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
}

#[test]
fn lost_expansion_output_is_not_a_success() {
    let cli = cli();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    let Ok(full) = full else {
        let test = "lost_expansion_output_is_not_a_success";
        return skip(test, "there is no /dev/full");
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    command
        .current_dir(cli.path())
        .args(["expand", MAIN])
        .stdout(full);
    assert_eq!(command.status().unwrap().code(), Some(5));
    let said = cli.qcbus(&["pack", MAIN, "/dev/zero", "-o", "x.mosc"]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    assert!(said.stderr.contains("it is not a file"), "{}", said.stderr);
}
