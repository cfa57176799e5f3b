//! Compares a bundle with recorded results of ASAM's bundles, for tests.

mod findings;
mod parity;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use qcbus_document::Document;
use qcbus_formats::config::LEVELS_OF_ASAM;
use qcbus_formats::pool::CheckerOutcome;
use qcbus_formats::xqar::{Issue, Location};
use serde_json::Value;

use qcbus_sdk::run::examine;
use qcbus_sdk::{Bundle, LEVELS, Loaded, Plan};

pub use findings::print_findings;
pub use parity::{Deviations, Parity, agrees_or_says};

/// A case with an intended difference from the recorded result.
#[derive(Debug, Clone, Copy)]
pub struct Deviation {
    /// End of the input's path.
    pub input: &'static str,
    /// The checker.
    pub checker: &'static str,
    /// Reason why our result is correct.
    pub reason: &'static str,
}

/// One recorded result of one checker, compared with the current one.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Path of the input below `cases/asam`.
    pub input: String,
    /// The checker.
    pub checker: String,
    /// The difference; `None` if both agree.
    pub difference: Option<String>,
}

/// Returns the plan that ASAM's bundles are compared with.
fn by_levels_of_asam(bundle: &'static Bundle) -> Plan {
    Plan::new(
        bundle,
        |checker| checker.facts.default_on,
        |_, name| (name == LEVELS.name).then(|| LEVELS_OF_ASAM.to_owned()),
    )
}

/// Compares a bundle with the cases in `cases/asam-cases.json`; returns `None` if they are missing.
/// An input that several cases share is compared once.
///
/// # Errors
/// Returns an error for a file that cannot be read.
pub fn compare_asam_cases(
    bundle: &'static Bundle,
    cases: &Path,
) -> Result<Option<Vec<Comparison>>, String> {
    let Ok(text) = std::fs::read(cases.join("asam-cases.json")) else {
        return Ok(None);
    };
    let recorded: Vec<Value> =
        serde_json::from_slice(&text).map_err(|error| format!("asam-cases.json: {error}"))?;
    let plan = by_levels_of_asam(bundle);
    let (mut seen, mut comparisons) = (BTreeSet::new(), Vec::new());
    for case in recorded.iter().filter(|case| case["kind"] == bundle.alias) {
        let input = format!("{}/{}", text_of(&case["repo"]), text_of(&case["input"]));
        if !seen.insert(input.clone()) {
            continue;
        }
        let path = cases.join("asam").join(&input);
        let results = Compared::case(&plan, &path, &case["observed"]);
        let results = results.map_err(|error| format!("{input}: {error}"))?;
        comparisons.extend(results.into_iter().map(|(checker, difference)| Comparison {
            input: input.clone(),
            checker,
            difference,
        }));
    }
    Ok(Some(comparisons))
}

/// Compares a bundle with recorded results of ASAM's bundles on files of other projects: status and
/// number of issues by checker. The record is `cases/real-files.json`. Returns `None` if it is
/// missing.
///
/// If a schema finding caused the recorded checker to be skipped, our checker may run. Checkers
/// that no record mentions were not part of the recorded bundle.
///
/// # Errors
/// Returns an error for a file that cannot be read.
pub fn compare_real_files(
    bundle: &'static Bundle,
    cases: &Path,
) -> Result<Option<Vec<Comparison>>, String> {
    let Ok(text) = std::fs::read(cases.join("real-files.json")) else {
        return Ok(None);
    };
    let recorded: Vec<Value> =
        serde_json::from_slice(&text).map_err(|error| format!("real-files.json: {error}"))?;
    let known: BTreeSet<String> = recorded
        .iter()
        .flat_map(|file| mentioned(&file["peer"]))
        .collect();
    let plan = by_levels_of_asam(bundle);
    let mut comparisons = Vec::new();
    for file in recorded.iter().filter(|file| file["kind"] == bundle.alias) {
        let input = format!("{}/{}", text_of(&file["repo"]), text_of(&file["path"]));
        let path = cases.join("real").join(&input);
        if !path.exists() {
            continue;
        }
        let wrong = |error: String| format!("{input}: {error}");
        let folder = path.parent().unwrap_or(&path);
        let loaded = Loaded::from_path(&path, folder).map_err(|error| wrong(error.to_string()))?;
        let outcome = examine(&plan, &loaded).map_err(|error| wrong(error.to_string()))?;
        let peer = &file["peer"];
        let named = outcome
            .checkers
            .iter()
            .filter(|ours| known.contains(&*ours.id));
        comparisons.extend(named.map(|ours| Comparison {
            input: input.clone(),
            checker: ours.id.to_string(),
            difference: counted(peer, ours),
        }));
    }
    Ok(Some(comparisons))
}

/// Difference between a skipped checker and one that ran and found nothing.
pub(super) const NOTHING_THERE: &str = "recorded skipped, ours completed and found nothing";

fn looked_in_vain(theirs: &str, ours: &CheckerOutcome) -> bool {
    theirs == "skipped" && status_of(ours) == "completed" && ours.issues.is_empty()
}

/// Returns the checkers that the record of a file mentions. It does not mention those that ran and
/// found nothing.
fn mentioned(peer: &Value) -> Vec<String> {
    let skipped = peer["skipped"].as_array().into_iter().flatten();
    let tables = [&peer["issuesByChecker"], &peer["errors"]];
    let keys = tables
        .into_iter()
        .flat_map(|table| table.as_object().into_iter().flatten())
        .map(|(checker, _)| checker.clone());
    skipped
        .map(|checker| text_of(checker).to_owned())
        .chain(keys)
        .collect()
}

/// Returns the difference in status or number of issues.
fn counted(peer: &Value, ours: &CheckerOutcome) -> Option<String> {
    let skipped = |id: &str| {
        let all = peer["skipped"].as_array().into_iter().flatten();
        all.into_iter().any(|checker| checker == id)
    };
    let theirs = if skipped(&ours.id) {
        "skipped"
    } else if peer["errors"].get(&*ours.id).is_some() {
        "error"
    } else {
        "completed"
    };
    let status = status_of(ours);
    let schema = peer["issuesByChecker"].as_object().into_iter().flatten();
    let mut schema = schema.filter(|(checker, _)| checker.ends_with("valid_schema"));
    if theirs == "skipped" && status == "completed" && schema.next().is_some() {
        return None;
    }
    if looked_in_vain(theirs, ours) {
        return Some(NOTHING_THERE.to_owned());
    }
    let recorded = peer["issuesByChecker"][&*ours.id].as_u64().unwrap_or(0);
    let found = ours.issues.len() as u64;
    (theirs != status || recorded != found)
        .then(|| format!("recorded {theirs} with {recorded} issues, ours {status} with {found}"))
}

fn status_of(ours: &CheckerOutcome) -> &'static str {
    ours.status().as_str()
}

/// Fails the running test for every undeclared difference and every declared deviation that does
/// not occur.
///
/// # Panics
/// Panics in the cases above, and if nothing was compared.
#[expect(clippy::panic, reason = "it is an assertion for tests")]
pub fn settle(bundle: &Bundle, comparisons: &[Comparison], deviations: &[Deviation]) {
    let mut used = BTreeSet::new();
    let mut complaints = Vec::new();
    for comparison in comparisons {
        let Comparison { input, checker, .. } = comparison;
        let Some(difference) = &comparison.difference else {
            continue;
        };
        let declared = deviations
            .iter()
            .position(|deviation| input.ends_with(deviation.input) && deviation.checker == checker);
        match declared {
            Some(index) => _ = used.insert(index),
            None => complaints.push(format!("{input}: {checker}: {difference}")),
        }
    }
    let unused = deviations
        .iter()
        .enumerate()
        .filter(|(index, _)| !used.contains(index));
    complaints.extend(unused.map(|(_, deviation)| format!("no longer a deviation: {deviation:?}")));
    let compared = comparisons.len();
    crate::note(&format!(
        "{}: {compared} recorded results compared\n",
        bundle.alias
    ));
    if !complaints.is_empty() || compared == 0 {
        panic!(
            "{compared} compared, {} disagree:\n{}",
            complaints.len(),
            complaints.join("\n")
        );
    }
}

struct Compared<'c> {
    observed: &'c Value,
    document: Document<'c>,
}

impl Compared<'_> {
    /// Returns the difference of each checker; `None` if it agrees.
    fn case(
        plan: &Plan,
        input: &Path,
        observed: &Value,
    ) -> Result<BTreeMap<String, Option<String>>, String> {
        let folder = input.parent().unwrap_or(input);
        let loaded = Loaded::from_path(input, folder).map_err(|error| error.to_string())?;
        let outcome = examine(plan, &loaded).map_err(|error| error.to_string())?;
        let subject = loaded
            .subject(plan.bundle())
            .map_err(|error| error.to_string())?;
        let compared = Compared {
            observed,
            document: subject.root(),
        };
        let known = outcome
            .checkers
            .iter()
            .filter(|ours| observed["status"].get(&*ours.id).is_some());
        Ok(known
            .map(|ours| (ours.id.to_string(), compared.checker(ours)))
            .collect())
    }

    fn checker(&self, ours: &CheckerOutcome) -> Option<String> {
        let theirs = text_of(&self.observed["status"][&*ours.id]);
        let status = status_of(ours);
        if theirs == "skipped" && status == "completed" && self.schema_silenced() {
            return None;
        }
        if looked_in_vain(theirs, ours) {
            return Some(NOTHING_THERE.to_owned());
        }
        if theirs != status {
            return Some(format!(
                "recorded {theirs}, ours {status} ({})",
                ours.reason()
            ));
        }
        let recorded = self.recorded_issues(&ours.id);
        let levels = |issues: &mut dyn Iterator<Item = u64>| {
            let mut levels: Vec<u64> = issues.collect();
            levels.sort_unstable();
            levels
        };
        let their_levels = levels(&mut recorded.iter().filter_map(|issue| issue["level"].as_u64()));
        let our_levels = levels(&mut ours.issues.iter().map(|issue| issue.level as u64));
        if their_levels != our_levels {
            return Some(format!(
                "levels recorded {their_levels:?}, ours {our_levels:?}"
            ));
        }
        let theirs = self.their_places(&recorded);
        let ours: Vec<Vec<String>> = ours.issues.iter().map(|one| self.our_places(one)).collect();
        // Our checker may name more places, such as the link between two lanes.
        let found = theirs
            .iter()
            .all(|place| ours.iter().flatten().any(|our| our == place));
        let main = ours.iter().all(|places| {
            let first = places.iter().take(2);
            places.is_empty() || first.clone().any(|place| theirs.contains(place))
        });
        (!found || !main).then(|| format!("places recorded {theirs:?}, ours {ours:?}"))
    }

    /// Checks whether the recorded run skipped all checkers after that of the schema.
    fn schema_silenced(&self) -> bool {
        let status = self.observed["status"].as_object().into_iter().flatten();
        let schema = status.filter(|(id, _)| id.ends_with("valid_schema"));
        schema
            .into_iter()
            .any(|(id, status)| status != "completed" || !self.recorded_issues(id).is_empty())
    }

    fn recorded_issues(&self, checker: &str) -> Vec<&Value> {
        let all = self.observed["issues"].as_array().into_iter().flatten();
        let of_checker = all.filter(|entry| entry["checkerId"] == checker);
        of_checker
            .flat_map(|entry| entry["issues"].as_array().into_iter().flatten())
            .collect()
    }

    /// Returns the places of issues: the elements selected by the XPaths, or the row if there are
    /// none.
    fn their_places(&self, issues: &[&Value]) -> BTreeSet<String> {
        let mut places = BTreeSet::new();
        for issue in issues {
            let locations = issue["locations"].as_array().into_iter().flatten();
            let xpaths = locations.flat_map(|one| one["xpath"].as_array().into_iter().flatten());
            let selected: Vec<String> = xpaths.map(|xpath| self.node(text_of(xpath))).collect();
            if selected.is_empty() {
                places.insert(format!("row {}", issue["locations"][0]["file"][0][0]));
            }
            places.extend(selected);
        }
        places
    }

    /// Returns the places of an issue: each row and, if it exists, each element.
    fn our_places(&self, issue: &Issue) -> Vec<String> {
        let all = issue.locations.iter().flat_map(|one| &one.places);
        let places = all.filter_map(|place| match place {
            Location::File { row, .. } => Some(format!("row {row}")),
            Location::Xml { xpath } => Some(self.node(xpath)),
            _ => None,
        });
        places.collect()
    }

    fn node(&self, xpath: &str) -> String {
        let selected = self.document.evaluate(xpath).ok();
        let first = selected.as_ref().and_then(|nodes| nodes.first());
        first.map_or_else(
            || format!("nothing at {xpath}"),
            |node| node.positional_xpath(),
        )
    }
}

fn text_of(value: &Value) -> &str {
    value.as_str().unwrap_or("")
}
