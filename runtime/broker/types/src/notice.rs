//! Notices for the user: a closed list, so that `status`, JSON and tests need not parse English text.

use std::fmt;

use qcbus_messages::control::Unseen;
use qcbus_messages::shown;

/// A notice for the user.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Notice {
    /// A process was rejected, with the reason.
    TurnedAway(String),
    /// A bundle or reporter has ended.
    Ended {
        /// Its name.
        name: String,
        /// How it ended.
        why: String,
    },
    /// The broker has ended the session of a bundle or reporter, and its process if the broker started it.
    Killed {
        /// Its name.
        name: String,
        /// Description of its fault.
        why: String,
    },
    /// A flapping bundle changes its registration repeatedly and is distrusted for a while.
    Flapping {
        /// Its name.
        name: String,
        /// Number of changes, and the end of the pause.
        why: String,
    },
    /// A child failed too often and is not restarted for a while.
    GaveUp {
        /// Its name.
        name: String,
        /// Number and kind of the failures.
        why: String,
    },
    /// The newer process of a child does not join. The older one continues.
    NotUpgraded {
        /// Its name.
        name: String,
        /// The reason.
        why: String,
    },
    /// There is no room for a file's image.
    NoRoom(String),
    /// A file cannot be read at the moment.
    NotRead(String),
    /// A result could not be written.
    NotWritten(String),
    /// A result could not be read back for a reporter.
    NotDelivered(String),
    /// A reporter has failed.
    NotReported {
        /// The reporter.
        name: String,
        /// The reason.
        why: String,
    },
    /// No process can join any more.
    Lost(String),
    /// A limit of the system is lower than may be needed.
    Limited(String),
    /// A notice about the watched directories.
    Watching(String),
    /// A notice about the configuration or the manifests.
    Loading(String),
    /// An accepted file is not published because of a file that it depends on.
    HeldBack(String),
    /// A notice about the journal or the results on the disk.
    Storing(String),
    /// A part of the watched directories cannot be read.
    Unseen(Unseen),
}

impl Notice {
    /// Returns the notice of a child that has ended.
    pub fn ended(name: &str, why: &str) -> Notice {
        let (name, why) = (name.to_owned(), why.to_owned());
        Notice::Ended { name, why }
    }

    /// Returns the notice of a child that was killed.
    pub fn killed(name: &str, why: &str) -> Notice {
        let (name, why) = (name.to_owned(), why.to_owned());
        Notice::Killed { name, why }
    }

    /// Returns the notice of a report that could not be written.
    pub fn not_reported(name: &str, why: String) -> Notice {
        let name = name.to_owned();
        Notice::NotReported { name, why }
    }

    /// Returns a word for programs. It never changes.
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

    /// Returns the bundle or reporter that the notice is about.
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

    /// Returns the text without the name of the bundle or reporter.
    pub fn why(&self) -> String {
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
    /// Writes the notice on one line, even if names or reasons contain line breaks.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shown::line(&self.text()))
    }
}

impl Notice {
    fn text(&self) -> String {
        match self {
            Notice::TurnedAway(reason) => format!("refused: {reason}"),
            Notice::Ended { name, why }
            | Notice::Killed { name, why }
            | Notice::Flapping { name, why } => format!("{name}: {why}"),
            Notice::GaveUp { name, why } => format!("{name} {why}"),
            Notice::NotUpgraded { name, why } => {
                format!("{name} is not upgraded, the previous process continues: {why}")
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
