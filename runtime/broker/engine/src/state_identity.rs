//! Identity of a state directory, to detect that it was copied or moved.
//!
//! A state directory may be copied for a backup or a staging farm. Its journal then names the results of the original
//! farm. This broker leaves them alone and tells the user why it judges everything again.

use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use qcbus_disk::{foreign, write_whole};
use qcbus_messages::path_text::{from_text, to_text};
use serde::{Deserialize, Serialize};

use crate::options::Options;

/// Name of the file in the state directory. It has no suffix, so that a search for reports below
/// the directory of results does not find it.
const FILE: &str = "belongs-to";

/// Maximum size of that file in bytes: two paths and a number.
const MOST: u64 = 64 << 10;

/// Identity of a state directory.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Identity {
    /// Absolute path of the state directory.
    state: String,
    /// Inode number of the state directory. The device number is not used, because it changes with
    /// every mount of overlay, NFS and btrfs.
    inode: u64,
    /// Absolute path of the directory of results.
    out: String,
}

/// Returns a message for the user if the state directory was copied or moved, or if results now go
/// elsewhere. Returns `None` without a state directory or without a change.
pub fn difference_of(options: &Options) -> Option<String> {
    let state = options.state.as_deref()?;
    identify(state, &options.out, options.durable).unwrap_or_else(|error| {
        let state = to_text(state);
        Some(format!("cannot tell whether {state} was copied: {error}"))
    })
}

/// Compares a state directory with its identity at the last use by a broker, and writes the current
/// identity.
///
/// # Errors
/// When the directory cannot be accessed or written to.
fn identify(state: &Path, out: &Path, durable: bool) -> io::Result<Option<String>> {
    let data = std::fs::metadata(state)?;
    let now = Identity {
        state: to_text(state),
        inode: data.ino(),
        out: to_text(out),
    };
    let file = state.join(FILE);
    let before = foreign::read(&file, MOST).ok();
    let before: Option<Identity> = before.and_then(|text| serde_json::from_slice(&text).ok());
    if before.as_ref() == Some(&now) {
        return Ok(None);
    }
    let mut text = serde_json::to_vec_pretty(&now).map_err(io::Error::other)?;
    text.push(b'\n');
    write_whole(&file, &text, durable)?;
    Ok(before.and_then(|before| difference(&before, &now)))
}

fn difference(before: &Identity, now: &Identity) -> Option<String> {
    let (is, was) = (&now.state, &before.state);
    let same_directory = before.inode == now.inode;
    if !same_directory && was != is && from_text(was).exists() {
        return Some(format!(
            "the state directory {is} is a copy of {was}: results outside of {} that it lists belong to the \
             original and are left alone; files without results here are judged again",
            now.out
        ));
    }
    if was != is {
        return Some(format!(
            "the state directory {is} was moved or copied from {was}: results outside of {} that it lists are \
             left alone; files without results here are judged again",
            now.out
        ));
    }
    if !same_directory {
        return Some(format!(
            "the state directory {is} was replaced, for instance by a backup: files whose results in {} do not \
             agree with it are judged again",
            now.out
        ));
    }
    (before.out != now.out).then(|| {
        format!(
            "results are now written to {} instead of {}: the earlier results are left alone",
            now.out, before.out
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(state: &Path, out: &str) -> Option<String> {
        identify(state, Path::new(out), false).unwrap()
    }

    #[test]
    fn unchanged_state_gives_no_notice() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(said(dir.path(), "/out"), None, "the state is new");
        assert_eq!(said(dir.path(), "/out"), None);
    }

    #[test]
    fn copied_state_names_the_original() {
        let dir = tempfile::tempdir().unwrap();
        let (live, copy) = (dir.path().join("live"), dir.path().join("copy"));
        std::fs::create_dir(&live).unwrap();
        std::fs::create_dir(&copy).unwrap();
        said(&live, "/live/out");
        std::fs::copy(live.join(FILE), copy.join(FILE)).unwrap();
        let told = said(&copy, "/copy/out").unwrap();
        assert!(
            told.contains(&format!("a copy of {}", live.display())),
            "{told}"
        );
        assert_eq!(said(&copy, "/copy/out"), None, "reported once");
        assert_eq!(said(&live, "/live/out"), None, "the original is unchanged");
    }

    #[test]
    fn state_on_remounted_file_system_gives_no_notice() {
        let dir = tempfile::tempdir().unwrap();
        said(dir.path(), "/out");
        let file = dir.path().join(FILE);
        let mut written: serde_json::Value =
            serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        written["device"] = 1_u64.into(); // The previous version wrote it like this, under another mount.
        std::fs::write(&file, written.to_string()).unwrap();
        assert_eq!(said(dir.path(), "/out"), None);
    }

    #[test]
    fn state_restored_from_backup_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        let state = dir.path().join("state");
        std::fs::create_dir(&state).unwrap();
        said(&state, "/out");
        let backup = dir.path().join("backup");
        std::fs::create_dir(&backup).unwrap();
        std::fs::copy(state.join(FILE), backup.join(FILE)).unwrap();
        std::fs::remove_dir_all(&state).unwrap();
        std::fs::rename(&backup, &state).unwrap();
        let told = said(&state, "/out").unwrap();
        assert!(told.contains("was replaced"), "{told}");
    }

    #[test]
    fn moved_state_names_its_former_place() {
        let dir = tempfile::tempdir().unwrap();
        let (before, after) = (dir.path().join("before"), dir.path().join("after"));
        std::fs::create_dir(&before).unwrap();
        said(&before, "/out");
        std::fs::rename(&before, &after).unwrap();
        let told = said(&after, "/out").unwrap();
        assert!(told.contains("was moved or copied from"), "{told}");
    }

    #[test]
    fn changed_results_directory_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        said(dir.path(), "/one");
        let told = said(dir.path(), "/two").unwrap();
        assert!(told.contains("/one") && told.contains("/two"), "{told}");
    }

    #[test]
    fn broken_identity_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(FILE), "{").unwrap();
        assert_eq!(said(dir.path(), "/out"), None);
        assert_eq!(said(dir.path(), "/out"), None);
    }
}
