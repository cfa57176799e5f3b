//! The verdict file `NAME.verdict.json` next to a result. It contains all information that a farm
//! needs to decide without reading the result itself.

use std::path::Path;

use qcbus_formats::pool::{NotAsked, OWN_BUNDLE, Pooled, Unfinished};
use qcbus_formats::xqar::{CheckerBundle, Status};
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;
use qcbus_types::{FinishedJob, Input, Judged, RequiredBundle, RequiredSet, RestsOn};
use serde::Serialize;

/// Version of the format.
pub const FORMAT: u32 = 1;

/// Content of a verdict file. Existing fields never change; new fields may be added.
#[derive(Debug, Serialize)]
pub struct VerdictFile<'a> {
    format: u32,
    verdict: Verdict,
    /// Verdict without the files that it depends on.
    own: Verdict,
    input_file: String,
    sha256: String,
    /// Dependencies with verdicts of their own.
    rests_on: Vec<RestsOnLine>,
    depends_on: Vec<Dependency>,
    configuration_sha256: String,
    qcbus_version: &'a str,
    /// Epoch of the required set. It increases with every change of the set.
    epoch: u64,
    /// Bundles that were required in this epoch.
    demanded: Vec<&'a str>,
    /// Required bundles that were missing.
    absent: Vec<&'a str>,
    bundles: Vec<BundleLine<'a>>,
    errors: u64,
    warnings: u64,
    information: u64,
    filtered: u64,
    skipped: Vec<CheckerLine<'a>>,
    failed: Vec<CheckerLine<'a>>,
    /// Open points that keep the verdict undetermined.
    open: Vec<CheckerLine<'a>>,
    /// Bundles with checkers that the configuration excludes.
    not_asked: Vec<NotAskedLine>,
    result: String,
    /// Dependencies that are not published behind the gate with the file, because they lie outside
    /// of the watched directories. Missing if there is no gate.
    #[serde(skip_serializing_if = "Option::is_none")]
    outside_gate: Option<Vec<String>>,
}

#[derive(Debug, Serialize)]
struct RestsOnLine {
    path: String,
    sha256: String,
    /// `null` if there was no verdict on these bytes yet.
    verdict: Option<Verdict>,
    /// Number of errors of its own.
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

/// Returns the text of a verdict file.
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
    // There may be one line for each of a few hundred checkers.
    let mut text = Vec::with_capacity(32 << 10);
    // The target is memory and the data are only text and numbers, so this cannot fail.
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

/// Returns the bundles that took part, without those that are only required.
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
