//! Registration of bundles: limits the size of a catalogue and the rate of its changes. Every change causes all files
//! to be judged again, so a flapping bundle is accepted only at growing intervals.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::Catalogue;
use qcbus_messages::shown::moves;
use qcbus_types::{Launch, Notice, VersionDigest};

use super::bundles::Bundle;
use super::{Actions, State};

/// Maximum number of checkers of one bundle.
const MOST_CHECKERS: usize = 4096;
/// Maximum size of a catalogue in bytes. Each result holds the whole demanded part of it.
const MOST_OF_A_CATALOGUE: usize = 1 << 20;
/// Maximum length in bytes of a name in a catalogue: of a checker, a rule, a parameter and so on.
const MOST_OF_A_NAME: usize = 256;

/// Maximum number of names with remembered changes.
const MOST_FLAPPING: usize = 1024;
/// Key for all bundles together that the broker does not start itself. No bundle can have this name.
const EVERYBODY: &str = "";

/// Number of registration changes of one name.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Changes {
    /// Accepted changes since the name was last stable.
    changes: u32,
    /// Time of the last change.
    last: Duration,
}

/// Registration of a bundle that is not accepted yet.
#[derive(Debug)]
pub(super) struct Registration {
    catalogue: Arc<Catalogue>,
    /// Time from which it is accepted.
    at: Duration,
}

impl Changes {
    /// Returns the time from which the next change is accepted.
    fn next(&self, forgiven: u32, shortest: Duration, longest: Duration) -> Duration {
        let Some(beyond) = self.changes.checked_sub(forgiven) else {
            return self.last;
        };
        let pause = shortest.saturating_mul(1 << beyond.min(20));
        self.last + pause.min(longest)
    }

    fn is_over(&self, now: Duration, calm: Duration) -> bool {
        now.saturating_sub(self.last) > calm
    }
}

impl State {
    /// Handles the catalogue of a bundle.
    pub(super) fn catalogue(&mut self, name: &str, catalogue: Catalogue, actions: &mut Actions) {
        if let Some(why) = unsound(&catalogue) {
            return self.bundle_fails(name, &why, actions);
        }
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        if bundle.ready && bundle.catalogue.as_deref() == Some(&catalogue) {
            return;
        }
        let catalogue = Arc::new(catalogue);
        let waits_until = bundle.pending_registration.as_ref().map(|it| it.at);
        let version_digest = self.version_digest_of(name, bundle, &catalogue);
        let is_new = bundle.origin.is_none() && !self.is_shadow(name);
        let changes = bundle.version_digest != Some(version_digest) || is_new;
        let at = waits_until.or_else(|| changes.then(|| self.accepted_from(name, bundle)));
        match at.filter(|at| *at > self.now) {
            Some(at) => self.distrust(name, Registration { catalogue, at }, actions),
            None => self.accept(name, catalogue, actions),
        }
    }

    /// Accepts all registrations after the end of their pause.
    pub(super) fn accept_registrations(&mut self, actions: &mut Actions) {
        let now = self.now;
        let due = self.bundles.iter_mut().filter_map(|(name, bundle)| {
            let said = bundle.pending_registration.take_if(|it| it.at <= now)?;
            bundle.session?;
            Some((name.clone(), said.catalogue))
        });
        for (name, catalogue) in due.collect::<Vec<_>>() {
            self.accept(&name, catalogue, actions);
        }
    }

    fn accept(&mut self, name: &str, catalogue: Arc<Catalogue>, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        let changes =
            bundle.version_digest != Some(self.version_digest_of(name, bundle, &catalogue));
        if changes || (bundle.origin.is_none() && !self.is_shadow(name)) {
            self.note_change(name);
        }
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.catalogue = Some(catalogue);
            bundle.ready = true;
            bundle.pending_registration = None;
            bundle.note.clear();
            bundle.accepted_spec = bundle.launch.map(Launch::started);
            self.is_ready(name);
            self.enrol(name, actions);
        }
    }

    /// Keeps the registration of a flapping bundle for later. Until then the bundle must not judge
    /// under its old registration.
    fn distrust(&mut self, name: &str, said: Registration, actions: &mut Actions) {
        let changes = self.changes.get(name).map_or(0, |it| it.changes);
        let pause = said.at.saturating_sub(self.now).as_secs_f64();
        let why = if changes >= self.settings.changes_forgiven {
            format!(
                "it changed its version or checkers {changes} times, and everything was judged again each time; the \
                 next change is accepted in {pause:.1} s"
            )
        } else {
            format!(
                "too many unsupervised bundles join and change; its registration is accepted in {pause:.1} s"
            )
        };
        self.take_back(name, false);
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        bundle.ready = false;
        let is_news = bundle.pending_registration.replace(said).is_none();
        if is_news {
            bundle.note.clone_from(&why);
            let name = name.to_owned();
            self.notice(Notice::Flapping { name, why }, actions);
        }
        self.fail_missing();
    }

    /// Returns the version digest that the bundle would judge with.
    pub(super) fn version_digest_of(
        &self,
        name: &str,
        bundle: &Bundle,
        catalogue: &Catalogue,
    ) -> VersionDigest {
        let supervised = self.children.contains_key(name);
        let launch = bundle.launch.filter(|_| supervised);
        VersionDigest::of(&bundle.version, catalogue, launch.map(Launch::started))
    }

    /// Returns the time from which a change of this bundle is accepted.
    fn accepted_from(&self, name: &str, bundle: &Bundle) -> Duration {
        let settings = &self.settings;
        let started = bundle.launch.map(Launch::started);
        if self.children.contains_key(name) && bundle.accepted_spec != started {
            // The bundle did not cause the change: the user has changed the program that the broker starts.
            return self.now;
        }
        let of = |name: &str, forgiven: u32, longest: Duration| {
            let changes = self.changes.get(name);
            changes
                .filter(|it| !it.is_over(self.now, settings.calm_after))
                .map_or(self.now, |it| it.next(forgiven, settings.distrust, longest))
        };
        let own = of(name, settings.changes_forgiven, settings.distrust_max);
        if self.children.contains_key(name) {
            return own;
        }
        let all = settings.changes_forgiven.saturating_mul(8);
        // The pause of the common key stays short, because a well-behaved new bundle also waits for it.
        own.max(of(EVERYBODY, all, settings.distrust * 4))
    }

    fn note_change(&mut self, name: &str) {
        let (now, calm) = (self.now, self.settings.calm_after);
        self.changes.retain(|_, it| !it.is_over(now, calm));
        let joined = !self.children.contains_key(name);
        for of in [Some(name), joined.then_some(EVERYBODY)]
            .into_iter()
            .flatten()
        {
            if self.changes.len() < MOST_FLAPPING || self.changes.contains_key(of) {
                let changes = self.changes.entry(of.to_owned()).or_default();
                changes.changes = changes.changes.saturating_add(1);
                changes.last = now;
            }
        }
    }

    /// Returns the reason why a joined bundle gets no tasks: it is distrusted for the time being.
    /// `None` if it gets tasks.
    pub(super) fn is_flapping(&self, name: &str, bundle: &Bundle) -> Option<String> {
        bundle.pending_registration.as_ref()?;
        let in_the_registry = bundle.session.is_some() && bundle.origin.is_some();
        in_the_registry.then(|| format!("{name} gets no tasks for now: {}", bundle.note))
    }
}

/// Returns the reason why a catalogue is invalid, or `None`.
fn unsound(catalogue: &Catalogue) -> Option<String> {
    let ids: BTreeSet<&str> = catalogue.checkers.iter().map(|it| &*it.id).collect();
    if catalogue.checkers.len() > MOST_CHECKERS {
        let checkers = catalogue.checkers.len();
        return Some(format!(
            "its catalogue contains {checkers} checkers; at most {MOST_CHECKERS} are allowed"
        ));
    }
    if ids.len() < catalogue.checkers.len() || ids.contains("") {
        return Some("its catalogue contains a duplicate or empty checker id".to_owned());
    }
    let bytes = catalogue_weight(catalogue);
    if bytes > MOST_OF_A_CATALOGUE {
        return Some(format!(
            "its catalogue has {bytes} bytes; at most {MOST_OF_A_CATALOGUE} are allowed"
        ));
    }
    let mut names = names(catalogue);
    let odd = names.find(|name| name.len() > MOST_OF_A_NAME || name.chars().any(moves))?;
    let start: String = odd.chars().take(40).collect();
    Some(format!(
        "its catalogue contains the name {start:?}: names must have no control characters and at most \
         {MOST_OF_A_NAME} bytes"
    ))
}

/// Returns all names of a catalogue that results and users refer to.
fn names(catalogue: &Catalogue) -> impl Iterator<Item = &str> {
    let checkers = catalogue.checkers.iter().flat_map(|checker| {
        let params = checker.params.iter().map(|param| param.name.as_str());
        std::iter::once(&*checker.id)
            .chain(checker.rule_uids.iter().map(|uid| &**uid))
            .chain(params)
    });
    [&*catalogue.alias, &*catalogue.build_date]
        .into_iter()
        .chain(checkers)
}

/// Estimates the memory that a catalogue occupies.
fn catalogue_weight(catalogue: &Catalogue) -> usize {
    let texts = |texts: &[&str]| texts.iter().map(|text| 24 + text.len()).sum::<usize>();
    let kinds = |kinds: &[FileKind]| size_of_val(kinds);
    let checkers = catalogue.checkers.iter().map(|it| {
        let uids: Vec<&str> = it.rule_uids.iter().map(|uid| &**uid).collect();
        let params = it.params.iter();
        let params = params.map(|it| texts(&[&it.name, &it.default, &it.description]));
        64 + texts(&[&it.id, &it.description])
            + texts(&uids)
            + kinds(&it.kinds)
            + params.sum::<usize>()
    });
    let own = [
        catalogue.alias.as_str(),
        catalogue.description.as_str(),
        catalogue.build_date.as_str(),
    ];
    texts(&own) + kinds(&catalogue.kinds) + checkers.sum::<usize>()
}
