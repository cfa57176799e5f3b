//! Tests of a report on an existing result file.

use std::path::Path;

use qcbus_formats::xqar::Param;
use qcbus_report_text::REPORTER;
use qcbus_reporter_samples::plain_run;
use qcbus_reporter_sdk::{OnceError, OneShot, report_once};

const RESULT: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<CheckerResults version="1.0.0">
  <CheckerBundle build_date="2026-11-21" description="" name="xodrBundle" summary="" version="1">
    <Param name="InputFile" value="quay.xodr"/>
    <Checker checkerId="check_ids" description="" summary="" status="completed">
      <Issue issueId="0" description="the id is taken" level="1" ruleUID="asam.net:xodr:1.4.0:ids.id_unique_in_class">
        <Locations description="here">
          <FileLocation row="2" column="3"/>
        </Locations>
      </Issue>
      <AddressedRule ruleUID="asam.net:xodr:1.4.0:ids.id_unique_in_class"/>
    </Checker>
  </CheckerBundle>
</CheckerResults>
"#;

fn params(output: &Path) -> Vec<Param> {
    vec![Param {
        name: "OutputFile".into(),
        value: output.to_string_lossy().into_owned(),
    }]
}

/// Writes the file first, then the result, because a newer file would not be shown.
fn scene(dir: &Path) {
    std::fs::write(dir.join("quay.xodr"), "<OpenDRIVE>\n  <road id='5'/>\n").unwrap();
    std::fs::write(dir.join("Result.xqar"), RESULT).unwrap();
}

#[test]
fn report_is_written_from_result_file_alone() {
    let dir = tempfile::tempdir().unwrap();
    scene(dir.path());
    let output = dir.path().join("report.txt");
    let what = OneShot {
        results: vec![dir.path().join("Result.xqar")],
        params: params(&output),
        ..OneShot::default()
    };
    once(&what).unwrap();
    let text = std::fs::read_to_string(output).unwrap();
    let place = dir.path().canonicalize().unwrap().join("quay.xodr");
    let text = text.replace(&*place.to_string_lossy(), "DIR/quay.xodr");
    insta::assert_snapshot!(text);
}

#[test]
fn configuration_gives_result_output_and_line_width() {
    let dir = tempfile::tempdir().unwrap();
    scene(dir.path());
    let at = |name: &str| dir.path().join(name);
    let config = format!(
        r#"<Config>
  <Param name="InputFile" value="quay.xodr"/>
  <ReportModule application="TextReport">
    <Param name="InputFile" value="{}"/>
    <Param name="OutputFile" value="{}"/>
    <Param name="LineWidth" value="narrow"/>
  </ReportModule>
</Config>"#,
        at("Result.xqar").display(),
        at("report.txt").display()
    );
    std::fs::write(at("config.xml"), config).unwrap();
    let mut what = OneShot {
        config: Some(at("config.xml")),
        ..OneShot::default()
    };
    let error = once(&what).unwrap_err();
    assert!(
        error.to_string().contains("LineWidth=\"narrow\""),
        "{error}"
    );
    what.params.push(Param {
        name: "LineWidth".into(),
        value: "80".into(),
    });
    once(&what).unwrap();
    let text = std::fs::read_to_string(at("report.txt")).unwrap();
    assert!(text.contains("rejected"), "{text}");
}

#[test]
fn unusable_input_is_named_in_error() {
    let dir = tempfile::tempdir().unwrap();
    let fails = |what: &OneShot| once(what).unwrap_err().to_string();
    let results = vec![dir.path().join("none.xqar")];
    let missing = fails(&OneShot {
        results,
        ..OneShot::default()
    });
    assert!(missing.contains("none.xqar"), "{missing}");
    std::fs::write(dir.path().join("c.xml"), "<Config><Param").unwrap();
    let config = Some(dir.path().join("c.xml"));
    let broken = fails(&OneShot {
        config,
        ..OneShot::default()
    });
    assert!(broken.contains("c.xml: 1:"), "{broken}");
}

fn once(what: &OneShot) -> Result<(), OnceError> {
    let mut reporter = (REPORTER.make)(&plain_run());
    report_once(reporter.as_mut(), &REPORTER, what)
}
