//! What both rings have in common.

use std::os::fd::OwnedFd;
use std::path::Path;

use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, PathBeneath, PathFd,
    Ruleset, RulesetAttr, RulesetCreated, RulesetCreatedAttr, Scope,
};

use crate::SandboxError;

/// The newest that is known here; a kernel that has less gives what it has.
const LEVEL: ABI = ABI::V7;

/// To read files below a path, not directories.
pub(crate) fn files() -> BitFlags<AccessFs> {
    AccessFs::ReadFile.into()
}

/// To see what lies below a path, not to read it.
pub(crate) fn listings() -> BitFlags<AccessFs> {
    AccessFs::ReadDir.into()
}

/// To read files and directories below a path.
pub(crate) fn trees() -> BitFlags<AccessFs> {
    AccessFs::ReadFile | AccessFs::ReadDir
}

/// To do anything with what lies below a path.
pub(crate) fn everything() -> BitFlags<AccessFs> {
    AccessFs::from_all(LEVEL)
}

/// To read and run whatever there is.
pub(crate) fn reading() -> BitFlags<AccessFs> {
    AccessFs::from_read(LEVEL)
}

/// Rules under which nothing is allowed that is not added to them.
pub(crate) struct Rules(RulesetCreated);

impl Rules {
    pub(crate) fn new(network: bool) -> Result<Rules, SandboxError> {
        let refused = |why| SandboxError::kernel("Landlock", why);
        let rules = Ruleset::default()
            .set_compatibility(CompatLevel::BestEffort)
            .handle_access(AccessFs::from_all(LEVEL))
            .and_then(|rules| rules.scope(Scope::from_all(LEVEL)))
            .and_then(|rules| match network {
                true => Ok(rules),
                false => rules.handle_access(AccessNet::from_all(LEVEL)),
            })
            .and_then(Ruleset::create)
            .map_err(|error| refused(error.to_string()))?;
        Ok(Rules(rules))
    }

    /// Allows this below a path. What is not there needs no rule.
    pub(crate) fn allow(
        self,
        path: impl AsRef<Path>,
        access: BitFlags<AccessFs>,
    ) -> Result<Rules, SandboxError> {
        let Ok(there) = PathFd::new(path.as_ref()) else {
            return Ok(self);
        };
        // Rights to a directory mean nothing for a file, and the kernel says so.
        let access = match path.as_ref().is_dir() {
            true => access,
            false => access & AccessFs::from_file(LEVEL),
        };
        let rules = self.0.add_rule(PathBeneath::new(there, access));
        let rules = rules.map_err(|error| SandboxError::kernel("Landlock", error))?;
        Ok(Rules(rules))
    }

    /// The rules as the kernel holds them; `None` where it has no Landlock.
    pub(crate) fn into_descriptor(self) -> Option<OwnedFd> {
        self.0.into()
    }

    /// Puts the calling thread, and what it starts from now on, under them. `false`: the kernel has no Landlock.
    pub(crate) fn enforce(self) -> Result<bool, SandboxError> {
        let status = self.0.restrict_self();
        let status = status.map_err(|error| SandboxError::kernel("Landlock", error))?;
        Ok(status.ruleset != landlock::RulesetStatus::NotEnforced)
    }
}
