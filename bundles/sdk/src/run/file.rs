//! Checks one file at once, without a broker.

use std::collections::BTreeMap;
use std::io::{self, Write as _};
use std::path::Path;
use std::time::Instant;

use qcbus_formats::Text;
use qcbus_formats::pool::{
    BundleOutcome, CheckerOutcome, Ending, NoPlaces, PoolInput, Pooled, Scope, pool,
};
use qcbus_formats::verdict::Verdict;
use qcbus_formats::xqar::{Checker, CheckerBundle, Issue, Level, Location};
use qcbus_messages::path_text::to_text;
use qcbus_messages::shown;

use super::{Exit, Timings};
use crate::Permits;
use crate::{BUILD_DATE, Bundle, Listener, Loaded, Outcome, Plan, UserFiles, check_with};

/// Output format of findings.
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
    (permits, given): (&Permits, Option<&UserFiles>),
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
            to_text(path)
        ));
        return Exit::Usage;
    }
    let plan = Plan::by_default(bundle).with_files(given);
    let Judged {
        pooled,
        reasons,
        took,
    } = match judge(&plan, &loaded, permits) {
        Ok(judged) => judged,
        Err(error) => {
            complain(&format!("failed to {error}\n"));
            return Exit::Internal;
        }
    };
    if timings {
        complain(&took.to_string());
    }
    let printed = print(&match format {
        Format::Text => as_text(path, &pooled),
        Format::Json => as_json(path, bundle, &pooled, &reasons),
    });
    match printed {
        Ok(()) => pooled.verdict().into(),
        Err(error) => {
            complain(&format!("cannot write to stdout: {error}\n"));
            Exit::Internal
        }
    }
}

/// Returns the findings of a plan in a loaded file from a level on, and the verdict. Each finding
/// is a line as `bundle run` prints it. Further lines list what could not be checked.
///
/// # Errors
/// If the built image cannot be opened.
pub fn findings(
    plan: &Plan,
    loaded: &Loaded,
    from: Level,
) -> Result<(String, Verdict), crate::LoadError> {
    let Judged { mut pooled, .. } = judge(plan, loaded, &Permits::new(1))?;
    let verdict = pooled.verdict();
    for bundle in &mut pooled.results.bundles {
        for checker in &mut bundle.checkers {
            checker.issues.retain(|issue| issue.level <= from);
        }
    }
    Ok((as_text(loaded.path(), &pooled), verdict))
}

struct Judged {
    pooled: Pooled,
    /// Reasons why checkers did not complete, by identifier.
    reasons: BTreeMap<Text, String>,
    took: Timings,
}

/// Checks a file and pools the findings, as a broker does without a configuration.
fn judge(plan: &Plan, loaded: &Loaded, permits: &Permits) -> Result<Judged, crate::LoadError> {
    let (outcome, took) = examine_timed(plan, loaded, permits)?;
    let mut reasons: BTreeMap<Text, String> = outcome
        .checkers
        .iter()
        .map(|checker| (checker.id.clone(), checker.reason().to_owned()))
        .collect();
    let bundles = vec![outcome];
    let input = PoolInput {
        input_file: &to_text(loaded.path()),
        config: None,
        remarks: loaded.remarks(&bundles)?,
        bundles,
        scope: Scope::Alone,
        separate: true,
        version: plan.bundle().version,
        build_date: BUILD_DATE,
    };
    let pooled = pool(input, &mut NoPlaces);
    let own = pooled.unfinished.iter();
    reasons.extend(own.map(|it| (it.checker.clone(), it.ending.reason().to_owned())));
    Ok(Judged {
        pooled,
        reasons,
        took,
    })
}

/// Returns all findings of the plan's demanded checkers in a loaded file.
///
/// # Errors
/// If the built image cannot be opened.
pub fn examine(plan: &Plan, loaded: &Loaded) -> Result<BundleOutcome, crate::LoadError> {
    examine_timed(plan, loaded, &Permits::new(1)).map(|(outcome, _)| outcome)
}

/// Does the same as [`examine`] with one thread per permit in `permits`, and also returns the time
/// of every checker.
///
/// # Errors
/// If the built image cannot be opened.
pub fn examine_timed(
    plan: &Plan,
    loaded: &Loaded,
    permits: &Permits,
) -> Result<(BundleOutcome, Timings), crate::LoadError> {
    let bundle = plan.bundle();
    let start = Instant::now();
    let subject = loaded.subject(bundle)?;
    let mut collected = Collected {
        plan,
        checkers: Vec::new(),
        timings: Timings::default(),
    };
    check_with(plan, &subject, permits, &mut collected);
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
        absent: None,
        asked: Some(plan.asked()),
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
                id: checker.id.as_str().into(),
                description: checker.description.as_str().into(),
                rule_uids: checker.facts.uids.iter().copied().collect(),
                ending: Some(outcome.ending),
                params: outcome.params,
                issues,
                metadata: outcome.metadata,
            },
        ));
    }
}

fn as_text(path: &Path, pooled: &Pooled) -> String {
    let mut lines: Vec<(u64, u64, String)> = Vec::new();
    for issue in checkers(pooled).flat_map(|(_, checker)| &checker.issues) {
        let (row, column) = row_column(issue).unwrap_or((1, 1));
        let first = issue.locations.first();
        let place = first
            .filter(|place| place.elsewhere.is_some())
            .map(|place| format!(" ({})", place.written()))
            .unwrap_or_default();
        let level = issue.level.as_str();
        let text = format!(
            "{}:{row}:{column}: {level}: {}{place} [{}]",
            to_text(path),
            issue.description,
            issue.rule_uid
        );
        lines.push((row, column, format!("{}\n", shown::line(&text))));
    }
    lines.sort();
    let open = pooled.open().map(|it| {
        let what = match it.ending {
            Ending::Failed { .. } => "failed",
            _ => "could not run",
        };
        let (path, why) = (to_text(path), it.ending.reason());
        let text = format!("{path}: {} {what}: {why}", it.checker);
        format!("{}\n", shown::line(&text))
    });
    let lines = lines.into_iter().map(|(_, _, line)| line);
    lines.chain(open).collect()
}

fn as_json(
    path: &Path,
    bundle: &Bundle,
    pooled: &Pooled,
    reasons: &BTreeMap<Text, String>,
) -> String {
    let checkers = checkers(pooled).map(|(of, checker)| {
        serde_json::json!({
            "id": checker.id,
            "bundle": of.name,
            "status": checker.status,
            "reason": reasons.get(&checker.id).map_or("", String::as_str),
            "params": checker.params,
            "metadata": checker.metadata,
            "issues": checker.issues,
            "rules": checker.addressed_rules,
        })
    });
    let whole = serde_json::json!({
        "file": to_text(path),
        "bundle": bundle.name,
        "version": bundle.version,
        "verdict": pooled.verdict().as_str(),
        "checkers": checkers.collect::<Vec<_>>(),
    });
    format!("{whole:#}\n")
}

fn checkers(pooled: &Pooled) -> impl Iterator<Item = (&CheckerBundle, &Checker)> {
    let bundles = pooled.results.bundles.iter();
    bundles.flat_map(|bundle| bundle.checkers.iter().map(move |checker| (bundle, checker)))
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

/// Prints results to stdout. A closed pipe is not an error.
pub(super) fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        done => done,
    }
}

/// Prints a message for a person to stderr, even if logging is not set up.
pub(crate) fn complain(text: &str) {
    let _ = io::stderr().lock().write_all(shown::lines(text).as_bytes());
}
