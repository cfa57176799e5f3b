//! A summary of the state machine for the simulation of the whole broker.

use super::super::*;
use crate::simulation::Summary;

impl State {
    pub(crate) fn summary(&self) -> Summary {
        let unpublished = self.files.iter().filter(|(_, it)| it.unpublished);
        let members = self.bundles.iter().filter(|(_, it)| it.origin.is_some());
        Summary {
            demanded: members.map(|(name, _)| name.clone()).collect(),
            quiet: self.files.is_quiet() && self.jobs.is_empty() && self.scanned,
            unpublished: unpublished.map(|(_, it)| it.path.clone()).collect(),
        }
    }
}
