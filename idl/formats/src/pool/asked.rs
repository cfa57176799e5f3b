//! How little was asked, as it stands in a result.

use std::fmt;

use super::Asked;
use crate::xqar::{CheckerBundle, Param, Results};

/// Name of the bundle's parameter that says how many of its checkers were not asked.
const PARAM: &str = "qcbus.notAsked";

/// The checkers of a bundle that a configuration left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotAsked {
    /// Name of the bundle.
    pub bundle: String,
    /// How many were left out.
    pub left_out: usize,
    /// Of how many.
    pub offered: usize,
}

impl NotAsked {
    /// What the bundles of a result say, in its order; nothing of those that were asked everything.
    pub fn of(results: &Results) -> Vec<NotAsked> {
        results.bundles.iter().filter_map(of_bundle).collect()
    }
}

fn of_bundle(bundle: &CheckerBundle) -> Option<NotAsked> {
    let param = bundle.params.iter().find(|param| param.name == PARAM)?;
    let (left_out, offered) = param.value.split_once(" of ")?;
    Some(NotAsked {
        bundle: bundle.name.clone(),
        left_out: left_out.parse().ok()?,
        offered: offered.parse().ok()?,
    })
}

impl Asked {
    /// The bundle's parameter, when something was left out.
    pub(super) fn to_param(self) -> Option<Param> {
        let left_out = self.offered.checked_sub(self.asked)?;
        (left_out > 0).then(|| Param {
            name: PARAM.to_owned(),
            value: format!("{left_out} of {}", self.offered),
        })
    }
}

impl fmt::Display for NotAsked {
    /// `251 of the 252 checkers of xodrBundle`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NotAsked {
            bundle,
            left_out,
            offered,
        } = self;
        let plural = if *offered == 1 { "" } else { "s" };
        write!(f, "{left_out} of the {offered} checker{plural} of {bundle}")
    }
}
