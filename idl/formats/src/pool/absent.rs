//! What the configuration demands and nobody offers.

use super::{BundleOutcome, CheckerOutcome, Ending};
use crate::Text;
use crate::config::{BundleConfig, published_name};
use crate::distance::did_you_mean;

/// The checker that stands for a whole bundle when the configuration names none of its checkers.
const WHOLE_BUNDLE: &str = "qcbus_bundle_is_there";

/// The outcome of a bundle that is not there: each of its configured checkers is in error. `why` is
/// known when somebody waited for it.
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
        description: String::from("Configured, and not there."),
        checkers,
        ..BundleOutcome::default()
    }
}

/// The outcome of a bundle that must take part without being configured, and is not there.
pub(super) fn demanded(why: String) -> BundleOutcome {
    BundleOutcome {
        description: String::from("Demanded, and not there."),
        checkers: vec![whole(why)],
        ..BundleOutcome::default()
    }
}

fn whole(reason: String) -> CheckerOutcome {
    CheckerOutcome {
        description: "The bundle that must take part does.".into(),
        ..failed(WHOLE_BUNDLE, reason)
    }
}

/// The outcome of a configured checker that its bundle does not have.
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
        description: "Configured, and not there.".into(),
        ending: Some(Ending::Failed { reason }),
        ..CheckerOutcome::default()
    }
}
