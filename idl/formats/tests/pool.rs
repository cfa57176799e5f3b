//! Pooling: nothing lost without a word, and always the same bytes.

#![expect(
    clippy::unwrap_used,
    reason = "a test fails by panicking, in its helpers too"
)]

mod common;

use common::{UID, bundle, checker, input, issue, param, xml_place};
use qcbus_formats::config::Config;
use qcbus_formats::pool::{
    BundleOutcome, Counts, NoPlaces, PoolInput, Pooled, Remark, Scope, XPathPlace, is_rule_uid,
    pool,
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

/// What must hold for every pooled result.
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
                assert!(checker.addressed_rules.contains(&issue.rule_uid));
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
fn without_a_configuration_everything_stays_as_given() {
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
    assert_eq!((pooled.removed, pooled.failed), (Counts::default(), vec![]));
}

#[test]
fn a_configuration_orders_filters_relevels_and_misses() {
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
        .failed
        .iter()
        .map(|f| format!("{} {}: {}", f.bundle, f.checker, f.reason))
        .collect();
    insta::assert_snapshot!(failed.join("\n"));
    let params = &pooled.results.bundles[2].params;
    let expected = [
        param("InputFile", "/farm/town.xodr"),
        param("resultFile", "r.xqar"),
        param("tolerance", "2"),
    ];
    assert_eq!(params[..], expected);
    assert_eq!(pooled.results.bundles[2].checkers[2].addressed_rules, [UID]);
}

#[test]
fn a_new_level_counts_before_the_interval() {
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
        "nothing removed, nothing to say"
    );
    let params = &pooled.results.bundles[0].checkers[0].params;
    assert_eq!(params[..], [param("qcbus.level", "warning")]);
}

#[test]
fn a_bundle_by_itself_minds_its_own_business() {
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
    assert_eq!(pooled.failed, []);
}

#[test]
fn checkers_that_break_their_word_are_in_error() {
    let mut silent = checker("silent", vec![issue(Level::Warning, "kept")]);
    silent.status = None;
    silent.reason = "killed by signal 9".into();
    let mut liar = checker("liar", vec![issue(Level::Warning, "kept as well")]);
    liar.status = Some(Status::Skipped);
    let mut odd = checker("odd", vec![issue(Level::Error, "no rule")]);
    odd.issues[0].rule_uid = "my rule".into();
    odd.rule_uids.push("also wrong".into());
    let twice = checker("odd", vec![issue(Level::Error, "second")]);
    let guest = bundle("qcbus", "q", vec![]);
    let mut bundles = vec![bundle("b", "b", vec![silent, liar, odd, twice]), guest];
    bundles.push(bundle("b", "b", vec![]));
    let pooled = pooled(input(bundles));
    insta::assert_snapshot!(outline(&pooled.results));
    assert_eq!(pooled.failed.len(), 2);
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
        issue: text,
    };
    let pooled = pooled(PoolInput {
        config: Some(&config),
        remarks: vec![remark],
        ..input(Vec::new())
    });
    let own = pooled.results.bundles.last().unwrap();
    assert_eq!(
        (own.name.as_str(), own.checkers[0].id.as_str()),
        ("qcbus", "qcbus_limits")
    );
    assert_eq!(pooled.counts.warnings, 1);
}

#[test]
fn every_xpath_gets_its_place_once() {
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
fn the_same_input_gives_the_same_bytes() {
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
