//! What a person should read: a closed list, so that `status`, JSON and tests need not read English.

use std::fmt;

use qcbus_messages::control::Unseen;
use qcbus_messages::shown;

/// Something that a person should read.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Notice {
    /// A process may not take part, and why.
    TurnedAway(String),
    /// A bundle or reporter has ended.
    Ended {
        /// Its name.
        name: String,
        /// How.
        why: String,
    },
    /// The broker has ended the session of a bundle or reporter, and its process where it started it.
    Killed {
        /// Its name.
        name: String,
        /// What it did wrong.
        why: String,
    },
    /// A bundle changes what it is all the time, and is not believed for a while.
    Flapping {
        /// Its name.
        name: String,
        /// How often, and until when.
        why: String,
    },
    /// A child failed too often and is left alone for a while.
    GaveUp {
        /// Its name.
        name: String,
        /// How often, and how it failed.
        why: String,
    },
    /// The newer process of a child does not join; the older goes on.
    NotUpgraded {
        /// Its name.
        name: String,
        /// Why.
        why: String,
    },
    /// There is no room for a file's image.
    NoRoom(String),
    /// A file cannot be read for now.
    NotRead(String),
    /// A result could not be written.
    NotWritten(String),
    /// A result could not be read back for a reporter.
    NotDelivered(String),
    /// A reporter could not do its work.
    NotReported {
        /// The reporter.
        name: String,
        /// Why.
        why: String,
    },
    /// Nobody can join any more.
    Lost(String),
    /// What the system allows is less than may be needed.
    Limited(String),
    /// Of the directories that are watched.
    Watching(String),
    /// Of the configuration and the manifests.
    Loading(String),
    /// An accepted file is not published, because of something that it depends on.
    HeldBack(String),
    /// Of the journal and the results on the disk.
    Storing(String),
    /// Something in the directories that are looked at cannot be looked at.
    Unseen(Unseen),
}

impl Notice {
    pub(super) fn ended(name: &str, why: &str) -> Notice {
        let (name, why) = (name.to_owned(), why.to_owned());
        Notice::Ended { name, why }
    }

    pub(super) fn killed(name: &str, why: &str) -> Notice {
        let (name, why) = (name.to_owned(), why.to_owned());
        Notice::Killed { name, why }
    }

    pub(super) fn not_reported(name: &str, why: String) -> Notice {
        let name = name.to_owned();
        Notice::NotReported { name, why }
    }

    /// A word for programs, which never changes.
    pub fn kind(&self) -> &'static str {
        match self {
            Notice::TurnedAway(_) => "turned-away",
            Notice::Ended { .. } => "ended",
            Notice::Killed { .. } => "killed",
            Notice::Flapping { .. } => "flapping",
            Notice::GaveUp { .. } => "gave-up",
            Notice::NotUpgraded { .. } => "not-upgraded",
            Notice::NoRoom(_) => "no-room",
            Notice::NotRead(_) => "not-read",
            Notice::NotWritten(_) => "not-written",
            Notice::NotDelivered(_) => "not-delivered",
            Notice::NotReported { .. } => "not-reported",
            Notice::Lost(_) => "lost",
            Notice::Limited(_) => "limited",
            Notice::Watching(_) => "watching",
            Notice::Loading(_) => "loading",
            Notice::HeldBack(_) => "held-back",
            Notice::Storing(_) => "storing",
            Notice::Unseen(_) => "unseen",
        }
    }

    /// The bundle or reporter that it is about.
    pub fn about(&self) -> Option<&str> {
        match self {
            Notice::Ended { name, .. }
            | Notice::Killed { name, .. }
            | Notice::Flapping { name, .. }
            | Notice::GaveUp { name, .. }
            | Notice::NotUpgraded { name, .. }
            | Notice::NotReported { name, .. } => Some(name),
            _ => None,
        }
    }

    /// What it says, without whom it is about.
    pub(super) fn why(&self) -> String {
        match self {
            Notice::Ended { why, .. }
            | Notice::Killed { why, .. }
            | Notice::Flapping { why, .. }
            | Notice::GaveUp { why, .. }
            | Notice::NotUpgraded { why, .. }
            | Notice::NotReported { why, .. } => why.clone(),
            other => other.to_string(),
        }
    }
}

impl fmt::Display for Notice {
    /// On one line, whoever has chosen the names and reasons in it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shown::line(&self.text()))
    }
}

impl Notice {
    fn text(&self) -> String {
        match self {
            Notice::TurnedAway(reason) => format!("turned away: {reason}"),
            Notice::Ended { name, why }
            | Notice::Killed { name, why }
            | Notice::Flapping { name, why } => format!("{name}: {why}"),
            Notice::GaveUp { name, why } => format!("{name} {why}"),
            Notice::NotUpgraded { name, why } => {
                format!("{name} is not upgraded, the process before goes on: {why}")
            }
            Notice::NotReported { name, why } => format!("{name} {why}"),
            Notice::NoRoom(text)
            | Notice::NotRead(text)
            | Notice::NotWritten(text)
            | Notice::NotDelivered(text)
            | Notice::Lost(text)
            | Notice::Limited(text)
            | Notice::Watching(text)
            | Notice::Loading(text)
            | Notice::HeldBack(text)
            | Notice::Storing(text) => text.clone(),
            Notice::Unseen(unseen) => unseen.to_string(),
        }
    }
}
