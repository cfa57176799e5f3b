//! Private instances: removes their remains after their process was killed.

use std::path::Path;

use crate::generation::{sweep, sweep_strays};
use crate::instance::{Instance, InstanceLock};

/// Prefix of private instances (of `qcbus check`). Each belongs to a single process.
pub const PRIVATE_PREFIX: &str = "check-";

/// Age below which a private instance of a living process may not have taken its lock yet.
const YOUNG: std::time::Duration = std::time::Duration::from_secs(10);

/// Removes the directories and the shared memory of dead private instances. It also removes the
/// shared memory of any dead broker with a removed directory. Returns the number of removed
/// instances. Instances with a living broker stay.
pub fn sweep_private_instances() -> usize {
    sweep_known() + sweep_strays()
}

fn sweep_known() -> usize {
    let Ok(probe) = Instance::base_dir() else {
        return 0;
    };
    let Ok(entries) = std::fs::read_dir(&probe) else {
        return 0;
    };
    let mut swept = 0;
    for entry in entries.flatten() {
        let is_private = entry
            .file_name()
            .to_string_lossy()
            .starts_with(PRIVATE_PREFIX);
        let path = entry.path();
        if is_private && (maker_is_dead(&path) || !is_young(&path)) {
            swept += usize::from(sweep_one(&path));
        }
    }
    swept
}

/// Checks whether the process that created it has ended. Its id is in the name.
fn maker_is_dead(directory: &Path) -> bool {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    let rest = name.strip_prefix(PRIVATE_PREFIX);
    let pid = rest.and_then(|rest| rest.split_once('-')?.0.parse::<u32>().ok());
    pid.is_some_and(|pid| !Path::new("/proc").join(pid.to_string()).exists())
}

fn is_young(directory: &Path) -> bool {
    let made = std::fs::metadata(directory).and_then(|data| data.modified());
    made.is_ok_and(|made| made.elapsed().unwrap_or_default() < YOUNG)
}

fn sweep_one(directory: &Path) -> bool {
    let instance = Instance::at(directory.to_path_buf());
    // A holder of the lock is alive.
    let Ok(lock) = InstanceLock::take(&instance) else {
        return false;
    };
    sweep(&instance, None);
    drop(lock);
    std::fs::remove_dir_all(directory).is_ok()
}
