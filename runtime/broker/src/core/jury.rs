//! Who must judge a file, and who did.

use std::sync::Arc;

use qcbus_messages::Catalogue;
use sha2::{Digest as _, Sha256};

/// Counts up with every change of who must judge, or of what is demanded of them. The upper half
/// is the broker's generation, so that a number never comes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Epoch(pub u64);

impl Epoch {
    /// The first epoch of a broker's generation.
    pub fn first_of(generation: u64) -> Epoch {
        Epoch(generation << 32)
    }

    pub(super) fn next(self) -> Epoch {
        Epoch(self.0 + 1)
    }
}

/// Tells apart versions and catalogues of a bundle: with another one it judges otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mark(pub u64);

impl Mark {
    /// The mark of a version with what it offers.
    pub fn of(version: &str, catalogue: &Catalogue) -> Mark {
        let mut hash = Sha256::new();
        hash.update(format!("{version}\0{}\0", catalogue.build_date));
        for checker in &catalogue.checkers {
            let (id, uids, on) = (&checker.id, &checker.rule_uids, checker.default_on);
            hash.update(format!("{id}\0{uids:?}\0{on}\0"));
            // Another default is another result.
            for param in &checker.params {
                hash.update(format!("{}={}\0", param.name, param.default));
            }
        }
        let digest = hash.finalize();
        let first = digest.iter().take(8);
        Mark(first.fold(0, |number, byte| (number << 8) | u64::from(*byte)))
    }
}

/// One bundle that had to judge a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Juror {
    /// Its name.
    pub name: String,
    /// What it judged as; `None`: it was not there.
    pub mark: Option<Mark>,
}

/// The bundles that had to judge a file, by name. A verdict stands as long as the same must.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Jury(pub Vec<Juror>);

impl Jury {
    /// Nobody knows who judged: no verdict of this jury stands.
    pub fn unknown() -> Jury {
        // No peer may be called so.
        let name = "?".to_owned();
        Jury(vec![Juror { name, mark: None }])
    }
}

/// A bundle that must judge files of a kind, as things are now.
#[derive(Debug, Clone)]
pub(super) struct Seat {
    pub name: String,
    pub version: String,
    /// `None`: nobody has seen it, so nobody knows what it checks.
    pub catalogue: Option<Arc<Catalogue>>,
    pub mark: Option<Mark>,
    /// Indexes of the checkers that are to run.
    pub demanded: Vec<u32>,
}

/// What brought a bundle onto the roster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Origin {
    /// A manifest, or it comes with the program: it leaves with its manifest.
    Supervised,
    /// It was started by somebody and joined: it leaves by drain, or when somebody removes it.
    Joined,
}

impl Origin {
    /// The word in the journal.
    pub fn as_str(self) -> &'static str {
        match self {
            Origin::Supervised => "supervised",
            Origin::Joined => "joined",
        }
    }

    /// The origin of this word.
    pub fn of(word: &str) -> Option<Origin> {
        let all = [Origin::Supervised, Origin::Joined];
        all.into_iter().find(|it| it.as_str() == word)
    }
}

/// A bundle on the roster, as the journal remembers it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// The version that joined last.
    pub version: String,
    /// What it offered then, if that can still be read.
    pub catalogue: Option<Arc<Catalogue>>,
    /// What brought it.
    pub origin: Origin,
}
