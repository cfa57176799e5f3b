//! Conversion of command line arguments to settings of the broker.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use qcbus_bus::Instance;
use qcbus_configuration::OwnProgram;
use qcbus_formats::xqar::Dialect;
use qcbus_ingest::Limits;
use qcbus_messages::path_text::to_text;
use qcbus_sdk::Permits;
use qcbus_types::Settings;
use qcbus_watch::hidden_above;

use crate::args::{DialectArg, InstanceArgs, LimitArgs};

/// Returns the instance that the arguments name.
pub fn instance(args: &InstanceArgs) -> Result<Instance, String> {
    match &args.instance_dir {
        Some(dir) => Ok(Instance::at(absolute(dir))),
        None => Instance::named(&args.instance).map_err(|error| error.to_string()),
    }
}

/// Returns the absolute path, as far as possible without disk access.
pub fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

/// Resolves a path. Links are followed as far as the path exists.
pub fn real(path: &Path) -> PathBuf {
    let mut real = PathBuf::new();
    for part in absolute(path).components() {
        if part == Component::ParentDir {
            real.pop();
            continue;
        }
        real.push(part);
        if let Ok(there) = std::fs::canonicalize(&real) {
            real = there;
        }
    }
    real
}

/// Returns the path under which a broker knows a file, even before the file exists. Links to
/// directories are followed; a file that is a link itself keeps its own name.
pub fn named(file: &Path) -> PathBuf {
    let file = absolute(file);
    let (Some(above), Some(name)) = (file.parent(), file.file_name()) else {
        return real(&file);
    };
    real(above).join(name)
}

/// Checks whether a scan of the roots reaches a directory. A scan skips hidden directories.
pub fn looks_into(roots: &[PathBuf], directory: &Path) -> bool {
    let is_inside = roots.iter().any(|root| directory.starts_with(root));
    is_inside && hidden_above(roots, directory).is_none()
}

/// Removes directories that a scan of the others reaches anyway.
pub fn outermost(named: BTreeSet<PathBuf>) -> Vec<PathBuf> {
    let mut roots: Vec<PathBuf> = Vec::new();
    // A directory comes after those that contain it.
    for directory in named {
        if !looks_into(&roots, &directory) {
            roots.push(directory);
        }
    }
    roots
}

/// Returns a directory of manifests that must exist. A misspelt one contains no bundles, and their
/// findings would be missing without any message.
pub fn manifest_directory(named: &Path) -> Result<PathBuf, String> {
    let path = absolute(named);
    match std::fs::read_dir(&path) {
        Ok(_) => Ok(path),
        Err(error) => Err(format!(
            "cannot take bundles from --bundles-d {}: {error}",
            to_text(&path)
        )),
    }
}

/// Returns the dialect of results.
pub fn dialect(arg: DialectArg) -> Dialect {
    match arg {
        DialectArg::Current => Dialect::Current,
        DialectArg::Qc4openx => Dialect::Qc4Openx,
    }
}

const MIB: u64 = 1 << 20;

/// Returns the limits on input files.
pub fn limits(args: &LimitArgs) -> Limits {
    let mut limits = Limits::default();
    if let Some(mib) = args.max_file {
        limits.max_file = mib.saturating_mul(MIB);
    }
    if let Some(mib) = args.max_unpacked {
        limits.max_unpacked = mib.saturating_mul(MIB);
    }
    limits.max_ratio = args.max_ratio.unwrap_or(limits.max_ratio);
    limits.max_members = args.max_members.unwrap_or(limits.max_members);
    limits.max_depth = args.max_depth.unwrap_or(limits.max_depth);
    limits
}

/// Returns the maximum private memory of a child in bytes.
pub fn memory_limit(args: &LimitArgs) -> Option<u64> {
    args.memory_limit.map(|mib| mib.saturating_mul(MIB))
}

/// Returns the settings of the state machine.
pub fn settings(args: &LimitArgs) -> Settings {
    let mut settings = Settings::default();
    settings.job_deadline = args.job_deadline.unwrap_or(settings.job_deadline);
    settings.silence_limit = args.silence_limit.unwrap_or(settings.silence_limit);
    settings.absence_limit = args.absence_limit.unwrap_or(settings.absence_limit);
    settings.room_limit = args.room_limit.unwrap_or(settings.room_limit);
    settings.max_restarts = args.max_restarts.unwrap_or(settings.max_restarts);
    // The broker does a third of the work on a file. Its reading and its active jobs keep many
    // processors busy. The upper bounds come from memory and from the number of documents on the
    // bus.
    let cores = args.threads.unwrap_or_else(Permits::available);
    settings.max_preparing = cores.clamp(settings.max_preparing, 8);
    settings.max_active = (2 * cores + 8).clamp(settings.max_active, 40);
    settings
}

/// Returns the path of this program, to start children from it.
pub fn program() -> &'static Path {
    OwnProgram::this().path()
}
