//! Levels of findings: those of readers by default, those of ASAM on request.

use crate::support::cli::{Cli, issues};
use crate::support::content::Content;
use qcbus_formats::xqar::{Level, Results};

const SCHEMA: &str = "check_asam_xodr_xml_valid_schema";

/// Returns the parameter that selects levels.
fn levels(value: &str) -> String {
    format!("<Param name=\"qcbus.levels\" value=\"{value}\"/>\n")
}

/// Returns a configuration with these parts at its top, in its bundle and in its only checker. The
/// checker is named only if its part is not empty.
fn config(top: &str, bundle: &str, checker: &str) -> String {
    let checker = match checker {
        "" => String::new(),
        params => format!("<Checker checkerId=\"{SCHEMA}\">\n{params}</Checker>\n"),
    };
    format!(
        "<Config>\n{top}<CheckerBundle application=\"xodrBundle\">\n{bundle}{checker}</CheckerBundle>\n</Config>\n"
    )
}

/// Returns a directory with a map that lacks the colour of a road mark. The schema demands it, and
/// readers pass over it.
fn with_map() -> Cli {
    let cli = Cli::new();
    cli.write("map.xodr", Content::colourless_road_mark());
    cli
}

/// Returns the levels of the schema's findings.
fn found(results: &Results) -> Vec<Level> {
    let of_schema = issues(results).filter(|(checker, _)| *checker.id == *SCHEMA);
    of_schema.map(|(_, issue)| issue.level).collect()
}

/// Returns whether a bundle of the result states the levels of ASAM.
fn states_asam(results: &Results) -> bool {
    let mut params = results.bundles.iter().flat_map(|bundle| &bundle.params);
    params.any(|param| param.name == "qcbus.levels" && param.value == "asam")
}

const OF_READERS: (Option<i32>, &[Level]) = (Some(0), &[Level::Warning]);
const OF_ASAM: (Option<i32>, &[Level]) = (Some(1), &[Level::Error]);

#[test]
fn readers_decide_by_default_and_the_standard_with_strict() {
    let cli = with_map();
    let check = |more: &[&str]| {
        let said = cli.qcbus(&[&["check", "map.xodr"], more].concat());
        let results = cli.result("qcbus-out/map.xodr.xqar");
        assert_eq!(
            said.stdout.contains("levels of ASAM"),
            states_asam(&results)
        );
        (said, results)
    };
    let (said, results) = check(&[]);
    let whole = said.whole(&cli);
    assert_eq!((said.code, &*found(&results)), OF_READERS, "{whole}");
    assert!(!states_asam(&results), "{whole}");
    let (said, results) = check(&["--strict"]);
    let whole = said.whole(&cli);
    assert_eq!((said.code, &*found(&results)), OF_ASAM, "{whole}");
    assert!(states_asam(&results), "{whole}");
    assert!(
        said.stdout.contains("note: levels of ASAM: `--strict`\n"),
        "{whole}"
    );
    // Every checker runs, as without `--strict`.
    assert!(results.bundles[0].checkers.len() > 200, "{whole}");
}

#[test]
fn configuration_selects_the_levels() {
    let (readers, asam) = (levels("readers"), levels("asam"));
    let limit = "<Param name=\"qcbus.max_issues\" value=\"9\"/>\n";
    for (config, expected) in [
        (config("", "", ""), OF_ASAM),
        (config("", limit, ""), OF_READERS),
        (config(&asam, "", ""), OF_ASAM),
        (config("", &asam, ""), OF_ASAM),
        (config("", "", &asam), OF_ASAM),
        (config(&readers, "", ""), OF_READERS),
        (config("", &readers, ""), OF_READERS),
        (config("", "", &readers), OF_READERS),
        // The nearest value applies.
        (config(&asam, &readers, ""), OF_READERS),
        (config(&readers, "", &asam), OF_ASAM),
    ] {
        let cli = with_map();
        cli.write("config.xml", &config);
        let said = cli.qcbus(&["check", "-c", "config.xml", "map.xodr"]);
        let results = cli.result("Result.xqar");
        let whole = said.whole(&cli);
        assert_eq!((said.code, &*found(&results)), expected, "{config}{whole}");
        let has_note = said.stdout.contains("note: levels of ASAM: ");
        assert_eq!(
            has_note,
            config.contains("\"asam\"") || expected == OF_ASAM,
            "{whole}"
        );
        let valid = cli.qcbus(&["config", "check", "config.xml"]);
        assert!(valid.stderr.ends_with("config.xml: valid\n"), "{config}");
        // The command line has the last word.
        let strict = cli.qcbus(&["check", "-c", "config.xml", "map.xodr", "--strict"]);
        let results = cli.result("Result.xqar");
        let whole = strict.whole(&cli);
        assert_eq!((strict.code, &*found(&results)), OF_ASAM, "{config}{whole}");
        assert!(states_asam(&results), "{whole}");
    }
}

#[test]
fn configuration_of_asam_is_named_as_the_reason() {
    let cli = with_map();
    cli.write("config.xml", config("", "", ""));
    let said = cli.qcbus(&["check", "-c", "config.xml", "map.xodr"]);
    let whole = said.whole(&cli);
    let reason = "note: levels of ASAM: the configuration has no parameter of qcbus;";
    assert!(said.stdout.contains(reason), "{whole}");
    assert!(states_asam(&cli.result("Result.xqar")), "{whole}");
}

#[test]
fn module_of_asams_framework_has_the_levels_of_asam() {
    for (params, expected) in [("", Level::Error), (&*levels("readers"), Level::Warning)] {
        let cli = with_map();
        let input = "<Param name=\"InputFile\" value=\"map.xodr\"/>\n";
        cli.write("config.xml", config(&format!("{input}{params}"), "", ""));
        let said = cli.qcbus(&["bundle", "run", "xodr", "-c", "config.xml"]);
        let results = cli.result("xodrBundle.xqar");
        assert_eq!(found(&results), [expected], "{}", said.whole(&cli));
        assert_eq!(states_asam(&results), expected == Level::Error);
    }
}

#[test]
fn module_without_its_bundle_in_the_configuration_runs_no_checker() {
    let cli = with_map();
    let input = "<Param name=\"InputFile\" value=\"map.xodr\"/>";
    cli.write("config.xml", format!("<Config>{input}</Config>"));
    let said = cli.qcbus(&["bundle", "run", "xodr", "-c", "config.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let results = cli.result("xodrBundle.xqar");
    assert_eq!(issues(&results).count(), 0, "{results:?}");
}

#[test]
fn invalid_levels_are_reported_with_their_position() {
    let wrong = levels("strict");
    let message = "the parameter `qcbus.levels` is `strict`, but must be `readers` or `asam`";
    for (config, position) in [
        (config(&wrong, "", ""), "config.xml:2:1"),
        (config("", &wrong, ""), "config.xml:3:1"),
        (config("", "", &wrong), "config.xml:4:1"),
    ] {
        let cli = with_map();
        cli.write("config.xml", &config);
        let told = cli.qcbus(&["config", "check", "config.xml"]);
        let whole = told.whole(&cli);
        assert!(
            whole.contains(&format!("{position}: warning: {message}")),
            "{whole}"
        );
        let said = cli.qcbus(&["check", "-c", "config.xml", "map.xodr"]);
        let whole = said.whole(&cli);
        let unwrapped = whole.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(said.code, Some(3), "{whole}");
        assert!(unwrapped.contains(message), "{whole}");
    }
    let cli = Cli::new();
    cli.write("config.xml", config(&levels(""), "", ""));
    let whole = cli.qcbus(&["config", "check", "config.xml"]).whole(&cli);
    assert!(
        whole.contains("`qcbus.levels` is empty, which means `readers`"),
        "{whole}"
    );
}

#[test]
fn page_of_a_rule_names_both_levels() {
    let cli = Cli::new();
    for (rule, level) in [
        (
            "road.object.circular_vs_angular",
            "warning (error with `--strict`)",
        ),
        (SCHEMA, "by case (error with `--strict`)"),
        ("check_asam_xodr_xml_fileheader_is_present", "error"),
    ] {
        let said = cli.qcbus(&["rule", rule]);
        assert!(
            said.stdout.contains(&format!("\n  level {level}, ")),
            "{}",
            said.whole(&cli)
        );
    }
    let said = cli.qcbus(&[
        "rule",
        "road.object.circular_vs_angular",
        "--format",
        "json",
    ]);
    let described: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(described["level"], "error");
    assert_eq!(described["readers"]["level"], "warning");
}
