//! Tests references. A scenario is not accepted if its map, or a catalog that it needs, is missing.

use std::fs::File;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::Command;

use crate::support::cli::{Cli, Said, issues, places, sample_farm};
use qcbus_formats::xqar::{Location, Results};

const MAP: &str = "../maps/quay_straight.xodr";
const CATALOGS: &str = "../catalogs";

/// Row and column of the references to the map and to the catalogs.
const AT_MAP: (u64, u64) = (11, 16);
const AT_CATALOGS: (u64, u64) = (7, 18);

/// A scenario, its verdict, and the expected finding for its reference.
struct Case {
    name: &'static str,
    text: String,
    verdict: &'static str,
    said: Option<(&'static str, (u64, u64))>,
}

fn scenario() -> String {
    std::fs::read_to_string(sample_farm().join("scenarios/van_follows.xosc")).unwrap()
}

/// Returns the sample scenario with another path to its map.
fn map(
    name: &'static str,
    path: &str,
    verdict: &'static str,
    said: impl Into<Option<&'static str>>,
) -> Case {
    Case {
        name,
        text: scenario().replace(MAP, path),
        verdict,
        said: said.into().map(|said| (said, AT_MAP)),
    }
}

/// Returns the sample scenario with another path to its catalogs.
fn catalogs(name: &'static str, path: &str, verdict: &'static str, said: &'static str) -> Case {
    Case {
        name,
        text: scenario().replace(CATALOGS, path),
        verdict,
        said: Some((said, AT_CATALOGS)),
    }
}

/// Returns a file that varies the parameters of another scenario.
fn distribution(
    name: &'static str,
    path: &str,
    verdict: &'static str,
    said: impl Into<Option<&'static str>>,
) -> Case {
    let text = format!(
        "<?xml version=\"1.0\"?>\n<OpenSCENARIO>\n<FileHeader revMajor=\"1\" revMinor=\"2\" \
         date=\"2026-03-02T08:00:00\" description=\"d\" author=\"qcbus\"/>\n\
         <ParameterValueDistribution>\n<ScenarioFile filepath=\"{path}\"/>\n<Deterministic/>\n\
         </ParameterValueDistribution>\n</OpenSCENARIO>\n"
    );
    Case {
        name,
        text,
        verdict,
        said: said.into().map(|said| (said, (5, 15))),
    }
}

const NOT_THERE: &str = "does not exist";

fn cases() -> Vec<Case> {
    let unused =
        "<RouteCatalog><Directory path=\"../routes\"/></RouteCatalog>\n  </CatalogLocations>";
    vec![
        map("whole", MAP, "accepted", None),
        map(
            "backslashes",
            "..\\maps\\quay_straight.xodr",
            "accepted",
            None,
        ),
        map(
            "simulators_own",
            "Town05",
            "accepted",
            "a map of the simulator",
        ),
        map("missing", "../maps/gone.xodr", "rejected", NOT_THERE),
        map(
            "missing_spelt",
            "..\\maps\\a%20b.xodr",
            "rejected",
            NOT_THERE,
        ),
        map(
            "missing_absolute",
            "/nowhere/gone.xodr",
            "rejected",
            NOT_THERE,
        ),
        map(
            "missing_url_of_file",
            "file:///nowhere/gone.xodr",
            "rejected",
            NOT_THERE,
        ),
        map(
            "below_a_file",
            "../maps/quay_straight.xodr/a.xodr",
            "rejected",
            NOT_THERE,
        ),
        map(
            "dangling_link",
            "../maps/dangling.xodr",
            "rejected",
            NOT_THERE,
        ),
        map("directory", "../maps", "rejected", "is a directory"),
        map(
            "ends_as_directory",
            "../maps/quay_straight.xodr/",
            "rejected",
            "is a directory",
        ),
        map(
            "through_nothing",
            "../gone/../maps/quay_straight.xodr",
            "rejected",
            NOT_THERE,
        ),
        map(
            "out_of_a_file",
            "../maps/notes.txt/../quay_straight.xodr",
            "rejected",
            NOT_THERE,
        ),
        // Without links, this path would lead to the map.
        map(
            "out_of_a_link",
            "../maps/far/../quay_straight.xodr",
            "rejected",
            NOT_THERE,
        ),
        // The path leads to the map only if the link is followed as the system does it.
        map(
            "through_a_link",
            "../maps/far/../maps/quay_straight.xodr",
            "accepted",
            None,
        ),
        map(
            "broken",
            "../maps/broken.xodr",
            "rejected",
            "broken.xodr:2:",
        ),
        map(
            "lacks_include",
            "../maps/lacks.xodr",
            "rejected",
            "lacks.xodr:2:",
        ),
        map(
            "looping_link",
            "../maps/loop.xodr",
            "undetermined",
            "cannot be read",
        ),
        map(
            "pipe",
            "../maps/pipe.xodr",
            "undetermined",
            "a device, pipe or socket",
        ),
        map(
            "remote",
            "https://maps.example/a.xodr",
            "undetermined",
            "nothing is fetched",
        ),
        map(
            "too_large",
            "../maps/large.xodr",
            "undetermined",
            "is too large",
        ),
        map(
            "parameter",
            "$road/a.xodr",
            "undetermined",
            "the parameter `$road`",
        ),
        map(
            "expression",
            "${1 + 2}.xodr",
            "undetermined",
            "is an expression",
        ),
        map("empty", "", "rejected", "is an empty path"),
        catalogs("no_catalogs", "../nowhere", "rejected", NOT_THERE),
        catalogs(
            "catalogs_file",
            "../maps/notes.txt",
            "undetermined",
            "notes.txt:1:",
        ),
        catalogs(
            "catalog_as_directory",
            "../catalogs/vehicles.xosc/",
            "rejected",
            NOT_THERE,
        ),
        catalogs("broken_catalog", "../half", "undetermined", "half.xosc:1:"),
        catalogs(
            "many_catalogs",
            "../many",
            "undetermined",
            "more than 48 documents",
        ),
        Case {
            name: "unused_catalogs",
            text: scenario().replace("</CatalogLocations>", unused),
            verdict: "accepted",
            said: Some((NOT_THERE, (9, 28))),
        },
        distribution("varied", "whole.xosc", "accepted", None),
        distribution("varied_missing", "gone.xosc", "rejected", NOT_THERE),
    ]
}

/// Creates all files that the cases refer to.
fn cli() -> Cli {
    let cli = Cli::new();
    let farm = |name: &str| std::fs::read(sample_farm().join(name)).unwrap();
    cli.write("maps/quay_straight.xodr", farm("maps/quay_straight.xodr"));
    cli.write("catalogs/vehicles.xosc", farm("catalogs/vehicles.xosc"));
    cli.write("half/half.xosc", "<OpenSCENARIO><Catalog");
    cli.write("maps/notes.txt", "not a catalog");
    cli.write("maps/broken.xodr", "<OpenDRIVE>\n<road></OpenDRIVE>");
    cli.write(
        "maps/lacks.xodr",
        "<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/>\n<include file=\"gone.xml\"/></OpenDRIVE>",
    );
    for number in 0..60 {
        let name = format!("many/{number}.xosc");
        cli.write(&name, farm("catalogs/vehicles.xosc"));
    }
    let at = |name: &str| cli.path().join("maps").join(name);
    symlink("gone.xodr", at("dangling.xodr")).unwrap();
    symlink("../half", at("far")).unwrap();
    symlink("loop.xodr", at("loop.xodr")).unwrap();
    let made = Command::new("mkfifo").arg(at("pipe.xodr")).status();
    assert!(made.unwrap().success());
    // The file is sparse, because its content is never read.
    let large = File::create(at("large.xodr")).unwrap();
    large.set_len((1 << 30) + 1).unwrap();
    cli
}

/// Returns the descriptions of qcbus's own findings about references, with their places.
fn remarks(results: &Results) -> Vec<(String, (u64, u64))> {
    let own = results.bundles.iter().filter(|it| it.name == "qcbus");
    let checkers = own.flat_map(|bundle| &bundle.checkers);
    let of_references = checkers.filter(|checker| &*checker.id == "qcbus_references");
    let issues = of_references.flat_map(|checker| &checker.issues);
    let place = |places: &[Location]| match places.first() {
        Some(Location::File { row, column, .. }) => (*row, *column),
        other => panic!("{other:?}"),
    };
    issues
        .map(|it| (it.description.clone(), place(&it.locations[0].places)))
        .collect()
}

fn assert_said(case: &Case, results: &Results, whole: &str) {
    let remarks = remarks(results);
    let Some((said, at)) = case.said else {
        assert!(remarks.is_empty(), "{}: {remarks:?}", case.name);
        return;
    };
    let hit = remarks
        .iter()
        .any(|(text, place)| text.contains(said) && *place == at);
    assert!(
        hit,
        "{}: expected {said} at {at:?}, found {remarks:?}\n{whole}",
        case.name
    );
}

#[test]
fn references_of_a_scenario_affect_its_verdict() {
    let cli = cli();
    let cases = cases();
    for case in &cases {
        cli.write(&format!("scenarios/{}.xosc", case.name), &case.text);
    }
    let said = cli.qcbus(&["check", "scenarios", "-v", "--out", "out"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    for case in &cases {
        let name = format!("scenarios/{}.xosc", case.name);
        let line = format!("{}: {name}: ", case.verdict);
        assert!(said.stdout.contains(&line), "{line}\n{}", said.whole(&cli));
        let results = cli.result(&format!("out/{name}.xqar"));
        assert_said(case, &results, &said.whole(&cli));
    }
}

fn code_of(verdict: &str) -> Option<i32> {
    Some(match verdict {
        "accepted" => 0,
        "rejected" => 1,
        _ => 3,
    })
}

#[test]
fn bundle_without_a_broker_gives_the_same_verdicts() {
    let cli = cli();
    // A broker holds few documents at a time on the bus. A bundle without a broker holds all in
    // memory.
    for case in cases().iter().filter(|case| case.name != "many_catalogs") {
        let name = format!("scenarios/{}.xosc", case.name);
        cli.write("scenarios/whole.xosc", scenario());
        cli.write(&name, &case.text);
        let said = cli.qcbus(&["bundle", "run", "xosc", &name]);
        let whole = said.whole(&cli);
        assert_eq!(said.code, code_of(case.verdict), "{}: {whole}", case.name);
        let text = case.said.map_or("", |(text, _)| text);
        assert!(said.stdout.contains(text), "{}: {whole}", case.name);
    }
}

#[test]
fn framework_module_gives_the_same_remarks() {
    let cli = cli();
    let input = cli.write(
        "scenarios/missing.xosc",
        scenario().replace(MAP, "gone.xodr"),
    );
    cli.write(
        "config.xml",
        format!(
            "<Config><Param name=\"InputFile\" value=\"{}\"/>\
             <CheckerBundle application=\"xoscBundle\"/></Config>",
            input.display()
        ),
    );
    let said = cli.qcbus(&["bundle", "run", "xosc", "-c", "config.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let remarks = remarks(&cli.result("xoscBundle.xqar"));
    assert_eq!(remarks.len(), 1, "{remarks:?}");
}

#[test]
fn unreadable_map_prevents_acceptance() {
    let cli = cli();
    let locked = cli.path().join("maps/quay_straight.xodr");
    std::fs::set_permissions(&locked, PermissionsExt::from_mode(0o000)).unwrap();
    if File::open(&locked).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    cli.write("scenarios/locked.xosc", scenario());
    let said = cli.qcbus(&["check", "scenarios"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
}

/// Returns a readable map that is rejected because of an unknown attribute.
fn rejected_map() -> String {
    let farm = std::fs::read_to_string(sample_farm().join("maps/quay_straight.xodr")).unwrap();
    farm.replacen("<geometry ", "<geometry paved=\"yes\" ", 1)
}

/// Checks a scenario before its map, the map, and a scenario after it.
fn checked(cli: &Cli, out: &str, more: &[&str]) -> Said {
    let files = ["a/on_it.xosc", "maps/quay_straight.xodr", "z/on_it.xosc"];
    let mut arguments = vec!["check", "-v", "--out", out];
    arguments.extend(files.iter().chain(more));
    cli.qcbus(&arguments)
}

#[test]
fn scenario_is_rejected_until_its_map_is_fixed() {
    let cli = cli();
    let good = std::fs::read(cli.path().join("maps/quay_straight.xodr")).unwrap();
    cli.write("maps/quay_straight.xodr", rejected_map());
    cli.write("a/on_it.xosc", scenario());
    cli.write("z/on_it.xosc", scenario());
    let said = checked(&cli, "out", &[]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    for name in ["a", "z"] {
        let line = format!("rejected: {name}/on_it.xosc: ");
        assert!(said.stdout.contains(&line), "{line}\n{}", said.whole(&cli));
        let results = cli.result(&format!("out/{name}/on_it.xosc.xqar"));
        let (text, place) = one_about_the_map(&results);
        assert!(
            text.contains("maps/quay_straight.xodr is rejected: it has 1 error"),
            "{text}"
        );
        assert_eq!(place, [AT_MAP]);
    }
    // With own verdicts, the map is rejected, and the scenarios only mention it.
    let said = checked(&cli, "own", &["--own-verdict"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    for name in ["a", "z"] {
        let line = format!("accepted: {name}/on_it.xosc: ");
        assert!(said.stdout.contains(&line), "{line}\n{}", said.whole(&cli));
        one_about_the_map(&cli.result(&format!("own/{name}/on_it.xosc.xqar")));
    }
    // The map also counts when the scenario is checked alone.
    let said = cli.qcbus(&["check", "a/on_it.xosc", "--out", "alone"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    cli.write("maps/quay_straight.xodr", good);
    let said = checked(&cli, "out", &[]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
}

/// Returns the text and the places of the one issue about a file that the checked one rests on.
fn one_about_the_map(results: &Results) -> (String, Vec<(u64, u64)>) {
    let all = issues(results).filter(|(checker, _)| &*checker.id == "qcbus_rests_on");
    let all: Vec<_> = all.collect();
    let [(_, issue)] = &*all else {
        panic!("expected one issue, found {all:?}");
    };
    (issue.description.clone(), places(issue))
}

#[test]
fn only_used_catalogs_affect_the_verdict() {
    let cli = cli();
    let catalog = std::fs::read_to_string(cli.path().join("catalogs/vehicles.xosc")).unwrap();
    let broken = catalog.replacen("<Vehicle ", "<Vehicle paved=\"yes\" ", 1);
    cli.write("scenarios/on_it.xosc", scenario());
    // A rejected scenario and another rejected catalog in the catalog directory must not count.
    let scenario_with_fault = scenario().replacen("<Vehicle ", "<Vehicle paved=\"yes\" ", 1);
    cli.write("catalogs/beside.xosc", scenario_with_fault);
    cli.write(
        "catalogs/unused.xosc",
        broken.replace("harbour_vehicles", "others"),
    );
    let said = cli.qcbus(&["check", "-v", "."]);
    let line = "accepted: scenarios/on_it.xosc: ";
    assert!(said.stdout.contains(line), "{}", said.whole(&cli));
    cli.write("catalogs/vehicles.xosc", broken);
    let said = cli.qcbus(&["check", "-v", "."]);
    let line = "rejected: scenarios/on_it.xosc: ";
    assert!(said.stdout.contains(line), "{}", said.whole(&cli));
}

/// The map with a surface grid on its road.
fn map_with_grid(path: &str) -> String {
    let map = std::fs::read_to_string(sample_farm().join("maps/quay_straight.xodr")).unwrap();
    let surface = format!(
        "</lanes>\n<surface>\n<CRG file=\"{path}\" sStart=\"0\" sEnd=\"120\" orientation=\"same\" mode=\"attached\" \
         sOffset=\"0\" tOffset=\"0\" zOffset=\"0\" zScale=\"1\"/>\n</surface>"
    );
    map.replace("</lanes>", &surface)
}

#[test]
fn map_without_its_surface_grid_is_rejected() {
    let cli = cli();
    cli.write("maps/grids/quay.crg", "$CRG 1.0\n");
    let cases = [
        ("grids/quay.crg", 0, ""),
        (
            "grids/pier.crg",
            1,
            "the file `grids/pier.crg` does not exist",
        ),
        ("grids", 1, "the file `grids` is a directory, not a file"),
    ];
    for (path, code, said) in cases {
        cli.write("maps/quay.xodr", map_with_grid(path));
        let out = cli.qcbus(&["check", "maps/quay.xodr", "--out", "out"]);
        assert_eq!(out.code, Some(code), "{path}: {}", out.whole(&cli));
        let results = cli.result("out/maps/quay.xodr.xqar");
        let remarks = remarks(&results);
        let found = remarks.iter().find(|(text, _)| text.starts_with(said));
        match said {
            "" => assert_eq!(remarks, []),
            _ => assert_eq!(found.map(|(_, place)| *place), Some((34, 6)), "{remarks:?}"),
        }
    }
}
