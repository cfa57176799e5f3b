//! One file, checked at once, without a broker.

use std::io::{self, Write as _};
use std::path::Path;
use std::time::Instant;

use qcbus_formats::pool::{BundleOutcome, CheckerOutcome};
use qcbus_formats::xqar::{Issue, Level, Location, Status};
use qcbus_messages::Verdict;

use super::{Exit, Timings};
use crate::pages::level_name;
use crate::{BUILD_DATE, Bundle, Listener, Loaded, Outcome, Plan, UserFiles, check};

/// How findings are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// `file:row:column: level: text [rule]`, one per line.
    #[default]
    Text,
    /// One JSON object for the whole run.
    Json,
}

impl Format {
    pub(super) fn of(name: &str) -> Option<Format> {
        match name {
            "text" => Some(Format::Text),
            "json" => Some(Format::Json),
            _ => None,
        }
    }
}

pub(super) fn run(
    bundle: &'static Bundle,
    path: &Path,
    (format, timings): (Format, bool),
    given: Option<&UserFiles>,
) -> Exit {
    let boundary = path
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty());
    let loaded = match Loaded::from_path(path, boundary.unwrap_or(Path::new("."))) {
        Ok(loaded) => loaded,
        Err(error) => {
            complain(&format!("failed to {error}\n"));
            return Exit::Usage;
        }
    };
    if !bundle.kinds.contains(&loaded.kind()) {
        complain(&format!(
            "{} does not check {}\n",
            bundle.name,
            path.display()
        ));
        return Exit::Usage;
    }
    match examine_timed(&Plan::by_default(bundle).with_files(given), &loaded) {
        Ok((outcome, took)) => {
            if timings {
                complain(&took.to_string());
            }
            let verdict = verdict(&outcome);
            print(&match format {
                Format::Text => as_text(path, &outcome),
                Format::Json => as_json(path, &outcome, verdict),
            });
            verdict.into()
        }
        Err(error) => {
            complain(&format!("failed to {error}\n"));
            Exit::Internal
        }
    }
}

/// Everything that the plan's demanded checkers find in a loaded file.
///
/// # Errors
/// When the image that was built cannot be opened.
pub fn examine(plan: &Plan, loaded: &Loaded) -> Result<BundleOutcome, crate::LoadError> {
    examine_timed(plan, loaded).map(|(outcome, _)| outcome)
}

/// The same as [`examine`], with what every checker took.
///
/// # Errors
/// When the image that was built cannot be opened.
pub fn examine_timed(
    plan: &Plan,
    loaded: &Loaded,
) -> Result<(BundleOutcome, Timings), crate::LoadError> {
    let bundle = plan.bundle();
    let start = Instant::now();
    let subject = loaded.subject(bundle)?;
    let mut collected = Collected {
        plan,
        checkers: Vec::new(),
        timings: Timings::default(),
    };
    check(plan, &subject, &mut collected);
    let mut timings = collected.timings;
    timings.whole = start.elapsed();
    collected.checkers.sort_by_key(|(index, _)| *index);
    let outcome = BundleOutcome {
        name: bundle.name.to_owned(),
        alias: bundle.alias.to_owned(),
        version: bundle.version.to_owned(),
        build_date: BUILD_DATE.to_owned(),
        description: bundle.description.to_owned(),
        params: Vec::new(),
        checkers: collected
            .checkers
            .into_iter()
            .map(|(_, checker)| checker)
            .collect(),
    };
    Ok((outcome, timings))
}

struct Collected<'p> {
    plan: &'p Plan,
    checkers: Vec<(usize, CheckerOutcome)>,
    timings: Timings,
}

impl Listener for Collected<'_> {
    fn ended(&mut self, index: usize, issues: Vec<Issue>, outcome: Outcome) {
        let Some(checker) = self.plan.checkers().get(index) else {
            return;
        };
        let timings = &mut self.timings.checkers;
        timings.push((checker.id.clone(), outcome.took));
        self.checkers.push((
            index,
            CheckerOutcome {
                id: checker.id.clone(),
                description: checker.description.clone(),
                rule_uids: checker
                    .facts
                    .uids
                    .iter()
                    .map(|&uid| uid.to_owned())
                    .collect(),
                status: Some(outcome.status),
                reason: outcome.reason,
                params: outcome.params,
                issues,
                metadata: outcome.metadata,
            },
        ));
    }
}

/// Rejected on any error; else undetermined when a checker failed.
fn verdict(outcome: &BundleOutcome) -> Verdict {
    let mut issues = outcome.checkers.iter().flat_map(|checker| &checker.issues);
    if issues.any(|issue| issue.level == Level::Error) {
        Verdict::Rejected
    } else if outcome
        .checkers
        .iter()
        .any(|checker| checker.status == Some(Status::Error))
    {
        Verdict::Undetermined
    } else {
        Verdict::Accepted
    }
}

fn as_text(path: &Path, outcome: &BundleOutcome) -> String {
    let mut lines: Vec<(u64, u64, String)> = Vec::new();
    for issue in outcome.checkers.iter().flat_map(|checker| &checker.issues) {
        let (row, column) = row_column(issue).unwrap_or((1, 1));
        let elsewhere = issue
            .domain_info
            .iter()
            .any(|info| info.name == "qcbus.location");
        let place = issue.locations.first().filter(|_| elsewhere);
        let place = place
            .map(|place| format!(" ({})", place.description))
            .unwrap_or_default();
        let level = level_name(issue.level);
        let text = format!(
            "{}:{row}:{column}: {level}: {}{place} [{}]\n",
            path.display(),
            issue.description,
            issue.rule_uid
        );
        lines.push((row, column, text));
    }
    lines.sort();
    let failed = outcome
        .checkers
        .iter()
        .filter(|checker| checker.status == Some(Status::Error));
    let failed = failed.map(|c| format!("{}: {} failed: {}\n", path.display(), c.id, c.reason));
    lines
        .into_iter()
        .map(|(_, _, line)| line)
        .chain(failed)
        .collect()
}

fn as_json(path: &Path, outcome: &BundleOutcome, verdict: Verdict) -> String {
    let checkers = outcome.checkers.iter().map(|checker| {
        serde_json::json!({
            "id": checker.id,
            "status": checker.status,
            "reason": checker.reason,
            "params": checker.params,
            "metadata": checker.metadata,
            "issues": checker.issues,
            "rules": checker.rule_uids,
        })
    });
    let whole = serde_json::json!({
        "file": path.display().to_string(),
        "bundle": outcome.name,
        "version": outcome.version,
        "verdict": verdict.as_str(),
        "checkers": checkers.collect::<Vec<_>>(),
    });
    format!("{whole:#}\n")
}

fn row_column(issue: &Issue) -> Option<(u64, u64)> {
    issue
        .locations
        .iter()
        .flat_map(|locations| &locations.places)
        .find_map(|place| match place {
            Location::File { row, column, .. } => Some((*row, *column)),
            _ => None,
        })
}

/// Results go to stdout; a closed pipe is nobody's business.
pub(super) fn print(text: &str) {
    let _ = io::stdout().lock().write_all(text.as_bytes());
}

/// What a person must know goes to stderr, also when nobody has set up logging.
pub(crate) fn complain(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}
