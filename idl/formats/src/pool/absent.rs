//! What the configuration demands and nobody offers.

use super::{BundleOutcome, CheckerOutcome};
use crate::config::{BundleConfig, published_name};
use crate::distance::did_you_mean;
use crate::xqar::Status;

/// The checker that stands for a whole bundle when the configuration names none of its checkers.
const WHOLE_BUNDLE: &str = "qcbus_bundle_is_there";

/// The outcome of a bundle that is not there: each of its configured checkers is in error.
pub(super) fn bundle(config: &BundleConfig) -> BundleOutcome {
    let application = &config.application;
    let reason = format!("no bundle `{application}` took part in this check");
    let checkers = if config.checkers.is_empty() {
        let mut checker = failed(WHOLE_BUNDLE, reason);
        checker.description = String::from("The bundle that the configuration names takes part.");
        vec![checker]
    } else {
        config
            .checkers
            .iter()
            .map(|checker| failed(&checker.id, reason.clone()))
            .collect()
    };
    BundleOutcome {
        name: published_name(application)
            .unwrap_or(application)
            .to_owned(),
        description: String::from("Configured, and not there."),
        checkers,
        ..BundleOutcome::default()
    }
}

/// The outcome of a configured checker that its bundle does not have.
pub(super) fn checker(id: &str, bundle: &str, there: &[String]) -> CheckerOutcome {
    let hint = did_you_mean(id, there.iter().map(String::as_str));
    failed(
        id,
        format!("bundle `{bundle}` has no checker of this name{hint}"),
    )
}

fn failed(id: &str, reason: String) -> CheckerOutcome {
    CheckerOutcome {
        id: id.to_owned(),
        description: String::from("Configured, and not there."),
        status: Some(Status::Error),
        reason,
        ..CheckerOutcome::default()
    }
}
