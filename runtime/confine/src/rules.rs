//! Rules shared by both sandboxes.

use std::os::fd::OwnedFd;
use std::path::Path;

use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, PathBeneath, PathFd,
    Ruleset, RulesetAttr, RulesetCreated, RulesetCreatedAttr, Scope,
};

use crate::SandboxError;

/// Newest supported version of Landlock. Older kernels apply the rules that they know.
const LEVEL: ABI = ABI::V7;

/// Returns the right to read files below a path, but not directories.
pub(crate) fn files() -> BitFlags<AccessFs> {
    AccessFs::ReadFile.into()
}

/// Returns the right to list directories below a path, but not to read files.
pub(crate) fn listings() -> BitFlags<AccessFs> {
    AccessFs::ReadDir.into()
}

/// Returns the right to read files and directories below a path.
pub(crate) fn trees() -> BitFlags<AccessFs> {
    AccessFs::ReadFile | AccessFs::ReadDir
}

/// Returns all rights below a path.
pub(crate) fn everything() -> BitFlags<AccessFs> {
    AccessFs::from_all(LEVEL)
}

/// Returns the right to read and execute everything.
pub(crate) fn reading() -> BitFlags<AccessFs> {
    AccessFs::from_read(LEVEL)
}

/// Rules that forbid everything not explicitly added.
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

    /// Allows this access below a path. A missing path needs no rule.
    pub(crate) fn allow(
        self,
        path: impl AsRef<Path>,
        access: BitFlags<AccessFs>,
    ) -> Result<Rules, SandboxError> {
        let Ok(there) = PathFd::new(path.as_ref()) else {
            return Ok(self);
        };
        // Directory rights are invalid for a file, and the kernel returns an error.
        let access = match path.as_ref().is_dir() {
            true => access,
            false => access & AccessFs::from_file(LEVEL),
        };
        let rules = self.0.add_rule(PathBeneath::new(there, access));
        let rules = rules.map_err(|error| SandboxError::kernel("Landlock", error))?;
        Ok(Rules(rules))
    }

    /// Returns the rules as a kernel descriptor, or `None` if the kernel has no Landlock.
    pub(crate) fn into_descriptor(self) -> Option<OwnedFd> {
        self.0.into()
    }

    /// Applies the rules to the calling thread and its later children. Returns `false` if the
    /// kernel has no Landlock.
    pub(crate) fn enforce(self) -> Result<bool, SandboxError> {
        let status = self.0.restrict_self();
        let status = status.map_err(|error| SandboxError::kernel("Landlock", error))?;
        Ok(status.ruleset != landlock::RulesetStatus::NotEnforced)
    }
}
