//! Required sets: the bundles that must judge a file, and the bundles that did.

use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_messages::Catalogue;
use sha2::{Digest as _, Sha256};

/// Counter of changes of the required bundles or of the demand on them. The upper half exceeds all
/// values in the journal, so a number never repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Epoch(pub u64);

impl Epoch {
    /// Returns the first epoch of a broker's numbers (`Settings::numbers`).
    pub fn first_of(numbers: u64) -> Epoch {
        Epoch(numbers << 32)
    }

    /// Returns the following epoch.
    pub fn next(self) -> Epoch {
        Epoch(self.0 + 1)
    }
}

/// Version digest of a bundle. It distinguishes versions and catalogues that may judge differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VersionDigest(pub u64);

impl VersionDigest {
    /// Returns the digest of a version and its catalogue. For a child it includes the program that
    /// its manifest starts, because scripts and arguments change without a new version.
    pub fn of(version: &str, catalogue: &Catalogue, started: Option<u64>) -> VersionDigest {
        let mut hash = Hash::default();
        hash.list(started, |hash, it| hash.0.update(it.to_le_bytes()));
        hash.text(version);
        hash.text(&catalogue.build_date);
        hash.text(&catalogue.alias);
        hash.kinds(&catalogue.kinds);
        hash.list(&catalogue.checkers, |hash, checker| {
            hash.text(&checker.id);
            hash.list(checker.rule_uids.iter(), |hash, uid| hash.text(uid));
            hash.0.update([u8::from(checker.default_on)]);
            hash.kinds(&checker.kinds);
            // Another default value gives another result.
            hash.list(&checker.params, |hash, param| {
                hash.text(&param.name);
                hash.text(&param.default);
            });
        });
        let digest = hash.0.finalize();
        let first = digest.iter().take(8);
        VersionDigest(first.fold(0, |number, byte| (number << 8) | u64::from(*byte)))
    }
}

/// Hash over parts that cannot be confused with each other. A text begins with its length, and each
/// part of a list with a marker byte.
#[derive(Default)]
struct Hash(Sha256);

impl Hash {
    fn text(&mut self, text: &str) {
        self.0.update((text.len() as u64).to_le_bytes());
        self.0.update(text);
    }

    fn kinds(&mut self, kinds: &[FileKind]) {
        self.list(kinds, |hash, kind| hash.0.update([*kind as u8]));
    }

    fn list<T>(&mut self, parts: impl IntoIterator<Item = T>, each: impl Fn(&mut Hash, T)) {
        for part in parts {
            self.0.update([1]);
            each(self, part);
        }
        self.0.update([0]);
    }
}

/// One required bundle of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequiredBundle {
    /// Its name.
    pub name: String,
    /// Its version digest when it judged. `None` if the bundle was missing.
    pub version_digest: Option<VersionDigest>,
}

/// The required bundles of a file, by name. A verdict is valid as long as its required set stays the same.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RequiredSet(pub Vec<RequiredBundle>);

impl RequiredSet {
    /// Returns an unknown required set. No verdict of this set is valid.
    pub fn unknown() -> RequiredSet {
        // No peer may have this name.
        let name = "?".to_owned();
        RequiredSet(vec![RequiredBundle {
            name,
            version_digest: None,
        }])
    }
}

/// Requirement: a bundle that must currently judge files of one kind.
#[derive(Debug, Clone)]
pub struct Requirement {
    /// Its name.
    pub name: String,
    /// Its version, or an empty text if it was never seen.
    pub version: String,
    /// `None` if the bundle was never seen, so its checkers are unknown.
    pub catalogue: Option<Arc<Catalogue>>,
    /// Its version digest, or `None` if it is missing.
    pub version_digest: Option<VersionDigest>,
    /// Indexes of the checkers that must run.
    pub demanded: Arc<[u32]>,
}

/// Reason why a bundle is in the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Origin {
    /// It has a manifest or belongs to the program. It leaves the registry with its manifest.
    Supervised,
    /// It was started by another process and has joined. It leaves by draining or when a user removes it.
    Joined,
}

impl Origin {
    /// Returns the word for the journal.
    pub fn as_str(self) -> &'static str {
        match self {
            Origin::Supervised => "supervised",
            Origin::Joined => "joined",
        }
    }

    /// Returns the origin for a word of the journal.
    pub fn of(word: &str) -> Option<Origin> {
        let all = [Origin::Supervised, Origin::Joined];
        all.into_iter().find(|it| it.as_str() == word)
    }
}

/// Entry of the registry as stored in the journal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// The version that joined last.
    pub version: String,
    /// Its catalogue at that time, if that can still be read.
    pub catalogue: Option<Arc<Catalogue>>,
    /// Reason for the entry.
    pub origin: Origin,
}

#[cfg(test)]
mod tests {
    use qcbus_document::FileKind;
    use qcbus_formats::pool::RuleUids;
    use qcbus_formats::xqar::Level;
    use qcbus_messages::{CheckerInfo, ParamInfo};

    use super::*;

    #[test]
    fn unknown_required_set_differs_from_empty_set() {
        // The empty set is required for a kind of file that no bundle checks.
        assert_ne!(RequiredSet::unknown(), RequiredSet::default());
    }

    #[test]
    fn epochs_increase_over_every_restart() {
        let (first, second) = (Epoch::first_of(1), Epoch::first_of(2));
        assert!(Epoch::default() < first && first < first.next());
        assert!(first.next().next() < second);
    }

    #[test]
    fn every_catalogue_change_changes_the_version_digest() {
        let checker = CheckerInfo {
            id: "one".into(),
            description: "".into(),
            rule_uids: ["uid"].into_iter().collect(),
            kinds: vec![FileKind::Xodr],
            default_on: true,
            level: Level::Error,
            params: vec![ParamInfo {
                name: "tolerance".to_owned(),
                default: "1".to_owned(),
                description: String::new(),
            }],
        };
        let catalogue = Catalogue {
            alias: "mine".to_owned(),
            build_date: "2026-11-22".to_owned(),
            kinds: vec![FileKind::Xodr],
            checkers: vec![checker],
            ..Catalogue::default()
        };
        let changes: [fn(&mut Catalogue); 8] = [
            |it| it.alias.push('r'),
            |it| it.build_date.push('1'),
            |it| it.kinds.push(FileKind::Xosc),
            |it| it.checkers[0].id = "oner".into(),
            |it| it.checkers[0].rule_uids = RuleUids::default(),
            |it| it.checkers[0].kinds.push(FileKind::Xosc),
            |it| it.checkers[0].default_on = false,
            |it| it.checkers[0].params[0].default.push('0'),
        ];
        let mut version_digests = vec![
            VersionDigest::of("1", &catalogue, None),
            VersionDigest::of("2", &catalogue, None),
            VersionDigest::of("1", &catalogue, Some(7)),
            VersionDigest::of("1", &catalogue, Some(8)),
        ];
        for change in changes {
            let mut changed = catalogue.clone();
            change(&mut changed);
            version_digests.push(VersionDigest::of("1", &changed, None));
        }
        assert_eq!(VersionDigest::of("1", &catalogue, None), version_digests[0]);
        // All bits of a version digest must distinguish bundles.
        let halves = |shift: u32| {
            version_digests
                .iter()
                .map(move |it| it.0 >> shift & 0xffff_ffff)
        };
        for shift in [0, 32] {
            let different: std::collections::BTreeSet<u64> = halves(shift).collect();
            assert_eq!(different.len(), version_digests.len());
        }
    }
}
