//! Readiness of bundles that a user has added or changed, and the catalogues of joined bundles.

use std::collections::BTreeSet;

use qcbus_messages::control::{BundleReadiness, Offer, Readiness, Runs};

use super::State;
use super::bundles::Bundle;
use super::children::{Child, ChildState};

impl State {
    /// Returns the readiness of the bundle with this name, or `None` if it is neither wanted nor known. It describes
    /// the process that is wanted now, and distinguishes it from an older one that is still running.
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

    /// Returns the catalogues of all ready bundles.
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

    /// Clears the failure of a bundle that now judges in its current version.
    pub(super) fn is_ready(&mut self, name: &str) {
        let child = self.children.get_mut(name);
        if let Some(child) = child.filter(|it| it.is_what_is_wanted()) {
            child.failure = None;
        }
    }

    fn hindrance(&self, child: Option<&Child>, bundle: Option<&Bundle>) -> Option<String> {
        let flapping = bundle.filter(|it| it.pending_registration.is_some());
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
    /// Checks whether the joined process is the wanted one, and not an older one.
    pub fn is_what_is_wanted(&self) -> bool {
        self.state == ChildState::Joined && self.upgrade.is_none()
    }
}

impl Bundle {
    /// Checks whether the bundle is connected, has sent its catalogue and is not draining.
    pub fn is_heard(&self) -> bool {
        self.session.is_some() && self.ready && !self.draining
    }
}
