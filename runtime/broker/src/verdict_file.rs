//! The verdict file `NAME.verdict.json` beside a result: everything that a farm needs to decide,
//! without reading the result itself.

use std::path::Path;

use qcbus_formats::pool::{NotAsked, OWN_BUNDLE, Pooled, Unfinished};
use qcbus_formats::xqar::{CheckerBundle, Status};
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;
use serde::Serialize;

use crate::core::{FinishedJob, Input, Judged, RequiredBundle, RequiredSet, RestsOn};

/// Version of the form.
pub const FORMAT: u32 = 1;

/// The content of a verdict file. Fields are only ever added.
#[derive(Debug, Serialize)]
pub struct VerdictFile<'a> {
    format: u32,
    verdict: Verdict,
    /// The verdict without the files that it rests on.
    own: Verdict,
    input_file: String,
    sha256: String,
    /// The files with verdicts of their own that it rests on.
    rests_on: Vec<RestsOnLine>,
    depends_on: Vec<Dependency>,
    configuration_sha256: String,
    qcbus_version: &'a str,
    /// Of who must judge: counts up with every change of that.
    epoch: u64,
    /// The bundles that had to judge in this epoch.
    demanded: Vec<&'a str>,
    /// Those of them that were not there.
    absent: Vec<&'a str>,
    bundles: Vec<BundleLine<'a>>,
    errors: u64,
    warnings: u64,
    information: u64,
    filtered: u64,
    skipped: Vec<CheckerLine<'a>>,
    failed: Vec<CheckerLine<'a>>,
    /// What keeps the verdict undetermined.
    open: Vec<CheckerLine<'a>>,
    /// Bundles of which a configuration left checkers out.
    not_asked: Vec<NotAskedLine>,
    result: String,
    /// Files that the verdict depends on and that do not lie behind the gate with it, because they
    /// lie outside of the watched directories; absent when there is no gate.
    #[serde(skip_serializing_if = "Option::is_none")]
    outside_gate: Option<Vec<String>>,
}

#[derive(Debug, Serialize)]
struct RestsOnLine {
    path: String,
    sha256: String,
    /// `null` while there was none on these bytes.
    verdict: Option<Verdict>,
    /// Errors of its own.
    errors: u64,
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

#[derive(Debug, Serialize)]
struct NotAskedLine {
    bundle: String,
    checkers: usize,
    of: usize,
}

/// The text of a verdict file.
pub fn render(
    job: &FinishedJob,
    pooled: &Pooled,
    judged: &Judged,
    outside_gate: Option<Vec<&Path>>,
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
        format: FORMAT,
        verdict: judged.verdict,
        own: judged.own,
        rests_on: judged
            .rests_on
            .iter()
            .flatten()
            .map(rests_on_line)
            .collect(),
        input_file: to_text(&job.path),
        sha256: inputs.first().and_then(sha256).unwrap_or_default(),
        depends_on: depends_on.collect(),
        configuration_sha256: job.config.to_string(),
        qcbus_version: env!("CARGO_PKG_VERSION"),
        epoch: job.epoch.0,
        demanded: names(&job.required_set, |_| true),
        absent: names(&job.required_set, |required_bundle| {
            required_bundle.version_digest.is_none()
        }),
        bundles: bundles(pooled),
        errors: pooled.counts.errors,
        warnings: pooled.counts.warnings,
        information: pooled.counts.information,
        filtered: pooled.removed.errors + pooled.removed.warnings + pooled.removed.information,
        skipped: unfinished(pooled, |it| it.ending.status() == Status::Skipped),
        failed: unfinished(pooled, |it| it.ending.status() == Status::Error),
        open: unfinished(pooled, |it| {
            judged.verdict == Verdict::Undetermined && it.ending.is_open()
        }),
        not_asked: NotAsked::of(&pooled.results)
            .into_iter()
            .map(not_asked)
            .collect(),
        result: judged.xqar.as_deref().map(to_text).unwrap_or_default(),
        outside_gate: outside_gate.map(|paths| paths.into_iter().map(to_text).collect()),
    };
    // A line for each of a few hundred checkers.
    let mut text = Vec::with_capacity(32 << 10);
    // Into memory, and of text and numbers alone: it cannot fail.
    let _ = serde_json::to_writer_pretty(&mut text, &file);
    text.push(b'\n');
    text
}

fn rests_on_line(it: &RestsOn) -> RestsOnLine {
    RestsOnLine {
        path: to_text(&it.path),
        sha256: it.digest.to_string(),
        verdict: it.verdict,
        errors: it.errors,
    }
}

fn names(required_set: &RequiredSet, wanted: impl Fn(&RequiredBundle) -> bool) -> Vec<&str> {
    let required_bundles = required_set
        .0
        .iter()
        .filter(|required_bundle| wanted(required_bundle));
    required_bundles
        .map(|required_bundle| required_bundle.name.as_str())
        .collect()
}

/// The bundles that took part; not those that are only demanded.
fn bundles(pooled: &Pooled) -> Vec<BundleLine<'_>> {
    let bundles = pooled.results.bundles.iter();
    let there = bundles.filter(|it| it.name != OWN_BUNDLE && !it.version.is_empty());
    there.map(bundle_line).collect()
}

fn bundle_line(bundle: &CheckerBundle) -> BundleLine<'_> {
    BundleLine {
        name: &bundle.name,
        version: &bundle.version,
        checkers: bundle.checkers.len(),
    }
}

fn unfinished(pooled: &Pooled, listed: impl Fn(&Unfinished) -> bool) -> Vec<CheckerLine<'_>> {
    let listed = pooled.unfinished.iter().filter(|it| listed(it));
    listed.map(checker_line).collect()
}

fn checker_line(it: &Unfinished) -> CheckerLine<'_> {
    CheckerLine {
        bundle: &it.bundle,
        checker: &it.checker,
        reason: it.ending.reason(),
    }
}

fn not_asked(it: NotAsked) -> NotAskedLine {
    NotAskedLine {
        bundle: it.bundle,
        checkers: it.left_out,
        of: it.offered,
    }
}
