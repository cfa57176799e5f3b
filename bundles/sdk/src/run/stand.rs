//! The process context of a bundle on the bus, with its sandbox if there is one.

use std::path::{Path, PathBuf};
use std::time::Duration;

use qcbus_bus::{Instance, PeerOptions, SendSide};
use qcbus_confine::{After, Orders, Sandboxed, run_sessions};
use qcbus_formats::manifest::May;

use super::file::complain;
use super::{Exit, OwnFiles};

/// What follows a session.
pub(super) enum Ended {
    /// The process ends.
    With(Exit),
    /// Another session in a fresh process, because this process may not join again.
    Again,
}

/// Context of one session.
pub(super) struct Stand<'a> {
    pub instance: &'a Instance,
    /// Number of earlier sessions.
    number: u32,
    /// Permissions that its manifest declares. `None` if it is not confined.
    may: Option<&'a May>,
    /// Whether a broker started this process and ends it when it ends itself.
    is_bound: bool,
}

impl Stand<'_> {
    /// Returns the options with the waiting time. After a lost session, the bundle waits for
    /// another broker. A broker that started this process may not be ready itself, so the time is
    /// the same.
    pub(super) fn options(&self) -> PeerOptions {
        let usual = PeerOptions::default();
        let patience: Duration = if self.number == 0 && !self.is_bound {
            usual.patience
        } else {
            usual.grace
        };
        PeerOptions {
            patience,
            rejoins: self.may.is_none(),
            ..usual
        }
    }

    /// Confines this process, which may then read only `reads` and its own files. Returns `None` if
    /// it is not to be confined.
    pub(super) fn confine(
        &self,
        memory: Option<&Path>,
        reads: impl FnOnce() -> Vec<PathBuf>,
        own: &OwnFiles,
    ) -> Option<Sandbox> {
        let may = self.may?;
        let sandboxed = Sandboxed {
            memory: memory.map(Path::to_path_buf),
            reads: [reads(), own.reads.clone()].concat(),
            lists: own.lists.clone(),
            may: if own.restricted {
                May::default()
            } else {
                may.clone()
            },
        };
        // The identities are recorded before the process is confined. A file that changes in
        // between counts as another one, and a fresh process reads it.
        let sandbox = Sandbox::around(&sandboxed.reads);
        if let Err(error) = qcbus_confine::confine(&sandboxed) {
            tracing::warn!(%error, "this bundle is not fully confined");
        }
        Some(sandbox)
    }
}

/// Files and directories that a confined process may read, with their identities at the time of
/// confinement.
pub(super) struct Sandbox(Vec<(PathBuf, Identity)>);

/// Device and inode.
type Identity = (u64, u64);

impl Sandbox {
    fn around(paths: &[PathBuf]) -> Sandbox {
        let known = |path: &PathBuf| Some((path.clone(), identity(path)?));
        Sandbox(paths.iter().filter_map(known).collect())
    }

    /// Returns whether the path now holds a file that only a fresh process may read. `stat` always
    /// works.
    pub(super) fn keeps_out(&self, path: &Path) -> bool {
        let known = self.0.iter().find(|(known, _)| known == path);
        identity(path).is_some_and(|now| known.is_none_or(|(_, then)| *then != now))
    }
}

fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    let found = std::fs::metadata(path).ok()?;
    Some((found.dev(), found.ino()))
}

/// Number of sessions and the party that ends them.
pub(super) struct Sessions {
    /// The process serves a single broker only.
    pub only_one: bool,
    /// A broker ends the sessions, not a person.
    pub supervised: bool,
    /// The bundle is not confined.
    pub unfenced: bool,
}

/// Runs sessions. Each has its own process if bundles are confined and there may be more than one
/// session. Otherwise all run in this process.
pub(super) fn sandboxed(
    instance: &Instance,
    sessions: &Sessions,
    session: impl Fn(Stand<'_>) -> Ended,
) -> Exit {
    let orders = match Orders::given() {
        Ok(Orders::On(may)) if !sessions.unfenced => Some(may),
        Ok(_) => None,
        Err(error) => {
            complain(&format!("{error}\n"));
            return Exit::Usage;
        }
    };
    let voice = SendSide::take();
    let stand = |number, may| Stand {
        instance,
        number,
        may,
        is_bound: sessions.only_one,
    };
    let once = |may| match session(stand(0, may)) {
        Ended::With(exit) => exit,
        // This process cannot run another session. A supervisor restarts it.
        Ended::Again => Exit::NoBroker,
    };
    let Some(may) = &orders else {
        return once(None);
    };
    if sessions.only_one {
        return once(Some(may));
    }
    // The launcher process outlives the broker. Only the first session still sends its output to
    // the broker that started it.
    voice.iter().for_each(SendSide::lasts);
    let ended = run_sessions(!sessions.supervised, |number| {
        voice
            .iter()
            .filter(|_| number == 0)
            .for_each(SendSide::is_heard);
        match session(stand(number, Some(may))) {
            Ended::With(exit) => After::End(exit.code()),
            Ended::Again => After::Again,
        }
    });
    match ended {
        Ok(ended) => ended.end(),
        Err(error) => tracing::warn!(%error, "this bundle is not confined"),
    }
    once(None)
}
