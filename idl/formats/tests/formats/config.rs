//! Tests of configurations: accepted content, reported content, rejected content.

use crate::common::param;
use qcbus_formats::config::{
    Config, Known, KnownBundle, KnownChecker, KnownParam, Levels, Oddity, ParamType, Parsed,
    Selected, Selection, same_bundle, same_reporter,
};
use qcbus_formats::xqar::Level;

const GOOD: &str = r#"<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<Config xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
  <ReportModule application="TextReport">
    <Param name="strReportFile" value="Report.txt"/>
  </ReportModule>
  <CheckerBundle application="xodr">
    <Checker checkerId="lanes" minLevel="2" maxLevel="1"/>
    <Param name="tolerance" value="0.1"/>
    <Checker minLevel="3" maxLevel="1" checkerId="length">
      <Param name="tolerance" value="0.5"/>
      <Param name="qcbus.level" value="Warning"/>
      <Param name="own"/>
    </Checker>
    <Checker checkerId="free"/>
  </CheckerBundle>
  <Param name="XodrFile" value="myTrack.xodr"/>
  <Param name="tolerance" value="1"/>
  <Param name="unit" value="m"/>
  <CheckerBundle application="mine"/>
</Config>
"#;

fn parse(text: &str) -> Parsed {
    Config::parse(text.as_bytes()).unwrap()
}

fn told(oddities: &[Oddity]) -> String {
    let line = |n: &Oddity| format!("{}:{}: {}: {}", n.row, n.column, n.level.as_str(), n.text);
    oddities.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn children_in_any_order_and_missing_levels_are_read() {
    let Parsed { config, oddities } = parse(GOOD);
    assert_eq!(told(&oddities), "");
    assert_eq!(config.input_file(), Some("myTrack.xodr"));
    let bundle = config.bundle("xodrBundle", "xodr").unwrap();
    let ids: Vec<&str> = bundle
        .checkers
        .iter()
        .map(|checker| checker.id.as_str())
        .collect();
    assert_eq!(ids, ["lanes", "length", "free"]);
    assert_eq!(
        bundle.checkers[0].levels,
        Levels::between(Level::Warning, Level::Error)
    );
    assert_eq!(bundle.checkers[2].levels, Levels::ALL);
    assert!(same_reporter(
        &config.reports[0].application,
        "qc-report-text"
    ));
}

#[test]
fn selection_distinguishes_every_case() {
    let config = parse(GOOD).config;
    let levels = Levels::ALL;
    let relevelled = Selected {
        levels,
        relevel: Some(Level::Warning),
    };
    assert_eq!(
        config.selects("xodrBundle", "xodr", "length"),
        Selection::Selected(relevelled)
    );
    assert_eq!(
        config.selects("xodrBundle", "xodr", "x"),
        Selection::CheckerNotConfigured
    );
    assert_eq!(
        config.selects("xoscBundle", "xosc", "x"),
        Selection::BundleNotConfigured
    );
    assert_eq!(config.selects("mine", "m", "x"), Selection::ByDefault);
    assert!(Selection::ByDefault.runs(true) && !Selection::ByDefault.runs(false));
}

#[test]
fn parameters_inherit_from_checker_bundle_global_and_default() {
    let config = parse(GOOD).config;
    let bundle = config.bundle("xodrBundle", "xodr");
    let defaults = [
        param("tolerance", "9"),
        param("unit", "cm"),
        param("count", "3"),
    ];
    let effective = |id: &str| {
        let params = config.effective_params(bundle, id, &defaults);
        params
            .iter()
            .map(|p| format!("{}={}", p.name, p.value))
            .collect::<Vec<_>>()
            .join(" ")
    };
    assert_eq!(
        effective("length"),
        "tolerance=0.5 unit=m count=3 qcbus.level=Warning own="
    );
    assert_eq!(effective("lanes"), "tolerance=0.1 unit=m count=3");
    let global = config.effective_params(None, "lanes", &defaults);
    assert_eq!(global[0], param("tolerance", "1"));
    let shared = config.bundle_params(bundle);
    assert_eq!(shared, [param("tolerance", "0.1"), param("unit", "m")]);
    let report = config.report_params(&config.reports[0]);
    assert_eq!(report[0], param("strReportFile", "Report.txt"));
    assert_eq!(report.len(), 4);
}

#[test]
fn both_orders_of_levels_mean_same_interval() {
    let text = |min, max| {
        format!(
            "<Config><CheckerBundle application='b'><Checker checkerId='c' minLevel='{min}' \
             maxLevel='{max}'/></CheckerBundle></Config>"
        )
    };
    for (min, max, levels) in [
        (1, 3, "123"),
        (3, 1, "123"),
        (1, 2, "12"),
        (2, 1, "12"),
        (2, 2, "2"),
    ] {
        let Parsed { config, oddities } = parse(&text(min, max));
        let kept = config.bundles[0].checkers[0].levels;
        let all = [Level::Error, Level::Warning, Level::Information];
        let numbers = all
            .iter()
            .filter(|l| kept.contains(**l))
            .map(|l| (*l as u8).to_string());
        assert_eq!(numbers.collect::<String>(), levels, "{min} {max}");
        assert_eq!(oddities.len(), usize::from(min < max));
        assert_eq!(config.old_order_oddities(), oddities);
    }
    insta::assert_snapshot!(told(&parse(&text(1, 3)).oddities));
}

#[test]
fn example_of_2023_is_refused_at_stray_quotation_mark() {
    let broken = "<Config>\n  <Param name=\"XodrFile\" value=\"e\"myTrack.xodr\">\n  \
                  <CheckerBundle application=\"DemoCheckerBundle\">\n    <Checker \
                  checkerId=\"exampleChecker\" maxLevel=\"3\" minLevel=\"1\"/>\n  \
                  </CheckerBundle>\n</Config>\n";
    insta::assert_snapshot!(Config::parse(broken.as_bytes()).unwrap_err().to_string());
    let repaired = broken.replace("\"e\"myTrack.xodr\">", "\"myTrack.xodr\"/>");
    let Parsed { config, oddities } = parse(&repaired);
    assert_eq!(config.input_file(), Some("myTrack.xodr"));
    assert_eq!(oddities.len(), 1, "the old order of levels is reported");
}

#[test]
fn configuration_oddities_are_reported_with_position() {
    let text = r#"<Config version="1" >
  stray
  <CheckerBundel application="x"/>
  <CheckerBundle application="xodrBundle" aplication="y">
    <Checker checkerId="a" minlevel="2" maxLevel="error" minLevel="7"/>
    <Checker checkerId="a"/>
    <Checker checkerId="b"><Param name="qcbus.level" value="eror"/><Parm/></Checker>
    <Param name="qcbus.level" value="error"/>
  </CheckerBundle>
  <CheckerBundle application="xodr"><Param name="p" value="1"/>
    <Checker checkerId="a"/><Checker checkerId="c"/>
  </CheckerBundle>
  <Param name="InputFile" value="a"/><Param name="InputFile" value="b"/>
</Config>"#;
    let Parsed { config, oddities } = parse(text);
    insta::assert_snapshot!(told(&oddities));
    let ids: Vec<&str> = config.bundles[0]
        .checkers
        .iter()
        .map(|c| c.id.as_str())
        .collect();
    assert_eq!(ids, ["a", "b", "c"]);
    let bundle = config.bundle("xodrBundle", "xodr");
    assert_eq!(config.effective_params(bundle, "c", &[]), [param("p", "1")]);
    assert_eq!(config.effective_params(bundle, "a", &[]), []);
}

#[test]
fn unusable_configuration_is_refused_with_position_and_hint() {
    let cases = [
        "",
        "just text",
        "<Conf/>",
        "<Config>\n<CheckerBundle/>\n</Config>",
        "<Config><CheckerBundle application=' '/></Config>",
        "<Config><CheckerBundle application='a'><Checker checkerID='c'/></CheckerBundle></Config>",
        "<Config><Param value='1'/></Config>",
        "<Config>\n  <Param name='a' value='1>\n  <Param name='b' value='2'/>\n</Config>",
        "<Config><Param name=a value='1'/></Config>",
        "<Config><Param name/></Config>",
        "<Config><Param name='a' name='b'/></Config>",
        "<Config><Param name='a' value='R&D'/></Config>",
        "<Config>\n <CheckerBundle application='a'>\n</Config>",
        "<Config>\n <Param name='ä' value='1'/></Param></Config>",
        "<Config></Config></Config>",
        "<Config",
        "<Config><!-- open </Config>",
        "<Config>&unknown;</Config>",
        "\u{FEFF}<Config/><?xml version='1.0'?>",
        "<?xml version='1.0' encoding='klingon'?><Config/>",
    ];
    let lines = cases
        .iter()
        .map(|case| match Config::parse(case.as_bytes()) {
            Ok(parsed) => format!("{case:?}\n  accepted: {:?}", parsed.oddities),
            Err(error) => format!("{case:?}\n  {error}"),
        });
    let mut lines: Vec<String> = lines.collect();
    let error = Config::parse(b"<Config>\n <Param name='a' value='\xFC'/></Config>").unwrap_err();
    lines.push(format!("a Latin-1 byte\n  {error}"));
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn application_matches_name_alias_and_published_name() {
    for (application, name, alias, same) in [
        ("xodrBundle", "xodrBundle", "xodr", true),
        ("xodr", "xodrBundle", "xodr", true),
        ("qc_opendrive", "xodrBundle", "xodr", true),
        ("qc-openscenarioxml", "xoscBundle", "xosc", true),
        ("xodrBundle", "xoscBundle", "xosc", false),
        ("mine", "mineBundle", "mine", true),
        ("qc_opendrive", "mine", "m", false),
        ("", "", "", false),
    ] {
        assert_eq!(
            same_bundle(application, name, alias),
            same,
            "{application} {name}"
        );
    }
    for (application, name, same) in [
        ("TextReport", "qc-report-text", true),
        ("qc_report_text", "qc-report-text", true),
        ("text", "qc-report-text", true),
        ("qc-report-json", "qc-report-json", true),
        ("GithubCIReport", "qc-report-github", true),
        ("TextReport", "qc-report-json", false),
        ("mail", "mail", true),
        ("mail", "mailbox", false),
        ("", "qc-report-text", false),
    ] {
        let found = same_reporter(application, name);
        assert_eq!(found, same, "{application} {name}");
    }
}

fn number(name: &str) -> KnownParam {
    KnownParam {
        name: name.into(),
        value: ParamType::Number,
    }
}

/// Checks that an unreadable value is reported at the checker, in the bundle and beside the
/// bundles. A checker cannot check anything if it cannot read its parameter.
#[test]
fn unreadable_value_is_reported_at_every_place() {
    let flag = KnownParam {
        name: "strict".into(),
        value: ParamType::Flag,
    };
    let checker = KnownChecker {
        id: "check_lanes".into(),
        params: vec![number("tolerance"), flag],
    };
    let known = Known {
        bundles: vec![KnownBundle {
            name: "xodrBundle".into(),
            alias: "xodr".into(),
            checkers: Some(vec![checker]),
        }],
        reporters: vec![],
    };
    let told_of = |param: &str, value: &str| -> Vec<u64> {
        let param = format!(r#"<Param name="{param}" value="{value}"/>"#);
        let text = format!(
            "<Config>\n{param}\n<CheckerBundle application='xodr'>\n{param}\n\
             <Checker checkerId='check_lanes'>\n{param}</Checker></CheckerBundle></Config>"
        );
        let oddities = parse(&text).all_oddities(&known);
        for oddity in &oddities {
            assert_eq!(oddity.level, Level::Warning);
            let named = oddity.text.contains(&format!("is `{value}`, but must be"));
            assert!(named, "{oddity:?}");
        }
        oddities.iter().map(|oddity| oddity.row).collect()
    };
    for wrong in ["0,05", "abc", "", "nan", "inf", "1 m"] {
        assert_eq!(told_of("tolerance", wrong), [2, 4, 6], "{wrong}");
    }
    for right in ["0.05", " 5e-2 ", "0", "-1"] {
        assert!(told_of("tolerance", right).is_empty(), "{right}");
    }
    assert_eq!(told_of("strict", "yes"), [2, 4, 6]);
    assert!(told_of("strict", "true").is_empty());
}

#[test]
fn invalid_levels_are_reported_at_every_place() {
    let told_of = |value: &str| {
        let param = format!(r#"<Param name="qcbus.levels" value="{value}"/>"#);
        let text = format!(
            "<Config>\n{param}\n<CheckerBundle application='xodr'>\n{param}\n\
             <Checker checkerId='check_lanes'>\n{param}</Checker></CheckerBundle></Config>"
        );
        let oddities = parse(&text).oddities;
        let rows: Vec<u64> = oddities.iter().map(|oddity| oddity.row).collect();
        (rows, told(&oddities))
    };
    for right in ["asam", "readers", " asam "] {
        assert_eq!(told_of(right).1, "");
    }
    let (rows, text) = told_of("Asam");
    assert_eq!(rows, [2, 4, 6]);
    let message = "is `Asam`, but must be `readers` or `asam`: checkers that read it check nothing";
    assert_eq!(text.matches(message).count(), 3, "{text}");
    let (rows, text) = told_of("");
    assert_eq!(rows, [2, 4, 6]);
    assert!(text.contains("is empty, which means `readers`"), "{text}");
}

#[test]
fn configuration_without_parameters_of_qcbus_has_the_levels_of_asam() {
    let of = |text: &str| parse(text).config;
    assert!(of("<Config><CheckerBundle application='xodr'/></Config>").is_of_asam());
    let other = "<Param name='gap' value='1'/>";
    assert!(
        of(&format!(
            "<Config>{other}<CheckerBundle application='xodr'/></Config>"
        ))
        .is_of_asam()
    );
    // `GOOD` has the parameter `qcbus.level` at a checker.
    assert!(!of(GOOD).is_of_asam());
    assert!(!of(GOOD).selects_levels_of_asam());
    assert!(!of(GOOD).sets_only_levels());
    let strict = of(GOOD).with_levels_of_asam();
    assert!(strict.selects_levels_of_asam() && !strict.sets_only_levels());
    let readers = "<Param name='qcbus.levels' value='readers'/>";
    let everywhere = format!(
        "<Config>{readers}<CheckerBundle application='xodr'>{readers}<Checker checkerId='a'>{readers}\
         </Checker></CheckerBundle></Config>"
    );
    let strict = of(&everywhere).with_levels_of_asam();
    let bundle = &strict.bundles[0];
    assert!(bundle.params.is_empty() && bundle.checkers[0].params.is_empty());
    let defaults = [param("qcbus.levels", "readers")];
    let effective = strict.effective_params(Some(bundle), "a", &defaults);
    assert_eq!(effective, [param("qcbus.levels", "asam")]);
    assert!(Config::default().with_levels_of_asam().sets_only_levels());
    assert!(!Config::default().sets_only_levels());
}

#[test]
fn unknown_names_in_configuration_are_reported() {
    let checker = |id: &str, params: &[&str]| KnownChecker {
        id: id.into(),
        params: params.iter().map(|name| number(name)).collect(),
    };
    let known = Known {
        bundles: vec![
            KnownBundle {
                name: "xodrBundle".into(),
                alias: "xodr".into(),
                checkers: Some(vec![
                    checker("check_lanes", &["tolerance"]),
                    checker("check_ids", &[]),
                ]),
            },
            KnownBundle {
                name: "xoscBundle".into(),
                alias: "xosc".into(),
                checkers: Some(vec![checker("check_actors", &[])]),
            },
        ],
        reporters: ["qc-report-json", "qc-report-text", "mail"]
            .map(str::to_owned)
            .to_vec(),
    };
    let text = r#"<Config>
  <Param name="InputFile" value="a"/><Param name="tolerence" value="1"/>
  <CheckerBundle application="xodr">
    <Param name="resultFile" value="r.xqar"/><Param name="tolerance" value="1"/>
    <Checker checkerId="check_lane"><Param name="x"/></Checker>
    <Checker checkerId="check_actors"/>
    <Checker checkerId="check_lanes"><Param name="Tolerances"/><Param name="qcbus.level" value="1"/></Checker>
  </CheckerBundle>
  <CheckerBundle application="xodrbundel"/>
  <CheckerBundle application="DemoCheckerBundle"/>
  <ReportModule application="TextReprt"/>
  <ReportModule application="GithubCIReport"/>
  <ReportModule application="mail"/>
  <ReportModule application="qc-report-json"/>
</Config>"#;
    let parsed = parse(text);
    assert_eq!(parsed.oddities, []);
    insta::assert_snapshot!(told(&parsed.config.check(&known)));
    let none = parse("<Config><CheckerBundle application='qc_opendrive'/></Config>").config;
    insta::assert_snapshot!(told(&none.check(&Known::default())));
}

#[test]
fn deep_nesting_is_refused_without_overflow() {
    for levels in [200, 100_000] {
        let text = format!("<Config>{}", "<Param name='a'>".repeat(levels));
        assert!(
            Config::parse(text.as_bytes())
                .unwrap_err()
                .text
                .contains("nested deeper")
        );
    }
}

#[test]
fn configuration_round_trips_as_json() {
    let config = parse(GOOD).config;
    let json = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<Config>(&json).unwrap(), config);
}

#[test]
fn two_names_for_same_bundle_are_reported() {
    let known = Known {
        bundles: vec![KnownBundle {
            name: "mineBundle".into(),
            alias: "mine".into(),
            checkers: Some(vec![]),
        }],
        reporters: vec![],
    };
    let text = "<Config><CheckerBundle application='mine'/>\n<CheckerBundle application='mineBundle'/></Config>";
    let oddities = parse(text).config.check(&known);
    assert_eq!(oddities.len(), 1);
    assert!(
        oddities[0].row == 2 && oddities[0].text.contains("the same bundle"),
        "{oddities:?}"
    );
}

#[test]
fn unverifiable_names_of_bundle_are_reported_as_unknown() {
    let checker = KnownChecker {
        id: "check_lanes".into(),
        params: vec![number("tolerance")],
    };
    let bundle = |name: &str, checkers| KnownBundle {
        name: name.into(),
        alias: String::new(),
        checkers,
    };
    let known = Known {
        bundles: vec![bundle("ours", Some(vec![checker])), bundle("mine", None)],
        reporters: vec![],
    };
    let text = r#"<Config>
  <Param name="of_mine" value="1"/><Param name="tolerence" value="1"/>
  <CheckerBundle application="mine"><Checker checkerId="any"/></CheckerBundle>
</Config>"#;
    let oddities = parse(text).all_oddities(&known);
    let found: Vec<_> = oddities.iter().map(|it| (it.row, it.level)).collect();
    assert_eq!(found, [(2, Level::Warning), (3, Level::Information)]);
    assert!(oddities[0].text.contains("tolerence"), "{oddities:?}");
    let line = oddities[1].line(std::path::Path::new("c.xml"));
    assert!(
        line.starts_with("c.xml:3:3: information: the checkers and parameters of `mine`"),
        "{line}"
    );
}
