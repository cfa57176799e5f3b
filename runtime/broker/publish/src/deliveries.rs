//! Messages for reporters. They are read back from the stored result, so a slow reporter uses disk
//! space but no memory.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use qcbus_disk::foreign;
use qcbus_formats::config::{Config, same_reporter};
use qcbus_formats::xqar::{self, Checker, Param, Results};
use qcbus_messages::codec::MAX_MESSAGE;
use qcbus_messages::path_text::to_text;
use qcbus_messages::{DocId, ResultMessage, Withdrawn};
use qcbus_types::{Delivery, facts_weight, weight};

use crate::result_paths::ResultPaths;

/// Builds the message for one reporter.
///
/// # Errors
/// Returns a text for the user if the stored result cannot be read back.
pub fn message(
    reporter: &str,
    delivery: &Delivery,
    document: Option<DocId>,
    places: &ResultPaths,
    config: Option<&Arc<Config>>,
) -> Result<ResultMessage, String> {
    let judged = &delivery.judged;
    let Some(xqar) = &judged.xqar else {
        let (path, why) = (to_text(&delivery.path), judged.why.join("; "));
        return Err(format!("{path} has no result for {reporter}: {why}"));
    };
    let fail = |error: &dyn std::fmt::Display| {
        let xqar = to_text(xqar);
        format!("cannot read {xqar} back for {reporter}: {error}")
    };
    let bytes = foreign::read(xqar, MOST_OF_A_RESULT).map_err(|error| fail(&error))?;
    let mut results = xqar::read(&bytes).map_err(|error| fail(&error))?;
    drop(bytes);
    cut_to(&mut results, MOST_BYTES);
    Ok(ResultMessage {
        job: delivery.job,
        input: to_text(&delivery.path),
        display_path: to_text(&places.display(&delivery.path)),
        xqar: to_text(xqar),
        verdict: judged.verdict,
        digest: judged.digest,
        config: judged.config,
        document,
        rules: broken_rules(&results),
        params: params_of(reporter, config),
        results,
    })
}

/// Returns the message for one reporter about a removed file. `left` is the path of its result, if
/// that differs from the present result path.
pub fn withdrawn(
    reporter: &str,
    path: &Path,
    left: Option<&Path>,
    places: &ResultPaths,
    config: Option<&Arc<Config>>,
) -> Withdrawn {
    let shown = left.and_then(|xqar| places.shown_at(xqar));
    let shown = shown.unwrap_or_else(|| places.display(path));
    let xqar = left.map_or_else(|| places.xqar(path), Path::to_path_buf);
    Withdrawn {
        input: to_text(path),
        display_path: to_text(&shown),
        xqar: to_text(&xqar),
        params: params_of(reporter, config),
    }
}

/// Maximum size of a result. A result with all the data that the broker keeps of every bundle is far smaller.
const MOST_OF_A_RESULT: u64 = 4 << 30;

/// Maximum bytes of memory for the findings in one message. It is half of the message limit of the
/// bus. The encoded form is smaller, and the rest of the message also needs room.
const MOST_BYTES: usize = MAX_MESSAGE / 2;

/// Shortens a result that is too large for one message at the checkers with most findings, and
/// states this there. The stored result remains complete.
fn cut_to(results: &mut Results, most: usize) {
    let mut checkers: Vec<&mut Checker> = results
        .bundles
        .iter_mut()
        .flat_map(|bundle| &mut bundle.checkers)
        .collect();
    let bytes = |checker: &Checker| {
        let issues = checker.issues.iter().map(weight).sum::<usize>();
        issues + facts_weight(&checker.params, &checker.metadata)
    };
    let mut weighed: Vec<usize> = checkers.iter().map(|checker| bytes(checker)).collect();
    let before: Vec<usize> = checkers.iter().map(|it| it.issues.len()).collect();
    while weighed.iter().sum::<usize>() > most {
        let heaviest = (0..weighed.len()).max_by_key(|at| weighed.get(*at));
        let Some(at) = heaviest else { break };
        let (Some(checker), Some(weighs)) = (checkers.get_mut(at), weighed.get_mut(at)) else {
            break;
        };
        if checker.issues.is_empty() {
            checker.params.clear();
            checker.metadata.clear();
        }
        checker.issues.truncate(checker.issues.len() / 2);
        *weighs = bytes(checker);
    }
    for (checker, before) in checkers.iter_mut().zip(before) {
        let cut = before - checker.issues.len();
        if cut > 0 {
            let gap = if checker.summary.is_empty() { "" } else { "; " };
            checker.summary = format!(
                "{}{gap}{cut} further findings are only in the .xqar, because a report has no room for them",
                checker.summary
            )
            .into();
        }
    }
}

/// Returns the descriptions of the violated rules.
pub fn broken_rules(results: &Results) -> BTreeMap<String, String> {
    let checkers = results.bundles.iter().flat_map(|bundle| &bundle.checkers);
    let broken = checkers.flat_map(|checker| {
        checker
            .issues
            .iter()
            .map(|issue| (issue.rule_uid.clone(), checker.description.to_string()))
    });
    broken.collect()
}

fn params_of(reporter: &str, config: Option<&Arc<Config>>) -> Vec<Param> {
    let Some(config) = config else {
        return Vec::new();
    };
    let mut reports = config.reports.iter();
    let mine = reports.find(|report| same_reporter(&report.application, reporter));
    mine.map(|report| config.report_params(report))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use qcbus_formats::xqar::{CheckerBundle, Issue, Level};

    use super::*;

    fn checker(id: &str, issues: usize) -> Checker {
        let issue = |id| Issue {
            id,
            description: "x".repeat(1000),
            level: Level::Warning,
            rule_uid: String::new(),
            locations: Vec::new(),
            domain_info: Vec::new(),
        };
        Checker {
            id: id.into(),
            summary: "said".into(),
            issues: (0..issues as u64).map(issue).collect(),
            ..Checker::default()
        }
    }

    #[test]
    fn oversized_result_is_cut_at_largest_checker() {
        let mut results = Results::default();
        results.bundles.push(CheckerBundle {
            checkers: vec![checker("modest", 2), checker("flood", 1000)],
            ..CheckerBundle::default()
        });
        let whole = results.clone();
        cut_to(&mut results, 10_000_000);
        assert_eq!(results, whole, "it fits");
        cut_to(&mut results, 200_000);
        let [modest, flood] = results.bundles[0].checkers.as_slice() else {
            panic!("no checker may be removed");
        };
        assert_eq!(modest, &whole.bundles[0].checkers[0]);
        assert_eq!(flood.issues.len(), 125);
        let said = "said; 875 further findings are only in the .xqar, because a report has no room for them";
        assert_eq!(&*flood.summary, said);
    }
}
