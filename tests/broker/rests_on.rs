//! Tests that a check of a single scenario also reports faults of the files that it rests on.
//! Accepted means that the scenario can be run.

use std::os::unix::fs::symlink;
use std::path::Path;

use crate::support::broker::Broker;
use crate::support::cli::{Cli, Said, files_below, issues};
use crate::support::content::{CATALOG, Content, Mark};
use crate::support::farm::Farm;
use crate::support::watchdog::until_or;
use qcbus_formats::xqar::Level;
use qcbus_messages::Verdict;

const SCENARIO: &str = "scenarios/a.xosc";
const MAP: &str = "maps/m.xodr";

/// Writes a scenario in one directory, and its map in another.
fn place(map: &Content) -> Cli {
    let cli = Cli::new();
    let scenario = Content::Scenario(1, format!("../{MAP}"));
    cli.write(SCENARIO, scenario.bytes());
    cli.write(
        &format!("scenarios/{CATALOG}"),
        Content::Catalog(1, Mark::Clean).bytes(),
    );
    cli.write(MAP, map.bytes());
    cli
}

fn check(cli: &Cli, more: &[&str]) -> Said {
    cli.qcbus(&[&["check", SCENARIO][..], more].concat())
}

/// Checks whether a checker with this name suffix has found an issue in a file.
fn is_found(cli: &Cli, file: &str, checker: &str) -> bool {
    let results = cli.result(&format!("qcbus-out/{file}.xqar"));
    issues(&results).any(|(it, _)| it.id.ends_with(checker))
}

#[test]
fn single_scenario_is_rejected_until_its_map_is_fixed() {
    let cli = place(&Content::NoHeader(1));
    let said = check(&cli, &[]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    for words in [
        "maps/m.xodr",
        "fileheader_is_present",
        "in 2 of 2 files; 2 rejected",
    ] {
        assert!(said.stdout.contains(words), "{words}: {}", said.whole(&cli));
    }
    assert!(is_found(&cli, SCENARIO, "qcbus_rests_on"));
    assert!(is_found(&cli, MAP, "fileheader_is_present"));

    let said = check(&cli, &["--own-verdict"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(!is_found(&cli, SCENARIO, "qcbus_rests_on"));

    cli.write(MAP, Content::Good(1).bytes());
    let said = check(&cli, &[]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let whole = "of 1 file; 1 accepted";
    assert!(said.stdout.contains(whole), "{}", said.whole(&cli));
}

/// A broker that watches only scenarios must report unchecked files.
#[test]
fn broker_reports_a_map_it_does_not_watch() {
    let farm = Farm::new();
    let scenario = Content::Scenario(1, "../elsewhere.xodr".to_owned());
    let map = farm.base().join("elsewhere.xodr");
    std::fs::write(&map, Content::Good(1).bytes()).unwrap();
    std::fs::create_dir(farm.root().join("catalogs")).unwrap();
    farm.write(CATALOG, &Content::Catalog(1, Mark::Clean).bytes());
    farm.write("a.xosc", &scenario.bytes());
    let mut broker = farm.serve_ready();
    assert_eq!(farm.verdict("a.xosc").verdict, Verdict::Accepted);
    let results = farm.result("a.xosc");
    let said = issues(&results).filter(|(it, _)| it.id.ends_with("qcbus_rests_on"));
    let said: Vec<_> = said.map(|(_, it)| (it.level, &*it.description)).collect();
    let [(Level::Warning, told)] = said[..] else {
        panic!("{said:?}");
    };
    let names_it = told.contains(map.to_str().unwrap());
    assert!(names_it && told.contains("is not watched"), "{told}");
    farm.qcbus(&["down"]);
    broker.wait();
}

/// Starts a broker that is not helped by rescans, with a scenario, its map and its catalog.
fn served() -> (Farm, Broker) {
    let farm = Farm::with(&["--rescan", "1h"]);
    for directory in ["catalogs", "maps"] {
        std::fs::create_dir(farm.root().join(directory)).unwrap();
    }
    farm.write(CATALOG, &Content::Catalog(1, Mark::Clean).bytes());
    farm.write(MAP, &Content::Good(1).bytes());
    farm.write("a.xosc", &Content::Scenario(1, MAP.to_owned()).bytes());
    let broker = farm.serve_ready();
    assert_eq!(farm.verdict("a.xosc").verdict, Verdict::Accepted);
    (farm, broker)
}

#[test]
fn map_in_a_linked_directory_is_reported_as_unwatched() {
    let (farm, _broker) = served();
    let elsewhere = farm.base().join("elsewhere");
    std::fs::rename(farm.root().join("maps"), &elsewhere).unwrap();
    symlink(&elsewhere, farm.root().join("maps")).unwrap();
    let told = || {
        farm.verdict("a.xosc");
        let results = farm.result("a.xosc");
        let mut said = issues(&results).filter(|(it, _)| it.id.ends_with("qcbus_rests_on"));
        said.any(|(_, it)| it.description.contains("is not watched"))
    };
    until_or("the map is named", || told().then_some(()), || farm.log());
    let named = farm.status().unwrap().unseen;
    assert!(
        named.iter().any(|it| it.path.ends_with("maps")),
        "{named:?}"
    );
}

/// The same path now leads to another map, and the verdict on that map counts.
#[test]
fn changed_link_leads_to_another_map() {
    let (farm, _broker) = served();
    let root = farm.root();
    for directory in ["first/deep", "second/deep"] {
        std::fs::create_dir_all(root.join(directory)).unwrap();
    }
    farm.write("first/m.xodr", &Content::Good(1).bytes());
    farm.write("second/m.xodr", &Content::NoHeader(1).bytes());
    symlink("first/deep", root.join("link")).unwrap();
    let scenario = Content::Scenario(1, "link/../m.xodr".to_owned());
    farm.write("b.xosc", &scenario.bytes());
    assert_eq!(farm.verdict("b.xosc").verdict, Verdict::Accepted);

    symlink("second/deep", root.join("other")).unwrap();
    std::fs::rename(root.join("other"), root.join("link")).unwrap();
    assert_eq!(farm.verdict("b.xosc").verdict, Verdict::Rejected);
    let results = farm.result("b.xosc");
    let mut said = issues(&results).filter(|(it, _)| it.id.ends_with("qcbus_rests_on"));
    assert!(said.any(|(_, it)| it.description.contains("second/m.xodr")));
}

/// A write to a file under an unwatched name causes no event.
#[test]
fn map_changed_under_another_name_is_judged_on_wait() {
    let (farm, _broker) = served();
    let other_name = farm.base().join("other name");
    std::fs::hard_link(farm.root().join(MAP), &other_name).unwrap();
    std::fs::write(&other_name, Content::NoHeader(1).bytes()).unwrap();
    assert_eq!(farm.verdict("a.xosc").verdict, Verdict::Rejected);
    assert_eq!(farm.verdict_file(MAP)["verdict"], "rejected");
}

#[test]
fn waiting_in_a_missing_directory_returns_no_result() {
    let (farm, _broker) = served();
    let aside = farm.base().join("aside");
    std::fs::rename(farm.root(), &aside).unwrap();
    for file in ["a.xosc", MAP] {
        let file = farm.root().join(file);
        let waited = farm.wait_in_vain(&file, &[], "the watched directory");
        let said = String::from_utf8(waited.stderr).unwrap();
        assert!(said.contains("is gone"), "{said}");
    }
    for result in [
        "a.xosc.xqar",
        "maps/m.xodr.xqar",
        "catalogs/vehicles.xosc.xqar",
    ] {
        assert!(farm.out().join(result).exists(), "{result}: {}", farm.log());
    }
    std::fs::rename(&aside, farm.root()).unwrap();
    assert_eq!(farm.verdict("a.xosc").verdict, Verdict::Accepted);
}

#[test]
fn scenarios_are_checked_with_maps_elsewhere() {
    let cli = place(&Content::NoHeader(1));
    let said = cli.qcbus(&["check", "scenarios"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    assert!(is_found(&cli, MAP, "fileheader_is_present"));
}

#[test]
fn unnamed_catalog_affects_the_verdict() {
    let cli = place(&Content::Good(1));
    let catalog = Content::Catalog(1, Mark::Clean).bytes();
    let catalog = String::from_utf8(catalog).unwrap();
    let broken = catalog.replacen("maxSpeed=\"", "maxSpeed=\"-", 1);
    assert_ne!(broken, catalog);
    cli.write(&format!("scenarios/{CATALOG}"), broken);
    let said = check(&cli, &[]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    assert!(is_found(&cli, SCENARIO, "qcbus_rests_on"));
}

#[test]
fn excluded_map_does_not_affect_the_verdict() {
    let cli = place(&Content::NoHeader(1));
    cli.write(".qcignore", "maps/\n");
    let said = check(&cli, &[]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let results = files_below(&cli.path().join("qcbus-out"));
    let of_map = |it: &&std::path::PathBuf| it.starts_with("maps");
    assert_eq!(results.iter().find(of_map), None);
}

#[test]
fn single_result_of_a_configuration_covers_its_input() {
    let cli = place(&Content::NoHeader(1));
    let config = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Config>\n\
         <Param name=\"InputFile\" value=\"{SCENARIO}\"/>\n\
         <CheckerBundle application=\"xoscBundle\"/>\n\
         <CheckerBundle application=\"xodrBundle\"/>\n</Config>\n"
    );
    cli.write("config.xml", config);
    let said = cli.qcbus(&["check", "-c", "config.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let results = cli.result("Result.xqar");
    let inputs = results.bundles.iter().flat_map(|it| &it.params);
    let named = inputs.filter(|it| it.name == "InputFile");
    let named: Vec<&str> = named.map(|it| it.value.as_str()).collect();
    let is_scenario = |it: &&str| Path::new(it).ends_with(SCENARIO);
    assert!(
        !named.is_empty() && named.iter().all(is_scenario),
        "{named:?}"
    );
}

/// The broker and the bundles hold few documents at a time, and one scenario may need all of them.
#[test]
fn scenario_with_many_catalogs_does_not_block_them() {
    let cli = place(&Content::Good(1));
    for number in 2..70 {
        let catalog = Content::Catalog(number, Mark::Clean).bytes();
        cli.write(&format!("scenarios/catalogs/z{number}.xosc"), catalog);
    }
    let said = cli.qcbus(&["check", "scenarios"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
    let whole = "70 files; 69 accepted, 1 undetermined";
    assert!(said.stdout.contains(whole), "{}", said.whole(&cli));
}
