//! What a reporter is told: read back from the stored result, so that a slow reporter costs disk
//! space and no memory.

use std::collections::BTreeMap;
use std::sync::Arc;

use qcbus_formats::config::{Config, reporter_for};
use qcbus_formats::xqar::{self, Param, Results};
use qcbus_messages::{DocId, ResultMessage};

use crate::core::Delivery;
use crate::places::Places;

/// Builds the message for one reporter.
///
/// # Errors
/// When the stored result cannot be read back; for a person.
pub fn message(
    reporter: &str,
    delivery: &Delivery,
    document: Option<DocId>,
    places: &Places,
    config: Option<&Arc<Config>>,
) -> Result<ResultMessage, String> {
    let judged = &delivery.judged;
    let fail = |error: &dyn std::fmt::Display| {
        format!(
            "cannot read {} back for {reporter}: {error}",
            judged.xqar.display()
        )
    };
    let bytes = std::fs::read(&judged.xqar).map_err(|error| fail(&error))?;
    let results = xqar::read(&bytes).map_err(|error| fail(&error))?;
    Ok(ResultMessage {
        job: delivery.job,
        input: delivery.path.to_string_lossy().into_owned(),
        display_path: places
            .display(&delivery.path)
            .to_string_lossy()
            .into_owned(),
        xqar: judged.xqar.to_string_lossy().into_owned(),
        verdict: judged.verdict,
        digest: judged.digest,
        config: judged.config,
        document,
        rules: broken_rules(&results),
        params: params_of(reporter, config),
        results,
    })
}

/// What the rules that were broken are about.
pub fn broken_rules(results: &Results) -> BTreeMap<String, String> {
    let checkers = results.bundles.iter().flat_map(|bundle| &bundle.checkers);
    let broken = checkers.flat_map(|checker| {
        checker
            .issues
            .iter()
            .map(|issue| (issue.rule_uid.clone(), checker.description.clone()))
    });
    broken.collect()
}

fn params_of(reporter: &str, config: Option<&Arc<Config>>) -> Vec<Param> {
    let Some(config) = config else {
        return Vec::new();
    };
    let mine = config.reports.iter().find(|report| {
        report.application == reporter || reporter_for(&report.application) == Some(reporter)
    });
    mine.map(|report| config.report_params(report))
        .unwrap_or_default()
}
