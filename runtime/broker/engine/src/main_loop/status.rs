//! Status of the broker.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_messages::control::{Status, Unfinished, Unseen};
use qcbus_publish::gate::Gate;
use qcbus_watch::Why;

use super::Broker;

/// Maximum number of listed paths that could not be read or have not settled.
const UNSEEN_SHOWN: usize = 100;

impl Broker {
    pub(super) fn status(&self) -> Status {
        let mut status = self.state.status();
        for peer in &mut status.peers {
            peer.sandbox = self.children.sandbox_of(peer);
        }
        Status {
            instance: self.options.instance.name().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            uptime_s: self.started.elapsed().as_secs(),
            watching: self.options.roots.clone(),
            watch_mode: self.watch_mode.clone(),
            out: self.options.out.clone(),
            unseen: self.all_unseen(),
            unfinished: self.first_unfinished(),
            state: self.options.state.clone(),
            bundles_d: self.options.bundles_d.clone(),
            troubles: self.troubles(),
            replaced: self.looks.around.replaced.clone(),
            scratch: self.looks.around.scratch.clone(),
            gate: self.store.gate.as_ref().map(Gate::status),
            ..status
        }
    }

    /// Returns the failures that currently prevent the broker from working.
    fn troubles(&self) -> Vec<String> {
        let mut troubles: Vec<String> = self.writers.troubles().into_iter().collect();
        if self.is_nobody_watching() {
            troubles.push("changes are not watched".to_owned());
        }
        if let Some(text) = self.said_of_state() {
            troubles.push(text);
        }
        troubles.extend(self.state.hindrances());
        if let Some(why) = &self.not_in_force {
            troubles.push(format!(
                "the configuration on disk is not in force, because it has an error: {why}"
            ));
        }
        troubles
    }

    fn first_unfinished(&self) -> Vec<Unfinished> {
        let unfinished = |(path, why): (&Arc<Path>, &Why)| Unfinished {
            path: path.to_path_buf(),
            why: why.to_string(),
        };
        let all = self.unfinished.iter().map(unfinished);
        all.take(UNSEEN_SHOWN).collect()
    }

    fn all_unseen(&self) -> Vec<Unseen> {
        let unseen = |(path, why): (&PathBuf, &String)| Unseen {
            path: path.clone(),
            why: why.clone(),
        };
        // The status lists only the first paths to keep the answer short.
        self.unseen.iter().take(UNSEEN_SHOWN).map(unseen).collect()
    }
}
