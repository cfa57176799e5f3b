//! How a bundle stands that somebody has added or changed, and what those offer that are there.

use std::collections::BTreeSet;

use qcbus_messages::control::{BundleReadiness, Offer, Readiness, Runs};

use super::State;
use super::bundles::Bundle;
use super::children::{Child, ChildState};

impl State {
    /// How the bundle of this name stands; `None` when nobody wants or knows one. What is said of it is of the very
    /// process that is wanted now: an older one that goes on beside it is told apart.
    pub fn readiness(&self, name: &str) -> Option<BundleReadiness> {
        let (child, bundle) = (self.children.get(name), self.bundles.get(name));
        if child.is_none() && bundle.is_none() {
            return None;
        }
        let runs = bundle.and_then(|it| self.runs(name, it));
        let is_the_one = child.is_none_or(Child::is_what_is_wanted);
        let readiness = match (&runs, self.hindrance(child, bundle)) {
            (Some(_), _) if is_the_one => Readiness::Ready,
            (_, Some(why)) => Readiness::Failing { why },
            _ => Readiness::Coming {
                joined: is_the_one && bundle.is_some_and(|it| it.session.is_some()),
            },
        };
        Some(BundleReadiness {
            name: name.to_owned(),
            readiness,
            runs,
            ..BundleReadiness::default()
        })
    }

    /// What the bundles offer that are there and heard.
    pub fn offers(&self) -> Vec<Offer> {
        let there = self.bundles.iter().filter(|(_, it)| it.is_heard());
        let offer = |(name, bundle): (&String, &Bundle)| {
            Some(Offer {
                name: name.clone(),
                version: bundle.version.clone(),
                catalogue: bundle.catalogue.as_deref()?.clone(),
            })
        };
        there.filter_map(offer).collect()
    }

    /// The bundle judges as what it is now: nothing is wrong with it any more.
    pub(super) fn is_ready(&mut self, name: &str) {
        let child = self.children.get_mut(name);
        if let Some(child) = child.filter(|it| it.is_what_is_wanted()) {
            child.failure = None;
        }
    }

    fn hindrance(&self, child: Option<&Child>, bundle: Option<&Bundle>) -> Option<String> {
        let flapping = bundle.filter(|it| it.registered.is_some());
        let flapping = flapping.map(|it| it.note.clone());
        child.and_then(|it| it.failure.clone()).or(flapping)
    }

    fn runs(&self, name: &str, bundle: &Bundle) -> Option<Runs> {
        let catalogue = bundle.catalogue.as_ref().filter(|_| bundle.is_heard())?;
        let mut demanded = BTreeSet::new();
        if self.demand.wants_bundle(name, &catalogue.alias) {
            let kinds = catalogue.kinds.iter();
            demanded.extend(kinds.flat_map(|kind| self.demand.checkers(name, catalogue, *kind)));
        }
        Some(Runs {
            version: bundle.version.clone(),
            pid: bundle.pid,
            checkers: catalogue.checkers.len() as u64,
            kinds: catalogue.kinds.clone(),
            demanded: demanded.len() as u64,
            shadow: self.is_shadow(name),
        })
    }
}

impl Child {
    /// Whether the process that has joined is the one that is wanted, and not an older one.
    pub fn is_what_is_wanted(&self) -> bool {
        self.state == ChildState::Joined && self.upgrade.is_none()
    }
}

impl Bundle {
    /// Whether it is there, has said what it checks, and stays.
    pub fn is_heard(&self) -> bool {
        self.session.is_some() && self.ready && !self.draining
    }
}
