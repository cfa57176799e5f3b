//! Sample results for tests of reporters, without a real check.

use std::collections::BTreeMap;

use qcbus_formats::pool::BLOCKED;
use qcbus_formats::xqar::{
    Checker, CheckerBundle, Issue, Level, Location, Locations, Metadata, Results, Status,
};
use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};
use qcbus_reporter_sdk::Setting;

/// Returns the setting of a separate run, without colours and pages.
pub fn plain_run() -> Setting {
    Setting {
        color: false,
        keep: false,
        is_run: true,
        pages: |_, _| None,
    }
}

/// Creates an issue at a row and a column of the checked file; 0 means unknown.
pub fn issue(level: Level, uid: &str, text: &str, (row, column): (u64, u64)) -> Issue {
    let place = Location::File {
        row,
        column,
        offset: None,
    };
    Issue {
        id: 0,
        description: text.into(),
        level,
        rule_uid: uid.into(),
        locations: vec![Locations {
            places: vec![place],
            ..Locations::default()
        }],
        domain_info: Vec::new(),
    }
}

/// Creates a checker with this status.
pub fn checker(id: &str, status: Option<Status>, summary: &str, issues: Vec<Issue>) -> Checker {
    Checker {
        id: id.into(),
        summary: summary.into(),
        status,
        issues,
        ..Checker::default()
    }
}

/// Creates a blocked checker.
pub fn blocked(id: &str) -> Checker {
    let by = Metadata {
        key: BLOCKED.into(),
        value: "check_version".into(),
        ..Metadata::default()
    };
    let summary = "Skipped: `check_version` found errors. 0 issues.";
    Checker {
        metadata: vec![by],
        ..checker(id, Some(Status::Skipped), summary, Vec::new())
    }
}

/// Creates the result of the file `/farm/PATH`, with one bundle of these checkers. The verdict
/// follows from them.
pub fn result(path: &str, checkers: Vec<Checker>) -> ResultMessage {
    let results = Results {
        version: "1.0.0".into(),
        bundles: vec![CheckerBundle {
            name: "xodrBundle".into(),
            checkers,
            ..CheckerBundle::default()
        }],
    };
    ResultMessage {
        job: JobId(1),
        input: format!("/farm/{path}"),
        display_path: path.into(),
        xqar: format!("/out/{path}.xqar"),
        verdict: Verdict::of(&results),
        digest: Digest([7; 32]),
        config: Digest::default(),
        document: None,
        results,
        rules: BTreeMap::new(),
        params: Vec::new(),
    }
}
