//! Tests of pooling: every loss is reported, and the bytes are always the same.

use crate::common::{UID, bundle, checker, input, issue, param, xml_place};
use qcbus_formats::Verdict;
use qcbus_formats::config::Config;
use qcbus_formats::pool::{
    Asked, BundleOutcome, Counts, Ending, NoPlaces, NotAsked, PoolInput, Pooled, Remark, Scope,
    XPathPlace, is_rule_uid, pool,
};
use qcbus_formats::xqar::{Dialect, Issue, Level, Location, Results, Status, read, write};

fn config(text: &str) -> Config {
    Config::parse(text.as_bytes()).unwrap().config
}

fn two_bundles() -> Vec<BundleOutcome> {
    let found = vec![
        issue(Level::Error, "one"),
        issue(Level::Warning, "two"),
        issue(Level::Information, "three"),
    ];
    let actors = vec![issue(Level::Error, "four")];
    vec![
        bundle(
            "xodrBundle",
            "xodr",
            vec![checker("lanes", found), checker("ids", Vec::new())],
        ),
        bundle("xoscBundle", "xosc", vec![checker("actors", actors)]),
    ]
}

fn outline(results: &Results) -> String {
    let mut lines = Vec::new();
    for bundle in &results.bundles {
        lines.push(format!("{}: {}", bundle.name, bundle.summary));
        for checker in &bundle.checkers {
            let status = checker.status.map_or("none", Status::as_str);
            lines.push(format!("  {} {status}: {}", checker.id, checker.summary));
            for Issue {
                id,
                level,
                description,
                ..
            } in &checker.issues
            {
                lines.push(format!("    {id} {}: {description}", level.as_str()));
            }
        }
    }
    lines.join("\n")
}

/// Checks the properties of every pooled result.
fn assert_sound(pooled: &Pooled) {
    let mut next = 0;
    let mut counts = Counts::default();
    for bundle in &pooled.results.bundles {
        assert_eq!(bundle.params[0].name, "InputFile");
        for checker in &bundle.checkers {
            assert!(checker.status.is_some());
            assert!(checker.issues.is_empty() || checker.status != Some(Status::Skipped));
            assert!(checker.addressed_rules.iter().all(|uid| is_rule_uid(uid)));
            for issue in &checker.issues {
                assert_eq!(issue.id, next);
                assert!(
                    checker
                        .addressed_rules
                        .iter()
                        .any(|uid| **uid == *issue.rule_uid)
                );
                counts.add(issue.level);
                next += 1;
            }
        }
    }
    assert_eq!(counts, pooled.counts);
    let text = write(&pooled.results, Dialect::Current);
    assert_eq!(read(text.as_bytes()).as_ref(), Ok(&pooled.results));
}

fn pooled(input: PoolInput<'_>) -> Pooled {
    let pooled = pool(input, &mut NoPlaces);
    assert_sound(&pooled);
    pooled
}

#[test]
fn results_without_configuration_stay_unchanged() {
    let pooled = pooled(input(two_bundles()));
    insta::assert_snapshot!(outline(&pooled.results));
    assert_eq!(
        pooled.counts,
        Counts {
            errors: 2,
            warnings: 1,
            information: 1
        }
    );
    assert_eq!(
        (pooled.removed, pooled.unfinished),
        (Counts::default(), vec![])
    );
}

#[test]
fn configuration_orders_filters_relevels_and_adds_missing() {
    let config = config(
        r#"<Config><Param name="tolerance" value="2"/>
        <CheckerBundle application="gone"><Checker checkerId="x"/><Checker checkerId="y"/></CheckerBundle>
        <CheckerBundle application="away"/>
        <CheckerBundle application="xodr"><Param name="resultFile" value="r.xqar"/>
          <Checker checkerId="ids"/>
          <Checker checkerId="lane"/>
          <Checker checkerId="lanes" minLevel="1" maxLevel="2"/>
        </CheckerBundle></Config>"#,
    );
    let mut bundles = two_bundles();
    bundles[0]
        .checkers
        .push(checker("extra", vec![issue(Level::Warning, "five")]));
    let pooled = pooled(PoolInput {
        config: Some(&config),
        ..input(bundles)
    });
    insta::assert_snapshot!(outline(&pooled.results));
    assert_eq!(
        pooled.counts,
        Counts {
            errors: 1,
            warnings: 1,
            information: 4
        }
    );
    assert_eq!(
        pooled.removed,
        Counts {
            errors: 1,
            warnings: 1,
            information: 1
        }
    );
    let failed: Vec<String> = pooled
        .open()
        .map(|f| format!("{} {}: {}", f.bundle, f.checker, f.ending.reason()))
        .collect();
    insta::assert_snapshot!(failed.join("\n"));
    let params = &pooled.results.bundles[2].params;
    let expected = [
        param("InputFile", "/farm/town.xodr"),
        param("resultFile", "r.xqar"),
        param("tolerance", "2"),
    ];
    assert_eq!(params[..], expected);
    assert_eq!(
        pooled.results.bundles[2].checkers[2].addressed_rules[..],
        [UID.into()]
    );
}

#[test]
fn new_level_is_applied_before_level_interval() {
    let config = config(
        r#"<Config><CheckerBundle application="xodrBundle">
        <Checker checkerId="lanes" minLevel="2" maxLevel="2"><Param name="qcbus.level" value="warning"/></Checker>
        </CheckerBundle></Config>"#,
    );
    let mut bundles = two_bundles();
    bundles.pop();
    let pooled = pooled(PoolInput {
        config: Some(&config),
        ..input(bundles)
    });
    assert_eq!(
        pooled.counts,
        Counts {
            errors: 0,
            warnings: 3,
            information: 0
        }
    );
    assert_eq!(
        pooled.results.bundles.len(),
        1,
        "nothing is reported when nothing was removed"
    );
    let params = &pooled.results.bundles[0].checkers[0].params;
    assert_eq!(params[..], [param("qcbus.level", "warning")]);
}

#[test]
fn bundle_pooled_alone_ignores_configuration_of_others() {
    let config = config("<Config><CheckerBundle application='other'/></Config>");
    let mut bundles = two_bundles();
    bundles.pop();
    let alone = PoolInput {
        config: Some(&config),
        scope: Scope::Alone,
        ..input(bundles)
    };
    let pooled = pooled(alone);
    assert_eq!(pooled.results.bundles.len(), 1);
    assert_eq!(pooled.counts.total(), 3);
    assert_eq!(pooled.unfinished, []);
}

#[test]
fn contradictory_checker_results_become_errors() {
    let mut silent = checker("silent", vec![issue(Level::Warning, "kept")]);
    silent.ending = None;
    let mut liar = checker("liar", vec![issue(Level::Warning, "kept as well")]);
    liar.ending = Some(Ending::NotApplicable {
        reason: "OpenDRIVE 1.4".into(),
    });
    let mut odd = checker("odd", vec![issue(Level::Error, "no rule")]);
    odd.issues[0].rule_uid = "my rule".into();
    odd.rule_uids = [UID, "also wrong"].into_iter().collect();
    let twice = checker("odd", vec![issue(Level::Error, "second")]);
    let guest = bundle("qcbus", "q", vec![]);
    let mut bundles = vec![bundle("b", "b", vec![silent, liar, odd, twice]), guest];
    bundles.push(bundle("b", "b", vec![]));
    let pooled = pooled(input(bundles));
    insta::assert_snapshot!(outline(&pooled.results));
    assert_eq!(pooled.open().count(), 2);
    assert_eq!(
        pooled.results.bundles[0].checkers[2].metadata[0].value,
        "also wrong"
    );
}

#[test]
fn remarks_are_never_filtered() {
    let config = config("<Config><CheckerBundle application='none'/></Config>");
    let mut text = issue(Level::Warning, "3 texts were cut");
    text.rule_uid = "qcbus.dev:qcbus:1.0.0:limits.text_length".into();
    let remark = Remark {
        checker: "qcbus_limits".into(),
        description: "Texts keep within their limits.".into(),
        issue: Some(text),
        open: None,
    };
    let pooled = pooled(PoolInput {
        config: Some(&config),
        remarks: vec![remark],
        ..input(Vec::new())
    });
    let own = pooled.results.bundles.last().unwrap();
    assert_eq!(
        (own.name.as_str(), &*own.checkers[0].id),
        ("qcbus", "qcbus_limits")
    );
    assert_eq!(pooled.counts.warnings, 1);
}

#[test]
fn every_xpath_is_resolved_to_position_once() {
    let file = Location::File {
        row: 3,
        column: 4,
        offset: Some(50),
    };
    let given = Location::File {
        row: 9,
        column: 9,
        offset: None,
    };
    let mut bare = issue(Level::Error, "bare");
    bare.locations = vec![xml_place("/a/b"), xml_place("/nowhere"), xml_place("/a/b")];
    let mut placed = issue(Level::Error, "placed");
    placed.locations = vec![xml_place("/a/b")];
    placed.locations[0]
        .places
        .extend([given.clone(), given.clone()]);
    let mut asked = Vec::new();
    let mut resolver = |xpath: &str| {
        asked.push(xpath.to_owned());
        (xpath == "/a/b").then_some(XPathPlace {
            row: 3,
            column: 4,
            offset: Some(50),
        })
    };
    let bundles = vec![bundle("b", "b", vec![checker("c", vec![bare, placed])])];
    let pooled = pool(input(bundles), &mut resolver);
    assert_sound(&pooled);
    let issues = &pooled.results.bundles[0].checkers[0].issues;
    let xml = |xpath: &str| Location::Xml {
        xpath: xpath.into(),
    };
    assert_eq!(issues[0].locations[0].places, [file.clone(), xml("/a/b")]);
    assert_eq!(issues[0].locations[1].places, [xml("/nowhere")]);
    assert_eq!(issues[0].locations[2].places, [file, xml("/a/b")]);
    assert_eq!(issues[1].locations[0].places, [xml("/a/b"), given]);
    assert_eq!(asked, ["/a/b", "/nowhere"]);
}

#[test]
fn same_input_gives_same_bytes() {
    let config = config(
        "<Config><CheckerBundle application='xodr'><Checker checkerId='lanes' minLevel='1' \
         maxLevel='1'/></CheckerBundle></Config>",
    );
    let once = || {
        let input = PoolInput {
            config: Some(&config),
            ..input(two_bundles())
        };
        write(&pooled(input).results, Dialect::Current)
    };
    assert_eq!(once(), once());
}

fn blocked(by: &[&str]) -> Option<Ending> {
    Some(Ending::Blocked {
        by: by.iter().map(|&id| id.into()).collect(),
        reason: format!("`{}` found errors", by.join("`, `")),
    })
}

const ONLY_LANES: &str = "<Config><CheckerBundle application='xodr'><Checker checkerId='lanes'/></CheckerBundle></Config>";

/// Returns a bundle in which `lanes` depends on `ids`, and `ids` depends on `xml`. Nothing depends
/// on `signs`.
fn resting(xml: Vec<Issue>) -> Vec<BundleOutcome> {
    let [mut lanes, mut ids] = ["lanes", "ids"].map(|id| checker(id, Vec::new()));
    lanes.ending = blocked(&["ids"]);
    ids.ending = blocked(&["xml"]);
    let signs = checker("signs", vec![issue(Level::Error, "not asked")]);
    vec![bundle(
        "xodrBundle",
        "xodr",
        vec![checker("xml", xml), ids, lanes, signs],
    )]
}

#[test]
fn findings_of_blocking_checker_are_kept_despite_filter() {
    let config = config(ONLY_LANES);
    let input = PoolInput {
        config: Some(&config),
        ..input(resting(vec![issue(Level::Error, "not well-formed")]))
    };
    let pooled = pooled(input);
    insta::assert_snapshot!(outline(&pooled.results));
    assert_eq!(pooled.verdict(), Verdict::Rejected);
    assert_eq!(
        pooled.removed.errors, 1,
        "only the error of the checker that blocks no other is removed"
    );
}

#[test]
fn blocked_selected_checker_leaves_verdict_undetermined() {
    let config = config(ONLY_LANES);
    let input = PoolInput {
        config: Some(&config),
        ..input(resting(Vec::new()))
    };
    let pooled = pooled(input);
    assert_eq!(pooled.verdict(), Verdict::Undetermined);
    let open: Vec<String> = pooled.open().map(ToString::to_string).collect();
    assert_eq!(
        open,
        [
            "xodrBundle / lanes: `ids` found errors",
            "xodrBundle / ids: `xml` found errors"
        ]
    );
    let text = write(&pooled.results, Dialect::Current);
    let read = read(text.as_bytes()).unwrap();
    assert_eq!(Verdict::of(&read), Verdict::Undetermined, "{text}");
}

#[test]
fn open_remark_leaves_verdict_undetermined() {
    let remark = |open: &str| Remark {
        checker: "qcbus_bundles".into(),
        description: "Somebody checks the file.".into(),
        issue: None,
        open: Some(open.into()),
    };
    let pooled = pooled(PoolInput {
        remarks: vec![remark("nobody came"), remark("nor went")],
        ..input(Vec::new())
    });
    assert_eq!(pooled.verdict(), Verdict::Undetermined);
    assert_eq!(
        pooled.unfinished[0].ending.reason(),
        "nobody came (and 1 more)"
    );
}

#[test]
fn number_of_unasked_checkers_is_in_result() {
    let mut bundles = two_bundles();
    bundles[0].asked = Some(Asked {
        asked: 2,
        offered: 252,
    });
    bundles[1].asked = Some(Asked {
        asked: 1,
        offered: 1,
    });
    let pooled = pooled(input(bundles));
    let said: Vec<String> = NotAsked::of(&pooled.results)
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(said, ["250 of the 252 checkers of xodrBundle"]);
}

#[test]
fn bundle_never_seen_leaves_its_checkers_open() {
    let never = || {
        let mut bundle = bundle("mine", "", Vec::new());
        bundle.absent = Some("mine cannot be started: no such file".into());
        bundle
    };
    let free = pooled(input(vec![never()]));
    assert_eq!(free.verdict(), Verdict::Undetermined);
    let config = config(
        "<Config><CheckerBundle application='mine'><Checker checkerId='a'/></CheckerBundle></Config>",
    );
    let configured = pooled(PoolInput {
        config: Some(&config),
        ..input(vec![never()])
    });
    let open: Vec<String> = configured.open().map(ToString::to_string).collect();
    assert_eq!(open, ["mine / a: mine cannot be started: no such file"]);
}

#[test]
fn rule_uid_with_hyphens_is_written_with_underscores() {
    let uid = "asam.net:xodr:1.9.0:road.geometry.s-value_sum";
    let written = "asam.net:xodr:1.9.0:road.geometry.s_value_sum";
    let mut bundles = two_bundles();
    let checker = &mut bundles[0].checkers[0];
    checker.rule_uids = [uid, written].into_iter().collect();
    checker.issues.truncate(1);
    checker.issues[0].rule_uid = uid.to_owned();
    let text = checker.issues[0].description.clone();
    let pooled = pooled(input(bundles));
    let checker = &pooled.results.bundles[0].checkers[0];
    assert_eq!(
        checker
            .addressed_rules
            .iter()
            .map(|uid| &**uid)
            .collect::<Vec<_>>(),
        [written]
    );
    assert_eq!(checker.issues[0].rule_uid, written);
    assert_eq!(checker.issues[0].description, text);
}
