//! Checks whether only this user and root control the content of a path.
//!
//! A user who can replace a file controls its content. So every component of the path is checked
//! through descriptors. Links are read but never followed. Each component must belong to this user
//! or to root, and nobody else may write to it. The last descriptor is the one that is read, so
//! nothing can be replaced between check and use.

use std::collections::VecDeque;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, Read};
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::ffi::OsStringExt;
use std::path::{Component, Path, PathBuf};

use qcbus_messages::path_text::to_text;
use rustix::fs::{FileType, Mode, OFlags, Stat};
use rustix::io::Errno;

/// Maximum number of links on one path, the same as in the kernel.
const MAX_LINKS: usize = 40;
/// Owner that the kernel shows for unmapped users: `nobody`.
const OVERFLOW: u32 = 65_534;

/// Reason why the content of a path is not used.
#[derive(Debug, thiserror::Error)]
pub enum TrustError {
    /// Another user controls the content.
    #[error("{}", explain(asked, at, why))]
    Foreign {
        /// The requested path.
        asked: PathBuf,
        /// The path of the offending component, or the requested path itself.
        at: PathBuf,
        /// The problem with it.
        why: Foreign,
    },
    /// It cannot be opened or read.
    #[error("cannot use {}: {source}", to_text(path))]
    Io {
        /// The requested path.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

impl TrustError {
    /// Checks whether the path does not exist.
    pub fn is_absent(&self) -> bool {
        matches!(self, TrustError::Io { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }
}

/// How another user controls the content of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foreign {
    /// It belongs to this user, who is neither root nor the current user.
    Owner(u32),
    /// Everybody may write to it; the mode.
    World(u32),
    /// This group may write to it and is not a private group of this user; the mode.
    Group(u32, u32),
    /// It is not a regular file.
    Special,
}

fn explain(asked: &Path, at: &Path, why: &Foreign) -> String {
    let (us, place) = (rustix::process::geteuid().as_raw(), to_text(at));
    let end = match asked == at {
        true => "so others control its contents".to_owned(),
        false => format!("so others control {}", to_text(asked)),
    };
    match why {
        Foreign::Owner(OVERFLOW) => format!(
            "{place} belongs to user {OVERFLOW} (nobody), not to user {us} who runs this program, {end}: files \
             of users that this container does not know look like this, and so do files that root writes to NFS \
             with root_squash; run this as the owner, or use a directory on a local disk"
        ),
        Foreign::Owner(them) => format!(
            "{place} belongs to user {them}, not to user {us} who runs this program, {end}: run this as user \
             {them} (`docker run --user {them}`), or take ownership (`chown {us}`) after checking its contents"
        ),
        Foreign::World(mode) | Foreign::Group(mode, _) if mode & 0o1000 != 0 => format!(
            "others may write to {place} (mode {mode:04o}; its sticky bit only protects existing entries), \
             {end}: use a directory of your own below it ({}/NAME)",
            place.trim_end_matches('/')
        ),
        Foreign::World(mode) => format!(
            "everyone may write to {place} (mode {mode:04o}), {end}: remove that permission (`chmod o-w`), or \
             protect a directory's entries with the sticky bit (`chmod +t`) and use a directory of your own \
             below it"
        ),
        Foreign::Group(mode, group) => format!(
            "group {group} may write to {place} (mode {mode:04o}), {end}: remove that permission (`chmod g-w`), \
             or protect a directory's entries with the sticky bit (`chmod +t`); only the user's private group, \
             which has the same number, is trusted"
        ),
        Foreign::Special => format!("{place} is not a regular file, {end}"),
    }
}

/// Reads a file that only this user and root control.
///
/// # Errors
/// Returns [`TrustError`]; a file of more than `limit` bytes is [`io::ErrorKind::FileTooLarge`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, TrustError> {
    let found = walk(path, None)?;
    let file = found.open(path)?;
    let mut bytes = Vec::new();
    let read = file.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|source| failed(path, source))?;
    if bytes.len() as u64 > limit {
        return Err(failed(path, io::ErrorKind::FileTooLarge.into()));
    }
    Ok(bytes)
}

/// Checks whether only this user and root control a file, for example a program. It stays
/// unchanged, because no other user can replace it or any part of its path.
///
/// # Errors
/// Returns [`TrustError`].
pub fn look_at_file(path: &Path) -> Result<(), TrustError> {
    let found = walk(path, None)?;
    found.is_ours_alone(path, found.kind() == FileType::RegularFile)
}

/// Opens a directory that only this user and root control.
///
/// # Errors
/// Returns [`TrustError`].
pub fn directory(path: &Path) -> Result<OwnedFd, TrustError> {
    open_directory(path, &walk(path, None)?)
}

/// Works like [`directory`], and creates missing directories of the path.
///
/// # Errors
/// Returns [`TrustError`].
pub fn make_directory(path: &Path) -> Result<OwnedFd, TrustError> {
    let mode = Mode::from_raw_mode(0o755);
    open_directory(path, &walk(path, Some(mode))?)
}

/// Opens or creates a directory that only this user can read. The access of others to this user's
/// directory is removed. A directory of another user, including root, is refused unchanged.
///
/// # Errors
/// Returns [`TrustError`].
pub fn make_private_directory(path: &Path) -> Result<OwnedFd, TrustError> {
    let found = walk(path, Some(Mode::RWXU))?;
    let owner = found.stat.st_uid;
    if owner != rustix::process::geteuid().as_raw() {
        return Err(found.foreign(path, Foreign::Owner(owner)));
    }
    let opened = found.reopen(path, OFlags::DIRECTORY)?;
    let stat = rustix::fs::fstat(&opened).map_err(|error| failed(path, error.into()))?;
    if stat.st_mode & 0o077 != 0 {
        let closed = rustix::fs::fchmod(&opened, Mode::RWXU);
        closed.map_err(|error| failed(path, error.into()))?;
    }
    Ok(opened)
}

fn open_directory(path: &Path, found: &Found) -> Result<OwnedFd, TrustError> {
    if found.kind() != FileType::Directory {
        return Err(failed(path, Errno::NOTDIR.into()));
    }
    found.is_ours_alone(path, true)?;
    found.reopen(path, OFlags::DIRECTORY)
}

/// Target of a path. Only this user and root control everything before it.
struct Found {
    /// The directory that contains it, and its name there.
    parent: OwnedFd,
    name: OsString,
    /// Its path.
    at: PathBuf,
    stat: Stat,
}

impl Found {
    fn kind(&self) -> FileType {
        FileType::from_raw_mode(self.stat.st_mode)
    }

    fn foreign(&self, asked: &Path, why: Foreign) -> TrustError {
        foreign(asked, &self.at, why)
    }

    fn is_ours_alone(&self, asked: &Path, is_kind: bool) -> Result<(), TrustError> {
        if !is_kind {
            return Err(self.foreign(asked, Foreign::Special));
        }
        let writer = other_writer(&self.stat, || has_access_list(&self.parent, &self.name));
        writer.map_or(Ok(()), |why| Err(self.foreign(asked, why)))
    }

    /// Opens it for reading. It is unchanged, because no other user can replace it there.
    fn reopen(&self, asked: &Path, kind: OFlags) -> Result<OwnedFd, TrustError> {
        let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
        let flags = flags | OFlags::CLOEXEC | kind;
        rustix::fs::openat(&self.parent, &self.name, flags, Mode::empty())
            .map_err(|error| failed(asked, error.into()))
    }

    /// Opens a regular file that only this user and root control; checks the opened descriptor.
    fn open(mut self, asked: &Path) -> Result<File, TrustError> {
        // This check precedes opening, because opening a device can have effects.
        self.is_ours_alone(asked, self.kind() == FileType::RegularFile)?;
        let opened = self.reopen(asked, OFlags::empty())?;
        self.stat = rustix::fs::fstat(&opened).map_err(|error| failed(asked, error.into()))?;
        self.is_ours_alone(asked, self.kind() == FileType::RegularFile)?;
        Ok(File::from(opened))
    }
}

/// Walks a path from the root and returns its target. With `make`, missing directories are created.
fn walk(asked: &Path, make: Option<Mode>) -> Result<Found, TrustError> {
    let io = |error: Errno| failed(asked, error.into());
    let path = std::path::absolute(asked).map_err(|source| failed(asked, source))?;
    let mut ahead: VecDeque<OsString> = parts(&path);
    let mut parent = root(asked)?;
    let mut at = PathBuf::from("/");
    let mut links = 0;
    loop {
        // The root is its own parent.
        let name = ahead.pop_front().unwrap_or_else(|| OsString::from("."));
        let found = open_entry(&parent, &name, make).map_err(io)?;
        let stat = rustix::fs::fstat(&found).map_err(io)?;
        let place = at.join(&name);
        let place = match name.to_str() {
            Some(".") => at.clone(),
            Some("..") => at.parent().unwrap_or(&at).to_path_buf(),
            _ => place,
        };
        let is_link = FileType::from_raw_mode(stat.st_mode) == FileType::Symlink;
        let is_last = ahead.is_empty() && !is_link;
        is_of_a_friend(&stat, is_last).map_err(|why| foreign(asked, &place, why))?;
        if is_link {
            links += 1;
            if links > MAX_LINKS {
                return Err(io(Errno::LOOP));
            }
            let target = rustix::fs::readlinkat(&found, "", Vec::new()).map_err(io)?;
            let target = PathBuf::from(OsString::from_vec(target.into_bytes()));
            for part in parts(&target).into_iter().rev() {
                ahead.push_front(part);
            }
            if target.is_absolute() {
                (parent, at) = (root(asked)?, PathBuf::from("/"));
            }
            continue;
        }
        if is_last {
            let at = place;
            return Ok(Found {
                parent,
                name,
                at,
                stat,
            });
        }
        let is_sticky = stat.st_mode & 0o1000 != 0;
        let writer = other_writer(&stat, || has_access_list(&parent, &name));
        if let Some(why) = writer.filter(|_| !is_sticky) {
            return Err(foreign(asked, &place, why));
        }
        (parent, at) = (found, place);
    }
}

fn parts(path: &Path) -> VecDeque<OsString> {
    let part = |part: Component<'_>| match part {
        Component::Normal(name) => Some(name.to_owned()),
        Component::ParentDir => Some(OsString::from("..")),
        Component::RootDir | Component::CurDir | Component::Prefix(_) => None,
    };
    path.components().filter_map(part).collect()
}

fn root(asked: &Path) -> Result<OwnedFd, TrustError> {
    let flags = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    rustix::fs::open("/", flags, Mode::empty()).map_err(|error| failed(asked, error.into()))
}

fn open_entry(parent: &OwnedFd, name: &OsStr, make: Option<Mode>) -> Result<OwnedFd, Errno> {
    let flags = OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let open = || rustix::fs::openat(parent, name, flags, Mode::empty());
    match (open(), make) {
        (Err(Errno::NOENT), Some(mode)) => {
            match rustix::fs::mkdirat(parent, name, mode) {
                // If another process has created it first, the entry is checked like any other.
                Ok(()) | Err(Errno::EXIST) => open(),
                Err(error) => Err(error),
            }
        }
        (opened, _) => opened,
    }
}

/// Accepts root and this user as owners. On the way, the owner of the root directory is also
/// accepted. In a namespace without root, this user owns the system's directories.
fn is_of_a_friend(stat: &Stat, is_last: bool) -> Result<(), Foreign> {
    let owner = stat.st_uid;
    let system = || rustix::fs::stat("/").is_ok_and(|root| root.st_uid == owner);
    let known = owner == 0 || owner == rustix::process::geteuid().as_raw();
    match known || (!is_last && system()) {
        true => Ok(()),
        false => Err(Foreign::Owner(owner)),
    }
}

/// Returns who may write to it besides its owner, according to its mode.
fn other_writer(stat: &Stat, has_access_list: impl Fn() -> bool) -> Option<Foreign> {
    let mode = stat.st_mode & 0o7777;
    if mode & 0o002 != 0 {
        return Some(Foreign::World(mode));
    }
    if mode & 0o020 == 0 {
        return None;
    }
    // With umask 002 all files of a user are writable for the user's private group, which has no
    // other member. Group 0 belongs to root.
    let (us, group) = (rustix::process::geteuid().as_raw(), stat.st_gid);
    let is_private = group == 0 || (group == us && rustix::process::getegid().as_raw() == us);
    (!is_private || has_access_list()).then_some(Foreign::Group(mode, group))
}

/// Checks for an access list. With one, the group bits are the maximum rights of any entry on it.
fn has_access_list(parent: &OwnedFd, name: &OsStr) -> bool {
    let path = PathBuf::from(format!("/proc/self/fd/{}", parent.as_raw_fd())).join(name);
    let list = "system.posix_acl_access";
    rustix::fs::lgetxattr(path, list, &mut [0_u8; 0][..]).is_ok()
}

fn foreign(asked: &Path, at: &Path, why: Foreign) -> TrustError {
    TrustError::Foreign {
        asked: asked.to_path_buf(),
        at: at.to_path_buf(),
        why,
    }
}

fn failed(path: &Path, source: io::Error) -> TrustError {
    TrustError::Io {
        path: path.to_path_buf(),
        source,
    }
}

#[cfg(test)]
mod tests;
