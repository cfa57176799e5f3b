//! Validates reports against the schema that Jenkins and others use.
//!
//! `QCBUS_JUNIT_XSD` names a copy of `junit-10.xsd`, and `xmllint` validates the reports. If either
//! is missing, the test checks nothing and prints a message.

use std::process::Command;

use crate::common::{blocked, checker, endings, issue, report, result};
use qcbus_formats::xqar::{Level, Param, Status};

#[test]
fn reports_are_valid_against_the_schema() {
    let Some(schema) = std::env::var_os("QCBUS_JUNIT_XSD") else {
        eprintln!("SKIPPED: no schema; QCBUS_JUNIT_XSD should name a junit-10.xsd");
        return;
    };
    if Command::new("xmllint").arg("--version").output().is_err() {
        eprintln!("SKIPPED: no xmllint (Debian: libxml2-utils)");
        return;
    }
    let mut listed = result("listed.xodr", endings());
    listed.params = vec![Param {
        name: "Inapplicable".into(),
        value: "listed".into(),
    }];
    let hostile = vec![issue(Level::Error, "]]>\u{1b}[2K<&\0\u{FFFE}", 3)];
    let reports = [
        report(&[]),
        report(&[result("a.xodr", endings()), listed]),
        report(&[result("b.xodr", vec![blocked("check_lanes")])]),
        report(&[result(
            "<\u{7}\">",
            vec![checker("", Some(Status::Completed), "", hostile)],
        )]),
    ];
    let dir = tempfile::tempdir().unwrap();
    for (number, text) in reports.iter().enumerate() {
        let path = dir.path().join(format!("{number}.junit.xml"));
        std::fs::write(&path, text).unwrap();
        let mut xmllint = Command::new("xmllint");
        xmllint.args(["--noout", "--schema"]).arg(&schema).arg(path);
        let said = xmllint.output().unwrap();
        let why = String::from_utf8_lossy(&said.stderr);
        assert!(said.status.success(), "{why}\n{text}");
    }
}
