//! The verdict file `NAME.verdict.json` beside a result: everything that a farm needs to decide,
//! without reading the result itself.

use qcbus_formats::pool::{FailedChecker, Pooled};
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;
use serde::Serialize;

use crate::core::{BundleOutcome, FinishedJob, Input};

/// The content of a verdict file. Fields are only ever added.
#[derive(Debug, Serialize)]
pub struct VerdictFile<'a> {
    format: u32,
    verdict: Verdict,
    input_file: String,
    sha256: String,
    depends_on: Vec<Dependency>,
    configuration_sha256: String,
    qcbus_version: &'a str,
    bundles: Vec<BundleLine<'a>>,
    errors: u64,
    warnings: u64,
    information: u64,
    filtered: u64,
    skipped: Vec<CheckerLine<'a>>,
    failed: Vec<CheckerLine<'a>>,
    result: String,
}

#[derive(Debug, Serialize)]
struct Dependency {
    path: String,
    sha256: Option<String>,
}

#[derive(Debug, Serialize)]
struct BundleLine<'a> {
    name: &'a str,
    version: &'a str,
    checkers: usize,
}

#[derive(Debug, Serialize)]
struct CheckerLine<'a> {
    bundle: &'a str,
    checker: &'a str,
    reason: &'a str,
}

/// The text of a verdict file.
pub fn render(
    job: &FinishedJob,
    pooled: &Pooled,
    verdict: Verdict,
    xqar: &std::path::Path,
) -> Vec<u8> {
    let inputs: &[Input] = job
        .prepared
        .as_ref()
        .map_or(&[], |prepared| &prepared.inputs);
    let sha256 = |input: &Input| input.digest().map(|digest| digest.to_string());
    let depends_on = inputs.iter().skip(1).map(|input| Dependency {
        path: to_text(&input.path),
        sha256: sha256(input),
    });
    let file = VerdictFile {
        format: 1,
        verdict,
        input_file: to_text(&job.path),
        sha256: inputs.first().and_then(sha256).unwrap_or_default(),
        depends_on: depends_on.collect(),
        configuration_sha256: job.config.to_string(),
        qcbus_version: env!("CARGO_PKG_VERSION"),
        bundles: job
            .bundles
            .iter()
            .filter(|it| it.catalogue.is_some())
            .map(|it| BundleLine {
                name: &it.name,
                version: &it.version,
                checkers: it.checkers.len(),
            })
            .collect(),
        errors: pooled.counts.errors,
        warnings: pooled.counts.warnings,
        information: pooled.counts.information,
        filtered: pooled.removed.errors + pooled.removed.warnings + pooled.removed.information,
        skipped: skipped(&job.bundles),
        failed: pooled.failed.iter().map(failed).collect(),
        result: to_text(xqar),
    };
    let mut text = serde_json::to_vec_pretty(&file).unwrap_or_default();
    text.push(b'\n');
    text
}

fn skipped(bundles: &[BundleOutcome]) -> Vec<CheckerLine<'_>> {
    let mut lines = Vec::new();
    for bundle in bundles {
        let offered = bundle.catalogue.as_deref();
        let skipped = bundle.checkers.iter();
        for said in skipped.filter(|it| it.status == Status::Skipped) {
            let index = usize::try_from(said.checker).unwrap_or(usize::MAX);
            let Some(checker) = offered.and_then(|it| it.checkers.get(index)) else {
                continue;
            };
            lines.push(CheckerLine {
                bundle: &bundle.name,
                checker: &checker.id,
                reason: &said.reason,
            });
        }
    }
    lines
}

fn failed(it: &FailedChecker) -> CheckerLine<'_> {
    CheckerLine {
        bundle: &it.bundle,
        checker: &it.checker,
        reason: &it.reason,
    }
}
