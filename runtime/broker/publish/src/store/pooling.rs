//! Pooling: combines the findings of the bundles on a file into its result.

use qcbus_document::Document;
use qcbus_formats::config::Config;
use qcbus_formats::pool::{
    self, BundleOutcome, Ending, NoPlaces, PoolInput, Pooled, Remark, Resolver, Scope, Unfinished,
};
use qcbus_formats::xqar::Level;
use qcbus_ingest::{RESTS_ON_CHECKER, Resting};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{BUILD_DATE, MissingDocument, Verdict};
use qcbus_types::{FinishedJob, Referenced, RestsOn, TaskOutcome};

use super::Store;

impl Store {
    pub(super) fn pool(
        &self,
        job: &FinishedJob,
        mut bundles: Vec<BundleOutcome>,
        (config, scope): (Option<&Config>, Scope),
        root: Option<&[u8]>,
    ) -> Pooled {
        let document = root.and_then(|bytes| Document::open(bytes).ok());
        let mut remarks: Vec<Remark> = unanswered(job).into_iter().collect();
        remarks.extend(pool::chosen(&self.choice));
        match (&document, &job.prepared) {
            (Some(document), Some(prepared)) => {
                remarks.extend(qcbus_ingest::remarks(document, &prepared.missing, &bundles));
                remarks.extend(self.resting(job, document, &prepared.missing));
            }
            (None, Some(_)) => remarks.push(unseen_root()),
            (_, None) => {}
        }
        if self.strict || config.is_some_and(Config::is_of_asam) {
            pool::state_levels_of_asam(&mut bundles);
        }
        let input = PoolInput {
            input_file: &to_text(&job.path),
            config,
            bundles,
            remarks,
            scope,
            separate: self.all || self.strict || config.is_some_and(Config::lists_as_asam),
            version: env!("CARGO_PKG_VERSION"),
            build_date: BUILD_DATE,
        };
        match document {
            Some(document) => pool::pool(input, &mut InDocument { document }),
            None => pool::pool(input, &mut NoPlaces),
        }
    }
}

impl Store {
    /// Returns findings about files that this file depends on and that are not accepted. A broken
    /// file is left out, because it is already reported at the same reference.
    fn resting(
        &self,
        job: &FinishedJob,
        root: &Document<'_>,
        missing: &[MissingDocument],
    ) -> Vec<Remark> {
        let is_said = |path: &str| {
            let mut missing = missing.iter();
            missing.any(|it| it.path == path && it.level == Level::Error)
        };
        let remark = |(file, verdict): &(Referenced, RestsOn)| {
            let path = to_text(&file.path);
            let resting = Resting {
                role: file.role,
                referred_at: file.referred_at,
                path: &path,
                verdict: verdict.verdict,
                errors: verdict.errors,
            };
            let remark = qcbus_ingest::resting(root, &resting, !self.own_verdicts);
            remark.filter(|_| !is_said(&path))
        };
        let judged = job.rests_on.iter().filter_map(remark);
        let prepared = job.prepared.iter().filter(|_| !self.own_verdicts);
        let unwatched = prepared.flat_map(|it| &it.unwatched).filter_map(|file| {
            let path = to_text(&file.path);
            let remark = || qcbus_ingest::unwatched(root, file.role, &path, file.referred_at);
            (!is_said(&path)).then(remark)
        });
        judged.chain(unwatched).collect()
    }
}

/// Returns a finding if no bundle could check the file: it cannot be read, or no bundle checks its kind.
fn unanswered(job: &FinishedJob) -> Option<Remark> {
    let takes = |it: &TaskOutcome| {
        let catalogue = it.catalogue.as_ref();
        catalogue.is_some_and(|it| it.kinds.contains(&job.kind))
    };
    let (checker, description, open) = if let Some(why) = &job.unreadable {
        (
            "qcbus_file",
            "The file is complete and can be read.",
            why.clone(),
        )
    } else if job.bundles.iter().any(takes) {
        return None;
    } else {
        let kind = job.kind.as_str();
        let why = format!(
            "no bundle is required for .{kind} files: no known bundle checks them, or the configuration requests \
             none of its checkers"
        );
        ("qcbus_bundles", "A bundle checks files of this kind.", why)
    };
    Some(Remark {
        checker: checker.to_owned(),
        description: description.to_owned(),
        issue: None,
        open: Some(open),
    })
}

/// Returns a finding for a missing image. Without the diagnostics of the reader the file is not accepted.
fn unseen_root() -> Remark {
    Remark {
        checker: "qcbus_file".to_owned(),
        description: "The file is complete and can be read.".to_owned(),
        issue: None,
        open: Some("its image was released before its result was written".to_owned()),
    }
}

/// Maximum number of reasons shown to the user. Further ones are only counted.
const REASONS: usize = 20;

/// Returns the reasons of a verdict for the user: open points, and errors taken over from other files. If the verdict
/// is rejected, only failures are listed. Checkers that were skipped because of the error are left out.
pub(super) fn reasons(job: &FinishedJob, pooled: &Pooled, verdict: Verdict) -> Vec<String> {
    if let Some(open) = unanswered(job).and_then(|remark| remark.open) {
        return vec![open];
    }
    let told = |it: &&Unfinished| {
        verdict != Verdict::Rejected || matches!(it.ending, Ending::Failed { .. })
    };
    let open: Vec<&Unfinished> = pooled.open().filter(told).collect();
    let mut why: Vec<String> = open.iter().take(REASONS).map(ToString::to_string).collect();
    if open.len() > REASONS {
        why.push(format!("and {} more", open.len() - REASONS));
    }
    if verdict == Verdict::Rejected && pooled.verdict_without(RESTS_ON_CHECKER) != verdict {
        why.extend(taken_over(pooled));
    }
    why
}

/// Returns the findings that reject a file without errors of its own.
fn taken_over(pooled: &Pooled) -> impl Iterator<Item = String> {
    let checkers = pooled.results.bundles.iter().flat_map(|it| &it.checkers);
    let resting = checkers.filter(|it| &*it.id == RESTS_ON_CHECKER);
    let errors = resting
        .flat_map(|it| &it.issues)
        .filter(|it| it.level == Level::Error);
    errors.map(|it| it.description.to_string()).take(REASONS)
}

/// Finds the row and column of an XPath in the image.
struct InDocument<'a> {
    document: Document<'a>,
}

impl Resolver for InDocument<'_> {
    fn resolve(&mut self, xpath: &str) -> Option<pool::XPathPlace> {
        let nodes = self.document.evaluate(xpath).ok()?;
        let position = nodes.first()?.position();
        Some(pool::XPathPlace {
            row: position.row.into(),
            column: position.column.into(),
            offset: Some(position.offset.into()),
        })
    }
}
