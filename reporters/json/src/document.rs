//! The JSON document around the issues.

use std::collections::{BTreeMap, BTreeSet};

use qcbus_formats::Text;
use qcbus_formats::xqar::{Checker, CheckerBundle, Level, Metadata, Param, Status};
use qcbus_messages::{Digest, ResultMessage};
use serde::Serialize;

use crate::SCHEMA;
use crate::issue::{IssueJson, issue};
use crate::ordered::Ordered;

/// The document of one result.
#[derive(Serialize)]
pub(crate) struct Document<'r> {
    version: &'r str,
    qcbus: Own<'r>,
    bundles: Ordered<BundleJson<'r>>,
    rules: Rules<'r>,
}

/// Data that ASAM's report lacks.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Own<'r> {
    schema: u32,
    verdict: &'static str,
    input_file: &'r str,
    display_path: &'r str,
    result_file: &'r str,
    #[serde(skip_serializing_if = "Option::is_none")]
    sha256: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    config_sha256: Option<String>,
    issues: Levels<usize>,
    checkers: Statuses,
    rules: &'r BTreeMap<String, String>,
}

#[derive(Serialize)]
struct Levels<T> {
    error: T,
    warning: T,
    information: T,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Statuses {
    completed: usize,
    skipped: usize,
    error: usize,
    no_status: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct BundleJson<'r> {
    name: &'r str,
    version: &'r str,
    build_date: &'r str,
    summary: &'r str,
    description: &'r str,
    parameters: Ordered<&'r Param>,
    checkers: Ordered<CheckerJson<'r>>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct CheckerJson<'r> {
    checker_id: &'r str,
    description: &'r str,
    summary: &'r str,
    status: Option<Status>,
    parameters: Ordered<&'r Param>,
    metadata: Ordered<&'r Metadata>,
    addressed_rule: &'r [Text],
    issues: Vec<IssueJson<'r>>,
}

#[derive(Serialize)]
struct Rules<'r> {
    addressed: BTreeSet<&'r str>,
    violated: Levels<BTreeSet<&'r str>>,
}

/// Returns the document of a result.
pub(crate) fn document(result: &ResultMessage) -> Document<'_> {
    let bundles = result.results.bundles.iter();
    Document {
        version: &result.results.version,
        qcbus: own(result),
        bundles: bundles
            .map(|each| (each.name.clone(), bundle(each, result)))
            .collect(),
        rules: rules(result),
    }
}

fn own(result: &ResultMessage) -> Own<'_> {
    let status = |status| checkers(result).filter(|c| c.status == status).count();
    Own {
        schema: SCHEMA,
        verdict: result.verdict.as_str(),
        input_file: &result.input,
        display_path: &result.display_path,
        result_file: &result.xqar,
        sha256: known(result.digest),
        config_sha256: known(result.config),
        issues: levels(|level| {
            let issues = checkers(result).flat_map(|checker| &checker.issues);
            issues.filter(|issue| issue.level == level).count()
        }),
        checkers: Statuses {
            completed: status(Some(Status::Completed)),
            skipped: status(Some(Status::Skipped)),
            error: status(Some(Status::Error)),
            no_status: status(None),
        },
        rules: &result.rules,
    }
}

fn known(digest: Digest) -> Option<String> {
    (digest != Digest::default()).then(|| digest.to_string())
}

fn checkers(result: &ResultMessage) -> impl Iterator<Item = &Checker> {
    qcbus_reporter_sdk::checkers(result).map(|(_, checker)| checker)
}

fn levels<T>(of: impl Fn(Level) -> T) -> Levels<T> {
    Levels {
        error: of(Level::Error),
        warning: of(Level::Warning),
        information: of(Level::Information),
    }
}

fn bundle<'r>(bundle: &'r CheckerBundle, result: &'r ResultMessage) -> BundleJson<'r> {
    let checkers = bundle.checkers.iter();
    BundleJson {
        name: &bundle.name,
        version: &bundle.version,
        build_date: &bundle.build_date,
        summary: &bundle.summary,
        description: &bundle.description,
        parameters: params(&bundle.params),
        checkers: checkers
            .map(|each| (each.id.to_string(), checker(each, result)))
            .collect(),
    }
}

fn checker<'r>(checker: &'r Checker, result: &'r ResultMessage) -> CheckerJson<'r> {
    let metadata = checker.metadata.iter();
    let issues = checker.issues.iter();
    CheckerJson {
        checker_id: &checker.id,
        description: &checker.description,
        summary: &checker.summary,
        status: checker.status,
        parameters: params(&checker.params),
        metadata: metadata.map(|fact| (fact.key.clone(), fact)).collect(),
        addressed_rule: &checker.addressed_rules,
        issues: issues.map(|each| issue(each, &result.input)).collect(),
    }
}

fn params(params: &[Param]) -> Ordered<&Param> {
    let pairs = params.iter().map(|param| (param.name.clone(), param));
    pairs.collect()
}

fn rules(result: &ResultMessage) -> Rules<'_> {
    let violated = |level| {
        let issues = checkers(result).flat_map(|checker| &checker.issues);
        let broken = issues.filter(|issue| issue.level == level && !issue.rule_uid.is_empty());
        broken.map(|issue| issue.rule_uid.as_str()).collect()
    };
    Rules {
        addressed: checkers(result)
            .flat_map(|checker| checker.addressed_rules.iter())
            .map(|uid| &**uid)
            .collect(),
        violated: levels(violated),
    }
}
