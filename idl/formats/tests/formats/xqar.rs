//! Tests of result files: the written form, and the accepted forms.

use crate::common::{full, issue};
use qcbus_formats::xqar::{
    Checker, CheckerBundle, Dialect, Level, Location, Locations, Results, Status, read, write,
};

#[test]
fn full_result_is_written_in_current_format() {
    insta::assert_snapshot!(write(&full(), Dialect::Current));
}

#[test]
fn full_result_is_written_in_format_of_2023() {
    insta::assert_snapshot!(write(&full(), Dialect::Qc4Openx));
}

#[test]
fn current_format_reads_back_completely() {
    let mut expected = full();
    // XML cannot contain this character.
    expected.bundles[0].checkers[0].issues[0].domain_info[0].content[0].children[0].text =
        "a < b\u{FFFD}".into();
    assert_eq!(
        read(write(&full(), Dialect::Current).as_bytes()).unwrap(),
        expected
    );
}

#[test]
fn old_format_keeps_rules_and_road_positions() {
    let back = read(write(&full(), Dialect::Qc4Openx).as_bytes()).unwrap();
    let (old, new) = (&back.bundles[0].checkers[0], &full().bundles[0].checkers[0]);
    assert_eq!(old.issues[0].rule_uid, new.issues[0].rule_uid);
    assert_eq!(old.issues[0].description, new.issues[0].description);
    assert_eq!(old.issues[0].locations[1], new.issues[0].locations[1]);
    assert_eq!(old.status, None);
}

/// A file as tools of 2023 wrote it: no status, no rules, no build date, angles, empty attributes.
const OLD: &str = r#"<?xml version="1.0" encoding="UTF-8" standalone="no" ?>
<CheckerResults version="1.0.0">

  <CheckerBundle description="old" name="OldBundle" summary="">
    <Param name="XodrFile" value="a.xodr"/>
    <Checker checkerId="lanes" description="" summary="1 issue">
      <Issue description="gap" issueId="x7" level="1">
        <Locations description="here">
          <FileLocation column="0" fileType="1" row="17"/>
          <FileLocation fileType="xosc" row="3" column=""/>
          <RoadLocation roadId="12" s="0.5" t="-1"/>
          <InertialLocation x="1.500000" y="2" z="0" h="0.1" p="0" r="0"/>
          <Unknown/>
        </Locations>
      </Issue>
      <Issue description="second" level="3"/>
    </Checker>
  </CheckerBundle>
</CheckerResults>
"#;

#[test]
fn result_in_old_format_is_read() {
    let results = read(OLD.as_bytes()).unwrap();
    let bundle = &results.bundles[0];
    assert_eq!(
        (bundle.name.as_str(), bundle.build_date.as_str()),
        ("OldBundle", "")
    );
    let issues = &bundle.checkers[0].issues;
    assert_eq!(
        (issues[0].id, issues[0].level),
        (0, Level::Error),
        "`x7` is not a number, so the rank is the id"
    );
    assert_eq!((issues[1].id, issues[1].level), (1, Level::Information));
    assert_eq!(
        issues[0].locations[0].places,
        [
            Location::File {
                row: 17,
                column: 0,
                offset: None
            },
            Location::File {
                row: 3,
                column: 0,
                offset: None
            },
            Location::Road {
                road_id: "12".into(),
                s: 0.5,
                t: -1.0
            },
            Location::Inertial {
                x: 1.5,
                y: 2.0,
                z: 0.0
            },
        ]
    );
}

#[test]
fn python_attribute_order_and_encodings_are_read() {
    let text = r#"<?xml version='1.0' encoding='ISO-8859-1' standalone='no'?>
<CheckerResults version="0.0.1"><CheckerBundle name="b" version="v1" summary="s"
 description="Stra&#223;e" build_date="2024-01-01"><Checker checkerId="c" description="d"
 status="error" summary=""><AddressedRule ruleUID="a.b:c:1.0:d"/><Issue issueId="4"
 description="Brücke" level="2" ruleUID="a.b:c:1.0:d"><Locations description="">
 <FileLocation offset="99"/></Locations></Issue><Metadata key="k" value="v"
 description="m"/></Checker></CheckerBundle></CheckerResults>"#;
    let bytes: Vec<u8> = text
        .chars()
        .map(|c| u8::try_from(u32::from(c)).unwrap())
        .collect();
    let results = read(&bytes).unwrap();
    let checker = &results.bundles[0].checkers[0];
    assert_eq!(results.bundles[0].description, "Straße");
    assert_eq!(checker.status, Some(Status::Error));
    assert_eq!(
        (checker.issues[0].id, checker.issues[0].description.as_str()),
        (4, "Brücke")
    );
    let offset_only = Location::File {
        row: 0,
        column: 0,
        offset: Some(99),
    };
    assert_eq!(checker.issues[0].locations[0].places, [offset_only]);
    assert_eq!(checker.metadata[0].key, "k");
    let utf16: Vec<u8> = std::iter::once(0xFEFF)
        .chain(text.replace("ISO-8859-1", "UTF-16").encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    assert_eq!(read(&utf16).unwrap(), results);
}

#[test]
fn content_that_readers_refuse_is_never_written() {
    let mut odd = issue(Level::Error, "\u{0}\u{1b}[31m\u{FFFF}\t\r\n");
    odd.locations = vec![Locations::default()];
    odd.rule_uid = "asam.net:xodr:1.0.0:not.listed".into();
    let checker = Checker {
        id: "c".into(),
        issues: vec![odd],
        ..Checker::default()
    };
    let bundle = CheckerBundle {
        checkers: vec![checker],
        ..CheckerBundle::default()
    };
    let text = write(
        &Results {
            bundles: vec![bundle],
            ..Results::default()
        },
        Dialect::Current,
    );
    assert!(text.contains("&#9;&#13;&#10;"), "{text}");
    let back = read(text.as_bytes()).unwrap();
    assert_eq!(back.version, "1.0.0");
    let checker = &back.bundles[0].checkers[0];
    assert_eq!(
        checker.issues[0].description,
        "\u{FFFD}\u{FFFD}[31m\u{FFFD}\t\r\n"
    );
    assert_eq!(
        checker.addressed_rules[..],
        ["asam.net:xodr:1.0.0:not.listed".into()]
    );
    let whole_file = Location::File {
        row: 1,
        column: 1,
        offset: None,
    };
    assert_eq!(checker.issues[0].locations[0].places, [whole_file]);
}

#[test]
fn result_errors_name_position_and_cause() {
    let wrap = |inner: &str| {
        format!(
            "<CheckerResults>\n<CheckerBundle>\n <Checker>{inner}</Checker></CheckerBundle></CheckerResults>"
        )
    };
    let cases = [
        String::new(),
        "<Config/>".into(),
        "<CheckerResults><a></CheckerResults>".into(),
        wrap("<Issue level='4'/>"),
        wrap("<Issue><Locations><FileLocation row='-1'/></Locations></Issue>"),
        wrap("<Issue><Locations><InertialLocation x='1,5' y='0' z='0'/></Locations></Issue>"),
        wrap("<Issue><Locations><XMLLocation/></Locations></Issue>"),
        wrap("<Issue a='&nbsp;'/>"),
        wrap("<Issue description='a < b'/>"),
        "<!DOCTYPE a [<!ENTITY b 'c'>]><CheckerResults/>".into(),
        "<CheckerResults/><CheckerResults/>".into(),
        "<CheckerResults/>tail".into(),
        "<CheckerResults>\u{1}</CheckerResults>".into(),
    ];
    let told: Vec<String> = cases
        .iter()
        .map(|c| read(c.as_bytes()).unwrap_err().to_string())
        .collect();
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn deep_nesting_is_refused_without_overflow() {
    let deep = |levels: usize| {
        let (open, close) = ("<a>".repeat(levels), "</a>".repeat(levels));
        format!(
            "<CheckerResults><CheckerBundle><Checker><Issue><DomainSpecificInfo name=\"d\">{open}\
             {close}</DomainSpecificInfo></Issue></Checker></CheckerBundle></CheckerResults>"
        )
    };
    assert!(read(deep(48).as_bytes()).is_ok());
    for levels in [49, 200, 100_000] {
        let error = read(deep(levels).as_bytes()).unwrap_err();
        assert!(error.text.contains("nested deeper"), "{error}");
    }
    assert!(read("<a>".repeat(1_000_000).as_bytes()).is_err());
}

#[test]
fn refused_deep_tree_does_not_affect_next_decoding() {
    let json = |levels: usize| {
        let open = r#"{"name":"a","attributes":[],"text":"","children":["#.repeat(levels);
        format!("{open}{}", "]}".repeat(levels))
    };
    let decode = |text: &str| serde_json::from_str::<qcbus_formats::xqar::InfoElement>(text);
    for _ in 0..3 {
        assert!(decode(&json(48)).is_ok());
        assert!(
            decode(&json(50))
                .unwrap_err()
                .to_string()
                .contains("nested deeper")
        );
    }
}
