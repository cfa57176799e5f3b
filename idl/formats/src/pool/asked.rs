//! The number of checkers left out, as written in a result.

use std::fmt;

use super::Asked;
use crate::xqar::{CheckerBundle, Param, Results};

/// Name of the bundle's parameter with the number of checkers left out.
const PARAM: &str = "qcbus.notAsked";

/// The checkers of a bundle that a configuration left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotAsked {
    /// Name of the bundle.
    pub bundle: String,
    /// Number of checkers left out.
    pub left_out: usize,
    /// Total number of checkers.
    pub offered: usize,
}

impl NotAsked {
    /// Returns the entries of the bundles in a result, in order, if checkers were left out.
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
    /// Returns the bundle's parameter, if any checkers were left out.
    pub(super) fn to_param(self) -> Option<Param> {
        let left_out = self.offered.checked_sub(self.asked)?;
        (left_out > 0).then(|| Param {
            name: PARAM.to_owned(),
            value: format!("{left_out} of {}", self.offered),
        })
    }
}

impl fmt::Display for NotAsked {
    /// Writes text such as `251 of the 252 checkers of xodrBundle`.
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
