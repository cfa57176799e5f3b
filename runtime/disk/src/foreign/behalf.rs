//! Access checks on behalf of file owners. This process reads referenced files with its own rights,
//! and their content becomes visible to everybody who reads results.

use std::cell::Cell;
use std::fs::Metadata;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use nix::unistd::{Gid, Uid, User, getgrouplist};

/// A user on behalf of whom files are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Reader {
    user: u32,
    /// Group of the user's file. The user need not be in it: files of the group are shared
    /// together.
    group: u32,
}

thread_local! {
    static READER: Cell<Option<Reader>> = const { Cell::new(None) };
}

/// While this exists, the thread reads on behalf of another user.
#[must_use]
#[derive(Debug)]
pub struct Behalf(Option<Reader>);

impl Drop for Behalf {
    fn drop(&mut self) {
        READER.set(self.0);
    }
}

/// Restricts this thread to opening and listing what the owner of this file may read. For a
/// symbolic link, the owner of the link counts. Files of this user or of root are not restricted.
pub fn on_behalf_of(path: &Path) -> Behalf {
    let before = READER.get();
    let data = std::fs::symlink_metadata(path).ok();
    let trusted = |user| user == 0 || user == rustix::process::geteuid().as_raw();
    let reader = data.filter(|it| !trusted(it.uid())).map(|it| Reader {
        user: it.uid(),
        group: it.gid(),
    });
    READER.set(reader);
    Behalf(before)
}

/// Returns the user on behalf of whom this thread reads, if any.
pub fn reader() -> Option<Reader> {
    READER.get()
}

/// # Errors
/// Returns [`io::ErrorKind::PermissionDenied`] with the reason.
pub(super) fn may_read(data: &Metadata) -> io::Result<()> {
    match READER.get() {
        Some(reader) if !reader.may_read(data) => {
            let why = format!(
                "it may not be read by user {}, who owns the file that refers to it",
                reader.user
            );
            Err(io::Error::new(io::ErrorKind::PermissionDenied, why))
        }
        _ => Ok(()),
    }
}

impl Reader {
    fn may_read(self, data: &Metadata) -> bool {
        let allows = |bits: u32| data.mode() & bits != 0;
        data.uid() == self.user
            || allows(0o004)
            || (allows(0o040) && (data.gid() == self.group || self.is_in(data.gid())))
    }

    fn is_in(self, group: u32) -> bool {
        let user = User::from_uid(Uid::from_raw(self.user)).ok().flatten();
        let Some(user) = user else { return false };
        let name = std::ffi::CString::new(user.name).ok();
        let groups = name.and_then(|name| getgrouplist(&name, user.gid).ok());
        groups.is_some_and(|all| all.contains(&Gid::from_raw(group)))
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{PermissionsExt, lchown};

    use super::super::{list, open, read};
    use super::*;

    const STRANGER: u32 = 65_534;

    fn is_denied<T>(result: io::Result<T>) -> bool {
        result.is_err_and(|it| it.kind() == io::ErrorKind::PermissionDenied)
    }

    #[test]
    fn link_is_followed_with_the_rights_of_its_owner() {
        if !rustix::process::geteuid().is_root() {
            eprintln!("skipped: only root can give files away");
            return;
        }
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for (name, mode) in [("open", 0o644), ("private", 0o600), ("shared", 0o640)] {
            std::fs::write(at(name), name).unwrap();
            std::fs::set_permissions(at(name), PermissionsExt::from_mode(mode)).unwrap();
        }
        std::fs::create_dir(at("closed")).unwrap();
        std::fs::set_permissions(at("closed"), PermissionsExt::from_mode(0o700)).unwrap();
        std::os::unix::fs::symlink(at("private"), at("link")).unwrap();

        let own = on_behalf_of(&at("link"));
        assert!(read(&at("link"), 100).is_ok(), "root's own link");
        drop(own);
        lchown(at("link"), Some(STRANGER), Some(STRANGER)).unwrap();
        let behalf = on_behalf_of(&at("link"));
        assert!(is_denied(open(&at("link")).map_err(io::Error::from)));
        assert!(is_denied(read(&at("private"), 100)));
        assert!(is_denied(read(&at("shared"), 100)));
        assert!(is_denied(list(&at("closed"))));
        assert!(read(&at("open"), 100).is_ok());
        lchown(at("shared"), None, Some(STRANGER)).unwrap();
        assert!(
            read(&at("shared"), 100).is_ok(),
            "a file of the user's group"
        );
        lchown(at("private"), Some(STRANGER), None).unwrap();
        assert!(read(&at("private"), 100).is_ok(), "his own");
        lchown(at("private"), Some(0), None).unwrap();
        drop(behalf);
        assert!(
            read(&at("private"), 100).is_ok(),
            "not on behalf of another user"
        );
    }
}
