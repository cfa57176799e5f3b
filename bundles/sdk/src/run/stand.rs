//! Where a bundle stands while it is on the bus: inside its sandbox, if there is one.

use std::path::{Path, PathBuf};
use std::time::Duration;

use qcbus_bus::{Instance, PeerOptions, SendSide};
use qcbus_confine::{After, Orders, Sandboxed, run_sessions};
use qcbus_formats::manifest::May;

use super::file::complain;
use super::{Exit, OwnFiles};

/// What follows a session.
pub(super) enum Ended {
    /// Nothing.
    With(Exit),
    /// Another one, in a fresh process: this one may not do what joining takes.
    Again,
}

/// Where one session takes place.
pub(super) struct Stand<'a> {
    pub instance: &'a Instance,
    /// How many sessions there were before.
    number: u32,
    /// What its manifest declares. `None`: it is not to be confined.
    may: Option<&'a May>,
    /// A broker has started it that it ends with.
    is_bound: bool,
}

impl Stand<'_> {
    /// How patient it is. After a session was lost, another broker is waited for; and one that has started this
    /// process and is there may not have got ready itself.
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

    /// Confines this process, which may then read what `reads` gives and what is its own. `None`: it is not to be confined.
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
        // Before: what comes in between is taken for something else, and a fresh process reads it.
        let sandbox = Sandbox::around(&sandboxed.reads);
        if let Err(error) = qcbus_confine::confine(&sandboxed) {
            tracing::warn!(%error, "this bundle is not wholly confined");
        }
        Some(sandbox)
    }
}

/// Files and directories that a confined process may read, as they were when it was confined.
pub(super) struct Sandbox(Vec<(PathBuf, Identity)>);

/// Device and inode.
type Identity = (u64, u64);

impl Sandbox {
    fn around(paths: &[PathBuf]) -> Sandbox {
        let known = |path: &PathBuf| Some((path.clone(), identity(path)?));
        Sandbox(paths.iter().filter_map(known).collect())
    }

    /// Whether something lies at the path now that only a fresh process may read. Looking is never forbidden.
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

/// How many sessions there may be, and who ends them.
pub(super) struct Sessions {
    /// There is no broker after this one.
    pub only_one: bool,
    /// A broker ends them, and not a person.
    pub supervised: bool,
    /// It is not to be confined.
    pub unfenced: bool,
}

/// Runs sessions: each in a process of its own where bundles are confined and there may be more than one, else all
/// of them in this one.
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
        // It cannot have another one here. A supervisor starts it anew.
        Ended::Again => Exit::NoBroker,
    };
    let Some(may) = &orders else {
        return once(None);
    };
    if sessions.only_one {
        return once(Some(may));
    }
    // The process that keeps them outlives the broker; only the first has not been heard yet.
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
