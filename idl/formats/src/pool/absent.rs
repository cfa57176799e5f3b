//! Outcomes for configured bundles and checkers that are missing.

use super::{BundleOutcome, CheckerOutcome, Ending};
use crate::Text;
use crate::config::{BundleConfig, published_name};
use crate::distance::did_you_mean;

/// Checker that represents a whole bundle when the configuration names none of its checkers.
const WHOLE_BUNDLE: &str = "qcbus_bundle_is_there";

/// Returns the outcome of a missing bundle: each of its configured checkers is in error. `why` is
/// set when the broker waited for the bundle.
pub(super) fn bundle(config: &BundleConfig, why: Option<String>) -> BundleOutcome {
    let application = &config.application;
    let reason =
        why.unwrap_or_else(|| format!("no bundle `{application}` took part in this check"));
    let configured = config.checkers.iter();
    let mut checkers: Vec<CheckerOutcome> = configured
        .map(|checker| failed(&checker.id, reason.clone()))
        .collect();
    if checkers.is_empty() {
        checkers.push(whole(reason));
    }
    BundleOutcome {
        name: published_name(application)
            .unwrap_or(application)
            .to_owned(),
        description: String::from("Configured, but not available."),
        checkers,
        ..BundleOutcome::default()
    }
}

/// Returns the outcome of a missing bundle that is required but not configured.
pub(super) fn required(why: String) -> BundleOutcome {
    BundleOutcome {
        description: String::from("Required, but not available."),
        checkers: vec![whole(why)],
        ..BundleOutcome::default()
    }
}

fn whole(reason: String) -> CheckerOutcome {
    CheckerOutcome {
        description: "The required bundle takes part.".into(),
        ..failed(WHOLE_BUNDLE, reason)
    }
}

/// Returns the outcome of a configured checker that its bundle does not have.
pub(super) fn checker(id: &str, bundle: &str, there: &[Text]) -> CheckerOutcome {
    let hint = did_you_mean(id, there.iter().map(|it| &**it));
    failed(
        id,
        format!("bundle `{bundle}` has no checker of this name{hint}"),
    )
}

fn failed(id: &str, reason: String) -> CheckerOutcome {
    CheckerOutcome {
        id: id.into(),
        description: "Configured, but not available.".into(),
        ending: Some(Ending::Failed { reason }),
        ..CheckerOutcome::default()
    }
}
