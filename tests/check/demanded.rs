//! Demands of a configuration: a demanded checker that could not run gives no answer, and qcbus
//! reports how little was demanded.

use std::path::Path;

use crate::support::cli::{Cli, Said, sample_farm};

fn check_with(cli: &Cli, bundle: &str, checkers: &[&str], file: &Path) -> Said {
    let checkers: String = checkers
        .iter()
        .map(|id| format!("<Checker checkerId=\"{id}\"/>"))
        .collect();
    cli.write(
        "config.xml",
        format!(
            "<Config><CheckerBundle application=\"{bundle}\">{checkers}</CheckerBundle></Config>"
        ),
    );
    let file = file.to_string_lossy();
    cli.qcbus(&["check", "-c", "config.xml", &file])
}

const IDS: &str = "check_asam_xodr_ids_id_unique_in_class";

#[test]
fn preconditions_of_a_requested_checker_always_count() {
    let cli = Cli::new();
    let broken = sample_farm().join("faulty/not_well_formed.xodr");
    let said = check_with(&cli, "xodrBundle", &[IDS], &broken);
    let whole = said.whole(&cli);
    assert_eq!(said.code, Some(1), "{whole}");
    assert!(said.stdout.contains("not_well_formed.xodr:40:5"), "{whole}");
    let results = cli.result("Result.xqar");
    let ids: Vec<&str> = results.bundles[0]
        .checkers
        .iter()
        .map(|checker| &*checker.id)
        .collect();
    assert_eq!(
        ids.first(),
        Some(&IDS),
        "the configured checker comes first"
    );
    assert!(
        ids.contains(&"check_asam_xodr_xml_valid_xml_document"),
        "{ids:?}"
    );
}

#[test]
fn module_reports_failed_preconditions_of_a_checker() {
    let cli = Cli::new();
    let broken = sample_farm().join("faulty/not_well_formed.xodr");
    cli.write(
        "config.xml",
        format!(
            "<Config><Param name=\"InputFile\" value=\"{}\"/><CheckerBundle \
             application=\"xodrBundle\"><Checker checkerId=\"{IDS}\"/></CheckerBundle></Config>",
            broken.display()
        ),
    );
    let said = cli.qcbus(&["bundle", "run", "xodr", "-c", "config.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let results = cli.result("xodrBundle.xqar");
    let found = results.bundles[0]
        .checkers
        .iter()
        .find(|checker| &*checker.id == "check_asam_xodr_xml_valid_xml_document");
    assert_eq!(found.map(|checker| checker.issues.len()), Some(1));
}

#[test]
fn filtered_precondition_prevents_acceptance() {
    let cli = Cli::new();
    let broken = sample_farm().join("faulty/not_well_formed.xodr");
    cli.write(
        "config.xml",
        format!(
            "<Config><CheckerBundle application=\"xodrBundle\"><Checker checkerId=\"{IDS}\"/>\
             <Checker checkerId=\"check_asam_xodr_xml_valid_xml_document\" maxLevel=\"3\" \
             minLevel=\"3\"/></CheckerBundle></Config>"
        ),
    );
    let said = cli.qcbus(&["check", "-c", "config.xml", &broken.to_string_lossy()]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
}

#[test]
fn file_without_an_applicable_checker_is_undetermined() {
    let cli = Cli::new();
    // This checker is for a later version than that of the file.
    let later = "check_asam_xodr_road_lane_layer_lane_group_width_temporary";
    let plain = sample_farm().join("maps/ring.xodr");
    let said = check_with(&cli, "xodrBundle", &[later], &plain);
    let whole = said.whole(&cli);
    assert_eq!(said.code, Some(3), "{whole}");
    assert!(
        said.stdout.contains("does not apply to this file"),
        "{whole}"
    );
    let both = check_with(&cli, "xodrBundle", &[later, IDS], &plain);
    assert_eq!(both.code, Some(0), "{}", both.whole(&cli));
}

#[test]
fn number_of_unrequested_checkers_is_reported() {
    let cli = Cli::new();
    let good = sample_farm().join("maps/ring.xodr");
    let said = check_with(&cli, "xodrBundle", &[IDS], &good);
    let whole = said.whole(&cli);
    assert_eq!(said.code, Some(0), "{whole}");
    let line = said
        .stdout
        .lines()
        .find(|line| line.contains("not requested"));
    let line = line.unwrap_or_else(|| panic!("{whole}")).trim();
    let (_, numbers) = line
        .split_once("not requested, so the verdicts do not cover it: ")
        .unwrap_or_default();
    let words: Vec<&str> = numbers.split(' ').collect();
    let [out, "of", "the", all, "checkers", "of", "xodrBundle"] = words[..] else {
        panic!("{line}")
    };
    let (out, all): (usize, usize) = (out.parse().unwrap(), all.parse().unwrap());
    assert!(out + 1 == all && all > 200, "{line}");

    let plain = cli.qcbus(&["check", &good.to_string_lossy()]);
    assert!(!plain.stdout.contains("not requested"), "{}", plain.stdout);
}
